"""Session in space: aircraft with 2 sigma ellipsoids, links coloured by residual."""

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from groundstation.base.ellipse import principal_axes
from groundstation.base.local_frame import LocalFrame, plane_through
from groundstation.base.records import Int64Array
from groundstation.results.arrays.session import SessionPoints
from groundstation.results.arrays.typed import Texts
from groundstation.results.flight import FlightResults
from groundstation.systems.cooperative.answer import CooperativeResult
from groundstation.systems.cooperative.arrays import CooperativeLinks, CooperativeTracks
from groundstation.systems.cooperative.chapter import trusted
from groundstation.viewer import colours
from groundstation.viewer.colours import Colour
from groundstation.viewer.names import clean_text, path_parts
from groundstation.viewer.recorder import Recorder
from groundstation.viewer.series import FloatArray

MARK, TRAIL, LINK = 5.0, 1.0, 1.2  # radii in points of the screen
FLAT_M = 0.01  # half height of an ellipsoid where the height is not known: a disc
FRAME_S = 1.0  # links of one such step are drawn together
MOST_STRIPS = 60_000
STEPS: tuple[tuple[float, Colour], ...] = ((1.0, colours.ANSWER), (2.0, colours.PAPER), (3.0, colours.OVER_LIMIT))
VIEW_NAME = "East, north, up; true 2σ ellipsoids; links: residual below 1σ green, 2σ yellow, 3σ orange, else red"


def space(recorder: Recorder, answer: CooperativeResult, results: FlightResults) -> list[rrb.View]:
    """Log aircraft, tracks, ground points and links, and return the view.

    There is none without a position.
    """
    tracks = results.rows_of(CooperativeTracks)
    if tracks is None:
        return []
    rows = tracks.algorithm == trusted(answer).algorithm
    place = np.column_stack([tracks.x_m, tracks.y_m, tracks.z_m])
    origin = plane_through(place[rows]) if answer.frame == "ecef" else None
    shown, stations = _seen(place, origin), _stations(recorder, results.rows_of(SessionPoints), origin)
    ways: dict[str, tuple[FloatArray, FloatArray]] = {}
    shades, parts = colours.for_series(len(answer.vehicle_names)), path_parts(answer.vehicle_names)
    for name, part, shade in zip(answer.vehicle_names, parts, shades, strict=True):
        mine = np.flatnonzero(rows & (tracks.vehicle == name) & np.isfinite(shown).all(axis=1))
        if len(mine):
            _aircraft(recorder, f"space/{part}", name, tracks.where(mine), shown[mine], shade)
            ways[name] = tracks.time_s[mine], shown[mine]
    links = results.rows_of(CooperativeLinks)
    if links is not None:
        _links(recorder, links, ways, stations)
    recorder.static("space", rr.ViewCoordinates.RIGHT_HAND_Z_UP)
    return [rrb.Spatial3DView(name=VIEW_NAME, origin="/space")]


def _seen(position_m: FloatArray, origin: LocalFrame | None) -> FloatArray:
    """Return east, north, up of positions in the frame of the session."""
    plane = position_m if origin is None else origin.from_ecef_m(position_m)
    return np.column_stack([plane[:, 1], plane[:, 0], -plane[:, 2]])


def _stations(recorder: Recorder, points: SessionPoints | None, origin: LocalFrame | None) -> dict[str, FloatArray]:
    if points is None:
        return {}
    places = _seen(np.column_stack([points.x_m, points.y_m, points.z_m]), origin)
    drawn = rr.Points3D(
        places,
        labels=[clean_text(name) for name in points.label],
        colors=[colours.LIGHT] * len(places),
        radii=rr.Radius.ui_points(MARK),
    )
    recorder.static("space/stations", drawn)
    return {str(name): place for name, place in zip(points.label, places, strict=True)}


def _aircraft(
    recorder: Recorder, path: str, name: str, track: CooperativeTracks, place: FloatArray, shade: Colour
) -> None:
    indexes = recorder.indexes(recorder.time_ns(track.time_s))
    strip = rr.LineStrips3D([place], colors=[shade], radii=rr.Radius.ui_points(TRAIL))
    recorder.static(f"{path}/track", strip)
    mark = rr.Points3D.from_fields(colors=[shade], radii=rr.Radius.ui_points(MARK), labels=[clean_text(name)])
    recorder.static(f"{path}/now", mark)
    where = place.astype(np.float32)
    recorder.stream.send_columns(f"{path}/now", indexes, rr.Points3D.columns(positions=where))
    half_m, turn = ellipsoids(track.sigma_north_m, track.sigma_east_m, track.correlation_north_east, track.sigma_up_m)
    recorder.static(f"{path}/ellipsoid", rr.Ellipsoids3D.from_fields(colors=[(*shade[:3], 90)], fill_mode="solid"))
    columns = rr.Ellipsoids3D.columns(half_sizes=half_m.astype(np.float32), centers=where, quaternions=turn)
    recorder.stream.send_columns(f"{path}/ellipsoid", indexes, columns)


