"""The linear INS errors: judged by a nonlinear INS, by closed forms and by what is known of the real thing."""

from dataclasses import replace

import numpy as np
import pytest

from groundstation.base.angles import FloatArray
from groundstation.base.errors import SettingsError
from groundstation.base.geodesy import EARTH_RATE_RADPS, curvature_radii_m
from groundstation.base.units import MPS2_PER_G
from groundstation.simulation.ins_errors import InsErrors, SensorErrors, TrueMotion, normal_gravity_mps2, propagate
from tests.simulation.ins_oracle import Case, navigate

DPH = np.deg2rad(1.0 / 3600.0)
LINEAR = 2e-3  # share of the largest error: second order and 1 s holds of what changes in turns
ROUNDING = 1e-9  # share of the largest error: one Runge-Kutta step errs by 1e-12 of a turn of the Schuler pendulum


def standing(duration_s: float, latitude_deg: float = 0.0, step_s: float = 1.0, flights: int = 1) -> TrueMotion:
    time_s = np.arange(0.0, duration_s + step_s / 2, step_s)
    still = np.zeros((flights, len(time_s)))
    return TrueMotion(time_s, still + latitude_deg, still, still, still, still, still, still)


def none(motion: TrueMotion, **changes: FloatArray) -> SensorErrors:
    return replace(SensorErrors.none(*motion.latitude_deg.shape), **changes)


def constant(motion: TrueMotion, *values: float) -> FloatArray:
    return np.broadcast_to(np.array(values), (*motion.latitude_deg.shape, 3)).copy()


def weaving(time: float) -> float:
    return 2.4 + 1.2 * np.sin(2.0 * np.pi * time / 400.0)


CASES = {
    "straight": Case(
        heading_rad=lambda time: 2.4,
        speed_mps=200.0,
        latitude_deg=62.0,
        altitude_m=9000.0,
        gyro_radps=DPH * np.array([0.02, -0.03, 0.05]),
        accelerometer_mps2=1e-5 * MPS2_PER_G * np.array([1.0, -2.0, 3.0]),
        gyro_scale=np.zeros((3, 3)),
        accelerometer_scale=np.zeros((3, 3)),
        position_m=np.array([100.0, -200.0]),
        velocity_mps=np.array([0.2, 0.1]),
        tilt_rad=np.array([1e-5, -2e-5]),
        azimuth_rad=5e-4,
    ),
    "weaving": Case(
        heading_rad=weaving,
        speed_mps=150.0,
        latitude_deg=-40.0,
        altitude_m=3000.0,
        gyro_radps=DPH * np.array([0.02, -0.03, 0.05]),
        accelerometer_mps2=1e-5 * MPS2_PER_G * np.array([1.0, -2.0, 3.0]),
        gyro_scale=1e-5 * np.arange(1.0, 10.0).reshape(3, 3),
        accelerometer_scale=1e-5 * np.arange(-4.0, 5.0).reshape(3, 3),
        position_m=np.zeros(2),
        velocity_mps=np.zeros(2),
        tilt_rad=np.array([1e-5, -2e-5]),
        azimuth_rad=-5e-4,
    ),
}


def linear(case: Case, time_s: FloatArray, latitude_deg: FloatArray) -> InsErrors:
    heading = np.array([case.heading_rad(float(time)) for time in time_s])
    turn = np.gradient(heading, time_s)
    motion = TrueMotion(
        time_s=time_s,
        latitude_deg=latitude_deg,
        altitude_m=np.full(len(time_s), case.altitude_m),
        velocity_north_mps=case.speed_mps * np.cos(heading),
        velocity_east_mps=case.speed_mps * np.sin(heading),
        velocity_down_mps=np.zeros(len(time_s)),
        heading_deg=np.rad2deg(heading),
        roll_deg=np.rad2deg(np.arctan(case.speed_mps * turn / MPS2_PER_G)),
    )
    sensors = none(
        motion,
        gyro_radps=constant(motion, *case.gyro_radps),
        accelerometer_mps2=constant(motion, *case.accelerometer_mps2),
        gyro_scale=case.gyro_scale[None],
        accelerometer_scale=case.accelerometer_scale[None],
        position_m=case.position_m[None],
        velocity_mps=case.velocity_mps[None],
        tilt_rad=case.tilt_rad[None],
        azimuth_rad=np.array([case.azimuth_rad]),
    )
    return propagate(motion, sensors)


