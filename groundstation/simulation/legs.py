"""Legs of a simulated flight, as a scenario lists them, and their pieces of motion.

On the ground the state is ground speed along the track; in the air it is airspeed along the direction of the air
velocity, so that a turn at constant bank is one in the air mass and the wind adds to the ground velocity.
"""

from dataclasses import replace
from typing import ClassVar, TypeAlias

import numpy as np

from groundstation.base.dataclasses import dataclass
from groundstation.base.errors import SettingsError
from groundstation.base.geodesy import SEMI_MAJOR_M, curvature_radii_m
from groundstation.base.toml_settings import number, required_number
from groundstation.base.units import MPS2_PER_G

GROUND_ACCELERATION_MPS2 = 0.8  # peak of a change of taxi speed
BRAKING_MPS2 = 2.0
AIR_ACCELERATION_MPS2 = 1.0
GROUND_TURN_RAMP_S = 2.0
BANK_RAMP_S = 5.0
CLIMB_RAMP_S = 8.0
GREAT_CIRCLE_PIECE_S = 60.0  # the turn rate of a great circle is followed linearly within: 1e-4 deg


@dataclass(frozen=True)
class Parked:
    """Standstill at the stand, at a stop or on the runway, after braking if needed."""

    kind: ClassVar[str] = "parked"
    duration_s: float = required_number(0.0)


@dataclass(frozen=True)
class Taxi:
    """Straight taxi over a length.

    The change to the leg's speed is made at its start and is part of the length.
    """

    kind: ClassVar[str] = "taxi"
    length_m: float = required_number(0.0)
    speed_mps: float = required_number(0.5, 40.0)


@dataclass(frozen=True)
class GroundTurn:
    """Turn on the ground (right positive) at a speed; the rate rises and falls smoothly."""

    kind: ClassVar[str] = "ground_turn"
    angle_deg: float = required_number(-720.0, 720.0)
    speed_mps: float = number(5.0, 0.5, 40.0)
    rate_dps: float = number(9.0, 0.01, 30.0)


@dataclass(frozen=True)
class TakeOff:
    """Take-off straight on: acceleration, lift-off at a speed, start of the climb.

    The aircraft rotates in the last seconds before lift-off.
    """

    kind: ClassVar[str] = "take_off"
    lift_off_speed_mps: float = number(55.0, 20.0, 120.0)
    acceleration_mps2: float = number(2.5, 0.1, 10.0)
    climb_rate_mps: float = number(6.0, 0.5, 40.0)


@dataclass(frozen=True)
class Fly:
    """Straight flight for a time.

    Airspeed and climb rate change smoothly at the start (0 keeps level). Straight is along the rhumb line, or with
    ``great_circle`` along the great circle that starts with the heading.
    """

    kind: ClassVar[str] = "fly"
    duration_s: float = required_number(0.0)
    airspeed_mps: float = required_number(20.0, 400.0)
    climb_rate_mps: float = number(0.0, -40.0, 40.0)
    great_circle: bool = False


@dataclass(frozen=True)
class ClimbTo:
    """Climb or descent to an ellipsoid altitude, levelled off there exactly."""

    kind: ClassVar[str] = "climb_to"
    altitude_m: float = required_number(-500.0, 20_000.0)
    airspeed_mps: float = required_number(20.0, 400.0)
    climb_rate_mps: float = number(8.0, 0.1, 40.0)


@dataclass(frozen=True)
class AirTurn:
    """Coordinated turn (right positive) at constant airspeed and altitude.

    The bank is rolled in and out smoothly. ``bank_change_deg`` is how much more bank there is at the end of the turn
    than at its start, ``bank_deg`` between.
    """

    kind: ClassVar[str] = "air_turn"
    angle_deg: float = required_number(-1080.0, 1080.0)
    bank_deg: float = number(20.0, 1.0, 60.0)
    bank_change_deg: float = number(0.0, -40.0, 40.0)

    def __post_init__(self) -> None:
        if abs(self.bank_change_deg) >= 2.0 * self.bank_deg:
            found = f"{self.bank_change_deg:g} at a bank of {self.bank_deg:g}"
            raise SettingsError("bank_change_deg", found, "a change below twice the bank")


@dataclass(frozen=True)
class Landing:
    """Descent to the runway, flare, touchdown at a speed, braking to taxi speed."""

    kind: ClassVar[str] = "landing"
    runway_altitude_m: float = required_number(-500.0, 6_000.0)
    airspeed_mps: float = number(50.0, 20.0, 120.0)
    descent_rate_mps: float = number(3.0, 0.5, 10.0)
    taxi_speed_mps: float = number(8.0, 0.5, 30.0)


Leg: TypeAlias = Parked | Taxi | GroundTurn | TakeOff | Fly | ClimbTo | AirTurn | Landing


@dataclass(frozen=True)
class MotionSegment:
    """Stretch of motion with smooth changes of speed, turn rate and climb rate.

    They go from their last values to these. ``airborne`` is the state during the piece. Durations are rounded up to
    whole steps by the planner beforehand.
    """

    duration_s: float
    speed_mps: float
    turn_rate_dps: float = 0.0
    climb_rate_mps: float = 0.0
    airborne: bool = False


