"""View in space: smoothed track beside the on-board filter's, and the noses of both."""

from itertools import pairwise

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from groundstation.base.geodesy import on_earth, plan_north_east_m
from groundstation.results.arrays.typed import Counts
from groundstation.results.flight import FlightResults
from groundstation.systems.trajectory.arrays import TrajectoryOnboard, TrajectoryTrack
from groundstation.systems.trajectory.plots import onboard_attitude_deg
from groundstation.viewer import colours
from groundstation.viewer.recorder import Recorder
from groundstation.viewer.series import FloatArray

PATH = "trajectory/space"
TRAIL, ARROW = 1.4, 2.5  # radii in points of the screen
SHARE = 0.08  # length of a nose, of the longer side of the track
LEAST_M = 4.0
EYE = np.array([-0.45, -0.6, 0.5])  # from the middle of the track, in its lengths


def space(recorder: Recorder, results: FlightResults) -> rrb.Spatial3DView | None:
    """Log the view; None without places."""
    data, onboard = results.rows_of(TrajectoryTrack), results.rows_of(TrajectoryOnboard)
    if data is None:
        return None
    latitude, longitude = on_earth(data.latitude_deg, data.longitude_deg)
    known = np.flatnonzero(np.isfinite(latitude) & np.isfinite(longitude) & np.isfinite(data.height_m))
    if len(known) < 2:
        return None
    origin = float(latitude[known[0]]), float(longitude[known[0]])
    north, east = plan_north_east_m(latitude, longitude, *origin)
    place = np.column_stack([east, north, data.height_m - np.min(data.height_m[known])])
    size_m = max(SHARE * float(np.ptp(place[known], axis=0).max()), LEAST_M)
    recorder.static(PATH, rr.ViewCoordinates.RIGHT_HAND_Z_UP)
    green, blue = colours.ROLES["answer"], colours.ROLES["ins"]
    _strips(recorder, "smoothed", place[known], data.segment[known], green)
    _nose(recorder, "smoothed_nose", data.time_s[known], place[known], _attitude(data)[known], size_m, green)
    theirs = onboard_attitude_deg(results)
    name = "Smoothed (green); noses not to scale"
    if onboard is not None and theirs is not None:
        there = np.column_stack([np.interp(theirs[0], data.time_s[known], one) for one in place[known].T])
        _nose(recorder, "onboard_nose", theirs[0], there, theirs[1], size_m, blue)
        places = plan_north_east_m(*on_earth(onboard.latitude_deg, onboard.longitude_deg), *origin)
        flat = np.column_stack([places[1], places[0], there[:, 2] + np.nan_to_num(onboard.height_m)])
        seen = np.isfinite(flat).all(axis=1)
        _strips(recorder, "onboard", flat[seen], np.zeros(int(seen.sum()), dtype=np.int64), blue)
        name = "Smoothed (green) and on-board filter (blue); noses not to scale"
    low, high = place[known].min(axis=0), place[known].max(axis=0)
    middle, across = 0.5 * (low + high), max(float(np.linalg.norm(high - low)), 3.0 * size_m)
    eye = rrb.EyeControls3D(position=middle + across * EYE, look_target=middle, eye_up=(0.0, 0.0, 1.0))
    return rrb.Spatial3DView(name=name, origin=f"/{PATH}", eye_controls=eye)


def _attitude(data: TrajectoryTrack) -> FloatArray:
    return np.column_stack([data.roll_deg, data.pitch_deg, data.heading_deg])


def _strips(recorder: Recorder, name: str, place: FloatArray, segment: Counts, shade: colours.Colour) -> None:
    """Log a track, a strip each segment."""
    if len(place) < 2:
        return
    ends = [0, *(np.flatnonzero(np.diff(segment) != 0) + 1).tolist(), len(place)]
    strips = [place[first:last].astype(np.float32) for first, last in pairwise(ends) if last - first > 1]
    drawn = rr.LineStrips3D(strips, colors=[shade] * len(strips), radii=rr.Radius.ui_points(TRAIL))
    recorder.static(f"{PATH}/{name}", drawn)


def _nose(
    recorder: Recorder,
    name: str,
    time_s: FloatArray,
    place: FloatArray,
    attitude_deg: FloatArray,
    size_m: float,
    shade: colours.Colour,
) -> None:
    """Log an arrow along the nose that moves; it keeps the last known attitude."""
    pitch, heading = np.deg2rad(attitude_deg[:, 1]), np.deg2rad(attitude_deg[:, 2])
    vector = size_m * np.column_stack([np.cos(pitch) * np.sin(heading), np.cos(pitch) * np.cos(heading), np.sin(pitch)])
    rows = np.flatnonzero(np.isfinite(vector).all(axis=1) & np.isfinite(place).all(axis=1))
    style = rr.Arrows3D.from_fields(colors=[shade], radii=rr.Radius.ui_points(ARROW))
    recorder.static(f"{PATH}/{name}", style)
    columns = rr.Arrows3D.columns(vectors=vector[rows].astype(np.float32), origins=place[rows].astype(np.float32))
    recorder.stream.send_columns(f"{PATH}/{name}", recorder.indexes(recorder.time_ns(time_s[rows])), columns)
