"""Knowledge of a flight besides its tables.

It holds aircraft, airfield, the user's intervals and earlier answers.
"""

from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import field
from itertools import pairwise
from typing import TYPE_CHECKING, Any, Literal, TypeVar

from groundstation.base.dataclasses import dataclass
from groundstation.base.errors import GroundstationError, SettingsError
from groundstation.base.timescales import iso_to_utc_ns
from groundstation.base.toml_settings import check_ranges, number, required_number
from groundstation.results.answer import A, Answers, answer_meeting, answer_of
from groundstation.results.chosen import Interval
from groundstation.results.installations import Lesson
from groundstation.tables.phases import Phases
from groundstation.tables.vehicle import VehicleKind

if TYPE_CHECKING:
    from groundstation.base.runways.table import RunwayTable
    from groundstation.tables.session_assemble import Truth

S = TypeVar("S")
AircraftClass = Literal["", "light", "jet trainer", "business jet", "airliner", "car", "uav"]
LEAST_ENTRY_STEP_DEG = 1e-6  # the places an answer is shown with


@dataclass(frozen=True)
class AircraftData:
    """Knowledge of the aircraft.

    Parameters
    ----------
    antenna_arm_m, antenna_arm_sigma_m : float or None
        GNSS antenna ahead of the middle of the main-gear axle (the point that does not slip sideways), and its sigma;
        None where unknown: it is then estimated, or its possible effect widens the interval.
    entry_step_deg : float
        Step in which the operator can enter the correction.
    mounting_deg : float
        Heading of the INS case minus heading of the airframe, known.
    mounting_sigma_deg : float or None
        What remains uncertain of it; None: the settings' figure. It widens the interval of the platform's number alone.
    sideslip_sigma_deg : float or None
        Sigma of the steady sideslip that a crosswind makes on taxi, at 10 m/s where the wind is known; None: that of
        the class in the wind.
    steady_sideslip_sigma_deg : float or None
        Sigma of sideslip that is the same in every direction; None: the settings' figure.
    taxi_power : str
        ``uneven``: it taxis on some of its engines, or against a brake that drags; ``even``; empty: not stated.
    aircraft_class : str
        How far a crosswind pushes its nose off the path on taxi: ``light``, ``jet trainer``, ``business jet``,
        ``airliner``, ``car`` or ``uav``; empty: not known, with a sigma that holds them all.
    gnss_latency_s, gnss_latency_sigma_s : float or None
        How much later GNSS velocities are logged than the INS shows the same motion, known; None: estimated.
    ins_class : str
        Class of its INS: noise of system 2, prior of the azimuth drift.
    ins_kind : str
        Whether GNSS corrects the INS already, ``gnss_aided`` or ``unaided``; empty: the log shows it.
    ins_serial, ins_alignment : str
        Which unit is installed and how it is aligned ("gyrocompass", "stored heading"): by them earlier flights
        teach how the unit sits, and the acceptance groups flights.
    nav_start_utc : str
        When the INS began to navigate, ISO 8601, where the log does not show it; it may lie before the log.
    imu_mounting_deg : three floats or None
        Roll, pitch and yaw of the case of the inertial unit in the airframe: the attitude that the case has while the
        airframe is level and points north. None: as the log tells or its motion shows.
    compass_deviation_deg : five floats or None
        A to E of the deviation, which is added to the compass heading c for the magnetic one: A + B sin c + C cos c +
        D sin 2c + E cos 2c. None: not stated.
    compass_sigma_deg : float
        Sigma of the magnetic heading so corrected; its error lasts.
    vehicle : str
        ``rolls``, ``flies``, ``walks`` or ``floats``; empty: as the log says or shows. What rolls is always on the
        ground: nothing need prove it.
    always_on_ground : bool
        True: it is always on the ground, as what rolls is.
    """

    antenna_arm_m: float | None = number(None, -50.0, 50.0)
    antenna_arm_sigma_m: float = number(0.05, 0.0)
    entry_step_deg: float = number(0.1, LEAST_ENTRY_STEP_DEG, 10.0)
    mounting_deg: float = number(0.0, -10.0, 10.0)
    mounting_sigma_deg: float | None = number(None, 0.0)
    sideslip_sigma_deg: float | None = number(None, 0.0)
    steady_sideslip_sigma_deg: float | None = number(None, 0.0)
    taxi_power: Literal["", "even", "uneven"] = ""
    aircraft_class: AircraftClass = ""
    gnss_latency_s: float | None = number(None, -10.0, 10.0)
    gnss_latency_sigma_s: float = number(0.01, 0.0, 10.0)
    ins_class: str = ""
    ins_kind: Literal["", "unaided", "gnss_aided"] = ""
    ins_serial: str = ""
    ins_alignment: str = ""
    nav_start_utc: str = ""
    imu_mounting_deg: tuple[float, float, float] | None = number(None, -360.0, 360.0)
    compass_deviation_deg: tuple[float, float, float, float, float] | None = number(None, -180.0, 180.0)
    compass_sigma_deg: float = number(3.0, 0.1, 45.0)
    vehicle: Literal["", VehicleKind] = ""
    always_on_ground: bool = False

    def __post_init__(self) -> None:
        check_ranges(self)
        if self.always_on_ground and self.vehicle not in ("", "rolls"):
            raise SettingsError("always_on_ground", "true", f"false, or no vehicle = {self.vehicle!r} beside it")
        if self.nav_start_utc:
            try:
                iso_to_utc_ns(self.nav_start_utc)
            except GroundstationError as error:
                expected = "ISO 8601 such as 2026-05-04T06:00:00Z"
                raise SettingsError("nav_start_utc", repr(self.nav_start_utc), expected) from error

    @property
    def stated_vehicle(self) -> Literal["", VehicleKind]:
        """Kind of vehicle that the aircraft file states, empty where it states none."""
        return "rolls" if self.always_on_ground else self.vehicle


