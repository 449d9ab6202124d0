"""Tab on placement of ground points: way and points over a map of accuracy.

The accuracy along the way is beside it.
"""

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from groundstation.chapters.markdown import markdown
from groundstation.results.flight import FlightResults
from groundstation.systems.planning.session.placement_answer import PlacementPlan
from groundstation.systems.planning.session.placement_arrays import (
    PlacementAccuracy,
    PlacementKeepOut,
    PlacementMap,
    PlacementPoints,
)
from groundstation.systems.planning.session.placement_chapter import placement as chapter
from groundstation.viewer import colours
from groundstation.viewer.names import clean_text
from groundstation.viewer.plot_views import panels_of, plot_of
from groundstation.viewer.recorder import Recorder
from groundstation.viewer.series import FloatArray
from groundstation.viewer.views import document

MARK, TRAIL, EDGE = 5.0, 1.2, 0.8  # radii in points of the screen
WORST_SHARE = 90.0  # per cent of the map's values that keep their own colour
GOOD, BAD = np.array([70.0, 190.0, 140.0]), np.array([80.0, 40.0, 90.0])


def placement(recorder: Recorder, results: FlightResults) -> rrb.Container | None:
    """Log the tab; None without an answer."""
    answer, section = results.answer(PlacementPlan), chapter(results)
    way = results.rows_of(PlacementAccuracy)
    if answer is None or section is None or way is None:
        return None
    recorder.document("placement/answer", markdown(section))
    left = [_space(recorder, answer, way, results), document("Designs and places", "placement/answer")]
    right = panels_of(recorder, plot_of(recorder, "placement.accuracy", results))
    columns = [rrb.Vertical(contents=left), rrb.Vertical(contents=right)]
    return rrb.Horizontal(contents=columns, column_shares=[1.6, 1.0], name="Placement")


def _east_north_up(rows: PlacementAccuracy | PlacementPoints) -> FloatArray:
    return np.column_stack([rows.east_m, rows.north_m, rows.up_m])


def _space(recorder: Recorder, answer: PlacementPlan, way: PlacementAccuracy, results: FlightResults) -> rrb.View:
    rows = way.design == answer.recommended
    place = _east_north_up(way)[rows]
    recorder.static("site/way", rr.LineStrips3D([place], colors=[colours.ANSWER], radii=rr.Radius.ui_points(TRAIL)))
    mark = rr.Radius.ui_points(MARK)
    name = clean_text(answer.judged)
    recorder.static("site/now", rr.Points3D.from_fields(colors=[colours.ANSWER], radii=mark, labels=[name]))
    indexes = recorder.indexes(recorder.time_ns(way.time_s[rows]))
    recorder.stream.send_columns("site/now", indexes, rr.Points3D.columns(positions=place.astype(np.float32)))
    fixed = [[answer.fixed_east_m, answer.fixed_north_m, answer.fixed_height_m]]
    recorder.static("site/fixed", rr.Points3D(fixed, labels=["fixed point"], colors=[colours.LIMIT], radii=mark))
    points = results.rows_of(PlacementPoints)
    if points is not None:
        mine = points.design == answer.recommended
        names = [clean_text(one) for one in points.label[mine].tolist()]
        stand = rr.Points3D(_east_north_up(points)[mine], labels=names, colors=[colours.LIGHT] * len(names), radii=mark)
        recorder.static("site/points", stand)
    _keep_out(recorder, results)
    _ground(recorder, results)
    recorder.static("site", rr.ViewCoordinates.RIGHT_HAND_Z_UP)
    moved = clean_text(answer.moved)
    return rrb.Spatial3DView(
        name=f"East, north, up; ground: accuracy with {moved} there, light is good", origin="/site"
    )


def _keep_out(recorder: Recorder, results: FlightResults) -> None:
    rings = results.rows_of(PlacementKeepOut)
    if rings is None:
        return
    corners = np.column_stack([rings.east_m, rings.north_m, np.zeros(len(rings))])
    order = list(dict.fromkeys(rings.label.tolist()))
    strips = [corners[rings.label == name] for name in order]
    drawn = rr.LineStrips3D(
        strips, colors=[colours.LIMIT] * len(strips), labels=[clean_text(name) for name in order],
        radii=rr.Radius.ui_points(EDGE),
    )  # fmt: skip
    recorder.static("site/keep_out", drawn)


def _ground(recorder: Recorder, results: FlightResults) -> None:
    """Log the map as a mesh on the ground, a colour for each place.

    No mesh where no point is allowed, or the rectangle is a line.
    """
    data = results.rows_of(PlacementMap)
    if data is None:
        return
    sigma = data.sigma_m
    side = len(np.unique(data.east_m))
    known = np.isfinite(sigma)
    if not known.any() or side in (1, len(sigma)):
        return
    low, high = float(np.nanmin(sigma)), float(np.nanpercentile(sigma, WORST_SHARE))
    share = np.clip(np.nan_to_num(np.log(sigma / low) / max(np.log(high / low), 1e-9), nan=1.0), 0.0, 1.0)[:, None]
    shades = (GOOD + share * (BAD - GOOD)).astype(np.uint8)
    corner = np.arange(len(sigma)).reshape(-1, side)
    squares = np.stack([corner[:-1, :-1], corner[:-1, 1:], corner[1:, 1:], corner[1:, :-1]], axis=-1).reshape(-1, 4)
    squares = squares[known[squares].all(axis=1)]
    mesh = rr.Mesh3D(
        vertex_positions=np.column_stack([data.east_m, data.north_m, np.zeros(len(sigma))]),
        triangle_indices=np.concatenate([squares[:, [0, 1, 2]], squares[:, [0, 2, 3]]]),
        vertex_colors=shades,
    )
    recorder.static("site/ground", mesh)
