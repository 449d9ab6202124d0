"""A folder of flights as a fleet: its statistics, fleet.parquet and the dataset of samples."""

import io
import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from groundstation.base.errors import GroundstationError
from groundstation.estimators.analyses import ANSWER_TYPES
from groundstation.estimators.fleet import answer
from groundstation.estimators.fleet.changes import ChangeSettings
from groundstation.estimators.fleet.density import SampleHistogram, densities_of
from groundstation.estimators.fleet.deviation import deviations
from groundstation.estimators.fleet.moments import Moments
from groundstation.estimators.fleet.skill import SkillMerger
from groundstation.pipeline.many_flights.fleet_columns import FLIGHT_COLUMNS
from groundstation.pipeline.many_flights.fleet_rows import (
    checks_of,
    flight_row,
    flights_table,
    heading_samples,
    session_row,
    skill_of,
)
from groundstation.pipeline.many_flights.fleet_samples import SampleStore
from groundstation.pipeline.many_flights.inputs import flight_folders, session_folders
from groundstation.pipeline.one_flight.outcome import Outcome
from groundstation.results.columns import FlightColumn, Kind
from groundstation.results.figures import FigureData
from groundstation.results.file_names import INDEX_JSON
from groundstation.results.files import load, write_bytes
from groundstation.results.fleet import FleetResults, NotInFleet, SessionRow

FLEET_PARQUET = "fleet.parquet"
TEXTS: tuple[Kind, ...] = ("text", "category")
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


