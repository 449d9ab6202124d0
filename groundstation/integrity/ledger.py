"""The integrity ledger: what a log holds, topic by topic, and what is odd about it. Figures only, no judgement."""

from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from groundstation.base.records import Damage, Int64Array, Remark, frozen
from groundstation.base.signals import kind_of
from groundstation.base.units import NS_PER_S
from groundstation.integrity.clock import Clock, quantile

GAPS_LISTED = 100
SPORADIC_KINDS = ("event", "onboard")  # written when something happens: a pause in them is no gap
MOST_STEPS = 10_000  # of which a typical step is taken
FEWEST_STEPS, UNEVEN = 4, 3.0  # a raw topic with fewer steps, or a fifth of them so much longer than usual, has no rate


@dataclass(frozen=True)
class LedgerSettings:
    """Definition of a gap: a step longer than ``gap_periods`` nominal periods and than ``gap_min_s`` seconds."""

    gap_periods: float = 3.0
    gap_min_s: float = 0.2


@dataclass(frozen=True)
class Gaps:
    """Gaps of one topic: last sample before each (corrected nanoseconds) and seconds to the next, shape (n,)."""

    topic: str
    start_ns: Int64Array
    length_s: np.ndarray[Any, np.dtype[np.float64]]

    def __post_init__(self) -> None:
        object.__setattr__(self, "start_ns", frozen(self.start_ns))
        object.__setattr__(self, "length_s", frozen(self.length_s))

    def __len__(self) -> int:
        return len(self.start_ns)


@dataclass(frozen=True)
class FieldLedger:
    """One field: samples present, NaN the device wrote, values outside the physical range and the first of them."""

    name: str
    present: int
    nan: int = 0
    out_of_range: int = 0
    first_out_of_range: int | None = None
    low: float = float("-inf")
    high: float = float("inf")

    def to_dict(self) -> dict[str, Any]:
        """JSON-able."""
        return {"present": self.present, "nan": self.nan, "out_of_range": self.out_of_range}


@dataclass(frozen=True)
class TopicLedger:
    """One topic on the corrected clock.

    Parameters
    ----------
    topic : str
    rows : int
    first_ns, last_ns : int
        Corrected time of the first and last record.
    nominal_rate_hz : float or None
        From the median step; None with fewer than two distinct times.
    actual_rate_hz : float or None
        Distinct times less one, over the span.
    coverage : float or None
        Share of the samples expected at the nominal rate over the topic's span that are there, at most 1.
    duplicates, backward_steps, stray_rows : int
        Records at the time of the one before (in order of time); steps back of device time; records out of order.
    gaps : Gaps
    fields : tuple of FieldLedger
    """

    topic: str
    rows: int
    first_ns: int
    last_ns: int
    nominal_rate_hz: float | None
    actual_rate_hz: float | None
    coverage: float | None
    duplicates: int
    backward_steps: int
    stray_rows: int
    gaps: Gaps
    fields: tuple[FieldLedger, ...]

    @property
    def span_s(self) -> float:
        """Seconds from the first to the last record."""
        return (self.last_ns - self.first_ns) / NS_PER_S

    def to_dict(self, clock: Clock) -> dict[str, Any]:
        """JSON-able; seconds to the millisecond, rates to 4 decimals, shares to 6."""
        listed = zip(self.gaps.start_ns[:GAPS_LISTED], self.gaps.length_s[:GAPS_LISTED], strict=True)
        return {
            "rows": self.rows,
            "first": clock.text(self.first_ns),
            "last": clock.text(self.last_ns),
            "span_s": round(self.span_s, 3),
            "nominal_rate_hz": _rounded(self.nominal_rate_hz, 4),
            "actual_rate_hz": _rounded(self.actual_rate_hz, 4),
            "coverage": _rounded(self.coverage, 6),
            "duplicates": self.duplicates,
            "backward_steps": self.backward_steps,
            "stray_rows": self.stray_rows,
            "gaps": {
                "count": len(self.gaps),
                "total_s": round(float(self.gaps.length_s.sum()), 3),
                "longest_s": round(float(self.gaps.length_s.max(initial=0.0)), 3),
                "listed": [[clock.text(int(start)), round(float(length), 3)] for start, length in listed],
            },
            "fields": {ledger.name: ledger.to_dict() for ledger in self.fields},
        }


