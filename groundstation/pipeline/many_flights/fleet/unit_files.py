"""Files on the INS units of a folder of flights: two tables, and the user's limits."""

from dataclasses import fields
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from groundstation.base.errors import GroundstationError
from groundstation.base.toml_settings import settings_from
from groundstation.pipeline.one_flight.configuration import read_toml
from groundstation.pipeline.one_flight.outcome import Outcome
from groundstation.results.figures import FigureData
from groundstation.results.files import csv_text, write_text
from groundstation.results.fleet import FleetResults
from groundstation.results.fleet_units import FleetUnitFlights, FleetUnitRow, UnitLimits

UNITS_CSV, UNIT_FLIGHTS_CSV = "units.csv", "unit_flights.csv"
UNIT_LIMITS = "unit_limits.toml"


def keep_limits(out: Path, path: Path) -> UnitLimits:
    """Copy a file of limits into a folder of flights, where later runs find it.

    Raises
    ------
    SettingsError
        When it cannot be read or used.
    """
    found = settings_from(UnitLimits, read_toml(path), str(path))
    target = out / UNIT_LIMITS
    if path.resolve() != target.resolve():
        write_text(target, path.read_text(encoding="utf-8-sig"))
    return found


def limits_in(out: Path) -> tuple[UnitLimits, str]:
    """Return the limits of a folder, and what is wrong with its file in a line.

    The shipped ones without a file that can be used; the line is empty where nothing is wrong.
    """
    path = out / UNIT_LIMITS
    if not path.is_file():
        return UnitLimits(), ""
    try:
        return settings_from(UnitLimits, read_toml(path), str(path)), ""
    except GroundstationError as error:
        return UnitLimits(), str(error)


def write_units(out: Path, fleet: FleetResults) -> tuple[Outcome, ...]:
    """Write the two tables of units, or remove them where no flight states a serial.

    Returns what could not be written, and what is wrong with the limits.
    """
    problems = []
    if told := limits_in(out)[1]:
        problems.append(Outcome(str(out / UNIT_LIMITS), "failed", told, is_beside=True))
    tables = {UNITS_CSV: units_table(fleet.units), UNIT_FLIGHTS_CSV: flights_table(fleet.unit_flights)}
    for name, table in tables.items():
        try:
            if fleet.units:
                write_text(out / name, csv_text(table))
            else:
                (out / name).unlink(missing_ok=True)
        except OSError as error:
            text = f"{out}: {name} cannot be written ({error.strerror or error})"
            problems.append(Outcome(str(out), "failed", text, is_beside=True))
    return tuple(problems)


def flights_table(flights: FleetUnitFlights) -> FigureData:
    """Return every INS of every flight as columns; times are ISO 8601, UTC."""
    times = flights.start_utc.astype("datetime64[s]")
    told = np.where(np.isnat(times), "", np.char.add(times.astype(np.str_), "Z"))
    return FigureData("unit_flights", {**flights.columns, "start_utc": told}, flights.digits)


def units_table(rows: tuple[FleetUnitRow, ...]) -> FigureData:
    """Return the units as columns; dates are days, UTC."""
    columns: dict[str, NDArray[np.generic]] = {}
    for part in fields(FleetUnitRow):
        values = [getattr(row, part.name) for row in rows]
        name = part.name
        if name.endswith("_utc_ns"):
            days = ["" if one is None else str(np.datetime64(one, "ns").astype("datetime64[D]")) for one in values]
            columns[name.removesuffix("_ns")] = np.array(days, dtype=np.str_)
        elif name in {"place", "flights", "counted", "undated"}:
            columns[name] = np.array(values, dtype=np.int64)
        elif name == "flights_missing":
            columns[name] = np.array(["" if one is None else str(one) for one in values], dtype=np.str_)
        elif "nmiph" in name:
            columns[name] = np.array([np.nan if one is None else one for one in values], dtype=np.float64)
        else:
            columns[name] = np.array(values, dtype=np.str_)
    return FigureData("units", columns, {name: 4 for name in columns if "nmiph" in name})
