"""Records of an SBET: their layout, which bytes are records, where the next one begins.

Source: Applanix, POSPac MMS file formats (SBET, SMRMSG).
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from groundstation.base.angles import FloatArray, wrap_180
from groundstation.base.geodesy import SEMI_MAJOR_M, has_position
from groundstation.base.units import DEG_PER_RAD
from groundstation.readers.receiver.times import unrolled

_FIELDS = (
    "time latitude longitude altitude x_velocity y_velocity z_velocity roll pitch platform_heading wander_angle "
    "x_acceleration y_acceleration z_acceleration x_rate y_rate z_rate"
)
RECORD = np.dtype([(name, "<f8") for name in _FIELDS.split()])
_ACCURACIES = "time north_m east_m down_m north_mps east_mps down_mps roll_arcmin pitch_arcmin heading_arcmin"
ACCURACY = np.dtype([(name, "<f8") for name in _ACCURACIES.split()])
S_PER_WEEK = 604_800
FEWEST, _FIRST, _ENOUGH = 5, 20, 0.9
_LEAST_STEP_S, _BASELINE_S = 1e-4, 1.0
_FASTER, _FASTER_MPS, _MOSTLY = 1.5, 10.0, 0.8  # positions may move so much faster than the speeds say, in most places
_MOST_ACCELERATION_MPS2, _MOST_RATE_RADPS = 1_000.0, 100.0
IN_A_ROW, _SEARCHED, _MOST_TRIED = 3, 256, 500
_NO_PLACE = 1e-12  # radians: bytes that are no latitude are often a number next to zero
_LONGEST_STEP_S, _FASTEST_MPS = 10.0, 1_000.0


def are_plausible(records: NDArray[Any], has_no_place: bool = False) -> bool:
    """Tell whether records are a stretch of a trajectory, by their order and the way between.

    ``has_no_place``: they may also have none, as before a first fix.
    """
    sizes = np.abs(records.view("<f8").reshape(len(records), -1))
    is_number = (((sizes >= np.finfo(np.float64).tiny) & np.isfinite(sizes)) | (sizes == 0.0)).all(axis=1)
    with np.errstate(invalid="ignore", over="ignore"):
        is_sound = _follow(records) & is_number
        for axis in "xyz":
            is_sound &= np.abs(records[f"{axis}_acceleration"]) < _MOST_ACCELERATION_MPS2
            is_sound &= np.abs(records[f"{axis}_rate"]) < _MOST_RATE_RADPS
        is_sound[1:] &= np.diff(unrolled_s(records["time"])) > _LEAST_STEP_S
    is_one = is_sound[:_FIRST].all() or is_sound.mean() >= _ENOUGH
    if not is_one or is_sound.sum() < FEWEST:
        return False
    placed = records[is_sound & has_place(records)]
    return has_no_place if not len(placed) else _fits_the_way(placed)


def _fits_the_way(records: NDArray[Any]) -> bool:
    """Tell whether places are as near as the speeds say, over a second or all there is."""
    latitude, longitude, time = records["latitude"], records["longitude"], unrolled_s(records["time"])
    if len(records) < 2 or ((latitude == longitude) & (latitude == records["altitude"])).all():
        return False
    last = np.minimum(np.searchsorted(time, time + _BASELINE_S), len(records) - 1)
    first = np.flatnonzero(time[last] - time >= min(_BASELINE_S, time[-1] - time[0]))
    last = last[first]
    north = latitude[last] - latitude[first]
    east = np.deg2rad(wrap_180(np.rad2deg(longitude[last] - longitude[first]))) * np.cos(latitude[first])
    way = SEMI_MAJOR_M * np.hypot(north, east) / (time[last] - time[first])
    speeds = np.cumsum(np.append(0.0, np.hypot(records["x_velocity"], records["y_velocity"])))
    speed = (speeds[last + 1] - speeds[first]) / (last - first + 1)
    return bool((way <= _FASTER * speed + _FASTER_MPS).mean() >= _MOSTLY)


def has_place(records: NDArray[Any]) -> NDArray[np.bool_]:
    """Tell which records have a place, shape (n,)."""
    with np.errstate(over="ignore", invalid="ignore"):
        return has_position(records["latitude"] * DEG_PER_RAD, records["longitude"] * DEG_PER_RAD)


def next_start(data: bytes, at: int) -> int | None:
    """Next byte at which several sound records in a row begin, one step of time apart."""
    span = IN_A_ROW * RECORD.itemsize
    aligned = at - 1 + RECORD.itemsize  # most often one record alone is damaged
    width = _SEARCHED
    while at + span <= len(data):
        width = min(4 * width, len(data) - at - span + 1)
        time, latitude, longitude = (np.ndarray((width,), "<f8", data, at + 8 * k, (1,)) for k in range(3))
        with np.errstate(invalid="ignore", over="ignore"):
            steps = np.ndarray((width,), "<f8", data, at + RECORD.itemsize, (1,)) - time
            plausible = (time >= 0.0) & (time < 2 * S_PER_WEEK) & (steps > 0.0) & (steps < _LONGEST_STEP_S)
            plausible &= (np.abs(latitude) <= np.pi / 2) & (np.abs(longitude) <= np.pi) & (np.abs(latitude) > _NO_PLACE)
        candidates = at + np.flatnonzero(plausible)
        for place in sorted(candidates[:_MOST_TRIED].tolist(), key=lambda place: (place != aligned, place)):
            if _follow(np.frombuffer(data, RECORD, IN_A_ROW, place)).all():
                return int(place)
        at += width
    return None


def unrolled_s(week_s: FloatArray) -> FloatArray:
    """Count seconds of the week on past its end; a NaN stays."""
    finite = np.isfinite(week_s) & (np.abs(week_s) < 1e9)
    ms = unrolled((np.where(finite, week_s, 0.0) * 1e3).astype(np.int64), S_PER_WEEK * 1000)
    turns = np.round((ms / 1e3 - np.where(finite, week_s, 0.0)) / S_PER_WEEK)
    return np.asarray(week_s + S_PER_WEEK * turns)


def are_sound(records: NDArray[Any]) -> NDArray[np.bool_]:
    """Tell which records are places on Earth with angles and speeds that exist, shape (n,)."""
    with np.errstate(invalid="ignore", over="ignore"):
        time, latitude, longitude = records["time"], records["latitude"], records["longitude"]
        sound = (time >= 0.0) & (time < 2 * S_PER_WEEK) & (np.abs(latitude) <= np.pi / 2) & (np.abs(longitude) <= np.pi)
        sound &= (np.abs(records["altitude"]) < 100_000.0) & (np.abs(records["wander_angle"]) <= 2 * np.pi)
        sound &= (np.abs(records["roll"]) <= np.pi) & (np.abs(records["pitch"]) <= np.pi / 2)
        sound &= np.abs(records["platform_heading"]) <= 4 * np.pi
        sound &= np.hypot(records["x_velocity"], records["y_velocity"]) < _FASTEST_MPS
        near = np.flatnonzero(np.abs(latitude) <= _NO_PLACE)
    sound[near] &= _are_zeros_of_a_record(records[near])
    return np.asarray(sound)


def _are_zeros_of_a_record(records: NDArray[Any]) -> NDArray[np.bool_]:
    """Tell which records with a latitude of 0 are real records.

    Their latitude is exactly 0, and the longitude or another value is not.
    """
    is_one = np.logical_or.reduce([records[name] != 0.0 for name in ("altitude", "x_velocity", "platform_heading")])
    is_one &= records["time"] > 0.0
    return np.asarray((records["latitude"] == 0.0) & ((records["longitude"] != 0.0) | is_one))


def _follow(records: NDArray[Any]) -> NDArray[np.bool_]:
    """Tell which records are sound, a small step of time behind the one before, shape (n,)."""
    sound = are_sound(records)
    with np.errstate(invalid="ignore", over="ignore"):
        steps = np.diff(unrolled_s(records["time"]))
    sound[1:] &= (steps > 0.0) & (steps < _LONGEST_STEP_S)
    return sound
