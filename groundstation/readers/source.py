"""A log file as readers see it before one of them claims it."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, BinaryIO, Protocol, runtime_checkable

from groundstation.base.errors import UnreadableLogError
from groundstation.base.records import Item

HEAD_BYTES = 1 << 20  # a header row of 10 000 columns takes about 300 kB


@dataclass(frozen=True)
class Source:
    """A file, its size and its first bytes. Nothing is read before it is asked for.

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
        """Size in bytes."""
        try:
            return self.path.stat().st_size
        except OSError as error:
            raise self._unopenable(error) from error

    @cached_property
    def head(self) -> bytes:
        """The first :data:`HEAD_BYTES` bytes, fewer when the file is shorter."""
        with self.open() as stream:
            return stream.read(HEAD_BYTES)

    def open(self) -> BinaryIO:
        """Open for reading bytes.

        Raises
        ------
        UnreadableLogError
            When the file is absent, a folder, or may not be read.
        """
        try:
            return self.path.open("rb")
        except OSError as error:
            raise self._unopenable(error) from error

    def _unopenable(self, error: OSError) -> UnreadableLogError:
        reason = (error.strerror or type(error).__name__).lower()
        return UnreadableLogError(
            str(self.path), f"no readable file ({reason})", "", "check the path and its permissions"
        )


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
    """What a reader module (or a third party's object) offers."""

    NAME: str

    def sniff(self, source: Source) -> Claim | None:
        """Say whether this reader can read the source; looks at ``source.head`` only."""

    def read(self, source: Source, **options: Any) -> Iterator[Item]:
        """Yield the header, then batches, remarks and damages."""
