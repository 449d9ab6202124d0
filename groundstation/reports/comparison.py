"""The page of a comparison: what differs between two flights, and their figures over each other."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from groundstation.base.failures import attempt
from groundstation.base.geodesy import north_east_m, on_earth, plan_north_east_m
from groundstation.chapters.comparison import answers, findings, opening, settings
from groundstation.chapters.parts import Section
from groundstation.chapters.plots.comparison import NEAR_M, OVERLAYS, Overlay
from groundstation.plots.ranges import broken_at_gaps, finite, padded
from groundstation.reports import drawing as d
from groundstation.reports import layout
from groundstation.reports.drawing import Drawing
from groundstation.reports.figures.inertial import plain_log
from groundstation.reports.page import TEMPLATES, render
from groundstation.results.arrays.flight import Overview
from groundstation.results.arrays.forecast import ForecastGrowth
from groundstation.results.comparison import Comparison
from groundstation.results.files import SavedFlight
from groundstation.results.forecast import ForecastResult

A, B = d.INS, d.GNSS
MOST = 3000  # points of a line


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
        *(attempt("figure", line.name, _overlay, sides, line) for line in OVERLAYS),
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


def _overlay(sides: Sequence[_Side], told: Overlay[Any]) -> Drawing | None:
    """A curve of both flights over the flight time of A, with its band."""
    drawn = [(side, curve) for side in sides if (curve := told.of(side.saved)) is not None]
    if not drawn:
        return None
    title, has_band = told.title, any(curve.half is not None for _, curve in drawn)

    def paint(figure: Any) -> None:
        axes = layout.place(figure, 20, 12, 174, 54)
        times, shown = [], []
        for side, curve in drawn:
            unknown = np.full(len(curve.time_s), np.nan)
            known = (unknown if one is None else one for one in (curve.values, curve.half))
            time, values, half = broken_at_gaps(curve.time_s + side.offset_s, *known)
            for edge in (values - half, values + half):
                d.line(axes, time, edge, side.colour, 0.5, MOST, alpha=0.7)
                shown.append(edge)
            d.line(axes, time, values, side.colour, side.width, MOST, label=side.letter, zorder=3)
            times.append(time)
            shown.append(values)
        # The bands of the first samples may leave the picture.
        low, high = np.percentile(finite(*shown), (0.5, 99.5) if has_band else (0.0, 100.0))
        axes.set_ylim(*padded(float(low), float(high)))
        axes.set_ylabel(told.axis)
        every = finite(*times)
        layout.time_axis(axes, float(every.min()), float(every.max()))
        layout.legend_above(axes)

    caption = f"{title} of both flights." if len(drawn) == len(sides) else f"{title}: only {drawn[0][0].letter} has it."
    return Drawing(title, caption, f"{title} of A and B over flight time.", d.draw(told.name, 60, paint))


def _tracks(sides: Sequence[_Side]) -> Drawing | None:
    drawn = []
    for side in sides:
        data = side.saved.rows_of(Overview)
        if data is not None:
            latitude, longitude = on_earth(data.latitude_deg, data.longitude_deg)
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
        data = side.saved.rows_of(ForecastGrowth)
        for method, style in ((default, "-"), ("raw_ins", ":")):
            rms_m = None if data is None else data.rms_m.get(method)
            if data is not None and rms_m is not None and np.isfinite(rms_m).any():
                name = f"{side.letter}: {d.label(method.replace('_', ' '))}"
                curves.append((data.horizon_min, rms_m, name, side.colour, style))
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
