"""Damage put into a simulated flight: rows lost, doubled, a clock set back, bad values.

Truth is never damaged but for the rows that a doubled or re-timed log row carries with it.
"""

from collections.abc import Iterable
from dataclasses import replace
from typing import ClassVar, TypeAlias

import numpy as np

from groundstation.base.angles import FloatArray, wrap_180
from groundstation.base.dataclasses import dataclass
from groundstation.base.errors import SettingsError
from groundstation.base.geodesy import curvature_radii_m
from groundstation.base.records import BoolArray, Column, Int64Array
from groundstation.base.toml_settings import number, required_number
from groundstation.base.units import NS_PER_S
from groundstation.tables.table import Flight, Table


@dataclass(frozen=True)
class Dropout:
    """Samples of a topic (empty: of all topics) missing between two log times."""

    kind: ClassVar[str] = "dropout"
    from_s: float = required_number(0.0)
    to_s: float = required_number(0.0)
    topic: str = ""


@dataclass(frozen=True)
class Duplicate:
    """Log rows recorded twice in succession between two log times."""

    kind: ClassVar[str] = "duplicate"
    from_s: float = required_number(0.0)
    to_s: float = required_number(0.0)


@dataclass(frozen=True)
class BackwardStep:
    """Recorder's clock set back by ``step_s`` at a log time, from which it runs on."""

    kind: ClassVar[str] = "backward_step"
    at_s: float = required_number(0.0)
    step_s: float = required_number(0.0)


@dataclass(frozen=True)
class ForwardStep:
    """Recorder's clock set ahead by ``step_s`` at a log time, from which it runs on."""

    kind: ClassVar[str] = "forward_step"
    at_s: float = required_number(0.0)
    step_s: float = required_number(0.0)


@dataclass(frozen=True)
class ClockDrift:
    """Drift of the recorder's clock from a log time on: fast, or slow where negative.

    It comes on top of what the clock did before.
    """

    kind: ClassVar[str] = "clock_drift"
    at_s: float = required_number(0.0)
    drift_ppm: float = required_number(-1e5, 1e5)


@dataclass(frozen=True)
class Stuck:
    """Field that keeps the value it had at ``from_s``."""

    kind: ClassVar[str] = "stuck"
    topic: str
    field: str
    from_s: float = required_number(0.0)
    to_s: float = required_number(0.0)


@dataclass(frozen=True)
class NotANumber:
    """NaN that the device writes into a numeric field."""

    kind: ClassVar[str] = "nan"
    topic: str
    field: str
    from_s: float = required_number(0.0)
    to_s: float = required_number(0.0)


@dataclass(frozen=True)
class MissingChannel:
    """Topic, or one field of it, that was not recorded at all."""

    kind: ClassVar[str] = "missing_channel"
    topic: str
    field: str = ""


@dataclass(frozen=True)
class Frozen:
    """Device that repeats all numbers of its last sample while the aircraft moves on."""

    kind: ClassVar[str] = "frozen"
    topic: str
    from_s: float = required_number(0.0)
    to_s: float = required_number(0.0)


@dataclass(frozen=True)
class Jump:
    """Position of a device that is displaced for a while."""

    kind: ClassVar[str] = "jump"
    topic: str
    from_s: float = required_number(0.0)
    to_s: float = required_number(0.0)
    north_m: float = number(0.0, -1e6, 1e6)
    east_m: float = number(0.0, -1e6, 1e6)


@dataclass(frozen=True)
class Reset:
    """Step of a navigator's errors at a log time, which lasts.

    The position steps, and the velocity with the position it adds up to. The Schuler oscillation that such a step
    starts is left out: 4 % of the added position in 10 min.
    """

    kind: ClassVar[str] = "reset"
    topic: str
    at_s: float = required_number(0.0)
    north_m: float = number(0.0, -1e6, 1e6)
    east_m: float = number(0.0, -1e6, 1e6)
    north_mps: float = number(0.0, -1e3, 1e3)
    east_mps: float = number(0.0, -1e3, 1e3)


