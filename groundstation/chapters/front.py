"""Top of the report: which flight, its best answer, others as tiles, what is not assessed.

Of a plan: what is planned, and what its chapters say above all.
"""

from collections.abc import Sequence
from dataclasses import replace

from groundstation.base.failures import attempt
from groundstation.base.findings import worst
from groundstation.base.ledger import END_CUT
from groundstation.base.timescales import utc_ns_to_iso
from groundstation.base.words import capitalised
from groundstation.chapters.assessed import not_assessed
from groundstation.chapters.by_answer import answer_chapters, loss_above
from groundstation.chapters.chapter import Chapter, Chapters, Pairs
from groundstation.chapters.grades import legend
from groundstation.chapters.parts import Cell, Facts, Front, Mark, Note, Section, Tile
from groundstation.chapters.wording import ABSENT, clean, duration, typeset
from groundstation.results.flight import FlightResults, Status
from groundstation.results.recorded import recorded, simulated, wholeness

NOTES = ("note", "notes", "comment", "comments", "remark", "remarks")  # keys of what the head of a log says of itself
LONGEST_NOTE = 240
STATUS: dict[Status, Mark] = {
    "ok": Mark("good", "ok"),
    "degraded": Mark("warn", "degraded: data were lost"),
    "failed": Mark("bad", "failed: nothing could be computed"),
}
RECORDED = Mark("plain", "Recorded")
DAMAGED = Mark("warn", "Recorded")
DATA_LOST = Mark("bad", "Data lost")
OF_PLANS = {
    None: Mark("good", "Planned"),
    "info": Mark("good", "Planned"),
    "warn": Mark("warn", "Planned, with warnings"),
    "fail": Mark("bad", "No usable plan"),
}


def front(results: FlightResults, chapters: Chapters, answers: Sequence[Section] | None = None) -> Front:
    """Build the top of the report.

    ``answers`` are the chapters on the answers of a flight where they are built already.
    """
    top = _front(results, chapters, answers)
    words = legend(top.verdict, (tile.claim for tile in top.others))
    return replace(top, note=note_of_log(results), legend=words)


def note_of_log(results: FlightResults) -> str:
    """Return in a line that a simulator made the log, and what its head says of it."""
    texts = {key.lower(): clean(text).strip() for key, text in results.metadata.items()}
    told = simulated(results)
    for text in filter(None, (texts.get(key, "") for key in NOTES)):
        told = told if text in told else "; ".join(filter(None, (told, text)))
    return told if len(told) <= LONGEST_NOTE else f"{told[: LONGEST_NOTE - 4].rpartition(' ')[0]} ..."


def _front(results: FlightResults, chapters: Chapters, answers: Sequence[Section] | None) -> Front:
    if results.is_plan:
        return plan_front(results, _pairs_of_plan(results), chapters.plan)
    names = [results.metadata.get(key, "") for key in ("aircraft", "flight")]
    title = " · ".join(filter(None, (names[0], names[1] and f"flight {names[1]}"))) or results.flight_id
    if results.is_session:
        tops = (one.front(results, _pairs(results)) for one in chapters.session if one.front is not None)
        return next(tops, Front(title, _pairs(results), RECORDED, _told(recorded(results))))
    sections = answer_chapters(results, chapters) if answers is None else answers
    tiles = [Tile(one.title, one.key, one.claim) for one in sections if one.claim is not None]
    left_open = tuple((one.title, one.headline) for one in sections if one.is_open)
    pairs, missing = _pairs(results), (*left_open, *not_assessed(results, chapters))
    line = _told(recorded(results))
    if loss := loss_above(results, tiles[0].claim if tiles else None):
        return Front(title, pairs, DATA_LOST, _told(loss), others=tiles, missing=missing, recorded=line)
    if not tiles:
        mark = RECORDED if results.status == "ok" else DAMAGED
        return Front(title, pairs, mark, line, missing=missing)
    best, *others = tiles
    told = best.claim
    return Front(
        title,
        pairs,
        verdict=told.mark,
        headline=told.headline,
        sentences=told.sentences,
        figures=told.figures,
        to_sign=told.to_sign,
        subject=best.title,
        key=best.key,
        others=others,
        missing=missing,
        recorded=line,
    )


def _told(line: str) -> str:
    """Return a line with a capital and the signs of a page."""
    return typeset(capitalised(line))


def _pairs(results: FlightResults) -> tuple[tuple[str, Cell], ...]:
    start = "" if results.start_utc_ns is None else utc_ns_to_iso(results.start_utc_ns)
    return (
        ("Start", f"{start[:10]} {start[11:19]} UTC" if start else "no absolute time"),
        _duration(results),
        ("Status", _status(results)),
        ("Findings", _counts(results)),
        ("Log", results.source.name or ABSENT),
    )


def _pairs_of_plan(results: FlightResults) -> tuple[tuple[str, Cell], ...]:
    scenario = ("Scenario", results.source.name or ABSENT)
    return (
        ("Plan", results.metadata.get("plan", "") or ABSENT),
        _duration(results),
        ("Findings", _counts(results)),
        scenario,
    )


def _status(results: FlightResults) -> Mark:
    """Return the status; of a log whose end alone is lost, that it is."""
    mark = STATUS[results.status]
    if results.status != "degraded" or results.ledger.loss != END_CUT:
        return mark
    return Mark(mark.tone, f"degraded: {wholeness(results).partition(';')[0]}")


def _duration(results: FlightResults) -> tuple[str, str]:
    told = duration(results.duration_s)
    return "Duration", told if ":" not in told else f"{told} {'h:min:s' if told.count(':') > 1 else 'min:s'}"


def _counts(results: FlightResults) -> str:
    counts = [finding.severity for finding in results.findings]
    return " · ".join(f"{counts.count(name)} {name}" for name in ("fail", "warn", "info") if name in counts) or "none"


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
        verdict=OF_PLANS[worst(results.findings)],
        headline=sections[0].headline if sections else "",
        sentences=tuple(part.text for part in above if isinstance(part, Note)),
        figures=tuple(pair for part in above if isinstance(part, Facts) for pair in part.pairs),
    )
