"""Strapdown on exact increments, and the transition of an epoch against central differences."""

import numpy as np
import pytest

from groundstation.simulation.imu.families import Family
from groundstation.systems.trajectory.states import BARO, FAST, LEV, MNT, NAVIGATION, SLOW, STATES
from tests.systems.trajectory.core_cases import (
    SIZES,
    carried,
    correction_between,
    nudged,
    perfect,
    plan_of,
    rotation_of,
    samples_of,
    start_at,
    transition,
)

# Largest error of the velocity after 600 s, m/s. The error of coning and sculling is of the fourth order in the
# interval: at 50 Hz it is 10 to 20 times that at 100 Hz. Measured at 100 Hz: drive 3.5e-7, uav 9.5e-7, hover 1.0e-7,
# start in motion (the fastest turns, from the first sample on) 1.1e-6; hover at 50 Hz 1.9e-6.
EXACT_MPS: dict[tuple[Family, float], float] = {
    ("drive", 100.0): 1e-6,
    ("uav", 100.0): 1e-6,
    ("hover", 100.0): 1e-6,
    ("hover", 50.0): 3e-6,
    ("start_in_motion", 100.0): 1.5e-6,
}
EXACT_RAD = 3e-9
EVERY = 100
# Error of the transition over 0.2 s, as the effect of a correction of the size of ``SIZES``. The unit's axes are those
# at the start of each sample: half a sample of turn, 1e-3 at 15 deg/s. Rounding of the latitude is 1e-6 m.
POSITION_M, VELOCITY_MPS, ATTITUDE_RAD = 3e-5, 2e-4, 1e-5


@pytest.mark.parametrize(("family", "rate_hz"), EXACT_MPS)
def test_exact_increments_give_the_true_velocity(family: Family, rate_hz: float) -> None:
    flight = perfect(family, rate_hz, 600.0)
    samples = samples_of(flight)
    nav = carried(samples, plan_of(samples, [0, len(samples.time_s)]), start_at(flight, 0.0)).nav
    assert np.abs(nav[:, 3:6] - flight.velocity_mps).max() < EXACT_MPS[family, rate_hz]
    turn = rotation_of(nav[::EVERY, 6:])
    for at, matrix in zip(range(0, len(nav), 20 * EVERY), turn[::20], strict=True):
        truth = rotation_of(start_at(flight, flight.true_time_s[at]).nav[6:])
        assert np.abs(matrix - truth).max() < EXACT_RAD


@pytest.mark.parametrize(("family", "time_s"), [("uav", 100.0), ("hover", 83.0), ("drive", 120.0), ("drive", 150.0)])
def test_transition_of_an_epoch_is_the_derivative_of_the_strapdown(family: Family, time_s: float) -> None:
    flight = perfect(family)
    samples, first = samples_of(flight), round(time_s * 100.0)
    value = np.zeros(STATES)
    value[NAVIGATION:LEV] = 0.3 * SIZES[NAVIGATION:LEV] * np.random.default_rng(1).standard_normal(LEV - NAVIGATION)
    start, plan = start_at(flight, time_s, value), plan_of(samples, [first, first + 20])
    linear = carried(samples, plan, start)
    end = linear.nav[first + 19].copy()
    found = transition(linear, 1)[:NAVIGATION, :LEV]
    wanted = np.empty_like(found)
    for state in range(LEV):
        by = 1e-3 * SIZES[state]
        up, down = (carried(samples, plan, nudged(start, state, sign * by)).nav[first + 19] for sign in (1.0, -1.0))
        wanted[:, state] = (correction_between(end, up) - correction_between(end, down)) / (2.0 * by)
    off = np.abs((found - wanted) * SIZES[:LEV])
    assert off[:3].max() < POSITION_M and off[3:6].max() < VELOCITY_MPS and off[6:].max() < ATTITUDE_RAD
    moves = np.abs(wanted * SIZES[:LEV])
    assert (moves[:, [*range(3, 9), *range(9, 15)]].max(axis=0) > 1e-4).all()  # each of them is seen in the derivative


def test_other_states_stay_or_fade() -> None:
    flight = perfect("uav")
    samples = samples_of(flight)
    value = np.ones(STATES)
    value[:LEV] = 0.0
    start, plan = start_at(flight, 100.0, value), plan_of(samples, [10_000, 10_020, 10_040])
    linear = carried(samples, plan, start)
    np.testing.assert_allclose(linear.value[2, LEV:SLOW], 1.0, rtol=0.0, atol=0.0)
    np.testing.assert_allclose(linear.value[2, SLOW:FAST], np.exp(-0.4 / 300.0), rtol=1e-12)
    np.testing.assert_allclose(linear.value[2, FAST:MNT], np.exp(-0.4 / 10.0), rtol=1e-12)
    np.testing.assert_allclose(linear.value[2, MNT:BARO], 1.0, rtol=0.0, atol=0.0)
    np.testing.assert_allclose(np.diag(transition(linear, 1))[SLOW:MNT], np.exp(-0.2 / np.repeat([300.0, 10.0], 3)))
