"""MAVLink telemetry as ground stations record it (.tlog): frames, each behind the time of receipt."""

from collections.abc import Iterator

from groundstation.base.records import Item
from groundstation.readers.source import Claim, Source

NAME = "tlog"
_STX = {0xFE: (6, 8), 0xFD: (10, 12)}  # first byte of a frame -> bytes before the payload, and without it
_FIRST_US, _LAST_US = 946_684_800_000_000, 4_102_444_800_000_000  # 2000 and 2100
_FRAMES = 3  # in a row are looked at


def sniff(source: Source) -> Claim | None:
    """Claim a file that begins with times of this century, each before a frame."""
    head, at, found = source.head, 0, 0
    while found < _FRAMES and at + 10 <= len(head):
        sizes = _STX.get(head[at + 8])
        if sizes is None or not _FIRST_US <= int.from_bytes(head[at : at + 8], "big") < _LAST_US:
            return None
        is_signed = head[at + 8] == 0xFD and len(head) > at + 10 and head[at + 10] & 1
        at += 8 + sizes[1] + head[at + 9] + (13 if is_signed else 0)
        found += 1
    return Claim(NAME) if found else None


def read(source: Source) -> Iterator[Item]:
    """Yield the header, batches of every message (raw and canonical), remarks and damages."""
    from groundstation.readers.tlog.reader import items

    yield from items(source, NAME)
