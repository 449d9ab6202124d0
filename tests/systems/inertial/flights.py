"""Flights with INS errors for the tests of system 2: tables made of a simulated family, without a log."""

from dataclasses import replace

import numpy as np

from groundstation.base.geodesy import curvature_radii_m
from groundstation.base.records import Column
from groundstation.base.units import NS_PER_S
from groundstation.simulation.inertial_family import ErrorBatch, FamilySettings, GnssErrorModel, simulate_family
from groundstation.tables.table import Flight, Table

RECEIVER = GnssErrorModel(
    position_white_m=2.0, position_correlated_m=1.2, velocity_white_mps=0.03, velocity_correlated_mps=0.01
)


def batch_of(runs: int = 1, seed: int = 41, **family: object) -> ErrorBatch:
    """Simulated flights of navigation class."""
    return simulate_family(FamilySettings(**({"gnss": RECEIVER} | family)), runs, seed)  # type: ignore[arg-type]


def flight_of(batch: ErrorBatch, run: int = 0, **metadata: str) -> Flight:
    """One flight of a family as tables ``ins`` and ``gnss`` at the family's rate."""
    truth = {
        "latitude_deg": batch.latitude_deg[run],
        "longitude_deg": batch.longitude_deg[run],
        "velocity_north_mps": batch.velocity_north_mps[run],
        "velocity_east_mps": batch.velocity_east_mps[run],
    }
    altitude = batch.altitude_m[run]
    tables = {}
    for topic, position_m, velocity_mps in (
        ("ins", batch.position_error_m[run], batch.velocity_error_mps[run]),
        ("gnss", batch.gnss_position_error_m[run], batch.gnss_velocity_error_mps[run]),
    ):
        meridian, prime_vertical = curvature_radii_m(truth["latitude_deg"])
        parallel = (prime_vertical + altitude) * np.cos(np.deg2rad(truth["latitude_deg"]))
        columns = {
            "latitude_deg": truth["latitude_deg"] + np.rad2deg(position_m[:, 0] / (meridian + altitude)),
            "longitude_deg": truth["longitude_deg"] + np.rad2deg(position_m[:, 1] / parallel),
            "altitude_ellipsoid_m": altitude,
            "velocity_north_mps": truth["velocity_north_mps"] + velocity_mps[:, 0],
            "velocity_east_mps": truth["velocity_east_mps"] + velocity_mps[:, 1],
        }
        if topic == "ins":
            columns["true_heading_deg"] = batch.heading_deg[run]
        tables[topic] = table_of(topic, batch.time_s, columns)
    return Flight(tables=tables, metadata=metadata)


def table_of(topic: str, time_s: np.ndarray, columns: dict[str, np.ndarray]) -> Table:
    """A table of float columns."""
    time_ns = np.round(time_s * NS_PER_S).astype(np.int64)
    return Table(
        topic,
        time_ns,
        {name: Column(np.array(values)) for name, values in columns.items()},
        np.arange(len(time_ns)),
        Column(time_ns),
    )


def with_table(flight: Flight, table: Table) -> Flight:
    """The flight with a table replaced."""
    return replace(flight, tables={**flight.tables, table.topic: table})


def changed(flight: Flight, topic: str, **columns: np.ndarray) -> Flight:
    """The flight with fields of a topic replaced."""
    table = flight[topic]
    fresh = {name: Column(np.array(values)) for name, values in columns.items()}
    return with_table(flight, replace(table, columns={**table.columns, **fresh}))


def without_rows(flight: Flight, topic: str, keep: np.ndarray) -> Flight:
    """The flight with only some rows of a topic."""
    return with_table(flight, flight[topic].take(keep))
