"""Latencies on simulated flights: intervals hold the truth as often as they say; nothing is said where none moves."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from groundstation.base.records import Column
from groundstation.base.units import NS_PER_S
from groundstation.simulation.flight import simulate
from groundstation.simulation.readings import TopicReadings
from groundstation.simulation.scenario import GnssSettings, InsSettings
from groundstation.simulation.sensors import gnss_readings, ins_readings
from groundstation.simulation.trajectory import Trajectory
from groundstation.systems.latency.answer import Latency
from groundstation.systems.latency.estimate import estimate_latencies
from groundstation.tables.table import Flight, Table
from tests.simulated_flights import FLIGHT_LEGS, TAXI_LEGS, scenario

LATENCIES_S, GNSS_HZ, INS_HZ = (0.0, 0.05, 0.2, 0.5), (1.0, 2.0, 5.0, 10.0), (10.0, 20.0, 50.0, 100.0)
BAND_SIGMAS = 3.0  # of the binomial: one run in 370 leaves it by chance
MOST_FALSE = 0.02  # of straight flights called observed
CRUISE_S = 600.0


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


@cache
def straight() -> Trajectory:
    """A take-off, and ten minutes straight on."""
    legs = [*FLIGHT_LEGS[:7], {"kind": "fly", "duration_s": CRUISE_S, "airspeed_mps": 70.0}]
    return simulate(scenario(legs=legs)).trajectory


def cruise_only(seed: int) -> Latency:
    """Answer for draw ``seed`` of a log that holds nothing but the straight part."""
    flight = recorded(straight(), seed, 0.2, 10.0, 50.0)
    begin_ns = flight["ins"].time_ns[-1] - round((CRUISE_S - 30.0) * NS_PER_S)
    cut = {name: table.take(table.time_ns > begin_ns) for name, table in flight.tables.items()}
    return estimate_latencies(replace(flight, tables=cut, start_ns=int(begin_ns))).rows[0]


def estimated(seed: int) -> tuple[float, Latency]:
    """True latency and answer of draw ``seed``."""
    rng = np.random.default_rng((79, seed))
    latency_s = LATENCIES_S[seed // 4 % 4]
    flight = recorded(motion(seed % 16), seed, latency_s, float(rng.choice(GNSS_HZ)), float(rng.choice(INS_HZ)))
    return latency_s, estimate_latencies(flight).rows[0]


def coverage(seeds: range) -> tuple[int, int]:
    """How many draws are observed, and how many of their intervals hold the truth."""
    answers = [estimated(seed) for seed in seeds]
    found = [(truth, row.confidence95_s) for truth, row in answers if row.confidence95_s is not None]
    return len(found), sum(low <= truth <= high for truth, (low, high) in found)


def coverage_limits(count: int) -> tuple[float, float]:
    """Share of intervals that hold the truth: at most 5 % and what the binomial allows may miss it."""
    sigma = float(np.sqrt(0.95 * 0.05 / count))
    return 0.95 - BAND_SIGMAS * sigma, 1.0


def test_intervals_hold_the_truth_on_a_few_flights() -> None:
    observed, inside = coverage(range(8))
    assert observed >= 6
    assert inside >= observed - 2


def test_straight_flight_is_not_observable() -> None:
    answers = [cruise_only(seed) for seed in range(4)]
    assert [row.state for row in answers] == ["not_observable"] * 4
    assert all(row.reason.startswith(("too little motion", "noise")) for row in answers)


@pytest.mark.slow
def test_coverage_of_the_interval() -> None:
    observed, inside = coverage(range(400))
    assert observed >= 300
    low, high = coverage_limits(observed)
    assert low <= inside / observed <= high


@pytest.mark.slow
def test_straight_flights_are_hardly_ever_called_observed() -> None:
    false = sum(cruise_only(seed).state == "observed" for seed in range(100, 300))
    assert false <= MOST_FALSE * 200
