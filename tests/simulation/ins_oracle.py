"""A second, independent INS: the nonlinear strapdown equations, integrated to judge the linear error model.

Nothing of the linear model is used: sensors are made from the true motion, spoiled, and navigated; the errors are the
differences. Altitude and vertical velocity are the true ones, as with a perfect barometer.

Source: Titterton and Weston, Strapdown Inertial Navigation Technology, 2nd ed. 2004, chapter 3 (navigation equations
in the local geographic frame).
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
EARTH_RATE, SEMI_MAJOR, E2 = 7.292115e-5, 6_378_137.0, 6.694379990141e-3
STEP = 1e-3  # of the central differences of the true velocity and attitude, s


@dataclass(frozen=True)
class Case:
    """True heading and speed in time, and constant sensor and initial errors."""

    heading_rad: Callable[[float], float]
    speed_mps: float
    latitude_deg: float
    altitude_m: float
    gyro_radps: Array
    accelerometer_mps2: Array
    gyro_scale: Array
    accelerometer_scale: Array
    position_m: Array
    velocity_mps: Array
    tilt_rad: Array
    azimuth_rad: float
    earth_rate: float = EARTH_RATE


def radii(latitude: float) -> tuple[float, float]:
    root = 1.0 - E2 * np.sin(latitude) ** 2
    return SEMI_MAJOR * (1.0 - E2) / root**1.5, SEMI_MAJOR / np.sqrt(root)


def gravity(latitude: float, altitude: float) -> float:
    """Somigliana's formula with the second-order altitude term of WGS-84."""
    square = np.sin(latitude) ** 2
    surface = 9.7803253359 * (1.0 + 0.00193185265241 * square) / np.sqrt(1.0 - E2 * square)
    first = 2.0 / SEMI_MAJOR * (1.0 + 1 / 298.257223563 + 0.00344978650684 - 2.0 / 298.257223563 * square)
    return float(surface * (1.0 - first * altitude + 3.0 * (altitude / SEMI_MAJOR) ** 2))


def frame_rates(earth: float, latitude: float, altitude: float, north: float, east: float) -> tuple[Array, Array]:
    meridian, normal = radii(latitude)
    of_earth = earth * np.array([np.cos(latitude), 0.0, -np.sin(latitude)])
    over = east / (normal + altitude)
    return of_earth, np.array([over, -north / (meridian + altitude), -over * np.tan(latitude)])


def bank(case: Case, time: float) -> float:
    rate = (case.heading_rad(time + STEP) - case.heading_rad(time - STEP)) / (2.0 * STEP)
    return float(np.arctan(case.speed_mps * rate / 9.80665))


def attitude(case: Case, time: float) -> Array:
    """n_from_b of a level, coordinated flight."""
    heading, roll = case.heading_rad(time), bank(case, time)
    ch, sh, cr, sr = np.cos(heading), np.sin(heading), np.cos(roll), np.sin(roll)
    return np.array([[ch, -sh * cr, sh * sr], [sh, ch * cr, -ch * sr], [0.0, sr, cr]])


def skew(vector: Array) -> Array:
    x, y, z = vector
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def navigate(case: Case, time_s: Array, parts: int = 1) -> dict[str, Array]:
    """Errors of the nonlinear INS, names and signs as ``InsErrors``; ``parts`` Runge-Kutta steps between two times."""
    h, earth = case.altitude_m, case.earth_rate

    def velocity(time: float) -> tuple[float, float]:
        heading = case.heading_rad(time)
        return case.speed_mps * np.cos(heading), case.speed_mps * np.sin(heading)

    def rates(time: float, y: Array) -> Array:
        latitude, (north, east) = y[0], velocity(time)
        meridian, normal = radii(latitude)
        of_earth, transport = frame_rates(earth, latitude, h, north, east)
        later, sooner = velocity(time + STEP), velocity(time - STEP)
        change = np.array([later[0] - sooner[0], later[1] - sooner[1], 0.0]) / (2.0 * STEP)
        v = np.array([north, east, 0.0])
        force_n = change + skew(2.0 * of_earth + transport) @ v - np.array([0.0, 0.0, gravity(latitude, h)])
        b = attitude(case, time)
        turning = b.T @ (attitude(case, time + STEP) - attitude(case, time - STEP)) / (2.0 * STEP)
        rate_nb = np.array([turning[2, 1], turning[0, 2], turning[1, 0]])
        level = np.array([0.0, 0.0, -gravity(latitude, h)])
        force_b = b.T @ force_n
        force_b = force_b + case.accelerometer_mps2 + case.accelerometer_scale @ (force_b - level)
        rate_b = rate_nb + b.T @ (of_earth + transport) + case.gyro_radps + case.gyro_scale @ rate_nb
        # the INS
        latitude_i, velocity_i, b_i = y[2], y[4:6], y[6:15].reshape(3, 3)
        of_earth_i, transport_i = frame_rates(earth, latitude_i, h, *velocity_i)
        v_i = np.array([*velocity_i, 0.0])
        gained = b_i @ force_b - skew(2.0 * of_earth_i + transport_i) @ v_i
        meridian_i, normal_i = radii(latitude_i)
        turned = b_i @ skew(rate_b) - skew(of_earth_i + transport_i) @ b_i
        return np.concatenate(
            [
                [north / (meridian + h), east / ((normal + h) * np.cos(latitude))],
                [v_i[0] / (meridian_i + h), v_i[1] / ((normal_i + h) * np.cos(latitude_i))],
                gained[:2],
                turned.ravel(),
            ]
        )

    latitude = np.deg2rad(case.latitude_deg)
    meridian, normal = radii(latitude)
    phi = np.array([case.tilt_rad[1], -case.tilt_rad[0], -case.azimuth_rad])
    start = np.concatenate(
        [
            [latitude, 0.0, latitude + case.position_m[0] / (meridian + h)],
            [case.position_m[1] / ((normal + h) * np.cos(latitude))],
            np.array(velocity(0.0)) + case.velocity_mps,
            ((np.eye(3) - skew(phi)) @ attitude(case, 0.0)).ravel(),
        ]
    )
    y = np.zeros((15, len(time_s)))
    y[:, 0] = state = start
    for k in range(1, len(time_s)):
        step = (time_s[k] - time_s[k - 1]) / parts
        for part in range(parts):
            time = float(time_s[k - 1] + part * step)
            k1 = rates(time, state)
            k2 = rates(time + step / 2, state + step / 2 * k1)
            k3 = rates(time + step / 2, state + step / 2 * k2)
            state = state + step / 6 * (k1 + 2 * k2 + 2 * k3 + rates(time + step, state + step * k3))
        y[:, k] = state
    true_velocity = np.array([velocity(float(time)) for time in time_s])
    radius = np.array([radii(latitude) for latitude in y[0]])
    errors_phi = np.zeros((len(time_s), 3))
    for k, time in enumerate(time_s):
        small = np.eye(3) - y[6:15, k].reshape(3, 3) @ attitude(case, float(time)).T
        errors_phi[k] = small[2, 1], small[0, 2], small[1, 0]
    parallel = (radius[:, 1] + h) * np.cos(y[0])
    return {
        "latitude_deg": np.rad2deg(y[0]),
        "position_m": np.stack([(y[2] - y[0]) * (radius[:, 0] + h), (y[3] - y[1]) * parallel], axis=-1),
        "velocity_mps": y[4:6].T - true_velocity,
        "tilt_rad": np.stack([-errors_phi[:, 1], errors_phi[:, 0]], axis=-1),
        "azimuth_rad": -errors_phi[:, 2],
    }
