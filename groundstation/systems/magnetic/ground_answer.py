"""Deviation of the installed heading sensor from straight runs on the ground.

The deviation is given by each run, and by all together.
"""

from dataclasses import field
from typing import ClassVar, Literal

from groundstation.base.dataclasses import dataclass
from groundstation.results.answer import Answer
from groundstation.results.figures import FigureData
from groundstation.results.roles import LETTERS
from groundstation.systems.magnetic.answer import DeclinationUsed

NUMBERS_ARE_KNOWN = True  # in the schema of summary.json: a float that is not optional is never null

RunState = Literal["used", "rejected"]
CoefficientState = Literal["found", "not observable"]


@dataclass(frozen=True)
class GroundRun:
    """Straight run on the ground, and the reason where it is not used. Times: flight seconds.

    Parameters
    ----------
    phase : str
        Phase of the flight that most of it belongs to: taxi, take-off run, landing roll.
    magnetic_heading_deg, track_deg : float
        Means; the track is true.
    error_deg : float or None
        Magnetic heading + declination - track: the error of the sensor at this heading. None where rejected.
    noise_sigma_deg : float or None
        Sigma of the mean over the run, correlated noise and the steps of the log in it.
    sigma_deg : float or None
        Sigma of the error, with that of slip and of declination (the latter common to all runs).
    heading_change_deg : float
        Range of the smoothed heading along the run.
    """

    start_s: float
    end_s: float
    phase: str
    magnetic_heading_deg: float  #: Mean magnetic heading as read.
    track_deg: float  #: Mean true track.
    declination_deg: float  #: Declination there, east positive.
    error_deg: float | None
    noise_sigma_deg: float | None
    sigma_deg: float | None
    samples: int  #: Epochs in it.
    speed_mps: float  #: Mean ground speed.
    heading_change_deg: float
    state: RunState  #: used or rejected.
    reason: str = ""  #: Why it is rejected; empty where it is used.


@dataclass(frozen=True)
class LeftOut:
    """GNSS epochs that belong to no run, and the reason."""

    reason: str  #: Why they belong to no run.
    epochs: int  #: Number of them.


@dataclass(frozen=True)
class GroundCoefficient:
    """One of the coefficients A to E.

    ``value_deg`` is None where the runs do not show it; ``sigma_deg`` is what they leave of it.
    """

    letter: str = field(metadata={"one_of": LETTERS})  #: Which of A to E.
    value_deg: float | None  #: Coefficient of the error; null where it is not seen.
    sigma_deg: float  #: Standard deviation, or what is left open of it.
    state: CoefficientState  #: found or not observable.
    reason: str = ""  #: Why it is not observable; empty where it is found.


@dataclass(frozen=True)
class AlongAxis:
    """Part of B and C that opposite runs show.

    The part is ``value_deg`` x cos(heading - ``axis_deg``), the axis in [0, 180).
    """

    axis_deg: float  #: Heading of the axis, 0 to 180.
    value_deg: float  #: Error along it: value x cos(heading - axis).
    sigma_deg: float  #: Standard deviation of the value.


@dataclass(frozen=True)
class Repeat:
    """Runs on about one heading: spread of their errors, and the spread to expect.

    The latter is that by their noise and slip alone.
    """

    magnetic_heading_deg: float  #: Their mean heading.
    runs: int  #: Number of them.
    spread_deg: float  #: Spread of their errors.
    expected_deg: float  #: Spread by noise and slip alone.


@dataclass(frozen=True)
class GroundDeviation(Answer):
    """Errors of the installed heading sensor on straight ground runs.

    The errors are advisory, not a release to service.

    Parameters
    ----------
    ins_topic, gnss_topic : str
    declination : DeclinationUsed
        Its mean over the runs.
    directions, widest_gap_deg
        Directions that the used runs have, and the widest gap of the circle between them.
    place_sigma_deg : float
        Standard deviation of what each run has of its own beyond noise and slip, as the runs show it.
    coefficients : tuple of GroundCoefficient
        error(c) = A + B sin c + C cos c + D sin 2c + E cos 2c, c the uncorrected magnetic heading, as far as seen.
        What is not seen counts in the sigma of the others.
    along : AlongAxis or None
        Where B or C is not seen, but their sum along an axis is.
    logged_variation_deg : float or None
        Mean of what the device itself takes for declination, where the log has it.
    heading_step_deg, track_step_deg : float or None
        Step the log writes it in; None where none shows.
    figures
        ``magnetic_ground_epochs`` (every epoch of the runs), ``magnetic_ground_curve`` (360 bins: error and sigma by A
        to E, NaN where it is not known).
    """

    analysis: ClassVar[str] = "magnetic_ground"
    schema_name: ClassVar[str] = analysis

    ins_topic: str  #: Topic of the magnetic heading.
    gnss_topic: str
    declination: DeclinationUsed
    runs: tuple[GroundRun, ...]  #: Straight runs on the ground, used or not.
    left_out: tuple[LeftOut, ...]  #: Epochs that belong to no run, by reason.
    directions: int  #: Directions that the used runs have.
    widest_gap_deg: float  #: Widest part of the circle without a run.
    place_sigma_deg: float
    coefficients: tuple[GroundCoefficient, ...]
    along: AlongAxis | None = None
    repeats: tuple[Repeat, ...] = ()  #: Runs on about one heading against each other.
    logged_variation_deg: float | None = None
    heading_step_deg: float | None = None  #: Step in which the log writes the heading; null where none shows.
    track_step_deg: float | None = None  #: Step in which the log writes the track; null where none shows.
    remarks: tuple[str, ...] = ()
    settings: dict[str, float | str | bool] = field(default_factory=dict)
    figures: tuple[FigureData, ...] = ()

    @property
    def used(self) -> tuple[GroundRun, ...]:
        """The runs that count."""
        return tuple(run for run in self.runs if run.state == "used")

    def coefficient(self, letter: str) -> GroundCoefficient:
        """One of A to E."""
        return next(item for item in self.coefficients if item.letter == letter)
