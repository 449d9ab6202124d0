"""Chapter on what to fly, record and check next time.

It covers every answer that this flight could not give or not decide. Systems say what helps them; what helps any of
them stands here. A signal that the log has is not asked for.
"""

from collections.abc import Iterator

from groundstation.base.findings import CONTRADICTION
from groundstation.base.ledger import END_CUT
from groundstation.base.signals import topics_of_kind
from groundstation.base.words import capitalised, listed
from groundstation.chapters.chapter import Advice, Chapters, Remedies
from groundstation.chapters.held_signals import without_held
from groundstation.chapters.parts import Facts, Section
from groundstation.results.flight import FlightResults
from groundstation.results.recorded import unnamed_buses

TITLE = "What to do next"
LEAD = ""
LINES = ("Fly", "Record", "Check")
MOST_OF_A_LINE = 4
# By a part of the reason for which an analysis could not be carried out, whichever it is.
BY_REASON: Remedies = (
    ("expected at least 300 s", ("Fly", "5 min or more with INS and GNSS")),
    ("GNSS never had a fix", ("Check", "the GNSS antenna, its cable and its sky")),
    ("no GNSS velocity", ("Record", "GNSS velocity")),
    ("no GNSS position", ("Record", "GNSS position")),
)
# The same of what only an INS gives: of no use beside an inertial unit or a receiver without one.
BY_REASON_OF_AN_INS: Remedies = (
    ("no INS position", ("Record", "INS position")),
    ("no INS heading", ("Record", "INS heading")),
)
LOST = "the recorder: data were lost"
UNNAMED = "the buses with an ICD (run --icd FILE; info --suggest-icd drafts one)"
CUT = "that the log was copied whole: its end is cut off"


def next_steps(results: FlightResults, chapters: Chapters) -> Section | None:
    """Return the chapter in at most three lines; None where nothing is left to advise.

    The line that a danger asks for comes first.
    """
    lines: dict[str, dict[str, list[str]]] = {line: {} for line in LINES}
    withheld = [word for one in chapters.advisers for word in one.withheld(results)]
    danger = ""
    for line, text, purpose, _, is_danger in (without_held(one, results) for one in _advice(results, chapters)):
        if any(word in text for word in withheld):
            continue
        danger = danger or (line if is_danger else "")
        texts = lines[line]
        if text in texts and purpose not in texts[text]:
            texts[text].append(purpose)
        elif len(texts) < MOST_OF_A_LINE:
            texts.setdefault(text, [purpose])
    order = sorted(LINES, key=lambda line: line != danger)
    pairs = [(line, _told(lines[line]), "") for line in order if lines[line]]
    return Section("next", TITLE, LEAD, (Facts("", pairs),)) if pairs else None


def _told(texts: dict[str, list[str]]) -> str:
    """Return what is wanted, each once, grouped by its purposes; what is for all has none."""
    groups: dict[str, list[str]] = {}
    for text, purposes in texts.items():
        groups.setdefault("" if "" in purposes else listed([f"the {one}" for one in purposes]), []).append(text)
    told = "; ".join(f"for {who}: {', '.join(some)}" if who else ", ".join(some) for who, some in groups.items())
    return f"{capitalised(told)}."


def _advice(results: FlightResults, chapters: Chapters) -> Iterator[Advice]:
    """Yield the advice, the most pressing first."""
    if unnamed_buses(results.ledger):  # nobody knows what they lack
        yield Advice("Check", UNNAMED, "")
        yield from _on_loss(results)
        return
    given = [advice for one in chapters.advisers for advice in one.advise(results)]
    yield from (advice for advice in given if advice.is_danger)
    yield from (advice for advice in given if advice.is_pressing and not advice.is_danger)
    remedies = [*(remedy for one in chapters.advisers for remedy in one.remedies), *BY_REASON]
    if not results.ledger.topics or topics_of_kind("ins", tuple(results.ledger.topics)):
        remedies += BY_REASON_OF_AN_INS
    for one in results.not_assessable:
        purpose = chapters.titles.get(one.analysis, one.analysis)
        purpose = purpose if purpose.startswith("INS") else purpose[:1].lower() + purpose[1:]
        for part, (line, text) in remedies:
            if part in one.reason:
                yield Advice(line, text, purpose)
    for topic in dict.fromkeys(one.topic for one in results.findings if one.code == CONTRADICTION):
        yield Advice("Check", f"signs, units and axes of {topic}: they contradict each other, a profile turns them", "")
    yield from (advice for advice in given if not advice.is_pressing)
    yield from _on_loss(results)


def _on_loss(results: FlightResults) -> Iterator[Advice]:
    """Yield what to check of a log with losses; none where it ends in a record alone."""
    if results.status != "ok" and not results.ledger.is_in_midst:
        yield Advice("Check", CUT if results.ledger.loss == END_CUT else LOST, "")
