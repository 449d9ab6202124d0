"""Base of the answers of all analyses: a frozen dataclass that names its analysis."""

from collections.abc import Mapping
from typing import ClassVar, TypeVar

from groundstation.results.figures import FigureData
from groundstation.results.frames import Tabular


class Answer(Tabular):
    """Base of every answer.

    A subclass is a frozen dataclass. ``analysis`` is the name of its analysis: its key in ``results`` of summary.json.
    ``figures`` are the arrays behind its figures; they are saved beside the summary, not in it.
    """

    analysis: ClassVar[str]
    figures: tuple[FigureData, ...]


class PlanAnswer(Answer):
    """Base of the answers of ``groundstation plan``: nothing of it has been flown."""


class SessionAnswer(Answer):
    """Base of the answers of a session of several aircraft."""


A = TypeVar("A", bound=Answer)
R = TypeVar("R")
Answers = Mapping[str, Answer]  # by the name of the analysis


def answer_of(answers: Answers, kind: type[A]) -> A | None:
    """The answer of that type, None where there is none.

    Examples
    --------
    >>> from dataclasses import dataclass
    >>> @dataclass(frozen=True)
    ... class Wind(Answer):
    ...     analysis = "wind"
    ...     speed_mps: float
    >>> answer_of({}, Wind) is None, answer_of({"wind": Wind(3.0)}, Wind)
    (True, <Wind speed_mps=3>)
    """
    found = answers.get(kind.analysis)
    return found if isinstance(found, kind) else None


def answer_meeting(answers: Answers, role: type[R]) -> R | None:
    """Return the first answer that plays a role, None where none does.

    The roles stand in :mod:`groundstation.results.roles`.
    """
    return next((found for found in answers.values() if isinstance(found, role)), None)


def by_analysis(*answers: Answer | None) -> dict[str, Answer]:
    """Return the answers by the name of their analysis; None is left out."""
    return {answer.analysis: answer for answer in answers if answer is not None}
