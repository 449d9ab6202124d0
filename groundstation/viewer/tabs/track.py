"""Track in space and from above: a plan that needs no network, and a map on demand.

Rerun's map fetches tiles over the network for the very place flown over, whatever the provider. Therefore the plan
opens first; the map has its own tab, and a hidden tab fetches nothing.
"""

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from groundstation.base.ellipse import ELLIPSE_95
from groundstation.base.geodesy import continuous_longitude_deg, on_earth, plan_north_east_m
from groundstation.base.records import BoolArray
from groundstation.results.arrays.flight import Overview, PhaseSpans
from groundstation.results.corrected_position import corrected_position
from groundstation.results.flight import FlightResults
from groundstation.viewer import colours
from groundstation.viewer.colours import Colour
from groundstation.viewer.recorder import Recorder
from groundstation.viewer.series import FloatArray
from groundstation.viewer.tabs.flight_space import flight_space

LINE, MARK, GRID_LINE = 1.6, 5.0, 0.5  # widths and radii in points of the screen
TILE_PIXELS, MAP_PIXELS, MAX_ZOOM = 256.0, 500.0, 18.0
MAP_LATITUDE_DEG = 85.0  # beyond it the map, in Mercator's projection, has no tiles and soon no end
GRID_LINES = 6  # about so many across the longer side
MARGIN = 0.08  # of the longer side, around the track
LARGEST_IN_M = 3000.0  # a plan no larger is labelled in metres, as in the report
SMALLEST_M = 20.0  # side of the plan of an aircraft that never moved


def track(recorder: Recorder, results: FlightResults, figure: Overview) -> rrb.Container | None:
    """Log the track by flight phase with the aircraft at the cursor.

    None for a flight without positions on Earth and without attitude.
    """
    time_s, positions = figure.time_s, np.column_stack(on_earth(figure.latitude_deg, figure.longitude_deg))
    known = np.asarray(np.isfinite(positions).all(axis=1), dtype=bool)
    if not known.any():
        space = flight_space(recorder, figure, None, [], [])
        return None if space is None else rrb.Tabs(contents=[space])
    pieces, shades = _pieces(results, time_s, known)
    north, east = plan_north_east_m(positions[:, 0], positions[:, 1], *positions[known][0].tolist())
    space = flight_space(recorder, figure, np.column_stack([east, north]), pieces, shades)
    plan_m = np.column_stack([east, -north])
    ellipses = _ellipses(recorder, results, positions[known][0], plan_m[known])
    plan = _plan(recorder, time_s, plan_m, known, pieces, shades, ellipses)
    views = [plan, _map(recorder, time_s, positions, known, pieces, shades)]
    return rrb.Tabs(contents=[*([] if space is None else [space]), *views], active_tab=0)


def _plan(
    recorder: Recorder,
    time_s: FloatArray,
    points: FloatArray,
    known: BoolArray,
    pieces: list[slice],
    shades: list[Colour],
    ellipses: str,
) -> rrb.Spatial2DView:
    """Log the plan: ``points`` are metres east and south.

    The axes of a Rerun picture run right and down. ``ellipses`` says in the title what those on it are.
    """
    low, high = bounds_of(points[known])
    recorder.static("plan/grid", grid(low, high))
    recorder.static(
        "plan/track",
        rr.LineStrips2D(
            [points[piece] for piece in pieces], colors=shades, radii=rr.Radius.ui_points(LINE), draw_order=1.0
        ),
    )
    recorder.static(
        "plan/ends",
        rr.Points2D(
            points[known][[0, -1]],
            colors=[colours.ANSWER, colours.LIMIT],
            labels=["start", "end"],
            radii=rr.Radius.ui_points(MARK),
            draw_order=2.0,
        ),
    )
    style = rr.Points2D.from_fields(colors=[colours.PAPER], radii=rr.Radius.ui_points(MARK), draw_order=3.0)
    recorder.static("plan/now", style)
    rows = recorder.time_ns(time_s[known])
    recorder.stream.send_columns(
        "plan/now", recorder.indexes(rows), rr.Points2D.columns(positions=points[known].astype(np.float32))
    )
    bounds = rrb.VisualBounds2D(x_range=[low[0], high[0]], y_range=[low[1], high[1]])
    unit = grid_unit(float((high - low).max()))[0]
    name = f"Plan, {unit} east and north{ellipses}"
    return rrb.Spatial2DView(name=name, origin="/plan", visual_bounds=bounds)


def _ellipses(recorder: Recorder, results: FlightResults, origin_deg: FloatArray, points: FloatArray) -> str:
    """Log 95 % ellipses of the corrected position along the plan and at the cursor.

    Returns their description, empty for none.
    """
    corrected = corrected_position(results)
    if corrected is None:
        return ""
    rows, larger = corrected.drawn_on(float(np.ptp(points, axis=0).max()))
    north, east = plan_north_east_m(corrected.latitude_deg, corrected.longitude_deg, *origin_deg.tolist())
    middle = np.column_stack([east, -north]).astype(np.float32)
    half = larger * ELLIPSE_95 * np.column_stack([corrected.sigma_east_m, corrected.sigma_north_m]).astype(np.float32)
    thin = rr.Radius.ui_points(GRID_LINE)
    along = rr.Ellipses2D(
        half_sizes=half[rows], centers=middle[rows], colors=[colours.INS], line_radii=thin, draw_order=2.5
    )
    recorder.static("plan/ellipses", along)
    now = rr.Ellipses2D.from_fields(colors=[colours.PAPER], line_radii=thin, draw_order=2.6)
    recorder.static("plan/ellipse_now", now)
    recorder.stream.send_columns(
        "plan/ellipse_now",
        recorder.indexes(recorder.time_ns(corrected.time_s)),
        rr.Ellipses2D.columns(half_sizes=half, centers=middle),
    )
    size = f", {larger} times" if larger > 1 else ""
    return f"; ellipses: 95 % of the corrected position{size}"


