"""Steps of linear error models, and the dynamics of an aircraft in a local frame.

A step is a transition and its noise.

Source: Van Loan, Computing integrals involving the matrix exponential, IEEE Transactions on Automatic Control 23(3),
1978 (the integral of exp(F s) Q exp(F' s); both are summed as power series here: their terms follow from one
another).
"""

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.compile import in_place

TERMS, FEWEST_TERMS = 40, 4
SMALLEST = 1e-16  # smallest term of the transition, whose largest entry is 1 or more
ROOMS = 11  # matrices of n by n that a step works in; the last three keep the last step of aircraft in a local frame


@in_place
def fill_step(
    n: int, F: FloatArray, q: FloatArray, step_s: float, phi: FloatArray, noise: FloatArray, room: FloatArray
) -> None:
    """Fill transition and noise covariance of a step of dx/dt = F x + w.

    Entries of F that are zero cost nothing. Phi = sum (F h)^k / k!; Q = sum L_k h^(k+1) / (k+1)! with L_0 = diag(q),
    L_(k+1) = F L_k + L_k F'. A step may go back; then the noise means nothing.
    """
    term, level, moved = room[0], room[1], room[2]
    for i in range(n):
        for j in range(n):
            term[i, j] = level[i, j] = phi[i, j] = noise[i, j] = 0.0
        term[i, i] = phi[i, i] = 1.0
        level[i, i] = q[i]
        noise[i, i] = q[i] * step_s
    factor = step_s
    for k in range(1, TERMS):
        largest = 0.0
        _times(n, F, term, moved)
        for i in range(n):
            for j in range(n):
                value = moved[i, j] * step_s / k
                term[i, j] = value
                phi[i, j] += value
                largest = max(largest, abs(value))
        _times(n, F, level, moved)
        factor *= step_s / (k + 1)
        for i in range(n):
            for j in range(n):
                level[i, j] = moved[i, j] + moved[j, i]
                noise[i, j] += level[i, j] * factor
        if k >= FEWEST_TERMS and largest < SMALLEST:
            break


@in_place
def _times(n: int, F: FloatArray, matrix: FloatArray, product: FloatArray) -> None:
    """Multiply: product <- F matrix."""
    for i in range(n):
        for j in range(n):
            product[i, j] = 0.0
        for m in range(n):
            a = F[i, m]
            if a != 0.0:
                for j in range(n):
                    product[i, j] += a * matrix[m, j]


def discretise(F: FloatArray, q: FloatArray, step_s: float) -> tuple[FloatArray, FloatArray]:
    """Transition matrix and covariance of the noise of a step of dx/dt = F x + w.

    Parameters
    ----------
    F : ndarray, shape (n, n)
        Dynamics, 1/s and mixed units.
    q : ndarray, shape (n,)
        Spectral density of the white noise on each state.
    step_s : float
        May be negative: then the noise is not used.
    """
    n = len(F)
    transition, noise = np.empty((n, n)), np.empty((n, n))
    fill_step(n, np.ascontiguousarray(F), q, step_s, transition, noise, np.zeros((ROOMS, n, n)))
    return transition, noise


def local_dynamics(velocity_s: float, baro_s: float, clock_s: float) -> FloatArray:
    """Dynamics of x, y, vx, vy, height, clock offset, clock frequency."""
    F = np.zeros((7, 7))
    F[0, 2] = F[1, 3] = 1.0
    F[2, 2] = F[3, 3] = -1.0 / velocity_s
    F[4, 4] = -1.0 / baro_s
    F[5, 6] = 1.0
    F[6, 6] = -1.0 / clock_s
    return F
