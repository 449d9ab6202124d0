"""Chapter on latency: how much later than the INS each sensor shows the same motion."""

from groundstation.chapters.agreement import agreement_note
from groundstation.chapters.assessed import without_answer
from groundstation.chapters.parts import Claim, Facts, Figure, Grid, Head, Mark, Part, Rank, Section, kept
from groundstation.chapters.wording import interval, number, significant, typeset
from groundstation.results.flight import FlightResults
from groundstation.systems.latency.agreement_answer import latency_agreement, trajectory_agreement
from groundstation.systems.latency.answer import Latencies, Latency

TITLE = "Latency between sensors"
LEAD = "How much later than the INS each sensor shows the same motion."
HEADS = (
    *(Head("Sensor"), Head("Quantity"), Head("State"), Head("Latency, s", True), Head("95 % interval", True)),
    *(Head("Windows", True), Head("Motion in 1 s / residual, RMS", True), Head("Basis, or why not")),
)
CAPTION = "Windows: degrees of freedom of the interval, of the windows used."


def latency(results: FlightResults) -> Section | None:
    """Return the chapter; None when the flight was not assessed and no reason is known."""
    answer = results.answer(Latencies)
    if answer is None or not answer.rows:
        return without_answer(results, "latency", TITLE, LEAD)
    table = Grid("Latencies", HEADS, [_row(row) for row in answer.rows], CAPTION, ("latency_search",))
    told = _claim(answer)
    of = ", ".join(dict.fromkeys(row.other for row in answer.rows))
    headline = f"not observable for {of}: too little motion" if told is None else told.headline
    if told is None:
        unseen = [
            (f"{row.other} {row.quantity} against {row.reference}", typeset(row.reason), "") for row in answer.rows
        ]
        parts: tuple[Part, ...] = (Facts("Not observable", unseen), Figure("latency.search"))
        return Section("latency", TITLE, LEAD, parts, headline, is_open=True)
    twice = agreement_note(latency_agreement(results.answers))
    thrice = agreement_note(trajectory_agreement(results.answers))
    shown = kept((twice, thrice, table, Figure("latency.search")))
    return Section("latency", TITLE, LEAD, shown, headline, claim=told)


def _claim(answer: Latencies) -> Claim | None:
    seen = [row for row in answer.rows if row.state == "observed"]
    if not seen:
        return None
    first = seen[0]
    value = number(first.latency_s, 3, "s", signed=True)
    what = f"{first.other} {first.quantity} against {first.reference}"
    figures = tuple(
        (
            f"{row.other} {row.quantity}",
            number(row.latency_s, 3, "s", signed=True),
            f"95 % {interval(row.confidence95_s, 3, 's')}",
        )
        for row in seen
    )
    sense = "later than" if (first.latency_s or 0.0) >= 0.0 else "earlier than"
    size = number(abs(first.latency_s or 0.0), 3, "s")
    headline = f"{first.other} {first.quantity} is {size} {sense} {first.reference}"
    return Claim(Rank.LATENCY, Mark("good", "Measured"), headline, value, what, (), figures)


def _row(row: Latency) -> tuple[str | Mark, ...]:
    return (
        f"{row.other} against {row.reference}",
        row.quantity,
        Mark("good", "observed") if row.state == "observed" else Mark("unknown", "not observable"),
        number(row.latency_s, 3, signed=True),
        interval(row.confidence95_s, 3, "s"),
        f"{number(row.effective_windows, 1)} of {number(row.windows, 0)}",
        f"{significant(row.motion)} / {significant(row.residual)} {row.unit}",
        typeset(row.reason),
    )
