"""Answer on the causes of the errors of an unaided INS: shares, Schuler, body, legs."""

from dataclasses import field
from typing import ClassVar, Literal

from groundstation.base.dataclasses import dataclass
from groundstation.results.answer import Answer
from groundstation.results.figures import FigureData
from groundstation.systems.inertial.units_answer import Measured

Cause = Literal["schuler", "drift", "azimuth", "body", "reset", "unexplained"]
CAUSES: tuple[Cause, ...] = ("schuler", "drift", "azimuth", "body", "reset", "unexplained")
ParameterName = Literal[
    "mean_drift_north",
    "mean_drift_east",
    "drift_north",
    "drift_east",
    "gyro_forward",
    "gyro_right",
    "accelerometer_forward",
    "accelerometer_right",
    "tilt_north",
    "tilt_east",
    "azimuth",
]
PARAMETERS: tuple[ParameterName, ...] = (
    "mean_drift_north",
    "mean_drift_east",
    "drift_north",
    "drift_east",
    "gyro_forward",
    "gyro_right",
    "accelerometer_forward",
    "accelerometer_right",
    "tilt_north",
    "tilt_east",
    "azimuth",
)


@dataclass(frozen=True)
class Within95:
    """Value with the ends of its 95 % interval."""

    schema_name: ClassVar[str] = "within95"

    value: float  #: Best estimate.
    low95: float  #: Lower end of its 95 % interval.
    high95: float  #: Upper end of its 95 % interval.


@dataclass(frozen=True)
class CauseShare:
    """Share of the mean square velocity error that a cause explains.

    The shares of all causes add up to one. One may be negative, or above one: where two causes cancel.
    """

    schema_name: ClassVar[str] = "cause_share"

    name: Cause = field(metadata={"one_of": CAUSES})  #: Cause for scripts.
    share: Within95  #: Share of the mean square velocity error; all add up to 1, one may be negative.


def taken_away(share: float) -> str:
    """Return what other causes take from a share above the whole error; empty of others.

    Examples
    --------
    >>> taken_away(1.034), taken_away(1.004), taken_away(0.6)
    ('the other causes take 3 % away', '', '')
    """
    percent = round(100.0 * share) - 100
    return f"the other causes take {percent} % away" if percent > 0 else ""


@dataclass(frozen=True)
class CauseParameter:
    """Constant of the INS that the coupled model estimates over the whole flight.

    Parameters
    ----------
    name : str
        ``mean_drift``: the constant drift of a channel, all that makes it together, mean over the flight. ``drift``:
        its part that stays north and east when the aircraft turns. ``gyro``, ``accelerometer``: fixed to the body.
        ``tilt``: less what an accelerometer bias makes of it on the first heading. ``azimuth``: at the start.
    value, half95 : float
        In ``unit``, with half of the 95 % interval.
    observability : float
        1 - sigma / sigma before the flight, 0 to 1; ``is_observable`` above one half.
    """

    schema_name: ClassVar[str] = "cause_parameter"

    name: ParameterName = field(metadata={"one_of": PARAMETERS})
    title: str  #: Name for people.
    unit: str  #: Unit of value and interval.
    value: float  #: Estimate over the whole flight.
    half95: float  #: Half of its 95 % interval.
    observability: float
    is_observable: bool  #: Whether the flight tells more than half of what there is to know.


@dataclass(frozen=True)
class SchulerWave:
    """Schuler oscillation of the velocity error of a channel.

    v = offset + amplitude cos(rate x time - phase), time since the first comparison.

    Parameters
    ----------
    amplitude_mps : Within95
        As the start and the constant drift make it.
    phase_deg : Within95 or None
        None where the interval is wider than half a turn.
    tilt_arcsec, bias_ug : Within95
        Initial tilt and accelerometer bias that alone would make such an amplitude.
    offset_mps : Within95
        About which it swings: - R x mean drift.
    end_mps : Within95
        Amplitude at the last comparison; what random drift added or took is in it.
    flight_mps : Within95 or None
        Amplitude of the plain least squares fit over the flight: offset, slope, cosine and sine; the interval is that
        of GNSS. None of a flight shorter than a Schuler period.
    """

    schema_name: ClassVar[str] = "schuler_wave"

    channel: str = field(metadata={"one_of": ("north", "east")})  #: north or east.
    amplitude_mps: Within95
    phase_deg: Within95 | None
    tilt_arcsec: Within95  #: Initial tilt that alone would make the amplitude.
    bias_ug: Within95  #: Accelerometer bias that alone would make the amplitude.
    offset_mps: Within95
    end_mps: Within95
    flight_mps: Within95 | None = None


