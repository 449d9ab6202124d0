"""Differences of several INS in a log that is too short to judge them."""

from collections.abc import Sequence
from itertools import combinations

import numpy as np

from groundstation.base.angles import FloatArray, wrap_180
from groundstation.base.geodesy import continuous_longitude_deg, north_east_m
from groundstation.base.quantiles import NORMAL_95
from groundstation.base.units import S_PER_H
from groundstation.base.words import listed, with_half
from groundstation.systems.inertial.units_answer import LEAST_S, InsPair, InsUnit, Measured, UnitsResult
from groundstation.systems.inertial.units_track import UnitTrack

WHY_NOT = "too little of both together"
SAME_M, SAME_DEG = 0.5, 0.005  # smaller differences round to nothing


def differ_in_short(tracks: Sequence[UnitTrack], *, ins_class: str, ins_class_origin: str) -> UnitsResult | None:
    """Return the differences of units that are together for less than :data:`LEAST_S`.

    None where none is known.

    A difference is the median over the time of both, the second unit less the first, whose values are interpolated to
    the times of the one with fewer samples. Its interval is 1.96 times the scatter: what noise and rounding of both do,
    as samples so near each other are no independent ones. Clocks, axes and steps cannot be told in so short a time:
    the values are as logged.
    """
    every = [_pair(first, second) for first, second in combinations(tracks, 2)]
    pairs = tuple(pair for pair in every if pair is not None)
    if not pairs:
        return None
    longest_s = max(pair.hours for pair in pairs) * S_PER_H
    return UnitsResult(
        verdict="not_judged",
        sentence=f"{_told(pairs)} over {longest_s:.2g} s together: at least {LEAST_S:.0f} s are needed to judge them",
        off=(),
        units=tuple(_unit(one, ins_class) for one in tracks),
        pairs=pairs,
        faults=(),
        against="",
        against_title="",
        ins_class=ins_class,
        ins_class_origin=ins_class_origin,
        false_alarm_share=0.0,
    )


def together_s(first: UnitTrack, second: UnitTrack) -> float:
    """Return the length of the time of both, negative where there is none."""
    ends = min(first.time_s[-1], second.time_s[-1]), max(first.time_s[0], second.time_s[0])
    return float(ends[0] - ends[1])


def _pair(first: UnitTrack, second: UnitTrack) -> InsPair | None:
    length_s = together_s(first, second)
    times = [one.time_s[_within(one.time_s, first, second)] for one in (first, second)]
    time_s = min((one for one in times if len(one)), key=len, default=times[0])
    if length_s < 0.0 or not len(time_s):
        return None
    heading, distance = _heading_deg(first, second, time_s), _distance_m(first, second, time_s)
    if heading is None and distance is None:
        return None
    return InsPair(first.topic, second.topic, length_s / S_PER_H, None, None, None, distance, heading, why_not=WHY_NOT)


def _within(time_s: FloatArray, first: UnitTrack, second: UnitTrack) -> FloatArray:
    low, high = (pick(first.time_s[end], second.time_s[end]) for pick, end in ((max, 0), (min, -1)))
    return np.asarray((time_s >= low) & (time_s <= high))


def _at(track: UnitTrack, values: FloatArray, time_s: FloatArray) -> FloatArray | None:
    known = np.isfinite(values)
    if not known.any():
        return None
    return np.interp(time_s, track.time_s[known], values[known], left=np.nan, right=np.nan)


def _measured(values: FloatArray) -> Measured | None:
    known = values[np.isfinite(values)]
    return Measured(float(np.median(known)), NORMAL_95 * float(np.std(known))) if len(known) else None


def _heading_deg(first: UnitTrack, second: UnitTrack, time_s: FloatArray) -> Measured | None:
    found = []
    for one in (first, second):
        if one.heading_deg is None or not np.isfinite(one.heading_deg).any():
            return None
        start = one.heading_deg[np.isfinite(one.heading_deg)][0]
        turned = _at(one, wrap_180(one.heading_deg - start), time_s)  # a log this short holds no half turn
        found.append((start, turned))
    (start_1, turned_1), (start_2, turned_2) = found
    if turned_1 is None or turned_2 is None:
        return None
    return _measured(wrap_180(start_2 - start_1 + turned_2 - turned_1))


def _distance_m(first: UnitTrack, second: UnitTrack, time_s: FloatArray) -> Measured | None:
    places = []
    for one in (first, second):
        latitude = _at(one, one.latitude_deg, time_s)
        longitude = _at(one, continuous_longitude_deg(one.longitude_deg), time_s)
        if latitude is None or longitude is None or not np.isfinite(latitude).any():
            return None
        places.append((latitude, longitude))
    (latitude_1, longitude_1), (latitude_2, longitude_2) = places
    origin = float(np.nanmedian(latitude_1)), float(np.nanmedian(longitude_1))
    north_1, east_1 = north_east_m(latitude_1, longitude_1, *origin)
    north_2, east_2 = north_east_m(latitude_2, longitude_2, *origin)
    return _measured(np.hypot(north_2 - north_1, east_2 - east_1))


def _unit(track: UnitTrack, ins_class: str) -> InsUnit:
    return InsUnit(
        topic=track.topic,
        kind=track.kind,
        kind_reason=track.kind_reason,
        has_position=bool(np.isfinite(track.latitude_deg).any()),
        state="not_judged",
        serials=tuple(serial for _, serial in track.serials),
        start_s=track.start_s,
        ins_class=track.ins_class or ins_class,
    )


def _told(pairs: Sequence[InsPair]) -> str:
    """Return the largest differences in words."""
    headings = [(pair, one) for pair in pairs if (one := pair.heading_difference_deg) is not None]
    distances = [(pair, one) for pair in pairs if (one := pair.largest_m) is not None]
    told = []
    if headings:
        pair, one = max(headings, key=lambda found: abs(found[1].value))
        if abs(one.value) >= SAME_DEG:
            told.append(f"headings of {pair.first} and {pair.second} {_size(one, 2, 'deg')} apart")
    if distances:
        pair, one = max(distances, key=lambda found: found[1].value)
        if one.value >= SAME_M:
            told.append(f"positions of {pair.first} and {pair.second} {_size(one, 0, 'm')} apart")
    return listed(told) if told else "no two INS differ"


def _size(one: Measured, places: int, unit: str) -> str:
    is_exact = one.half95 < 0.5 * 10.0**-places
    return f"{abs(one.value):.{places}f} {unit}" if is_exact else with_half(abs(one.value), one.half95, unit)
