"""Parts of a page without any markup: a front, sections, figures, tables, facts, notes.

A chapter builds them from the answers, once. HTML, typst, Markdown and the terminal are renderers of them; they alone
escape. Where long tables are no help, on paper and in panels that are laid out again and again, they are cut.
"""

from collections.abc import Iterable, Sequence
from dataclasses import field, replace
from enum import IntEnum
from pathlib import Path
from typing import ClassVar, Literal, NamedTuple, TypeAlias

from groundstation.base.dataclasses import dataclass
from groundstation.chapters.wording import number

Tone = Literal["good", "bad", "warn", "unknown", "plain"]

SYMBOLS: dict[Tone, str] = {"good": "✓", "bad": "✗", "warn": "▲", "unknown": "○", "plain": ""}


@dataclass(frozen=True)
class Mark:
    """State in a cell: a symbol, a word and a colour, readable in black and white."""

    tone: Tone
    text: str

    @property
    def symbol(self) -> str:
        """The symbol that goes with the tone."""
        return SYMBOLS[self.tone]


Cell: TypeAlias = str | Mark


class Part:
    """Base of the parts of a section; ``kind`` tells a template which part it is."""

    kind: ClassVar[str]


@dataclass(frozen=True)
class Figure(Part):
    """Place of a figure, by its name; a page without figures leaves it out.

    ``of`` says which of several alike: a state, a horizon. ``instead`` is what a page without figures shows there.
    """

    kind: ClassVar[str] = "figure"
    name: str
    of: str = ""
    instead: Part | None = None

    @property
    def full_name(self) -> str:
        """Name with which of several alike it is: "inertial.state.position"."""
        return ".".join(filter(None, (self.name, self.of)))


@dataclass(frozen=True)
class Head:
    """A column's title; numbers stand right-aligned."""

    title: str
    numeric: bool = False


@dataclass(frozen=True)
class Grid(Part):
    """Table; ``numbers`` names the arrays behind it."""

    kind: ClassVar[str] = "grid"
    title: str
    heads: Sequence[Head]
    rows: Sequence[Sequence[Cell]]
    caption: str = ""
    numbers: Sequence[str] = ()


@dataclass(frozen=True)
class Facts(Part):
    """Pairs of a label and a value, each with an optional remark.

    ``compact`` sets many short ones in columns. ``settings_of`` names the table of a settings file whose keys and
    values the pairs are.
    """

    kind: ClassVar[str] = "facts"
    title: str
    pairs: Sequence[tuple[str, str, str]]
    caption: str = ""
    compact: bool = False
    settings_of: str = ""


@dataclass(frozen=True)
class Note(Part):
    """Paragraph, set off in the colour of its tone.

    ``files`` beside the report are named, and linked on a screen.
    """

    kind: ClassVar[str] = "note"
    text: str
    tone: Tone = "plain"
    files: Sequence[str] = ()


@dataclass(frozen=True)
class Signatures(Part):
    """Room for people to sign by hand: a line with name, signature and date for each role."""

    kind: ClassVar[str] = "signatures"
    roles: Sequence[str]


def kept(parts: Iterable[Part | None]) -> tuple[Part, ...]:
    """Return the parts that are not None."""
    return tuple(part for part in parts if part is not None)


class Rank(IntEnum):
    """Order of claims: a report opens with danger, then with the lowest that the flight has."""

    HEADING = 0  # decided: accept, advisory, reject, extend
    MAGNETIC = 1  # decided
    INERTIAL = 2
    FORECAST = 3
    LANDING = 4
    REFERENCE = 5
    ONBOARD_ERROR = 6  # of the filter on board, beyond the 95 % of a better solution
    HEALTH = 7  # of an autopilot and its filter
    GROUND_RUNS = 8
    TRACK = 9  # the best one, and how sure it is
    GNSS = 10  # reception
    HEADING_OPEN = 11  # undecided, too little taxi, or partly from taxi after the flight
    MAGNETIC_OPEN = 12
    INERTIAL_OPEN = 13  # aided by GNSS, or not known whether
    TRACK_OPEN = 14  # doubtful or ambiguous
    LATENCY = 15
    LANDING_OPEN = 16  # flown, but no gate height passed
    OTHER = 17


