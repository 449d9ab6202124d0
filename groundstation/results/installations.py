"""File of installations: how each INS sits in its aircraft, and the heading errors by it."""

import json
from dataclasses import field
from pathlib import Path
from typing import ClassVar

from groundstation.base.dataclasses import dataclass
from groundstation.base.errors import SettingsError
from groundstation.base.serial import MismatchError, from_json, to_json
from groundstation.results.roles import IntervalPart

INSTALLATIONS = "installations.json"
FORMAT_VERSION = 1
METHOD_VERSION = 1  # version of the model: with another one every learned answer is made again
NAMED_PROBABILITY = 0.5  # of a change, or an odd flight, above which it is named
POOLED = ("compass_a_deg", "antenna_arm_m", "gnss_latency_s")  # figures of other sensors that stay as they are


@dataclass(frozen=True)
class Measured:
    """Figure of a sensor that one flight measured, and its sigma.

    Its unit ends its name.
    """

    name: str = field(metadata={"one_of": POOLED})
    value: float
    sigma: float


@dataclass(frozen=True)
class Lesson:
    """Contribution of one flight to the knowledge of its installation: stored numbers alone.

    Parameters
    ----------
    flight_id, aircraft, ins_serial, start_utc
        ``start_utc`` is ISO 8601; empty where the log has no UTC.
    not_taught : str
        Why the flight teaches nothing; empty where it teaches.
    number_deg : float, optional
        Heading error as the taxi shows it, the sideslip of the wind not taken off: alignment error + mounting + steady
        sideslip + factor x crosswind. None without a taxi.
    taxi_sigma_deg : float
        By this taxi alone.
    crosswind_mps, crosswind_sigma_mps : float
        Wind that pushes the nose to the right of the path (from the right), as the samples weigh it.
    alignment, alignment_sigma_deg
        Kind of alignment as stated, and the sigma of the heading error that it leaves.
    azimuth_deg, azimuth_sigma_deg : float, optional
        Azimuth error of the INS from the turns of the flight, at the time of the taxi.
    reference_deg, reference_sigma_deg : float, optional
        Heading error of the INS against a theodolite at the stand or a runway: mounting in it, sideslip not.
    aircraft_class : str
    factor, factor_sigma, steady_sigma_deg, mounting_deg, mounting_sigma_deg : float
        Prior of the crosswind factor (deg per m/s), the sideslip that is the same in every direction, the mounting.
    verdict, failed
        Verdict of this taxi alone, and the required gates that failed or were not measured.
    error_deg, half_width_deg, platform_error_deg
        Errors and half width of this taxi alone.
    limit_deg : float, optional
        Limit of the whole half width; None where it does not decide.
    entry_step_deg : float
    measured : tuple of Measured
        Figures that the flight measured of the compass, the antenna and GNSS.
    """

    flight_id: str
    aircraft: str
    ins_serial: str
    start_utc: str
    not_taught: str = ""
    number_deg: float | None = None
    taxi_sigma_deg: float = 0.0
    crosswind_mps: float = 0.0
    crosswind_sigma_mps: float = 0.0
    alignment: str = ""
    alignment_sigma_deg: float = 0.0
    azimuth_deg: float | None = None
    azimuth_sigma_deg: float | None = None
    reference_deg: float | None = None
    reference_sigma_deg: float | None = None
    aircraft_class: str = ""
    factor: float = 0.0
    factor_sigma: float = 0.0
    steady_sigma_deg: float = 0.0
    mounting_deg: float = 0.0
    mounting_sigma_deg: float = 0.0
    verdict: str = ""
    failed: tuple[str, ...] = ()
    error_deg: float | None = None
    half_width_deg: float = 0.0
    platform_error_deg: float | None = None
    limit_deg: float | None = None
    entry_step_deg: float = 0.1
    measured: tuple[Measured, ...] = ()

    @property
    def teaches(self) -> bool:
        """Tell whether later flights learn from it."""
        return not self.not_taught

    @property
    def place(self) -> tuple[str, str]:
        """Key that orders flights by time."""
        return self.start_utc.removesuffix("Z"), self.flight_id

    @property
    def prior(self) -> tuple[float, ...]:
        """Knowledge before the first flight: factor, steady sideslip, mounting, with sigmas."""
        return (self.factor, self.factor_sigma, self.steady_sigma_deg, self.mounting_deg, self.mounting_sigma_deg)


