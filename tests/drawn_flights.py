"""Flights of an INS and a satellite receiver, motion and errors drawn by seed, without a log."""

from functools import cache

import numpy as np

from groundstation.base.records import Column
from groundstation.simulation.flight import simulate
from groundstation.simulation.readings import TopicReadings
from groundstation.simulation.scenario import GnssSettings, InsSettings
from groundstation.simulation.sensors import gnss_readings, ins_readings
from groundstation.simulation.trajectory import Trajectory
from groundstation.tables.table import Flight, Table
from tests.simulated_flights import FLIGHT_LEGS, TAXI_LEGS, scenario


@cache
def motion(number: int) -> Trajectory:
    """Flight ``number``: taxi, take-off, turns of several angles and banks, landing."""
    rng = np.random.default_rng((77, number))
    turns = [
        {"kind": "air_turn", "angle_deg": float(rng.choice([-1, 1]) * rng.uniform(40, 180)), "bank_deg": bank}
        for bank in rng.uniform(12, 30, 3)
    ]
    cruise = [{"kind": "fly", "duration_s": float(rng.uniform(20, 60)), "airspeed_mps": 65.0} for _ in turns]
    legs = FLIGHT_LEGS[:7] + [leg for pair in zip(turns, cruise, strict=True) for leg in pair] + FLIGHT_LEGS[10:]
    return simulate(scenario(legs=TAXI_LEGS if number % 4 == 3 else legs, seed=number)).trajectory


def recorded(trajectory: Trajectory, seed: int, latency_s: float, gnss_hz: float, ins_hz: float) -> Flight:
    """INS and GNSS of a motion, errors drawn by ``seed``."""
    rng = np.random.default_rng((78, seed))
    ins = InsSettings(
        rate_hz=ins_hz,
        velocity_noise_mps=float(rng.uniform(0.002, 0.015)),
        azimuth_error_deg=float(rng.normal(0.0, 1.0)),
        velocity_error_mps=(float(rng.normal(0, 0.5)), float(rng.normal(0, 0.5))),
        drift_dph=(float(rng.normal(0, 0.03)), float(rng.normal(0, 0.03))),
    )
    gnss = GnssSettings(
        rate_hz=gnss_hz,
        latency_s=latency_s,
        antenna_forward_m=float(rng.uniform(-4.0, 6.0)),
        antenna_right_m=float(rng.uniform(-1.0, 1.0)),
        velocity_white_mps=float(rng.uniform(0.02, 0.08)),
        velocity_correlated_mps=float(rng.uniform(0.01, 0.05)),
        velocity_correlation_s=float(np.exp(rng.uniform(0.0, np.log(10.0)))),
    )
    return flight_of(ins_readings(trajectory, ins, rng), gnss_readings(trajectory, gnss, rng))


def flight_of(*parts: TopicReadings) -> Flight:
    tables = {
        part.topic: Table(part.topic, part.time_ns, part.columns, np.arange(len(part.time_ns)), Column(part.time_ns))
        for part in parts
    }
    return Flight(tables=tables)
