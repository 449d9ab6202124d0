"""Answer of the GNSS reception: states, quality, scatter and jumps of every receiver."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any, ClassVar, Literal

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

    state: str
    seconds: float
    share: float
    spells: int
    longest_s: float
    claimed_m: float | None = None


@dataclass(frozen=True)
class FixLoss:
    """Time without a fix after the first one, or without a row.

    The latter is ``no_record`` or ``log_silent``. Speeds are those of the last fix before and of the first one after
    it; ``moved_m`` is between these.
    """

    state: str
    start_s: float
    end_s: float
    seconds: float
    speed_before_mps: float | None
    speed_after_mps: float | None
    moved_m: float | None


@dataclass(frozen=True)
class PositionJump:
    """Step of the position that the velocity does not explain.

    ``along_m`` is its part along the motion; ``time_shift_s`` is set where all of it is along a fast motion: then the
    time stamp may be wrong by so much, and not the place.
    """

    time_s: float
    size_m: float
    along_m: float | None
    up_m: float | None
    state_before: str
    state_after: str
    time_shift_s: float | None = None


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
        Time after which errors are correlated by less than 1/e; None: longer than a tenth of the standstill, so that
        the scatter understates the error.
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
    """

    start_s: float
    end_s: float
    state: str
    samples: int
    scatter_m: float
    up_scatter_m: float | None
    claimed_m: float | None
    up_claimed_m: float | None
    correlation_s: float | None
    independent: float
    speed_rms_mps: float | None
    claimed_mps: float | None
    resolution_m: float
    is_held: bool
    phase_start_s: float | None = None
    phase_end_s: float | None = None

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

    seconds: float
    difference_rms_mps: float
    left_rms_mps: float
    lasting_rms_mps: float | None
    claimed_mps: float | None
    lag_s: float | None
    lag_sigma_s: float | None


@dataclass(frozen=True)
class GnssReceiver(Brief):
    """Reception of one receiver.

    Medians and shares are of time with a fix; ``*_low`` and ``*_high`` leave one twentieth of the time beyond them.
    Values that are not logged are None. ``lost_s`` is time without a fix after the first one, ``silent_s`` time without
    a row; ``placeless_rows`` claim a fix without a place or a velocity. ``standstill`` is the longest one,
    ``standstills`` the longest of each kind of fix, the best kind first. ``hdop_of`` is the NMEA topic that HDOP comes
    from, empty where it is a field of the receiver's rows.
    """

    topic: str
    start_s: float
    end_s: float
    rows: int
    rate_hz: float | None
    repeated_rows: int
    missed_epochs: int | None
    is_kind_logged: bool
    placeless_rows: int
    states: tuple[FixState, ...]
    first_fix_s: float | None
    fix_share: float
    lost_s: float
    silent_s: float
    losses: tuple[FixLoss, ...]
    satellites_used: float | None
    satellites_used_low: float | None
    satellites_tracked: float | None
    cn0_dbhz: float | None
    cn0_low_dbhz: float | None
    hdop: float | None
    hdop_high: float | None
    pdop: float | None
    pdop_high: float | None
    age_of_corrections_s: float | None
    age_of_corrections_high_s: float | None
    horizontal_sigma_m: float | None
    vertical_sigma_m: float | None
    velocity_sigma_mps: float | None
    standstill: StandstillScatter | None
    motion: VelocityAgainstPosition | None
    jumps: tuple[PositionJump, ...]
    jumps_found: int
    behind_ins_s: float | None
    behind_ins_sigma_s: float | None
    standstills: tuple[StandstillScatter, ...] = ()
    hdop_of: str = ""

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

    first: str
    second: str
    seconds: float
    distance_m: float
    distance_scatter_m: float
    up_m: float | None
    up_scatter_m: float | None
    claimed_m: float | None
    velocity_difference_rms_mps: float | None
    forward_m: float | None
    right_m: float | None
    lag_s: float | None
    lag_sigma_s: float | None


@dataclass(frozen=True)
class ReceiverTexts:
    """Texts of the receiver in one topic: how many, how many differ, the first one."""

    topic: str
    count: int
    different: int
    first: str


TELLING = frozenset(("rtk_fixed", "rtk_float", "ppp", "dgnss", "2d", "dead_reckoning"))
LEAST_TOLD = 0.2  # share of a kind of fix that is worth a word


@dataclass(frozen=True)
class GnssReception(Answer, WordsOfRecord):
    """Reception of all receivers of a flight.

    ``main`` is the topic of the one with the most time with a fix, of which ``sentence`` speaks; ``reasons`` say what
    the grade rests on. ``has_heading_source`` is False where the log has one receiver alone.
    """

    analysis: ClassVar[str] = "gnss"

    grade: Grade
    sentence: str
    reasons: tuple[str, ...]
    main: str
    receivers: tuple[GnssReceiver, ...]
    pairs: tuple[ReceiverPair, ...] = ()
    texts: tuple[ReceiverTexts, ...] = ()
    has_heading_source: bool = True
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
        share = min(self.receiver.share_after_first_fix(best.state), 1.0)
        return {"gnss": f"{STATE_NAMES[best.state]} {100.0 * share:.0f} %"}
