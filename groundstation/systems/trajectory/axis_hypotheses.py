"""Explanations of a unit's increments by turned, mirrored and scaled axes.

They are ranked by how well GNSS agrees.

For each turn G of the gyros against the accelerometers, and for each lag, the specific force is carried through the
span with rates G w; u are its changes of velocity in the axes of the start. The rotation that brings u nearest to
GNSS's changes b is that of Wahba's problem; the misfit is sum |b|^2 + sum |u|^2 - 2 (s1 + s2 + d s3), with the
singular values s of sum b u' and d the sign of its determinant; with -d for left-handed axes.

Source: Markley, Attitude determination using vector observations and the singular value decomposition, 1988.
"""

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.dataclasses import dataclass
from groundstation.base.records import Int64Array
from groundstation.systems.trajectory.axis_turns import axis_turns
from groundstation.systems.trajectory.mounting_settings import MountingSettings
from groundstation.systems.trajectory.short_spans import Spans, Sums

DEG_PER_RAD = 180.0 / np.pi
SCALES = (1.0, 1.0 / DEG_PER_RAD, DEG_PER_RAD)
SHIFTS = 20


@dataclass(frozen=True)
class Explanation:
    """One explanation of the increments, at the lag that suits it best.

    Parameters
    ----------
    gyro_turn : ndarray, shape (3, 3)
        Applied to the rates; the identity where gyros and accelerometers share their axes.
    is_right_handed : bool
        Of the accelerometers' axes.
    scale : float
        Applied to the rates: 1/57.3 where they are logged in degrees as radians.
    lag_s : float
        GNSS is later than the unit by so much.
    log_likelihood : float
        Over the correlation factor.
    """

    gyro_turn: FloatArray
    is_right_handed: bool
    scale: float
    lag_s: float
    log_likelihood: float

    @property
    def is_sound(self) -> bool:
        """Tell whether the unit is as it should be."""
        return self.is_right_handed and self.scale == 1.0 and bool((self.gyro_turn == np.eye(3)).all())

    @property
    def turns_alike(self) -> bool:
        """Tell whether gyros and accelerometers have one set of axes, whatever its hand."""
        sign = 1.0 if self.is_right_handed else -1.0
        return bool((self.gyro_turn == sign * np.eye(3)).all())


@dataclass(frozen=True)
class Carried:
    """Attitude, and sums of its products with the force, over each span.

    They are on an even grid of times.

        Parameters
        ----------
        start_s : ndarray, shape (s,)
        step_s : float
        attitude : ndarray, shape (s, k, 3, 3)
            Start axes from the axes of the case, at the times start_s + k step_s.
        products_mps : ndarray, shape (s, k, 3, 3, 3)
            Sum of attitude[i, j] times increment of velocity[l].
    """

    start_s: FloatArray
    step_s: float
    attitude: FloatArray
    products_mps: FloatArray

    def products_at(self, time_s: FloatArray) -> FloatArray:
        """Return the products at times, shape (s, n) to (s, n, 3, 3, 3)."""
        place = np.clip((time_s - self.start_s[:, None]) / self.step_s, 0.0, self.products_mps.shape[1] - 1.000001)
        low = place.astype(np.int64)
        part = (place - low)[..., None, None, None]
        rows = np.arange(len(self.start_s))[:, None]
        found: FloatArray = self.products_mps[rows, low] * (1.0 - part) + self.products_mps[rows, low + 1] * part
        return found

    def attitude_at(self, time_s: FloatArray) -> FloatArray:
        """Return the attitude at the nearest times of the grid, shape (s, n, 3, 3)."""
        place = np.rint((time_s - self.start_s[:, None]) / self.step_s).astype(np.int64)
        rows = np.arange(len(self.start_s))[:, None]
        found: FloatArray = self.attitude[rows, np.clip(place, 0, self.attitude.shape[1] - 1)]
        return found


