"""Answer of the GNSS reception: states, quality, scatter and jumps of every receiver."""

from collections.abc import Mapping
from dataclasses import field
from types import MappingProxyType
from typing import Any, ClassVar, Literal

from groundstation.base.dataclasses import dataclass
from groundstation.results.answer import Answer
from groundstation.results.figures import FigureData
from groundstation.results.frames import Brief
from groundstation.results.roles import WordsOfRecord

NUMBERS_ARE_KNOWN = True  # in the schema of summary.json: a float that is not optional is never null

Grade = Literal["unknown", "good", "warn", "bad"]  # unknown: what would tell is not logged
# States of a receiver, the best first: those of base.signals.FIXES, and what this analysis adds.
STATE_NAMES: Mapping[str, str] = MappingProxyType(
    {
        "rtk_fixed": "RTK fixed",
        "rtk_float": "RTK float",
        "ppp": "PPP",
        "dgnss": "DGNSS",
        "3d": "single (3D)",
        "gnss_ins": "GNSS with INS",
        "fix": "fix (kind not logged)",
        "2d": "2D",
        "other": "other",
        "dead_reckoning": "dead reckoning",
        "integrity_lost": "integrity lost",
        "none": "no fix",
        "no_record": "nothing recorded",
        "log_silent": "log paused",  # of all sensors
        "not_logged": "disarmed, not logged",  # and so by the autopilot's setting
    }
)
WITHOUT_RECORD = ("no_record", "log_silent")  # between rows: only the receiver is silent, or all of the log
NOT_LOGGED = "not_logged"  # no time of the receiver: it has no share, and is no loss
WITHOUT_FIX = ("dead_reckoning", "integrity_lost", "none")  # rows in them are time lost
NO_FIXES = (*WITHOUT_FIX, *WITHOUT_RECORD, NOT_LOGGED)
COARSE = 2.0  # times the scatter: a coarser step of the logged places hides it


@dataclass(frozen=True)
class FixState:
    """Time that a receiver spent in a state: seconds, share of its time, spells, the longest.

    Its time is the logged one: a pause of the log while disarmed has the share 0.
    ``claimed_m`` is the median sigma of the horizontal position that it claims in this state; None where it is not
    logged, or in fewer than ten rows.
    """

    state: str  #: Kind of fix.
    seconds: float  #: Time in it.
    share: float  #: Share of the receiver's time.
    spells: int  #: How often it was entered.
    longest_s: float  #: Longest spell.
    claimed_m: float | None = None  #: Median horizontal sigma claimed in it; null where not logged or too few.


@dataclass(frozen=True)
class FixLoss:
    """Time without a fix after the first one, or without a row.

    The latter is ``no_record`` or ``log_silent``. Speeds are those of the last fix before and of the first one after
    it; ``moved_m`` is between these.
    """

    state: str  #: no fix, no_record (the row is missing) or log_silent (the whole log is).
    start_s: float
    end_s: float
    seconds: float  #: Length of it.
    speed_before_mps: float | None  #: Speed of the last fix before.
    speed_after_mps: float | None  #: Speed of the first fix after.
    moved_m: float | None  #: Distance between these two.


@dataclass(frozen=True)
class PositionJump:
    """Step of the position that the velocity does not explain.

    ``along_m`` is its part along the motion; ``time_shift_s`` is set where all of it is along a fast motion: then the
    time stamp may be wrong by so much, and not the place.
    """

    time_s: float
    size_m: float  #: Length of the step.
    along_m: float | None  #: Part along the motion.
    up_m: float | None  #: Part upwards.
    state_before: str  #: Kind of fix before.
    state_after: str  #: Kind of fix after.
    time_shift_s: float | None = None  #: Error of the time stamp that explains the step; null where the place is wrong.


