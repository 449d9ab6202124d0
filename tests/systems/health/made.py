"""Flights of a PX4 autopilot made of arrays, for the checks of its health."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike

from groundstation.base.records import Column
from groundstation.systems.known import Known
from groundstation.tables.phases import Phases
from groundstation.tables.table import Flight, Table

NS = 1_000_000_000
KNOWN = Known(Phases((), "none"))
END_S = 100.0


def table(topic: str, time_s: ArrayLike, **columns: ArrayLike) -> Table:
    """A topic; ``name__0`` stands for ``name[0]``."""
    time_ns = np.round(np.asarray(time_s, dtype=np.float64) * NS).astype(np.int64)
    made = {}
    for name, values in columns.items():
        base, _, place = name.partition("__")
        field = f"{base}[{place}]" if place else base
        made[field] = Column(np.broadcast_to(np.asarray(values), (len(time_ns),)).copy())
    return Table(topic, time_ns, made, np.arange(len(time_ns)), Column(time_ns))


def flight(*tables: Table, metadata: Mapping[str, str] | None = None) -> Flight:
    """A flight of 100 s: on the ground up to 10 s, in the air up to 90 s."""
    every = np.arange(0.0, END_S + 0.5, 1.0)
    landed = ((every < 10.0) | (every >= 90.0)).astype(np.float64)
    status = table("raw.vehicle_land_detected", every, landed=landed)
    named = {one.topic: one for one in (status, *tables)}
    return Flight(named, metadata or {}, 0, False, "made.ulg")


def seconds(step_s: float = 0.2) -> np.ndarray:
    """Times from 0 to 100 s."""
    return np.arange(0.0, END_S, step_s)