@dataclass(frozen=True)
class StraightLeg:
    """Straight leg of the flight with its errors along and across the course.

    Across is positive to the right. ``rate`` is change of position error over time, ``change`` that of the velocity
    error from the first to the last half minute; None where GNSS is missing at an end.
    """

    schema_name: ClassVar[str] = "straight_leg"

    start_s: float
    end_s: float
    course_deg: float  #: True course.
    length_km: float  #: Length over ground.
    along_rate_nmiph: Measured | None  #: Growth of the position error along the course.
    across_rate_nmiph: Measured | None  #: Growth of the position error across the course, right positive.
    #: Change of the velocity error along the course, from the first to the last half minute.
    along_change_mps: Measured | None
    across_change_mps: Measured | None  #: Change of the velocity error across the course, right positive.


@dataclass(frozen=True)
class ErrorWindow:
    """Radial error after some hours.

    ``since_start_m`` is that of the flight itself, so long after navigation began. ``median_m`` and ``p95_m`` are of
    the error that builds up in windows of this length, one every five minutes; they overlap, ``independent`` is how
    many fit in one after the other.
    """

    schema_name: ClassVar[str] = "error_window"

    hours: float  #: Length of the window.
    since_start_m: float | None  #: Radial error so long after navigation began.
    median_m: float | None  #: Median of what builds up in windows of this length.
    p95_m: float | None  #: 95th percentile of what builds up.
    windows: int  #: Windows, one every five minutes: they overlap.
    independent: int  #: Windows that fit in one after the other.


@dataclass(frozen=True)
class AlongAcross:
    """RMS of an error along and across the track, while the aircraft moves."""

    schema_name: ClassVar[str] = "along_across"

    quantity: str = field(metadata={"one_of": ("position", "velocity")})  #: position or velocity.
    unit: str
    along: float  #: RMS along the track.
    across: float  #: RMS across the track.


@dataclass(frozen=True)
class CausesResult(Answer):
    """Errors of an unaided INS by cause.

    Parameters
    ----------
    ins_topic, gnss_topic, ins_class : str
    sentence : str
        Conclusion in words.
    hours : float
        From the first to the last comparison.
    schuler_period_min : float
    heading_spread : float
        1 - length of the mean of the headings as unit vectors while the aircraft moves: 0 on one heading.
    is_parted : bool
        Whether headings differ enough to part what is fixed to the body from what is fixed to north and east.
    is_strapdown : bool
        Of the class: whether its sensors turn with the aircraft.
    resets : int
        Resets of the INS, each with jumps of its own.
    start_mps : Within95
        Length of the Schuler amplitudes of both channels, as velocity error and tilt at the start make them;
        ``start_tilt_arcsec`` is the initial tilt that alone would.
    period_share : float or None
        Share of the mean square velocity error that swings with the Schuler period, whatever the cause; None of a
        flight shorter than that.
    shares, parameters, schuler, legs, windows, along_across
        The tables.
    legs_left_out : int
        Shorter legs that are not in the table.
    """

    analysis: ClassVar[str] = "ins_causes"
    schema_name: ClassVar[str] = analysis

    ins_topic: str  #: Topic of the INS judged.
    gnss_topic: str
    ins_class: str  #: Class of the INS: noise and limits.
    sentence: str
    hours: float
    schuler_period_min: float  #: Period of the Schuler oscillation, about 84.4 min.
    heading_spread: float
    is_parted: bool
    is_strapdown: bool
    resets: int
    start_mps: Within95
    start_tilt_arcsec: Within95  #: Initial tilt that alone would make the Schuler amplitude.
    shares: tuple[CauseShare, ...]  #: Share of the velocity error that each cause explains.
    parameters: tuple[CauseParameter, ...]  #: Constants of the INS that the flight shows.
    schuler: tuple[SchulerWave, ...]  #: Schuler oscillation of each channel.
    legs: tuple[StraightLeg, ...]  #: Straight legs, errors along and across the course.
    legs_left_out: int
    windows: tuple[ErrorWindow, ...]  #: Radial error after so many hours.
    along_across: tuple[AlongAcross, ...]  #: RMS errors along and across the track.
    period_share: float | None = None
    figures: tuple[FigureData, ...] = ()

    def share(self, name: Cause) -> Within95:
        """Return the share of a cause."""
        return next(one.share for one in self.shares if one.name == name)

    def parameter(self, name: ParameterName) -> CauseParameter | None:
        """Return a constant, None where the class has none such."""
        return next((one for one in self.parameters if one.name == name), None)
