"""Rows, checks, forecast skill and samples that one flight adds to the fleet.

Each is made from what the flight saved.
"""

import math
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from groundstation.base.angles import wrap_180
from groundstation.base.records import MAX_TEXT_CHARACTERS
from groundstation.base.signals import topics_of_kind
from groundstation.base.units import ARCMIN_PER_DEG
from groundstation.methods.fleet.density import SampleHistogram, histogram_of
from groundstation.methods.fleet.moments import Moments, moments_of
from groundstation.methods.fleet.skill import SkillOfFlight
from groundstation.pipeline.many_flights.fleet.columns import FLIGHT_COLUMNS, Check, FlightShare, answer_values
from groundstation.pipeline.many_flights.fleet.samples import FleetSamples, SampleStore
from groundstation.reports.index import index_row, reasons_of
from groundstation.results.columns import Kind
from groundstation.results.files import SavedFlight, load, mapping, utf8_text
from groundstation.results.fleet import SessionRow
from groundstation.results.installations import Lesson
from groundstation.systems import systems
from groundstation.systems.cooperative.answer import CooperativeResult
from groundstation.systems.cooperative.chapter import REFERENCE, trusted
from groundstation.systems.heading.answer import HeadingResult
from groundstation.systems.heading.arrays import HeadingSamples
from groundstation.systems.heading.figures import IN_PAUSE
from groundstation.systems.heading.installation.lesson import lesson_of_flight
from groundstation.systems.heading.references import REFERENCE_SIGMA_DEG, logged_reference
from groundstation.systems.inertial.forecast_answer import TOO_FEW, WITHIN, CalibrationRow, ForecastResult, honesty
from groundstation.systems.reference.answer import ReferenceResult
from groundstation.systems.reference.arrays import ReferenceChecks
from groundstation.tables.session_tracks import aircraft_named

FloatArray = NDArray[np.float64]
NORMAL_95 = 1.959964
LARGEST = 1e15  # no figure of a flight is larger: what is comes from a file that is damaged
LATEST_NS = 7_000_000_000_000_000_000  # 2191: times of samples must fit beside the start


def to_number(value: Any) -> float:
    """A JSON value as a float; NaN when it is no finite number, or an absurd one.

    Examples
    --------
    >>> to_number(3), to_number("3"), to_number(True), to_number(None), to_number(10**400)
    (3.0, nan, nan, nan, nan)
    """
    if not isinstance(value, int | float) or isinstance(value, bool):
        return math.nan
    return float(value) if abs(value) <= LARGEST else math.nan


def flight_row(saved: SavedFlight, samples: FleetSamples | None) -> dict[str, Any]:
    """Build the row of a flight.

    It has a value for every one of :data:`FLIGHT_COLUMNS`, of the type of its kind.
    """
    results = saved.results
    start = results.start_utc_ns
    start = start if start is not None and abs(start) < LATEST_NS else None
    moments = samples.moments if samples is not None else Moments()
    found: dict[str, Any] = vars(index_row(saved)) | {
        "flight_id": saved.folder.name,
        "start_utc": start,
        "month": "" if start is None else str(np.datetime64(start, "ns").astype("datetime64[M]")),
        "has_lost_data": results.ledger.loses_data,
        "not_assessable": "; ".join(reasons_of(results)),
        **answer_values(results),
    }
    if moments.count:
        found |= {"samples": moments.count, "sample_mean_deg": moments.mean, "sample_m2_deg2": moments.m2}
    return {column.name: _typed(column.kind, found.get(column.name)) for column in FLIGHT_COLUMNS}


def _typed(kind: Kind, value: Any) -> Any:
    if kind in ("number", "count"):
        return to_number(value)
    if kind in ("flag", "time"):
        return value
    return "" if value is None else utf8_text(value)[:MAX_TEXT_CHARACTERS]


def heading_samples(saved: SavedFlight) -> FleetSamples | None:
    """The heading samples a flight saved, None when it has none.

    Raises
    ------
    UnreadableLogError
        When their file is broken.
    """
    figure = saved.rows_of(HeadingSamples)
    if figure is None:
        return None
    epochs = figure.where(figure.gate != IN_PAUSE)
    difference, used = epochs.difference_deg, epochs.is_used
    heading = saved.results.answer(HeadingResult)
    centre = float(np.nan_to_num(wrap_180(to_number(heading.error_deg if heading else None))))
    about_estimate = centre + wrap_180(difference[used] - centre)
    columns: dict[str, NDArray[Any]] = {
        "time_s": epochs.time_s,
        "segment": epochs.segment.astype(np.float64),
        "heading_deg": epochs.heading_deg,
        "track_deg": epochs.track_deg,
        "ground_speed_mps": epochs.ground_speed_mps,
        "weight": epochs.weight,
        "error_deg": difference,
        "used": used,
        "gate": epochs.gate,
    }
    return FleetSamples(columns, moments_of(about_estimate), histogram_of(about_estimate))


def session_row(saved: SavedFlight) -> SessionRow:
    """Build the row of a session: what its report says on top."""
    results, indexed = saved.results, index_row(saved, "session")
    row = SessionRow(
        saved.folder.name,
        indexed.aircraft or "",
        results.start_utc_ns,
        to_number(results.duration_s),
        results.status,
        findings_fail=indexed.findings_fail or 0,
        findings_warn=indexed.findings_warn or 0,
        reason="; ".join(reasons_of(results)),
        report=indexed.report or "",
        recording=indexed.recording or "",
    )
    answer = results.answer(CooperativeResult)
    if answer is None or not answer.algorithms:
        return row
    best, reckoned = trusted(answer), next((one for one in answer.algorithms if one.algorithm == REFERENCE), None)
    return replace(
        row,
        algorithm=best.algorithm,
        two_sigma_r_m=best.two_sigma_r_m,
        reckoned_two_sigma_r_m=reckoned.two_sigma_r_m if reckoned else None,
        rms_m=best.rms_m,
        is_consistent=best.is_consistent,
        diverges=best.diverges,
    )


