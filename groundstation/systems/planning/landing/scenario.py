"""Scenario of an approach by ranges, as frozen dataclasses.

It states path, reference points, noise, and the errors of the aircraft itself. Frame of the runway: along (in the
direction of landing), right and up from the middle of the threshold, metres. A place before the threshold has a
negative along; the scenario states distances before the threshold as positive numbers.
"""

from dataclasses import field
from typing import Literal

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.dataclasses import dataclass
from groundstation.base.errors import SettingsError
from groundstation.base.records import frozen
from groundstation.base.toml_settings import check_ranges, number, required_number

LEAST_CLEARANCE_M = 1.0  # between the path and a reference point: nearer, the aircraft flies through its aerial
MOST_EPOCHS = 200_000


@dataclass(frozen=True)
class StraightPath:
    """Glide path flown exactly, at constant speed, from the outer locator to the ground.

    Parameters
    ----------
    start_m : float
        Distance before the threshold at which it begins.
    glide_angle_deg, threshold_height_m, speed_mps : float
    runway_length_m, runway_width_m : float
    """

    start_m: float = number(4000.0, 100.0, 30_000.0)
    glide_angle_deg: float = number(3.0, 1.0, 10.0)
    threshold_height_m: float = number(15.0, 1.0, 100.0)
    speed_mps: float = number(70.0, 10.0, 200.0)
    runway_length_m: float = number(2500.0, 100.0, 6000.0)
    runway_width_m: float = number(45.0, 5.0, 200.0)

    def __post_init__(self) -> None:
        check_ranges(self)
        if self.touchdown_m >= self.runway_length_m:
            found = f"{self.runway_length_m:g} m, touchdown at {self.touchdown_m:.0f} m"
            raise SettingsError("runway_length_m", found, "a runway that the glide path meets")

    @property
    def touchdown_m(self) -> float:
        """Distance beyond the threshold at which the path meets the ground."""
        return self.threshold_height_m / float(np.tan(np.deg2rad(self.glide_angle_deg)))

    @property
    def duration_s(self) -> float:
        """Time from the start to the ground; the speed is that over the ground."""
        return (self.start_m + self.touchdown_m) / self.speed_mps

    def at(self, along_m: FloatArray) -> FloatArray:
        """Places on the path, shape (n, 3), of their along coordinate."""
        up = (self.touchdown_m - along_m) * np.tan(np.deg2rad(self.glide_angle_deg))
        return np.column_stack([along_m, np.zeros_like(along_m), up])


@dataclass(frozen=True)
class ReferencePoint:
    """A reference point on the ground, its place known exactly."""

    name: str
    before_threshold_m: float = required_number(-10_000.0, 30_000.0)
    right_m: float = required_number(-20_000.0, 20_000.0)
    up_m: float = number(0.0, -500.0, 2000.0)

    @property
    def place_m(self) -> tuple[float, float, float]:
        """Along, right, up."""
        return -self.before_threshold_m, self.right_m, self.up_m


@dataclass(frozen=True)
class MovingPoint:
    """An aircraft in the course plane that sends ranges and its own position.

    The errors of that position are states of the filter.

    Parameters
    ----------
    behind_m : float
        Behind the landing aircraft at the start.
    height_m : float
        Above the threshold, kept.
    height_sigma_m, position_sigma_m, error_s : float
        Its reported position errs by Gauss-Markov processes: height; along and right; correlation time.
    control : {'determinant', 'none'}
        Whether its speed is steered so that det(H'H) is largest, or kept at ``speed_mps``.
    speed_mps, slowest_mps, fastest_mps, acceleration_mps2 : float
        Speed at the start, its bounds and how fast it may change.
    """

    behind_m: float = number(300.0, -20_000.0, 20_000.0)
    height_m: float = number(600.0, 10.0, 10_000.0)
    height_sigma_m: float = number(10.0, 0.0, 1000.0)
    position_sigma_m: float = number(10.0, 0.0, 1000.0)
    error_s: float = number(300.0, 1.0, 1e6)
    control: Literal["determinant", "none"] = "determinant"
    speed_mps: float = number(70.0, 0.0, 300.0)
    slowest_mps: float = number(50.0, 0.0, 300.0)
    fastest_mps: float = number(120.0, 0.0, 300.0)
    acceleration_mps2: float = number(2.0, 0.01, 10.0)

    def __post_init__(self) -> None:
        check_ranges(self)
        if not self.slowest_mps <= self.speed_mps <= self.fastest_mps:
            raise SettingsError(
                "speed_mps", f"{self.speed_mps:g}", f"within [{self.slowest_mps:g}, {self.fastest_mps:g}], its bounds"
            )


