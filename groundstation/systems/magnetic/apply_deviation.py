"""``run --apply``: add a deviation to the magnetic heading of the log.

The deviation is the flight's own or another's.
"""

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from groundstation.base.dataclasses import dataclass
from groundstation.base.errors import NotAssessableError
from groundstation.base.findings import Finding, Severity
from groundstation.base.records import Column, RecordBatch
from groundstation.results.flight import FlightResults
from groundstation.results.roles import AzimuthByTurns, Delays, HeadingByTrack, KindOfIns
from groundstation.systems.applied import APPLIED as APPLIED_END
from groundstation.systems.applied import Applied, ApplyStep, Derived
from groundstation.systems.known import Known
from groundstation.systems.magnetic.answer import MagneticResult
from groundstation.systems.magnetic.arrays import CorrectedHeadingRows
from groundstation.systems.magnetic.deviation_answer import (
    Deviation,
    deviation_of,
    flux_deviation_of,
)
from groundstation.systems.magnetic.deviation_to_apply import Apply, asked_for
from groundstation.systems.magnetic.flux_answer import FluxDeviation
from groundstation.systems.magnetic.settings import MagneticSettings
from groundstation.tables.table import Flight

if TYPE_CHECKING:
    from groundstation.systems.magnetic.corrected import CorrectedHeading

TOPIC = "corrected_heading"
APPLIED, NOT_APPLIED = f"magnetic{APPLIED_END}", "magnetic.not_applied"
MOST_DRAWN = 20_000


@dataclass(frozen=True)
class AppliedDeviation:
    """Result of ``--apply``: results with their findings, and the corrected heading, if any."""

    results: FlightResults
    deviation: Deviation | None = None
    corrected: "CorrectedHeading | None" = None


def apply_deviation(flight: Flight, results: FlightResults, asked: Apply, known: Known) -> AppliedDeviation:
    """Add a deviation to the magnetic heading of a flight.

    A finding says what was done, or why nothing was.

    Parameters
    ----------
    flight : Flight
    results : FlightResults
        All answers of the flight: its own deviation, latencies, kind and error of the INS.
    asked : Apply
    known : Known
        Settings and aircraft.

    Returns
    -------
    AppliedDeviation
        ``results`` with the findings and, where it was applied, the figure ``corrected_heading``.
    """
    from groundstation.systems.magnetic.corrected import correct_heading

    is_own = asked.deviation is None
    deviation = asked.deviation or _own(results)
    if deviation is None:
        return _not_applied(results, "this flight has none of its own", "info")
    whose = "the flight's own deviation" if is_own else f"the deviation of {deviation.title}"
    if deviation.verdict == "reject":
        why = f" ({deviation.verdict_reason})" if deviation.verdict_reason else ""
        return _not_applied(results, f"{whose} is rejected{why}", "warn")
    if deviation.is_of_heading and deviation.verdict != "accept":
        why = f" ({deviation.verdict_reason})" if deviation.verdict_reason else ""
        return _not_applied(results, f"{whose} is {deviation.verdict}{why}", "info")
    try:
        corrected = correct_heading(
            flight, deviation, settings=known.settings_of(MagneticSettings), latencies=results.answer_meeting(Delays)
        )
    except NotAssessableError as error:
        return _not_applied(results, str(error).removeprefix("magnetic: "), "info")
    findings = [_told(corrected, deviation, whose)]
    if not is_own:
        findings += [*_other_aircraft(results, deviation), *_judged(flight, results, corrected, known)]
    figures = (*results.figures, _figure(flight, corrected))
    return AppliedDeviation(
        replace(results, findings=(*results.findings, *findings), figures=figures), deviation, corrected
    )


def _own(results: FlightResults) -> Deviation | None:
    found, by_heading = results.answer(MagneticResult), results.answer(FluxDeviation)
    whose = results.flight_id, results.metadata.get("aircraft", "")
    if found is None and by_heading is not None:
        return flux_deviation_of(by_heading, *whose)
    return deviation_of(found, *whose) if found else None


def _not_applied(results: FlightResults, reason: str, severity: Severity) -> AppliedDeviation:
    finding = Finding(severity, NOT_APPLIED, f"no magnetic deviation applied: {reason}")
    return AppliedDeviation(replace(results, findings=(*results.findings, finding)))


def _told(corrected: "CorrectedHeading", deviation: Deviation, whose: str) -> Finding:
    from groundstation.base.signals import kind_of

    how = {"iron": "its iron", "table": "its table", "coefficients": "its coefficients A to E"}[corrected.way]
    parts = [f"{whose} ({deviation.method}, {deviation.verdict}) applied to {corrected.topic} by {how}"]
    parts.append(f"{len(corrected)} headings")
    if kind_of(corrected.topic) == "ins" and deviation.magnetometer_topic and not deviation.is_of_heading:
        parts.append(f"it was found for {deviation.magnetometer_topic}: correct only if that is the same sensor")
    if corrected.lacks_current:
        parts.append("it depends on a current that this log lacks: that of its figures is assumed")
    if not corrected.model:
        parts.append("no true heading: the declination needs a date and a position")
    return Finding("info", APPLIED, "; ".join(parts), corrected.topic)


