"""A chapter with the answers it tells, and the chapters of flights, sessions and plans."""

from collections.abc import Callable
from typing import NamedTuple

from groundstation.chapters.parts import Cell, Front, Section
from groundstation.results.answer import Answer
from groundstation.results.flight import FlightResults

Pairs = tuple[tuple[str, Cell], ...]


class Chapter(NamedTuple):
    """Chapter of a system: the answers it tells, and its builder.

    ``build(results)`` returns None where there is nothing to say.

    ``front(results, pairs)`` is the top of the report of a session, made of its first chapter.
    """

    answers: tuple[type[Answer], ...]
    build: Callable[[FlightResults], Section | None]
    front: Callable[[FlightResults, Pairs], Front] | None = None

    @property
    def name(self) -> str:
        """Name of the analysis whose answer it tells first."""
        return self.answers[0].analysis


class Chapters(NamedTuple):
    """Chapters of flights, sessions and plans, in the order of the report.

    An answer that none of them tells has the generic chapter.
    """

    flight: tuple[Chapter, ...] = ()
    session: tuple[Chapter, ...] = ()
    plan: tuple[Chapter, ...] = ()

    def of(self, results: FlightResults) -> tuple[Chapter, ...]:
        """Return the chapters of what the results are of."""
        return self.plan if results.is_plan else self.session if results.is_session else self.flight

    @property
    def told(self) -> tuple[type[Answer], ...]:
        """Types of the answers that some chapter tells."""
        return tuple(kind for every in self for chapter in every for kind in chapter.answers)
