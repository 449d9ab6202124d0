"""Flights whose figures are far from those of the same aircraft."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from groundstation.base.dataclasses import dataclass
from groundstation.methods.fleet.robust import VALUES_PER_FREEDOM_MAD, limit_in_sigmas, sigma_of_spread

FloatArray = NDArray[np.float64]
FEWEST = 8
FALSE_OUTLIERS = 0.05


@dataclass(frozen=True)
class Outlier:
    """Value number ``index`` of a group, ``z`` robust sigmas from its median ``typical``."""

    group: str
    index: int
    typical: float
    z: float


def find_outliers(groups: Mapping[str, FloatArray], *, chance: float = FALSE_OUTLIERS) -> tuple[Outlier, ...]:
    """Find values far from the median of their group.

    z = (value - median) / (1.4826 median |value - median|). The limit is Student's quantile at ``chance`` over the
    number of all values of all groups (Bonferroni): in a whole fleet without an outlier anything is named with that
    chance, if values within a group are normal. Groups of fewer than eight values, and those whose values mostly agree
    to the last digit, are left alone.

    Parameters
    ----------
    groups : mapping of name to ndarray
        Values that are not finite are left out; indices count them.
    chance : float

    Returns
    -------
    tuple of Outlier
        In the order of the groups, then of the values.

    Examples
    --------
    >>> values = np.array([1.0, 1.1, 0.9, 1.2, 0.8, 1.05, 0.95, 9.0])
    >>> [(found.group, found.index) for found in find_outliers({"A12": values})]
    [('A12', 7)]
    """
    known = {name: np.flatnonzero(np.isfinite(values)) for name, values in groups.items()}
    known = {name: places for name, places in known.items() if len(places) >= FEWEST}
    tested = sum(map(len, known.values()))
    found: list[Outlier] = []
    for name, places in known.items():
        values = groups[name][places]
        typical, sigma = float(np.median(values)), sigma_of_spread(values)
        if not sigma > 0.0:
            continue
        z = (values - typical) / sigma
        limit = limit_in_sigmas(len(values), chance / tested, VALUES_PER_FREEDOM_MAD)
        found += [Outlier(name, int(places[at]), typical, float(z[at])) for at in np.flatnonzero(np.abs(z) > limit)]
    return tuple(found)
