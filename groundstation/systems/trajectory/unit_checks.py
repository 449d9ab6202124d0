"""Reasons to refuse a unit before its motion: a stuck axis, force in other units."""

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.records import BoolArray
from groundstation.base.units import MPS2_PER_G
from groundstation.systems.trajectory.inputs import ImuIncrements
from groundstation.systems.trajectory.mounting_settings import MountingSettings
from groundstation.systems.trajectory.short_spans import QUIET_MPS2, Steps

STUCK_S, STUCK_SHARE = 10.0, 0.2  # of the log: a shorter one is a gap of the sensor, which the ledger tells
SAME = 1e-5  # relative: increments are logged in single precision
FEWEST_CALM = 5
AXES = tuple(f"{sensor} {axis}" for sensor in ("gyro", "accelerometer") for axis in "xyz")


def stuck_axis(imu: ImuIncrements) -> str:
    """Return why a unit with a stuck axis is refused; empty where none is.

    An axis is stuck while its value stays the same though others change.
    """
    if len(imu) < 3:
        return ""
    same = [_stays(imu, axis) for axis in range(len(AXES))]
    moves = ~np.logical_and.reduce(same)
    limit_s = max(STUCK_S, STUCK_SHARE * float(imu.time_s[-1] - imu.time_s[0]))
    for axis, name in enumerate(AXES):
        edges = np.flatnonzero(np.diff(np.concatenate([[0], same[axis].astype(np.int8), [0]])))
        lengths_s = imu.time_s[edges[1::2]] - imu.time_s[edges[::2]]
        for run in np.flatnonzero(lengths_s >= limit_s):
            start, end = edges[2 * run], edges[2 * run + 1]
            if moves[start:end].mean() > 0.5:
                value = _values(imu, axis)[start + 1]
                return f"{name} is stuck: {value:.4g} for {lengths_s[run]:.0f} s while other axes change"
    return ""


def _values(imu: ImuIncrements, axis: int) -> FloatArray:
    """Return the mean rate or force of an axis over each interval."""
    found: FloatArray = (imu.delta_angle_rad, imu.delta_velocity_mps)[axis // 3][:, axis % 3] / imu.interval_s
    return found


def _stays(imu: ImuIncrements, axis: int) -> BoolArray:
    """Tell at which samples an axis has the value of the sample before."""
    values = _values(imu, axis)
    stays: BoolArray = np.abs(np.diff(values)) <= SAME * np.abs(values[1:]) + 1e-12
    return stays


def wrong_force(steps: Steps, settings: MountingSettings) -> str:
    """Return why the specific force cannot be one in m/s2; empty where it can.

    At rest and in steady travel it is gravity.
    """
    size = np.linalg.norm(steps.force_mps2, axis=1)
    known = np.isfinite(size)
    calm = known & (np.linalg.norm(steps.acceleration_mps2, axis=1) < QUIET_MPS2)
    sizes = [float(np.median(size[part])) for part in (calm, known) if part.sum() >= FEWEST_CALM]
    if not sizes:
        return ""
    found = min(sizes, key=lambda one: abs(np.log(max(one, 1e-9) / MPS2_PER_G)))
    low, high = settings.gravity_range_mps2
    if low <= found <= high:
        return ""
    told = f"accelerometers show {found:.3g} where gravity is {MPS2_PER_G:.2f} m/s2"
    if low <= found * MPS2_PER_G <= high:
        return f"{told}: they are in g, not in m/s2"
    if low <= found / MPS2_PER_G <= high:
        return f"{told}: they are multiplied by g twice"
    if found < 0.2 * MPS2_PER_G:
        return f"{told}: gravity has been taken off, or they are not specific force"
    return f"{told}: wrong units, scale or a bias beyond use"
