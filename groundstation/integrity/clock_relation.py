"""Relation of a recorder's clock to another clock of the log, in figures and in words."""

from collections.abc import Callable

from groundstation.base.clock import BreakEntry, MistakeEntry, RelationEntry, SegmentEntry
from groundstation.base.dataclasses import dataclass
from groundstation.base.timescales import (
    ROLLOVER_WEEKS,
    leap_seconds_at,
    leap_seconds_late,
    utc_ns_to_iso,
    whole_weeks,
)
from groundstation.base.units import NS_PER_S

WEEK_S, ROLLOVER_S, QUARTER_S = 604_800, 1_024 * 604_800, 900  # time zones are multiples of a quarter of an hour
_NEAR_S = 0.35  # largest distance from whole seconds: receivers are late by less
_LEAP_S = range(13, 21)  # GPS time less UTC since 1999, and for some years to come
_MISTAKES = {
    "leap_seconds": "{seconds:+.2f} s: equal to the leap seconds between GPS time and UTC",
    "time_zone": "{seconds:+.2f} s: whole quarters of an hour, as between time zones",
}


@dataclass(frozen=True)
class ClockSegment:
    """A stretch over which two clocks run at constant rates.

    Parameters
    ----------
    start_ns, end_ns : int
        Corrected recorder time of its first and last sample.
    samples : int
    offset_ns : int
        Reference minus recorder in the middle of the segment.
    offset_sigma_s : float
        One standard error.
    drift_ppm : float or None
        Rate of the recorder's clock less that of the reference, millionths; positive: the recorder is fast. None where
        it cannot be observed.
    drift_sigma_ppm : float or None
        One standard error; None of too few samples.
    """

    start_ns: int
    end_ns: int
    samples: int
    offset_ns: int
    offset_sigma_s: float
    drift_ppm: float | None = None
    drift_sigma_ppm: float | None = None

    @property
    def length_s(self) -> float:
        """Seconds from its first to its last sample."""
        return (self.end_ns - self.start_ns) / NS_PER_S


@dataclass(frozen=True)
class ClockBreak:
    """Moment at which two clocks part: one was set, or changed its rate.

    Parameters
    ----------
    time_ns : int
        Corrected recorder time.
    time_sigma_s : float
        One standard error.
    kind : {'step', 'rate'}
    step_s : float
        Step of reference minus recorder; 0 for a change of rate.
    step_sigma_s : float
    drift_change_ppm : float or None
        Drift after less drift before, where both are observed.
    """

    time_ns: int
    time_sigma_s: float
    kind: str
    step_s: float
    step_sigma_s: float
    drift_change_ppm: float | None = None


@dataclass(frozen=True)
class Mistake:
    """An error of one of two clocks that has a name.

    Parameters
    ----------
    kind : {'week_number', 'leap_seconds', 'time_zone'}
    size_s : float
        Reference minus recorder, or the step of it.
    time_ns : int or None
        Corrected time of the step, or of the first of the readings; None when it holds throughout, or at the end.
    readings : int
        Number of readings that have it, where it is neither a step nor holds at the end; they are left out of all else.
    """

    kind: str
    size_s: float
    time_ns: int | None = None
    readings: int = 0

    @property
    def text(self) -> str:
        """Describe the mistake in words.

        Examples
        --------
        >>> Mistake("week_number", -604_800.0, 0, readings=4).text
        '4 readings of one week: GPS week number off by -1 week, as before a receiver knows it'
        """
        if self.kind == "week_number":
            return self._of_weeks
        if self.kind == "leap_seconds" and round(abs(self.size_s)) not in _LEAP_S:
            return f"{self.size_s:+.2f} s: whole seconds, as where a receiver learns the leap seconds"
        return _MISTAKES[self.kind].format(seconds=self.size_s)

    @property
    def _of_weeks(self) -> str:
        weeks = round(self.size_s / WEEK_S)
        why = "as before a receiver knows it" if weeks % ROLLOVER_WEEKS else "it rolls over every 1024"
        text = f"GPS week number off by {weeks:+d} week{'s' if abs(weeks) > 1 else ''}"
        text += f", {why}" if weeks % ROLLOVER_WEEKS else f" ({why})"
        of_readings = f"{self.readings} reading{'s' if self.readings > 1 else ''} of one week: "
        return of_readings + text if self.readings else text


