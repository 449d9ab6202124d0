"""Page on the share of unstable approaches: by runway, by aircraft, approach by approach."""

from groundstation.chapters.parts import Cell, Document, Front, Grid, Head, Mark, Note, Section, Tone
from groundstation.chapters.wording import ABSENT, clean, number, percent, plural, typeset
from groundstation.systems.landing.unstable_answer import Decision, UnstableApproaches, UnstableShare

MARKS: dict[Decision, Mark] = {
    "pass": Mark("good", "Pass"),
    "fail": Mark("bad", "Fail"),
    "not enough flights": Mark("warn", "Not enough flights"),
    "not flown": Mark("unknown", "Not flown"),
    "no limit": Mark("unknown", "No limit"),
}
TONES: dict[str, Tone] = {"stabilised": "good", "not stabilised": "warn", "": "unknown"}
KIND = "Approaches against a standard"
MOST_LISTED = 200


def document(found: UnstableApproaches) -> Document:
    """Put the page together."""
    shares = Section("shares", "Unstable approaches", _lead(found), (_table(found), Note(_caution(found))))
    rows = Section("approaches", "Approaches", "Each approach under the standard.", (_rows(found),))
    left_out = [Note(typeset(one)) for one in found.left_out[:MOST_LISTED]]
    out = (Section("left_out", "Flights left out", "", left_out),) if left_out else ()
    return Document(KIND, f"{KIND} {found.name}", front(found), (shares, rows, *out))


def front(found: UnstableApproaches) -> Front:
    """Return the top of the page: the share of all approaches and the decision."""
    whole = found.shares[0]
    pairs: tuple[tuple[str, Cell], ...] = (
        ("Flights", number(found.flights, 0)),
        ("Approaches judged", f"{number(whole.judged, 0)} of {number(len(found.approaches), 0)}"),
        ("Standard", f"{clean(found.name)}, SHA-256 {found.sha256[:16]}"),
        ("groundstation", found.version),
    )
    return Front(
        clean(found.title),
        pairs,
        verdict=MARKS[found.decision],
        headline=line(found),
        sentences=tuple(filter(None, (clean(found.source),))),
    )


def line(found: UnstableApproaches) -> str:
    """Return the share of all approaches in a line."""
    whole = found.shares[0]
    if not whole.judged:
        return "No approach can be judged"
    limit = f", at most {percent(found.share_at_most)} wanted" if found.share_at_most is not None else ""
    return (
        f"{number(whole.unstable, 0)} of {plural(whole.judged, 'approach', 'approaches')} unstable from "
        f"{number(found.height_m, 0, 'm')} down: {_interval(whole)}{limit}"
    )


def _lead(found: UnstableApproaches) -> str:
    return f"How many approaches were not stabilised from {number(found.height_m, 0, 'm')} down, and where?"


def _interval(one: UnstableShare) -> str:
    return f"{percent(one.share)} ({percent(one.low)} … {percent(one.high)})" if one.judged else ABSENT


def _table(found: UnstableApproaches) -> Grid:
    heads = (
        *(Head("By"), Head("Name")),
        *(Head("Approaches", True), Head("Unstable", True), Head("Of these gone around", True)),
        *(Head("Share", True), Head("Interval", True)),
    )
    rows = [
        (
            one.group,
            typeset(one.name),
            *(number(count, 0) for count in (one.judged, one.unstable, one.gone_around)),
            percent(one.share) if one.judged else ABSENT,
            f"{percent(one.low)} … {percent(one.high)}" if one.judged else ABSENT,
        )
        for one in found.shares
    ]
    caption = f"Interval: Wilson (1927), {percent(found.confidence)}; approaches taken as independent."
    return Grid("Share of unstable approaches", heads, rows, caption)


def _caution(found: UnstableApproaches) -> str:
    return (
        "An approach counts as stabilised if it broke none of the criteria that its log has: logs with fewer channels "
        "look better. Compare runways and aircraft by logs of one kind."
    )


def _rows(found: UnstableApproaches) -> Grid:
    heads = (
        *(Head("Flight"), Head("Aircraft"), Head("Runway"), Head("Approach", True), Head("Outcome")),
        *(Head("Verdict"), Head("Not met, or why not judged")),
    )
    listed = sorted(found.approaches, key=lambda one: (one.verdict != "not stabilised", one.flight_id, one.number))
    rows = [
        (
            typeset(one.flight_id),
            typeset(one.aircraft),
            typeset(one.runway),
            number(one.number, 0),
            one.outcome,
            Mark(TONES[one.verdict], one.verdict or "not measured"),
            typeset(one.reason),
        )
        for one in listed[:MOST_LISTED]
    ]
    more = len(listed) - MOST_LISTED
    return Grid("Approaches", heads, rows, f"{number(more, 0)} more are in the table of the CSV." if more > 0 else "")
