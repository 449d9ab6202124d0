"""Density of the heading error over a fleet.

It grows flight by flight over its final state; each flight has its own too. Rerun takes the abscissa of a bar for its
left edge.
"""

import math
from collections.abc import Iterator

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from groundstation.base.records import Int64Array
from groundstation.results.fleet import Densities, FittedNormal, FleetResults
from groundstation.viewer import colours
from groundstation.viewer.colours import NO_WIDTH, UNSEEN, Colour
from groundstation.viewer.fleet_recorder import FleetRecorder
from groundstation.viewer.series import FloatArray

PATH = "fleet/heading_error_density"
MOST_STEPS = 200  # a bar chart is logged alone, about 1 ms each
NORMAL_POINTS = 600
SLIM = 0.4  # of a bin
FLEET_PLACE, FLIGHT_PLACE = 0.05, 0.55  # in a bin: side by side, for Rerun adds up the colours of bars that overlap
BEHIND, FRONT = 60, 255  # opacity
CEILING, MOST_FLIGHTS = 3.0, 0.9  # highest bar, in peaks of the whole fleet; or what so many flights stay below


def heading_error_density(recorder: FleetRecorder, fleet: FleetResults) -> list[rrb.View]:
    """Log the densities; the view that shows them, none without samples.

    A flight (or the fleet, after few flights) that rises far above the rest is not drawn: Rerun fits the axis to the
    highest bar there is, and the rest would be flat.
    """
    densities = fleet.densities
    if not len(densities) or not densities.pooled_per_deg.any():
        return []
    left, width = densities.edge_deg[:-1], np.diff(densities.edge_deg)
    normal = fleet.normal()
    peak = float(densities.pooled_per_deg.max())
    if normal is not None and normal.sigma_deg > 0.0:
        peak = max(peak, _normal(recorder, normal, densities.edge_deg))
    numbers = recorder.numbers(densities.flight_id)
    order = np.argsort(numbers)
    flight_peaks = densities.density_per_deg.max(axis=1)
    ceiling = max(CEILING * peak, float(np.quantile(flight_peaks, MOST_FLIGHTS)))
    _bars(recorder, "fleet_all", densities.pooled_per_deg, left, width, (*colours.GREY[:3], BEHIND))
    highest = peak
    for place, so_far in steps(densities, order):
        own = densities.density_per_deg[order[place]].astype(np.float64)
        recorder.set_flight(int(numbers[order[place]]))
        for name, height, shift, colour in (
            ("fleet_so_far", so_far, FLEET_PLACE, colours.ANSWER),
            ("flight_now", own, FLIGHT_PLACE, colours.GNSS),
        ):
            drawn = height if height.max() <= ceiling else np.zeros_like(height)
            highest = max(highest, float(drawn.max()))
            recorder.stream.log(
                f"{PATH}/{name}",
                rr.BarChart(drawn, abscissa=left + shift * width, widths=SLIM * width, color=(*colour[:3], FRONT)),
            )
    recorder.stream.reset_time()
    middle = np.array([float(np.mean(densities.edge_deg))])
    _bars(recorder, "axis_top", np.array([highest]), middle, np.array([NO_WIDTH]), UNSEEN)
    every = math.ceil(len(densities) / MOST_STEPS)
    own = "flight" if every == 1 else f"one flight of {every}"
    name = f"Density of heading error, 1/deg (green so far, orange {own}, grey all, red normal)"
    return [rrb.BarChartView(name=name, origin=f"/{PATH}", plot_legend=rrb.PlotLegend(visible=False))]


def steps(densities: Densities, order: Int64Array) -> Iterator[tuple[int, FloatArray]]:
    """Yield places in ``order`` to draw at, and the density of all flights up to each.

    There are at most 200 places, the last among them. Densities are merged by samples, like that of the whole fleet:
    the last step equals it.
    """
    places = np.unique(np.linspace(0, len(order) - 1, min(len(order), MOST_STEPS)).round().astype(np.int64))
    total, count, done = np.zeros(len(densities.pooled_per_deg)), 0, 0
    for place in places.tolist():
        added = order[done : place + 1]
        total = total + densities.samples[added] @ densities.density_per_deg[added].astype(np.float64)
        count += int(densities.samples[added].sum())
        done = place + 1
        yield place, total / max(count, 1)


def _normal(recorder: FleetRecorder, normal: FittedNormal, edge_deg: FloatArray) -> float:
    """Draw the fitted normal as hairlines; return its height."""
    x = np.linspace(edge_deg[0], edge_deg[-1], NORMAL_POINTS)
    width = np.diff(x)
    height = 1.0 / (normal.sigma_deg * math.sqrt(2.0 * math.pi))
    y = height * np.exp(-0.5 * ((x[:-1] + 0.5 * width - normal.mean_deg) / normal.sigma_deg) ** 2)
    _bars(recorder, "fitted_normal", y, x[:-1], width, (*colours.NORMAL[:3], BEHIND))
    return height


def _bars(
    recorder: FleetRecorder, name: str, height: FloatArray, left: FloatArray, width: FloatArray, colour: Colour
) -> None:
    recorder.static(f"{PATH}/{name}", rr.BarChart(height, abscissa=left, widths=width, color=colour))
