"""Tables from record batches and back, the same whether a log or the store was read."""

from collections.abc import Iterable, Iterator, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from groundstation.base.errors import GroundstationError
from groundstation.base.geodesy import MOST_ON_EARTH_DEG
from groundstation.base.records import MAX_BATCH_ROWS, BoolArray, Column, Int64Array, RecordBatch
from groundstation.base.signals import has_values, is_canonical
from groundstation.tables.table import Flight, Table


def flight_from_batches(
    batches: Iterable[RecordBatch], *, metadata: Mapping[str, str], has_utc: bool, source_name: str
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
    by_topic: dict[str, list[RecordBatch]] = {}
    starts_ns: list[int] = []
    for batch in batches:
        if batch.time_ns is None:
            raise GroundstationError(
                f"{source_name}, {batch.topic}", "records without corrected time", "time_ns", "fit the clock first"
            )
        if len(batch) and has_values(batch.topic):
            by_topic.setdefault(batch.topic, []).append(batch)
        elif len(batch):
            starts_ns.append(int(batch.time_ns.min()))
    tables = {topic: _table(topic, parts) for topic, parts in by_topic.items()}
    start_ns = min((*(int(table.time_ns[0]) for table in tables.values()), *starts_ns), default=0)
    return Flight(tables, metadata, start_ns, has_utc, source_name)


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


def _table(topic: str, parts: list[RecordBatch]) -> Table:
    lengths = [len(part) for part in parts]
    names = dict.fromkeys(name for part in parts for name in part.columns)  # in order of first appearance
    columns = {name: _column([part.columns.get(name) for part in parts], lengths) for name in names}
    table = Table(
        topic,
        np.concatenate([_time_of_validity_ns(part) for part in parts]),
        _with_places_on_earth(columns) if is_canonical(topic) else columns,
        np.concatenate([part.record_index for part in parts]),
        _column([part.device_time_ns for part in parts], lengths),
    )
    if np.all(table.time_ns[1:] >= table.time_ns[:-1]):
        return table
    return table.take(np.argsort(table.time_ns, kind="stable"))


def _time_of_validity_ns(part: RecordBatch) -> Int64Array:
    assert part.time_ns is not None  # checked where the batches come in
    return part.time_ns if part.validity_time_ns is None else part.validity_time_ns


def _column(pieces: list[Column | None], lengths: list[int]) -> Column:
    """Join the pieces of one field; None stands for a batch without it."""
    known = [piece for piece in pieces if piece is not None]
    if len(pieces) == 1:
        return Column(known[0].values, _unless_all(known[0].present))
    dtype = _common_type([piece.values.dtype for piece in known])
    values: NDArray[Any] = np.empty(sum(lengths), dtype=dtype)
    is_partial = len(known) < len(pieces) or any(piece.present is not None for piece in known)
    present = np.ones(len(values), dtype=bool) if is_partial else None
    end = 0
    for piece, length in zip(pieces, lengths, strict=True):
        start, end = end, end + length
        if piece is not None:
            values[start:end] = piece.values
        else:
            values[start:end] = np.nan if dtype.kind == "f" else np.zeros(1, dtype=dtype)
        if present is not None:
            present[start:end] = False if piece is None else piece.mask
    return Column(values, _unless_all(present))


def _with_places_on_earth(columns: dict[str, Column]) -> dict[str, Column]:
    """Columns whose latitude and longitude are absent where one of them is not on Earth."""
    named = {name: columns[name] for name in MOST_ON_EARTH_DEG if name in columns}
    places = {name: column for name, column in named.items() if column.values.dtype.kind in "fiu"}
    beyond = [column.mask & (np.abs(column.values) > MOST_ON_EARTH_DEG[name]) for name, column in places.items()]
    off = np.any(beyond, axis=0) if beyond else np.zeros(0, dtype=bool)
    if not off.any():
        return columns
    return columns | {name: Column(column.values, column.mask & ~off) for name, column in places.items()}


def _common_type(dtypes: list[np.dtype[Any]]) -> np.dtype[Any]:
    first = dtypes[0]
    return first if all(dtype == first for dtype in dtypes) else np.result_type(*dtypes)


def _unless_all(present: BoolArray | None) -> BoolArray | None:
    return None if present is None or present.all() else present
