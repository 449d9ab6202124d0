"""index.json and index.csv: a row for each flight and session of a folder, and for each log that gave none."""

from collections.abc import Iterable
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any, Literal

from groundstation.base.digits import digits_of
from groundstation.base.serial import to_json_exactly
from groundstation.base.timescales import utc_ns_to_iso
from groundstation.chapters.wording import is_number
from groundstation.results.files import SavedFlight, json_text, text_cell, write_text
from groundstation.results.flight import FlightResults
from groundstation.results.forecast import ForecastResult
from groundstation.results.heading import HeadingResult
from groundstation.results.inertial import InertialResult
from groundstation.results.magnetic import MagneticResult
from groundstation.results.summary import SCHEMA_VERSION

INDEX_JSON, INDEX_CSV = "index.json", "index.csv"
Kind = Literal["flight", "session", "failed", "skipped"]
KINDS: tuple[Kind, ...] = ("flight", "session", "failed", "skipped")


@dataclass(frozen=True, kw_only=True)
class IndexRow:
    """One flight or session, or a log that gave none: every row has all columns in this order, None where none applies.

    Answers stand under the names they have in summary.json, with the analysis before them where it is not the heading.
    Of a session there are those of what it is and what was made of it: its answers are its own.
    """

    kind: Kind
    flight_id: str | None = None
    aircraft: str | None = None
    flight: str | None = None
    start_utc: str | None = None
    duration_s: float | None = None
    status: str | None = None
    verdict: str | None = None
    verdict_reason: str | None = None
    error_deg: float | None = None
    standard_error_deg: float | None = None
    confidence95_low_deg: float | None = None
    confidence95_high_deg: float | None = None
    correction_deg: float | None = None
    precision_deg: float | None = None
    quality_deg: float | None = None
    estimate_sd_deg: float | None = None
    samples: int | None = None
    taxi_seconds: float | None = None
    drift_deg_per_h: float | None = None
    parking_heading_deg: float | None = None
    reference_residual_arcmin: float | None = None
    onboard_error_deg: float | None = None
    onboard_difference_deg: float | None = None
    ins_kind: str | None = None
    radial_error_rate_50_nmiph: float | None = None
    radial_error_rate_95_nmiph: float | None = None
    forecast_method: str | None = None
    forecast_30min_rms_m: float | None = None
    forecast_60min_rms_m: float | None = None
    forecast_120min_rms_m: float | None = None
    magnetic_verdict: str | None = None
    magnetic_method: str | None = None
    magnetic_before_rms_deg: float | None = None
    magnetic_after_rms_deg: float | None = None
    magnetic_a_deg: float | None = None
    magnetic_a_sigma_deg: float | None = None
    magnetic_b_deg: float | None = None
    magnetic_b_sigma_deg: float | None = None
    magnetic_c_deg: float | None = None
    magnetic_c_sigma_deg: float | None = None
    magnetic_d_deg: float | None = None
    magnetic_d_sigma_deg: float | None = None
    magnetic_e_deg: float | None = None
    magnetic_e_sigma_deg: float | None = None
    findings_fail: int | None = None
    findings_warn: int | None = None
    findings_info: int | None = None
    not_assessable: tuple[str, ...] | None = None
    reason: str | None = None
    source: str | None = None
    sha256: str | None = None
    summary: str | None = None
    report: str | None = None
    recording: str | None = None
    mcap: str | None = None


COLUMNS = tuple(column.name for column in fields(IndexRow))


def index_row(saved: SavedFlight, kind: Kind = "flight") -> IndexRow:
    """Build the row of one flight or session from what it saved; links are relative to the folder of flights.

    A link is None when the flight folder lacks the file at the time of the call.

    Raises
    ------
    UnreadableLogError
        When the summary lacks what a result needs.
    """
    results = saved.results
    severities = [finding.severity for finding in results.findings]
    return IndexRow(
        kind=kind,
        flight_id=results.flight_id,
        aircraft=results.metadata.get("aircraft", ""),
        flight=results.metadata.get("flight", ""),
        start_utc=None if results.start_utc_ns is None else utc_ns_to_iso(results.start_utc_ns),
        duration_s=results.duration_s,
        status=results.status,
        **_of_heading(results.answer(HeadingResult)),
        **_of_inertial(results.answer(InertialResult)),
        **_of_forecast(results.answer(ForecastResult)),
        **_of_deviation(results.answer(MagneticResult)),
        findings_fail=severities.count("fail"),
        findings_warn=severities.count("warn"),
        findings_info=severities.count("info"),
        not_assessable=reasons_of(results),
        source=results.source.name,
        sha256=results.source.sha256,
        summary=_link(saved, "summary.json"),
        report=_link(saved, "report.html"),
        recording=_link(saved, f"{results.flight_id}.rrd"),
        mcap=_link(saved, f"{results.flight_id}.mcap"),
    )


