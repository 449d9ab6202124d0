"""Flight in space: the track by flight phase, and the aircraft with its attitude."""

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from groundstation.base.attitude import quaternion_enu_from_flu_xyzw
from groundstation.base.records import BoolArray
from groundstation.results.arrays.flight import Overview
from groundstation.viewer import colours
from groundstation.viewer.chart import screen_radius, unbroken
from groundstation.viewer.colours import Colour
from groundstation.viewer.recorder import Recorder
from groundstation.viewer.series import FloatArray

LINE, SHADOW, MARK = 1.4, 0.5, 5.0  # radii in points of the screen
SHARE = 0.06  # length of the aircraft, of the longer side of its track: at its own size it would not be seen
LEAST_LENGTH_M = 4.0
MOST_HEIGHT_M = 1e6  # beyond it is none
EYE = np.array([-0.45, -0.6, 0.5])  # from the middle of the track, in its lengths
# Forward, left, up of a body one long: nose, wing tips, tail, tips of the tailplane, top of the fin.
CORNERS = np.array(
    [
        *[(0.55, 0.0, 0.0), (-0.05, 0.5, 0.0), (-0.05, -0.5, 0.0), (-0.45, 0.0, 0.0)],
        *[(-0.45, 0.2, 0.0), (-0.45, -0.2, 0.0), (-0.3, 0.0, 0.0), (-0.5, 0.0, 0.22), (0.15, 0.0, 0.0)],
        *[(0.0, 0.05, 0.0), (0.0, -0.05, 0.0)],
    ]
)
FACES = np.array([(0, 9, 10), (9, 3, 10), (8, 1, 10), (8, 9, 2), (6, 4, 5), (6, 7, 3)])
SIDES = np.array([colours.ANSWER, colours.ANSWER, colours.INS, colours.INS, colours.ANSWER, colours.LIMIT])


def flight_space(
    recorder: Recorder, figure: Overview, points_m: FloatArray | None, pieces: list[slice], shades: list[Colour]
) -> rrb.Spatial3DView | None:
    """Log track and aircraft; None with neither a height along a track nor an attitude.

    Parameters
    ----------
    points_m : ndarray, shape (n, 2), optional
        East and north of every row of the figure; None for a flight without positions.
    pieces, shades
        Stretches of the track and their colours.
    """
    up_m = _height_m(figure)
    place = np.zeros((len(figure), 3)) if points_m is None else np.column_stack([points_m, up_m])
    attitude = _attitude(figure)
    known = np.asarray(np.isfinite(place).all(axis=1), dtype=bool)
    if not known.any() or (points_m is None and attitude is None):
        return None
    size_m = max(SHARE * float(np.ptp(place[known], axis=0).max()), LEAST_LENGTH_M)
    recorder.static("space", rr.ViewCoordinates.RIGHT_HAND_Z_UP)
    if points_m is not None:
        _track(recorder, place, pieces, shades)
    _aircraft(recorder, recorder.time_ns(figure.time_s), place, known, attitude, size_m)
    name = "Aircraft, not to scale" if attitude is not None else "In space, attitude not logged"
    return rrb.Spatial3DView(name=name, origin="/space", eye_controls=_eye(place[known], size_m))


def _eye(place: FloatArray, size_m: float) -> rrb.EyeControls3D:
    """Return an eye that sees the whole track from the south-west and above."""
    low, high = place.min(axis=0), place.max(axis=0)
    middle, across = 0.5 * (low + high), max(float(np.linalg.norm(high - low)), 3.0 * size_m)
    return rrb.EyeControls3D(position=middle + across * EYE, look_target=middle, eye_up=(0.0, 0.0, 1.0))


def _height_m(figure: Overview) -> FloatArray:
    """Return the height above the lowest place; 0 where none is logged."""
    for logged in (figure.altitude_m, figure.pressure_altitude_m, figure.height_above_airfield_m):
        if logged is not None and np.isfinite(logged).any():
            height = np.where(np.abs(logged) < MOST_HEIGHT_M, logged, np.nan)
            return np.asarray(height - np.nanmin(height))
    return np.zeros(len(figure))


def _attitude(figure: Overview) -> FloatArray | None:
    """Return quaternions x y z w.

    Without a true heading the aircraft points along the track, else by the compass, else to the north.
    """
    roll, pitch = figure.roll_deg, figure.pitch_deg
    if roll is None or pitch is None:
        return None
    directions = (figure.heading_deg, figure.track_deg, figure.magnetic_heading_deg)
    known = (one for one in directions if one is not None and np.isfinite(one).any())
    heading = next(known, np.zeros(len(roll)))
    turn = quaternion_enu_from_flu_xyzw(roll, pitch, heading)
    return turn if np.isfinite(turn).any() else None


def _track(recorder: Recorder, place: FloatArray, pieces: list[slice], shades: list[Colour]) -> None:
    whole = [(strip, shade) for piece, shade in zip(pieces, shades, strict=True) for strip in unbroken(place[piece])]
    ground = [strip * np.array([1.0, 1.0, 0.0]) for strip, _ in whole]
    drawn = rr.LineStrips3D(
        [*(strip for strip, _ in whole), *ground],
        colors=[*(shade for _, shade in whole), *[colours.DIM] * len(ground)],
        radii=[screen_radius(LINE)] * len(whole) + [screen_radius(SHADOW)] * len(ground),
    )
    recorder.static("space/track", drawn)


def _aircraft(
    recorder: Recorder,
    time_ns: np.ndarray,
    place: FloatArray,
    known: BoolArray,
    attitude: FloatArray | None,
    size_m: float,
) -> None:
    """Log a body that moves and turns; a dot where no attitude is known at all.

    Where the attitude is unknown for a while the body keeps the last one.
    """
    is_shown = known if attitude is None else known & np.isfinite(attitude).all(axis=1)
    rows = np.flatnonzero(is_shown)
    turn = None if attitude is None else attitude[rows].astype(np.float32)
    moved = rr.Transform3D.columns(translation=place[rows].astype(np.float32), quaternion=turn)
    recorder.stream.send_columns("space/aircraft", recorder.indexes(time_ns[rows]), moved)
    if attitude is None:
        mark = rr.Points3D([[0.0, 0.0, 0.0]], colors=[colours.ANSWER], radii=rr.Radius.ui_points(MARK))
        recorder.static("space/aircraft/body", mark)
        return
    corners = CORNERS[FACES].reshape(-1, 3)
    body = rr.Mesh3D(
        vertex_positions=(size_m * corners).astype(np.float32),
        triangle_indices=np.arange(len(corners)).reshape(-1, 3),
        vertex_colors=np.repeat(SIDES, 3, axis=0).astype(np.uint8),
        face_rendering="DoubleSided",
    )
    recorder.static("space/aircraft/body", body)
