"""Rows of the error map (see ``cooperative.error_map``) of one vehicle after another."""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from groundstation.base.angles import FloatArray

Other = tuple[FloatArray, FloatArray]


def unit_rows(sizes: Sequence[int], window_s: float) -> list[FloatArray]:
    """Rows of the unit map, a block (m, N) for each vehicle; N is 0 where no window is judged."""
    if window_s <= 0.0:
        return [np.zeros((size, 0)) for size in sizes]
    edges = np.concatenate([[0], np.cumsum(sizes)]).astype(int)
    unit = np.eye(int(edges[-1]))
    return [unit[one:two] for one, two in pairwise(edges)]


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
