"""Overview: where the aircraft went, how high, how fast, its attitude and state, and a row for each answer."""

import numpy as np
import rerun.blueprint as rrb

from groundstation.chapters.front import front
from groundstation.chapters.markdown import front_markdown
from groundstation.results.figures import FigureData
from groundstation.results.flight import FlightResults
from groundstation.viewer import colours
from groundstation.viewer.colours import Colour
from groundstation.viewer.names import path_parts
from groundstation.viewer.recorder import Line, Recorder
from groundstation.viewer.series import gap_after, wraps_after
from groundstation.viewer.tabs.track import track
from groundstation.viewer.views import document, figure_of, lanes, numbers, plot, told_by_colour

LANE_SHARE = 0.45  # height of a lane, of that of a plot
MARGIN_DEG = 10.0  # beyond 0 and 360: a nose that points north would be drawn on the frame
CIRCULAR = ("heading_deg", "magnetic_heading_deg", "track_deg")
# Rows of plots: entity, unit, columns of the figure with their names, range of the axis.
PLOTS: tuple[tuple[str, str, dict[str, str], tuple[float, float] | None], ...] = (
    (
        "height",
        "m",
        {
            "altitude_m": "altitude",
            "pressure_altitude_m": "pressure altitude",
            "height_above_airfield_m": "height above the airfield",
        },
        None,
    ),
    (
        *("speed", "m/s"),
        {
            "ground_speed_mps": "ground speed",
            "true_airspeed_mps": "true airspeed",
            "indicated_airspeed_mps": "indicated airspeed",
        },
        None,
    ),
    ("climb", "m/s", {"climb_mps": "climb"}, None),
    (
        *("directions", "deg"),
        {"heading_deg": "INS true heading", "magnetic_heading_deg": "INS magnetic heading", "track_deg": "GNSS track"},
        (-MARGIN_DEG, 360.0 + MARGIN_DEG),
    ),
    ("attitude", "deg", {"roll_deg": "roll, right wing down", "pitch_deg": "pitch, nose up"}, None),
)
SHADES = {
    **dict.fromkeys(("altitude_m", "heading_deg", "climb_mps", "roll_deg"), colours.INS),
    **dict.fromkeys(("ground_speed_mps", "track_deg", "pitch_deg"), colours.GNSS),
    **dict.fromkeys(("pressure_altitude_m", "height_above_airfield_m", "magnetic_heading_deg"), colours.HONEST),
    **dict.fromkeys(("true_airspeed_mps", "indicated_airspeed_mps"), colours.ANSWER),
}


def overview(recorder: Recorder, results: FlightResults) -> rrb.Container:
    """Log the overview: whatever there is of track, plots and lanes, and always the summary."""
    recorder.document("summary", front_markdown(front(results)))
    summary = document("Flight", "summary")
    figure = figure_of(results, "overview", "time_s")
    ground = None if figure is None else track(recorder, results, figure)
    left = summary if ground is None else rrb.Vertical(contents=[ground, summary], row_shares=[1.5, 1.0])
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
    return rrb.Horizontal(contents=columns, column_shares=[1.0, 1.2][: len(columns)], name="Overview")


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
    """A view for each row of PLOTS that the flight has; its title names the lines, for a legend would cover them."""
    views: list[rrb.View] = []
    time_ns = recorder.time_ns(numbers(figure, "time_s"))
    for path, unit, columns, axis_range in PLOTS:
        known = [name for name in columns if name in figure.columns and np.isfinite(numbers(figure, name)).any()]
        for name in known:
            values, line = numbers(figure, name), Line(f"{columns[name]}, {unit}", SHADES[name])
            breaks = gap_after(time_ns) | wraps_after(values) if name in CIRCULAR else gap_after(time_ns)
            recorder.lines(f"overview/{path}/{name}", time_ns, values[:, None], [line], breaks)
        if known:
            title = told_by_colour([Line(columns[name], SHADES[name]) for name in known], unit)
            paths = [f"overview/{path}/{name}" for name in known]
            views.append(plot(title, paths, axis_range=axis_range, legend=False))
    return views
