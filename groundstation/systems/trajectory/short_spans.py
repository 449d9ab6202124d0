"""Short spans of dead reckoning: increments of a unit beside changes of GNSS velocity.

Over a span the unit's own gyros carry its specific force into the axes that the case had at the start; GNSS gives the
same changes of velocity in north, east and down. One rotation makes them agree if the unit is right-handed, its gyros
turn about the axes of its accelerometers, and it is on the vehicle that GNSS is on, however the case stands. A turn of
the axes of the gyros against those of the accelerometers, a mirrored axis or wrong units leave a misfit.
"""

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.dataclasses import dataclass
from groundstation.base.geodesy import north_east_m
from groundstation.base.records import Int64Array
from groundstation.base.units import MPS2_PER_G
from groundstation.systems.trajectory.inputs import GnssFixes, ImuIncrements
from groundstation.systems.trajectory.mounting_settings import MountingSettings

FIX_GAP_STEPS = 1.6  # of the usual step: a longer one ends a span
IMU_GAP_S, IMU_GAP_INTERVALS = 0.2, 3.5
QUIET_MPS2 = 0.3
FEWEST_QUIET = 5


@dataclass(frozen=True)
class Steps:
    """Steps between fixes of GNSS about a second apart, with the means of the unit over each.

    Parameters
    ----------
    start_s, end_s : ndarrays, shape (n,)
    change_mps : ndarray, shape (n, 3)
        Of velocity, north, east, down.
    velocity_mps : ndarray, shape (n, 3)
        Mean of both ends.
    turned_rad : ndarray, shape (n,)
        Change of track, to the right; NaN where too slow to have one.
    rate_radps, force_mps2 : ndarrays, shape (n, 3)
        Means of the unit in the axes of its case; NaN where it has a gap.
    by_positions : bool
        The receiver has no velocities; those of its positions are smoothed noise as much as motion.
    """

    start_s: FloatArray
    end_s: FloatArray
    change_mps: FloatArray
    velocity_mps: FloatArray
    turned_rad: FloatArray
    rate_radps: FloatArray
    force_mps2: FloatArray
    by_positions: bool = False

    def __len__(self) -> int:
        return len(self.start_s)

    @property
    def length_s(self) -> FloatArray:
        """Length of each step."""
        return self.end_s - self.start_s

    @property
    def acceleration_mps2(self) -> FloatArray:
        """Mean acceleration by GNSS, north, east, down."""
        return self.change_mps / self.length_s[:, None]

    @property
    def speed_mps(self) -> FloatArray:
        """Ground speed."""
        return np.hypot(self.velocity_mps[:, 0], self.velocity_mps[:, 1])


