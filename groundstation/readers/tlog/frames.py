"""Frames of a stretch of a telemetry log: senders, times of receipt, field values."""

from collections.abc import Iterator, Sequence
from functools import cached_property
from itertools import groupby
from operator import itemgetter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from groundstation.base.dataclasses import dataclass
from groundstation.base.records import Column, Int64Array
from groundstation.readers.tlog.dialect import DialectMessage

_NS_PER_US = 1_000
_MOST_US = (1 << 62) // _NS_PER_US


@dataclass(frozen=True, eq=False)
class FrameBlock:
    """Frames of one stretch: columns as in :mod:`scan`, and the bytes they stand in."""

    data: NDArray[np.uint8]
    frames: NDArray[np.int64]
    first_index: int

    def __len__(self) -> int:
        return len(self.frames)

    @cached_property
    def record_index(self) -> Int64Array:
        """Places of the frames among those of the log."""
        return np.arange(self.first_index, self.first_index + len(self.frames), dtype=np.int64)

    @cached_property
    def received(self) -> Column:
        """Times of receipt, nanoseconds; absent where they are none."""
        time_us = self.frames[:, 0]
        is_time = (time_us >= 0) & (time_us < _MOST_US)
        if is_time.all():
            return Column(time_us * _NS_PER_US)
        return Column(np.where(is_time, time_us, 0) * _NS_PER_US, is_time)

    @cached_property
    def groups(self) -> Sequence[tuple[int, int, Int64Array]]:
        """Groups of frames: sender, number of message, and the frames of both, in that order.

        The sender is system x 256 + component.
        """
        senders, numbers = (self.frames[:, column].astype(np.uint16) for column in (2, 1))  # sorted by their digits
        order = np.argsort(numbers, kind="stable")
        order = order[np.argsort(senders[order], kind="stable")]
        senders, numbers = senders[order], numbers[order]
        edges = np.flatnonzero((senders[1:] != senders[:-1]) | (numbers[1:] != numbers[:-1])) + 1
        first = np.concatenate(([0], edges))[: len(order)]
        pairs = zip(senders[first].tolist(), numbers[first].tolist(), strict=True)
        return [(*pair, which) for pair, which in zip(pairs, np.split(order, edges), strict=False)]

    def by_sender(self) -> Iterator[tuple[int, list[tuple[int, Int64Array]]]]:
        """Each sender, with its messages by number and the frames of each."""
        for sender, groups in groupby(self.groups, key=itemgetter(0)):
            yield sender, [(number, which) for _sender, number, which in groups]

    def rows(self, which: Int64Array, message: DialectMessage) -> NDArray[Any]:
        """Return the frames of one message as records.

        A payload of version 2 leaves out the zeros at its end.
        """
        key = message.name, int(which[0]) if len(which) else -1
        if key not in self._rows or len(self._rows[key]) != len(which):
            self._rows[key] = self._read(which, message)
        return self._rows[key]

    def _read(self, which: Int64Array, message: DialectMessage) -> NDArray[Any]:
        size = message.dtype.itemsize
        places, lengths = self.frames[which, 3], np.minimum(self.frames[which, 4], size)
        if lengths.min(initial=size) == size:
            return np.asarray(self._at_any_byte(np.dtype(f"V{size}"))[places].view(message.dtype))
        payloads = np.zeros((len(which), size), dtype=np.uint8)
        for length in np.flatnonzero(np.bincount(lengths)).tolist():
            if length:
                rows = np.flatnonzero(lengths == length)
                found = self._at_any_byte(np.dtype(f"V{length}"))[places[rows]]
                payloads[rows, :length] = found.view(np.uint8).reshape(len(rows), length)
        return payloads.view(message.dtype)[:, 0]

    def _at_any_byte(self, dtype: np.dtype[Any]) -> NDArray[Any]:
        """Return a view of the bytes whose entry ``k`` is the value that starts at byte ``k``."""
        return np.ndarray((max(len(self.data) - dtype.itemsize + 1, 0),), dtype, self.data.data, strides=(1,))

    @cached_property
    def _rows(self) -> dict[tuple[str, int], NDArray[Any]]:
        return {}
