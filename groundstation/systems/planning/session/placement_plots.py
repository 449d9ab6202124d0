"""Plots of a placement: map of accuracy with the points, and accuracy along the way."""

from collections.abc import Mapping

import numpy as np

from groundstation.chapters.plots.common import M_PER_KM, label
from groundstation.plots.axes import time_axis
from groundstation.plots.marks import AnyMark, Cells, Curve, Emphasis, Limit, Outlines, Points, Role, Symbol, series
from groundstation.plots.plot import Axis, Describe, Panel, Plot, Row, one_panel
from groundstation.plots.ranges import finite, padded
from groundstation.results.arrays.typed import Floats
from groundstation.results.flight import FlightResults
from groundstation.systems.planning.session.placement_answer import GIVEN, PlacementPlan
from groundstation.systems.planning.session.placement_arrays import (
    PlacementAccuracy,
    PlacementKeepOut,
    PlacementMap,
    PlacementPoints,
)
from groundstation.systems.planning.session.placement_chapter import design_title

PANEL_MM = 32.0
TOP_SHARE = 90.0  # per cent of the map's values that keep their own colour


def accuracy_map(results: FlightResults) -> Plot | None:
    """Return accuracy at the fixed point over places of the last point.

    The areas kept out and the places of the points are drawn too.
    """
    answer, data = results.answer(PlacementPlan), results.rows_of(PlacementMap)
    if answer is None or data is None:
        return None
    north, east = (np.unique(values) / M_PER_KM for values in (data.north_m, data.east_m))
    sigma = data.sigma_m.reshape(len(north), len(east))
    known = finite(sigma)
    if not known.size:
        return None
    if 1 in sigma.shape:
        return _accuracy_on_a_line(answer, north, east, sigma.ravel())
    low, high = float(known.min()), float(np.percentile(known, TOP_SHARE))
    high = max(high, 1.05 * low)
    marks: list[AnyMark] = [
        Cells(x=east, y=north, values=sigma, low=low, high=high, title="weighted sigma, m", is_log=True)
    ]
    way, rings = results.rows_of(PlacementAccuracy), results.rows_of(PlacementKeepOut)
    if way is not None:
        mine = way.design == answer.recommended
        marks.append(Curve(x=way.east_m[mine] / M_PER_KM, y=way.north_m[mine] / M_PER_KM, role="ink", name="path"))
    if rings is not None:
        marks.append(_keep_out(rings))
    fixed = (np.array([value / M_PER_KM]) for value in (answer.fixed_east_m, answer.fixed_north_m))
    x, y = fixed
    marks.append(Points(x=x, y=y, symbol="cross", role="gnss", name="fixed point"))
    points = results.rows_of(PlacementPoints)
    if points is not None:
        marks += _stand(points, answer)
    across, up = (float(east[0]), float(east[-1])), padded(float(north[0]), float(north[-1]), 0.03)
    x_axis, y_axis = Axis("east, km", low=across[0], high=across[1]), Axis("north, km", low=up[0], high=up[1])
    panel = Panel(marks, x_axis, y_axis, legend="beside", is_map=True)
    return Plot(
        "placement.map",
        "Map of accuracy",
        f"Root of the weighted variance at the fixed point if {answer.moved} stood elsewhere, the other points as "
        f"recommended ({design_title(answer.recommended)}). White: not allowed, or outside the map.",
        "Map of accuracy.",
        one_panel(panel, 100.0),
        tuple(one.name for one in (data, points, rings) if one is not None),
    )


