"""Packets of IRIG 106 Chapter 10 as bytes, each with its checksums.

They are header, TMATS, time, MIL-STD-1553 and ARINC 429.

Source: IRIG 106-17, chapter 10 (file) and chapter 11 (packets): 11.2.1 header, 11.2.7.2 TMATS, 11.2.3.1 time data
format 1, 11.2.4.1 1553 format 1, 11.2.8.1 ARINC 429 format 0.
"""

from dataclasses import field
from datetime import UTC, datetime

import numpy as np
from numpy.typing import NDArray

from groundstation.base.dataclasses import dataclass
from groundstation.base.records import Int64Array
from groundstation.base.units import NS_PER_S

NS_PER_TICK = 100  # tick of the relative time counter
SYNC = 0xEB25
VERSION_106_17 = 8
TMATS_106_17 = 0x0C
TMATS, TIME_F1, BUS_1553_F1, ARINC_429_F0 = 0x01, 0x11, 0x19, 0x38
CHECKSUM_32 = 3
LARGEST_GAP_TICKS = 1 << 20  # between two ARINC 429 words of a packet: the field has 20 bits
FIRST_BIT_OF_FIRST_WORD = 1 << 30  # the time stamp of a 1553 message marks this bit
RESPONSE_TICKS = 40  # response time of a terminal, 4 us

HEADER = np.dtype(
    [
        ("sync", "<u2"),
        ("channel", "<u2"),
        ("packet_bytes", "<u4"),
        ("data_bytes", "<u4"),
        ("version", "u1"),
        ("sequence", "u1"),
        ("flags", "u1"),
        ("kind", "u1"),
        ("counter", "<u2", 3),
        ("checksum", "<u2"),
    ]
)
MESSAGE_1553 = np.dtype(
    [("counter", "<u8"), ("status", "<u2"), ("gaps", "<u2"), ("bytes", "<u2"), ("words", "<u2", 34)]
)
WORD_429 = np.dtype([("bus_and_gap", "<u4"), ("word", "<u4")])


@dataclass
class Packer:
    """Maker of packets, numbered within each channel."""

    sequences: dict[int, int] = field(default_factory=dict)

    def packet(self, channel: int, kind: int, ticks: int, body: bytes) -> bytes:
        """A whole packet: header, body, filler to a multiple of four bytes, checksum of both.

        Parameters
        ----------
        channel, kind : int
            Channel id, and type of the data.
        ticks : int
            Relative time counter of the first data, 100 ns each; 48 bits, so it starts again after 325 days.
        body : bytes
            Channel-specific word and data.
        """
        sequence = self.sequences.get(channel, 0)
        self.sequences[channel] = (sequence + 1) & 0xFF
        content = body + bytes(-len(body) % 4)
        header = np.zeros((), dtype=HEADER)
        header["sync"], header["channel"], header["kind"] = SYNC, channel, kind
        header["packet_bytes"], header["data_bytes"] = HEADER.itemsize + len(content) + 4, len(body)
        header["version"], header["sequence"], header["flags"] = VERSION_106_17, sequence, CHECKSUM_32
        header["counter"] = [(ticks >> shift) & 0xFFFF for shift in (0, 16, 32)]
        header["checksum"] = int(np.frombuffer(header.tobytes()[:22], "<u2").sum(dtype=np.uint64)) & 0xFFFF
        checksum = int(np.frombuffer(content, "<u4").sum(dtype=np.uint64)) & 0xFFFFFFFF
        return header.tobytes() + content + checksum.to_bytes(4, "little")


def tmats_body(lines: list[str]) -> bytes:
    """Setup record of the recorder, a line for each attribute."""
    return TMATS_106_17.to_bytes(4, "little") + "".join(f"{line};\r\n" for line in lines).encode("ascii", "replace")


def time_body(utc_ns: int) -> bytes:
    """IRIG-B time of an external source with day, month and year, resolved to 10 ms.

    Examples
    --------
    >>> time_body(1_323_449_232_120_000_000)[4:].hex()  # 2011-12-09 16:47:12.12
    '1212471609121120'
    """
    moment = datetime.fromtimestamp(utc_ns // NS_PER_S, UTC)
    is_leap = moment.year % 4 == 0 and (moment.year % 100 != 0 or moment.year % 400 == 0)
    word = 0x1 | 0x200 | (0x100 if is_leap else 0)  # external, IRIG-B, day month year
    hundredths = utc_ns % NS_PER_S // 10_000_000
    parts = [
        _digits(hundredths) | _digits(moment.second) << 8,
        _digits(moment.minute) | _digits(moment.hour) << 8,
        _digits(moment.day) | _digits(moment.month) << 8,
        _digits(moment.year % 100) | _digits(moment.year // 100) << 8,
    ]
    return word.to_bytes(4, "little") + np.array(parts, "<u2").tobytes()


def _digits(number: int) -> int:
    """Return two decimal digits, four bits each."""
    return number // 10 << 4 | number % 10


def body_1553(ticks: Int64Array, command: int, data: NDArray[np.uint16]) -> bytes:
    """Return messages of one terminal that sends 32 words to the bus controller.

    They go over bus A and are without error.

    Parameters
    ----------
    ticks : ndarray of int64, shape (n,)
        Counter at the first bit of each command word.
    command : int
        Command word: transmit, 32 words.
    data : ndarray of uint16, shape (n, 32)
    """
    messages = np.zeros(len(ticks), dtype=MESSAGE_1553)
    messages["counter"], messages["gaps"], messages["bytes"] = ticks, RESPONSE_TICKS, 68
    messages["words"][:, 0], messages["words"][:, 1] = command, command & 0xF800
    messages["words"][:, 2:] = data
    return (len(ticks) | FIRST_BIT_OF_FIRST_WORD).to_bytes(4, "little") + messages.tobytes()


def body_429(ticks: Int64Array, subchannels: NDArray[np.uint8], words: NDArray[np.uint32]) -> bytes:
    """Return words of high-speed buses.

    Their times are told by the gaps between them, each below ``LARGEST_GAP_TICKS``.

    Parameters
    ----------
    ticks : ndarray of int64, shape (n,)
        Counter at the beginning of each word, never decreasing.
    subchannels : ndarray of uint8, shape (n,)
        Number of each word's bus, from 1.
    words : ndarray of uint32, shape (n,)
    """
    entries = np.zeros(len(words), dtype=WORD_429)
    gaps = np.diff(ticks, prepend=ticks[:1])
    entries["bus_and_gap"] = gaps | 1 << 21 | (subchannels.astype(np.int64) - 1) << 24
    entries["word"] = words
    return len(words).to_bytes(4, "little") + entries.tobytes()
