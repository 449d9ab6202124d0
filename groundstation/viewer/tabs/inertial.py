"""INS errors: what the filter says of position, velocity, tilt and drift of each channel, and how far to trust it."""

from dataclasses import dataclass

import numpy as np
import rerun.blueprint as rrb

from groundstation.base.normal import NORMAL_95
from groundstation.base.records import Int64Array
from groundstation.chapters.inertial import inertial as chapter
from groundstation.chapters.markdown import markdown
from groundstation.results.arrays.flight import PhaseSpans
from groundstation.results.arrays.inertial import (
    InertialObservability,
    InertialStates,
    InertialTrack,
    ObservabilityOfChannel,
    StateName,
    StatesOfChannel,
)
from groundstation.results.flight import FlightResults
from groundstation.results.inertial import InertialResult
from groundstation.viewer import colours
from groundstation.viewer.recorder import Line, Recorder
from groundstation.viewer.series import FloatArray, gap_after, runs
from groundstation.viewer.tabs.aided_ins import aided_pages
from groundstation.viewer.views import document, lanes, plot

THIN, BOLD, DOT = 1.0, 2.0, 1.6
ESTIMATE = Line("estimate ± 95 %", colours.ANSWER, BOLD)
MARGIN = 0.12
BAND_QUANTILES = (10.0, 90.0)  # the band of the first minutes and of long outages may leave the picture


@dataclass(frozen=True)
class StateLine:
    """A state of a channel as it is shown: name, title, unit."""

    name: StateName
    title: str
    unit: str


FAST = (
    StateLine("position", "position error", "m"),
    StateLine("velocity", "velocity error", "m/s"),
    StateLine("tilt", "platform tilt", "arcsec"),
    StateLine("drift", "constant gyro drift", "deg/h"),
)
SLOW = (
    StateLine("drift_rate", "drift rate", "deg/h per h"),
    StateLine("random_drift", "random gyro drift", "deg/h"),
)


def inertial(recorder: Recorder, results: FlightResults) -> rrb.Container | None:
    """Log the tab of the INS errors; None when the flight was not assessed: the overview says why."""
    section = chapter(results)
    if section is None or results.answer(InertialResult) is None:
        return None
    recorder.document("inertial/answer", markdown(section))
    right: list[rrb.View] = [document("Errors of this INS against GNSS", "inertial/answer")]
    states = results.rows_of(InertialStates)
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


def _pages(recorder: Recorder, results: FlightResults, states: InertialStates) -> list[rrb.Container]:
    """Two pages of plots, north on the left and east on the right."""
    first, second = [], []
    observed = results.rows_of(InertialObservability)
    time_ns = recorder.time_ns(states.time_s)
    for channel, one in (("north", states.north), ("east", states.east)):
        fast = [_state(recorder, time_ns, channel, one, state) for state in FAST]
        slow = [_state(recorder, time_ns, channel, one, state) for state in SLOW]
        slow.append(_innovation(recorder, time_ns, channel, one))
        if observed is not None:
            of_channel = observed.north if channel == "north" else observed.east
            slow.append(_observability(recorder, recorder.time_ns(observed.time_s), channel, of_channel))
        first.append(rrb.Vertical(contents=fast))
        second.append(rrb.Vertical(contents=slow))
    return [
        rrb.Horizontal(
            contents=first,
            name="Position, velocity, tilt, drift: estimate ± 95 % green, INS − GNSS grey, smoothed yellow",
        ),
        rrb.Horizontal(contents=second, name="Slow drifts, innovations, observability"),
    ]


def _state(
    recorder: Recorder, time_ns: Int64Array, channel: str, states: StatesOfChannel, state: StateLine
) -> rrb.View:
    """One state: measured where GNSS shows it, smoothed, estimate, and its filled 95 % band."""
    path, gaps = f"inertial/{channel}/{state.name}", gap_after(time_ns)
    one = states.state(state.name)
    estimate, half = one.value, NORMAL_95 * one.sigma
    shown, series, lines = [estimate], list[FloatArray](), list[Line]()
    if np.isfinite(one.measured).any():
        series.append(one.measured)  # a line, not dots: Rerun would draw those over the estimate
        lines.append(Line(f"INS − GNSS, {state.unit}", colours.SAMPLES, THIN))
        shown.append(one.measured)
    if np.isfinite(one.smoothed).any():
        series.append(one.smoothed)
        lines.append(Line(f"smoothed (RTS), {state.unit}", colours.PAPER, THIN))
    recorder.band(f"{path}/b_band", time_ns, estimate, half, ESTIMATE, gaps)  # over the others
    if series:
        recorder.lines(f"{path}/a_lines", time_ns, np.column_stack(series), lines, gaps)
    title = f"{channel.capitalize()} {state.title}, {state.unit}"
    return plot(title, path, axis_range=_range(shown, [estimate + half, estimate - half]), legend=False)


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


