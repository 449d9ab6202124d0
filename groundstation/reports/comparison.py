"""The page of a comparison: what differs between two flights, and their figures over each other."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from groundstation.base.failures import attempt
from groundstation.base.geodesy import north_east_m, on_earth, plan_north_east_m
from groundstation.base.normal import NORMAL_95
from groundstation.chapters.comparison import answers, findings, opening, settings
from groundstation.chapters.parts import Section
from groundstation.reports import drawing as d
from groundstation.reports import layout
from groundstation.reports.drawing import Drawing
from groundstation.reports.figures.inertial import plain_log
from groundstation.reports.page import TEMPLATES, render
from groundstation.results.comparison import Comparison
from groundstation.results.figures import FigureData, numbers
from groundstation.results.files import SavedFlight
from groundstation.results.forecast import ForecastResult

A, B = d.INS, d.GNSS
MOST = 3000  # points of a line
NEAR_M = 200_000.0  # flights that begin no further apart share one map
LINES = (  # figure, column, column of the half width and what it is multiplied by, axis, title
    ("overview", "altitude_m", None, "altitude, m", "Altitude"),
    ("overview", "ground_speed_mps", None, "ground speed, m/s", "Ground speed"),
    ("overview", "heading_deg", None, "true heading, °", "INS heading"),
    ("heading_running", "mean_deg", ("honest_half_width_deg", 1.0), "heading error, °", "Heading error, running mean"),
    ("inertial_track", "ins_error_m", None, "radial error, m", "Radial error of the INS against GNSS"),
    ("inertial_states", "north_position_m", ("north_position_sigma_m", NORMAL_95), "north, m", "North position error"),
    ("inertial_states", "east_position_m", ("east_position_sigma_m", NORMAL_95), "east, m", "East position error"),
    ("session_errors", "two_sigma_r_m", None, "m", "2σ_r as computed, worst aircraft"),
    ("session_errors", "rms_error_m", None, "m", "Horizontal error against the truth, RMS of all aircraft"),
)


def comparison_html(comparison: Comparison, a: SavedFlight, b: SavedFlight) -> str:
    """Render the page of a comparison as a complete HTML document, without parts that fail."""
    sections = (
        attempt("chapter", "answers", answers, comparison),
        attempt("chapter", "figures", _figures, comparison, a, b),
        attempt("chapter", "settings", settings, comparison),
        attempt("chapter", "findings", findings, comparison),
    )
    return render(
        "compare.html.j2",
        title=f"{comparison.a.flight_id} and {comparison.b.flight_id}",
        opening=opening(comparison),
        sections=[section for section in sections if section is not None],
        style=(TEMPLATES / "report.css").read_text(encoding="utf-8"),
    )


# ---------------------------------------------------------------------------------------------------- figures


def _figures(comparison: Comparison, a: SavedFlight, b: SavedFlight) -> Section | None:
    sides = (_Side("A", a, A), _Side("B", b, B, comparison.alignment.offset_s))
    drawings = [
        attempt("figure", "tracks", _tracks, sides),
        *(attempt("figure", f"{row[0]}.{row[1]}", _overlay, sides, *row) for row in LINES),
        attempt("figure", "growth", _growth, sides),
    ]
    parts = [drawing for drawing in drawings if drawing is not None]
    lead = "A blue, B orange; thin lines are 95 % bands."
    return Section("figures", "Figures", lead, parts) if parts else None


class _Side(NamedTuple):
    letter: str
    saved: SavedFlight
    colour: str
    offset_s: float = 0.0

    @property
    def width(self) -> float:
        """Of its lines: where both agree, A is seen behind B."""
        return 2.4 if self.letter == "A" else 1.0

    def figure(self, name: str, *columns: str) -> FigureData | None:
        """Figure data that has numbers in every column named."""
        data = self.saved.figure(name)
        has_all = data is not None and all(np.isfinite(numbers(data, column)).any() for column in columns)
        return data if has_all else None


def _overlay(
    sides: Sequence[_Side], name: str, column: str, width: tuple[str, float] | None, axis: str, title: str
) -> Drawing | None:
    """A column of both flights over the flight time of A, with its band; ``width``: its half width and a factor."""
    drawn = [(side, data) for side in sides if (data := side.figure(name, "time_s", column)) is not None]
    if not drawn:
        return None

    def paint(figure: Any) -> None:
        axes = layout.place(figure, 20, 12, 174, 54)
        times, shown = [], []
        for side, data in drawn:
            values = d.broken_at_wrap(numbers(data, column)) if column == "heading_deg" else numbers(data, column)
            half = np.full(len(data), np.nan) if width is None else width[1] * numbers(data, width[0])
            time, values, half = d.broken_at_gaps(numbers(data, "time_s") + side.offset_s, values, half)
            for edge in (values - half, values + half):
                d.line(axes, time, edge, side.colour, 0.5, MOST, alpha=0.7)
                shown.append(edge)
            d.line(axes, time, values, side.colour, side.width, MOST, label=side.letter, zorder=3)
            times.append(time)
            shown.append(values)
        # The bands of the first samples may leave the picture.
        low, high = np.percentile(d.finite(*shown), (0.0, 100.0) if width is None else (0.5, 99.5))
        axes.set_ylim(*layout.padded(float(low), float(high)))
        axes.set_ylabel(axis)
        every = d.finite(*times)
        layout.time_axis(axes, float(every.min()), float(every.max()))
        layout.legend_above(axes)

    caption = f"{title} of both flights." if len(drawn) == len(sides) else f"{title}: only {drawn[0][0].letter} has it."
    return Drawing(title, caption, f"{title} of A and B over flight time.", d.draw(f"{name}-{column}", 60, paint))


def _tracks(sides: Sequence[_Side]) -> Drawing | None:
    drawn = []
    for side in sides:
        data = side.figure("overview", "latitude_deg", "longitude_deg")
        if data is not None:
            latitude, longitude = on_earth(numbers(data, "latitude_deg"), numbers(data, "longitude_deg"))
            known = np.flatnonzero(np.isfinite(latitude))
            if known.size:
                first = float(latitude[known[0]]), float(longitude[known[0]])
                drawn.append((side, latitude, longitude, first))
    if not drawn:
        return None
    shared = drawn[0][-1]
    is_shared = bool(np.hypot(*north_east_m(*drawn[-1][-1], *shared)) <= NEAR_M)
    tracks = [
        (side, *plan_north_east_m(latitude, longitude, *(shared if is_shared else own)))
        for side, latitude, longitude, own in drawn
    ]

    def paint(figure: Any) -> None:
        axes = layout.place(figure, 20, 12, 174, 96)
        axes.set_aspect("equal", adjustable="datalim")
        for side, north, east in tracks:
            d.line(axes, east / 1000.0, north / 1000.0, side.colour, side.width, MOST, label=side.letter)
        axes.set_xlabel("east, km")
        axes.set_ylabel("north, km")
        layout.legend_above(axes)

    origin = "the first position of A" if is_shared else "the first position of each"
    caption = f"Distances north and east of {origin}, equal scales."
    return Drawing("Tracks", caption, "Map of the tracks of A and B.", d.draw("tracks", 102, paint))


def _growth(sides: Sequence[_Side]) -> Drawing | None:
    """RMS of the forecast by horizon, the shipped method and the INS without one."""
    curves = []
    for side in sides:
        forecast = side.saved.results.answer(ForecastResult)
        default = forecast.default_method if forecast else ""
        for method, style in ((default, "-"), ("raw_ins", ":")):
            data = side.figure("forecast_growth", "horizon_min", f"{method}_rms_m")
            if data is not None:
                name = f"{side.letter}: {d.label(method.replace('_', ' '))}"
                curves.append(
                    (numbers(data, "horizon_min"), numbers(data, f"{method}_rms_m"), name, side.colour, style)
                )
    if not curves:
        return None

    def paint(figure: Any) -> None:
        axes = layout.place(figure, 20, 12, 174, 64)
        for horizon, rms, name, colour, style in curves:
            d.line(axes, horizon, np.where(rms > 0.0, rms, np.nan), colour, 1.2, label=name, linestyle=style)
        axes.set_xscale("log")
        axes.set_yscale("log")
        plain_log(axes.xaxis)
        plain_log(axes.yaxis)
        axes.set_xlabel("horizon, min")
        axes.set_ylabel("RMS radial error, m")
        layout.legend_above(axes, 4)

    caption = "Root mean square of the radial error over all replayed starts; dotted: the INS without a forecast."
    return Drawing("Forecast", caption, "RMS of the forecast error of A and B by horizon.", d.draw("growth", 70, paint))
