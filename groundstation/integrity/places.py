"""Places and times of a log's records, kept in memory or compactly in a temporary file.

The file is used beyond a certain size. A survey needs them twice more: for the clock, in the order of the log, and for
the ledger, topic by topic. Neither needs all at once.
"""

import tempfile
from collections import deque
from collections.abc import Collection, Iterable, Iterator, Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from groundstation.base.dataclasses import dataclass
from groundstation.base.errors import GroundstationError
from groundstation.base.records import BoolArray, Column, Int64Array, RecordBatch
from groundstation.integrity import time_passes
from groundstation.integrity.counting import is_frozen
from groundstation.integrity.ordering import joined_columns
from groundstation.integrity.time_passes import MANY_LAID, lay, passes_over

MEMORY_BYTES = 24 << 20  # when there are more, all go to a file
WINDOW_RECORDS = 500_000  # at least so many records of all topics are laid in order at a time


@dataclass(frozen=True, eq=False)
class BatchPlaces:
    """Places and times of one batch, or of a whole topic; topics sampled together share it.

    ``validity_ns`` are times of validity by the device's clock, where they are others.
    """

    index: Int64Array
    time: Column
    validity_ns: Int64Array | None = None

    @property
    def timed(self) -> Int64Array:
        """Times that are present, in the order of the places."""
        return self.time.values if self.time.present is None else self.time.values[self.time.present]

    @property
    def nbytes(self) -> int:
        """Memory that the piece takes."""
        present = self.time.present
        validity = 0 if self.validity_ns is None else self.validity_ns.nbytes
        return self.index.nbytes + self.time.values.nbytes + (0 if present is None else present.nbytes) + validity

    def holds(self, batch: RecordBatch) -> bool:
        """Tell whether these are the places and times of this batch."""
        device, validity = batch.device_time_ns, batch.validity_time_ns
        return (
            len(self.index) == len(batch)
            and _are_equal(self.index, batch.record_index)
            and _are_equal(self.time.values, device.values)
            and (self.time.present is device.present or np.array_equal(self.time.mask, device.mask))
            and _are_equal(self.validity_ns, validity)
        )


@dataclass(frozen=True)
class PieceOnDisk:
    """Location of a kept piece in the file, with a summary that saves reading it.

    Parameters
    ----------
    number : int
    at : int
        Byte of the file.
    count : int
    first, last : int
        Its places lie between these.
    is_near : bool
        Places fit 32 bits when counted from the first.
    is_timed : bool
        Every record has a time.
    times : tuple of int
        First and last time, how many there are, and how many repeat the one before; empty when there is none.
    has_validity : bool
        Records have times of validity of their own.
    """

    number: int
    at: int
    count: int
    first: int
    last: int
    is_near: bool
    is_timed: bool
    times: tuple[int, ...]
    has_validity: bool = False

    @property
    def size(self) -> int:
        """Number of bytes that the piece takes in a file."""
        of_one = (4 if self.is_near else 8) + 8 + (0 if self.is_timed else 1) + (8 if self.has_validity else 0)
        return self.count * of_one


class Places:
    """Store of pieces: kept once for batches with the same places and times, and read back.

    Attributes
    ----------
    records : int
        Number of records kept.
    """

    def __init__(self) -> None:
        self._held: dict[int, tuple[PieceOnDisk, BatchPlaces]] = {}
        self._held_bytes = 0
        self._file: Any = None
        self._end = 0
        self._count = self.records = 0
        self._recent: deque[tuple[BatchPlaces, PieceOnDisk]] = deque(maxlen=8)

    def close(self) -> None:
        """Release pieces and file."""
        self._held.clear()
        if self._file is not None:
            self._file.close()

    @property
    def is_long(self) -> bool:
        """Tell whether there may be several windows."""
        return self.records > WINDOW_RECORDS

    def of(self, batch: RecordBatch) -> PieceOnDisk:
        """Keep the piece of a batch."""
        for piece, kept in self._recent:
            if piece.holds(batch):
                return kept
        device = batch.device_time_ns
        present = None if device.present is None else _lasting(device.present)
        validity = batch.validity_time_ns
        piece = BatchPlaces(
            _lasting(np.asarray(batch.record_index, np.int64)),
            Column(_lasting(np.asarray(device.values, np.int64)), present),
            None if validity is None else _lasting(np.asarray(validity, np.int64)),
        )
        self._recent.append((piece, self._keep(piece)))
        return self._recent[-1][1]

    def _keep(self, piece: BatchPlaces) -> PieceOnDisk:
        index, timed = piece.index, piece.timed
        first, last = int(index[0]), int(index[-1])
        is_near, is_timed = last - first < 1 << 32, len(timed) == len(index)
        times = (int(timed[0]), int(timed[-1]), len(timed), _repeats(timed)) if len(timed) else ()
        has_validity = piece.validity_ns is not None
        kept = PieceOnDisk(self._count, self._end, len(index), first, last, is_near, is_timed, times, has_validity)
        self._end += kept.size
        self._count += 1
        self.records += len(index)
        self._held[kept.number] = kept, piece
        self._held_bytes += piece.nbytes
        if self._file is not None or self._held_bytes > MEMORY_BYTES:
            self._write()
        return kept

    def _write(self) -> None:
        """Write the pieces in memory to the file, and release them."""
        try:
            if self._file is None:
                self._file = tempfile.TemporaryFile()  # noqa: SIM115 -- lives as long as this
            for kept, piece in self._held.values():
                self._file.seek(kept.at)
                places = piece.index - kept.first
                self._file.write((places.astype(np.uint32) if kept.is_near else places).data)
                self._file.write(np.ascontiguousarray(piece.time.values).data)
                if not kept.is_timed:
                    self._file.write(np.ascontiguousarray(piece.time.mask).data)
                if piece.validity_ns is not None:
                    self._file.write(np.ascontiguousarray(piece.validity_ns).data)
        except OSError as error:
            folder, reason = tempfile.gettempdir(), error.strerror or type(error).__name__
            raise GroundstationError(folder, f"no temporary file ({reason})", "", "make room, or set TMPDIR") from error
        self._held.clear()
        self._held_bytes = 0

    def piece(self, kept: PieceOnDisk) -> BatchPlaces:
        """Read a piece back."""
        if kept.number in self._held:
            return self._held[kept.number][1]
        self._file.seek(kept.at)
        index = self._array(np.uint32 if kept.is_near else np.int64, kept.count).astype(np.int64) + kept.first
        time = self._array(np.int64, kept.count)
        timed = None if kept.is_timed else self._array(np.bool_, kept.count)
        return BatchPlaces(index, Column(time, timed), self._array(np.int64, kept.count) if kept.has_validity else None)

    def _array(self, dtype: Any, count: int) -> Any:
        return np.frombuffer(self._file.read(count * np.dtype(dtype).itemsize), dtype)

    def in_order(self, topics: Iterable[Sequence[PieceOnDisk]]) -> Iterator[tuple[Int64Array, Column, BoolArray]]:
        """Yield places, device times and frozenness of all records in log order, in windows.

        Each place comes once. Where topics tell different times of a place, the topic that is named first is believed.
        """
        topics = list(topics)
        frozen = {kept.number for several in topics if _is_frozen(several) for kept in several}
        for window in _windows({kept.number: kept for several in topics for kept in several}.values()):
            pieces = [self.piece(kept) for kept in window]
            index, time = _united(pieces)
            is_frozen_here = np.zeros(len(index), dtype=bool)
            for kept, piece in zip(window, pieces, strict=True):
                if kept.number in frozen:
                    is_frozen_here[np.searchsorted(index, piece.index)] = True
            yield index, time, is_frozen_here

    def in_one(self, topics: Iterable[Sequence[PieceOnDisk]]) -> tuple[Int64Array, Column]:
        """Places and device times of all records in the order of the log, each place once."""
        index, time = np.empty(self.records, dtype=np.int64), np.empty(self.records, dtype=np.int64)
        timed = np.empty(self.records, dtype=bool)
        count = 0
        for window_index, window_time, _frozen in self.in_order(topics):
            rows = slice(count, count + len(window_index))
            index[rows], time[rows], timed[rows] = window_index, window_time.values, window_time.mask
            count = rows.stop
        return index[:count], Column(time[:count], timed[:count])


