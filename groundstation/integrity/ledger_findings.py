"""Findings on a ledger, one line each, with figures and places."""

from collections.abc import Iterator

import numpy as np

from groundstation.base.findings import CONTRADICTION, Finding, Severity
from groundstation.base.gaps import Gaps, Pause
from groundstation.base.records import Damage
from groundstation.base.signals import is_canonical
from groundstation.base.units import NS_PER_S
from groundstation.base.words import counted
from groundstation.integrity.clock import ClockModel
from groundstation.integrity.clock_findings import clock_findings
from groundstation.integrity.contradictions import Contradiction
from groundstation.integrity.ledger import FieldCounts, LedgerCounts, TopicCounts
from groundstation.integrity.limits import DuplicateLimits
from groundstation.integrity.sequence import Sequence

TOPIC_CODES = (
    *("time.duplicates", "data.not_logged", "data.silent", "data.gaps", "data.sequence", "data.sequence_reset"),
    *("values.out_of_range", "values.nan", "values.stuck", "values.saturated", "data.increments"),
)
WHOLE_SHARE = 0.9  # of the time: increments that cover less have gaps, or were thinned out
_REMARKS_THAT_WARN = (
    *("assumed_utc", "assumed_year", "year_unknown", "clock_disagrees", "unreadable_metadata"),
    *(
        "plug_in",
        "duplicate_column",
        "missing_columns",
        "unchecked_draft",
        "icd_of_another",
        "tmats_contradicted",
        "week_rollover",
        "week_number",
    ),
)


def ledger_findings(ledger: LedgerCounts) -> tuple[Finding, ...]:
    """Findings of a ledger: clock first, then losses, topics and the reader's remarks.

    Codes: those of :func:`clock_findings`, ``time.duplicates``, ``data.none``, ``data.not_logged`` (a pause of the log
    while disarmed), ``data.silent`` (all topics stop at once), ``data.gaps``, ``data.contradiction``,
    ``data.<kind of damage>`` (``data.truncated``, ``data.dropped_rows``, ``data.breaks_off`` ...),
    ``data.sequence``, ``data.sequence_reset``, ``values.out_of_range``, ``values.nan``, ``values.stuck``,
    ``values.saturated`` and ``data.increments`` (inertial units),
    ``reader.<remark>`` (``reader.derived``, ``reader.assumed_utc`` ...).
    """
    damages = (damage_finding(damage) for damage in ledger.damages)
    against = (_contradiction(one, ledger.clock) for one in ledger.contradictions)
    return (*clock_findings(ledger), *damages, *against, *topic_findings(ledger), *_remarks(ledger))


def _contradiction(one: Contradiction, clock: ClockModel) -> Finding:
    place = f"from {clock.text(one.start_ns)}, {one.length_s:.0f} s in all"
    return Finding("warn", CONTRADICTION, f"this log contradicts itself: {one.text}", one.topic, place)


def topic_findings(ledger: LedgerCounts) -> tuple[Finding, ...]:
    """Return the findings about topics: silence of all; order, gaps, counters, values of each."""
    return (*_silences(ledger), *(finding for topic in ledger.topics for finding in _topic(topic, ledger)))


def _silences(ledger: LedgerCounts) -> Iterator[Finding]:
    """Yield a finding on the pauses of the log, and one on stops that nothing explains."""
    if ledger.pauses:
        often, place = _often(ledger.pauses, ledger.clock)
        yield Finding("info", "data.not_logged", f"nothing logged while disarmed{often}", "", place, len(ledger.pauses))
    if ledger.stops:
        often, place = _often(ledger.stops, ledger.clock)
        yield Finding("warn", "data.silent", f"nothing recorded of any topic{often}", "", place, len(ledger.stops))


def _often(found: tuple[Pause, ...], clock: ClockModel) -> tuple[str, str]:
    """Return the lengths of silences in words, and the place of the longest."""
    longest = max(found, key=lambda one: one.length_s)
    place = f"from {clock.text(longest.start_ns)} to {clock.text(longest.end_ns)}"
    if len(found) == 1:
        return f": {longest.length_s:.1f} s {place}", place
    together_s = sum(one.length_s for one in found)
    times = f" {len(found)} times: {together_s:.1f} s together"
    return f"{times}, the longest {longest.length_s:.1f} s {place}", place


def _own_gaps(topic: TopicCounts, stops: tuple[Pause, ...]) -> Gaps:
    """Return the gaps of a topic that stops of the whole log do not explain.

    More than a step that is no gap is left of them.
    """
    if not stops or not len(topic.gaps):
        return topic.gaps
    start_ns, length_s = topic.gaps.start_ns, topic.gaps.length_s
    end_ns = start_ns + np.round(length_s * NS_PER_S).astype(np.int64)
    left_s = length_s.copy()
    for stop in stops:
        left_s -= np.maximum(np.minimum(end_ns, stop.end_ns) - np.maximum(start_ns, stop.start_ns), 0) / NS_PER_S
    own = np.flatnonzero(left_s > topic.longest_s)
    return Gaps(topic.topic, start_ns[own], length_s[own])


