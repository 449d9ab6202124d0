"""Figures of the magnetic deviation: by heading, on the part held out, the figure flown, its branches, the modulus."""

from typing import Any

import numpy as np

from groundstation.base.geodesy import on_earth, plan_north_east_m
from groundstation.base.normal import NORMAL_95
from groundstation.chapters.wording import number
from groundstation.plots.ranges import broken_at_gaps, padded, windows
from groundstation.reports import drawing as d
from groundstation.reports import layout
from groundstation.reports.drawing import Drawing
from groundstation.reports.frames import TIME
from groundstation.results.arrays.flight import Overview
from groundstation.results.arrays.magnetic import MagneticCurves, MagneticModulus, MagneticSamples, MagneticTable
from groundstation.results.flight import FlightResults
from groundstation.results.magnetic import METHOD_TITLES, MagneticResult

METHOD_COLOURS = dict(zip(METHOD_TITLES, (d.INS, d.USED, "#cc79a7"), strict=True))
RIGHT, LEFT = d.GNSS, d.INS
MARGIN_S = 20.0  # flight shown before and after the figure


def _heading_axis(axes: Any) -> None:
    axes.set_xlim(0.0, 360.0)
    axes.set_xticks(range(0, 361, 30))
    axes.set_xlabel("magnetic heading as read, °")


def deviation(results: FlightResults) -> Drawing | None:
    """Deviation against heading by each method, with bands."""
    curves, table = results.rows_of(MagneticCurves), results.rows_of(MagneticTable)
    if curves is None:
        return None
    heading = curves.uncorrected_magnetic_heading_deg

    def paint(figure: Any) -> None:
        axes = layout.place(figure, 16, 12, 174, 74)
        if table is not None:
            bins, values = table.uncorrected_magnetic_heading_deg, table.deviation_deg
            d.dots(axes, bins, values, d.UNUSED, 3.0, label="table, bins of 1°")
        for name, title in METHOD_TITLES.items():
            if name not in curves.deviation_deg or name not in curves.sigma_deg:
                continue
            value, half = curves.deviation_deg[name], NORMAL_95 * curves.sigma_deg[name]
            if not np.isfinite(value).any():
                continue
            colour = METHOD_COLOURS[name]
            axes.fill_between(heading, value - half, value + half, color=colour, alpha=0.15, linewidth=0)
            d.line(axes, heading, value, colour, 1.3, label=title)
        axes.axhline(0.0, color=d.FAINT, linewidth=0.6)
        axes.set_ylabel("deviation, to be added, °")
        _heading_axis(axes)
        layout.legend_above(axes, 4)

    caption = (
        "To be added to the reading, east positive; lines by A to E of each method in level flight, shaded ± 1.96 σ. "
        "The modulus, where it is drawn, does not show A. Grey: the table bin by bin, with the bias of its bank."
    )
    alt = "Deviation against magnetic heading, one curve for each method."
    return Drawing("Deviation by heading", caption, alt, d.draw("magnetic-deviation", 82, paint), ("magnetic_curves",))


def held_out(results: FlightResults) -> Drawing | None:
    """Error of the magnetic heading where no fit has seen, before and after the recommended correction."""
    answer, data = results.answer(MagneticResult), results.rows_of(MagneticSamples)
    if answer is None or data is None or not (mine := data.part == "held out").any():
        return None
    method = answer.recommended_method
    time, heading = data.time_s[mine], data.uncorrected_magnetic_heading_deg[mine]
    before, after = data.error_before_deg[mine], data.error_after_deg(method)[mine]
    shown = ((before, d.UNUSED, "before"), (after, METHOD_COLOURS[method], "after"))

    def paint(figure: Any) -> None:
        left, right = layout.place(figure, 16, 12, 92, 62), layout.place(figure, 106, 12, 174, 62)
        for values, colour, name in shown:
            d.dots(left, time, values, colour, 1.6, 2500, label=name)
            d.dots(right, heading, values, colour, 1.6, 2500)
        for axes in (left, right):
            axes.axhline(0.0, color=d.FAINT, linewidth=0.6)
        left.set_ylabel("error of magnetic heading, °")
        layout.time_axis(left, *padded(float(time.min()), float(time.max())), most=5)
        _heading_axis(right)
        right.set_xticks(range(0, 361, 60))
        layout.legend_above(left, 2)

    caption = (
        f"Level flight that no fit used, n = {number(len(time), 0)} drawn, against flight time and heading; after: by "
        f"the {METHOD_TITLES[method]}. Judged by the same INS and declination: their errors common to the whole flight "
        "do not show."
    )
    alt = "Residual heading error before and after correction on the held-out part."
    sketch = d.draw("magnetic-held-out", 70, paint)
    return Drawing("Error on data that no fit used", caption, alt, sketch, ("magnetic_samples",))


