"""Small simulated sessions as the flights that their aircraft recorded, and damage to them."""

from collections.abc import Mapping
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np

from groundstation.base.records import Column
from groundstation.base.units import NS_PER_S
from groundstation.pipeline.one_flight.convert import convert_log
from groundstation.pipeline.one_flight.flight import read_flight
from groundstation.pipeline.one_flight.log import open_log
from groundstation.simulation.session import SimulatedSession, simulate_session
from groundstation.simulation.session_log import session_flights
from groundstation.simulation.session_scenario import SessionScenario
from groundstation.tables.session_settings import Station, Stations
from groundstation.tables.table import Flight, Table
from tests.systems.cooperative.example import GLOBAL, LOCAL, POINTS

SEED = 9100
WITH_POINTS = replace(GLOBAL, points=POINTS)
SHORT = replace(WITH_POINTS, duration_s=20.0)


@cache
def simulated(scenario: SessionScenario = WITH_POINTS) -> SimulatedSession:
    return simulate_session(scenario, SEED)


@cache
def recorded(scenario: SessionScenario = WITH_POINTS) -> tuple[Flight, ...]:
    """Flights of the session, not rounded."""
    flights = session_flights(simulated(scenario), scenario, "example")
    return tuple(replace(flight, source_name=f"{flight.metadata['aircraft']}.csv") for flight in flights)


def stations_of(scenario: SessionScenario = WITH_POINTS) -> Stations:
    from groundstation.base.ecef import geodetic_deg_m
    from groundstation.simulation.session_log import origin_of

    origin, stations = origin_of(scenario), []
    for point in simulated(scenario).session.points:
        place = np.array(point.position_m)
        latitude, longitude, height = geodetic_deg_m(place if origin is None else origin.to_ecef_m(place))
        stations.append(Station(point.name, float(latitude), float(longitude), float(height)))
    ranks = {one.name: one.rank for one in scenario.aircraft}
    return Stations(tuple(stations), origin, ranks)


def through_the_log(path: Path, folder: Path) -> Flight:
    """A log as the verbs read it: converted to MCAP, and that read."""
    mcap = folder / f"{path.stem}.mcap"
    return read_flight(mcap, convert_log(open_log(path), mcap))


def with_table(flight: Flight, table: Table) -> Flight:
    return replace(flight, tables={**flight.tables, table.topic: table})


def without(flight: Flight, *topics: str) -> Flight:
    return replace(flight, tables={name: table for name, table in flight.tables.items() if name not in topics})


def with_values(flight: Flight, topic: str, column: str, values: np.ndarray) -> Flight:
    table = flight[topic]
    return with_table(flight, replace(table, columns={**table.columns, column: Column(values)}))


def shifted(flight: Flight, shift_s: float, from_record: int = 0) -> Flight:
    """The log with its clock wrong by a shift, from a record on."""
    shift_ns = round(shift_s * NS_PER_S)
    tables: Mapping[str, Table] = {
        name: replace(table, time_ns=table.time_ns + np.where(table.record_index >= from_record, shift_ns, 0))
        for name, table in flight.tables.items()
    }
    first = min(int(table.time_ns[0]) for table in tables.values())
    return replace(flight, tables=tables, start_ns=first)


__all__ = ["GLOBAL", "LOCAL", "POINTS", "SHORT", "WITH_POINTS"]
