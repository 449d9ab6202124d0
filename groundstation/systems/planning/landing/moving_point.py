"""Flight of the moving reference point, steered in speed for the best range geometry.

Local criterion: at every step the speed, within reach of the acceleration, whose place at the end of the step gives the
largest measure of observability det(H'H), where a row of H is the direction to a point and 1 for the clock.
"""

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.dataclasses import dataclass
from groundstation.base.records import frozen
from groundstation.systems.planning.landing.scenario import RangeApproach

CONTROL_STEP_S = 0.5
CHOICES = 21


@dataclass(frozen=True)
class MovingTrack:
    """Flight of the moving point at the times of the measurements: places (n, 3), speed (n,)."""

    place_m: FloatArray
    speed_mps: FloatArray

    def __post_init__(self) -> None:
        for name in ("place_m", "speed_mps"):
            object.__setattr__(self, name, frozen(getattr(self, name)))


def directions(place_m: FloatArray, points_m: FloatArray) -> FloatArray:
    """Unit vectors from points (..., k, 3) to places (..., 3), shape (..., k, 3)."""
    line = place_m[..., None, :] - points_m
    return np.asarray(line / np.linalg.norm(line, axis=-1, keepdims=True))


def measure(place_m: FloatArray, points_m: FloatArray) -> FloatArray:
    """det(H'H) of three coordinates and a clock, shape (...); less than four points give 0.

    Examples
    --------
    >>> corners = np.array([[1.0, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]])  # a regular tetrahedron: (4/3)^3 4
    >>> measure(np.zeros(3), corners).round(3).item()
    9.481
    """
    unit = directions(place_m, points_m)
    H = np.concatenate([unit, np.ones((*unit.shape[:-1], 1))], axis=-1)
    return np.asarray(np.linalg.det(np.swapaxes(H, -1, -2) @ H))


def fly_moving_point(scenario: RangeApproach) -> MovingTrack | None:
    """Flight of the scenario's moving point, None without one.

    Speeds change linearly between control steps, so the place is exact at the measurements.
    """
    moving, time_s = scenario.moving, scenario.time_s
    if moving is None:
        return None
    knots_s = np.arange(0.0, time_s[-1] + CONTROL_STEP_S, CONTROL_STEP_S)
    true_m = scenario.path.at(scenario.path.speed_mps * knots_s - scenario.path.start_m)
    speed, along = np.empty(len(knots_s)), np.empty(len(knots_s))
    speed[0], along[0] = moving.speed_mps, -scenario.path.start_m - moving.behind_m
    reach = moving.acceleration_mps2 * CONTROL_STEP_S * np.linspace(-1.0, 1.0, CHOICES)
    for k in range(1, len(knots_s)):
        chosen = speed[k - 1]
        if moving.control == "determinant":
            speeds = np.clip(speed[k - 1] + reach, moving.slowest_mps, moving.fastest_mps)
            ends = along[k - 1] + 0.5 * (speed[k - 1] + speeds) * CONTROL_STEP_S
            chosen = speeds[int(np.argmax(_measures(scenario, true_m[k], ends, moving.height_m)))]
        speed[k] = chosen
        along[k] = along[k - 1] + 0.5 * (speed[k - 1] + chosen) * CONTROL_STEP_S
    since = time_s - knots_s[knot := np.minimum((time_s / CONTROL_STEP_S).astype(int), len(knots_s) - 2)]
    slope = (speed[knot + 1] - speed[knot]) / CONTROL_STEP_S
    place = np.zeros((len(time_s), 3))
    place[:, 0] = along[knot] + speed[knot] * since + 0.5 * slope * since**2
    place[:, 2] = moving.height_m
    return MovingTrack(place, speed[knot] + slope * since)


def _measures(scenario: RangeApproach, place_m: FloatArray, ends_m: FloatArray, height_m: float) -> FloatArray:
    """Measure for each place of the moving point, shape (c,)."""
    ground = scenario.point_places_m
    points = np.empty((len(ends_m), len(ground) + 1, 3))
    points[:, :-1] = ground
    points[:, -1] = np.column_stack([ends_m, np.zeros_like(ends_m), np.full_like(ends_m, height_m)])
    return measure(np.broadcast_to(place_m, (len(ends_m), 3)), points)