def _are_equal(one: Int64Array | None, other: Int64Array | None) -> bool:
    return one is other or (one is not None and other is not None and np.array_equal(one, other))


def _lasting(array: Any) -> Any:
    """Return the array, or a copy where it would hold much more memory than its own.

    Arrays of records never change.
    """
    owner = array if array.base is None else array.base
    return array if isinstance(owner, np.ndarray) and owner.nbytes <= 2 * array.nbytes else np.array(array)


def _repeats(times: Int64Array) -> int:
    return int(np.count_nonzero(times[1:] == times[:-1]))


def _is_frozen(several: Sequence[PieceOnDisk]) -> bool:
    """Tell whether the times of a topic are frozen."""
    timed = [kept.times for kept in several if kept.times]
    count = sum(times[2] for times in timed)
    repeats = sum(times[3] for times in timed)
    repeats += sum(before[1] == after[0] for before, after in pairwise(timed))
    return is_frozen(count, repeats)


def _windows(pieces: Collection[PieceOnDisk]) -> Iterator[list[PieceOnDisk]]:
    """Yield the pieces of one stretch of the log after another, none reaching into the next.

    The pieces of a stretch stand in the order given.
    """
    rank = {kept.number: at for at, kept in enumerate(pieces)}
    window: list[PieceOnDisk] = []
    count, reached = 0, -1
    for kept in sorted(pieces, key=lambda kept: kept.first):
        if count >= WINDOW_RECORDS and kept.first > reached:
            yield sorted(window, key=lambda kept: rank[kept.number])
            window, count = [], 0
        window.append(kept)
        count, reached = count + kept.count, max(reached, kept.last)
    if window:
        yield sorted(window, key=lambda kept: rank[kept.number])


def _united(pieces: list[BatchPlaces]) -> tuple[Int64Array, Column]:
    """Records of all pieces in order of their places, each place once."""
    if len(pieces) == 1:
        return pieces[0].index, pieces[0].time
    start, end = min(int(piece.index[0]) for piece in pieces), max(int(piece.index[-1]) for piece in pieces) + 1
    if end - start <= 4 * sum(len(piece.index) for piece in pieces):  # places without many holes need no sorting
        seen, time = np.zeros(end - start, dtype=bool), np.zeros(end - start, dtype=np.int64)
        timed = seen if all(piece.time.present is None for piece in pieces) else seen.copy()
        is_long = sum(len(piece.index) for piece in pieces) >= time_passes.MANY_IN_ALL
        for piece in reversed(pieces):
            if is_long and piece.time.present is None and passes_over(piece.index, piece.time.values, least=MANY_LAID):
                lay(piece.index, piece.time.values, start, seen, timed, time)
                continue
            at = piece.index - start
            seen[at], time[at] = True, piece.time.values
            if timed is not seen:
                timed[at] = piece.time.mask
        if seen.all():
            return np.arange(start, end), Column(time, timed)
        places = np.flatnonzero(seen)
        return places + start, Column(time[places], timed[places])
    index, first = np.unique(np.concatenate([piece.index for piece in pieces]), return_index=True)
    return index, joined_columns([piece.time for piece in pieces]).take(first)
