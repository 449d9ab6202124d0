"""Chapter: latency between sensors: how much later than the INS each shows the same motion."""

from groundstation.chapters.assessed import without_answer
from groundstation.chapters.parts import Figure, Grid, Head, Mark, Section
from groundstation.chapters.wording import interval, number, significant, typeset
from groundstation.results.flight import FlightResults
from groundstation.results.latency import Latencies, Latency

TITLE = "Latency between sensors"
LEAD = (
    "How much later than the INS each sensor shows the same motion, by the time stamps of the log: positive is later. "
    "Estimated from ordinary motion; straight and level flight shows nothing of it."
)
HEADS = (
    *(Head("Sensor"), Head("Quantity"), Head("State"), Head("Latency, s", True), Head("95 % interval", True)),
    *(Head("Windows", True), Head("Motion in 1 s / left, RMS", True), Head("What it rests on, or why not")),
)
CAPTION = "Windows: degrees of freedom of the interval, of the windows used; motion slower than a window is taken away."


def latency(results: FlightResults) -> Section | None:
    """The chapter; None when the flight was not assessed and no reason is known."""
    answer = results.answer(Latencies)
    if answer is None or not answer.rows:
        return without_answer(results, "latency", TITLE, LEAD)
    table = Grid("Latencies", HEADS, [_row(row) for row in answer.rows], CAPTION, ("latency_search",))
    return Section("latency", TITLE, LEAD, (table, Figure("latency.search")))


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
