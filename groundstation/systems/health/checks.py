"""Verdict of each check, from its evidence.

Shares of time in the air, worst span, and the threshold behind it.
"""

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from groundstation.base.dataclasses import dataclass
from groundstation.base.records import Int64Array
from groundstation.base.units import NS_PER_S
from groundstation.systems.health.answer import FIRST, LOGGED_BLANK, Check, Measure, Verdict
from groundstation.systems.health.evidence import Event, Evidence, FloatArray, Spans
from groundstation.systems.health.limits import Threshold
from groundstation.tables.table import Flight

CHECKS: Mapping[str, str] = {  # in the order they are told
    "gnss": "GNSS quality",
    "interference": "jamming and spoofing",
    "innovations": "filter innovations",
    "resets": "resets and estimators against each other",
    "switches": "switches of estimator or sensor",
    "vibration": "vibration",
    "clipping": "accelerometer clipping",
    "imu": "IMU bias, IMU against IMU",
    "magnetometer": "magnetometer",
    "yaw": "yaw against the compass",
    "faults": "faults and failsafes",
    "timing": "timing and log",
    "battery": "battery and supply",
    "link": "remote control and data link",
    "tracking": "attitude and rate against setpoint",
    "saturation": "actuator saturation",
    "settings": "settings against what was found",
}
ORDER: tuple[Verdict, ...] = ("not_logged", "pass", "warn", "fail")
HOLD_STEPS, SHORTEST_HOLD_S, LONGEST_HOLD_S = 3.0, 2.0, 10.0  # how long a sample speaks
EVENTS_TOLD = 3
TOLD_AS_INFORMATION = ("switches",)  # what a check that passes tells of its messages
LEAST_PAUSE_S = 2.0  # of the log: without a sample of anything judged
ONLY_FLOWN = ("tracking", "saturation")  # on the ground nothing follows its setpoints


@dataclass(frozen=True, eq=False)
class Judged:
    """Evidence with its grade over time, arrays of shape (n,).

    Grades: 0 fine, 1 amber, 2 red, -1 absent.
    """

    evidence: Evidence
    measure: Measure
    time_s: FloatArray
    until_s: FloatArray
    grade: np.ndarray
    in_air: np.ndarray
    is_drawn: bool = True


def judge(
    flight: Flight,
    evidence: Iterable[Evidence],
    events: Sequence[Event],
    air: Spans,
    limits: Mapping[str, Threshold],
) -> tuple[tuple[Check, ...], tuple[Judged, ...]]:
    """Judge a flight.

    Parameters
    ----------
    flight : Flight
    evidence, events
        Of one autopilot, in any order.
    air : Spans
        What counts for the verdicts.
    limits : mapping
        Thresholds by quantity.

    Returns
    -------
    checks : tuple of Check
        One of each key of :data:`CHECKS`; one without anything logged in the spans is ``not_logged``.
    judged : tuple of Judged
        The evidence behind them.
    """
    end_ns = flight.start_ns + round(flight.duration_s * NS_PER_S)
    clocks: dict[int, _Clock] = {}  # several quantities share the rows of a topic
    judged = []
    blanks: dict[str, list[str]] = {}
    for each in evidence:
        if each.check in ONLY_FLOWN and not air.is_flown:
            continue
        if each.blank:
            blanks.setdefault(each.check, []).append(each.blank)
            continue
        if id(each.time_ns) not in clocks:
            clocks[id(each.time_ns)] = _clock(each.time_ns, air, end_ns)
        one = _judged(flight, each, air, limits[each.quantity], clocks[id(each.time_ns)])
        judged += [] if one is None else [one]
    order = {key: place for place, key in enumerate(CHECKS)}
    judged.sort(key=lambda one: order[one.measure.check])  # as the measures of the checks
    checks = []
    for key, title in CHECKS.items():
        measures = tuple(one.measure for one in judged if one.measure.check == key)
        mine = [one for one in events if one.check == key]
        checks.append(_with_blanks(_check(flight, key, title, measures, mine, air), blanks.get(key, ())))
    return tuple(checks), tuple(judged)


