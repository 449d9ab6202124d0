"""Drift of the three gyros from the standstill before flight.

The drift is what the gyros show beyond the rotation of the earth.
"""

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.dataclasses import dataclass
from groundstation.base.geodesy import EARTH_RATE_RADPS
from groundstation.base.records import BoolArray
from groundstation.base.units import DEG_PER_RAD, S_PER_H
from groundstation.methods import harmonics
from groundstation.systems.magnetic.answer import Vector, vector_of
from groundstation.systems.magnetic.attitude import field_in_body
from groundstation.tables.phases import Phases
from groundstation.tables.table import Flight, Table

RATES = ("rate_x_dps", "rate_y_dps", "rate_z_dps")
ATTITUDE = ("true_heading_deg", "roll_deg", "pitch_deg")
EARTH_DEG_PER_H = EARTH_RATE_RADPS * DEG_PER_RAD * S_PER_H
GUARD_S, LEAST_S, LEAST_SAMPLES = 2.0, 20.0, 20
SURE_SHARE = 0.5  # of the earth's rate: what is left must be smaller to tell whether the rates hold the earth's


@dataclass(frozen=True)
class GyroDrift:
    """Drift along forward, right, down and about the vertical, with sigmas.

    Clockwise is positive.
    """

    drift_deg_per_h: Vector
    sigma_deg_per_h: Vector
    vertical_deg_per_h: float
    vertical_sigma_deg_per_h: float


def gyro_drift(flight: Flight, ins_topic: str, phases: Phases, start_s: float, end_s: float) -> GyroDrift | None:
    """Return mean rates at standstill within a window, less the earth's rotation.

    The window is in flight seconds; None where not logged. The earth's rotation along the body follows from attitude
    and latitude. Some systems log rates free of it: it is taken off where less is left with it than without. Where
    gyros are too poor to tell, it is taken off and counts in full in the sigma. The sigma holds noise correlated in
    time and the rounding of the log. Rates that never change say nothing.
    """
    table = flight[ins_topic]
    if not table.has(*RATES, *ATTITUDE, "latitude_deg"):
        return None
    time_s = flight.time_s(ins_topic)
    rows = _still(time_s, phases, start_s, end_s) & table.valid(*RATES, *ATTITUDE, "latitude_deg")
    if np.count_nonzero(rows) < LEAST_SAMPLES or float(np.ptp(time_s[rows])) < LEAST_S:
        return None
    table = table.take(rows)
    rates = np.stack([table.values(name) for name in RATES], axis=-1) * S_PER_H
    steps = [np.diff(np.unique(axis)) for axis in rates.T]
    if not all(step.size for step in steps):
        return None
    rounding = np.array([float(np.min(step)) for step in steps]) / np.sqrt(12.0)
    drift, missing = _without_earth(np.mean(rates, axis=0), _earth_along_body(table))
    sigma = np.sqrt(_variance_of_mean(rates) + rounding**2 + missing**2)
    heading, roll, pitch = (table.values(name) for name in ATTITUDE)
    down = np.mean(field_in_body(0.0, 1.0, heading, roll, pitch), axis=0)
    return GyroDrift(vector_of(drift), vector_of(sigma), float(down @ drift), float(np.sqrt(down**2 @ sigma**2)))


def _still(time_s: FloatArray, phases: Phases, start_s: float, end_s: float) -> BoolArray:
    """Samples at standstill inside the window, guards cut off."""
    still = np.zeros(len(time_s), dtype=bool)
    for interval in phases.intervals:
        if interval.phase == "standstill":
            low, high = max(interval.start_s + GUARD_S, start_s), min(interval.end_s - GUARD_S, end_s)
            still |= (time_s >= low) & (time_s <= high)
    return still


def _earth_along_body(table: Table) -> FloatArray:
    """Return the mean rotation of the earth along forward, right, down, deg/h, shape (3,).

    The rotation is cos latitude north, -sin latitude down.
    """
    latitude_rad = np.deg2rad(float(np.mean(table.values("latitude_deg"))))
    north, down = EARTH_DEG_PER_H * np.cos(latitude_rad), -EARTH_DEG_PER_H * np.sin(latitude_rad)
    heading, roll, pitch = (table.values(name) for name in ATTITUDE)
    return np.asarray(np.mean(field_in_body(float(north), float(down), heading, roll, pitch), axis=0))


def _without_earth(mean: FloatArray, earth: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Drift, and what of the earth's rotation may be wrong in it, deg/h, shapes (3,)."""
    sensed, relative = mean - earth, mean
    left = min(float(np.linalg.norm(sensed)), float(np.linalg.norm(relative)))
    if left > SURE_SHARE * EARTH_DEG_PER_H:
        return sensed, np.abs(earth)
    return (sensed if left == float(np.linalg.norm(sensed)) else relative), np.zeros(3)


def _variance_of_mean(rates: FloatArray) -> FloatArray:
    """Return the variance of the mean of each axis, shape (n, 3) -> (3,).

    Noise is correlated from sample to sample.
    """
    variances = []
    for axis in rates.T:
        centred = axis - np.mean(axis)
        correlation = harmonics.autocorrelation(centred, 1)
        total = harmonics.long_run(centred[:, None], correlation)[0, 0]
        variances.append(total * harmonics.inflation(len(axis), 1, correlation) / len(axis) ** 2)
    return np.array(variances)
