"""Chapter on where ground points should stand.

Designs side by side, places, and the cost of losing a point.
"""

from collections.abc import Mapping

from groundstation.chapters.gates import setting_facts
from groundstation.chapters.parts import Cell, Facts, Figure, Grid, Head, Mark, Note, Part, Section
from groundstation.chapters.wording import ABSENT, is_number, number, percent, significant
from groundstation.results.flight import FlightResults
from groundstation.systems.planning.session.placement_answer import GIVEN, PlacementPlan

TITLE = "Placement of ground points"
LEAD = (
    "Where ground points should stand for the accuracy of an aircraft on a given path: by the geometry at one point "
    "of the path, and by the covariance of the filter along it."
)
CRITERIA: Mapping[str, str] = {
    "determinant": "Largest det(H'H)",
    "eigenvalue": "Largest least eigenvalue",
    "dop": "Least dilution",
    "covariance": "Least weighted variance",
}
OVERS: Mapping[str, str] = {"fixed": "fixed point", "way": "worst point of the path", "lost": "one point lost"}
DESIGN_HEADS = (
    *(Head("Design"), Head("det(H'H)", True), Head("DOP", True), Head("2σ north, m", True), Head("2σ east, m", True)),
    *(Head("2σ up, m", True), Head("Worst north, m", True), Head("Worst east, m", True), Head("Worst up, m", True)),
)
DESIGN_CAPTION = (
    "det(H'H), DOP and 2σ at the fixed point, 2σ of the filter when it arrives there; worst: largest 2σ over the part "
    "of the path that counts."
)
PLACE_HEADS = (
    *(Head("Point"), Head("North, m", True), Head("East, m", True), Head("Height, m", True), Head("Placed")),
    *(Head("To keep-out area, m", True), Head("Below the path, m", True)),
)
LOST_HEADS = (
    *(Head("Design"), Head("Lost"), Head("2σ north, m", True), Head("2σ east, m", True), Head("2σ up, m", True)),
)
SEARCH_HEADS = (
    *(Head("Design"), Head("Converged"), Head("Gain left", True), Head("Starts", True), Head("Starts apart", True)),
    *(Head("Iterations", True), Head("Evaluations", True)),
)
SEARCH_CAPTION = (
    "Gain left: first-order gain within a hundredth of the rectangle, over the loss. Starts apart: worst over best."
)


def placement(results: FlightResults) -> Section | None:
    """Return the chapter; None without an answer."""
    answer = results.answer(PlacementPlan)
    if answer is None:
        return None
    parts: tuple[Part | None, ...] = (
        Figure("placement.map"),
        _places(answer),
        _designs(answer),
        Figure("placement.accuracy"),
        _lost(answer),
        _search(answer),
        setting_facts(answer.settings),
    )
    shown = tuple(part for part in parts if part is not None)
    return Section("placement", TITLE, LEAD, shown, _headline(answer), _above(answer))


def design_title(design: str) -> str:
    """Return the name of a design for people.

    Examples
    --------
    >>> design_title("determinant_fixed"), design_title("given")
    ("Largest det(H'H), fixed point", 'As given')
    """
    criterion, _, over = design.partition("_")
    return "As given" if design == GIVEN else f"{CRITERIA.get(criterion, criterion)}, {OVERS.get(over, over)}"


def _headline(answer: PlacementPlan) -> str:
    placed = [row for row in answer.places_of(answer.recommended) if row.is_placed]
    where = ", ".join(f"{row.point} {number(row.north_m, 0)} / {number(row.east_m, 0)}" for row in placed)
    return f"North / east, m: {where}"


def _above(answer: PlacementPlan) -> tuple[Part, ...]:
    best, given = answer.design(answer.recommended), answer.design(GIVEN)
    at = f"north {number(answer.fixed_north_m, 0, 'm')}, height {number(answer.fixed_height_m, 0, 'm')}"
    told = f"{design_title(best.design)}, for {answer.judged}; fixed point: {at}."
    figures = tuple(
        (
            f"2σ {axis}, fixed point",
            number(getattr(best, f"two_sigma_{axis}_m"), 1, "m"),
            f"{number(getattr(given, f'two_sigma_{axis}_m'), 1, 'm')} as given",
        )
        for axis in ("north", "east", "up")
    )
    return Note(told), Facts("", (*figures, ("DOP", _dop(best.dop), f"{_dop(given.dop)} as given")))


def _dop(value: float) -> str:
    return number(value, 2) if is_number(value) else "none"


def _designs(answer: PlacementPlan) -> Grid:
    rows: list[tuple[Cell, ...]] = [
        (
            Mark("good" if row.design == answer.recommended else "plain", design_title(row.design)),
            significant(row.determinant),
            _dop(row.dop),
            *(number(getattr(row, f"two_sigma_{axis}_m"), 1) for axis in ("north", "east", "up")),
            *(number(getattr(row, f"worst_two_sigma_{axis}_m"), 1) for axis in ("north", "east", "up")),
        )
        for row in answer.designs
    ]
    return Grid("Designs", DESIGN_HEADS, rows, DESIGN_CAPTION, ("placement_accuracy",))


def _places(answer: PlacementPlan) -> Grid:
    rows: list[tuple[Cell, ...]] = [
        (
            row.point,
            *(number(value, 1) for value in (row.north_m, row.east_m, row.height_m)),
            "yes" if row.is_placed else "no",
            number(row.keep_out_distance_m, 0),
            number(row.below_way_m, 0),
        )
        for row in answer.places_of(answer.recommended)
    ]
    title = f"Places: {design_title(answer.recommended)}"
    return Grid(title, PLACE_HEADS, rows, numbers=("placement_points",))


def _lost(answer: PlacementPlan) -> Grid | None:
    rows: list[tuple[Cell, ...]] = [
        (
            design_title(row.design),
            row.lost,
            *(number(getattr(row, f"lost_two_sigma_{axis}_m"), 1) for axis in ("north", "east", "up")),
        )
        for row in answer.designs
        if row.lost
    ]
    caption = "At the fixed point, without the ground point whose loss costs most."
    return Grid("One point lost", LOST_HEADS, rows, caption) if rows else None


def _search(answer: PlacementPlan) -> Grid:
    rows: list[tuple[Cell, ...]] = [
        (
            design_title(row.design),
            Mark("good" if row.has_converged else "warn", "yes" if row.has_converged else "no"),
            significant(row.gap, 2),
            number(row.starts, 0),
            percent(row.start_spread, 1) if row.starts > 1 else ABSENT,
            number(row.iterations, 0),
            number(row.evaluations, 0),
        )
        for row in answer.designs
        if row.design != GIVEN
    ]
    return Grid("How the places were found", SEARCH_HEADS, rows, SEARCH_CAPTION)
