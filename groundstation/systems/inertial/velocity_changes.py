"""Changes of velocity of a flight, and what each azimuth parameter does to their errors."""

from dataclasses import replace

import numpy as np

from groundstation.base.dataclasses import dataclass
from groundstation.base.records import BoolArray, Int64Array
from groundstation.base.toml_settings import check_ranges, number
from groundstation.systems.inertial.differences import InsDifferences
from groundstation.systems.inertial.model import FloatArray
from groundstation.tables.motion import runs

PARAMETERS = ("azimuth", "azimuth_drift", "latency", "scale", "bias_forward", "bias_right")
AZIMUTH, AZIMUTH_DRIFT, LATENCY, SCALE, BIAS_FORWARD, BIAS_RIGHT = range(6)


@dataclass(frozen=True)
class AzimuthLimits:
    """Limits of what counts as a change of velocity, and how many are asked for.

    ``average_s``: GNSS and INS are averaged so long before and after each. An epoch is in a manoeuvre where the
    acceleration over ``smooth_s`` exceeds ``acceleration_mps2``; manoeuvres longer than ``longest_s`` are cut.
    ``latency_s`` and ``scale``: how large the time offset between GNSS and INS and the scale error of the
    accelerometers may be (sigmas). ``opposed_share``: length of the mean of the directions of change above which they
    all point one way. ``sigma_scale``: what the sigma is multiplied by for all that the regression leaves out (Earth's
    rotation between the channels, gyro errors excited by the turns), found on simulated flights.
    """

    average_s: float = number(10.0, 0.1, 600.0)
    smooth_s: float = number(6.0, 0.1, 60.0)
    acceleration_mps2: float = number(0.3, 0.0, 100.0)
    change_mps: float = number(10.0, 0.1, 1000.0)
    longest_s: float = number(120.0, 1.0, 3600.0)
    least_changes: int = number(3, 1, 1000)
    opposed_share: float = number(0.9, 0.0, 1.0)
    latency_s: float = number(0.3, 0.0, 10.0)
    scale: float = number(1e-3, 0.0, 1.0)
    sigma_scale: float = number(1.3, 0.1, 10.0)

    def __post_init__(self) -> None:
        check_ranges(self)


@dataclass(frozen=True)
class Changes:
    """Changes of velocity, m of them, between the mean of some seconds before and after.

    Parameters
    ----------
    before, after : ndarrays of int, shape (m, 2)
        Epochs averaged, half-open.
    known : ndarray of bool, shape (n,)
        Epochs that count in an average.
    before_s, after_s : ndarrays, shape (m,)
        Mean times.
    velocity_mps : ndarray, shape (m, 2)
        Change of the INS velocity, north and east.
    columns : ndarray, shape (m, 2, 6)
        What a unit of each of :data:`PARAMETERS` does to the change of velocity error.
    """

    before: Int64Array
    after: Int64Array
    known: BoolArray
    before_s: FloatArray
    after_s: FloatArray
    velocity_mps: FloatArray
    columns: FloatArray

    def __len__(self) -> int:
        return len(self.before_s)

    def point_one_way(self, limits: AzimuthLimits) -> bool:
        """Tell whether all have nearly the same direction.

        An azimuth then looks like a scale error.
        """
        unit = self.velocity_mps / np.hypot(*self.velocity_mps.T)[:, None]
        return bool(np.hypot(*unit.mean(axis=0)) > limits.opposed_share)

    def first(self, span_s: float) -> "Changes":
        """Return those whose middle is within some seconds of the first one's."""
        middle_s = 0.5 * (self.before_s + self.after_s)
        count = int(np.sum(middle_s <= middle_s[0] + span_s))
        columns = np.array(self.columns[:count])
        columns[:, :, AZIMUTH_DRIFT] += columns[:, :, AZIMUTH] * (middle_s[-1] - middle_s[count - 1])
        return replace(
            self,
            before=self.before[:count],
            after=self.after[:count],
            before_s=self.before_s[:count],
            after_s=self.after_s[:count],
            velocity_mps=self.velocity_mps[:count],
            columns=columns,
        )

    @property
    def reference_s(self) -> float:
        """Time the azimuth belongs to: the middle of the last change."""
        return float(0.5 * (self.before_s[-1] + self.after_s[-1]))


