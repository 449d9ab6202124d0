"""Chapters of a plan, and the top of its report.

What is planned, and the conclusions of its chapters.
"""

from groundstation.base.failures import attempt
from groundstation.base.findings import worst
from groundstation.chapters.chapter import Chapter
from groundstation.chapters.control import control
from groundstation.chapters.landing_ranges import landing_ranges
from groundstation.chapters.parts import Cell, Facts, Front, Mark, Note
from groundstation.chapters.placement import placement
from groundstation.results.control import ControlPlan
from groundstation.results.flight import FlightResults
from groundstation.results.landing_ranges import RangeLanding
from groundstation.results.placement import PlacementPlan
from groundstation.results.plan import PlanAnswer

# In the order of the report. An answer that none of them tells has the generic chapter.
PLAN_CHAPTERS: tuple[Chapter, ...] = (
    Chapter((ControlPlan,), control),
    Chapter((PlacementPlan,), placement),
    Chapter((RangeLanding,), landing_ranges),
)
MARKS = {
    None: Mark("good", "Planned"),
    "info": Mark("good", "Planned"),
    "warn": Mark("warn", "Planned, with warnings"),
    "fail": Mark("bad", "No usable plan"),
}


def is_plan(results: FlightResults) -> bool:
    """Tell whether the results are those of a plan, not of something flown."""
    return any(isinstance(answer, PlanAnswer) for answer in results.answers.values())


def plan_front(results: FlightResults, pairs: tuple[tuple[str, Cell], ...]) -> Front:
    """Return the top of a plan's report.

    The headline of its first chapter, and what every chapter has above its parts.
    """
    built = (attempt("chapter", chapter.name, chapter.build, results) for chapter in PLAN_CHAPTERS)
    sections = [section for section in built if section is not None]
    above = [part for section in sections for part in section.above]
    return Front(
        results.metadata.get("title", "") or results.flight_id,
        pairs,
        verdict=MARKS[worst(results.findings)],
        headline=sections[0].headline if sections else "",
        sentences=tuple(part.text for part in above if isinstance(part, Note)),
        figures=tuple(pair for part in above if isinstance(part, Facts) for pair in part.pairs),
    )
