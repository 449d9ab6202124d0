"""Increments of the inertial unit of a flight, from the tables of its log."""

import numpy as np
from numpy.typing import NDArray

from groundstation.base.dataclasses import dataclass
from groundstation.base.errors import NotAssessableError
from groundstation.base.signals import topics_of_kind
from groundstation.base.words import counted, listed
from groundstation.systems.trajectory.gathered import ImuFacts, InputNote
from groundstation.systems.trajectory.imu_samples import FEWEST, INTEGRAL, SUBJECT, fields_of, samples_of
from groundstation.systems.trajectory.imu_timing import timed_on_lines, touching_increments
from groundstation.systems.trajectory.input_settings import InputSettings
from groundstation.systems.trajectory.inputs import ImuIncrements
from groundstation.systems.trajectory.unit_checks import ends_of_range, without_stuck
from groundstation.tables.sources import WHOLE_SHARE
from groundstation.tables.table import Flight, Table

FloatArray = NDArray[np.float64]

BRIDGED_SHARE = 1e-3  # of the time, from which on it is told


@dataclass(frozen=True)
class ImuInput:
    """Increments, facts and notes of a unit."""

    imu: ImuIncrements
    facts: ImuFacts
    notes: tuple[InputNote, ...]


def _gap_notes(
    flight: Flight, topic: str, imu: ImuIncrements, gaps_s: FloatArray, settings: InputSettings
) -> list[InputNote]:
    """Return notes on the gaps of a unit, and on those that are pauses of the whole log.

    A gap is a pause as far as nothing was logged; what is left of it is a gap where it is longer than one may be.
    """
    if not gaps_s.size:
        return []
    steps_s = np.diff(imu.time_s) - imu.interval_s[1:]
    rows = np.sort(np.argsort(steps_s)[::-1][: gaps_s.size])
    start_s, end_s = imu.time_s[rows], imu.time_s[rows + 1] - imu.interval_s[rows + 1]
    paused_s = np.zeros(rows.size)
    for one in flight.pauses:
        first_s, last_s = flight.seconds(np.array(one, dtype=np.int64))
        paused_s += np.maximum(np.minimum(end_s, last_s) - np.maximum(start_s, first_s), 0.0)
    is_pause = paused_s > 0.0
    left_s = np.where(is_pause, (end_s - start_s) - paused_s, end_s - start_s)
    left_s = left_s[~is_pause | (left_s > settings.gap_s)]
    notes = []
    if is_pause.any():
        text = f"{counted(is_pause.sum(), 'pause')} of the log while disarmed, {paused_s.sum():.1f} s in all"
        notes.append(InputNote("pauses", text, int(is_pause.sum())))
    if left_s.size:
        text = (
            f"{counted(left_s.size, 'gap')} of {topic}, {left_s.sum():.1f} s in all, the longest {left_s.max():.2f} s"
        )
        notes.append(InputNote("gaps", text, int(left_s.size)))
    return notes


def imu_of(flight: Flight, settings: InputSettings) -> ImuInput:
    """Return the increments of the best inertial unit of a flight.

    Raises
    ------
    NotAssessableError
        Where there is no unit with six axes, or its values are none.
    """
    topic, others = _chosen(flight, settings)
    notes: list[InputNote] = []
    if others:
        notes.append(InputNote("several_units", f"{topic} is used; {listed(others)} not", len(others)))
    samples, integral = samples_of(flight, topic, settings, notes)
    samples = without_stuck(samples, topic, settings, notes)
    clipped, saturated = ends_of_range(samples, notes)
    timed = timed_on_lines(samples, settings)
    notes += timed.notes
    imu, bridged, gaps_s = touching_increments(timed, settings)
    if len(imu) < FEWEST:
        raise NotAssessableError(SUBJECT, f"{topic} has only {counted(len(imu), 'usable sample')}")
    least_s = BRIDGED_SHARE * float(imu.interval_s.sum())
    if samples.repeats_after is not None:
        count = int(samples.repeats_after.sum())
        where = f", the {bridged.repeats_s:.1f} s that they stood for bridged" if bridged.repeats_s > least_s else ""
        text = f"{counted(count, 'sample')} of {topic} repeat{'s' * (count == 1)} the one before: left out{where}"
        notes.append(InputNote("duplicates", text, count))
    if bridged.missing_s > least_s:
        text = f"samples of {topic} are missing in steps below {settings.gap_s:g} s, {bridged.missing_s:.1f} s in all"
        notes.append(InputNote("bridged", f"{text}: bridged"))
    notes += _gap_notes(flight, topic, imu, gaps_s, settings)
    rate_hz = 1.0 / float(np.median(imu.interval_s))
    facts = ImuFacts(
        topic,
        integral,
        rate_hz,
        timed.jitter_s,
        timed.jitter_max_s,
        bridged.missing_s + bridged.repeats_s,
        int(gaps_s.size),
        float(gaps_s.max(initial=0.0)),
        clipped,
        saturated,
    )
    return ImuInput(imu, facts, tuple(notes))


def _chosen(flight: Flight, settings: InputSettings) -> tuple[str, tuple[str, ...]]:
    """Return the topic to use, and the others that could be used.

    Increments come before point samples, a higher rate before a lower one, then the one with more samples, among those
    that cover most of the time of the fullest.
    """
    topics = [one for one in topics_of_kind("imu", flight.topics()) if len(flight[one])]
    named = settings.imu_topic
    if named and named not in topics:
        raise NotAssessableError(SUBJECT, f"no topic {named}")
    if not topics:
        raise NotAssessableError(SUBJECT, "no inertial unit (topic imu) in the log")
    whole = [one for one in topics if fields_of(flight[one])]
    if named:
        whole = [one for one in whole if one == named]
    if not whole:
        raise NotAssessableError(SUBJECT, f"{listed(topics)}: no unit with three gyros and three accelerometers")
    spans_s = {one: _span_s(flight[one]) for one in whole}
    enough = [one for one in whole if spans_s[one] >= WHOLE_SHARE * max(spans_s.values())]

    def key(one: str) -> tuple[bool, float, int]:
        table = flight[one]
        rate_hz = len(table) / max(spans_s[one], 1e-3)
        return fields_of(table) != INTEGRAL, -round(rate_hz, -1 if rate_hz > 20.0 else 0), -len(table)

    best = min(enough, key=key)
    return best, tuple(one for one in whole if one != best)


def _span_s(table: Table) -> float:
    return float(table.time_ns[-1] - table.time_ns[0]) / 1e9
