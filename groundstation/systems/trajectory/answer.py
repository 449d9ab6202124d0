"""Answer of the best trajectory: state, accuracy, checks, errors of the on-board filter."""

import math
from dataclasses import field
from typing import Any, ClassVar, Literal

from groundstation.base.dataclasses import dataclass
from groundstation.base.quantiles import NORMAL_95
from groundstation.results.answer import Answer
from groundstation.results.arrays.states import BodyStates
from groundstation.results.arrays.typed import found_in
from groundstation.results.figures import FigureData
from groundstation.results.gates import Gate
from groundstation.results.roles import ErrorsOfFilter, FilterError, FilterWrong, StatesAlongTheFlight
from groundstation.systems.trajectory.aids_answer import AidRow
from groundstation.systems.trajectory.checks_answer import (
    AgainstOwnTrack,
    HeadingHypothesis,
    HeldOutRow,
    InnovationRow,
    OutageRow,
    OutageTruth,
    RaisedSigma,
    SeparationRow,
)
from groundstation.systems.trajectory.onboard_answer import OnboardErrors
from groundstation.systems.trajectory.quantity_answer import Quantity

NUMBERS_ARE_KNOWN = True  # in the schema of summary.json: a float that is not optional is never null

TrajectoryState = Literal["accepted", "doubtful", "ambiguous"]
MountingSource = Literal["stated", "logged", "found", "case"]
# Names of parameters that others read: of the lever arm, and of the receiver's delay.
ARM = ("antenna forward of the unit", "antenna right of the unit", "antenna down of the unit")
TRAVEL = ("travel in the unit, yaw", "travel in the unit, pitch")
LATENCY, VELOCITY_LAG = "GNSS latency", "GNSS velocity behind its position"
STARTED_BY_SEARCH = ("latency", "mounting")  # groups of parameters whose first value is not zero


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
    off_deg : float or None
        Angle of the travel from forward of these axes, where what rolls shows that the unit stands turned in the
        vehicle beyond 95 %: the attitude is then that of the unit. None else, and where the mounting is stated.
    to_state_deg : three floats or None
        ``imu_mounting_deg`` of the aircraft file that takes that angle off.
    """

    source: MountingSource
    words: str
    roll_deg: float = 0.0  #: Roll of the case in the body.
    pitch_deg: float = 0.0  #: Pitch of the case in the body.
    yaw_deg: float = 0.0  #: Yaw of the case in the body, clockwise.
    sigma_deg: float | None = None
    off_deg: float | None = None
    to_state_deg: tuple[float, float, float] | None = None


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

    quantity: Quantity  #: Quantity that the sigmas are of.
    unit: str
    median_sigma: float  #: Median over time; horizontal: both axes together.
    worst_sigma: float  #: Largest over time.
    median_within95: float
    worst_s: float | None = None


@dataclass(frozen=True)
class NoiseRow:
    """One noise of the model: prior of its class, value fitted to the log.

    ``is_at_bound``: the fit stopped at the bound that the class allows.
    """

    name: str  #: Noise for people.
    unit: str
    prior: float  #: Value of the class.
    fitted: float  #: Value that the log shows.
    is_at_bound: bool = False  #: The fit stopped at the bound that the class allows.


@dataclass(frozen=True)
class TrajectoryParameter:
    """Parameter of the model: value, sigma, and the sigma it started with.

    ``is_observable`` is false where the data hardly narrow it. ``group`` is the name without its axis: "gyro bias".
    """

    name: str  #: Parameter with its axis.
    group: str  #: Name without its axis.
    unit: str
    value: float  #: Estimate over the log.
    sigma: float  #: Its standard deviation.
    start_sigma: float  #: Standard deviation before the log was seen.
    is_observable: bool  #: False where the data say nothing of it.

    @property
    def is_far(self) -> bool:
        """Tell whether it is beyond the 95 % assumed at first, yet not observable.

        It is coupled with others.
        """
        starts_at_zero = self.group not in STARTED_BY_SEARCH
        return starts_at_zero and not self.is_observable and abs(self.value) > NORMAL_95 * self.start_sigma


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
    aids : tuple of AidRow
        Barometer, wheels, magnetic heading of the log, used or not.
    onboard : OnboardErrors or None
        Of the filter that flew the vehicle, where the log tells it.
    other_filters : tuple of OnboardErrors
        Of further ones: other INSs, lanes of the autopilot.
    separation : tuple of SeparationRow
    """

    analysis: ClassVar[str] = "trajectory"
    states_name: ClassVar[str] = analysis

    state: TrajectoryState
    reasons: tuple[str, ...]
    imu: str  #: Topic of the inertial unit.
    gnss: str  #: Topic of the GNSS.
    is_integral: bool
    imu_rate_hz: float  #: Samples of the inertial unit a second.
    vehicle: str
    segments: tuple[TrajectorySegment, ...]  #: Stretches without a gap of the inertial unit.
    moving_s: float
    mounting: UnitMounting  #: Angles of the unit in the body.
    accuracy: tuple[TrajectoryAccuracy, ...]  #: Sigmas of each quantity over the flight.
    gates: tuple[Gate, ...] = ()
    raised: tuple[RaisedSigma, ...] = ()  #: Factors by which sigmas were raised, and why.
    noise: tuple[NoiseRow, ...] = ()  #: Noise of the model as the log shows it.
    parameters: tuple[TrajectoryParameter, ...] = ()  #: Biases, arms and delays that the log shows.
    innovations: tuple[InnovationRow, ...] = ()  #: Whether each sensor fits what its covariance expects.
    held_out: tuple[HeldOutRow, ...] = ()  #: Agreement with GNSS that the solution has not seen.
    own_track: AgainstOwnTrack | None = None  #: Heading against the track of what rolls; null else.
    outages: tuple[OutageRow, ...] = ()  #: Error after replayed losses of GNSS, by length.
    outage_truth: OutageTruth = "undisturbed solution"  #: What the replayed outages are judged by.
    hypotheses: tuple[HeadingHypothesis, ...] = ()
    aids: tuple[AidRow, ...] = ()
    onboard: OnboardErrors | None = None
    other_filters: tuple[OnboardErrors, ...] = ()
    separation: tuple[SeparationRow, ...] = ()  #: Forward filter against the smoothed solution.
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
    def unit_topic(self) -> str:
        """Topic of the inertial unit it rests on."""
        return self.imu

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
        every = () if self.onboard is None else (self.onboard, *self.other_filters)
        filter_ = next((one for one in every if one.topic == ins_topic), None)
        latency, lag = self.gnss_latency, self.parameter(VELOCITY_LAG)
        if filter_ is None or filter_.delay_s is None or latency is None:
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
    def filter_topics(self) -> tuple[str, ...]:
        """Topics of the filters whose errors are known.

        None are where the checks do not hold.
        """
        return tuple(one.topic for one in self._filters)

    @property
    def _filters(self) -> tuple[OnboardErrors, ...]:
        return (self.onboard, *self.other_filters) if self.onboard is not None and self.is_reference else ()

    def filter_errors(self, topic: str) -> tuple[FilterError, ...]:
        """Return the errors of a filter by quantity."""
        found = next((one for one in self._filters if one.topic == topic), None)
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
                row.changed,
            )
            for row in (() if found is None else found.rows)
        )
