"""Layouts of recordings that a user saved in the viewer."""

import hashlib
import zlib
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

from groundstation.base.errors import UsageError

KindOfRecording = Literal["flight", "session", "fleet"]


@dataclass(frozen=True)
class SavedLayout:
    """Layout saved in the viewer: name of its file, packed content, and which recordings it is of.

    A view shows entities by their paths, and those of flights, sessions and fleets differ: in place of the tabs of
    another kind of recording it would be empty.
    """

    name: str
    packed: bytes = field(repr=False)
    of: KindOfRecording = "flight"

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
    from groundstation.viewer.saved_layout import kind_of, read_layout

    return SavedLayout(path.name, zlib.compress(read_layout(path)), kind_of(path))


def saved_layouts(paths: Iterable[Path]) -> tuple[SavedLayout, ...]:
    """Return the layouts of files, at most one for each kind of recording.

    Raises
    ------
    UsageError
        When a file is no layout, or two are of one kind.
    """
    found: dict[str, SavedLayout] = {}
    for one in map(saved_layout, paths):
        if one is None:
            continue
        if one.of in found:
            both = f"{found[one.of].name} and {one.name}, both of a {one.of}"
            raise UsageError("--layout", both, "one of a flight, one of a session, one of fleet.rrd")
        found[one.of] = one
    return tuple(found.values())
