"""Landing: every final in space with the corridors of the categories, deviations, protection levels, the chapter."""

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from groundstation.chapters.landing import landing as chapter
from groundstation.chapters.markdown import markdown
from groundstation.results.arrays.landing import LandingPath, LandingProtection
from groundstation.results.flight import FlightResults
from groundstation.results.landing import Approach, LandingResult
from groundstation.results.landing_categories import CATEGORIES
from groundstation.viewer import colours
from groundstation.viewer.chart import Axis, Chart
from groundstation.viewer.recorder import Line, Recorder
from groundstation.viewer.run_chart import RunChart, runs_of
from groundstation.viewer.series import FloatArray
from groundstation.viewer.views import document

SEEN_M = 6_000.0  # of the final, before the threshold
ENLARGED = 10.0  # across and up against along: corridors of metres along kilometres
MARK, TRAIL, EDGE = 6.0, 2.0, 0.8  # radii in points of the screen
THIN, BOLD = 1.0, 2.0
M_PER_KM = 1000.0
LEAST_REACH_M, ROOM, BEHIND_M, HEIGHT = 20.0, 1.15, 500.0, 110.0  # of the charts
MOST_APPROACHES = 6
SHADES = dict(zip((one.name for one in CATEGORIES), (colours.ORANGE, colours.PINK, colours.YELLOW_GREEN), strict=True))
SPACE_NAME = (
    f"Last {SEEN_M / 1000:g} km; across and up drawn {ENLARGED:g} times; frames: 95 % of CAT I, II and IIIA, IIIB"
)


def landing(recorder: Recorder, results: FlightResults) -> rrb.Container | None:
    """Log the tab of the approaches; None where there are none."""
    answer, section = results.answer(LandingResult), chapter(results)
    data = results.rows_of(LandingPath)
    if answer is None or section is None or data is None:
        return None
    recorder.document("landing/answer", markdown(section))
    tabs = [_approach(recorder, results, one, data) for one in answer.approaches[:MOST_APPROACHES]]
    approaches = tabs[0] if len(tabs) == 1 else rrb.Tabs(contents=tabs, active_tab=0)
    text = document("Approaches", "landing/answer")
    return rrb.Horizontal(contents=[approaches, text], column_shares=[3.0, 1.5], name="Landing")


def _approach(recorder: Recorder, results: FlightResults, one: Approach, data: LandingPath) -> rrb.Container:
    flown, path = data.where(data.approach == one.number), f"landing/{one.number}"
    left = _space(recorder, f"{path}/space", flown)
    left += _motion(recorder, f"{path}/motion", flown)
    left += _protection(recorder, f"{path}/protection", results, one)
    right = _deviation(recorder, f"{path}/lateral", "Right of the course, m", flown, "lateral")
    right += _deviation(recorder, f"{path}/vertical", "Above the path, m", flown, "vertical")
    shares = [2.0, *[1.0] * (len(left) - 1)]
    columns = [rrb.Vertical(contents=left, row_shares=shares), rrb.Vertical(contents=right)]
    contents = [view for view, has in zip(columns, (left, right), strict=True) if has]
    return rrb.Horizontal(contents=contents, name=f"Approach {one.number}")


def _place(along_m: FloatArray, across_m: FloatArray, height_m: FloatArray) -> FloatArray:
    """Forward along the runway, left, up, as drawn."""
    return np.column_stack([along_m, -ENLARGED * across_m, ENLARGED * height_m]).astype(np.float32)


def _space(recorder: Recorder, path: str, flown: LandingPath) -> list[rrb.View]:
    """The end of the final between the frames of the categories, by positions (grey) and by the guidance.

    The aircraft moves where the guidance has it, else along the positions.
    """
    distance = flown.distance_m
    seen = (distance < SEEN_M) & np.isfinite(flown.height_m) & np.isfinite(flown.across_m)
    if seen.sum() < 2:
        return []
    place = _place(-distance[seen], flown.across_m[seen], flown.height_m[seen])
    track = rr.LineStrips3D([place], colors=[colours.SAMPLES], radii=rr.Radius.ui_points(EDGE))
    recorder.static(f"{path}/positions", track)
    guided_height = flown.path_height_m + flown.vertical_guidance_m
    guided = (distance < SEEN_M) & np.isfinite(guided_height) & np.isfinite(flown.lateral_guidance_m)
    if guided.sum() > 1:
        seen = guided
        place = _place(-distance[seen], flown.lateral_guidance_m[seen], guided_height[seen])
        track = rr.LineStrips3D([place], colors=[colours.INS], radii=rr.Radius.ui_points(TRAIL))
        recorder.static(f"{path}/guidance", track)
    before = (distance < SEEN_M) & (distance > 0.0)
    for category in CATEGORIES:
        along, height = -distance[before], flown.path_height_m[before]
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
    indexes = recorder.indexes(recorder.time_ns(flown.time_s[seen]))
    recorder.stream.send_columns(f"{path}/aircraft", indexes, rr.Points3D.columns(positions=place))
    recorder.static(path, rr.ViewCoordinates.RIGHT_HAND_Z_UP)
    return [rrb.Spatial3DView(name=SPACE_NAME, origin=f"/{path}")]


