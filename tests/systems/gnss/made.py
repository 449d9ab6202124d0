"""Flights of receivers with known truth: a drive at standstill and in a circle, written as tables."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.records import Column
from groundstation.base.units import NS_PER_S
from groundstation.systems.gnss.answer import GnssReceiver, GnssReception
from groundstation.systems.gnss.estimate import Reception, reception_of
from groundstation.systems.gnss.settings import GnssSettings
from groundstation.tables.phases import PhaseInterval, Phases
from groundstation.tables.table import Flight, Table

LATITUDE_DEG, LONGITUDE_DEG, EARTH_M = 55.0, 37.0, 6_378_137.0
STEP_S, STANDS_S, WHOLE_S = 0.2, 60.0, 180.0
RADIUS_M, SPEED_MPS = 100.0, 10.0


def times(step_s: float = STEP_S, whole_s: float = WHOLE_S) -> FloatArray:
    """Flight seconds of the rows."""
    return np.arange(0.0, whole_s, step_s)


def motion(time_s: FloatArray) -> tuple[FloatArray, FloatArray]:
    """True places and velocities, north and east: a stand of a minute, then a circle begun smoothly."""
    driven_s = np.maximum(time_s - STANDS_S, 0.0)
    speed = SPEED_MPS * np.minimum(driven_s / 10.0, 1.0)
    way = np.where(driven_s < 10.0, 0.5 * SPEED_MPS * driven_s**2 / 10.0, SPEED_MPS * (driven_s - 5.0))
    angle = way / RADIUS_M
    place = RADIUS_M * np.column_stack([np.sin(angle), 1.0 - np.cos(angle)])
    return place, speed[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])


def table(time_s: FloatArray, topic: str = "gnss", place_m: FloatArray | None = None, **columns: Any) -> Table:
    """Rows of a receiver; ``columns`` replace and add fields, None takes one away."""
    true_m, velocity = motion(time_s)
    place_m = true_m if place_m is None else place_m
    latitude = LATITUDE_DEG + np.rad2deg(place_m[:, 0] / _meridian())
    longitude = LONGITUDE_DEG + np.rad2deg(place_m[:, 1] / (_vertical() * np.cos(np.deg2rad(LATITUDE_DEG))))
    fields: dict[str, Any] = {
        "latitude_deg": latitude,
        "longitude_deg": longitude,
        "altitude_ellipsoid_m": np.full(len(time_s), 150.0),
        "velocity_north_mps": velocity[:, 0],
        "velocity_east_mps": velocity[:, 1],
        "velocity_down_mps": np.zeros(len(time_s)),
        "satellites_used": np.full(len(time_s), 12.0),
        "hdop": np.full(len(time_s), 0.8),
        "fix": np.full(len(time_s), "3d"),
        **columns,
    }
    kept = {name: _column(values) for name, values in fields.items() if values is not None}
    time_ns = np.round(time_s * NS_PER_S).astype(np.int64)
    return Table(topic, time_ns, kept, np.arange(len(time_s)), Column(time_ns))


def _column(values: Any) -> Column:
    if isinstance(values, Column):
        return values
    values = np.asarray(values)
    return Column(values, np.isfinite(values) if values.dtype.kind == "f" else None)


def _meridian() -> float:
    from groundstation.base.geodesy import curvature_radii_m

    return float(curvature_radii_m(LATITUDE_DEG)[0])


def _vertical() -> float:
    from groundstation.base.geodesy import curvature_radii_m

    return float(curvature_radii_m(LATITUDE_DEG)[1])


def flight(*tables: Table) -> Flight:
    """A flight of some tables."""
    return Flight({one.topic: one for one in tables})


def unknown_phases(whole_s: float = WHOLE_S) -> Phases:
    """Phases of a flight of which nothing is known."""
    return Phases((PhaseInterval(0.0, whole_s, "unknown"),), "none")


def reception(*tables: Table, phases: Phases | None = None, **settings: Any) -> Reception:
    """Assess a flight of some tables."""
    return reception_of(flight(*tables), phases or unknown_phases(), settings=GnssSettings(**settings))


def answer(*tables: Table, **settings: Any) -> GnssReception:
    """The answer of a flight of some tables."""
    return reception(*tables, **settings).answer


def receiver(*tables: Table, **settings: Any) -> GnssReceiver:
    """The main receiver of a flight of some tables."""
    return answer(*tables, **settings).receiver


def shares(one: GnssReceiver) -> Mapping[str, float]:
    """Shares of time by state."""
    return {state.state: state.share for state in one.states}
