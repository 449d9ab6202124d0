"""Chapter on landing by ranges.

Accuracy along the path against the categories, and how honest the filter is.
"""

from groundstation.chapters.gates import setting_facts
from groundstation.chapters.parts import Cell, Facts, Figure, Grid, Head, Mark, Note, Part, Section
from groundstation.chapters.wording import ABSENT, number, sentence
from groundstation.results.flight import FlightResults
from groundstation.results.landing_categories import CATEGORIES
from groundstation.systems.planning.landing.answer import (
    ALL_AXES,
    TOUCHDOWN,
    WHITE,
    AccuracyRow,
    RangeLanding,
    ReferencePointRow,
    TrialRow,
)

TITLE = "Landing by ranges"
LEAD = (
    "Accuracy of an approach by ranges to reference points along the glide path: covariance of its filter on the true "
    "path, compared with the accuracy of the categories and with errors of simulated approaches."
)
POINT_HEADS = (
    Head("Reference point"),
    *(Head(title, True) for title in ("Before the threshold, m", "Right, m", "Up, m")),
)
ROW_HEADS = (
    Head("Place"),
    *(Head(title, True) for title in ("Before the threshold, m", "Height, m", "σ along, m", "σ right, m", "σ up, m")),
    *(Head(title, True) for title in ("Lateral 95 %, m", "Horizontal 95 %, m", "Vertical 95 %, m")),
    Head("Accuracy met"),
)
ROW_CAPTION = (
    "Lateral and vertical: 1.96 σ of one axis; horizontal: the radius that holds 95 %. Accuracy met: the most "
    "demanding category whose horizontal and vertical figures are met."
)
CATEGORY_HEADS = (
    *(Head("Category"), Head("Horizontal 95 %, m", True), Head("Vertical 95 %, m", True)),
    *(Head("Met in all axes, m before the threshold"), Head("Laterally"), Head("Vertically")),
)
CATEGORY_CAPTION = (
    "After ICAO, as Satellite Navigation 2020 lists it (doi 10.1186/s43020-020-00010-2). Rows of CAT II and III are "
    "ILS look-alike values. CAT I allows 4 to 6 m vertically: 6 m is used."
)
TRIAL_HEADS = (
    *(Head("Range errors"), Head("Before the threshold, m", True), Head("NEES (95 % limits)", True)),
    *(Head("RMS right, m", True), Head("RMS up, m", True), Head("RMS over σ right", True)),
    *(Head("RMS over σ up", True), Head("Filter")),
)
TRIAL_CAPTION = (
    "NEES: squared position error over its computed covariance, 3 is honest; limits for this number of independent "
    "approaches. Errors are drawn from the model that the scenario states."
)


def landing_ranges(results: FlightResults) -> Section | None:
    """Return the chapter; None without an answer."""
    answer = results.answer(RangeLanding)
    if answer is None:
        return None
    parts: tuple[Part | None, ...] = (
        Figure("landing_ranges.space"),
        Grid("Reference points", POINT_HEADS, [_point(row) for row in answer.points], "Moving: at the start."),
        Figure("landing_ranges.accuracy"),
        Grid("Accuracy", ROW_HEADS, [_row(row) for row in answer.rows], ROW_CAPTION, ("landing_ranges_path",)),
        _categories(answer),
        Figure("landing_ranges.trials"),
        _trials(answer),
        *(Note(sentence(remark)) for remark in answer.remarks),
        setting_facts(answer.settings),
    )
    shown = tuple(part for part in parts if part is not None)
    return Section("landing_ranges", TITLE, LEAD, shown, _headline(answer), _above(answer))


def _headline(answer: RangeLanding) -> str:
    row = answer.at(TOUCHDOWN)
    met = f"accuracy of {row.category}" if row.category else "the accuracy of no category"
    return f"At touchdown {met}: lateral {number(row.lateral_95_m, 1, 'm')}, vertical {_vertical(row)} (95 %)"


def _vertical(row: AccuracyRow) -> str:
    return number(row.vertical_95_m, 1, "m")


def _above(answer: RangeLanding) -> tuple[Part, ...]:
    pairs = [
        (category.label, where(answer, category.name, ALL_AXES), "where horizontal and vertical accuracy are met")
        for category in CATEGORIES
    ]
    return (Facts("", pairs),)


def where(answer: RangeLanding, category: str, axis: str) -> str:
    """Return the stretches of the path where an accuracy is met, metres before the threshold."""
    spans = [one for one in answer.spans if (one.category, one.axis) == (category, axis)]
    told = (f"{number(one.from_before_threshold_m, 0)} to {number(one.to_before_threshold_m, 0, 'm')}" for one in spans)
    return ", ".join(told) or "nowhere"


def _point(row: ReferencePointRow) -> tuple[Cell, ...]:
    name = f"{row.name} (aircraft)" if row.is_moving else row.name
    places = number(row.before_threshold_m, 0), number(row.right_m, 0, signed=True), number(row.up_m, 0)
    return name, *places


def _row(row: AccuracyRow) -> tuple[Cell, ...]:
    return (
        row.place,
        number(row.before_threshold_m, 0),
        number(row.height_m, 0),
        *(number(value, 2) for value in (row.sigma_along_m, row.sigma_right_m, row.sigma_up_m)),
        *(number(value, 1) for value in (row.lateral_95_m, row.horizontal_95_m, row.vertical_95_m)),
        row.category or ABSENT,
    )


def _categories(answer: RangeLanding) -> Grid:
    rows = [
        (
            one.label,
            number(one.horizontal_m, 1),
            number(one.vertical_m, 1),
            *(where(answer, one.name, axis) for axis in (ALL_AXES, "lateral", "vertical")),
        )
        for one in CATEGORIES
    ]
    return Grid("Categories", CATEGORY_HEADS, rows, CATEGORY_CAPTION)


def _trials(answer: RangeLanding) -> Grid | None:
    if not answer.trials:
        return None
    rows = [_trial(row) for row in answer.trials]
    title = f"Simulated approaches: {answer.trial_count}"
    return Grid(title, TRIAL_HEADS, rows, TRIAL_CAPTION, ("landing_ranges_errors",))


def _trial(row: TrialRow) -> tuple[Cell, ...]:
    state = Mark("good", "consistent") if row.is_consistent else Mark("warn", "not consistent")
    if row.nees > row.nees_high:
        state = Mark("bad", "overconfident")
    return (
        "taken for white" if row.filter == WHITE else "modelled",
        number(row.before_threshold_m, 0),
        f"{number(row.nees, 1)} ({number(row.nees_low, 1)} to {number(row.nees_high, 1)})",
        *(number(value, 2) for value in (row.rms_right_m, row.rms_up_m)),
        *(number(value, 1) for value in (row.overconfidence_right, row.overconfidence_up)),
        state,
    )
