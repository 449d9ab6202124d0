"""Answer of the heading analysis with what earlier flights taught of the installation."""

from typing import ClassVar

from groundstation.base.dataclasses import dataclass
from groundstation.results.answer import Answer
from groundstation.results.figures import FigureData
from groundstation.results.installations import LearnedHeading


@dataclass(frozen=True)
class InstallationResult(LearnedHeading, Answer):
    """Heading error with the knowledge from earlier flights (INS heading - true heading)."""

    analysis: ClassVar[str] = "installation"

    figures: tuple[FigureData, ...] = ()