@dataclass(frozen=True)
class Stand:
    """Parking stand with a reference heading (theodolite) and its sigma."""

    name: str
    heading_deg: float = required_number(0.0, 360.0)
    sigma_deg: float = number(0.05, 0.0)

    def __post_init__(self) -> None:
        check_ranges(self)


@dataclass(frozen=True)
class Ground:
    """Height of the ground on the extended centre line, above that of the threshold."""

    before_threshold_m: float = required_number(-10_000.0, 100_000.0)
    height_m: float = required_number(-5_000.0, 5_000.0)

    def __post_init__(self) -> None:
        check_ranges(self)


@dataclass(frozen=True)
class Runway:
    """Runway with true bearing, position of its threshold and approach aids.

    The bearing is that in the direction of take-off. ``localizer_width_m`` is the full width of the course sector at
    the threshold, ``localizer_distance_m`` from the threshold to its antenna behind the far end. ``ground`` is the
    profile under the approach, straight between its places; none: level.
    """

    name: str
    true_bearing_deg: float = required_number(0.0, 360.0)
    sigma_deg: float = number(0.05, 0.0)
    latitude_deg: float | None = number(None, -90.0, 90.0)
    longitude_deg: float | None = number(None, -180.0, 180.0)
    glide_angle_deg: float = number(3.0, 1.0, 10.0)
    threshold_crossing_height_m: float = number(15.0, 0.0, 100.0)
    elevation_m: float | None = number(None, -500.0, 6_000.0)  # of the threshold, above mean sea level
    length_m: float | None = number(None, 50.0, 10_000.0)
    width_m: float | None = number(None, 1.0, 200.0)
    localizer_width_m: float | None = number(None, 10.0, 1_000.0)
    localizer_distance_m: float | None = number(None, 500.0, 10_000.0)
    ground: tuple[Ground, ...] = ()

    def __post_init__(self) -> None:
        check_ranges(self)
        places = [one.before_threshold_m for one in self.ground]
        if len(places) == 1 or any(one >= other for one, other in pairwise(places)):
            raise SettingsError(
                "ground", f"{len(places)} places", "two or more, by growing distance before_threshold_m"
            )
        if (self.latitude_deg is None) != (self.longitude_deg is None):
            missing, other = "latitude_deg", "longitude_deg"
            if self.longitude_deg is None:
                missing, other = other, missing
            raise SettingsError(missing, "nothing", f"a value, as {other} has one, or neither")


@dataclass(frozen=True)
class Beacon:
    """A non-directional beacon by its place from the threshold of a runway.

    Where no runway is named it is the only one.
    """

    name: str
    before_threshold_m: float = required_number(-20_000.0, 100_000.0)
    right_m: float = number(0.0, -50_000.0, 50_000.0)
    runway: str = ""

    def __post_init__(self) -> None:
        check_ranges(self)