def bounds_of(points: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return lower and upper corner of a plan that shows points, shape (n, 2), with a margin."""
    low, high = points.min(axis=0), points.max(axis=0)
    side = max(float((high - low).max()), SMALLEST_M)
    return low - MARGIN * side, high + MARGIN * side


def grid_step_m(side_m: float) -> float:
    """Return the distance of grid lines for a plan that is ``side_m`` across.

    1, 2 or 5 times a power of ten.

    Examples
    --------
    >>> grid_step_m(12_000.0), grid_step_m(150.0)
    (2000.0, 20.0)
    """
    decade = 10.0 ** np.floor(np.log10(side_m / GRID_LINES))
    return float(decade * min((1.0, 2.0, 5.0, 10.0), key=lambda factor: abs(factor * decade - side_m / GRID_LINES)))


def grid_unit(side_m: float) -> tuple[str, float]:
    """Return the unit of the grid's labels and its length in metres.

    The plan is ``side_m`` across.

    Examples
    --------
    >>> grid_unit(12_000.0), grid_unit(150.0)
    (('km', 1000.0), ('m', 1.0))
    """
    return ("km", 1000.0) if side_m > LARGEST_IN_M else ("m", 1.0)


def grid(low: FloatArray, high: FloatArray) -> rr.LineStrips2D:
    """Return lines of equal distance east and north; the label of each stands in its middle."""
    side = float((high - low).max())
    step, (unit, metres) = grid_step_m(side), grid_unit(side)
    strips, labels = [], []
    for axis, names in ((0, ("E", "W")), (1, ("S", "N"))):
        for place in np.arange(np.ceil(low[axis] / step), np.floor(high[axis] / step) + 1) * step:
            line = np.array([low, high])
            line[:, axis] = place
            strips.append(line)
            labels.append(f"{abs(place) / metres:.6g} {unit} {names[int(place < 0)] if place else ''}".strip())
    return rr.LineStrips2D(
        strips,
        colors=[colours.DIM] * len(strips),
        labels=labels,
        show_labels=True,
        radii=rr.Radius.ui_points(GRID_LINE),
        draw_order=0.0,
    )


def _map(
    recorder: Recorder,
    time_s: FloatArray,
    positions: FloatArray,
    known: BoolArray,
    pieces: list[slice],
    shades: list[Colour],
) -> rrb.MapView:
    """Log the track on the map, in one piece: beyond 180 deg where it crosses the date line."""
    latitude = np.clip(positions[:, 0], -MAP_LATITUDE_DEG, MAP_LATITUDE_DEG)
    positions = np.column_stack([latitude, continuous_longitude_deg(positions[:, 1])])
    strips = rr.GeoLineStrings(
        lat_lon=[positions[piece] for piece in pieces], colors=shades, radii=rr.Radius.ui_points(LINE)
    )
    recorder.static("map/track", strips)
    recorder.static("map/now", rr.GeoPoints.from_fields(colors=[colours.PAPER], radii=rr.Radius.ui_points(MARK)))
    rows = recorder.time_ns(time_s[known])
    recorder.stream.send_columns("map/now", recorder.indexes(rows), rr.GeoPoints.columns(positions=positions[known]))
    name = "Map (asks openstreetmap.org)"
    return rrb.MapView(name=name, origin="/map", zoom=zoom_of(positions[known]))


def zoom_of(positions_deg: FloatArray, pixels: float = MAP_PIXELS) -> float:
    """Return the zoom of the map, in powers of two, at which positions fill ``pixels``.

    Positions are latitude and longitude, shape (n, 2).

    Examples
    --------
    >>> zoom_of(np.array([[0.0, 0.0], [0.0, 360.0]]), 256.0), zoom_of(np.array([[56.0, 38.0]]))
    (0.0, 18.0)
    """
    low, high = positions_deg.min(axis=0), positions_deg.max(axis=0)
    stretch = np.cos(np.deg2rad(np.clip(0.5 * (low[0] + high[0]), -85.0, 85.0)))  # of the Mercator projection
    span_deg = max(float(high[0] - low[0]) / float(stretch), float(high[1] - low[1]), 1e-9)
    return float(np.clip(np.log2(360.0 / span_deg * pixels / TILE_PIXELS), 0.0, MAX_ZOOM))


def _pieces(results: FlightResults, time_s: FloatArray, known: BoolArray) -> tuple[list[slice], list[Colour]]:
    """Cut the track at gaps and phase changes; neighbouring pieces share their joint."""
    phase = np.full(len(time_s), "unknown", dtype="U32")
    spans = results.rows_of(PhaseSpans)
    if spans is not None:
        for start, end, name in zip(spans.start_s, spans.end_s, spans.phase.tolist(), strict=True):
            phase[(time_s >= start) & (time_s <= end)] = name
    cuts = (np.flatnonzero((phase[1:] != phase[:-1]) | ~known[1:] | ~known[:-1]) + 1).tolist()
    pieces, shades = [], []
    for start, end in zip([0, *cuts], [*cuts, len(time_s)], strict=True):
        joint = end < len(time_s) and bool(known[end])
        if known[start] and end + joint - start > 1:
            pieces.append(slice(start, end + joint))
            shades.append(colours.PHASES.get(str(phase[start]), colours.GREY))
    return pieces, shades
