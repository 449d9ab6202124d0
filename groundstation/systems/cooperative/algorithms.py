"""Algorithms by name."""

import numpy as np

from groundstation.systems.cooperative.events import Prepared
from groundstation.systems.cooperative.filters.centralised import run_centralised
from groundstation.systems.cooperative.filters.decentralised import run_decentralised
from groundstation.systems.cooperative.filters.pairwise import run_pairwise
from groundstation.systems.cooperative.settings import ALGORITHMS, CooperativeSettings
from groundstation.systems.cooperative.tracks import AlgorithmRun


@np.errstate(over="ignore", invalid="ignore")  # a filter that diverges to infinity says so by its NaN
def run_algorithm(
    prepared: Prepared, settings: CooperativeSettings, algorithm: str, *, innovates: bool = True
) -> AlgorithmRun:
    """Run one algorithm by its name.

    Parameters
    ----------
    prepared : Prepared
    settings : CooperativeSettings
    algorithm : str
    innovates : bool
        False (the centralised filter alone): measurements shrink the covariance and leave the state where it is.

    Raises
    ------
    KeyError
        When there is no such algorithm.
    """
    if algorithm not in ALGORITHMS:
        raise KeyError(algorithm)
    if algorithm in ("dead_reckoning", "centralised"):
        return run_centralised(prepared, settings, uses_measurements=algorithm == "centralised", innovates=innovates)
    if algorithm == "pairwise":
        return run_pairwise(prepared, settings)
    return run_decentralised(prepared, settings, algorithm)
