"""Tab on landing: every final in space with the corridors of the categories.

Deviations, protection levels, the chapter.
"""

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from groundstation.base.geodesy import continuous_longitude_deg, latitude_longitude_deg
from groundstation.chapters.markdown import markdown
from groundstation.results.flight import FlightResults
from groundstation.results.landing_categories import CATEGORIES
from groundstation.systems.landing.answer import Approach, LandingResult
from groundstation.systems.landing.arrays import LandingPath
from groundstation.systems.landing.chapter import landing as chapter
from groundstation.systems.landing.runway_answer import RunwayUsed
from groundstation.systems.landing.runway_plots import USUAL_WIDTH_M
from groundstation.viewer import colours
from groundstation.viewer.plot_views import panels_of, plot_of, runs_of
from groundstation.viewer.recorder import Recorder
from groundstation.viewer.series import FloatArray
from groundstation.viewer.views import document

SEEN_M = 6_000.0  # of the final, before the threshold
ENLARGED = 10.0  # across and up against along: corridors of metres along kilometres
MARK, TRAIL, EDGE = 6.0, 2.0, 0.8  # radii in points of the screen
MOST_TABS = 6
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
    tabs = [_approach(recorder, results, one, data) for one in answer.approaches[:MOST_TABS]]
    approaches = tabs[0] if len(tabs) == 1 else rrb.Tabs(contents=tabs, active_tab=0)
    text = document("Approaches", "landing/answer")
    return rrb.Horizontal(contents=[approaches, text], column_shares=[3.0, 1.5], name="Landing")


def _approach(recorder: Recorder, results: FlightResults, one: Approach, data: LandingPath) -> rrb.Container:
    flown, path = data.where(data.approach == one.number), f"landing/{one.number}"
    left = _space(recorder, f"{path}/space", flown, one.runway)
    _on_the_map(recorder, one)
    motion = plot_of(recorder, "landing.motion", results, str(one.number))
    left += [view for run in runs_of(recorder, motion, f"{path}/motion") for view in run]
    told = plot_of(recorder, "landing.protection", results, str(one.number))
    left += panels_of(recorder, told, of="Protection levels", height=70.0)
    right = panels_of(recorder, plot_of(recorder, "landing.deviations", results, str(one.number)), height=110.0)
    shares = [2.0, *[1.0] * (len(left) - 1)]
    columns = [rrb.Vertical(contents=left, row_shares=shares), rrb.Vertical(contents=right)]
    contents = [view for view, has in zip(columns, (left, right), strict=True) if has]
    return rrb.Horizontal(contents=contents, name=f"Approach {one.number}")


def _place(along_m: FloatArray, across_m: FloatArray, height_m: FloatArray) -> FloatArray:
    """Return a place as drawn: forward along the runway, left, up."""
    return np.column_stack([along_m, -ENLARGED * across_m, ENLARGED * height_m]).astype(np.float32)


def _on_the_map(recorder: Recorder, one: Approach) -> None:
    """Log the outline of the runway on the map of the track."""
    runway = one.runway
    if not runway.is_surveyed or not runway.length_m:
        return
    course = np.deg2rad(runway.true_course_deg)
    along, across = _outline(runway).T
    north, east = (
        along * np.cos(course) - across * np.sin(course),
        along * np.sin(course) + across * np.cos(course),
    )
    latitude, longitude = latitude_longitude_deg(north, east, runway.latitude_deg, runway.longitude_deg)
    strip = np.column_stack([latitude, continuous_longitude_deg(longitude)])
    line = rr.GeoLineStrings(lat_lon=[strip], colors=[colours.ANSWER], radii=rr.Radius.ui_points(EDGE))
    recorder.static(f"map/runway/{one.number}", line)


def _outline(runway: RunwayUsed) -> FloatArray:
    """Return the corners of a runway, forward and right, with a bar at the threshold."""
    half_m = 0.5 * (runway.width_m or USUAL_WIDTH_M)
    first = -(runway.displaced_m or 0.0)
    last = first + (runway.length_m or 0.0)
    corners = [(0.0, -half_m), (0.0, half_m), (first, half_m), (first, -half_m), (last, -half_m), (last, half_m)]
    return np.array([*corners, (0.0, half_m)])


def _space(recorder: Recorder, path: str, flown: LandingPath, runway: RunwayUsed) -> list[rrb.View]:
    """Log the end of the final between the frames of the categories.

    One track is by positions (grey), one by the guidance. The aircraft moves where the guidance has it, else along the
    positions.
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
    if runway.is_surveyed and runway.length_m:
        along, across = _outline(runway).T
        strip = rr.LineStrips3D(
            [_place(along, across, np.zeros(len(along)))], colors=[colours.SAMPLES], radii=rr.Radius.ui_points(TRAIL)
        )
        recorder.static(f"{path}/runway", strip)
    mark = rr.Points3D.from_fields(colors=[colours.ANSWER], radii=rr.Radius.ui_points(MARK))
    recorder.static(f"{path}/aircraft", mark)
    indexes = recorder.indexes(recorder.time_ns(flown.time_s[seen]))
    recorder.stream.send_columns(f"{path}/aircraft", indexes, rr.Points3D.columns(positions=place))
    recorder.static(path, rr.ViewCoordinates.RIGHT_HAND_Z_UP)
    return [rrb.Spatial3DView(name=SPACE_NAME, origin=f"/{path}")]
