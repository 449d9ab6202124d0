"""Cut a receiver's stream into blocks of frames; bytes of no frame are counted."""

from collections.abc import Callable, Iterator
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from groundstation.base.dataclasses import dataclass
from groundstation.base.errors import UnreadableLogError
from groundstation.base.records import Damage, Int64Array
from groundstation.readers.receiver import scan
from groundstation.readers.skipped import SkippedBytes, bytes_place
from groundstation.readers.source import Source

BLOCK_BYTES = 4 << 20
MOST_HELD_BACK = 1 << 18  # bytes of an epoch that wait for the next block
SMALLEST_FRAME = 5
_crc_tables = cache(scan.crc_tables)


@dataclass(frozen=True, eq=False)
class Frames:
    """Frames of one block.

    Parameters
    ----------
    data : ndarray of uint8
    first_byte : int
        Place of ``data`` in the file.
    offsets, lengths : ndarrays of int64, shape (n,)
        Where each frame begins in ``data`` and how many bytes it has.
    kinds : ndarray of uint8, shape (n,)
        Protocol, as :mod:`scan` numbers them.
    texts : ndarray of int64, shape (n, 2), optional
        Bytes of a computer's text in front of each frame and behind it; None where there is none at all.
    """

    data: NDArray[np.uint8]
    first_byte: int
    offsets: Int64Array
    lengths: Int64Array
    kinds: NDArray[np.uint8]
    texts: Int64Array | None = None

    def __len__(self) -> int:
        return len(self.offsets)

    @property
    def places(self) -> Int64Array:
        """Bytes of the file at which the frames begin: their record index."""
        return self.first_byte + self.offsets

    def of(self, *kinds: int) -> Int64Array:
        """Return the numbers of the frames of these protocols, increasing."""
        return np.flatnonzero(np.isin(self.kinds, kinds))

    def bytes_at(self, offsets: Int64Array, width: int) -> NDArray[np.uint8]:
        """Return ``width`` bytes at each place, shape (n, width); zeros past the end of data."""
        if len(offsets) and int(offsets.max()) + width > len(self.data):
            padded = np.concatenate((self.data, np.zeros(width, dtype=np.uint8)))
            return np.lib.stride_tricks.sliding_window_view(padded, width)[offsets]
        if not len(offsets):
            return np.zeros((0, width), dtype=np.uint8)
        return np.lib.stride_tricks.sliding_window_view(self.data, width)[offsets]

    def records(self, offsets: Int64Array, dtype: np.dtype[Any]) -> NDArray[Any]:
        """Structures at given places, shape (n,), copied."""
        return np.ascontiguousarray(self.bytes_at(offsets, dtype.itemsize)).view(dtype)[:, 0]

    def head(self, count: int) -> "Frames":
        """Return the first ``count`` frames."""
        texts = None if self.texts is None else self.texts[:count]
        return Frames(self.data, self.first_byte, self.offsets[:count], self.lengths[:count], self.kinds[:count], texts)


