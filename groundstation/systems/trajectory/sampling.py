"""States of a track at other times, and of a long track not every one."""

from dataclasses import fields

import numpy as np
from numpy.typing import NDArray

from groundstation.base.angles import wrap_180, wrap_360
from groundstation.base.records import BoolArray
from groundstation.systems.trajectory.solution import FloatArray, TrackOfStates

IndexArray = NDArray[np.intp]
LARGEST_STEP_S = 1.0  # between two states that is interpolated over
NOWHERE = -1  # segment of a time without a state
_WRAPPED = {"longitude_deg": wrap_180, "roll_deg": wrap_180, "heading_deg": wrap_360}


def at_times(track: TrackOfStates, time_s: FloatArray) -> TrackOfStates:
    """Interpolate states and sigmas linearly between neighbours of one segment.

    Elsewhere they are NaN, and the segment is -1.
    """
    count = len(track)
    right = np.clip(np.searchsorted(track.time_s, time_s, side="left"), 0, max(count - 1, 0))
    is_state = track.time_s[right] == time_s
    left = np.where(is_state, right, np.maximum(right - 1, 0))
    step_s = track.time_s[right] - track.time_s[left]
    is_between = (track.time_s[left] <= time_s) & (time_s <= track.time_s[right])
    inside = is_between & (track.segment[left] == track.segment[right]) & (step_s <= LARGEST_STEP_S)
    share = np.where(inside, (time_s - track.time_s[left]) / np.where(step_s > 0.0, step_s, 1.0), np.nan)
    found: dict[str, FloatArray] = {}
    for item in fields(track):
        if item.name not in ("time_s", "segment"):
            found[item.name] = _interpolated(item.name, getattr(track, item.name), left, right, share)
    segment = np.where(inside, track.segment[left], NOWHERE)
    return TrackOfStates(time_s=np.asarray(time_s, dtype=np.float64), segment=segment, **found)


def thinned(time_s: FloatArray, step_s: float) -> BoolArray:
    """Choose samples that are at least a step apart, to a tenth of the step; increasing times.

    Examples
    --------
    >>> thinned(np.array([0.0, 0.05, 0.1, 0.15, 0.5]), 0.1).tolist()
    [True, False, True, False, True]
    """
    slot = np.floor((time_s - (time_s[0] if len(time_s) else 0.0)) / step_s + 0.1)
    chosen = np.ones(len(time_s), dtype=bool)
    chosen[1:] = np.diff(slot) > 0.0
    return chosen


def _interpolated(name: str, values: FloatArray, left: IndexArray, right: IndexArray, share: FloatArray) -> FloatArray:
    weight = share[:, None] if values.ndim > 1 else share
    change = values[right] - values[left]
    wrap = _WRAPPED.get(name)
    if wrap is None:
        return np.asarray(values[left] + weight * change)
    return np.asarray(wrap(values[left] + weight * wrap_180(change)))
