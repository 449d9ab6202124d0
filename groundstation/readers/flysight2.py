"""Logs of a FlySight 2: TRACK.CSV with fixes, SENSOR.CSV with sensors, or both in one.

Source: github.com/flysight/flysight-2-firmware, FlySight/log.c (columns, units, digits; TIME: seconds of the unit's
counter beside seconds of the GPS week).
"""

from collections.abc import Iterator

from groundstation.base.records import Item
from groundstation.readers.source import Claim, Source

NAME = "flysight2"
_LOOKED_AT = 1 << 16  # bytes of the head
_FIRST = (b"$FLYS,", b"\xef\xbb\xbf$FLYS,")


def sniff(source: Source) -> Claim | None:
    """Claim a file that begins with the maker's line and names the columns of a record."""
    head = source.head[:_LOOKED_AT]
    return Claim(NAME) if head.startswith(_FIRST) and b"$COL," in head else None


def read(source: Source) -> Iterator[Item]:
    """Yield the header, fixes, pressures, other records, remarks and damage."""
    from groundstation.readers.flysight2_log import items_of  # every other log is opened without pyarrow

    yield from items_of(source, NAME)
