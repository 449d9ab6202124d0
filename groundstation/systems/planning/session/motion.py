"""Motion of aircraft under controls, and derivatives of a measure by the controls.

A control is the speed or the heading of one aircraft at the end of every step. Between two epochs the aircraft moves
with the mean speed along the mean heading. All controls have one unit, m/s: headings count as heading times the speed
at the start, so that a gradient step means the same for both.
"""

from functools import cached_property

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.dataclasses import dataclass
from groundstation.base.findings import Finding
from groundstation.base.records import frozen
from groundstation.systems.planning.session.scenario import NEAREST_M, Controlled, SessionPlan


@dataclass(frozen=True)
class ControlBounds:
    """One control with its bounds: which aircraft, range of values, change per step; in m/s.

    Parameters
    ----------
    aircraft : int
    kind : {'speed', 'heading'}
    start, low, high, change : float
    scale : float
        Control over quantity: 1 for a speed, m/s per radian for a heading.
    """

    aircraft: int
    kind: Controlled
    start: float
    low: float
    high: float
    change: float
    scale: float


@dataclass(frozen=True)
class Paths:
    """Positions, speeds and headings of a session at every epoch.

    ``position_m`` (epochs, sources, 3) is north, east, up; ``speed_mps`` and ``heading_rad`` are (epochs, aircraft).
    """

    position_m: FloatArray
    speed_mps: FloatArray
    heading_rad: FloatArray

    def __post_init__(self) -> None:
        for name in ("position_m", "speed_mps", "heading_rad"):
            object.__setattr__(self, name, frozen(getattr(self, name)))


@dataclass(frozen=True)
class SessionMotion:
    """Motion of a session: aircraft first, then ground points, in the order of the scenario."""

    plan: SessionPlan

    @cached_property
    def bounds(self) -> tuple[ControlBounds, ...]:
        """Every control, in the order of the aircraft."""
        found = []
        for number, one in enumerate(self.plan.aircraft):
            if "speed" in one.control:
                change = one.acceleration_mps2 * self.plan.step_s
                found.append(
                    ControlBounds(number, "speed", one.speed_mps, one.speed_low_mps, one.speed_high_mps, change, 1.0)
                )
            if "heading" in one.control:
                scale = one.speed_mps
                start, swing = (scale * np.deg2rad(value) for value in (one.track_deg, one.heading_swing_deg))
                change = scale * np.deg2rad(one.turn_rate_dps) * self.plan.step_s
                found.append(ControlBounds(number, "heading", start, start - swing, start + swing, change, scale))
        return tuple(found)

    @cached_property
    def uncontrolled(self) -> FloatArray:
        """Controls that leave everybody as the scenario starts them, shape (controls, steps)."""
        return frozen(np.array([np.full(self.plan.steps, bound.start) for bound in self.bounds]).reshape(self.shape))

    @property
    def shape(self) -> tuple[int, int]:
        """Controls, steps."""
        return len(self.bounds), self.plan.steps

    def paths(self, controls: FloatArray) -> Paths:
        """Positions at every epoch under controls of shape (controls, steps)."""
        plan, epochs = self.plan, self.plan.steps + 1
        speed = np.tile([one.speed_mps for one in plan.aircraft], (epochs, 1))
        heading = np.tile(np.deg2rad([one.track_deg for one in plan.aircraft]), (epochs, 1))
        for bound, values in zip(self.bounds, controls, strict=True):
            into = speed if bound.kind == "speed" else heading
            into[1:, bound.aircraft] = values / bound.scale
        mean_speed, mean_heading = (0.5 * (values[1:] + values[:-1]) for values in (speed, heading))
        climb = np.broadcast_to([one.climb_mps for one in plan.aircraft], mean_speed.shape)
        moves = np.stack([mean_speed * np.cos(mean_heading), mean_speed * np.sin(mean_heading), climb], axis=2)
        start = np.array([[one.north_m, one.east_m, one.height_m] for one in plan.aircraft])
        flown = np.concatenate([start[None], start + plan.step_s * np.cumsum(moves, axis=0)])
        points = np.array([[one.north_m, one.east_m, one.height_m] for one in plan.points]).reshape(-1, 3)
        still = np.broadcast_to(points, (epochs, *points.shape))
        return Paths(np.concatenate([flown, still], axis=1), speed, heading)

    def by_controls(self, paths: Paths, by_position: FloatArray) -> FloatArray:
        """Convert the derivative by the positions to that by the controls.

        Shapes (epochs, sources, 3) and (controls, steps). What moves an aircraft in step k moves it at every later
        epoch: the derivatives are summed from the end.
        """
        later = np.cumsum(by_position[:0:-1], axis=0)[::-1] * self.plan.step_s
        found = np.zeros(self.shape)
        for row, bound in enumerate(self.bounds):
            heading = paths.heading_rad[:, bound.aircraft]
            middle = 0.5 * (heading[1:] + heading[:-1])
            along = np.column_stack([np.cos(middle), np.sin(middle)])
            by_move = later[:, bound.aircraft, :2]
            if bound.kind == "speed":
                by_mean = np.einsum("ka,ka->k", by_move, along)
            else:
                speed = paths.speed_mps[:, bound.aircraft]
                across = np.column_stack([-along[:, 1], along[:, 0]]) * (0.5 * (speed[1:] + speed[:-1]))[:, None]
                by_mean = np.einsum("ka,ka->k", by_move, across)
            found[row] = 0.5 * by_mean / bound.scale
            found[row, :-1] += 0.5 * by_mean[1:] / bound.scale
        return found


def points_at_starts(plan: SessionPlan, position_m: FloatArray) -> list[Finding]:
    """Tell which points stand where an aircraft starts.

    Ranges count from the end of the first step on: a start on top of a point is no error, and hardly meant.

    Parameters
    ----------
    plan : SessionPlan
    position_m : ndarray, shape (sources, 3)
        At the start: aircraft, then points.
    """
    count, found = len(plan.aircraft), []
    for number, aircraft in enumerate(plan.aircraft):
        away_m = np.linalg.norm(position_m[count:] - position_m[number], axis=1)
        for point, distance in zip(plan.points, away_m.tolist(), strict=True):
            if distance < NEAREST_M:
                text = f"{point.name} stands where {aircraft.name} starts: their ranges count from {plan.step_s:g} s on"
                found.append(Finding("warn", "plan.at_start", text))
    return found
