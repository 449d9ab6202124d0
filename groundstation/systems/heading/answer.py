"""Answer of the heading estimator (system 1): the correction to type, and its basis.

The basis is the reason for it, and its interval.
"""

import math
from collections.abc import Iterable
from dataclasses import field
from typing import ClassVar, Literal

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.dataclasses import dataclass
from groundstation.base.records import BoolArray
from groundstation.results.answer import Answer
from groundstation.results.arrays.typed import found_in
from groundstation.results.figures import FigureData
from groundstation.results.gates import Gate
from groundstation.results.roles import HeadingByTrack, IntervalPart, LatencyByTurns, OnTaxi
from groundstation.systems.heading.arrays import HeadingSamples
from groundstation.systems.heading.gates_answer import NOT_IN_INTERVAL

Verdict = Literal["accept", "advisory", "reject", "extend", "undecided"]
# Limits that figures show: setting, and what is shipped (a test holds them to the settings).
RAW_SPEED_LIMIT, MEAN_SPEED_LIMIT = ("standstill_speed_max_mps", 0.2), ("speed_of_mean_max_mps", 0.01)


@dataclass(frozen=True)
class Standstill:
    """GNSS velocity assessed at standstill (stage A).

    Times are flight seconds. ``speed_of_mean_mps`` is the length of the mean velocity vector (gated),
    ``mean_of_speed_mps`` the mean of the speeds: the two readings of the paper. ``speed_bound97_mps`` is the 0.97
    bound of the former from the effective number of samples. ``velocity_is_held``: the receiver freezes its velocity
    when standing (or shows it in coarse steps), so that its error cannot be seen.
    """

    start_s: float
    end_s: float
    samples: int
    mean_north_mps: float  #: Mean GNSS velocity north while parked.
    mean_east_mps: float  #: Mean GNSS velocity east while parked.
    sigma_north_mps: float  #: Scatter of the north velocity about its mean.
    sigma_east_mps: float  #: Scatter of the east velocity about its mean.
    mean_of_speed_mps: float  #: Mean of the speeds: the second reading of the paper.
    speed_of_mean_mps: float  #: Length of the mean velocity vector: the figure that is gated.
    speed_bound97_mps: float  #: 97 % bound of speed_of_mean_mps by the effective number of samples.
    share_above_limit: float  #: Share of the samples faster than a parked aircraft may seem.
    ground_proof: str  #: What shows that the aircraft stood, in words.
    white_sigma_mps: float | None = None  #: Part of the noise that differs from epoch to epoch.
    correlated_sigma_mps: float | None = None  #: Part of the noise that lasts.
    correlation_time_s: float | None = None  #: Time over which the lasting part decays.
    velocity_is_held: bool = False  #: The receiver freezes its velocity at rest: its error cannot be seen.


@dataclass(frozen=True)
class TaxiSegment:
    """One straight taxi segment (stage B) and its own estimate. Times are flight seconds."""

    schema_name: ClassVar[str] = "segment"

    start_s: float
    end_s: float
    samples: int  #: GNSS epochs used in it.
    mean_track_deg: float  #: Mean GNSS track, true.
    mean_speed_mps: float  #: Mean ground speed.
    error_deg: float  #: INS heading minus track on this segment alone.
    sigma_deg: float  #: Standard error of this segment's error.


def seconds_of_epochs(is_meant: BoolArray, interval_s: float) -> float:
    """Return the seconds that epochs stand for, each for the usual interval between them."""
    return int(np.count_nonzero(is_meant)) * interval_s


def seconds_of_segments(spans_s: Iterable[tuple[float, float]], interval_s: float) -> float:
    """Return the seconds of straight segments, from the first epoch to the end of the last.

    Unlike :func:`seconds_of_epochs` it counts the few epochs within a segment that are not used.
    """
    return float(sum(end_s - start_s + interval_s for start_s, end_s in spans_s))


@dataclass(frozen=True)
class UnprovenGround:
    """Straight epochs left out because nothing proves ground contact.

    Of a vehicle that is found to roll, and not stated to, the error by all of them stands beside.
    """

    schema_name: ClassVar[str] = "unproven_ground"

    epochs: int  #: Straight epochs at taxi speed left out.
    straight: int  #: Straight epochs in all: these and those used.
    error_deg: float | None = None  #: Heading error with them; null where the vehicle is not found to roll.


