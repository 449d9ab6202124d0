"""A chapter with the answers it tells, and the chapters of flights, sessions and plans."""

from collections.abc import Callable, Iterable, Mapping
from types import MappingProxyType
from typing import Literal, NamedTuple

from groundstation.chapters.parts import Cell, Front, Section
from groundstation.results.answer import Answer
from groundstation.results.flight import FlightResults

Pairs = tuple[tuple[str, Cell], ...]
Citation = tuple[str, str]  # name in the chapters, and the publication


class Chapter(NamedTuple):
    """Chapter of a system: the answers it tells, and its builder.

    ``build(results)`` returns None where there is nothing to say.

    ``front(results, pairs)`` is the top of the report of a session, made of its first chapter. ``sources`` are the
    publications that the method of the first answer rests on.
    """

    answers: tuple[type[Answer], ...]
    build: Callable[[FlightResults], Section | None]
    front: Callable[[FlightResults, Pairs], Front] | None = None
    sources: tuple[Citation, ...] = ()

    @property
    def name(self) -> str:
        """Name of the analysis whose answer it tells first."""
        return self.answers[0].analysis


NextLine = Literal["Fly", "Record", "Check"]
# Each a part of the reason for which an analysis could not be carried out, with the line and the text that mend it.
Remedies = tuple[tuple[str, tuple[NextLine, str]], ...]


class Advice(NamedTuple):
    """Advice for the next flight: its line, its text, and what it is for, empty where for all.

    What keeps an answer from being used is pressing: it stands before what would give a missing one. What a danger asks
    for stands before all.
    """

    line: NextLine
    text: str
    purpose: str
    is_pressing: bool = False
    is_danger: bool = False


def _nothing_withheld(_results: FlightResults) -> tuple[str, ...]:
    return ()


def _no_advice(_results: FlightResults) -> tuple[Advice, ...]:
    return ()


class Adviser(NamedTuple):
    """Advice of a system: remedies of missing answers, and what would better those there are.

    ``withheld`` are words of advice that the aircraft of these results cannot follow, of whichever system it is.
    """

    remedies: Remedies = ()
    advise: Callable[[FlightResults], Iterable[Advice]] = _no_advice
    withheld: Callable[[FlightResults], tuple[str, ...]] = _nothing_withheld


class Chapters(NamedTuple):
    """Chapters of flights, sessions and plans, in the order of the report.

    An answer that none of them tells has the generic chapter. ``titles`` are those of the analyses, by name, where
    they could not be carried out; ``advisers`` fill the chapter on what to do next.
    """

    flight: tuple[Chapter, ...] = ()
    session: tuple[Chapter, ...] = ()
    plan: tuple[Chapter, ...] = ()
    titles: Mapping[str, str] = MappingProxyType({})
    advisers: tuple[Adviser, ...] = ()

    def of(self, results: FlightResults) -> tuple[Chapter, ...]:
        """Return the chapters of what the results are of."""
        return self.plan if results.is_plan else self.session if results.is_session else self.flight

    @property
    def told(self) -> tuple[type[Answer], ...]:
        """Types of the answers that some chapter tells."""
        every = (*self.flight, *self.session, *self.plan)
        return tuple(kind for chapter in every for kind in chapter.answers)