def changes_of(differences: InsDifferences, known: BoolArray, limits: AzimuthLimits) -> Changes:
    """Find the changes of velocity of a flight.

    ``known`` (n,) says where INS and GNSS velocities are compared.
    """
    pieces = [
        piece
        for piece in _manoeuvres(differences, limits)
        if np.hypot(*(differences.velocity_mps[piece[1]] - differences.velocity_mps[piece[0]])) >= limits.change_mps
    ]
    return _changes_between(differences, known, np.array(pieces, dtype=np.int64).reshape(-1, 2), limits)


def quiet_intervals(differences: InsDifferences, known: BoolArray, limits: AzimuthLimits) -> Changes:
    """Find stretches without a manoeuvre, as long as the manoeuvres may be.

    Nothing but noise changes across them.
    """
    time_s = differences.epochs.time_s
    busy = _is_manoeuvring(differences, limits)
    pieces, reach = [], limits.average_s + 0.5 * limits.longest_s
    for first, end in runs(~busy):
        start = time_s[first] + limits.average_s
        while start + reach <= time_s[end - 1]:
            pieces.append(np.searchsorted(time_s, [start, start + 0.5 * limits.longest_s]))
            start += reach
    return _changes_between(differences, known, np.array(pieces, dtype=np.int64).reshape(-1, 2), limits)


def turned(vectors: FloatArray) -> FloatArray:
    """Turn horizontal vectors (..., 2) by 90 deg clockwise: what a unit of azimuth error adds."""
    return np.stack([-vectors[..., 1], vectors[..., 0]], axis=-1)


def _is_manoeuvring(differences: InsDifferences, limits: AzimuthLimits) -> BoolArray:
    """Tell where the INS velocity changes, shape (n,)."""
    time_s, velocity = differences.epochs.time_s, differences.velocity_mps
    half = 0.5 * limits.smooth_s
    early = np.maximum(np.searchsorted(time_s, time_s - half - 1e-6), 0)
    late = np.minimum(np.searchsorted(time_s, time_s + half - 1e-6), len(time_s) - 1)
    seconds = np.maximum(time_s[late] - time_s[early], 1e-6)
    change = np.nan_to_num(np.hypot(*(velocity[late] - velocity[early]).T))
    return np.asarray(change > limits.acceleration_mps2 * seconds)


def _manoeuvres(differences: InsDifferences, limits: AzimuthLimits) -> list[tuple[int, int]]:
    """Return first and last epoch of each manoeuvre.

    Those with no room for averages in between are one.
    """
    time_s = differences.epochs.time_s
    joined: list[list[int]] = []
    for first, end in runs(_is_manoeuvring(differences, limits)):
        last = end - 1
        if joined and time_s[first] - time_s[joined[-1][1]] < 2.0 * limits.average_s:
            joined[-1][1] = last
        else:
            joined.append([first, last])
    out = []
    for first, last in joined:
        parts = max(1, int(np.ceil((time_s[last] - time_s[first]) / limits.longest_s)))
        edges = np.searchsorted(time_s, np.linspace(time_s[first], time_s[last], parts + 1) - 1e-6)
        out += list(zip(edges[:-1].tolist(), edges[1:].tolist(), strict=True))
    return out