def damage_finding(damage: Damage) -> Finding:
    """A finding that tells of damage to the log."""
    severity: Severity = "warn" if damage.loses_data else "info"
    text = f"{damage.what}: {damage.count} ({damage.place})"
    return Finding(severity, f"data.{damage.kind}", text, damage.topic, damage.place, damage.count)


def _duplicates(topic: TopicCounts, clock: ClockModel, limits: DuplicateLimits) -> Finding:
    """Report records at one time; a warning where there are many.

    It is none for the topics of a counting clock, whose sources share times.
    """
    share = topic.duplicates / topic.rows
    text = f"{topic.topic}: {topic.duplicates} of {counted(topic.rows, 'record')} repeat the time of the one before"
    is_many = topic.duplicates >= limits.fewest and share > limits.share
    is_odd = is_many and is_canonical(topic.topic) and not clock.is_counting
    if is_odd and share > limits.standing_share:
        text += ": the clock stands still"
    return Finding("warn" if is_odd else "info", "time.duplicates", text, topic.topic, count=topic.duplicates)


def _topic(topic: TopicCounts, ledger: LedgerCounts) -> Iterator[Finding]:
    if topic.duplicates:
        yield _duplicates(topic, ledger.clock, ledger.thresholds.duplicates)
    gaps, own = topic.gaps, _own_gaps(topic, ledger.stops)
    if len(own):
        longest = int(gaps.length_s.argmax())
        place = ledger.clock.text(int(gaps.start_ns[longest]))
        text = (
            f"{topic.topic}: {counted(len(gaps), 'gap')}, {gaps.length_s.sum():.1f} s together, "
            f"the longest {gaps.length_s[longest]:.1f} s after {place}"
        )
        if len(own) < len(gaps):
            text += f"; {len(gaps) - len(own)} of them stops of the whole log"
        severity: Severity = "warn" if is_canonical(topic.topic) else "info"  # nothing is estimated from raw topics
        yield Finding(severity, "data.gaps", text, topic.topic, place, len(gaps))
    for sequence in topic.sequences:
        yield from _sequence(topic.topic, sequence, ledger.clock)
    if topic.increments_share is not None and topic.increments_share < WHOLE_SHARE:
        text = f"{topic.topic}: its increments cover {100.0 * topic.increments_share:.0f} % of the time"
        yield Finding("warn", "data.increments", text, topic.topic)
    for field in topic.fields:
        yield from _field(topic.topic, field, ledger.clock)


def _field(topic: str, field: FieldCounts, clock: ClockModel) -> Iterator[Finding]:
    name = f"{topic}.{field.name}"
    if field.out_of_range:
        place = f"record {field.first_out_of_range}"
        count = counted(field.out_of_range, "value")
        text = f"{name}: {count} outside [{field.low:g}, {field.high:g}], first at {place}"
        if field.first_outside_ns is not None:
            text += f" ({clock.text(field.first_outside_ns)})"
        yield Finding("warn", "values.out_of_range", text, topic, place, field.out_of_range)
    if field.at_end:
        text = f"{name}: {counted(field.at_end, 'sample')} of {field.present} at the end of the range"
        yield Finding("warn", "values.saturated", text, topic, count=field.at_end)
    if field.nan:
        text = f"{name}: NaN, as the device wrote it, in {field.nan} of {counted(field.present, 'value')}"
        yield Finding("info", "values.nan", text, topic, count=field.nan)
    if field.stuck:
        longest = max(field.stuck, key=lambda one: one.length_s)
        place = clock.text(longest.start_ns)
        text = (
            f"{name}: stuck {counted(len(field.stuck), 'time')}, the longest at {longest.value:g} for "
            f"{longest.length_s:.1f} s ({counted(longest.samples, 'sample')}) from {place}: {longest.why}"
        )
        yield Finding("warn", "values.stuck", text, topic, place, len(field.stuck))


def _sequence(topic: str, sequence: Sequence, clock: ClockModel) -> Iterator[Finding]:
    name = f"{topic}.{sequence.field}"
    if sequence.lost:
        place = clock.text(sequence.places[0][0])
        what = "records missing by the counter" if sequence.kind == "records" else "losses counted by the recorder"
        text = f"{name}: {sequence.lost} {what}, the first before {place}"
        yield Finding("warn", "data.sequence", text, topic, place, sequence.lost)
    if sequence.before:
        text = f"{name}: the recorder had counted {counted(sequence.before, 'loss', 'losses')} when the log began"
        yield Finding("info", "data.sequence", text, topic, count=sequence.before)
    if sequence.resets:
        text = f"{name}: the counter jumped {counted(sequence.resets, 'time')}: no loss is counted there"
        yield Finding("info", "data.sequence_reset", text, topic, count=sequence.resets)


def _remarks(ledger: LedgerCounts) -> Iterator[Finding]:
    for remark in ledger.remarks:
        severity: Severity = "warn" if remark.code in _REMARKS_THAT_WARN else "info"
        yield Finding(severity, f"reader.{remark.code}", remark.text, remark.topic)