@dataclass
class _Collected:
    """What is kept of the flights while they are gone through: a few hundred numbers each, never their arrays."""

    columns: dict[str, list[Any]] = field(default_factory=lambda: {column.name: [] for column in FLIGHT_COLUMNS})
    sampled: list[tuple[str, str]] = field(default_factory=list)  # flight id, aircraft
    moments: list[Moments] = field(default_factory=list)
    histograms: list[SampleHistogram] = field(default_factory=list)
    skill: SkillMerger = field(default_factory=SkillMerger)
    skill_rows: list[tuple[Any, ...]] = field(default_factory=list)
    checks: list[tuple[Any, ...]] = field(default_factory=list)
    unread: list[NotInFleet] = field(default_factory=list)
    sessions: list[SessionRow] = field(default_factory=list)


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
    """
    return _results(out, _collect(out, None))


def write_fleet(out: Path) -> tuple[FleetResults, tuple[Outcome, ...]]:
    """Write fleet.parquet and samples.parquet/ of a folder of flights; call it once index.json is written.

    Files of samples are written for flights that changed, and removed for flights that are gone. Each file is written
    under a temporary name and moved into place.

    Returns
    -------
    FleetResults, tuple of Outcome
        What :func:`gather` gives, and what could not be written.
    """
    collected = _Collected()
    problems: list[Outcome] = []
    try:
        store = SampleStore(out)
        collected = _collect(out, store)
        store.sweep()
    except OSError as error:
        problems.append(_unwritten(out, "the samples", error))
        collected = _collect(out, None)
    results = _results(out, collected)
    try:
        write_bytes(out / FLEET_PARQUET, fleet_parquet(results.flights))
    except OSError as error:
        problems.append(_unwritten(out, FLEET_PARQUET, error))
    return results, tuple(problems)


def _unwritten(out: Path, what: str, error: OSError) -> Outcome:
    return Outcome(str(out), "failed", f"{out}: {what} cannot be written ({error.strerror or error})")


def _collect(out: Path, store: SampleStore | None) -> _Collected:
    collected = _Collected()
    for folder in flight_folders(out):
        try:
            _add(collected, folder, store)
        except GroundstationError as error:
            collected.unread.append(NotInFleet("failed", str(folder), str(error)))
            if store is not None:
                store.keep(folder.name)
    for folder in session_folders(out):
        try:
            collected.sessions.append(session_row(load(folder, ANSWER_TYPES)))
        except GroundstationError as error:
            collected.unread.append(NotInFleet("failed", str(folder), str(error)))
    return collected


def _add(collected: _Collected, folder: Path, store: SampleStore | None) -> None:
    saved = load(folder, ANSWER_TYPES)
    samples = heading_samples(saved)
    row = flight_row(saved, samples)
    for name, values in collected.columns.items():
        values.append(row[name])
    names = (row["flight_id"], row["aircraft"])
    if samples is not None:
        if samples.moments.count:
            collected.sampled.append(names)
            collected.moments.append(samples.moments)
            collected.histograms.append(samples.histogram)
        if store is not None:
            store.put(row, samples)
    for check in checks_of(saved):
        told = (check.verdict, check.residual_deg, check.sigma_deg, check.z, check.is_inside)
        collected.checks.append((check.quantity, *names, *told))
    shipped, skill = skill_of(saved)
    start = np.datetime64("NaT", "ns") if row["start_utc"] is None else np.datetime64(row["start_utc"], "ns")
    for one in skill:
        collected.skill.add(one)
        if one.method == shipped:
            figures = (one.horizon_min, one.starts, one.rms_m, one.coverage95)
            collected.skill_rows.append((*names, start, one.method, *figures))


def _results(out: Path, collected: _Collected) -> FleetResults:
    settings = ChangeSettings()
    flights = flights_table(collected.columns)
    ids, aircraft = zip(*collected.sampled, strict=True) if collected.sampled else ((), ())
    trend, changes = answer.trends(flights, settings)
    checks = _table("calibration_checks", CHECK_COLUMNS, collected.checks)
    return FleetResults(
        flights=flights,
        densities=densities_of(ids, aircraft, collected.moments, collected.histograms),
        normals=answer.normals_of(aircraft, collected.moments),
        by_aircraft=answer.by_aircraft(flights),
        trend=trend,
        change_points=changes,
        skill=collected.skill.rows(),
        skill_flights=_table("skill_flights", SKILL_COLUMNS, collected.skill_rows),
        calibration=answer.calibrations(checks),
        calibration_checks=checks,
        outliers=answer.outliers(flights),
        not_in_fleet=_not_in_fleet(out, collected),
        deviations=deviations(flights),
        sessions=tuple(collected.sessions),
        stated=answer.stated_rates(settings),
    )


def _table(name: str, types: Mapping[str, str], rows: list[tuple[Any, ...]]) -> FigureData:
    columns = zip(*rows, strict=True) if rows else ([] for _ in types)
    arrays = {key: np.array(values, dtype=types[key]) for key, values in zip(types, columns, strict=True)}
    return FigureData(name, arrays, {})


def _not_in_fleet(out: Path, collected: _Collected) -> tuple[NotInFleet, ...]:
    """Logs without a flight, as the index remembers them, and flight folders that could not be read just now."""
    folders = {str(folder) for folder in (*flight_folders(out), *session_folders(out))}
    told = [*(one for one in _indexed(out) if one.source not in folders), *collected.unread]
    return tuple(sorted(told, key=lambda one: (one.kind, one.source, one.reason)))


def _indexed(out: Path) -> Iterator[NotInFleet]:
    try:
        rows = json.loads((out / INDEX_JSON).read_text(encoding="utf-8"))["rows"]
    except (OSError, ValueError, KeyError, TypeError):
        return
    for row in rows if isinstance(rows, list) else ():
        if isinstance(row, dict) and row.get("kind") in ("failed", "skipped"):
            yield NotInFleet(row["kind"], str(row.get("source") or ""), str(row.get("reason") or ""))


def fleet_parquet(flights: FigureData) -> bytes:
    """Encode the table of flights: timestamps in UTC, dictionaries for categories, null for what is missing.

    The schema's metadata has ``columns``, JSON of every column's meaning.
    """
    import pyarrow as pa
    import pyarrow.parquet as pq

    arrays = {column.name: _arrow(column, flights) for column in FLIGHT_COLUMNS}
    meanings = json.dumps({column.name: column.meaning for column in FLIGHT_COLUMNS})
    buffer = io.BytesIO()
    pq.write_table(pa.table(arrays).replace_schema_metadata({"columns": meanings}), buffer, compression="zstd")
    return buffer.getvalue()


def _arrow(column: FlightColumn, flights: FigureData) -> Any:
    import pyarrow as pa

    values = flights[column.name]
    if column.kind == "time":
        return pa.array(values.astype(np.int64), pa.timestamp("ns", tz="UTC"), mask=np.isnat(values))
    if column.kind in TEXTS:
        found = pa.array([text or None for text in values.tolist()], pa.string())
        return found.dictionary_encode() if column.kind == "category" else found
    if column.kind == "count":
        return pa.array(np.nan_to_num(values).astype(np.int64), mask=np.isnan(values))
    return pa.array(values, from_pandas=True)