@pytest.mark.parametrize("name", CASES)
def test_nonlinear_ins_has_the_same_errors(name: str) -> None:
    case = CASES[name]
    time_s = {"straight": np.arange(0.0, 6000.0, 4.0), "weaving": np.arange(0.0, 1500.0)}[name]
    truth = navigate(case, time_s)
    found = linear(case, time_s, truth["latitude_deg"])
    for quantity in ("position_m", "velocity_mps", "tilt_rad", "azimuth_rad"):
        expected, got = truth[quantity], getattr(found, quantity)[0]
        assert np.max(np.abs(got - expected)) < LINEAR * np.max(np.abs(expected)), quantity


def zero_crossings(time_s: FloatArray, values: FloatArray) -> FloatArray:
    place = np.flatnonzero(values[:-1] * values[1:] < 0.0)
    share = values[place] / (values[place] - values[place + 1])
    return np.asarray(time_s[place] + share * (time_s[place + 1] - time_s[place]))


@pytest.mark.parametrize("channel", [0, 1])
def test_schuler_period_is_84_minutes(channel: int) -> None:
    motion = standing(6 * 3600.0)
    tilt = np.zeros((1, 2))
    tilt[0, channel] = 5e-5
    velocity = propagate(motion, none(motion, tilt_rad=tilt), earth_rate=False).velocity_mps[0]
    crossings = zero_crossings(motion.time_s, velocity[:, channel])
    radius = float(curvature_radii_m(0.0)[channel])
    expected = 2.0 * np.pi * np.sqrt(radius / normal_gravity_mps2(0.0, 0.0))
    assert 2.0 * float(np.mean(np.diff(crossings))) == pytest.approx(expected, rel=1e-6)
    assert expected / 60.0 == pytest.approx(84.4, abs=0.4)  # the radius differs from the mean by up to 0.6 %
    assert velocity[1, channel] < 0.0 and np.max(np.abs(velocity[:, 1 - channel])) == 0.0


def test_constant_drift_gives_a_bounded_velocity_and_a_position_ramp() -> None:
    """v = -R e (1 - cos w t), p = -R e (t - sin w t / w); Titterton and Weston 2004, chapter 12."""
    motion, drift = standing(4 * 3600.0), 0.01 * DPH
    gravity, radii = normal_gravity_mps2(0.0, 0.0), np.array([float(radius) for radius in curvature_radii_m(0.0)])
    # north channel: drift is the east gyro's error; east channel: minus the north gyro's
    errors = propagate(motion, none(motion, gyro_radps=constant(motion, -drift, drift, 0.0)), earth_rate=False)
    rate = np.sqrt(gravity / radii)
    phase = rate * motion.time_s[:, None]
    velocity = -radii * drift * (1.0 - np.cos(phase))
    position = -radii * drift * (motion.time_s[:, None] - np.sin(phase) / rate)
    assert np.allclose(errors.velocity_mps[0], velocity, atol=ROUNDING * np.max(np.abs(velocity)))
    assert np.allclose(errors.position_m[0], position, atol=ROUNDING * np.max(np.abs(position)))
    assert np.allclose(errors.drift_radps, drift, rtol=1e-12)


