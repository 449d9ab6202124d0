"""Proof of ground contact from motion alone, for logs without weight on wheels.

Slow is not on the ground: a multirotor hovers, an aircraft meets its own speed in wind. So the proof starts from
standstills that only a parked vehicle shows and is carried from there, forward and backward, as long as the motion
is that of something rolling on a surface. Every rule may refuse ground that was ground; none may pass air for ground.
"""

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.dataclasses import dataclass
from groundstation.base.records import BoolArray, frozen
from groundstation.tables.motion import (
    RATE_HZ,
    Motion,
    known_mean,
    largest_over_sources,
    running_mean,
    runs,
    window_sum,
)

WALKING_MPS = 2.0  # nothing flies so slowly that does not hover


@dataclass(frozen=True)
class GroundSettings:
    """Limits of the ground detector.

    Defaults were set on a UAV carried by hand, light aircraft at 1 Hz and simulations.

    Parameters
    ----------
    standstill_s, standstill_speed_mps
        A standstill lasts at least so long below that speed (receiver noise included).
    steady_altitude_m
        Largest change of altitude across ``standstill_s``.
    steady_tilt_deg, steady_heading_deg
        Largest standard deviation, about a straight line over ``standstill_s``, of roll and pitch and of heading.
        Parked aircraft show 0.01-0.2 deg (filters settling 0.2), a hover 0.3-2 deg.
    swaying_tilt_deg
        Slow for ``standstill_s`` with more scatter of roll or pitch than that is a hover: no proof passes through it.
    slope, altitude_noise_m, altitude_drift_mps, altitude_drift_m
        Two points on one ground differ in altitude by at most noise + slope x distance + drift x time between them; the
        drift (of satellite altitude) counts up to ``altitude_drift_m``. Runways are within 2 %.
    climb_window_s, climb_m
        Across that window, centred, altitude changes at most by ``climb_m`` + slope x distance.
    climb_mps, drift_mps
        The upward speed is at most ``climb_mps`` + slope x speed as a mean of 3 s, and ``drift_mps`` + slope x speed as
        a mean of the climb window: satellite receivers measure it to some cm/s.
    tilt_deg
        Largest change of 1-s mean roll and pitch against the standstill.
    height_m, height_s
        Surely airborne is what stays that much above what the ground can be, for so long, in every altitude source.
    low_height_m
        The same for what is as fast as ``speed_share`` of sure flight all the time: a low hop between two standstills.
    speed_share
        Share of the lowest speed while surely airborne (first percentile): nothing faster is proven. A vehicle that
        hovers is never proven to roll; a float above the runway does not pass.
    unlearnt_speed_mps
        The limit of speed in a log without sure flight.
    lift_off_share
        Before an end by climb or tilt, samples faster than this share of the speed there are taken off.
    margin_s
        Taken off at both ends of every proven stretch.
    """

    standstill_s: float = 10.0
    standstill_speed_mps: float = 0.5
    steady_altitude_m: float = 1.5
    steady_tilt_deg: float = 0.2
    steady_heading_deg: float = 0.5
    swaying_tilt_deg: float = 0.4
    slope: float = 0.02
    altitude_noise_m: float = 3.0
    altitude_drift_mps: float = 0.05
    altitude_drift_m: float = 10.0
    climb_window_s: float = 8.0
    climb_m: float = 2.0
    climb_mps: float = 0.5
    drift_mps: float = 0.2
    tilt_deg: float = 5.0
    height_m: float = 15.0
    height_s: float = 5.0
    low_height_m: float = 5.0
    speed_share: float = 0.8
    unlearnt_speed_mps: float = 15.0
    lift_off_share: float = 0.7
    margin_s: float = 3.0


@dataclass(frozen=True)
class Detection:
    """Proofs of the detector on the grid of :class:`Motion`, arrays of shape (n,).

    ``ground`` is proven contact, ``standing`` proven standstill, ``airborne`` sure flight; the rest is not known.
    ``speed_limit_mps`` is the largest speed that could be proven. ``reason`` says why nothing was.
    """

    ground: BoolArray
    standing: BoolArray
    airborne: BoolArray
    speed_limit_mps: float
    reason: str = ""

    def __post_init__(self) -> None:
        for name in ("ground", "standing", "airborne"):
            object.__setattr__(self, name, frozen(getattr(self, name)))


