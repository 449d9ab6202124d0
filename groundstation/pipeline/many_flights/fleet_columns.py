"""The columns of the tables of flights: what every flight has, and between it what each analysis gives."""

from contextlib import suppress
from typing import Any

from groundstation.results.columns import FlightColumn
from groundstation.results.flight import FlightResults
from groundstation.systems import systems

BEFORE = (
    FlightColumn("flight_id", "text", "name of the flight and of its folder"),
    FlightColumn("aircraft", "category", "as the log or the aircraft file says"),
    FlightColumn("flight", "text", "flight number as logged"),
    FlightColumn("start_utc", "time", "first corrected time; missing for a log without absolute time"),
    FlightColumn("month", "category", "year and month of start_utc: 2026-05"),
    FlightColumn("duration_s", "number", "from the first sample of any topic to the last"),
    FlightColumn("status", "category", "ok, degraded (data lost) or failed"),
    FlightColumn("has_lost_data", "flag", "the log is cut or damaged"),
)
BEHIND = (
    FlightColumn("findings_fail", "count", "findings of severity fail"),
    FlightColumn("findings_warn", "count", "findings of severity warn"),
    FlightColumn("findings_info", "count", "findings of severity info"),
    FlightColumn("not_assessable", "text", "analyses that could not be carried out and why, joined by '; '"),
    FlightColumn("source", "text", "name of the log"),
    FlightColumn("sha256", "text", "of the log"),
    FlightColumn("summary", "text", "file, relative to the folder of flights; empty when it is not there"),
    FlightColumn("report", "text", "file, the same"),
    FlightColumn("recording", "text", "file, the same"),
    FlightColumn("mcap", "text", "file, the same"),
)
FLIGHT_COLUMNS: tuple[FlightColumn, ...] = (
    *BEFORE,
    *(column for analysis in systems().analyses for column in analysis.columns),
    *BEHIND,
)
INDEXED = tuple(column.name for analysis in systems().analyses for column in analysis.columns if column.is_indexed)


def answer_values(results: FlightResults) -> dict[str, Any]:
    """Values of the columns of all analyses, by name; none of one without an answer.

    Columns that fail are empty: the run of the flight has told it.
    """
    found: dict[str, Any] = {}
    for analysis in systems().analyses:
        with suppress(Exception):
            found |= analysis.values(results.answers)
    return found
