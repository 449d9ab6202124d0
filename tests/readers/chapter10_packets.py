"""Packets of Chapter 10 made by hand for the tests of the reader: each function gives bytes."""

import struct
from collections.abc import Sequence


def packet(
    channel: int,
    kind: int,
    data: bytes,
    rtc: int,
    *,
    sequence: int = 0,
    checksum: int = 0,
    secondary: bytes = b"",
    flags: int = 0,
) -> bytes:
    """A packet around its data (channel-specific word included); ``checksum`` is that of the data, 0 to 3."""
    width = (0, 1, 2, 4)[checksum]
    filled = data + bytes(-(len(data) + width) % 4)  # a multiple of the checksum's width, too
    if checksum:
        numbers = struct.unpack(f"<{len(filled) // width}{'BHI'[checksum - 1]}", filled)
        filled += (sum(numbers) % (1 << 8 * width)).to_bytes(width, "little")
    flags |= checksum | (0x80 if secondary else 0)
    length = 24 + len(secondary) + len(filled)
    head = struct.pack("<HHIIBBBB", 0xEB25, channel, length, len(data), 6, sequence % 256, flags, kind)
    head += rtc.to_bytes(6, "little")
    return head + struct.pack("<H", sum(struct.unpack("<11H", head)) & 0xFFFF) + secondary + filled


def secondary_1588(seconds: int, nanoseconds: int) -> bytes:
    """Secondary header with IEEE 1588 time."""
    head = struct.pack("<IIH", nanoseconds, seconds, 0)
    return head + struct.pack("<H", sum(struct.unpack("<5H", head)) & 0xFFFF)


def tmats(text: str) -> bytes:
    """Data of a TMATS packet."""
    return bytes(4) + text.encode()


def time_of_day(day: int, second: float, *, year: int | None = None, month: int = 0, day_of_month: int = 0) -> bytes:
    """Data of a time packet: day of the year, or with ``year`` a date."""

    def decimal(number: int) -> int:
        return int(str(number), 16)

    whole, hundredths = int(second), round(second % 1 * 100)
    clock = [hundredths, whole % 60, whole // 60 % 60, whole // 3600]
    days = [day % 100, day // 100] if year is None else [day_of_month, month]
    body = bytes(map(decimal, [*clock, *days]))
    if year is not None:
        body += bytes(map(decimal, (year % 100, year // 100)))
    return struct.pack("<I", 0x10 | (0x200 if year is not None else 0)) + body


def messages_1553(messages: Sequence[tuple[int, int, Sequence[int]]]) -> bytes:
    """Data of a 1553 packet: counter, block status and words of each message."""
    body = b"".join(
        rtc.to_bytes(8, "little")
        + struct.pack("<HHH", status, 0, 2 * len(words))
        + struct.pack(f"<{len(words)}H", *words)
        for rtc, status, words in messages
    )
    return struct.pack("<I", len(messages)) + body


def words_429(words: Sequence[tuple[int, int, int]]) -> bytes:
    """Data of an ARINC-429 packet: number of the bus from 0, gap, and word."""
    body = b"".join(struct.pack("<II", bus << 24 | 1 << 21 | gap, word) for bus, gap, word in words)
    return struct.pack("<I", len(words)) + body


def word_429(label: int, data: int, *, status: int = 3, sdi: int = 0) -> int:
    """A word of odd parity: label as a number, 19 bits of data."""
    word = int(f"{label:08b}"[::-1], 2) | sdi << 8 | (data & 0x7FFFF) << 10 | status << 29
    return word | (1 - word.bit_count() % 2) << 31
