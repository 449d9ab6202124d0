"""Contradictions within a log: values that cannot all be true, though each is possible.

A speed that its own positions do not show, a vehicle on wheels or fast in the air whose nose points away from its
track, a vehicle that drives or flies on its side, a height that pressure does not follow, a vertical velocity with the
other sign. Mostly it is a unit, a sign or an axis that the log does not state as it is read. Nothing is changed and
nothing is dropped.
"""

from collections.abc import Iterable, Mapping

import numpy as np
from numpy.typing import NDArray

from groundstation.base.angles import direction_of, wrap_180
from groundstation.base.climb import OPPOSITE, climb_agreement
from groundstation.base.dataclasses import dataclass
from groundstation.base.geodesy import METRES_PER_DEG
from groundstation.base.records import BoolArray, Column, Int64Array
from groundstation.base.signals import kind_of
from groundstation.base.sorted_values import distinct, median
from groundstation.base.units import NS_PER_S
from groundstation.integrity.clock import ClockModel
from groundstation.integrity.stuck import MotionSampler

FloatArray = NDArray[np.float64]
LASTS_S = 60.0  # a shorter stretch may be a turn, a slip, a receiver's bad minute
WINDOW_S = 10.0  # speeds and directions are those between the ends of windows
LONGEST_STEP_S = 5.0  # between samples; across a longer one nothing is compared

SPEED_MPS, SPEED_SHARE = 5.0, 0.3  # allowed difference of the speeds by positions and velocity
SIDE_DEG = 75.0  # roll at which no vehicle drives or flies for a minute
STEEP_DEG = 60.0  # pitch beyond which roll says little
MOVES_MPS = 0.5
OFF_DEG = 60.0  # nose against track
FAST_MPS = 25.0  # no multirotor flies sideways so fast for a minute
ALIGNED = 0.8  # length of the mean direction of what lasts: an offset, not a spin
HEIGHT_M, HEIGHT_SHARE = 200.0, 0.2  # weather moves pressure altitude by less, cold air by less of the climb
ANY = 1e7  # metres, metres per second or degrees
HEADINGS = ("true_heading_deg", "magnetic_heading_deg")
ALTITUDES = ("altitude_msl_m", "altitude_ellipsoid_m")
DOWN = "velocity_down_mps"
WHEELS = "odometry"  # kind of topic that only a vehicle on wheels has
ROLLS = "rolls"


@dataclass(frozen=True)
class Contradiction:
    """Values of a topic that cannot all be true: which, corrected time of the start, length."""

    topic: str
    text: str
    start_ns: int
    length_s: float


@dataclass(frozen=True)
class _Series:
    """Samples of one topic in order of corrected time.

    Times are seconds since the first sample of the log, shape (n,).
    """

    topic: str
    time_s: FloatArray
    columns: Mapping[str, FloatArray]

    def has(self, *names: str) -> bool:
        return all(name in self.columns and bool(np.isfinite(self.columns[name]).any()) for name in names)

    def known(self, *names: str, beside: tuple[str, ...] = ()) -> "_Series":
        """Return the samples in which all of these fields are known, one for each time.

        Fields ``beside`` them come along, known or not.
        """
        mask = np.all([np.isfinite(self.columns[name]) for name in names], axis=0)
        mask &= np.concatenate([[True], np.diff(self.time_s) > 0.0]) if len(self.time_s) else mask
        kept = {name: self.columns[name][mask] for name in (*names, *beside) if name in self.columns}
        return _Series(self.topic, self.time_s[mask], kept)


@dataclass(frozen=True)
class _Windows:
    """Motion between samples some ten seconds apart, shapes (n,).

    It has the times of both ends, and metres per second north and east. ``first`` and ``last`` are the samples at the
    ends.
    """

    start_s: FloatArray
    end_s: FloatArray
    north_mps: FloatArray
    east_mps: FloatArray
    first: Int64Array
    last: Int64Array

    @property
    def speed_mps(self) -> FloatArray:
        return np.hypot(self.north_mps, self.east_mps)


