"""Tab on the forecast: what the filter would have said had GNSS been lost.

GNSS of the same time and the errors of the forecast are beside it.
"""

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from groundstation.base.quantiles import NORMAL_95
from groundstation.base.timescales import duration_text
from groundstation.chapters.markdown import markdown
from groundstation.results.flight import FlightResults
from groundstation.results.forecast_methods import FORECAST_METHODS
from groundstation.systems.inertial.arrays import InertialStates
from groundstation.systems.inertial.forecast_answer import ForecastResult
from groundstation.systems.inertial.forecast_arrays import ForecastFan, ForecastMap
from groundstation.systems.inertial.forecast_chapter import forecast as chapter
from groundstation.viewer import colours
from groundstation.viewer.chart import Chart, ChartAxis
from groundstation.viewer.names import words
from groundstation.viewer.plot_views import panels_of, plot_of
from groundstation.viewer.recorder import Line, Recorder
from groundstation.viewer.series import FloatArray
from groundstation.viewer.views import document, plot

THIN, BOLD = 0.8, 1.8
MARGIN = 1.08
FAN_HEIGHT, GROWTH_HEIGHT = 140.0, 115.0
SHOWN = Line("recorded GNSS", colours.GNSS, BOLD)
FORECAST = Line("forecast", colours.ANSWER, BOLD)
CLAIMED = Line("95 % as claimed", colours.HONEST, THIN)


def forecast(recorder: Recorder, results: FlightResults) -> rrb.Container | None:
    """Log the forecast tab; None when the flight was not assessed: the overview says why."""
    section, answer = chapter(results), results.answer(ForecastResult)
    if section is None or answer is None:
        return None
    recorder.document("forecast/answer", markdown(section))
    text = document("How far a forecast can be trusted", "forecast/answer")
    rows: list[rrb.Container] = []
    fan = _fan(recorder, results)
    if fan:
        rows.append(rrb.Horizontal(contents=fan))
    growth = panels_of(recorder, plot_of(recorder, "forecast.growth", results), height=GROWTH_HEIGHT)
    pictures = [*growth, *_map(recorder, results, answer)]
    if pictures:
        rows.append(rrb.Horizontal(contents=pictures))
    if not rows:
        return rrb.Horizontal(contents=[text], name="Forecast")
    left: list[rrb.View | rrb.Container] = [*rows]
    states = results.rows_of(InertialStates)
    if states is not None:  # somewhere to drag the playhead along
        paths = ["inertial/state/position"]
        left.append(plot("INS position error, north and east, m: drag the playhead here", paths, legend=False))
    shares = [3.0] * len(rows) + [1.0] * (len(left) - len(rows))
    column = rrb.Vertical(contents=left, row_shares=shares)
    return rrb.Horizontal(contents=[column, text], column_shares=[2.1, 1.0], name="Forecast")


# ---------------------------------------------------------------------------------------------------- fan


def _fan(recorder: Recorder, results: FlightResults) -> list[rrb.View]:
    """Log the forecast from each start at its time.

    The playhead shows that from the latest start.
    """
    fan = results.rows_of(ForecastFan)
    if fan is None or not np.isfinite(fan.lead_s).any():
        return []
    minutes = fan.lead_s / 60.0
    x = ChartAxis("lead, min", 0.0, max(float(np.nanmax(minutes)), 1.0))
    views: list[rrb.View] = []
    for channel, one in (("north", fan.north), ("east", fan.east)):
        expected, actual, half = one.forecast_m, one.actual_m, NORMAL_95 * one.sigma_m
        size = _largest(expected, actual, np.abs(expected) + half)
        axis = ChartAxis(f"{channel.capitalize()} error, m,", -size, size)
        chart = Chart(recorder, f"forecast/fan_{channel}", x, axis, FAN_HEIGHT)
        chart.legend([FORECAST, CLAIMED, SHOWN])
        _starts(chart, fan, minutes, [(expected, FORECAST), (actual, SHOWN)], (expected - half, expected + half))
        views.append(chart.view())
    return [*views, _radial(recorder, fan, minutes, x)]