@dataclass(frozen=True)
class Installed:
    """Posterior of an installation.

    It has the mounting of the unit, and the factor and steady sideslip of the aircraft. ``factor`` is in degrees per
    m/s of crosswind; ``sum_deg`` is mounting + steady sideslip, which the flights see together: its sigma is smaller
    than either's.
    """

    flights: int  #: Earlier flights that taught.
    mounting_deg: float  #: Heading of the unit's axes minus that of the airframe.
    mounting_sigma_deg: float  #: Standard deviation of the mounting.
    steady_deg: float  #: Steady sideslip of the aircraft on taxi.
    steady_sigma_deg: float  #: Standard deviation of the steady sideslip.
    sum_deg: float  #: Mounting plus steady sideslip, which the flights see together.
    sum_sigma_deg: float  #: Standard deviation of the sum: smaller than either's.
    factor: float  #: Sideslip in degrees per m/s of crosswind.
    factor_sigma: float  #: Standard deviation of the factor.


@dataclass(frozen=True)
class LearnedHeading:
    """Heading error with the knowledge from earlier flights (INS heading - true heading).

    Parameters
    ----------
    ins_serial, aircraft : str
    flights : int
        Earlier flights that taught.
    why_not : str
        Why nothing was learned: the answer is then that of the taxi alone. Empty otherwise.
    verdict, verdict_reason, correction_deg
        As of the heading correction, the gate on the whole half width with what was learned.
    error_deg, standard_error_deg, confidence95_deg
        The airframe's: this is typed.
    interval_parts : tuple of IntervalPart
        This taxi, wind, installation.
    platform_error_deg, platform_standard_error_deg, platform_confidence95_deg
        Azimuth of the INS itself, the learned mounting taken off.
    platform_parts : tuple of IntervalPart
    alone_error_deg, alone_half_width_deg
        The answer of this taxi alone, for comparison.
    half_width_deg : float
        Half width of the airframe's interval: from the number to the farther end.
    installed : Installed
        Posterior of the earlier flights.
    odd, changed : tuple of str
        Earlier flights that were taken for flights of another unit, and those from which on it sits otherwise.
    residual_deg, residual_sigma_deg : float, optional
        The platform's error less the azimuth that the same flight showed later, and the sigma of that difference:
        nothing of that azimuth is in the number.
    """

    schema_name: ClassVar[str] = "installation_result"

    ins_serial: str  #: Serial number, as logged or stated.
    aircraft: str  #: Aircraft in which it is installed.
    flights: int
    why_not: str
    verdict: str  #: As of the heading correction, with the interval learned.
    verdict_reason: str  #: Gate or figure that decided it, for people.
    correction_deg: float | None  #: Number to type; null unless the verdict is accept.
    error_deg: float  #: INS heading minus true heading of the airframe.
    standard_error_deg: float  #: Standard error with what was learned in it.
    confidence95_deg: tuple[float, float]  #: 95 % interval of the airframe's error [low, high].
    half_width_deg: float
    alone_error_deg: float  #: Error by this taxi alone.
    alone_half_width_deg: float  #: Half width of the interval by this taxi alone.
    interval_parts: tuple[IntervalPart, ...] = ()
    platform_error_deg: float | None = None  #: Azimuth of the INS itself minus true: the learned mounting is taken off.
    platform_standard_error_deg: float | None = None  #: Standard error of the platform's azimuth.
    platform_confidence95_deg: tuple[float, float] | None = None  #: 95 % interval of the platform's error [low, high].
    platform_parts: tuple[IntervalPart, ...] = ()  #: What the platform's interval is made of.
    installed: Installed | None = None
    odd: tuple[str, ...] = ()  #: Earlier flights that seem to be of another unit.
    changed: tuple[str, ...] = ()  #: Earlier flights from which on the unit sits otherwise.
    residual_deg: float | None = None  #: Platform error less the azimuth that the same flight showed later.
    residual_sigma_deg: float | None = None  #: Standard deviation of that difference.
    settings: dict[str, float | str | bool] = field(default_factory=dict)


@dataclass(frozen=True)
class InstalledFlight:
    """Flight of an installation: its lesson, and its answer by those of earlier flights.

    The answer is None without a taxi.
    """

    lesson: Lesson
    answer: LearnedHeading | None


