"""True motion of the aircraft on a fixed fine grid: position, velocity and attitude.

They are each other's derivatives. The reference point is the middle of the main-gear axle at ground level. On the
ground its velocity is along the true track; the nose is at track + sideslip + sway, and steering turns track and nose
together. In the air the nose points along the air velocity, the wind makes the drift angle, turns are coordinated.
Lift-off and touchdown swing the nose smoothly between the two in :data:`TRANSITION_S`. Every rate is the exact
derivative of its angle.

Rotation of the north-east-down frame below the aircraft (0.00005 m/s on a 5 m arm), bouncing and flare are not
modelled.
"""

from dataclasses import fields

import numpy as np

from groundstation.base.angles import FloatArray, direction_of, wrap_180, wrap_360
from groundstation.base.dataclasses import dataclass
from groundstation.base.geodesy import curvature_radii_m
from groundstation.base.records import BoolArray, Int64Array, frozen
from groundstation.base.units import MPS2_PER_G
from groundstation.simulation.processes import damped_oscillation
from groundstation.simulation.profile import MotionProfile, plan, smoothstep, smoothstep_slope
from groundstation.simulation.scenario import Scenario

TRANSITION_S = 5.0
ROTATION_S = 3.0
ANGLE_OF_ATTACK_DEG = 4.0
ROLLING_MPS = (0.5, 3.0)  # sway and steering grow with the speed between these
STEADY_MPS = (16.0, 20.0)  # and steering fades out again: on the take-off run the centreline is held
KNOTS_PER_CYCLE = 20.0


@dataclass(frozen=True)
class Trajectory:
    """True motion, arrays of shape (n,), one row each ``step_ns``.

    Velocities are of the reference point over the ground; ``heading_deg`` is of the nose, in [0, 360); rates are of
    the body about its own axes (forward, right, down) relative to north-east-down.
    """

    step_ns: int
    time_ns: Int64Array
    latitude_deg: FloatArray
    longitude_deg: FloatArray
    altitude_m: FloatArray
    velocity_north_mps: FloatArray
    velocity_east_mps: FloatArray
    velocity_down_mps: FloatArray
    roll_deg: FloatArray
    pitch_deg: FloatArray
    heading_deg: FloatArray
    rate_x_dps: FloatArray
    rate_y_dps: FloatArray
    rate_z_dps: FloatArray
    airspeed_mps: FloatArray
    airborne: BoolArray

    def __post_init__(self) -> None:
        for item in fields(self):
            value = getattr(self, item.name)
            if isinstance(value, np.ndarray):
                object.__setattr__(self, item.name, frozen(value))

    def __len__(self) -> int:
        return len(self.time_ns)

    def at(self, index: Int64Array) -> "Trajectory":
        """The rows that ``index`` selects."""
        values = {item.name: getattr(self, item.name) for item in fields(self)}
        return Trajectory(**{key: value[index] if key != "step_ns" else value for key, value in values.items()})

    def moved_to(self, arm_body_m: tuple[float, float, float]) -> "Trajectory":
        """Return position and velocity of another point fixed in the body.

        It lies ``arm_body_m`` (forward, right, down) from the reference. Position is moved by R r, velocity by R (w x
        r): exact derivatives of one another.
        """
        if not any(arm_body_m):
            return self
        arm = np.array(arm_body_m)
        rate_radps = np.deg2rad(np.stack([self.rate_x_dps, self.rate_y_dps, self.rate_z_dps], axis=1))
        n_from_b = rotation_n_from_b(self.roll_deg, self.pitch_deg, self.heading_deg)
        offset = n_from_b @ arm
        velocity = np.einsum("nij,nj->ni", n_from_b, np.cross(rate_radps, arm))
        meridian, prime_vertical = curvature_radii_m(self.latitude_deg)
        east_radius = (prime_vertical + self.altitude_m) * np.cos(np.deg2rad(self.latitude_deg))
        moved = {item.name: getattr(self, item.name) for item in fields(self)} | {
            "latitude_deg": self.latitude_deg + np.rad2deg(offset[:, 0] / (meridian + self.altitude_m)),
            "longitude_deg": wrap_180(self.longitude_deg + np.rad2deg(offset[:, 1] / east_radius)),
            "altitude_m": self.altitude_m - offset[:, 2],
            "velocity_north_mps": self.velocity_north_mps + velocity[:, 0],
            "velocity_east_mps": self.velocity_east_mps + velocity[:, 1],
            "velocity_down_mps": self.velocity_down_mps + velocity[:, 2],
        }
        return Trajectory(**moved)


