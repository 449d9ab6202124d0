"""Routes for Monte Carlo: kinematic flights at the epochs of a log.

They do without the fine grid of a whole simulated flight. A route is a speed, an altitude and a turn rate in time; the
heading follows the geodesic (great circle) between turns and the position is integrated on the ellipsoid. No wind:
heading = track. Turns are coordinated: tan(bank) = speed x turn rate / g.
"""

from typing import Literal

import numpy as np

from groundstation.base.angles import FloatArray, wrap_180, wrap_360
from groundstation.base.compile import compiled
from groundstation.base.dataclasses import dataclass
from groundstation.base.geodesy import ECCENTRICITY_SQUARED, SEMI_MAJOR_M
from groundstation.base.records import frozen
from groundstation.base.units import MPS2_PER_G
from groundstation.simulation.ins_errors import TrueMotion

RouteKind = Literal["straight", "norilsk_moscow", "manoeuvring", "out_and_back", "dogleg", "racetrack", "late_survey"]
NORILSK_DEG = (69.31, 87.33)
MOSCOW_DEG = (55.60, 37.30)
ROLL_S = 40.0  # take-off run
BANK_RAMP_S = 6.0
STEERING_S = 20.0  # time constant of steering for the destination
DEPARTURE_S = 400.0
APPROACH_S = 1400.0
DETOUR_M = 10e3  # the departure leads astray by some 30 km, the approach begins some 30 km out
HIGHEST_LATITUDE_DEG = 75.0
MEAN_RADIUS_M = 6_371_009.0


@dataclass(frozen=True)
class Route:
    """One true flight at n times."""

    motion: TrueMotion
    longitude_deg: FloatArray

    def __post_init__(self) -> None:
        object.__setattr__(self, "longitude_deg", frozen(self.longitude_deg))


@dataclass(frozen=True)
class RoutePlan:
    """Plan that a route is flown from; arrays of shape (n,).

    Where ``steers`` the aircraft turns to its destination by itself, at most at ``steering_radps``.
    """

    latitude_deg: float
    longitude_deg: float
    heading_deg: float
    speed_mps: FloatArray
    altitude_m: FloatArray
    turn_radps: FloatArray
    steers: FloatArray
    destination_deg: tuple[float, float] = (0.0, 0.0)
    steering_radps: float = 0.015


def draw_route(kind: RouteKind, time_s: FloatArray, rng: np.random.Generator) -> Route:
    """Draw a route of a kind over all of ``time_s``, shape (n,), evenly spaced."""
    return fly_plan(draw_plan(kind, time_s, rng), time_s)


def draw_plan(kind: RouteKind, time_s: FloatArray, rng: np.random.Generator) -> RoutePlan:
    """Draw the plan of a route of a kind."""
    planners = {
        "straight": _straight,
        "norilsk_moscow": _norilsk_moscow,
        "manoeuvring": _manoeuvring,
        "out_and_back": _out_and_back,
        "dogleg": _dogleg,
        "racetrack": _racetrack,
        "late_survey": _late_survey,
    }
    return planners[kind](time_s, rng)


def fly_plan(plan: RoutePlan, time_s: FloatArray) -> Route:
    """Integrate a plan: heading along the geodesic plus turns, position on the ellipsoid."""
    n = len(time_s)
    latitude, longitude, heading, turn = (np.zeros(n) for _ in range(4))
    _fly(
        float(time_s[1] - time_s[0]),
        np.deg2rad(np.array([plan.latitude_deg, plan.longitude_deg, plan.heading_deg])),
        plan.speed_mps,
        plan.altitude_m,
        plan.turn_radps,
        plan.steers,
        np.deg2rad(np.array(plan.destination_deg)),
        plan.steering_radps,
        latitude,
        longitude,
        heading,
        turn,
    )
    motion = TrueMotion(
        time_s=time_s,
        latitude_deg=np.rad2deg(latitude),
        altitude_m=plan.altitude_m,
        velocity_north_mps=plan.speed_mps * np.cos(heading),
        velocity_east_mps=plan.speed_mps * np.sin(heading),
        velocity_down_mps=-np.gradient(plan.altitude_m, time_s),
        heading_deg=wrap_360(np.rad2deg(heading)),
        roll_deg=np.rad2deg(np.arctan(plan.speed_mps * turn / MPS2_PER_G)),
    )
    return Route(motion, wrap_180(np.rad2deg(longitude)))


