"""Damage that a log can have, put into a simulated flight on purpose: rows lost, doubled, a clock set back, bad values.

Truth is never damaged but for the rows that a doubled or re-timed log row carries with it.
"""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import ClassVar, TypeAlias

import numpy as np

from groundstation.base.errors import SettingsError
from groundstation.base.records import BoolArray, Column, Int64Array
from groundstation.base.toml_settings import required_number
from groundstation.base.units import NS_PER_S
from groundstation.tables.table import Flight, Table


@dataclass(frozen=True)
class Dropout:
    """Samples of a topic (empty: of all topics) between two log times are not recorded."""

    kind: ClassVar[str] = "dropout"
    from_s: float = required_number(0.0)
    to_s: float = required_number(0.0)
    topic: str = ""


@dataclass(frozen=True)
class Duplicate:
    """Log rows between two log times are recorded twice in succession."""

    kind: ClassVar[str] = "duplicate"
    from_s: float = required_number(0.0)
    to_s: float = required_number(0.0)


@dataclass(frozen=True)
class BackwardStep:
    """The recorder's clock is set back by ``step_s`` at a log time and runs on from there."""

    kind: ClassVar[str] = "backward_step"
    at_s: float = required_number(0.0)
    step_s: float = required_number(0.0)


@dataclass(frozen=True)
class Stuck:
    """A field keeps the value it had at ``from_s``."""

    kind: ClassVar[str] = "stuck"
    topic: str
    field: str
    from_s: float = required_number(0.0)
    to_s: float = required_number(0.0)


@dataclass(frozen=True)
class NotANumber:
    """The device writes NaN into a numeric field."""

    kind: ClassVar[str] = "nan"
    topic: str
    field: str
    from_s: float = required_number(0.0)
    to_s: float = required_number(0.0)


@dataclass(frozen=True)
class MissingChannel:
    """A topic, or one field of it, was not recorded at all."""

    kind: ClassVar[str] = "missing_channel"
    topic: str
    field: str = ""


Fault: TypeAlias = Dropout | Duplicate | BackwardStep | Stuck | NotANumber | MissingChannel


def apply_faults(flight: Flight, faults: Iterable[Fault]) -> Flight:
    """Damage a flight, fault after fault in the order given; log times are those of the undamaged clock.

    ``time_ns`` stays the true time of every row; ``device_time_ns`` is what the recorder wrote and ``record_index``
    the row of the log.

    Raises
    ------
    SettingsError
        When a fault names a topic or field that the flight does not have.
    """
    for fault in faults:
        match fault:
            case Dropout():
                flight = _drop(flight, fault)
            case Duplicate():
                flight = _duplicate(flight, fault)
            case BackwardStep():
                flight = _step_back(flight, fault)
            case Stuck() | NotANumber():
                flight = _spoil(flight, fault)
            case MissingChannel():
                flight = _remove(flight, fault)
    return _renumbered(flight)


def describe(fault: Fault) -> str:
    """One line for people.

    Examples
    --------
    >>> describe(BackwardStep(at_s=146.0, step_s=2.5))
    'clock set back by 2.5 s at 146 s'
    """
    match fault:
        case Dropout():
            return f"no samples of {fault.topic or 'any topic'} from {fault.from_s:g} to {fault.to_s:g} s"
        case Duplicate():
            return f"every row twice from {fault.from_s:g} to {fault.to_s:g} s"
        case BackwardStep():
            return f"clock set back by {fault.step_s:g} s at {fault.at_s:g} s"
        case Stuck():
            return f"{fault.topic}.{fault.field} stuck from {fault.from_s:g} to {fault.to_s:g} s"
        case NotANumber():
            return f"{fault.topic}.{fault.field} is NaN from {fault.from_s:g} to {fault.to_s:g} s"
        case MissingChannel():
            return f"{'.'.join(filter(None, (fault.topic, fault.field)))} was not recorded"


def _inside(flight: Flight, table: Table, from_s: float, to_s: float) -> BoolArray:
    since_ns = table.time_ns - flight.start_ns
    return (since_ns >= round(from_s * NS_PER_S)) & (since_ns < round(to_s * NS_PER_S))


