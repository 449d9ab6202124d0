"""Messages other than data, parsed from their bytes."""

import struct

from groundstation.base.dataclasses import dataclass
from groundstation.base.errors import GroundstationError
from groundstation.readers.ulog.formats import DTYPES

MAGIC = b"ULog\x01\x12\x35"
FILE_HEADER_BYTES = 16
FLAG_BITS_BYTES = 40
FLAGS_BYTES = 3 + FLAG_BITS_BYTES  # with the head of the message
APPENDED_BIT = 1
SEVERITIES = ("emergency", "alert", "critical", "error", "warning", "notice", "info", "debug")
_CODES = dict(zip(DTYPES, "bBhHiIqQfdBb", strict=True))


@dataclass(frozen=True)
class FlagBits:
    """Flags of the log: features a reader must understand, offsets of appended data, own end.

    ``end`` is the place where the flag message ends. ``is_plain``: no flag is set, and nothing was appended.
    """

    incompatible: bytes
    appended_offsets: tuple[int, ...]
    end: int
    is_plain: bool

    @property
    def has_unknown(self) -> bool:
        """Tell whether the log uses features that this reader does not know."""
        return bool(self.incompatible[0] & ~APPENDED_BIT) and not self.is_damaged

    @property
    def is_damaged(self) -> bool:
        """Tell whether flags are set that no ULog version has.

        Flags are assigned from the lowest bit on, and one is assigned so far.
        """
        return any(self.incompatible[1:]) or self.incompatible[0] == 0xFF


@dataclass(frozen=True)
class Keyed:
    """Key, type of its value, and the value.

    The value is a number, a text, or bytes where it is neither.
    """

    key: str
    type: str
    value: int | float | str | bytes


@dataclass(frozen=True)
class LoggedText:
    """Line of text with its severity and the time of the device clock.

    ``tag`` names the process that wrote it, None without one.
    """

    severity: str
    timestamp_us: int
    text: str
    tag: int | None


def flag_bits(head: bytes) -> FlagBits | None:
    """Return the flags of a log, None when its first message is another one."""
    at = FILE_HEADER_BYTES
    if len(head) < at + 3 + FLAG_BITS_BYTES or head[at + 2 : at + 3] != b"B":
        return None
    size = int.from_bytes(head[at : at + 2], "little")
    if size < FLAG_BITS_BYTES:
        return None
    body = head[at + 3 : at + 3 + FLAG_BITS_BYTES]
    offsets = struct.unpack("<3Q", body[16:]) if body[8] & APPENDED_BIT else ()
    offsets = tuple(offset for offset in offsets if offset)
    return FlagBits(body[8:16], offsets, at + 3 + size, is_plain=size == FLAG_BITS_BYTES and not any(body[8:]))


def keyed(body: bytes) -> Keyed:
    """Read ``length, "type key", value`` (information and parameters).

    Raises
    ------
    GroundstationError
        When the bytes are none.

    Examples
    --------
    >>> keyed(b"\\x0fint32_t MAV_SYS" + bytes([1, 0, 0, 0]))
    Keyed(key='MAV_SYS', type='int32_t', value=1)
    """
    length = body[0] if body else 0
    kind, space, key = text_of(body[1 : 1 + length]).partition(" ")
    value = body[1 + length :]
    if not (space and key):
        raise GroundstationError("message", "no key")
    if kind.startswith("char"):
        return Keyed(key, kind, text_of(value))
    if kind in _CODES:
        code = struct.Struct("<" + _CODES[kind])
        if len(value) != code.size:
            raise GroundstationError(f"key {key!r}", f"{len(value)} bytes", f"{code.size} of {kind}")
        return Keyed(key, kind, code.unpack(value)[0])
    return Keyed(key, kind, value)


def logged_text(body: bytes, is_tagged: bool) -> LoggedText:
    """Read a logged line; the scan has checked that it is long enough."""
    tag = int.from_bytes(body[1:3], "little") if is_tagged else None
    start = 3 if is_tagged else 1
    timestamp = int.from_bytes(body[start : start + 8], "little")
    return LoggedText(SEVERITIES[(body[0] - 0x30) & 7], timestamp, text_of(body[start + 8 :]).strip(), tag)


def text_of(data: bytes) -> str:
    """Text without NUL bytes; what is no UTF-8 becomes a mark."""
    return data.decode("utf-8", errors="replace").replace("\0", "")


def release_text(number: int) -> str:
    """Version that ``ver_sw_release`` packs into a number.

    Examples
    --------
    >>> release_text(0x010B02FF), release_text(0x011000C0)
    ('v1.11.2', 'v1.16.0 rc')
    """
    major, minor, patch, kind = (number >> shift & 0xFF for shift in (24, 16, 8, 0))
    names = ((255, ""), (192, " rc"), (128, " beta"), (64, " alpha"), (0, " dev"))
    return f"v{major}.{minor}.{patch}" + next(name for least, name in names if kind >= least)
