"""Figures of a planned session: ways from above, accuracy and geometry with time, laws of control."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from groundstation.base.angles import unwrap
from groundstation.chapters.control import title_of
from groundstation.plots.ranges import finite, padded
from groundstation.reports import drawing as d
from groundstation.reports import layout
from groundstation.reports.drawing import Drawing
from groundstation.reports.figures.inertial import plain_log
from groundstation.reports.frames import TIME
from groundstation.results.arrays.cooperative import ControlMeasures, ControlPaths, ControlPoints
from groundstation.results.arrays.typed import T
from groundstation.results.control import UNCONTROLLED, ControlPlan
from groundstation.results.flight import FlightResults

M_PER_KM = 1000.0
PANEL_MM = 38.0
TICKS_ON_A_WAY = 5
COLOURS = {
    UNCONTROLLED: d.FAINT,
    "determinant": d.INS,
    "eigenvalue": d.GNSS,
    "dop": "#e69f00",
    "covariance": d.USED,
}
WIDTHS = {"determinant": 3.2, "eigenvalue": 2.0, "dop": 1.0}  # laws that agree lie over each other and stay visible


def _data(results: FlightResults, kind: type[T]) -> tuple[ControlPlan, T] | None:
    answer, data = results.answer(ControlPlan), results.rows_of(kind)
    return None if answer is None or data is None else (answer, data)


def _laws(answer: ControlPlan) -> list[tuple[str, str, float]]:
    """Laws in the order they are drawn, with colour and width."""
    return [(row.law, COLOURS.get(row.law, d.INK), WIDTHS.get(row.law, 1.2)) for row in answer.laws]


def paths(results: FlightResults) -> Drawing | None:
    """Ways of all aircraft from above: under the recommended law, and without control."""
    found = _data(results, ControlPaths)
    if found is None:
        return None
    answer, data = found
    law, aircraft = data.law, data.aircraft
    north, east = data.north_m / M_PER_KM, data.east_m / M_PER_KM
    points = results.rows_of(ControlPoints)

    def paint(figure: Any) -> None:
        axes = layout.place(figure, 18, 12, 174, 104)
        for number, name in enumerate(answer.aircraft):
            colour = d.SERIES[number % len(d.SERIES)]
            nominal = np.flatnonzero((law == UNCONTROLLED) & (aircraft == name))
            mine = np.flatnonzero((law == answer.recommended) & (aircraft == name))
            exact = " (exact)" if name in answer.exact else ""
            d.line(axes, east[nominal], north[nominal], colour, 0.8, linestyle=(0, (3, 2)))
            d.line(axes, east[mine], north[mine], colour, 1.6, label=d.label(f"{name}{exact}", 20))
            marks = mine[np.linspace(0, len(mine) - 1, TICKS_ON_A_WAY).astype(np.int64)]
            d.dots(axes, east[marks], north[marks], colour, 3.0)
            axes.plot(east[mine[-1:]], north[mine[-1:]], "o", color=colour, markersize=5.0)
        mine = law == answer.recommended
        d.tell(axes, east[mine], north[mine], data.time_s[mine], TIME)
        if points is not None:
            places = points.east_m / M_PER_KM, points.north_m / M_PER_KM
            axes.plot(*places, "^", color=d.INK, markersize=4.5, linestyle="none")
            for x, y, name in zip(*places, points.label, strict=True):
                layout.beside(axes, x, y, d.label(str(name), 16), d.INK, axes.transData, "center")
        axes.set_aspect("equal", adjustable="datalim")
        axes.set_xlabel("east, km")
        axes.set_ylabel("north, km")
        layout.legend_above(axes, 6)

    between = answer.duration_s / (TICKS_ON_A_WAY - 1)
    caption = (
        f"Paths from above: {title_of(answer.recommended)}; dashed: without control. Small dots are {between:g} s "
        "apart, the large one is at the end." + (" Triangles: ground points." if points is not None else "")
    )
    names = ("control_paths", *(("control_points",) if points is not None else ()))
    return Drawing("Paths", caption, "Paths of the aircraft.", d.draw("control-paths", 112, paint), names)


def measures(results: FlightResults) -> Drawing | None:
    """Accuracy and geometry of the judged aircraft with time, every law in its colour."""
    found = _data(results, ControlMeasures)
    if found is None:
        return None
    answer, data = found
    law, time_s = data.law, data.time_s
    panels = (
        (data.two_sigma_north_m, "2σ north, m", True),
        (data.two_sigma_east_m, "2σ east, m", True),
        (data.determinant, "det(H'H)", False),
        (data.dop, "DOP", False),
    )
    height = (PANEL_MM + 4) * len(panels) + 14.0

    def paint(figure: Any) -> None:
        for number, (values, title, is_log) in enumerate(panels):
            top = height - 8 - (PANEL_MM + 4) * number
            axes = layout.place(figure, 18, top - PANEL_MM + 4, 174, top)
            for name, colour, width in _laws(answer):
                mine = law == name
                d.line(axes, time_s[mine], values[mine], colour, width, label=title_of(name))
            axes.set_ylabel(title)
            if is_log:
                axes.set_yscale("log")
                plain_log(axes.yaxis, (1.0, 2.0, 5.0))
            layout.time_axis(axes, float(time_s.min()), float(time_s.max()), title=number == len(panels) - 1)
            if not number:
                layout.legend_above(axes, 3)

    caption = (
        f"Accuracy of {answer.judged} as the centralised filter computes it, and geometry of its sources, under every "
        "control law. Laws of each step that agree overlap."
    )
    svg = d.draw("control-measures", height, paint)
    return Drawing("Accuracy and geometry", caption, "Two sigma and geometry with time.", svg, ("control_measures",))


def law(results: FlightResults) -> Drawing | None:
    """Every control with time under every law, with its bounds."""
    found = _data(results, ControlPaths)
    if found is None or not found[0].controls:
        return None
    answer, data = found
    of, aircraft, time_s = data.law, data.aircraft, data.time_s
    height = (PANEL_MM + 4) * len(answer.controls) + 14.0

    def paint(figure: Any) -> None:
        for number, row in enumerate(answer.controls):
            top = height - 8 - (PANEL_MM + 4) * number
            axes = layout.place(figure, 18, top - PANEL_MM + 4, 174, top)
            is_speed = row.control == "speed"
            drawn = []
            for name, colour, width in _laws(answer):
                mine = (of == name) & (aircraft == row.aircraft)
                values = data.speed_mps[mine] if is_speed else _unwrapped(data, mine, row.start)
                d.line(axes, time_s[mine], values, colour, width, label=title_of(name))
                drawn.append(values)
            low, high = padded(float(finite(*drawn).min()), float(finite(*drawn).max()), 0.1, 0.5)
            axes.set_ylim(low, high)
            for value in (row.low, row.high):
                if low <= value <= high:
                    layout.limit_line(axes, value, "")
            axes.set_ylabel(f"{d.label(row.aircraft, 12)}: {row.control}, {'m/s' if is_speed else '°'}")
            layout.time_axis(axes, float(time_s.min()), float(time_s.max()), title=number == len(answer.controls) - 1)
            if not number:
                layout.legend_above(axes, 3)

    caption = "The control laws with time; straight grey: no control; dashed: bounds."
    svg = d.draw("control-law", height, paint)
    return Drawing("Control laws", caption, "Controls with time.", svg, ("control_paths",))


def _unwrapped(data: ControlPaths, rows: NDArray[np.bool_], start_deg: float) -> NDArray[np.float64]:
    """Headings without jumps through north, beginning at the start."""
    track = unwrap(data.track_deg[rows])
    return np.asarray(start_deg + track - track[0])
