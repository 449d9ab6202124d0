"""Families of motion: car, fixed wing, multicopter, and a log that begins in flight."""

from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from groundstation.base.dataclasses import dataclass
from groundstation.base.errors import SettingsError
from groundstation.simulation.imu.jets import Jet, Ramps, Sines, cosine, direction, root, sine
from groundstation.simulation.imu.motion import ORDER, Motion, MotionJets, Origin, Place

FloatArray = NDArray[np.float64]
Family = Literal["drive", "uav", "hover", "start_in_motion"]
FAMILIES: tuple[Family, ...] = get_args(Family)
GRAVITY_MPS2 = 9.81  # of the pilot who banks a turn
IN_FLIGHT_S = 150.0  # of flight before a log that starts in motion


def motion_of(family: Family, rng: np.random.Generator, origin: Origin, duration_s: float, slip: float) -> Motion:
    """Draw a motion of a family.

    Parameters
    ----------
    family : str
        One of :data:`FAMILIES`.
    rng : numpy.random.Generator
    origin : Origin
        Place of the start.
    duration_s : float
        Length of the log.
    slip : float
        Sideslip of a car in degrees for a metre per second squared to the side.

    Raises
    ------
    SettingsError
        When there is no such family.
    """
    if family == "drive":
        return _drive(rng, origin, duration_s, slip)
    if family in {"uav", "start_in_motion"}:
        return _wing(rng, origin, duration_s, float(rng.uniform(45.0, 75.0)) if family == "uav" else -IN_FLIGHT_S)
    if family == "hover":
        return _hover(rng, origin, duration_s)
    raise SettingsError("family", repr(family), f"one of {', '.join(FAMILIES)}")


@dataclass(frozen=True)
class Drive:
    """Drive of a car: metres over time along a road of corners and hills.

    The unit sits at the middle of the rear axle, whose nose is along the track but for the slip of its tyres. The body
    leans out of turns, sinks at the rear under power, and the road slopes to the side.
    """

    origin: Origin
    travel: Ramps
    north: Ramps
    east: Ramps
    start_rad: float
    hills: Sines
    camber: Sines
    slip_rad_per_mps2: float
    lean_rad_per_mps2: float = 0.006
    squat_rad_per_mps2: float = 0.003

    def jets(self, time_s: FloatArray) -> MotionJets:
        """Return the motion at times."""
        along = self.travel.of(Jet.of_time(time_s, ORDER))
        to_north, to_east = (float(part(self.start_rad)) for part in (np.cos, np.sin))
        north, east, up = (
            along * to_north + self.north.of(along),
            along * to_east + self.east.of(along),
            self.hills.of(along),
        )
        place = self.origin.place(north, east, up)
        velocity = _velocity(place, north, east, up)
        tangent_north = (self.north.slope(along) + to_north) * place.north_scale
        tangent_east = (self.east.slope(along) + to_east) * place.east_scale
        track = direction(tangent_east, tangent_north)
        forward, right = _forward_right(velocity, track)
        level = root(tangent_north * tangent_north + tangent_east * tangent_east)
        slope = direction(self.hills.slope(along), level)
        heading = track - right * self.slip_rad_per_mps2
        roll = self.camber.of(along) - right * self.lean_rad_per_mps2
        return MotionJets(place, velocity, (roll, slope + forward * self.squat_rad_per_mps2, heading))


@dataclass(frozen=True)
class Wing:
    """Flight of a fixed wing: figures of eight over the ground, in wind.

    It is banked so that no force is to the side. It stands, is launched, and then flies with its nose into the air's
    flow. ``course`` is the angle along the figure over time, ``pace`` what is added to it so that the speed over ground
    is even, ``flying`` rises from 0 to 1 after the launch.
    """

    origin: Origin
    course: Ramps
    pace: Sines
    flying: Ramps
    ahead: Sines
    aside: Sines
    start_rad: float
    climb: Ramps
    swell: Sines
    slide: Sines
    wind_mps: tuple[float, float]
    launch_mps: float
    incidence_rad: float

    def jets(self, time_s: FloatArray) -> MotionJets:
        """Return the motion at times."""
        time = Jet.of_time(time_s, ORDER)
        angle, flying = self.course.of(time), self.flying.slope(time)
        course = angle + self.pace.of(angle)
        north, east = self._turned(self.ahead.of(course), self.aside.of(course))
        up = self.climb.slope(time) + self.swell.of(time) * flying
        place = self.origin.place(north, east, up)
        velocity = _velocity(place, north, east, up)
        still = (-flying + 1.0) * self.launch_mps
        nose_north, nose_east = self._turned(self.ahead.slope(course), self.aside.slope(course))
        length = root(nose_north * nose_north + nose_east * nose_east)
        air_north = nose_north / length * still + (velocity[0] - self.wind_mps[0]) * flying
        air_east = nose_east / length * still + (velocity[1] - self.wind_mps[1]) * flying
        heading = direction(air_east, air_north) + self.slide.of(time) * flying
        level = root(air_north * air_north + air_east * air_east)
        pitch = direction(-velocity[2], level) + self.incidence_rad
        forward, right = _forward_right(velocity, heading)
        lift = (-velocity[2].derivative() + GRAVITY_MPS2) * cosine(pitch) - forward * sine(pitch)
        return MotionJets(place, velocity, (direction(right, lift), pitch, heading))

    def _turned(self, ahead: Jet, aside: Jet) -> tuple[Jet, Jet]:
        c, s = float(np.cos(self.start_rad)), float(np.sin(self.start_rad))
        return ahead * c - aside * s, ahead * s + aside * c


