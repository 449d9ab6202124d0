"""Transitions between epochs: sparse in one pattern, blocks side by side, or dense.

Dense ones are for a handful of states.
"""

from typing import Self

import numpy as np
from numpy.typing import ArrayLike

from groundstation.base.dataclasses import dataclass
from groundstation.base.records import Int64Array, frozen
from groundstation.methods.kalman.arrays import Dynamics, FloatArray, Pattern, States

NONE = frozen(np.zeros(0, dtype=np.int64))

# The loops are compiled once for each type of their arguments, and a read-only array is a type of its own: what goes in
# is read-only throughout, what comes out is writable while a loop fills it.


@dataclass(frozen=True)
class Transition:
    """F and Q of s distinct steps: x next = F x + noise of covariance Q.

    Parameters
    ----------
    size : int
        Number n of states.
    dynamics : Dynamics
        Made by :meth:`sparse`, :meth:`blocks` or :meth:`dense`.
    is_unrolled : bool
        The loops are compiled for just this number of states, which pays for small systems that run long: a compilation
        of some seconds for each number, kept in the cache.
    """

    size: int
    dynamics: Dynamics
    is_unrolled: bool = False

    def __post_init__(self) -> None:
        pattern, *arrays = self.dynamics
        object.__setattr__(self, "dynamics", Dynamics(Pattern(*map(frozen, pattern)), *map(frozen, arrays)))

    @classmethod
    def sparse(
        cls,
        size: int,
        rows: ArrayLike,
        columns: ArrayLike,
        values: ArrayLike,
        noise_rows: ArrayLike = NONE,
        noise_columns: ArrayLike = NONE,
        noise: ArrayLike | None = None,
        noise_before: ArrayLike | None = None,
    ) -> Self:
        """Make a transition with m entries in one pattern for all steps.

        A row without an entry is that of the identity.

        Parameters
        ----------
        rows, columns : ndarrays of int, shape (m,)
            In any order; a row that has an entry has all of its entries here, that on the diagonal among them.
        values : ndarray, shape (s, m)
        noise_rows, noise_columns : ndarrays of int, shape (q,)
            Entries of Q on the diagonal or above it.
        noise, noise_before : ndarrays, shape (s, q)
            Q as it is added after the transition, and (trapezoidal rule of a white noise over the step) before it.

        Raises
        ------
        ValueError
            For an entry outside the matrix, two at one place, or noise below the diagonal.
        """
        # contiguous, as every other column: the loops are compiled for each kind of array
        place = [np.ascontiguousarray(part, dtype=np.int64) for part in (rows, columns, noise_rows, noise_columns)]
        entries = np.atleast_2d(np.asarray(values, dtype=np.float64))
        added = [_table(part, len(entries), len(place[2])) for part in (noise_before, noise)]
        if (place[2] > place[3]).any():
            raise ValueError("process noise below the diagonal: give its upper half alone")
        for which, (row, column) in zip(("transition", "noise"), (place[:2], place[2:]), strict=True):
            _check_places(which, row, column, size)
        order = np.lexsort((place[1], place[0]))
        changed, starts = np.unique(place[0][order], return_index=True)
        pattern = Pattern(changed, np.append(starts, len(order)).astype(np.int64), place[1][order])
        ordered = np.ascontiguousarray(entries if (np.diff(order) > 0).all() else entries[:, order])
        return cls(size, Dynamics(pattern, ordered, place[2], place[3], *added))

    @classmethod
    def blocks(cls, F: FloatArray, Q: FloatArray, count: int) -> Self:
        """Make a transition of ``count`` equal systems side by side without ties.

        F and Q are the blocks of each step, shape (s, b, b).
        """
        size, (_, _, each) = F.shape[1] * count, F.shape
        place = [np.nonzero(np.any(part != 0.0, axis=0)) for part in (F, np.triu(Q))]
        # a row that is zero in all steps is kept by its diagonal
        empty = np.setdiff1d(np.arange(each), place[0][0])
        place[0] = (np.append(place[0][0], empty), np.append(place[0][1], empty))
        offset = each * np.arange(count)[:, None]
        rows, columns, noise_rows, noise_columns = ((offset + part).ravel() for pair in place for part in pair)
        values, noise = (np.tile(part[:, pair[0], pair[1]], count) for part, pair in zip((F, Q), place, strict=True))
        return cls.sparse(size, rows, columns, values, noise_rows, noise_columns, noise)

    @classmethod
    def dense(cls, F: FloatArray, Q: FloatArray) -> Self:
        """Make a transition of full matrices, shape (s, n, n), for a handful of states.

        F and Q are those of each step. All loops are unrolled.
        """
        nothing = np.zeros(0, dtype=np.int64)
        pattern = Pattern(nothing, np.zeros(1, dtype=np.int64), nothing)
        full = np.ascontiguousarray(F, dtype=np.float64), np.ascontiguousarray(Q, dtype=np.float64)
        none = np.zeros((0, *full[0].shape[1:]))
        return cls(full[0].shape[1], Dynamics(pattern, full[0], nothing, nothing, none, full[1]), is_unrolled=True)

    @property
    def states(self) -> States:
        """Numbers of the states as the compiled loops want them."""
        return tuple(range(self.size)) if self.is_unrolled else frozen(np.arange(self.size))


def _table(values: ArrayLike | None, steps: int, width: int) -> FloatArray:
    if values is None:
        return np.zeros((0, width))
    table = np.ascontiguousarray(np.atleast_2d(np.asarray(values, dtype=np.float64)))
    if table.shape != (steps, width):
        raise ValueError(f"noise has shape {table.shape}, expected {(steps, width)}: a row for each step")
    return table


def _check_places(which: str, rows: Int64Array, columns: Int64Array, size: int) -> None:
    places = np.concatenate([rows, columns])
    if len(rows) != len(columns) or (places < 0).any() or (places >= size).any():
        raise ValueError(f"{which}: rows and columns must pair up and lie within 0 to {size - 1}")
    if len(np.unique(rows * size + columns)) != len(rows):
        raise ValueError(f"{which}: two entries at one place: add them up")


def distinct_steps(interval_s: FloatArray, resolution_s: float, most: int) -> tuple[FloatArray, Int64Array]:
    """Return the distinct intervals, and the number of each: equal ones share a transition.

    Parameters
    ----------
    interval_s : ndarray, shape (n,)
    resolution_s : float
        Intervals that agree to this are one; ten times as coarse until there are no more than ``most``.

    Examples
    --------
    >>> seconds, index = distinct_steps(np.array([0.0, 1.0, 1.00001, 2.0]), 1e-4, 100)
    >>> seconds.tolist(), index.tolist()
    ([0.0, 1.0, 2.0], [0, 1, 1, 2])
    """
    rounded = np.round(interval_s / resolution_s).astype(np.int64)
    while len(np.unique(rounded)) > most:
        resolution_s *= 10.0
        rounded = np.round(interval_s / resolution_s).astype(np.int64)
    distinct, index = np.unique(rounded, return_inverse=True)
    return np.asarray(distinct * resolution_s, dtype=np.float64), index.astype(np.int64)