def _deviation(recorder: Recorder, path: str, title: str, flown: LandingPath, axis: str) -> list[rrb.View]:
    """Deviation over the end of the final, in a dot of the guidance and the figures of the categories."""
    distance = flown.distance_m
    if axis == "lateral":
        guided, dot, placed = flown.lateral_guidance_m, flown.lateral_dot_m, flown.across_m
    else:
        guided, dot, placed = flown.vertical_guidance_m, flown.vertical_dot_m, flown.height_m - flown.path_height_m
    placed = np.where(distance > 0.0, placed, np.nan)
    shown = guided if np.isfinite(guided).any() else placed
    seen = (distance < SEEN_M) & np.isfinite(shown)
    if seen.sum() < 2:
        return []
    reach = max(LEAST_REACH_M, ROOM * float(np.max(np.abs(shown[seen]))))
    ends = np.array([-min(SEEN_M, float(distance[seen].max())), BEHIND_M]) / M_PER_KM
    ahead, off = Axis("distance along the runway, km", *ends.tolist()), Axis(title, -reach, reach)
    chart = Chart(recorder, path, ahead, off, HEIGHT)
    along = -distance / M_PER_KM
    lines = [Line("one dot", colours.DIM, THIN), *(Line(name, shade, THIN) for name, shade in SHADES.items())]
    halves = [one.horizontal_m if axis == "lateral" else one.vertical_m for one in CATEGORIES]
    levels = [dot, *(np.full(len(dot), half) for half in halves)]
    curves = [(along, sign * half, line) for half, line in zip(levels, lines, strict=True) for sign in (1.0, -1.0)]
    named = [*lines, Line("positions" if axis == "lateral" else "height", colours.SAMPLES, THIN)]
    named += [Line("guidance", colours.INS, BOLD)]
    chart.curves("curves", [*curves, (along, placed, named[-2]), (along, guided, named[-1])])
    chart.legend(named)
    recorder.static(
        f"{path}/aircraft", rr.Points2D.from_fields(colors=[colours.ANSWER], radii=rr.Radius.ui_points(MARK))
    )
    indexes = recorder.indexes(recorder.time_ns(flown.time_s[seen]))
    points = np.nan_to_num(chart.points(along[seen], shown[seen])).astype(np.float32)
    recorder.stream.send_columns(f"{path}/aircraft", indexes, rr.Points2D.columns(positions=points))
    return [chart.view()]


def _motion(recorder: Recorder, path: str, flown: LandingPath) -> list[rrb.View]:
    """Sink rate and bank."""
    series = {
        Line("sink rate, m/s", colours.INS): flown.sink_rate_mps,
        Line("bank, deg", colours.GNSS): flown.bank_deg,
    }
    return _over_time(recorder, path, "Sink rate, m/s, and bank, deg,", flown.time_s, series)


def _over_time(
    recorder: Recorder, path: str, title: str, time_s: FloatArray, series: dict[Line, FloatArray]
) -> list[rrb.View]:
    """Lines that have values over the time since the approach began; none without two samples."""
    runs = runs_of(time_s, np.inf)
    known = {line: values for line, values in series.items() if np.isfinite(values).any()}
    if not runs or not known:
        return []
    chart = RunChart(recorder, path, title, runs[0], list(known.values()))
    for number, (line, values) in enumerate(known.items()):
        chart.line(f"line/{number}", time_s, values, line)
    return [chart.view(list(known))]


def _protection(recorder: Recorder, path: str, results: FlightResults, one: Approach) -> list[rrb.View]:
    """Protection levels and alarm limits."""
    data = results.rows_of(LandingProtection)
    if one.protection is None or data is None:
        return []
    mine = data.where(data.approach == one.number)
    series = {
        Line("horizontal level", colours.GNSS, BOLD): mine.horizontal_protection_m,
        Line("vertical level", colours.ANSWER, BOLD): mine.vertical_protection_m,
        Line("horizontal limit", colours.LIMIT, THIN): mine.horizontal_alarm_limit_m,
        Line("vertical limit", colours.HONEST, THIN): mine.vertical_alarm_limit_m,
    }
    return _over_time(recorder, path, "Protection levels, m,", mine.time_s, series)
