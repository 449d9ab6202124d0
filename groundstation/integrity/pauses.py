"""Silences of a whole log: pauses that its events explain, and stops that nothing does.

A silence is time in which no topic with a rhythm has a record though one is due. It is of the log, and not of its
topics, when every canonical topic with a rate misses records in it and most of them stop and go on with it, each to
within the longest step that is no gap of it. It is a pause as far as the vehicle was disarmed, when recording goes on
as it is armed: so does an autopilot that does not log while disarmed. Where its own setting says that it does not, it
is a pause also when recording goes on without an arm: a failed arming is logged too. What is left of it is a stop.
"""

from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np

from groundstation.base.dataclasses import dataclass
from groundstation.base.gaps import Pause
from groundstation.base.records import BoolArray, Column, Int64Array
from groundstation.base.signals import EVENT_SEPARATOR, is_canonical, kind_of
from groundstation.base.sorted_values import median
from groundstation.integrity.limits import GapLimits
from groundstation.integrity.rhythm import Rhythm

TRUTH = "truth"  # may come from another log, which does not pause with this one
ARMED, DISARMED = "armed", "disarmed"
LOG_DISARMED = "LOG_DISARMED"  # parameter of ArduPilot: 0 logs nothing while disarmed
NEVER_NS = int(np.iinfo(np.int64).max)
LEAST_TOPICS = 2  # canonical ones that are silent together: the gap of a single one is its own
MISSES = 1.5  # periods: in a longer step a record is missing


class Arming(NamedTuple):
    """Change between armed and disarmed, on the corrected clock."""

    time_ns: int
    is_armed: bool


@dataclass(frozen=True)
class Outline:
    """Steps of a topic in which records are missing: from and to, in order of time.

    ``longest_ns`` is the longest step that is no gap.
    """

    topic: str
    first_ns: int
    last_ns: int
    start_ns: Int64Array
    end_ns: Int64Array
    period_ns: float
    longest_ns: float
    has_rate: bool


def armings_in(column: Column) -> list[tuple[int, bool]]:
    """Return rows of a column of event names that tell of arming, and which it is."""
    values = np.asarray(column.values, dtype=np.str_)
    rows = np.flatnonzero((np.strings.find(values, ARMED) >= 0) & column.mask)
    found = []
    for row in rows.tolist():
        told = [name for name in str(values[row]).split(EVENT_SEPARATOR) if name in (ARMED, DISARMED)]
        found += [(row, name == ARMED) for name in told]
    return found


def outline_of(topic: str, time_ns: Int64Array, rhythm: Rhythm, limits: GapLimits) -> Outline | None:
    """Return the steps of a topic that may hold a silence; None where it tells of none."""
    if not rhythm.has_gaps or kind_of(topic) == TRUTH:
        return None
    start_ns, end_ns = rhythm.steps_beyond(time_ns, max(limits.min_ns, MISSES * rhythm.period_ns))
    judged = rhythm.period_ns, rhythm.longest_ns, rhythm.has_rate
    return Outline(topic, int(time_ns[0]), int(time_ns[-1]), start_ns, end_ns, *judged)


def says_no_log_while_disarmed(name: Column, value: Column) -> bool | None:
    """Tell whether rows of parameters say so, the last of them; None where none does."""
    rows = np.flatnonzero((np.asarray(name.values, dtype=np.str_) == LOG_DISARMED) & name.mask & value.mask)
    return bool(value.values[rows[-1]] == 0) if len(rows) else None


def pauses_of(
    outlines: Sequence[Outline], armings: Iterable[Arming], limits: GapLimits, *, is_by_setting: bool = False
) -> tuple[Pause, ...]:
    """Return the silences of the log while the vehicle was disarmed, in order of time.

    ``is_by_setting``: a setting in the log says that nothing is logged while disarmed.

    Examples
    --------
    >>> second = 1_000_000_000
    >>> time_ns = np.concatenate((np.arange(0, 10 * second, second // 10), np.arange(40, 50) * second))
    >>> steps = Rhythm(np.diff(time_ns), len(time_ns) - 1, second / 10, True, True, GapLimits(3.0, 0.2, 10.0, 0.05))
    >>> both = [outline_of(topic, time_ns, steps, steps.limits) for topic in ("ins", "baro")]
    >>> armings = [Arming(8 * second, False), Arming(40 * second, True)]
    >>> [(pause.start_ns / second, pause.end_ns / second) for pause in pauses_of(both, armings, steps.limits)]
    [(9.9, 40.0)]
    """
    times = _disarmed(armings)
    found = []
    for start_ns, end_ns, slack_ns in _silences(outlines, limits):
        for disarmed_ns, armed_ns in times:
            if abs(armed_ns - end_ns) <= slack_ns or (is_by_setting and disarmed_ns < end_ns < armed_ns):
                pause = Pause(max(start_ns, disarmed_ns), min(end_ns, armed_ns))
                found += [pause] if pause.end_ns - pause.start_ns > limits.min_ns else []
    return tuple(dict.fromkeys(found))


