"""An INS that GNSS corrects: INS - GNSS, and the innovations of its own filter with its band."""

import numpy as np
import rerun.blueprint as rrb

from groundstation.base.normal import NORMAL_95
from groundstation.results.figures import FigureData, numbers
from groundstation.results.flight import FlightResults
from groundstation.viewer import colours
from groundstation.viewer.recorder import Line, Recorder
from groundstation.viewer.series import gap_after
from groundstation.viewer.views import figure_of, plot

SHOWN = (("position", "m", "m"), ("velocity", "mps", "m/s"))
CHANNELS = ("north", "east")
THIN, BOLD = 1.0, 1.5


def aided_pages(recorder: Recorder, results: FlightResults) -> list[rrb.Container]:
    """Pages of plots, north on the left and east on the right; none for an INS that GNSS does not correct."""
    pages: list[rrb.Container] = []
    for figure_name, name, of in (
        ("inertial_differences", "INS − GNSS", "INS − GNSS"),
        ("inertial_own_innovations", "Its own filter", "innovation, GNSS − predicted"),
    ):
        figure = figure_of(results, figure_name, "time_s")
        if figure is None:
            continue
        columns = [
            rrb.Vertical(contents=[_plot(recorder, figure, channel, *row, of) for row in SHOWN]) for channel in CHANNELS
        ]
        pages.append(rrb.Horizontal(contents=columns, name=name))
    return pages


def _plot(
    recorder: Recorder, figure: FigureData, channel: str, quantity: str, suffix: str, unit: str, of: str
) -> rrb.View:
    path = f"inertial/{figure.name.removeprefix('inertial_')}/{channel}_{quantity}"
    time_ns = recorder.time_ns(numbers(figure, "time_s"))
    values, series, lines = numbers(figure, f"{channel}_{quantity}_{suffix}"), [], []
    half = NORMAL_95 * numbers(figure, f"{channel}_{quantity}_sigma_{suffix}")
    if np.isfinite(half).any():
        series += [half, -half]
        lines += [Line(f"± 1.96 σ of the filter, {unit}", colours.HONEST, THIN)] * 2
    series.append(values)
    lines.append(Line(f"{of}, {unit}", colours.INS, BOLD))
    recorder.lines(path, time_ns, np.column_stack(series), lines, gap_after(time_ns))
    title = f"{channel.capitalize()} {quantity}: {of}, {unit}"
    return plot(title, path, legend=len(lines) > 1)
