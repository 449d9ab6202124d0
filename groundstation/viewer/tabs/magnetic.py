"""Magnetic: the deviation by each method against heading, the branches, the errors and the field over time."""

from collections.abc import Sequence

import numpy as np
import rerun.blueprint as rrb

from groundstation.base.normal import NORMAL_95
from groundstation.chapters.magnetic import magnetic as chapter
from groundstation.chapters.markdown import markdown
from groundstation.results.arrays.magnetic import (
    CorrectedHeadingRows,
    GroundRunCurve,
    MagneticCurves,
    MagneticModulus,
    MagneticSamples,
    MagneticTable,
)
from groundstation.results.flight import FlightResults
from groundstation.results.magnetic import METHOD_TITLES, MagneticResult, MethodName
from groundstation.results.magnetic_ground import GroundDeviation
from groundstation.viewer import colours
from groundstation.viewer.chart import Axis, Chart
from groundstation.viewer.recorder import Line, Recorder
from groundstation.viewer.series import FloatArray, gap_after
from groundstation.viewer.tabs.magnetic_field import eight, sphere
from groundstation.viewer.views import document, plot

THIN, BOLD, DOT = 1.0, 2.0, 1.6
SHADES = dict(zip(METHOD_TITLES, (colours.INS, colours.ANSWER, colours.HONEST), strict=True))
MARGIN = 0.08
RUN, FITTED = Line("ground runs", colours.INS, BOLD), Line("A to E", colours.ANSWER, THIN)


def magnetic(recorder: Recorder, results: FlightResults) -> rrb.Container | None:
    """Log the tab of the magnetic deviation; None when the flight was not assessed: the overview says why."""
    section = chapter(results)
    if section is None or not any(results.answer(kind) for kind in (MagneticResult, GroundDeviation)):
        return None
    recorder.document("magnetic/answer", markdown(section))
    text = document("Verdict and card", "magnetic/answer")
    left = [*_deviation(recorder, results), *_branches(recorder, results), *_ground_runs(recorder, results)]
    middle = [*_errors(recorder, results), *_modulus(recorder, results), *_applied(recorder, results)]
    right = [*sphere(recorder, results), *eight(recorder, results), text]
    columns = [rrb.Vertical(contents=column) for column in (left, middle, right) if column]
    return rrb.Horizontal(contents=columns, name="Magnetic")


def _axis(title: str, curves: list[FloatArray]) -> Axis | None:
    known = np.concatenate([curve[np.isfinite(curve)] for curve in curves] or [np.zeros(0)])
    if not known.size:
        return None
    low, high = float(known.min()), float(known.max())
    margin = max(MARGIN * (high - low), 0.1)
    return Axis(title, low - margin, high + margin)


def _chart(
    recorder: Recorder,
    path: str,
    title: str,
    heading: FloatArray,
    curves: list[tuple[FloatArray, Line]],
    bands: Sequence[tuple[FloatArray, FloatArray, colours.Colour]] = (),
) -> list[rrb.View]:
    """Curves against magnetic heading, each with its name, over filled bands; the view, none without a number."""
    y = _axis(title, [*(values for values, _ in curves), *(edge for low, high, _ in bands for edge in (low, high))])
    if y is None:
        return []
    chart = Chart(recorder, path, Axis("magnetic heading as read, deg", 0.0, 360.0), y)
    for number, (low, high, shade) in enumerate(bands):
        chart.band(f"band/{number}", heading, low, high, shade)
    chart.curves("curves", [(heading, values, line) for values, line in curves])
    chart.legend([line for _, line in curves if line.name])
    return [chart.view()]


def _deviation(recorder: Recorder, results: FlightResults) -> list[rrb.View]:
    """Deviation to be added, by each method, with its filled 95 % band."""
    figure = results.rows_of(MagneticCurves)
    if figure is None:
        return []
    curves, bands = [], []
    for name, title in METHOD_TITLES.items():
        value, sigma = figure.deviation_deg.get(name), figure.sigma_deg.get(name)
        if value is not None and sigma is not None and np.isfinite(value).any():
            shade = SHADES[name]
            bands.append((value - NORMAL_95 * sigma, value + NORMAL_95 * sigma, shade))
            curves.append((value, Line(title, shade, BOLD)))
    heading = figure.uncorrected_magnetic_heading_deg
    title = "Deviation to be added and 95 %, deg"
    return _chart(recorder, "magnetic/deviation", title, heading, curves, bands)


