"""INS errors: what the filter says of position, velocity, tilt and drift of each channel, and how far to trust it."""

import numpy as np
import rerun.blueprint as rrb

from groundstation.base.normal import NORMAL_95
from groundstation.chapters.inertial import inertial as chapter
from groundstation.chapters.markdown import markdown
from groundstation.results.figures import FigureData
from groundstation.results.flight import FlightResults
from groundstation.results.inertial import InertialResult
from groundstation.viewer import colours
from groundstation.viewer.recorder import Line, Recorder
from groundstation.viewer.series import FloatArray, gap_after, runs
from groundstation.viewer.tabs.aided_ins import aided_pages
from groundstation.viewer.views import document, figure_of, lanes, numbers, plot

CHANNELS = ("north", "east")
THIN, BOLD, DOT = 1.0, 2.0, 1.6
ESTIMATE = Line("estimate ± 95 %", colours.ANSWER, BOLD)
MARGIN = 0.12
BAND_QUANTILES = (10.0, 90.0)  # the band of the first minutes and of long outages may leave the picture
FAST = (  # state, unit, whether GNSS measures it and the smoother is drawn
    ("position", "m", "m", True),
    ("velocity", "mps", "m/s", True),
    ("tilt", "arcsec", "arcsec", False),
    ("drift", "dph", "deg/h", False),
)
SLOW = (("drift_rate", "dphph", "deg/h per h", False), ("random_drift", "dph", "deg/h", False))
TITLES = {
    "position": "position error",
    "velocity": "velocity error",
    "tilt": "platform tilt",
    "drift": "constant gyro drift",
    "drift_rate": "drift rate",
    "random_drift": "random gyro drift",
}


def inertial(recorder: Recorder, results: FlightResults) -> rrb.Container | None:
    """Log the tab of the INS errors; None when the flight was not assessed: the overview says why."""
    section = chapter(results)
    if section is None or results.answer(InertialResult) is None:
        return None
    recorder.document("inertial/answer", markdown(section))
    right: list[rrb.View] = [document("Errors of this INS against GNSS", "inertial/answer")]
    states = figure_of(results, "inertial_states", "time_s", "north_position_m", "east_position_m")
    pages = aided_pages(recorder, results)
    if states is not None:
        pages = _pages(recorder, results, states)
    right += _radial(recorder, results)
    column = rrb.Vertical(contents=right, row_shares=[2.0, 1.0, 1.0][: len(right)])
    if not pages:
        return rrb.Horizontal(contents=[column], name="INS errors")
    left: list[rrb.View | rrb.Container] = [rrb.Tabs(contents=pages, active_tab=0)]
    strip = _lanes(recorder, results, states)
    left += strip
    column_left = rrb.Vertical(contents=left, row_shares=[6.0, 1.0][: len(left)])
    return rrb.Horizontal(contents=[column_left, column], column_shares=[2.6, 1.0], name="INS errors")


def _pages(recorder: Recorder, results: FlightResults, states: FigureData) -> list[rrb.Container]:
    """Two pages of plots, north on the left and east on the right."""
    first, second = [], []
    observability = figure_of(results, "inertial_observability", "time_s")
    for channel in CHANNELS:
        fast = [_state(recorder, states, channel, *row) for row in FAST]
        slow = [_state(recorder, states, channel, *row) for row in SLOW]
        slow += [_innovation(recorder, states, channel), _observability(recorder, observability, channel)]
        first.append(rrb.Vertical(contents=[view for view in fast if view is not None]))
        second.append(rrb.Vertical(contents=[view for view in slow if view is not None]))
    return [
        rrb.Horizontal(
            contents=first,
            name="Position, velocity, tilt, drift: estimate ± 95 % green, INS − GNSS grey, smoothed yellow",
        ),
        rrb.Horizontal(contents=second, name="Slow drifts, innovations, observability"),
    ]


def _state(
    recorder: Recorder, states: FigureData, channel: str, name: str, suffix: str, unit: str, is_measured: bool
) -> rrb.View | None:
    """One state: measured where GNSS shows it, smoothed, estimate, and its filled 95 % band."""
    column = f"{channel}_{name}_{suffix}"
    if column not in states.columns:
        return None
    path = f"inertial/{channel}/{name}"
    time_ns = recorder.time_ns(numbers(states, "time_s"))
    gaps = gap_after(time_ns)
    estimate = numbers(states, column)
    shown, series, lines = [estimate], [], []
    measured = f"measured_{column}"
    if is_measured and measured in states.columns and np.isfinite(numbers(states, measured)).any():
        series.append(numbers(states, measured))  # a line, not dots: Rerun would draw those over the estimate
        lines.append(Line(f"INS − GNSS, {unit}", colours.SAMPLES, THIN))
        shown.append(series[0])
    smoothed = f"smoothed_{column}"
    if smoothed in states.columns and np.isfinite(numbers(states, smoothed)).any():
        series.append(numbers(states, smoothed))
        lines.append(Line(f"smoothed (RTS), {unit}", colours.PAPER, THIN))
    band: list[FloatArray] = []
    sigma = f"{channel}_{name}_sigma_{suffix}"
    if sigma in states.columns:
        half = NORMAL_95 * numbers(states, sigma)
        band = [estimate + half, estimate - half]
        recorder.band(f"{path}/b_band", time_ns, estimate, half, ESTIMATE, gaps)  # over the others
    else:
        series.append(estimate)
        lines.append(ESTIMATE)
    if series:
        recorder.lines(f"{path}/a_lines", time_ns, np.column_stack(series), lines, gaps)
    title = f"{channel.capitalize()} {TITLES[name]}, {unit}"
    return plot(title, path, axis_range=_range(shown, band), legend=False)