@dataclass(frozen=True)
class MotionState:
    """State of the aircraft between two pieces.

    Its speed and direction are over the ground, or through the air. The latitude is good to some kilometres: it serves
    the turn rate of great circles alone.
    """

    step_s: float
    speed_mps: float
    direction_deg: float
    altitude_m: float
    climb_rate_mps: float = 0.0
    airborne: bool = False
    latitude_deg: float = 0.0
    wind_mps: tuple[float, float] = (0.0, 0.0)

    def after(self, piece: MotionSegment, turn_rate_dps: float) -> "MotionState":
        """The state at the end of a piece that starts with a turn rate."""
        time, rate = piece.duration_s, turn_rate_dps
        mean_mps = 0.5 * (self.speed_mps + piece.speed_mps)
        middle_rad = np.deg2rad(self.direction_deg + 0.125 * time * (3.0 * rate + piece.turn_rate_dps))
        north_mps = mean_mps * float(np.cos(middle_rad)) + (self.wind_mps[0] if self.airborne else 0.0)
        return replace(
            self,
            speed_mps=piece.speed_mps,
            direction_deg=self.direction_deg + 0.5 * time * (rate + piece.turn_rate_dps),
            altitude_m=self.altitude_m + 0.5 * time * (self.climb_rate_mps + piece.climb_rate_mps),
            climb_rate_mps=piece.climb_rate_mps,
            latitude_deg=self.latitude_deg + float(np.rad2deg(north_mps * time / SEMI_MAJOR_M)),
        )

    def great_circle_rate_dps(self) -> float:
        """Turn rate that keeps to the great circle: east velocity x tan(latitude) / (N + h)."""
        _meridian, normal = curvature_radii_m(self.latitude_deg)
        east_mps = self.speed_mps * np.sin(np.deg2rad(self.direction_deg)) + self.wind_mps[1]
        radius_m = float(normal) + self.altitude_m
        return float(np.rad2deg(east_mps * np.tan(np.deg2rad(self.latitude_deg)) / radius_m))

    def whole_steps(self, duration_s: float) -> float:
        """Round a duration up to whole steps."""
        return float(np.ceil(duration_s / self.step_s - 1e-6)) * self.step_s


def pieces_of(leg: Leg, state: MotionState, place: str) -> tuple[MotionSegment, ...]:
    """The pieces of one leg flown from a state (which is not changed).

    Raises
    ------
    SettingsError
        When the leg cannot follow: a ground leg in the air, a straight too short for its change of speed.
    """
    wants_air = isinstance(leg, Fly | ClimbTo | AirTurn | Landing)
    if wants_air != state.airborne:
        found = f"{leg.kind} {'on the ground' if wants_air else 'in the air'}"
        raise SettingsError(place, found, "take_off before and landing after the legs flown in the air")
    match leg:
        case Parked():
            return _parked(leg, state)
        case Taxi():
            return _taxi(leg, state, place)
        case GroundTurn():
            ramp = _speed_change(state, leg.speed_mps, GROUND_ACCELERATION_MPS2)
            return ramp + _turn(leg.angle_deg, leg.rate_dps, GROUND_TURN_RAMP_S, leg.speed_mps, state)
        case TakeOff():
            return _take_off(leg, state)
        case Fly():
            ramp_s = state.whole_steps(_air_ramp_s(state, leg.airspeed_mps))
            hold_s = state.whole_steps(max(leg.duration_s - ramp_s, 0.0))
            if leg.great_circle:
                return _great_circle(leg, ramp_s, hold_s, state)
            return tuple(
                MotionSegment(duration, leg.airspeed_mps, 0.0, leg.climb_rate_mps, True)
                for duration in (ramp_s, hold_s)
            )
        case ClimbTo():
            return _climb_to(leg.altitude_m, leg.airspeed_mps, leg.climb_rate_mps, state, place)
        case AirTurn():
            rate, first, last = (
                float(np.rad2deg(MPS2_PER_G * np.tan(np.deg2rad(leg.bank_deg + change)) / state.speed_mps))
                for change in (0.0, -0.5 * leg.bank_change_deg, 0.5 * leg.bank_change_deg)
            )
            level = () if state.climb_rate_mps == 0.0 else (_level(state),)
            growth = (last - first) / (2.0 * rate)
            return level + _turn(leg.angle_deg, rate, BANK_RAMP_S, state.speed_mps, state, growth)
        case Landing():
            return _climb_to(leg.runway_altitude_m, leg.airspeed_mps, leg.descent_rate_mps, state, place)


def _speed_change(state: MotionState, speed_mps: float, acceleration_mps2: float) -> tuple[MotionSegment, ...]:
    difference = abs(speed_mps - state.speed_mps)
    if difference == 0.0:
        return ()
    # The smoothstep's steepest slope is 1.5 times its mean one.
    return (MotionSegment(state.whole_steps(1.5 * difference / acceleration_mps2), speed_mps, airborne=state.airborne),)


def _parked(leg: Parked, state: MotionState) -> tuple[MotionSegment, ...]:
    return (*_speed_change(state, 0.0, GROUND_ACCELERATION_MPS2), MotionSegment(state.whole_steps(leg.duration_s), 0.0))


