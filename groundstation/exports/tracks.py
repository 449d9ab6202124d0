"""Tracks to export: those logged, those made of an INS, and the best trajectory."""

import math
from collections.abc import Mapping
from itertools import pairwise

import numpy as np

from groundstation.base.angles import FloatArray, interpolate_heading, wrap_180
from groundstation.base.dataclasses import dataclass
from groundstation.base.ellipse import ELLIPSE_95, principal_axes
from groundstation.base.records import Int64Array
from groundstation.base.signals import topics_of_kind
from groundstation.base.units import NS_PER_S
from groundstation.results.arrays.states import BodyStates
from groundstation.results.corrected_position import BestTrack, MadeTrack
from groundstation.results.flight import FlightResults
from groundstation.results.roles import StatesAlongTheFlight
from groundstation.tables.motion import horizontal_speed_mps
from groundstation.tables.table import Flight, Table

POSITION = ("latitude_deg", "longitude_deg")
MSL, ELLIPSOID, PRESSURE = "altitude_msl_m", "altitude_ellipsoid_m", "pressure_altitude_m"
ALTITUDES = (MSL, ELLIPSOID, PRESSURE)
MOVES = ("velocity_north_mps", "velocity_east_mps", "velocity_down_mps", "roll_deg", "pitch_deg")
DIRECTIONS = ("track_deg", "true_heading_deg")
OF_THE_FIX = ("hdop", "satellites_used")
BRIDGED_S = 0.25  # altitude, attitude and velocity of other rows are interpolated over at most so long
EPOCH_BRIDGED_S = 1.5  # altitude of the INS at the epochs of a track made of it, which are as far apart
SPEED, HALF_WIDTH = "ground_speed_mps", "horizontal95_m"
NORTH_SIGMA, EAST_SIGMA, VERTICAL_SIGMA = "north_sigma_m", "east_sigma_m", "vertical_sigma_m"
VELOCITY_SIGMAS = tuple(f"velocity_{axis}_sigma_mps" for axis in ("north", "east", "down"))
ANGLE_SIGMAS = ("roll_sigma_deg", "pitch_sigma_deg", "true_heading_sigma_deg")


@dataclass(frozen=True)
class Track:
    """Positions in the order of time, all of them known.

    Parameters
    ----------
    name : str
        Topic of the log, or the name that the analysis gives its track: ``corrected``.
    title : str
        For people.
    time_ns : ndarray of int64, shape (n,)
        UTC where ``has_utc``, else since the log's own zero.
    start_ns : int
        Time of flight second zero.
    latitude_deg, longitude_deg : ndarrays, shape (n,)
    columns : mapping of str to ndarray, shape (n,)
        Further data of each position, altitudes among it, NaN where it is not.
    is_best : bool
        True of the best trajectory where its checks hold: a format of one track takes it before the logged ones if it
        can hold attitude.
    """

    name: str
    title: str
    time_ns: Int64Array
    start_ns: int
    has_utc: bool
    latitude_deg: FloatArray
    longitude_deg: FloatArray
    columns: Mapping[str, FloatArray]
    is_best: bool = False

    def __len__(self) -> int:
        return len(self.time_ns)

    @property
    def time_s(self) -> FloatArray:
        """Flight seconds, shape (n,)."""
        return (self.time_ns - self.start_ns) / NS_PER_S

    def column(self, name: str) -> FloatArray:
        """A column, NaN where the track has none."""
        return self.columns.get(name, np.full(len(self), np.nan))

    def pieces(self) -> tuple[slice, ...]:
        """Rows between crossings of the date line; all rows where it crosses none."""
        crossings = (np.flatnonzero(np.abs(np.diff(self.longitude_deg)) > 180.0) + 1).tolist()
        return tuple(slice(first, last) for first, last in pairwise((0, *crossings, len(self))))


def tracks_of(flight: Flight, results: FlightResults | None) -> tuple[Track, ...]:
    """Return the tracks of a flight: logged ones, those made of an INS, the best.

    They are the tracks that have positions. The altitude of the INS stands beside the positions made of it.
    """
    topics = [topic for kind in ("gnss", "ins", "truth") for topic in topics_of_kind(kind, flight.topics())]
    logged = [_logged(flight, flight[topic].unique_times()) for topic in topics]
    tracks = [track for track in logged if track is not None]
    best = None if results is None else results.answer_meeting(BestTrack)
    if results is not None and best is not None:
        tracks += [_made(flight, made, best.ins_topic) for made in best.tracks(results)]
    estimated = None if results is None else results.answer_meeting(StatesAlongTheFlight)
    states = None if results is None else results.rows_of(BodyStates)
    if estimated is not None and states is not None:
        tracks.append(_estimated(flight, estimated, states))
    return tuple(track for track in tracks if len(track))


def _logged(flight: Flight, table: Table) -> Track | None:
    table = table.take(table.values("integrity_ok") != 0.0)
    # A latitude beyond the poles is no place on Earth; a longitude may count from 0 to 360.
    placed = table.take((np.abs(table.values(POSITION[0])) <= 90.0) & np.isfinite(table.values(POSITION[1])))
    time_s, at_s = flight.seconds(table.time_ns), flight.seconds(placed.time_ns)
    columns = {name: placed.values(name) for name in OF_THE_FIX if placed.has(name)}
    for name in (*ALTITUDES, *MOVES, *DIRECTIONS):
        if table.has(name):
            columns[name] = _bridged(at_s, time_s, table.values(name), is_direction=name in DIRECTIONS)
    speed = horizontal_speed_mps(table)
    if np.isfinite(speed).any():
        columns[SPEED] = _bridged(at_s, time_s, speed)
    longitude = placed.values(POSITION[1])
    place = (placed.values(POSITION[0]), np.where(np.abs(longitude) > 180.0, wrap_180(longitude), longitude))
    return Track(
        table.topic, f"{table.topic} as logged", placed.time_ns, flight.start_ns, flight.has_utc, *place, columns
    )