@dataclass(frozen=True)
class Pooled:
    """Figure of a sensor from all flights of an installation, in the unit that ends its name.

    ``odd`` and ``changed`` name flights that another sensor seems to have made, and those from which on it is another.
    """

    name: str = field(metadata={"one_of": POOLED})
    flights: int
    value: float
    sigma: float
    odd: tuple[str, ...] = ()
    changed: tuple[str, ...] = ()


@dataclass(frozen=True)
class Installation:
    """One unit in one aircraft, until it flies in another, and the results of its flights.

    Parameters
    ----------
    ins_serial, aircraft : str
    installed : Installed, optional
        Posterior that the next flight can rely on; None where nothing was taught.
    taught_by : tuple of str
        Flights that taught; ``odd`` and ``changed`` go with them.
    odd, changed : tuple of float
        Probabilities, from all flights: it was another unit's; from it on the unit sits otherwise.
    flights : tuple of InstalledFlight
        In order of time.
    pooled : tuple of Pooled
        Compass A, antenna arm, latency of GNSS: by the same rule, of this installation alone.
    """

    ins_serial: str
    aircraft: str
    installed: Installed | None
    taught_by: tuple[str, ...]
    odd: tuple[float, ...]
    changed: tuple[float, ...]
    flights: tuple[InstalledFlight, ...]
    pooled: tuple[Pooled, ...] = ()

    @property
    def lessons(self) -> tuple[Lesson, ...]:
        """Lessons of its flights."""
        return tuple(one.lesson for one in self.flights)


@dataclass(frozen=True)
class LeftOut:
    """Flight with a serial that is in no installation, and the reason."""

    flight_id: str
    reason: str


@dataclass(frozen=True)
class Installations:
    """installations.json: every installation of a folder of flights, by serial and time.

    ``method_version`` is that of the model: answers of another one are made again. ``without_serial`` counts flights
    that state no INS serial: nothing is learned from them.
    """

    format_version: int = FORMAT_VERSION
    method_version: int = METHOD_VERSION
    without_serial: int = 0
    left_out: tuple[LeftOut, ...] = ()
    installations: tuple[Installation, ...] = ()

    @property
    def lessons(self) -> tuple[Lesson, ...]:
        """Lessons of all flights."""
        return tuple(lesson for one in self.installations for lesson in one.lessons)


@dataclass(frozen=True)
class InstallationRow:
    """One unit in one aircraft and the results of its flights together; :class:`Installed`.

    ``place`` counts the installations of the fleet from 1. ``odd`` and ``changed`` name flights taken for another
    unit's, and those from which on it sits otherwise, joined by ", ". ``pooled`` are figures of other sensors.
    """

    place: int
    ins_serial: str
    aircraft: str
    first_flight: str
    last_flight: str
    flights: int
    taught: int
    mounting_deg: float | None = None
    mounting_sigma_deg: float | None = None
    sum_deg: float | None = None
    sum_sigma_deg: float | None = None
    factor: float | None = None
    factor_sigma: float | None = None
    odd: str = ""
    changed: str = ""
    pooled: tuple[Pooled, ...] = ()


def as_stored(lesson: Lesson) -> Lesson:
    """Round the numbers of a lesson as the file has them.

    Every reader of the file then computes the same.
    """
    return from_json(Lesson, to_json(lesson))


def installations_text(found: Installations) -> str:
    """The file as text."""
    from groundstation.results.files import json_text  # whoever teaches alone writes nothing

    return json_text(to_json(found))


def read_installations(path: Path) -> Installations:
    """Read installations.json.

    Raises
    ------
    SettingsError
        When it cannot be read, or is not such a file.
    """
    expected = "installations.json of a folder that `run` made"
    try:
        document = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise SettingsError(str(path), error.strerror or "cannot be read", expected) from error
    except ValueError as error:
        raise SettingsError(str(path), "no JSON", expected) from error
    if not isinstance(document, dict) or document.get("format_version") != FORMAT_VERSION:
        version = document.get("format_version") if isinstance(document, dict) else None
        raise SettingsError(str(path), f"format_version {version!r}", f"{FORMAT_VERSION}: {expected}")
    try:
        return from_json(Installations, document)
    except MismatchError as error:
        raise SettingsError(f"{path}, {error.place}", error.found, error.expected or expected) from error


def installations_in(out: Path) -> Installations | None:
    """Read installations.json of an OUT; None where there is none that can be read."""
    try:
        return read_installations(out / INSTALLATIONS)
    except SettingsError:
        return None