def _other_aircraft(results: FlightResults, deviation: Deviation) -> list[Finding]:
    mine = results.metadata.get("aircraft", "")
    if not mine or not deviation.aircraft or mine == deviation.aircraft:
        return []
    text = f"the deviation of {deviation.aircraft} was applied to {mine}: each aircraft has its own"
    return [Finding("warn", "magnetic.other_aircraft", text)]


def _judged(flight: Flight, results: FlightResults, corrected: "CorrectedHeading", known: Known) -> list[Finding]:
    """Return findings on whether the corrected heading is nearer to that of the flight's INS.

    The comparison is with the heading before the deviation was added.
    """
    from groundstation.systems.magnetic.corrected import judge

    known_ins = results.answer_meeting(KindOfIns)
    found = judge(
        flight,
        corrected,
        known.phases,
        kinds=known_ins.kinds if known_ins else {},
        ins_error_deg=ins_error_deg(results, corrected.ins_topic),
        aircraft=known.aircraft,
        settings=known.settings_of(MagneticSettings),
    )
    if found is None:
        return []
    residual, count = found
    text = (
        f"magnetic heading plus declination minus INS true heading in level flight: {residual.before:.2f} deg RMS "
        f"before, {residual.after:.2f} after the deviation was applied ({count} headings of {corrected.topic})"
    )
    if residual.after <= residual.before:
        return [Finding("info", "magnetic.applied_better", text, corrected.topic)]
    return [Finding("warn", "magnetic.applied_worse", f"{text}: it does not fit this flight", corrected.topic)]


def ins_error_deg(results: FlightResults, ins_topic: str) -> float:
    """Return the error of the INS heading where it is known.

    The error is known at the figure, from taxi, or from turns in flight.
    """
    from groundstation.systems.magnetic.alignment import refused

    magnetic, heading = results.answer(MagneticResult), results.answer_meeting(HeadingByTrack)
    if magnetic is not None and magnetic.ins_topic == ins_topic:
        return magnetic.alignment.error_deg
    if heading is not None and heading.ins_topic == ins_topic and not refused(heading):
        error_deg, _sigma_deg = heading.azimuth
        return error_deg if np.isfinite(error_deg) else 0.0
    flown = results.answer_meeting(AzimuthByTurns)
    azimuth = flown.azimuth if flown is not None and flown.ins_topic == ins_topic else None
    return azimuth.error_deg or 0.0 if azimuth is not None else 0.0


def _figure(flight: Flight, corrected: "CorrectedHeading") -> CorrectedHeadingRows:
    from groundstation.systems.magnetic.corrected import thinned

    drawn = thinned(corrected, MOST_DRAWN)
    return CorrectedHeadingRows(
        time_s=flight.seconds(drawn.at_ns),
        magnetic_heading_deg=drawn.magnetic_heading_deg,
        uncorrected_magnetic_heading_deg=drawn.uncorrected_deg,
        deviation_deg=drawn.deviation_deg,
        true_heading_deg=drawn.true_heading_deg,
    )


def _fields(corrected: "CorrectedHeading") -> dict[str, np.ndarray]:
    return {
        "magnetic_heading_deg": corrected.magnetic_heading_deg,
        "uncorrected_magnetic_heading_deg": corrected.uncorrected_deg,
        "deviation_deg": corrected.deviation_deg,
        "true_heading_deg": corrected.true_heading_deg,
    }


def derived_of(flight: Flight, applied: AppliedDeviation) -> Derived | None:
    """Return the records of the corrected heading, None where nothing was applied."""
    corrected, deviation = applied.corrected, applied.deviation
    if corrected is None or deviation is None:
        return None
    return Derived(_batch(flight, corrected), _origin(corrected, deviation))


def _batch(flight: Flight, corrected: "CorrectedHeading") -> RecordBatch:
    table = flight[corrected.topic]
    time_ns = table.time_ns[corrected.rows]
    columns = {name: Column(values, _present(values)) for name, values in _fields(corrected).items()}
    return RecordBatch(
        TOPIC,
        table.record_index[corrected.rows],
        table.device_time_ns.take(corrected.rows),
        {name: column for name, column in columns.items() if column.mask.any()},
        time_ns,
        None if np.array_equal(time_ns, corrected.at_ns) else corrected.at_ns,
    )


def _present(values: np.ndarray) -> np.ndarray | None:
    known = np.isfinite(values)
    return None if known.all() else known


def _origin(corrected: "CorrectedHeading", deviation: Deviation) -> dict[str, str]:
    """Return whose deviation was added, by which method, to which heading."""
    told = {
        "deviation.flight": deviation.flight_id,
        "deviation.aircraft": deviation.aircraft,
        "deviation.method": deviation.method,
        "deviation.verdict": deviation.verdict,
        "deviation.verdict_reason": deviation.verdict_reason,
        "deviation.applied_by": corrected.way,
        "deviation.applied_to": corrected.topic,
        "deviation.ins": corrected.ins_topic,
        "deviation.sense": "magnetic heading = uncorrected magnetic heading + deviation, east positive",
    }
    if corrected.model:
        told[f"derived.{TOPIC}.true_heading_deg"] = f"magnetic heading + declination of {corrected.model}"
    return {name: text for name, text in told.items() if text}


def _run(flight: Flight, results: FlightResults, asked: Apply, known: Known) -> Applied:
    done = apply_deviation(flight, results, asked, known)
    return Applied(done.results, derived_of(flight, done))


STEP = ApplyStep(asked_for, _run)