def contradictions(
    motion: MotionSampler, clock: ClockModel, topics: Iterable[str], metadata: Mapping[str, str]
) -> tuple[Contradiction, ...]:
    """Find the places where a log contradicts itself.

    Parameters
    ----------
    motion : MotionSampler
        Samples of all sources of motion.
    clock : ClockModel
    topics : iterable of str
        All topics of the log.
    metadata : mapping
        Head of the log: ``vehicle``, ``always_on_ground``.
    """
    zero_ns, series = _series_of(motion, clock)
    windows = {one.topic: seen for one in series if (seen := _windows_of(one)) is not None}
    does_roll = (
        any(kind_of(topic) == WHEELS for topic in topics)
        or metadata.get("vehicle", "") == ROLLS
        or metadata.get("always_on_ground", "").strip().lower() in ("true", "yes", "1")
    )
    found: list[Contradiction | None] = []
    for one in series:
        found.append(_speed(one, windows.get(one.topic), zero_ns))
        if kind_of(one.topic) == "ins":
            found.append(_side(one, windows, zero_ns))
            found.append(_heading(one, windows, does_roll, zero_ns))
            found.append(_climb(one, zero_ns))
    found += [_height(one, series, zero_ns) for one in series if kind_of(one.topic) in ("gnss", "ins")]
    return tuple(one for one in found if one is not None)


def _series_of(motion: MotionSampler, clock: ClockModel) -> tuple[int, list[_Series]]:
    placed = []
    for topic, index, device_ns, columns in motion.samples():
        time_ns = clock.time_ns(index, Column(device_ns))
        order = np.argsort(time_ns, kind="stable")
        placed.append((topic, time_ns[order], {name: _possible(name, one[order]) for name, one in columns.items()}))
    zero_ns = min((int(time_ns[0]) for _, time_ns, _ in placed if len(time_ns)), default=0)
    return zero_ns, [_Series(topic, (time_ns - zero_ns) / NS_PER_S, columns) for topic, time_ns, columns in placed]


def _possible(name: str, values: FloatArray) -> FloatArray:
    """Replace by NaN the values that no motion has; the ledger lists them as out of range."""
    return np.where(np.abs(values) <= (90.0 if name == "latitude_deg" else ANY), values, np.nan)


def _windows_of(one: _Series) -> _Windows | None:
    """Motion by positions; None where a topic has none."""
    if not one.has("latitude_deg", "longitude_deg"):
        return None
    known = one.known("latitude_deg", "longitude_deg")
    time_s, latitude = known.time_s, known.columns["latitude_deg"]
    if len(time_s) < 2:
        return None
    # Edges beside a sample only: damaged times may be centuries apart.
    steps = distinct(np.floor((time_s - time_s[0]) / WINDOW_S))
    edges_s = time_s[0] + WINDOW_S * distinct(np.concatenate([steps, steps + 1.0]))
    ends = distinct(np.searchsorted(time_s, edges_s[edges_s < time_s[-1]]))
    if len(ends) < 2:
        return None
    start, end = ends[:-1], ends[1:]
    steps = np.maximum.reduceat(np.diff(time_s), start)
    length = time_s[end] - time_s[start]
    whole = (steps <= LONGEST_STEP_S) & (length >= 0.5 * WINDOW_S)
    start, end, length = start[whole], end[whole], length[whole]
    east_deg = wrap_180(known.columns["longitude_deg"][end] - known.columns["longitude_deg"][start])
    north = METRES_PER_DEG * (latitude[end] - latitude[start]) / length
    east = METRES_PER_DEG * np.cos(np.deg2rad(latitude[start])) * np.asarray(east_deg) / length
    return _Windows(time_s[start], time_s[end], north, east, start, end)