def _range(shown: list[FloatArray], band: list[FloatArray]) -> tuple[float, float] | None:
    """Axis on which every estimate is seen and the band most of the time."""
    values = np.concatenate([series[np.isfinite(series)] for series in shown])
    if not values.size:
        return None
    edges = [series[np.isfinite(series)] for series in band]
    ends = [float(end) for edge in edges if edge.size for end in np.percentile(edge, BAND_QUANTILES)]
    low, high = min(float(values.min()), *ends), max(float(values.max()), *ends)
    margin = max(MARGIN * (high - low), 1e-6)
    return low - margin, high + margin


def _innovation(recorder: Recorder, states: FigureData, channel: str) -> rrb.View | None:
    """Innovations over their own sigma with the 95 % limits."""
    column = f"{channel}_normalised_innovation"
    if column not in states.columns:
        return None
    path = f"inertial/{channel}/innovation"
    time_ns, values = recorder.time_ns(numbers(states, "time_s")), numbers(states, column)
    known = np.isfinite(values)
    recorder.dots(f"{path}/a_samples", time_ns[known], values[known], Line("innovation / σ", colours.SAMPLES, DOT))
    ends = np.array([[NORMAL_95, -NORMAL_95], [NORMAL_95, -NORMAL_95]])
    lines = [Line("± 1.96", colours.LIMIT, THIN)] * 2
    recorder.lines(f"{path}/b_limits", time_ns[[0, -1]], ends, lines)
    largest = float(np.abs(values[known]).max(initial=NORMAL_95))
    high = min(max(1.1 * largest, 2.0 * NORMAL_95), 8.0)
    title = f"{channel.capitalize()} normalised innovation (95 % inside ± 1.96)"
    return plot(title, path, axis_range=(-high, high), legend=False)


def _observability(recorder: Recorder, figure: FigureData | None, channel: str) -> rrb.View | None:
    """Observability of the six states, 0 to 1."""
    known = [] if figure is None else [name for name in TITLES if f"{channel}_{name}" in figure.columns]
    if figure is None or not known:
        return None
    path = f"inertial/{channel}/observability"
    time_ns = recorder.time_ns(numbers(figure, "time_s"))
    values = np.column_stack([numbers(figure, f"{channel}_{name}") for name in known])
    shades = colours.for_series(len(known))
    lines = [Line(TITLES[name], colour) for name, colour in zip(known, shades, strict=True)]
    recorder.lines(path, time_ns, values, lines, gap_after(time_ns))
    title = f"{channel.capitalize()} observability (0 no, 1 full)"
    return plot(title, path, axis_range=(-0.05, 1.05), legend=channel == CHANNELS[-1])


def _radial(recorder: Recorder, results: FlightResults) -> list[rrb.View]:
    """Radial error against GNSS of the INS and of the corrected track; their sizes differ too much for one plot."""
    figure = figure_of(results, "inertial_track", "time_s", "ins_error_m", "corrected_error_m")
    if figure is None:
        return []
    time_ns = recorder.time_ns(numbers(figure, "time_s"))
    views: list[rrb.View] = []
    for column, title, colour in (
        ("ins_error_m", "Radial error of the INS against GNSS, m", colours.INS),
        ("corrected_error_m", "Radial error of the corrected track against GNSS, m", colours.ANSWER),
    ):
        values = numbers(figure, column)
        if np.isfinite(values).any():
            path = f"inertial/radial/{column.removesuffix('_m')}"
            recorder.lines(path, time_ns, values[:, None], [Line(title, colour)], gap_after(time_ns))
            views.append(plot(title, path, legend=False))
    return views


def _lanes(recorder: Recorder, results: FlightResults, states: FigureData | None) -> list[rrb.View]:
    """When the filter had GNSS and when it forecast, under the flight phase that the overview logged."""
    if states is None or not {"is_forecast", "gnss_used"} <= set(states.columns):
        return []
    state = np.where(states["gnss_used"].astype(bool), "GNSS used", "GNSS not used")
    state = np.where(states["is_forecast"].astype(bool), "forecast", state)
    answer = results.answer(InertialResult)
    time_s, outages = numbers(states, "time_s"), () if answer is None else answer.outages
    ends = [end for outage in outages for end in (outage.start_s, outage.end_s)]
    every = np.unique(np.concatenate([time_s, ends]))  # a short outage may lie between two rows
    state = state[np.clip(np.searchsorted(time_s, every, side="right") - 1, 0, len(time_s) - 1)]
    for outage in outages:
        state[(every >= outage.start_s) & (every < outage.end_s)] = "forecast"
    rows = runs(state)
    time_ns = recorder.time_ns(every[rows])
    recorder.lane("inertial/filter", time_ns, state[rows].tolist(), colours.FILTER_STATES)
    phases = ["flight/phase"] if figure_of(results, "phases", "start_s", "end_s", "phase") is not None else []
    return [lanes("Filter and flight phase", ["inertial/filter", *phases])]
