"""What several sources give to one topic, as one batch in the order of the log."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from groundstation.base.records import MAX_BATCH_ROWS, BoolArray, Column, Int64Array, RecordBatch


@dataclass(frozen=True, eq=False)
class Part:
    """Columns of one topic that one source gave, with place, device time and, where it is another, time of validity."""

    index: Int64Array
    time: Column
    columns: dict[str, Column]
    validity_ns: Int64Array | None = None


def occupied(part: Part) -> Part | None:
    """The rows that have any value; None when there are none."""
    columns = part.columns.values()
    if not part.columns or any(column.present is None for column in columns):
        return part if part.columns else None
    rows: BoolArray = np.logical_or.reduce([column.mask for column in columns])
    if rows.all():
        return part
    if not rows.any():
        return None
    kept = {name: column.take(rows) for name, column in part.columns.items()}
    validity_ns = None if part.validity_ns is None else part.validity_ns[rows]
    return Part(part.index[rows], part.time.take(rows), kept, validity_ns)


def merged(topic: str, parts: Sequence[Part]) -> RecordBatch:
    """One batch of parts from different messages, in the order of the log; each row has the fields of its source."""
    if len(parts) == 1:
        one = parts[0]
        return RecordBatch(topic, one.index, one.time, one.columns, validity_time_ns=one.validity_ns)
    index = np.concatenate([part.index for part in parts])
    order = np.argsort(index, kind="stable")
    time = Column(
        np.concatenate([part.time.values for part in parts])[order],
        np.concatenate([part.time.mask for part in parts])[order],
    )
    columns = {}
    for name in dict.fromkeys(name for part in parts for name in part.columns):
        having = [part.columns.get(name) for part in parts]
        dtype = np.result_type(*(column.values.dtype for column in having if column is not None))
        values, present = np.zeros(len(index), dtype=dtype), np.zeros(len(index), dtype=bool)
        start = 0
        for part, column in zip(parts, having, strict=True):
            rows = slice(start, start + len(part.index))
            start += len(part.index)
            if column is not None:
                values[rows], present[rows] = column.values, column.mask
        columns[name] = Column(values[order], present[order])
    validity_ns = None
    if any(part.validity_ns is not None for part in parts):
        each = [part.time.values if part.validity_ns is None else part.validity_ns for part in parts]
        validity_ns = np.concatenate(each)[order]
    return RecordBatch(topic, index[order], time, columns, validity_time_ns=validity_ns)


def bounded(batch: RecordBatch) -> Iterator[RecordBatch]:
    """The batch in pieces of at most ``MAX_BATCH_ROWS`` rows."""
    for start in range(0, len(batch), MAX_BATCH_ROWS):
        yield batch if len(batch) <= MAX_BATCH_ROWS else batch.take(slice(start, start + MAX_BATCH_ROWS))
