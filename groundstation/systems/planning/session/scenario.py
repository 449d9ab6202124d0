"""Scenario of a session to be planned: who flies, what is controlled, what is measured.

Controls have bounds.
"""

import math
from dataclasses import field
from typing import Literal

from groundstation.base.dataclasses import dataclass
from groundstation.base.errors import SettingsError
from groundstation.base.toml_settings import check_ranges, number, required_number

Controlled = Literal["speed", "heading"]
Axis = Literal["north", "east", "up", "clock"]
Over = Literal["fixed", "way", "lost"]
LocalCriterion = Literal["determinant", "eigenvalue", "dop"]
Criterion = Literal["determinant", "eigenvalue", "dop", "covariance"]
LOCAL_CRITERIA: tuple[LocalCriterion, ...] = ("determinant", "eigenvalue", "dop")
MOST_AIRCRAFT, MOST_POINTS, MOST_STEPS = 10, 20, 2000
NEAREST_M = 1.0  # a source nearer than this has no direction one could plan with


@dataclass(frozen=True)
class PlannedErrors:
    """Sigmas of one aircraft's own errors: the seven states of the local frame.

    Position and velocity along each horizontal axis, barometric height, offset and frequency of its clock; velocity,
    height and frequency are Gauss-Markov processes.
    """

    position_m: float = number(300.0, 0.0, 1e6)
    velocity_mps: float = number(0.2, 0.0, 1e3)
    velocity_s: float = number(1000.0, 1.0)
    baro_m: float = number(10.0, 0.0, 1e4)
    baro_s: float = number(3600.0, 1.0)
    clock_m: float = number(30.0, 0.0, 1e6)
    clock_mps: float = number(3.0, 0.0, 1e3)
    clock_s: float = number(3600.0, 1.0)

    def __post_init__(self) -> None:
        check_ranges(self)


@dataclass(frozen=True)
class PlannedAircraft:
    """One aircraft: its start, its flight, and what of it may be controlled.

    The start is given north and east of the origin.

    Parameters
    ----------
    name : str
    north_m, east_m, height_m : float
        At the start.
    speed_mps, track_deg, climb_mps : float
        Horizontal speed and track at the start, and throughout where nothing is controlled; rate of climb throughout.
    is_exact : bool
        Its position and clock are known without error, as those of a ground point: it has no states.
    control : tuple of {'speed', 'heading'}
    speed_low_mps, speed_high_mps : float
        Bounds of a controlled speed.
    acceleration_mps2 : float
        Most by which it changes in a second.
    heading_swing_deg : float
        Most by which a controlled heading leaves the track at the start.
    turn_rate_dps : float
        Most by which it changes in a second.
    errors : PlannedErrors
        Unused where the aircraft is exact.
    """

    name: str
    north_m: float = required_number(-1e6, 1e6)
    east_m: float = required_number(-1e6, 1e6)
    height_m: float = number(1000.0, -500.0, 30_000.0)
    speed_mps: float = number(220.0, 1.0, 1000.0)
    track_deg: float = number(0.0, -360.0, 360.0)
    climb_mps: float = number(0.0, -100.0, 100.0)
    is_exact: bool = False
    control: tuple[Controlled, ...] = ()
    speed_low_mps: float = number(1.0, 1.0, 1000.0)
    speed_high_mps: float = number(1000.0, 1.0, 1000.0)
    acceleration_mps2: float = number(2.0, 0.0, 50.0)
    heading_swing_deg: float = number(180.0, 0.0, 720.0)
    turn_rate_dps: float = number(3.0, 0.0, 30.0)
    errors: PlannedErrors = field(default_factory=PlannedErrors)

    def __post_init__(self) -> None:
        check_ranges(self)
        if not self.speed_low_mps <= self.speed_mps <= self.speed_high_mps:
            found = f"{self.speed_mps:g} m/s"
            bounds = f"within speed_low_mps and speed_high_mps, [{self.speed_low_mps:g}, {self.speed_high_mps:g}]"
            raise SettingsError("speed_mps", found, bounds)
        if len(set(self.control)) < len(self.control):
            raise SettingsError("control", "a name given twice", 'some of "speed", "heading"')


@dataclass(frozen=True)
class PlannedPoint:
    """A ground reference point, its position known without error.

    Parameters
    ----------
    name : str
    north_m, east_m, height_m : float
        Where it stands; of one that is to be placed: as given, to compare with and to start from.
    is_placed : bool
        Its place is to be found.
    mirrors : str
        Name of a placed point on the other side of the axis east = 0 that it goes with; empty: none.
    """

    name: str
    north_m: float = required_number(-1e6, 1e6)
    east_m: float = required_number(-1e6, 1e6)
    height_m: float = number(0.0, -500.0, 9000.0)
    is_placed: bool = False
    mirrors: str = ""

    def __post_init__(self) -> None:
        check_ranges(self)
        if self.is_placed and self.mirrors:
            raise SettingsError("mirrors", f"{self.mirrors!r} of a point that is_placed itself", "one of the two")


