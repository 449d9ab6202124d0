"""Recognition of a store file by its first bytes, or by the rest where those are damaged."""

import os
import re
from pathlib import Path
from typing import BinaryIO

from groundstation.store.marks import HEADER_OPCODE, MAGIC, METADATA_NAME, PACKAGE, RECORD_PREFIX, SEARCH_BYTES

HEAD_BYTES = 4096  # enough to recognise a sound file
_LIBRARY = "groundstation "
_BEGINNING = re.compile(re.escape(MAGIC) + rb"\x01[\0-\xff]{8}\0{4}[\0-\xff]{4}" + _LIBRARY.encode())


def is_groundstation_mcap(source: str | os.PathLike[str] | bytes) -> bool:
    """Tell whether a file, or the first 4096 bytes of one, was written by the store.

    Three marks tell: MCAP's magic number, the library in the header, the name of the metadata record. Two are enough,
    so that no single flipped bit disowns a file. Of a file with fewer, unless its header names another program, the
    first and the last 1 MiB are searched for a definition that the store wrote: without any, nothing could be read.
    """
    head = _head(source)
    marks = (head.startswith(MAGIC), head[25:39] == _LIBRARY.encode(), _metadata_mark() in head)
    if sum(marks) >= 2:
        return True
    if isinstance(source, bytes) or _is_of_another_program(head):
        return False
    try:
        with Path(source).open("rb") as file:
            return _has_definition(file, os.fstat(file.fileno()).st_size)
    except OSError:
        return False


def is_mostly_mcap(path: str | os.PathLike[str]) -> bool:
    """Tell whether a file is an MCAP of the store to its end, or in large part chunks.

    The chunks must be at least half of its bytes, or a quarter where :func:`is_groundstation_mcap` accepts its
    beginning. Else another log may stand in it, of which a part was overwritten.
    """
    from groundstation.store.recovery import chunk_bytes

    try:
        with Path(path).open("rb") as file:
            size = os.fstat(file.fileno()).st_size
            begins = is_groundstation_mcap(file.read(HEAD_BYTES))
            is_whole = begins and _ends_with_magic(file, size)
            return is_whole or (4 if begins else 2) * chunk_bytes(file, size) >= size
    except OSError:
        return False


def _metadata_mark() -> bytes:
    return len(METADATA_NAME).to_bytes(4, "little") + METADATA_NAME.encode()


def _head(source: str | os.PathLike[str] | bytes) -> bytes:
    if isinstance(source, bytes):
        return source[:HEAD_BYTES]
    try:
        with Path(source).open("rb") as file:
            return file.read(HEAD_BYTES)
    except OSError:
        return b""


def _is_of_another_program(head: bytes) -> bool:
    """Tell whether there is a whole header that names another program's library.

    A name that is ours but for some damaged characters is not another.
    """
    start = len(MAGIC) + RECORD_PREFIX
    length = int.from_bytes(head[len(MAGIC) + 1 : start], "little")
    if not head.startswith(MAGIC + bytes([HEADER_OPCODE])) or length > HEAD_BYTES:
        return False
    from mcap.records import Header

    from groundstation.store.framing import parse_record

    header = parse_record(HEADER_OPCODE, head[start : start + length])
    if not isinstance(header, Header) or not header.library.isprintable():
        return False
    alike = sum(one == other for one, other in zip(header.library, _LIBRARY, strict=False))
    return 2 * alike < len(_LIBRARY)


def _has_definition(file: BinaryIO, size: int) -> bool:
    """Tell whether a message type of the store stands in the first or the last 1 MiB.

    False when the file is an archive or an image that holds an MCAP: a whole beginning further in, or a summary that
    does not end with the file.
    """
    is_ended = _ends_with_magic(file, size)
    if _defines(file, 0):
        file.seek(0)
        return is_ended or _BEGINNING.search(file.read(SEARCH_BYTES), 1) is None
    return is_ended and _defines(file, max(0, size - SEARCH_BYTES))


def _defines(file: BinaryIO, start: int) -> bool:
    """Tell whether a message type of the store begins in the 1 MiB from ``start`` on."""
    file.seek(start)
    if PACKAGE.encode() + b"." not in file.read(SEARCH_BYTES):
        return False
    from mcap.records import Schema

    from groundstation.store.recovery import definitions_in, is_own_schema

    found = definitions_in(file, start, start + SEARCH_BYTES)
    return any(isinstance(record, Schema) and is_own_schema(record) for record, _ in found)


def _ends_with_magic(file: BinaryIO, size: int) -> bool:
    file.seek(max(0, size - len(MAGIC)))
    return file.read(len(MAGIC)) == MAGIC
