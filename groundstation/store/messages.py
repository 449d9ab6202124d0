"""Message records as they lie in a chunk: their head, their starts, which are alike."""

from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from groundstation.base.dataclasses import dataclass
from groundstation.base.records import BoolArray, Int64Array

ByteArray = NDArray[np.uint8]

HEAD = np.dtype(
    [
        ("opcode", "u1"),
        ("length", "<u8"),
        ("channel_id", "<u2"),
        ("sequence", "<u4"),
        ("log_time", "<u8"),
        ("publish_time", "<u8"),
    ]
)
MESSAGE_OPCODE = 5
WORD = np.dtype("<u8")
PIECE_BYTES = 8192  # of records that are compared at once


@dataclass(frozen=True)
class ChunkMessages:
    """Message records of one channel inside a chunk.

    Parameters
    ----------
    buffer : ndarray of uint8
        The chunk, decompressed.
    channel_id : int
    starts, sizes : ndarray of int64, shape (n,)
        Where each record starts and how many bytes it has, the nine of opcode and length included.
    stride : int
        Distance of records that follow each other and are equally long; 0 when they are not.
    """

    buffer: ByteArray
    channel_id: int
    starts: Int64Array
    sizes: Int64Array
    stride: int

    def __len__(self) -> int:
        return len(self.starts)

    def matrix(self) -> ByteArray:
        """Return the records as rows of bytes, shape (n, stride), for a stride that is not 0."""
        first = int(self.starts[0])
        return self.buffer[first : first + len(self) * self.stride].reshape(len(self), self.stride)

    def take(self, rows: Any) -> "ChunkMessages":
        """Return the messages that ``rows`` (slice or positions) selects."""
        stride = self.stride if isinstance(rows, slice) and rows.step in (None, 1) else 0
        return ChunkMessages(self.buffer, self.channel_id, self.starts[rows], self.sizes[rows], stride)

    def head(self, name: str) -> Int64Array:
        """Return an entry of every record's head (``"log_time"``) as int64, shape (n,)."""
        dtype, offset = HEAD.fields[name][:2]  # type: ignore[index]
        if self.stride:
            return self.column(dtype, offset).astype(np.int64)
        return at_any_byte(self.buffer, dtype)[self.starts + offset].astype(np.int64)

    @cached_property
    def log_time(self) -> Int64Array:
        """Log time of every message, nanoseconds, shape (n,)."""
        return self.head("log_time")

    @property
    def first_sequence(self) -> int:
        """Sequence number of the first message."""
        return int(np.frombuffer(self.buffer, HEAD, 1, int(self.starts[0]))[0]["sequence"])

    def column(self, dtype: np.dtype[Any], offset: int) -> NDArray[Any]:
        """Return the values ``offset`` bytes into every record, shape (n,), as a strided view.

        The records must have an even stride.
        """
        return np.ndarray((len(self),), dtype, self.buffer.data, int(self.starts[0]) + offset, (self.stride,))

    @cached_property
    def _same(self) -> bytes:
        """Mark of each byte of a record: one where it is the same in all of them, else zero.

        The records must have an even stride. Such a byte is what is left of it by *and* as by *or* over all records,
        many of which are taken at once.
        """
        matrix = self.matrix()
        rows = WORD.itemsize * max(PIECE_BYTES // (WORD.itemsize * self.stride), 1)
        whole = len(matrix) // rows * rows
        pieces = matrix[:whole].reshape(-1, rows * self.stride).view(WORD)

        def over_all(join: np.ufunc) -> ByteArray:
            one = join.reduce(pieces, axis=0).view(np.uint8).reshape(rows, self.stride)
            return join(join.reduce(one, axis=0), join.reduce(matrix[whole:], axis=0))  # type: ignore[no-any-return]

        same: BoolArray = over_all(np.bitwise_and) == over_all(np.bitwise_or)
        return same.tobytes()

    def is_alike(self, start: int, stop: int) -> bool:
        """Tell whether bytes ``start`` to ``stop`` of each record are those of the first.

        The records must have an even stride.
        """
        return 0 not in self._same[start:stop]


def at_any_byte(buffer: ByteArray, dtype: np.dtype[Any]) -> NDArray[Any]:
    """Return a view of a buffer whose entry ``k`` is the value that starts at byte ``k``.

    Entries overlap.

    Indexing it with many places moves whole values, five to ten times faster than a matrix of byte indices.
    """
    return np.ndarray((len(buffer) - dtype.itemsize + 1,), dtype, buffer.data, strides=(1,))
