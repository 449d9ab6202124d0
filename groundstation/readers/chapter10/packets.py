"""Cuts a recording into blocks of packets; what belongs to no packet, and packets that are damaged, are counted."""

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray

from groundstation.base.errors import UnreadableLogError
from groundstation.base.records import Damage, Int64Array, Remark
from groundstation.readers.chapter10 import scan
from groundstation.readers.skipped import SkippedBytes, bytes_place
from groundstation.readers.source import Source

BLOCK_BYTES = 4 << 20
MAX_SPANS = 4_096
NS_PER_COUNT = 100  # of the relative time counter, which runs at 10 MHz
_SLACK = 64  # bytes behind the data, so that it may be seen as numbers of four bytes
_SMALLEST_PACKET = scan.HEADER_BYTES
TMATS, EVENT, TIME, MIL_STD_1553, DISCRETE, ARINC_429 = 0x01, 0x02, 0x11, 0x19, 0x29, 0x38


@dataclass(frozen=True, eq=False)
class Block:
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


@dataclass
class _Sequence:
    """Sequence number of a channel's last packet, and how many packets are missing by it."""

    last: int
    missing: int = 0
    first_place: int = 0


@dataclass
class Tally:
    """Counts of a whole recording."""

    packets: int = 0
    types: dict[int, int] = field(default_factory=dict)
    checked: int = 0
    secondary: int = 0
    filler_bytes: int = 0
    unsynced: int = 0
    overflows: int = 0
    sequences: dict[int, _Sequence] = field(default_factory=dict)
    wrong: list[tuple[int, int, int]] = field(default_factory=list)  # verdict, place, bytes

    def add(self, packets: Int64Array, base: int) -> None:
        """Count packets, damaged ones among them; ``base`` is the place of their places."""
        self.packets += len(packets)
        flags = packets[:, scan.FLAGS]
        self.secondary += int(np.count_nonzero(flags & scan.HAS_SECONDARY))
        self.unsynced += int(np.count_nonzero(flags & scan.RTC_UNSYNCED))
        self.overflows += int(np.count_nonzero(flags & scan.OVERFLOW))
        for number, count in zip(*np.unique(packets[:, scan.TYPE], return_counts=True), strict=True):
            self.types[int(number)] = self.types.get(int(number), 0) + int(count)
        for row in packets[packets[:, scan.STATE] != scan.WHOLE].tolist():
            self.wrong.append((row[scan.STATE], base + row[scan.AT], row[scan.END] - row[scan.AT]))
        for channel in np.unique(packets[:, scan.CHANNEL]).tolist():
            self._add_sequence(channel, packets[packets[:, scan.CHANNEL] == channel], base)

    def _add_sequence(self, channel: int, packets: Int64Array, base: int) -> None:
        numbers = packets[:, scan.SEQUENCE]
        sequence = self.sequences.setdefault(channel, _Sequence(int(numbers[0]) - 1))
        missing = (np.diff(numbers, prepend=sequence.last) - 1) % 256
        sequence.last = int(numbers[-1])
        if missing.any():
            if not sequence.missing:
                sequence.first_place = base + int(
                    packets[missing.argmax() if missing[0] else missing.nonzero()[0][0], 0]
                )
            sequence.missing += int(missing.sum())

    def remark(self) -> Remark:
        """What was checked."""
        kinds = ", ".join(
            f"{count} {TYPES.get(number, f'type {number:#04x}')}" for number, count in sorted(self.types.items())
        )
        wrong = sum(verdict == scan.WRONG_CHECKSUM for verdict, _place, _size in self.wrong)
        text = (
            f"{self.packets} packets: {kinds}; data checksums of {self.checked}, {wrong} wrong; "
            f"{self.secondary} secondary headers; {self.filler_bytes} bytes of filler"
        )
        if self.unsynced:
            text += f"; {self.unsynced} packets say that their counter was not in step with its source"
        return Remark("packets", text)

    def damages(self) -> Iterator[Damage]:
        """Damaged packets, and packets that were never written."""
        for verdict, what in _VERDICTS.items():
            found = [(place, size) for kind, place, size in self.wrong if kind == verdict]
            if found:
                place = bytes_place(found[0][0], found[-1][0] + found[-1][1])
                yield Damage("truncated" if verdict == scan.CUT else "corrupt", place, len(found), what)
        for channel, one in sorted(self.sequences.items()):
            if one.missing:
                what = f"packets of channel {channel} are missing by its sequence numbers"
                yield Damage("lost_packets", bytes_place(one.first_place, one.first_place + 1), one.missing, what)
        if self.overflows:
            what = "packets in which the recorder lost data (overflow flag)"
            yield Damage("lost_packets", "the whole log", self.overflows, what)


