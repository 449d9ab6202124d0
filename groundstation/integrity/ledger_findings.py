"""What a user must know of a ledger, one line each, with figures and places."""

from collections.abc import Iterator

from groundstation.base.findings import Finding, Severity
from groundstation.base.signals import is_canonical
from groundstation.base.units import NS_PER_S
from groundstation.integrity.clock import Clock, ClockStep
from groundstation.integrity.ledger import FieldLedger, Ledger, TopicLedger
from groundstation.integrity.limits import DuplicateLimits
from groundstation.integrity.sequence import Sequence

TOPIC_CODES = (
    *("time.duplicates", "data.gaps", "data.sequence", "data.sequence_reset"),
    *("values.out_of_range", "values.nan", "values.stuck"),
)
_REMARKS_THAT_WARN = ("assumed_utc", "clock_disagrees", "unreadable_metadata", "plug_in", "duplicate_column")


def ledger_findings(ledger: Ledger) -> tuple[Finding, ...]:
    """Findings of a ledger: clock first, then losses, topics and the reader's remarks.

    Codes: ``clock.backward_step``, ``clock.forward_step``, ``clock.missing_times``, ``clock.implausible_times``,
    ``clock.stale_times``, ``clock.shifted``, ``clock.no_utc``, ``clock.no_times``, ``time.unordered``,
    ``time.stray_rows``, ``time.duplicates``, ``data.none``, ``data.gaps``, ``data.<kind of damage>``
    (``data.truncated``, ``data.dropped_rows``, ``data.unreadable_cells`` ...), ``data.sequence``,
    ``data.sequence_reset``, ``values.out_of_range``, ``values.nan``, ``values.stuck``, ``reader.<remark>``
    (``reader.derived``, ``reader.assumed_utc`` ...).
    """
    return (*_clock(ledger), *_damages(ledger), *topic_findings(ledger), *_remarks(ledger))


def topic_findings(ledger: Ledger) -> tuple[Finding, ...]:
    """Those of the findings that are about topics: order, gaps, counters and values."""
    return tuple(finding for topic in ledger.topics for finding in _topic(topic, ledger))


def _clock(ledger: Ledger) -> Iterator[Finding]:
    clock = ledger.clock
    if not clock.has_times:
        if clock.missing_times:
            text = f"none of the {clock.missing_times} records has a time: nothing can be placed in time"
            yield Finding("fail", "clock.no_times", text, count=clock.missing_times)
        else:
            yield Finding("fail", "data.none", "the log holds no records")
        return
    for step in clock.steps:
        yield _step(step, clock)
    if clock.missing_times:
        rows = sum(topic.rows for topic in ledger.topics)
        many = ledger.thresholds.findings.missing_times_share * rows
        severity: Severity = "warn" if clock.missing_times > many else "info"
        text = f"{_counted(clock.missing_times, 'record')} without a time: placed by their neighbours"
        yield Finding(severity, "clock.missing_times", text, count=clock.missing_times)
    if clock.implausible_times:
        text = (
            f"{_counted(clock.implausible_times, 'record')} with a time that cannot be true: placed by their neighbours"
        )
        yield Finding("warn", "clock.implausible_times", text, count=clock.implausible_times)
    if clock.stale_times:
        text = (
            f"{_counted(clock.stale_times, 'record')} with the time of an earlier publication (the newest value when "
            "the log began, or a topic whose time does not advance): placed by their neighbours"
        )
        yield Finding("info", "clock.stale_times", text, count=clock.stale_times)
    if clock.is_unordered:
        text = f"the log is not in order of time ({clock.stray_rows} records after a later one): sorted"
        yield Finding("warn", "time.unordered", text, count=clock.stray_rows)
    elif clock.stray_rows:
        place = f"record {int(clock.stray_index[0])}"
        text = f"{_counted(clock.stray_rows, 'record')} out of order, the first at {place}: sorted"
        yield Finding("warn", "time.stray_rows", text, place=place, count=clock.stray_rows)
    if clock.shift_ns:
        text = f"times were moved by {clock.shift_ns / NS_PER_S:+.3f} s so that none is negative"
        yield Finding("info", "clock.shifted", text)
    if not clock.is_absolute:
        yield Finding("info", "clock.no_utc", "the log has no absolute time: times count from its own zero")


def _step(step: ClockStep, clock: Clock) -> Finding:
    zero_ns = int(clock.offsets_ns[-1])
    before, after = clock.text(step.device_before_ns + zero_ns), clock.text(step.device_after_ns + zero_ns)
    direction = "back" if step.kind == "backward" else "ahead"
    text = (
        f"the clock stepped {direction} by {abs(step.size_s):.3f} s at record {step.record_index} "
        f"({before} to {after}); "
        f"{_counted(step.records_before, 'record')} before it moved by {step.shift_s:+.3f} s to join"
    )
    return Finding("warn", f"clock.{step.kind}_step", text, place=f"{after}, record {step.record_index}")


