"""Merge of what several sources give to one topic, in the order of the log."""

from collections.abc import Iterator, Sequence
from typing import Any
from zlib import crc32

import numpy as np
from numpy.typing import NDArray

from groundstation.base.dataclasses import dataclass
from groundstation.base.one_memory import arrays_at_once
from groundstation.base.records import (
    MAX_BATCH_ROWS,
    BoolArray,
    Column,
    Int64Array,
    RecordBatch,
    frozen,
)

MOST_LATE_NS = 1_000_000_000  # from the time at which values were true to that of their record


@dataclass(frozen=True, eq=False)
class TopicPart:
    """Columns of one topic from one source, with their places in the log and device time.

    ``validity_ns`` is the time of validity, where it differs from the device time; ``source`` names the messages.
    """

    index: Int64Array
    time: Column
    columns: dict[str, Column]
    validity_ns: Int64Array | None = None
    source: str = ""

    @property
    def sources(self) -> Int64Array | None:
        """Number of the source for each row, shape (n,); None where it has no name."""
        return np.broadcast_to(np.int64(crc32(self.source.encode())), len(self.index)) if self.source else None


def sampled_ns(time: Column, told_ns: NDArray[Any]) -> Int64Array | None:
    """Return when values were true by what each record tells.

    Where that cannot be, it is the time of the record.

    Parameters
    ----------
    time : Column of int64
        Time of the records, nanoseconds.
    told_ns : ndarray, shape (n,)
        On the same clock; zero or NaN where a device does not tell.

    Returns
    -------
    ndarray of int64, shape (n,), or None
        None where no record tells another time.

    Examples
    --------
    >>> sampled_ns(Column(np.array([10, 20, 30])), np.array([9.0, 0.0, 31.0])).tolist()
    [9, 20, 30]
    """
    with np.errstate(invalid="ignore"):
        told = np.where((told_ns > 0) & (told_ns <= time.values), told_ns, 0).astype(np.int64)
    is_told = (told > 0) & (time.values - told <= MOST_LATE_NS) & time.mask
    return np.where(is_told, told, time.values) if (is_told & (told != time.values)).any() else None


def occupied(part: TopicPart) -> TopicPart | None:
    """Return the rows that have any value; None when there are none."""
    columns = part.columns.values()
    if not part.columns or any(column.present is None for column in columns):
        return part if part.columns else None
    masks = {id(column.present): column.mask for column in columns}
    rows: BoolArray = np.logical_or.reduce(list(masks.values())) if len(masks) > 1 else next(iter(masks.values()))
    if rows.all():
        return part
    at = np.flatnonzero(rows)
    if not len(at):
        return None
    taken = {identity: frozen(mask[at]) for identity, mask in masks.items()}
    kept = {name: Column(column.values[at], taken[id(column.present)]) for name, column in part.columns.items()}
    validity_ns = None if part.validity_ns is None else part.validity_ns[at]
    return TopicPart(part.index[at], part.time.take(at), kept, validity_ns, part.source)


