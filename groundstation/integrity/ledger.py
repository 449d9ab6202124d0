"""Integrity ledger: contents and oddities of a log, topic by topic; figures, no judgement."""

import math
from collections.abc import Mapping
from dataclasses import field

import numpy as np

from groundstation.base.dataclasses import dataclass
from groundstation.base.gaps import Gaps, Pause
from groundstation.base.ledger import (
    DamageEntry,
    Dropouts,
    FieldEntry,
    GapDefinition,
    Ledger,
    OutOfRange,
    PauseEntry,
    RemarkEntry,
    StuckStretch,
    TopicEntry,
    TopicGaps,
)
from groundstation.base.records import Damage, Int64Array, Remark
from groundstation.base.signals import is_canonical
from groundstation.base.units import NS_PER_S
from groundstation.integrity.clock import ClockModel
from groundstation.integrity.contradictions import Contradiction
from groundstation.integrity.inertial import is_inertial
from groundstation.integrity.limits import Thresholds, shipped
from groundstation.integrity.rhythm import Rhythm, rhythm_of
from groundstation.integrity.sequence import Sequence
from groundstation.integrity.source_clock import PowerUpClock
from groundstation.integrity.spans import RecorderDropout, Span, Timeline, skipped_bytes, spans_of, truncation
from groundstation.integrity.stuck import StuckPlace

GAPS_LISTED = STUCK_LISTED = SPANS_LISTED = 100


@dataclass(frozen=True)
class FieldCounts:
    """Counts of one field: samples, NaN of the device, values out of range, stuck stretches.

    ``first_out_of_range`` is the record of the first value outside the range; ``first_outside_ns`` and
    ``last_outside_ns`` are the corrected times of the first and the last. ``at_end``: samples of an inertial unit
    at the end of its range.
    """

    name: str
    present: int
    nan: int = 0
    out_of_range: int = 0
    first_out_of_range: int | None = None
    low: float = float("-inf")
    high: float = float("inf")
    first_outside_ns: int | None = None
    last_outside_ns: int | None = None
    stuck: tuple[StuckPlace, ...] = ()
    at_end: int = 0

    @property
    def is_odd(self) -> bool:
        """Tell whether there is more to say of the field than its number of samples."""
        return bool(self.nan or self.out_of_range or self.stuck or self.at_end)

    def entry(self, clock: ClockModel) -> FieldEntry:
        """Return the form to keep."""
        if not self.is_odd:
            return FieldEntry(present=self.present)
        first_ns, ends = self.first_outside_ns, (self.low, self.high)
        low, high = (end if math.isfinite(end) else None for end in ends)
        time = None if first_ns is None else clock.text(first_ns)
        return FieldEntry(
            at_end=self.at_end,
            present=self.present,
            nan=self.nan,
            out_of_range=self.out_of_range,
            first_out_of_range=(
                OutOfRange(record=self.first_out_of_range, time=time, range=(low, high)) if self.out_of_range else None
            ),
            stuck=tuple(
                StuckStretch(
                    record=one.record_index,
                    start=clock.text(one.start_ns),
                    length_s=round(one.length_s, 3),
                    samples=one.samples,
                    value=one.value,
                    why=one.why,
                )
                for one in self.stuck[:STUCK_LISTED]
            ),
        )


