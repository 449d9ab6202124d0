"""Log file as readers see it before one of them claims it.

Files in gzip and zstd are seen decompressed.
"""

import io
from collections.abc import Iterator
from functools import cached_property
from pathlib import Path
from typing import Any, BinaryIO, Protocol, runtime_checkable

from groundstation.base.dataclasses import dataclass
from groundstation.base.errors import UnreadableLogError
from groundstation.base.reading import open_to_read
from groundstation.base.records import Damage, Item
from groundstation.readers.compressed import Expanded, FileWindow, compression_of, expand, head_of
from groundstation.readers.row_shapes import RowShape

HEAD_BYTES = 1 << 20  # a header row of 10 000 columns takes about 300 kB


@dataclass(frozen=True)
class Source:
    """File, its size and its first bytes; nothing is read before it is asked for.

    Parameters
    ----------
    path : Path
    """

    path: Path

    @property
    def name(self) -> str:
        """Name of the file, for messages."""
        return self.path.name

    @cached_property
    def size(self) -> int:
        """Size in bytes, of the decompressed log when the file is compressed."""
        return self._expanded.size if self.compression else self._file_size

    @cached_property
    def seen(self) -> dict[Any, Any]:
        """Findings of readers about the first bytes, which they keep for their next look."""
        return {}

    @property
    def compression(self) -> str:
        """Compression, ``gzip``, ``zstd`` or empty, by the content (it must decompress)."""
        return self._beginning[0]

    @property
    def head(self) -> bytes:
        """The first :data:`HEAD_BYTES` bytes, decompressed; fewer when the file is shorter."""
        return self._beginning[1]

    @cached_property
    def _beginning(self) -> tuple[str, bytes]:
        """Compression and head."""
        with self._open_file() as stream:
            compression = compression_of(stream.read(4))
            stream.seek(0)
            if compression and (head := head_of(stream, compression, HEAD_BYTES)):
                return compression, head
            stream.seek(0)
            return "", stream.read(HEAD_BYTES)

    def open(self) -> BinaryIO:
        """Open for reading bytes; a compressed file is decompressed at the first call.

        Raises
        ------
        UnreadableLogError
            When the file is absent, a folder, may not be read, or expands beyond all measure.
        """
        if self.compression:
            return io.BufferedReader(FileWindow(self._expanded.file, self._expanded.size))
        return self._open_file()

    @property
    def lines(self) -> "Source":
        """Source of the lines that :meth:`rows` turns into rows, at the same bytes."""
        return self

    def rows(self, lines: bytes) -> tuple[bytes, RowShape | None]:
        """Return whole lines as rows with delimiters, and their shape where it is known."""
        return lines, None

    def damages(self) -> tuple[Damage, ...]:
        """Damage of the compressed file itself, once it was opened."""
        damage = self._expanded.damage if self.compression else None
        return (damage,) if damage else ()

    @cached_property
    def is_empty(self) -> bool:
        """Tell whether the file has no bytes."""
        return self._file_size == 0

    @cached_property
    def _expanded(self) -> Expanded:
        with self._open_file() as stream:
            return expand(stream, self.compression, self._file_size, self.name)

    @cached_property
    def _file_size(self) -> int:
        try:
            return self.path.stat().st_size
        except OSError as error:
            raise self._unopenable(error) from error

    def _open_file(self) -> BinaryIO:
        try:
            return open_to_read(self.path)
        except OSError as error:
            raise self._unopenable(error) from error

    def _unopenable(self, error: OSError) -> UnreadableLogError:
        reason = (error.strerror or type(error).__name__).lower()
        return UnreadableLogError(
            str(self.path), f"no readable file ({reason})", "", "check the path and its permissions"
        )


@dataclass(frozen=True)
class MadeSource(Source):
    """Source whose bytes are made of others: what is read is decompressed."""

    @property
    def compression(self) -> str:
        """Empty."""
        return ""

    @cached_property
    def head(self) -> bytes:
        """The first :data:`HEAD_BYTES` bytes, as they are read."""
        with self.open() as stream:
            return stream.read(HEAD_BYTES)


@dataclass(frozen=True)
class Claim:
    """A reader's statement that it can read a source.

    Parameters
    ----------
    reader : str
        Name of the reader: ``"flat-csv"``.
    detail : str
        What of it applies, such as the profile's name; empty when there is nothing to add.
    confidence : float
        Between 0 and 1; the highest wins, ties go to the reader named first in the alphabet.
    """

    reader: str
    detail: str = ""
    confidence: float = 1.0

    @property
    def title(self) -> str:
        """Reader and detail in one: ``"csv-profile garmin-g1000"``."""
        return f"{self.reader} {self.detail}".strip()


@runtime_checkable
class Reader(Protocol):
    """Interface of a reader: a module of ours, or an object of a plug-in."""

    NAME: str

    def sniff(self, source: Source) -> Claim | None:
        """Claim the source if this reader can read it; looks at ``source.head`` only."""

    def read(self, source: Source) -> Iterator[Item]:
        """Yield the header, batches, remarks and damage."""
