"""Constant offset of a case to the direction of travel: straights alone, medians, sigmas that hold."""

import numpy as np
import pytest
from numpy.typing import NDArray

from groundstation.base.angles import wrap_180, wrap_360
from groundstation.systems.trajectory.mounting_offset import travel_offset

FloatArray = NDArray[np.float64]
RATE_HZ, LENGTH_S = 10.0, 1200.0
YAW_DEG, PITCH_DEG = 3.2, -1.7
SIGMAS = 4.0
RUNS = 40


def drive(rng: np.random.Generator) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Time, heading of the car and velocity: a turn each 40 s, stops, a hill."""
    time_s = np.arange(0.0, LENGTH_S, 1.0 / RATE_HZ)
    turning = (time_s % 40.0) > 34.0
    heading = np.cumsum(np.where(turning, 15.0, 0.0)) / RATE_HZ + rng.uniform(0.0, 360.0)
    speed = np.where((time_s % 200.0) > 170.0, 0.0, 12.0)
    slope = np.deg2rad(2.0 * np.sin(time_s / 50.0))
    slip = np.where(turning, 2.0, 0.0)
    track = np.deg2rad(heading + slip)
    velocity = np.column_stack([np.cos(track), np.sin(track), -np.tan(slope)]) * speed[:, None]
    return time_s, heading, velocity


def case_of(rng: np.random.Generator, noise_deg: float) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Time, heading and pitch of a case with an offset, velocity; errors that last 5 s."""
    time_s, heading, velocity = drive(rng)
    speed = np.hypot(velocity[:, 0], velocity[:, 1])
    slope = np.rad2deg(np.arctan2(-velocity[:, 2], np.maximum(speed, 1e-9)))
    lasting = [np.repeat(rng.normal(0.0, noise_deg, len(time_s) // 50 + 1), 50)[: len(time_s)] for _ in range(2)]
    return time_s, wrap_360(heading + YAW_DEG + lasting[0]), slope + PITCH_DEG + lasting[1], velocity


def test_offset_to_travel_is_exact_without_errors() -> None:
    """Slip in turns and stops are left out."""
    found = travel_offset(*case_of(np.random.default_rng(1), 0.0))
    assert (found.yaw_deg, found.pitch_deg) == pytest.approx((YAW_DEG, PITCH_DEG), abs=1e-9)
    assert 0.5 * LENGTH_S < found.seconds < 0.8 * LENGTH_S


def test_offset_of_a_case_mounted_backwards_does_not_average_across_the_seam() -> None:
    time_s, heading, pitch, velocity = case_of(np.random.default_rng(2), 1.0)
    found = travel_offset(time_s, wrap_360(heading - YAW_DEG + 180.0), pitch, velocity)
    assert abs(wrap_180(found.yaw_deg - 180.0)) < 1.0


def test_sigmas_of_the_offset_to_travel_hold() -> None:
    ratios = []
    for seed in range(RUNS):
        found = travel_offset(*case_of(np.random.default_rng(seed), 1.0))
        ratios.append((found.yaw_deg - YAW_DEG) / found.yaw_sigma_deg)
        ratios.append((found.pitch_deg - PITCH_DEG) / found.pitch_sigma_deg)
    squares = np.mean(np.square(ratios))
    assert 0.4 < squares < 1.6  # mean square of 2 x 40 ratios; a robust spread of 30 stretches is itself good to 15 %
    assert np.max(np.abs(ratios)) < SIGMAS


def test_outliers_do_not_move_the_offset_to_travel() -> None:
    time_s, heading, pitch, velocity = case_of(np.random.default_rng(4), 0.5)
    wild = (time_s > 300.0) & (time_s < 420.0)
    found = travel_offset(time_s, wrap_360(heading + np.where(wild, 40.0, 0.0)), pitch, velocity)
    assert found.yaw_deg == pytest.approx(YAW_DEG, abs=0.5)


def test_without_straights_there_is_no_offset_to_travel() -> None:
    time_s, heading, pitch, velocity = case_of(np.random.default_rng(5), 0.5)
    none = travel_offset(time_s[:0], heading[:0], pitch[:0], velocity[:0])
    for slow in (travel_offset(time_s, heading, pitch, 0.1 * velocity), none):
        assert np.isnan([slow.yaw_deg, slow.yaw_sigma_deg, slow.pitch_deg]).all() and slow.blocks == 0
