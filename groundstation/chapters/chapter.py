"""Chapter with the types of the answers it presents."""

from collections.abc import Callable
from typing import NamedTuple

from groundstation.chapters.parts import Section
from groundstation.results.answer import Answer
from groundstation.results.flight import FlightResults


class Chapter(NamedTuple):
    """Chapter written for certain answers: their types, and the function that builds it.

    ``build`` returns None where there is nothing to say.
    """

    answers: tuple[type[Answer], ...]
    build: Callable[[FlightResults], Section | None]

    @property
    def name(self) -> str:
        """Name of the analysis whose answer it presents first."""
        return self.answers[0].analysis
