"""Satellite receivers: UBX, NMEA 0183 and NovAtel OEM in one stream, RTCM 3 is counted."""

import re
from collections.abc import Iterator

from groundstation.base.records import Item
from groundstation.readers.receiver.checksums import binary_frame_at, is_novatel_text, is_sentence
from groundstation.readers.source import Claim, Source

NAME = "receiver"
_NAME = rb"(?<![ -~].)(?=[A-Z][A-Z0-9]{2,29},)"  # after a $ or ! with no text before it
_ASCII = rb"(?=[A-Z][A-Z0-9_]*A,)"  # NovAtel's messages as text
# Every branch begins with one byte: then re skips what begins none, seven times as fast.
_START = re.compile(
    rb"\xb5\x62|\xaa\x44[\x12\x13]|\$" + _NAME + rb"|!" + _NAME + rb"|#" + _ASCII + rb"|%" + _ASCII, re.DOTALL
)
_LOOKED_AT = 1 << 16
_MOST_TRIED, _ENOUGH = 200, 3
_LEADING = 2  # bytes in front of the first frame that are still a beginning: the end of a line


def sniff(source: Source) -> Claim | None:
    """Claim a file that begins with a frame, or has several in its first 64 KiB.

    The frames may stand alone, or in text that a computer wrote.
    """
    head = source.head[:_LOOKED_AT]
    found = 0
    for tried, match in enumerate(_START.finditer(head)):
        at = match.start()
        if tried == _MOST_TRIED:
            break
        if not _is_frame(head, at):
            continue
        if at <= _LEADING:
            return Claim(NAME)
        found += 1
        if found == _ENOUGH:
            return Claim(NAME, confidence=0.7)
    if b"$" not in head and b"!" not in head:  # what every sentence begins with
        return None
    from groundstation.readers.receiver import host_text

    return Claim(NAME, confidence=0.6) if host_text.find(head) else None


def _is_frame(head: bytes, at: int) -> bool:
    if head[at] in b"$!":
        return is_sentence(head, at)
    return is_novatel_text(head, at) if head[at] in b"#%" else binary_frame_at(head, at)


def read(source: Source) -> Iterator[Item]:
    """Yield the header, batches, remarks and damage of a stream."""
    from groundstation.readers.receiver.reader import items  # brings numba

    return items(source)
