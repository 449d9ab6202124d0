"""Bytes kept until they can be written in another order."""

import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

ROOM_BYTES = 1 << 20  # kept in memory: more is no faster, as new memory takes as long as a write to a file


class Kept(NamedTuple):
    """Place of bytes: in memory, or in the file behind it."""

    start: int
    nbytes: int


class Spool:
    """Place for bytes that are read back once, in any order.

    The first go to memory, those beyond ``ROOM_BYTES`` to an unnamed temporary file.

    Parameters
    ----------
    folder : Path
        Where the file is made.

    Examples
    --------
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     spool = Spool(Path(folder))
    ...     first, other = spool.put([b"a", b"bc"]), spool.put([b"d"])
    ...     bytes(spool.get(other)), bytes(spool.get(first))
    ...     spool.close()
    (b'd', b'abc')
    """

    def __init__(self, folder: Path) -> None:
        self._file = tempfile.TemporaryFile(dir=folder)  # noqa: SIM115 - closed by `close`
        self._room = memoryview(bytearray(ROOM_BYTES))
        self._used = 0  # bytes of the memory that are taken

    def put(self, parts: Sequence[bytes]) -> Kept:
        """Keep bytes, given in parts."""
        nbytes = sum(map(len, parts))
        if self._used + nbytes > ROOM_BYTES:
            start = ROOM_BYTES + self._file.tell()
            self._file.writelines(parts)
            return Kept(start, nbytes)
        start = at = self._used
        for part in parts:
            self._room[at : at + len(part)] = part
            at += len(part)
        self._used = at
        return Kept(start, nbytes)

    def get(self, kept: Kept) -> bytes | memoryview:
        """Return bytes that were kept; nothing is put in afterwards."""
        if kept.start < ROOM_BYTES:
            return self._room[kept.start : kept.start + kept.nbytes]
        self._file.seek(kept.start - ROOM_BYTES)
        return self._file.read(kept.nbytes)

    def close(self) -> None:
        """Give the memory and the file back."""
        self._file.close()
