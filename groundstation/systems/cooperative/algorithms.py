"""Algorithms by name: compiled loops where these know the vehicles, else plain numpy."""

import numpy as np

from groundstation.systems.cooperative import plain
from groundstation.systems.cooperative.centralised import run_centralised
from groundstation.systems.cooperative.decentralised import run_decentralised
from groundstation.systems.cooperative.events import Prepared
from groundstation.systems.cooperative.pairwise import run_pairwise
from groundstation.systems.cooperative.settings import ALGORITHMS, CooperativeSettings
from groundstation.systems.cooperative.smoother.smoothed import run_smoothed
from groundstation.systems.cooperative.tracks import AlgorithmRun

WORTH_COMPILING = 50_000  # measurements; plain filters take some ten seconds for so many


@np.errstate(over="ignore", invalid="ignore")  # a filter that diverges to infinity says so by its NaN
def run_algorithm(
    prepared: Prepared,
    settings: CooperativeSettings,
    algorithm: str,
    *,
    innovates: bool = True,
    is_repeated: bool = False,
) -> AlgorithmRun:
    """Run one algorithm by its name.

    The compiled loops know aircraft, and compiling them takes a minute and a half once: a long session and one of many
    (``is_repeated``) run in them. A short one, and one with a vehicle on wheels, runs in ``plain``, which knows cameras
    and bearings too, and tells who is seen where it stands. Both give the same to rounding (a test).

    Parameters
    ----------
    prepared : Prepared
    settings : CooperativeSettings
    algorithm : str
    innovates : bool
        False (the centralised filter and the smoother alone): measurements shrink the covariance and leave the state
        where it is.
    is_repeated : bool
        Whether this is one run of many.

    Raises
    ------
    KeyError
        When there is no such algorithm.
    """
    if algorithm not in ALGORITHMS:
        raise KeyError(algorithm)
    is_compiled = prepared.is_of_aircraft and (is_repeated or len(prepared.events.time_s) >= WORTH_COMPILING)
    if algorithm in ("dead_reckoning", "centralised"):
        run = run_centralised if is_compiled else plain.run_centralised
        return run(prepared, settings, uses_measurements=algorithm == "centralised", innovates=innovates)
    if algorithm == "smoothed":
        return run_smoothed(prepared, settings, innovates=innovates)
    if algorithm == "pairwise":
        return (run_pairwise if is_compiled else plain.run_pairwise)(prepared, settings)
    return (run_decentralised if is_compiled else plain.run_decentralised)(prepared, settings, algorithm)