def _bridged(
    at_s: FloatArray,
    time_s: FloatArray,
    values: FloatArray,
    *,
    is_direction: bool = False,
    longest_s: float = BRIDGED_S,
) -> FloatArray:
    """Return values of a topic at other times of the same topic.

    Many logs give position and attitude in rows of their own.
    """
    known = np.isfinite(values)
    if not known.any():
        return np.full(len(at_s), np.nan)
    time_s, values = time_s[known], values[known]
    after = np.clip(np.searchsorted(time_s, at_s), 0, len(time_s) - 1)
    before = np.clip(np.searchsorted(time_s, at_s, side="right") - 1, 0, None)
    near = (time_s[after] - time_s[before] <= longest_s) & (time_s[before] <= at_s) & (at_s <= time_s[after])
    between = interpolate_heading(at_s, time_s, values) if is_direction else np.interp(at_s, time_s, values)
    return np.where(near, between, np.nan)


def _made(flight: Flight, made: MadeTrack, ins_topic: str) -> Track:
    """Return a track that an analysis made of an INS, at its own times.

    Half of the 95 % ellipse's major axis is its width. No error of height is estimated: the altitude is that of the
    INS, as logged.
    """
    columns = _altitudes(flight, ins_topic, made.time_s)
    north, east = made.sigma_north_m, made.sigma_east_m
    if north is not None and east is not None:
        major = principal_axes(north, east, np.zeros(len(north)))[0]
        columns |= {NORTH_SIGMA: north, EAST_SIGMA: east, HALF_WIDTH: ELLIPSE_95 * major}
    time_ns = flight.start_ns + np.rint(made.time_s * NS_PER_S).astype(np.int64)
    title, place = f"{made.title}, height of the INS", (made.latitude_deg, made.longitude_deg)
    return Track(made.name, title, time_ns, flight.start_ns, flight.has_utc, *place, columns)


def _estimated(flight: Flight, estimated: StatesAlongTheFlight, states: BodyStates) -> Track:
    """Return the track of the states of a vehicle, every one."""
    given = dict(states.columns)
    sigmas = {NORTH_SIGMA: given["position_north_sigma_m"], EAST_SIGMA: given["position_east_sigma_m"]}
    others = (*ALTITUDES, *MOVES, *DIRECTIONS, VERTICAL_SIGMA, *VELOCITY_SIGMAS, *ANGLE_SIGMAS)
    columns = {name: given[name] for name in others if name in given} | sigmas
    columns |= _other_altitude(flight, estimated.gnss_topic, states)
    major = principal_axes(sigmas[NORTH_SIGMA], sigmas[EAST_SIGMA], np.zeros(len(states)))[0]
    columns[HALF_WIDTH] = ELLIPSE_95 * major
    columns[SPEED] = np.hypot(states.velocity_north_mps, states.velocity_east_mps)
    time_ns = flight.start_ns + np.rint(states.time_s * NS_PER_S).astype(np.int64)
    clock = (time_ns, flight.start_ns, flight.has_utc)
    place = (states.latitude_deg, states.longitude_deg)
    title = estimated.states_title
    return Track(estimated.states_name, title, *clock, *place, columns, is_best=estimated.is_reference)


def _other_altitude(flight: Flight, gnss_topic: str, states: BodyStates) -> dict[str, FloatArray]:
    """Return the altitude that the states lack, by the height of the geoid.

    That is known where the receiver gives both altitudes.
    """
    if gnss_topic not in flight or not (flight[gnss_topic].has(MSL) and flight[gnss_topic].has(ELLIPSOID)):
        return {}
    table = flight[gnss_topic].unique_times()
    geoid_m = table.values(ELLIPSOID) - table.values(MSL)
    known = np.isfinite(geoid_m)
    if not known.any():
        return {}
    geoid_m = np.interp(states.time_s, flight.seconds(table.time_ns)[known], geoid_m[known])
    if states.altitude_ellipsoid_m is not None and states.altitude_msl_m is None:
        return {MSL: states.altitude_ellipsoid_m - geoid_m}
    if states.altitude_msl_m is not None and states.altitude_ellipsoid_m is None:
        return {ELLIPSOID: states.altitude_msl_m + geoid_m}
    return {}


def _altitudes(flight: Flight, ins_topic: str, at_s: FloatArray) -> dict[str, FloatArray]:
    """Altitudes of an INS at given flight seconds."""
    if ins_topic not in flight:
        return {}
    table = flight[ins_topic].unique_times()
    time_s = flight.seconds(table.time_ns)
    return {
        name: _bridged(at_s, time_s, table.values(name), longest_s=EPOCH_BRIDGED_S)
        for name in ALTITUDES
        if table.has(name)
    }


def number(value: float, digits: int) -> str:
    """Write a number with so many decimals at most; empty where it is not known.

    Examples
    --------
    >>> number(1.5, 3), number(-0.0001, 3), number(float("nan"), 3)
    ('1.5', '0', '')
    """
    if not math.isfinite(value):
        return ""
    text = f"{value:.{digits}f}".rstrip("0").rstrip(".") if digits else f"{value:.0f}"
    return "0" if text == "-0" else text


def coordinates(values_deg: FloatArray) -> list[str]:
    """Write degrees with nine decimals, 0.1 mm."""
    return [number(value, 9) for value in values_deg.tolist()]