@dataclass(frozen=True)
class StandstillScatter:
    """Scatter of positions and velocities while the vehicle stood, beside the sigmas claimed.

    Parameters
    ----------
    start_s, end_s : float
    state : str
        The fix all the while.
    samples : int
    scatter_m, up_scatter_m : float
        Standard deviations about the mean; horizontal is north and east together, as sigmas are claimed.
    claimed_m, up_claimed_m : float or None
        Median sigmas that the receiver claims.
    correlation_s : float or None
        Time after which errors are correlated by less than 1/e, or the longer one by which means over a time scatter;
        None: longer than a tenth of the standstill, so that the scatter understates the error.
    independent : float
        Values that are independent of each other; 1 where the correlation is not known.
    speed_rms_mps, claimed_mps : float or None
        Speed shown while it stood, and the sigma claimed of the velocity.
    resolution_m : float
        Step in which positions are logged, 0 where none is seen.
    is_held : bool
        The receiver repeats one position: it holds it while it believes to stand.
    phase_start_s, phase_end_s : float or None
        Standstill of the overview that this lies in; None where the phases show none.
    averaged_s, averaged_scatter_m : float or None
        What a mean over the longest time is worth.
    """

    start_s: float
    end_s: float
    state: str
    samples: int  #: Number of positions.
    scatter_m: float  #: Horizontal standard deviation about the mean, north and east together.
    up_scatter_m: float | None  #: Vertical standard deviation about the mean.
    claimed_m: float | None  #: Median horizontal sigma that the receiver claims.
    up_claimed_m: float | None  #: Median vertical sigma that the receiver claims.
    correlation_s: float | None
    independent: float
    speed_rms_mps: float | None  #: RMS speed shown while it stood.
    claimed_mps: float | None  #: Median sigma of the velocity that the receiver claims.
    resolution_m: float
    is_held: bool
    #: Flight second at which the standstill of the overview begins; null without one.
    phase_start_s: float | None = None
    phase_end_s: float | None = None  #: Flight second at which the standstill of the overview ends.
    averaged_s: float | None = None  #: Longest time of which four means or more fit into the standstill.
    averaged_scatter_m: float | None = None  #: Horizontal standard deviation of the means over that time.

    @property
    def is_coarse(self) -> bool:
        """Tell whether the step in which positions are logged hides their scatter."""
        return not self.is_held and self.resolution_m > COARSE * self.scatter_m


@dataclass(frozen=True)
class VelocityAgainstPosition:
    """Velocity against differenced position.

    ``left_rms_mps`` is what the delay does not explain. ``lag_s`` positive: the velocity is later than the position
    by so much; None where the motion does not tell. ``lasting_rms_mps`` is the RMS of means over ten seconds: scatter
    of the position from fix to fix averages out of it; None without such a stretch.
    """

    seconds: float  #: Time compared.
    difference_rms_mps: float  #: RMS of velocity minus differenced position.
    left_rms_mps: float  #: RMS that the delay does not explain.
    lasting_rms_mps: float | None  #: RMS of the means over ten seconds; null without such a stretch.
    claimed_mps: float | None  #: Median sigma of the velocity that the receiver claims.
    lag_s: float | None  #: Positive: the velocity is later than the position; null where the motion does not tell.
    lag_sigma_s: float | None  #: Standard deviation of the delay.


