"""PX4 ULog: every topic under its own definition, canonical ones in their units.

Loss on the way is reported as damage.
"""

import re
from collections.abc import Iterator

from groundstation.base.errors import UnclaimedLogError, UnreadableLogError
from groundstation.base.records import Damage, Item
from groundstation.readers.source import Claim, Source

NAME = "px4-ulog"
_MAGIC = b"ULog\x01\x12\x35"
_FORMAT = re.compile(rb"F[A-Za-z0-9_\-/]{2,80}:uint64_t timestamp;")
_ENOUGH_FORMATS = 2
_ENCRYPTED, _KEY = b"ULogEnc", b"ULogKey"  # PX4 from 1.16: key and data in one file (.ulge); before: .ulgk and .ulgc
_ENCRYPTED_NAMES = (".ulge", ".ulgc")


def sniff(source: Source) -> Claim | None:
    """Claim a file that begins with the seven magic bytes of a ULog.

    Where the start of the file is damaged, several ULog formats in the head are enough.

    Raises
    ------
    UnreadableLogError
        When the log is encrypted.
    """
    if source.head.startswith(_MAGIC):
        return Claim(NAME)
    found = zip(range(_ENOUGH_FORMATS), _FORMAT.finditer(source.head), strict=False)
    if sum(1 for _ in found) == _ENOUGH_FORMATS:
        return Claim(NAME, confidence=0.8)
    _refuse_encrypted(source)
    return None


def _refuse_encrypted(source: Source) -> None:
    """Refuse a log that PX4 encrypted and say how to decrypt it.

    Before PX4 1.16 encrypted data are recognised by the file's name.
    """
    if source.head.startswith(_KEY):
        found, next_step = "the key of an encrypted PX4 ULog, no log", "decrypt the .ulgc beside it"
        raise UnclaimedLogError(source.name, found, "", f"{next_step} with PX4's Tools/decrypt_ulog.py")
    by_name = [suffix for suffix in source.path.suffixes if suffix.lower() in _ENCRYPTED_NAMES]
    if source.head.startswith(_ENCRYPTED) or by_name:
        raise UnreadableLogError(
            source.name,
            "an encrypted PX4 ULog",
            "",
            "decrypt it with the private key of whoever built the firmware and PX4's Tools/decrypt_ulog.py "
            "(from 1.16 on Tools/log_encryption/decrypt_logs.py), then read the .ulg that it writes",
        )


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
    """Yield the items of a log whose first bytes are damaged; its start is not known."""
    from groundstation.readers.ulog.reader import items

    yield from items(source, NAME, 0)
    yield Damage("corrupt", "bytes 0 to 15", 16, "bytes of the file's header")
