"""Figures of autopilot health: lanes of checks, quantities thinned."""

from collections.abc import Sequence

import numpy as np

from groundstation.results.arrays.typed import joined
from groundstation.systems.health.answer import AttitudeLoss, Happening
from groundstation.systems.health.arrays import HealthLanes, HealthMotors, HealthSeries
from groundstation.systems.health.checks import CHECKS, Judged
from groundstation.systems.health.evidence import FloatArray
from groundstation.systems.health.motors import Motors
from groundstation.tables.table import Flight

BEFORE_S, AFTER_S = 3.0, 5.0  # of the outputs to the motors around a lost attitude
MOST_POINTS = 600  # of a quantity
GRADES = ("good", "amber", "red")
NOT_LOGGED = "not logged"
SHORTEST_SHARE = 1 / 2_000  # of the log: shorter breaks of a lane are not drawn
EVENT_SHARE = 1 / 200  # of the log that an event is drawn as
Spans = tuple[FloatArray, FloatArray]


def lanes_figure(
    judged: Sequence[Judged], happenings: Sequence[Happening], duration_s: float, pauses_s: Spans
) -> HealthLanes:
    """Return the grade of each check over time: the worst of its quantities, and its events.

    A pause of the log is shown as not logged in the lane of each check that is.
    """
    parts = []
    for key, title in CHECKS.items():
        own = [one for one in judged if one.measure.check == key]
        events = [one for one in happenings if one.check == key and one.grade != "info"]
        shown = _by_grade(own, events, duration_s)
        quiet = pauses_s if any(len(start) for start, _ in shown) else union(np.zeros(0), np.zeros(0))
        logged = [without(one, pauses_s) for one in shown]
        for grade, (start, end) in zip((*GRADES, NOT_LOGGED), (*logged, quiet), strict=True):
            count = len(start)
            parts.append(
                HealthLanes(check=np.full(count, title), start_s=start, end_s=end, grade=np.full(count, grade))
            )
    return joined(parts)


def _by_grade(judged: Sequence[Judged], events: Sequence[Happening], duration_s: float) -> list[Spans]:
    """Return the spans of each grade, without those of a worse one."""
    least = SHORTEST_SHARE * duration_s
    levels = []
    for level in range(len(GRADES)):
        starts, ends = [], []
        for one in judged:
            rows = one.grade >= level
            starts.append(one.time_s[rows])
            ends.append(one.until_s[rows])
        happened = [one.time_s for one in events if level <= (2 if one.grade == "fail" else 1)]
        starts.append(np.array(happened, dtype=np.float64))
        ends.append(np.minimum(np.array(happened, dtype=np.float64) + EVENT_SHARE * duration_s, duration_s))
        levels.append(union(np.concatenate(starts), np.concatenate(ends), least))
    return [without(levels[0], levels[1]), without(levels[1], levels[2]), levels[2]]


def union(start: FloatArray, end: FloatArray, gap: float = 0.0) -> Spans:
    """Return spans joined where they meet or are less than ``gap`` apart, in order.

    Examples
    --------
    >>> union(np.array([3.0, 0.0, 1.0]), np.array([4.0, 1.0, 2.0]))
    (array([0., 3.]), array([2., 4.]))
    """
    if not len(start):
        return np.zeros(0), np.zeros(0)
    order = np.argsort(start, kind="stable")
    start, reach = start[order], np.maximum.accumulate(end[order])
    first = np.concatenate([[True], start[1:] > reach[:-1] + gap])
    places = np.flatnonzero(first)
    return start[places], reach[np.append(places[1:], len(start)) - 1]


def without(spans: Spans, others: Spans) -> Spans:
    """Return spans less what others cover; both are in order and apart.

    Examples
    --------
    >>> without((np.array([0.0]), np.array([10.0])), (np.array([2.0, 9.0]), np.array([3.0, 11.0])))
    (array([0., 3.]), array([2., 9.]))
    """
    if not len(spans[0]) or not len(others[0]):
        return spans
    edges = np.unique(np.concatenate([*spans, *others]))
    start, end = edges[:-1], edges[1:]
    middle = 0.5 * (start + end)
    kept = _covers(spans, middle) & ~_covers(others, middle)
    return union(start[kept], end[kept])


def _covers(spans: Spans, time_s: FloatArray) -> np.ndarray:
    place = np.searchsorted(spans[0], time_s, side="right") - 1
    return np.asarray((place >= 0) & (time_s < spans[1][np.maximum(place, 0)]))


def series_figure(judged: Sequence[Judged]) -> HealthSeries:
    """Return the quantities over time, by their place among the measures."""
    parts = [HealthSeries.empty()]
    for number, one in enumerate(judged):
        if not one.is_drawn:
            continue
        time_s, value = _worst_of_each(one.time_s, one.evidence.value, is_below=one.measure.is_below)
        parts.append(HealthSeries(measure=np.full(len(time_s), number), time_s=time_s, value=value))
    return joined(parts)


def motors_figure(flight: Flight, motors: Motors, loss: AttitudeLoss) -> HealthMotors:
    """Return the outputs to the motors around the loss of control of attitude."""
    time_s = flight.seconds(motors.time_ns)
    rows = (time_s >= loss.start_s - BEFORE_S) & (time_s <= loss.start_s + AFTER_S)
    count = int(np.count_nonzero(rows))
    parts = [
        HealthMotors(output=np.full(count, one.number), time_s=time_s[rows], value=one.value[rows])
        for one in motors.each
    ]
    return joined([HealthMotors.empty(), *parts])


def _worst_of_each(time_s: FloatArray, value: FloatArray, *, is_below: bool) -> tuple[FloatArray, FloatArray]:
    """Return the worst known value of each stretch of rows, at its time.

    All rows where they are few.
    """
    if len(value) <= MOST_POINTS:
        return time_s, value
    width = -(-len(value) // MOST_POINTS)
    room = np.full(-len(value) % width, np.nan)
    table = np.concatenate([value, room]).reshape(-1, width)
    sought = np.where(np.isfinite(table), -table if is_below else table, -np.inf)
    row = np.arange(len(table)) * width + np.argmax(sought, axis=1)
    row = np.minimum(row, len(value) - 1)
    return time_s[row], value[row]
