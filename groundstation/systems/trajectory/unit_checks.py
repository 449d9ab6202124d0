"""Reasons to refuse a unit, or parts of its log, before its motion is looked at.

They are a stuck axis, specific force in another unit, samples at the end of the range.
"""

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.errors import NotAssessableError
from groundstation.base.records import BoolArray
from groundstation.base.units import DEG_PER_RAD, MPS2_PER_G
from groundstation.base.words import clock_text, counted
from groundstation.systems.trajectory.gathered import InputNote
from groundstation.systems.trajectory.imu_samples import SUBJECT, UnitSamples
from groundstation.systems.trajectory.input_settings import InputSettings
from groundstation.systems.trajectory.mounting_settings import MountingSettings
from groundstation.systems.trajectory.short_spans import QUIET_MPS2, Steps
from groundstation.tables.motion import runs

LONG_S, LONG_SHARE = 10.0, 0.2  # of the log: stuck for so long needs less motion beside it
SAME = 1e-6  # relative: increments and their intervals are logged in single precision
MOVES = (5.0 / DEG_PER_RAD, 2.0)  # rad/s, m/s2: spread over 90 % of the samples of what moves
FLICKERS = 0.7  # of the samples: at the edge of a step half of them change by less noise than a step
FEWEST_CALM = 5
AT_END, FEWEST_AT_END = 1e-6, 3  # relative nearness to the largest value, and how many in a row are saturated
LEAST_END = (100.0 / DEG_PER_RAD, 18.0)  # no gyro and no accelerometer ends below
AXES = tuple(f"{sensor} {axis}" for sensor in ("gyro", "accelerometer") for axis in "xyz")


def without_stuck(samples: UnitSamples, topic: str, settings: InputSettings, notes: list[InputNote]) -> UnitSamples:
    """Drop the samples during which an axis is stuck: it keeps one value while others move.

    Raises
    ------
    NotAssessableError
        Where hardly anything is left.
    """
    bad = np.zeros(len(samples), dtype=bool)
    stays = [_stays(samples, axis) for axis in range(len(AXES))]
    changes = ~np.logical_and.reduce(stays)
    long_s = max(LONG_S, LONG_SHARE * float(np.ptp(samples.time_s)))
    for axis, name in enumerate(AXES):
        places, count = [], 0
        for start, end in runs(stays[axis]):
            length_s = samples.time_s[end] - samples.time_s[start]
            is_long = length_s >= long_s and changes[start:end].mean() > 0.5
            is_alone = _flicker(stays, axis, start, end)
            if is_long or (length_s > settings.stuck_s and (is_alone or _moves(samples.rates[start:end]))):
                bad[start : end + 1] = True
                places.append(float(samples.time_s[start]))
                count += end + 1 - start
        if count:
            text = f"{name} of {topic} keeps one value from {clock_text(places[0])} on, {counted(count, 'sample')}"
            notes.append(InputNote("stuck_axis", f"{text}: left out", count, is_doubt=True))
    if not bad.any():
        return samples
    if np.mean(bad) > settings.stuck_share_max:
        stuck = [note.text.removesuffix(": left out") for note in notes if note.code == "stuck_axis"]
        raise NotAssessableError(SUBJECT, stuck[0])
    return samples.take(~bad)


def _flicker(stays: list[BoolArray], axis: int, start: int, end: int) -> bool:
    """Tell whether the two other axes of the sensor hardly keep a value.

    Then its noise is above its resolution, and no sound axis keeps one.
    """
    first = axis - axis % 3
    others = [stays[one][start:end].mean() for one in range(first, first + 3) if one != axis]
    return bool(max(others) < 1.0 - FLICKERS)


def _stays(samples: UnitSamples, axis: int) -> BoolArray:
    """Tell which samples have the value of the one before."""
    values = samples.rates[:, axis]
    if samples.interval_s is None:
        return np.asarray(values[1:] == values[:-1])
    return np.asarray(np.abs(np.diff(values)) <= SAME * np.abs(values[1:]))


def _moves(rates: FloatArray) -> bool:
    """Tell whether a unit is turned or shaken by more than the resolution of a coarse one."""
    low, high = np.percentile(rates, (5.0, 95.0), axis=0)
    return bool((high - low >= np.repeat(MOVES, 3)).any())


def ends_of_range(samples: UnitSamples, notes: list[InputNote]) -> tuple[int, int]:
    """Note samples that are clipped and those at the end of the range; return how many."""
    clipped = int(np.count_nonzero(samples.clipped))
    if clipped:
        first_s = float(samples.time_s[int(np.argmax(samples.clipped))])
        text = f"{counted(clipped, 'sample')} clipped by the unit's own count, the first at {clock_text(first_s)}"
        notes.append(InputNote("clipped", text, clipped, is_doubt=True))
    saturated = 0
    for axis, name in enumerate(AXES):
        values = np.abs(samples.rates[:, axis])
        most = float(values.max())
        if most < LEAST_END[axis // 3]:
            continue
        at_end = [(a, b) for a, b in runs(values >= most * (1.0 - AT_END)) if b - a >= FEWEST_AT_END]
        count = sum(b - a for a, b in at_end)
        if count:
            first_s = float(samples.time_s[at_end[0][0]])
            text = (
                f"{name} stays at {_shown(axis, most)} for {counted(count, 'sample')}, first at {clock_text(first_s)}"
            )
            notes.append(InputNote("saturated", text, count, is_doubt=True))
            saturated += count
    return clipped, saturated


def _shown(axis: int, value: float) -> str:
    return f"{value * DEG_PER_RAD:.0f} deg/s" if axis < 3 else f"{value:.0f} m/s2"


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


AT_END, FEWEST_AT_END = 1e-6, 3  # relative nearness to the largest value, and how many in a row are saturated


LEAST_END = (100.0 / DEG_PER_RAD, 18.0)  # no gyro and no accelerometer ends below


MOVES = (5.0 / DEG_PER_RAD, 2.0)  # rad/s, m/s2: spread over 90 % of the samples of what moves
