"""Overview: where the aircraft went, how high, how fast, where it pointed, and in what state it was."""

import numpy as np
import rerun.blueprint as rrb

from groundstation.chapters.findings import not_assessable
from groundstation.chapters.front import front
from groundstation.chapters.markdown import front_markdown, part_markdown
from groundstation.results.figures import FigureData
from groundstation.results.flight import FlightResults
from groundstation.viewer import colours
from groundstation.viewer.colours import Colour
from groundstation.viewer.names import path_parts
from groundstation.viewer.recorder import Line, Recorder
from groundstation.viewer.series import gap_after, wraps_after
from groundstation.viewer.tabs.track import track
from groundstation.viewer.views import document, figure_of, lanes, numbers, plot

LANE_SHARE = 0.35  # height of a lane, of that of a plot
MARGIN_DEG = 10.0  # beyond 0 and 360: a nose that points north would be drawn on the frame


def overview(recorder: Recorder, results: FlightResults) -> rrb.Container:
    """Log the overview: whatever there is of track, plots and lanes, and always the summary."""
    recorder.document("summary", _summary(results))
    summary = document("Flight", "summary")
    figure = figure_of(results, "overview", "time_s")
    ground = None if figure is None else track(recorder, results, figure)
    left = summary if ground is None else rrb.Vertical(contents=[ground, summary], row_shares=[2.0, 1.0])
    right: list[rrb.View] = [] if figure is None else _plots(recorder, figure)
    shares = [1.0] * len(right)
    lane_paths = [
        *log_lane(recorder, results, "phases", "phase", "flight/phase", colours.PHASES),
        *log_lane(recorder, results, "gnss_lanes", "state", "flight/GNSS", colours.GNSS_STATES),
    ]
    lane_paths += _state_lanes(recorder, results)
    if lane_paths:
        right.append(lanes("Flight phase, states and GNSS", lane_paths))
        shares.append(max(1.0, LANE_SHARE * len(lane_paths)))
    columns = [left, *([rrb.Vertical(contents=right, row_shares=shares)] if right else [])]
    return rrb.Horizontal(contents=columns, name="Overview")


def log_lane(
    recorder: Recorder, results: FlightResults, name: str, column: str, path: str, palette: dict[str, Colour]
) -> list[str]:
    """Log the spans of a figure as one lane; the path logged, or nothing when the flight has no such figure."""
    figure = figure_of(results, name, "start_s", "end_s", column)
    if figure is None:
        return []
    states = figure[column].astype(np.str_)
    over_limit = {state: colours.OVER_LIMIT for state in states.tolist() if ">" in state}  # "gdop > 2"
    recorder.spans(path, numbers(figure, "start_s"), numbers(figure, "end_s"), states, palette | over_limit)
    return [path]


def _state_lanes(recorder: Recorder, results: FlightResults) -> list[str]:
    """Log flight mode, arming and ground contact, a lane each; the paths logged."""
    figure = figure_of(results, "state_lanes", "lane", "start_s", "end_s", "state")
    if figure is None:
        return []
    names = figure["lane"].astype(np.str_)
    found = list(dict.fromkeys(names.tolist()))
    paths = [f"flight/{part}" for part in path_parts(["phase", "GNSS", *found])[2:]]
    for lane, path in zip(found, paths, strict=True):
        rows = names == lane
        states = figure["state"].astype(np.str_)[rows]
        start, end = numbers(figure, "start_s")[rows], numbers(figure, "end_s")[rows]
        recorder.spans(path, start, end, states, colours.STATES)
    return paths


def _plots(recorder: Recorder, figure: FigureData) -> list[rrb.View]:
    views: list[rrb.View] = []
    for column, name, line in (
        ("altitude_m", "Altitude, m", Line("altitude, m", colours.INS)),
        ("pressure_altitude_m", "Pressure altitude, m", Line("pressure altitude, m", colours.INS)),
        ("ground_speed_mps", "Ground speed, m/s", Line("ground speed, m/s", colours.GNSS)),
    ):
        if column in figure.columns and np.isfinite(numbers(figure, column)).any():
            path = f"overview/{column.rpartition('_')[0]}"
            time_ns = recorder.time_ns(numbers(figure, "time_s"))
            recorder.lines(path, time_ns, numbers(figure, column)[:, None], [line], gap_after(time_ns))
            views.append(plot(name, path, legend=False))
    directions = [
        ("heading_deg", "overview/directions/heading", Line("INS true heading, deg", colours.INS)),
        ("track_deg", "overview/directions/track", Line("GNSS track, deg", colours.GNSS)),
    ]
    paths = [path for column, path, line in directions if _direction(recorder, figure, column, path, line)]
    if paths:
        views.append(plot("INS heading and GNSS track, deg", paths, axis_range=(-MARGIN_DEG, 360.0 + MARGIN_DEG)))
    return views


def _direction(recorder: Recorder, figure: FigureData, column: str, path: str, line: Line) -> bool:
    """Log a heading or a track, interrupted where it crosses north; False when it has no value."""
    if column not in figure.columns or not np.isfinite(numbers(figure, column)).any():
        return False
    time_ns, values = recorder.time_ns(numbers(figure, "time_s")), numbers(figure, column)
    recorder.lines(path, time_ns, values[:, None], [line], gap_after(time_ns) | wraps_after(values))
    return True


def _summary(results: FlightResults) -> str:
    """The front of the report, and what could not be assessed."""
    missing = not_assessable(results)
    parts = [front_markdown(front(results)), *([] if missing is None else [part_markdown(missing)])]
    return "\n\n".join(parts)
