"""States of a track at other times, and of a long track not every one."""

from dataclasses import fields

import numpy as np

from groundstation.base.records import BoolArray
from groundstation.results.arrays.states import NOWHERE, between
from groundstation.systems.trajectory.solution import FloatArray, TrackOfStates


def at_times(track: TrackOfStates, time_s: FloatArray) -> TrackOfStates:
    """Interpolate states and sigmas linearly between neighbours of one segment.

    Elsewhere they are NaN, and the segment is -1.
    """
    place = between(track.time_s, track.segment, time_s)
    found = {
        item.name: place.interpolated(getattr(track, item.name), item.name)
        for item in fields(track)
        if item.name not in ("time_s", "segment")
    }
    segment = np.where(place.is_inside, track.segment[place.left], NOWHERE)
    return TrackOfStates(time_s=np.asarray(time_s, dtype=np.float64), segment=segment, **found)


def every(track: TrackOfStates, step_s: float) -> TrackOfStates:
    """Return the states that are at least a step apart."""
    rows = np.flatnonzero(thinned(track.time_s, step_s))
    if len(rows) == len(track):
        return track
    return TrackOfStates(**{item.name: getattr(track, item.name)[rows] for item in fields(track)})


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
