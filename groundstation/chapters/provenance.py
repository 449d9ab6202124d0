"""Chapter on where the numbers come from, and that on the sources of the methods.

Time of run, host and versions stand in manifest.json alone.
"""

from groundstation.chapters.chapter import Chapters
from groundstation.chapters.parts import Facts, Note, Part, Section
from groundstation.chapters.wording import ABSENT, clean, number
from groundstation.results.flight import FlightResults, Source

LONG_LISTS = ("parameter.", "units.", "together")  # of autopilot logs, hundreds of them; a chapter tells the last
TOLD = ("derived.", "vehicle.", "phases.", "altitude.")  # by a finding, by the overview
ON_TOP = ("aircraft", "flight", "start_utc")  # of the page
MOST_METADATA = 8
REST = "More metadata in summary.json."
CHECKS = (
    "All numbers and settings are in summary.json and tables/*.csv; this report lists only settings that were set. "
    "Versions and configuration are in manifest.json."
)


def provenance(results: FlightResults) -> Section:
    """Return the chapter."""
    flight_id = clean(results.flight_id)
    if results.is_plan:
        store = ("Scenario as given", "plan.toml", "the file that this plan was made from")
    elif results.is_session:
        store = ("Lossless stores", "manifest.json", "names the MCAP of every log")
    else:
        store = ("Lossless store", f"{flight_id}.mcap", "every topic of the log")
    pairs = (
        *source_pairs(results.source, "scenario" if results.is_plan else "log"),
        ("Recording", f"{flight_id}.rrd", "open with: groundstation view"),
        store,
    )
    parts: list[Part] = [Facts("Source and files", pairs)]
    if results.metadata:
        listed = sorted(results.metadata.items())
        own = [pair for pair in listed if not pair[0].startswith((*LONG_LISTS, *TOLD)) and pair[0] not in ON_TOP]
        rows = [(key, value, "") for key, value in own[:MOST_METADATA]]
        if rows:
            parts.append(Facts("Title and kind" if results.is_plan else "Metadata of the log", rows))
        if len(rows) < len(own) or any(key.startswith(LONG_LISTS) for key, _ in listed):
            parts.append(Note(REST))
    parts.append(Note(CHECKS))
    return Section("provenance", "Provenance", "", parts)


def source_pairs(source: Source, what: str = "log") -> tuple[tuple[str, str, str], ...]:
    """Return the log a flight came from, or the scenario of a plan."""
    return (
        (what.capitalize(), source.name or ABSENT, f"{number(source.size_bytes, 0)} bytes"),
        (f"SHA-256 of the {what}", source.sha256 or ABSENT, ""),
        ("Read by", source.reader or ABSENT, ""),
    )


def sources(results: FlightResults, chapters: Chapters) -> Section | None:
    """Return the chapter on the sources of the methods.

    Each is told once, by the name used in the other chapters. None where no answer rests on a source.
    """
    cited = {chapter.name: chapter.sources for chapter in chapters.of(results)}
    named = dict.fromkeys(source for name in results.answers for source in cited.get(name, ()))
    if not named:
        return None
    return Section("sources", "Sources", "", (Facts("", [(name, text, "") for name, text in named]),))