class Sums:
    """Running sums of increments, to be read at any time: no vibration is aliased."""

    def __init__(self, imu: ImuIncrements, bias_radps: FloatArray | None = None) -> None:
        angle = (
            imu.delta_angle_rad if bias_radps is None else imu.delta_angle_rad - bias_radps * imu.interval_s[:, None]
        )
        zero = np.zeros((1, 3))
        self.time_s = np.concatenate([imu.time_s[:1] - imu.interval_s[:1], imu.time_s])
        self.angle_rad = np.concatenate([zero, np.cumsum(angle, axis=0)])
        self.velocity_mps = np.concatenate([zero, np.cumsum(imu.delta_velocity_mps, axis=0)])
        usual = float(np.median(imu.interval_s))
        gaps = np.diff(self.time_s) > max(IMU_GAP_S, IMU_GAP_INTERVALS * usual)
        self._gaps_before = np.concatenate([[0], np.cumsum(gaps)])

    def between(self, start_s: FloatArray, end_s: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return angle and velocity gathered between times; NaN across a gap or outside."""
        whole = self.is_whole(start_s, end_s)[..., None]
        angle, velocity = (
            self.at(end_s, sums) - self.at(start_s, sums) for sums in (self.angle_rad, self.velocity_mps)
        )
        return np.where(whole, angle, np.nan), np.where(whole, velocity, np.nan)

    def at(self, time_s: FloatArray, sums: FloatArray) -> FloatArray:
        """Return sums at times, shape (..., 3)."""
        return np.stack([np.interp(time_s, self.time_s, sums[:, k]) for k in range(3)], axis=-1)

    def is_whole(self, start_s: FloatArray, end_s: FloatArray) -> FloatArray:
        """Tell whether the unit has no gap between two times."""
        first = np.searchsorted(self.time_s, start_s, side="right") - 1
        last = np.searchsorted(self.time_s, end_s, side="left")
        inside = (first >= 0) & (last < len(self.time_s))
        last = np.minimum(last, len(self.time_s) - 1)
        found: FloatArray = inside & (self._gaps_before[last] == self._gaps_before[np.maximum(first, 0)])
        return found


def steps_of(imu: ImuIncrements, gnss: GnssFixes, settings: MountingSettings) -> Steps:
    """Return the steps of a log; those of GNSS that lost fixes are left out.

    A receiver without a vertical velocity is taken to stay level; one without velocities has those of its positions.
    """
    time_s, velocity = _velocities(gnss, settings.step_s)
    length_s = np.diff(time_s)
    longest_s = FIX_GAP_STEPS * max(settings.step_s, float(np.median(length_s)) if len(length_s) else 0.0)
    fits = length_s <= min(longest_s, 2.0 * FIX_GAP_STEPS * settings.step_s)
    start, end = velocity[:-1][fits], velocity[1:][fits]
    start_s, end_s = time_s[:-1][fits], time_s[1:][fits]
    cross = start[:, 0] * end[:, 1] - start[:, 1] * end[:, 0]
    turned = np.arctan2(cross, (start[:, :2] * end[:, :2]).sum(axis=1))
    slow = np.minimum(np.hypot(*start[:, :2].T), np.hypot(*end[:, :2].T)) < 1.0
    angle, gathered = Sums(imu).between(start_s, end_s)
    each_s = (end_s - start_s)[:, None]
    return Steps(
        start_s,
        end_s,
        end - start,
        0.5 * (start + end),
        np.where(slow, np.nan, turned),
        angle / each_s,
        gathered / each_s,
        not np.isfinite(gnss.velocity_mps[:, :2]).all(axis=1).any(),
    )


def _velocities(gnss: GnssFixes, step_s: float) -> tuple[FloatArray, FloatArray]:
    """Return times about a step apart, and velocities at them."""
    known = np.flatnonzero(np.isfinite(gnss.velocity_mps[:, :2]).all(axis=1))
    chosen = known[_thinned(gnss.time_s[known], step_s)]
    if len(chosen):
        return gnss.time_s[chosen], np.nan_to_num(gnss.velocity_mps[chosen])
    placed = np.flatnonzero(np.isfinite(gnss.latitude_deg) & np.isfinite(gnss.longitude_deg))
    chosen = placed[_thinned(gnss.time_s[placed], step_s)]
    if len(chosen) < 3:
        return np.zeros(0), np.zeros((0, 3))
    latitude, longitude, time_s = gnss.latitude_deg[chosen], gnss.longitude_deg[chosen], gnss.time_s[chosen]
    north, east = north_east_m(latitude, longitude, float(latitude[0]), float(longitude[0]))
    place = np.column_stack([north, east, np.zeros(len(chosen))])
    return time_s[1:-1], (place[2:] - place[:-2]) / (time_s[2:] - time_s[:-2])[:, None]


def _thinned(time_s: FloatArray, step_s: float) -> Int64Array:
    """Return places of times at least about a step apart."""
    if not len(time_s):
        return np.zeros(0, dtype=np.int64)
    bins = np.floor((time_s - time_s[0]) / step_s + 0.25)
    return np.flatnonzero(np.concatenate([[True], np.diff(bins) > 0])).astype(np.int64)


def resting_rate_radps(steps: Steps) -> FloatArray:
    """Return what the gyros show while nothing accelerates; zeros where that never is.

    It is their error: at rest and in steady travel nothing turns for long.
    """
    calm = np.linalg.norm(steps.acceleration_mps2[:, :2], axis=1) < QUIET_MPS2
    calm &= np.isfinite(steps.rate_radps).all(axis=1)
    calm[1:-1] &= calm[:-2] & calm[2:]
    if calm.sum() < FEWEST_QUIET:
        return np.zeros(3)
    found: FloatArray = np.median(steps.rate_radps[calm], axis=0)
    return found


@dataclass(frozen=True)
class Spans:
    """Spans of equal numbers of steps.

    Parameters
    ----------
    first : ndarray of int, shape (s,)
        Place of the first step of each.
    wanted_mps : ndarray, shape (s, m, 3)
        Integral of specific force over each step by GNSS, north, east, down.
    velocity_mps : ndarray, shape (s, m, 3)
    node_s : ndarray, shape (s, m + 1)
        Ends of the steps.
    """

    first: Int64Array
    wanted_mps: FloatArray
    velocity_mps: FloatArray
    node_s: FloatArray

    def __len__(self) -> int:
        return len(self.first)


def spans_of(steps: Steps, sums: Sums, settings: MountingSettings) -> Spans:
    """Return the spans with the most motion, without gaps of GNSS or of the unit."""
    count = settings.steps
    acceleration = steps.acceleration_mps2
    chosen: list[tuple[float, int]] = []
    place = 0
    while place + count <= len(steps):
        part = slice(place, place + count)
        joined = np.abs(steps.start_s[part][1:] - steps.end_s[part][:-1]) < 1e-6
        if not joined.all():
            place += int(np.flatnonzero(~joined)[-1]) + 1
            continue
        reach = settings.lag_max_s + 0.1
        is_whole = sums.is_whole(steps.start_s[[place]] - reach, steps.end_s[[place + count - 1]] + reach)[0]
        motion = float(np.sqrt(np.mean((acceleration[part, :2] ** 2).sum(axis=1))))
        if is_whole and motion >= settings.motion_min_mps2:
            chosen.append((motion, place))
        place += count
    kept = sorted(place for _, place in sorted(chosen, reverse=True)[: settings.spans_max])
    first = np.array(kept, dtype=np.int64)
    index = first[:, None] + np.arange(count)[None, :]
    wanted = steps.change_mps[index]
    wanted[..., 2] -= MPS2_PER_G * steps.length_s[index]
    node_s = np.concatenate([steps.start_s[index], steps.end_s[index[:, -1:]]], axis=1)
    return Spans(first, wanted, steps.velocity_mps[index], node_s)
