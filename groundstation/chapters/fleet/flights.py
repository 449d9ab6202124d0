"""Chapter: every flight and what is out of the ordinary about it."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from groundstation.base.dataclasses import dataclass
from groundstation.chapters.fleet.common import aircraft_name, bounded, minute, title_of
from groundstation.chapters.fleet.reasons import reasons_of
from groundstation.chapters.gates import VERDICTS
from groundstation.chapters.parts import Cell, Grid, Head, Mark, Note, Section, Tone, kept
from groundstation.chapters.wording import ABSENT, clean, duration, number, plural
from groundstation.results.fleet import FleetResults

KEY = "flights"
MOST_LINES = 10_000  # of the table on the page: 7 MB
LEAD = "Every flight of the fleet, with remarks on what is unusual."
GRAVITY: tuple[Tone, ...] = ("bad", "warn", "plain")
CAPTION = (
    "Error: INS heading − true heading; ± 95 %: half of its interval; reference: corrected parking heading minus "
    "reference; INS: radial error rate, time-position fit; 60 min: RMS error of the forecast after 60 min "
    "without GNSS, the error that 95 % of its starts stay below, and that of the raw INS; approaches: those not "
    "stabilised in brackets. A column that no flight fills is left out."
)
LINKED = (("recording", "rrd"), ("mcap", "mcap"))


@dataclass(frozen=True)
class FlightLine:
    """Flight in the table: its cells but the last, remarks and links.

    A link is a text and an address relative to the fleet's page; ``log`` is the name of the log, shortened.
    """

    report: str
    cells: Sequence[Cell]
    remarks: Sequence[Mark]
    links: Sequence[tuple[str, str]]
    log: str


def lines(fleet: FleetResults) -> list[FlightLine]:
    """Return the flights in the order of the fleet, at most :data:`MOST_LINES`.

    A larger fleet shows the flights with remarks, then the latest.
    """
    noted = remarks_of(fleet)
    return _lines(fleet, _shown(fleet, noted), noted)


def by_number(fleet: FleetResults, rows: NDArray[np.intp], numbers: NDArray[np.int64]) -> Section:
    """Return the chapter for a recording: some flights with their numbers on its timeline."""
    shown = _lines(fleet, rows, remarks_of(fleet))
    cells = [
        (line.cells[0], str(place), *line.cells[1:], _joined(line.remarks))
        for line, place in zip(shown, numbers.tolist(), strict=True)
    ]
    some = f" The last {number(len(cells), 0)}; all of them are in flights.parquet." if len(cells) < len(fleet) else ""
    heads = heads_of(fleet)
    grid = Grid("", (heads[0], Head("No.", True), *heads[1:]), cells, f"{CAPTION}{some}")
    return Section(KEY, plural(len(fleet), "flight"), LEAD, kept((grid, reasons_of(fleet).table)) if cells else ())


def _lines(fleet: FleetResults, rows: NDArray[np.intp], noted: Mapping[str, Sequence[Mark]]) -> list[FlightLine]:
    columns = {name: values[rows].tolist() for name, values in fleet.flights.columns.items() if name != "start_utc"}
    columns["start"] = [minute(time) for time in fleet.flights["start_utc"][rows]]
    told = (dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True))
    shown = columns_of(fleet)
    return [_line(row, shown, noted.get(row["flight_id"], ())) for row in told]


def caption_of(fleet: FleetResults) -> str:
    """Return the caption of the table: the meaning of its columns, and which flights it omits."""
    if len(fleet) <= MOST_LINES:
        return CAPTION
    some = (
        f"{number(MOST_LINES, 0)} of {plural(len(fleet), 'flight')}: notable ones first, most severe on top, then the "
        "latest."
    )
    return f"{CAPTION} {some} All of them are in flights.parquet."


def _shown(fleet: FleetResults, noted: Mapping[str, Sequence[Mark]]) -> NDArray[np.intp]:
    """Return rows of the flights in the table."""
    every = np.arange(len(fleet))
    if len(fleet) <= MOST_LINES:
        return every
    gravity = np.array([_gravest(noted.get(name, ())) for name in fleet.flights["flight_id"].tolist()])
    return np.asarray(np.sort(np.lexsort((-every, gravity))[:MOST_LINES]))


def _line(row: dict[str, Any], columns: Sequence["Column"], remarks: Sequence[Mark]) -> FlightLine:
    links = [(text, row[name]) for name, text in LINKED if row[name]]
    cells = [column.cell(row) for column in columns]
    log = shortened_name(row["source"])
    return FlightLine(row["report"], cells, remarks, [*links, ("folder", row["flight_id"] + "/")], log)


def verdict_mark(verdict: str) -> Mark:
    """Return a verdict as it stands in a cell."""
    mark = VERDICTS.get(verdict) or Mark("unknown", clean(verdict) or "not assessable")
    return Mark(mark.tone, mark.text.lower())


class Column(NamedTuple):
    """Column of the table: head, cell of a flight, column of the fleet that must have values."""

    head: Head
    cell: Callable[[dict[str, Any]], Cell]
    source: str = ""


def _half(row: dict[str, Any]) -> str:
    return bounded(0.5 * (row["confidence95_high_deg"] - row["confidence95_low_deg"]), 3)


def _approaches(row: dict[str, Any]) -> Cell:
    if not row["landing_approaches"] >= 1.0:
        return ABSENT
    count, unstable = number(row["landing_approaches"], 0), row["landing_unstable_approaches"]
    return Mark("warn", f"{count} ({number(unstable, 0)})") if unstable >= 1.0 else count


def _graded(name: str, marks: Mapping[str, Mark]) -> Callable[[dict[str, Any]], Cell]:
    """Make a cell of a grade, in the words of the pages of flights."""

    def cell(row: dict[str, Any]) -> Cell:
        text = clean(row[name])
        return marks.get(text, Mark("unknown", text)) if text else ABSENT

    return cell


GRADES: Mapping[str, Mark] = {
    "pass": Mark("good", "good"),
    "warn": Mark("warn", "warnings"),
    "fail": Mark("bad", "bad"),
    "not_logged": Mark("unknown", "not judged"),
}
STATES: Mapping[str, Mark] = {
    "accepted": Mark("good", "accept"),
    "doubtful": Mark("warn", "doubtful"),
    "ambiguous": Mark("warn", "ambiguous"),
}
COLUMNS = (
    Column(Head("Flight"), lambda row: row["flight_id"]),
    Column(Head("Aircraft"), lambda row: aircraft_name(row["aircraft"])),
    Column(Head("Start, UTC"), lambda row: row["start"]),
    Column(Head("Verdict"), lambda row: verdict_mark(row["verdict"])),
    Column(Head("Error, °", True), lambda row: bounded(row["error_deg"], 3, signed=True), "error_deg"),
    Column(Head("± 95 %, °", True), _half, "confidence95_high_deg"),
    Column(Head("To enter, °", True), lambda row: bounded(row["correction_deg"], 2, signed=True), "correction_deg"),
    Column(
        Head("Reference, ′", True),
        lambda row: bounded(row["reference_residual_arcmin"], 1, signed=True),
        "reference_residual_arcmin",
    ),
    Column(
        Head("INS, nmi/h", True),
        lambda row: bounded(row["radial_error_rate_fit_nmiph"], 2),
        "radial_error_rate_fit_nmiph",
    ),
    Column(Head("60 min, m", True), lambda row: bounded(row["forecast_60min_rms_m"], 0), "forecast_60min_rms_m"),
    Column(Head("95 %, m", True), lambda row: bounded(row["forecast_60min_p95_m"], 0), "forecast_60min_p95_m"),
    Column(Head("Raw 95 %, m", True), lambda row: bounded(row["raw_60min_p95_m"], 0), "raw_60min_p95_m"),
    Column(Head("Duration", True), lambda row: duration(row["duration_s"]), "duration_s"),
    Column(Head("Approaches"), _approaches, "landing_approaches"),
    Column(Head("Health"), _graded("health_verdict", GRADES), "health_verdict"),
    Column(Head("Trajectory"), _graded("trajectory_state", STATES), "trajectory_state"),
)
REMARKS = Head("Remarks")
ON_PAPER = ("Flight", "Start, UTC", "Verdict", "Error, °", "± 95 %, °", "Approaches", "Health")


def columns_of(fleet: FleetResults) -> list[Column]:
    """Return the columns that some flight of a fleet fills."""

    def has(name: str) -> bool:
        values = fleet.flights[name]
        return bool(np.isfinite(values).any() if values.dtype.kind == "f" else np.any(values != ""))

    return [column for column in COLUMNS if not column.source or has(column.source)]


def heads_of(fleet: FleetResults) -> list[Head]:
    """Return the heads of the table of a fleet, that of the remarks last."""
    return [*(column.head for column in columns_of(fleet)), REMARKS]


def shortened_name(name: str, most: int = 48) -> str:
    """Return the name of a log, its middle left out where very long."""
    name = clean(name)
    return name if len(name) <= most else f"{name[: most // 2]}…{name[-(most // 2 - 1) :]}"


def remarks_of(fleet: FleetResults) -> dict[str, list[Mark]]:
    """Return what is out of the ordinary about flights, by flight id, most severe first."""
    found: dict[str, list[Mark]] = {}

    def note(flight_id: Any, tone: Tone, text: str) -> None:
        found.setdefault(str(flight_id), []).append(Mark(tone, text))

    flights, trend = fleet.flights, fleet.trend
    for row in np.flatnonzero(np.isin(flights["units_verdict"], ("off", "one_of"))):
        is_sure, units = flights["units_verdict"][row] == "off", clean(str(flights["units_off"][row]))
        note(
            flights["flight_id"][row],
            "bad" if is_sure else "warn",
            f"{units} off" if is_sure else f"one of {units} off",
        )
    for row in np.flatnonzero(flights["status"] == "failed"):
        note(flights["flight_id"][row], "bad", "failed")
    for flight_id, text in reasons_of(fleet).remarks.items():
        note(flight_id, "bad", text)
    for outlier in fleet.outliers:
        note(outlier.flight_id, "warn", f"outlier: {title_of(outlier.quantity)}")
    for row in np.flatnonzero(trend.is_outside) if len(trend) else ():
        note(trend.flight_id[row], "warn", f"outside limits: {title_of(str(trend.quantity[row]))}")
    for change in fleet.change_points:
        note(change.flight_id, "warn", f"new level from here: {title_of(change.quantity)}")
    for row in np.flatnonzero(flights["landing_unstable_approaches"] > 0):
        count = plural(int(flights["landing_unstable_approaches"][row]), "approach", "approaches")
        criteria = ", ".join(clean(str(flights["landing_criteria_not_met"][row])).split()[:4]).replace("_", " ")
        note(flights["flight_id"][row], "warn", f"{count} not stabilised{f' (last: {criteria})' if criteria else ''}")
    for row in np.flatnonzero(flights["findings_fail"] > 0):
        note(flights["flight_id"][row], "warn", plural(int(flights["findings_fail"][row]), "severe finding"))
    for row in np.flatnonzero(flights["has_lost_data"]):
        note(flights["flight_id"][row], "plain", "log cut or damaged")
    return found


def build(fleet: FleetResults) -> Section:
    """Build the chapter for paper: flights with remarks first, the most severe on top."""
    if not len(fleet):
        return Section(KEY, "Flights", LEAD, (Note("No log gave a flight.", "unknown"),))
    every = sorted(lines(fleet), key=_gravity)
    noted = sum(_gravest(marks) < GRAVITY.index("plain") for marks in remarks_of(fleet).values())
    titles = [column.head.title for column in columns_of(fleet)]
    shown = [place for place, title in enumerate(titles) if title in ON_PAPER]
    heads = (*(heads_of(fleet)[place] for place in shown), REMARKS)
    rows = [(*(line.cells[place] for place in shown), _joined(line.remarks)) for line in every]
    caption = (
        f"Notable flights first, {number(noted, 0)} of {plural(len(fleet), 'flight')}: failed, rejected, outliers, "
        "outside the limits, the first of a new level, or with severe findings."
    )
    return Section(KEY, "Flights", LEAD, kept((Grid("Flights", heads, rows, caption), reasons_of(fleet).table)))


def _gravity(line: FlightLine) -> int:
    return _gravest(line.remarks)


def _gravest(marks: Sequence[Mark]) -> int:
    return min((GRAVITY.index(mark.tone) for mark in marks), default=len(GRAVITY))


def _joined(remarks: Sequence[Mark]) -> str:
    return "; ".join(mark.text for mark in remarks)
