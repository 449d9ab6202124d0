"""Figures of a placement: map of accuracy with the points, and accuracy along the way."""

from typing import Any

import numpy as np

from groundstation.chapters.placement import design_title
from groundstation.plots.ranges import finite, padded
from groundstation.reports import drawing as d
from groundstation.reports import layout
from groundstation.reports.drawing import Drawing
from groundstation.reports.figures.inertial import plain_log
from groundstation.results.arrays.cooperative import PlacementAccuracy, PlacementKeepOut, PlacementMap, PlacementPoints
from groundstation.results.flight import FlightResults
from groundstation.results.placement import GIVEN, PlacementPlan

M_PER_KM = 1000.0
PANEL_MM = 36.0
LEVELS = 12
TOP_SHARE = 90.0  # per cent of the map's values that keep their own colour


def accuracy_map(results: FlightResults) -> Drawing | None:
    """Accuracy at the fixed point over places of the last point, with what is kept out and where the points stand."""
    answer, data = results.answer(PlacementPlan), results.rows_of(PlacementMap)
    if answer is None or data is None:
        return None
    north, east = (np.unique(values) / M_PER_KM for values in (data.north_m, data.east_m))
    sigma = data.sigma_m.reshape(len(north), len(east))
    known = finite(sigma)
    if not known.size:
        return None
    low, high = float(known.min()), float(np.percentile(known, TOP_SHARE))
    levels = np.geomspace(low, max(high, 1.05 * low), LEVELS)
    way = results.rows_of(PlacementAccuracy)
    rings, points = results.rows_of(PlacementKeepOut), results.rows_of(PlacementPoints)

    def paint(figure: Any) -> None:
        axes, bar = layout.place(figure, 18, 12, 150, 112), layout.place(figure, 156, 22, 160, 102)
        filled = axes.contourf(east, north, sigma, levels=levels, cmap="viridis_r", extend="max")
        figure.colorbar(filled, cax=bar, ticks=levels[::2], format="%.3g")
        bar.set_ylabel("weighted sigma, m")
        d.tell(axes, *np.meshgrid(east, north), sigma, "weighted sigma, m")
        if rings is not None:
            _keep_out(axes, rings)
        if way is not None:
            mine = way.design == answer.recommended
            along, up = way.east_m[mine] / M_PER_KM, way.north_m[mine] / M_PER_KM
            d.line(axes, along, up, d.INK, 1.0, label="path")
        _marks(axes, answer.fixed_east_m, answer.fixed_north_m, "x", 6.0, "fixed point", color=d.GNSS)
        if points is not None:
            _stand(axes, points, answer)
        axes.set_aspect("equal", adjustable="box", anchor="W")
        axes.set_xlim(float(east[0]), float(east[-1]))
        axes.set_ylim(*padded(float(north[0]), float(north[-1]), 0.03))
        axes.set_xlabel("east, km")
        axes.set_ylabel("north, km")
        axes.legend(loc="center left", bbox_to_anchor=(1.25, 0.5), bbox_transform=axes.transAxes)

    caption = (
        f"Root of the weighted variance at the fixed point if {answer.moved} stood elsewhere, the other points as "
        f"recommended ({design_title(answer.recommended)}). White: not allowed, or outside the map."
    )
    names = tuple(one.name for one in (data, points, rings) if one is not None)
    return Drawing("Map of accuracy", caption, "Map of accuracy.", d.draw("placement-map", 122, paint), names)


def _keep_out(axes: Any, rings: PlacementKeepOut) -> None:
    """Polygons that are kept out, with their names."""
    names = rings.label
    for name in dict.fromkeys(names.tolist()):
        east, north = (values[names == name] / M_PER_KM for values in (rings.east_m, rings.north_m))
        axes.fill(east, north, facecolor="#eef0f2", edgecolor=d.FAINT, linewidth=0.8, zorder=3)
        middle = float(east[:-1].mean()), float(north[:-1].mean())
        axes.text(*middle, d.label(name, 16), fontsize=7, color=d.FAINT, ha="center", zorder=4)


def _marks(axes: Any, east_m: Any, north_m: Any, mark: str, size: float, name: str, **look: Any) -> None:
    """Marks without a line between them."""
    look = {"color": "white", "markeredgecolor": d.INK} | look
    if mark == "x":
        look["markeredgecolor"], look["markeredgewidth"] = look["color"], 1.6
    east, north = np.atleast_1d(east_m) / M_PER_KM, np.atleast_1d(north_m) / M_PER_KM
    axes.plot(east, north, mark, markersize=size, linestyle="none", label=name, zorder=6, **look)


def _stand(axes: Any, points: PlacementPoints, answer: PlacementPlan) -> None:
    """The points of the recommended design, and where those that are placed were given."""
    design, placed = points.design, points.is_placed
    east, north = points.east_m, points.north_m
    given = (design == GIVEN) & placed
    _marks(axes, east[given], north[given], "o", 4.5, "as given")
    for is_placed, mark, name in ((True, "*", "placed"), (False, "^", "already there")):
        mine = (design == answer.recommended) & (placed == is_placed)
        if not mine.any():
            continue
        _marks(axes, east[mine], north[mine], mark, 9.0 if is_placed else 6.0, name)
        for x, y, text in zip(east[mine], north[mine], points.label[mine], strict=True):
            place = x / M_PER_KM, y / M_PER_KM
            layout.beside(axes, *place, d.label(str(text), 16), d.INK, axes.transData, "center")


def accuracy(results: FlightResults) -> Drawing | None:
    """Two sigma along the way, every design in its colour."""
    answer, data = results.answer(PlacementPlan), results.rows_of(PlacementAccuracy)
    if answer is None or data is None:
        return None
    design, time_s = data.design, data.time_s
    panels = (
        ("north", data.two_sigma_north_m),
        ("east", data.two_sigma_east_m),
        ("up", data.two_sigma_up_m),
    )
    height = (PANEL_MM + 4) * len(panels) + 24.0

    def paint(figure: Any) -> None:
        for number, (axis, two_sigma_m) in enumerate(panels):
            top = height - 18 - (PANEL_MM + 4) * number
            axes = layout.place(figure, 18, top - PANEL_MM + 4, 174, top)
            for place, row in enumerate(answer.designs):
                mine = design == row.design
                colour = d.FAINT if row.design == GIVEN else d.SERIES[(place - 1) % len(d.SERIES)]
                width = 2.2 if row.design == answer.recommended else 1.0
                values = two_sigma_m[mine]
                d.line(axes, time_s[mine][1:], values[1:], colour, width, label=design_title(row.design))
            axes.set_ylabel(f"2σ {axis}, m")
            axes.set_yscale("log")
            plain_log(axes.yaxis, (1.0, 2.0, 5.0))
            layout.limit_line(axes, answer.fixed_at_s, "fixed point" if not number else "", vertical=True)
            layout.time_axis(axes, float(time_s.min()), float(time_s.max()), title=number == len(panels) - 1)
            if not number:
                layout.legend_above(axes, 2)

    caption = "Accuracy along the path as the filter computes it, for every design, from the first ranges on."
    svg = d.draw("placement-accuracy", height, paint)
    return Drawing("Accuracy along the path", caption, "Two sigma with time.", svg, ("placement_accuracy",))
