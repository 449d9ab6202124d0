"""Tables of the best trajectory: parameters, noise, raised sigmas, forward filter."""

from groundstation.base.quantiles import NORMAL_95
from groundstation.base.words import capitalised, places_of
from groundstation.chapters.parts import Cell, Grid, Head, Mark
from groundstation.chapters.wording import ABSENT, clock, number, number_with_unit, significant, typeset
from groundstation.systems.trajectory.answer import TRAVEL, BestTrajectory, TrajectoryParameter
from groundstation.systems.trajectory.claim_chapter import unit_sign_of


def parameters(answer: BestTrajectory) -> Grid | None:
    """Return the parameters that were found; None without any."""
    if not answer.parameters:
        return None
    heads = (
        *(Head("Parameter"), Head("Value, ± 95 %", True), Head("Assumed at first, 95 %", True)),
        Head("Observable"),
    )
    caption = "Values at the end of the log, in the axes of the body."
    if any(not one.is_observable and not one.is_far for one in answer.parameters):
        caption += " Not observable: the log hardly narrows what was assumed, and no value is told."
    if any(one.is_far for one in answer.parameters):
        caption += (
            " Not by itself: the log asks for more than was assumed and hardly narrows it. It shows a sum with others, "
            "such as scale and bias of one axis: do not use the value alone."
        )
    if any(one.name in TRAVEL for one in answer.parameters):
        caption += " Travel in the unit: direction in which the vehicle goes straight on, right and up of the unit."
    return Grid("Parameters found", heads, [_parameter(one) for one in answer.parameters], caption)


def _parameter(row: TrajectoryParameter) -> tuple[Cell, ...]:
    mark = Mark("good", "yes") if row.is_observable else Mark("unknown", "no")
    mark = Mark("warn", "not by itself") if row.is_far else mark
    is_told = row.is_observable or row.is_far
    value = _signed(row.value, NORMAL_95 * row.sigma, row.unit) if is_told else ABSENT
    return capitalised(row.name), value, f"± {with_unit(NORMAL_95 * row.start_sigma, row.unit)}", mark


def noise(answer: BestTrajectory) -> Grid | None:
    """Return the noise fitted to the log; None without any."""
    if not answer.noise:
        return None
    heads = (Head("Noise"), Head("Of its class", True), Head("Fitted", True), Head("Bound"))
    rows: list[tuple[Cell, ...]] = [
        (
            capitalised(one.name),
            with_unit(one.prior, one.unit, 3),
            with_unit(one.fitted, one.unit, 3),
            Mark("warn", "at its bound") if one.is_at_bound else "",
        )
        for one in answer.noise
    ]
    return Grid("Noise of the model", heads, rows, "Fitted to this log by likelihood, within the bounds of the class.")


def raised(answer: BestTrajectory) -> Grid | None:
    """Return the sigmas that were raised, and why; None without any."""
    if not answer.raised:
        return None
    heads = (Head("Sigma"), Head("Raised by", True), Head("Why"))
    rows = [(capitalised(one.name), number(one.factor, 2), typeset(one.reason)) for one in answer.raised]
    return Grid("Sigmas raised", heads, rows, "They are never lowered.")


def separation(answer: BestTrajectory) -> Grid | None:
    """Return how far the forward filter was off the smoothed solution; None without figures."""
    if not answer.separation:
        return None
    heads = (Head("Quantity"), Head("RMS", True), Head("Worst", True), Head("At", True))
    rows = [
        (capitalised(one.quantity), with_unit(one.rms, one.unit), with_unit(one.worst, one.unit), clock(one.worst_s))
        for one in answer.separation
    ]
    return Grid("Forward filter against smoothed solution", heads, rows, "", ("trajectory_separation",))


def with_unit(value: float | None, unit: str, digits: int = 2) -> str:
    """Return a value to a number of significant digits, with its unit."""
    return number_with_unit(significant(value, digits), unit_sign_of(unit))


def _signed(value: float, half: float, unit: str) -> str:
    places = places_of(half)
    return number_with_unit(f"{number(value, places)} ± {number(half, places)}", unit_sign_of(unit))
