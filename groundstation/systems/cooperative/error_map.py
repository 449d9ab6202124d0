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


def unit_rows(sizes: Sequence[int], window_s: float) -> list[FloatArray]:
    """Rows of the unit map, a block (m, N) for each vehicle; N is 0 where no window is judged."""
    if window_s <= 0.0:
        return [np.zeros((size, 0)) for size in sizes]
    edges = np.concatenate([[0], np.cumsum(sizes)]).astype(int)
    unit = np.eye(int(edges[-1]))
    return [unit[one:two] for one, two in pairwise(edges)]


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