def _accuracy_on_a_line(answer: PlacementPlan, north: Floats, east: Floats, sigma: Floats) -> Plot | None:
    """Return accuracy at the fixed point over places of a rectangle that is a line.

    None for a single place.
    """
    name, along = ("east", east) if len(east) > 1 else ("north", north)
    if len(along) < 2:
        return None
    moved = next(one for one in answer.places_of(answer.recommended) if one.point == answer.moved)
    placed = (moved.east_m if name == "east" else moved.north_m) / M_PER_KM
    marks: list[AnyMark] = [
        Curve(x=along, y=sigma, role="ink", name="weighted sigma"),
        Limit(value=placed, is_upright=True, label="placed"),
    ]
    x_axis = Axis(f"{name}, km", low=float(along[0]), high=float(along[-1]))
    return Plot(
        "placement.map",
        "Accuracy over places",
        f"Root of the weighted variance at the fixed point if {answer.moved} stood elsewhere, the other points as "
        f"recommended ({design_title(answer.recommended)}). The rectangle is a line.",
        "Accuracy over places.",
        one_panel(Panel(marks, x_axis, Axis("weighted sigma, m"), legend="above"), 60.0),
        ("placement_map",),
    )


def _keep_out(rings: PlacementKeepOut) -> Outlines:
    """Return polygons that are kept out, with their names."""
    names = tuple(dict.fromkeys(rings.label.tolist()))
    corners = np.column_stack([rings.east_m, rings.north_m]) / M_PER_KM
    drawn = tuple(corners[rings.label == name] for name in names)
    return Outlines(rings=drawn, labels=tuple(label(name, 16) for name in names), is_filled=True, role="faint")


def _stand(points: PlacementPoints, answer: PlacementPlan) -> list[AnyMark]:
    """Return the points of the recommended design, and where placed ones were given."""
    x, y = points.east_m / M_PER_KM, points.north_m / M_PER_KM
    given = (points.design == GIVEN) & points.is_placed
    marks: list[AnyMark] = [
        Points(x=x[given], y=y[given], symbol="circle", role="ink", name="as given", is_hollow=True)
    ]
    kinds: tuple[tuple[bool, Symbol, str], ...] = ((True, "star", "placed"), (False, "triangle", "already there"))
    for is_placed, symbol, name in kinds:
        mine = (points.design == answer.recommended) & (points.is_placed == is_placed)
        if mine.any():
            names = tuple(label(str(text), 16) for text in points.label[mine])
            marks.append(
                Points(x=x[mine], y=y[mine], symbol=symbol, labels=names, role="ink", name=name, is_hollow=True)
            )
    return marks


def accuracy(results: FlightResults) -> Plot | None:
    """Return two sigma along the way, every design in its colour."""
    answer, data = results.answer(PlacementPlan), results.rows_of(PlacementAccuracy)
    if answer is None or data is None:
        return None
    listed = (
        ("north", data.two_sigma_north_m),
        ("east", data.two_sigma_east_m),
        ("up", data.two_sigma_up_m),
    )
    time = time_axis(float(data.time_s.min()), float(data.time_s.max()))
    rows: list[Row] = []
    for axis, values in listed:
        marks: list[AnyMark] = []
        for place, row in enumerate(answer.designs):
            mine = np.flatnonzero(data.design == row.design)[1:]  # from the first ranges on
            role: Role = "faint" if row.design == GIVEN else series(place - 1)
            heavy: Emphasis = "bold" if row.design == answer.recommended else "usual"
            name = design_title(row.design)
            marks.append(Curve(x=data.time_s[mine], y=values[mine], role=role, name=name, emphasis=heavy))
        marks.append(Limit(value=answer.fixed_at_s, is_upright=True, name="" if rows else "fixed point"))
        panel = Panel(marks, time, Axis(f"2σ {axis}, m", "log"), legend="" if rows else "above")
        rows.append(Row((panel,), PANEL_MM, shares_x=axis != "up"))
    return Plot(
        "placement.accuracy",
        "Accuracy along the path",
        "Accuracy along the path as the filter computes it, for every design, from the first ranges on.",
        "Two sigma with time.",
        tuple(rows),
        ("placement_accuracy",),
    )


PLOTS: Mapping[str, Describe] = {
    "placement.map": accuracy_map,
    "placement.accuracy": accuracy,
}