def smooth_ramp(time_s: FloatArray, start_s: float, length_s: float) -> FloatArray:
    """Return a smooth step from 0 to 1 over a length of time."""
    share = np.clip((time_s - start_s) / length_s, 0.0, 1.0)
    return np.asarray(share * share * (3.0 - 2.0 * share))


def turn_of(time_s: FloatArray, start_s: float, angle_deg: float, rate_dps: float) -> tuple[FloatArray, float]:
    """Return the turn rate (rad/s) of one turn with bank ramps, and its end.

    The angle is exact to the step.
    """
    length = max(abs(angle_deg) / rate_dps, BANK_RAMP_S)
    shape = smooth_ramp(time_s, start_s, BANK_RAMP_S) - smooth_ramp(time_s, start_s + length, BANK_RAMP_S)
    area = float(np.sum(shape)) * float(time_s[1] - time_s[0])
    scale = np.deg2rad(angle_deg) / length if area > 0.5 * length else 0.0
    return shape * scale, start_s + length + BANK_RAMP_S


def _rate_dps(bank_deg: float, speed_mps: float) -> float:
    return float(np.rad2deg(MPS2_PER_G * np.tan(np.deg2rad(bank_deg)) / speed_mps))


def _climb_out(
    time_s: FloatArray, field_m: float, cruise_m: float, lift_off_mps: float, cruise_mps: float, climb_mps: float
) -> tuple[FloatArray, FloatArray]:
    """Return speed and altitude of a stand of 30 s, a take-off run, climb and acceleration."""
    climb_s = 1.5 * (cruise_m - field_m) / climb_mps
    speed = lift_off_mps * smooth_ramp(time_s, 30.0, ROLL_S)
    speed += (cruise_mps - lift_off_mps) * smooth_ramp(time_s, 30.0 + ROLL_S, 0.7 * climb_s)
    return speed, field_m + (cruise_m - field_m) * smooth_ramp(time_s, 30.0 + ROLL_S, climb_s)


def _straight(time_s: FloatArray, rng: np.random.Generator) -> RoutePlan:
    """Plan a ferry flight: one departure turn, then a great circle.

    It lies anywhere below 75 deg of latitude.
    """
    cruise = rng.uniform(180.0, 240.0)
    speed, altitude = _climb_out(time_s, rng.uniform(0.0, 600.0), rng.uniform(8e3, 12e3), 75.0, cruise, 10.0)
    turn_deg, turn_at = rng.uniform(-150.0, 150.0), rng.uniform(150.0, 400.0)
    length = float(np.sum(speed)) * float(time_s[1] - time_s[0]) / MEAN_RADIUS_M
    turn, _unused = turn_of(time_s, turn_at, turn_deg, _rate_dps(20.0, 130.0))
    for _ in range(200):
        latitude, runway = rng.uniform(-70.0, 70.0), rng.uniform(0.0, 360.0)
        if _highest_deg(latitude, runway + turn_deg, length) < HIGHEST_LATITUDE_DEG:
            break
    else:  # so long a flight fits along the equator only
        latitude, runway = 0.0, 90.0 - turn_deg
    return RoutePlan(latitude, rng.uniform(-180.0, 180.0), runway, speed, altitude, turn, np.zeros(len(time_s)))


def _highest_deg(latitude_deg: float, course_deg: float, arc_rad: float) -> float:
    """Return the largest distance from the equator along a great circle, on the sphere."""
    arc = np.linspace(0.0, arc_rad, 50)
    start, course = np.deg2rad(latitude_deg), np.deg2rad(course_deg)
    sine = np.sin(start) * np.cos(arc) + np.cos(start) * np.sin(arc) * np.cos(course)
    return float(np.rad2deg(np.arcsin(np.max(np.abs(sine)))))


