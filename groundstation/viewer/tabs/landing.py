"""Landing: every final in space with the corridors of the categories, deviations, protection levels, the chapter."""

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from groundstation.base.records import Int64Array
from groundstation.chapters.landing import landing as chapter
from groundstation.chapters.markdown import markdown
from groundstation.results.figures import FigureData
from groundstation.results.flight import FlightResults
from groundstation.results.landing import Approach, LandingResult
from groundstation.results.landing_categories import CATEGORIES
from groundstation.viewer import colours
from groundstation.viewer.recorder import Line, Recorder
from groundstation.viewer.series import FloatArray, gap_after
from groundstation.viewer.views import document, figure_of, numbers, plot

SEEN_M = 6_000.0  # of the final, before the threshold
ENLARGED = 10.0  # across and up against along: corridors of metres along kilometres
MARK, TRAIL, EDGE = 6.0, 2.0, 0.8  # radii in points of the screen
THIN, BOLD = 1.0, 2.0
MOST_APPROACHES = 6
SHADES = dict(zip((one.name for one in CATEGORIES), (colours.ORANGE, colours.PINK, colours.YELLOW_GREEN), strict=True))
SPACE_NAME = (
    f"Last {SEEN_M / 1000:g} km; across and up drawn {ENLARGED:g} times; frames: 95 % of CAT I, II and IIIA, IIIB"
)


def landing(recorder: Recorder, results: FlightResults) -> rrb.Container | None:
    """Log the tab of the approaches; None where there are none."""
    answer, section = results.answer(LandingResult), chapter(results)
    data = figure_of(results, "landing_path", "approach", "time_s", "distance_m", "across_m", "height_m")
    if answer is None or section is None or data is None:
        return None
    recorder.document("landing/answer", markdown(section))
    tabs = [_approach(recorder, results, one, data) for one in answer.approaches[:MOST_APPROACHES]]
    approaches = tabs[0] if len(tabs) == 1 else rrb.Tabs(contents=tabs, active_tab=0)
    text = document("Approaches", "landing/answer")
    return rrb.Horizontal(contents=[approaches, text], column_shares=[3.0, 2.0], name="Landing")


def _approach(recorder: Recorder, results: FlightResults, one: Approach, data: FigureData) -> rrb.Container:
    mine = np.flatnonzero(numbers(data, "approach") == one.number)
    column = {name: numbers(data, name)[mine] for name in data.columns}
    path = f"landing/{one.number}"
    views = [*_space(recorder, f"{path}/space", column)]
    time_ns = recorder.time_ns(column["time_s"])
    for axis, title in (("lateral", "Right of the course"), ("vertical", "Above the path")):
        views += _deviation(recorder, f"{path}/{axis}", f"{title}, m", time_ns, column, axis)
    views += _motion(recorder, f"{path}/motion", time_ns, column)
    views += _protection(recorder, f"{path}/protection", results, one)
    name = f"Approach {one.number}"
    return rrb.Vertical(contents=views, row_shares=[2.0, *[1.0] * (len(views) - 1)], name=name)


def _place(along_m: FloatArray, across_m: FloatArray, height_m: FloatArray) -> FloatArray:
    """Forward along the runway, left, up, as drawn."""
    return np.column_stack([along_m, -ENLARGED * across_m, ENLARGED * height_m]).astype(np.float32)


def _space(recorder: Recorder, path: str, column: dict[str, FloatArray]) -> list[rrb.View]:
    """The end of the final as a track with the aircraft on it, between the frames of the categories."""
    distance = column["distance_m"]
    seen = (distance < SEEN_M) & np.isfinite(column["height_m"]) & np.isfinite(column["across_m"])
    if seen.sum() < 2:
        return []
    place = _place(-distance[seen], column["across_m"][seen], column["height_m"][seen])
    track = rr.LineStrips3D([place], colors=[colours.INS], radii=rr.Radius.ui_points(TRAIL))
    recorder.static(f"{path}/track", track)
    before = seen & (distance > 0.0)
    for category in CATEGORIES:
        along, height = -distance[before], column["path_height_m"][before]
        edges = [
            _place(along, np.full(len(along), side * category.horizontal_m), height + up * category.vertical_m)
            for side in (-1.0, 1.0)
            for up in (-1.0, 1.0)
        ]
        if len(along):
            frame = [edges[row][-1] for row in (0, 1, 3, 2, 0)]  # round the corridor, as the threshold is crossed
            shade = SHADES[category.name]
            strips = rr.LineStrips3D([*edges, frame], colors=[shade] * 5, radii=rr.Radius.ui_points(EDGE))
            recorder.static(f"{path}/corridor/{category.name.replace(' ', '_')}", strips)
    ground = _place(np.array([-SEEN_M, 1000.0]), np.zeros(2), np.zeros(2))
    recorder.static(
        f"{path}/course", rr.LineStrips3D([ground], colors=[colours.LIGHT], radii=rr.Radius.ui_points(EDGE))
    )
    mark = rr.Points3D.from_fields(colors=[colours.ANSWER], radii=rr.Radius.ui_points(MARK))
    recorder.static(f"{path}/aircraft", mark)
    indexes = recorder.indexes(recorder.time_ns(column["time_s"][seen]))
    recorder.stream.send_columns(f"{path}/aircraft", indexes, rr.Points3D.columns(positions=place))
    recorder.static(path, rr.ViewCoordinates.RIGHT_HAND_Z_UP)
    return [rrb.Spatial3DView(name=SPACE_NAME, origin=f"/{path}")]