def logged(evidence: Iterable[Evidence], events: Iterable[Event], air: Spans) -> frozenset[str]:
    """Return the keys of the checks that have something logged in the spans."""
    found = {one.check for one in events if bool(air.hold(np.array([one.time_ns]))[0])}
    for one in evidence:
        is_judged = air.is_flown or one.check not in ONLY_FLOWN
        if one.check not in found and is_judged and bool((np.isfinite(one.value) & air.hold(one.time_ns)).any()):
            found.add(one.check)
    return frozenset(found)


@dataclass(frozen=True, eq=False)
class _Clock:
    """Rows of a topic: until when each speaks, and for how many seconds.

    ``seconds`` are those of the judged spans, ``all_s`` all; ``in_air`` are the rows that lie in the spans.
    """

    time_ns: Int64Array
    until_ns: Int64Array
    seconds: FloatArray
    all_s: FloatArray
    in_air: np.ndarray


def pauses(evidence: Iterable[Evidence]) -> tuple[Int64Array, Int64Array]:
    """Return start and end of the pauses of a log.

    In them nothing that is judged has a sample, for longer than a sample of the fastest of it speaks.
    """
    clocks = {id(one.time_ns): one.time_ns for one in evidence if one.check != "timing" and len(one.time_ns)}
    if not clocks:
        return np.zeros(0, dtype=np.int64), np.zeros(0, dtype=np.int64)
    least_ns = max(round(LEAST_PAUSE_S * NS_PER_S), min(_hold_ns(one) for one in clocks.values()))
    every = np.unique(np.concatenate(list(clocks.values())))
    rows = np.flatnonzero(np.diff(every) > least_ns)
    return every[rows], every[rows + 1]


def _hold_ns(time_ns: Int64Array) -> int:
    """Return how long a sample speaks at most."""
    step_ns = float(np.median(np.diff(time_ns))) if len(time_ns) > 1 else 0.0
    return int(np.clip(HOLD_STEPS * step_ns, SHORTEST_HOLD_S * NS_PER_S, LONGEST_HOLD_S * NS_PER_S))


def _clock(time_ns: Int64Array, air: Spans, end_ns: int) -> _Clock:
    hold_ns = _hold_ns(time_ns)
    last_ns = time_ns[-1] + (min(int(np.median(np.diff(time_ns))), hold_ns) if len(time_ns) > 1 else 0)
    until_ns = np.minimum(np.append(time_ns[1:], last_ns), time_ns + hold_ns)
    until_ns = np.minimum(until_ns, np.maximum(end_ns, time_ns))  # nothing speaks beyond the log
    seconds = air.until(until_ns) - air.until(time_ns)
    return _Clock(time_ns, until_ns, seconds, (until_ns - time_ns) / NS_PER_S, air.hold(time_ns))


def _judged(flight: Flight, evidence: Evidence, air: Spans, limit: Threshold, clock: _Clock) -> Judged | None:
    """Judge one quantity; None where nothing of it is logged."""
    known = np.isfinite(evidence.value)
    if not known.any():
        return None
    time_ns, until_ns = clock.time_ns, clock.until_ns
    grade = np.where(known, _grades(evidence.value, limit), -1)
    if limit.hold_s > 0.0:
        grade = _lasting(time_ns, until_ns, grade, round(limit.hold_s * NS_PER_S))
    measure = _measure(flight, evidence, limit, grade, clock, air)
    if limit.rule == "rise":  # its lane shows when it rose; how long that lasts says nothing
        grade = np.where(known, _rises(evidence.value, clock.in_air, limit), -1)
    return Judged(
        evidence, measure, flight.seconds(time_ns), flight.seconds(until_ns), grade, clock.in_air, limit.is_drawn
    )