def rotation_n_from_b(roll_deg: FloatArray, pitch_deg: FloatArray, heading_deg: FloatArray) -> FloatArray:
    """Return rotation matrices from body to north-east-down, shape (n, 3, 3).

    Body axes are forward-right-down; v_n = n_from_b @ v_b.

    Source: Titterton and Weston, Strapdown Inertial Navigation Technology, 2nd ed. 2004, equation 3.47.

    Examples
    --------
    >>> forward = rotation_n_from_b(np.zeros(1), np.zeros(1), np.array([90.0]))[0] @ [1.0, 0.0, 0.0]
    >>> forward.round(12).tolist()
    [0.0, 1.0, 0.0]
    """
    roll_rad, pitch_rad, heading_rad = np.deg2rad(roll_deg), np.deg2rad(pitch_deg), np.deg2rad(heading_deg)
    sin_r, cos_r = np.sin(roll_rad), np.cos(roll_rad)
    sin_p, cos_p = np.sin(pitch_rad), np.cos(pitch_rad)
    sin_h, cos_h = np.sin(heading_rad), np.cos(heading_rad)
    rows = [
        [cos_p * cos_h, sin_r * sin_p * cos_h - cos_r * sin_h, cos_r * sin_p * cos_h + sin_r * sin_h],
        [cos_p * sin_h, sin_r * sin_p * sin_h + cos_r * cos_h, cos_r * sin_p * sin_h - sin_r * cos_h],
        [-sin_p, sin_r * cos_p, cos_r * cos_p],
    ]
    return np.moveaxis(np.array(rows), -1, 0)


def fly(scenario: Scenario, rng: np.random.Generator) -> Trajectory:
    """True motion of a scenario; ``rng`` draws sway and steering."""
    profile = plan(scenario)
    on_ground = ~profile.airborne
    steering, steering_rate = _steering(scenario, profile, rng)
    direction = profile.direction_deg + steering
    direction_rad = np.deg2rad(direction)
    north = profile.speed_mps * np.cos(direction_rad) + np.where(on_ground, 0.0, scenario.wind.north_mps)
    east = profile.speed_mps * np.sin(direction_rad) + np.where(on_ground, 0.0, scenario.wind.east_mps)
    latitude, longitude = _integrate(north, east, profile, scenario)
    direction_rate = profile.turn_rate_dps + steering_rate
    crosswind_slip = _crosswind_slip(scenario, profile, direction, direction_rate)
    nose, nose_rate = _nose_about_direction(scenario, profile, crosswind_slip, rng)
    roll, roll_rate, pitch, pitch_rate = _roll_and_pitch(profile)
    rate_x, rate_y, rate_z = _body_rates(roll, pitch, roll_rate, pitch_rate, direction_rate + nose_rate)
    return Trajectory(
        step_ns=profile.step_ns,
        time_ns=np.arange(len(profile), dtype=np.int64) * profile.step_ns,
        latitude_deg=latitude,
        longitude_deg=longitude,
        altitude_m=profile.altitude_m,
        velocity_north_mps=north,
        velocity_east_mps=east,
        velocity_down_mps=-profile.climb_rate_mps,
        roll_deg=roll,
        pitch_deg=pitch,
        heading_deg=wrap_360(direction + nose),
        rate_x_dps=rate_x,
        rate_y_dps=rate_y,
        rate_z_dps=rate_z,
        airspeed_mps=np.sqrt(
            (north - scenario.wind.north_mps) ** 2 + (east - scenario.wind.east_mps) ** 2 + profile.climb_rate_mps**2
        ),
        airborne=profile.airborne,
    )


def track_deg(trajectory: Trajectory) -> FloatArray:
    """Return the direction of the ground velocity, [0, 360), shape (n,).

    It is meaningless where the aircraft stands.
    """
    return direction_of(trajectory.velocity_north_mps, trajectory.velocity_east_mps)