def _branches(recorder: Recorder, results: FlightResults) -> list[rrb.View]:
    """Magnetic minus true heading on right and left turns and in the average."""
    figure = results.rows_of(MagneticTable)
    if figure is None:
        return []
    curves = [
        (figure.right_turn_deg, Line("right turn", colours.GNSS, THIN)),
        (figure.left_turn_deg, Line("left turn", colours.INS, THIN)),
        (figure.compass_error_deg, Line("average", colours.LIGHT, BOLD)),
    ]
    heading = figure.uncorrected_magnetic_heading_deg
    return _chart(recorder, "magnetic/branches", "Magnetic minus true heading, deg", heading, curves)


def _ground_runs(recorder: Recorder, results: FlightResults) -> list[rrb.View]:
    """Error of the installed heading sensor on each ground run with its 95 % bar, and the curve where it is known."""
    on_ground = results.answer(GroundDeviation)
    runs = on_ground.used if on_ground else ()
    curves = []
    for run in runs:
        if run.error_deg is None or run.sigma_deg is None:
            continue
        ends = run.error_deg + NORMAL_95 * run.sigma_deg * np.array([-1.0, 1.0])
        middle = run.magnetic_heading_deg + DOT * np.array([-1.0, 1.0])
        bar = np.full(2, run.magnetic_heading_deg)
        curves += [(bar, ends, Line("", colours.INS, THIN)), (middle, np.full(2, run.error_deg), RUN)]
    y = _axis("Error on ground runs, deg", [values for _, values, _ in curves])
    if y is None:
        return []
    figure = results.rows_of(GroundRunCurve)
    if figure is not None:
        curves.append((figure.magnetic_heading_deg, figure.heading_error_deg, FITTED))
    chart = Chart(recorder, "magnetic/ground", Axis("magnetic heading as read, deg", 0.0, 360.0), y)
    chart.curves("curves", curves)
    chart.legend([RUN, FITTED] if figure is not None else [RUN])
    return [chart.view()]


def _errors(recorder: Recorder, results: FlightResults) -> list[rrb.View]:
    """Error of the magnetic heading where no fit has seen, before and after the recommended correction."""
    in_flight = results.answer(MagneticResult)
    method: MethodName = in_flight.recommended_method if in_flight else "compass_table"
    figure = results.rows_of(MagneticSamples)
    if figure is None:
        return []
    mine = figure.part == "held out"
    if not mine.any():
        return []
    time_ns = recorder.time_ns(figure.time_s[mine])
    for title, values, shade in (
        ("before", figure.error_before_deg, colours.SAMPLES),
        ("after", figure.error_after_deg(method), colours.ANSWER),
    ):
        recorder.dots(f"magnetic/error/{title}", time_ns, values[mine], Line(f"{title}, deg", shade, DOT))
    title = "Error of magnetic heading on data that no fit used, deg: before grey, after green"
    return [plot(title, "magnetic/error", legend=False)]


def _applied(recorder: Recorder, results: FlightResults) -> list[rrb.View]:
    """Magnetic heading before and after a deviation was applied to the log."""
    figure = results.rows_of(CorrectedHeadingRows)
    if figure is None:
        return []
    time_ns = recorder.time_ns(figure.time_s)
    for title, values, shade in (
        ("uncorrected", figure.uncorrected_magnetic_heading_deg, colours.SAMPLES),
        ("corrected", figure.magnetic_heading_deg, colours.ANSWER),
    ):
        recorder.dots(f"magnetic/heading/{title}", time_ns, values, Line(f"{title}, deg", shade, DOT))
    title = "Magnetic heading, deg: as read grey, with the deviation applied green"
    return [plot(title, "magnetic/heading", legend=False)]


def _modulus(recorder: Recorder, results: FlightResults) -> list[rrb.View]:
    """Modulus of the field on the figures, as read and freed of the iron."""
    figure = results.rows_of(MagneticModulus)
    if figure is None:
        return []
    shown = [(figure.before_nt, Line("as read, nT", colours.SAMPLES, THIN))]
    shown += [(values, Line(f"{METHOD_TITLES[name]}, nT", SHADES[name])) for name, values in figure.freed().items()]
    known = [(values, line) for values, line in shown if np.isfinite(values).any()]
    if not known:
        return []
    time_ns, series = recorder.time_ns(figure.time_s), np.column_stack([values for values, _ in known])
    recorder.lines("magnetic/modulus", time_ns, series, [line for _, line in known], gap_after(time_ns))
    return [plot("Modulus of the field on the figures, nT", "magnetic/modulus")]
