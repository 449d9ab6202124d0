"""Findings on the clock of a log, one line each, with figures and places."""

from collections.abc import Iterator, Sequence

import numpy as np

from groundstation.base.findings import Finding, Severity
from groundstation.base.quantiles import NORMAL_95
from groundstation.base.timescales import utc_ns_to_iso
from groundstation.base.units import NS_PER_S
from groundstation.base.words import counted
from groundstation.integrity.clock import FIRST_NS, ClockModel
from groundstation.integrity.clock_relation import ClockRelation, Mistake
from groundstation.integrity.clock_steps import ClockStep
from groundstation.integrity.ledger import LedgerCounts
from groundstation.integrity.power_ups import LAST_RECORD
from groundstation.integrity.source_clock import PowerUpClock

POWER_UPS_TOLD = 5
_UNIX_SECONDS = (1_000_000_000, 4_000_000_000)  # 2001 to 2096: as a time since power-up, more than 31 years


def clock_findings(ledger: LedgerCounts) -> Iterator[Finding]:
    """Yield the findings on a clock.

    They are about steps, times that are missing or not believed, order, absolute time, other clocks. Codes:
    ``clock.backward_step``, ``clock.forward_step``, ``clock.unset``, ``clock.missing_times``,
    ``clock.implausible_times``, ``clock.stale_times``, ``clock.shifted``, ``clock.no_utc``, ``clock.no_times``,
    ``clock.relation_step``, ``clock.relation_rate``, ``clock.drift``, ``clock.offset``, ``clock.week_number``,
    ``clock.leap_seconds``, ``clock.time_zone``, ``time.unordered``, ``time.stray_rows``, ``data.none``,
    ``clock.wrapped``, ``log.power_ups``.
    """
    clock = ledger.clock
    if not clock.has_times:
        if clock.missing_times:
            text = f"none of {counted(clock.missing_times, 'record')} has a time: nothing can be placed in time"
            yield Finding("fail", "clock.no_times", text, count=clock.missing_times)
        else:
            yield Finding("fail", "data.none", "the log holds no records")
        return
    if ledger.power_ups:
        yield _power_ups(ledger.power_ups, clock)
    for wrap in clock.wraps:
        text = f"the {wrap.what} wrapped at record {wrap.record_index} and goes on"
        yield Finding("info", "clock.wrapped", text, place=f"record {wrap.record_index}")
    for step in clock.steps:
        yield _step(step, clock, _zero_at(step, ledger))
    yield from _times(ledger)
    yield from _order(clock)
    yield from _absolute(clock)
    for relation in clock.relations:
        yield from _relation(relation, clock, ledger.thresholds.clock_relation.drift_ppm)


def _power_ups(several: Sequence[PowerUpClock], clock: ClockModel) -> Finding:
    """Return the finding that the source holds several flights, with their times."""
    _first, second = several[:2]
    spans = [
        f"{clock.text(one.start_ns)} to {clock.text(one.end_ns)}" if one.is_absolute else "one without UTC"
        for one in several[:POWER_UPS_TOLD]
    ]
    more = f" and {len(several) - POWER_UPS_TOLD} more" if len(several) > POWER_UPS_TOLD else ""
    text = f"{len(several)} power-ups in one file: {'; '.join(spans)}{more}: `run` makes a flight of each"
    place = f"record {second.records.first}"
    return Finding("warn", "log.power_ups", text, place=place, count=len(several))


def _zero_at(step: ClockStep, ledger: LedgerCounts) -> int:
    """Return the offset of device times at the end of the power-up that holds a step.

    The last offset is the one believed.
    """
    clock = ledger.clock
    ends = (one.records.end for one in ledger.power_ups if step.record_index < one.records.end)
    last = int(np.searchsorted(clock.starts, next(ends, LAST_RECORD))) - 1
    return int(clock.offsets_ns[last])


def _step(step: ClockStep, clock: ClockModel, zero_ns: int) -> Finding:
    before, after = clock.text(step.device_before_ns + zero_ns), clock.text(step.device_after_ns + zero_ns)
    direction = "back" if step.kind == "backward" else "ahead"
    text = (
        f"the clock stepped {direction} by {abs(step.size_s):.3f} s at record {step.record_index} "
        f"({before} to {after}); "
        f"{counted(step.records_before, 'record')} before it moved by {step.shift_s:+.3f} s to join"
    )
    kind = clock.mistake(step)
    text += f"; {Mistake(kind, step.set_s).text}" if kind else ""
    return Finding("warn", f"clock.{step.kind}_step", text, place=f"{after}, record {step.record_index}")