def _grades(value: FloatArray, limit: Threshold) -> np.ndarray:
    """Return the grade of each sample; a counter has none of its own."""
    grade = np.zeros(len(value), dtype=np.int8)
    if limit.rule == "rise":
        return grade
    with np.errstate(invalid="ignore"):
        for level, above, below in ((1, limit.amber, limit.amber_below), (2, limit.red, limit.red_below)):
            if above is not None:
                grade[value > above] = level
            if below is not None:
                grade[value < below] = level
    return grade


def _lasting(time_ns: np.ndarray, until_ns: np.ndarray, grade: np.ndarray, hold_ns: int) -> np.ndarray:
    """Lower the grade where it does not last ``hold_ns``."""
    out = np.where(grade > 0, 0, grade)
    for level in (1, 2):
        first, last = _runs(time_ns, until_ns, grade >= level)
        for start, end in zip(first, last, strict=True):
            if until_ns[end] - time_ns[start] >= hold_ns:
                out[start : end + 1] = np.where(out[start : end + 1] >= 0, level, -1)
    return out


def _runs(time_ns: np.ndarray, until_ns: np.ndarray, is_true: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return first and last row of each stretch of true rows without a gap in time."""
    rows = np.flatnonzero(is_true)
    if not rows.size:
        return rows, rows
    breaks = (np.diff(rows) > 1) | (time_ns[rows[1:]] > until_ns[rows[:-1]])
    starts = np.concatenate([[0], np.flatnonzero(breaks) + 1])
    ends = np.append(starts[1:], len(rows)) - 1
    return rows[starts], rows[ends]


def _measure(
    flight: Flight, evidence: Evidence, limit: Threshold, grade: np.ndarray, clock: _Clock, air: Spans
) -> Measure:
    value, time_ns, until_ns = evidence.value, clock.time_ns, clock.until_ns
    known = np.isfinite(value)
    seconds, all_s = np.where(known, clock.seconds, 0.0), np.where(known, clock.all_s, 0.0)
    logged_s, whole_s = float(seconds.sum()), float(all_s.sum())
    flown = known & clock.in_air
    shares = {
        name: float(weight[grade >= level].sum() / total) if total > 0.0 else None
        for name, level, weight, total in (
            ("amber_share", 1, seconds, logged_s),
            ("red_share", 2, seconds, logged_s),
            ("amber_share_log", 1, all_s, whole_s),
            ("red_share_log", 2, all_s, whole_s),
        )
    }
    mean = _mean(value, seconds, flown)
    among = _lasting_rows(grade, flown if flown.any() else known, limit)
    figure = _figure(value, seconds, flown, limit, among)
    verdict: Verdict = "not_logged"
    if logged_s > 0.0 and figure is not None and limit.is_judged:
        verdict = _verdict(figure, shares["amber_share"] or 0.0, shares["red_share"] or 0.0, limit)
        if verdict == "pass" and limit.amber_mean is not None and mean is not None and mean > limit.amber_mean:
            verdict = "warn"
    worst_row = _worst_row(value, among, limit)
    start, end = _worst_span(time_ns, until_ns, grade, seconds)
    return Measure(
        check=evidence.check,
        quantity=evidence.quantity,
        title=limit.title,
        sensor=evidence.sensor,
        source=evidence.source,
        unit=evidence.unit or limit.unit,
        verdict=verdict,
        rule=limit.rule,
        figure=figure,
        worst=float(value[worst_row]),
        worst_at_s=float(flight.seconds(time_ns[worst_row : worst_row + 1])[0]),
        median=float(np.median(value[flown])) if flown.any() else None,
        mean=mean,
        **shares,
        logged_share=min(logged_s / air.seconds, 1.0) if air.seconds > 0.0 else 0.0,
        span_start_s=None if start is None else float(flight.seconds(time_ns[start : start + 1])[0]),
        span_end_s=None if end is None else float(flight.seconds(until_ns[end : end + 1])[0]),
        amber=limit.amber if limit.amber is not None else limit.amber_below,
        red=limit.red if limit.red is not None else limit.red_below,
        is_below=limit.is_below,
        threshold_source=limit.source,
        is_flag=not limit.is_drawn and limit.rule == "share",
    )


def _lasting_rows(grade: np.ndarray, among: np.ndarray, limit: Threshold) -> np.ndarray:
    """Return the rows whose worst value is told.

    Where a limit counts only after some time, the rows that did count, if there are any: the worst value then lies in
    a span that is told, and a shorter peak elsewhere does not stand beside a green lane.
    """
    worst = int(grade[among].max(initial=0))
    return among & (grade == worst) if limit.hold_s > 0.0 and worst > 0 else among


def _figure(
    value: FloatArray, seconds: FloatArray, flown: np.ndarray, limit: Threshold, among: np.ndarray
) -> float | None:
    """Return the number that the limits judge.

    Worst value, median, mean over time, or the rise of a counter.
    """
    if not flown.any():
        return None
    if limit.rule == "median":
        return float(np.median(value[flown]))
    if limit.rule == "mean":
        return _mean(value, seconds, flown)
    if limit.rule == "rise":
        return rise(value, flown)
    return float(value[_worst_row(value, among, limit)])


def _mean(value: FloatArray, seconds: FloatArray, flown: np.ndarray) -> float | None:
    """Return the mean over time of the rows that were flown."""
    total = float(seconds[flown].sum())
    return float(value[flown] @ seconds[flown]) / total if total > 0.0 else None


def rise(value: FloatArray, flown: np.ndarray) -> float:
    """Return how far a counter rose in the rows that were flown.

    A step counts where both its ends are known and it ends in the air; one backwards is a counter that began again.

    Examples
    --------
    >>> rise(np.array([5.0, 5.0, 7.0, 1.0, np.nan, 2.0]), np.array([False, True, True, True, False, True]))
    4.0
    """
    rows, steps = _steps(value)
    return float(steps[flown[rows]].sum())


def _steps(value: FloatArray) -> tuple[Int64Array, FloatArray]:
    """Return the rows to which a counter stepped, and by how much.

    One that began again steps from 0.
    """
    known = np.flatnonzero(np.isfinite(value))
    steps = np.diff(value[known])
    return known[1:], np.where(steps < 0.0, value[known][1:], steps)


def _rises(value: FloatArray, in_air: np.ndarray, limit: Threshold) -> np.ndarray:
    """Return the grade of the samples at which a counter rose.

    It is by how far the counter has risen until then: in the air by what it rose there, as the check counts it.
    """
    grade = np.zeros(len(value), dtype=np.int8)
    rows, steps = _steps(value)
    flown = in_air[rows]
    risen = np.where(flown, np.cumsum(np.where(flown, steps, 0.0)), np.cumsum(steps))
    for level, above in ((1, limit.amber), (2, limit.red)):
        if above is not None:
            grade[rows[(steps > 0.0) & (risen > above)]] = level
    return grade


def _worst_row(value: FloatArray, among: np.ndarray, limit: Threshold) -> int:
    rows = np.flatnonzero(among & np.isfinite(value))
    is_low = limit.is_below and limit.rule != "rise"
    return int(rows[np.argmin(value[rows]) if is_low else np.argmax(value[rows])])


def _worst_span(
    time_ns: np.ndarray, until_ns: np.ndarray, grade: np.ndarray, seconds: FloatArray
) -> tuple[int | None, int | None]:
    """Return first and last row of the longest red stretch in the air.

    Of the longest amber one where none is red.
    """
    for level in (2, 1):
        first, last = _runs(time_ns, until_ns, (grade >= level) & (seconds > 0.0))
        if len(first):
            longest = int(np.argmax(until_ns[last] - time_ns[first]))
            return int(first[longest]), int(last[longest])
    return None, None


def _verdict(figure: float, amber_share: float, red_share: float, limit: Threshold) -> Verdict:
    if limit.rule != "share":
        over = (limit.amber, limit.red)
        is_over = [one is not None and figure > one for one in over]
        return "fail" if is_over[1] else "warn" if is_over[0] else "pass"
    if _beyond(amber_share, limit.fail_amber) or _beyond(red_share, limit.fail_red):
        return "fail"
    return "warn" if _beyond(amber_share, limit.warn_amber) or _beyond(red_share, limit.warn_red) else "pass"


def _beyond(share: float, limit: float | None) -> bool:
    return limit is not None and share > limit


def worst_of(verdicts: Iterable[Verdict]) -> Verdict:
    """Return the worst verdict; ``not_logged`` where there is none.

    Examples
    --------
    >>> worst_of(("pass", "not_logged", "warn")), worst_of(())
    ('warn', 'not_logged')
    """
    return max(verdicts, key=ORDER.index, default="not_logged")


def verdict_of(checks: Sequence[Check]) -> Verdict:
    """Return the verdict of a flight: the worst of its checks.

    A log without GNSS, filter and vibration passes nothing by the little that it holds.
    """
    verdict = worst_of(one.verdict for one in checks)
    is_known = any(one.key in FIRST and one.verdict != "not_logged" for one in checks)
    return "not_logged" if verdict == "pass" and not is_known else verdict


def _check(
    flight: Flight, key: str, title: str, measures: tuple[Measure, ...], events: Sequence[Event], air: Spans
) -> Check:
    """Put the measures and events of one check together.

    The worst verdict is that of the check.
    """
    time_ns = np.array([one.time_ns for one in events], dtype=np.int64)
    flown = air.hold(time_ns) if len(events) else np.zeros(0, dtype=bool)
    graded: dict[str, Verdict] = {"info": "pass", "warn": "warn", "fail": "fail"}
    told = [(graded[one.grade], one) for one, in_air in zip(events, flown, strict=True) if in_air]
    verdict = worst_of([*(one.verdict for one in measures), *(grade for grade, _ in told)])
    decisive = next((one for one in measures if one.verdict == verdict), None) if verdict != "not_logged" else None
    is_told = verdict != "pass" or key in TOLD_AS_INFORMATION
    texts = [one.text for grade, one in told if grade == verdict and is_told]
    return Check(
        key=key,
        title=title,
        verdict=verdict,
        reason=_reason(verdict, decisive, texts, measures, air.words),
        measures=measures,
        events_in_air=sum(grade != "pass" for grade, _ in told),
        first_event_s=next(
            (float(flight.seconds(np.array([one.time_ns]))[0]) for grade, one in told if grade == verdict != "pass"),
            None,
        ),
    )


def _with_blanks(check: Check, blanks: Sequence[str]) -> Check:
    """Return a check with what is logged of it without a value in its reason."""
    told = "; ".join(blanks)
    if check.verdict == "not_logged" and not check.measures and told:
        return replace(check, reason=f"{LOGGED_BLANK}{told}")
    return replace(check, reason="; ".join(filter(None, (check.reason, told))))


def _reason(
    verdict: Verdict, decisive: Measure | None, texts: Sequence[str], measures: Sequence[Measure], over: str
) -> str:
    if verdict == "not_logged":
        if any(one.is_unjudged for one in measures):
            return "not judged: no limit in the log"
        if any(one.median is not None for one in measures):
            return "logged at one moment alone: no time to judge"
        return f"logged, but not {over}" if measures else ""
    if texts:
        counts = Counter(texts)
        told = [text if count == 1 else f"{text} ({count} times)" for text, count in counts.items()]
        more = f" and {len(told) - EVENTS_TOLD} more" if len(told) > EVENTS_TOLD else ""
        return "; ".join(told[:EVENTS_TOLD]) + more
    return "" if decisive is None or verdict == "pass" else decisive.told