def _innovation(recorder: Recorder, time_ns: Int64Array, channel: str, states: StatesOfChannel) -> rrb.View:
    """Innovations over their own sigma with the 95 % limits."""
    path, values = f"inertial/{channel}/innovation", states.normalised_innovation
    known = np.isfinite(values)
    recorder.dots(f"{path}/a_samples", time_ns[known], values[known], Line("innovation / σ", colours.SAMPLES, DOT))
    ends = np.array([[NORMAL_95, -NORMAL_95], [NORMAL_95, -NORMAL_95]])
    lines = [Line("± 1.96", colours.LIMIT, THIN)] * 2
    recorder.lines(f"{path}/b_limits", time_ns[[0, -1]], ends, lines)
    largest = float(np.abs(values[known]).max(initial=NORMAL_95))
    high = min(max(1.1 * largest, 2.0 * NORMAL_95), 8.0)
    title = f"{channel.capitalize()} normalised innovation (95 % inside ± 1.96)"
    return plot(title, path, axis_range=(-high, high), legend=False)


def _observability(recorder: Recorder, time_ns: Int64Array, channel: str, states: ObservabilityOfChannel) -> rrb.View:
    """Observability of the six states, 0 to 1."""
    path = f"inertial/{channel}/observability"
    values = np.column_stack(list(states.states().values()))
    titles = [state.title for state in (*FAST, *SLOW)]
    lines = [Line(title, colour) for title, colour in zip(titles, colours.for_series(len(titles)), strict=True)]
    recorder.lines(path, time_ns, values, lines, gap_after(time_ns))
    title = f"{channel.capitalize()} observability (0 no, 1 full)"
    return plot(title, path, axis_range=(-0.05, 1.05), legend=channel == "east")


def _radial(recorder: Recorder, results: FlightResults) -> list[rrb.View]:
    """Radial error against GNSS of the INS and of the corrected track; their sizes differ too much for one plot."""
    figure = results.rows_of(InertialTrack)
    if figure is None:
        return []
    time_ns = recorder.time_ns(figure.time_s)
    views: list[rrb.View] = []
    if figure.ins_error_m is None or figure.corrected_error_m is None:
        return []
    for part, values, subject, colour in (
        ("ins_error", figure.ins_error_m, "INS", colours.INS),
        ("corrected_error", figure.corrected_error_m, "corrected track", colours.ANSWER),
    ):
        if np.isfinite(values).any():
            path, title = f"inertial/radial/{part}", f"Radial error of the {subject} against GNSS, m"
            recorder.lines(path, time_ns, values[:, None], [Line(title, colour)], gap_after(time_ns))
            views.append(plot(title, path, legend=False))
    return views


def _lanes(recorder: Recorder, results: FlightResults, states: InertialStates | None) -> list[rrb.View]:
    """When the filter had GNSS and when it forecast, under the flight phase that the overview logged."""
    if states is None:
        return []
    state = np.where(states.is_gnss_used, "GNSS used", "GNSS not used")
    state = np.where(states.is_forecast, "forecast", state)
    answer = results.answer(InertialResult)
    time_s, outages = states.time_s, () if answer is None else answer.outages
    ends = [end for outage in outages for end in (outage.start_s, outage.end_s)]
    every = np.unique(np.concatenate([time_s, ends]))  # a short outage may lie between two rows
    state = state[np.clip(np.searchsorted(time_s, every, side="right") - 1, 0, len(time_s) - 1)]
    for outage in outages:
        state[(every >= outage.start_s) & (every < outage.end_s)] = "forecast"
    rows = runs(state)
    time_ns = recorder.time_ns(every[rows])
    recorder.lane("inertial/filter", time_ns, state[rows].tolist(), colours.FILTER_STATES)
    phases = ["flight/phase"] if results.rows_of(PhaseSpans) is not None else []
    return [lanes("Filter and flight phase", ["inertial/filter", *phases])]