@dataclass(frozen=True)
class Jitter:
    """Time stamps of a topic up to ``spread_s`` early or late, evenly distributed.

    Its samples get rows of their own.
    """

    kind: ClassVar[str] = "jitter"
    topic: str
    spread_s: float = required_number(0.0, 10.0)
    seed: int = number(1, 0)


Fault: TypeAlias = (
    Dropout
    | Duplicate
    | BackwardStep
    | ForwardStep
    | ClockDrift
    | Stuck
    | NotANumber
    | MissingChannel
    | Frozen
    | Jump
    | Reset
    | Jitter
)


def apply_faults(flight: Flight, faults: Iterable[Fault]) -> Flight:
    """Damage a flight, fault after fault in the order given.

    Log times are those of the undamaged clock. ``time_ns`` stays the true time of every row; ``device_time_ns`` is what
    the recorder wrote and ``record_index`` the row of the log.

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
                flight = _clock_changed(flight, fault.at_s, step_s=-fault.step_s)
            case ForwardStep():
                flight = _clock_changed(flight, fault.at_s, step_s=fault.step_s)
            case ClockDrift():
                flight = _clock_changed(flight, fault.at_s, rate=fault.drift_ppm * 1e-6)
            case Stuck() | NotANumber():
                flight = _spoil(flight, fault)
            case Frozen():
                flight = _freeze(flight, fault)
            case Jump() | Reset():
                flight = _displace(flight, fault)
            case Jitter():
                flight = _jitter(flight, fault)
            case MissingChannel():
                flight = _remove(flight, fault)
    return _renumbered(flight)


def describe(fault: Fault) -> str:
    """Describe a fault in one line for people.

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
        case ForwardStep():
            return f"clock set ahead by {fault.step_s:.12g} s at {fault.at_s:g} s"
        case ClockDrift():
            return f"clock {fault.drift_ppm:+g} ppm off from {fault.at_s:g} s on"
        case Stuck():
            return f"{fault.topic}.{fault.field} stuck from {fault.from_s:g} to {fault.to_s:g} s"
        case NotANumber():
            return f"{fault.topic}.{fault.field} is NaN from {fault.from_s:g} to {fault.to_s:g} s"
        case MissingChannel():
            return f"{'.'.join(filter(None, (fault.topic, fault.field)))} was not recorded"
        case Frozen():
            return f"{fault.topic} repeats one sample from {fault.from_s:g} to {fault.to_s:g} s"
        case Jump():
            place = f"{fault.north_m:g} m north, {fault.east_m:g} m east"
            return f"{fault.topic} position off by {place} from {fault.from_s:g} to {fault.to_s:g} s"
        case Reset():
            steps = (
                f"{fault.north_m:g} m north, {fault.east_m:g} m east, {fault.north_mps:g} and {fault.east_mps:g} m/s"
            )
            return f"{fault.topic} errors step by {steps} at {fault.at_s:g} s"
        case Jitter():
            return f"times of {fault.topic} scatter by up to {fault.spread_s:g} s"


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


def _clock_changed(flight: Flight, at_s: float, *, step_s: float = 0.0, rate: float = 0.0) -> Flight:
    """Change the recorder's clock from a log time on: another time, another rate."""
    tables = {}
    for topic, table in flight.tables.items():
        since_ns = table.time_ns - flight.start_ns - round(at_s * NS_PER_S)
        change_ns = round(step_s * NS_PER_S) + np.rint(rate * since_ns).astype(np.int64)
        device = table.device_time_ns.values + np.where(since_ns >= 0, change_ns, 0)
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


def _freeze(flight: Flight, fault: Frozen) -> Flight:
    table = _table_of(flight, fault, fault.topic)
    inside = _inside(flight, table, fault.from_s, fault.to_s)
    row = np.arange(len(table))
    if inside.any():
        row[inside] = np.flatnonzero(inside)[0]
    columns = {name: column.take(row) for name, column in table.columns.items()}
    return replace(flight, tables=dict(flight.tables) | {fault.topic: replace(table, columns=columns)})