def reasons_of(results: FlightResults) -> tuple[str, ...]:
    """What was not assessable, each with its reason."""
    return tuple(f"{entry.analysis}: {entry.reason}" for entry in results.not_assessable)


def _link(saved: SavedFlight, name: str) -> str | None:
    return f"{saved.folder.name}/{name}" if (saved.folder / name).exists() else None


def _of_heading(heading: HeadingResult | None) -> dict[str, Any]:
    if heading is None:
        return {}
    onboard = heading.onboard
    return {
        "verdict": heading.verdict,
        "verdict_reason": heading.verdict_reason,
        "error_deg": heading.error_deg,
        "standard_error_deg": heading.standard_error_deg,
        "confidence95_low_deg": heading.confidence95_deg[0],
        "confidence95_high_deg": heading.confidence95_deg[1],
        "correction_deg": heading.correction_deg,
        "precision_deg": heading.precision_deg,
        "quality_deg": heading.quality_deg,
        "estimate_sd_deg": heading.estimate_sd_deg,
        "samples": heading.samples,
        "taxi_seconds": heading.taxi_seconds,
        "drift_deg_per_h": heading.drift_deg_per_h,
        "parking_heading_deg": heading.parking_heading_deg,
        "reference_residual_arcmin": heading.reference_residual_arcmin,
        "onboard_error_deg": onboard.heading_error_deg if onboard else None,
        "onboard_difference_deg": onboard.difference_error_deg if onboard else None,
    }


def _of_inertial(inertial: InertialResult | None) -> dict[str, Any]:
    if inertial is None:
        return {}
    return {
        "ins_kind": inertial.kind,
        "radial_error_rate_50_nmiph": inertial.radial_error_rate_50_nmiph,
        "radial_error_rate_95_nmiph": inertial.radial_error_rate_95_nmiph,
    }


def _of_forecast(forecast: ForecastResult | None) -> dict[str, Any]:
    """The shipped method and its RMS at three horizons, None where they were not replayed."""
    if forecast is None:
        return {}
    rms_m = {row.horizon_min: row.rms_m for row in forecast.skill if row.method == forecast.default_method}
    return {
        "forecast_method": forecast.default_method,
        **{f"forecast_{horizon}min_rms_m": rms_m.get(horizon) for horizon in (30, 60, 120)},
    }


def _of_deviation(magnetic: MagneticResult | None) -> dict[str, Any]:
    """Verdict, errors before and after, and the coefficients of the method that is recommended."""
    if magnetic is None:
        return {}
    residual, method = magnetic.residual_rms_deg, magnetic.method(magnetic.recommended_method)
    sigmas = method.coefficients_sigma_deg
    return {
        "magnetic_verdict": magnetic.verdict,
        "magnetic_method": magnetic.recommended_method,
        "magnetic_before_rms_deg": residual.before if residual else None,
        "magnetic_after_rms_deg": residual.after if residual else None,
        **{f"magnetic_{letter.lower()}_deg": value for letter, value in method.coefficients_deg.items()},
        **{f"magnetic_{letter.lower()}_sigma_deg": sigma for letter, sigma in sigmas.items()},
    }


def failed_row(source: str, state: str, reason: str) -> IndexRow:
    """Build the row of a log that gave no flight; ``state`` is ``skipped`` or ``failed``."""
    return IndexRow(kind="skipped" if state == "skipped" else "failed", reason=reason, source=source)


def write_index(out: Path, rows: Iterable[IndexRow]) -> None:
    """Write index.json and index.csv of a folder of flights.

    Parameters
    ----------
    out : Path
        The folder that holds the flight folders.
    rows : iterable of IndexRow
        From :func:`index_row` and :func:`failed_row`, in any order: written flights first, then sessions, by id.
    """
    plain = [to_json_exactly(row) for row in sorted(rows, key=_place)]
    write_text(out / INDEX_JSON, json_text({"schema_version": SCHEMA_VERSION, "rows": plain}))
    lines = [",".join(COLUMNS)]
    lines += [",".join(_cell(name, row[name]) for name in COLUMNS) for row in plain]
    write_text(out / INDEX_CSV, "\n".join(lines) + "\n")


def _place(row: IndexRow) -> tuple[int, str, str, str]:
    return KINDS.index(row.kind), row.flight_id or "", row.source or "", row.reason or ""


def _cell(name: str, value: Any) -> str:
    if value is None:
        return ""
    if isinstance(value, list):
        return text_cell("; ".join(map(str, value)))
    if is_number(value):
        return f"{value:.{digits_of(name)}f}" if isinstance(value, float) else str(value)
    return text_cell(str(value))
