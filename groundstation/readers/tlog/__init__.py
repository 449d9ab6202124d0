"""MAVLink telemetry as ground stations record it (.tlog).

Each frame stands behind its time of receipt.
"""

import re
from collections.abc import Iterator
from itertools import islice

from groundstation.base.records import Item
from groundstation.readers.source import Claim, Source

NAME = "tlog"
_STX = {0xFE: (6, 8), 0xFD: (10, 12)}  # first byte of a frame -> bytes before the payload, and without it
_FIRST_US, _LAST_US = 946_684_800_000_000, 4_102_444_800_000_000  # 2000 and 2100
_HOUR_US = 3_600_000_000
_FRAMES = 3  # in a row are looked at
_START = re.compile(rb"\0(?=[\x03-\x0e].{6}[\xfd\xfe])", re.DOTALL)  # a time of this century before a frame
_LOOKED_AT, _MOST_TRIED = 1 << 16, 200


def sniff(source: Source) -> Claim | None:
    """Claim a file of frames, each behind a time of this century.

    They stand at its beginning, or in its first 64 KiB. The clock of a ground station may not have been set: then three
    frames within an hour are enough.
    """
    if _frames_at(source.head, 0):
        return Claim(NAME)
    if _frames_at(source.head, 0, first_us=1) == _FRAMES:
        return Claim(NAME, confidence=0.9)
    begins = islice(_START.finditer(source.head[:_LOOKED_AT]), _MOST_TRIED)
    is_one = any(_frames_at(source.head, one.start()) == _FRAMES for one in begins)
    return Claim(NAME, confidence=0.6) if is_one else None


def _frames_at(head: bytes, at: int, first_us: int = _FIRST_US) -> int:
    """Count the consecutive frames from a place on, up to three.

    0 where something else is among them.
    """
    found, before_us = 0, -1
    while found < _FRAMES and at + 10 <= len(head):
        sizes, time_us = _STX.get(head[at + 8]), int.from_bytes(head[at : at + 8], "big")
        if sizes is None or not first_us <= time_us < _LAST_US:
            return 0
        if first_us < _FIRST_US and found and abs(time_us - before_us) > _HOUR_US:
            return 0
        before_us = time_us
        is_signed = head[at + 8] == 0xFD and len(head) > at + 10 and head[at + 10] & 1
        at += 8 + sizes[1] + head[at + 9] + (13 if is_signed else 0)
        found += 1
    return found


def read(source: Source) -> Iterator[Item]:
    """Yield the header, batches of every message (raw and canonical), remarks and damage."""
    from groundstation.readers.tlog.reader import items

    yield from items(source, NAME)