def _deviation(
    recorder: Recorder, path: str, name: str, time_ns: Int64Array, column: dict[str, FloatArray], axis: str
) -> list[rrb.View]:
    """Deviation by the guidance on the band of one dot, and by the positions or the height."""
    placed = column["across_m"] if axis == "lateral" else column["height_m"] - column["path_height_m"]
    placed = np.where(column["distance_m"] > 0.0, placed, np.nan)
    guided = column[f"{axis}_guidance_m"]
    entities = []
    if np.isfinite(guided).any():
        known = np.isfinite(guided)
        half_m = np.where(known, column[f"{axis}_dot_m"], 0.0)
        style = rr.Measurements.from_fields(names=["one dot, m"], colors=[colours.DIM], widths=[THIN])
        recorder.static(f"{path}/band", style)
        columns = rr.Measurements.columns(values=np.where(known, 0.0, np.nan), variances=half_m**2)
        recorder.stream.send_columns(f"{path}/band", recorder.indexes(time_ns), columns)
        line = Line("by the guidance, m", colours.INS, BOLD)
        recorder.lines(f"{path}/guidance", time_ns, guided[:, None], [line], gap_after(time_ns))
        entities = [f"{path}/band", f"{path}/guidance"]
    if np.isfinite(placed).any():
        title = "by the positions, m" if axis == "lateral" else "by the height, m"
        recorder.dots(f"{path}/placed", time_ns, placed, Line(title, colours.SAMPLES, THIN))
        entities.append(f"{path}/placed")
    return [plot(name, entities)] if entities else []


def _motion(recorder: Recorder, path: str, time_ns: Int64Array, column: dict[str, FloatArray]) -> list[rrb.View]:
    """Sink rate and bank."""
    lines = {"sink_rate_mps": Line("sink rate, m/s", colours.INS), "bank_deg": Line("bank, deg", colours.GNSS)}
    known = [name for name in lines if np.isfinite(column[name]).any()]
    if not known:
        return []
    values = np.column_stack([column[name] for name in known])
    recorder.lines(path, time_ns, values, [lines[name] for name in known], gap_after(time_ns))
    return [plot("Sink rate, m/s, and bank, deg", path)]


def _protection(recorder: Recorder, path: str, results: FlightResults, one: Approach) -> list[rrb.View]:
    """Protection levels and alarm limits."""
    data = figure_of(results, "landing_protection", "approach", "time_s")
    if one.protection is None or data is None:
        return []
    mine = np.flatnonzero(numbers(data, "approach") == one.number)
    lines = {
        "horizontal_protection_m": Line("horizontal protection level, m", colours.GNSS, BOLD),
        "vertical_protection_m": Line("vertical protection level, m", colours.ANSWER, BOLD),
        "horizontal_alarm_limit_m": Line("horizontal alarm limit, m", colours.LIMIT, THIN),
        "vertical_alarm_limit_m": Line("vertical alarm limit, m", colours.HONEST, THIN),
    }
    known = [name for name in lines if np.isfinite(numbers(data, name)[mine]).any()]
    if not known:
        return []
    time_ns = recorder.time_ns(numbers(data, "time_s")[mine])
    values = np.column_stack([numbers(data, name)[mine] for name in known])
    recorder.lines(path, time_ns, values, [lines[name] for name in known], gap_after(time_ns))
    return [plot("Protection levels and alarm limits, m", path)]