@dataclass(frozen=True)
class KeepOut:
    """Polygon without ground points: water, the runway strip, a village.

    Corners are north, east in metres.
    """

    name: str
    corners_m: tuple[tuple[float, float], ...]

    def __post_init__(self) -> None:
        if len(self.corners_m) < 3:
            raise SettingsError("corners_m", f"{len(self.corners_m)} corners", "three or more")
        if not all(math.isfinite(value) for corner in self.corners_m for value in corner):
            raise SettingsError("corners_m", "a number that is not finite", "metres north and east")


@dataclass(frozen=True)
class Placement:
    """Places allowed to the points that are to be placed, and the aim of the search.

    Parameters
    ----------
    criterion : {'covariance', 'determinant', 'eigenvalue', 'dop'}
        The local ones look at the geometry of a single place of the judged aircraft, the covariance at the filter along
        its whole way there.
    over : {'fixed', 'way', 'lost'}
        What the recommended design is best for: the fixed point, the worst point of the way, or the fixed point with
        whichever ground point lost costs most (covariance alone).
    fixed_at_s : float
        Time at which the judged aircraft is at the fixed point.
    from_s, to_s : float
        Part of the way of which the worst point counts.
    axes, weight_north, weight_east, weight_up
        As of :class:`Control`.
    low_north_m, high_north_m, low_east_m, high_east_m : float
        Rectangle for the points.
    keep_out : tuple of KeepOut
    overflown_m : float
        A point nearer than this below the way is worth a warning.
    map_side : int
        Places along each side of the map of the last placed point.
    starts, seed, iterations, tolerance
        Random starts besides the places given; of each descent: at most so many iterations, and the first-order gain
        left within a hundredth of the rectangle, over the loss.
    """

    criterion: Criterion = "covariance"
    over: Over = "fixed"
    fixed_at_s: float = number(0.0, 0.0, 1e5)
    from_s: float = number(0.0, 0.0, 1e5)
    to_s: float = number(1e5, 0.0, 1e5)
    axes: tuple[Axis, ...] = ("north", "east", "up")
    weight_north: float = number(1.0, 0.0, 1e6)
    weight_east: float = number(1.0, 0.0, 1e6)
    weight_up: float = number(1.0, 0.0, 1e6)
    low_north_m: float = number(-5000.0, -1e6, 1e6)
    high_north_m: float = number(5000.0, -1e6, 1e6)
    low_east_m: float = number(-5000.0, -1e6, 1e6)
    high_east_m: float = number(5000.0, -1e6, 1e6)
    keep_out: tuple[KeepOut, ...] = ()
    overflown_m: float = number(100.0, 0.0, 1e4)
    map_side: int = number(31, 2, 201)
    starts: int = number(4, 0, 100)
    seed: int = number(1, 0)
    iterations: int = number(100, 1, 10_000)
    tolerance: float = number(1e-4, 1e-12, 0.1)

    def __post_init__(self) -> None:
        check_ranges(self)
        check_criterion(self.axes, (self.weight_north, self.weight_east, self.weight_up))
        for axis in ("north", "east"):
            low, high = getattr(self, f"low_{axis}_m"), getattr(self, f"high_{axis}_m")
            if low > high:
                raise SettingsError(f"low_{axis}_m", f"{low:g} m", f"at most high_{axis}_m, {high:g} m")
        if self.over == "lost" and self.criterion != "covariance":
            raise SettingsError("over", f'"lost" with {self.criterion}', 'criterion = "covariance"')
        if self.from_s > self.to_s:
            raise SettingsError("from_s", f"{self.from_s:g} s", f"at most to_s, {self.to_s:g} s")


@dataclass(frozen=True)
class Ranging:
    """Ranges to every source: sigma, time between them, correlation time of their error.

    Each step of the plan uses what the ranges in it tell together: variance sigma^2 max(interval_s, 2 correlation_s) /
    step_s. For a correlated error that is the limit of a step much longer than the correlation. One-way ranges contain
    the difference of the two clocks.
    """

    sigma_m: float = number(10.0, 1e-3, 1e5)
    interval_s: float = number(1.0, 1e-3, 600.0)
    correlation_s: float = number(0.0, 0.0, 600.0)
    is_two_way: bool = False

    def __post_init__(self) -> None:
        check_ranges(self)

    def variance_m2(self, step_s: float) -> float:
        """Variance of what the ranges of a step tell together.

        Examples
        --------
        >>> Ranging(3.0, 0.01).variance_m2(1.0), Ranging(3.0, 0.01, correlation_s=1.0).variance_m2(1.0)
        (0.09, 18.0)
        """
        return self.sigma_m**2 * max(self.interval_s, 2.0 * self.correlation_s) / step_s


