"""ArduPilot DataFlash logs (.BIN): every message kept, navigation in canonical topics."""

import re
from collections.abc import Iterator

from groundstation.base.records import Item
from groundstation.readers.source import Claim, Source

NAME = "dataflash"
# A FMT record: every log defines its types by these first.
_DEFINITION = re.compile(rb"\xa3\x95\x80[\x00-\xff][\x03-\xff][A-Za-z][A-Za-z0-9_\0]{3}")
_ENOUGH_DEFINITIONS = 3


def sniff(source: Source) -> Claim | None:
    """Claim a file that begins with a format definition.

    Where the start of the file is damaged, several definitions in the head are enough.
    """
    if _DEFINITION.match(source.head):
        return Claim(NAME)
    found = zip(range(_ENOUGH_DEFINITIONS), _DEFINITION.finditer(source.head), strict=False)
    return Claim(NAME, confidence=0.9) if sum(1 for _ in found) == _ENOUGH_DEFINITIONS else None


def read(source: Source) -> Iterator[Item]:
    """Yield the header, the log's batches, remarks and damage."""
    from groundstation.readers.dataflash.reader import items  # brings numba

    return items(source)
