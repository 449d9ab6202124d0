"""Tab of the overview: track, height, speed, attitude and state, a row for each answer."""

from collections.abc import Callable, Mapping

import numpy as np
import rerun.blueprint as rrb

from groundstation.base.dataclasses import dataclass
from groundstation.chapters.front import front
from groundstation.chapters.markdown import front_markdown
from groundstation.results.arrays.flight import GnssLanes, Overview, PhaseSpans, StateLanes
from groundstation.results.flight import FlightResults
from groundstation.viewer import colours
from groundstation.viewer.colours import Colour
from groundstation.viewer.names import path_parts
from groundstation.viewer.recorder import Line, Recorder
from groundstation.viewer.series import FloatArray, gap_after, wraps_after
from groundstation.viewer.tabs.track import track
from groundstation.viewer.views import document, lanes, plot, told_by_colour

LANE_SHARE = 0.45  # height of a lane, of that of a plot
MARGIN_DEG = 10.0  # beyond 0 and 360: a nose that points north would be drawn on the frame


@dataclass(frozen=True)
class OverviewLine:
    """Line of a plot: end of its path, name, colour, and values (None where none is logged)."""

    part: str
    name: str
    colour: Colour
    values_of: Callable[[Overview], FloatArray | None]


@dataclass(frozen=True)
class OverviewRow:
    """Plot: path, unit, lines, range of the axis, and whether its lines wrap at 360."""

    path: str
    unit: str
    lines: tuple[OverviewLine, ...]
    axis_range: tuple[float, float] | None = None
    is_circular: bool = False


PLOTS = (
    OverviewRow(
        "height",
        "m",
        (
            OverviewLine("altitude_m", "altitude", colours.INS, lambda data: data.altitude_m),
            OverviewLine(
                "pressure_altitude_m", "pressure altitude", colours.HONEST, lambda data: data.pressure_altitude_m
            ),
            OverviewLine(
                "height_above_airfield_m",
                "height above the airfield",
                colours.HONEST,
                lambda data: data.height_above_airfield_m,
            ),
        ),
    ),
    OverviewRow(
        "speed",
        "m/s",
        (
            OverviewLine("ground_speed_mps", "ground speed", colours.GNSS, lambda data: data.ground_speed_mps),
            OverviewLine("true_airspeed_mps", "true airspeed", colours.ANSWER, lambda data: data.true_airspeed_mps),
            OverviewLine(
                "indicated_airspeed_mps",
                "indicated airspeed",
                colours.ANSWER,
                lambda data: data.indicated_airspeed_mps,
            ),
        ),
    ),
    OverviewRow("climb", "m/s", (OverviewLine("climb_mps", "climb", colours.INS, lambda data: data.climb_mps),)),
    OverviewRow(
        "directions",
        "deg",
        (
            OverviewLine("heading_deg", "INS true heading", colours.INS, lambda data: data.heading_deg),
            OverviewLine(
                "magnetic_heading_deg",
                "INS magnetic heading",
                colours.HONEST,
                lambda data: data.magnetic_heading_deg,
            ),
            OverviewLine("track_deg", "GNSS track", colours.GNSS, lambda data: data.track_deg),
        ),
        (-MARGIN_DEG, 360.0 + MARGIN_DEG),
        is_circular=True,
    ),
    OverviewRow(
        "attitude",
        "deg",
        (
            OverviewLine("roll_deg", "roll, right wing down", colours.INS, lambda data: data.roll_deg),
            OverviewLine("pitch_deg", "pitch, nose up", colours.GNSS, lambda data: data.pitch_deg),
        ),
    ),
)


def overview(recorder: Recorder, results: FlightResults) -> rrb.Container:
    """Log the overview: whatever there is of track, plots and lanes, and always the summary."""
    recorder.document("summary", front_markdown(front(results, recorder.systems.chapters)))
    summary = document("Flight", "summary")
    figure = results.rows_of(Overview)
    ground = None if figure is None else track(recorder, results, figure)
    left = summary if ground is None else rrb.Vertical(contents=[ground, summary], row_shares=[1.5, 1.0])
    right: list[rrb.View] = [] if figure is None else _plots(recorder, figure)
    shares = [1.0] * len(right)
    lane_paths = [
        *log_lane(recorder, "flight/phase", results.rows_of(PhaseSpans), colours.PHASES),
        *log_lane(recorder, "flight/GNSS", results.rows_of(GnssLanes), colours.GNSS_STATES),
    ]
    lane_paths += _state_lanes(recorder, results)
    if lane_paths:
        right.append(lanes("Flight phase, states and GNSS", lane_paths))
        shares.append(max(1.0, LANE_SHARE * len(lane_paths)))
    columns = [left, *([rrb.Vertical(contents=right, row_shares=shares)] if right else [])]
    return rrb.Horizontal(contents=columns, column_shares=[1.0, 1.2][: len(columns)], name="Overview")


def log_lane(
    recorder: Recorder, path: str, spans: PhaseSpans | GnssLanes | None, palette: Mapping[str, Colour]
) -> list[str]:
    """Log spans as one lane; the path logged, or nothing when the flight has none."""
    if spans is None:
        return []
    states = spans.phase if isinstance(spans, PhaseSpans) else spans.state
    over_limit = {state: colours.OVER_LIMIT for state in states.tolist() if ">" in state}  # "gdop > 2"
    recorder.spans(path, spans.start_s, spans.end_s, states, {**palette, **over_limit})
    return [path]


def _state_lanes(recorder: Recorder, results: FlightResults) -> list[str]:
    """Log flight mode, arming and ground contact, a lane each; the paths logged."""
    figure = results.rows_of(StateLanes)
    if figure is None:
        return []
    found = list(dict.fromkeys(figure.lane.tolist()))
    paths = [f"flight/{part}" for part in path_parts(["phase", "GNSS", *found])[2:]]
    for lane, path in zip(found, paths, strict=True):
        rows = figure.lane == lane
        recorder.spans(path, figure.start_s[rows], figure.end_s[rows], figure.state[rows], colours.STATES)
    return paths


def _plots(recorder: Recorder, figure: Overview) -> list[rrb.View]:
    """Log a view for each row of PLOTS that the flight has.

    Its title names the lines: a legend would cover them.
    """
    views: list[rrb.View] = []
    time_ns = recorder.time_ns(figure.time_s)
    for row in PLOTS:
        paths, told = [], []
        for shown in row.lines:
            values = shown.values_of(figure)
            if values is None or not np.isfinite(values).any():
                continue
            line = Line(f"{shown.name}, {row.unit}", shown.colour)
            breaks = gap_after(time_ns) | wraps_after(values) if row.is_circular else gap_after(time_ns)
            recorder.lines(f"overview/{row.path}/{shown.part}", time_ns, values[:, None], [line], breaks)
            paths.append(f"overview/{row.path}/{shown.part}")
            told.append(Line(shown.name, shown.colour))
        if paths:
            views.append(plot(told_by_colour(told, row.unit), paths, axis_range=row.axis_range, legend=False))
    return views