def _table_of(flight: Flight, fault: Fault, topic: str, field: str = "") -> Table:
    if topic not in flight or (field and field not in flight[topic]):
        name = f"{topic}.{field}" if field else topic
        raise SettingsError(f"fault {fault.kind}", f"no channel {name}", f"one of {', '.join(flight.topics())}")
    return flight[topic]


def _drop(flight: Flight, fault: Dropout) -> Flight:
    if fault.topic:
        _table_of(flight, fault, fault.topic)
    names = [fault.topic] if fault.topic else [topic for topic in flight.topics() if topic != "truth"]
    kept = {name: flight[name].take(~_inside(flight, flight[name], fault.from_s, fault.to_s)) for name in names}
    return replace(flight, tables=dict(flight.tables) | kept)


def _duplicate(flight: Flight, fault: Duplicate) -> Flight:
    rows = all_rows(flight)
    copies = np.ones(len(rows), dtype=np.int64)
    for table in flight.tables.values():
        copies[np.searchsorted(rows, table.record_index[_inside(flight, table, fault.from_s, fault.to_s)])] = 2
    first = np.cumsum(copies) - copies
    tables = {}
    for topic, table in flight.tables.items():
        place = np.searchsorted(rows, table.record_index)
        repeats = copies[place]
        longer = table.take(np.repeat(np.arange(len(table)), repeats))
        second = np.concatenate([[False], np.diff(np.repeat(np.arange(len(table)), repeats)) == 0])[: len(longer)]
        tables[topic] = replace(longer, record_index=np.repeat(first[place], repeats) + second)
    return replace(flight, tables=tables)


def _step_back(flight: Flight, fault: BackwardStep) -> Flight:
    tables = {}
    for topic, table in flight.tables.items():
        after = table.time_ns - flight.start_ns >= round(fault.at_s * NS_PER_S)
        device = table.device_time_ns.values - np.where(after, round(fault.step_s * NS_PER_S), 0)
        tables[topic] = replace(table, device_time_ns=Column(device, table.device_time_ns.present))
    return replace(flight, tables=tables)


def _spoil(flight: Flight, fault: Stuck | NotANumber) -> Flight:
    table = _table_of(flight, fault, fault.topic, fault.field)
    inside, column = _inside(flight, table, fault.from_s, fault.to_s), table.columns[fault.field]
    values = column.values.copy()
    if isinstance(fault, NotANumber):
        if values.dtype.kind != "f":
            raise SettingsError("fault nan", f"{fault.topic}.{fault.field} is not a number", "a numeric field")
        values[inside] = np.nan
    elif inside.any():
        values[inside] = values[np.flatnonzero(inside)[0]]
    columns = dict(table.columns) | {fault.field: Column(values, column.present)}
    return replace(flight, tables=dict(flight.tables) | {fault.topic: replace(table, columns=columns)})


def _remove(flight: Flight, fault: MissingChannel) -> Flight:
    table = _table_of(flight, fault, fault.topic, fault.field)
    tables = dict(flight.tables)
    if fault.field:
        columns = {name: column for name, column in table.columns.items() if name != fault.field}
        tables[fault.topic] = replace(table, columns=columns)
    else:
        del tables[fault.topic]
    return replace(flight, tables=tables)


def all_rows(flight: Flight, topics: Iterable[str] | None = None) -> Int64Array:
    """Rows of the log that hold a sample of any of the topics (all when not named), increasing, shape (n,)."""
    names = flight.topics() if topics is None else tuple(topics)
    last = max((int(flight[name].record_index[-1]) for name in names if len(flight[name])), default=-1)
    holds_sample = np.zeros(last + 1, dtype=bool)  # rows are nearly dense: cheaper than sorting
    for name in names:
        holds_sample[flight[name].record_index] = True
    return np.flatnonzero(holds_sample).astype(np.int64)


def _renumbered(flight: Flight) -> Flight:
    """Rows counted without holes, as a reader of the log would count them."""
    rows = all_rows(flight)
    tables = {
        topic: replace(table, record_index=np.searchsorted(rows, table.record_index).astype(np.int64))
        for topic, table in flight.tables.items()
    }
    return replace(flight, tables=tables)
