"""Magnetic: the field as a sphere before and after, and the figures as flown, coloured by branch."""

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from groundstation.base.geodesy import on_earth, plan_north_east_m
from groundstation.results.arrays.flight import Overview
from groundstation.results.arrays.magnetic import BodyField, MagneticField
from groundstation.results.flight import FlightResults
from groundstation.results.magnetic import MagneticResult, Turn
from groundstation.viewer import colours
from groundstation.viewer.chart import round_step, screen_radius
from groundstation.viewer.recorder import Recorder
from groundstation.viewer.series import FloatArray
from groundstation.viewer.tabs.track import bounds_of, grid, grid_unit

NT_PER_UT = 1000.0
EXAGGERATED_TO = 0.15  # of the radius: what the modulus differs by from the model's, as read
MARGIN_S = 30.0
THIN, BOLD, DOT = 0.8, 2.4, 2.0
CIRCLE_POINTS = 73
PARALLELS_DEG = (-60.0, -30.0, 0.0, 30.0, 60.0)


def sphere(recorder: Recorder, results: FlightResults) -> list[rrb.View]:
    """The field along the body axes on the model's sphere, as read and freed of the iron, in microtesla.

    What the modulus differs by from the model's is drawn many times larger: iron of one per cent would not be seen.
    """
    figure = results.rows_of(MagneticField)
    if figure is None:
        return []
    before, after = _known_ut(figure.before), _known_ut(figure.after)
    if not len(before):
        return []
    radius = _radius_ut(results, after if len(after) else before)
    spread = float(np.percentile(np.abs(np.linalg.norm(before, axis=1) - radius), 95.0))
    factor = max(1.0, round_step(EXAGGERATED_TO * radius / spread)) if spread > 0.0 else 1.0
    recorder.static("magnetic/field", rr.ViewCoordinates.FRD)
    recorder.static(
        "magnetic/field/model",
        rr.LineStrips3D(_circles(radius), colors=[colours.DIM], radii=screen_radius(THIN)),
    )
    for name, values, shade in (("as_read", before, colours.SAMPLES), ("freed_of_iron", after, colours.ANSWER)):
        if len(values):
            recorder.static(
                f"magnetic/field/{name}",
                rr.Points3D(_exaggerated(values, radius, factor), colors=[shade], radii=rr.Radius.ui_points(DOT)),
            )
    name = f"Field, uT forward, right, down: grey as read, green freed of iron; off the sphere x {factor:g}"
    return [rrb.Spatial3DView(name=name, origin="/magnetic/field")]


def _known_ut(field: BodyField) -> FloatArray:
    """The rows that have a field, shape (n, 3)."""
    values = np.column_stack([field.forward_nt, field.right_nt, field.down_nt]) / NT_PER_UT
    return values[np.isfinite(values).all(axis=1)]


def _radius_ut(results: FlightResults, field_ut: FloatArray) -> float:
    """Strength of the model; without one the median of the readings."""
    answer = results.answer(MagneticResult)
    declination = answer.declination if answer else None
    if declination is None or declination.horizontal_nt is None or declination.down_nt is None:
        return float(np.median(np.linalg.norm(field_ut, axis=1)))
    return float(np.hypot(declination.horizontal_nt, declination.down_nt)) / NT_PER_UT


def _exaggerated(field: FloatArray, radius: float, factor: float) -> FloatArray:
    """The same directions, distances from the sphere times a factor; shape (n, 3)."""
    length = np.maximum(np.linalg.norm(field, axis=1, keepdims=True), 1e-12)
    return np.asarray(field / length * (radius + factor * (length - radius)), dtype=np.float32)


def _circles(radius: float) -> list[FloatArray]:
    """Parallels and four meridians of a sphere."""
    turn = np.linspace(0.0, 2.0 * np.pi, CIRCLE_POINTS)
    circles = []
    for latitude in np.deg2rad(PARALLELS_DEG):
        level = np.full(CIRCLE_POINTS, np.sin(latitude))
        circles.append(np.column_stack([np.cos(turn) * np.cos(latitude), np.sin(turn) * np.cos(latitude), level]))
    for azimuth in np.deg2rad((0.0, 45.0, 90.0, 135.0)):
        circles.append(np.column_stack([np.cos(turn) * np.cos(azimuth), np.cos(turn) * np.sin(azimuth), np.sin(turn)]))
    return [radius * circle for circle in circles]


def eight(recorder: Recorder, results: FlightResults) -> list[rrb.View]:
    """The used turns on the ground track, right and left in two colours."""
    figure = results.rows_of(Overview)
    answer = results.answer(MagneticResult)
    turns = [turn for turn in (answer.turns if answer else ()) if turn.state == "used"]
    if figure is None or not turns:
        return []
    time_s = figure.time_s
    latitude, longitude = on_earth(figure.latitude_deg, figure.longitude_deg)
    start_s, end_s = min(turn.start_s for turn in turns) - MARGIN_S, max(turn.end_s for turn in turns) + MARGIN_S
    shown = np.flatnonzero((time_s >= start_s) & (time_s <= end_s) & np.isfinite(latitude) & np.isfinite(longitude))
    if len(shown) < 2:
        return []
    origin = float(latitude[shown[0]]), float(longitude[shown[0]])
    north, east = plan_north_east_m(latitude[shown], longitude[shown], *origin)
    points = np.column_stack([east, -north])  # the axes of a Rerun picture run right and down
    low, high = bounds_of(points)
    recorder.static("magnetic/eight/grid", grid(low, high))
    strips, shades = _branches(points, time_s[shown], turns)
    recorder.static(
        "magnetic/eight/track",
        rr.LineStrips2D(
            [points, *strips],
            colors=[colours.SAMPLES, *shades],
            radii=[screen_radius(THIN), *[screen_radius(BOLD)] * len(strips)],
            draw_order=1.0,
        ),
    )
    bounds = rrb.VisualBounds2D(x_range=[low[0], high[0]], y_range=[low[1], high[1]])
    unit = grid_unit(float((high - low).max()))[0]
    name = f"Figures as flown: orange right, blue left; {unit} east and north"
    return [rrb.Spatial2DView(name=name, origin="/magnetic/eight", visual_bounds=bounds)]


def _branches(
    points: FloatArray, time_s: FloatArray, turns: list[Turn]
) -> tuple[list[FloatArray], list[colours.Colour]]:
    strips, shades = [], []
    for turn in turns:
        mine = points[(time_s >= turn.start_s) & (time_s <= turn.end_s)]
        if len(mine) > 1:
            strips.append(mine)
            shades.append(colours.GNSS if turn.bank_deg > 0.0 else colours.INS)
    return strips, shades