@dataclass(frozen=True)
class _Stop:
    """A standstill: rows [start, end), its mean attitude and its altitude by source."""

    start: int
    end: int
    roll_deg: float
    pitch_deg: float
    altitude_m: FloatArray

    @property
    def middle(self) -> int:
        return (self.start + self.end) // 2


def detect_ground(motion: Motion, settings: GroundSettings | None = None) -> Detection:
    """Prove ground contact from standstills and from motion that continues them.

    Standstill: speed, roll, pitch, heading (where logged) and altitude steady over ``standstill_s``; one that lies
    higher than another near it is a hover. From each standstill the proof is extended over rows whose data are
    complete, slow enough, neither climbing nor sinking nor tilting, and whose altitude stays near that of the
    standstill; before an end by climb or tilt the fast rows are taken off, and ``margin_s`` everywhere.

    It ignores: rolling that no standstill adjoins, slopes above ``slope``, a vehicle carried steadily by hand.
    """
    settings = settings or GroundSettings()
    nothing = np.zeros(len(motion), dtype=bool)
    missing = _missing(motion)
    if missing:
        return Detection(nothing, nothing, nothing, 0.0, f"no {missing} in the log")
    stops = _without_hovers(motion, _stops(motion, settings), settings)
    if not stops:
        return Detection(nothing, nothing, nothing, 0.0, "no standstill of a parked vehicle")
    standing = nothing.copy()
    for stop in stops:
        standing[stop.start : stop.end] = True
    height = _height_above_ground_m(motion, stops, settings)
    flying = (height > settings.height_m) & np.isfinite(motion.speed_mps)
    airborne = lasting(flying, settings.height_s) & ~standing
    limit = settings.unlearnt_speed_mps
    if airborne.any():
        limit = settings.speed_share * float(np.nanpercentile(motion.speed_mps[airborne], 1.0))
        hops = (height > settings.low_height_m) & (motion.speed_mps > max(limit, WALKING_MPS))
        airborne |= lasting(hops, settings.height_s) & ~standing
    ground = nothing.copy()
    allowed = _rolls(motion, limit, settings) | standing
    component = np.cumsum(np.diff(allowed.astype(np.int8), prepend=0) != 0)
    for stop in stops:
        first = int(np.searchsorted(component, component[stop.start], side="left"))
        last = int(np.searchsorted(component, component[stop.start], side="right"))
        _extend(ground, motion, stop, slice(first, last), settings, is_learnt=bool(airborne.any()))
    return Detection(ground, standing, airborne, limit)


def _missing(motion: Motion) -> str:
    if not np.isfinite(motion.speed_mps).any():
        return "ground speed"
    if not (np.isfinite(motion.roll_deg).any() and np.isfinite(motion.pitch_deg).any()):
        return "roll and pitch"
    return "" if np.isfinite(motion.all_altitudes_m).any() else "altitude that moves"


def _is_slow_throughout(motion: Motion, half: int, settings: GroundSettings) -> BoolArray:
    slow = motion.speed_mps <= settings.standstill_speed_mps  # NaN is not slow
    return np.asarray(window_sum(slow.astype(np.float64), half) == 2 * half + 1)


def _tilt_scatter_deg(motion: Motion, half: int) -> FloatArray:
    return np.maximum(_scatter_about_line(motion.roll_deg, half), _scatter_about_line(motion.pitch_deg, half))


def _stops(motion: Motion, settings: GroundSettings) -> list[_Stop]:
    half = round(0.5 * settings.standstill_s * RATE_HZ)
    steady = _is_slow_throughout(motion, half, settings)
    steady &= _tilt_scatter_deg(motion, half) <= settings.steady_tilt_deg
    if np.isfinite(motion.heading_deg).any():
        steady &= _scatter_about_line(motion.heading_deg, half) <= settings.steady_heading_deg
    steady &= _altitude_change_m(motion, half)[0] <= settings.steady_altitude_m
    steady &= window_sum(_climbs(motion, settings).astype(np.float64), half) == 0
    standing = window_sum(steady.astype(np.float64), half) > 0
    return [
        _Stop(
            start,
            end,
            float(np.nanmean(motion.roll_deg[start:end])),
            float(np.nanmean(motion.pitch_deg[start:end])),
            known_mean(motion.all_altitudes_m[:, start:end]),
        )
        for start, end in runs(standing)
    ]


