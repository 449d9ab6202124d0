"""Magnetic: the deviation by each method against heading, the branches, the errors and the field over time."""

from collections.abc import Sequence

import numpy as np
import rerun.blueprint as rrb

from groundstation.base.normal import NORMAL_95
from groundstation.chapters.magnetic import magnetic as chapter
from groundstation.chapters.markdown import markdown
from groundstation.results.flight import FlightResults
from groundstation.results.magnetic import METHOD_TITLES, MagneticResult
from groundstation.results.magnetic_ground import GroundDeviation
from groundstation.viewer import colours
from groundstation.viewer.chart import Axis, Chart
from groundstation.viewer.recorder import Line, Recorder
from groundstation.viewer.series import FloatArray, gap_after
from groundstation.viewer.tabs.magnetic_field import eight, sphere
from groundstation.viewer.views import document, figure_of, numbers, plot

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
    figure = figure_of(results, "magnetic_curves", "uncorrected_magnetic_heading_deg")
    if figure is None:
        return []
    curves, bands = [], []
    for name, title in METHOD_TITLES.items():
        columns = f"deviation_{name}_deg", f"sigma_{name}_deg"
        if not set(columns) <= set(figure.columns):
            continue
        value, sigma = (numbers(figure, column) for column in columns)
        if np.isfinite(value).any():
            shade = SHADES[name]
            bands.append((value - NORMAL_95 * sigma, value + NORMAL_95 * sigma, shade))
            curves.append((value, Line(title, shade, BOLD)))
    heading = numbers(figure, "uncorrected_magnetic_heading_deg")
    title = "Deviation to be added and 95 %, deg"
    return _chart(recorder, "magnetic/deviation", title, heading, curves, bands)


def _branches(recorder: Recorder, results: FlightResults) -> list[rrb.View]:
    """Magnetic minus true heading on right and left turns and in the average."""
    columns = ("right_turn_deg", "left_turn_deg", "compass_error_deg")
    figure = figure_of(results, "magnetic_table", "uncorrected_magnetic_heading_deg", *columns)
    if figure is None:
        return []
    lines = (
        Line("right turn", colours.GNSS, THIN),
        Line("left turn", colours.INS, THIN),
        Line("average", colours.LIGHT, BOLD),
    )
    curves = [(numbers(figure, column), line) for column, line in zip(columns, lines, strict=True)]
    heading = numbers(figure, "uncorrected_magnetic_heading_deg")
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
    figure = figure_of(results, "magnetic_ground_curve", "magnetic_heading_deg", "error_deg")
    if figure is not None:
        curves.append((numbers(figure, "magnetic_heading_deg"), numbers(figure, "error_deg"), FITTED))
    chart = Chart(recorder, "magnetic/ground", Axis("magnetic heading as read, deg", 0.0, 360.0), y)
    chart.curves("curves", curves)
    chart.legend([RUN, FITTED] if figure is not None else [RUN])
    return [chart.view()]


def _errors(recorder: Recorder, results: FlightResults) -> list[rrb.View]:
    """Error of the magnetic heading where no fit has seen, before and after the recommended correction."""
    in_flight = results.answer(MagneticResult)
    method = in_flight.recommended_method if in_flight else "compass_table"
    column = f"error_{method}_deg"
    figure = figure_of(results, "magnetic_samples", "time_s", "part", "error_before_deg", column)
    if figure is None:
        return []
    mine = np.asarray(figure["part"].astype(np.str_) == "held out")
    if not mine.any():
        return []
    time_ns = recorder.time_ns(numbers(figure, "time_s")[mine])
    for name, title, shade in (("error_before_deg", "before", colours.SAMPLES), (column, "after", colours.ANSWER)):
        values = numbers(figure, name)[mine]
        recorder.dots(f"magnetic/error/{title}", time_ns, values, Line(f"{title}, deg", shade, DOT))
    title = "Error of magnetic heading on data that no fit used, deg: before grey, after green"
    return [plot(title, "magnetic/error", legend=False)]


def _applied(recorder: Recorder, results: FlightResults) -> list[rrb.View]:
    """Magnetic heading before and after a deviation was applied to the log."""
    shown = {
        "uncorrected_magnetic_heading_deg": ("uncorrected", colours.SAMPLES),
        "magnetic_heading_deg": ("corrected", colours.ANSWER),
    }
    figure = figure_of(results, "corrected_heading", "time_s", *shown)
    if figure is None:
        return []
    time_ns = recorder.time_ns(numbers(figure, "time_s"))
    for column, (title, shade) in shown.items():
        recorder.dots(f"magnetic/heading/{title}", time_ns, numbers(figure, column), Line(f"{title}, deg", shade, DOT))
    title = "Magnetic heading, deg: as read grey, with the deviation applied green"
    return [plot(title, "magnetic/heading", legend=False)]


def _modulus(recorder: Recorder, results: FlightResults) -> list[rrb.View]:
    """Modulus of the field on the figures, as read and freed of the iron."""
    figure = figure_of(results, "magnetic_modulus", "time_s", "before_nt")
    if figure is None:
        return []
    shown = {"before_nt": Line("as read, nT", colours.SAMPLES, THIN)}
    shown |= {f"{name}_nt": Line(f"{title}, nT", SHADES[name]) for name, title in METHOD_TITLES.items()}
    known = [name for name in shown if name in figure.columns and np.isfinite(numbers(figure, name)).any()]
    if not known:
        return []
    time_ns = recorder.time_ns(numbers(figure, "time_s"))
    values = np.column_stack([numbers(figure, name) for name in known])
    recorder.lines("magnetic/modulus", time_ns, values, [shown[name] for name in known], gap_after(time_ns))
    return [plot("Modulus of the field on the figures, nT", "magnetic/modulus")]
