"""Figures of the chapter on navigation between aircraft: map, errors against sigma, geometry, residuals."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from groundstation.base.local_frame import plane_through
from groundstation.base.normal import NORMAL_95
from groundstation.chapters.cooperative import REFERENCE, title_of, trusted
from groundstation.reports import drawing as d
from groundstation.reports.drawing import Drawing
from groundstation.reports.figures.inertial import plain_log
from groundstation.results.cooperative import CooperativeResult
from groundstation.results.figures import FigureData, numbers, texts
from groundstation.results.flight import FlightResults

ELLIPSES = 8  # of each track
SEEN_SHARE, MAGNIFIED = 0.03, (1, 2, 5, 10, 20, 50, 100)
MOST_PANELS = 8
PANEL_MM = 38.0
M_PER_KM = 1000.0
ROUND = np.linspace(0.0, 2.0 * np.pi, 49)
FloatArray = NDArray[np.float64]


def _tracks(results: FlightResults) -> tuple[CooperativeResult, FigureData, str] | None:
    """The answer, its tracks and the algorithm that is drawn."""
    answer, data = results.answer(CooperativeResult), results.figure_with_rows("cooperative_tracks")
    return None if answer is None or data is None else (answer, data, trusted(answer).algorithm)


def _places(data: FigureData) -> FloatArray:
    return np.column_stack([numbers(data, f"{axis}_m") for axis in "xyz"])


def session_map(results: FlightResults) -> Drawing | None:
    """Tracks from above with their 2 sigma ellipses, and the ground points."""
    found = _tracks(results)
    if found is None:
        return None
    answer, data, algorithm = found
    rows = texts(data, "algorithm") == algorithm
    place, vehicle = _places(data)[rows], texts(data, "vehicle")[rows]
    north_m, east_m = (2.0 * numbers(data, f"sigma_{axis}_m")[rows] for axis in ("north", "east"))
    origin = plane_through(place) if answer.frame == "ecef" else None
    plane = place if origin is None else origin.from_ecef_m(place)
    stations = results.figure_with_rows("session_points")
    larger = _magnified(plane, north_m, east_m)

    def paint(figure: Any) -> None:
        axes = d.place(figure, 18, 12, 174, 104)
        for name, colour in zip(answer.vehicle_names, _colours(answer), strict=True):
            mine = np.flatnonzero(vehicle == name)
            if not len(mine):
                continue
            d.line(axes, plane[mine, 1] / M_PER_KM, plane[mine, 0] / M_PER_KM, colour, 1.2, label=d.label(name, 12))
            d.dots(axes, plane[mine[:1], 1] / M_PER_KM, plane[mine[:1], 0] / M_PER_KM, colour, 4.0)
            for row in mine[d.thin(len(mine), ELLIPSES)]:
                east = (plane[row, 1] + larger * east_m[row] * np.cos(ROUND)) / M_PER_KM
                north = (plane[row, 0] + larger * north_m[row] * np.sin(ROUND)) / M_PER_KM
                d.line(axes, east, north, colour, 0.6)
        if stations is not None:
            points = _places(stations) if origin is None else origin.from_ecef_m(_places(stations))
            axes.plot(points[:, 1] / M_PER_KM, points[:, 0] / M_PER_KM, "^", color=d.INK, markersize=4.0)
            for point, name in zip(points, texts(stations, "name"), strict=True):
                text = d.label(str(name), 16)
                d.beside(axes, point[1] / M_PER_KM, point[0] / M_PER_KM, text, d.INK, axes.transData, "center")
        axes.set_aspect("equal", adjustable="datalim")
        axes.set_xlabel("east, km")
        axes.set_ylabel("north, km")
        d.legend_above(axes, 10)

    size = f", drawn {larger} times their size" if larger > 1 else ""
    caption = (
        f"Tracks from above, {title_of(algorithm)}; the dot is where each begins. Ellipses: 2σ north and east, at "
        f"{ELLIPSES} times of each track{size}." + (" Triangles: ground stations." if stations is not None else "")
    )
    return Drawing("Map", caption, "Tracks of the aircraft.", d.draw("cooperative-map", 112, paint), _numbers(results))


def _magnified(plane: FloatArray, north_m: FloatArray, east_m: FloatArray) -> int:
    """How many times larger ellipses are drawn so that they can be seen: 1, or 2, 5, 10 ... times."""
    half = float(np.nanmedian(np.hypot(north_m, east_m)))
    side = float(np.nanmax(np.nanmax(plane[:, :2], axis=0) - np.nanmin(plane[:, :2], axis=0)))
    wanted = SEEN_SHARE * side / half if half > 0.0 else 1.0
    return max((step for step in MAGNIFIED if step <= wanted), default=1)


def _numbers(results: FlightResults) -> tuple[str, ...]:
    names = ("cooperative_tracks", "session_points")
    return tuple(name for name in names if results.figure_with_rows(name) is not None)


def _colours(answer: CooperativeResult) -> list[str]:
    return [d.SERIES[number % len(d.SERIES)] for number in range(len(answer.vehicle_names))]


def errors(results: FlightResults) -> Drawing | None:
    """Horizontal error of each aircraft against its computed 2 sigma_r, and that of dead reckoning."""
    found = _tracks(results)
    if found is None:
        return None
    answer, data, algorithm = found
    shown = answer.vehicle_names[:MOST_PANELS]
    vehicle, of = texts(data, "vehicle"), texts(data, "algorithm")
    time_s, error, bound = (numbers(data, name) for name in ("time_s", "error_m", "two_sigma_r_m"))
    lines = (len(shown) + 1) // 2
    height = PANEL_MM * lines + 14.0

    def paint(figure: Any) -> None:
        for number, name in enumerate(shown):
            left, top = 14 + 90 * (number % 2), height - 8 - PANEL_MM * (number // 2)
            axes = d.place(figure, left, top - PANEL_MM + 10, left + 72, top)
            mine, reckoned = ((vehicle == name) & (of == which) for which in (algorithm, REFERENCE))
            axes.fill_between(time_s[mine], 0.0, bound[mine], color=d.FILL, linewidth=0, label="2σ_r")
            d.line(axes, time_s[reckoned], bound[reckoned], d.FAINT, 0.8, label="2σ_r without ranges")
            if np.isfinite(error[mine]).any():
                d.line(axes, time_s[mine], error[mine], d.INS, 1.0, label="error")
            axes.set_ylim(0.0, _ceiling(bound[mine], error[mine]))
            axes.set_ylabel(f"{d.label(name, 12)}, m")
            d.time_axis(axes, float(time_s.min()), float(time_s.max()), title=number >= len(shown) - 2, most=6)
            if not number:
                d.legend_above(axes, 3)

    more = len(answer.vehicle_names) - len(shown)
    caption = (
        f"Horizontal error against the truth, where a log holds one, and the computed 2σ_r (shaded) of "
        f"{title_of(algorithm)}; grey: that of dead reckoning alone, where it fits in."
        + (f" {more} more aircraft in the table." if more else "")
    )
    alt = "Horizontal error and 2 sigma of each aircraft with time."
    return Drawing("Error against 2σ_r", caption, alt, d.draw("cooperative-errors", height, paint), _numbers(results))


def _ceiling(*series: FloatArray) -> float:
    known = d.finite(*series)
    return 1.15 * float(known.max()) if known.size and known.max() > 0.0 else 1.0


def geometry(results: FlightResults) -> Drawing | None:
    """HDOP, determinant and smallest eigenvalue of every aircraft with time."""
    answer, data = results.answer(CooperativeResult), results.figure_with_rows("cooperative_geometry")
    if answer is None or data is None:
        return None
    vehicle, time_s = texts(data, "vehicle"), numbers(data, "time_s")
    measures = (("hdop", "HDOP"), ("determinant", "det(H'H)"), ("eigenvalue", "least eigenvalue"))
    columns = [one for one in measures if np.isfinite(numbers(data, one[0])).any()]
    height = 42.0 * len(columns) + 12.0

    def paint(figure: Any) -> None:
        for number, (column, title) in enumerate(columns):
            top = height - 8 - 42 * number
            axes = d.place(figure, 18, top - 34, 174, top)
            for name, colour in zip(answer.vehicle_names, _colours(answer), strict=True):
                mine = vehicle == name
                when, values = d.broken_at_gaps(time_s[mine], numbers(data, column)[mine])
                d.line(axes, when, values, colour, 1.0, label=d.label(name, 12))
            axes.set_ylabel(title)
            known = d.finite(numbers(data, column))
            if column == "hdop" and known.size and known.max() > 20.0 * np.median(known):
                axes.set_yscale("log")
                plain_log(axes.yaxis, (1.0,))
            d.time_axis(axes, float(time_s.min()), float(time_s.max()), title=number == len(columns) - 1)
            if not number:
                d.legend_above(axes, 10)

    caption = (
        "Geometry of the sources that each aircraft hears in a frame: dilution, and determinant and least eigenvalue "
        "of H'H, horizontal directions alone; a line ends where an aircraft hears nothing."
    )
    svg = d.draw("cooperative-geometry", height, paint)
    return Drawing("Geometry", caption, "Geometry measures with time.", svg, ("cooperative_geometry",))


def links(results: FlightResults) -> Drawing | None:
    """Residuals of every range over their own sigma; gated ones stand out."""
    answer, data = results.answer(CooperativeResult), results.figure_with_rows("cooperative_links")
    if answer is None or data is None:
        return None
    time_s, mark, receiver = numbers(data, "time_s"), numbers(data, "mark"), texts(data, "receiver")
    with np.errstate(divide="ignore", invalid="ignore"):
        normal = numbers(data, "innovation") / numbers(data, "sigma")
    far = d.finite(np.abs(normal))
    ceiling = float(np.clip(1.1 * far.max(initial=3.0), 4.0, 12.0))

    def paint(figure: Any) -> None:
        axes = d.place(figure, 18, 12, 174, 56)
        for name, colour in zip(answer.vehicle_names, _colours(answer), strict=True):
            mine = (receiver == name) & (mark > 0)
            d.dots(axes, time_s[mine], np.clip(normal[mine], -ceiling, ceiling), colour, label=d.label(name, 12))
        gated = mark <= 0
        if gated.any():
            d.dots(axes, time_s[gated], np.clip(normal[gated], -ceiling, ceiling), d.LIMIT, 3.0, label="gated")
        d.limit_line(axes, NORMAL_95, "95 %")
        d.limit_line(axes, -NORMAL_95, "")
        axes.set_ylim(-1.05 * ceiling, 1.05 * ceiling)
        axes.set_ylabel("residual over its sigma")
        d.time_axis(axes, float(time_s.min()), float(time_s.max()))
        d.legend_above(axes, 10)

    caption = (
        f"Residuals of the ranges over their computed sigma, {title_of(answer.default_algorithm)}, by receiver; what "
        f"is beyond {ceiling:.0f} is drawn at the edge."
    )
    svg = d.draw("cooperative-links", 66, paint)
    return Drawing("Residuals of the links", caption, "Residuals of the ranges with time.", svg, ("cooperative_links",))