def _times(ledger: LedgerCounts) -> Iterator[Finding]:
    clock = ledger.clock
    if clock.missing_times:
        rows = sum(topic.rows for topic in ledger.topics)
        many = ledger.thresholds.findings.missing_times_share * rows
        severity: Severity = "warn" if clock.missing_times > many else "info"
        text = f"{counted(clock.missing_times, 'record')} without a time: placed by the records around"
        yield Finding(severity, "clock.missing_times", text, count=clock.missing_times)
    if clock.implausible_times:
        text = f"{counted(clock.implausible_times, 'record')} with an impossible time: placed by the records around"
        yield Finding("warn", "clock.implausible_times", text, count=clock.implausible_times)
    if clock.stale_times:
        text = (
            f"{counted(clock.stale_times, 'record')} with the time of an earlier publication (the newest value when "
            "the log began, or a topic whose time does not advance): placed by the records around"
        )
        yield Finding("info", "clock.stale_times", text, count=clock.stale_times)


def _order(clock: ClockModel) -> Iterator[Finding]:
    if clock.is_unordered:
        text = f"the log is not in order of time ({counted(clock.stray_rows, 'record')} after a later one): sorted"
        yield Finding("warn", "time.unordered", text, count=clock.stray_rows)
    elif clock.stray_rows:
        place = f"record {int(clock.stray_index[0])}"
        text = f"{counted(clock.stray_rows, 'record')} out of order, the first at {place}: sorted"
        yield Finding("warn", "time.stray_rows", text, place=place, count=clock.stray_rows)
    if clock.shift_ns:
        text = f"times were moved by {clock.shift_ns / NS_PER_S:+.3f} s so that none is negative"
        yield Finding("info", "clock.shifted", text)


def _absolute(clock: ClockModel) -> Iterator[Finding]:
    """Yield findings on whether the time is UTC, and on how the clock began."""
    if clock.start == "unset":
        began = f"the clock began at {utc_ns_to_iso(clock.first_device_ns)}: it was not set"
        yield Finding("warn", "clock.unset", began + ("" if clock.is_absolute else ", not even later in the log"))
    if clock.is_absolute:
        return
    text = "the log has no absolute time: times count from its own zero"
    if clock.start == "own_zero":
        first_s = clock.first_device_ns / NS_PER_S
        text += f", the first record at {first_s:.3f} s"
        if _UNIX_SECONDS[0] <= first_s < _UNIX_SECONDS[1]:
            text += f" (if these are seconds since 1970, {utc_ns_to_iso(clock.first_device_ns)}: state start_utc)"
    dated = (one for one in clock.relations if one.is_absolute and one.segments)
    known = next((one for one in dated if one.segments[-1].offset_ns >= FIRST_NS), None)  # else it was not set either
    if known is not None:
        zero = known.offset_text(known.segments[-1], has_utc=False)
        text += f"; by {known.name}, the log's {zero}: state it as start_utc"
    yield Finding("info", "clock.no_utc", text)


def _relation(relation: ClockRelation, clock: ClockModel, most_ppm: float) -> Iterator[Finding]:
    for mistake in relation.mistakes:
        place = "" if mistake.time_ns is None else clock.text(mistake.time_ns)
        where = f", from {place} on" if mistake.readings else f", a step at {place}"
        text = f"{relation.name} minus the recorder's: {mistake.text}" + (where if place else "")
        yield Finding("warn", f"clock.{mistake.kind}", text, place=place, count=mistake.readings)
    for one in relation.breaks:
        place = f"{clock.text(one.time_ns)} ± {one.time_sigma_s:.1f} s"
        if one.kind == "step":
            step = f"{one.step_s:+.3f} ± {one.step_sigma_s:.3f} s"
            text = f"{relation.name} minus the recorder's stepped by {step} at {place}"
            yield Finding("warn", "clock.relation_step", text, place=place)
        else:
            change = "" if one.drift_change_ppm is None else f" by {one.drift_change_ppm:+.1f} ppm"
            text = f"the recorder's clock changed its rate against {relation.name}{change} at {place}"
            yield Finding("info", "clock.relation_rate", text, place=place)
    for segment in relation.segments:
        drift, sigma = segment.drift_ppm, segment.drift_sigma_ppm
        if drift is not None and sigma is not None and abs(drift) - NORMAL_95 * sigma > most_ppm:
            pace = "fast" if drift > 0 else "slow"
            text = f"the recorder's clock is {pace} against {relation.name}: {relation.drift_text(segment)}"
            yield Finding("warn", "clock.drift", text, place=f"from {clock.text(segment.start_ns)}")
    if relation.segments and relation.is_utc and clock.is_absolute and not relation.mistakes:
        offset_s = relation.segments[-1].offset_ns / NS_PER_S
        if abs(offset_s) >= 1.0:
            text = f"{relation.name} and the recorder's clock differ by {offset_s:+.3f} s"
            yield Finding("warn", "clock.offset", text)