@dataclass(frozen=True)
class SiteData:
    """Knowledge of the airfield; ``stand`` names the stand the aircraft was parked on.

    ``station`` is the field's four letters in METAR lines: the wind is then taken from its lines alone.
    """

    stands: tuple[Stand, ...] = ()
    runways: tuple[Runway, ...] = ()
    stand: str = ""
    beacons: tuple[Beacon, ...] = ()
    station: str = ""

    def __post_init__(self) -> None:
        for key, listed in (("stands", self.stands), ("runways", self.runways), ("beacons", self.beacons)):
            twice = [name for name, count in Counter(item.name for item in listed).items() if count > 1]
            if twice:
                raise SettingsError(key, f"{twice[0]!r} more than once", "names that differ")
        names = [stand.name for stand in self.stands]
        if self.stand and self.stand not in names:
            expected = f"one of {', '.join(names)}" if names else "a stand listed under [[stands]]: there is none"
            raise SettingsError("stand", repr(self.stand), expected)
        runways = {runway.name for runway in self.runways}
        lost = [beacon for beacon in self.beacons if beacon.runway and beacon.runway not in runways]
        if lost:
            raise SettingsError("beacons", f"{lost[0].name!r} of runway {lost[0].runway!r}", "a runway of [[runways]]")

    def parked_on(self) -> Stand | None:
        """The named stand; the only one where none is named; else None."""
        if self.stand:
            return next((stand for stand in self.stands if stand.name == self.stand), None)
        return self.stands[0] if len(self.stands) == 1 else None


def no_runways() -> tuple["RunwayTable | None", str]:
    """Return no runways of the world: they are not looked up."""
    return None, ""


@dataclass(frozen=True)
class Known:
    """Inputs of an analysis besides the tables of a flight.

    Parameters
    ----------
    phases : Phases
        Flight phases, read off the tables once.
    aircraft : AircraftData
    site : SiteData
    intervals : tuple of Interval
        Parts of the flight that the user excludes or forces.
    weather : tuple of str
        METAR lines of the day, of one field or several.
    intervals_problem : SettingsError, optional
        Why the user's intervals have no place on this flight, which then has none.
    settings : mapping
        Settings by the name of their table: an analysis that works with another's method takes that one's settings.
    answers : mapping
        Answers of the analyses before this one.
    workings : mapping
        What an earlier analysis computed on the way, by its name; it is not saved.
    lessons : tuple of Lesson, optional
        What earlier flights say of installations, where the user gives a file of them.
    roles : mapping of role to callable
        What the analyses offer to each other, whether they gave an answer or not: ``roles[kind](known)`` makes it.
    find_runways : callable
        Gives the runways of the world, below those of ``site``, and why the user's own table is not that one. It reads
        them, so it is asked by those that need them; by default there are none.
    """

    phases: Phases
    aircraft: AircraftData = AircraftData()
    site: SiteData = SiteData()
    intervals: tuple[Interval, ...] = ()
    weather: tuple[str, ...] = ()
    intervals_problem: SettingsError | None = None
    settings: Mapping[str, Any] = field(default_factory=dict)
    answers: Answers = field(default_factory=dict)
    workings: Mapping[str, Any] = field(default_factory=dict)
    lessons: tuple[Lesson, ...] | None = None
    roles: Mapping[type[Any], Callable[["Known"], Any]] = field(default_factory=dict)
    find_runways: Callable[[], tuple["RunwayTable | None", str]] = no_runways

    @property
    def runways(self) -> "RunwayTable | None":
        """Runways of the world; None: not looked up."""
        return self.find_runways()[0]

    @property
    def runways_problem(self) -> str:
        """Reason why the user's own table of runways is not used, else empty."""
        return self.find_runways()[1]

    @property
    def excluded_s(self) -> tuple[tuple[float, float], ...]:
        """Flight seconds that the user excludes."""
        return tuple((part.start_s, part.end_s) for part in self.intervals if part.use == "exclude")

    def answer(self, kind: type[A]) -> A | None:
        """The answer of that type, None where there is none."""
        return answer_of(self.answers, kind)

    def answer_meeting(self, role: type[S]) -> S | None:
        """The answer that plays a role of :mod:`groundstation.results.roles`, else None."""
        return answer_meeting(self.answers, role)

    def settings_of(self, kind: type[S]) -> S:
        """The settings of that type, the shipped ones where the user set none."""
        return next((found for found in self.settings.values() if isinstance(found, kind)), None) or kind()

    def role(self, kind: type[S]) -> S | None:
        """Return what an analysis offers under a type, None where none does.

        The types stand in :mod:`groundstation.methods.roles`.
        """
        make = self.roles.get(kind)
        return None if make is None else make(self)

    def workings_of(self, kind: type[S]) -> S | None:
        """Return what an earlier analysis computed on the way, None where there is none."""
        return next((found for found in self.workings.values() if isinstance(found, kind)), None)


@dataclass(frozen=True)
class SessionKnown:
    """Inputs of an analysis of a session besides the session itself.

    Parameters
    ----------
    truth : mapping of vehicle to (time_s, position_m)
        Only judges.
    settings : mapping
        Settings by the name of their table.
    answers, workings : mappings
        Of the analyses before this one.
    """

    truth: "Truth" = field(default_factory=dict)
    settings: Mapping[str, Any] = field(default_factory=dict)
    answers: Answers = field(default_factory=dict)
    workings: Mapping[str, Any] = field(default_factory=dict)
