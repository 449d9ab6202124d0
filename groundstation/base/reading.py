"""Opening of files so that an error of a later read names the file."""

import io
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from _typeshed import WriteableBuffer


class _NamedFile(io.FileIO):
    """File whose errors name it, which the system's errors do not."""

    def readinto(self, buffer: "WriteableBuffer", /) -> int:
        try:
            return super().readinto(buffer)
        except OSError as error:
            error.filename = self.name
            raise

    def readall(self) -> bytes:
        try:
            return super().readall()
        except OSError as error:
            error.filename = self.name
            raise


def open_to_read(path: Path) -> io.BufferedReader:
    """Open a file for reading bytes.

    Raises
    ------
    OSError
        With the name of the file, as every later read does that fails.
    """
    return io.BufferedReader(_NamedFile(path))
