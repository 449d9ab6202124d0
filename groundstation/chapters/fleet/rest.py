"""Chapters: outliers, what is not in the fleet and why, how the figures were computed."""

from collections.abc import Callable

from groundstation.chapters.fleet.common import aircraft_name, figure_of, title_of
from groundstation.chapters.parts import Facts, Grid, Head, Mark, Note, Section
from groundstation.chapters.wording import ABSENT, number, percent, significant, words
from groundstation.results.fleet import FleetResults

KINDS = {"failed": Mark("bad", "failed"), "skipped": Mark("plain", "skipped")}
STATED: dict[str, tuple[str, Callable[[float], str]]] = {
    "confidence": ("Confidence of the intervals", percent),
    "false_change_per_aircraft": ("Chance that a steady aircraft shows a change", lambda value: percent(value, 1)),
    "outside_limits_per_flight": ("Chance that a steady flight is outside the limits", lambda value: percent(value, 2)),
    "any_false_outlier_in_the_fleet": ("Chance that a clean fleet has any outlier", percent),
    "fewest_flights_for_a_trend": ("Fewest flights for a trend", lambda value: number(value, 0)),
    "fewest_flights_for_outliers": ("Fewest flights for outliers", lambda value: number(value, 0)),
}


def outliers(fleet: FleetResults) -> Section:
    """Build the chapter on outliers, the farthest first."""
    lead = "Flights with a figure far from those of the same aircraft. They are listed, not removed."
    if not fleet.outliers:
        fewest = fleet.stated.get("fewest_flights_for_outliers")
        needed = "" if fewest is None else f" Only aircraft with at least {number(fewest, 0)} flights are judged."
        return Section("outliers", "Outliers", lead, (Note(f"No outlier.{needed}"),))
    heads = (
        *(Head("Flight"), Head("Aircraft"), Head("Quantity"), Head("Value", True)),
        *(Head("Usual for it", True), Head("Robust σ", True)),
    )
    rows = [
        (
            *(one.flight_id, aircraft_name(one.aircraft), title_of(one.quantity)),
            *(figure_of(one.quantity, value) for value in (one.value, one.typical)),
            number(one.z, 1, signed=True),
        )
        for one in sorted(fleet.outliers, key=lambda one: -abs(one.z))
    ]
    caption = (
        "Usual: median of the aircraft; robust σ: distance from it, for positive figures on a logarithmic scale. The "
        "farthest first."
    )
    return Section("outliers", "Outliers", lead, (Grid("Outliers", heads, rows, caption),))


def not_in_fleet(fleet: FleetResults) -> Section:
    """Build the chapter on logs that gave no flight."""
    title, lead = "Not in the fleet", "Logs that gave no flight, and flights that cannot be read, with the reason."
    if not fleet.not_in_fleet:
        return Section("missing", title, lead, (Note("Every log gave a flight.", "good"),))
    rows = [(KINDS[one.kind], one.source or ABSENT, one.reason) for one in fleet.not_in_fleet]
    return Section("missing", title, lead, (Grid("Logs", (Head("State"), Head("Log"), Head("Reason")), rows),))


def method(fleet: FleetResults) -> Section:
    """Build the chapter on how the figures were computed."""
    definitions = (
        (
            "Heading error",
            "INS heading − true heading",
            "of a sample: INS heading − GNSS track; the value to enter is its negative",
        ),
        ("Merging", "n, mean and sum of squares", "Chan, Golub, LeVeque (1983), never means of means"),
        ("Mean of an aircraft", "random effects, Student", "each flight counts as one; Hedges (1983)"),
        (
            "Change of level",
            "ranks, split in two repeatedly",
            "Pettitt (1979), Scott and Knott (1974); p from random orders",
        ),
        ("Slope", "median over all pairs", "Theil (1950), Sen (1968); called where a line explains a change as well"),
        ("Control limits", "level ± L σ", "σ from the median of successive differences; L is 3 for a long series"),
        ("Outlier", "value − median over 1.4826 MAD", "one limit for the whole fleet (Bonferroni)"),
        ("Share inside", "exact interval", "Clopper and Pearson (1934)"),
    )
    stated = [(label, write(fleet.stated[name]), "") for name, (label, write) in STATED.items() if name in fleet.stated]
    stated += [(words(name), significant(value), "") for name, value in fleet.stated.items() if name not in STATED]
    note = Note(
        "Every figure comes from the saved results of the flights; fleet.parquet holds a row for each flight, "
        "samples.parquet the samples. Equal results give this report byte for byte."
    )
    parts = (Facts("Definitions", definitions), Facts("Rates and limits used", stated), note)
    return Section("method", "How it was computed", "What the words mean, and how often the tests are wrong.", parts)
