"""Figures of the comparison with a reference: errors in the band claimed, plan view, claimed against seen."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from groundstation.base.normal import NORMAL_95
from groundstation.chapters.wording import MINUS
from groundstation.plots.ranges import broken_at_gaps, finite, padded
from groundstation.reports import drawing as d
from groundstation.reports import layout
from groundstation.reports.drawing import Drawing
from groundstation.results.arrays.reference import ReferenceErrors, ReferenceTrack
from groundstation.results.flight import FlightResults
from groundstation.results.reference import ReferenceResult, title_of

FloatArray = NDArray[np.float64]
COLOURS = {"reference": d.INK, "gnss": d.GNSS, "ins": d.INS, "corrected": d.USED, "smoothed": "#cc79a7"}
PANEL_MM, GAP_MM = 26.0, 7.0
BAND_SEEN = 3.0  # a band may make an axis so many times as long as its errors do


def errors(results: FlightResults, of: str) -> Drawing | None:
    """Errors of one subject and quantity over time, in the band of 95 % that it and the reference claim."""
    subject, _, quantity = of.partition(" ")
    data = results.rows_of(ReferenceErrors)
    if data is None:
        return None
    own = data.where(data.subject == subject)
    panels = [panel for panel in _panels(own, quantity) if np.isfinite(panel.error).any()]
    if not panels:
        return None
    time = own.time_s

    def paint(figure: Any) -> None:
        for place, panel in enumerate(panels):
            bottom = 12.0 + (len(panels) - 1 - place) * (PANEL_MM + GAP_MM)
            axes = layout.place(figure, 18, bottom, 174, bottom + PANEL_MM)
            _paint(axes, time, panel.error, panel.half, COLOURS.get(subject.partition(".")[0], d.USED))
            axes.set_ylabel(panel.title)
            layout.time_axis(axes, float(time.min()), float(time.max()), title=place == len(panels) - 1)
            if place == 0:
                layout.legend_above(axes)

    has_band = any(np.isfinite(panel.half).any() for panel in panels)
    claimed = "Shaded: the 95 % that it and the reference claim together." if has_band else "It claims no σ."
    height = 12.0 + len(panels) * (PANEL_MM + GAP_MM)
    name = title_of(subject)
    caption = f"{name} {MINUS} reference. {claimed}"
    alt = f"Errors of {name} in {quantity} against the reference over flight time."
    svg = d.draw(f"reference-{subject}-{quantity}", height, paint)
    return Drawing(f"{name}: {quantity} against the reference", caption, alt, svg, ("reference_errors",))


@dataclass(frozen=True)
class _Panel:
    """Errors along one axis, its title, and half of the 95 % that are claimed."""

    title: str
    error: FloatArray
    half: FloatArray


def _panels(data: ReferenceErrors, quantity: str) -> tuple[_Panel, ...]:
    """Axes of a quantity; a sigma claimed of several axes together is shared out among them."""
    if quantity == "position":
        across = NORMAL_95 / np.sqrt(2.0) * data.horizontal_sigma_m
        return (
            _Panel("north, m", data.north_error_m, across),
            _Panel("east, m", data.east_error_m, across),
            _Panel("up, m", data.up_error_m, NORMAL_95 * data.vertical_sigma_m),
        )
    if quantity == "velocity":
        across = NORMAL_95 / np.sqrt(2.0) * data.velocity_sigma_mps
        return _Panel("north, m/s", data.north_error_mps, across), _Panel("east, m/s", data.east_error_mps, across)
    return (
        _Panel("roll, °", data.roll_error_deg, NORMAL_95 * data.roll_sigma_deg),
        _Panel("pitch, °", data.pitch_error_deg, NORMAL_95 * data.pitch_sigma_deg),
        _Panel("heading, °", data.heading_error_deg, NORMAL_95 * data.true_heading_sigma_deg),
    )


def _paint(axes: Any, time: FloatArray, values: FloatArray, half: FloatArray, colour: str) -> None:
    axes.axhline(0.0, color=d.FAINT, linewidth=0.6, zorder=1)
    if np.isfinite(half).any():
        broken, low, high = broken_at_gaps(time, -half, half)
        axes.fill_between(broken, low, high, color=d.FAINT, alpha=0.22, linewidth=0, label="95 % claimed")
    broken, line = broken_at_gaps(time, values)
    d.line(axes, broken, line, colour, 1.0, zorder=2, label="error")
    shown = finite(values)
    reach = float(np.abs(shown).max()) if shown.size else 1.0
    claimed = finite(half)
    most = min(float(claimed.max()), BAND_SEEN * reach) if claimed.size else 0.0
    if shown.size:
        axes.set_ylim(*padded(min(float(shown.min()), -most), max(float(shown.max()), most), 0.08))


def track(results: FlightResults) -> Drawing | None:
    """Plan view of the reference and of every subject."""
    data = results.rows_of(ReferenceTrack)
    if data is None:
        return None
    of, north, east = data.subject, data.place_north_m, data.place_east_m
    names = list(dict.fromkeys(of.tolist()))
    known = finite(north, east)
    if not known.size:
        return None
    scale, unit = (1e-3, "km") if float(np.ptp(known)) > 3_000.0 else (1.0, "m")

    def paint(figure: Any) -> None:
        axes = layout.place(figure, 18, 12, 174, 92)
        axes.set_aspect("equal", adjustable="datalim")
        for name in names:
            mine = of == name
            colour = COLOURS.get(name.partition(".")[0], d.USED)
            label = "reference" if name == "reference" else title_of(name)
            width, order = (2.6, 1.5) if name == "reference" else (1.0, 2.0)
            shade = "#c3c9d0" if name == "reference" else colour
            d.line(axes, scale * east[mine], scale * north[mine], shade, width, zorder=order, label=label)
        axes.set_xlabel(f"east, {unit}")
        axes.set_ylabel(f"north, {unit}")
        layout.legend_above(axes)

    caption = "Origin: where the reference begins. All position errors are shown, constant ones too."
    alt = "Plan view of the reference and of what was recorded and estimated."
    return Drawing("Plan view", caption, alt, d.draw("reference-track", 102, paint), ("reference_track",))


def claims(results: FlightResults) -> Drawing | None:
    """Share of the errors inside the 95 % claimed, with its interval."""
    answer = results.answer(ReferenceResult)
    if answer is None or not answer.claims:
        return None
    rows = answer.claims
    height = 16.0 + 6.0 * len(rows)

    def paint(figure: Any) -> None:
        axes = layout.place(figure, 66, 12, 174, height - 2.0)
        for place, row in enumerate(rows):
            colour = "#b3261e" if row.state == "too_sure" else d.USED if row.state == "consistent" else d.FAINT
            axes.plot([100.0 * bound for bound in row.confidence95], [place, place], color=colour, linewidth=2.4)
            axes.plot([100.0 * row.share_inside95], [place], "o", color=colour, markersize=4.5)
        layout.limit_line(axes, 95.0, "", vertical=True)
        axes.set_yticks(range(len(rows)), [_name(row.subject, row.quantity, row.axis) for row in rows])
        axes.set_ylim(len(rows) - 0.5, -0.5)
        axes.grid(axis="y", visible=False)
        axes.set_xlim(-2.0, 102.0)
        axes.set_xlabel("seen inside the 95 % claimed, %")

    caption = (
        "Dot: share of the errors inside the 95 % that subject and reference claim together; bar: its 95 % interval by "
        "the number of independent samples. Green is consistent with the dashed 95 %, red too sure, grey cannot be "
        "judged or is too careful."
    )
    alt = "Share of the errors inside the claimed 95 % with intervals, one row for each claim."
    return Drawing("Claimed against seen", caption, alt, d.draw("reference-claims", height, paint))


def _name(subject: str, quantity: str, axis: str) -> str:
    return d.label(f"{title_of(subject)}, {axis if quantity == 'attitude' else f'{quantity} {axis}'}", 44)