@dataclass(frozen=True)
class ClockRelation:
    """Comparison of the recorder's corrected clock with another clock.

    Parameters
    ----------
    clock : str
        The other: ``gnss``, ``ins``.
    source : str
        Topic and field that tell it.
    samples : int
        Readings that were used.
    segments : tuple of ClockSegment
    breaks : tuple of ClockBreak
        One between two segments.
    residual_s : float
        Scatter about the segments: 1.4826 times the median.
    resolution_s : float
        Step to which a reading may be rounded.
    is_utc, is_absolute : bool
        True where the other clock tells UTC, and its date too.
    mistakes : tuple of Mistake
    reason : str
        Why nothing is known.
    """

    clock: str
    source: str
    samples: int = 0
    segments: tuple[ClockSegment, ...] = ()
    breaks: tuple[ClockBreak, ...] = ()
    residual_s: float = 0.0
    resolution_s: float = 0.0
    is_utc: bool = False
    is_absolute: bool = False
    mistakes: tuple[Mistake, ...] = ()
    reason: str = ""

    @property
    def name(self) -> str:
        """Name of the other clock for people."""
        return f"{self.clock.upper()} time ({self.source})"

    def offset_text(self, segment: ClockSegment, *, has_utc: bool) -> str:
        """Reference minus recorder; of a recorder without UTC, the UTC of its zero."""
        sigma = f"± {_figure(segment.offset_sigma_s)} s"
        if self.is_absolute and not has_utc:
            return f"zero at {utc_ns_to_iso(segment.offset_ns)} {sigma}"
        return f"{segment.offset_ns / NS_PER_S:+.{_places(segment.offset_sigma_s)}f} {sigma}"

    def drift_text(self, segment: ClockSegment) -> str:
        """Rate of the recorder's clock, or why it is not known."""
        sigma = segment.drift_sigma_ppm
        if sigma is None:
            return f"not observable: {segment.samples} readings in {segment.length_s:.1f} s"
        if segment.drift_ppm is None:
            why = f"readings scatter by {_figure(self.residual_s)} s"
            if self.resolution_s > self.residual_s:
                why = f"readings are rounded to {_figure(self.resolution_s)} s"
            return f"not observable to better than ± {_figure(sigma)} ppm: {why} in {segment.length_s:.1f} s"
        return f"{segment.drift_ppm:+.{_places(sigma)}f} ± {_figure(sigma)} ppm"

    def entry(self, text: Callable[[int], str], *, has_utc: bool) -> RelationEntry:
        """Return the form to keep: seconds to the microsecond, rates to a thousandth of a ppm.

        ``text`` writes a time.
        """
        return RelationEntry(
            clock=self.clock,
            source=self.source,
            samples=self.samples,
            reason=self.reason,
            resolution_s=round(self.resolution_s, 6),
            residual_s=round(self.residual_s, 6),
            segments=tuple(self._segment_entry(one, text, has_utc) for one in self.segments),
            breaks=tuple(_break_entry(one, text) for one in self.breaks),
            mistakes=tuple(_mistake_entry(one, text) for one in self.mistakes),
        )

    def _segment_entry(self, one: ClockSegment, text: Callable[[int], str], has_utc: bool) -> SegmentEntry:
        return SegmentEntry(
            start=text(one.start_ns),
            length_s=round(one.length_s, 3),
            samples=one.samples,
            offset_s=round(one.offset_ns / NS_PER_S, 6),
            offset_sigma_s=round(one.offset_sigma_s, 6),
            drift_ppm=_rounded(one.drift_ppm),
            drift_sigma_ppm=_rounded(one.drift_sigma_ppm),
            offset=self.offset_text(one, has_utc=has_utc),
            drift=self.drift_text(one),
        )


def _break_entry(one: ClockBreak, text: Callable[[int], str]) -> BreakEntry:
    return BreakEntry(
        time=text(one.time_ns),
        time_sigma_s=round(one.time_sigma_s, 3),
        kind=one.kind,
        step_s=round(one.step_s, 6),
        step_sigma_s=round(one.step_sigma_s, 6),
        drift_change_ppm=_rounded(one.drift_change_ppm),
    )


def _mistake_entry(one: Mistake, text: Callable[[int], str]) -> MistakeEntry:
    time = None if one.time_ns is None else text(one.time_ns)
    return MistakeEntry(kind=one.kind, size_s=round(one.size_s, 3), time=time, text=one.text)


def mistake_of_step(size_s: float, utc_ns: int) -> str:
    """Name of a step of UTC, empty where it has none.

    Examples
    --------
    >>> mistake_of_step(-18.02, 1_777_874_400_000_000_000), mistake_of_step(619_315_200.1, 0), mistake_of_step(-5.0, 0)
    ('leap_seconds', 'week_number', '')
    """
    if whole_weeks(round(size_s * NS_PER_S)):
        return "week_number"
    whole = round(abs(size_s))
    is_leap = whole > 0 and whole == leap_seconds_at(utc_ns) and abs(abs(size_s) - whole) < _NEAR_S
    return "leap_seconds" if is_leap else ""


def mistake_of_told_step(size_s: float, utc_ns: int) -> str:
    """Name of a step of a receiver's UTC, which falls as leap seconds are learnt, or empty.

    Examples
    --------
    >>> mistake_of_told_step(-2.003, 0), mistake_of_told_step(2.0, 0), mistake_of_told_step(-2.5, 0)
    ('leap_seconds', '', '')
    """
    learnt = leap_seconds_late(round(-size_s * NS_PER_S))
    return mistake_of_step(size_s, utc_ns) or ("leap_seconds" if learnt else "")


def mistake_of_offset(offset_s: float) -> str:
    """Name a standing difference between two clocks that both tell UTC; empty if it has none.

    Examples
    --------
    >>> mistake_of_offset(16.9), mistake_of_offset(10_800.1), mistake_of_offset(0.12)
    ('leap_seconds', 'time_zone', '')
    """
    if whole_weeks(round(offset_s * NS_PER_S)):
        return "week_number"
    whole = round(abs(offset_s))
    if whole in _LEAP_S and abs(abs(offset_s) - whole) < _NEAR_S:
        return "leap_seconds"
    quarters = round(abs(offset_s) / QUARTER_S)
    return "time_zone" if 0 < quarters <= 56 and abs(abs(offset_s) - quarters * QUARTER_S) < 2.0 else ""


def _places(sigma: float) -> int:
    """Decimals that show two figures of a standard error, at most 9."""
    return next((places for places in range(9) if sigma * 10**places >= 9.5), 9)


def _figure(value: float) -> str:
    return f"{value:.{_places(value)}f}"


def _rounded(value: float | None) -> float | None:
    return None if value is None else round(value, 3)
