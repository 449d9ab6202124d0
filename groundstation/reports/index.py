"""index.json and index.csv: a row for each flight, session and log without a flight.

The rows are those of one folder.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import field, fields
from pathlib import Path
from typing import Any, Literal

from groundstation.base.dataclasses import dataclass
from groundstation.base.digits import digits_of
from groundstation.base.printable import csv_cell
from groundstation.base.serial import to_json_exactly
from groundstation.base.timescales import utc_ns_to_iso
from groundstation.chapters.wording import is_number
from groundstation.results.file_names import INDEX_CSV, INDEX_JSON
from groundstation.results.files import SavedFlight, json_text, write_text
from groundstation.results.flight import FlightResults
from groundstation.results.summary import SCHEMA_VERSION

Kind = Literal["flight", "session", "failed", "skipped"]
KINDS: tuple[Kind, ...] = ("flight", "session", "failed", "skipped")


@dataclass(frozen=True, kw_only=True)
class IndexRow:
    """One flight or session, or a log that gave none.

    Every row has all columns in this order, None where one does not apply. In place of ``answers`` stand those of the
    analyses of a flight, by the names of their columns; a session has none.
    """

    kind: Kind
    flight_id: str | None = None
    aircraft: str | None = None
    flight: str | None = None
    start_utc: str | None = None
    duration_s: float | None = None
    status: str | None = None
    answers: Mapping[str, Any] = field(default_factory=dict)
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


def columns_of(answers: Sequence[str]) -> tuple[str, ...]:
    """Return names of the columns in order, those of the answers in their place."""
    names = [one.name for one in fields(IndexRow)]
    place = names.index("answers")
    return (*names[:place], *answers, *names[place + 1 :])


def index_row(saved: SavedFlight, kind: Kind = "flight", answers: Mapping[str, Any] | None = None) -> IndexRow:
    """Build the row of one flight or session from its saved results.

    Links are relative to the folder of flights. A link is None when the flight folder lacks the file at the time of the
    call.

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
        answers=answers or {},
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
    """Return what was not assessable, each with its reason."""
    return tuple(f"{entry.analysis}: {entry.reason}" for entry in results.not_assessable)


def _link(saved: SavedFlight, name: str) -> str | None:
    return f"{saved.folder.name}/{name}" if (saved.folder / name).exists() else None


def failed_row(source: str, state: str, reason: str) -> IndexRow:
    """Build the row of a log that gave no flight; ``state`` is ``skipped`` or ``failed``."""
    return IndexRow(kind="skipped" if state == "skipped" else "failed", reason=reason, source=source)


def write_index(out: Path, rows: Iterable[IndexRow], answers: Sequence[str] = (), *, elsewhere: str = "") -> None:
    """Write index.json and index.csv of a folder of flights.

    Parameters
    ----------
    out : Path
        The folder that holds the flight folders.
    rows : iterable of IndexRow
        From :func:`index_row` and :func:`failed_row`, in any order: written flights first, then sessions, by id.
    answers : sequence of str
        Names of the columns of the analyses.
    elsewhere : str
        Where the rows of the flights are, if they are not among ``rows``; written into both files.
    """
    columns = columns_of(answers)
    told = [to_json_exactly(row) for row in sorted(rows, key=_place)]
    plain = [{name: row.get(name) for name in columns} for row in (row["answers"] | row for row in told)]
    note = {"elsewhere": elsewhere} if elsewhere else {}
    write_text(out / INDEX_JSON, json_text({"schema_version": SCHEMA_VERSION, **note, "rows": plain}))
    lines = [*([f"# {elsewhere}"] if elsewhere else []), ",".join(columns)]
    lines += [",".join(_cell(name, row[name]) for name in columns) for row in plain]
    write_text(out / INDEX_CSV, "\n".join(lines) + "\n")


def _place(row: IndexRow) -> tuple[int, str, str, str]:
    return KINDS.index(row.kind), row.flight_id or "", row.source or "", row.reason or ""


def _cell(name: str, value: Any) -> str:
    if value is None:
        return ""
    if isinstance(value, list):
        return csv_cell("; ".join(map(str, value)))
    if is_number(value):
        return f"{value:.{digits_of(name)}f}" if isinstance(value, float) else str(value)
    return csv_cell(str(value))