def checks_of(saved: SavedFlight) -> list[Check]:
    """Everything independent that the flight's answers were compared with."""
    heading, reference = saved.results.answer(HeadingResult), saved.results.answer(ReferenceResult)
    found = [] if heading is None else _heading_checks(saved, heading)
    if reference is not None and reference.is_judge:
        verdict = "" if heading is None else heading.verdict
        found += [_check("truth_heading", one.difference_deg, one.sigma_deg, verdict) for one in reference.headings]
        found += _position_checks(saved.rows_of(ReferenceChecks))
    return [check for check in found if check is not None]


def _heading_checks(saved: SavedFlight, heading: HeadingResult) -> list[Check | None]:
    verdict = heading.verdict
    found = [_reference_check(heading, saved.results.metadata)]
    found += [_check("runway", runway.difference_deg, runway.sigma_deg, verdict) for runway in heading.runway]
    if heading.onboard is not None:
        # Steady sideslip is the same in both.
        difference = heading.onboard.difference_error_deg
        found.append(_check("onboard", difference, heading.measured_sigma_deg, verdict))
    return found


def _position_checks(checks: ReferenceChecks | None) -> list[Check | None]:
    """The independent samples of the horizontal positions that claimed something."""
    if checks is None:
        return []
    columns = (checks.subject, checks.quantity, checks.axis)
    rows = zip(*(one.tolist() for one in columns), checks.z, checks.is_inside, strict=True)
    return [
        Check(f"truth_{subject}", float(z), bool(is_inside))
        for subject, quantity, axis, z, is_inside in rows
        if (quantity, axis) == ("position", "horizontal") and math.isfinite(z)
    ]


def _reference_check(heading: HeadingResult, metadata: Mapping[str, str]) -> Check | None:
    reference, residual = logged_reference(metadata), heading.reference_residual_arcmin
    sigma = math.hypot(to_number(heading.parking_sigma_deg), reference.sigma_deg if reference else REFERENCE_SIGMA_DEG)
    return _check("reference", None if residual is None else residual / ARCMIN_PER_DEG, sigma, heading.verdict)


def _check(quantity: str, residual: float | None, sigma: float, verdict: str) -> Check | None:
    residual_deg, sigma_deg = to_number(residual), to_number(sigma)
    if math.isnan(residual_deg) or not sigma_deg > 0.0:
        return None
    is_inside = abs(residual_deg) <= NORMAL_95 * sigma_deg
    return Check(quantity, residual_deg / sigma_deg, is_inside, residual_deg, sigma_deg, verdict)


def skill_of(saved: SavedFlight) -> tuple[str, list[SkillOfFlight]]:
    """The shipped method of a flight and its rows of forecast skill."""
    forecast = saved.results.answer(ForecastResult)
    if forecast is None:
        return "", []
    told = {(row.method, row.horizon_min): _is_within(row) for row in forecast.calibration}
    rows = [
        SkillOfFlight(
            *(row.method, row.horizon_min, row.starts, row.rms_m, to_number(row.coverage95)),
            is_within=told.get((row.method, row.horizon_min)),
        )
        for row in forecast.skill
        if row.starts >= 1 and math.isfinite(to_number(row.horizon_min) + to_number(row.rms_m))
    ]
    return forecast.default_method, rows


def _is_within(row: CalibrationRow) -> bool | None:
    """Tell whether NEES is within its limits.

    None when there are too few starts, or the row is damaged on the disk.
    """
    figures = [to_number(value) for value in (row.independent_starts, row.nees, row.nees_low, row.nees_high)]
    if not all(map(math.isfinite, figures)):
        return None
    says = honesty(int(figures[0]), *figures[1:])
    return None if says == TOO_FEW else says == WITHIN


def share_of(folder: Path, store: SampleStore | None = None) -> FlightShare:
    """Read a flight folder; with ``store`` its heading samples are put there.

    Raises
    ------
    GroundstationError
        When the folder cannot be read.
    OSError
        When the samples cannot be written.
    """
    saved = load(folder, systems().answer_types)
    results, samples = saved.results, heading_samples(saved)
    row = flight_row(saved, samples)
    empty = SampleHistogram(np.zeros(0, np.int32), np.zeros(0, np.int32))
    return FlightShare(
        row,
        index_row(saved, "flight", answer_values(results)),
        samples.histogram if samples is not None else empty,
        *skill_of(saved),
        checks_of(saved),
        saved.manifest.source.path,
        aircraft_named(results.metadata, results.source.name),
        tuple(topic.partition(".")[2] for topic in topics_of_kind("link", tuple(results.ledger.topics))),
        store.put(row, samples) if samples is not None and store is not None else "",
        tuple(part.sha256 for part in saved.manifest.parts[1:]),
        lesson_of(saved),
    )


def lesson_of(saved: SavedFlight) -> Lesson | None:
    """Lesson of a flight on its installation; None where the INS has no serial number."""
    lesson = lesson_of_flight(saved.results, mapping(saved.manifest.configuration, "aircraft"), saved.folder.name)
    return lesson if lesson.ins_serial else None
