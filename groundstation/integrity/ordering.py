"""Records in order of corrected time, topic by topic, streaming."""

from collections.abc import Iterable, Iterator, Sequence

import numpy as np

from groundstation.base.records import MAX_BATCH_ROWS, BoolArray, Column, Item, RecordBatch
from groundstation.integrity.clock import ClockModel


def corrected(items: Iterable[Item], clock: ClockModel, *, for_tables: bool = False) -> Iterator[RecordBatch]:
    """Yield the batches of a log with corrected time, each topic in time order.

    ``time_ns`` never decreases within a topic. A record is held back until no earlier one of its topic can follow,
    which the lateness found by the survey tells: memory is bounded by it. Records of equal time keep the order of the
    source. Damages and remarks are left out: the survey has them.

    Parameters
    ----------
    items : iterable of Item
        The same log again.
    clock : ClockModel
        From the survey of that log.
    for_tables : bool
        The last rows of a topic with late records come with those before them, in one batch: a table of one batch has
        its arrays, and copies none. Topics then come in another order.
    """
    if not clock.has_times:
        return
    held: dict[str, tuple[RecordBatch, int]] = {}  # with the number of rows before which no earlier one can come
    reached: dict[str, int] = {}
    for item in items:
        if not isinstance(item, RecordBatch) or not len(item):
            continue
        batch = clock.correct(item)
        topic, lateness = batch.topic, clock.lateness_ns.get(item.topic, 0)
        if not lateness:
            yield from _bounded(batch)
            continue
        if topic in held:
            before, ready = held.pop(topic)
            if ready:
                yield from _bounded(before.take(slice(0, ready)))
            batch = joined([before.take(slice(ready, None)), batch]) if ready < len(before) else batch
        batch = _ordered(batch)
        time = _times(batch)
        reached[topic] = max(reached.get(topic, int(time[-1])), int(time[-1]))
        ready = int(np.searchsorted(time, reached[topic] - lateness, side="right"))
        if ready and not for_tables:
            yield from _bounded(batch.take(slice(0, ready)))
            batch, ready = batch.take(slice(ready, None)), 0
        if len(batch):
            held[topic] = batch, ready
    for topic in sorted(held):
        yield from _bounded(held[topic][0])


def _times(batch: RecordBatch) -> np.ndarray[tuple[int], np.dtype[np.int64]]:
    assert batch.time_ns is not None, "a corrected batch has times"
    return batch.time_ns


def _ordered(batch: RecordBatch) -> RecordBatch:
    time = _times(batch)
    return batch.take(np.argsort(time, kind="stable")) if (time[1:] < time[:-1]).any() else batch


def _bounded(batch: RecordBatch) -> Iterator[RecordBatch]:
    for start in range(0, len(batch), MAX_BATCH_ROWS):
        yield batch if len(batch) <= MAX_BATCH_ROWS else batch.take(slice(start, start + MAX_BATCH_ROWS))


def joined(batches: Sequence[RecordBatch]) -> RecordBatch:
    """Join batches of one topic, in the order given.

    A field that one of them lacks is absent there.
    """
    names = dict.fromkeys(name for batch in batches for name in batch.columns)
    validity = [batch.validity_time_ns if batch.validity_time_ns is not None else batch.time_ns for batch in batches]
    has_validity = any(batch.validity_time_ns is not None for batch in batches)
    return RecordBatch(
        batches[0].topic,
        np.concatenate([batch.record_index for batch in batches]),
        joined_columns([batch.device_time_ns for batch in batches]),
        {name: joined_columns([_column_of(batch, name, batches) for batch in batches]) for name in names},
        np.concatenate([_times(batch) for batch in batches]),
        np.concatenate([time for time in validity if time is not None]) if has_validity else None,
    )


def _column_of(batch: RecordBatch, name: str, batches: Sequence[RecordBatch]) -> Column:
    column = batch.columns.get(name)
    if column is not None:
        return column
    kind = next(other.columns[name].values.dtype for other in batches if name in other.columns)
    return Column(np.zeros(len(batch), dtype=kind), np.zeros(len(batch), dtype=bool))


def joined_columns(columns: Sequence[Column]) -> Column:
    """Join columns into one, in the order given."""
    present: BoolArray | None = None
    if any(column.present is not None for column in columns):
        present = np.concatenate([column.mask for column in columns])
    return Column(np.concatenate([column.values for column in columns]), present)