def test_accelerometer_bias_swings_about_its_tilt() -> None:
    """v = b / w sin w t, p = b / w^2 (1 - cos w t); Titterton and Weston 2004, chapter 12."""
    motion, bias = standing(3 * 3600.0), 5e-4
    errors = propagate(motion, none(motion, accelerometer_mps2=constant(motion, bias, 0.0, 0.0)), earth_rate=False)
    rate = np.sqrt(normal_gravity_mps2(0.0, 0.0) / float(curvature_radii_m(0.0)[0]))
    expected = bias / rate * np.sin(rate * motion.time_s)
    assert np.allclose(errors.velocity_mps[0, :, 0], expected, atol=ROUNDING * np.max(expected))


def test_oscillation_plane_turns_as_foucaults_pendulum() -> None:
    """The plane of the Schuler oscillation turns at -Earth rate x sin(latitude) (clockwise in the north)."""
    latitude, hours = 50.0, 8.0
    motion = standing(hours * 3600.0, latitude)
    errors = propagate(motion, none(motion, velocity_mps=np.array([[1.0, 0.0]])))
    north, east = np.moveaxis(errors.velocity_mps[0], -1, 0)
    last = slice(-5100, None)  # one oscillation
    plane_rad = 0.5 * np.arctan2(2.0 * np.mean(north[last] * east[last]), np.mean(north[last] ** 2 - east[last] ** 2))
    turned = EARTH_RATE_RADPS * np.sin(np.deg2rad(latitude)) * (hours * 3600.0 - 2550.0)
    assert plane_rad == pytest.approx(turned, rel=0.02)  # the 24 h terms and the two radii move it by a percent
    opposite = propagate(standing(hours * 3600.0, -latitude), none(motion, velocity_mps=np.array([[1.0, 0.0]])))
    assert np.allclose(opposite.velocity_mps[0, :, 1], -east, atol=1e-9)


def test_constant_east_drift_has_a_24_hour_wave() -> None:
    """The mean of the latitude error over a Schuler period follows sin(Earth rate x t), not a ramp."""
    motion = standing(24 * 3600.0, 45.0, step_s=10.0)
    drift = 0.01 * DPH
    errors = propagate(motion, none(motion, gyro_radps=constant(motion, 0.0, drift, 0.0)))
    width = 506  # one Schuler period
    smooth = np.convolve(errors.position_m[0, :, 0], np.ones(width) / width, "valid")
    at = motion.time_s[: len(smooth)] + 0.5 * width * 10.0
    basis = np.stack([np.sin(EARTH_RATE_RADPS * at), np.cos(EARTH_RATE_RADPS * at), np.ones(len(at))], axis=1)
    fitted, *_ = np.linalg.lstsq(basis, smooth, rcond=None)
    amplitude = float(curvature_radii_m(45.0)[0]) * drift / EARTH_RATE_RADPS
    assert np.std(smooth - basis @ fitted) < 0.02 * amplitude
    assert fitted[0] == pytest.approx(-amplitude, rel=0.02) and abs(fitted[1]) < 0.02 * amplitude


def test_at_rest_it_is_the_exact_exponential() -> None:
    """At rest on a turning Earth the equations are constant: eleven hours against scipy's matrix exponential."""
    from scipy.linalg import expm

    latitude = np.deg2rad(35.0)
    motion = standing(40_000.0, 35.0)
    meridian, normal = (float(radius) for radius in curvature_radii_m(35.0))
    gravity = normal_gravity_mps2(35.0, 0.0)
    wn, wd = EARTH_RATE_RADPS * np.cos(latitude), -EARTH_RATE_RADPS * np.sin(latitude)
    # [p_N, p_E, v_N, v_E, phi_N, phi_E, phi_D]; Titterton and Weston 2004, section 12.3, at rest
    a = np.zeros((7, 7))
    a[0, 2] = a[1, 3] = 1.0
    a[2, 5], a[3, 4] = gravity, -gravity
    a[2, 3], a[3, 2] = 2.0 * wd, -2.0 * wd
    a[4, 0], a[6, 0] = wd / meridian, -wn / meridian
    a[4, 3], a[5, 2], a[6, 3] = 1.0 / normal, -1.0 / meridian, -np.tan(latitude) / normal
    a[4, 5], a[5, 4], a[5, 6], a[6, 5] = wd, -wd, wn, -wn
    start = np.array([30.0, -50.0, 0.3, -0.2, 4e-5, -3e-5, 2e-4])
    sensors = none(
        motion,
        position_m=start[None, 0:2],
        velocity_mps=start[None, 2:4],
        tilt_rad=np.array([[-start[5], start[4]]]),
        azimuth_rad=np.array([-start[6]]),
    )
    errors = propagate(motion, sensors)
    end = expm(a * 40_000.0) @ start
    found = np.array(
        [
            *errors.position_m[0, -1],
            *errors.velocity_mps[0, -1],
            errors.tilt_rad[0, -1, 1],
            -errors.tilt_rad[0, -1, 0],
            -errors.azimuth_rad[0, -1],
        ]
    )
    assert np.allclose(found, end, rtol=1e-7, atol=1e-7 * np.abs(start))


