"""Field of the magnetic tab as a sphere, before and after."""

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from groundstation.results.flight import FlightResults
from groundstation.systems.magnetic.answer import MagneticResult
from groundstation.systems.magnetic.arrays import BodyField, MagneticField
from groundstation.viewer import colours
from groundstation.viewer.chart import round_step, screen_radius
from groundstation.viewer.recorder import Recorder
from groundstation.viewer.series import FloatArray

NT_PER_UT = 1000.0
EXAGGERATED_TO = 0.15  # of the radius: what the modulus differs by from the model's, as read
THIN, DOT = 0.8, 2.0
CIRCLE_POINTS = 73
PARALLELS_DEG = (-60.0, -30.0, 0.0, 30.0, 60.0)


def sphere(recorder: Recorder, results: FlightResults) -> list[rrb.View]:
    """Log the field along the body axes on the model's sphere, in microtesla.

    The field is shown as read, and freed of the iron. What the modulus differs by from the model's is drawn many times
    larger: iron of one per cent would not be seen.
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
    """Return the rows that have a field, shape (n, 3)."""
    values = np.column_stack([field.forward_nt, field.right_nt, field.down_nt]) / NT_PER_UT
    return values[np.isfinite(values).all(axis=1)]


def _radius_ut(results: FlightResults, field_ut: FloatArray) -> float:
    """Return the strength of the model; without one the median of the readings."""
    answer = results.answer(MagneticResult)
    declination = answer.declination if answer else None
    if declination is None or declination.horizontal_nt is None or declination.down_nt is None:
        return float(np.median(np.linalg.norm(field_ut, axis=1)))
    return float(np.hypot(declination.horizontal_nt, declination.down_nt)) / NT_PER_UT


def _exaggerated(field: FloatArray, radius: float, factor: float) -> FloatArray:
    """Return the same directions, distances from the sphere times a factor; shape (n, 3)."""
    length = np.maximum(np.linalg.norm(field, axis=1, keepdims=True), 1e-12)
    return np.asarray(field / length * (radius + factor * (length - radius)), dtype=np.float32)


def _circles(radius: float) -> list[FloatArray]:
    """Return parallels and four meridians of a sphere."""
    turn = np.linspace(0.0, 2.0 * np.pi, CIRCLE_POINTS)
    circles = []
    for latitude in np.deg2rad(PARALLELS_DEG):
        level = np.full(CIRCLE_POINTS, np.sin(latitude))
        circles.append(np.column_stack([np.cos(turn) * np.cos(latitude), np.sin(turn) * np.cos(latitude), level]))
    for azimuth in np.deg2rad((0.0, 45.0, 90.0, 135.0)):
        circles.append(np.column_stack([np.cos(turn) * np.cos(azimuth), np.cos(turn) * np.sin(azimuth), np.sin(turn)]))
    return [radius * circle for circle in circles]
