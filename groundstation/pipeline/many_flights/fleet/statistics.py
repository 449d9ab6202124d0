"""Statistics of a folder of flights, from what each flight adds, and fleet.parquet."""

import json
from collections.abc import Iterator, Mapping, Sequence
from itertools import chain, compress
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from groundstation.base.errors import GroundstationError
from groundstation.methods.fleet import answer
from groundstation.methods.fleet.changes import ChangeSettings
from groundstation.methods.fleet.density import densities_of
from groundstation.methods.fleet.deviation import deviations
from groundstation.methods.fleet.installations import installation_flights, installation_rows
from groundstation.methods.fleet.moments import Moments
from groundstation.methods.fleet.skill import SkillMergers
from groundstation.methods.fleet.trends import trends
from groundstation.methods.fleet.units import FlownUnit, UnitHistories, histories_of
from groundstation.pipeline.many_flights.fleet.columns import FLIGHT_COLUMNS
from groundstation.pipeline.many_flights.fleet.rows import session_row, share_of
from groundstation.pipeline.many_flights.fleet.scan import MOST_LISTED, Scan, scan
from groundstation.pipeline.many_flights.fleet.table import (
    check_rows_of,
    fleet_parquet,
    flights_of,
    histograms_of,
    skill_rows_of,
    to_arrow,
    units_of,
)
from groundstation.pipeline.many_flights.fleet.unit_files import limits_in, write_units
from groundstation.pipeline.one_flight.outcome import Outcome
from groundstation.results.arrays.fleet import FleetChecks, FleetSkillFlights
from groundstation.results.figures import FigureData
from groundstation.results.file_names import INDEX_JSON, SUMMARY
from groundstation.results.files import load, write_bytes
from groundstation.results.fleet import FleetResults, NotInFleet, SessionRow
from groundstation.results.installations import installations_in
from groundstation.systems import systems

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
    shares, unread = _unread_shares(found)
    return _results(found, flights_of(_flights(found, shares)), shares, unread)


def write_fleet(out: Path, found: Scan) -> tuple[FleetResults, tuple[Outcome, ...]]:
    """Write fleet.parquet of a folder of flights; call it once index.json is written.

    It is written under a temporary name and moved into place. More than 20 000 flights have no such file: their rows
    are in flights.parquet/ alone.

    Parameters
    ----------
    out : Path
    found : Scan
        What :func:`groundstation.pipeline.many_flights.fleet.refresh.refresh` gave.

    Returns
    -------
    FleetResults, tuple of Outcome
        What :func:`gather` gives, and what could not be written.
    """
    shares, unread = _unread_shares(found)
    problems: tuple[Outcome, ...] = ()
    table = _flights(found, shares)
    try:
        if len(found) > MOST_LISTED:
            (out / FLEET_PARQUET).unlink(missing_ok=True)
        else:
            write_bytes(out / FLEET_PARQUET, fleet_parquet(table))
    except OSError as error:
        problem = f"{out}: {FLEET_PARQUET} cannot be written ({error.strerror or error})"
        problems = (Outcome(str(out), "failed", problem, is_beside=True),)
    flights = flights_of(table)
    del table
    results = _results(found, flights, shares, unread)
    return results, (*problems, *write_units(out, results))


def _unread_shares(found: Scan) -> tuple[Any, list[NotInFleet]]:
    """Shares of the flights that the dataset has not, and the flights that cannot be read."""
    shares, unread = [], []
    for name in found.stale:
        try:
            shares.append(share_of(found.out / name))
        except GroundstationError as error:
            unread.append(NotInFleet("failed", str(found.out / name), str(error)))
    return to_arrow(shares), unread


def _flights(found: Scan, shares: Any) -> Any:
    """The columns of all flights, as Arrow."""
    names = [column.name for column in FLIGHT_COLUMNS]
    return _joined(found.table(names), shares.select(names))


def _joined(table: Any, shares: Any) -> Any:
    import pyarrow as pa

    if not len(shares):
        return table
    return pa.concat_tables([table, shares.select(table.column_names)]).sort_by("flight_id")


def _parts(found: Scan, shares: Any, columns: Sequence[str]) -> Iterator[Any]:
    """Columns of all flights in the order of their ids.

    They come a month at a time, where the months are in that order.
    """
    places = np.concatenate([np.zeros(0, np.intp), *found.fresh.by_month().values()])
    if len(shares) or not len(places) or np.any(np.diff(places) < 0):
        yield _joined(found.table(columns), shares)
    else:
        yield from found.months_of(columns)


