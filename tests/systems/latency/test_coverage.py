"""Latencies on simulated flights: intervals hold the truth as often as they say; nothing is said where none moves."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from groundstation.base.units import NS_PER_S
from groundstation.simulation.flight import simulate
from groundstation.simulation.trajectory import Trajectory
from groundstation.systems.latency.answer import Latency
from groundstation.systems.latency.estimate import estimate_latencies
from tests.drawn_flights import motion, recorded
from tests.simulated_flights import FLIGHT_LEGS, scenario

LATENCIES_S, GNSS_HZ, INS_HZ = (0.0, 0.05, 0.2, 0.5), (1.0, 2.0, 5.0, 10.0), (10.0, 20.0, 50.0, 100.0)
BAND_SIGMAS = 3.0  # of the binomial: one run in 370 leaves it by chance
MOST_FALSE = 0.02  # of straight flights called observed
CRUISE_S = 600.0


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