def _displace(flight: Flight, fault: Jump | Reset) -> Flight:
    table = _table_of(flight, fault, fault.topic, "latitude_deg")
    _table_of(flight, fault, fault.topic, "longitude_deg")
    time_s = (table.time_ns - flight.start_ns) / NS_PER_S
    added: dict[str, FloatArray] = {}
    if isinstance(fault, Jump):
        inside = _inside(flight, table, fault.from_s, fault.to_s)
        north, east = inside * fault.north_m, inside * fault.east_m
    else:
        since, after = np.maximum(time_s - fault.at_s, 0.0), time_s >= fault.at_s
        north, east = after * fault.north_m + since * fault.north_mps, after * fault.east_m + since * fault.east_mps
        for name, step in (("velocity_north_mps", fault.north_mps), ("velocity_east_mps", fault.east_mps)):
            if step:
                _table_of(flight, fault, fault.topic, name)
                added[name] = np.asarray(after * step, dtype=np.float64)
    latitude, altitude = table.values("latitude_deg"), np.zeros(len(table))
    if "altitude_ellipsoid_m" in table:
        altitude = table.values("altitude_ellipsoid_m")
    meridian, prime_vertical = curvature_radii_m(latitude)
    parallel = (prime_vertical + altitude) * np.cos(np.deg2rad(latitude))
    added["latitude_deg"] = np.asarray(np.rad2deg(north / (meridian + altitude)))
    added["longitude_deg"] = np.asarray(np.rad2deg(east / parallel))
    columns = dict(table.columns)
    for name, change in added.items():
        moved = columns[name].values + change
        columns[name] = Column(wrap_180(moved) if name == "longitude_deg" else moved, columns[name].present)
    return replace(flight, tables=dict(flight.tables) | {fault.topic: replace(table, columns=columns)})


def _jitter(flight: Flight, fault: Jitter) -> Flight:
    """Move the recorder's times of one topic.

    Its samples leave the rows they shared with other topics.
    """
    table = _table_of(flight, fault, fault.topic)
    closest_s = float(np.min(np.diff(table.time_ns), initial=10**18)) / NS_PER_S
    if 2.0 * fault.spread_s >= closest_s:
        found, expected = f"{fault.spread_s:g} s", f"less than half of the {closest_s:g} s between two samples"
        raise SettingsError("fault jitter, key spread_s", found, expected)
    spread_ns = round(fault.spread_s * NS_PER_S)
    shift = np.random.default_rng(fault.seed).integers(-spread_ns, spread_ns, len(table), endpoint=True)
    device = Column(np.maximum(table.device_time_ns.values + shift, 0), table.device_time_ns.present)
    tables = dict(flight.tables) | {fault.topic: replace(table, device_time_ns=device)}
    keys = []
    for topic, item in tables.items():
        moves = topic == fault.topic
        order = item.time_ns + (shift if moves else 0)
        keys.append(np.stack([order, item.record_index, np.full(len(item), moves)], axis=1))
    _, place = np.unique(np.concatenate(keys), axis=0, return_inverse=True)
    parts = np.split(place.ravel().astype(np.int64), np.cumsum([len(key) for key in keys])[:-1])
    renumbered = zip(tables.items(), parts, strict=True)
    return replace(flight, tables={topic: replace(item, record_index=part) for (topic, item), part in renumbered})


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
    """Return the rows of the log that hold a sample of any of the topics, shape (n,).

    They increase. All topics count when none are named.
    """
    names = flight.topics() if topics is None else tuple(topics)
    last = max((int(flight[name].record_index[-1]) for name in names if len(flight[name])), default=-1)
    holds_sample = np.zeros(last + 1, dtype=bool)  # rows are nearly dense: cheaper than sorting
    for name in names:
        holds_sample[flight[name].record_index] = True
    return np.flatnonzero(holds_sample).astype(np.int64)


def _renumbered(flight: Flight) -> Flight:
    """Number the rows without holes, as a reader of the log would count them."""
    rows = all_rows(flight)
    tables = {
        topic: replace(table, record_index=np.searchsorted(rows, table.record_index).astype(np.int64))
        for topic, table in flight.tables.items()
    }
    return replace(flight, tables=tables)
