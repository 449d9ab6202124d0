"""Standard of one system that the flights of a folder are held against, from what they saved."""

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any, Literal, NamedTuple, Protocol

if TYPE_CHECKING:
    from groundstation.base.shipped_toml import ShippedToml, TomlFile
    from groundstation.chapters.parts import Document
    from groundstation.results.figures import FigureData
    from groundstation.results.files import SavedFlight

ShareDecision = Literal["pass", "fail", "not enough flights", "not flown", "no limit"]


class HeldTo(Protocol):
    """Answer of a standard: its decision, and the table behind it."""

    @property
    def decision(self) -> ShareDecision:
        """Whether the flights keep the standard."""
        ...

    @property
    def table(self) -> "FigureData":
        """One row for each thing that was judged."""
        ...

    def to_dict(self) -> dict[str, Any]:
        """Return plain JSON values."""
        ...


class FolderStandard(NamedTuple):
    """Kind of standard that a system judges a folder by.

    Parameters
    ----------
    kind : str
        Value of ``kind`` in its files.
    shipped : ShippedToml
        Those that ship with the package.
    judge : callable
        ``judge(flights, file, unread)``: the answer; ``unread`` are flights that cannot be read, with the reason.
    document : callable
        Its page.
    """

    kind: str
    shipped: "ShippedToml"
    judge: "Callable[[Sequence[SavedFlight], TomlFile, Sequence[str]], HeldTo]"
    document: "Callable[[Any], Document]"
