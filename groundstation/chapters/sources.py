"""Chapter on the sources of the methods, once, by the names used in the other chapters."""

from groundstation.chapters.chapter import Chapters
from groundstation.chapters.parts import Facts, Section
from groundstation.results.flight import FlightResults

TITLE = "Sources"
LEAD = ""


def sources(results: FlightResults, chapters: Chapters) -> Section | None:
    """Return the chapter; None where no answer rests on a source."""
    cited = {chapter.name: chapter.sources for chapter in chapters.of(results)}
    named = dict.fromkeys(source for name in results.answers for source in cited.get(name, ()))
    if not named:
        return None
    return Section("sources", TITLE, LEAD, (Facts("", [(name, text, "") for name, text in named]),))
