"""Messages of an autopilot: logged text, error codes, events, changes of mode.

A text that has no level (MSG of DataFlash) is graded by known words. A failsafe is never information, unless the text
or the code says that it is over.
"""

import re
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from groundstation.base.ardupilot_codes import (
    EVENTS,
    LANES,
    MODE_REASONS,
    MODES,
    error_name,
    error_severity,
    event_severity,
    mode_severity,
)
from groundstation.base.findings import Finding
from groundstation.base.log_levels import severity_of_level, severity_of_text
from groundstation.base.printable import printable
from groundstation.base.units import NS_PER_S
from groundstation.systems.health.evidence import Event, Grade
from groundstation.systems.health.logged import is_number, named
from groundstation.tables.table import Flight, Table

ULOG_TEXT, DATAFLASH_TEXT, MAVLINK_TEXT = "raw.ulog.text", "raw.MSG", "raw.STATUSTEXT"
_COLOURS, _MODULE = re.compile("\x1b\\[[0-9;]*m"), re.compile(r"^\[\w+\]\s+(?=\S)")
# A measured number: with a fraction, of three digits and more, or with its unit; a smaller one counts units of a kind.
_VALUE = re.compile(r"(?<![\w.])[-+]?(?:\d+\.\d+|\d{3,}|\d+(?= ?(?:[VAsm%°]|m[As]h?|km|deg|hz)\b))", re.I)
_ESTIMATOR_EVENTS = (60, 62)
_SWITCH_EVENTS = (67, 90)
_OF_CHECK = (
    ("switches", re.compile(r"lane switch|switch(?:ed|ing) to (?:compass|lane|imu|gps|primary)", re.I)),
    ("resets", re.compile(r"(?:yaw|position|velocity|height) re-?(?:set|align)", re.I)),
    ("gnss", re.compile(r"\b(?:gps|gnss)\b.*(?:glitch|lost|no fix|jamm|spoof|unhealthy)", re.I)),
    ("battery", re.compile(r"battery", re.I)),
)
YAW_RESET, ALIGNED = 62, re.compile(r"in-?flight yaw alignment complete", re.I)
MOST_TOLD = 12  # kinds of messages that are a finding each


class Message(NamedTuple):
    """Text that was logged, with its grade."""

    time_ns: int
    grade: Grade
    text: str
    source: str


def messages(flight: Flight) -> tuple[Message, ...]:
    """Return logged text in order of time, graded by its level, or else by its words."""
    return flight.once("logged messages", lambda one: tuple(sorted(_read(one))))


def _read(flight: Flight) -> Iterator[Message]:
    for topic, field, level in (
        (ULOG_TEXT, "text", "severity"),
        (DATAFLASH_TEXT, "Message", ""),
        (MAVLINK_TEXT, "text", "severity"),
    ):
        if topic not in flight or not flight[topic].has(field):
            continue
        table = flight[topic]
        texts = table.text(field).tolist()
        levels: list[int | str | None] = _levels(table, level) if level else [None] * len(texts)
        for time_ns, text, one in zip(table.time_ns.tolist(), texts, levels, strict=True):
            said = plain(text)
            if said:
                grade = severity_of_text(said) if one is None else severity_of_level(one, said)
                yield Message(time_ns, grade, said, topic)


def plain(text: str) -> str:
    """Return what was said, without colours of a terminal and without the module that said it.

    Examples
    --------
    >>> plain("\\x1b[33m[commander] Failsafe activated\\x1b[0m")
    'Failsafe activated'
    """
    return _MODULE.sub("", printable(_COLOURS.sub("", text)).strip())


def _levels(table: Table, field: str) -> list[int | str | None]:
    """Return levels as numbers or names, None where they are absent."""
    if not is_number(table, field):
        names = table.text(field).tolist() if table.has(field) else [""] * len(table)
        return [one or None for one in names]
    return [int(one) if np.isfinite(one) else None for one in table.values(field).tolist()]


def events(flight: Flight) -> tuple[Event, ...]:
    """Return text, codes and changes of mode as events of checks, read once a flight."""
    return flight.once("events of the autopilot's messages", _events)


def _events(flight: Flight) -> tuple[Event, ...]:
    return (*texts(flight), *_errors(flight), *_plain_events(flight), *_modes(flight))


def texts(flight: Flight) -> Iterator[Event]:
    """Yield logged text as events of the checks it speaks of.

    A switch keeps its check as information, too: ArduPilot tells the change of a compass at that level.
    """
    for one in messages(flight):
        told = (check for check, words in _OF_CHECK if words.search(one.text))
        check = next((check for check in told if one.grade != "info" or check == "switches"), "faults")
        yield Event(check, one.time_ns, one.grade, one.text, one.source)