def test_azimuth_error_shows_across_the_change_of_velocity() -> None:
    """A heading error of d turns the felt change of velocity: dv = d x (-dV_east, dV_north)."""
    time_s = np.arange(0.0, 61.0)
    heading = np.deg2rad(30.0 + 120.0 * time_s / 60.0)
    still = np.zeros(len(time_s))
    north, east, azimuth = 200.0 * np.cos(heading), 200.0 * np.sin(heading), np.deg2rad(0.1)
    motion = TrueMotion(time_s, still, still + 5000.0, north, east, still, np.rad2deg(heading), still)
    errors = propagate(motion, none(motion, azimuth_rad=np.array([azimuth])), earth_rate=False)
    expected = azimuth * np.array([-(east[-1] - east[0]), north[-1] - north[0]])
    assert np.allclose(
        errors.velocity_mps[0, -1], expected, atol=0.01 * np.max(np.abs(expected))
    )  # a minute of Schuler


def test_world_turned_by_137_degrees_gives_errors_turned_by_137_degrees() -> None:
    """Over a short stretch at the equator of an Earth that does not turn, no direction is special."""
    turned, time_s = np.deg2rad(137.0), np.arange(0.0, 601.0)
    heading = np.deg2rad(20.0) + 0.8 * np.sin(time_s / 90.0)
    rotation = np.array([[np.cos(turned), -np.sin(turned)], [np.sin(turned), np.cos(turned)]])
    bank = 10.0 * np.cos(time_s / 90.0)

    def fly(angle: float, start: FloatArray) -> InsErrors:
        north, east = 80.0 * np.cos(heading + angle), 80.0 * np.sin(heading + angle)
        still = np.zeros(len(time_s))
        motion = TrueMotion(time_s, still, still, north, east, still, np.rad2deg(heading + angle), bank)
        sensors = none(
            motion,
            gyro_radps=constant(motion, 0.3 * DPH, -0.2 * DPH, 1.0 * DPH),
            accelerometer_mps2=constant(motion, 3e-4, -2e-4, 1e-4),
            gyro_scale=1e-5 * np.arange(9.0).reshape(1, 3, 3),
            accelerometer_scale=1e-5 * np.arange(9.0).reshape(1, 3, 3),
            velocity_mps=start[None],
            tilt_rad=1e-4 * start[None],
            azimuth_rad=np.array([1e-4]),
        )
        return propagate(motion, sensors, earth_rate=False)

    start = np.array([0.5, 0.2])
    plain, other = fly(0.0, start), fly(turned, rotation @ start)
    for name in ("position_m", "velocity_mps", "tilt_rad"):
        expected = getattr(plain, name)[0] @ rotation.T
        # the two radii of curvature differ by 0.7 %, the coupling through them by that of a small term
        assert np.allclose(getattr(other, name)[0], expected, atol=2e-3 * np.max(np.abs(expected))), name


