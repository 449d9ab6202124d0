"""Planned motion of a flight: legs chained into pieces, sampled on the internal grid.

The grid is one of times.
"""

from dataclasses import replace

import numpy as np

from groundstation.base.angles import FloatArray, direction_of, wrap_180
from groundstation.base.dataclasses import dataclass
from groundstation.base.errors import SettingsError
from groundstation.base.records import BoolArray
from groundstation.base.units import NS_PER_S
from groundstation.simulation.legs import MotionSegment, MotionState, pieces_after_transition, pieces_of
from groundstation.simulation.scenario import Scenario


@dataclass(frozen=True)
class MotionProfile:
    """Planned motion on the internal grid, arrays of shape (n,).

    On the ground ``speed_mps`` and ``direction_deg`` are those of the ground velocity, in the air those of the
    horizontal air velocity. ``direction_deg`` is continuous within a stay on the ground or in the air; at the
    transitions (``transition_index``, the first sample of the new state) it steps by the drift angle.
    """

    step_ns: int
    speed_mps: FloatArray
    acceleration_mps2: FloatArray
    direction_deg: FloatArray
    turn_rate_dps: FloatArray
    turn_acceleration_dps2: FloatArray
    altitude_m: FloatArray
    climb_rate_mps: FloatArray
    climb_acceleration_mps2: FloatArray
    airborne: BoolArray
    transition_index: tuple[int, ...]

    @property
    def step_s(self) -> float:
        """Step of the grid, seconds."""
        return self.step_ns / NS_PER_S

    @property
    def time_s(self) -> FloatArray:
        """Seconds since log zero, shape (n,)."""
        return np.arange(len(self), dtype=np.float64) * self.step_s

    def __len__(self) -> int:
        return len(self.speed_mps)


def smoothstep(share: FloatArray) -> FloatArray:
    """Return 3 s^2 - 2 s^3, held at 0 and 1 outside [0, 1].

    It is continuous with its slope. A polynomial is exact anywhere.

    Examples
    --------
    >>> smoothstep(np.array([-1.0, 0.5, 2.0])).tolist()
    [0.0, 0.5, 1.0]
    """
    held = np.clip(share, 0.0, 1.0)
    return held * held * (3.0 - 2.0 * held)


def smoothstep_slope(share: FloatArray) -> FloatArray:
    """Derivative of :func:`smoothstep` with respect to its argument."""
    held = np.clip(share, 0.0, 1.0)
    return 6.0 * held * (1.0 - held)


def plan(scenario: Scenario) -> MotionProfile:
    """Chain the scenario's legs and sample them.

    Raises
    ------
    SettingsError
        When a leg cannot follow the one before it.
    """
    step_ns = round(NS_PER_S / scenario.internal_rate_hz)
    if step_ns * scenario.internal_rate_hz != NS_PER_S:
        place = f"{scenario.name}, key internal_rate_hz"
        raise SettingsError(place, f"{scenario.internal_rate_hz:g} Hz", "a whole number of nanoseconds a step")
    heading_deg = scenario.parking_heading_deg - scenario.ground.sideslip_deg
    state = MotionState(
        step_s=step_ns / NS_PER_S,
        speed_mps=0.0,
        direction_deg=heading_deg,
        altitude_m=scenario.airport.altitude_ellipsoid_m,
        latitude_deg=scenario.airport.latitude_deg,
        wind_mps=(scenario.wind.north_mps, scenario.wind.east_mps),
    )
    planned: list[tuple[MotionState, MotionSegment, float]] = []
    for number, leg in enumerate(scenario.legs):
        place = f"{scenario.name}, key legs[{number}]"
        state = _fly(pieces_of(leg, state, place), state, 0.0, planned)
        if leg.kind in ("take_off", "landing"):
            state = _change_frame(state, scenario)
            state = _fly(pieces_after_transition(leg, state), state, 0.0, planned)
    return _sample(planned, state, step_ns)


