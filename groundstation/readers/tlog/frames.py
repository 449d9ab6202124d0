"""Frames of a stretch of a telemetry log: who sent them, when they were received, the values of their fields."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from groundstation.base.records import Column, Int64Array
from groundstation.readers.tlog.dialect import Message

_NS_PER_US = 1_000
_MOST_US = (1 << 62) // _NS_PER_US


@dataclass(frozen=True, eq=False)
class Block:
    """Frames of one stretch: columns as in :mod:`scan`, and the bytes they stand in."""

    data: NDArray[np.uint8]
    frames: NDArray[np.int64]
    first_index: int

    def __len__(self) -> int:
        return len(self.frames)

    @property
    def record_index(self) -> Int64Array:
        """Places of the frames among those of the log."""
        return np.arange(self.first_index, self.first_index + len(self.frames), dtype=np.int64)

    @property
    def received(self) -> Column:
        """Times of receipt, nanoseconds; absent where they are none."""
        time_us = self.frames[:, 0]
        is_time = (time_us >= 0) & (time_us < _MOST_US)
        return Column(np.where(is_time, time_us, 0) * _NS_PER_US, None if is_time.all() else is_time)

    def by_number(self, rows: Int64Array) -> Iterator[tuple[int, Int64Array]]:
        """Each message that occurs among frames, by its number, and which of the frames are of it."""
        order = rows[np.argsort(self.frames[rows, 1], kind="stable")]
        numbers = self.frames[order, 1]
        for which in np.split(order, np.flatnonzero(np.diff(numbers)) + 1):
            yield int(self.frames[which[0], 1]), which

    def of_senders(self) -> Iterator[tuple[int, Int64Array]]:
        """Each sender (system x 256 + component), and which frames it sent."""
        for sender in np.unique(self.frames[:, 2]).tolist():
            yield sender, np.flatnonzero(self.frames[:, 2] == sender)

    def rows(self, which: Int64Array, message: Message) -> NDArray[Any]:
        """Frames of one message as records; a payload of version 2 leaves out the zeros at its end."""
        frames, size = self.frames[which], message.dtype.itemsize
        payloads = np.zeros((len(which), size), dtype=np.uint8)
        lengths = np.minimum(frames[:, 4], size)
        for length in np.unique(lengths[lengths > 0]).tolist():
            rows = np.flatnonzero(lengths == length)
            at_any_byte = np.ndarray((len(self.data) - length + 1,), f"V{length}", self.data.data, strides=(1,))
            payloads[rows, :length] = at_any_byte[frames[rows, 3]].view(np.uint8).reshape(len(rows), length)
        return payloads.view(message.dtype)[:, 0]

    def numbers(self, which: Int64Array, message: Message, name: str) -> NDArray[Any]:
        """One field, a number, of frames of one message."""
        assert message.dtype.fields is not None
        dtype, offset = message.dtype.fields[name][:2]
        frames = self.frames[which]
        left = np.clip(frames[:, 4] - offset, 0, dtype.itemsize)
        places = (frames[:, 3] + offset)[:, None] + np.arange(dtype.itemsize)
        is_there = np.arange(dtype.itemsize) < left[:, None]
        found = np.where(is_there, self.data[np.minimum(places, len(self.data) - 1)], np.uint8(0))
        return np.ascontiguousarray(found).view(dtype)[:, 0]