@dataclass(frozen=True)
class Ledger:
    """The ledger of a log: its topics in alphabetical order, its clock, and what the reader lost and remarked."""

    topics: tuple[TopicLedger, ...] = ()
    clock: Clock = field(default_factory=Clock)
    damages: tuple[Damage, ...] = ()
    remarks: tuple[Remark, ...] = ()
    settings: LedgerSettings = field(default_factory=LedgerSettings)

    def __getitem__(self, topic: str) -> TopicLedger:
        """The ledger of one topic; KeyError when the log has none of that name."""
        for ledger in self.topics:
            if ledger.topic == topic:
                return ledger
        raise KeyError(topic)

    @property
    def gaps(self) -> tuple[Gaps, ...]:
        """Gaps of the topics that have any."""
        return tuple(ledger.gaps for ledger in self.topics if len(ledger.gaps))

    @property
    def loses_data(self) -> bool:
        """Whether anything recorded could not be read (exit code 3)."""
        return any(damage.loses_data for damage in self.damages)

    @property
    def completeness(self) -> dict[str, float]:
        """Share of expected samples by topic, where it is known, rounded to 6 decimals."""
        return {ledger.topic: round(ledger.coverage, 6) for ledger in self.topics if ledger.coverage is not None}

    def to_dict(self) -> dict[str, Any]:
        """JSON-able, in a fixed order."""
        return {
            "gap_definition": {"periods": self.settings.gap_periods, "min_s": self.settings.gap_min_s},
            "topics": {ledger.topic: ledger.to_dict(self.clock) for ledger in self.topics},
            "damages": [
                {
                    "kind": damage.kind,
                    "place": damage.place,
                    "count": damage.count,
                    "what": damage.what,
                    "topic": damage.topic,
                    "loses_data": damage.loses_data,
                }
                for damage in self.damages
            ],
            "remarks": [{"code": remark.code, "text": remark.text, "topic": remark.topic} for remark in self.remarks],
        }


def gaps_of(topic: str, time_ns: Int64Array, *, settings: LedgerSettings | None = None) -> Gaps:
    """Gaps of a topic by the definition of :class:`LedgerSettings`, from its corrected times in order, shape (n,).

    Topics that are written when something happens (events) have none.

    Examples
    --------
    >>> gaps = gaps_of("ins", np.array([0, 1, 2, 9, 10]) * NS_PER_S)
    >>> gaps.start_ns.tolist(), gaps.length_s.tolist()
    ([2000000000], [7.0])
    """
    return _gaps(topic, time_ns, _rhythm(topic, time_ns), settings or LedgerSettings())


def _gaps(topic: str, time_ns: Int64Array, rhythm: "_Rhythm", settings: LedgerSettings) -> Gaps:
    if not rhythm.is_regular:
        return Gaps(topic, np.zeros(0, dtype=np.int64), np.zeros(0))
    longest_ns = max(settings.gap_periods * rhythm.typical_ns, settings.gap_min_s * NS_PER_S)
    before = np.flatnonzero(rhythm.steps_ns > longest_ns)
    return Gaps(topic, time_ns[before], rhythm.steps_ns[before] / NS_PER_S)


def topic_ledger(
    topic: str,
    time_ns: Int64Array,
    *,
    backward_steps: int,
    stray_rows: int,
    fields: tuple[FieldLedger, ...],
    settings: LedgerSettings,
) -> TopicLedger:
    """Ledger of one topic from its corrected times in order, shape (n,), n at least 1."""
    rhythm = _rhythm(topic, time_ns)
    span_ns = int(time_ns[-1] - time_ns[0])
    period_ns, ahead = rhythm.typical_ns, rhythm.ahead
    return TopicLedger(
        topic,
        rows=len(time_ns),
        first_ns=int(time_ns[0]),
        last_ns=int(time_ns[-1]),
        nominal_rate_hz=NS_PER_S / period_ns if period_ns else None,
        actual_rate_hz=ahead * NS_PER_S / span_ns if period_ns else None,
        coverage=min(1.0, (ahead + 1) / (span_ns / period_ns + 1.0)) if rhythm.is_regular else None,
        duplicates=len(rhythm.steps_ns) - ahead,
        backward_steps=backward_steps,
        stray_rows=stray_rows,
        gaps=_gaps(topic, time_ns, rhythm, settings),
        fields=fields,
    )


class _Rhythm(NamedTuple):
    """How a topic's times follow each other: steps, how many lead ahead, their median, whether it is a period.

    A topic that is written when something happens has none.
    """

    steps_ns: Int64Array
    ahead: int
    typical_ns: float
    is_regular: bool


def _rhythm(topic: str, time_ns: Int64Array) -> _Rhythm:
    """The rhythm of a topic, from its corrected times in order."""
    steps = np.diff(time_ns)
    ahead = steps[steps > 0]
    if not len(ahead):
        return _Rhythm(steps, 0, 0.0, False)
    some = np.sort(ahead[:: len(ahead) // MOST_STEPS | 1])  # odd: two steps in turn are both met
    typical_ns = quantile(some, 0.5)
    return _Rhythm(steps, len(ahead), typical_ns, not _is_sporadic(topic, len(ahead), typical_ns, quantile(some, 0.8)))


def _is_sporadic(topic: str, steps: int, usual_ns: float, long_ns: float) -> bool:
    """Whether a topic is written when something happens: by its kind, or, of a raw one, by steps of every length."""
    if kind_of(topic) != "raw":
        return kind_of(topic) in SPORADIC_KINDS
    return steps < FEWEST_STEPS or long_ns > UNEVEN * usual_ns


def _rounded(value: float | None, digits: int) -> float | None:
    return None if value is None else round(value, digits)
