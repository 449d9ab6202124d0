"""Answer of the best trajectory: state, accuracy, checks, errors of the on-board filter."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any, ClassVar, Literal

from groundstation.results.answer import Answer
from groundstation.results.arrays.states import BodyStates
from groundstation.results.arrays.typed import found_in
from groundstation.results.figures import FigureData
from groundstation.results.gates import Gate
from groundstation.results.roles import ErrorsOfFilter, FilterError, FilterWrong, StatesAlongTheFlight

NUMBERS_ARE_KNOWN = True  # in the schema of summary.json: a float that is not optional is never null

TrajectoryState = Literal["accepted", "doubtful", "ambiguous"]
MountingSource = Literal["stated", "logged", "found", "case"]
OutageTruth = Literal["undisturbed solution", "RTK"]
# Names of parameters that others read: of the lever arm, and of the receiver's delay.
ARM = ("antenna forward of the unit", "antenna right of the unit", "antenna down of the unit")
LATENCY, VELOCITY_LAG = "GNSS latency", "GNSS velocity behind its position"
OffsetCause = Literal["", "mounting", "antenna", "datum", "sign"]
Quantity = Literal[
    "heading",
    "roll",
    "pitch",
    "tilt",
    "horizontal position",
    "vertical position",
    "horizontal velocity",
    "vertical velocity",
]
UNITS: Mapping[Quantity, str] = MappingProxyType(
    {
        "heading": "deg",
        "roll": "deg",
        "pitch": "deg",
        "tilt": "deg",
        "horizontal position": "m",
        "vertical position": "m",
        "horizontal velocity": "m/s",
        "vertical velocity": "m/s",
    }
)
# Least error of the on-board filter that is one, however small our sigma; and that a report opens with.
LEAST_ERROR: Mapping[Quantity, float] = MappingProxyType(
    {
        "heading": 0.3,
        "roll": 0.2,
        "pitch": 0.2,
        "horizontal position": 1.0,
        "vertical position": 2.0,
        "horizontal velocity": 0.2,
        "vertical velocity": 0.2,
    }
)
OPENING_ERROR: Mapping[Quantity, float] = MappingProxyType(
    {
        "heading": 1.5,
        "roll": 1.0,
        "pitch": 1.0,
        "horizontal position": 5.0,
        "vertical position": 10.0,
        "horizontal velocity": 1.0,
        "vertical velocity": 1.0,
    }
)


@dataclass(frozen=True)
class TrajectorySegment:
    """Span without a gap of the inertial unit above a second, flight seconds."""

    start_s: float
    end_s: float


@dataclass(frozen=True)
class UnitMounting:
    """Mounting of the inertial unit: the angles of its case in the body.

    Parameters
    ----------
    source : {'stated', 'logged', 'found', 'case'}
        ``case``: not known; the attitude told is that of the case.
    words : str
        "z axis up, x axis aft, by level and direction of travel".
    roll_deg, pitch_deg, yaw_deg : float
        Rotation from the axes of the case to those of the body.
    sigma_deg : float or None
        None where it is stated or not known.
    """

    source: MountingSource
    words: str
    roll_deg: float = 0.0
    pitch_deg: float = 0.0
    yaw_deg: float = 0.0
    sigma_deg: float | None = None


@dataclass(frozen=True)
class TrajectoryAccuracy:
    """Accuracy of one quantity of the smoothed solution, sigmas already raised.

    Parameters
    ----------
    quantity : str
    unit : str
    median_sigma, worst_sigma : float
        Over time. Of a horizontal quantity the square root of the sum of both variances.
    median_within95 : float
        Bound that 95 % of the errors stay within at the median sigmas; horizontal: radius.
    worst_s : float or None
        Flight time of the worst.
    """

    quantity: Quantity
    unit: str
    median_sigma: float
    worst_sigma: float
    median_within95: float
    worst_s: float | None = None


@dataclass(frozen=True)
class RaisedSigma:
    """Factor by which sigmas were raised, 1 where they held, and what asked for it."""

    name: Literal["position", "velocity", "tilt", "heading"]
    factor: float
    reason: str = ""


@dataclass(frozen=True)
class NoiseRow:
    """One noise of the model: prior of its class, value fitted to the log.

    ``is_at_bound``: the fit stopped at the bound that the class allows.
    """

    name: str
    unit: str
    prior: float
    fitted: float
    is_at_bound: bool = False


@dataclass(frozen=True)
class TrajectoryParameter:
    """Parameter that the log itself shows: value, sigma, and the sigma it started with.

    ``is_observable`` is false where the data say nothing of it. ``group`` is the name without its axis: "gyro bias".
    """

    name: str
    group: str
    unit: str
    value: float
    sigma: float
    start_sigma: float
    is_observable: bool


@dataclass(frozen=True)
class InnovationRow:
    """Mean squared innovation of one sensor over what its covariance expects."""

    sensor: str
    ratio: float
    count: int
    low: float = 0.5
    high: float = 2.0

    @property
    def is_inside(self) -> bool:
        """Tell whether the ratio is within its limits."""
        return self.low <= self.ratio <= self.high


@dataclass(frozen=True)
class HeldOutRow:
    """GNSS that was held out of the solution against it.

    ``error_rms`` is solution minus GNSS, ``sigma_rms`` what both sigmas expect of it.
    """

    quantity: Quantity
    unit: str
    count: int
    error_rms: float
    sigma_rms: float
    inside95_share: float


@dataclass(frozen=True)
class AgainstOwnTrack:
    """Heading minus own track on straights of what rolls.

    ``mad_deg`` is the median absolute deviation, ``scatter_100_s_deg`` the scatter of medians over 100 s.
    """

    samples: int
    mad_deg: float
    scatter_100_s_deg: float | None = None


@dataclass(frozen=True)
class OutageRow:
    """Replayed outages of one length.

    Parameters
    ----------
    length_s : float
    count : int
    smoothed_rms_m : float
        Largest horizontal error inside each outage, smoothed solution; RMS over the outages.
    forward_end_rms_m : float or None
        Horizontal error of the forward filter at the end of each outage, RMS.
    inside95_share : float
        Share of the outages whose largest error is inside 95 % of its sigma.
    rms_over_sigma : float
        RMS error over RMS sigma.
    seconds : float
        Replayed altogether.
    """

    length_s: float
    count: int
    smoothed_rms_m: float
    forward_end_rms_m: float | None
    inside95_share: float
    rms_over_sigma: float
    seconds: float


@dataclass(frozen=True)
class HeadingHypothesis:
    """Heading at start and end under one hypothesis.

    ``below_best`` is its log-likelihood below that of the best.
    """

    start_heading_deg: float
    end_heading_deg: float
    below_best: float


@dataclass(frozen=True)
class WrongSpan:
    """Span in which the on-board filter was wrong beyond 95 %.

    ``value`` is the median error in it, constant offset taken off; ``half95`` half of its 95 % interval, by the sigmas
    of the smoothed solution and of the offset. ``largest`` is the largest error in it.
    """

    start_s: float
    end_s: float
    value: float
    half95: float
    largest: float

    def over(self, quantity: Quantity) -> float:
        """Return what is sure of the error, over the one that a report opens with."""
        return (abs(self.value) - self.half95) / OPENING_ERROR[quantity]


@dataclass(frozen=True)
class OnboardError:
    """Error of the on-board filter in one quantity: its output minus the smoothed solution.

    Parameters
    ----------
    quantity : str
    unit : str
    samples : int
    offset, offset_sigma : float or None
        Constant over the log; None where none was looked for. It is never an error of the filter.
    offset_cause : str
        What a constant offset comes from; empty where it is not different from zero.
    offset_words : str
        "antenna or reference point 1.2 m forward, 0.3 m right".
    rms : float
        Of the rest; horizontal: of the vector.
    sigma_rms : float
        Of the smoothed solution at the same times.
    correlation_s : float
        Time for which its errors last.
    spans : tuple of WrongSpan
        The worst first.
    """

    quantity: Quantity
    unit: str
    samples: int
    offset: float | None
    offset_sigma: float | None
    offset_cause: OffsetCause
    offset_words: str
    rms: float
    sigma_rms: float
    correlation_s: float
    spans: tuple[WrongSpan, ...] = ()


@dataclass(frozen=True)
class OnboardErrors:
    """Errors of the on-board filter of one topic, by quantity.

    Parameters
    ----------
    topic : str
    rows : tuple of OnboardError
    delay_s, delay_sigma_s : float or None
        How much later than the inertial unit its stamps are, taken off; None where the motion does not tell.
    """

    topic: str
    rows: tuple[OnboardError, ...]
    delay_s: float | None = None
    delay_sigma_s: float | None = None

    def row(self, quantity: Quantity) -> OnboardError | None:
        """Return the row of a quantity, None where the filter does not log it."""
        return next((one for one in self.rows if one.quantity == quantity), None)


@dataclass(frozen=True)
class SeparationRow:
    """Difference of the forward filter from the smoothed solution in one quantity."""

    quantity: Quantity
    unit: str
    rms: float
    worst: float
    worst_s: float


@dataclass(frozen=True)
class BestTrajectory(Answer, StatesAlongTheFlight, ErrorsOfFilter):
    """Best trajectory of a flight, smoothed over raw inertial data and GNSS.

    Parameters
    ----------
    state : {'accepted', 'doubtful', 'ambiguous'}
        ``doubtful``: a check does not hold, so the sigmas may be too small. ``ambiguous``: a second heading explains
        the log nearly as well.
    reasons : tuple of str
        Why it is not accepted, each with its figure and limit.
    gates : tuple of Gate
        Checks that the state rests on.
    imu, gnss : str
        Topics.
    is_integral : bool
        The unit logs increments over time; else point samples.
    imu_rate_hz : float
    vehicle : str
        ``rolls``, ``flies``, ``walks`` or ``floats``; empty: not known.
    segments : tuple of TrajectorySegment
    moving_s : float
        Seconds in motion.
    mounting : UnitMounting
    accuracy : tuple of TrajectoryAccuracy
    raised : tuple of RaisedSigma
    noise : tuple of NoiseRow
    parameters : tuple of TrajectoryParameter
    innovations : tuple of InnovationRow
    held_out : tuple of HeldOutRow
    own_track : AgainstOwnTrack or None
    outages : tuple of OutageRow
    outage_truth : {'undisturbed solution', 'RTK'}
    hypotheses : tuple of HeadingHypothesis
        The best first; that of the solution.
    onboard : OnboardErrors or None
    separation : tuple of SeparationRow
    """

    analysis: ClassVar[str] = "trajectory"
    states_name: ClassVar[str] = analysis

    state: TrajectoryState
    reasons: tuple[str, ...]
    imu: str
    gnss: str
    is_integral: bool
    imu_rate_hz: float
    vehicle: str
    segments: tuple[TrajectorySegment, ...]
    moving_s: float
    mounting: UnitMounting
    accuracy: tuple[TrajectoryAccuracy, ...]
    gates: tuple[Gate, ...] = ()
    raised: tuple[RaisedSigma, ...] = ()
    noise: tuple[NoiseRow, ...] = ()
    parameters: tuple[TrajectoryParameter, ...] = ()
    innovations: tuple[InnovationRow, ...] = ()
    held_out: tuple[HeldOutRow, ...] = ()
    own_track: AgainstOwnTrack | None = None
    outages: tuple[OutageRow, ...] = ()
    outage_truth: OutageTruth = "undisturbed solution"
    hypotheses: tuple[HeadingHypothesis, ...] = ()
    onboard: OnboardErrors | None = None
    separation: tuple[SeparationRow, ...] = ()
    settings: dict[str, Any] = field(default_factory=dict)
    figures: tuple[FigureData, ...] = ()

    @property
    def start_s(self) -> float:
        """Flight time of the first state."""
        return self.segments[0].start_s

    @property
    def end_s(self) -> float:
        """Flight time of the last state."""
        return self.segments[-1].end_s

    @property
    def length_s(self) -> float:
        """Seconds of all segments together."""
        return sum(one.end_s - one.start_s for one in self.segments)

    def accuracy_of(self, quantity: Quantity) -> TrajectoryAccuracy | None:
        """Return the accuracy of a quantity, None where it has none."""
        return next((one for one in self.accuracy if one.quantity == quantity), None)

    def parameter(self, name: str) -> TrajectoryParameter | None:
        """Return the parameter of a name, None where the model has none."""
        return next((one for one in self.parameters if one.name == name), None)

    @property
    def gnss_topic(self) -> str:
        """Topic of the receiver it rests on."""
        return self.gnss

    @property
    def is_reference(self) -> bool:
        """Tell whether its checks hold, so that others may be set against it."""
        return self.state == "accepted"

    @property
    def by_it(self) -> str:
        """Words for what is found by it.

        Examples
        --------
        >>> heading = TrajectoryAccuracy("heading", "deg", 0.15, 0.4, 0.294)
        >>> mounting, segments = UnitMounting("case", ""), (TrajectorySegment(0.0, 60.0),)
        >>> BestTrajectory(
        ...     "accepted", (), "imu", "gnss", True, 100.0, "rolls", segments, 50.0, mounting, (heading,)
        ... ).by_it
        'by the best trajectory (heading to 0.29 deg)'
        """
        heading = self.accuracy_of("heading")
        told = "" if heading is None else f" (heading to {heading.median_within95:.2g} deg)"
        return f"by the best trajectory{told}"

    @property
    def states_title(self) -> str:
        """Title of its track, with what is doubtful of it."""
        told = "" if self.is_reference else f", {self.state}: {'; '.join(self.reasons)}"
        return f"best trajectory, smoothed{told}"

    @property
    def gnss_latency(self) -> tuple[float, float] | None:
        """Delay of the receiver behind the inertial unit and its sigma, s.

        None where it is not observable.
        """
        found = self.parameter(LATENCY)
        return None if found is None or not found.is_observable else (found.value, found.sigma)

    def velocity_latency(self, ins_topic: str) -> tuple[float, float] | None:
        """Return the delay of GNSS velocities behind the output of an INS and its sigma, s.

        Both stand against the inertial unit. None where the log does not show it, or the filter is another one's.
        """
        filter_, latency, lag = self.onboard, self.gnss_latency, self.parameter(VELOCITY_LAG)
        if filter_ is None or filter_.topic != ins_topic or filter_.delay_s is None or latency is None:
            return None
        value, sigma = latency
        if lag is not None:
            value, sigma = value + lag.value, math.hypot(sigma, lag.sigma)
        return value - filter_.delay_s, math.hypot(sigma, filter_.delay_sigma_s or 0.0)

    @property
    def antenna_arm_m(self) -> tuple[float, float, float]:
        """Antenna from the inertial unit: forward, right, down; 0 where it is not observable."""
        forward, right, down = (
            one.value if (one := self.parameter(name)) is not None and one.is_observable else 0.0 for name in ARM
        )
        return forward, right, down

    def body_states(self) -> BodyStates | None:
        """Return the states, None where they are not kept."""
        return found_in(self.figures, BodyStates)

    @property
    def filter_topic(self) -> str:
        """Topic of the filter whose errors are known.

        Empty where none are, or the checks do not hold.
        """
        return self.onboard.topic if self.onboard is not None and self.is_reference else ""

    def filter_errors(self) -> tuple[FilterError, ...]:
        """Return the errors of that filter by quantity."""
        rows = self.onboard.rows if self.onboard is not None and self.is_reference else ()
        whole_s = (self.start_s, self.end_s)
        return tuple(
            FilterError(
                row.quantity,
                row.unit,
                row.rms,
                row.sigma_rms,
                tuple(
                    FilterWrong((one.start_s, one.end_s), whole_s, one.value, one.half95, one.over(row.quantity))
                    for one in row.spans
                ),
                row.offset_words,
            )
            for row in rows
        )
