"""Logs of simulators are told from logs of aircraft, and the page and the terminal say so."""

from dataclasses import replace

import numpy as np
import pytest

from groundstation.pipeline.one_flight.line import line_of_results
from groundstation.results.flight import SIMULATED_BY
from groundstation.systems import systems
from groundstation.tables.simulated import simulated_by
from tests.report_example import example
from tests.tables.test_phases import flight_of, light_aircraft, sampled
from tests.told import front

TIMES_S = np.arange(5.0)


@pytest.mark.parametrize(
    ("topic", "name", "value", "told"),
    [
        ("raw.SIMSTATE", "yaw", 1.0, "SIMSTATE"),
        ("raw.SIM2.0", "PN", 1.0, "SIM2"),
        ("raw.vehicle_attitude_groundtruth", "q[0]", 1.0, "vehicle_attitude_groundtruth"),
        ("raw.HEARTBEAT", "base_mode", 32.0, "HEARTBEAT: hardware in the loop"),
        ("raw.HEARTBEAT", "base_mode", 209.0, ""),
        ("raw.vehicle_status", "hil_state", 1.0, "vehicle_status.hil_state"),
        ("raw.vehicle_status", "hil_state", 0.0, ""),
        ("raw.SIMPLE", "x", 1.0, ""),
    ],
)
def test_what_only_a_simulator_logs_tells_it(topic: str, name: str, value: float, told: str) -> None:
    flight = flight_of(light_aircraft())
    table = sampled(topic, {name: np.full(5, value)}, TIMES_S, 1.0, flight.start_ns)
    assert simulated_by(replace(flight, tables={**flight.tables, topic: table})) == told


def test_the_head_of_a_log_tells_it() -> None:
    flight = flight_of(light_aircraft())
    assert simulated_by(replace(flight, metadata={"ver_hw": "PX4_SITL"})) == "ver_hw PX4_SITL"
    assert simulated_by(replace(flight, metadata={"ver_hw": "PX4_FMU_V5"})) == ""


def test_the_page_and_the_terminal_say_it_first() -> None:
    results = replace(example(), metadata={SIMULATED_BY: "SIMSTATE", "note": "by hand"})
    assert front(results).note == "simulated vehicle (SIMSTATE); by hand"
    assert line_of_results(results, systems()).startswith("simulated vehicle (SIMSTATE); ")
    assert "simulated" not in line_of_results(replace(results, metadata={}), systems())