@dataclass(frozen=True)
class TopicCounts:
    """One topic on the corrected clock.

    Parameters
    ----------
    topic : str
    rows : int
    first_ns, last_ns : int
        Corrected time of the first and last record.
    nominal_rate_hz : float or None
        From the median step; None where no step is usual: fewer than two distinct times, or a topic that is written
        when something happens.
    actual_rate_hz : float or None
        Distinct times less one, over the span without pauses.
    coverage : float or None
        Share of the samples expected at the nominal rate over the topic's span that are there, at most 1.
    duplicates, backward_steps, stray_rows : int
        Records at the time of the one before (in order of time); steps back of device time; records out of order.
    gaps : Gaps
    fields : tuple of FieldCounts
    sequences : tuple of Sequence
        Losses that record counters show.
    jitter_s : float or None
        Of an inertial unit: root mean square of its steps less the nominal one, gaps left out.
    increments_share : float or None
        Share of the logged time that its increments cover.
    longest_s : float
        Longest step that is no gap.
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
    fields: tuple[FieldCounts, ...]
    sequences: tuple[Sequence, ...] = ()
    jitter_s: float | None = None
    increments_share: float | None = None
    longest_s: float = math.inf

    @property
    def span_s(self) -> float:
        """Seconds from the first to the last record."""
        return (self.last_ns - self.first_ns) / NS_PER_S

    def entry(self, clock: ClockModel, losses: Mapping[str, int]) -> TopicEntry:
        """Return the form to keep: seconds to the millisecond, rates to 4 decimals, shares to 6."""
        listed = zip(self.gaps.start_ns[:GAPS_LISTED], self.gaps.length_s[:GAPS_LISTED], strict=True)
        return TopicEntry(
            rows=self.rows,
            first=clock.text(self.first_ns),
            last=clock.text(self.last_ns),
            span_s=round(self.span_s, 3),
            nominal_rate_hz=_rounded(self.nominal_rate_hz, 4),
            actual_rate_hz=_rounded(self.actual_rate_hz, 4),
            coverage=_rounded(self.coverage, 6),
            duplicates=self.duplicates,
            jitter_s=_rounded(self.jitter_s, 7),
            increments_share=_rounded(self.increments_share, 6),
            backward_steps=self.backward_steps,
            stray_rows=self.stray_rows,
            gaps=TopicGaps(
                count=len(self.gaps),
                total_s=round(float(self.gaps.length_s.sum()), 3),
                longest_s=round(float(self.gaps.length_s.max(initial=0.0)), 3),
                listed=tuple((clock.text(int(start)), round(float(length), 3)) for start, length in listed),
            ),
            sequences=tuple(sequence.entry(clock) for sequence in self.sequences),
            fields={one.name: one.entry(clock) for one in sorted(self.fields, key=lambda one: one.name)},
            losses=dict(sorted(losses.items())),
        )


@dataclass(frozen=True)
class LedgerCounts:
    """Ledger of a log: topics in alphabetical order, clock, damage and remarks of the reader.

    ``power_ups`` are those of the source, where it holds several. Nothing was logged in ``pauses``, as the vehicle was
    disarmed; in ``stops`` neither, and nothing tells why.
    """

    topics: tuple[TopicCounts, ...] = ()
    clock: ClockModel = field(default_factory=ClockModel)
    damages: tuple[Damage, ...] = ()
    remarks: tuple[Remark, ...] = ()
    thresholds: Thresholds = field(default_factory=shipped)
    dropouts: tuple[RecorderDropout, ...] = ()
    timeline: Timeline | None = None
    contradictions: tuple[Contradiction, ...] = ()
    power_ups: tuple[PowerUpClock, ...] = ()
    pauses: tuple[Pause, ...] = ()
    stops: tuple[Pause, ...] = ()

    def __getitem__(self, topic: str) -> TopicCounts:
        """Return the ledger of one topic; KeyError when the log has none of that name."""
        for ledger in self.topics:
            if ledger.topic == topic:
                return ledger
        raise KeyError(topic)

    @property
    def rows(self) -> dict[str, int]:
        """Number of records of each topic."""
        return {ledger.topic: ledger.rows for ledger in self.topics}

    @property
    def gaps(self) -> tuple[Gaps, ...]:
        """Gaps of the topics that have any."""
        return tuple(ledger.gaps for ledger in self.topics if len(ledger.gaps))

    @property
    def loses_data(self) -> bool:
        """Tell whether anything recorded could not be read (exit code 3)."""
        return any(damage.loses_data for damage in self.damages)

    @property
    def completeness(self) -> dict[str, float]:
        """Share of expected samples by topic, where it is known, rounded to 6 decimals."""
        return {ledger.topic: round(ledger.coverage, 6) for ledger in self.topics if ledger.coverage is not None}

    @property
    def start_ns(self) -> int:
        """Corrected time of the first record of any topic: flight time zero."""
        return min((ledger.first_ns for ledger in self.topics), default=0)

    @property
    def end_ns(self) -> int:
        """Corrected time of the last record of topics with a nominal rate.

        Only canonical topics count where there are any.
        """
        rated = [ledger for ledger in self.topics if ledger.nominal_rate_hz is not None]
        canonical = [ledger for ledger in rated if is_canonical(ledger.topic)]
        return max((ledger.last_ns for ledger in canonical or rated), default=self.start_ns)

    @property
    def spans(self) -> tuple[Span, ...]:
        """Spans of time with damage, in order of time; gaps stand with their topics."""
        end_ns = max((ledger.last_ns for ledger in self.topics), default=0)
        timeline = self.timeline or Timeline(np.zeros(0, dtype=np.int64), np.zeros(0, dtype=np.int64))
        found = spans_of(self.damages, self.dropouts, timeline, end_ns) if self.topics else []
        for topic in self.topics:
            found += _spans_of_topic(topic)
        return tuple(sorted(found, key=lambda span: (span.start_ns, span.topic, span.field, span.cause)))

    def _pause(self, one: Pause) -> PauseEntry:
        start_s = round((one.start_ns - self.start_ns) / NS_PER_S, 3)
        return PauseEntry(length_s=round(one.length_s, 3), start=self.clock.text(one.start_ns), start_s=start_s)

    def losses(self, topic: str) -> dict[str, int]:
        """Count the unreadable records of a topic by kind of damage."""
        counts: dict[str, int] = {}
        for damage in self.damages:
            if damage.topic == topic and damage.loses_data:
                counts[damage.kind] = counts.get(damage.kind, 0) + damage.count
        return counts

    def document(self) -> Ledger:
        """Return the form to keep."""
        limits, spans = self.thresholds.gaps, self.spans
        skipped, skipped_spans = skipped_bytes(self.damages)
        return Ledger(
            thresholds=self.thresholds.used(),
            gap_definition=GapDefinition(periods=limits.periods, min_s=limits.min_s),
            topics={one.topic: one.entry(self.clock, self.losses(one.topic)) for one in self.topics},
            bytes_skipped=skipped,
            skipped_spans=skipped_spans,
            truncated=truncation(self.damages),
            dropouts=Dropouts(count=len(self.dropouts), total_s=round(sum(one.length_s for one in self.dropouts), 3)),
            pauses=tuple(self._pause(one) for one in self.pauses),
            spans=tuple(span.entry(self.clock, self.start_ns) for span in spans[:SPANS_LISTED]),
            spans_more=max(0, len(spans) - SPANS_LISTED),
            damages=tuple(damage_entry(damage) for damage in self.damages),
            remarks=tuple(RemarkEntry(code=one.code, text=one.text, topic=one.topic) for one in self.remarks),
        )


def damage_entry(damage: Damage) -> DamageEntry:
    """Return the form of damage to keep."""
    return DamageEntry(
        kind=damage.kind,
        place=damage.place,
        count=damage.count,
        what=damage.what,
        topic=damage.topic,
        loses_data=damage.loses_data,
    )


def _spans_of_topic(topic: TopicCounts) -> list[Span]:
    """Spans of wrong values and of records that a counter misses."""
    found = []
    for ledger in topic.fields:
        if ledger.first_outside_ns is not None and ledger.last_outside_ns is not None:
            start_ns, end_ns = sorted((ledger.first_outside_ns, ledger.last_outside_ns))
            count = ledger.out_of_range
            found.append(Span("out_of_range", topic.topic, ledger.name, start_ns, end_ns, count == 1, count))
        for one in ledger.stuck:
            end_ns = one.start_ns + round(one.length_s * NS_PER_S)
            found.append(Span("stuck", topic.topic, ledger.name, one.start_ns, end_ns, True, one.samples))
    for sequence in topic.sequences:
        for time_ns, lost in sequence.places:
            scope = topic.topic if sequence.kind == "records" else ""
            found.append(Span("sequence", scope, "", time_ns, time_ns, False, lost))
    return found


def gaps_of(
    topic: str, time_ns: Int64Array, *, thresholds: Thresholds | None = None, pauses: tuple[Pause, ...] = ()
) -> Gaps:
    """Gaps of a topic by the thresholds, from its corrected times in order, shape (n,).

    Topics that are written when something happens (events) have none. Time in ``pauses`` of the log is in none.

    Examples
    --------
    >>> gaps = gaps_of("ins", np.array([0, 1, 2, 9, 10]) * NS_PER_S)
    >>> gaps.start_ns.tolist(), gaps.length_s.tolist()
    ([2000000000], [7.0])
    """
    limits = thresholds or shipped()
    return rhythm_of(topic, time_ns, limits, pauses).gaps(topic, time_ns)


def topic_ledger(
    topic: str,
    time_ns: Int64Array,
    *,
    backward_steps: int,
    stray_rows: int,
    fields: tuple[FieldCounts, ...],
    sequences: tuple[Sequence, ...] = (),
    increments_s: float | None = None,
    rhythm: Rhythm,
) -> TopicCounts:
    """Ledger of one topic, from its corrected times in order, shape (n,), and their rhythm.

    There is at least one time.
    """
    span_ns, ahead = rhythm.span_ns, rhythm.ahead
    return TopicCounts(
        topic,
        rows=len(time_ns),
        first_ns=int(time_ns[0]),
        last_ns=int(time_ns[-1]),
        nominal_rate_hz=NS_PER_S / rhythm.period_ns if rhythm.has_rate else None,
        actual_rate_hz=ahead * NS_PER_S / span_ns if ahead else None,
        coverage=rhythm.coverage if rhythm.has_rate else None,
        duplicates=len(time_ns) - 1 - ahead,
        backward_steps=backward_steps,
        stray_rows=stray_rows,
        gaps=rhythm.gaps(topic, time_ns),
        fields=fields,
        sequences=sequences,
        jitter_s=rhythm.jitter_s if is_inertial(topic) and rhythm.has_rate else None,
        increments_share=increments_s * NS_PER_S / span_ns if increments_s and span_ns else None,
        longest_s=rhythm.longest_ns / NS_PER_S,
    )


def _rounded(value: float | None, digits: int) -> float | None:
    return None if value is None else round(value, digits)