def _speed(one: _Series, windows: _Windows | None, zero_ns: int) -> Contradiction | None:
    """Find velocity, or speed, that the topic's own positions do not show."""
    if windows is None or not len(windows.start_s):
        return None
    names = ("velocity_north_mps", "velocity_east_mps")
    if one.has(*names):
        logged = [_mean_within(one, name, windows) for name in names]
        apart = np.hypot(windows.north_mps - logged[0], windows.east_mps - logged[1])
        speed = np.hypot(*logged)
    elif one.has("ground_speed_mps"):
        speed = _mean_within(one, "ground_speed_mps", windows)
        apart = windows.speed_mps - speed  # in a turn the ends are nearer to each other than the way is long
    else:
        return None
    allowed = SPEED_MPS + SPEED_SHARE * np.maximum(speed, windows.speed_mps)
    rows = _lasting(windows.start_s, windows.end_s, np.nan_to_num(apart) > allowed)
    if rows is None:
        return None
    implied, told = median(windows.speed_mps[rows]), median(speed[rows])
    text = f"positions of {one.topic} imply {implied:.3g} m/s, logged are {told:.3g} m/s"
    if abs(implied - told) <= SPEED_MPS + SPEED_SHARE * max(implied, told):
        moved = direction_of(windows.north_mps[rows], windows.east_mps[rows])
        off = _mean_direction(wrap_180(direction_of(logged[0][rows], logged[1][rows]) - moved))[0]
        text = f"velocity of {one.topic} points {abs(off):.0f} deg off the way that its positions go"
    return _told(one.topic, text, windows.start_s, windows.end_s, rows, zero_ns)


def _side(one: _Series, windows: Mapping[str, _Windows], zero_ns: int) -> Contradiction | None:
    """Find the roll of a vehicle on its side while it moves."""
    if not one.has("roll_deg"):
        return None
    known = one.known("roll_deg", beside=("pitch_deg",))
    roll, time_s = known.columns["roll_deg"], known.time_s
    pitch = known.columns.get("pitch_deg", np.zeros(len(roll)))
    is_side = (np.abs(roll) > SIDE_DEG) & ~(np.abs(pitch) > STEEP_DEG) & (_speed_at(time_s, windows) > MOVES_MPS)
    ends_s = np.append(time_s[1:], time_s[-1:])
    rows = _lasting(time_s, np.minimum(ends_s, time_s + LONGEST_STEP_S), is_side)
    if rows is None:
        return None
    text = f"{one.topic} rolls by {median(np.abs(roll[rows])):.1f} deg while the vehicle moves"
    return _told(one.topic, text, time_s, ends_s, rows, zero_ns)


def _heading(one: _Series, windows: Mapping[str, _Windows], does_roll: bool, zero_ns: int) -> Contradiction | None:
    """Find heading far off the track of a vehicle that cannot move sideways."""
    name = next((name for name in HEADINGS if one.has(name)), "")
    track = windows.get(one.topic) or next((found for found in windows.values() if len(found.start_s)), None)
    if not name or track is None:
        return None
    known = one.known(name)
    middle_s = 0.5 * (track.start_s + track.end_s)
    at = np.clip(np.searchsorted(known.time_s, middle_s), 0, len(known.time_s) - 1)
    heading = np.where(np.abs(known.time_s[at] - middle_s) < WINDOW_S, known.columns[name][at], np.nan)
    off = np.asarray(wrap_180(heading - direction_of(track.north_mps, track.east_mps)))
    is_fit = track.speed_mps > (MOVES_MPS if does_roll else FAST_MPS)
    rows = _lasting(track.start_s, track.end_s, is_fit & (np.abs(off) > OFF_DEG))
    if rows is None:
        return None
    if _mean_direction(off[rows])[1] < ALIGNED:
        return None
    usual = np.nanmedian(np.abs(off[is_fit]))
    kind = "a vehicle on wheels" if does_roll else f"an aircraft faster than {FAST_MPS:.0f} m/s"
    text = f"heading of {one.topic} is {usual:.0f} deg off the track of {kind}"
    return _told(one.topic, text, track.start_s, track.end_s, rows, zero_ns)


def _climb(one: _Series, zero_ns: int) -> Contradiction | None:
    """Find a downward velocity that has the sign of an upward one."""
    name = next((name for name in ALTITUDES if one.has(name)), "")
    if not name or not one.has(DOWN):
        return None
    known = one.known(name, DOWN)
    found = climb_agreement(known.time_s, known.columns[name], known.columns[DOWN])
    if found is None or found >= OPPOSITE:
        return None
    text = (
        f"{DOWN} of {one.topic} goes up with its height (correlation with its rate of sinking {found:.2f}): climb and "
        "sink rate by it have the wrong sign"
    )
    start_ns = zero_ns + round(float(known.time_s[0]) * NS_PER_S)
    return Contradiction(one.topic, text, start_ns, float(known.time_s[-1] - known.time_s[0]))


