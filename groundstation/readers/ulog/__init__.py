"""PX4 ULog: every topic under its own definition, the canonical ones in their units, and what was lost on the way."""

import re
from collections.abc import Iterator

from groundstation.base.errors import UnreadableLogError
from groundstation.base.records import Damage, Item
from groundstation.readers.source import Claim, Source

NAME = "px4-ulog"
_MAGIC = b"ULog\x01\x12\x35"
_FORMAT = re.compile(rb"F[A-Za-z0-9_\-/]{2,80}:uint64_t timestamp;")
_ENOUGH_FORMATS = 2


def sniff(source: Source) -> Claim | None:
    """Claim what begins with the seven bytes of a ULog, or (where its start is damaged) holds several formats of it."""
    if source.head.startswith(_MAGIC):
        return Claim(NAME)
    found = zip(range(_ENOUGH_FORMATS), _FORMAT.finditer(source.head), strict=False)
    return Claim(NAME, confidence=0.8) if sum(1 for _ in found) == _ENOUGH_FORMATS else None


def read(source: Source) -> Iterator[Item]:
    """Yield the header, batches, remarks and damages of a ULog.

    Raises
    ------
    UnreadableLogError
        When the file is none, or its flags say that a reader must know more than this one does.
    """
    from groundstation.readers.ulog.blocks import flags_of
    from groundstation.readers.ulog.messages import FILE_HEADER_BYTES
    from groundstation.readers.ulog.reader import items

    head = source.head[:FILE_HEADER_BYTES]
    if len(head) == FILE_HEADER_BYTES and not head.startswith(_MAGIC) and sniff(source) is not None:
        return _headless(source)
    if not head.startswith(_MAGIC) or len(head) < FILE_HEADER_BYTES:
        raise UnreadableLogError(source.name, "no ULog header", f"{FILE_HEADER_BYTES} bytes", "the file was cut")
    flags = flags_of(source)
    if flags is not None and flags.has_unknown:
        raise UnreadableLogError(
            source.name,
            f"ULog flags {flags.incompatible.hex()}, which this version does not know",
            "",
            "convert the log with the tools of the PX4 that wrote it",
        )
    return items(source, NAME, int.from_bytes(head[8:16], "little"))


def _headless(source: Source) -> Iterator[Item]:
    """Items of a log whose first bytes are damaged; when logging began is not known."""
    from groundstation.readers.ulog.reader import items

    yield from items(source, NAME, 0)
    yield Damage("corrupt", "bytes 0 to 15", 16, "bytes of the file's header")