def carry(spans: Spans, sums: Sums, settings: MountingSettings, scale: float = 1.0) -> Carried:
    """Carry attitude and force through every span, with rates times a scale."""
    reach, step = settings.lag_max_s + 0.1, settings.imu_step_s
    longest = float((spans.node_s[:, -1] - spans.node_s[:, 0]).max())
    count = int(np.ceil((longest + 2.0 * reach) / step)) + 1
    start_s = spans.node_s[:, 0] - reach
    times = start_s[:, None] + step * np.arange(count + 1)
    turned = scale * np.diff(sums.at(times, sums.angle_rad), axis=1)
    gathered = np.diff(sums.at(times, sums.velocity_mps), axis=1)
    attitude = np.empty((len(spans), count + 1, 3, 3))
    products = np.zeros((len(spans), count + 1, 3, 3, 3))
    attitude[:, 0] = np.eye(3)
    halves = rotations(0.5 * turned)
    for k in range(count):
        middle = attitude[:, k] @ halves[:, k]
        products[:, k + 1] = products[:, k] + middle[..., None] * gathered[:, k, None, None, :]
        attitude[:, k + 1] = middle @ halves[:, k]
    return Carried(start_s, step, attitude, products)


def rotations(vector_rad: FloatArray) -> FloatArray:
    """Return the rotations by rotation vectors, shape (..., 3) to (..., 3, 3).

    Examples
    --------
    >>> rotations(np.array([0.0, 0.0, np.pi / 2])).round(9)[:2, :2].tolist()
    [[0.0, -1.0], [1.0, 0.0]]
    """
    angle = np.linalg.norm(vector_rad, axis=-1)[..., None, None]
    x, y, z = np.moveaxis(vector_rad, -1, 0)
    zero = np.zeros_like(x)
    cross = np.stack([zero, -z, y, z, zero, -x, -y, x, zero], axis=-1).reshape(*x.shape, 3, 3)
    safe = np.where(angle > 1e-12, angle, 1.0)
    one = np.where(angle > 1e-12, np.sin(safe) / safe, 1.0)
    two = np.where(angle > 1e-12, (1.0 - np.cos(safe)) / safe**2, 0.5)
    found: FloatArray = np.eye(3) + one * cross + two * (cross @ cross)
    return found


def lags_of(settings: MountingSettings) -> FloatArray:
    """Return the lags that are tried."""
    count = round(settings.lag_max_s / settings.lag_step_s)
    lags: FloatArray = settings.lag_step_s * np.arange(-count, count + 1, dtype=np.float64)
    return lags


def ranked(spans: Spans, sums: Sums, settings: MountingSettings) -> tuple[Explanation, ...]:
    """Return every explanation, the likeliest first."""
    found: list[Explanation] = []
    for scale in SCALES:
        for sign in (1.0, -1.0):
            turns = axis_turns() if scale == 1.0 else axis_turns()[:1]
            carried = carry(spans, sums, settings, sign * scale)
            right, left = likelihoods(spans, moved(spans, carried, turns, settings), settings)
            for is_right, values in ((True, right), (False, left)):
                best = np.argmax(values, axis=1)
                for turn, lag, value in zip(turns, best, values.max(axis=1), strict=True):
                    found.append(Explanation(sign * turn, is_right, scale, float(lags_of(settings)[lag]), float(value)))
    return tuple(sorted(found, key=lambda one: -one.log_likelihood))


def moved(spans: Spans, carried: Carried, turns: FloatArray, settings: MountingSettings) -> FloatArray:
    """Return the changes of velocity in start axes, shape (turns, s, lags, m, 3)."""
    lags = lags_of(settings)
    times = (spans.node_s[:, None, :] - lags[:, None]).reshape(len(spans), -1)
    products = carried.products_at(times).reshape(len(spans), len(lags), -1, 3, 3, 3)
    found: FloatArray = np.einsum("snmijl,glj->gsnmi", np.diff(products, axis=2), turns, optimize=True)
    return found


def likelihoods(
    spans: Spans, changes_mps: FloatArray, settings: MountingSettings, order: Int64Array | None = None
) -> tuple[FloatArray, FloatArray]:
    """Return log-likelihoods for right-handed and left-handed axes, shape (turns, lags).

    The misfit of a span has an unknown scale of its own, above that of a good receiver: one bad span decides nothing.
    ``order`` pairs spans of the unit with other spans of GNSS.
    """
    free = 3 * spans.wanted_mps.shape[1] - 3
    right, left = (
        (-0.5 * free * np.log(misfit / free + settings.velocity_floor_mps**2)).sum(axis=1)
        for misfit in misfits(spans.wanted_mps if order is None else spans.wanted_mps[order], changes_mps)
    )
    return right / settings.correlation_factor, left / settings.correlation_factor


