"""States as others read them: at other times, of other points, saved, and by the role."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from groundstation.base.angles import wrap_180
from groundstation.results.answer import answer_meeting
from groundstation.results.arrays.states import BodyStates
from groundstation.results.files import load, save
from groundstation.results.manifest import Manifest
from groundstation.results.roles import StatesAlongTheFlight
from groundstation.systems.trajectory.answer import VELOCITY_LAG, BestTrajectory, TrajectoryParameter
from groundstation.systems.trajectory.figures import offsets_m, states_of
from tests.systems.trajectory.made import track
from tests.systems.trajectory.made_answers import accepted, ambiguous, doubtful, results_of

ROUNDED_M = 1e-6  # by double precision of degrees


def test_states_between_two_are_interpolated_and_none_in_a_gap() -> None:
    states = states_of(track(gap_s=(250.0, 290.0)), "msl")
    found = states.at(np.array([100.02, 270.0, 700.0]))
    assert found.segment.tolist() == [0, -1, -1]
    assert np.isfinite(found.latitude_deg).tolist() == [True, False, False]
    row = int(np.searchsorted(states.time_s, 100.0))
    expected = states.true_heading_deg[row] + 0.4 * wrap_180(np.diff(states.true_heading_deg[row : row + 2]))[0]
    assert found.true_heading_deg[0] == pytest.approx(expected % 360.0)
    assert found.altitude_ellipsoid_m is None


def test_another_point_of_the_body_moves_with_it() -> None:
    states = states_of(track(), "ellipsoid")
    arm = (1.5, -0.5, 0.8)
    moved = states.at_point(*arm)
    assert states.altitude_ellipsoid_m is not None and moved.altitude_ellipsoid_m is not None
    places = [(one.latitude_deg, one.longitude_deg, one.altitude_ellipsoid_m) for one in (moved, states)]
    offsets = offsets_m(*places)  # type: ignore[arg-type]
    assert np.allclose(np.linalg.norm(offsets, axis=1), np.linalg.norm(arm), atol=1e-5)
    heading = np.deg2rad(states.true_heading_deg)
    forward = offsets[:, 0] * np.cos(heading) + offsets[:, 1] * np.sin(heading)
    assert np.allclose(forward, arm[0], atol=0.05), "tilt is at most 4 deg"
    speed = np.column_stack([moved.velocity_north_mps, moved.velocity_east_mps]) - np.column_stack(
        [states.velocity_north_mps, states.velocity_east_mps]
    )
    step = np.diff(offsets[:, :2], axis=0) / np.diff(states.time_s)[:, None]
    assert np.allclose(0.5 * (speed[1:] + speed[:-1])[2:-2], step[2:-2], atol=2e-3)


def test_states_are_saved_whole_without_a_copy_for_people(tmp_path: Path) -> None:
    results = results_of(accepted())
    save(tmp_path, results, Manifest())
    assert (tmp_path / "arrays" / "trajectory_states.parquet").is_file()
    assert (tmp_path / "tables" / "trajectory_track.csv").is_file()
    assert not (tmp_path / "tables" / "trajectory_states.csv").exists()
    saved = load(tmp_path, {"trajectory": BestTrajectory}).results
    back, was = saved.rows_of(BodyStates), results.rows_of(BodyStates)
    assert back is not None and was is not None and len(back) == len(was) == 12_000
    assert np.array_equal(back.true_heading_deg, was.true_heading_deg)


def test_the_role_is_that_of_an_accepted_solution_alone() -> None:
    for make, is_one in ((accepted, True), (doubtful, False), (ambiguous, False)):
        answer = make()
        found = answer_meeting({"trajectory": answer}, StatesAlongTheFlight)
        assert found is answer and found.is_reference is is_one
    found = accepted()
    assert found.by_it == "by the best trajectory (heading to 0.3 deg)"
    assert found.gnss_latency == (0.112, 0.004)
    assert found.antenna_arm_m == (0.61, -0.05, 0.0), "what is not observable is left at zero"
    assert replace(found, figures=()).body_states() is None
    bare = replace(found, parameters=())
    assert bare.gnss_latency is None and bare.antenna_arm_m == (0.0, 0.0, 0.0)


def test_velocity_of_gnss_behind_the_filter_is_what_both_are_behind_the_unit() -> None:
    answer = accepted()
    assert answer.onboard is not None and answer.onboard.delay_s is not None
    found = answer.velocity_latency("ins")
    assert found is not None and found[0] == pytest.approx(0.112 - answer.onboard.delay_s)
    lag = TrajectoryParameter(VELOCITY_LAG, "latency", "s", 0.2, 0.003, 0.1, True)
    later = replace(answer, parameters=(*answer.parameters, lag)).velocity_latency("ins")
    assert later is not None and later[0] - found[0] == pytest.approx(0.2) and later[1] > found[1]
    assert answer.velocity_latency("ins.2") is None and replace(answer, onboard=None).velocity_latency("ins") is None
