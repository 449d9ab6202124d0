"""The true motion: derivatives belong to each other, legs do what they say, the wheels leave the ground in time."""

from itertools import pairwise

import numpy as np
import pytest

from groundstation.base.angles import FloatArray, unwrap, wrap_180
from groundstation.base.errors import SettingsError
from groundstation.base.geodesy import curvature_radii_m
from groundstation.base.units import MPS2_PER_G
from groundstation.simulation.profile import plan
from groundstation.simulation.readings import generator
from groundstation.simulation.trajectory import Trajectory, fly, track_deg
from tests.simulated_flights import FLIGHT_LEGS, QUIET_GROUND, TAXI_LEGS, scenario

WIND = {"north_mps": -4.0, "east_mps": 7.0}
# Central differences err by step / 4 of a jump in acceleration: small at 100 Hz, and it must vanish with the step.
ROUGH_MPS, ROUGH_DPS = 2e-3, 5e-2
RATES_HZ = (100.0, 400.0)
SHRINKS = 3.0
ROUNDING_DEG = 1e-9


def flown(**changes: object) -> Trajectory:
    """A whole flight in wind, with everything that moves the nose."""
    changes = {"legs": FLIGHT_LEGS, "wind": WIND, "ground": {"crosswind_slip_deg_per_mps": 0.1}} | changes
    return fly(scenario(**changes), generator(5, "motion"))


def velocity_from_positions(motion: Trajectory) -> tuple[FloatArray, FloatArray, FloatArray]:
    """North, east, down by central differences, shape (n - 2,)."""
    two_steps_s = 2e-9 * motion.step_ns
    meridian, prime_vertical = curvature_radii_m(motion.latitude_deg[1:-1])
    altitude = motion.altitude_m[1:-1]
    moved = [values[2:] - values[:-2] for values in (motion.latitude_deg, motion.longitude_deg, motion.altitude_m)]
    parallel = (prime_vertical + altitude) * np.cos(np.deg2rad(motion.latitude_deg[1:-1]))
    north = np.deg2rad(moved[0]) * (meridian + altitude) / two_steps_s
    return north, np.deg2rad(wrap_180(moved[1])) * parallel / two_steps_s, -moved[2] / two_steps_s


@pytest.mark.parametrize("arm", [(0.0, 0.0, 0.0), (4.0, 0.5, -2.0)], ids=["reference point", "antenna"])
@pytest.mark.parametrize("longitude_deg", [37.41, 179.9999])
def test_velocity_is_the_derivative_of_position(arm: tuple[float, float, float], longitude_deg: float) -> None:
    airport = {"latitude_deg": 55.97, "longitude_deg": longitude_deg, "altitude_ellipsoid_m": 200.0}
    errors = []
    for rate_hz in RATES_HZ:
        motion = flown(airport=airport, internal_rate_hz=rate_hz).moved_to(arm)
        velocities = (motion.velocity_north_mps, motion.velocity_east_mps, motion.velocity_down_mps)
        found = velocity_from_positions(motion)
        errors.append(max(np.max(np.abs(a - b[1:-1])) for a, b in zip(found, velocities, strict=True)))
    assert errors[0] < ROUGH_MPS and errors[1] < errors[0] / SHRINKS


def test_body_rates_are_the_derivative_of_the_attitude() -> None:
    errors = []
    for rate_hz in RATES_HZ:
        motion = flown(internal_rate_hz=rate_hz)
        two_steps_s = 2e-9 * motion.step_ns
        roll_rate, pitch_rate, heading_rate = (
            (values[2:] - values[:-2]) / two_steps_s
            for values in (motion.roll_deg, motion.pitch_deg, unwrap(motion.heading_deg))
        )
        roll_rad, pitch_rad = np.deg2rad(motion.roll_deg[1:-1]), np.deg2rad(motion.pitch_deg[1:-1])
        expected = (
            roll_rate - heading_rate * np.sin(pitch_rad),
            pitch_rate * np.cos(roll_rad) + heading_rate * np.sin(roll_rad) * np.cos(pitch_rad),
            -pitch_rate * np.sin(roll_rad) + heading_rate * np.cos(roll_rad) * np.cos(pitch_rad),
        )
        rates = (motion.rate_x_dps, motion.rate_y_dps, motion.rate_z_dps)
        errors.append(max(np.max(np.abs(a - b[1:-1])) for a, b in zip(expected, rates, strict=True)))
    assert errors[0] < ROUGH_DPS and errors[1] < errors[0] / SHRINKS


def test_heading_and_velocity_never_jump() -> None:
    motion = flown()
    step_s = 1e-9 * motion.step_ns
    assert np.max(np.abs(wrap_180(np.diff(motion.heading_deg)))) < 15.0 * step_s  # deg/s
    for values in (motion.velocity_north_mps, motion.velocity_east_mps, motion.velocity_down_mps):
        assert np.max(np.abs(np.diff(values))) < 6.0 * step_s  # m/s2


def test_on_the_ground_the_velocity_is_along_the_track_and_sway_is_about_it() -> None:
    motion = fly(scenario(), generator(1, "motion"))
    speed = np.hypot(motion.velocity_north_mps, motion.velocity_east_mps)
    sway = wrap_180(motion.heading_deg - track_deg(motion))[speed > 4.0]
    assert abs(float(np.std(sway)) - 0.5) < 0.15  # about 20 s of 0.4 Hz sway, damping 0.1
    still = fly(scenario(ground=QUIET_GROUND | {"sideslip_deg": 0.7}, parking_heading_deg=40.0), generator(1, "motion"))
    speed = np.hypot(still.velocity_north_mps, still.velocity_east_mps)
    assert np.allclose(wrap_180(still.heading_deg - track_deg(still))[speed > 0.1], 0.7, atol=ROUNDING_DEG)
    assert still.heading_deg[0] == pytest.approx(40.0, abs=ROUNDING_DEG)