@dataclass(frozen=True)
class Claim:
    """Answer of a chapter at a glance.

    The report opens with the best claim, the others stand beside it as tiles.

    Parameters
    ----------
    rank : Rank
    mark : Mark
        Whether to trust it, in a word.
    headline : str
        What was found, or what to do.
    value, remark : str
        The figure of a tile, and what it is; without a value the tile shows the word.
    sentences : sequence of str
        Why.
    figures : sequence of (str, str, str)
        Label, value, remark.
    to_sign : bool
        Whether room is left for a name and a signature.
    is_danger : bool
        Whether it tells of something that endangers a flight: it then stands before every good number.
    """

    rank: Rank
    mark: Mark
    headline: str
    value: str = ""
    remark: str = ""
    sentences: Sequence[str] = ()
    figures: Sequence[tuple[str, str, str]] = ()
    to_sign: bool = False
    is_danger: bool = False

    @property
    def place(self) -> tuple[bool, Rank]:
        """Place among the claims of a flight: danger first, then by rank."""
        return not self.is_danger, self.rank

    @property
    def line(self) -> str:
        """Word and headline in one line, with the symbol of the word."""
        return f"{self.mark.symbol} {self.mark.text} · {self.headline}".strip()


@dataclass(frozen=True)
class Section:
    """One chapter of the report.

    ``key`` is its anchor; ``lead`` says in a sentence which question it answers. ``appendix`` are parts that only a
    report shows, behind all chapters: settings, workings, how it was computed. ``number`` is its number in a report.
    ``is_open``: there is no answer and ``headline`` says why; a report then lists it among what could not be assessed,
    and puts its parts in the appendix.

    A page without a front (a text panel, the terminal) begins with ``headline``, the answer in a few words, and
    ``above``, its parts in the front of a report.
    """

    key: str
    title: str
    lead: str
    parts: Sequence[Part] = field(default_factory=tuple)
    headline: str = ""
    above: Sequence[Part] = ()
    claim: Claim | None = None
    appendix: Sequence[Part] = ()
    number: str = ""
    is_open: bool = False


@dataclass(frozen=True)
class Tile:
    """Answer beside the one a report opens with: title and key of its chapter, its claim."""

    title: str
    key: str
    claim: Claim


@dataclass(frozen=True)
class Front:
    """Part of a report above its first chapter; empty fields are left out.

    Parameters
    ----------
    title : str
    recorded : str
        What was recorded and how whole it is, in one line.
    pairs : sequence of (str, Cell)
        Label and value; a label that is the key of a section leads there.
    verdict : Mark, optional
        The answer in a word; ``headline`` says what to do, ``sentences`` why.
    figures : sequence of (str, str, str)
        Label, value, remark.
    to_sign : bool
        Whether room is left for a name and a signature.
    subject : str
        What the verdict is on: the title of its chapter, whose key is ``key``.
    others : sequence of Tile
        The other answers.
    missing : sequence of (str, str)
        Subject and reason of what could not be assessed, a folded line each.
    note : str
        What the head of the log says of how it was made.
    legend : sequence of (Mark, str)
        The words that the answers are graded by, and what each means.
    """

    title: str
    pairs: Sequence[tuple[str, Cell]] = ()
    verdict: Mark | None = None
    headline: str = ""
    sentences: Sequence[str] = ()
    figures: Sequence[tuple[str, str, str]] = ()
    to_sign: bool = False
    subject: str = ""
    key: str = ""
    others: Sequence[Tile] = ()
    missing: Sequence[tuple[str, str]] = ()
    recorded: str = ""
    note: str = ""
    legend: Sequence[tuple[Mark, str]] = ()

    @property
    def line(self) -> str:
        """Verdict and headline in one line, with the symbol of the verdict."""
        mark = self.verdict
        return " · ".join(filter(None, ("" if mark is None else f"{mark.symbol} {mark.text}".strip(), self.headline)))


@dataclass(frozen=True)
class Document:
    """Whole report.

    ``kind`` says of what ("Flight report"), ``label`` stands on every page of paper.
    """

    kind: str
    label: str
    front: Front
    sections: Sequence[Section]


class Paper(NamedTuple):
    """Document that a template of its own sets as PDF; a dataclass."""

    document: object
    template: Path


def shortened(section: Section, most: int, where: str) -> Section:
    """Return the section with its long tables cut.

    A cut table says how many rows more there are, and where.
    """
    return replace(section, parts=tuple(_cut(part, most, where) for part in section.parts))


def _cut(part: Part, most: int, where: str) -> Part:
    if not isinstance(part, Grid) or len(part.rows) <= most:
        return part
    more = f"The first {most}; {number(len(part.rows) - most, 0)} more in {where}."
    return replace(part, rows=part.rows[:most], caption=f"{part.caption} {more}".strip())