def _scatter_about_line(values: FloatArray, half: int) -> FloatArray:
    """Return the standard deviation about the straight line through each centred window.

    It is infinite where data lack.
    """
    known = np.isfinite(values)
    complete = window_sum(known.astype(np.float64), half) == 2 * half + 1
    level = float(np.mean(values[known])) if known.any() else 0.0
    centred = np.where(known, values - level, 0.0)  # small numbers: cumulative sums lose no digits
    count = 2 * half + 1
    row = np.arange(len(values), dtype=np.float64)
    mean = window_sum(centred, half) / count
    moment = window_sum(centred * row, half) - row * mean * count  # about the middle of each window
    line = moment**2 / (count * (count**2 - 1) / 12.0)
    variance = (window_sum(centred**2, half) - count * mean**2 - line) / count
    return np.where(complete, np.sqrt(np.maximum(variance, 0.0)), np.inf)


def _altitude_change_m(motion: Motion, half: int) -> tuple[FloatArray, FloatArray]:
    """Return the altitude change across the centred window, and the distance travelled in it.

    The change is the largest of the sources.
    """
    row = np.arange(len(motion))
    before, after = np.maximum(row - half, 0), np.minimum(row + half, len(motion) - 1)
    smooth = running_mean(motion.all_altitudes_m, 1.0)
    change = largest_over_sources(np.abs(smooth[:, after] - smooth[:, before]))
    return change, motion.path_m[after] - motion.path_m[before]


def _climbs(motion: Motion, settings: GroundSettings) -> BoolArray:
    """Tell where a logged upward speed is more than ground allows."""
    sloping = settings.slope * motion.speed_mps
    fast = np.abs(running_mean(motion.climb_mps, 1.5)) > settings.climb_mps + sloping
    lasting = np.abs(running_mean(motion.climb_mps, 0.5 * settings.climb_window_s)) > settings.drift_mps + sloping
    return np.asarray(np.any(fast | lasting, axis=0))


def _ground_spread_m(distance_m: FloatArray, elapsed_s: FloatArray, settings: GroundSettings) -> FloatArray:
    """Return the largest difference that two altitudes on one ground may read."""
    drift = np.minimum(settings.altitude_drift_mps * elapsed_s, settings.altitude_drift_m)
    return np.asarray(settings.altitude_noise_m + settings.slope * distance_m + drift)


def _without_hovers(motion: Motion, stops: list[_Stop], settings: GroundSettings) -> list[_Stop]:
    """Drop standstills that lie above another one by more than ground can.

    The lower one is the ground.
    """

    def is_above(high: _Stop, low: _Stop) -> bool:
        elapsed = max(high.start - low.end, low.start - high.end, 0) / RATE_HZ
        distance = motion.distance_m(np.array(low.middle), np.array([high.middle]))
        height = np.fmin.reduce(high.altitude_m - low.altitude_m)
        return bool(height > _ground_spread_m(distance, np.array(elapsed), settings)[0])

    return [stop for stop in stops if not any(is_above(stop, other) for other in stops if other is not stop)]


def _height_above_ground_m(motion: Motion, stops: list[_Stop], settings: GroundSettings) -> FloatArray:
    """Return the height above the highest that ground can be, shape (n,).

    Every source is compared with the standstill before or after.
    """
    starts = np.array([stop.start for stop in stops])
    row = np.arange(len(motion))
    before = np.searchsorted(starts, row, side="right") - 1
    reference = np.array([stop.altitude_m for stop in stops]).T  # (sources, stops)
    middle = np.array([stop.middle for stop in stops])
    smooth = running_mean(motion.all_altitudes_m, 1.0)
    highest = np.full(len(motion), -np.inf)
    for neighbour in (before, before + 1):
        exists = (neighbour >= 0) & (neighbour < len(stops))
        stop = np.clip(neighbour, 0, len(stops) - 1)
        height = np.fmin.reduce(smooth - reference[:, stop], axis=0)
        distance = motion.distance_m(middle[stop], slice(None))
        spread = _ground_spread_m(distance, np.abs(row - middle[stop]) / RATE_HZ, settings)
        highest = np.where(exists, np.fmax(highest, height - spread), highest)
    return highest


