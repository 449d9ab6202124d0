"""Figures of landing by ranges: points and path, accuracy along it with the categories' limits, simulated errors."""

from typing import Any

import numpy as np

from groundstation.reports import drawing as d
from groundstation.reports import layout
from groundstation.reports.drawing import Drawing
from groundstation.reports.figures.inertial import plain_log
from groundstation.results.arrays.landing import RangesErrors, RangesPath, RangesSpace
from groundstation.results.arrays.typed import T
from groundstation.results.flight import FlightResults
from groundstation.results.landing_categories import CATEGORIES, LINEAR_95
from groundstation.results.landing_ranges import HONEST, WHITE, RangeLanding

M_PER_KM = 1000.0
NAME_KM = 0.08  # from a point to its name
MOST_TRIALS = 30
LEAST_SHOWN_M = 0.1


def _data(results: FlightResults, kind: type[T]) -> tuple[RangeLanding, T] | None:
    answer, data = results.answer(RangeLanding), results.rows_of(kind)
    return None if answer is None or data is None else (answer, data)


def space(results: FlightResults) -> Drawing | None:
    """Path and points from above and from the side."""
    found = _data(results, RangesSpace)
    if found is None:
        return None
    answer, data = found
    name = data.label
    along, right, up = (values / M_PER_KM for values in (data.along_m, data.right_m, data.up_m))
    length = float(answer.settings["path.runway_length_m"]) / M_PER_KM

    def paint(figure: Any) -> None:
        above, side = layout.place(figure, 18, 58, 174, 104), layout.place(figure, 18, 12, 174, 46)
        for axes, across, title in ((above, right, "right, km"), (side, M_PER_KM * up, "up, m")):
            axes.plot([0.0, length], [0.0, 0.0], color=d.INK, linewidth=3.0, solid_capstyle="butt", label="runway")
            ways = (("aircraft", d.INS, "aircraft"), ("moving", d.GNSS, "moving point"))
            for which, colour, label in ways:
                rows = name == which
                if rows.any():
                    d.line(axes, along[rows], across[rows], colour, 1.3, label=label)
                    axes.plot(along[rows][:1], across[rows][:1], "o", color=colour, markersize=3.5)
            for point in answer.points:
                if not point.is_moving:
                    row = int(np.flatnonzero(name == point.name)[0])
                    axes.plot(along[row], across[row], "^", color=d.INK, markersize=5.0)
                    if axes is above:
                        place = along[row] + NAME_KM, across[row] - 3.5 * NAME_KM
                        layout.beside(axes, *place, d.label(point.name, 16), d.INK, axes.transData, "left")
            axes.set_ylabel(title)
        above.set_aspect("equal", adjustable="datalim")
        side.set_xlim(above.get_xlim())
        above.tick_params(labelbottom=False)
        side.set_xlabel("beyond the threshold, km")
        layout.legend_above(above, 4)

    caption = (
        "Approach from above and from the side; dots: where flights begin, triangles: reference points on the ground."
    )
    alt = "Glide path, runway and reference points from above and from the side."
    return Drawing("Approach", caption, alt, d.draw("landing-space", 112, paint), ("landing_ranges_space",))