@dataclass(frozen=True)
class Hover:
    """Flight of a multicopter: it hovers, dashes, and turns its nose as it likes.

    Its thrust is along its own vertical, against weight, drag and what the wind does.
    """

    origin: Origin
    flying: Ramps
    north: Ramps
    east: Ramps
    climb: Ramps
    sway: tuple[Sines, Sines, Sines]
    turns: Ramps
    wander: Sines
    start_rad: float
    wind_mps: tuple[float, float]
    drag_per_s: float

    def jets(self, time_s: FloatArray) -> MotionJets:
        """Return the motion at times."""
        time = Jet.of_time(time_s, ORDER)
        flying = self.flying.slope(time)
        sway = [one.of(time) * flying for one in self.sway]
        north, east = self.north.slope(time) + sway[0], self.east.slope(time) + sway[1]
        up = self.climb.slope(time) + sway[2]
        place = self.origin.place(north, east, up)
        velocity = _velocity(place, north, east, up)
        heading = self.turns.slope(time) + self.wander.of(time) * flying + self.start_rad
        flow = flying * self.drag_per_s
        north_flow, east_flow = (velocity[0] - self.wind_mps[0]) * flow, (velocity[1] - self.wind_mps[1]) * flow
        forward, right = _along_across(north_flow, east_flow, heading)
        more_forward, more_right = _forward_right(velocity, heading)
        forward, right = forward + more_forward, right + more_right
        lift = -velocity[2].derivative() + GRAVITY_MPS2
        pitch = direction(-forward, lift)
        roll = direction(right, lift * cosine(pitch) - forward * sine(pitch))
        return MotionJets(place, velocity, (roll, pitch, heading))


def _velocity(place: Place, north: Jet, east: Jet, up: Jet) -> tuple[Jet, Jet, Jet]:
    return place.north_scale * north.derivative(), place.east_scale * east.derivative(), -up.derivative()


def _forward_right(velocity: tuple[Jet, Jet, Jet], heading: Jet) -> tuple[Jet, Jet]:
    """Return the horizontal acceleration along a heading and to its right."""
    return _along_across(velocity[0].derivative(), velocity[1].derivative(), heading)


def _along_across(north: Jet, east: Jet, heading: Jet) -> tuple[Jet, Jet]:
    c, s = cosine(heading), sine(heading)
    return north * c + east * s, east * c - north * s


def _drive(rng: np.random.Generator, origin: Origin, duration_s: float, slip: float) -> Drive:
    """Draw a drive: it stands 60 to 120 s, then goes and stops, a corner every 100 to 300 m."""
    at, width, size = [], [], []
    now, speed, most = float(rng.uniform(60.0, 120.0)), 0.0, 0.0

    def change(to_mps: float, soft_s: float) -> None:
        nonlocal speed
        at.append(now)
        width.append(soft_s)
        size.append(to_mps - speed)
        speed = to_mps

    now = min(now, 0.3 * duration_s)
    while now < duration_s:
        for _ in range(int(rng.integers(2, 6))):
            change(float(rng.uniform(6.0, 13.0)), float(rng.uniform(2.0, 4.0)))
            most = max(most, speed)
            now += float(rng.uniform(12.0, 35.0))
        change(0.0, float(rng.uniform(2.5, 4.0)))
        now += float(rng.uniform(15.0, 40.0))
    corners = np.cumsum(rng.uniform(100.0, 300.0, int(most * duration_s / 100.0) + 2)) - 50.0
    angle = rng.uniform(0.0, 2.0 * np.pi) + np.concatenate(
        [[0.0], np.cumsum(np.deg2rad(rng.uniform(30.0, 95.0, len(corners))) * rng.choice([-1.0, 1.0], len(corners)))]
    )
    soft = rng.uniform(20.0, 30.0, len(corners))
    return Drive(
        origin,
        Ramps(np.array(at), np.array(width), np.array(size)),
        Ramps(corners, soft, np.diff(np.cos(angle))),
        Ramps(corners, soft, np.diff(np.sin(angle))),
        float(angle[0]),
        _sines(rng, 3, (0.5, 2.0), (300.0, 900.0)),
        _sines(rng, 2, (0.005, 0.015), (150.0, 500.0)),
        float(np.deg2rad(slip)),
    )