def _integrate(
    north_mps: FloatArray, east_mps: FloatArray, profile: MotionProfile, scenario: Scenario
) -> tuple[FloatArray, FloatArray]:
    """Integrate positions on the ellipsoid by the trapezoidal rule.

    Its error (step^2 / 12 of the change of acceleration) is some 0.03 mm in all. The latitude comes by fixed-point
    iteration, since the radius hardly depends on it.
    """
    from scipy.integrate import cumulative_trapezoid

    latitude = np.full(len(profile), scenario.airport.latitude_deg)
    for _ in range(4):
        meridian, _unused = curvature_radii_m(latitude)
        rate = north_mps / (meridian + profile.altitude_m)
        moved = np.rad2deg(cumulative_trapezoid(rate, dx=profile.step_s, initial=0))
        latitude = scenario.airport.latitude_deg + moved
    _unused, prime_vertical = curvature_radii_m(latitude)
    rate = east_mps / ((prime_vertical + profile.altitude_m) * np.cos(np.deg2rad(latitude)))
    moved = np.rad2deg(cumulative_trapezoid(rate, dx=profile.step_s, initial=0))
    return latitude, wrap_180(scenario.airport.longitude_deg + moved)


def _wander(
    rng: np.random.Generator, profile: MotionProfile, sigma: float, frequency_hz: float, damping: float
) -> tuple[FloatArray, FloatArray]:
    """Draw a damped oscillation and its exact derivative.

    It is drawn at knots, and twice continuously differentiable between them.
    """
    from scipy.interpolate import CubicSpline

    if sigma == 0.0:
        return np.zeros(len(profile)), np.zeros(len(profile))
    knot_step_s = 1.0 / (KNOTS_PER_CYCLE * frequency_hz)
    knots = int(np.ceil((len(profile) - 1) * profile.step_s / knot_step_s)) + 4
    values = damped_oscillation(rng, (knots,), knot_step_s, sigma, frequency_hz, damping)
    spline = CubicSpline(np.arange(knots) * knot_step_s, values)
    return spline(profile.time_s), spline(profile.time_s, 1)


def _between(low_high: tuple[float, float], profile: MotionProfile) -> tuple[FloatArray, FloatArray]:
    """Return a weight that grows smoothly from 0 to 1 with the speed, and its time derivative."""
    low, high = low_high
    share = (profile.speed_mps - low) / (high - low)
    return smoothstep(share), smoothstep_slope(share) * profile.acceleration_mps2 / (high - low)


def _steering(scenario: Scenario, profile: MotionProfile, rng: np.random.Generator) -> tuple[FloatArray, FloatArray]:
    ground = scenario.ground
    wander, wander_rate = _wander(
        rng, profile, ground.steering_sigma_deg, ground.steering_frequency_hz, ground.steering_damping
    )
    weight, weight_rate = _taxiing(profile)
    on_ground = ~profile.airborne
    return on_ground * weight * wander, on_ground * (weight_rate * wander + weight * wander_rate)


def _taxiing(profile: MotionProfile) -> tuple[FloatArray, FloatArray]:
    """Return a weight that is 1 at taxi speeds, and its derivative in time.

    It is 0 at rest and on the take-off run.
    """
    rolling, rolling_rate = _between(ROLLING_MPS, profile)
    steady, steady_rate = _between(STEADY_MPS, profile)
    return rolling * (1.0 - steady), rolling_rate * (1.0 - steady) - rolling * steady_rate


