"""Plots of landing by ranges: points and path, accuracy along it, simulated errors.

The accuracy with the limits of the categories.
"""

from collections.abc import Mapping

import numpy as np

from groundstation.chapters.plots.common import M_PER_KM, label
from groundstation.plots.marks import AnyMark, Band, Curve, Floats, Limit, Points, Role
from groundstation.plots.plot import Axis, Describe, Panel, Plot, Row
from groundstation.results.arrays.typed import T
from groundstation.results.flight import FlightResults
from groundstation.results.landing_categories import CATEGORIES, LINEAR_95
from groundstation.systems.planning.landing.answer import HONEST, WHITE, RangeLanding
from groundstation.systems.planning.landing.arrays import RangesErrors, RangesPath, RangesSpace

MOST_TRIALS = 30
LEAST_SHOWN_M = 0.1
NEAR_KM = 2.5  # the errors from there on set the axis
WAYS: tuple[tuple[str, Role, str], ...] = (("aircraft", "ins", "aircraft"), ("moving", "gnss", "moving point"))
FILTERS = {HONEST: "range errors modelled", WHITE: "taken for white"}


def _data(results: FlightResults, kind: type[T]) -> tuple[RangeLanding, T] | None:
    answer, data = results.answer(RangeLanding), results.rows_of(kind)
    return None if answer is None or data is None else (answer, data)


def space(results: FlightResults) -> Plot | None:
    """Return the path and points from above and from the side."""
    found = _data(results, RangesSpace)
    if found is None:
        return None
    answer, data = found
    above = _view(answer, data, data.right_m / M_PER_KM, has_names=True)
    side = _view(answer, data, data.up_m, has_names=False)
    x = Axis("beyond the threshold, km")
    return Plot(
        "landing_ranges.space",
        "Approach",
        "Approach from above and from the side; dots: where flights begin, triangles: reference points on the ground.",
        "Glide path, runway and reference points from above and from the side.",
        (
            Row((Panel(above, x, Axis("right, km"), is_map=True),), 46.0, shares_x=True),
            Row((Panel(side, x, Axis("up, m"), legend=""),), 34.0),
        ),
        ("landing_ranges_space",),
    )


def _view(answer: RangeLanding, data: RangesSpace, across: Floats, *, has_names: bool) -> list[AnyMark]:
    along = data.along_m / M_PER_KM
    runway = np.array([0.0, float(answer.settings["path.runway_length_m"]) / M_PER_KM])
    marks: list[AnyMark] = [Curve(x=runway, y=np.zeros(2), role="ink", name="runway", emphasis="bold")]
    for which, role, name in WAYS:
        rows = np.flatnonzero(data.label == which)
        if rows.size:
            marks.append(Curve(x=along[rows], y=across[rows], role=role, name=name))
            marks.append(Points(x=along[rows[:1]], y=across[rows[:1]], role=role))
    fixed = [point.name for point in answer.points if not point.is_moving]
    rows = np.array([int(np.flatnonzero(data.label == name)[0]) for name in fixed], dtype=np.intp)
    names = tuple(label(name, 16) for name in fixed) if has_names else ()
    marks.append(Points(x=along[rows], y=across[rows], symbol="triangle", labels=names, role="ink"))
    return marks


def accuracy(results: FlightResults) -> Plot | None:
    """Return horizontal, lateral and vertical 95 % figures along the path.

    The limits of the categories are drawn too.
    """
    found = _data(results, RangesPath)
    if found is None:
        return None
    data = found[1]
    plane: list[tuple[Floats, Role, str]] = [
        (data.horizontal_95_m, "ins", "radius"),
        (data.lateral_95_m, "gnss", "lateral"),
    ]
    above = _accuracy(data, "horizontal, m", plane, [one.horizontal_m for one in CATEGORIES])
    upright: list[tuple[Floats, Role, str]] = [(data.vertical_95_m, "ins", "vertical")]
    below = _accuracy(data, "vertical, m", upright, [one.vertical_m for one in CATEGORIES])
    return Plot(
        "landing_ranges.accuracy",
        "Accuracy",
        "Bound of 95 % of the errors, by the covariance of the filter along the true path: radius in the plane, 1.96 "
        "σ of one axis. Dashed: accuracy of the categories (CAT II and III: ILS look-alike; the line below CAT II is "
        "CAT IIIB). The vertical line is the threshold.",
        "Horizontal and vertical 95 % error along the approach, with the limits of the categories.",
        (Row((above,), 46.0, shares_x=True), Row((below,), 46.0)),
        ("landing_ranges_path",),
    )


def _accuracy(data: RangesPath, title: str, lines: list[tuple[Floats, Role, str]], limits: list[float]) -> Panel:
    before = data.before_threshold_m / M_PER_KM
    marks: list[AnyMark] = [Limit(value=0.0, is_upright=True, role="faint", dash="", emphasis="thin")]
    for value in sorted(set(limits), reverse=True):
        named = [one.name for one, limit in zip(CATEGORIES, limits, strict=True) if limit == value]
        text = "" if named == [CATEGORIES[-1].name] else f"{named[0]}: {value:g} m"  # too near for a text
        marks.append(Limit(value=value, label=text))
    for values, role, name in lines:
        marks.append(Curve(x=before, y=np.maximum(values, LEAST_SHOWN_M), role=role, name=name))
    x = Axis("before the threshold, km", low=float(before.max()), high=float(before.min()))
    return Panel(marks, x, Axis(title, "log"), legend="above" if len(lines) > 1 else "")


def trials(results: FlightResults) -> Plot | None:
    """Return errors to the right and up of simulated approaches in the filter's band."""
    found = _data(results, RangesErrors)
    if found is None:
        return None
    answer, data = found
    count = min(answer.trial_count, MOST_TRIALS)
    filters = [one for one in FILTERS if (data.filter == one).any()]
    rows = tuple(
        Row((_errors(data, which, "right", count), _errors(data, which, "up", count)), 38.0, which is not filters[-1])
        for which in filters
    )
    return Plot(
        "landing_ranges.trials",
        "Simulated approaches",
        f"Estimate minus truth of {count} simulated approaches, and the 95 % band that the filter computes for the "
        "first of them; errors beyond the axes are cut.",
        "Errors of simulated approaches to the right and up, within the computed bands.",
        rows,
        ("landing_ranges_errors",),
    )


def _errors(data: RangesErrors, which: str, axis: str, count: int) -> Panel:
    error, sigma = {"right": (data.error_right_m, data.sigma_right_m), "up": (data.error_up_m, data.sigma_up_m)}[axis]
    before, mine = data.before_threshold_m / M_PER_KM, data.filter == which
    first = mine & (data.trial == 1)
    half = LINEAR_95 * sigma[first]
    marks: list[AnyMark] = [Band(x=before[first], low=-half, high=half, role="answer", name="95 %")]
    for trial in range(1, count + 1):
        rows = mine & (data.trial == trial)
        marks.append(Curve(x=before[rows], y=error[rows], role="ins", emphasis="faint"))
    near = mine & (before < NEAR_KM)
    most = max(1.15 * float(np.nanquantile(np.abs(error[near]), 0.995)), 0.5)
    x = Axis("before the threshold, km", low=float(before.max()), high=float(before.min()))
    y, is_named = Axis(f"error {axis}, m", low=-most, high=most), axis == "right"
    return Panel(marks, x, y, title=FILTERS[which] if is_named else "", legend="" if is_named else "above")


PLOTS: Mapping[str, Describe] = {
    "landing_ranges.space": space,
    "landing_ranges.accuracy": accuracy,
    "landing_ranges.trials": trials,
}
