"""Departures of an aided INS from GNSS: spans with both far further apart than usual.

A filter that leaves its receiver shows it in three ways: the distance to GNSS, the difference of the velocities, and
its own gate, by which it rejects GNSS. Which of the two is wrong the difference alone does not tell.
"""

import numpy as np

from groundstation.base.findings import Finding, Severity
from groundstation.base.records import BoolArray
from groundstation.systems.inertial.answer import Departure, FilterOfIns
from groundstation.systems.inertial.differences import InsDifferences
from groundstation.systems.inertial.model import FloatArray
from groundstation.tables.own_filter import OwnInnovations
from groundstation.tables.table import Flight

TIMES_MEDIAN = 10.0  # so many times their median over the log are far
LEAST_M, LEAST_MPS = 10.0, 3.0  # and not less than this: twice what a receiver without corrections may jump by
LAG_S = 0.5  # a fix so late is no departure: as far apart as the aircraft moves meanwhile
LEAST_S = 5.0  # a shorter one is an outlier
JOINED_S = 10.0  # two with less between them are one
START_S = 30.0  # a filter that has just begun is still finding its place
MOST_TOLD = 5


def departures(flight: Flight, compared: InsDifferences, own: OwnInnovations | None) -> tuple[Departure, ...]:
    """Find the spans in which INS and GNSS are far apart, or the filter rejects GNSS.

    Far is ten times the median over the log, at least 10 m or 3 m/s, and further than the aircraft flies in 0.5 s.
    """
    epochs = compared.epochs
    apart_m, apart_mps = np.hypot(*epochs.position_m.T), np.hypot(*epochs.velocity_mps.T)
    speed = np.nan_to_num(np.hypot(*compared.velocity_mps.T))
    far = _beyond(apart_m, LEAST_M, LAG_S * speed) | _beyond(apart_mps, LEAST_MPS, np.zeros_like(speed))
    rejected = np.zeros(len(far), dtype=bool) if own is None else _rejected(flight, own, epochs.time_s)
    spans = _spans(epochs.time_s, far | rejected)
    known = epochs.time_s[np.isfinite(apart_m) | np.isfinite(apart_mps)]
    found = []
    for start_s, end_s in spans:
        inside = (epochs.time_s >= start_s) & (epochs.time_s <= end_s)
        found.append(
            Departure(
                start_s,
                end_s,
                largest_m=_largest(apart_m[inside]),
                largest_mps=_largest(apart_mps[inside]),
                share_rejected=None if own is None else float(np.mean(rejected[inside])),
                at_start=bool(start_s - known[0] < START_S),
            )
        )
    return tuple(found)


def findings_of(found: tuple[Departure, ...], of: FilterOfIns, usual_m: float | None, topic: str) -> list[Finding]:
    """Return a finding for each departure, the longest ones where there are many."""
    told = sorted(sorted(found, key=lambda one: one.start_s - one.end_s)[:MOST_TOLD], key=lambda one: one.start_s)
    usually = "" if usual_m is None else f" (usually {usual_m:.1f} m)"
    lines = []
    for one in told:
        text = f"{of.title} and GNSS {one.apart}apart for {one.end_s - one.start_s:.0f} s{usually}"
        gate = f"; the filter rejected GNSS in {one.share_rejected:.0%} of it" if one.share_rejected else ""
        begun = "; it had just begun" if one.at_start else ""
        place = f"{one.start_s:.1f} to {one.end_s:.1f} s"
        severity: Severity = "info" if one.at_start else "warn"
        lines.append(Finding(severity, "inertial.departure", f"{text}{gate}{begun}{of.use}", topic, place))
    if len(found) > len(told):
        more = len(found) - len(told)
        lines.append(Finding("warn", "inertial.departure", f"{more} shorter departures from GNSS", topic, count=more))
    return lines


def _beyond(apart: FloatArray, least: float, allowed: FloatArray) -> BoolArray:
    known = apart[np.isfinite(apart)]
    if not len(known):
        return np.zeros(len(apart), dtype=bool)
    limit = np.maximum(max(TIMES_MEDIAN * float(np.median(known)), least), allowed)
    return np.asarray(np.nan_to_num(apart) > limit)


def _rejected(flight: Flight, own: OwnInnovations, time_s: FloatArray) -> BoolArray:
    """Tell at which epochs the newest innovation within a second was beyond its gate."""
    gate = np.nan_to_num(own.gate_ratio.reshape(len(own.time_ns), -1)).max(axis=1, initial=0.0)
    own_s = flight.seconds(own.time_ns)
    place = np.searchsorted(own_s, time_s, side="right") - 1
    near = (place >= 0) & (time_s - own_s[np.maximum(place, 0)] <= 1.0)
    return np.asarray(near & (gate[np.maximum(place, 0)] > 1.0))


def _spans(time_s: FloatArray, bad: BoolArray) -> list[tuple[float, float]]:
    """Return the ends of runs of bad epochs, joined over short pauses, none short."""
    at = time_s[bad]
    if not len(at):
        return []
    breaks = np.flatnonzero(np.diff(at) > JOINED_S)
    starts, ends = at[np.concatenate([[0], breaks + 1])], at[np.concatenate([breaks, [len(at) - 1]])]
    long = ends - starts >= LEAST_S
    return list(zip(starts[long].tolist(), ends[long].tolist(), strict=True))


def _largest(values: FloatArray) -> float | None:
    known = values[np.isfinite(values)]
    return float(known.max()) if len(known) else None