def _taxi(leg: Taxi, state: MotionState, place: str) -> tuple[MotionSegment, ...]:
    ramp = _speed_change(state, leg.speed_mps, GROUND_ACCELERATION_MPS2)
    used_m = sum(piece.duration_s * 0.5 * (state.speed_mps + leg.speed_mps) for piece in ramp)
    if used_m > leg.length_m:
        raise SettingsError(f"{place}.length_m", f"{leg.length_m:g} m", f"{used_m:.0f} m or more for the speed change")
    return (*ramp, MotionSegment(state.whole_steps((leg.length_m - used_m) / leg.speed_mps), leg.speed_mps))


def _turn(
    angle_deg: float, rate_dps: float, ramp_s: float, speed_mps: float, state: MotionState, growth: float = 0.0
) -> tuple[MotionSegment, ...]:
    """Return the pieces of a turn: rate up, hold, rate down.

    The rate is adjusted so that whole steps give exactly the angle. ``growth`` is the share by which the rate at the
    end of the hold lies above its mean, and below it at the start.
    """
    hold_s = state.whole_steps(max(abs(angle_deg) / rate_dps - ramp_s, 0.0))
    ramp_s = state.whole_steps(ramp_s)
    rate = angle_deg / (hold_s + ramp_s)  # each ramp contributes half its length at full rate
    rates_and_times = ((rate * (1.0 - growth), ramp_s), (rate * (1.0 + growth), hold_s), (0.0, ramp_s))
    return tuple(MotionSegment(time, speed_mps, rate, 0.0, state.airborne) for rate, time in rates_and_times)


def _great_circle(leg: Fly, ramp_s: float, hold_s: float, state: MotionState) -> tuple[MotionSegment, ...]:
    """Return a change of speed and short pieces that follow a great circle.

    The pieces take up the turn rate of the great circle; at the end there is none again.
    """
    pieces, rate = [MotionSegment(ramp_s, leg.airspeed_mps, 0.0, leg.climb_rate_mps, True)], 0.0
    state = state.after(pieces[0], rate)
    length_s = state.whole_steps(GREAT_CIRCLE_PIECE_S)
    while hold_s > 2.0 * length_s:
        piece = MotionSegment(length_s, leg.airspeed_mps, state.great_circle_rate_dps(), leg.climb_rate_mps, True)
        state, rate, hold_s = state.after(piece, rate), piece.turn_rate_dps, hold_s - length_s
        pieces.append(piece)
    return (*pieces, MotionSegment(state.whole_steps(hold_s), leg.airspeed_mps, 0.0, leg.climb_rate_mps, True))


def _take_off(leg: TakeOff, state: MotionState) -> tuple[MotionSegment, ...]:
    roll_s = state.whole_steps(1.5 * (leg.lift_off_speed_mps - state.speed_mps) / leg.acceleration_mps2)
    return (MotionSegment(roll_s, leg.lift_off_speed_mps),)


def pieces_after_transition(leg: Leg, state: MotionState) -> tuple[MotionSegment, ...]:
    """Return the pieces of a take-off in the air, or of a landing on the ground.

    They are flown after lift-off and touchdown.
    """
    if isinstance(leg, TakeOff):
        return (MotionSegment(state.whole_steps(CLIMB_RAMP_S), state.speed_mps, 0.0, leg.climb_rate_mps, True),)
    if isinstance(leg, Landing):
        return _speed_change(state, leg.taxi_speed_mps, BRAKING_MPS2)
    return ()


def _air_ramp_s(state: MotionState, airspeed_mps: float) -> float:
    return max(1.5 * abs(airspeed_mps - state.speed_mps) / AIR_ACCELERATION_MPS2, CLIMB_RAMP_S)


def _level(state: MotionState) -> MotionSegment:
    return MotionSegment(state.whole_steps(CLIMB_RAMP_S), state.speed_mps, 0.0, 0.0, True)


def _climb_to(
    altitude_m: float, airspeed_mps: float, climb_rate_mps: float, state: MotionState, place: str
) -> tuple[MotionSegment, ...]:
    """Return the pieces of a climb: change speed and begin to climb, climb, level off.

    The middle rate is solved so that the altitude is exact.
    """
    ramp_s, level_s = state.whole_steps(_air_ramp_s(state, airspeed_mps)), state.whole_steps(CLIMB_RAMP_S)
    to_gain = altitude_m - state.altitude_m - 0.5 * state.climb_rate_mps * ramp_s
    hold_s = state.whole_steps(max(abs(to_gain) / climb_rate_mps - 0.5 * (ramp_s + level_s), 0.0))
    rate = to_gain / (hold_s + 0.5 * (ramp_s + level_s))
    if abs(rate) > 45.0:
        raise SettingsError(place, f"climb rate {rate:.0f} m/s", "an altitude that can be reached")
    times_and_rates = ((ramp_s, rate), (hold_s, rate), (level_s, 0.0))
    return tuple(MotionSegment(time, airspeed_mps, 0.0, rate, True) for time, rate in times_and_rates)
