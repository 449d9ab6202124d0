"""What a section of the report is made of: drawings, tables, facts and notes, without a word of HTML.

A section module builds these; templates/ turns them into a page, and escaping happens there, once, for everything.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import ClassVar, Literal, TypeAlias

Tone = Literal["good", "bad", "warn", "unknown", "plain"]

SYMBOLS: dict[Tone, str] = {"good": "✓", "bad": "✗", "warn": "▲", "unknown": "○", "plain": ""}


@dataclass(frozen=True)
class Mark:
    """A state in a cell: a symbol, a word and a colour, so that it survives a black-and-white printer."""

    tone: Tone
    text: str

    @property
    def symbol(self) -> str:
        """The symbol that goes with the tone."""
        return SYMBOLS[self.tone]


Cell: TypeAlias = str | Mark


@dataclass(frozen=True)
class Drawing:
    """One figure.

    Parameters
    ----------
    title, caption, alt : str
        The caption says what one sees, how many samples, what the lines are; alt is for those who cannot see it.
    svg : str
        The only text that the templates pass on unescaped: made by reports.drawing alone.
    numbers : sequence of str
        Names of the figure data; the readable copies are tables/<name>.csv.
    """

    kind: ClassVar[str] = "drawing"
    title: str
    caption: str
    alt: str
    svg: str
    numbers: Sequence[str] = ()


@dataclass(frozen=True)
class Head:
    """A column's title; numbers stand right-aligned."""

    title: str
    numeric: bool = False


@dataclass(frozen=True)
class Grid:
    """A table; ``numbers`` as in :class:`Drawing`."""

    kind: ClassVar[str] = "grid"
    title: str
    heads: Sequence[Head]
    rows: Sequence[Sequence[Cell]]
    caption: str = ""
    numbers: Sequence[str] = ()


@dataclass(frozen=True)
class Facts:
    """Pairs of a label and a value, each with an optional remark; ``compact`` sets many short ones in columns."""

    kind: ClassVar[str] = "facts"
    title: str
    pairs: Sequence[tuple[str, str, str]]
    caption: str = ""
    compact: bool = False


@dataclass(frozen=True)
class Note:
    """A paragraph, set off in the colour of its tone."""

    kind: ClassVar[str] = "note"
    text: str
    tone: Tone = "plain"


Part: TypeAlias = Drawing | Grid | Facts | Note


@dataclass(frozen=True)
class Section:
    """One chapter of the report. ``key`` is its anchor; ``lead`` says in a sentence what it answers."""

    key: str
    title: str
    lead: str
    parts: Sequence[Part] = field(default_factory=tuple)
