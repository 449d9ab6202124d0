"""Systems given by a sparse matrix of rates, x' = A x + white noise.

Here are their transitions, and states carried forward by them.
"""

from functools import cached_property

import numpy as np

from groundstation.base.dataclasses import dataclass
from groundstation.base.records import Int64Array, frozen
from groundstation.methods.kalman.arrays import FloatArray
from groundstation.methods.kalman.transition import Transition

ORDER = 4


@dataclass(frozen=True)
class Rates:
    """Places of the entries of A in x' = A x: n states, ``rows`` and ``columns`` (m,)."""

    size: int
    rows: Int64Array
    columns: Int64Array

    def __post_init__(self) -> None:
        for name in ("rows", "columns"):
            object.__setattr__(self, name, frozen(np.ascontiguousarray(getattr(self, name), dtype=np.int64)))

    @cached_property
    def reach(self) -> tuple[Int64Array, Int64Array]:
        """Return rows and columns where I + A + ... + A^4 may have entries.

        Rows that stay the identity's are left out.
        """
        own, power = np.zeros((self.size, self.size), dtype=bool), np.eye(self.size, dtype=bool)
        own[self.rows, self.columns] = True
        total = power.copy()
        for _ in range(ORDER):
            power = power @ own
            total |= power
        total[~own.any(axis=1)] = False
        rows, columns = np.nonzero(total)
        return frozen(np.ascontiguousarray(rows)), frozen(np.ascontiguousarray(columns))

    def transition(self, values: FloatArray, seconds: FloatArray, density: FloatArray) -> Transition:
        """Return the transition over each of k steps.

        A white noise enters half before and half after the step (trapezoidal rule).

        Parameters
        ----------
        values : ndarray, shape (k, m)
            Entries of A over each step.
        seconds : ndarray, shape (k,)
            Short beside the rates: the exponential is of the fourth order.
        density : ndarray, shape (n,)
            Power spectral densities of the white noises.

        Examples
        --------
        >>> falling = Rates(2, np.array([0]), np.array([1])).transition(np.ones((1, 1)), np.array([2.0]), np.ones(2))
        >>> falling.dynamics.F.tolist(), falling.dynamics.after.tolist()
        ([[1.0, 2.0]], [[1.0, 1.0]])
        """
        return self.with_noise(self.exponentials(values, seconds), seconds, density)

    def exponentials(self, values: FloatArray, seconds: FloatArray) -> FloatArray:
        """Return the entries of exp(A t) in the places of ``reach``, over each of k steps."""
        from groundstation.methods.kalman import series

        rows, columns = self.reach
        entries = np.empty((len(seconds), len(rows)))
        given, over = (frozen(np.ascontiguousarray(part, dtype=np.float64)) for part in (values, seconds))
        scratch = np.empty((2, self.size, self.size))
        series.exponentials(self.size, self.rows, self.columns, given, over, rows, columns, scratch, entries)
        return entries

    def matrices(self, values: FloatArray, seconds: FloatArray) -> FloatArray:
        """Return exp(A t) over each of k steps as full matrices, shape (k, n, n)."""
        out = np.tile(np.eye(self.size), (len(seconds), 1, 1))
        out[:, *self.reach] = self.exponentials(values, seconds)
        return out

    def with_noise(self, exponentials: FloatArray, seconds: FloatArray, density: FloatArray) -> Transition:
        """Return the transition over steps whose exponentials are known."""
        noise, diagonal = 0.5 * np.outer(seconds, density), np.arange(self.size)
        return Transition.sparse(self.size, *self.reach, exponentials, diagonal, diagonal, noise, noise)

    def carried(
        self, values: FloatArray, step: Int64Array, step_s: float, every: int, starts: FloatArray
    ) -> FloatArray:
        """Carry the states of many starts forward in equal steps.

        The result is each state after every ``every`` of them, shape (s, k // every, n).

        Parameters
        ----------
        values : ndarray, shape (d, m)
            Entries of A over each distinct step.
        step : ndarray of int, shape (s, k)
            Which of them each step of a start is.
        starts : ndarray, shape (s, n)
        """
        from groundstation.methods.kalman import series

        out, x = np.empty((len(step), step.shape[1] // every, self.size)), np.array(starts, dtype=np.float64, order="C")
        entries, which = frozen(np.ascontiguousarray(values)), frozen(np.ascontiguousarray(step, dtype=np.int64))
        scratch = np.empty((2, self.size))
        series.carry_by_rates(self.rows, self.columns, entries, which, float(step_s), every, x, scratch, out)
        return out

    def variances(
        self,
        values: FloatArray,
        step: Int64Array,
        step_s: float,
        every: int,
        starts: FloatArray,
        density: FloatArray,
    ) -> FloatArray:
        """Carry the covariances of many starts forward as :meth:`carried` does the states.

        The result is the variance of each state, shape (s, k // every, n).

        Parameters
        ----------
        starts : ndarray, shape (s, n, n)
        density : ndarray, shape (n,)
            Power spectral densities of the white noises.
        """
        F, half = self.matrices(values, np.full(len(values), step_s)), 0.5 * step_s * np.diag(density)
        P, out = starts, np.empty((len(step), step.shape[1] // every, self.size))
        for k in range(out.shape[1] * every):
            over = F[step[:, k]]
            P = over @ (P + half) @ over.transpose(0, 2, 1) + half
            if (k + 1) % every == 0:
                out[:, k // every] = np.einsum("sii->si", P)
        return out
