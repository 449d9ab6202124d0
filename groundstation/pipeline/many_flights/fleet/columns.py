"""Columns of the tables of flights, and the schema of the dataset that they are kept in.

Every flight has some columns; between them stand those that each analysis gives.
"""

import json
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import fields
from typing import Any

from groundstation.base.dataclasses import dataclass
from groundstation.methods.fleet.density import SampleHistogram
from groundstation.reports.index import IndexRow
from groundstation.results.columns import FlightColumn
from groundstation.results.fleet_share import Check, SkillOfFlight
from groundstation.results.fleet_units import UnitOfFlight
from groundstation.results.flight import FlightResults
from groundstation.results.installations import Lesson
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


TEXTS = ("text", "category")
SKILL_FIELDS = {
    "method": "string",
    "horizon_min": "double",
    "starts": "int64",
    "rms_m": "double",
    "coverage95": "double",
    "is_within": "bool",
}  # of SkillOfFlight
CHECK_FIELDS = {
    "quantity": "string",
    "z": "double",
    "is_inside": "bool",
    "residual_deg": "double",
    "sigma_deg": "double",
    "verdict": "string",
}  # of Check
UNIT_FIELDS = {one.name: "string" if one.type is str else "double" for one in fields(UnitOfFlight)}
DETAILS = {
    "index": "JSON: the flight's row of index.json",
    "shipped": "the shipped method of the forecast",
    "skill": "forecast skill of each method and horizon",
    "checks": "what independent thing each estimate was compared with",
    "units": "figures of each INS by its serial, or why they do not count",
    "sample_cell": "cells of 0.01 deg that hold used heading samples",
    "sample_count": "how many samples each of them holds",
    "lesson": "JSON: what the flight says of the installation of its INS; empty without a serial",
}


@dataclass(frozen=True)
class FlightShare:
    """Share of one flight in the fleet.

    It also has what a run must know of the flight when it does not touch it.

    Parameters
    ----------
    row : mapping
        A value for each of :data:`FLIGHT_COLUMNS`.
    index : IndexRow
    histogram : SampleHistogram
        Of its used heading samples.
    shipped, skill
        The shipped method of the forecast, and the skill of each.
    checks : sequence of Check
    path : str
        Of its log.
    link_name, hears : str, tuple of str
        Name of its aircraft on the data link, and of those whom it heard.
    samples : str
        File of its heading samples in the dataset of samples; empty without any.
    parts : tuple of str
        Digests of its consecutive logs but the first.
    lesson : Lesson, optional
        What it says of the installation of its INS; None where it states no serial.
    units : sequence of UnitOfFlight
        What each INS adds to the history of its unit.
    """

    row: Mapping[str, Any]
    index: IndexRow
    histogram: SampleHistogram
    shipped: str
    skill: Sequence[SkillOfFlight]
    checks: Sequence[Check]
    path: str
    link_name: str
    hears: tuple[str, ...]
    samples: str
    parts: tuple[str, ...] = ()
    lesson: Lesson | None = None
    units: Sequence[UnitOfFlight] = ()


def dataset_schema() -> Any:
    """Arrow schema of flights.parquet/: the columns of a flight and the details.

    Its metadata ``columns`` has their meanings.
    """
    import pyarrow as pa

    kinds = {
        "number": pa.float64(),
        "count": pa.int64(),
        "flag": pa.bool_(),
        "time": pa.timestamp("ns", tz="UTC"),
        "text": pa.string(),
        "category": pa.dictionary(pa.int32(), pa.string()),
    }
    cells = pa.list_(pa.field("element", pa.int32()))  # as Parquet names it
    lists = {
        "skill": _rows_of(SKILL_FIELDS),
        "checks": _rows_of(CHECK_FIELDS),
        "units": _rows_of(UNIT_FIELDS),
        "sample_cell": cells,
        "sample_count": cells,
    }
    fields = [(column.name, kinds[column.kind]) for column in FLIGHT_COLUMNS]
    fields += [(name, lists.get(name, pa.string())) for name in DETAILS]
    meanings = {column.name: column.meaning for column in FLIGHT_COLUMNS} | DETAILS
    return pa.schema(fields, metadata={"columns": json.dumps(meanings)})


def _rows_of(fields: Mapping[str, str]) -> Any:
    import pyarrow as pa

    struct = pa.struct([(name, pa.type_for_alias(kind)) for name, kind in fields.items()])
    return pa.list_(pa.field("element", struct))  # as Parquet names it


def answer_values(results: FlightResults) -> dict[str, Any]:
    """Values of the columns of all analyses, by name; none of one without an answer.

    Columns that fail are empty: the run of the flight has told it.
    """
    found: dict[str, Any] = {}
    for analysis in systems().analyses:
        with suppress(Exception):
            found |= analysis.values(results.answers)
    return found