@dataclass(frozen=True)
class HeadingStep:
    """Step of the INS heading: flight time of the first sample after it, and its size.

    The size is heading after minus heading before.
    """

    time_s: float  #: Flight second of the first sample after it.
    size_deg: float  #: Heading after minus heading before.


@dataclass(frozen=True)
class TaxiWind:
    """Wind on taxi: velocity of the air, sigma of either component, and its origin.

    The origin is ``log`` or the METAR line.
    """

    north_mps: float  #: Velocity of the air towards north.
    east_mps: float  #: Velocity of the air towards east.
    sigma_mps: float  #: Standard deviation of either component.
    origin: str  #: log, or the METAR line.


@dataclass(frozen=True)
class RunwayCheck:
    """Check against the runway: its true bearing beside the INS heading there.

    It is a second reference, on line-up or take-off run.
    """

    schema_name: ClassVar[str] = "runway"

    name: str  #: Runway as the site file or the table names it.
    true_bearing_deg: float  #: True bearing of the runway.
    ins_heading_deg: float  #: INS heading on line-up or take-off run.
    error_deg: float  #: INS heading minus runway bearing.
    sigma_deg: float  #: Standard deviation of that error.
    difference_deg: float  #: This error minus that by taxi.


@dataclass(frozen=True)
class HeadingByStates:
    """Heading error by the heading of states of their own, on the same straights.

    A second interval.

    Both rest on the INS heading and on the velocity of GNSS and are never combined.

    Parameters
    ----------
    by : str
        "by the best trajectory (heading to 0.3 deg)".
    error_deg, sigma_deg : float
        INS heading minus theirs; the sigma has theirs, the mounting's and the scatter.
    confidence95_deg : (float, float)
    samples : int
        Epochs of the taxi with states beside them.
    correlation : float or None
        Of the two differences over these epochs; None where one does not vary.
    difference_deg : float
        Taxi minus this.
    agrees : bool
        Whether both intervals meet.
    """

    schema_name: ClassVar[str] = "by_states"

    by: str
    error_deg: float  #: INS heading minus that of the states.
    sigma_deg: float  #: Standard deviation, with the states', the mounting's and the scatter.
    confidence95_deg: tuple[float, float]
    samples: int
    correlation: float | None
    difference_deg: float  #: Error by taxi minus this one.
    agrees: bool


@dataclass(frozen=True)
class OnboardComparison:
    """Figures of the aircraft itself (topic ``onboard``) beside ours.

    Differences are onboard minus ours.
    """

    schema_name: ClassVar[str] = "onboard"

    heading_error_deg: float | None  #: Heading error that the aircraft found.
    precision_deg: float | None  #: The paper's e as the aircraft computed it.
    quality_deg: float | None  #: The paper's quality figure as the aircraft computed it.
    cycles: float | None  #: Cycles of averaging on board.
    correction_entered_deg: float | None  #: Correction that stood in the INS while the log was made.
    status: str  #: State of the on-board procedure, as logged.
    difference_error_deg: float | None  #: Heading error found on board minus ours.


