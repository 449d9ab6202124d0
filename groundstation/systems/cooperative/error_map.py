"""Linear map of the errors of all vehicles over a stretch of time; its spectral radius.

It tells how errors act on one another. A decentralised filter that takes its neighbours' estimates mixes their errors
into its own: e_i becomes (I - K h_i) e_i - K h_j e_j. The product of these maps over a stretch tells whether errors
feed themselves: a spectral radius above 1 means that some pattern of errors grows, whatever the noise. Errors here are
truth - estimate.
"""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.systems.cooperative.loop_types import Fleet, Items


def unit_rows(fleet: Fleet, window_s: float) -> FloatArray:
    """Return the rows of the unit map, shape (k, n, N).

    There is a block for each vehicle, filled up to the longest state; N 0: no map.
    """
    k, n = fleet.density.shape
    if window_s <= 0.0:
        return np.zeros((k, n, 0))
    edges = np.concatenate([[0], np.cumsum(fleet.size)])
    rows = np.zeros((k, n, int(edges[-1])))
    for who, (one, two) in enumerate(pairwise(edges.tolist())):
        rows[who, : two - one, one:two] = np.eye(two - one)
    return rows


def windows(items: Items, window_s: float) -> list[tuple[int, int]]:
    """Split items into windows of ``window_s``: (first, behind the last) of each.

    A window begins where the one before has lasted so long.
    """
    if window_s <= 0.0:
        return [(0, len(items.time_s))]
    begins, end_s = [], -np.inf
    for at, at_s in enumerate(items.time_s.tolist()):
        if at_s >= end_s:
            begins.append(at)
            end_s = at_s + window_s
    return list(pairwise([*begins, len(items.time_s)]))


def blocks(rows: FloatArray, fleet: Fleet) -> list[FloatArray]:
    """Rows of every vehicle without what fills them up."""
    return [part[:size] for part, size in zip(rows, fleet.size.tolist(), strict=True)]


def spectral_radius(rows: Sequence[FloatArray]) -> float:
    """Largest absolute eigenvalue of the map; infinite where it has overflowed.

    Examples
    --------
    >>> spectral_radius([np.array([[1.0, 0.5]]), np.array([[0.5, 1.0]])])
    1.5
    """
    whole = np.concatenate(rows)
    if not np.isfinite(whole).all():
        return float("inf")
    return float(np.abs(np.linalg.eigvals(whole)).max())
