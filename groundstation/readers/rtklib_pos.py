"""RTKLIB solutions (.pos): position and velocity of a receiver with their covariances.

Every column is kept.

The line of names says which form it is: latitude and longitude (degrees, or degrees, minutes and seconds), ECEF, or a
baseline east, north, up from the base station; in GPS time, UTC or Japan's, as date and time or as week and second. A
further header in the middle of the file governs the rows below it.

Source: Takasu, RTKLIB ver. 2.4.2 manual (2013), appendix B.1.
"""

from collections.abc import Iterator

from groundstation.base.records import Item
from groundstation.readers.source import Claim, Source

NAME = "rtklib-pos"


def sniff(source: Source) -> Claim | None:
    """Claim a file with RTKLIB's line of names."""
    if not source.head.removeprefix(b"\xef\xbb\xbf").lstrip().startswith(b"%"):
        return None
    from groundstation.readers.rtklib_header import form_of

    return Claim(NAME) if form_of(source) is not None else None


def read(source: Source) -> Iterator[Item]:
    """Yield the header, rows as ``raw.pos`` and as ``gnss``, remarks and damage."""
    from groundstation.readers.rtklib_rows import items

    yield from items(source, NAME)
