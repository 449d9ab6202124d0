"""Transition and process noise of an aircraft's local error model, for plans: no session, no dead reckoning."""

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.compile import in_place
from groundstation.estimators.cooperative.motion import ROOMS
from groundstation.estimators.cooperative.motion import discretise as _fill


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
    _series(np.ascontiguousarray(F), q, step_s, transition, noise, np.zeros((ROOMS, n, n)))
    return transition, noise


@in_place
def _series(F: FloatArray, q: FloatArray, step_s: float, phi: FloatArray, noise: FloatArray, room: FloatArray) -> None:
    _fill(len(F), F, q, step_s, phi, noise, room)


def local_dynamics(velocity_s: float, baro_s: float, clock_s: float) -> FloatArray:
    """Dynamics of x, y, vx, vy, height, clock offset, clock frequency."""
    F = np.zeros((7, 7))
    F[0, 2] = F[1, 3] = 1.0
    F[2, 2] = F[3, 3] = -1.0 / velocity_s
    F[4, 4] = -1.0 / baro_s
    F[5, 6] = 1.0
    F[6, 6] = -1.0 / clock_s
    return F
