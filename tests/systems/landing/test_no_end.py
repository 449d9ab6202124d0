"""Reasons why a log has no end of an approach: set down, a landing between proofs, what the autopilot says, none."""

from dataclasses import replace

import numpy as np
import pytest

from groundstation.base.errors import NotAssessableError
from groundstation.base.records import Column
from groundstation.systems.known import Known
from groundstation.systems.landing.analysis import LANDING
from groundstation.systems.landing.no_end import NONE
from groundstation.systems.landing.settings import LandingSettings
from groundstation.tables.phases import PhaseInterval, Phases
from groundstation.tables.table import Flight
from tests.tables.test_phases import flight_of, light_aircraft, sampled

AIRBORNE = PhaseInterval(0.0, 60.0, "airborne")
DOWN = (AIRBORNE, PhaseInterval(60.0, 75.0, "unknown"), PhaseInterval(75.0, 100.0, "standstill"))


def flight(speed_mps: float, said: str = "") -> Flight:
    """A log of a flight whose ground speed is the same throughout, with an event at 70 s."""
    made = flight_of(light_aircraft())
    tables = dict(made.tables)
    for topic, table in made.tables.items():
        if table.has("velocity_north_mps"):
            north, east = np.full(len(table), speed_mps), np.zeros(len(table))
            columns = {"velocity_north_mps": Column(north), "velocity_east_mps": Column(east)}
            tables[topic] = replace(table, columns={**table.columns, **columns})
    if said:
        table = sampled("event", {"x": np.zeros(1)}, np.array([70.0]), 1.0, made.start_ns)
        tables["event"] = replace(table, columns={"name": Column(np.array([said]))})
    return replace(made, tables=tables)


def reason(made: Flight, *intervals: PhaseInterval) -> str:
    with pytest.raises(NotAssessableError) as caught:
        LANDING.run(made, Known(Phases(intervals, "detector")), LandingSettings())
    return str(caught.value)


def test_set_down_without_rolling_is_a_landing_and_no_approach() -> None:
    told = reason(flight(2.0, "Land complete"), *DOWN)
    between = "set down between 1:00 and 1:15 (“Land complete” at 1:10) without rolling: no approach to a runway"
    assert between in told


def test_a_landing_between_the_proofs_is_told_with_its_time() -> None:
    assert "it came down between 1:00 and 1:15, where neither flight nor ground is proven" in reason(
        flight(40.0), *DOWN
    )


def test_the_autopilot_is_not_contradicted_and_a_flight_without_landing_has_none() -> None:
    assert "“Landing detected” at 1:10, but nothing proves a flight" in reason(
        flight(40.0, "Landing detected"), AIRBORNE
    )
    for said in ("", "not landed", "land complete maybe"):
        assert NONE in reason(flight(40.0, said), AIRBORNE)