def _changes_between(
    differences: InsDifferences, known: BoolArray, pieces: Int64Array, limits: AzimuthLimits
) -> Changes:
    """Return the changes across pieces (m, 2) of epochs.

    Those without GNSS for half of either average, or with a reset, are left out.
    """
    epochs, velocity = differences.epochs, _filled(differences.epochs.time_s, differences.velocity_mps)
    time_s = epochs.time_s
    start, end = time_s[pieces].T
    before = np.searchsorted(time_s, np.stack([start - limits.average_s - 1e-6, start + 1e-6], axis=1))
    after = np.searchsorted(time_s, np.stack([end - 1e-6, end + limits.average_s + 1e-6], axis=1))
    least = 0.5 * limits.average_s / epochs.interval_s
    resets = _sums(epochs.is_reset.astype(np.float64)[:, None])[:, 0]
    keep = resets[after[:, 1]] == resets[before[:, 0]]
    for part in (before, after):
        keep &= count_known(part, known) >= least
    before, after = before[keep], after[keep]
    mean_s, mean_velocity, mean_acceleration = (
        tuple(mean_known(part, values, known) for part in (before, after))
        for values in (time_s[:, None], velocity, _slopes(time_s, velocity))
    )
    change, middle_s = mean_velocity[1] - mean_velocity[0], 0.5 * (mean_s[0] + mean_s[1])
    columns = np.zeros((len(before), 2, len(PARAMETERS)))
    columns[:, :, AZIMUTH] = turned(change)
    columns[:, :, AZIMUTH_DRIFT] = turned(change) * (middle_s - middle_s[-1:])
    columns[:, :, LATENCY] = mean_acceleration[1] - mean_acceleration[0]
    columns[:, :, SCALE] = change
    columns[:, :, BIAS_FORWARD] = _turned_bias(time_s, velocity, before, after, known)
    columns[:, :, BIAS_RIGHT] = turned(columns[:, :, BIAS_FORWARD])
    return Changes(before, after, known, mean_s[0][:, 0], mean_s[1][:, 0], change, columns)


def _turned_bias(
    time_s: FloatArray, velocity: FloatArray, before: Int64Array, after: Int64Array, known: BoolArray
) -> FloatArray:
    """Return the change of velocity error by a unit of forward bias, shape (m, 2).

    The bias was levelled away on the track before.
    """
    speed = np.hypot(*velocity.T)
    still = 1.0  # m/s; slower than this the track says nothing of the heading
    ahead = np.where((speed > still)[:, None], velocity / np.maximum(speed, still)[:, None], np.nan)
    ahead = _filled(time_s, ahead)
    gathered = np.cumsum(ahead * np.diff(time_s, prepend=time_s[:1])[:, None], axis=0)
    both = np.column_stack([gathered, time_s])
    grown = mean_known(after, both, known) - mean_known(before, both, known)
    return np.asarray(grown[:, :2] - grown[:, 2:] * mean_known(before, ahead, known))


def _slopes(time_s: FloatArray, values: FloatArray) -> FloatArray:
    return np.asarray(np.gradient(values, time_s, axis=0)) if len(time_s) > 1 else np.zeros_like(values)


def _sums(values: FloatArray) -> FloatArray:
    """Sums of the rows before each, shape (n + 1, c)."""
    return np.concatenate([np.zeros_like(values[:1]), np.cumsum(values, axis=0)])


def _filled(time_s: FloatArray, columns: FloatArray) -> FloatArray:
    """Columns (n, c) with straight lines over what is unknown, zero where nothing is known."""
    out = np.zeros_like(columns)
    for index in range(columns.shape[1]):
        known = np.isfinite(columns[:, index])
        if known.any():
            out[:, index] = np.interp(time_s, time_s[known], columns[known, index])
    return out


def count_known(ranges: Int64Array, known: BoolArray) -> FloatArray:
    """Known rows in each half-open range (m, 2), shape (m,)."""
    total = _sums(known.astype(np.float64)[:, None])[:, 0]
    return np.asarray(total[ranges[:, 1]] - total[ranges[:, 0]])


def mean_known(ranges: Int64Array, values: FloatArray, known: BoolArray) -> FloatArray:
    """Means of the known rows of values (n, c) in half-open ranges (m, 2), shape (m, c)."""
    total = _sums(np.where(known[:, None], values, 0.0))
    return np.asarray(
        (total[ranges[:, 1]] - total[ranges[:, 0]]) / np.maximum(count_known(ranges, known), 1.0)[:, None]
    )