@dataclass(frozen=True)
class RangeNoise:
    """Errors of a range: white noise, and a Gauss-Markov process of each point."""

    interval_s: float = number(0.01, 0.001, 10.0)
    white_m: float = number(3.0, 0.01, 1000.0)
    correlated_m: float = number(0.0, 0.0, 1000.0)
    correlation_s: float = number(5.0, 0.01, 10_000.0)

    def __post_init__(self) -> None:
        check_ranges(self)


@dataclass(frozen=True)
class OwnErrors:
    """Errors of the aircraft at the start of the approach: INS, barometric height and clock.

    Position and velocity of the INS along and right; velocity, height and clock rate are Gauss-Markov processes.
    """

    position_m: float = number(100.0, 0.01, 1e5)
    velocity_mps: float = number(0.5, 0.0, 100.0)
    velocity_s: float = number(1000.0, 1.0, 1e6)
    baro_m: float = number(50.0, 0.01, 1e4)
    baro_s: float = number(3600.0, 1.0, 1e6)
    clock_m: float = number(1000.0, 0.01, 1e7)
    clock_mps: float = number(10.0, 0.0, 1e5)
    clock_s: float = number(3600.0, 0.1, 1e6)

    def __post_init__(self) -> None:
        check_ranges(self)


@dataclass(frozen=True)
class RangeApproach:
    """One approach by ranges.

    Parameters
    ----------
    title : str
    points : tuple of ReferencePoint
    moving : MovingPoint, optional
    trials, seed : int
        Simulated approaches that judge the filter, and their seed.
    """

    title: str = ""
    path: StraightPath = field(default_factory=StraightPath)
    points: tuple[ReferencePoint, ...] = ()
    moving: MovingPoint | None = None
    noise: RangeNoise = field(default_factory=RangeNoise)
    own: OwnErrors = field(default_factory=OwnErrors)
    trials: int = number(10, 0, 1000)
    seed: int = number(1, 0)

    def __post_init__(self) -> None:
        check_ranges(self)
        if not self.points:
            raise SettingsError("points", "none", "one ground point or more")
        names = [point.name for point in self.points]
        if len(set(names)) < len(names):
            raise SettingsError("points", "a name given twice", "one name for each point")
        if self.path.duration_s / self.noise.interval_s > MOST_EPOCHS:
            found = f"{self.noise.interval_s:g} s over {self.path.duration_s:.0f} s"
            raise SettingsError("noise.interval_s", found, f"no more than {MOST_EPOCHS} measurements of a point")
        along_m = np.linspace(-self.path.start_m, self.path.touchdown_m, 4096)
        for point in self.points:
            reach = np.linalg.norm(self.path.at(along_m) - point.place_m, axis=1)
            if reach.min() < LEAST_CLEARANCE_M:
                found = f"{point.name} {reach.min():.1f} m from the path"
                raise SettingsError("points", found, f"points at least {LEAST_CLEARANCE_M:g} m off the path")

    @property
    def time_s(self) -> FloatArray:
        """Times of the measurements from the start of the approach.

        The last is at touchdown or just before.
        """
        steps = int(self.path.duration_s / self.noise.interval_s + 1e-9)
        return frozen(self.noise.interval_s * np.arange(steps + 1))

    @property
    def places_m(self) -> FloatArray:
        """True places of the aircraft at those times, shape (n, 3)."""
        return frozen(self.path.at(self.path.speed_mps * self.time_s - self.path.start_m))

    @property
    def point_places_m(self) -> FloatArray:
        """Places of the ground points, shape (k, 3)."""
        return frozen(np.array([point.place_m for point in self.points], dtype=np.float64))
