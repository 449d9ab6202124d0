"""A folder of flights as a fleet: its statistics, from what each flight adds, and fleet.parquet."""

import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from groundstation.base.errors import GroundstationError
from groundstation.estimators.analyses import ANSWER_TYPES
from groundstation.estimators.fleet import answer
from groundstation.estimators.fleet.changes import ChangeSettings
from groundstation.estimators.fleet.density import densities_of
from groundstation.estimators.fleet.deviation import deviations
from groundstation.estimators.fleet.moments import Moments
from groundstation.estimators.fleet.skill import SkillMerger
from groundstation.pipeline.many_flights.fleet_rows import session_row
from groundstation.pipeline.many_flights.fleet_share import (
    check_rows_of,
    fleet_parquet,
    flights_of,
    histograms_of,
    share_of,
    skill_rows_of,
    to_arrow,
)
from groundstation.pipeline.many_flights.fleet_store import MOST_LISTED, Scan, scan
from groundstation.pipeline.one_flight.outcome import Outcome
from groundstation.results.figures import FigureData
from groundstation.results.file_names import INDEX_JSON, SUMMARY
from groundstation.results.files import load, write_bytes
from groundstation.results.fleet import FleetResults, NotInFleet, SessionRow

FLEET_PARQUET = "fleet.parquet"
SKILL_COLUMNS = {
    "flight_id": "U",
    "aircraft": "U",
    "start_utc": "datetime64[ns]",
    "method": "U",
    "horizon_min": "f8",
    "starts": "i8",
    "rms_m": "f8",
    "coverage95": "f8",
}
CHECK_COLUMNS = {
    "quantity": "U",
    "flight_id": "U",
    "aircraft": "U",
    "verdict": "U",
    "residual_deg": "f8",
    "sigma_deg": "f8",
    "z": "f8",
    "is_inside": "bool",
}


def gather(out: Path) -> FleetResults:
    """Read what the flights of a folder say together.

    Parameters
    ----------
    out : Path
        Holds flight folders, and index.json for the logs that gave no flight.

    Returns
    -------
    FleetResults
        The same for the same flights, in whatever order and by however many processes they were run. A flight folder
        that cannot be read is in ``not_in_fleet`` with the reason.

    Raises
    ------
    GroundstationError
        When a file of the dataset of flights cannot be read.
    """
    found = scan(out)
    return _results(found, *_shares(found))


def write_fleet(out: Path, found: Scan) -> tuple[FleetResults, tuple[Outcome, ...]]:
    """Write fleet.parquet of a folder of flights; call it once index.json is written.

    It is written under a temporary name and moved into place. More than 20 000 flights have no such file: their rows
    are in flights.parquet/ alone.

    Parameters
    ----------
    out : Path
    found : Scan
        What :func:`groundstation.pipeline.many_flights.fleet_store.refresh` gave.

    Returns
    -------
    FleetResults, tuple of Outcome
        What :func:`gather` gives, and what could not be written.
    """
    table, unread = _shares(found)
    try:
        if len(found) > MOST_LISTED:
            (out / FLEET_PARQUET).unlink(missing_ok=True)
        else:
            write_bytes(out / FLEET_PARQUET, fleet_parquet(table))
    except OSError as error:
        problem = f"{out}: {FLEET_PARQUET} cannot be written ({error.strerror or error})"
        return _results(found, table, unread), (Outcome(str(out), "failed", problem),)
    return _results(found, table, unread), ()


def _shares(found: Scan) -> tuple[Any, list[NotInFleet]]:
    """The shares of all flights that can be read, and those that cannot."""
    import pyarrow as pa

    shares, unread = [], []
    for name in found.stale:
        try:
            shares.append(share_of(found.out / name))
        except GroundstationError as error:
            unread.append(NotInFleet("failed", str(found.out / name), str(error)))
    columns = [name for name in to_arrow([]).column_names if name != "index"]
    table = found.table(columns)
    if shares:
        table = pa.concat_tables([table, to_arrow(shares).select(table.column_names)]).sort_by("flight_id")
    return table, unread