def _radial(recorder: Recorder, fan: ForecastFan, minutes: FloatArray, x: ChartAxis) -> rrb.View:
    """Log the distance between forecast and GNSS, the claimed error, and the raw INS error."""
    east, north = fan.east, fan.north
    raw = np.hypot(east.actual_m, north.actual_m)
    left = np.hypot(east.actual_m - east.forecast_m, north.actual_m - north.forecast_m)
    claim = np.hypot(east.sigma_m, north.sigma_m)
    lines = (
        (raw, Line("raw INS", colours.INS, BOLD)),
        (claim, Line("radial σ claimed", colours.HONEST, THIN)),
        (left, Line("left after forecast", colours.ANSWER, BOLD)),
    )
    axis = ChartAxis("Radial error, m,", 0.0, _largest(raw, left, claim))
    chart = Chart(recorder, "forecast/fan_radial", x, axis, FAN_HEIGHT)
    chart.legend([line for _, line in lines])
    _starts(chart, fan, minutes, list(lines))
    return chart.view()


def _clock(seconds: float) -> str:
    return duration_text(float(round(seconds))).removesuffix(".0")


def _largest(*values: FloatArray) -> float:
    known = np.concatenate([one[np.isfinite(one)] for one in values])
    return MARGIN * max(float(np.abs(known).max(initial=0.0)), 1.0)


def _starts(
    chart: Chart,
    fan: ForecastFan,
    minutes: FloatArray,
    curves: list[tuple[FloatArray, Line]],
    band: tuple[FloatArray, FloatArray] | None = None,
) -> None:
    """Log the curves of each start from its time on; before the first one they are its own."""
    starts = fan.start_s
    each = np.unique(starts[np.isfinite(starts)])
    for place, start in enumerate(each.tolist()):
        rows, at_s = starts == start, start if place else min(start, 0.0)
        if band is not None:
            low, high = band
            chart.band("claimed", minutes[rows], low[rows], high[rows], CLAIMED.colour, at_s)
        chart.curves("latest", [(minutes[rows], values[rows], line) for values, line in curves], at_s)
        chart.note("start", f"GNSS withheld at {_clock(start)}", at_s)


# ---------------------------------------------------------------------------------------------------- skill


def _map(recorder: Recorder, results: FlightResults, answer: ForecastResult) -> list[rrb.View | rrb.Container]:
    """Log the hindcast map, one tensor per method: radial error by start and horizon.

    All on one colour scale.
    """
    figure = results.rows_of(ForecastMap)
    if figure is None:
        return []
    starts, horizons = np.unique(figure.start_s), np.unique(figure.horizon_min)
    shape = (len(starts), len(horizons))
    known = [name for name in FORECAST_METHODS if name in figure.radial_m]
    if shape[0] * shape[1] != len(figure) or not known:
        return []
    cubes = {name: figure.radial_m[name].reshape(shape) for name in known}
    reference = cubes.get("raw_ins", cubes[known[0]])
    top = float(np.nanmax(reference)) if np.isfinite(reference).any() else 1.0
    default = answer.default_method
    order = [name for name in (default, "raw_ins") if name in known]
    views: list[rrb.View] = []
    for name in [*order, *(name for name in known if name not in order)]:
        path = f"forecast/map/{name}"
        tensor = rr.Tensor(cubes[name].astype(np.float32), dim_names=("start", "horizon"), value_range=(0.0, top))
        recorder.static(path, tensor)
        views.append(_tensor(name, path))
    span = f"{_clock(float(starts[0]))} … {_clock(float(starts[-1]))}"
    title = (
        f"Radial error, 0 (dark blue) … {top:.0f} m (dark red). To the right: start, {span}; "
        f"down: horizon, {horizons[0]:g} … {horizons[-1]:g} min. The dark corner lies beyond the end of the flight."
    )
    recorder.document("forecast/map_legend", title)
    legend = document("Hindcast map", "forecast/map_legend")
    return [rrb.Vertical(contents=[legend, rrb.Tabs(contents=views, active_tab=0)], row_shares=[1.0, 3.5])]


def _tensor(name: str, path: str) -> rrb.TensorView:
    return rrb.TensorView(
        name=words(name),
        origin=f"/{path}",
        slice_selection=rrb.TensorSliceSelection(width=0, height=1),
        scalar_mapping=rrb.TensorScalarMapping(colormap="turbo", mag_filter="nearest"),
        view_fit="fill",
    )
