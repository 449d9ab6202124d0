"""Density of the heading error of each aircraft of a fleet.

It grows flight by flight over its final state; each flight has its own too. Rerun takes the abscissa of a bar for its
left edge.
"""

import math
from collections.abc import Iterator, Sequence

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from groundstation.base.records import Int64Array
from groundstation.base.words import capitalised
from groundstation.results.fleet import Densities, FittedNormal, FleetResults
from groundstation.viewer import colours
from groundstation.viewer.colours import NO_WIDTH, UNSEEN, Colour
from groundstation.viewer.fleet_charts import ChartedAircraft
from groundstation.viewer.fleet_recorder import FleetRecorder
from groundstation.viewer.series import FloatArray

PATH, ALL, SO_FAR = "fleet/heading_error_density", "all", "so_far"
MOST_ROWS = 6  # of aircraft, those with most flights
MOST_STEPS = 200  # a bar chart is logged alone, about 1 ms each
NORMAL_POINTS = 600
SLIM = 0.4  # of a bin
FLEET_PLACE, FLIGHT_PLACE = 0.05, 0.55  # in a bin: side by side, for Rerun adds up the colours of bars that overlap
BEHIND, FRONT = 60, 255  # opacity
CEILING, MOST_FLIGHTS = 3.0, 0.9  # highest bar, in peaks of the whole fleet; or what so many flights stay below


def heading_error_density(
    recorder: FleetRecorder, fleet: FleetResults, aircraft: Sequence[ChartedAircraft]
) -> list[rrb.View]:
    """Log the densities; the views that show them, none without samples.

    Each aircraft has a row of its own, those with most flights: errors of different aircraft are no one distribution.
    """
    densities = fleet.densities
    if not len(densities) or not densities.pooled_per_deg.any():
        return []
    if len(set(densities.aircraft.tolist())) == 1:
        return [_row(recorder, densities, PATH, "", MOST_STEPS, fleet.normal())]
    counts = {one: int(np.sum(densities.aircraft == one.name)) for one in aircraft}
    most = sorted((one for one in aircraft if counts[one]), key=lambda one: -counts[one])[:MOST_ROWS]
    shown = [one for one in aircraft if one in most]
    return [
        _row(
            recorder,
            _own(densities, one.name),
            f"{PATH}/{one.entity.rpartition('/')[2]}",
            f"{one.label}: ",
            MOST_STEPS // len(shown),
        )
        for one in shown
    ]


def _own(densities: Densities, aircraft: str) -> Densities:
    """Return the densities of the flights of an aircraft."""
    own = densities.aircraft == aircraft
    return Densities(
        densities.edge_deg,
        densities.flight_id[own],
        densities.aircraft[own],
        densities.samples[own],
        densities.density_per_deg[own],
        densities.pooled_of(aircraft),
    )


def _row(
    recorder: FleetRecorder,
    densities: Densities,
    path: str,
    whose: str,
    most_steps: int,
    normal: FittedNormal | None = None,
) -> rrb.View:
    """Log the densities of some flights and of all of them so far; the view that shows them.

    A flight (or all so far, after few flights) that rises far above the rest is not drawn: Rerun fits the axis to the
    highest bar there is, and the rest would be flat.
    """
    left, width = densities.edge_deg[:-1], np.diff(densities.edge_deg)
    peak = float(densities.pooled_per_deg.max())
    if normal is not None and normal.sigma_deg > 0.0:
        peak = max(peak, _normal(recorder, path, normal, densities.edge_deg))
    numbers = recorder.numbers(densities.flight_id)
    order = np.argsort(numbers)
    flight_peaks = densities.density_per_deg.max(axis=1)
    ceiling = max(CEILING * peak, float(np.quantile(flight_peaks, MOST_FLIGHTS)))
    _bars(recorder, f"{path}/{ALL}", densities.pooled_per_deg, left, width, (*colours.GREY[:3], BEHIND))
    highest = peak
    for place, so_far in steps(densities, order, most_steps):
        own = densities.density_per_deg[order[place]].astype(np.float64)
        recorder.set_flight(int(numbers[order[place]]))
        for name, height, shift, colour in (
            (SO_FAR, so_far, FLEET_PLACE, colours.ANSWER),
            ("flight_now", own, FLIGHT_PLACE, colours.GNSS),
        ):
            drawn = height if height.max() <= ceiling else np.zeros_like(height)
            highest = max(highest, float(drawn.max()))
            recorder.stream.log(
                f"{path}/{name}",
                rr.BarChart(drawn, abscissa=left + shift * width, widths=SLIM * width, color=(*colour[:3], FRONT)),
            )
    recorder.stream.reset_time()
    middle = np.array([float(np.mean(densities.edge_deg))])
    _bars(recorder, f"{path}/axis_top", np.array([highest]), middle, np.array([NO_WIDTH]), UNSEEN)
    every = math.ceil(len(densities) / most_steps)
    one = "flight" if every == 1 else f"one flight of {every}"
    red = "" if normal is None else ", red normal"
    name = f"{whose}density of heading error, 1/deg (green so far, orange {one}, grey all{red})"
    return rrb.BarChartView(name=capitalised(name), origin=f"/{path}", plot_legend=rrb.PlotLegend(visible=False))


def steps(densities: Densities, order: Int64Array, most: int = MOST_STEPS) -> Iterator[tuple[int, FloatArray]]:
    """Yield places in ``order`` to draw at, and the density of all flights up to each.

    There are at most so many places, the last among them. Densities are merged by samples, as they are of all flights:
    the last step equals it.
    """
    places = np.unique(np.linspace(0, len(order) - 1, min(len(order), most)).round().astype(np.int64))
    total, count, done = np.zeros(len(densities.pooled_per_deg)), 0, 0
    for place in places.tolist():
        added = order[done : place + 1]
        total = total + densities.samples[added] @ densities.density_per_deg[added].astype(np.float64)
        count += int(densities.samples[added].sum())
        done = place + 1
        yield place, total / max(count, 1)


def _normal(recorder: FleetRecorder, path: str, normal: FittedNormal, edge_deg: FloatArray) -> float:
    """Draw the fitted normal as hairlines; return its height."""
    x = np.linspace(edge_deg[0], edge_deg[-1], NORMAL_POINTS)
    width = np.diff(x)
    height = 1.0 / (normal.sigma_deg * math.sqrt(2.0 * math.pi))
    y = height * np.exp(-0.5 * ((x[:-1] + 0.5 * width - normal.mean_deg) / normal.sigma_deg) ** 2)
    _bars(recorder, f"{path}/fitted_normal", y, x[:-1], width, (*colours.NORMAL[:3], BEHIND))
    return height


def _bars(
    recorder: FleetRecorder, path: str, height: FloatArray, left: FloatArray, width: FloatArray, colour: Colour
) -> None:
    recorder.static(path, rr.BarChart(height, abscissa=left, widths=width, color=colour))
