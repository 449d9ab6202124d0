"""Layout of recordings that a user saved in the viewer."""

import hashlib
import zlib
from dataclasses import dataclass, field
from pathlib import Path


@dataclass(frozen=True)
class SavedLayout:
    """Layout saved in the viewer, for recordings: name of its file, and packed content."""

    name: str
    packed: bytes = field(repr=False)

    @property
    def content(self) -> bytes:
        """Content of its file."""
        return zlib.decompress(self.packed)

    @property
    def sha256(self) -> str:
        """Digest of the content."""
        return hashlib.sha256(self.content).hexdigest()


def saved_layout(path: Path | None) -> SavedLayout | None:
    """Return the layout of a file; None without a file.

    Raises
    ------
    UsageError
        When it is no layout that this version's viewer saved.
    """
    if path is None:
        return None
    from groundstation.viewer.saved_layout import read_layout

    return SavedLayout(path.name, zlib.compress(read_layout(path)))
