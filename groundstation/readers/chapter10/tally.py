"""Account of a recording by its packets' headers: types, sums, sequence numbers, TMATS.

It tells what the recording holds and lacks, and what TMATS says of it.
"""

from collections.abc import Iterator
from dataclasses import field
from typing import NamedTuple

import numpy as np

from groundstation.base.dataclasses import dataclass
from groundstation.base.records import Damage, Int64Array, Remark
from groundstation.base.words import counted
from groundstation.readers.chapter10 import kinds, scan
from groundstation.readers.chapter10.tmats import Tmats
from groundstation.readers.skipped import bytes_place

RESTART_TICKS = 10 * 10_000_000  # step back of a new recording; the counter runs at 10 MHz
WRAP_TICKS = 1 << 47  # a longer one is a wrap: numbers go on


class _Wrong(NamedTuple):
    """A packet that is not whole: verdict, type, place and length."""

    verdict: int
    kind: int
    place: int
    size: int


@dataclass
class _Sequence:
    """Sequence number and counter of a channel's last packet, and its missing packets.

    The number of missing packets follows from the sequence number.
    """

    last: int
    last_rtc: int
    missing: int = 0
    first_place: int = 0


@dataclass
class RecordingTally:
    """Counts of a whole recording."""

    packets: int = 0
    by_channel: dict[tuple[int, int], int] = field(default_factory=dict)  # by channel and type
    checked: int = 0
    secondary: int = 0
    filler_bytes: int = 0
    unsynced: int = 0
    overflows: int = 0
    unread_stamps: int = 0
    sequences: dict[int, _Sequence] = field(default_factory=dict)
    wrong: list[_Wrong] = field(default_factory=list)

    def add(self, packets: Int64Array, base: int) -> None:
        """Count packets, damaged ones too; ``base`` is the byte that their places count from."""
        self.packets += len(packets)
        flags, channels, types = (packets[:, column] for column in (scan.FLAGS, scan.CHANNEL, scan.TYPE))
        has_secondary = (flags & scan.HAS_SECONDARY) > 0
        self.secondary += int(np.count_nonzero(has_secondary))
        self.unsynced += int(np.count_nonzero(flags & scan.RTC_UNSYNCED))
        self.overflows += int(np.count_nonzero(flags & scan.OVERFLOW))
        is_other = has_secondary & ((flags & scan.STAMPS_ARE_SECONDARY) > 0) & ((flags >> 2 & 3) != scan.IEEE_1588)
        self.unread_stamps += int(np.count_nonzero(is_other))
        for row in packets[packets[:, scan.STATE] != scan.WHOLE].tolist():
            wrong = _Wrong(row[scan.STATE], row[scan.TYPE], base + row[scan.AT], row[scan.END] - row[scan.AT])
            self.wrong.append(wrong)
        for key, count in zip(*np.unique(channels << 8 | types, return_counts=True), strict=True):
            pair = int(key) >> 8, int(key) & 0xFF
            self.by_channel[pair] = self.by_channel.get(pair, 0) + int(count)
        for channel in np.unique(channels).tolist():
            self._add_sequence(channel, packets[channels == channel], base)

    def _add_sequence(self, channel: int, packets: Int64Array, base: int) -> None:
        numbers, counter = packets[:, scan.SEQUENCE], packets[:, scan.RTC]
        sequence = self.sequences.setdefault(channel, _Sequence(int(numbers[0]) - 1, int(counter[0])))
        missing = (np.diff(numbers, prepend=sequence.last) - 1) % 256
        steps = np.diff(counter, prepend=sequence.last_rtc)
        is_begun = (steps < -RESTART_TICKS) & (steps > -WRAP_TICKS) | (packets[:, scan.TYPE] == kinds.TMATS)
        missing[is_begun] = 0  # another recording begins, and its numbers
        sequence.last, sequence.last_rtc = int(numbers[-1]), int(counter[-1])
        if missing.any():
            if not sequence.missing:
                sequence.first_place = base + int(packets[np.flatnonzero(missing)[0], scan.AT])
            sequence.missing += int(missing.sum())

    def remarks(self, tmats: Tmats) -> Iterator[Remark]:
        """Yield remarks on what was checked, and where TMATS says otherwise."""
        types: dict[int, int] = {}
        for (_channel, kind), count in self.by_channel.items():
            types[kind] = types.get(kind, 0) + count
        listed = ", ".join(f"{count} {kinds.name_of(kind)}" for kind, count in sorted(types.items()))
        wrong = sum(one.verdict == scan.WRONG_CHECKSUM for one in self.wrong)
        text = (
            f"{counted(self.packets, 'packet')}: {listed}; data checksums of {self.checked}, {wrong} wrong; "
            f"{self.secondary} secondary headers; {self.filler_bytes} bytes of filler"
        )
        if self.unsynced:
            text += f"; {self.unsynced} packets say that their counter was not in step with its source"
        yield Remark("packets", text)
        if self.unread_stamps:
            text = f"{self.unread_stamps} packets stamp messages in a form that is not read: their time is the packet's"
            yield Remark("clock_disagrees", text)
        if not tmats.attributes:
            yield Remark("no_tmats", "no TMATS: buses have no names, and nothing says what the recording is of")
        for (channel, kind), count in sorted(self.by_channel.items()):
            said = tmats.channels[channel].kind if channel in tmats.channels else ""
            if kind not in kinds.OF_CHANNEL.get(said, (kind,)):
                held = counted(count, f"{kinds.name_of(kind)} packet")
                text = f"channel {channel} is {said} by TMATS and has {held}: they are believed"
                yield Remark("tmats_contradicted", text)

    def damages(self) -> Iterator[Damage]:
        """Yield damaged packets, and packets that were never written."""
        setup = [one for one in self.wrong if one.kind == kinds.TMATS and one.verdict == scan.WRONG_CHECKSUM]
        if setup:
            what = "TMATS packets with a wrong data checksum, read all the same"
            yield Damage("wrong_checksum", _place(setup), len(setup), what, loses_data=False)
        for verdict, what in _VERDICTS.items():
            found = [one for one in self.wrong if one.verdict == verdict and one not in setup]
            if found:
                yield Damage("truncated" if verdict == scan.CUT else "corrupt", _place(found), len(found), what)
        for channel, one in sorted(self.sequences.items()):
            if one.missing:
                what = f"packets of channel {channel} are missing by its sequence numbers"
                yield Damage("lost_packets", bytes_place(one.first_place, one.first_place + 1), one.missing, what)
        if self.overflows:
            what = "packets in which the recorder lost data (overflow flag)"
            yield Damage("lost_packets", "the whole log", self.overflows, what)


def _place(found: list[_Wrong]) -> str:
    return bytes_place(found[0].place, found[-1].place + found[-1].size)


_VERDICTS = {
    scan.WRONG_CHECKSUM: "packets with a wrong data checksum, left out",
    scan.TORN: "packets that end before their length, left out",
    scan.CUT: "packet that the end of the file cuts off; its whole messages are kept",
}