def _norilsk_moscow(time_s: FloatArray, rng: np.random.Generator) -> RoutePlan:
    """Plan the paper's flight: 400 s of departure, the great circle, 1400 s of approach.

    The cruise speed fits the time.
    """
    end = float(time_s[-1])
    field_m, cruise_m = 180.0, rng.uniform(8e3, 10e3)
    start, goal = np.deg2rad(NORILSK_DEG), np.deg2rad(MOSCOW_DEG)
    cosine = np.sin(start[0]) * np.sin(goal[0]) + np.cos(start[0]) * np.cos(goal[0]) * np.cos(goal[1] - start[1])
    to_fly_m = MEAN_RADIUS_M * float(np.arccos(cosine)) + DETOUR_M
    before = time_s < end - APPROACH_S
    step_s = float(time_s[1] - time_s[0])
    lengths = [
        float(np.sum(_climb_out(time_s, field_m, cruise_m, 75.0, cruise, 10.0)[0][before])) * step_s
        for cruise in (0.0, 1.0)
    ]
    cruise = float(np.clip((to_fly_m - lengths[0]) / (lengths[1] - lengths[0]), 120.0, 240.0))  # length is linear in it
    speed, altitude = _climb_out(time_s, field_m, cruise_m, 75.0, cruise, 10.0)
    speed -= (cruise - 95.0) * smooth_ramp(time_s, end - APPROACH_S, 500.0)
    speed -= 95.0 * smooth_ramp(time_s, end - 70.0, 50.0)
    altitude = altitude - (cruise_m - field_m - 10.0) * smooth_ramp(
        time_s, end - APPROACH_S - 300.0, APPROACH_S + 200.0
    )
    runway, turn, at = 13.0 + 180.0 * rng.integers(2), np.zeros(len(time_s)), 110.0
    for angle in rng.choice([-1.0, 1.0]) * np.array([60.0, -40.0]) + rng.uniform(-15.0, 15.0, 2):
        part, at = turn_of(time_s, at, angle, _rate_dps(18.0, float(np.interp(at, time_s, speed))))
        turn, at = turn + part, at + rng.uniform(15.0, 40.0)
    at = end - APPROACH_S + rng.uniform(60.0, 150.0)
    for angle in rng.choice([-1.0, 1.0]) * np.array([70.0, -110.0, 90.0, 90.0, 45.0]) + rng.uniform(-10.0, 10.0, 5):
        part, at = turn_of(time_s, at, angle, _rate_dps(20.0, float(np.interp(at, time_s, speed))))
        turn, at = turn + part, at + rng.uniform(60.0, 150.0)
    steers = ((time_s > DEPARTURE_S - 60.0) & (time_s < end - APPROACH_S)).astype(np.float64)
    return RoutePlan(*NORILSK_DEG, runway, speed, altitude, turn * (1.0 - steers), steers, MOSCOW_DEG)


def _manoeuvring(time_s: FloatArray, rng: np.random.Generator) -> RoutePlan:
    """Plan survey lines or racetracks: a turn every 5 to 20 min, back and forth or onwards."""
    cruise = rng.uniform(100.0, 180.0)
    speed, altitude = _climb_out(time_s, rng.uniform(0.0, 600.0), rng.uniform(3e3, 9e3), 70.0, cruise, 8.0)
    turn, at, side = np.zeros(len(time_s)), 150.0, float(rng.choice([-1.0, 1.0]))
    while at < time_s[-1] - 60.0:
        angle = side * rng.choice([180.0, 180.0, 90.0, 60.0, 360.0])
        part, at = turn_of(time_s, at, angle, _rate_dps(rng.uniform(15.0, 28.0), cruise))
        turn, side = turn + part, side * float(rng.choice([-1.0, -1.0, 1.0]))
        at += rng.uniform(300.0, 1200.0)
    start = (rng.uniform(-65.0, 65.0), rng.uniform(-180.0, 180.0), rng.uniform(0.0, 360.0))
    return RoutePlan(*start, speed, altitude, turn, np.zeros(len(time_s)))


def _out_and_back(time_s: FloatArray, rng: np.random.Generator) -> RoutePlan:
    """Plan one long leg, a turn of 180 deg near mid-flight, and the same leg back."""
    return _legs(time_s, rng, [(rng.uniform(0.35, 0.6) * float(time_s[-1]), 180.0 * rng.choice([-1.0, 1.0]))])


def _dogleg(time_s: FloatArray, rng: np.random.Generator) -> RoutePlan:
    """Plan an airway: legs of 15 to 45 min with changes of course of 20 to 80 deg.

    The changes go either way.
    """
    at = np.cumsum(rng.uniform(900.0, 2700.0, 20))
    return _legs(time_s, rng, [(start, rng.choice([-1.0, 1.0]) * rng.uniform(20.0, 80.0)) for start in at])


