"""Robots on wheels with cameras: what the camera adds, what one tells another that it sees, unknown correlation."""

from dataclasses import replace

import numpy as np
import pytest

from groundstation.systems.cooperative.algorithms import run_algorithm
from groundstation.systems.cooperative.consistency import judge
from groundstation.systems.cooperative.events import prepare
from groundstation.systems.cooperative.filters.sighting import sighting_of
from groundstation.systems.cooperative.filters.split_covariance import fuse
from groundstation.systems.cooperative.filters.steps import MeasurementEvent
from groundstation.systems.cooperative.loop_types import PEER
from groundstation.systems.cooperative.settings import CameraBelief, CooperativeSettings, OdometryBelief
from groundstation.systems.cooperative.tracks import VehicleTrack
from groundstation.systems.cooperative.wheeled_vehicle import WheeledVehicle
from groundstation.tables.session import NO_SLOT, GroundPoint, Odometry, Ranges, Session

SEEDS = range(500, 505)  # written down before the first run
STEP_S, DURATION_S = 0.2, 120.0
CAMERA = {"range_bias_m": 0.1, "range_scale": 0.03, "marker_bias_m": -0.05, "mount_deg": 1.5, "lag_s": 0.15}
SCALE = 0.08  # of the odometry, speed and turn
BELIEF = CooperativeSettings(
    odometry=OdometryBelief(
        position_m=0.05, along_m_per_sqrt_s=0.005, turn_deg_per_sqrt_s=0.3, speed_scale=0.1, turn_scale=0.1
    ),
    camera=CameraBelief(range_scale=0.05, marker_bias_m=0.05, mount_deg=2.0, lag_s=0.1),
    range_bias_m=0.1,
    gate_sigma=0.0,
    latency_slots=0,
)
DECENTRALISED = ("neighbour_exact", "ranked", "modified", "split_intersection", "pairwise")