def stops_of(outlines: Sequence[Outline], limits: GapLimits) -> tuple[Pause, ...]:
    """Return the silences of the log that are no pause, in order of time.

    ``outlines`` are those of topics whose rhythm knows the pauses.
    """
    return tuple(Pause(start_ns, end_ns) for start_ns, end_ns, _slack in _silences(outlines, limits))


def _disarmed(armings: Iterable[Arming]) -> list[tuple[int, int]]:
    """Return the times from a disarm to the next arm, the last perhaps without end."""
    times, since_ns = [], None
    for one in sorted(armings):
        if not one.is_armed:
            since_ns = one.time_ns if since_ns is None else since_ns
        elif since_ns is not None:
            times.append((since_ns, one.time_ns))
            since_ns = None
    return times if since_ns is None else [*times, (since_ns, NEVER_NS)]


def _silences(outlines: Sequence[Outline], limits: GapLimits) -> list[tuple[int, int, float]]:
    """Return silences that are of the log: from, to, and slack at their ends.

    The slack is the longest step that is no gap, the median of the topics that stop.
    """
    judges = [one for one in outlines if is_canonical(one.topic)]
    if len(judges) < LEAST_TOPICS:
        return []
    start_ns, end_ns = _without_records(outlines, limits.min_ns)
    if not len(start_ns):
        return []
    running, stopping = np.zeros(len(start_ns), dtype=np.int64), np.zeros(len(start_ns), dtype=np.int64)
    slack_ns = np.full((len(judges), len(start_ns)), np.nan)
    for own_ns, one in zip(slack_ns, judges, strict=True):
        runs, stops = _judged(one, start_ns, end_ns)
        running += runs
        stopping += stops
        own_ns[stops] = one.longest_ns
    kept = np.flatnonzero((running >= LEAST_TOPICS) & (2 * stopping > running))
    known_ns = [own_ns[np.isfinite(own_ns)] for own_ns in slack_ns[:, kept].T]
    return [(int(start_ns[row]), int(end_ns[row]), median(own_ns)) for row, own_ns in zip(kept, known_ns, strict=True)]


def _judged(one: Outline, start_ns: Int64Array, end_ns: Int64Array) -> tuple[BoolArray, BoolArray]:
    """Tell of each silence whether a topic runs around it, and stops and goes on with it."""
    if not len(one.start_ns):
        return np.zeros(len(start_ns), dtype=bool), np.zeros(len(start_ns), dtype=bool)
    step = np.maximum(np.searchsorted(one.start_ns, start_ns, side="right") - 1, 0)
    before_ns, behind_ns = one.start_ns[step], one.end_ns[step]
    runs = (before_ns <= start_ns) & (behind_ns >= end_ns)
    return runs, runs & (start_ns - before_ns <= one.longest_ns) & (behind_ns - end_ns <= one.longest_ns)


def _without_records(outlines: Sequence[Outline], least_ns: int) -> tuple[Int64Array, Int64Array]:
    """Return the times, longer than the least, in which no topic has a record that is due.

    A time in which no record of a topic is due says nothing for a raw topic or one without a rate; of another topic
    records must be missing.
    """
    ends = np.iinfo(np.int64).min // 4, np.iinfo(np.int64).max // 4
    start_ns, end_ns = np.array(ends[:1]), np.array(ends[1:])
    for one in sorted(outlines, key=lambda outline: outline.period_ns):
        is_due = end_ns - start_ns > MISSES * one.period_ns
        if one.has_rate and is_canonical(one.topic):
            is_due[:] = True
        free = (
            np.concatenate(([ends[0]], one.start_ns, [one.last_ns])),
            np.concatenate(([one.first_ns], one.end_ns, [ends[1]])),
        )
        cut = _common((start_ns[is_due], end_ns[is_due]), free)
        cut = np.concatenate((cut[0], start_ns[~is_due])), np.concatenate((cut[1], end_ns[~is_due]))
        order = np.argsort(cut[0], kind="stable")
        start_ns, end_ns = cut[0][order], cut[1][order]
        is_long = end_ns - start_ns > least_ns
        start_ns, end_ns = start_ns[is_long], end_ns[is_long]
    inside = (start_ns > ends[0]) & (end_ns < ends[1])
    return start_ns[inside], end_ns[inside]


def _common(one: tuple[Int64Array, Int64Array], other: tuple[Int64Array, Int64Array]) -> tuple[Int64Array, Int64Array]:
    """Return the times in spans of both; each has from and to, in order and apart."""
    first = np.searchsorted(other[1], one[0], side="right")
    count = np.maximum(np.searchsorted(other[0], one[1], side="left") - first, 0)
    mine = np.repeat(np.arange(len(count)), count)
    theirs = np.arange(len(mine)) - np.repeat(np.cumsum(count) - count, count) + first[mine]
    return np.maximum(one[0][mine], other[0][theirs]), np.minimum(one[1][mine], other[1][theirs])
