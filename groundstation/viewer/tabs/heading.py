"""Heading: the INS heading error found on straight taxi, how it grew, and what it rests on."""

import numpy as np
import rerun.blueprint as rrb

from groundstation.chapters.heading import heading as heading_chapter
from groundstation.chapters.markdown import markdown
from groundstation.results.arrays.heading import HeadingLanes, HeadingRunning, HeadingSamples, StandstillVelocity
from groundstation.results.flight import FlightResults
from groundstation.results.heading import HeadingResult
from groundstation.viewer import colours
from groundstation.viewer.recorder import Line, Recorder
from groundstation.viewer.series import FloatArray, gap_after, wraps_after
from groundstation.viewer.tabs import distribution
from groundstation.viewer.tabs.heading_runs import AFTER_TAXI, heading_runs, range_of_used, speed_limit_mps
from groundstation.viewer.tabs.overview import log_lane
from groundstation.viewer.views import document, lanes, plot

THIN, BOLD, DOT = 1.0, 2.5, 1.6


def heading(recorder: Recorder, results: FlightResults) -> rrb.Container | None:
    """Log the heading tab; None when the flight was not assessed: the overview says why."""
    if results.answer(HeadingResult) is None:
        return None
    recorder.document("heading/verdict", markdown(heading_chapter(results)))
    verdict = document("Verdict and the number to type", "heading/verdict")
    plots = [*_difference(recorder, results), *_taxi(recorder, results), *_lanes(recorder, results)]
    runs = heading_runs(recorder, results)
    pictures = [
        *distribution.heading_error(recorder, results),
        *_standstill(recorder, results),
        *distribution.mean_speed(recorder, results),
    ]
    columns: list[rrb.View | rrb.Container] = []
    if plots:
        shares = [3.0, 2.0, 2.0, 1.0][: len(plots)]
        whole = rrb.Vertical(contents=plots, row_shares=shares, name="The whole flight")
        columns.append(rrb.Tabs(contents=[runs, whole], active_tab=0) if runs is not None else whole)
    columns.append(verdict)
    if pictures:
        columns.append(rrb.Vertical(contents=pictures))
    widths = {1: [1.0], 2: [3.0, 2.0], 3: [5.0, 4.0, 3.5]}[len(columns)]
    return rrb.Horizontal(contents=columns, column_shares=widths, name="Heading")


def _difference(recorder: Recorder, results: FlightResults) -> list[rrb.View]:
    """Differences d as dots, the running mean, and two filled bands about it: the honest one and the paper's."""
    path = "heading/difference"
    samples = results.rows_of(HeadingSamples)
    running = results.rows_of(HeadingRunning)
    if samples is not None and samples.is_used.any():
        recorder.dots(
            f"{path}/samples",
            recorder.time_ns(samples.time_s[samples.is_used]),
            samples.difference_deg[samples.is_used],
            Line("INS heading − GNSS track, deg", colours.SAMPLES, DOT),
        )
    if running is not None:
        _running(recorder, f"{path}/running", running)
    if samples is None and running is None:
        return []
    name = "d = INS heading − GNSS track, deg: samples grey, mean ± honest 95 % green, ± e yellow"
    return [plot(name, path, axis_range=None if samples is None else range_of_used(samples), legend=False)]


def _running(recorder: Recorder, path: str, running: HeadingRunning) -> None:
    time_ns, mean = recorder.time_ns(running.time_s), running.mean_deg
    gaps = gap_after(time_ns)
    line = Line("mean ± e (the paper's precision), deg", colours.PAPER, THIN)
    recorder.band(f"{path}/a_precision", time_ns, mean, running.precision_deg, line, gaps)
    line = Line("mean ± honest 95 % interval, deg", colours.ANSWER, BOLD)
    recorder.band(f"{path}/b_honest", time_ns, mean, running.honest_half_width_deg, line, gaps)


def _taxi(recorder: Recorder, results: FlightResults) -> list[rrb.View]:
    """Heading and track while the aircraft moved, and the ground speed with its threshold."""
    samples = results.rows_of(HeadingSamples)
    if samples is None:
        return []
    ground = ~np.isin(samples.gate, AFTER_TAXI)  # the axes should show the taxi, not what comes after it
    time_ns = recorder.time_ns(samples.time_s)[ground]
    speed, heading_deg = samples.ground_speed_mps[ground], samples.heading_deg[ground]
    track_deg = np.where(samples.gate == "too slow", np.nan, samples.track_deg)[ground]  # noise at standstill
    gaps = gap_after(time_ns)
    for name, values, line in (
        ("heading", heading_deg, Line("INS true heading, deg", colours.INS)),
        ("track", track_deg, Line("GNSS track above the speed threshold, deg", colours.GNSS)),
    ):
        recorder.lines(f"heading/taxi/{name}", time_ns, values[:, None], [line], gaps | wraps_after(values))
    limit = speed_limit_mps(results)
    limits = np.full(len(speed), limit)
    lines = [Line("GNSS ground speed, m/s", colours.GNSS), Line(f"threshold {limit:g} m/s", colours.LIMIT, THIN)]
    recorder.lines("heading/speed", time_ns, np.column_stack([speed, limits]), lines, gaps)
    return [
        plot("On the ground: INS heading (blue), GNSS track (orange), deg", "heading/taxi", legend=False),
        plot(f"GNSS ground speed (orange), threshold {limit:g} m/s (red)", "heading/speed", legend=False),
    ]


def _lanes(recorder: Recorder, results: FlightResults) -> list[rrb.View]:
    paths = log_lane(recorder, "heading/gate", results.rows_of(HeadingLanes), colours.GATES)
    return [lanes("Why samples were used or not", paths)] if paths else []


def _standstill(recorder: Recorder, results: FlightResults) -> list[rrb.View]:
    figure = results.rows_of(StandstillVelocity)
    if figure is None:
        return []
    time_ns = recorder.time_ns(figure.time_s)
    values: FloatArray = np.column_stack([figure.velocity_north_mps, figure.velocity_east_mps])
    lines = [Line("GNSS velocity north, m/s", colours.BLUE), Line("GNSS velocity east, m/s", colours.GNSS)]
    recorder.lines("heading/standstill", time_ns, values, lines, gap_after(time_ns))
    return [plot("GNSS velocity at standstill, m/s: north dark blue, east orange", "heading/standstill", legend=False)]