def _errors(flight: Flight) -> Iterator[Event]:
    if "raw.ERR" not in flight or not is_number(flight["raw.ERR"], "Subsys", "ECode"):
        return
    table = flight["raw.ERR"]
    for time_ns, subsystem, code in zip(
        table.time_ns.tolist(), table.values("Subsys").tolist(), table.values("ECode").tolist(), strict=True
    ):
        if not (np.isfinite(subsystem) and np.isfinite(code)):
            continue
        is_switch = int(subsystem) == LANES
        grade = error_severity(int(subsystem), int(code))
        text = error_name(int(subsystem), int(code))
        yield Event("switches" if is_switch else "faults", time_ns, grade, text, "raw.ERR")


def _plain_events(flight: Flight) -> Iterator[Event]:
    """Yield EV records.

    The alignment of yaw that a filter makes in flight by design is no reset.
    """
    if "raw.EV" not in flight or not is_number(flight["raw.EV"], "Id"):
        return
    table = flight["raw.EV"]
    aligned = np.array([one.time_ns for one in messages(flight) if ALIGNED.search(one.text)], dtype=np.int64)
    for time_ns, number in zip(table.time_ns.tolist(), table.values("Id").tolist(), strict=True):
        if not np.isfinite(number):
            continue
        kind = int(number)
        check = "resets" if kind in _ESTIMATOR_EVENTS else "switches" if kind in _SWITCH_EVENTS else "faults"
        is_aligned = kind == YAW_RESET and bool(np.any(np.abs(aligned - time_ns) < NS_PER_S))
        grade: Grade = "info" if is_aligned else event_severity(kind)
        yield Event(check, time_ns, grade, EVENTS.get(kind, f"event {kind}"), "raw.EV")


def _modes(flight: Flight) -> Iterator[Event]:
    """Yield changes of mode; one whose reason is a failsafe is graded so."""
    if "raw.MODE" not in flight:
        return
    table = flight["raw.MODE"]
    number, reason = named(table, "ModeNum", "Mode"), named(table, "Rsn")
    if not number:
        return
    names = _mode_names(flight)
    reasons = table.values(reason).tolist() if reason else [np.nan] * len(table)
    for time_ns, mode, why in zip(table.time_ns.tolist(), table.values(number).tolist(), reasons, strict=True):
        if not np.isfinite(mode):
            continue
        known = int(why) if np.isfinite(why) else -1
        told = f", reason: {MODE_REASONS[known]}" if known in MODE_REASONS else ""
        name = names.get(int(mode), f"{mode:.0f}")
        grade = mode_severity(known)
        yield Event("modes" if grade == "info" else "faults", time_ns, grade, f"mode {name}{told}", "raw.MODE")


def _mode_names(flight: Flight) -> dict[int, str]:
    known = MODES.get(flight.metadata.get("vehicle", ""), ())
    return {number: name for number, name in enumerate(known) if name}


def kind_of_text(text: str) -> str:
    """Return a text with ``#`` for what was measured; numbers of units stay.

    Examples
    --------
    >>> kind_of_text("EKF2 IMU1 switching to compass 1")
    'EKF2 IMU1 switching to compass 1'
    >>> kind_of_text("Battery 1 low 10.2V used 4000 mAh"), kind_of_text("Flow lost for 12 s")
    ('Battery 1 low #V used # mAh', 'Flow lost for # s')
    """
    return _VALUE.sub("#", text)


def findings(flight: Flight) -> tuple[Finding, ...]:
    """Return a finding for each kind of warning or failure that was said.

    It has how often and when first. A finding that fails would say that the log could not be processed: it warns.

    Texts that differ in measured values alone are one kind; another unit (IMU 0, IMU 1) is another. Beyond
    ``MOST_TOLD`` kinds the rest is counted.
    """
    groups: dict[tuple[str, str], list[Event]] = {}
    for event in sorted(events(flight), key=lambda one: one.time_ns):
        if event.grade != "info":
            groups.setdefault((event.grade, kind_of_text(event.text)), []).append(event)
    ordered = sorted(groups.values(), key=lambda group: (group[0].grade != "fail", group[0].time_ns))
    told = [_finding(flight, group) for group in ordered[:MOST_TOLD]]
    if len(ordered) > MOST_TOLD:
        rest = [event for group in ordered[MOST_TOLD:] for event in group]
        text = f"{len(rest)} further messages of {len(ordered) - MOST_TOLD} kinds"
        told.append(Finding("warn", "health.said", text, "event", count=len(rest)))
    return tuple(told)


def _finding(flight: Flight, group: list[Event]) -> Finding:
    first = group[0]
    is_same = all(one.text == first.text for one in group)
    times = "" if len(group) == 1 else f", {len(group)} times{'' if is_same else ' with other values'}"
    place = f"at {flight.seconds(np.array([first.time_ns]))[0]:.1f} s"
    return Finding("warn", "health.said", f"{first.text}{times}", first.source, place, len(group))
