"""Binary messages of a block: their fields as columns, one topic a message.

Columns have the receiver's own names.
"""

from collections.abc import Iterator
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from groundstation.base.dataclasses import dataclass
from groundstation.base.records import (
    MAX_BATCH_ROWS,
    MAX_TEXT_CHARACTERS,
    BoolArray,
    Column,
    Int64Array,
    RecordBatch,
)
from groundstation.readers.receiver.layouts import MessageLayout
from groundstation.readers.receiver.stream import Frames

PIECE_BYTES = MAX_TEXT_CHARACTERS // 2  # bytes of a payload in one row, as hexadecimal digits
PIECES_AT_ONCE = 4_096
Columns = dict[str, Column]
_DIGITS = np.frombuffer(b"0123456789abcdef", dtype=np.uint8)


@dataclass(frozen=True, eq=False)
class Messages:
    """Messages of one name in one block.

    Parameters
    ----------
    name : str
    frames : Frames
    places : ndarray of int64, shape (n,)
        Byte of the file at which each begins.
    payload_at, payload_sizes : ndarrays of int64, shape (n,)
        Their payloads in ``frames.data``.
    layout : MessageLayout or None
        None: not known here, the bytes are kept.
    is_sound : bool
        Whether payloads hold all fields of the layout, or of an older version of the message: what is shorter is
        damage, of which the fields that are there are kept, and nothing else is made.
    """

    name: str
    frames: Frames
    places: Int64Array
    payload_at: Int64Array
    payload_sizes: Int64Array
    layout: MessageLayout | None
    is_sound: bool = True

    def __len__(self) -> int:
        return len(self.places)

    @property
    def size(self) -> int:
        """Bytes of the shortest payload: fields behind it are missing."""
        return int(self.payload_sizes.min())

    @property
    def topic(self) -> str:
        """Topic ``raw.<name>``, or ``raw.<name>.<bytes>`` for a payload shorter than the layout.

        The bytes are those of the payload.
        """
        is_usual = self.layout is None or self.size >= self.layout.size
        return f"raw.{self.name}" if is_usual else f"raw.{self.name}.{self.size}"

    @cached_property
    def _head(self) -> NDArray[Any]:
        assert self.layout is not None
        return self.frames.records(self.payload_at, self.layout.head.dtype)

    def head(self) -> NDArray[Any]:
        """Heads as structures, shape (n,)."""
        return self._head

    def has(self, member: str) -> bool:
        """Tell whether the heads have a member."""
        return self.layout is not None and self.layout.head.ends.get(member, self.size + 1) <= self.size

    @property
    def is_short(self) -> bool:
        """Tell whether payloads are shorter than the layout, and of no known older version."""
        if self.layout is None or self.size >= self.layout.size:
            return False  # also for a text that does not fit its layout, which is_sound tells
        return not self.is_sound or self.size >= self.layout.needed

    def misfits(self) -> BoolArray:
        """Tell which messages have a payload that does not fit the layout.

        It is longer than the layout, or does not hold the group as often as it says.
        """
        if self.layout is None or self.size < self.layout.size:
            return np.zeros(len(self), dtype=bool)
        behind = self.payload_sizes - self.layout.size
        if self.layout.group is None:
            return np.asarray(behind != 0)
        width = self.layout.group.dtype.itemsize
        told = np.zeros(len(self), dtype=np.int64) if self.layout.count == "*" else self._told()
        as_they_fit = (told == 0) & (behind % width == 0)  # older versions state no count
        return np.asarray((behind != width * told) & (behind != width * told + self.layout.tail) & ~as_they_fit)

    def _told(self) -> Int64Array:
        """Return the number of groups that each message states."""
        assert self.layout is not None
        return self.layout.head.values(self.head(), self.layout.count).astype(np.int64)

    def group(self) -> tuple[NDArray[Any], Int64Array, Int64Array]:
        """Return the members of the repeated groups, the message of each, its place in the file.

        The members are structures.
        """
        assert self.layout is not None and self.layout.group is not None
        width = self.layout.group.dtype.itemsize
        fits = np.maximum(self.payload_sizes - self.layout.size, 0) // width
        counts = fits
        if self.layout.count != "*":
            told = self._told()
            counts = np.where(told > 0, np.minimum(told, fits), fits)
        owner, number = _repeated(counts)
        records = self.frames.records(
            self.payload_at[owner] + self.layout.size + number * width, self.layout.group.dtype
        )
        return records, owner, self.places[owner] + 1 + number


def _repeated(counts: Int64Array) -> tuple[Int64Array, Int64Array]:
    """Return the owner of each repetition and its number within the owner."""
    owner = np.repeat(np.arange(len(counts)), counts)
    return owner, np.arange(len(owner)) - np.repeat(np.cumsum(counts) - counts, counts)


