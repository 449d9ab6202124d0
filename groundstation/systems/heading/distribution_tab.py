"""Density of the heading error as bars: the growing density over the final one.

Rerun has no x-y plots: the fitted normal is drawn as hairline bars. An invisible bar as high as the highest step keeps
the axes still while one scrubs. Rerun takes the abscissa of a bar for its left edge.
"""

from collections.abc import Iterator
from itertools import pairwise

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from groundstation.results.flight import FlightResults
from groundstation.systems.heading.arrays import HeadingDistribution, HeadingGrowth, HeadingNormal
from groundstation.viewer import colours
from groundstation.viewer.colours import NO_WIDTH, UNSEEN, Colour
from groundstation.viewer.recorder import FLIGHT_TIME, UTC, Recorder
from groundstation.viewer.series import FloatArray

PATH = "distribution"
HAIRLINE = 1.0  # of the distance between two points of the fitted normal
SLIM = 0.5  # of a bin: what grows stands before what it grows into
CEILING = 2.0  # highest bar of the growing density, in peaks of the final one
BEHIND, MIDDLE, FRONT = 100, 100, 255  # opacity; Rerun draws in alphabetical order of the entities


def heading_error(recorder: Recorder, results: FlightResults) -> list[rrb.View]:
    """Log the density of the differences d as it grows with time.

    The final density and the fitted normal lie behind it.
    """
    final = results.rows_of(HeadingDistribution)
    if final is None:
        return []
    low, high = final.bin_low_deg, final.bin_high_deg
    width = high - low
    density = final.density_per_deg
    peak = float(np.nanmax(density))
    normal = results.rows_of(HeadingNormal)
    if normal is not None:
        x, y = normal.difference_deg, normal.density_per_deg
        _hairlines(recorder, "fitted_normal", x, y)
        peak = max(peak, float(np.nanmax(y)))
    _bars(recorder, "samples_all", density, low, width, (*colours.GREY[:3], MIDDLE))
    growth = results.rows_of(HeadingGrowth)
    if growth is not None:
        highest = _growing(recorder, growth, float(np.median(width)), CEILING * peak)
        middle = np.array([0.5 * float(np.mean(low + high))])
        _bars(recorder, "axis_top", np.array([max(highest, peak)]), middle, np.array([NO_WIDTH]), UNSEEN)
    name = "Density of d, 1/deg (grey all, green so far, red normal)"
    hidden = rrb.PlotLegend(visible=False)  # it would name the invisible bar
    return [rrb.BarChartView(name=name, origin=f"/{PATH}", plot_legend=hidden)]


def _steps(growth: HeadingGrowth) -> Iterator[tuple[float, FloatArray, FloatArray]]:
    step = growth.step
    starts = [0, *(np.flatnonzero(step[1:] != step[:-1]) + 1).tolist(), len(step)]
    for start, end in pairwise(starts):
        part = slice(start, end)
        yield float(growth.time_s[start]), growth.bin_center_deg[part], growth.density_per_deg[part]


def _growing(recorder: Recorder, growth: HeadingGrowth, bin_width: float, ceiling: float) -> float:
    """Log one bar chart per step; return the highest bar.

    The SDK drops bar charts sent as columns. The first few steps are left out while a bar of some later one rises above
    the ceiling: of ten samples three may share a bin, and an axis that has to hold such a bar flattens the rest.
    """
    steps = list(_steps(growth))
    peaks = np.array([float(np.nanmax(density, initial=0.0)) for _, _, density in steps])
    too_high = np.flatnonzero(peaks > ceiling)
    first = int(too_high[-1]) + 1 if too_high.size else 0
    stream, bins = recorder.stream, np.zeros(0)
    for time_s, centre, density in steps[first:]:
        time_ns = int(recorder.time_ns(time_s))
        stream.set_time(FLIGHT_TIME, duration=np.timedelta64(time_ns - recorder.start_ns, "ns"))
        if recorder.has_utc:
            stream.set_time(UTC, timestamp=np.datetime64(time_ns, "ns"))
        if np.array_equal(centre, bins):  # what does not change holds from the first chart on
            bars = rr.BarChart.from_fields(values=density)
        else:
            width = np.full(len(centre), SLIM * bin_width)
            left, bins = centre - 0.5 * width, centre
            bars = rr.BarChart(density, abscissa=left, widths=width, color=(*colours.ANSWER[:3], FRONT))
        stream.log(f"{PATH}/samples_so_far", bars)
    stream.reset_time()
    return float(peaks[first:].max(initial=0.0))


def _bars(
    recorder: Recorder, name: str, height: FloatArray, left: FloatArray, width: FloatArray, colour: Colour
) -> None:
    recorder.static(f"{PATH}/{name}", rr.BarChart(height, abscissa=left, widths=width, color=colour))


def _hairlines(recorder: Recorder, name: str, x: FloatArray, y: FloatArray) -> None:
    spacing = float(np.median(np.diff(x))) if len(x) > 1 else 0.01
    width = np.full(len(x), HAIRLINE * spacing)
    _bars(recorder, name, y, x - 0.5 * width, width, (*colours.NORMAL[:3], BEHIND))
