"""Layouts of recordings that a user saved in the viewer."""

import hashlib
import zlib
from collections.abc import Iterable
from dataclasses import field
from pathlib import Path
from typing import Literal

from groundstation.base.dataclasses import dataclass
from groundstation.base.errors import UsageError
from groundstation.results.answer import SessionAnswer

OF_A_FLEET = frozenset({"fleet", "aircraft", "by_aircraft", "flights", "failed"})  # first parts of entity paths
KindOfRecording = Literal["flight", "session", "fleet"]


@dataclass(frozen=True)
class SavedLayout:
    """Layout saved in the viewer: name of its file, packed content, kind of its recordings.

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


def saved_layout(path: Path) -> SavedLayout:
    """Return the layout of a file.

    Raises
    ------
    UsageError
        When it is no layout that this version's viewer saved.
    """
    from groundstation.viewer.saved_layout import read_layout, roots_of

    return SavedLayout(path.name, zlib.compress(read_layout(path)), _kind_of(roots_of(path)))


def _kind_of(roots: frozenset[str]) -> KindOfRecording:
    """Return the kind of recording that has entities of these first parts."""
    from groundstation.systems import systems

    if roots & {name for tab in systems().tabs_of(SessionAnswer) for name in tab.shows}:
        return "session"
    return "fleet" if roots & OF_A_FLEET else "flight"


def saved_layouts(paths: Iterable[Path]) -> tuple[SavedLayout, ...]:
    """Return the layouts of files, at most one for each kind of recording.

    Raises
    ------
    UsageError
        When a file is no layout, or two are of one kind.
    """
    found: dict[str, SavedLayout] = {}
    for one in map(saved_layout, paths):
        if one.of in found:
            both = f"{found[one.of].name} and {one.name}, both of a {one.of}"
            raise UsageError("--layout", both, "one of a flight, one of a session, one of fleet.rrd")
        found[one.of] = one
    return tuple(found.values())
