"""A table that takes batch after batch: every column is held once."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from groundstation.base.one_memory import arrays_at_once
from groundstation.base.records import BoolArray, Column, Int64Array, RecordBatch
from groundstation.tables.table import Table

MORE = 8  # a column that is full gets room for an eighth more
MOST_AHEAD = 1024  # times the rows that came: what a damaged count asks for beyond is not believed


class GrowingTable:
    """Rows of one topic, copied into columns as batches come.

    The arrays of a batch are then free. Where a batch lacks a field its values are absent; number types widen to the
    common one, texts to the longest. With the expected number of ``rows`` no column is moved.

    Examples
    --------
    >>> def batch(first, **columns):
    ...     index = np.arange(first, first + 2)
    ...     return RecordBatch("ins", index, Column(index), {k: Column(np.array(v)) for k, v in columns.items()}, index)
    >>> table = GrowingTable("ins", rows=4)
    >>> table.add(batch(0, mode=["nav", "nav"]))
    >>> table.add(batch(2, mode=["attitude", "nav"], roll_deg=[1.0, 2.0]))
    >>> made = table.table()
    >>> made["mode"].tolist(), made.values("roll_deg").tolist()
    (['nav', 'nav', 'attitude', 'nav'], [nan, nan, 1.0, 2.0])
    """

    def __init__(self, topic: str, rows: int = 0) -> None:
        self._topic, self._expected = topic, rows
        self._rows = 0
        self._time_ns, self._index, self._device = _Growing(), _Growing(), _Growing()
        self._columns: dict[str, _Growing] = {}

    def add(self, batch: RecordBatch) -> None:
        """Take the rows of a batch; it has ``time_ns``."""
        start, end = self._rows, self._rows + len(batch)
        room = max(min(self._expected, MOST_AHEAD * end), end)
        new = {name: one.values.dtype for name, one in batch.columns.items() if name not in self._columns}
        clocks = [] if start else [np.dtype(np.int64)] * 3
        memory = arrays_at_once([((room,), kind) for kind in (*clocks, *new.values())])
        if clocks:
            self._time_ns, self._index, self._device = map(_Growing, memory[:3])
        self._columns |= zip(new, map(_Growing, memory[len(clocks) :]), strict=True)
        self._time_ns.put(Column(time_of_validity_ns(batch)), start, end, room)
        self._index.put(Column(batch.record_index), start, end, room)
        self._device.put(batch.device_time_ns, start, end, room)
        for name, growing in self._columns.items():
            growing.put(batch.columns.get(name), start, end, room)
        self._rows = end

    def table(self) -> Table:
        """Return the rows as a table, in the order in which they came; nothing comes after."""
        return Table(
            self._topic,
            self._time_ns.column(self._rows).values,
            {name: growing.column(self._rows) for name, growing in self._columns.items()},
            self._index.column(self._rows).values,
            self._device.column(self._rows),
        )


def time_of_validity_ns(batch: RecordBatch) -> Int64Array:
    """Return the corrected times at which the values of a batch were true, shape (n,)."""
    assert batch.time_ns is not None  # checked where the batches come in
    return batch.time_ns if batch.validity_time_ns is None else batch.validity_time_ns


def unless_all(present: BoolArray | None) -> BoolArray | None:
    """Return a mask of presence; None where it says that everything is present."""
    return None if present is None or present.all() else present


class _Growing:
    """Column that grows: its values, and its mask from the first absent value on."""

    def __init__(self, memory: NDArray[Any] | None = None) -> None:
        self._values: NDArray[Any] = np.empty(0) if memory is None else memory
        self._present: BoolArray | None = None
        self._types: list[np.dtype[Any]] = []  # that came, in their order

    def put(self, piece: Column | None, start: int, end: int, room: int) -> None:
        """Write a piece to the rows from ``start`` to ``end``; None: all are absent."""
        if piece is not None and piece.values.dtype not in self._types:
            self._widen(piece.values.dtype, start, room)
        if end > len(self._values):
            self._values = _moved(self._values, start, max(room, end + end // MORE), self._values.dtype)
        self._values[start:end] = self._filler if piece is None else piece.values
        if self._present is None and (piece is None or piece.present is not None):
            self._present = np.ones(len(self._values), dtype=bool)
        if self._present is not None:
            if end > len(self._present):
                self._present = _moved(self._present, start, len(self._values), np.dtype(bool))
            self._present[start:end] = False if piece is None else piece.mask

    def column(self, rows: int) -> Column:
        """Return the rows as a column."""
        return Column(_cut(self._values, rows), unless_all(None if self._present is None else self._present[:rows]))

    @property
    def _filler(self) -> Any:
        dtype = self._values.dtype
        return np.nan if dtype.kind == "f" else np.zeros((), dtype=dtype)

    def _widen(self, dtype: np.dtype[Any], start: int, room: int) -> None:
        """Make place for values of another type; rows before the first value are absent."""
        is_first = not self._types
        self._types.append(dtype)
        common = np.result_type(*self._types) if len(self._types) > 1 else dtype
        if is_first:
            if len(self._values) != room or self._values.dtype != common:
                self._values = np.empty(room, dtype=common)
            if start:
                self._values[:start] = self._filler
                self._present = np.ones(room, dtype=bool)
                self._present[:start] = False
        elif common != self._values.dtype:
            self._values = _moved(self._values, start, len(self._values), common)


def _moved(values: NDArray[Any], rows: int, room: int, dtype: np.dtype[Any]) -> NDArray[Any]:
    larger = np.empty(room, dtype=dtype)
    larger[:rows] = values[:rows]
    return larger


def _cut(values: NDArray[Any], rows: int) -> NDArray[Any]:
    """Return the first rows; a copy where much room is left."""
    return values[:rows].copy() if len(values) > rows + rows // MORE else values[:rows]
