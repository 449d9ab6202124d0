"""index.json and index.csv: one row per flight of a folder, and the logs that gave none with the reason."""

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from groundstation.base.findings import SEVERITIES
from groundstation.chapters.wording import is_number
from groundstation.reports.sections.saved import heading_of, mapping, objects
from groundstation.results.files import SavedFlight, json_text, text_cell, write_text
from groundstation.results.magnetic import LETTERS
from groundstation.results.summary import SCHEMA_VERSION, digits_of

INDEX_JSON, INDEX_CSV = "index.json", "index.csv"

# Every row has all of them, in this order; what does not apply is null.
COLUMNS = (
    *("kind", "flight_id", "aircraft", "flight", "start_utc", "duration_s", "status"),
    *("verdict", "verdict_reason", "error_deg", "standard_error_deg", "confidence95_low_deg", "confidence95_high_deg"),
    *(
        "correction_deg",
        "precision_deg",
        "quality_deg",
        "estimate_sd_deg",
        "samples",
        "taxi_seconds",
        "drift_deg_per_h",
    ),
    *("parking_heading_deg", "reference_residual_arcmin", "onboard_error_deg", "onboard_difference_deg"),
    *("ins_kind", "radial_error_rate_50_nmiph", "radial_error_rate_95_nmiph"),
    *("forecast_method", "forecast_30min_rms_m", "forecast_60min_rms_m", "forecast_120min_rms_m"),
    *("magnetic_verdict", "magnetic_method", "magnetic_before_rms_deg", "magnetic_after_rms_deg"),
    *(f"magnetic_{letter.lower()}{end}_deg" for letter in LETTERS for end in ("", "_sigma")),
    *("findings_fail", "findings_warn", "findings_info", "not_assessable", "reason"),
    *("source", "sha256", "summary", "report", "recording", "mcap"),
)
KINDS = ("flight", "failed", "skipped")
_FROM_HEADING = (
    *("verdict", "verdict_reason", "error_deg", "standard_error_deg", "correction_deg", "precision_deg", "quality_deg"),
    *(
        "estimate_sd_deg",
        "samples",
        "taxi_seconds",
        "drift_deg_per_h",
        "parking_heading_deg",
        "reference_residual_arcmin",
    ),
)


def index_row(saved: SavedFlight) -> dict[str, Any]:
    """Build the row of one flight from what it saved: plain values, links relative to the folder of flights.

    A link is null when the flight folder lacks the file at the time of the call.
    """
    flight, heading = mapping(saved.summary, "flight"), heading_of(saved)
    results = mapping(saved.summary, "results")
    inertial, forecast = mapping(results, "inertial"), mapping(results, "forecast")
    source, onboard = mapping(flight, "source"), mapping(heading, "onboard")
    low, high = _pair(heading.get("confidence95_deg"))
    flight_id = str(flight.get("id", ""))
    findings = [str(finding.get("severity")) for finding in objects(saved.summary, "findings")]
    files = {
        "summary": "summary.json",
        "report": "report.html",
        "recording": f"{flight_id}.rrd",
        "mcap": f"{flight_id}.mcap",
    }
    return _row(
        kind="flight",
        flight_id=flight_id,
        **{name: flight.get(name) for name in ("aircraft", "flight", "start_utc", "duration_s")},
        status=saved.summary.get("status"),
        **{name: heading.get(name) for name in _FROM_HEADING},
        confidence95_low_deg=low,
        confidence95_high_deg=high,
        onboard_error_deg=onboard.get("heading_error_deg"),
        onboard_difference_deg=onboard.get("difference_error_deg"),
        ins_kind=inertial.get("kind"),
        **{name: inertial.get(name) for name in ("radial_error_rate_50_nmiph", "radial_error_rate_95_nmiph")},
        forecast_method=forecast.get("default_method"),
        **{f"forecast_{horizon}min_rms_m": _forecast_rms(forecast, horizon) for horizon in (30, 60, 120)},
        **_of_deviation(mapping(results, "magnetic")),
        **{f"findings_{severity}": findings.count(severity) for severity in SEVERITIES},
        not_assessable=[
            f"{entry.get('analysis', '')}: {entry.get('reason', '')}"
            for entry in objects(saved.summary, "not_assessable")
        ],
        source=source.get("name"),
        sha256=source.get("sha256"),
        **{
            key: f"{saved.folder.name}/{name}" if (saved.folder / name).exists() else None
            for key, name in files.items()
        },
    )


def _forecast_rms(forecast: Mapping[str, Any], horizon_min: float) -> Any:
    """RMS of the shipped method at a horizon, None where it was not replayed."""
    rows = (row for row in objects(forecast, "skill") if row.get("method") == forecast.get("default_method"))
    return next((row.get("rms_m") for row in rows if row.get("horizon_min") == horizon_min), None)


def _of_deviation(magnetic: Mapping[str, Any]) -> dict[str, Any]:
    """Verdict, errors before and after, and the coefficients of the method that is recommended."""
    name, residual = magnetic.get("recommended_method"), mapping(magnetic, "residual_rms_deg")
    method = next((row for row in objects(magnetic, "methods") if row.get("name") == name), {})
    values, sigmas = (mapping(method, f"coefficients{end}_deg") for end in ("", "_sigma"))
    return {
        "magnetic_verdict": magnetic.get("verdict"),
        "magnetic_method": name,
        "magnetic_before_rms_deg": residual.get("before"),
        "magnetic_after_rms_deg": residual.get("after"),
        **{f"magnetic_{letter.lower()}_deg": values.get(letter) for letter in LETTERS},
        **{f"magnetic_{letter.lower()}_sigma_deg": sigmas.get(letter) for letter in LETTERS},
    }


def failed_row(source: str, state: str, reason: str) -> dict[str, Any]:
    """Build the row of a log that gave no flight; ``state`` is ``skipped`` or ``failed``."""
    return _row(kind="skipped" if state == "skipped" else "failed", reason=reason, source=source)


def write_index(out: Path, rows: Iterable[Mapping[str, Any]]) -> None:
    """Write index.json and index.csv of a folder of flights.

    Parameters
    ----------
    out : Path
        The folder that holds the flight folders.
    rows : iterable of mappings
        From :func:`index_row` and :func:`failed_row`, in any order: they are written flights first, by flight id.
    """
    ordered = sorted((_row(**row) for row in rows), key=_place)
    write_text(out / INDEX_JSON, json_text({"schema_version": SCHEMA_VERSION, "rows": ordered}))
    lines = [",".join(COLUMNS)]
    lines += [",".join(_cell(name, row[name]) for name in COLUMNS) for row in ordered]
    write_text(out / INDEX_CSV, "\n".join(lines) + "\n")


def _row(**values: Any) -> dict[str, Any]:
    return {name: values.get(name) for name in COLUMNS}


def _place(row: Mapping[str, Any]) -> tuple[int, str, str, str]:
    kind = KINDS.index(row["kind"]) if row["kind"] in KINDS else len(KINDS)
    return (kind, *(str(row[name] or "") for name in ("flight_id", "source", "reason")))  # type: ignore[return-value]


def _pair(value: Any) -> tuple[Any, Any]:
    return (value[0], value[1]) if isinstance(value, list | tuple) and len(value) == 2 else (None, None)


def _cell(name: str, value: Any) -> str:
    if value is None:
        return ""
    if isinstance(value, list):
        return text_cell("; ".join(map(str, value)))
    if is_number(value):
        return f"{value:.{digits_of(name)}f}" if isinstance(value, float) else str(value)
    return text_cell(str(value))
