"""Joining of logs as a step: the record that the MCAP keeps of it, and findings."""

import json
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from groundstation.base.clock import Clock
from groundstation.base.findings import Finding
from groundstation.base.quantiles import NORMAL_95
from groundstation.base.serial import to_json_exactly
from groundstation.base.units import NS_PER_S
from groundstation.systems.joining import JoinRecord, JoinStep, PlacedLog, name_in_flight
from groundstation.systems.several_logs.answer import JoinedLog, JoinedStretch, Joining
from groundstation.systems.several_logs.gnss_time import gnss_time_of
from groundstation.systems.several_logs.relate import relate
from groundstation.systems.several_logs.relation import LogRelation, TimedLog
from groundstation.systems.several_logs.settings import TwoClocksSettings
from groundstation.tables.table import Flight


def told(logs: Sequence[PlacedLog], start_ns: int) -> JoinRecord:
    """Return the record of a joining for the MCAP, and findings.

    Parameters
    ----------
    logs : sequence of PlacedLog
        In the order in which they were named.
    start_ns : int
        Start of the flight.
    """
    joined = tuple(_joined(log, start_ns) for log in logs)
    return JoinRecord(json.dumps(to_json_exactly(Joining(joined)), sort_keys=True), tuple(_findings(joined)))


def _joined(log: PlacedLog, start_ns: int) -> JoinedLog:
    source, relation = log.source, log.relation
    own = JoinedLog(
        log.label, source.name, source.sha256, source.reader, log.rows, "own_clock", reordered=log.reordered
    )
    if relation is None:
        return replace(own, reason="the flight uses its clock")
    gap_sigma = relation.gnss_less_motion_sigma_s
    return replace(
        own,
        method=relation.method,
        reason=relation.reason,
        remarks=relation.remarks,
        signals=relation.signals,
        reference_topic=relation.first_topic,
        topic=name_in_flight(relation.other_topic, log.label),
        correlation=relation.correlation,
        gnss_less_motion_s=relation.gnss_less_motion_s,
        gnss_less_motion_half_width95_s=None if gap_sigma is None else NORMAL_95 * gap_sigma,
        stretches=tuple(_stretches(relation, log.duration_s, start_ns)),
    )


def _stretches(relation: LogRelation, duration_s: float, start_ns: int) -> Iterator[JoinedStretch]:
    ends_s = [*(one.begin_s for one in relation.stretches[1:]), duration_s]
    base_s = (relation.first_start_ns - relation.other_start_ns) / NS_PER_S
    to_flight_s = (relation.first_start_ns - start_ns) / NS_PER_S
    for one, end_s in zip(relation.stretches, ends_s, strict=True):
        begin_s = max(one.begin_s, 0.0)
        at_s = np.array([begin_s, 0.5 * (begin_s + end_s), end_s])
        half_s = NORMAL_95 * one.sigma_at(at_s)
        is_known = bool(np.isfinite(half_s).all())
        yield JoinedStretch(
            start_s=float(begin_s + one.lag_at(begin_s)) + to_flight_s,
            end_s=float(end_s + one.lag_at(end_s)) + to_flight_s,
            method=one.method,
            offset_s=base_s + float(one.lag_at(at_s[1])),
            half_width95_s=float(half_s[1]) if is_known else None,
            largest_half_width95_s=float(half_s.max()) if is_known else None,
            drift_ppm=1e6 * one.drift if is_known else None,
            drift_half_width95_ppm=1e6 * NORMAL_95 * one.drift_sigma if is_known else None,
        )


def _findings(joined: Sequence[JoinedLog]) -> Iterator[Finding]:
    for log in joined:
        if log.method == "own_clock":
            continue
        yield Finding("info", "together.joined", joined_text(log))
        for remark in log.remarks:
            yield Finding("warn", "together.remark", f"{log.source_name}: {remark}")


def joined_text(log: JoinedLog) -> str:
    """Return in one line how a log was joined."""
    longest = max(log.stretches, key=lambda one: one.end_s - one.start_s)
    if longest.half_width95_s is None:
        return f"{log.source_name} is joined by {log.reason}"
    drift = ""
    if longest.drift_ppm is not None and longest.drift_half_width95_ppm is not None:
        drift = f", drift {longest.drift_ppm:+.1f} ppm (95 %: +- {longest.drift_half_width95_ppm:.1f})"
    return (
        f"{log.source_name} is joined with an offset of {longest.offset_s:+.3f} s (95 %: +- "
        f"{longest.half_width95_s:.3f} s){drift} by {log.reason}"
    )


def _timed(flight: Flight, clock: Clock, reader: str, settings: TwoClocksSettings) -> TimedLog:
    return TimedLog(flight, gnss_time_of(clock, reader, settings))


def _relate(first: TimedLog, other: TimedLog, settings: TwoClocksSettings) -> LogRelation:
    return relate(first, other, settings=settings)


STEP = JoinStep(TwoClocksSettings, _timed, _relate, told)