def _fly(
    pieces: tuple[MotionSegment, ...],
    state: MotionState,
    turn_rate_dps: float,
    planned: list[tuple[MotionState, MotionSegment, float]],
) -> MotionState:
    """Append pieces with the state and turn rate at their start.

    Every leg ends with a turn rate of zero.
    """
    for piece in pieces:
        planned.append((state, piece, turn_rate_dps))
        state = state.after(piece, turn_rate_dps)
        turn_rate_dps = piece.turn_rate_dps
    return state


def _change_frame(state: MotionState, scenario: Scenario) -> MotionState:
    """Turn ground velocity into air velocity at lift-off, and back at touchdown.

    The velocity over the ground is continuous.
    """
    sign = 1.0 if state.airborne else -1.0
    direction_rad = np.deg2rad(state.direction_deg)
    north = state.speed_mps * np.cos(direction_rad) + sign * scenario.wind.north_mps
    east = state.speed_mps * np.sin(direction_rad) + sign * scenario.wind.east_mps
    turned = wrap_180(direction_of(north, east) - state.direction_deg)
    return replace(
        state,
        speed_mps=float(np.hypot(north, east)),
        direction_deg=state.direction_deg + float(turned),
        airborne=not state.airborne,
    )


def _sample(planned: list[tuple[MotionState, MotionSegment, float]], end: MotionState, step_ns: int) -> MotionProfile:
    step_s = step_ns / NS_PER_S
    blocks = [_sample_piece(state, piece, rate, round(piece.duration_s / step_s)) for state, piece, rate in planned]
    last = [end.speed_mps, 0.0, end.direction_deg, 0.0, 0.0, end.altitude_m, end.climb_rate_mps, 0.0]
    speed, acceleration, direction, turn_rate, turn_acceleration, altitude, climb_rate, climb_acceleration = (
        np.concatenate([*blocks, np.array(last)[:, None]], axis=1)
    )
    flags = [np.full(block.shape[1], state.airborne) for block, (state, _, _) in zip(blocks, planned, strict=True)]
    airborne = np.concatenate([*flags, np.array([end.airborne])])
    return MotionProfile(
        step_ns=step_ns,
        speed_mps=speed,
        acceleration_mps2=acceleration,
        direction_deg=direction,
        turn_rate_dps=turn_rate,
        turn_acceleration_dps2=turn_acceleration,
        altitude_m=altitude,
        climb_rate_mps=climb_rate,
        climb_acceleration_mps2=climb_acceleration,
        airborne=airborne,
        transition_index=tuple(int(k) for k in np.flatnonzero(airborne[1:] != airborne[:-1]) + 1),
    )


def _sample_piece(state: MotionState, piece: MotionSegment, turn_rate_dps: float, count: int) -> FloatArray:
    """Sample one piece, shape (8, count), in closed form.

    Rows are speed, direction and altitude with their derivatives.
    """
    share = np.arange(count, dtype=np.float64) / max(count, 1)
    duration_s = piece.duration_s
    time_s = share * duration_s
    step, slope = smoothstep(share), smoothstep_slope(share) / max(duration_s, 1e-9)
    area = duration_s * share**3 * (1.0 - 0.5 * share)  # integral of the smoothstep
    speed_change = piece.speed_mps - state.speed_mps
    rate_change = piece.turn_rate_dps - turn_rate_dps
    climb_change = piece.climb_rate_mps - state.climb_rate_mps
    return np.stack(
        [
            state.speed_mps + speed_change * step,
            speed_change * slope,
            state.direction_deg + turn_rate_dps * time_s + rate_change * area,
            turn_rate_dps + rate_change * step,
            rate_change * slope,
            state.altitude_m + state.climb_rate_mps * time_s + climb_change * area,
            state.climb_rate_mps + climb_change * step,
            climb_change * slope,
        ]
    )