def test_platform_feels_no_turn() -> None:
    time_s = np.arange(0.0, 301.0)
    heading = 0.02 * time_s
    still = np.zeros(len(time_s))
    motion = TrueMotion(time_s, still, still, 50 * np.cos(heading), 50 * np.sin(heading), still, heading * 57.3, still)
    sensors = none(motion, gyro_scale=1e-3 * np.ones((1, 3, 3)), gyro_radps=constant(motion, 0.0, DPH, 0.0))
    platform = propagate(motion, sensors, earth_rate=False, body_fixed=False)
    body = propagate(motion, sensors, earth_rate=False, body_fixed=True)
    assert np.allclose(platform.drift_radps[0, :, 0], DPH, rtol=1e-3)  # transport rate x tilt
    assert abs(platform.azimuth_rad[0, -1]) < 1e-6 < abs(body.azimuth_rad[0, -1])
    assert body.azimuth_rad[0, -1] == pytest.approx(1e-3 * heading[-1], rel=0.01)  # INS heading runs ahead by the share


def banked() -> TrueMotion:
    time_s = np.arange(0.0, 301.0)
    heading, still = 0.02 * time_s, np.zeros(len(time_s))
    north, east = 100.0 * np.cos(heading), 100.0 * np.sin(heading)
    return TrueMotion(time_s, still + 50.0, still, north, east, still, np.rad2deg(heading), still + 12.0)


def test_white_noise_acts_as_any_gyro_error_and_is_no_drift() -> None:
    motion = banked()
    noise = 1e-6 * np.random.default_rng(5).standard_normal((1, 301, 3))
    as_noise, as_error = (
        propagate(motion, none(motion, gyro_white_radps=noise)),
        propagate(motion, none(motion, gyro_radps=noise)),
    )
    assert np.allclose(as_noise.velocity_mps, as_error.velocity_mps, rtol=1e-12)
    assert np.allclose(as_noise.azimuth_rad, as_error.azimuth_rad, rtol=1e-12)
    assert np.max(np.abs(as_noise.drift_radps)) < 0.05 * np.max(np.abs(as_error.drift_radps))  # couplings alone


def test_deflection_acts_north_and_east_whatever_the_heading() -> None:
    motion = banked()
    deflection = 1e-4 * np.random.default_rng(6).standard_normal((1, 301, 2))
    platform = np.concatenate([deflection, np.zeros((1, 301, 1))], axis=2)
    found = propagate(motion, none(motion, deflection_mps2=deflection))
    expected = propagate(motion, none(motion, accelerometer_mps2=platform), body_fixed=False)
    assert np.max(np.abs(expected.velocity_mps)) > 1e-4
    assert np.allclose(found.velocity_mps, expected.velocity_mps, rtol=1e-9, atol=1e-15)


def test_a_single_time_is_no_motion() -> None:
    still = np.zeros(1)
    motion = TrueMotion(still, still, still, still, still, still, still, still)
    with pytest.raises(SettingsError, match="two or more"):
        propagate(motion, none(motion))


def test_batch_is_its_flights_and_long_steps_are_divided() -> None:
    rng = np.random.default_rng(7)
    motion = standing(600.0, 60.0, flights=3)
    sensors = none(motion, gyro_radps=1e-7 * rng.standard_normal((3, 601, 3)), tilt_rad=np.full((3, 2), 1e-5))
    batch = propagate(motion, sensors)
    one = standing(600.0, 60.0)
    single = none(one, gyro_radps=sensors.gyro_radps[1:2], tilt_rad=sensors.tilt_rad[1:2])
    assert np.array_equal(batch.position_m[1:2], propagate(one, single).position_m)
    coarse = standing(600.0, 60.0, step_s=60.0)
    start = {"tilt_rad": np.full((1, 2), 1e-5), "velocity_mps": np.full((1, 2), 0.1)}
    fine = propagate(one, none(one, **start))
    rough = propagate(coarse, none(coarse, **start))
    assert np.allclose(rough.velocity_mps[0], fine.velocity_mps[0, ::60], atol=1e-12)