def _height(one: _Series, series: list[_Series], zero_ns: int) -> Contradiction | None:
    """Find height that the pressure altitude does not follow."""
    name = next((name for name in ALTITUDES if one.has(name)), "")
    baro = next(
        (other for other in series if kind_of(other.topic) == "baro" and other.has("pressure_altitude_m")), None
    )
    if not name or baro is None:
        return None
    own, other = one.known(name), baro.known("pressure_altitude_m")
    time_s, height = own.time_s, own.columns[name]
    if len(time_s) < 2 or len(other.time_s) < 2:
        return None
    pressure = np.interp(time_s, other.time_s, other.columns["pressure_altitude_m"], left=np.nan, right=np.nan)
    after = np.clip(np.searchsorted(other.time_s, time_s), 1, len(other.time_s) - 1)
    pressure[other.time_s[after] - other.time_s[after - 1] > LONGEST_STEP_S] = np.nan
    both = np.isfinite(pressure)
    if not both.any():
        return None
    climbed = [values - median(values[both]) for values in (height, pressure)]
    apart = np.abs(climbed[0] - climbed[1])
    allowed = HEIGHT_M + HEIGHT_SHARE * np.maximum(*np.abs(climbed))
    ends_s = np.minimum(np.append(time_s[1:], time_s[-1:]), time_s + LONGEST_STEP_S)
    rows = _lasting(time_s, ends_s, both & (np.nan_to_num(apart) > allowed))
    if rows is None:
        return None
    text = f"height of {one.topic} and pressure altitude drift {median(apart[rows]):.0f} m apart"
    return _told(one.topic, text, time_s, ends_s, rows, zero_ns)


def _mean_within(one: _Series, name: str, windows: _Windows) -> FloatArray:
    """Mean of a column over each window, shape (n,); NaN where it is not known there."""
    known = one.known(name)
    total = np.concatenate([[0.0], np.cumsum(known.columns[name])])
    low = np.searchsorted(known.time_s, windows.start_s)
    high = np.searchsorted(known.time_s, windows.end_s, side="right")
    return np.where(high > low, (total[high] - total[low]) / np.maximum(high - low, 1), np.nan)


def _speed_at(time_s: FloatArray, windows: Mapping[str, _Windows]) -> FloatArray:
    """Speed by positions of any topic at some times, shape (n,); 0 where none is known."""
    speed = np.zeros(len(time_s))
    for one in windows.values():
        if len(one.start_s):
            at = np.clip(np.searchsorted(one.start_s, time_s, side="right") - 1, 0, len(one.start_s) - 1)
            is_inside = (time_s >= one.start_s[at]) & (time_s <= one.end_s[at])
            speed = np.maximum(speed, np.where(is_inside, one.speed_mps[at], 0.0))
    return speed


def _mean_direction(angles_deg: FloatArray) -> tuple[float, float]:
    """Mean of directions, degrees in [-180, 180), and the length of their mean vector, 0 to 1."""
    angles = np.deg2rad(angles_deg)
    north, east = float(np.mean(np.cos(angles))), float(np.mean(np.sin(angles)))
    return float(np.rad2deg(np.arctan2(east, north))), float(np.hypot(north, east))


def _lasting(start_s: FloatArray, end_s: FloatArray, mask: BoolArray) -> Int64Array | None:
    """Rows of all runs of the mask that last, shape (k,); None where no run does."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], mask, [False]]).astype(np.int8)))
    runs = [(low, high) for low, high in edges.reshape(-1, 2) if end_s[high - 1] - start_s[low] >= LASTS_S]
    return np.concatenate([np.arange(low, high) for low, high in runs]) if runs else None


def _told(
    topic: str, text: str, start_s: FloatArray, end_s: FloatArray, rows: Int64Array, zero_ns: int
) -> Contradiction:
    length_s = float(np.sum(end_s[rows] - start_s[rows]))
    return Contradiction(topic, text, zero_ns + round(float(start_s[rows[0]]) * NS_PER_S), length_s)
