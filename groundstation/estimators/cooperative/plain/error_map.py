"""How errors of all vehicles act on one another: the linear map of a stretch of time, and its spectral radius.

A decentralised filter that takes its neighbours' estimates mixes their errors into its own: e_i becomes
(I - K h_i) e_i - K h_j e_j. The product of these maps over a stretch tells whether errors feed themselves: a spectral
radius above 1 means that some pattern of errors grows, whatever the noise. Errors here are truth - estimate.
"""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from groundstation.base.angles import FloatArray

Other = tuple[FloatArray, FloatArray]


def unit_rows(sizes: Sequence[int]) -> list[FloatArray]:
    """Rows of the unit map, a block (m, N) for each vehicle."""
    edges = np.concatenate([[0], np.cumsum(sizes)]).astype(int)
    unit = np.eye(int(edges[-1]))
    return [unit[one:two] for one, two in pairwise(edges)]


def spectral_radius(rows: Sequence[FloatArray]) -> float:
    """Largest absolute eigenvalue of the map.

    Examples
    --------
    >>> spectral_radius([np.array([[1.0, 0.5]]), np.array([[0.5, 1.0]])])
    1.5
    """
    return float(np.abs(np.linalg.eigvals(np.concatenate(rows))).max())


def corrected_rows(rows: FloatArray, gain: FloatArray, H: FloatArray, others: Sequence[Other | None]) -> FloatArray:
    """Rows of a vehicle after an update.

    Parameters
    ----------
    rows : ndarray, shape (m, N)
    gain : ndarray, shape (m, r)
    H : ndarray, shape (r, m)
    others : sequence of (ndarray (s,), ndarray (s, N)) or None
        For each measurement the derivative by its source's state and the source's rows; None for exact sources.
    """
    mixed = H @ rows
    for number, other in enumerate(others):
        if other is not None:
            mixed[number] += other[0] @ other[1]
    return np.asarray(rows - gain @ mixed)