def accuracy(results: FlightResults) -> Drawing | None:
    """Horizontal, lateral and vertical 95 % figures along the path, with the limits of the categories."""
    found = _data(results, RangesPath)
    if found is None:
        return None
    _, data = found
    before = data.before_threshold_m / M_PER_KM
    panels = (
        (
            "horizontal, m",
            ((data.horizontal_95_m, d.INS, "radius"), (data.lateral_95_m, d.GNSS, "lateral")),
            [one.horizontal_m for one in CATEGORIES],
        ),
        ("vertical, m", ((data.vertical_95_m, d.INS, "vertical"),), [one.vertical_m for one in CATEGORIES]),
    )

    def paint(figure: Any) -> None:
        for (title, lines, limits), (bottom, top) in zip(panels, ((66, 112), (12, 58)), strict=True):
            axes = layout.place(figure, 18, bottom, 174, top)
            for values, colour, label in lines:
                d.line(axes, before, np.maximum(values, LEAST_SHOWN_M), colour, 1.4, label=label)
            for value in sorted(set(limits), reverse=True):
                named = [one.name for one, limit in zip(CATEGORIES, limits, strict=True) if limit == value]
                text = "" if named == [CATEGORIES[-1].name] else f"{named[0]}: {value:g} m"  # too near for a text
                layout.limit_line(axes, value, "")
                layout.beside(axes, 0.66, value, text, d.LIMIT, axes.get_yaxis_transform(), "left")
            axes.axvline(0.0, color=d.FAINT, linewidth=0.8)
            axes.set_yscale("log")
            plain_log(axes.yaxis)
            axes.set_xlim(float(before.max()), float(before.min()))
            axes.set_ylabel(title)
            if bottom < 60:
                axes.set_xlabel("before the threshold, km")
            else:
                layout.legend_above(axes, 3)

    caption = (
        "Bound of 95 % of the errors, by the covariance of the filter along the true path: radius in the plane, 1.96 "
        "σ of one axis. Dashed: accuracy of the categories (CAT II and III: ILS look-alike; the line below CAT II is "
        "CAT IIIB). The vertical line is the threshold."
    )
    alt = "Horizontal and vertical 95 % error along the approach, with the limits of the categories."
    return Drawing("Accuracy", caption, alt, d.draw("landing-accuracy", 120, paint), ("landing_ranges_path",))


def trials(results: FlightResults) -> Drawing | None:
    """Errors to the right and up of simulated approaches in the band that the filter computes."""
    found = _data(results, RangesErrors)
    if found is None:
        return None
    answer, data = found
    before, trial, of = data.before_threshold_m / M_PER_KM, data.trial, data.filter
    filters = [one for one in (HONEST, WHITE) if (of == one).any()]
    names = {HONEST: "range errors modelled", WHITE: "taken for white"}
    height = 14.0 + 54.0 * len(filters)

    def paint(figure: Any) -> None:
        for number, which in enumerate(filters):
            top = height - 8.0 - 54.0 * number
            for left, axis, error, sigma in (
                (18, "right", data.error_right_m, data.sigma_right_m),
                (104, "up", data.error_up_m, data.sigma_up_m),
            ):
                axes = layout.place(figure, left, top - 38.0, left + 70, top)
                mine = of == which
                one = mine & (trial == 1)
                band = LINEAR_95 * sigma
                axes.fill_between(before[one], -band[one], band[one], color=d.FILL, linewidth=0, label="95 %")
                for count in range(1, min(answer.trial_count, MOST_TRIALS) + 1):
                    rows = mine & (trial == count)
                    d.line(axes, before[rows], error[rows], d.INS, 0.5)
                near = mine & (before < 2.5)
                most = 1.15 * float(np.nanquantile(np.abs(error[near]), 0.995))
                axes.set_ylim(-max(most, 0.5), max(most, 0.5))
                axes.set_xlim(float(before.max()), float(before.min()))
                axes.set_ylabel(f"error {axis}, m")
                axes.set_title(names[which] if axis == "right" else "")
                if number == len(filters) - 1:
                    axes.set_xlabel("before the threshold, km")
                if axis == "up":
                    layout.legend_above(axes, 1)

    caption = (
        f"Estimate minus truth of {min(answer.trial_count, MOST_TRIALS)} simulated approaches, and the 95 % band that "
        "the filter computes for the first of them; errors beyond the axes are cut."
    )
    alt = "Errors of simulated approaches to the right and up, within the computed bands."
    svg = d.draw("landing-trials", height, paint)
    return Drawing("Simulated approaches", caption, alt, svg, ("landing_ranges_errors",))