def lasting(mask: BoolArray, least_s: float) -> BoolArray:
    """Return the runs of a mask that last so long."""
    out = mask.copy()
    for start, end in runs(mask):
        if end - start < least_s * RATE_HZ:
            out[start:end] = False
    return out


def _rolls(motion: Motion, limit_mps: float, settings: GroundSettings) -> BoolArray:
    """Tell where the motion could be that of something rolling.

    It is slow enough, level, and does not sway on the spot.
    """
    change, travelled = _altitude_change_m(motion, round(0.5 * settings.climb_window_s * RATE_HZ))
    is_level = change <= settings.climb_m + settings.slope * travelled
    half = round(0.5 * settings.standstill_s * RATE_HZ)
    hovers = _is_slow_throughout(motion, half, settings)
    hovers &= _tilt_scatter_deg(motion, half) > settings.swaying_tilt_deg
    return np.asarray((motion.speed_mps <= limit_mps) & is_level & ~hovers & ~_climbs(motion, settings))


def _extend(
    ground: BoolArray, motion: Motion, stop: _Stop, rows: slice, settings: GroundSettings, *, is_learnt: bool
) -> None:
    """Mark the rows around a standstill that continue it on the ground.

    They stay within its run of allowed rows.
    """
    row = np.arange(rows.start, rows.stop)
    height = largest_over_sources(np.abs(running_mean(motion.all_altitudes_m[:, rows], 1.0) - stop.altitude_m[:, None]))
    elapsed = np.maximum(np.maximum(stop.start - row, row - (stop.end - 1)), 0) / RATE_HZ
    distance = motion.distance_m(np.full(len(row), stop.middle), rows)
    fits = height <= _ground_spread_m(distance, elapsed, settings)
    fits &= np.abs(running_mean(motion.roll_deg[rows], 0.5) - stop.roll_deg) <= settings.tilt_deg
    fits &= np.abs(running_mean(motion.pitch_deg[rows], 0.5) - stop.pitch_deg) <= settings.tilt_deg
    fits[stop.start - rows.start : stop.end - rows.start] = True
    first, last = next(run for run in runs(fits) if run[0] <= stop.start - rows.start < run[1])
    first, last = first + rows.start, last + rows.start
    first = _kept_end(motion, first, stop.start, -1, settings, is_learnt=is_learnt)
    last = _kept_end(motion, last - 1, stop.end - 1, 1, settings, is_learnt=is_learnt)
    ground[first : last + 1] = True


def _kept_end(
    motion: Motion, end: int, standstill: int, step: int, settings: GroundSettings, *, is_learnt: bool
) -> int:
    """Return the last row that is kept of a stretch from ``standstill`` to ``end``.

    ``step`` is +1 or -1. Where the motion itself ended it, this may have been a lift-off or touch-down, and the largest
    speed up to a climb window past it a flying speed: whatever came near it without slowing down in between may have
    been in the air. Where data ended the same is feared of the speed before, unless flying speeds are learnt from the
    log and bound it already. A standstill that lasts to the end of data is kept whole.
    """
    window = round(settings.climb_window_s * RATE_HZ)
    beyond = [row for row in range(end + step, end + step * (1 + window), step) if 0 <= row < len(motion)]
    is_end_of_data = not beyond or not _are_complete(motion, beyond[: window // 2 + 1])
    if is_end_of_data and end == standstill:
        return end
    if not (is_end_of_data and is_learnt):
        inside = range(max(end - window, 0), min(end + window, len(motion))) if is_end_of_data else [end]
        fast = settings.lift_off_share * float(np.fmax.reduce(motion.speed_mps[[*inside, *beyond]]))
        while end != standstill and motion.speed_mps[end] > max(fast, WALKING_MPS):
            end -= step
    return end - step * round(settings.margin_s * RATE_HZ)


def _are_complete(motion: Motion, rows: list[int]) -> bool:
    known = np.isfinite([motion.speed_mps[rows], motion.roll_deg[rows], motion.pitch_deg[rows]])
    return bool(known.all() and np.isfinite(motion.all_altitudes_m[:, rows]).any(axis=0).all())