class Team:
    """R1 drives among three landmarks and sees R2; R2 sees nothing at all."""

    def __init__(self, rng: np.random.Generator, noise: float = 1.0) -> None:
        self.time_s = np.arange(0.0, DURATION_S, STEP_S)
        poses = [
            self._drive(place, turn, noise * rng.standard_normal((2, len(self.time_s)))) for place, turn in _STARTS
        ]
        self.truth = {name: pose for name, (pose, _) in zip(("R1", "R2"), poses, strict=True)}
        self.vehicles = tuple(
            Odometry(
                name, self.time_s, odometry[0], np.rad2deg(odometry[1]), (pose[0, 0], pose[0, 1]), pose[0, 2] * DEG
            )
            for (name, pose), (_, odometry) in zip(self.truth.items(), poses, strict=True)
        )
        points = {"L1": (4.0, 0.0), "L2": (-4.0, 3.0), "L3": (0.0, -5.0)}
        self.points = tuple(GroundPoint(name, (*place, 0.0)) for name, place in points.items())
        places = {name: np.tile(place, (len(self.time_s), 1)) for name, place in points.items()}
        self.ranges = self._measure(places | {"R2": self.truth["R2"][:, :2]}, rng, noise)

    def _drive(self, place: tuple[float, float], turn: float, noise: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """True pose (n, 3) and what the odometry reads: too much way, too much turn, and noise."""
        rate = turn * np.where(np.sin(0.1 * self.time_s) > -0.3, 1.0, -1.0)
        root = np.sqrt(STEP_S)
        speed, rate = 0.2 + 0.005 / root * noise[0], rate + np.deg2rad(0.3) / root * noise[1]
        heading = np.concatenate([[0.0], np.cumsum(rate[:-1] * STEP_S)])
        middle = heading + 0.5 * rate * STEP_S
        steps = (speed * STEP_S)[:, None] * np.column_stack([np.cos(middle), np.sin(middle)])
        position = np.array(place) + np.concatenate([np.zeros((1, 2)), np.cumsum(steps[:-1], axis=0)])
        mean_speed, mean_rate = np.full_like(speed, 0.2), turn * np.where(np.sin(0.1 * self.time_s) > -0.3, 1.0, -1.0)
        return np.column_stack([position, heading]), np.array([mean_speed, mean_rate]) / (1.0 - SCALE)

    def _measure(self, places: dict[str, np.ndarray], rng: np.random.Generator, noise: float) -> Ranges:
        """Every second one sighting, of all in turn, as it was ``lag_s`` before."""
        names, late = list(places), np.arange(1.0, DURATION_S - 1.0, 0.4) + 0.05
        rows = []
        for number, at_s in enumerate(late):
            name, taken = names[number % len(names)], at_s - CAMERA["lag_s"]
            here = np.array([np.interp(taken, self.time_s, self.truth["R1"][:, k]) for k in range(3)])
            there = [np.interp(at_s, self.time_s, places[name][:, k]) for k in range(2)]
            line = np.array(there) - here[:2]
            distance = float(np.hypot(*line))
            value = CAMERA["range_bias_m"] + (1.0 + CAMERA["range_scale"]) * distance
            value += (CAMERA["marker_bias_m"] if name == "R2" else 0.0) + 0.02 * noise * rng.standard_normal()
            bearing = np.arctan2(line[1], line[0]) - here[2] - np.deg2rad(CAMERA["mount_deg"])
            bearing += np.deg2rad(0.5) * noise * rng.standard_normal()
            rows.append((at_s, name, value, (bearing * DEG + 180.0) % 360.0 - 180.0))
        n = len(rows)
        at, source, value, bearing = (np.array(column) for column in zip(*rows, strict=True))
        r1 = np.full(n, "R1")
        return Ranges(
            at, r1, source, value, np.full(n, 0.02), np.full(n, NO_SLOT), bearing, np.full(n, 0.5), is_two_way=True
        )

    def session(self, ranks: dict[str, int] | None = None) -> Session:
        return Session("local", self.vehicles, self.points, self.ranges, ranks=ranks or {"R1": 1, "R2": 2})

    def judge(self, algorithm: str, settings: CooperativeSettings = BELIEF) -> dict[str, tuple[float, float]]:
        """RMS error and mean NEES of every robot."""
        run = run_algorithm(prepare(self.session(), settings), settings, algorithm)
        found = {}
        for track, vehicle in zip(run.tracks, self.vehicles, strict=True):
            pose = self.truth[track.name]
            one = judge(track, vehicle, self.time_s, np.column_stack([pose[:, :2], np.zeros(len(pose))]))
            found[track.name] = (one.rms_m, float(np.nanmean(one.nees)))
        return found


DEG = float(np.rad2deg(1.0))
_STARTS = (((0.0, 0.0), 0.15), ((1.5, 1.5), 0.1))


def test_errors_of_camera_and_odometry_are_found_without_calibration() -> None:
    team = Team(np.random.default_rng(1), noise=0.0)
    prepared = prepare(team.session(), BELIEF)
    run = run_algorithm(prepared, BELIEF, "centralised")
    found = dict(zip(prepared.vehicles[0].states, run.tracks[0].state[-1], strict=True))
    sigma = dict(zip(prepared.vehicles[0].states, np.sqrt(np.diag(run.tracks[0].covariance[-1])), strict=True))
    expected = {
        "range_bias_m": 0.1,
        "range_scale": 0.03,
        "mount_rad": np.deg2rad(1.5),
        "lag_s": 0.15,
        "speed_scale": SCALE,
        "turn_scale": SCALE,
    }
    for name, value in expected.items():
        assert abs(found[name] - value) < 3.0 * sigma[name], name  # of the start; the lag is linear in the turn
        assert sigma[name] < 0.5 * abs(value), name
    assert team.judge("centralised")["R1"][0] < 0.02 < team.judge("dead_reckoning")["R1"][0]


@pytest.mark.parametrize("algorithm", DECENTRALISED)
def test_who_is_seen_learns_where_it_stands(algorithm: str) -> None:
    """R2 measures nothing. It is told by R1; a range without a bearing tells no place."""
    team = Team(np.random.default_rng(2))
    seen = team.judge(algorithm)["R2"][0]
    unseen = team.judge("dead_reckoning")["R2"][0]
    assert seen < 0.1 and unseen > 0.4, (seen, unseen)
    if algorithm != "pairwise":
        team.ranges = replace(team.ranges, bearing_deg=None, bearing_sigma_deg=None)
        assert team.judge(algorithm)["R2"][0] == pytest.approx(unseen)


def test_equal_ranks_tell_one_another_nothing() -> None:
    team = Team(np.random.default_rng(2))
    prepared = prepare(team.session({"R1": 1, "R2": 1}), BELIEF)
    run = run_algorithm(prepared, BELIEF, "ranked")
    assert run.messages.get("R1") is None
    assert run_algorithm(prepare(team.session(), BELIEF), BELIEF, "ranked").messages["R1"][0] > 50


@pytest.mark.slow
def test_honesty_of_filters_that_keep_correlations() -> None:
    """NEES of R2 over all seeds: near 2 for the centralised filter, not above it for covariance intersection."""
    teams = [Team(np.random.default_rng(seed)) for seed in SEEDS]
    centralised = np.mean([team.judge("centralised")["R2"][1] for team in teams])
    split = np.mean([team.judge("split_intersection")["R2"][1] for team in teams])
    assert 1.0 < centralised < 3.5 and split < 2.5, (centralised, split)


@pytest.mark.parametrize("algorithm", ["centralised", "split_intersection", "pairwise"])
def test_a_robot_that_was_carried_away_is_found_again(algorithm: str) -> None:
    """R1 is put 2 m aside after a minute; its wheels tell nothing of it."""
    team = Team(np.random.default_rng(8))
    moved = team.truth["R1"] + np.where(team.time_s > 60.0, 1.0, 0.0)[:, None] * (1.5, -1.5, 0.0)
    team.truth["R1"] = moved
    places = {point.name: np.tile(point.position_m[:2], (len(moved), 1)) for point in team.points}
    team.ranges = team._measure(places | {"R2": team.truth["R2"][:, :2]}, np.random.default_rng(9), 1.0)
    settings = replace(BELIEF, gate_sigma=5.0)
    run = run_algorithm(prepare(team.session(), settings), settings, algorithm)
    error = run.tracks[0].position_m[-10:, :2] - np.array(
        [[np.interp(at, team.time_s, moved[:, k]) for k in (0, 1)] for at in run.tracks[0].time_s[-10:]]
    )
    assert run.counts["reopened"] >= 1 and np.sqrt((error**2).sum(axis=1).mean()) < 0.1, error


def test_a_sighting_against_central_differences() -> None:
    team = Team(np.random.default_rng(3))
    observer = WheeledVehicle(team.vehicles[0], BELIEF)
    x = observer.start()[0] + 0.05 * np.random.default_rng(4).standard_normal(observer.size)
    event = MeasurementEvent(3.1, PEER, 0, 1, 2.0, 1e-4, NO_SLOT, np.zeros(3), 0.4, 1e-4, True, np.zeros(3), 1.0, 0)
    found = sighting_of(event, observer, x)
    assert found is not None
    for at in range(observer.size):
        step = np.zeros(observer.size)
        step[at] = 1e-6
        ends = [sighting_of(event, observer, state) for state in (x + step, x - step)]
        assert ends[0] is not None and ends[1] is not None
        numeric = (ends[0].place_m - ends[1].place_m) / 2e-6
        assert found.derivative[:, at] == pytest.approx(numeric, abs=1e-7), observer.states[at]
    assert sighting_of(event._replace(value_m=float("nan")), observer, x) is None


def test_readings_that_repeat_themselves_weigh_what_they_tell() -> None:
    """A mean over many readings of a Gauss-Markov error has the variance that the factor states."""
    share, time_s, dt_s, n = 0.6, 5.0, 0.5, 4000
    settings = replace(BELIEF, correlated_share=share, correlation_s=time_s)
    team = Team(np.random.default_rng(5))
    at = 1.0 + dt_s * np.arange(100)
    names, ones = np.full(100, "R1"), np.ones(100)
    session = replace(
        team.session(), ranges=Ranges(at, names, np.full(100, "L1"), 3.0 * ones, 0.1 * ones, np.zeros(100, dtype=int))
    )
    events = prepare(session, settings).events
    lags = np.arange(1, n)
    exact = 1.0 + 2.0 * share * np.sum((1.0 - lags / n) * np.exp(-lags * dt_s / time_s))
    assert events.variance_m2[0] == pytest.approx(0.01)
    assert events.variance_m2[50] / 0.01 == pytest.approx(exact, rel=0.01)
    assert events.variance_m2[50] * events.spread[50] == pytest.approx(0.01)  # the gate knows one reading


def test_fusion_without_unknown_correlation_is_that_of_kalman() -> None:
    rng = np.random.default_rng(6)
    root, H = rng.standard_normal((4, 4)), rng.standard_normal((2, 4))
    P, R = root @ root.T, np.diag([0.5, 0.2])
    fused = fuse(P, P, H, R, np.zeros((2, 2)))
    assert fused is not None
    gain = P @ H.T @ np.linalg.inv(H @ P @ H.T + R)
    np.testing.assert_allclose(fused.gain, gain)
    np.testing.assert_allclose(fused.P, P - gain @ H @ P)
    np.testing.assert_allclose(fused.independent, fused.P)


def test_fusion_is_never_too_sure_whatever_the_correlation() -> None:
    """The true covariance after the update, for a correlation of -1, 0 and 1, is at most the one that is claimed."""
    P, H, sensor, dependent = np.diag([1.0, 4.0]), np.eye(2), 0.01 * np.eye(2), np.diag([2.0, 0.5])
    fused = fuse(P, np.zeros((2, 2)), H, sensor, dependent)
    assert fused is not None
    kept = np.eye(2) - fused.gain @ H
    for correlation in (-1.0, 0.0, 1.0):
        cross = correlation * np.sqrt(P) @ np.sqrt(dependent)
        true = kept @ P @ kept.T + fused.gain @ (sensor + dependent) @ fused.gain.T
        true += -(kept @ cross @ fused.gain.T) - fused.gain @ cross.T @ kept.T
        assert np.linalg.eigvalsh(fused.P - true).min() > -1e-12


def test_epochs_inside_a_gap_of_the_truth_are_not_judged() -> None:
    time_s = np.arange(0.0, 10.0, 0.5)
    track = VehicleTrack("R1", time_s, np.zeros((20, 3)), np.zeros((20, 2)), np.tile(np.eye(2), (20, 1, 1)))
    true_s = np.concatenate([np.arange(0.0, 3.1, 0.1), np.arange(7.0, 12.0, 0.1)])
    vehicle = Odometry("R1", time_s, np.zeros(20), np.zeros(20), (0.0, 0.0), 0.0)
    judged = judge(track, vehicle, true_s, np.zeros((len(true_s), 3)))
    known = np.isfinite(judged.nees)
    assert not known[(time_s > 3.0) & (time_s < 7.0)].any() and known[(time_s <= 3.0) | (time_s >= 7.0)].all()


def test_a_gap_of_the_odometry_widens_the_sigma() -> None:
    """Ten seconds without a reading: the motion itself may be wrong, all the gap long, and the filters know it."""
    time_s = np.arange(0.0, 60.0, STEP_S)
    speed, turn = np.full(len(time_s), 0.15), np.full(len(time_s), 0.2 * DEG)
    whole = Odometry("R1", time_s, speed, turn, (0.0, 0.0), 0.0)
    gapped = replace(whole, gap_s=np.where((time_s >= 20.0) & (time_s < 30.0), 10.0, 0.0))
    noise = [WheeledVehicle(one, BELIEF).step(np.zeros(10), 20.0, 30.0)[2] for one in (gapped, whole)]
    added = np.diag(noise[0] - noise[1])
    assert np.sqrt(added[2]) == pytest.approx(0.2 * 10.0, rel=0.05), "radians: the whole turn of the gap"
    assert np.sqrt(0.5 * (added[0] + added[1])) >= 0.15 * 10.0