def _crosswind_slip(
    scenario: Scenario, profile: MotionProfile, direction_deg: FloatArray, direction_rate_dps: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return the angle of the nose into the wind while taxiing, and its rate."""
    wind, factor = scenario.wind, scenario.ground.crosswind_slip_deg_per_mps
    direction_rad = np.deg2rad(direction_deg)
    sine, cosine = np.sin(direction_rad), np.cos(direction_rad)
    to_the_right_mps = wind.east_mps * cosine - wind.north_mps * sine
    rate = (wind.east_mps * sine + wind.north_mps * cosine) * np.deg2rad(direction_rate_dps)
    weight, weight_rate = _taxiing(profile)
    return -factor * weight * to_the_right_mps, factor * (weight * rate - weight_rate * to_the_right_mps)


def _nose_about_direction(
    scenario: Scenario,
    profile: MotionProfile,
    crosswind_slip: tuple[FloatArray, FloatArray],
    rng: np.random.Generator,
) -> tuple[FloatArray, FloatArray]:
    """Return the angle of the nose about the track or the air velocity, and its rate.

    On the ground it is the track, in the air the air velocity.
    """
    ground = scenario.ground
    sway, sway_rate = _wander(rng, profile, ground.sway_sigma_deg, ground.sway_frequency_hz, ground.sway_damping)
    rolling, rolling_rate = _between(ROLLING_MPS, profile)
    slip = ground.sideslip_deg + crosswind_slip[0] + rolling * sway
    slip_rate = crosswind_slip[1] + rolling_rate * sway + rolling * sway_rate
    on_ground = np.full(len(profile), not profile.airborne[0], dtype=np.float64)
    on_ground_rate = np.zeros(len(profile))
    swing, swing_rate = np.zeros(len(profile)), np.zeros(len(profile))
    for index in profile.transition_index:
        share = (profile.time_s - index * profile.step_s) / TRANSITION_S
        settled, settled_rate = smoothstep(share), smoothstep_slope(share) / TRANSITION_S
        sign = -1.0 if profile.airborne[index] else 1.0
        on_ground, on_ground_rate = on_ground + sign * settled, on_ground_rate + sign * settled_rate
        # The direction itself is constant across a transition but for the drift angle: take that step back, smoothly.
        drift = float(wrap_180(profile.direction_deg[index] - profile.direction_deg[index - 1]))
        swing = swing - np.where(share >= 0.0, drift * (1.0 - settled), 0.0)
        swing_rate = swing_rate + drift * settled_rate
    return on_ground * slip + swing, on_ground * slip_rate + on_ground_rate * slip + swing_rate


def _roll_and_pitch(profile: MotionProfile) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Return roll and pitch with their rates (deg, deg/s).

    Roll is that of coordinated turns, pitch that of the flight path plus the angle of attack.
    """
    speed, acceleration = profile.speed_mps, profile.acceleration_mps2
    turn_rad, turn_change_rad = np.deg2rad(profile.turn_rate_dps), np.deg2rad(profile.turn_acceleration_dps2)
    tangent = np.where(profile.airborne, speed * turn_rad / MPS2_PER_G, 0.0)
    tangent_rate = np.where(profile.airborne, (acceleration * turn_rad + speed * turn_change_rad) / MPS2_PER_G, 0.0)
    slope = np.where(profile.airborne, profile.climb_rate_mps / np.maximum(speed, 1.0), 0.0)
    slope_rate = np.where(
        profile.airborne,
        (profile.climb_acceleration_mps2 - slope * acceleration) / np.maximum(speed, 1.0),
        0.0,
    )
    lift, lift_rate = np.zeros(len(profile)), np.zeros(len(profile))
    for index in profile.transition_index:
        takes_off = bool(profile.airborne[index])
        start = index * profile.step_s - (ROTATION_S if takes_off else 0.0)
        share = (profile.time_s - start) / ROTATION_S
        sign = 1.0 if takes_off else -1.0
        lift, lift_rate = lift + sign * smoothstep(share), lift_rate + sign * smoothstep_slope(share) / ROTATION_S
    return (
        np.rad2deg(np.arctan(tangent)),
        np.rad2deg(tangent_rate / (1.0 + tangent**2)),
        np.rad2deg(np.arctan(slope)) + ANGLE_OF_ATTACK_DEG * lift,
        np.rad2deg(slope_rate / (1.0 + slope**2)) + ANGLE_OF_ATTACK_DEG * lift_rate,
    )


def _body_rates(
    roll_deg: FloatArray,
    pitch_deg: FloatArray,
    roll_rate_dps: FloatArray,
    pitch_rate_dps: FloatArray,
    heading_rate_dps: FloatArray,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the rates about the body axes.

    Source: Titterton and Weston 2004, section 3.6.3.2 (inverse of equation 3.52).
    """
    roll_rad, pitch_rad = np.deg2rad(roll_deg), np.deg2rad(pitch_deg)
    across = heading_rate_dps * np.cos(pitch_rad)
    return (
        roll_rate_dps - heading_rate_dps * np.sin(pitch_rad),
        pitch_rate_dps * np.cos(roll_rad) + across * np.sin(roll_rad),
        across * np.cos(roll_rad) - pitch_rate_dps * np.sin(roll_rad),
    )