_VERDICTS = {
    scan.WRONG_CHECKSUM: "packets with a wrong data checksum, left out unless they are TMATS",
    scan.TORN: "packets that end before their length, left out",
    scan.CUT: "packet that the end of the file cuts off; its whole messages are kept",
}
TYPES = {
    0x00: "user-defined",
    0x01: "TMATS",
    0x02: "recording event",
    0x03: "index",
    0x08: "PCM format 0",
    0x09: "PCM",
    0x11: "time",
    0x12: "network time",
    0x19: "MIL-STD-1553",
    0x1A: "16PP194",
    0x21: "analog",
    0x29: "discrete",
    0x30: "message",
    0x38: "ARINC-429",
    0x40: "video format 0",
    0x41: "video format 1",
    0x42: "video format 2",
    0x43: "video format 3",
    0x44: "video format 4",
    0x48: "image format 0",
    0x49: "image format 1",
    0x4A: "image format 2",
    0x50: "UART",
    0x58: "IEEE 1394 format 0",
    0x59: "IEEE 1394 format 1",
    0x60: "parallel",
    0x68: "Ethernet",
    0x69: "ARINC-664",
    0x70: "TSPI (NMEA)",
    0x71: "TSPI (EAG ACMI)",
    0x72: "TSPI (ACTTS)",
    0x78: "CAN",
    0x79: "Fibre Channel",
    0x7A: "Fibre Channel format 1",
}


class Walk:
    """Iterates over the blocks of a recording; what it met is known at the end.

    Parameters
    ----------
    source : Source
    """

    def __init__(self, source: Source) -> None:
        self._source = source
        self.tally = Tally()
        self._skipped = SkippedBytes("packet")
        self._state = np.zeros(scan.STATE_SIZE, dtype=np.int64)
        self._state[scan.SKIP_START] = scan.NOWHERE
        self._spans = np.empty((MAX_SPANS, 3), dtype=np.int64)
        self._base = 0

    def __iter__(self) -> Iterator[Block]:
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
        """What was skipped and what was damaged."""
        yield from self._skipped.damages()
        yield from self.tally.damages()

    def _longer(self, data: NDArray[np.uint8], size: int, stream: BinaryIO) -> tuple[NDArray[np.uint8], int, bool]:
        """The data with the next bytes of the file behind them, how many they are, and whether those were the last."""
        whole = np.empty(size + BLOCK_BYTES + _SLACK, dtype=np.uint8)
        whole[:size] = data[:size]
        try:
            count = stream.readinto(whole[size : size + BLOCK_BYTES])  # type: ignore[attr-defined]
        except OSError as error:  # a failing disk or network share
            raise UnreadableLogError(
                self._source.name, f"no more data ({error.strerror})", "", "copy it again"
            ) from error
        return whole[: (size + count + _SLACK) // 4 * 4], size + count, count < BLOCK_BYTES

    def _blocks(self, data: NDArray[np.uint8], size: int, is_last: bool) -> Iterator[Block]:
        """Packets of the data at hand: one block, more where there are very many damaged places."""
        packets = np.empty((size // _SMALLEST_PACKET + 1, scan.COLUMNS), dtype=np.int64)
        halves, words, state = data.view("<u2"), data.view("<u4"), self._state
        while True:
            state[scan.COUNT] = state[scan.SPANS] = 0
            scan.scan(data, halves, words, size, is_last, packets, self._spans, state)
            count = int(state[scan.COUNT])
            found = packets[:count].copy()
            for start, end, before in self._spans[: state[scan.SPANS]].tolist():
                self._skipped.add(self._base + start, self._base + end, self._base + int(found[before, scan.AT]))
            if count:
                self.tally.add(found, self._base)
                verdict = found[:, scan.STATE]
                is_setup = (verdict == scan.WRONG_CHECKSUM) & (found[:, scan.TYPE] == TMATS)
                believed = found[(verdict == scan.WHOLE) | (verdict == scan.CUT) | is_setup]
                if len(believed):
                    yield Block(data, believed, self._base)
            if state[scan.SPANS] < len(self._spans):
                return