def ellipsoids(
    north_m: FloatArray, east_m: FloatArray, correlation: FloatArray, up_m: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return half axes (n, 3) of 2 sigma ellipsoids and their turn (n, 4), x y z w.

    The turn is from axes east, north, up. The errors of height and place are taken as independent. Without a sigma up
    an ellipsoid is a disc.

    Examples
    --------
    >>> one = (np.array([value]) for value in (1.0, 3.0, 0.0, 5.0))
    >>> half_m, turn = ellipsoids(*one)
    >>> half_m.tolist(), turn.round(6).tolist()
    ([[6.0, 2.0, 10.0]], [[0.0, 0.0, 0.0, 1.0]])
    """
    major, minor, azimuth_deg = principal_axes(north_m, east_m, correlation)
    half_m = 2.0 * np.column_stack([major, minor, np.where(np.isfinite(up_m), up_m, 0.5 * FLAT_M)])
    half_turn_rad = np.deg2rad(0.5 * (90.0 - azimuth_deg))  # the first axis shows east before it is turned
    nothing = np.zeros(len(major))
    turn = np.column_stack([nothing, nothing, np.sin(half_turn_rad), np.cos(half_turn_rad)])
    return np.nan_to_num(half_m), np.nan_to_num(turn)


def _links(
    recorder: Recorder,
    links: CooperativeLinks,
    ways: dict[str, tuple[FloatArray, FloatArray]],
    stations: dict[str, FloatArray],
) -> None:
    """Log the links of every frame as strips from source to receiver.

    A frame without any clears them.
    """
    receiver, source = links.receiver, links.source
    known = np.isin(receiver, list(ways)) & np.isin(source, [*ways, *stations])
    rows = np.flatnonzero(known)
    if not len(rows):
        return
    time_s = links.time_s[rows]
    frame_s = FRAME_S * np.ceil(len(rows) / MOST_STRIPS)  # of many links fewer frames
    frame = np.floor(time_s / frame_s).astype(np.int64)
    rows, frame, time_s = _one_a_frame(rows, frame, time_s, receiver, source)
    ends = np.stack([_places(name, rows, time_s, ways, stations) for name in (source, receiver)], axis=1)
    shades = [shade_of(*one) for one in _residuals(links, rows)]
    frames = np.arange(frame[0], frame[-1] + 2)
    lengths = np.bincount(frame - frame[0], minlength=len(frames))
    recorder.static("space/links", rr.LineStrips3D.from_fields(radii=rr.Radius.ui_points(LINK)))
    columns = rr.LineStrips3D.columns(strips=list(ends.astype(np.float32)), colors=shades).partition(lengths.tolist())
    recorder.stream.send_columns("space/links", recorder.indexes(recorder.time_ns(frames * frame_s)), columns)


def _one_a_frame(
    rows: Int64Array, frame: Int64Array, time_s: FloatArray, receiver: Texts, source: Texts
) -> tuple[Int64Array, Int64Array, FloatArray]:
    """Return the last range of each link in each frame, in order of frames."""
    names = np.char.add(np.char.add(receiver[rows], "\n"), source[rows])
    _, link = np.unique(names, return_inverse=True)
    order = np.lexsort((time_s, link, frame))
    same = (np.diff(frame[order]) == 0) & (np.diff(link[order]) == 0)
    kept = order[np.append(~same, True)]
    return rows[kept], frame[kept], time_s[kept]


def _places(
    names: Texts,
    rows: Int64Array,
    time_s: FloatArray,
    ways: dict[str, tuple[FloatArray, FloatArray]],
    stations: dict[str, FloatArray],
) -> FloatArray:
    """Return the place of one end of each link at its time."""
    found = np.zeros((len(rows), 3))
    for name in np.unique(names[rows]).tolist():
        mine = names[rows] == name
        if name in ways:
            when, where = ways[name]
            found[mine] = np.column_stack([np.interp(time_s[mine], when, where[:, k]) for k in range(3)])
        else:
            found[mine] = stations[name]
    return found


def _residuals(links: CooperativeLinks, rows: Int64Array) -> list[tuple[float, bool]]:
    with np.errstate(divide="ignore", invalid="ignore"):
        normal = np.abs(links.innovation[rows] / links.sigma[rows])
    return list(zip(normal.tolist(), (links.mark[rows] > 0).tolist(), strict=True))


def shade_of(normal: float, is_used: bool) -> Colour:
    """Return the colour of a link whose residual is ``normal`` sigmas.

    Examples
    --------
    >>> shade_of(0.4, True) == colours.ANSWER, shade_of(0.4, False) == colours.LIMIT == shade_of(9.0, True)
    (True, True)
    """
    if not is_used:
        return colours.LIMIT
    return next((shade for most, shade in STEPS if normal < most), colours.LIMIT)