def _racetrack(time_s: FloatArray, rng: np.random.Generator) -> RoutePlan:
    """Plan a patrol: legs of one length, 3 to 25 min, every turn 180 deg to the same side."""
    angle, leg_s = 180.0 * rng.choice([-1.0, 1.0]), rng.uniform(180.0, 1500.0)
    return _legs(time_s, rng, [(start, angle) for start in np.arange(600.0 + leg_s, time_s[-1], leg_s + 120.0)])


def _late_survey(time_s: FloatArray, rng: np.random.Generator) -> RoutePlan:
    """Plan a straight transit over 0.4 to 0.6 of the time, then a turn every 5 to 15 min.

    The past does not tell what comes.
    """
    begin_s = rng.uniform(0.4, 0.6) * float(time_s[-1])
    at = begin_s + np.cumsum(rng.uniform(300.0, 900.0, 60))
    return _legs(time_s, rng, [(start, float(rng.choice([-180.0, -90.0, 60.0, 90.0, 180.0]))) for start in at])


def _legs(time_s: FloatArray, rng: np.random.Generator, turns: list[tuple[float, float]]) -> RoutePlan:
    """Plan a climb out, cruise, and turns (start, angle) at 20 deg of bank."""
    cruise = rng.uniform(120.0, 230.0)
    speed, altitude = _climb_out(time_s, rng.uniform(0.0, 600.0), rng.uniform(5e3, 11e3), 70.0, cruise, 8.0)
    turn = np.zeros(len(time_s))
    for start_s, angle_deg in turns:
        turn += turn_of(time_s, start_s, angle_deg, _rate_dps(20.0, cruise))[0]
    latitude = rng.uniform(-50.0, 50.0)  # 16 000 s at 230 m/s end below 84 deg at worst
    return RoutePlan(latitude, rng.uniform(-180.0, 180.0), rng.uniform(0.0, 360.0), speed, altitude, turn, 0.0 * turn)


@compiled
def _fly(  # type: ignore[no-untyped-def]
    step_s,
    start_rad,
    speed_mps,
    altitude_m,
    turn_radps,
    steers,
    goal_rad,
    steering_radps,
    latitude,
    longitude,
    heading,
    turn,
):
    """Fill latitude, longitude and heading by Heun's rule.

    The geodesic turns the heading by v_E tan(lat) / (N + h).
    """
    n = len(speed_mps)
    lat, lon, course, rate = start_rad[0], start_rad[1], start_rad[2], 0.0
    pi = np.pi
    for k in range(n):
        if steers[k] > 0.0:
            d_lon = goal_rad[1] - lon
            x = np.cos(lat) * np.sin(goal_rad[0]) - np.sin(lat) * np.cos(goal_rad[0]) * np.cos(d_lon)
            wanted = np.arctan2(np.sin(d_lon) * np.cos(goal_rad[0]), x) - course
            wanted -= 2.0 * pi * np.rint(wanted / (2.0 * pi))
            aim = min(max(wanted / STEERING_S, -steering_radps), steering_radps)
            largest = steering_radps * step_s / BANK_RAMP_S
            rate += min(max(aim - rate, -largest), largest)
        else:
            change = turn_radps[k] - rate
            largest = 0.03 * step_s / BANK_RAMP_S  # leaves every planned ramp alone, eases out of steering
            rate += min(max(change, -largest), largest)
        latitude[k], longitude[k], heading[k], turn[k] = lat, lon, course, rate
        if k == n - 1:
            break
        at_lat, at_course, mean_lat, mean_lon, mean_course = lat, course, 0.0, 0.0, 0.0
        for half in range(2):
            speed, altitude = speed_mps[k + half], altitude_m[k + half]
            sine = np.sin(at_lat)
            denominator = 1.0 - ECCENTRICITY_SQUARED * sine * sine
            normal = SEMI_MAJOR_M / np.sqrt(denominator)
            meridian = normal * (1.0 - ECCENTRICITY_SQUARED) / denominator
            d_lat = speed * np.cos(at_course) / (meridian + altitude)
            d_lon = speed * np.sin(at_course) / ((normal + altitude) * np.cos(at_lat))
            d_course = rate + d_lon * sine
            mean_lat, mean_lon, mean_course = (
                mean_lat + 0.5 * d_lat,
                mean_lon + 0.5 * d_lon,
                mean_course + 0.5 * d_course,
            )
            at_lat, at_course = lat + step_s * d_lat, course + step_s * d_course
        lat, lon, course = lat + step_s * mean_lat, lon + step_s * mean_lon, course + step_s * mean_course
