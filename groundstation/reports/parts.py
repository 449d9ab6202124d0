"""What a report is made of: a front, sections, and in them drawings, tables, facts and notes, without a word of markup.

A section module builds these; page.py turns them into HTML and pdf.py into PDF, each with its template, and escaping
happens there, once, for everything.
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
        The only text that the page passes on unescaped: made by reports.drawing alone.
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
    """A paragraph, set off in the colour of its tone; ``files`` beside the report are named, and linked on a screen."""

    kind: ClassVar[str] = "note"
    text: str
    tone: Tone = "plain"
    files: Sequence[str] = ()


Part: TypeAlias = Drawing | Grid | Facts | Note


@dataclass(frozen=True)
class Section:
    """One chapter of the report. ``key`` is its anchor; ``lead`` says in a sentence what it answers."""

    key: str
    title: str
    lead: str
    parts: Sequence[Part] = field(default_factory=tuple)


@dataclass(frozen=True)
class Front:
    """What stands above the first chapter; what is empty is left out.

    Parameters
    ----------
    title : str
    pairs : sequence of (str, Cell)
        Label and value; a label that is the key of a section leads there.
    verdict : Mark, optional
        The answer in a word; ``headline`` says what to do, ``sentences`` why.
    figures : sequence of (str, str, str)
        Label, value, remark.
    to_sign : bool
        Whether room is left for a name and a signature.
    """

    title: str
    pairs: Sequence[tuple[str, Cell]] = ()
    verdict: Mark | None = None
    headline: str = ""
    sentences: Sequence[str] = ()
    figures: Sequence[tuple[str, str, str]] = ()
    to_sign: bool = False


@dataclass(frozen=True)
class Document:
    """A whole report; ``kind`` says what of ("Flight report"), ``label`` stands on every page of paper."""

    kind: str
    label: str
    front: Front
    sections: Sequence[Section]
