"""IRIG 106 Chapter 10 and 11 recordings: every bus word kept, navigation named by an ICD."""

import re
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from groundstation.base.records import Item
from groundstation.readers.source import Claim, Source

if TYPE_CHECKING:
    from groundstation.readers.icd import Icd

NAME = "chapter10"
# Sync, and after 12 bytes data type versions that exist, a sequence number, flags; see packets.py.
_PACKET = re.compile(rb"\x25\xeb.{10}[\x00-\x20].{11}", re.DOTALL)
_ENOUGH_PACKETS = 3


def sniff(source: Source) -> Claim | None:
    """Claim a file that begins with a packet.

    Where the start of the file is damaged, several headers with a right checksum are enough.
    """
    if _is_header(source.head, 0):
        return Claim(NAME)
    found = (one for one in _PACKET.finditer(source.head) if _is_header(source.head, one.start()))
    enough = sum(1 for _ in zip(range(_ENOUGH_PACKETS), found, strict=False)) == _ENOUGH_PACKETS
    return Claim(NAME, confidence=0.9) if enough else None


def _is_header(data: bytes, at: int) -> bool:
    """Tell whether 24 bytes begin with the sync pattern and end with their sum."""
    words = memoryview(data[at : at + 24]).cast("H") if len(data) >= at + 24 else None
    return words is not None and words[0] == 0xEB25 and sum(words[:11]) & 0xFFFF == words[11]


def read(source: Source, icds: "Sequence[Icd]" = ()) -> Iterator[Item]:
    """Yield the header, the recording's batches, the signals of ICDs, remarks and damage.

    The signals are those that the ICDs find in the batches.
    """
    from groundstation.readers.chapter10.reader import items  # brings numba

    return items(source, icds)
