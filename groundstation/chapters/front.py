"""Top of the report: which flight, its best answer, others as tiles, what is not assessed."""

from groundstation.base.timescales import utc_ns_to_iso
from groundstation.chapters.assessed import not_assessed
from groundstation.chapters.by_answer import answer_chapters
from groundstation.chapters.chapter import Chapters
from groundstation.chapters.parts import Cell, Front, Mark, Tile
from groundstation.chapters.plan import plan_front
from groundstation.chapters.wording import ABSENT, clock, is_number, typeset
from groundstation.results.flight import FlightResults, Status
from groundstation.results.recorded import great_loss, recorded

HOUR_S = 3599.5  # rounds to an hour
STATUS: dict[Status, Mark] = {
    "ok": Mark("good", "ok"),
    "degraded": Mark("warn", "degraded: data were lost"),
    "failed": Mark("bad", "failed: nothing could be computed"),
}
RECORDED = Mark("plain", "Recorded")
DAMAGED = Mark("warn", "Recorded")
DATA_LOST = Mark("bad", "Data lost")


def front(results: FlightResults, chapters: Chapters) -> Front:
    """The top of the report."""
    if results.is_plan:
        return plan_front(results, _pairs_of_plan(results), chapters.plan)
    names = [results.metadata.get(key, "") for key in ("aircraft", "flight")]
    title = " · ".join(filter(None, (names[0], names[1] and f"flight {names[1]}"))) or results.flight_id
    if results.is_session:
        tops = (one.front(results, _pairs(results)) for one in chapters.session if one.front is not None)
        return next(tops, Front(title, _pairs(results), RECORDED, _told(recorded(results))))
    sections = answer_chapters(results, chapters)
    tiles = [Tile(one.title, one.key, one.claim) for one in sections if one.claim is not None]
    left_open = tuple((one.title, one.headline) for one in sections if one.is_open)
    pairs, missing = _pairs(results), (*left_open, *not_assessed(results, chapters))
    line, loss = _told(recorded(results)), great_loss(results)
    if loss and not (tiles and tiles[0].claim.is_danger):
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
    return typeset(f"{line[:1].upper()}{line[1:]}")


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
