"""Top of a plan's report: what is planned, and what its chapters say above all."""

from collections.abc import Sequence

from groundstation.base.failures import attempt
from groundstation.base.findings import worst
from groundstation.chapters.chapter import Chapter, Pairs
from groundstation.chapters.parts import Facts, Front, Mark, Note
from groundstation.results.flight import FlightResults

MARKS = {
    None: Mark("good", "Planned"),
    "info": Mark("good", "Planned"),
    "warn": Mark("warn", "Planned, with warnings"),
    "fail": Mark("bad", "No usable plan"),
}


def plan_front(results: FlightResults, pairs: Pairs, chapters: Sequence[Chapter]) -> Front:
    """Build the top of a plan's report.

    It has the headline of the first chapter, and the parts that each chapter puts above its own.
    """
    built = (attempt("chapter", chapter.name, chapter.build, results) for chapter in chapters)
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