def track(results: FlightResults) -> Drawing | None:
    """The figures as flown, coloured by branch."""
    answer, data = results.answer(MagneticResult), results.rows_of(Overview)
    turns = [turn for turn in answer.turns if turn.state == "used"] if answer else []
    if data is None or not turns:
        return None
    time = data.time_s
    near = (time >= min(turn.start_s for turn in turns) - MARGIN_S) & (
        time <= max(turn.end_s for turn in turns) + MARGIN_S
    )
    latitude, longitude = on_earth(data.latitude_deg[near], data.longitude_deg[near])
    known = np.flatnonzero(np.isfinite(latitude) & np.isfinite(longitude))
    if not known.size:
        return None
    north, east = plan_north_east_m(latitude, longitude, float(latitude[known[0]]), float(longitude[known[0]]))
    time = time[near]

    def paint(figure: Any) -> None:
        axes = layout.place(figure, 16, 12, 174, 84)
        axes.set_aspect("equal", adjustable="datalim")
        d.line(axes, east / 1e3, north / 1e3, d.UNUSED, 0.9)
        d.tell(axes, east / 1e3, north / 1e3, time, TIME)
        named: set[str] = set()
        for turn in turns:
            mine = (time >= turn.start_s) & (time <= turn.end_s)
            colour, name = (RIGHT, "right turn") if turn.bank_deg > 0.0 else (LEFT, "left turn")
            shown = None if name in named else name
            x, y = (np.where(mine, values, np.nan) / 1e3 for values in (east, north))
            d.line(axes, x, y, colour, 2.0, label=shown)
            named.add(name)
        axes.set_xlabel("east, km")
        axes.set_ylabel("north, km")
        layout.legend_above(axes, 2)

    caption = "Ground track in wind from before the first used turn until after the last one, equal scales."
    alt = "Map of the figures flown, right and left turns in two colours."
    return Drawing("Figures as flown", caption, alt, d.draw("magnetic-track", 90, paint), ("overview",))


def branches(results: FlightResults) -> Drawing | None:
    """Compass error on either branch and their average, declination in it."""
    samples, table = results.rows_of(MagneticSamples), results.rows_of(MagneticTable)
    if samples is None or table is None:
        return None
    part, heading = samples.part, samples.uncorrected_magnetic_heading_deg
    error, bins = samples.compass_error_deg, table.uncorrected_magnetic_heading_deg
    average, filled = table.compass_error_deg, table.is_interpolated

    def paint(figure: Any) -> None:
        axes = layout.place(figure, 16, 12, 174, 70)
        for name, colour in (("right turn", RIGHT), ("left turn", LEFT)):
            mine = part == name
            d.dots(axes, heading[mine], error[mine], colour, 1.4, 2500, label=name)
        d.line(axes, bins, average, d.INK, 1.4, label="average of both")
        d.dots(axes, bins[filled], average[filled], d.LIMIT, 3.0, label="interpolated")
        axes.set_ylabel("magnetic − true heading, °")
        _heading_axis(axes)
        layout.legend_above(axes, 4)

    caption = (
        "Magnetic minus INS true heading, declination in it, as in the patent. Errors that are odd in bank cancel in "
        f"the average; one branch is never used alone. Bins interpolated: {number(int(filled.sum()), 0)} of 360."
    )
    alt = "Compass error against magnetic heading on right and left turns with their average."
    names = ("magnetic_samples", "magnetic_table")
    return Drawing("Both branches", caption, alt, d.draw("magnetic-branches", 78, paint), names)


def modulus(results: FlightResults) -> Drawing | None:
    """Modulus of the field on the figures before and after it is freed of the iron."""
    answer, data = results.answer(MagneticResult), results.rows_of(MagneticModulus)
    if answer is None or data is None:
        return None
    time = data.time_s
    spans = windows(time)
    horizontal, down = answer.declination.horizontal_nt, answer.declination.down_nt

    def paint(figure: Any) -> None:
        panels = layout.time_panels(figure, (16, 12, 174, 62), spans)
        for axes, (low, high) in zip(panels, spans, strict=True):
            mine = (time >= low) & (time <= high)
            for values, colour, name in (
                (data.before_nt, d.UNUSED, "as read"),
                *((after, METHOD_COLOURS[name], METHOD_TITLES[name]) for name, after in data.freed().items()),
            ):
                if np.isfinite(values).any():
                    broken_time, broken = broken_at_gaps(time[mine], values[mine] / 1e3)
                    d.line(axes, broken_time, broken, colour, 1.0, label=name)
            if horizontal is not None and down is not None:
                layout.limit_line(axes, float(np.hypot(horizontal, down)) / 1e3, "field of the model")
        panels[0].set_ylabel("modulus of the field, µT")
        layout.legend_above(panels[-1], 4)

    caption = (
        "Readings of the figures alone. If the modulus still waves after the fit, the model does not describe all iron."
    )
    alt = "Modulus of the magnetic field over flight time before and after the fit."
    return Drawing("Modulus of the field", caption, alt, d.draw("magnetic-modulus", 70, paint), ("magnetic_modulus",))