def misfits(wanted_mps: FloatArray, changes_mps: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the squared misfits of the best right- and left-handed rotation of each span.

    Parameters
    ----------
    wanted_mps : ndarray, shape (s, m, 3)
    changes_mps : ndarray, shape (turns, s, lags, m, 3)

    Returns
    -------
    two ndarrays, shape (turns, s, lags), m2/s2
    """
    inner = np.einsum("smi,gsnmj->gsnij", wanted_mps, changes_mps, optimize=True)
    size = (wanted_mps**2).sum(axis=(1, 2))[None, :, None] + (changes_mps**2).sum(axis=(3, 4))
    values = np.linalg.svd(inner, compute_uv=False)
    last = values[..., 2] * np.sign(np.linalg.det(inner))
    both = size - 2.0 * (values[..., 0] + values[..., 1])
    return np.maximum(both - 2.0 * last, 0.0), np.maximum(both + 2.0 * last, 0.0)


@dataclass(frozen=True)
class Relation:
    """Relation of a unit with GNSS under one explanation.

    Parameters
    ----------
    over_others : float
        Log-likelihood over the best one with spans of the unit paired with other spans of GNSS.
    unexplained : float
        Squared misfit over the variance of the changes of velocity of GNSS, median of the spans.
    misfit_mps : float
        RMS of a change of velocity, median of the spans.
    lag_is_inside : bool
        The best lag is none of the ends of those that were tried.
    """

    over_others: float
    unexplained: float
    misfit_mps: float
    lag_is_inside: bool

    def holds(self, settings: MountingSettings) -> bool:
        """Tell whether the unit moves as GNSS does.

        One on another vehicle does no better with its own times.
        """
        clear = self.over_others >= settings.over_others_clear
        most = settings.unexplained_clear_max if clear else settings.unexplained_max
        is_near = self.unexplained <= most and self.misfit_mps <= settings.misfit_max_mps
        return self.over_others >= settings.over_others_min and is_near and self.lag_is_inside


def relation_of(spans: Spans, sums: Sums, settings: MountingSettings, one: Explanation) -> Relation:
    """Return how an explanation does against other times, and what it leaves unexplained."""
    sign = float(np.sign(np.linalg.det(one.gyro_turn)))
    carried = carry(spans, sums, settings, sign * one.scale)
    changes = moved(spans, carried, sign * one.gyro_turn[None], settings)
    hand = 0 if one.is_right_handed else 1
    best, count = -np.inf, len(spans)
    for shift in np.unique(np.linspace(1, count - 1, min(SHIFTS, count - 1)).astype(np.int64)):
        best = max(best, float(likelihoods(spans, changes, settings, (np.arange(count) + shift) % count)[hand].max()))
    lag = int(np.argmin(np.abs(lags_of(settings) - one.lag_s)))
    misfit = misfits(spans.wanted_mps, changes)[hand][0, :, lag]
    spread = ((spans.wanted_mps - spans.wanted_mps.mean(axis=1, keepdims=True)) ** 2).sum(axis=(1, 2))
    return Relation(
        one.log_likelihood - best,
        float(np.median(misfit / spread)),
        float(np.sqrt(np.median(misfit) / (3 * spans.wanted_mps.shape[1] - 3))),
        settings.lag_max_s == 0.0 or abs(one.lag_s) < settings.lag_max_s - 0.5 * settings.lag_step_s,
    )


def attitudes(spans: Spans, carried: Carried, lag_s: float) -> FloatArray:
    """Return n from the axes of the case in the middle of each step, shape (s, m, 3, 3)."""
    nodes = carried.products_at(spans.node_s - lag_s)
    changes = np.einsum("smijj->smi", np.diff(nodes, axis=1))
    left, _, right = np.linalg.svd(np.einsum("smi,smj->sij", spans.wanted_mps, changes))
    fix = np.ones((len(spans), 3))
    fix[:, 2] = np.sign(np.linalg.det(left @ right))
    start = (left * fix[:, None, :]) @ right
    middle_s = 0.5 * (spans.node_s[:, 1:] + spans.node_s[:, :-1])
    found: FloatArray = start[:, None] @ carried.attitude_at(middle_s - lag_s)
    return found