@dataclass(frozen=True)
class HeadingResult(Answer, OnTaxi, HeadingByTrack, LatencyByTurns):
    """INS heading error found on straight taxi (error = INS heading - true heading).

    Parameters
    ----------
    ins_topic, gnss_topic : str
        The pair used.
    heading_source : str
        ``"true heading"`` or how a magnetic heading was turned to true (logged variation, magnetic model and date).
    error_deg : float
        The estimate reported and corrected by: robust, weighted by speed.
    paper_error_deg : float
        The plain running mean of the paper over the same samples.
    standard_error_deg, confidence95_deg
        Honest ones: they allow for errors correlated over seconds, for what segments and minutes say against each
        other, and for steady sideslip. The error is the airframe's, as a theodolite on it judges: the mounting of the
        INS is a part of it and needs no sigma.
    interval_parts : tuple of IntervalPart
        Parts of the interval: this taxi, the wind, the installation.
    platform_error_deg, platform_standard_error_deg, platform_confidence95_deg
        Azimuth error of the INS itself, as navigation has it: the mounting is taken off, its sigma is in the interval.
    wind, aircraft_class, sideslip_deg
        The wind used, the class whose factor turned it to sideslip, and the mean sideslip (heading minus track) taken
        off with them; None where no wind is known.
    mean_direction : (north, east), optional
        Mean of the unit vectors of motion as the samples weigh them: with the wind it gives the crosswind that the
        number holds, with its sigma how much of it may remain. Its length is 1 one way, near 0 there and back.
    confidence95_measured_deg : (low, high), optional
        The interval without steady sideslip: what this taxi shows by itself.
    steady_sigma_deg, steady_origin
        Sigma of what steady sideslip leaves in the error, and whence the prior sigmas come:
        ``"aircraft file"`` or ``"shipped figures"``.
    segment_spread_deg, wander_spread_deg, wander_s
        Error that each segment has of its own, and wander of INS heading minus path: sigmas and correlation time, as
        their spread shows.
    steps : tuple of HeadingStep
        Steps of the INS heading before or on taxi; the error is that after the last.
    precision_deg : float
        The paper's e: 1.96 sqrt(s^2 / (n - 1)).
    quality_deg : float
        Standard deviation of the running mean about its own running mean.
    estimate_sd_deg : float
        Standard deviation of the differences d about their mean.
    correction_deg : float or None
        The number to type: minus the error, rounded to the entry step; None unless the verdict is accept.
    drift_deg_per_h, drift_sigma_deg_per_h : float
    lever_arm_m, lever_arm_sigma_m, lever_arm_origin
        Longitudinal antenna arm, its sigma, and ``"aircraft file"``, ``"estimated"`` or ``"not observable"``.
    latency_used_s, latency_used_sigma_s, latency_origin
        Delay of GNSS behind the INS that was taken out, its sigma and its origin: ``"aircraft file"``, ``"motion"``;
        None and empty where nothing was shifted. ``time_offset_s`` is what the turns then still show.
    uncorrected_error_deg : float
        Plain mean of the differences with the velocity of the antenna as logged: what an on-board computer without arm
        correction would find.
    reference_time_s : float
        Flight time the error belongs to (weighted mean time of the samples).
    by_states : HeadingByStates or None
        A second interval, by the heading of the best trajectory where its checks hold.
    """

    analysis: ClassVar[str] = "heading"
    schema_name: ClassVar[str] = analysis
    taxi_serves: ClassVar[str] = "the heading error"

    ins_topic: str  #: Topic of the INS whose heading is judged.
    gnss_topic: str  #: Topic of the GNSS whose velocity gives the track.
    heading_source: str
    #: accept: type the correction; advisory: good to the interval; reject; extend: taxi longer; undecided.
    verdict: Verdict
    verdict_reason: str  #: Gate or figure that decided it, for people.
    error_deg: float  #: INS heading minus true heading: robust, weighted by speed, corrected by.
    standard_error_deg: float  #: Standard error with correlated errors, spread of segments and steady sideslip in it.
    #: 95 % interval of the error [low, high], of the airframe as a theodolite judges it.
    confidence95_deg: tuple[float, float]
    paper_error_deg: float
    precision_deg: float
    quality_deg: float
    estimate_sd_deg: float
    samples: int  #: Distinct GNSS epochs used.
    taxi_seconds: float  #: Straight taxi that was used.
    drift_deg_per_h: float | None  #: Growth of the error along the taxi.
    drift_sigma_deg_per_h: float | None  #: Standard deviation of the drift.
    correction_deg: float | None
    entry_step_deg: float = field(metadata={"above": 0})  #: Step to which the correction is rounded: that of the panel.
    gates: tuple[Gate, ...]  #: Conditions of the verdict, each with figure and limit.
    standstill: Standstill | None  #: GNSS velocity at rest before the taxi; null where the flight shows none.
    segments: tuple[TaxiSegment, ...]  #: Straight parts of the taxi, each with an error of its own.
    directions: tuple[TaxiSegment, ...] = ()  #: Segments of about one direction, joined.
    lever_arm_m: float | None = None  #: GNSS antenna ahead of the main-gear axle, positive forward.
    lever_arm_sigma_m: float | None = None  #: Standard deviation of the arm.
    lever_arm_origin: str = "not observable"  #: aircraft file, estimated or not observable.
    time_offset_s: float | None = None  #: Delay of GNSS behind the INS that the turns still show, after latency_used_s.
    time_offset_sigma_s: float | None = None  #: Standard deviation of that delay.
    latency_used_s: float | None = None  #: Delay of GNSS behind the INS that was taken out; null where none was.
    latency_used_sigma_s: float | None = None  #: Standard deviation of latency_used_s.
    #: Source of latency_used_s; empty where nothing was shifted.
    latency_origin: str = field(default="", metadata={"one_of": ("", "aircraft file", "motion")})
    parking_ins_heading_deg: float | None = None  #: INS heading while parked, as logged.
    #: The same with the error of that time taken off: true heading of the airframe.
    parking_heading_deg: float | None = None
    parking_sigma_deg: float | None = None  #: Standard deviation of the corrected parking heading.
    reference_parking_heading_deg: float | None = None  #: Parking heading by theodolite or stand, where one is stated.
    reference_residual_arcmin: float | None = None  #: Corrected parking heading minus its reference.
    runway: tuple[RunwayCheck, ...] = ()  #: INS heading against the runway's bearing: a second reference.
    #: What the aircraft computed itself, beside ours; null where it is not logged.
    onboard: OnboardComparison | None = None
    uncorrected_error_deg: float | None = None
    confidence95_measured_deg: tuple[float, float] | None = None
    steady_sigma_deg: float | None = None  #: Part of the standard error that steady sideslip makes.
    #: Source of the prior sigmas of sideslip.
    steady_origin: str = field(default="", metadata={"one_of": ("", "aircraft file", "shipped figures")})
    interval_parts: tuple[IntervalPart, ...] = ()
    platform_error_deg: float | None = None  #: Azimuth of the INS itself minus true: the mounting is taken off.
    #: Standard error of the platform's, with the sigma of the mounting.
    platform_standard_error_deg: float | None = None
    platform_confidence95_deg: tuple[float, float] | None = None  #: 95 % interval of the platform's error [low, high].
    wind: TaxiWind | None = None  #: Wind used for sideslip; null where none is known.
    aircraft_class: str = ""  #: Class whose factor turned crosswind to sideslip; empty without wind.
    sideslip_deg: float | None = None  #: Mean sideslip, heading minus track, that was taken off; null without wind.
    mean_direction: tuple[float, float] | None = None
    segment_spread_deg: float | None = None  #: Error that each segment has of its own, one sigma.
    wander_spread_deg: float | None = None  #: Wander of INS heading minus path within a segment, one sigma.
    wander_s: float | None = None  #: Correlation time of the wander.
    steps: tuple[HeadingStep, ...] = ()
    reference_time_s: float | None = None
    by_states: HeadingByStates | None = None
    #: Straight epochs left out for want of proof of ground contact; null where there are none.
    unproven_ground: UnprovenGround | None = None
    settings: dict[str, float | str | bool] = field(default_factory=dict)
    figures: tuple[FigureData, ...] = ()

    @property
    def measured_sigma_deg(self) -> float:
        """Standard error without steady sideslip."""
        return math.sqrt(max(self.standard_error_deg**2 - (self.steady_sigma_deg or 0.0) ** 2, 0.0))

    @property
    def azimuth(self) -> tuple[float, float]:
        """Error of the platform's azimuth and its standard error.

        In an answer of an older version they are the airframe's.
        """
        if self.platform_error_deg is None or self.platform_standard_error_deg is None:
            return self.error_deg, self.standard_error_deg
        return self.platform_error_deg, self.platform_standard_error_deg

    def setting(self, name: str, shipped: float) -> float:
        """Return a setting that the answer rests on; the shipped one where it keeps none."""
        value = self.settings.get(name)
        return shipped if value is None or isinstance(value, str | bool) else value

    @property
    def failed_beside_interval(self) -> tuple[str, ...]:
        """Names of the gates that refuse a use of the error."""
        return tuple(
            gate.name
            for gate in self.gates
            if gate.required and gate.state == "failed" and gate.name in NOT_IN_INTERVAL
        )

    @property
    def taxi_used_s(self) -> tuple[tuple[float, float], ...]:
        """Ends of the segments, flight seconds."""
        return tuple((one.start_s, one.end_s) for one in self.segments)

    @property
    def begins_s(self) -> float | None:
        """Flight second of the first straight segment, None where there is none."""
        return self.segments[0].start_s if self.segments else None

    def epochs_s(self) -> FloatArray:
        """Flight seconds of the epochs used, none where they are not kept."""
        samples = found_in(self.figures, HeadingSamples)
        return np.empty(0) if samples is None else samples.time_s[samples.is_used]

    def seconds_used(self) -> float:
        """Seconds that the epochs used stand for."""
        samples = found_in(self.figures, HeadingSamples)
        if samples is None:
            return 0.0
        return seconds_of_epochs(samples.is_used, float(np.median(np.diff(samples.time_s))))
