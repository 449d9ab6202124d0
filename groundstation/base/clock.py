"""Clock of a recorder as it is kept: start, steps, rate against other clocks of the log.

Times are text for people. Fields stand in alphabetical order, as the JSON of the MCAP has its keys.
"""

from dataclasses import dataclass, field
from typing import ClassVar, Literal

NUMBERS_ARE_KNOWN = True  # in the schema of summary.json: a float that is not optional is never null

Start = Literal["utc", "unset", "own_zero"]


@dataclass(frozen=True, kw_only=True)
class StepEntry:
    """One step of the recorder's clock.

    The records before it were moved by ``shift_of_earlier_s``. ``mistake`` names the cause where it is known.
    """

    kind: str = field(metadata={"one_of": ("backward", "forward")})
    mistake: str = field(metadata={"one_of": ("", "week_number", "leap_seconds")})
    record_index: int
    records_before: int
    set_s: float
    shift_of_earlier_s: float
    size_s: float


@dataclass(frozen=True, kw_only=True)
class SegmentEntry:
    """Stretch over which two clocks run at constant rates.

    ``offset`` and ``drift`` are text, with their sigmas. ``offset_s`` is the other clock less the recorder's. Drift is
    positive where the recorder is fast, None where it cannot be observed.
    """

    drift: str
    drift_ppm: float | None
    drift_sigma_ppm: float | None
    length_s: float
    offset: str
    offset_s: float
    offset_sigma_s: float
    samples: int = field(metadata={"least": 1})
    start: str


@dataclass(frozen=True, kw_only=True)
class BreakEntry:
    """Moment at which two clocks part: one was set (``step``) or changed its rate (``rate``)."""

    drift_change_ppm: float | None
    kind: str = field(metadata={"one_of": ("step", "rate")})
    step_s: float
    step_sigma_s: float
    time: str
    time_sigma_s: float


@dataclass(frozen=True, kw_only=True)
class MistakeEntry:
    """Named error of one of two clocks; ``time`` is None where it holds throughout."""

    kind: str = field(metadata={"one_of": ("week_number", "leap_seconds", "time_zone")})
    size_s: float
    text: str
    time: str | None


@dataclass(frozen=True, kw_only=True)
class RelationEntry:
    """Comparison of the recorder's clock with another clock of the log.

    ``reason`` says why nothing is known.
    """

    schema_name: ClassVar[str] = "clock_relation"

    breaks: tuple[BreakEntry, ...] = ()
    clock: str
    mistakes: tuple[MistakeEntry, ...] = ()
    reason: str
    residual_s: float
    resolution_s: float
    samples: int
    segments: tuple[SegmentEntry, ...] = ()
    source: str


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
    implausible_times: int = 0
    is_absolute: bool = False
    is_counting: bool = False
    is_unordered: bool = False
    missing_times: int = 0
    nominal_period_s: float = 0.0
    relations: tuple[RelationEntry, ...] = ()
    shift_s: float = 0.0
    stale_times: int = 0
    start: Start = "own_zero"
    steps: tuple[StepEntry, ...] = ()
    stray_rows: int = 0

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
