"""Estimates of a log that is turned, moved in time and place, or thinned; and of one with next to no fixes."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from groundstation.base.angles import wrap_180
from groundstation.base.errors import NotAssessableError
from groundstation.base.geodesy import curvature_radii_m
from groundstation.simulation.imu.flight import ImuFlight, simulate_imu
from groundstation.simulation.imu.motion import earth_and_transport_radps, true_states
from groundstation.simulation.imu.settings import ImuSettings, ReceiverSettings
from groundstation.systems.trajectory.estimate import Estimate, estimate
from groundstation.systems.trajectory.inputs import FloatArray, GnssFixes, ImuIncrements
from groundstation.systems.trajectory.passes import OWN_ESTIMATE, line_of, run_pass
from groundstation.systems.trajectory.solution import TrackOfStates
from groundstation.systems.trajectory.study.family import known_model, known_sigmas
from groundstation.systems.trajectory.study.judged import log_of, squared_errors
from groundstation.systems.trajectory.track import smoothed_track

SETTINGS = ImuSettings(duration_s=180.0, rate_hz=50.0, gnss=ReceiverSettings(latency_s=0.1))
TURN_DEG = 137.0
SAME = 1e-2  # of a sigma: a time of 1e5 s has 1.5e-11 s, which the search for the latency amplifies; measured 1.1e-3
TURNED = 0.1  # of a sigma: the noise is drawn in axes that turn, and the starts of the headings differ; measured 0.05
LINE_FROM_S = 90.0  # the filter has left its wide prior, about which the own estimate is linearised
Log = tuple[ImuIncrements, GnssFixes]


@cache
def flight(latitude_deg: float = 56.0, longitude_deg: float = 38.0) -> ImuFlight:
    """Flight at a place."""
    return simulate_imu("uav", 11, settings=replace(SETTINGS, latitude_deg=latitude_deg, longitude_deg=longitude_deg))


def solved(log: Log) -> Estimate:
    """Estimate with the noise known."""
    return estimate(*log, may_stop=False, prior=known_model(SETTINGS), sigmas=known_sigmas(SETTINGS), fit=False)


def track_of(found: Estimate) -> TrackOfStates:
    """Smoothed states."""
    return smoothed_track(found.problem.samples, found.result)


@cache
def plain() -> Estimate:
    """Estimate of the flight as it is."""
    return solved(log_of(flight()))


def fixes(log: Log, **changes: FloatArray) -> Log:
    """A log with changed fixes."""
    return log[0], replace(log[1], **changes)


def taken(log: Log, kept: FloatArray) -> Log:
    """A log with some of its fixes."""
    gnss = log[1]
    columns = {name: getattr(gnss, name)[kept] for name in gnss.__dataclass_fields__}
    return log[0], GnssFixes(**columns)


def differences(one: TrackOfStates, other: TrackOfStates) -> FloatArray:
    """Differences over the sigmas of the first: position, velocity, attitude, shape (k, 9)."""
    north, east = curvature_radii_m(one.latitude_deg)
    parallel = east * np.cos(np.radians(one.latitude_deg))
    place = np.stack(
        [
            np.radians(other.latitude_deg - one.latitude_deg) * north,
            np.radians(wrap_180(other.longitude_deg - one.longitude_deg)) * parallel,
            one.height_m - other.height_m,
        ],
        axis=1,
    )
    names = ("roll_deg", "pitch_deg", "heading_deg")
    turn = np.stack([wrap_180(getattr(other, name) - getattr(one, name)) for name in names], axis=1)
    return np.concatenate(
        [
            place / one.position_sigma_m,
            (other.velocity_mps - one.velocity_mps) / one.velocity_sigma_mps,
            turn / one.attitude_sigma_deg,
        ],
        axis=1,
    )


def turned_log() -> Log:
    """The log of the same flight with the world turned about the vertical of its first fix.

    The unit also feels the Earth turn: its increments get the difference.
    """
    source = flight()
    imu, gnss = log_of(source)
    c, s = np.cos(np.radians(TURN_DEG)), np.sin(np.radians(TURN_DEG))
    R = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    n_from_b = true_states(source.motion, source.true_time_s).n_from_b
    latitude = np.radians(source.latitude_deg)
    turning = R @ n_from_b
    velocity = source.velocity_mps @ R.T

    def felt(C: FloatArray, v: FloatArray) -> tuple[FloatArray, FloatArray]:
        earth, transport = earth_and_transport_radps(latitude, source.height_m, v)
        force = np.cross(2.0 * earth + transport, v)
        return np.einsum("nij,ni->nj", C, earth + transport), np.einsum("nij,ni->nj", C, force)

    before, after = felt(n_from_b, source.velocity_mps), felt(turning, velocity)
    step = imu.interval_s[:, None]
    angle, push = (
        old + (new - was) * step
        for old, was, new in zip((imu.delta_angle_rad, imu.delta_velocity_mps), before, after, strict=True)
    )
    latitude_0, longitude_0 = gnss.latitude_deg[0], gnss.longitude_deg[0]
    meridian, normal = (one + 200.0 for one in curvature_radii_m(latitude_0))
    parallel = normal * np.cos(np.radians(latitude_0))
    place = np.stack(
        [
            np.radians(gnss.latitude_deg - latitude_0) * meridian,
            np.radians(gnss.longitude_deg - longitude_0) * parallel,
        ]
    )
    north, east = R[:2, :2] @ place
    log = replace(imu, delta_angle_rad=angle, delta_velocity_mps=push), gnss
    return fixes(
        log,
        latitude_deg=latitude_0 + np.degrees(north / meridian),
        longitude_deg=longitude_0 + np.degrees(east / parallel),
        velocity_mps=gnss.velocity_mps @ R.T,
    )


@pytest.mark.slow
def test_a_turned_world_turns_the_answer() -> None:
    one, other = track_of(plain()), track_of(solved(turned_log()))
    c, s = np.cos(np.radians(TURN_DEG)), np.sin(np.radians(TURN_DEG))
    velocity = other.velocity_mps @ np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    off = np.stack(
        [
            wrap_180(other.heading_deg - one.heading_deg - TURN_DEG) / one.attitude_sigma_deg[:, 2],
            wrap_180(other.roll_deg - one.roll_deg) / one.attitude_sigma_deg[:, 0],
            wrap_180(other.pitch_deg - one.pitch_deg) / one.attitude_sigma_deg[:, 1],
            *((velocity - one.velocity_mps) / one.velocity_sigma_mps).T,
        ]
    )
    assert np.abs(off).max() < TURNED
    ratio = other.attitude_sigma_deg[:, 2] / one.attitude_sigma_deg[:, 2]
    assert ratio.min() > 0.95 and ratio.max() < 1.05


def test_a_shift_in_time_changes_nothing() -> None:
    imu, gnss = log_of(flight())
    late = solved((replace(imu, time_s=imu.time_s + 1e5), replace(gnss, time_s=gnss.time_s + 1e5)))
    one, other = track_of(plain()), track_of(late)
    np.testing.assert_allclose(other.time_s - 1e5, one.time_s, atol=1e-9)
    assert np.abs(differences(one, other)).max() < SAME


# The last lies on both lines; the others tell which of them it is.
PLACES = [*(pytest.param(*one, marks=pytest.mark.slow) for one in [(56.0, 179.9995), (0.0, 38.0)]), (0.0002, -179.9995)]


@pytest.mark.parametrize(("latitude_deg", "longitude_deg"), PLACES)
def test_date_line_and_equator_are_places_like_others(latitude_deg: float, longitude_deg: float) -> None:
    source = flight(latitude_deg, longitude_deg)
    fixed = np.array(source.gnss.longitude_deg)
    assert abs(longitude_deg) < 179.0 or (np.abs(np.diff(fixed)) > 300.0).any()  # it does cross the line
    found = solved(log_of(source))
    track = track_of(found)
    assert (np.abs(track.longitude_deg) <= 180.0).all()
    squared, _heading = squared_errors(source, track)
    assert squared.mean() < 3.0
    if latitude_deg == flight().settings.latitude_deg:
        there = replace(track, longitude_deg=wrap_180(track.longitude_deg - (longitude_deg - 38.0)))
        assert np.abs(differences(track_of(plain()), there)).max() < SAME


def test_a_third_of_the_fixes_left_out_changes_little() -> None:
    log = log_of(flight())
    kept = np.random.default_rng(2).random(len(log[1])) > 1.0 / 3.0
    kept[0] = True
    off = differences(track_of(solved(taken(log, kept))), track_of(plain()))
    assert np.sqrt(np.mean(off**2, axis=0)).max() < 1.0 and np.abs(off).max() < 3.0


def test_the_line_and_the_own_estimate_agree() -> None:
    found = plain()
    problem, rules, model = found.problem, found.gate, found.model
    own = run_pass(problem.samples, problem.plan(model), problem.noise(model), rules, found.result.start, OWN_ESTIMATE)
    off = differences(smoothed_track(problem.samples, found.result), smoothed_track(problem.samples, own))
    later = own.plan.epoch_s[0] + LINE_FROM_S < track_of(found).time_s
    assert np.abs(off[later]).max() < 0.5
    assert len(line_of(own).nav) == len(own.plan.epoch_s)


@pytest.mark.parametrize("count", [0, 1, 2])
def test_next_to_no_fixes_give_no_nan(count: int) -> None:
    log = log_of(flight())
    kept = np.zeros(len(log[1]), dtype=bool)
    kept[400 : 400 + count] = True
    if count == 0:
        with pytest.raises(NotAssessableError, match="no fix"):
            solved(taken(log, kept))
        return
    track = track_of(solved(taken(log, kept)))
    assert all(np.isfinite(getattr(track, name)).all() for name in track.__dataclass_fields__)


def test_fixes_at_the_same_time_give_no_nan() -> None:
    imu, gnss = log_of(flight())
    times = np.array(gnss.time_s)
    times[201::2] = times[200:-1:2][: len(times[201::2])]
    track = track_of(solved((imu, replace(gnss, time_s=times))))
    assert all(np.isfinite(getattr(track, name)).all() for name in track.__dataclass_fields__)