def raw_batches(messages: Messages, time: Column) -> Iterator[RecordBatch]:
    """Yield batches of ``raw.<name>``, and of ``raw.<name>.group`` where a group repeats.

    The latter have a row for each member of the group.
    """
    topic, layout = messages.topic, messages.layout
    columns = {} if layout is None else layout.head.columns(messages.head(), messages.size)
    if layout is None or not columns:
        yield from _payloads(topic, messages, time)
        return
    yield from bounded(RecordBatch(topic, messages.places, time, columns))
    if layout.group is not None and messages.size >= layout.size:
        records, owner, places = messages.group()
        if len(records):
            columns = layout.group.columns(records)
            yield from bounded(RecordBatch(f"{topic}.group", places, time.take(owner), columns))


def _payloads(topic: str, messages: Messages, time: Column) -> Iterator[RecordBatch]:
    """Yield payloads as hexadecimal digits, in rows of at most PIECE_BYTES."""
    owner, number = _repeated(np.maximum(-(-messages.payload_sizes // PIECE_BYTES), 1))
    for start in range(0, len(owner), PIECES_AT_ONCE):
        rows = slice(start, start + PIECES_AT_ONCE)
        sizes = np.minimum(messages.payload_sizes[owner[rows]] - number[rows] * PIECE_BYTES, PIECE_BYTES)
        width = max(int(sizes.max()), 1)
        content = messages.frames.bytes_at(messages.payload_at[owner[rows]] + number[rows] * PIECE_BYTES, width)
        digits = np.stack((_DIGITS[content >> 4], _DIGITS[content & 15]), axis=2).reshape(len(sizes), 2 * width)
        digits = np.where(np.arange(2 * width) < 2 * sizes[:, None], digits, 0).astype(np.uint8)
        columns = {
            "payload": Column(np.ascontiguousarray(digits).view(f"S{2 * width}")[:, 0].astype(f"U{2 * width}")),
            "piece": Column(number[rows].astype(np.float64)),
        }
        index = messages.places[owner[rows]] + number[rows]
        yield RecordBatch(topic, index, time.take(owner[rows]), columns)


def text_batches(messages: Messages, time: Column) -> Iterator[RecordBatch]:
    """Yield batches of messages that are nothing but a text."""
    for start in range(0, len(messages), PIECES_AT_ONCE):
        rows = slice(start, start + PIECES_AT_ONCE)
        width = int(np.clip(messages.payload_sizes[rows].max(), 1, MAX_TEXT_CHARACTERS))
        content = messages.frames.bytes_at(messages.payload_at[rows], width)
        content = np.where(np.arange(width) < messages.payload_sizes[rows][:, None], content, 0).astype(np.uint8)
        texts = np.char.decode(np.ascontiguousarray(content).view(f"S{width}")[:, 0], "latin-1")
        yield RecordBatch(f"raw.{messages.name}", messages.places[rows], time.take(rows), {"message": Column(texts)})


def bounded(batch: RecordBatch) -> Iterator[RecordBatch]:
    """Yield a batch in pieces of at most MAX_BATCH_ROWS rows."""
    if len(batch) <= MAX_BATCH_ROWS:
        yield batch
        return
    for start in range(0, len(batch), MAX_BATCH_ROWS):
        yield batch.take(slice(start, start + MAX_BATCH_ROWS))


class MessagesByName(dict[str, Messages]):
    """Sound messages of a block by name; of a name that occurs with several lengths the most."""

    def add(self, messages: Messages) -> None:
        """Take in messages."""
        if messages.is_sound and len(messages) > len(self.get(messages.name, ())):
            self[messages.name] = messages

    def fields(self, name: str) -> "dict[str, NDArray[Any]] | None":
        """Values of a message by field; None where the block has none."""
        messages = self.get(name)
        if messages is None or messages.layout is None or not len(messages):
            return None
        return {key: one.values for key, one in messages.layout.head.columns(messages.head(), messages.size).items()}


def occupied(topic: str, places: Int64Array, time: Column, columns: Columns) -> RecordBatch | None:
    """Return a batch of the rows that have any value."""
    if not columns:
        return None
    rows = np.logical_or.reduce([column.mask for column in columns.values()])
    batch = RecordBatch(topic, places, time, columns)
    return batch if rows.all() else (batch.take(rows) if rows.any() else None)


def merged(columns: Columns, newer: Columns) -> Columns:
    """Merge columns: newer values where there are any, older ones elsewhere."""
    merged = {}
    for name, column in newer.items():
        before = columns.get(name)
        if before is not None:
            values = np.where(column.mask, column.values, before.values)
            column = Column(values, column.mask | before.mask)
        merged[name] = column
    return merged
