"""Lessons of flights for later ones of the same installation, as a part of a system.

The pipeline collects the lessons of an OUT, keeps the file of installations and fills what was learned into the reports
of the flights; the system makes lessons and answers.
"""

from collections.abc import Callable, Iterable, Sequence
from typing import TYPE_CHECKING

from groundstation.base.dataclasses import dataclass
from groundstation.results.installations import Installation, LearnedHeading, Lesson

if TYPE_CHECKING:
    from groundstation.chapters.parts import Part
    from groundstation.results.files import SavedFlight


@dataclass(frozen=True)
class LearnStep:
    """Step across the flights of a folder, as a part of a system.

    Parameters
    ----------
    lesson : callable
        ``lesson(saved)``: what a flight teaches of its installation; None where the INS has no serial number.
    installations : callable
        ``installations(lessons, known)``: every installation with the answer of each flight; one of ``known`` that has
        the same lessons is taken over.
    line : callable
        ``line(answer)``: a learned answer in a line, behind that of the flight.
    sentence : callable
        ``sentence(answer)``: the same for the top of the flight's report.
    parts : callable
        ``parts(answer)``: the same for a chapter of it.
    """

    lesson: "Callable[[SavedFlight], Lesson | None]"
    installations: Callable[[Iterable[Lesson], Sequence[Installation]], tuple[Installation, ...]]
    line: Callable[[LearnedHeading], str]
    sentence: Callable[[LearnedHeading], str]
    parts: "Callable[[LearnedHeading], Sequence[Part]]"
