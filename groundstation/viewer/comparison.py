"""Two saved flights in one recording: entities ``A/`` and ``B/``, the clock of B moved onto that of A."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from groundstation.base.failures import attempt
from groundstation.base.geodesy import north_east_m, on_earth, plan_north_east_m
from groundstation.base.normal import NORMAL_95
from groundstation.base.timescales import iso_to_utc_ns
from groundstation.results.arrays.cooperative import SessionErrors
from groundstation.results.arrays.flight import Overview, PhaseSpans
from groundstation.results.arrays.forecast import ForecastGrowth
from groundstation.results.arrays.heading import HeadingRunning, HeadingSamples
from groundstation.results.arrays.inertial import InertialStates, InertialTrack
from groundstation.results.arrays.typed import T
from groundstation.results.comparison import Comparison
from groundstation.results.files import SavedFlight
from groundstation.results.forecast import ForecastResult
from groundstation.viewer import colours
from groundstation.viewer.chart import Axis, Chart, unbroken
from groundstation.viewer.colours import Colour
from groundstation.viewer.comparison_text import comparison_text
from groundstation.viewer.names import clean_text
from groundstation.viewer.recorder import Line, Recorder
from groundstation.viewer.recording import save_stream, send_layout
from groundstation.viewer.series import FloatArray, gap_after, wraps_after
from groundstation.viewer.tabs.track import bounds_of, grid, grid_unit
from groundstation.viewer.views import document, lanes, plot

THIN, MARK = 1.0, 5.0
WIDTHS = {"A": 3.5, "B": 1.5}  # where both agree, A is seen behind B
MARGIN_DEG = 10.0  # beyond 0 and 360
BAND_QUANTILES = (5.0, 95.0)  # the bands of the first samples may leave the picture
MARGIN = 0.1
NEAR_M = 200_000.0  # flights that begin no further apart share one plan
GROWTH_HEIGHT = 90.0


@dataclass(frozen=True)
class Half:
    """One of the two flights: its letter, what it saved, its colour, and the seconds its clock is moved by."""

    letter: str
    saved: SavedFlight
    colour: Colour
    offset_s: float = 0.0

    @property
    def width(self) -> float:
        """Of its lines, in points."""
        return WIDTHS[self.letter]

    def on_clock_of_a(self, time_s: FloatArray) -> FloatArray:
        """Flight seconds of this flight on the clock of A."""
        return np.asarray(time_s + self.offset_s)


@dataclass(frozen=True)
class CurveOfHalf:
    """Values of one flight over its time, and half the width of a band around them."""

    half: Half
    time_s: FloatArray
    values: FloatArray | None
    half_width: FloatArray | None = None


def write_comparison(path: Path, comparison: Comparison, a: SavedFlight, b: SavedFlight) -> None:
    """Write the recording that holds both flights.

    Raises
    ------
    GroundstationError
        When Rerun refused the data or the file could not be written.
    """
    identity = f"compare {comparison.a.flight_id} {comparison.b.flight_id}"
    save_stream(path, identity, lambda stream: send_comparison(stream, comparison, a, b))


def send_comparison(
    stream: rr.RecordingStream, comparison: Comparison, a: SavedFlight, b: SavedFlight
) -> rrb.Blueprint:
    """Log both flights to a stream that has its sink, send the layout; returns it.

    There is a timeline ``utc`` only where the clocks are aligned by UTC: otherwise one of them is moved.
    """
    has_utc = comparison.alignment.event == "utc" and comparison.a.start_utc is not None
    start_ns = iso_to_utc_ns(str(comparison.a.start_utc))[0] if has_utc else 0
    recorder = Recorder(stream, start_ns, has_utc)
    stream.send_recording_name(clean_text(f"{comparison.a.flight_id} | {comparison.b.flight_id}"))
    halves = (Half("A", a, colours.INS), Half("B", b, colours.GNSS, comparison.alignment.offset_s))
    recorder.document("comparison", comparison_text(comparison))
    tabs = (attempt("tab", name, tab, recorder, halves) for name, tab in TABS.items())
    return send_layout(stream, [tab for tab in tabs if tab is not None])


def _of_both(halves: Sequence[Half], kind: type[T]) -> list[tuple[Half, T]]:
    """The typed arrays of a figure, of those flights that have them."""
    return [(half, rows) for half in halves if (rows := half.saved.rows_of(kind)) is not None]


def _overview(recorder: Recorder, halves: Sequence[Half]) -> rrb.Container:
    flown = _of_both(halves, Overview)
    altitude = [CurveOfHalf(half, rows.time_s, rows.altitude_m) for half, rows in flown]
    pressure_altitude = [CurveOfHalf(half, rows.time_s, rows.pressure_altitude_m) for half, rows in flown]
    speed = [CurveOfHalf(half, rows.time_s, rows.ground_speed_mps) for half, rows in flown]
    heading = [CurveOfHalf(half, rows.time_s, rows.heading_deg) for half, rows in flown]
    views = [
        _overlay(recorder, "overview/altitude_m", "Altitude, m", altitude),
        _overlay(recorder, "overview/pressure_altitude_m", "Pressure altitude, m", pressure_altitude),
        _overlay(recorder, "overview/ground_speed_mps", "Ground speed, m/s", speed),
        _overlay(recorder, "overview/heading_deg", "INS true heading, deg", heading, is_direction=True),
        _phases(recorder, halves),
    ]
    right = [view for view in views if view is not None]
    ground = _plan(recorder, halves)
    text = document("A and B", "comparison")
    left = text if ground is None else rrb.Vertical(contents=[ground, text], row_shares=[1.0, 1.0])
    return rrb.Horizontal(
        contents=[left, *([rrb.Vertical(contents=right)] if right else [])], name="Overview of A and B"
    )


def _overlay(
    recorder: Recorder, path: str, title: str, curves: Sequence[CurveOfHalf], *, is_direction: bool = False
) -> rrb.View | None:
    """Log the curves of both flights that have values, and the bands around them; one view for both."""
    paths, shown, edges = [], [], []
    for curve in curves:
        half, values = curve.half, curve.values
        if values is None or not np.isfinite(values).any():
            continue
        time_ns = recorder.time_ns(half.on_clock_of_a(curve.time_s))
        breaks = gap_after(time_ns) | wraps_after(values) if is_direction else gap_after(time_ns)
        paths.append(f"{half.letter}/{path}")
        if curve.half_width is not None:
            width, line = curve.half_width, Line(f"{half.letter}: ± 95 %", half.colour, half.width)
            edges += [values - width, values + width]
            recorder.band(paths[-1], time_ns, values, width, line, breaks)
        else:
            line = Line(f"{half.letter}: {title}", half.colour, half.width)
            recorder.lines(paths[-1], time_ns, values[:, None], [line], breaks)
        shown.append(values)
    if not paths:
        return None
    axis_range = (-MARGIN_DEG, 360.0 + MARGIN_DEG) if is_direction else _range(shown, edges)
    return plot(f"{title}, A and B", paths, axis_range=axis_range)


def _range(shown: Sequence[FloatArray], edges: Sequence[FloatArray]) -> tuple[float, float] | None:
    """Axis for series with bands: all of the series, and the bands most of the time; None without bands."""
    known = [edge[np.isfinite(edge)] for edge in edges]
    ends = [float(end) for edge in known if edge.size for end in np.percentile(edge, BAND_QUANTILES)]
    if not ends:
        return None
    values = np.concatenate([series[np.isfinite(series)] for series in shown])
    low, high = min(float(values.min()), *ends), max(float(values.max()), *ends)
    margin = max(MARGIN * (high - low), 1e-6)
    return low - margin, high + margin


def _phases(recorder: Recorder, halves: Sequence[Half]) -> rrb.View | None:
    paths = []
    for half, spans in _of_both(halves, PhaseSpans):
        if np.isfinite(spans.end_s).any():
            paths.append(f"{half.letter}/phase")
            ends_s = half.on_clock_of_a(spans.start_s), half.on_clock_of_a(spans.end_s)
            recorder.spans(paths[-1], *ends_s, spans.phase, colours.PHASES)
    return lanes("Flight phase of A and B", paths) if paths else None


def _plan(recorder: Recorder, halves: Sequence[Half]) -> rrb.View | None:
    """Both tracks from above, each with a marker at the cursor; of flights far apart each from its own beginning."""
    tracks = []
    for half, flown in _of_both(halves, Overview):
        positions = np.column_stack(on_earth(flown.latitude_deg, flown.longitude_deg))
        known = np.asarray(np.isfinite(positions).all(axis=1))
        if known.any():
            tracks.append((half, half.on_clock_of_a(flown.time_s), positions, known))
    if not tracks:
        return None
    origins = [positions[known][0] for _, _, positions, known in tracks]
    apart_m = np.hypot(*north_east_m(origins[-1][0], origins[-1][1], *origins[0]))
    is_shared = bool(apart_m <= NEAR_M)
    places = []
    for (half, time_s, positions, known), origin in zip(tracks, origins, strict=True):
        north, east = plan_north_east_m(positions[:, 0], positions[:, 1], *(origins[0] if is_shared else origin))
        points = np.column_stack([east, -north])  # the axes of a Rerun picture run right and down
        places.append(points[known])
        _track(recorder, half, time_s, points, known)
    low, high = bounds_of(np.concatenate(places))
    recorder.static("plan/grid", grid(low, high))
    bounds = rrb.VisualBounds2D(x_range=[low[0], high[0]], y_range=[low[1], high[1]])
    unit, start = grid_unit(float((high - low).max()))[0], "the first position" if is_shared else "each one's own start"
    contents = ["+ /plan/**", *(f"+ /{half.letter}/plan/**" for half, *_ in tracks)]
    name = f"Tracks of A (blue) and B (orange), {unit} east and north of {start}"
    return rrb.Spatial2DView(name=name, origin="/", contents=contents, visual_bounds=bounds)


def _track(recorder: Recorder, half: Half, time_s: FloatArray, points: FloatArray, known: np.ndarray) -> None:
    strips = unbroken(points)
    recorder.static(
        f"{half.letter}/plan/track",
        rr.LineStrips2D(
            strips,
            colors=[half.colour] * len(strips),
            radii=rr.Radius.ui_points(0.5 * half.width),
            draw_order=1.0 if half.letter == "A" else 2.0,
        ),
    )
    style = rr.Points2D.from_fields(
        colors=[half.colour], labels=[half.letter], radii=rr.Radius.ui_points(MARK), draw_order=3.0
    )
    recorder.static(f"{half.letter}/plan/now", style)
    rows = rr.Points2D.columns(positions=points[known].astype(np.float32))
    recorder.stream.send_columns(f"{half.letter}/plan/now", recorder.indexes(recorder.time_ns(time_s[known])), rows)


def _heading(recorder: Recorder, halves: Sequence[Half]) -> rrb.Container | None:
    """Running mean of the heading difference with its interval."""
    title = "Heading error, running mean ± 95 %, deg"
    running = [
        CurveOfHalf(half, rows.time_s, rows.mean_deg, rows.honest_half_width_deg)
        for half, rows in _of_both(halves, HeadingRunning)
    ]
    view = _overlay(recorder, "heading_running/mean_deg", title, running)
    speeds = [CurveOfHalf(half, rows.time_s, rows.ground_speed_mps) for half, rows in _of_both(halves, HeadingSamples)]
    speed = _overlay(recorder, "heading_samples/ground_speed_mps", "Ground speed at the samples, m/s", speeds)
    views = [one for one in (view, speed) if one is not None]
    return None if view is None else rrb.Vertical(contents=views, row_shares=[2.0, 1.0], name="Heading")


def _inertial(recorder: Recorder, halves: Sequence[Half]) -> rrb.Container | None:
    """Errors of position and velocity that the filter estimated, and the radial error against GNSS."""
    positions: dict[str, list[CurveOfHalf]] = {"north": [], "east": []}
    velocities: dict[str, list[CurveOfHalf]] = {"north": [], "east": []}
    for half, states in _of_both(halves, InertialStates):
        for channel, one in (("north", states.north), ("east", states.east)):
            width = NORMAL_95 * one.position_sigma_m
            positions[channel].append(CurveOfHalf(half, states.time_s, one.position_m, width))
            width = NORMAL_95 * one.velocity_sigma_mps
            velocities[channel].append(CurveOfHalf(half, states.time_s, one.velocity_mps, width))
    rows = []
    for state, suffix, unit, of_both in (("position", "m", "m", positions), ("velocity", "mps", "m/s", velocities)):
        views = []
        for channel, curves in of_both.items():
            title = f"{channel.capitalize()} {state} error, {unit}"
            views.append(_overlay(recorder, f"inertial_states/{channel}_{state}_{suffix}", title, curves))
        shown = [view for view in views if view is not None]
        if shown:
            rows.append(rrb.Horizontal(contents=shown))
    errors = [CurveOfHalf(half, track.time_s, track.ins_error_m) for half, track in _of_both(halves, InertialTrack)]
    radial = _overlay(recorder, "inertial_track/ins_error_m", "Radial error of the INS against GNSS, m", errors)
    contents: list[rrb.View | rrb.Container] = [*rows, *([] if radial is None else [radial])]
    return rrb.Vertical(contents=contents, name="INS errors") if contents else None


def _cooperative(recorder: Recorder, halves: Sequence[Half]) -> rrb.Container | None:
    """What two sessions computed of their errors, and what these were."""
    found = _of_both(halves, SessionErrors)
    computed = [CurveOfHalf(half, rows.time_s, rows.two_sigma_r_m) for half, rows in found]
    errors = [CurveOfHalf(half, rows.time_s, rows.rms_error_m) for half, rows in found]
    views = (
        _overlay(recorder, "session_errors/two_sigma_r_m", "2σ_r as computed, worst aircraft, m", computed),
        _overlay(recorder, "session_errors/rms_error_m", "Horizontal error, RMS of all aircraft, m", errors),
    )
    shown = [view for view in views if view is not None]
    return rrb.Vertical(contents=shown, name="Cooperative") if shown else None


def _forecast(recorder: Recorder, halves: Sequence[Half]) -> rrb.Container | None:
    """RMS of the forecast by horizon, the shipped method and the INS without one; both axes logarithmic."""
    curves: list[tuple[FloatArray, FloatArray, Line]] = []
    for half, growth in _of_both(halves, ForecastGrowth):
        forecast = half.saved.results.answer(ForecastResult)
        default = forecast.default_method if forecast else ""
        for method, width in ((default, half.width), ("raw_ins", THIN)):
            rms_m = growth.rms_m.get(method)
            if rms_m is not None and np.isfinite(rms_m).any():
                name = f"{half.letter}: {'raw INS' if method == 'raw_ins' else method.replace('_', ' ')}"
                curves.append((growth.horizon_min, rms_m, Line(clean_text(name), half.colour, width)))
    ends = [np.concatenate([one[axis] for one in curves] or [np.zeros(0)]) for axis in (0, 1)]
    ends = [values[np.isfinite(values) & (values > 0.0)] for values in ends]
    if not all(values.size for values in ends):
        return None
    x = Axis("horizon, min", float(ends[0].min()) / 1.1, float(ends[0].max()) * 1.1, "log")
    y = Axis("RMS radial error over all starts, m,", float(ends[1].min()) / 1.3, float(ends[1].max()) * 1.3, "log")
    chart = Chart(recorder, "growth", x, y, GROWTH_HEIGHT)
    chart.curves("methods", curves)
    chart.legend([line for _, _, line in curves])
    return rrb.Horizontal(contents=[chart.view()], name="Forecast")


TABS: dict[str, Callable[[Recorder, Sequence[Half]], rrb.Container | None]] = {
    "overview": _overview,
    "heading": _heading,
    "inertial": _inertial,
    "cooperative": _cooperative,
    "forecast": _forecast,
}
