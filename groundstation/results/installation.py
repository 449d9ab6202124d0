"""What flights teach of an INS's installation, and the heading errors that follow from it."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import ClassVar

from groundstation.results.answer import Answer
from groundstation.results.figures import FigureData
from groundstation.results.heading import IntervalPart

FORMAT_VERSION = 1
METHOD_VERSION = 1  # of the model: another one makes every learned answer again
PLACES: Mapping[str, int] = {"factor": 5, "factor_sigma": 5, "probability": 4}


@dataclass(frozen=True)
class Lesson:
    """What one flight says of its installation: stored numbers alone.

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
        What is known beforehand of the crosswind factor (deg per m/s), the sideslip that is the same in every
        direction, the mounting.
    verdict, failed
        Of this taxi alone, and the required gates that failed or were not measured.
    error_deg, half_width_deg, platform_error_deg
        Of this taxi alone.
    limit_deg : float, optional
        Of the whole half width; None where it does not decide.
    entry_step_deg : float
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

    @property
    def teaches(self) -> bool:
        """Whether later flights learn from it."""
        return not self.not_taught

    @property
    def place(self) -> tuple[str, str]:
        """Orders flights by time."""
        return self.start_utc.removesuffix("Z"), self.flight_id

    @property
    def prior(self) -> tuple[float, ...]:
        """What is known before the first flight."""
        return (self.factor, self.factor_sigma, self.steady_sigma_deg, self.mounting_deg, self.mounting_sigma_deg)


@dataclass(frozen=True)
class Installed:
    """Posterior of an installation: mounting of the unit, factor and steady sideslip of the aircraft.

    ``factor`` is in degrees per m/s of crosswind; ``sum_deg`` is mounting + steady sideslip, which the flights see
    together: its sigma is smaller than either's.
    """

    flights: int
    mounting_deg: float
    mounting_sigma_deg: float
    steady_deg: float
    steady_sigma_deg: float
    sum_deg: float
    sum_sigma_deg: float
    factor: float
    factor_sigma: float


@dataclass(frozen=True)
class InstallationResult(Answer):
    """The heading error with what earlier flights taught (error = INS heading - true heading).

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
        Of the airframe's interval: from the number to the farther end.
    installed : Installed
        What the earlier flights say.
    taught_by : tuple of str
        Those flights.
    odd, changed : tuple of str
        Of them those that were taken for flights of another unit, and those from which on it sits otherwise.
    """

    analysis: ClassVar[str] = "installation"

    ins_serial: str
    aircraft: str
    flights: int
    why_not: str
    verdict: str
    verdict_reason: str
    correction_deg: float | None
    error_deg: float
    standard_error_deg: float
    confidence95_deg: tuple[float, float]
    half_width_deg: float
    alone_error_deg: float
    alone_half_width_deg: float
    interval_parts: tuple[IntervalPart, ...] = ()
    platform_error_deg: float | None = None
    platform_standard_error_deg: float | None = None
    platform_confidence95_deg: tuple[float, float] | None = None
    platform_parts: tuple[IntervalPart, ...] = ()
    installed: Installed | None = None
    taught_by: tuple[str, ...] = ()
    odd: tuple[str, ...] = ()
    changed: tuple[str, ...] = ()
    settings: dict[str, float | str | bool] = field(default_factory=dict)
    figures: tuple[FigureData, ...] = ()


@dataclass(frozen=True)
class Installation:
    """One unit in one aircraft, until it flies in another: what its flights say together.

    Parameters
    ----------
    ins_serial, aircraft : str
    flights : tuple of Lesson
        In order of time; what each says, and why some teach nothing.
    installed : Installed, optional
        What the next flight can rely on; None where nothing was taught.
    taught_by : tuple of str
        Flights that taught; ``odd`` and ``changed`` go with them.
    odd, changed : tuple of float
        Probabilities, from all flights: it was another unit's; from it on the unit sits otherwise.
    """

    ins_serial: str
    aircraft: str
    flights: tuple[Lesson, ...]
    installed: Installed | None = None
    taught_by: tuple[str, ...] = ()
    odd: tuple[float, ...] = ()
    changed: tuple[float, ...] = ()
