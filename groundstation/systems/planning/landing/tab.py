"""Tab on landing by ranges: the approach in space with the corridors of the categories.

Accuracy and errors with time.
"""

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from groundstation.chapters.markdown import markdown
from groundstation.results.flight import FlightResults
from groundstation.results.landing_categories import CATEGORIES, LINEAR_95
from groundstation.systems.planning.landing.answer import RangeLanding
from groundstation.systems.planning.landing.arrays import RangesPath, RangesSpace
from groundstation.systems.planning.landing.chapter import landing_ranges as chapter
from groundstation.viewer import colours
from groundstation.viewer.names import clean_text, path_parts
from groundstation.viewer.plot_views import panels_of, plot_of
from groundstation.viewer.recorder import Line, Recorder
from groundstation.viewer.series import FloatArray
from groundstation.viewer.views import document, plot

MARK, TRAIL, RANGE = 5.0, 1.2, 0.8  # radii in points of the screen
BOLD = 1.6
CORRIDORS = (colours.ANSWER, colours.PAPER, colours.OVER_LIMIT)
TIMES_LARGER = 5.0  # corridors and ellipsoids are drawn so many times their size
VIEW_NAME = f"Along, left, up, m; frames: corridors of CAT I, II, III and ellipsoid of 95 %, {TIMES_LARGER:g} times"


def landing_ranges(recorder: Recorder, results: FlightResults) -> rrb.Container | None:
    """Log the tab; None without an answer."""
    answer, section = results.answer(RangeLanding), chapter(results)
    space = results.rows_of(RangesSpace)
    path = results.rows_of(RangesPath)
    if answer is None or section is None or space is None or path is None:
        return None
    recorder.document("landing_ranges/answer", markdown(section))
    left = [_space(recorder, answer, space, path), document("What was found", "landing_ranges/answer")]
    plots = [plot_of(recorder, name, results) for name in ("landing_ranges.accuracy", "landing_ranges.trials")]
    shown = [view for one in plots for view in panels_of(recorder, one, height=80.0)]
    right: list[rrb.View | rrb.Container] = [rrb.Grid(contents=shown, grid_columns=2), *_moving(recorder, space)]
    shares = [2.0, 1.0]
    columns = [rrb.Vertical(contents=left, row_shares=shares)]
    columns.append(rrb.Vertical(contents=right, row_shares=shares[: len(right)]))
    return rrb.Horizontal(contents=columns, column_shares=[1.4, 1.0], name="Landing")


def _space(recorder: Recorder, answer: RangeLanding, space: RangesSpace, path: RangesPath) -> rrb.View:
    """Log aircraft and points in space, ranges as lines, corridor frames every half kilometre."""
    name, time_s = space.label, space.time_s
    place = np.column_stack([space.along_m, -space.right_m, space.up_m])
    flown = place[name == "aircraft"]
    ways = [("aircraft", colours.ANSWER)] + ([("moving", colours.GNSS)] if (name == "moving").any() else [])
    for which, shade in ways:
        way = place[name == which]
        recorder.static(
            f"landing/{which}/way", rr.LineStrips3D([way], colors=[shade], radii=rr.Radius.ui_points(TRAIL))
        )
        mark = rr.Points3D.from_fields(colors=[shade], radii=rr.Radius.ui_points(MARK), labels=[which])
        recorder.static(f"landing/{which}/now", mark)
        columns = rr.Points3D.columns(positions=way.astype(np.float32))
        indexes = recorder.indexes(recorder.time_ns(time_s[name == which]))
        recorder.stream.send_columns(f"landing/{which}/now", indexes, columns)
    ground = [(one.name, place[name == one.name][0]) for one in answer.points if not one.is_moving]
    marks = rr.Points3D(
        [where for _, where in ground],
        labels=[clean_text(one) for one, _ in ground],
        colors=[colours.LIGHT] * len(ground),
        radii=rr.Radius.ui_points(MARK),
    )
    recorder.static("landing/points", marks)
    length = float(answer.settings["path.runway_length_m"])
    half = 0.5 * float(answer.settings["path.runway_width_m"])
    runway = rr.Boxes3D(centers=[[0.5 * length, 0.0, 0.0]], half_sizes=[[0.5 * length, half, 0.5]], labels=["runway"])
    recorder.static("landing/runway", runway)
    _corridors(recorder, flown)
    _ranges(recorder, path, flown, ground, place[name == "moving"])
    _ellipsoid(recorder, path, flown)
    recorder.static("landing", rr.ViewCoordinates.RIGHT_HAND_Z_UP)
    return rrb.Spatial3DView(name=VIEW_NAME, origin="/landing")


def _corridors(recorder: Recorder, flown: FloatArray) -> None:
    """Log frames of each category's corridor across the path, joined by its edges."""
    for category, shade, part in zip(CATEGORIES, CORRIDORS, path_parts(one.name for one in CATEGORIES), strict=True):
        wide, high = TIMES_LARGER * category.horizontal_m, TIMES_LARGER * category.vertical_m
        corners = np.array([(0.0, wide, high), (0.0, -wide, high), (0.0, -wide, -high), (0.0, wide, -high)])
        frames = flown[:: max(1, len(flown) // 8)][:, None, :] + corners
        closed = [np.vstack([frame, frame[:1]]) for frame in frames]
        edges = [frames[:, corner] for corner in range(4)]
        strips = rr.LineStrips3D([*closed, *edges], colors=[shade], radii=rr.Radius.ui_points(RANGE))
        recorder.static(f"landing/corridor/{part}", strips)


def _ranges(
    recorder: Recorder,
    path: RangesPath,
    flown: FloatArray,
    ground: list[tuple[str, FloatArray]],
    moving: FloatArray,
) -> None:
    """Log a line from every point to the aircraft."""
    ends = [np.broadcast_to(where, flown.shape) for _, where in ground] + ([moving] if len(moving) else [])
    strips = np.stack([np.stack([end, flown], axis=1) for end in ends], axis=1)
    drawn = rr.LineStrips3D.from_fields(colors=[colours.DIM], radii=rr.Radius.ui_points(RANGE))
    recorder.static("landing/ranges", drawn)
    flat = list(strips.reshape(-1, 2, 3).astype(np.float32))
    columns = rr.LineStrips3D.columns(strips=flat).partition([len(ends)] * len(strips))
    recorder.stream.send_columns("landing/ranges", recorder.indexes(recorder.time_ns(path.time_s)), columns)


def _ellipsoid(recorder: Recorder, path: RangesPath, flown: FloatArray) -> None:
    half = TIMES_LARGER * LINEAR_95 * np.column_stack([path.sigma_along_m, path.sigma_right_m, path.sigma_up_m])
    recorder.static(
        "landing/aircraft/ellipsoid", rr.Ellipsoids3D.from_fields(colors=[(*colours.ANSWER[:3], 90)], fill_mode="solid")
    )
    columns = rr.Ellipsoids3D.columns(half_sizes=half.astype(np.float32), centers=flown.astype(np.float32))
    recorder.stream.send_columns("landing/aircraft/ellipsoid", recorder.indexes(recorder.time_ns(path.time_s)), columns)


def _moving(recorder: Recorder, space: RangesSpace) -> list[rrb.View]:
    """Log the speed of the moving point."""
    rows = space.label == "moving"
    if not rows.any():
        return []
    speed = space.speed_mps[rows][:, None]
    entity = "landing_ranges/speed"
    recorder.lines(entity, recorder.time_ns(space.time_s[rows]), speed, [Line("speed", colours.GNSS, BOLD)])
    return [plot("Speed of the moving point, m/s", entity)]