@dataclass(frozen=True)
class Control:
    """Search for laws of control, and the choice of the recommended one.

    Parameters
    ----------
    criterion : {'covariance', 'determinant', 'eigenvalue', 'dop'}
        ``covariance``: least weighted variance at the end (integral criterion); the others are best at each step.
    axes : tuple of {'north', 'east', 'up', 'clock'}
        Columns of H in determinant, eigenvalue and dilution.
    weight_north, weight_east, weight_up : float
        Theta, the weights of the variances of the judged aircraft.
    starts : int
        Random starts of the integral criterion, besides those of no control and of the local laws.
    seed : int
    iterations, tolerance
        Of each descent: at most so many; the largest first-order gain left, over the loss.
    """

    criterion: Criterion = "covariance"
    axes: tuple[Axis, ...] = ("north", "east")
    weight_north: float = number(1.0, 0.0, 1e6)
    weight_east: float = number(1.0, 0.0, 1e6)
    weight_up: float = number(0.0, 0.0, 1e6)
    starts: int = number(4, 0, 100)
    seed: int = number(1, 0)
    iterations: int = number(200, 1, 10_000)
    tolerance: float = number(1e-3, 1e-12, 0.1)

    def __post_init__(self) -> None:
        check_ranges(self)
        check_criterion(self.axes, (self.weight_north, self.weight_east, self.weight_up))


def check_criterion(axes: tuple[Axis, ...], weights: tuple[float, ...]) -> None:
    """Refuse a criterion without axes, with an axis twice, or with all weights zero."""
    if not axes or len(set(axes)) < len(axes):
        raise SettingsError("axes", "none, or one given twice", 'some of "north", "east", "up", "clock"')
    if sum(weights) <= 0.0:
        raise SettingsError("weight_north", "weights that are all zero", "at least one above zero")


@dataclass(frozen=True)
class SessionPlan:
    """A session to be planned.

    Parameters
    ----------
    title : str
    aircraft : tuple of PlannedAircraft
    points : tuple of PlannedPoint
    judged : str
        Name of the aircraft whose accuracy counts; empty: the first.
    duration_s, step_s : float
    ranging : Ranging
    control : Control
    placement : Placement
        Counts where a point ``is_placed``.
    separation_m : float
        Laws of control keep aircraft so far apart from each other; where they cannot it is a warning. 0: no matter.
    """

    title: str
    aircraft: tuple[PlannedAircraft, ...]
    points: tuple[PlannedPoint, ...] = ()
    judged: str = ""
    duration_s: float = number(40.0, 0.1, 100_000.0)
    step_s: float = number(1.0, 0.01, 600.0)
    separation_m: float = number(300.0, 0.0, 1e5)
    ranging: Ranging = field(default_factory=Ranging)
    control: Control = field(default_factory=Control)
    placement: Placement = field(default_factory=Placement)
    notes: str = ""

    def __post_init__(self) -> None:
        check_ranges(self)
        if not 1 <= len(self.aircraft) <= MOST_AIRCRAFT or len(self.points) > MOST_POINTS:
            found = f"{len(self.aircraft)} aircraft and {len(self.points)} points"
            raise SettingsError("aircraft", found, f"1 to {MOST_AIRCRAFT} aircraft, 0 to {MOST_POINTS} points")
        names = [*(one.name for one in self.aircraft), *(point.name for point in self.points)]
        if len(set(names)) < len(names) or "" in names:
            raise SettingsError("aircraft", "a name that is empty or given twice", "one for each aircraft and point")
        if not 1 <= self.steps <= MOST_STEPS or abs(self.steps * self.step_s - self.duration_s) > 1e-6:
            expected = f"1 to {MOST_STEPS} whole steps of {self.step_s:g} s"
            raise SettingsError("duration_s", f"{self.duration_s:g} s", expected)
        if self.judged and self.judged not in [one.name for one in self.aircraft]:
            raise SettingsError("judged", repr(self.judged), "the name of an aircraft")
        if self.user.is_exact:
            raise SettingsError("judged", f"{self.user.name}, which is exact", "an aircraft with errors")
        if len(names) < 2:
            raise SettingsError("points", "nothing to range to", "a point or a second aircraft")
        placed = {point.name for point in self.points if point.is_placed}
        for point in self.points:
            if point.mirrors and point.mirrors not in placed:
                raise SettingsError("points", f"{point.name} mirrors {point.mirrors!r}", "the name of a placed point")
        if placed and not self.step_s <= self.placement.fixed_at_s <= self.duration_s:
            expected = f"within [{self.step_s:g}, {self.duration_s:g}] s, the interval"
            raise SettingsError("placement.fixed_at_s", f"{self.placement.fixed_at_s:g} s", expected)
        if placed and self.placement.from_s > self.duration_s:
            raise SettingsError("placement.from_s", f"{self.placement.from_s:g} s", f"at most {self.duration_s:g} s")

    @property
    def steps(self) -> int:
        """Number of steps."""
        return round(self.duration_s / self.step_s)

    @property
    def user(self) -> PlannedAircraft:
        """The aircraft whose accuracy counts."""
        return next((one for one in self.aircraft if one.name == self.judged), self.aircraft[0])
