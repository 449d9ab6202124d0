"""Checks of one frame at a place, in plain Python, for the first bytes of a file."""

import re
import zlib

_SENTENCE = re.compile(rb"[$!]([A-Z][A-Z0-9]{2,29},[ -#%-)+-~]{0,500})(?:\*([0-9A-Fa-f]{2})|(?=[\r\n]|$))")

_NOVATEL_TEXT = re.compile(rb"[#%]([A-Z][A-Z0-9_]*A,[ -)+-~]{0,8000};[ -)+-~]{0,8000})\*([0-9A-Fa-f]{8})")


def is_sentence(data: bytes, at: int) -> bool:
    """Tell whether a sentence of NMEA 0183 stands at a place.

    A sentence without a checksum ends with its line.

    Examples
    --------
    >>> is_sentence(b"$GPHDT,123.4,T*31\\r\\n", 0), is_sentence(b"$GPHDT,123.4,T*00\\r\\n", 0)
    (True, False)
    """
    match = _SENTENCE.match(data, at)
    if match is None:
        return False
    total = 0
    for byte in match[1]:
        total ^= byte
    return match[2] is None or int(match[2], 16) == total


def is_novatel_text(data: bytes, at: int) -> bool:
    """Tell whether a NovAtel log in text stands at a place, with a right checksum.

    Examples
    --------
    >>> log = b"#TIMEA,COM1,0,0.0,FINE,2417,1.0;VALID*"
    >>> is_novatel_text(log + b"%08x" % (zlib.crc32(log[1:-1], 0xFFFFFFFF) ^ 0xFFFFFFFF), 0), is_novatel_text(log, 0)
    (True, False)
    """
    match = _NOVATEL_TEXT.match(data, at)
    return match is not None and int(match[2], 16) == zlib.crc32(match[1], 0xFFFFFFFF) ^ 0xFFFFFFFF


def binary_frame_at(data: bytes, at: int) -> bool:
    """Tell whether a frame of UBX or NovAtel stands at a place, with a right checksum.

    Examples
    --------
    >>> frame = bytes.fromhex("b562050102000607153e")
    >>> binary_frame_at(frame, 0), binary_frame_at(frame[:-1] + b"\\0", 0)
    (True, False)
    """
    if data[at] == 0xB5:
        end = at + 8 + int.from_bytes(data[at + 4 : at + 6], "little")
        first = second = 0
        for byte in data[at + 2 : end - 2]:
            first = (first + byte) & 255
            second = (second + first) & 255
        return end <= len(data) and data[end - 2 : end] == bytes((first, second))
    if len(data) < at + 16:
        return False
    if data[at + 2] == 0x12:
        end = at + data[at + 3] + int.from_bytes(data[at + 8 : at + 10], "little") + 4
    else:
        end = at + 12 + data[at + 3] + 4
    crc = zlib.crc32(data[at : end - 4], 0xFFFFFFFF) ^ 0xFFFFFFFF
    return end <= len(data) and data[end - 4 : end] == crc.to_bytes(4, "little")