def merged(topic: str, parts: Sequence[TopicPart]) -> RecordBatch:
    """Merge parts from different messages into one batch, in the order of the log.

    Each row has the fields of its source.
    """
    if len(parts) == 1:
        one = parts[0]
        return RecordBatch(
            topic, one.index, one.time, one.columns, validity_time_ns=one.validity_ns, sources=one.sources
        )
    index = np.concatenate([part.index for part in parts])
    order = np.argsort(index, kind="stable")
    places = np.empty_like(order)
    places[order] = np.arange(len(order))
    places_of = np.split(places, np.cumsum([len(part.index) for part in parts])[:-1])
    columns: dict[str, Column] = {}
    masks: dict[tuple[tuple[int, int], ...], BoolArray | None] = {}  # parts with the same masks share one
    several = {
        name: [(number, part.columns[name]) for number, part in enumerate(parts) if name in part.columns]
        for name in dict.fromkeys(name for part in parts for name in part.columns)
    }
    kinds = {name: np.result_type(*(one.values.dtype for _number, one in known)) for name, known in several.items()}
    memory = dict(zip(kinds, arrays_at_once([(index.shape, kind) for kind in kinds.values()]), strict=True))
    for name, known in several.items():
        pieces = [(places_of[number], column) for number, column in known]
        key = tuple((number, id(column.present)) for number, column in known)
        if key not in masks:
            masks[key] = _present(pieces, len(index))
        columns[name] = Column(_laid(pieces, memory[name]), masks[key])
    times = list(zip(places_of, [part.time for part in parts], strict=True))
    time = Column(_laid(times, np.empty(len(index), dtype=np.int64)), _present(times, len(index)))
    validity_ns = None
    if any(part.validity_ns is not None for part in parts):
        each = [part.time.values if part.validity_ns is None else part.validity_ns for part in parts]
        validity_ns = np.concatenate(each)[order]
    named = [part.sources for part in parts]
    sources = None if any(one is None for one in named) else np.concatenate([one for one in named if one is not None])
    return RecordBatch(
        topic,
        index[order],
        time,
        columns,
        validity_time_ns=validity_ns,
        sources=None if sources is None else sources[order],
    )


def _laid(pieces: Sequence[tuple[Int64Array, Column]], values: NDArray[Any]) -> NDArray[Any]:
    """Lay the values of several pieces at their places, a filler at all others."""
    if sum(len(at) for at, _piece in pieces) < len(values):
        first = pieces[0][1].values[:1]  # a text that never changes is written as one run
        values[:] = np.nan if values.dtype.kind == "f" else first[0] if len(first) else 0
    for at, piece in pieces:
        values[at] = piece.values
    return values


def _present(pieces: Sequence[tuple[Int64Array, Column]], rows: int) -> BoolArray | None:
    """Return where there is a value; None when there is one everywhere."""
    present = np.zeros(rows, dtype=bool)
    for at, piece in pieces:
        present[at] = True if piece.present is None else piece.present
    return None if present.all() else frozen(present)


def bounded(batch: RecordBatch) -> Iterator[RecordBatch]:
    """Yield the batch in pieces of at most ``MAX_BATCH_ROWS`` rows."""
    for start in range(0, len(batch), MAX_BATCH_ROWS):
        yield batch if len(batch) <= MAX_BATCH_ROWS else batch.take(slice(start, start + MAX_BATCH_ROWS))


def one_row_each(batch: RecordBatch) -> RecordBatch:
    """Merge records that are valid at the same time into one row.

    Where two records of an instant have the same field, they stay as they are.
    """
    stamps = batch.validity_time_ns
    if stamps is None:
        return batch
    instants, first, place = np.unique(stamps, return_index=True, return_inverse=True)
    if len(first) == len(batch):
        return batch
    masks = {id(column.present): column.mask for column in batch.columns.values()}
    is_twice = np.zeros(len(instants), dtype=bool)
    for mask in masks.values():
        is_twice |= np.bincount(place[mask], minlength=len(instants)) > 1
    if is_twice.any():
        own = np.flatnonzero(is_twice[place])
        place[own] = len(instants) + np.arange(len(own))
        _places, first, place = np.unique(place, return_index=True, return_inverse=True)
        if len(first) == len(batch):
            return batch
    columns = {}
    for name, column in batch.columns.items():
        values, present = np.zeros(len(first), dtype=column.values.dtype), np.zeros(len(first), dtype=bool)
        mask = masks[id(column.present)]
        at = place[mask]
        values[at], present[at] = column.values[mask], True
        columns[name] = Column(values, None if present.all() else present)
    index, time = batch.record_index[first], batch.device_time_ns.take(first)
    sources = None if batch.sources is None else batch.sources[first]
    made = RecordBatch(batch.topic, index, time, columns, validity_time_ns=stamps[first], sources=sources)
    return made.take(np.argsort(index))
