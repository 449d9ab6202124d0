"""Cut a recording into blocks of packets.

Bytes that belong to no packet, and damaged packets, are counted.
"""

from collections.abc import Iterator
from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray

from groundstation.base.dataclasses import dataclass
from groundstation.base.errors import UnreadableLogError
from groundstation.base.records import Damage, Int64Array
from groundstation.readers.chapter10 import kinds, scan
from groundstation.readers.chapter10.tally import RecordingTally
from groundstation.readers.dataflash.scan import magic_places
from groundstation.readers.skipped import SkippedBytes
from groundstation.readers.source import Source

BLOCK_BYTES = 4 << 20
MAX_SPANS = 4_096
NS_PER_COUNT = 100  # the relative time counter runs at 10 MHz
_SLACK = 64  # bytes behind the data, so that it may be seen as numbers of four bytes
_SMALLEST_PACKET = scan.HEADER_BYTES


@dataclass(frozen=True, eq=False)
class PacketBlock:
    """Packets of one stretch of the file; to be used before the next one is asked for.

    Parameters
    ----------
    data : ndarray of uint8
    packets : ndarray of int64, shape (n, scan.COLUMNS)
        Those whose data can be believed, in the order of the file; places count from the start of ``data``.
    base : int
        Place in the file of the first byte of ``data``.
    """

    data: NDArray[np.uint8]
    packets: Int64Array
    base: int

    def of(self, *types: int) -> Int64Array:
        """Packets of some types."""
        return self.packets[np.isin(self.packets[:, scan.TYPE], types)]

    def by_channel(self) -> Iterator[tuple[int, int, Int64Array]]:
        """Type, channel and packets of each pair that occurs."""
        keys = self.packets[:, scan.CHANNEL] << 8 | self.packets[:, scan.TYPE]
        for key in np.unique(keys).tolist():
            yield key & 0xFF, key >> 8, self.packets[keys == key]

    def body(self, packet: Int64Array) -> bytes:
        """Data of a packet behind its channel-specific word."""
        return self.data[packet[scan.BODY] : max(packet[scan.BODY], packet[scan.BODY_END])].tobytes()

    def specific_word(self, packet: Int64Array) -> int:
        """The channel-specific data word; 0 where the packet has none."""
        at = int(packet[scan.BODY])
        return int.from_bytes(self.data[at - 4 : at].tobytes(), "little") if packet[scan.BODY_END] >= at else 0


class PacketWalk:
    """Iterator over the blocks of a recording; the damage is known at the end.

    Parameters
    ----------
    source : Source
    """

    def __init__(self, source: Source) -> None:
        self._source = source
        self.tally = RecordingTally()
        self._skipped = SkippedBytes("packet")
        self._state = np.zeros(scan.STATE_SIZE, dtype=np.int64)
        self._state[scan.SKIP_START] = scan.NOWHERE
        self._spans = np.empty((MAX_SPANS, 3), dtype=np.int64)
        self._base = 0

    def __iter__(self) -> Iterator[PacketBlock]:
        data, size = np.zeros(_SLACK, dtype=np.uint8), 0
        with self._source.open() as stream:
            while True:
                data, size, is_last = self._longer(data, size, stream)
                yield from self._blocks(data, size, is_last)
                done = int(self._state[scan.POSITION])
                if is_last:
                    break
                data, size, self._base = data[done:], size - done, self._base + done
                self._state[scan.POSITION] = 0
                if self._state[scan.SKIP_START] != scan.NOWHERE:
                    self._state[scan.SKIP_START] -= done
        if self._state[scan.SKIP_START] != scan.NOWHERE:
            start = self._base + int(self._state[scan.SKIP_START])
            self._skipped.add(start, self._base + size, self._base + size)
        self.tally.checked = int(self._state[scan.CHECKED])
        self.tally.filler_bytes = int(self._state[scan.FILLER])

    def damages(self) -> Iterator[Damage]:
        """Yield the bytes that were skipped and the packets that were damaged."""
        yield from self._skipped.damages()
        yield from self.tally.damages()

    def _longer(self, data: NDArray[np.uint8], size: int, stream: BinaryIO) -> tuple[NDArray[np.uint8], int, bool]:
        """Append the next bytes of the file to the data.

        Returns the data, the number of bytes appended, and whether those were the last.
        """
        whole = np.empty(size + BLOCK_BYTES + _SLACK, dtype=np.uint8)
        whole[:size] = data[:size]
        try:
            count = stream.readinto(whole[size : size + BLOCK_BYTES])  # type: ignore[attr-defined]
        except OSError as error:  # a failing disk or network share
            raise UnreadableLogError(
                self._source.name, f"no more data ({error.strerror})", "", "copy it again"
            ) from error
        return whole[: (size + count + _SLACK) // 4 * 4], size + count, count < BLOCK_BYTES

    def _blocks(self, data: NDArray[np.uint8], size: int, is_last: bool) -> Iterator[PacketBlock]:
        """Yield the packets of the data at hand: one block, more if damage is frequent."""
        packets = np.empty((size // _SMALLEST_PACKET + 1, scan.COLUMNS), dtype=np.int64)
        halves, words, state = data.view("<u2"), data.view("<u4"), self._state
        syncs = magic_places(data[:size], scan.SYNC)
        while True:
            state[scan.COUNT] = state[scan.SPANS] = 0
            scan.scan(data, halves, words, syncs, size, is_last, packets, self._spans, state)
            count = int(state[scan.COUNT])
            found = packets[:count].copy()
            for start, end, before in self._spans[: state[scan.SPANS]].tolist():
                self._skipped.add(self._base + start, self._base + end, self._base + int(found[before, scan.AT]))
            if count:
                self.tally.add(found, self._base)
                verdict = found[:, scan.STATE]
                is_setup = (verdict == scan.WRONG_CHECKSUM) & (found[:, scan.TYPE] == kinds.TMATS)
                believed = found[(verdict == scan.WHOLE) | (verdict == scan.CUT) | is_setup]
                if len(believed):
                    yield PacketBlock(data, believed, self._base)
            if state[scan.SPANS] < len(self._spans):
                return
