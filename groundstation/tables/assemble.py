"""Tables from record batches and back, the same whether a log or the store was read."""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from types import MappingProxyType

import numpy as np

from groundstation.base.errors import GroundstationError
from groundstation.base.gaps import Pause
from groundstation.base.geodesy import MOST_ON_EARTH_DEG
from groundstation.base.ledger import PauseEntry
from groundstation.base.records import MAX_BATCH_ROWS, Column, RecordBatch
from groundstation.base.signals import has_values, is_canonical
from groundstation.base.units import NS_PER_S
from groundstation.tables.growing import GrowingTable, time_of_validity_ns, unless_all
from groundstation.tables.table import Flight, Table

NOT_TOLD: Mapping[str, int] = MappingProxyType({})


def flight_from_batches(
    batches: Iterable[RecordBatch],
    *,
    metadata: Mapping[str, str],
    has_utc: bool,
    source_name: str,
    rows: Mapping[str, int] = NOT_TOLD,
    pauses: Iterable[PauseEntry] = (),
) -> Flight:
    """Gather batches into one table per topic, in order of time of validity.

    Parameters
    ----------
    batches : iterable of RecordBatch
        Every batch has ``time_ns``. Fields may come and go between the batches of a topic: where a batch lacks a
        field its values are absent. Number types widen to the common one, texts to the longest. Batches without rows
        leave no table, and words and bytes as recorded (:func:`groundstation.base.signals.has_values`) none either.
    metadata, has_utc, source_name
        As in :class:`Flight`.
    rows : mapping of topic to int
        Rows to be expected, as a ledger counts them: each column is then made once. More or fewer do no harm.
    pauses : iterable of PauseEntry
        Those of the ledger.

    Returns
    -------
    Flight
        Rows of equal time keep the order of the source. ``start_ns`` is the first time of any topic. A place that is
        not on Earth (:func:`groundstation.base.geodesy.on_earth`) is absent: the ledger counts it, the store has it.

    Raises
    ------
    GroundstationError
        When a batch has no corrected time.

    Examples
    --------
    >>> def batch(time_ns, **columns):
    ...     index = np.arange(len(time_ns))
    ...     arrays = {name: Column(np.array(values)) for name, values in columns.items()}
    ...     return RecordBatch("ins", index, Column(index), arrays, np.array(time_ns))
    >>> batches = [batch([10, 20], roll_deg=[1.0, 2.0]), batch([30], pitch_deg=[3.0])]
    >>> flight = flight_from_batches(batches, metadata={}, has_utc=False, source_name="a.csv")
    >>> flight["ins"].values("roll_deg").tolist(), flight.start_ns
    ([1.0, 2.0, nan], 10)
    """
    first: dict[str, RecordBatch] = {}
    growing: dict[str, GrowingTable] = {}
    starts_ns, ends_ns = list[int](), list[int]()
    for batch in batches:
        if batch.time_ns is None:
            raise GroundstationError(
                f"{source_name}, {batch.topic}", "records without corrected time", "time_ns", "fit the clock first"
            )
        if not len(batch):
            continue
        if not has_values(batch.topic):
            starts_ns.append(int(batch.time_ns.min()))
            ends_ns.append(int(batch.time_ns.max()))
        elif batch.topic not in first:
            first[batch.topic] = batch  # most topics have one alone: its arrays are the table's
        else:
            if batch.topic not in growing:
                growing[batch.topic] = GrowingTable(batch.topic, rows.get(batch.topic, 0))
                growing[batch.topic].add(first[batch.topic])
            growing[batch.topic].add(batch)
    tables = {}
    for topic in list(first):
        alone, several = first.pop(topic), growing.pop(topic, None)
        tables[topic] = _in_order(_of_one(alone) if several is None else several.table())
    start_ns = min((*(int(table.time_ns[0]) for table in tables.values()), *starts_ns), default=0)
    ends_s = ((one.start_s, one.start_s + one.length_s) for one in pauses)
    paused = (Pause(*(start_ns + round(end_s * NS_PER_S) for end_s in ends)) for ends in ends_s)
    return Flight(tables, metadata, start_ns, has_utc, source_name, tuple(paused), max(ends_ns, default=None))


def batches_from_flight(flight: Flight, max_rows: int = MAX_BATCH_ROWS) -> Iterator[RecordBatch]:
    """Yield the tables as batches of at most ``max_rows`` rows, in order of their first time.

    The order lets a writer keep neighbours in time close together. Nothing is copied.
    """
    pieces = [
        (int(table.time_ns[start]), topic, start)
        for topic, table in flight.tables.items()
        for start in range(0, len(table), max_rows)
    ]
    for _, topic, start in sorted(pieces):
        table, rows = flight[topic], slice(start, start + max_rows)
        columns = {name: column.take(rows) for name, column in table.columns.items()}
        yield RecordBatch(
            topic, table.record_index[rows], table.device_time_ns.take(rows), columns, table.time_ns[rows]
        )


def _of_one(batch: RecordBatch) -> Table:
    """Return the table of a single batch, whose arrays it has."""
    columns = {name: Column(one.values, unless_all(one.present)) for name, one in batch.columns.items()}
    device = Column(batch.device_time_ns.values, unless_all(batch.device_time_ns.present))
    return Table(batch.topic, time_of_validity_ns(batch), columns, batch.record_index, device)


def _in_order(table: Table) -> Table:
    """Return a table in order of time, without places that are not on Earth."""
    if is_canonical(table.topic):
        table = replace(table, columns=_with_places_on_earth(table.columns))
    if np.all(table.time_ns[1:] >= table.time_ns[:-1]):
        return table
    return table.take(np.argsort(table.time_ns, kind="stable"))


def _with_places_on_earth(columns: Mapping[str, Column]) -> Mapping[str, Column]:
    """Columns whose latitude and longitude are absent where one of them is not on Earth."""
    named = {name: columns[name] for name in MOST_ON_EARTH_DEG if name in columns}
    places = {name: column for name, column in named.items() if column.values.dtype.kind in "fiu"}
    beyond = [column.mask & (np.abs(column.values) > MOST_ON_EARTH_DEG[name]) for name, column in places.items()]
    off = np.any(beyond, axis=0) if beyond else np.zeros(0, dtype=bool)
    if not off.any():
        return columns
    return {**columns, **{name: Column(column.values, column.mask & ~off) for name, column in places.items()}}
