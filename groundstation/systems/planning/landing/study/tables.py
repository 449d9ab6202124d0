"""Tables of the landing study: published figures with ours beside them.

Noise, order of the variants, honesty.
"""

from collections.abc import Mapping, Sequence

import numpy as np

from groundstation.results.figures import FigureData
from groundstation.results.landing_categories import CATEGORIES, LINEAR_95
from groundstation.systems.planning.landing.answer import TOUCHDOWN, WHITE, AccuracyRow, RangeLanding
from groundstation.systems.planning.landing.study.cases import CLAIMS, FACTOR, SIGMAS, Axis, Figure, PublishedCategory

THRESHOLD = "threshold"


def table(name: str, columns: Sequence[str], rows: Sequence[Sequence[object]], digits: int = 2) -> FigureData:
    """Return a table of rows."""
    arrays = {column: np.array([row[place] for row in rows]) for place, column in enumerate(columns)}
    return FigureData(name, arrays, dict.fromkeys(columns, digits))


def figure_of(answer: RangeLanding, figure: Figure) -> float:
    """Return one sigma that an answer holds."""
    if figure == "touchdown_up":
        return answer.at(TOUCHDOWN).sigma_up_m
    return {"least_along": answer.least_along_m, "least_right": answer.least_right_m}.get(figure, answer.least_up_m)


def sigma_table(answers: Mapping[str, RangeLanding]) -> FigureData:
    """Tabulate published sigmas with ours."""
    rows = []
    for one in SIGMAS:
        ours = figure_of(answers[one.approach], one.figure)
        near = one.low / FACTOR <= ours <= one.high * FACTOR
        rows.append((one.approach, one.figure, one.published, one.low, one.high, ours, "yes" if near else "no"))
    names = ("approach", "figure", "published", "published_low_m", "published_high_m", "ours_m", "within_factor_two")
    return table("landing_published_sigmas", names, rows)


def error_95_m(row: AccuracyRow, axis: Axis) -> float:
    """Return the 95 % figure of an axis."""
    return {"lateral": row.lateral_95_m, "horizontal": row.horizontal_95_m}.get(axis, row.vertical_95_m)


def holds(claim: PublishedCategory, error_m: float) -> bool:
    """Tell whether an error agrees with a claim."""
    limits = {one.name: one.vertical_m if claim.axis == "vertical" else one.horizontal_m for one in CATEGORIES}
    if not claim.category:
        return error_m > max(limits.values())
    return error_m <= limits[claim.category]


def category_table(answers: Mapping[str, RangeLanding]) -> FigureData:
    """Tabulate published claims of categories with our 95 % figures.

    Our figures are those at the threshold, at touchdown, and in height the least on the path: over the third point.
    """
    rows = []
    for claim in CLAIMS:
        answer = answers[claim.approach]
        at_threshold, at_touchdown = (error_95_m(answer.at(place), claim.axis) for place in (THRESHOLD, TOUCHDOWN))
        verdicts = ["holds" if holds(claim, error) else "refuted" for error in (at_threshold, at_touchdown)]
        least = LINEAR_95 * answer.least_up_m if claim.axis == "vertical" else float("nan")
        at_least = "" if claim.axis != "vertical" else "holds" if holds(claim, least) else "refuted"
        verdict = (at_threshold, verdicts[0], at_touchdown, verdicts[1], least, at_least)
        rows.append((claim.approach, claim.axis, claim.published, *verdict))
    names = (
        *("approach", "axis", "published", "threshold_95_m", "at_threshold", "touchdown_95_m", "at_touchdown"),
        *("least_95_m", "at_least"),
    )
    return table("landing_published_categories", names, rows)


def order_table(answers: Mapping[str, RangeLanding]) -> FigureData:
    """Tabulate variants of the source, the worst height at touchdown first."""
    ordered = sorted(answers.items(), key=lambda pair: -pair[1].at(TOUCHDOWN).sigma_up_m)
    rows = []
    for name, answer in ordered:
        threshold, touchdown = answer.at(THRESHOLD), answer.at(TOUCHDOWN)
        sigmas = [part for row in (threshold, touchdown) for part in _sigmas(row)]
        rows.append((name, *sigmas, answer.least_up_m, touchdown.category or "none"))
    places = [f"{place}_{axis}_m" for place in ("threshold", "touchdown") for axis in ("along", "right", "up")]
    return table("landing_variants", ("approach", *places, "least_up_m", "category_at_touchdown"), rows)


def _sigmas(row: AccuracyRow) -> tuple[float, float, float]:
    return row.sigma_along_m, row.sigma_right_m, row.sigma_up_m


def variation_table(answers: Mapping[str, RangeLanding]) -> FigureData:
    """Tabulate the effect of noise, correlation, baro and control.

    The approach is that with the moving point.
    """
    rows = []
    for name, answer in answers.items():
        threshold, touchdown = answer.at(THRESHOLD), answer.at(TOUCHDOWN)
        least = answer.least_along_m, answer.least_right_m, answer.least_up_m
        met = touchdown.vertical_category or "none"
        rows.append((name, *least, threshold.sigma_up_m, *_sigmas(touchdown), touchdown.vertical_95_m, met))
    names = (
        *("changed", "least_along_m", "least_right_m", "least_up_m", "threshold_up_m"),
        *("touchdown_along_m", "touchdown_right_m", "touchdown_up_m", "touchdown_vertical_95_m", "vertical_category"),
    )
    return table("landing_variations", names, rows)


def trial_table(answers: Mapping[str, RangeLanding]) -> FigureData:
    """Tabulate NEES and over-confidence of simulated approaches."""
    rows = [
        (
            *(name, "white" if row.filter == WHITE else "as it is", row.before_threshold_m),
            *(row.nees, row.nees_low, row.nees_high, "yes" if row.is_consistent else "no"),
            *(row.rms_right_m, row.rms_up_m, row.overconfidence_right, row.overconfidence_up, answer.trial_count),
        )
        for name, answer in answers.items()
        for row in answer.trials
    ]
    names = (
        *("approach", "noise_taken_for", "before_threshold_m", "nees", "nees_low", "nees_high", "consistent"),
        *("rms_right_m", "rms_up_m", "error_over_sigma_right", "error_over_sigma_up", "trials"),
    )
    return table("landing_trials", names, rows)