def _results(found: Scan, flights: FigureData, shares: Any, unread: list[NotInFleet]) -> FleetResults:
    settings = ChangeSettings()
    is_sampled = (flights["samples"] > 0) & np.isfinite(flights["sample_mean_deg"])  # whose samples are there
    figures = (flights[name][is_sampled].tolist() for name in ("samples", "sample_mean_deg", "sample_m2_deg2"))
    moments = [Moments(int(count), mean, m2) for count, mean, m2 in zip(*figures, strict=True)]
    aircraft = flights["aircraft"][is_sampled].tolist()
    cells = _parts(found, shares, ("sample_cell", "sample_count"))
    histograms = compress(chain.from_iterable(map(histograms_of, cells)), is_sampled.tolist())
    trend = trends(flights, settings, limits_in(found.out)[0])
    mergers, skill_flights, checks = _details(found, flights, shares)
    units = _units(found, flights, shares)
    read = installations_in(found.out)
    installations = () if read is None else read.installations
    sessions: list[SessionRow] = []
    for folder in found.sessions:
        try:
            sessions.append(session_row(load(folder, systems().answer_types)))
        except GroundstationError as error:
            unread.append(NotInFleet("failed", str(folder), str(error)))
    return FleetResults(
        flights=flights,
        densities=densities_of(flights["flight_id"][is_sampled].tolist(), aircraft, moments, histograms),
        normals=answer.normals_of(aircraft, moments),
        by_aircraft=answer.by_aircraft(flights),
        trend=trend.charts,
        change_points=trend.changes,
        slopes=trend.slopes,
        skill=mergers.whole.rows(),
        skill_by_aircraft=mergers.by_aircraft(),
        skill_flights=skill_flights,
        calibration=answer.calibrations(checks),
        calibration_checks=checks,
        outliers=answer.outliers(flights),
        not_in_fleet=_not_in_fleet(found.out, unread),
        deviations=deviations(flights),
        sessions=tuple(sessions),
        stated=answer.stated_rates(settings),
        installations=installation_rows(installations),
        installation_flights=installation_flights(installations),
        units=units.rows,
        unit_trends=units.trends,
        unit_events=units.events,
        unit_flights=units.flights,
    )


def _units(found: Scan, flights: FigureData, shares: Any) -> UnitHistories:
    """Histories of the INS units, by the limits that stand in the folder."""
    starts = flights["start_utc"].astype("datetime64[ns]")
    known = ~np.isnat(starts)
    start_ns, length_s = starts.astype(np.int64), flights["duration_s"]
    every = chain.from_iterable(map(units_of, _parts(found, shares, ("units",))))
    flown = [
        FlownUnit(
            unit,
            str(flights["flight_id"][row]),
            str(flights["aircraft"][row]),
            int(start_ns[row]) if known[row] else None,
            int(start_ns[row] + 1e9 * length_s[row]) if known[row] and np.isfinite(length_s[row]) else None,
        )
        for row, own in enumerate(every)
        for unit in own
    ]
    return histories_of(flown, limits_in(found.out)[0])


def _details(found: Scan, flights: FigureData, shares: Any) -> tuple[SkillMergers, FleetSkillFlights, FleetChecks]:
    """Skill merged over the flights, the rows of each flight's shipped method, all checks."""
    mergers, first = SkillMergers(), 0
    skill: list[dict[str, NDArray[Any]]] = []
    checks: list[dict[str, NDArray[Any]]] = []
    for part in _parts(found, shares, ("shipped", "skill", "checks")):
        rows, columns = skill_rows_of(part)
        mergers.add_columns(columns, flights["aircraft"][first + rows])
        is_shipped = columns["is_shipped"]
        told = {name: values[is_shipped] for name, values in columns.items() if name in SKILL_COLUMNS}
        skill.append(told | {"row": first + rows[is_shipped]})
        rows, columns = check_rows_of(part)
        checks.append(columns | {"row": first + rows})
        first += len(part)
    return (
        mergers,
        FleetSkillFlights.of(_table("skill_flights", SKILL_COLUMNS, flights, skill)),
        FleetChecks.of(_table("calibration_checks", CHECK_COLUMNS, flights, checks)),
    )


def _table(
    name: str, types: Mapping[str, str], flights: FigureData, parts: Sequence[Mapping[str, NDArray[Any]]]
) -> FigureData:
    """Table from parts that have some of its columns.

    Their ``row`` says which flight the other columns are taken of.
    """
    rows = np.concatenate([np.zeros(0, np.intp), *(part["row"] for part in parts)])
    arrays = {}
    for key, kind in types.items():
        own = [part[key] for part in parts if key in part]
        arrays[key] = np.concatenate(own).astype(kind) if own else flights[key][rows]
    return FigureData(name, arrays, {})


def _not_in_fleet(out: Path, unread: list[NotInFleet]) -> tuple[NotInFleet, ...]:
    """Logs without a flight by the index, and flight folders that could not be read just now."""
    told = [*(one for one in _indexed(out) if not _is_folder_of(out, one.source)), *unread]
    return tuple(sorted(told, key=lambda one: (one.kind, one.source, one.reason)))


def _is_folder_of(out: Path, source: str) -> bool:
    """Tell whether a row of the index is of a folder that could not be read then.

    It is looked at anew.
    """
    return Path(source).parent == out and (out / Path(source).name / SUMMARY).is_file()


def _indexed(out: Path) -> Iterator[NotInFleet]:
    try:
        rows = json.loads((out / INDEX_JSON).read_text(encoding="utf-8"))["rows"]
    except (OSError, ValueError, KeyError, TypeError):
        return
    for row in rows if isinstance(rows, list) else ():
        if isinstance(row, dict) and row.get("kind") in ("failed", "skipped"):
            yield NotInFleet(row["kind"], str(row.get("source") or ""), str(row.get("reason") or ""))