def test_crosswind_slip_changes_sign_on_the_way_back() -> None:
    """Wind blowing east, track north: the nose is turned left into it, on the way south to the right."""
    legs = [
        {"kind": "taxi", "length_m": 150, "speed_mps": 8},
        {"kind": "ground_turn", "angle_deg": 180},
        {"kind": "taxi", "length_m": 150, "speed_mps": 8},
    ]
    ground = QUIET_GROUND | {"crosswind_slip_deg_per_mps": 0.05}
    motion = fly(scenario(legs=legs, ground=ground, wind={"east_mps": 8.0}), generator(1, "motion"))
    fast = np.hypot(motion.velocity_north_mps, motion.velocity_east_mps) > 7.0
    slip, north = wrap_180(motion.heading_deg - track_deg(motion))[fast], motion.velocity_north_mps[fast] > 0.0
    assert np.allclose(slip[north], -0.4, atol=1e-6) and np.allclose(slip[~north], 0.4, atol=1e-6)


def test_legs_do_what_they_say() -> None:
    profile = plan(scenario())
    turned = profile.direction_deg[-1] - profile.direction_deg[0]
    assert turned == pytest.approx(100.0, abs=1e-9)
    assert profile.speed_mps.max() == pytest.approx(11.0) and profile.speed_mps[-1] == 0.0
    assert not profile.airborne.any()
    standing_s = profile.step_s * int(np.count_nonzero(profile.speed_mps == 0.0))
    assert standing_s == pytest.approx(25.0, abs=0.05)


def test_weight_leaves_the_wheels_at_the_lift_off_speed_and_the_runway_holds_the_aircraft() -> None:
    motion = flown(wind={"north_mps": 0.0, "east_mps": 0.0})
    changes = np.flatnonzero(np.diff(motion.airborne.astype(int))) + 1
    assert [bool(motion.airborne[k]) for k in changes] == [True, False]
    lift_off, touchdown = changes
    speed = np.hypot(motion.velocity_north_mps, motion.velocity_east_mps)
    assert speed[lift_off] == pytest.approx(55.0, abs=1e-6)
    assert np.all(motion.altitude_m[: lift_off + 1] == 200.0)
    assert np.all(np.diff(motion.altitude_m[lift_off + 1 : lift_off + 2_000]) > 0.0)
    assert motion.altitude_m[touchdown:] == pytest.approx(180.0, abs=1e-6)
    assert motion.pitch_deg[-1] == pytest.approx(0.0, abs=1e-12)


def test_climb_ends_at_its_altitude_and_turns_are_coordinated() -> None:
    motion = flown()
    banked = np.abs(motion.roll_deg) > 19.9
    assert motion.altitude_m[banked] == pytest.approx(700.0, abs=1e-6)
    assert np.max(np.abs(motion.roll_deg)) == pytest.approx(20.0, abs=0.05)
    heading_rate = np.gradient(unwrap(motion.heading_deg), 1e-9 * motion.step_ns)
    expected = np.rad2deg(MPS2_PER_G * np.tan(np.deg2rad(motion.roll_deg)) / motion.airspeed_mps)
    assert np.allclose(heading_rate[banked], expected[banked], atol=0.01)


def test_in_the_air_the_nose_points_along_the_air_velocity() -> None:
    motion = flown()
    settled = np.convolve(motion.airborne, np.ones(2_001), mode="same") > 2_000.5  # 10 s from both transitions
    north, east = motion.velocity_north_mps - WIND["north_mps"], motion.velocity_east_mps - WIND["east_mps"]
    along = np.rad2deg(np.arctan2(east, north))
    assert np.allclose(wrap_180(motion.heading_deg - along)[settled], 0.0, atol=1e-6)
    assert np.max(np.abs(wrap_180(motion.heading_deg - track_deg(motion))[settled])) > 3.0  # the drift angle


@pytest.mark.parametrize(
    ("legs", "place"),
    [
        ([*TAXI_LEGS, {"kind": "air_turn", "angle_deg": 90}], "legs[5]"),
        ([{"kind": "take_off"}, {"kind": "parked", "duration_s": 3}], "legs[1]"),
        ([{"kind": "taxi", "length_m": 20, "speed_mps": 15}], "legs[0].length_m"),
    ],
)
def test_legs_that_cannot_follow_are_named(legs: list[dict[str, object]], place: str) -> None:
    with pytest.raises(SettingsError, match=r"test, key ") as caught:
        plan(scenario(legs=legs))
    assert place in str(caught.value)


def test_turning_the_world_turns_the_flight() -> None:
    """Nothing may prefer a direction: the same flight turned by 137 degrees, north crossed, has turned velocities."""
    calm = {"north_mps": 0.0, "east_mps": 0.0}
    first, second = (flown(parking_heading_deg=heading, wind=calm) for heading in (10.0, 147.0))
    assert np.allclose(wrap_180(second.heading_deg - first.heading_deg), 137.0, atol=1e-9)
    turn = np.deg2rad(137.0)
    north = first.velocity_north_mps * np.cos(turn) - first.velocity_east_mps * np.sin(turn)
    assert np.allclose(second.velocity_north_mps, north, atol=1e-9)


def test_grid_is_even() -> None:
    motion = flown()
    assert {int(later - earlier) for earlier, later in pairwise(motion.time_ns[:1000])} == {motion.step_ns}