def _results(found: Scan, table: Any, unread: list[NotInFleet]) -> FleetResults:
    settings = ChangeSettings()
    flights = flights_of(table)
    sampled = np.flatnonzero(flights["samples"] > 0)
    moments = [
        Moments(
            int(flights["samples"][row]), *(float(flights[f"sample_{name}"][row]) for name in ("mean_deg", "m2_deg2"))
        )
        for row in sampled
    ]
    aircraft = flights["aircraft"][sampled].tolist()
    histograms = list(histograms_of(table, sampled))
    trend, changes = answer.trends(flights, settings)
    checks = _table("calibration_checks", CHECK_COLUMNS, _check_rows(table, flights))
    merger, skill_rows = _skill(table, flights)
    sessions: list[SessionRow] = []
    for folder in found.sessions:
        try:
            sessions.append(session_row(load(folder, ANSWER_TYPES)))
        except GroundstationError as error:
            unread.append(NotInFleet("failed", str(folder), str(error)))
    return FleetResults(
        flights=flights,
        densities=densities_of(flights["flight_id"][sampled].tolist(), aircraft, moments, histograms),
        normals=answer.normals_of(aircraft, moments),
        by_aircraft=answer.by_aircraft(flights),
        trend=trend,
        change_points=changes,
        skill=merger.rows(),
        skill_flights=_table("skill_flights", SKILL_COLUMNS, skill_rows),
        calibration=answer.calibrations(checks),
        calibration_checks=checks,
        outliers=answer.outliers(flights),
        not_in_fleet=_not_in_fleet(found.out, unread),
        deviations=deviations(flights),
        sessions=tuple(sessions),
        stated=answer.stated_rates(settings),
    )


def _names(flights: FigureData) -> Iterator[tuple[str, str]]:
    """Flight id and aircraft of each flight."""
    return zip(flights["flight_id"].tolist(), flights["aircraft"].tolist(), strict=True)


def _check_rows(table: Any, flights: FigureData) -> list[tuple[Any, ...]]:
    return [
        (check.quantity, *names, check.verdict, check.residual_deg, check.sigma_deg, check.z, check.is_inside)
        for names, checks in zip(_names(flights), check_rows_of(table), strict=True)
        for check in checks
    ]


def _skill(table: Any, flights: FigureData) -> tuple[SkillMerger, list[tuple[Any, ...]]]:
    """Skill merged over the flights, and the rows of each flight's shipped method."""
    merger, rows = SkillMerger(), []
    for names, start, (shipped, skill) in zip(_names(flights), flights["start_utc"], skill_rows_of(table), strict=True):
        for one in skill:
            merger.add(one)
            if one.method == shipped:
                figures = (one.horizon_min, one.starts, one.rms_m, one.coverage95)
                rows.append((*names, start, one.method, *figures))
    return merger, rows


def _table(name: str, types: Mapping[str, str], rows: list[tuple[Any, ...]]) -> FigureData:
    columns = zip(*rows, strict=True) if rows else ([] for _ in types)
    arrays = {key: np.array(values, dtype=types[key]) for key, values in zip(types, columns, strict=True)}
    return FigureData(name, arrays, {})


def _not_in_fleet(out: Path, unread: list[NotInFleet]) -> tuple[NotInFleet, ...]:
    """Logs without a flight, as the index remembers them, and flight folders that could not be read just now."""
    told = [*(one for one in _indexed(out) if not _is_folder_of(out, one.source)), *unread]
    return tuple(sorted(told, key=lambda one: (one.kind, one.source, one.reason)))


def _is_folder_of(out: Path, source: str) -> bool:
    """Whether a row of the index is of a folder that could not be read then: it is looked at anew."""
    return Path(source).parent == out and (out / Path(source).name / SUMMARY).is_file()


def _indexed(out: Path) -> Iterator[NotInFleet]:
    try:
        rows = json.loads((out / INDEX_JSON).read_text(encoding="utf-8"))["rows"]
    except (OSError, ValueError, KeyError, TypeError):
        return
    for row in rows if isinstance(rows, list) else ():
        if isinstance(row, dict) and row.get("kind") in ("failed", "skipped"):
            yield NotInFleet(row["kind"], str(row.get("source") or ""), str(row.get("reason") or ""))
