"""Transition and process noise of linear error models over a step, to rounding.

Source: Van Loan, Computing integrals involving the matrix exponential, IEEE Transactions on Automatic Control 23(3),
1978: the integral of exp(F s) Q exp(F' s). Both are summed as power series here: their terms follow from one another.
"""

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.compile import compiled
from groundstation.base.geodesy import EARTH_RATE_RADPS, curvature_radii_m

TERMS, FEWEST_TERMS = 40, 4
SMALLEST = 1e-16  # of a term of the transition: its largest entry is 1 or more


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

    Notes
    -----
    Phi = sum (F h)^k / k!; Q = sum L_k h^(k+1) / (k+1)! with L_0 = diag(q), L_(k+1) = F L_k + L_k F'.
    """
    n = len(F)
    transition, noise = np.empty((n, n)), np.empty((n, n))
    _series(np.ascontiguousarray(F), q, step_s, transition, noise)
    return transition, noise


@compiled
def _series(F, q, step_s, transition, noise):  # type: ignore[no-untyped-def]
    """Both sums at once; rows and columns of F without an entry cost nothing but their zeros."""
    n = F.shape[0]
    term, level, moved = np.zeros((n, n)), np.zeros((n, n)), np.zeros((n, n))
    for i in range(n):
        for j in range(n):
            transition[i, j] = noise[i, j] = 0.0
        term[i, i] = transition[i, i] = 1.0
        level[i, i] = q[i]
        noise[i, i] = q[i] * step_s
    factor = step_s
    for k in range(1, TERMS):
        largest = 0.0
        for i in range(n):
            for j in range(n):
                total = 0.0
                for m in range(n):
                    if F[i, m] != 0.0:
                        total += F[i, m] * term[m, j]
                moved[i, j] = total * step_s / k
        for i in range(n):
            for j in range(n):
                term[i, j] = moved[i, j]
                transition[i, j] += moved[i, j]
                largest = max(largest, abs(moved[i, j]))
        for i in range(n):
            for j in range(n):
                total = 0.0
                for m in range(n):
                    if F[i, m] != 0.0:
                        total += F[i, m] * level[m, j]
                moved[i, j] = total
        factor *= step_s / (k + 1)
        for i in range(n):
            for j in range(n):
                level[i, j] = moved[i, j] + moved[j, i]
                noise[i, j] += level[i, j] * factor
        if k >= FEWEST_TERMS and largest < SMALLEST:
            break


def local_dynamics(velocity_s: float, baro_s: float, clock_s: float) -> FloatArray:
    """Dynamics of x, y, vx, vy, height, clock offset, clock frequency."""
    F = np.zeros((7, 7))
    F[0, 2] = F[1, 3] = 1.0
    F[2, 2] = F[3, 3] = -1.0 / velocity_s
    F[4, 4] = -1.0 / baro_s
    F[5, 6] = 1.0
    F[6, 6] = -1.0 / clock_s
    return F


def global_dynamics(
    latitude_deg: float,
    height_m: float,
    velocity_mps: FloatArray,
    force_mps2: FloatArray,
    gyro_s: float,
    baro_s: float,
    clock_s: float,
) -> FloatArray:
    """Dynamics of the thirteen states of the global frame.

    States: position error north, east (m), velocity error north, east (m/s), platform angles about north, east, down
    (rad), drifts about the same (rad/s), barometric height error, clock offset (m), clock frequency (m/s). The angles
    have the sign with which the computed attitude is (I - [angle x]) times the true one; a positive drift makes its
    angle fall.

    Source: Titterton and Weston, Strapdown Inertial Navigation Technology, 2nd ed. 2004, section 12.3.
    """
    latitude_rad = np.deg2rad(latitude_deg)
    sine, cosine = float(np.sin(latitude_rad)), float(np.cos(latitude_rad))
    tangent = sine / cosine
    meridian, normal = (float(radius) + height_m for radius in curvature_radii_m(latitude_deg))
    north, east, down = (float(value) for value in velocity_mps)
    earth = EARTH_RATE_RADPS
    w_n = earth * cosine + east / normal
    w_e = -north / meridian
    w_d = -earth * sine - east * tangent / normal
    f_n, f_e, f_d = (float(value) for value in force_mps2)
    F = np.zeros((13, 13))
    # error of Earth and transport rate per metre north and per metre a second
    ie_n, ie_d = -earth * sine / meridian, -earth * cosine / meridian
    en_d = -east / (normal * cosine * cosine) / meridian
    F[0, 2] = 1.0
    F[1, 3] = 1.0
    F[1, 0] = east * tangent / meridian
    F[1, 1] = -tangent * north / meridian
    coriolis_d = w_d - earth * sine
    F[2, 5], F[2, 6], F[2, 3] = -f_d, f_e, coriolis_d + (-tangent / normal) * east
    F[2, 2] = down / meridian
    F[2, 0] = (2.0 * ie_d + en_d) * east
    F[3, 4], F[3, 6] = f_d, -f_n
    F[3, 2] = -coriolis_d
    F[3, 3] = down / normal + tangent / normal * north
    F[3, 0] = -(2.0 * ie_d + en_d) * north + 2.0 * ie_n * down
    F[4, 6], F[4, 5] = -w_e, w_d
    F[4, 0], F[4, 3], F[4, 7] = ie_n, 1.0 / normal, -1.0
    F[5, 4], F[5, 6] = -w_d, w_n
    F[5, 2], F[5, 8] = -1.0 / meridian, -1.0
    F[6, 5], F[6, 4] = -w_n, w_e
    F[6, 0], F[6, 3], F[6, 9] = ie_d + en_d, -tangent / normal, -1.0
    F[7, 7] = F[8, 8] = F[9, 9] = -1.0 / gyro_s
    F[10, 10] = -1.0 / baro_s
    F[11, 12] = 1.0
    F[12, 12] = -1.0 / clock_s
    return F
