"""Figures of the chapter on navigation between aircraft: map, errors against sigma, geometry, residuals."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from groundstation.base.ellipse import magnified, outlines
from groundstation.base.local_frame import plane_through
from groundstation.base.normal import NORMAL_95
from groundstation.chapters.cooperative import REFERENCE, title_of, trusted
from groundstation.plots.ranges import broken_at_gaps, finite, thin
from groundstation.reports import drawing as d
from groundstation.reports import layout
from groundstation.reports.drawing import Drawing
from groundstation.reports.figures.inertial import plain_log
from groundstation.reports.frames import TIME
from groundstation.results.arrays.cooperative import (
    CooperativeGeometry,
    CooperativeLinks,
    CooperativeTracks,
    SessionPoints,
)
from groundstation.results.cooperative import CooperativeResult
from groundstation.results.flight import FlightResults

ELLIPSES = 8  # of each track
MOST_PANELS = 8
PANEL_MM = 38.0
M_PER_KM = 1000.0
FloatArray = NDArray[np.float64]


def _tracks(results: FlightResults) -> tuple[CooperativeResult, CooperativeTracks, str] | None:
    """The answer, its tracks and the algorithm that is drawn."""
    answer, data = results.answer(CooperativeResult), results.rows_of(CooperativeTracks)
    return None if answer is None or data is None else (answer, data, trusted(answer).algorithm)


def _places(data: CooperativeTracks | SessionPoints) -> FloatArray:
    return np.column_stack([data.x_m, data.y_m, data.z_m])


def session_map(results: FlightResults) -> Drawing | None:
    """Tracks from above with their 2 sigma ellipses, and the ground points."""
    found = _tracks(results)
    if found is None:
        return None
    answer, data, algorithm = found
    rows = data.algorithm == algorithm
    place, vehicle = _places(data)[rows], data.vehicle[rows]
    ellipses = _ellipses(data, rows)
    origin = plane_through(place) if answer.frame == "ecef" else None
    plane = place if origin is None else origin.from_ecef_m(place)
    stations = results.rows_of(SessionPoints)
    larger = _magnified(plane, ellipses)
    when = "at the end" if _is_crowd(answer) else f"at {ELLIPSES} times"

    def paint(figure: Any) -> None:
        axes = layout.place(figure, 18, 12, 174, 104)
        for name, colour in zip(answer.vehicle_names, _colours(answer), strict=True):
            mine = np.flatnonzero(vehicle == name)
            if not len(mine):
                continue
            north, east = plane[mine, 0] / M_PER_KM, plane[mine, 1] / M_PER_KM
            d.line(axes, east, north, colour, 1.2, label=d.label(name, 12))
            d.dots(axes, east[:1], north[:1], colour, 4.0)
            for row in mine[-1:] if _is_crowd(answer) else mine[thin(len(mine), ELLIPSES)]:
                drawn = (plane[row, :2] + larger * ellipses[row]) / M_PER_KM
                d.line(axes, drawn[:, 1], drawn[:, 0], colour, 0.6)
            if _is_crowd(answer):
                layout.beside(axes, east[0], north[0], d.label(name, 12), colour, axes.transData, "center")
        if stations is not None:
            points = _places(stations) if origin is None else origin.from_ecef_m(_places(stations))
            axes.plot(points[:, 1] / M_PER_KM, points[:, 0] / M_PER_KM, "^", color=d.INK, markersize=4.0)
            for point, name in zip(points, stations.label, strict=True):
                text = d.label(str(name), 16)
                layout.beside(axes, point[1] / M_PER_KM, point[0] / M_PER_KM, text, d.INK, axes.transData, "center")
        d.tell(axes, plane[:, 1] / M_PER_KM, plane[:, 0] / M_PER_KM, data.time_s[rows], TIME)
        axes.set_aspect("equal", adjustable="datalim")
        axes.set_xlabel("east, km")
        axes.set_ylabel("north, km")
        if not _is_crowd(answer):
            layout.legend_above(axes, 10)

    size = f", drawn {larger} times their size" if larger > 1 else ""
    caption = (
        f"Tracks from above, {title_of(algorithm)}; the dot is where each begins. 2σ ellipses "
        f"{when} of each track{size}." + (" Triangles: ground stations." if stations is not None else "")
    )
    return Drawing("Map", caption, "Tracks of the aircraft.", d.draw("cooperative-map", 112, paint), _numbers(results))


def _ellipses(data: CooperativeTracks, rows: NDArray[np.bool_]) -> FloatArray:
    """2 sigma ellipses about the origin, north and east, shape (n, 49, 2); upright where no correlation is saved."""
    north, east = data.sigma_north_m[rows], data.sigma_east_m[rows]
    return outlines(north, east, np.nan_to_num(data.correlation_north_east[rows]), 2.0)


def _magnified(plane: FloatArray, ellipses: FloatArray) -> int:
    """How many times larger ellipses are drawn so that they can be seen."""
    side = float(np.nanmax(np.nanmax(plane[:, :2], axis=0) - np.nanmin(plane[:, :2], axis=0)))
    return magnified(side, float(np.nanmedian(np.hypot(*np.moveaxis(ellipses, 2, 0)))))


def _numbers(results: FlightResults) -> tuple[str, ...]:
    found = results.rows_of(CooperativeTracks), results.rows_of(SessionPoints)
    return tuple(one.name for one in found if one is not None)


def _is_crowd(answer: CooperativeResult) -> bool:
    """Whether there are more aircraft than colours: lines are then not told apart by them."""
    return len(answer.vehicle_names) > len(d.SERIES)


def _colours(answer: CooperativeResult) -> list[str]:
    return [d.SERIES[number % len(d.SERIES)] for number in range(len(answer.vehicle_names))]


def errors(results: FlightResults) -> Drawing | None:
    """Horizontal error of each aircraft against its computed 2 sigma_r, and that of dead reckoning."""
    found = _tracks(results)
    if found is None:
        return None
    answer, data, algorithm = found
    shown = _largest(answer, algorithm)
    vehicle, of = data.vehicle, data.algorithm
    time_s, error, bound = data.time_s, data.error_m, data.two_sigma_r_m
    lines = (len(shown) + 1) // 2
    height = PANEL_MM * lines + 14.0

    def paint(figure: Any) -> None:
        for number, name in enumerate(shown):
            left, top = 14 + 90 * (number % 2), height - 8 - PANEL_MM * (number // 2)
            axes = layout.place(figure, left, top - PANEL_MM + 10, left + 72, top)
            mine, reckoned = ((vehicle == name) & (of == which) for which in (algorithm, REFERENCE))
            axes.fill_between(time_s[mine], 0.0, bound[mine], color=d.FILL, linewidth=0, label="2σ_r")
            d.line(axes, time_s[reckoned], bound[reckoned], d.FAINT, 0.8, label="2σ_r without ranges")
            if np.isfinite(error[mine]).any():
                d.line(axes, time_s[mine], error[mine], d.INS, 1.0, label="error")
            axes.set_ylim(0.0, _ceiling(bound[mine], error[mine]))
            axes.set_ylabel(f"{d.label(name, 12)}, m")
            layout.time_axis(axes, float(time_s.min()), float(time_s.max()), title=number >= len(shown) - 2, most=6)
            if not number:
                layout.legend_above(axes, 3)

    more = len(answer.vehicle_names) - len(shown)
    caption = (
        f"Horizontal error against the truth, where a log holds one, and the computed 2σ_r (shaded) of "
        f"{title_of(algorithm)}; grey: that of dead reckoning alone, where it fits in."
        + (f" The {len(shown)} with the largest 2σ_r at the end; {more} more in the table." if more else "")
    )
    alt = "Horizontal error and 2 sigma of each aircraft with time."
    return Drawing("Error against 2σ_r", caption, alt, d.draw("cooperative-errors", height, paint), _numbers(results))


def _largest(answer: CooperativeResult, algorithm: str) -> list[str]:
    """The aircraft that have a panel, in their order: of very many those with the largest 2 sigma_r at the end."""
    rows = [row for row in answer.vehicles if row.algorithm == algorithm]
    kept = {row.vehicle for row in sorted(rows, key=lambda row: -row.two_sigma_r_m)[:MOST_PANELS]}
    return [name for name in answer.vehicle_names if name in kept]


def _ceiling(*series: FloatArray) -> float:
    known = finite(*series)
    return 1.15 * float(known.max()) if known.size and known.max() > 0.0 else 1.0


def _styles(answer: CooperativeResult) -> dict[str, tuple[str, str]]:
    """Colour and label of the line of each aircraft; of a crowd the one of the poorest geometry stands out, last."""
    names = answer.vehicle_names
    if not _is_crowd(answer) or not answer.geometry:
        return {name: (colour, d.label(name, 12)) for name, colour in zip(names, _colours(answer), strict=True)}
    worst = min(answer.geometry, key=lambda row: row.determinant_median).vehicle
    others = {name: (d.FAINT, "") for name in names if name != worst}
    return {**others, worst: (d.LIMIT, f"{d.label(worst, 12)}, least median det(H'H)")}


def geometry(results: FlightResults) -> Drawing | None:
    """HDOP, determinant and smallest eigenvalue of every aircraft with time."""
    answer, data = results.answer(CooperativeResult), results.rows_of(CooperativeGeometry)
    if answer is None or data is None:
        return None
    vehicle, time_s = data.vehicle, data.time_s
    measures = ((data.hdop, "HDOP"), (data.determinant, "det(H'H)"), (data.eigenvalue, "least eigenvalue"))
    columns = [one for one in measures if np.isfinite(one[0]).any()]
    styles = _styles(answer)
    height = 42.0 * len(columns) + 12.0

    def paint(figure: Any) -> None:
        for number, (column, title) in enumerate(columns):
            top = height - 8 - 42 * number
            axes = layout.place(figure, 18, top - 34, 174, top)
            for name, (colour, told) in styles.items():
                mine = vehicle == name
                when, values = broken_at_gaps(time_s[mine], column[mine])
                d.line(axes, when, values, colour, 1.0 if told else 0.5, label=told or None)
            axes.set_ylabel(title)
            known = finite(column)
            if title == "HDOP" and known.size and known.max() > 20.0 * np.median(known):
                axes.set_yscale("log")
                plain_log(axes.yaxis, (1.0,))
            layout.time_axis(axes, float(time_s.min()), float(time_s.max()), title=number == len(columns) - 1)
            if not number:
                layout.legend_above(axes, 10)

    caption = (
        "Geometry of the sources that each aircraft hears in a frame: dilution, and determinant and least eigenvalue "
        "of H'H, horizontal directions only; a line ends where an aircraft hears none."
        + (" Grey: the other aircraft, numbers in the table." if _is_crowd(answer) else "")
    )
    svg = d.draw("cooperative-geometry", height, paint)
    return Drawing("Geometry", caption, "Geometry measures with time.", svg, ("cooperative_geometry",))


def links(results: FlightResults) -> Drawing | None:
    """Residuals of every range over their own sigma; gated ones stand out."""
    answer, data = results.answer(CooperativeResult), results.rows_of(CooperativeLinks)
    if answer is None or data is None:
        return None
    time_s, mark, receiver = data.time_s, data.mark, data.receiver
    with np.errstate(divide="ignore", invalid="ignore"):
        normal = data.innovation / data.sigma
    far = finite(np.abs(normal))
    ceiling = float(np.clip(1.1 * far.max(initial=3.0), 4.0, 12.0))

    def paint(figure: Any) -> None:
        axes = layout.place(figure, 18, 12, 174, 56)
        if _is_crowd(answer):
            d.dots(axes, time_s[mark > 0], np.clip(normal[mark > 0], -ceiling, ceiling), d.INS, label="used")
        for name, colour in () if _is_crowd(answer) else zip(answer.vehicle_names, _colours(answer), strict=True):
            mine = (receiver == name) & (mark > 0)
            d.dots(axes, time_s[mine], np.clip(normal[mine], -ceiling, ceiling), colour, label=d.label(name, 12))
        gated = mark <= 0
        if gated.any():
            d.dots(axes, time_s[gated], np.clip(normal[gated], -ceiling, ceiling), d.LIMIT, 3.0, label="gated")
        layout.limit_line(axes, NORMAL_95, "95 %")
        layout.limit_line(axes, -NORMAL_95, "")
        axes.set_ylim(-1.05 * ceiling, 1.05 * ceiling)
        axes.set_ylabel("residual over its sigma")
        layout.time_axis(axes, float(time_s.min()), float(time_s.max()))
        layout.legend_above(axes, 10)

    caption = (
        "Residuals of the ranges over their computed sigma, "
        f"{title_of(answer.default_algorithm)}{'' if _is_crowd(answer) else ', by receiver'}; values beyond "
        f"{ceiling:.0f} are drawn at the edge."
    )
    svg = d.draw("cooperative-links", 66, paint)
    return Drawing("Residuals of the links", caption, "Residuals of the ranges with time.", svg, ("cooperative_links",))