@dataclass(frozen=True)
class GnssReceiver(Brief):
    """Reception of one receiver.

    Medians and shares are of time with a fix; ``*_low`` and ``*_high`` leave one twentieth of the time beyond them.
    Values that are not logged are None. ``lost_s`` is time without a fix after the first one, ``silent_s`` time without
    a row; ``placeless_rows`` claim a fix without a place or a velocity. ``standstill`` is the longest one,
    ``standstills`` the longest of each kind of fix, the best kind first. ``hdop_of`` is the NMEA topic that HDOP comes
    from, empty where it is a field of the receiver's rows.
    """

    topic: str  #: Topic of the receiver.
    start_s: float  #: Flight second of its first row.
    end_s: float  #: Flight second of its last row.
    rows: int  #: Rows logged.
    rate_hz: float | None  #: Usual rows a second.
    repeated_rows: int  #: Rows that repeat an epoch.
    missed_epochs: int | None  #: Epochs that its rate expects and the log lacks.
    is_kind_logged: bool  #: Whether the kind of fix is logged.
    placeless_rows: int  #: Rows that claim a fix without a place or a velocity.
    states: tuple[FixState, ...]  #: Time in each kind of fix.
    first_fix_s: float | None  #: Flight second of the first fix; null without any.
    fix_share: float  #: Share of its time with a fix.
    lost_s: float  #: Time without a fix after the first one.
    silent_s: float  #: Time without a row after the first fix.
    losses: tuple[FixLoss, ...]  #: Every time without a fix or row.
    satellites_used: float | None  #: Median of the satellites used.
    satellites_used_low: float | None  #: Satellites used that 95 % of the time exceeds.
    satellites_tracked: float | None  #: Median of the satellites tracked.
    cn0_dbhz: float | None  #: Median carrier to noise density.
    cn0_low_dbhz: float | None  #: Carrier to noise density that 95 % of the time exceeds.
    hdop: float | None  #: Median of the horizontal dilution of precision.
    hdop_high: float | None  #: HDOP that 95 % of the time stays below.
    pdop: float | None  #: Median of the position dilution of precision.
    pdop_high: float | None  #: PDOP that 95 % of the time stays below.
    age_of_corrections_s: float | None  #: Median age of the corrections.
    age_of_corrections_high_s: float | None  #: Age that 95 % of the time stays below.
    horizontal_sigma_m: float | None  #: Median horizontal sigma that the receiver claims.
    vertical_sigma_m: float | None  #: Median vertical sigma that the receiver claims.
    velocity_sigma_mps: float | None  #: Median sigma of the velocity that it claims.
    standstill: StandstillScatter | None  #: Scatter over the longest standstill; null without one.
    motion: VelocityAgainstPosition | None  #: Velocity against differenced position; null without motion.
    jumps: tuple[PositionJump, ...]  #: Largest steps of the position that the velocity does not explain.
    jumps_found: int  #: Number of such steps.
    behind_ins_s: float | None  #: How much later than the INS it shows the motion; null where not observable.
    behind_ins_sigma_s: float | None  #: Standard deviation of that delay.
    standstills: tuple[StandstillScatter, ...] = ()  #: Longest standstill of each kind of fix, the best first.
    hdop_of: str = ""  #: NMEA topic that HDOP comes from; empty where it is the receiver's own.

    @property
    def fixes(self) -> tuple[FixState, ...]:
        """States with a fix, the best first."""
        return tuple(one for one in self.states if one.state not in NO_FIXES)

    @property
    def not_logged_s(self) -> float:
        """Seconds between its rows in which the log paused while disarmed."""
        return sum(one.seconds for one in self.states if one.state == NOT_LOGGED)

    @property
    def told_standstill(self) -> StandstillScatter | None:
        """Standstill of which the sentence speaks: of the kind of fix held most, else the longest."""
        most = max(self.fixes, key=lambda one: one.seconds, default=None)
        mine = [one for one in self.standstills if most is not None and one.state == most.state]
        return mine[0] if mine else self.standstill

    def share(self, *states: str) -> float:
        """Share of its time in some states."""
        return sum(one.share for one in self.states if one.state in states)

    def share_after_first_fix(self, *states: str) -> float:
        """Share of the recorded time after the first fix in some states."""
        before_s = 0.0 if self.first_fix_s is None else self.first_fix_s - self.start_s
        unrecorded = (*WITHOUT_RECORD, NOT_LOGGED)
        every = [(one.state, one.seconds) for one in self.states if one.state not in unrecorded]
        fixed_s = sum(seconds for state, seconds in every if state not in WITHOUT_FIX)
        whole_s = max(
            sum(seconds for _state, seconds in every) - before_s, fixed_s
        )  # nothing recorded counts in neither
        if not whole_s > 0.0:
            return self.share(*states)
        return sum(seconds for state, seconds in every if state in states) / whole_s