def _wing(rng: np.random.Generator, origin: Origin, duration_s: float, launch_s: float) -> Wing:
    """Draw a flight of a fixed wing of some 20 m/s that is launched at a time."""
    length, turn = float(rng.uniform(190.0, 240.0)), float(rng.uniform(0.10, 0.115))
    mode = 1.7 * float(rng.uniform(0.9, 1.1))
    ahead = Sines(np.array([length, 0.06 * length]), np.array([1.0, mode]), np.zeros(2))
    aside = Sines(np.array([0.42 * length, 0.04 * length]), np.array([2.0, 1.6 * mode]), np.zeros(2))
    climbs = np.arange(launch_s + 15.0, launch_s + 15.0 + max(duration_s - launch_s, 1.0), 70.0)
    heights = np.concatenate([[90.0], 90.0 + rng.uniform(-40.0, 40.0, len(climbs))])
    gust = rng.uniform(0.0, 2.0 * np.pi)
    wind = float(rng.uniform(3.0, 6.0))
    return Wing(
        origin,
        Ramps(np.array([launch_s]), np.array([2.0]), np.array([turn])),
        Sines(np.array([-0.1, -0.04]), np.array([2.0, 4.0]), np.zeros(2)),
        Ramps(np.array([launch_s + 5.0]), np.array([1.5]), np.ones(1)),
        ahead,
        aside,
        float(rng.uniform(0.0, 2.0 * np.pi)),
        Ramps(
            np.concatenate([[launch_s + 14.0], climbs + 30.0]),
            np.concatenate([[7.0], rng.uniform(8.0, 14.0, len(climbs))]),
            np.diff(heights, prepend=0.0),
        ),
        _sines(rng, 3, (0.3, 1.0), (6.0, 25.0)),
        _sines(rng, 3, (0.004, 0.012), (2.0, 9.0)),
        (wind * float(np.cos(gust)), wind * float(np.sin(gust))),
        20.0,
        float(np.deg2rad(rng.uniform(2.0, 5.0))),
    )


def _hover(rng: np.random.Generator, origin: Origin, duration_s: float) -> Hover:
    """Draw a flight of a multicopter: a dash each half minute, turns of the nose in between."""
    launch = min(float(rng.uniform(30.0, 60.0)), 0.3 * duration_s)
    dashes = np.arange(launch + 20.0, max(duration_s, launch + 21.0), 28.0)
    dashes = dashes + rng.uniform(-5.0, 5.0, len(dashes))
    places = rng.uniform(-40.0, 40.0, (len(dashes), 2))
    steps = np.diff(places, axis=0, prepend=np.zeros((1, 2)))
    soft = np.maximum(rng.uniform(2.5, 4.5, len(dashes)), np.hypot(*steps.T) / 14.0)
    turns = np.cumsum(rng.uniform(12.0, 45.0, int(duration_s / 12.0) + 1)) + launch + 5.0
    climbs = np.arange(launch + 60.0, max(duration_s, launch + 61.0), 90.0)
    heights = np.concatenate([[20.0], rng.uniform(10.0, 40.0, len(climbs))])
    wind, gust = float(rng.uniform(1.0, 5.0)), float(rng.uniform(0.0, 2.0 * np.pi))
    angles = np.deg2rad(rng.uniform(30.0, 150.0, len(turns))) * rng.choice([-1.0, 1.0], len(turns))
    return Hover(
        origin,
        Ramps(np.array([launch + 6.0]), np.array([2.0]), np.ones(1)),
        Ramps(dashes, soft, steps[:, 0]),
        Ramps(dashes, soft, steps[:, 1]),
        Ramps(
            np.concatenate([[launch + 6.0], climbs]),
            np.concatenate([[4.0], rng.uniform(4.0, 7.0, len(climbs))]),
            np.diff(heights, prepend=0.0),
        ),
        tuple(_sines(rng, 4, (0.02, 0.25), (3.0, 15.0)) for _ in range(3)),  # type: ignore[arg-type]
        Ramps(turns, rng.uniform(1.2, 3.0, len(turns)), angles),
        _sines(rng, 3, (0.003, 0.015), (1.5, 8.0)),
        float(rng.uniform(0.0, 2.0 * np.pi)),
        (wind * float(np.cos(gust)), wind * float(np.sin(gust))),
        float(rng.uniform(0.15, 0.35)),
    )


def _sines(rng: np.random.Generator, count: int, amplitude: tuple[float, float], period: tuple[float, float]) -> Sines:
    """Draw sines with amplitudes and periods between bounds."""
    return Sines(
        rng.uniform(*amplitude, count), 2.0 * np.pi / rng.uniform(*period, count), rng.uniform(0.0, 2.0 * np.pi, count)
    )
