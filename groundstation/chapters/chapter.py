"""A chapter with the answers it tells."""

from collections.abc import Callable
from typing import NamedTuple

from groundstation.chapters.parts import Section
from groundstation.results.answer import Answer
from groundstation.results.flight import FlightResults


class Chapter(NamedTuple):
    """A chapter of its own: the answers it tells, and what builds it; None where it has nothing to say."""

    answers: tuple[type[Answer], ...]
    build: Callable[[FlightResults], Section | None]

    @property
    def name(self) -> str:
        """The analysis whose answer it tells first."""
        return self.answers[0].analysis