def _damages(ledger: Ledger) -> Iterator[Finding]:
    for damage in ledger.damages:
        severity: Severity = "warn" if damage.loses_data else "info"
        text = f"{damage.what}: {damage.count} ({damage.place})"
        yield Finding(severity, f"data.{damage.kind}", text, damage.topic, damage.place, damage.count)


def _duplicates(topic: TopicLedger, clock: Clock, limits: DuplicateLimits) -> Finding:
    """Records at one time: a warning where many, but of a counting clock's topics, whose sources share times."""
    share = topic.duplicates / topic.rows
    text = f"{topic.topic}: {topic.duplicates} of {topic.rows} records repeat the time of the one before"
    is_many = topic.duplicates >= limits.fewest and share > limits.share
    is_odd = is_many and is_canonical(topic.topic) and not clock.is_counting
    if is_odd and share > limits.standing_share:
        text += ": the clock stands still"
    return Finding("warn" if is_odd else "info", "time.duplicates", text, topic.topic, count=topic.duplicates)


def _topic(topic: TopicLedger, ledger: Ledger) -> Iterator[Finding]:
    if topic.duplicates:
        yield _duplicates(topic, ledger.clock, ledger.thresholds.duplicates)
    if len(topic.gaps):
        longest = int(topic.gaps.length_s.argmax())
        place = ledger.clock.text(int(topic.gaps.start_ns[longest]))
        text = (
            f"{topic.topic}: {_counted(len(topic.gaps), 'gap')}, {topic.gaps.length_s.sum():.1f} s together, "
            f"the longest {topic.gaps.length_s[longest]:.1f} s after {place}"
        )
        severity: Severity = "warn" if is_canonical(topic.topic) else "info"  # nothing is estimated from raw topics
        yield Finding(severity, "data.gaps", text, topic.topic, place, len(topic.gaps))
    for sequence in topic.sequences:
        yield from _sequence(topic.topic, sequence, ledger.clock)
    for field in topic.fields:
        yield from _field(topic.topic, field, ledger.clock)


def _field(topic: str, field: FieldLedger, clock: Clock) -> Iterator[Finding]:
    name = f"{topic}.{field.name}"
    if field.out_of_range:
        place = f"record {field.first_out_of_range}"
        count = _counted(field.out_of_range, "value")
        text = f"{name}: {count} outside [{field.low:g}, {field.high:g}], first at {place}"
        if field.first_outside_ns is not None:
            text += f" ({clock.text(field.first_outside_ns)})"
        yield Finding("warn", "values.out_of_range", text, topic, place, field.out_of_range)
    if field.nan:
        text = f"{name}: {field.nan} of {field.present} values are NaN as the device wrote them"
        yield Finding("info", "values.nan", text, topic, count=field.nan)
    if field.stuck:
        longest = max(field.stuck, key=lambda one: one.length_s)
        place = clock.text(longest.start_ns)
        text = (
            f"{name}: stuck {_counted(len(field.stuck), 'time')}, the longest at {longest.value:g} for "
            f"{longest.length_s:.1f} s ({longest.samples} samples) from {place}: {longest.why}"
        )
        yield Finding("warn", "values.stuck", text, topic, place, len(field.stuck))


def _sequence(topic: str, sequence: Sequence, clock: Clock) -> Iterator[Finding]:
    name = f"{topic}.{sequence.field}"
    if sequence.lost:
        place = clock.text(sequence.places[0][0])
        what = "records missing by the counter" if sequence.kind == "records" else "losses counted by the recorder"
        text = f"{name}: {sequence.lost} {what}, the first before {place}"
        yield Finding("warn", "data.sequence", text, topic, place, sequence.lost)
    if sequence.before:
        text = f"{name}: the recorder had counted {_counted(sequence.before, 'loss', 'losses')} when the log began"
        yield Finding("info", "data.sequence", text, topic, count=sequence.before)
    if sequence.resets:
        text = f"{name}: the counter jumped {_counted(sequence.resets, 'time')}: no loss is counted there"
        yield Finding("info", "data.sequence_reset", text, topic, count=sequence.resets)


def _counted(count: int, noun: str, nouns: str = "") -> str:
    return f"{count} {noun}" if count == 1 else f"{count} {nouns or noun + 's'}"


def _remarks(ledger: Ledger) -> Iterator[Finding]:
    for remark in ledger.remarks:
        severity: Severity = "warn" if remark.code in _REMARKS_THAT_WARN else "info"
        yield Finding(severity, f"reader.{remark.code}", remark.text, remark.topic)
