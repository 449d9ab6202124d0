"""Clock of a recorder as it is kept: start, steps, rate against other clocks of the log.

Times are text for people. Fields stand in alphabetical order, as the JSON of the MCAP has its keys.
"""

from dataclasses import field
from typing import ClassVar, Literal

from groundstation.base.dataclasses import dataclass

NUMBERS_ARE_KNOWN = True  # in the schema of summary.json: a float that is not optional is never null

Start = Literal["utc", "unset", "own_zero"]


@dataclass(frozen=True, kw_only=True)
class StepEntry:
    """One step of the recorder's clock.

    The records before it were moved by ``shift_of_earlier_s``. ``mistake`` names the cause where it is known.
    """

    kind: str = field(metadata={"one_of": ("backward", "forward")})  #: backward or forward jump of the clock.
    #: Cause where it is known, else empty.
    mistake: str = field(metadata={"one_of": ("", "week_number", "leap_seconds")})
    record_index: int  #: Place of the first record after it.
    records_before: int  #: Timed records since the step before.
    set_s: float  #: By how much the clock was set: the step less the nominal time between both records.
    shift_of_earlier_s: float  #: Seconds added to the records before it.
    size_s: float  #: Device time after the step minus device time before it.


@dataclass(frozen=True, kw_only=True)
class SegmentEntry:
    """Stretch over which two clocks run at constant rates.

    ``offset`` and ``drift`` are text, with their sigmas. ``offset_s`` is the other clock less the recorder's. Drift is
    positive where the recorder is fast, None where it cannot be observed.
    """

    drift: str  #: Drift with its sigma, for people.
    #: Parts per million, positive where the recorder is fast; null where it cannot be observed.
    drift_ppm: float | None
    drift_sigma_ppm: float | None  #: Standard deviation of the drift.
    length_s: float  #: From the first pair to the last.
    offset: str  #: Offset with its sigma, for people.
    offset_s: float  #: Other clock less the recorder's.
    offset_sigma_s: float  #: Standard deviation of the offset.
    samples: int = field(metadata={"least": 1})
    start: str  #: When it begins, for people.


@dataclass(frozen=True, kw_only=True)
class BreakEntry:
    """Moment at which two clocks part: one was set (``step``) or changed its rate (``rate``)."""

    drift_change_ppm: float | None  #: Rate after less rate before.
    kind: str = field(metadata={"one_of": ("step", "rate")})  #: step: one clock was set; rate: one changed its rate.
    step_s: float  #: Offset after less offset before.
    step_sigma_s: float  #: Standard deviation of the step.
    time: str  #: When, for people.
    time_sigma_s: float  #: Standard deviation of that time.


@dataclass(frozen=True, kw_only=True)
class MistakeEntry:
    """Named error of one of two clocks; ``time`` is None where it holds throughout."""

    #: GPS week number, leap seconds or time zone.
    kind: str = field(metadata={"one_of": ("week_number", "leap_seconds", "time_zone")})
    size_s: float  #: By how much the clock is wrong.
    text: str  #: One line for people.
    time: str | None  #: From when; null where it holds throughout.


@dataclass(frozen=True, kw_only=True)
class RelationEntry:
    """Comparison of the recorder's clock with another clock of the log.

    ``reason`` says why nothing is known.
    """

    schema_name: ClassVar[str] = "clock_relation"

    breaks: tuple[BreakEntry, ...] = ()  #: Moments at which the clocks part.
    clock: str  #: The other clock, in words.
    mistakes: tuple[MistakeEntry, ...] = ()  #: Known errors of either clock.
    reason: str  #: Why nothing is known; empty where something is.
    residual_s: float  #: RMS of what the segments leave unexplained.
    resolution_s: float  #: Step in which the other clock is logged.
    samples: int  #: Pairs of readings compared.
    segments: tuple[SegmentEntry, ...] = ()  #: Stretches of constant rate.
    source: str  #: Topic that holds the other clock.


@dataclass(frozen=True, kw_only=True)
class Clock:
    """The recorder's clock, as it was read and repaired.

    Parameters
    ----------
    first_device_time : str
        Reading of the clock at the first record; empty where nothing is known of the clock.
    is_absolute : bool
        True where corrected time is UTC.
    is_counting : bool
        Records of several sources may share a time.
    shift_s : float
        Seconds added to all times so that none is negative.
    start : {'utc', 'unset', 'own_zero'}
        Where it began: at a date, at one before its recorder can have been built, or at its own zero.
    """

    first_device_time: str = ""
    implausible_times: int = 0  #: Records with a time that cannot be true, placed by their neighbours.
    is_absolute: bool = False
    is_counting: bool = False
    is_unordered: bool = False  #: Whether so many records are out of order that all were sorted.
    missing_times: int = 0  #: Records without a time.
    nominal_period_s: float = 0.0  #: Usual step between timed records.
    relations: tuple[RelationEntry, ...] = ()  #: Comparison with every other clock in the log.
    shift_s: float = 0.0
    stale_times: int = 0  #: Records of a counting clock with the time of an earlier publication.
    start: Start = "own_zero"
    steps: tuple[StepEntry, ...] = ()  #: Jumps of the clock, each repaired as it says.
    stray_rows: int = 0  #: Records out of order with a time that is believed.

    def __repr__(self) -> str:
        kind = "UTC" if self.is_absolute else "no UTC"
        odd = {
            "steps": len(self.steps),
            "missing": self.missing_times,
            "implausible": self.implausible_times,
            "stale": self.stale_times,
        }
        told = [f"{count} {name}" for name, count in odd.items() if count]
        beside = f", beside {', '.join(dict.fromkeys(one.clock for one in self.relations))}" if self.relations else ""
        began = f" from {self.first_device_time}" if self.first_device_time else ""
        return f"<Clock: {kind}{began}; {', '.join(told) or 'no odd times'}{beside}>"
