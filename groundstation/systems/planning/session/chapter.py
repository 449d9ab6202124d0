"""Chapter on how aircraft should move.

The laws of control side by side, and the commands of the recommended one.
"""

from collections.abc import Mapping

from groundstation.chapters.gates import setting_facts
from groundstation.chapters.parts import Cell, Facts, Figure, Grid, Head, Mark, Note, Part, Section
from groundstation.chapters.wording import is_number, number, percent, significant
from groundstation.results.flight import FlightResults
from groundstation.systems.planning.session.answer import UNCONTROLLED, ControlPlan, LawRow

TITLE = "Control of the session"
LEAD = (
    "How aircraft should move, within their bounds, for the accuracy of one of them: covariance of the centralised "
    "filter under each control law. Nothing is simulated and no measurement is used."
)
LAWS: Mapping[str, str] = {
    UNCONTROLLED: "No control",
    "determinant": "Largest det(H'H) at each step",
    "eigenvalue": "Largest least eigenvalue at each step",
    "dop": "Least dilution at each step",
    "covariance": "Least weighted variance at the end",
}
LAW_HEADS = (
    *(Head("Law"), Head("2σ north, m", True), Head("2σ east, m", True), Head("2σ up, m", True), Head("2σ_r, m", True)),
    *(Head("det(H'H)", True), Head("Least eigenvalue", True), Head("DOP", True), Head("Worst DOP", True)),
)
LAW_CAPTION = (
    "At the end of the interval; 2σ_r is twice the root of the summed variances north and east. det, eigenvalue and "
    "DOP are of the axes asked for."
)
SEARCH_HEADS = (
    *(Head("Law"), Head("Converged"), Head("Gain left", True), Head("Starts", True), Head("Starts apart", True)),
    *(Head("Iterations", True), Head("At a bound", True), Head("Nearest source, m", True)),
    Head("Nearest aircraft, m", True),
)
SEARCH_CAPTION = (
    "Gain left: the most that any control within the bounds can still gain to first order, over the loss (for a law "
    "of each step: in its worst step). Starts apart: worst start over the best. At a bound: share of all control "
    "values."
)
CONTROL_HEADS = (
    *(Head("Aircraft"), Head("Control"), Head("Unit"), Head("Start", True), Head("Low", True), Head("High", True)),
    *(Head("Largest change in 1 s", True), Head("At the end", True)),
)


def control(results: FlightResults) -> Section | None:
    """Return the chapter on control; None without an answer."""
    answer = results.answer(ControlPlan)
    if answer is None:
        return None
    parts: tuple[Part | None, ...] = (
        Figure("control.paths"),
        _laws(answer),
        Figure("control.measures"),
        _controls(answer),
        Figure("control.law") if answer.controls else None,
        _search(answer) if answer.controls else None,
        setting_facts(answer.settings),
    )
    shown = tuple(part for part in parts if part is not None)
    return Section("control", TITLE, LEAD, shown, _headline(answer), _above(answer))


def title_of(law: str) -> str:
    """Return the name of a law for people."""
    return LAWS.get(law, law)


def _headline(answer: ControlPlan) -> str:
    row = answer.law(answer.recommended)
    return f"{answer.judged}: 2σ north {number(row.two_sigma_north_m, 1, 'm')}, east {_east(row)} at the end"


def _east(row: LawRow) -> str:
    return number(row.two_sigma_east_m, 1, "m")


def _above(answer: ControlPlan) -> tuple[Part, ...]:
    best, before = answer.law(answer.recommended), answer.law(UNCONTROLLED)
    if best is before:
        return (Note("No aircraft may be controlled: this is the accuracy without control."),)
    who = ", ".join(dict.fromkeys(row.aircraft for row in answer.controls))
    told = f"{title_of(best.law)}: {who} controlled over {number(answer.duration_s, 0, 's')}."
    figures = (
        (
            "2σ north",
            number(best.two_sigma_north_m, 1, "m"),
            f"{number(before.two_sigma_north_m, 1, 'm')} uncontrolled",
        ),
        ("2σ east", _east(best), f"{_east(before)} uncontrolled"),
        ("Gain", f"{number(answer.gain, 2)} times", "ratio of weighted sigmas"),
        ("DOP at the end", number(best.dop, 2), f"{number(before.dop, 2)} uncontrolled"),
    )
    return Note(told), Facts("", figures)


def _laws(answer: ControlPlan) -> Grid:
    rows: list[tuple[Cell, ...]] = [
        (
            Mark("good" if row.law == answer.recommended else "plain", title_of(row.law)),
            *(number(getattr(row, f"two_sigma_{axis}_m"), 2) for axis in ("north", "east", "up", "r")),
            significant(row.determinant),
            significant(row.eigenvalue),
            *(number(value, 2) if is_number(value) else "none" for value in (row.dop, row.dop_worst)),
        )
        for row in answer.laws
    ]
    return Grid(f"Control laws, accuracy of {answer.judged}", LAW_HEADS, rows, LAW_CAPTION, ("control_measures",))


def _controls(answer: ControlPlan) -> Grid | None:
    rows: list[tuple[Cell, ...]] = [
        (
            *(row.aircraft, row.control, "m/s" if row.unit == "m/s" else "°"),
            *(number(value, 1) for value in (row.start, row.low, row.high, row.most_change_per_s, row.end)),
        )
        for row in answer.controls
    ]
    title = f"Controls and their bounds, {title_of(answer.recommended)[0].lower()}{title_of(answer.recommended)[1:]}"
    return Grid(title, CONTROL_HEADS, rows, numbers=("control_paths",)) if rows else None


def _search(answer: ControlPlan) -> Grid:
    rows = [
        (
            title_of(row.law),
            Mark("good" if row.has_converged else "warn", "yes" if row.has_converged else "no"),
            significant(row.gap, 2),
            number(row.starts, 0),
            percent(row.start_spread, 1),
            number(row.iterations, 0),
            percent(row.bounded_share),
            number(row.least_range_m, 0),
            number(row.least_separation_m, 0),
        )
        for row in answer.laws
        if row.law != UNCONTROLLED
    ]
    return Grid("How the laws were found", SEARCH_HEADS, rows, SEARCH_CAPTION)
