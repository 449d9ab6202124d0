"""Tab on control of a session: the aircraft in space under the recommended law.

The law, accuracy and geometry.
"""

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from groundstation.chapters.markdown import markdown
from groundstation.results.flight import FlightResults
from groundstation.systems.planning.session.answer import UNCONTROLLED, ControlPlan
from groundstation.systems.planning.session.arrays import ControlPaths, ControlPoints
from groundstation.systems.planning.session.chapter import control as chapter
from groundstation.systems.planning.session.chapter import title_of
from groundstation.viewer import colours
from groundstation.viewer.names import clean_text, path_parts
from groundstation.viewer.plot_views import panels_of, plot_of
from groundstation.viewer.recorder import Recorder
from groundstation.viewer.series import FloatArray
from groundstation.viewer.views import document

MARK, TRAIL, RANGE = 5.0, 1.2, 0.8  # radii in points of the screen


def control(recorder: Recorder, results: FlightResults) -> rrb.Container | None:
    """Log the tab; None without an answer."""
    answer, section = results.answer(ControlPlan), chapter(results)
    paths = results.rows_of(ControlPaths)
    if answer is None or section is None or paths is None:
        return None
    recorder.document("control/answer", markdown(section))
    left = [_space(recorder, answer, paths, results), document("Control laws", "control/answer")]
    laws, measures = (
        panels_of(recorder, plot_of(recorder, name, results)) for name in ("control.law", "control.measures")
    )
    columns = [left, laws, measures]
    shown = [rrb.Vertical(contents=column) for column in columns if column]
    return rrb.Horizontal(contents=shown, column_shares=[1.6, 1.0, 1.0][: len(shown)], name="Control")


def _space(recorder: Recorder, answer: ControlPlan, paths: ControlPaths, results: FlightResults) -> rrb.View:
    """Log aircraft and points in space, with a line from the judged aircraft to every source."""
    law, aircraft = paths.law, paths.aircraft
    place = np.column_stack([paths.east_m, paths.north_m, paths.up_m])
    shades = colours.for_series(len(answer.aircraft))
    ways: dict[str, FloatArray] = {}
    for name, part, shade in zip(answer.aircraft, path_parts(answer.aircraft), shades, strict=True):
        rows = np.flatnonzero((law == answer.recommended) & (aircraft == name))
        nominal = place[(law == UNCONTROLLED) & (aircraft == name)]
        ways[name] = place[rows]
        indexes = recorder.indexes(recorder.time_ns(paths.time_s[rows]))
        path, trail = f"plan/{part}", rr.Radius.ui_points(TRAIL)
        recorder.static(f"{path}/way", rr.LineStrips3D([place[rows]], colors=[shade], radii=trail))
        recorder.static(f"{path}/uncontrolled", rr.LineStrips3D([nominal], colors=[colours.DIM], radii=trail))
        told = rr.Points3D.from_fields(colors=[shade], radii=rr.Radius.ui_points(MARK), labels=[clean_text(name)])
        recorder.static(f"{path}/now", told)
        columns = rr.Points3D.columns(positions=place[rows].astype(np.float32))
        recorder.stream.send_columns(f"{path}/now", indexes, columns)
    points = results.rows_of(ControlPoints)
    if points is not None:
        stations = np.column_stack([points.east_m, points.north_m, points.up_m])
        names = [clean_text(name) for name in points.label.tolist()]
        marks = rr.Points3D(
            stations, labels=names, colors=[colours.LIGHT] * len(names), radii=rr.Radius.ui_points(MARK)
        )
        recorder.static("plan/points", marks)
        ways |= {f"point {number}": np.tile(one, (len(ways[answer.judged]), 1)) for number, one in enumerate(stations)}
    _ranges(recorder, answer.judged, ways, np.unique(paths.time_s))
    recorder.static("plan", rr.ViewCoordinates.RIGHT_HAND_Z_UP)
    name = f"East, north, up: {title_of(answer.recommended)}; grey: no control"
    return rrb.Spatial3DView(name=name, origin="/plan")


def _ranges(recorder: Recorder, judged: str, ways: dict[str, FloatArray], time_s: FloatArray) -> None:
    others = [way for name, way in ways.items() if name != judged]
    strips = np.stack([np.stack([way, ways[judged]], axis=1) for way in others], axis=1)  # (epochs, sources, 2, 3)
    recorder.static(
        "plan/ranges", rr.LineStrips3D.from_fields(colors=[colours.PAPER], radii=rr.Radius.ui_points(RANGE))
    )
    flat = list(strips.reshape(-1, 2, 3).astype(np.float32))
    columns = rr.LineStrips3D.columns(strips=flat).partition([len(others)] * len(strips))
    recorder.stream.send_columns("plan/ranges", recorder.indexes(recorder.time_ns(time_s)), columns)
