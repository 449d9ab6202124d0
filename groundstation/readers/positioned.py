"""Read-only view of bytes with a position of its own."""

import io


class Positioned(io.RawIOBase):
    """Read-only view whose ``readinto`` reads from ``_at`` on, and moves it."""

    _at = 0

    def _length(self) -> int:
        """Return the number of bytes; asked for only where a position is told from the end."""
        raise io.UnsupportedOperation("length")

    def readable(self) -> bool:
        """True."""
        return True

    def seekable(self) -> bool:
        """True."""
        return True

    def tell(self) -> int:
        """Position from the start."""
        return self._at

    def seek(self, offset: int, whence: int = io.SEEK_SET) -> int:
        """Move to a position and return it."""
        base = {io.SEEK_SET: 0, io.SEEK_CUR: self._at}.get(whence)
        self._at = max(0, (self._length() if base is None else base) + offset)
        return self._at
