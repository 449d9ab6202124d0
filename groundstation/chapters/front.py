"""Top of the report: which flight, its best answer, others as tiles, what is not assessed."""

from groundstation.base.signals import RAW_PREFIX
from groundstation.base.timescales import utc_ns_to_iso
from groundstation.chapters.assessed import not_assessed
from groundstation.chapters.by_answer import answer_chapters
from groundstation.chapters.chapter import Chapters
from groundstation.chapters.parts import Cell, Front, Mark, Tile
from groundstation.chapters.plan import plan_front
from groundstation.chapters.wording import ABSENT, clock, is_number
from groundstation.results.flight import FlightResults, Status

HOUR_S = 3599.5  # rounds to an hour
STATUS: dict[Status, Mark] = {
    "ok": Mark("good", "ok"),
    "degraded": Mark("warn", "degraded: data were lost"),
    "failed": Mark("bad", "failed: nothing could be computed"),
}
NO_ANSWER = Mark("unknown", "No answer")
NOTHING = "Recorded, but nothing could be assessed"


def front(results: FlightResults, chapters: Chapters) -> Front:
    """The top of the report."""
    if results.is_plan:
        return plan_front(results, _pairs_of_plan(results), chapters.plan)
    names = [results.metadata.get(key, "") for key in ("aircraft", "flight")]
    title = " · ".join(filter(None, (names[0], names[1] and f"flight {names[1]}"))) or results.flight_id
    if results.is_session:
        tops = (one.front(results, _pairs(results)) for one in chapters.session if one.front is not None)
        return next(tops, Front(title, _pairs(results), NO_ANSWER, NOTHING))
    sections = answer_chapters(results, chapters)
    tiles = [Tile(one.title, one.key, one.claim) for one in sections if one.claim is not None]
    left_open = tuple((one.title, one.headline) for one in sections if one.is_open)
    pairs, missing = _pairs(results), (*left_open, *not_assessed(results, chapters))
    if not tiles:
        return Front(title, pairs, NO_ANSWER, NOTHING, _recorded(results), missing=missing)
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
    )


def _recorded(results: FlightResults) -> tuple[str, ...]:
    """Return a sentence that names the topics of the log, except raw data; none without any."""
    topics = sorted(topic for topic in results.completeness if not topic.startswith(RAW_PREFIX))
    return (f"In the log: {', '.join(topics)}.",) if topics else ()


def _pairs(results: FlightResults) -> tuple[tuple[str, Cell], ...]:
    start = "" if results.start_utc_ns is None else utc_ns_to_iso(results.start_utc_ns)
    return (
        ("Start", f"{start[:10]} {start[11:19]} UTC" if start else "no absolute time"),
        _duration(results),
        ("Status", STATUS[results.status]),
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


def _duration(results: FlightResults) -> tuple[str, str]:
    has_hours = is_number(results.duration_s) and results.duration_s >= HOUR_S
    return "Duration", f"{clock(results.duration_s)} {'h:min:s' if has_hours else 'min:s'}"


def _counts(results: FlightResults) -> str:
    counts = [finding.severity for finding in results.findings]
    return " · ".join(f"{counts.count(name)} {name}" for name in ("fail", "warn", "info") if name in counts) or "none"