@dataclass(frozen=True)
class ReceiverPair:
    """Second receiver against the first, where both had a fix.

    ``distance_m`` is the median distance of their places in the plane, ``distance_scatter_m`` its scatter: of two
    antennas on one vehicle the distance is constant. ``forward_m`` and ``right_m`` are where the second antenna is from
    the first, by the track of the moving vehicle; ``lag_s`` how much later the second one shows the motion.
    """

    first: str  #: Topic of one receiver.
    second: str  #: Topic of the other.
    seconds: float  #: Time with a fix of both.
    distance_m: float  #: Median distance in the plane.
    distance_scatter_m: float  #: Scatter of the distance: of two antennas on one vehicle it is constant.
    up_m: float | None  #: Second above first, median.
    up_scatter_m: float | None  #: Scatter of the height difference.
    claimed_m: float | None  #: Horizontal sigma that both claim together.
    velocity_difference_rms_mps: float | None  #: RMS of the difference of their velocities.
    forward_m: float | None  #: Second antenna ahead of the first, by the track.
    right_m: float | None  #: Second antenna right of the first, by the track.
    lag_s: float | None  #: How much later the second shows the motion.
    lag_sigma_s: float | None  #: Standard deviation of that delay.


@dataclass(frozen=True)
class ReceiverTexts:
    """Texts of the receiver in one topic: how many, how many differ, the first one."""

    topic: str
    count: int  #: Texts logged.
    different: int  #: Different ones.
    first: str  #: The first text.


TELLING = frozenset(("rtk_fixed", "rtk_float", "ppp", "dgnss", "2d", "dead_reckoning"))
LEAST_TOLD = 0.2  # share of a kind of fix that is worth a word


@dataclass(frozen=True)
class GnssReception(Answer, WordsOfRecord):
    """Reception of all receivers of a flight.

    ``main`` is the topic of the one with the most time with a fix, of which ``sentence`` speaks; ``reasons`` say what
    the grade rests on. ``has_heading_source`` is False where the log has one receiver alone.
    """

    analysis: ClassVar[str] = "gnss"

    grade: Grade  #: good, warn or bad; unknown where nothing tells.
    sentence: str  #: Summary for people, of the main receiver.
    reasons: tuple[str, ...]  #: What the grade rests on.
    main: str  #: Topic of the receiver with the most time with a fix.
    receivers: tuple[GnssReceiver, ...]  #: Reception of each receiver.
    pairs: tuple[ReceiverPair, ...] = ()  #: Every two receivers against each other.
    texts: tuple[ReceiverTexts, ...] = ()  #: What the receivers wrote as text.
    has_heading_source: bool = True  #: False where the log has one receiver alone and nothing with a heading.
    settings: dict[str, Any] = field(default_factory=dict)
    figures: tuple[FigureData, ...] = ()

    @property
    def receiver(self) -> GnssReceiver:
        """The one of which the sentence speaks."""
        return next(one for one in self.receivers if one.topic == self.main)

    @property
    def against(self) -> str:
        """First reason against the reception that the sentence does not tell; empty without one."""
        reasons = self.reasons if self.grade in ("warn", "bad") else ()
        return next((one for one in reasons if not one.startswith("RTK not fixed") and one not in self.sentence), "")

    @property
    def line(self) -> str:
        """The sentence, behind what is against the reception."""
        return "; ".join(filter(None, (self.against, self.sentence)))

    @property
    def words_of_record(self) -> Mapping[str, str]:
        """Kind of fix that held most, where it is no ordinary one: "RTK fixed 65 %"."""
        if self.receiver.first_fix_s is None:
            return {"gnss": "never a fix"}
        states = [one for one in self.receiver.states if one.state in TELLING]
        best = max(states, key=lambda one: one.share, default=None)
        if best is None or best.share < LEAST_TOLD:
            return {}
        return {"gnss": f"{STATE_NAMES[best.state]} {100.0 * best.share:.0f} %"}
