"""Flights of the magnetic study: only what the estimator needs, or whole.

Whole flights start on the stand.
"""

from dataclasses import replace
from typing import Any

import numpy as np

from groundstation.base.records import Column
from groundstation.methods.roles import HeadingOnGround
from groundstation.results.roles import Delays, HeadingByTrack
from groundstation.simulation.flight import simulate
from groundstation.simulation.legs import Fly
from groundstation.simulation.magnetic_family import FIGURE_ALTITUDE_M, MagneticFamilySettings, draw_magnetic_scenario
from groundstation.simulation.magnetometer import magnetometer_readings, world_field_nt
from groundstation.simulation.readings import TopicReadings, generator
from groundstation.simulation.scenario import InsSettings, Scenario
from groundstation.simulation.sensors import ins_readings
from groundstation.simulation.trajectory import Trajectory, fly
from groundstation.systems.answers_by_role import answered
from groundstation.systems.magnetic.study.cases import Legs, Setup, WideCell, with_figure
from groundstation.systems.magnetic.study.judge import FlightWithTruth, JudgedAnswer, judge
from groundstation.tables.phases import PhaseInterval, Phases
from groundstation.tables.table import Flight, Table

LEGS_TO_LIFT_OFF = 6
LEVEL_M = 1.0  # within so much of its altitude the figure's part of the flight begins
UNTOLD = Phases((), "not told")
INS_FIELDS = ("latitude_deg", "longitude_deg", "altitude_ellipsoid_m", "roll_deg", "pitch_deg", "true_heading_deg")


class Hangar:
    """Flights of one seed; each trajectory and each taxi is flown once for all setups."""

    def __init__(self, seed: int) -> None:
        self.seed = seed
        self._motions: dict[Scenario, Trajectory] = {}
        self._taxis: dict[float, HeadingByTrack | None] = {}

    def outcome(self, setup: Setup, figure: Legs | None = None) -> JudgedAnswer:
        """Fly one setup and judge the estimator's answer.

        ``figure``: flown instead of that of the family.
        """
        scenario = draw_magnetic_scenario(setup.family, self.seed)
        if figure is not None:
            scenario = replace(scenario, legs=with_figure(scenario.legs, figure))
        flown = self.flown(scenario, setup)
        heading = self._taxi(setup.family) if setup.is_aligned else None
        if heading is not None and setup.hours_since_taxi:
            heading = _earlier(heading, 3600.0 * setup.hours_since_taxi)
        phases = Phases((PhaseInterval(0.0, flown.flight.duration_s + 1.0, "airborne"),), "truth")
        on_ground = answered(flown.flight, phases, ()).role(HeadingOnGround)
        return judge(flown, heading=heading, on_ground=on_ground, phases=phases)

    def flown(self, scenario: Scenario, setup: Setup) -> FlightWithTruth:
        """Return the level part of a flight."""
        motion = self._motion(scenario)
        assert scenario.magnetometer is not None
        field = world_field_nt(motion, scenario, scenario.magnetometer)
        ins = scenario.ins
        added = ins.azimuth_drift_dph * setup.hours_since_taxi
        moved = replace(ins, azimuth_error_deg=ins.azimuth_error_deg + added)
        tables = [
            ins_readings(motion, moved, generator(self.seed, "ins"), self.seed).only(INS_FIELDS),
            magnetometer_readings(motion, scenario, scenario.magnetometer, generator(self.seed, "magnetometer")),
        ]
        return FlightWithTruth(scenario, _flight(scenario, tables), motion, field)

    def _motion(self, scenario: Scenario) -> Trajectory:
        key = replace(scenario, ins=InsSettings(), magnetometer=None)
        if key not in self._motions:
            whole = fly(scenario, generator(scenario.seed, "motion"))
            first = int(np.argmax(whole.altitude_m > FIGURE_ALTITUDE_M - LEVEL_M))
            self._motions[key] = whole.at(np.arange(first, len(whole)))
        return self._motions[key]

    def _taxi(self, family: MagneticFamilySettings) -> HeadingByTrack | None:
        """Return the heading error by the taxi before the flight.

        The taxi has the same azimuth error, and no drift.
        """
        sigma = family.heading_error_sigma_deg
        if sigma not in self._taxis:
            drawn = draw_magnetic_scenario(replace(family, drift_sigma_dph=0.0), self.seed)
            legs = (*drawn.legs[:LEGS_TO_LIFT_OFF], Fly(10.0, family.airspeed_mps))
            known = answered(simulate(replace(drawn, legs=legs)).flight, UNTOLD, (HeadingByTrack,))
            self._taxis[sigma] = known.answer_meeting(HeadingByTrack)
        return self._taxis[sigma]


def wide_outcome(cell: WideCell, seed: int) -> JudgedAnswer:
    """Fly a whole flight from stand to landing and answer it as the pipeline does.

    Latencies, taxi, deviation.
    """
    simulated = simulate(draw_magnetic_scenario(cell.family, seed))
    scenario, motion, flight = simulated.scenario, simulated.trajectory, simulated.flight
    assert scenario.magnetometer is not None
    field = world_field_nt(motion, scenario, scenario.magnetometer)
    if not cell.is_load_logged:
        flight = replace(flight, tables={topic: flight[topic] for topic in flight.topics() if topic != "electric"})
    heading = answered(flight, UNTOLD, (HeadingByTrack,)).answer_meeting(HeadingByTrack)
    known = answered(flight, UNTOLD, (Delays,))
    return judge(
        FlightWithTruth(scenario, flight, motion, field),
        heading=heading,
        on_ground=known.role(HeadingOnGround),
        latencies=known.answer_meeting(Delays),
    )


def judged_outcome(family: MagneticFamilySettings, seed: int) -> JudgedAnswer:
    """Return a whole flight of a family."""
    return wide_outcome(WideCell(family), seed)


def _earlier(heading: HeadingByTrack, by_s: float) -> HeadingByTrack:
    """Return a heading error as if the taxi had been so much earlier."""
    answer: Any = heading  # a frozen dataclass, as every answer is
    earlier: HeadingByTrack = replace(answer, reference_time_s=(heading.reference_time_s or 0.0) - by_s)
    return earlier


def _flight(scenario: Scenario, readings: list[TopicReadings]) -> Flight:
    """Return readings as the tables of a flight."""
    zero_ns = scenario.start_utc_ns or 0
    tables = {
        part.topic: Table(
            topic=part.topic,
            time_ns=part.time_ns + zero_ns,
            columns=part.columns,
            record_index=np.arange(len(part.time_ns), dtype=np.int64),
            device_time_ns=Column(part.time_ns),
        )
        for part in readings
    }
    return Flight(tables, {"aircraft": scenario.aircraft}, zero_ns, scenario.start_utc_ns is not None, scenario.name)