class Stream:
    """Iterator over the blocks of a stream; knows the damage once it is through.

    Parameters
    ----------
    source : Source
    bare : bool
        Sentences without a checksum are taken.
    epoch_start : callable, optional
        Number of the first frame of the last epoch of a block: that frame and those behind it wait for the next block,
        so that what belongs together comes together.
    is_hosts : callable, optional
        Whether a text in front of a sentence (True) or behind it (False) is that of the computer that recorded; without
        it there is no such text.
    """

    def __init__(
        self,
        source: Source,
        bare: bool = False,
        epoch_start: Callable[[Frames], int] | None = None,
        is_hosts: Callable[[bytes, bool], bool] | None = None,
    ) -> None:
        self._source, self._bare, self._epoch_start, self._is_hosts = source, bare, epoch_start, is_hosts
        self._skipped = SkippedBytes("frame")
        self._cut: tuple[int, int] | None = None
        self._state = scan.new_state()
        self._spans = np.empty((1 << 12, 2), dtype=np.int64)

    def __iter__(self) -> Iterator[Frames]:
        data, base = np.zeros(0, dtype=np.uint8), 0
        with self._source.open() as stream:
            while True:
                data, is_last = self._longer(data, stream.readinto)  # type: ignore[attr-defined]
                yield from self._blocks(data, base, is_last)
                if is_last:
                    break
                position, skip = int(self._state[scan.POSITION]), int(self._state[scan.SKIP_START])
                done = skip if self._is_hosts and 0 <= position - skip <= scan.LONGEST_TEXT else position
                data, base = data[done:], base + done
                self._state[scan.POSITION] = position - done
                if self._state[scan.SKIP_START] != scan.NOWHERE:
                    self._state[scan.SKIP_START] -= done
        self._finish(data, base)

    def damages(self) -> Iterator[Damage]:
        """Yield the bytes that were skipped, in the order of the file."""
        yield from self._skipped.damages()
        if self._cut is not None:
            start, end = self._cut
            what = "bytes of a frame that the end of the file cuts off"
            yield Damage("truncated", bytes_place(start, end), end - start, what, between_records=(start - 1, start))

    def _held_back(self, block: Frames) -> int:
        """Return how many frames of a block are given now."""
        if self._epoch_start is None or not len(block):
            return len(block)
        first = self._epoch_start(block)
        waiting = len(block.data) - int(block.offsets[first]) if first < len(block) else 0
        return len(block) if waiting > MOST_HELD_BACK + scan.LONGEST or first == 0 else first

    def _longer(self, data: NDArray[np.uint8], read_into: Callable[[Any], int]) -> tuple[NDArray[np.uint8], bool]:
        whole = np.empty(len(data) + BLOCK_BYTES, dtype=np.uint8)
        whole[: len(data)] = data
        try:
            count = read_into(whole[len(data) :])
        except OSError as error:  # a failing disk or network share
            raise UnreadableLogError(
                self._source.name, f"no more data ({error.strerror})", "", "copy it again"
            ) from error
        return whole[: len(data) + count], count < BLOCK_BYTES

    def _blocks(self, data: NDArray[np.uint8], base: int, is_last: bool) -> Iterator[Frames]:
        """Yield the blocks of the data at hand: one, or more where damage is frequent."""
        offsets = np.empty(len(data) // SMALLEST_FRAME + 1, dtype=np.int64)
        lengths, kinds = np.empty_like(offsets), np.empty(len(offsets), dtype=np.uint8)
        hosted = self._is_hosts is not None
        texts = np.zeros((len(offsets) if hosted else 0, 2), dtype=np.int64)
        tables, state = _crc_tables(), self._state
        limit = len(data) if is_last else len(data) - scan.LONGEST
        state[scan.DOUBTED] = 0
        while state[scan.POSITION] < limit:
            state[scan.COUNT] = state[scan.SPANS] = 0
            scan.scan(data, is_last, self._bare, hosted, *tables, offsets, lengths, kinds, texts, self._spans, state)
            count, spans = int(state[scan.COUNT]), self._spans[: state[scan.SPANS]]
            around = texts[:count].copy() if hosted else None
            found = Frames(data, base, offsets[:count].copy(), lengths[:count].copy(), kinds[:count].copy(), around)
            texts[:count] = 0
            is_whole = state[scan.POSITION] >= limit
            kept = self._held_back(found) if is_whole and not is_last else count
            if kept < count:  # the frames held back are found again
                first = int(found.offsets[kept]) - (0 if around is None else int(around[kept, 0]))
                state[scan.POSITION], state[scan.SKIP_START] = first, scan.NOWHERE
                spans = spans[spans[:, 1] <= first]
            given = found.head(kept)
            for start, end in sorted([*spans.tolist(), *self._strange_texts(given)]):
                self._skipped.add(base + start, base + end, base + end)
            yield given
            if kept < count:
                return

    def _strange_texts(self, frames: Frames) -> list[list[int]]:
        """Remove texts around the frames that are not the computer's.

        Returns them as pairs of start and end.
        """
        strange: list[list[int]] = []
        if frames.texts is None or self._is_hosts is None:
            return strange
        for row in np.flatnonzero(frames.texts.any(axis=1)).tolist():
            at, length = int(frames.offsets[row]), int(frames.lengths[row])
            before, behind = frames.texts[row].tolist()
            for column, (start, end) in enumerate(((at - before, at), (at + length, at + length + behind))):
                if start < end and not self._is_hosts(frames.data[start:end].tobytes(), column == 0):
                    strange.append([start, end])
                    frames.texts[row, column] = 0
        return strange

    def _finish(self, data: NDArray[np.uint8], base: int) -> None:
        """Count the bytes behind the last frame: a frame that was cut, or bytes of none."""
        start = int(self._state[scan.SKIP_START])
        if start == scan.NOWHERE:
            return
        if start >= 0 and scan.is_cut(data, start):
            self._cut = base + start, base + len(data)
        else:
            self._skipped.add(base + start, base + len(data), base + len(data))
