"""Azimuth (heading) error of an INS from what changes of velocity do to its velocity error.

An INS whose north is turned by a heading error psi (INS - truth, clockwise positive) turns every change of velocity by
psi: change of velocity error = psi x (-change east, +change north). Straight flight shows nothing of it.
"""

from dataclasses import dataclass, replace

import numpy as np

from groundstation.base.geodesy import EARTH_RATE_RADPS
from groundstation.base.quantiles import student_quantile
from groundstation.base.records import BoolArray, Int64Array
from groundstation.base.toml_settings import check_ranges, number
from groundstation.estimators.inertial.differences import Differences
from groundstation.estimators.inertial.filter import Epochs, FilterRun, run_filter
from groundstation.estimators.inertial.model import VELOCITY, FloatArray
from groundstation.estimators.inertial.noise import RADPS_PER_DPH
from groundstation.estimators.inertial.settings import InertialSettings
from groundstation.results.inertial import AzimuthEstimate, EarlyAzimuth
from groundstation.tables.motion import runs

PARAMETERS = ("azimuth", "azimuth_drift", "latency", "scale", "bias_forward", "bias_right")
AZIMUTH, AZIMUTH_DRIFT, LATENCY, SCALE, BIAS_FORWARD, BIAS_RIGHT = range(6)
ITERATIONS = 3  # what the filter had taken for tilt in earlier turns shrinks by ten or more each time
BOUND95 = 1.959963984540054
AZIMUTH_PRIOR_RAD = 1.0  # no knowledge
EARLY_S = 3600.0  # of turns that tell the azimuth on taxi: it oscillates over 24 h
S_PER_H, LEAST_PRODUCT = 3600.0, 1e-300


@dataclass(frozen=True)
class AzimuthLimits:
    """What counts as a change of velocity, and how many are asked for.

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
        """Whether all of them have nearly the same direction: an azimuth then looks like a scale error."""
        unit = self.velocity_mps / np.hypot(*self.velocity_mps.T)[:, None]
        return bool(np.hypot(*unit.mean(axis=0)) > limits.opposed_share)

    def first(self, span_s: float) -> "Changes":
        """Those whose middle is within some seconds of the first one's."""
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


@dataclass(frozen=True)
class AzimuthFit:
    """Parameters fitted (6,), their covariance (6, 6), residuals over their sigma (m, 2), degrees of freedom."""

    values: FloatArray
    covariance: FloatArray
    normalised: FloatArray
    freedom: float
    sigma_scale: float = 1.0

    @property
    def sigma_rad(self) -> float:
        """Sigma of the azimuth such that +- 1.96 sigma holds 95 %, widened where the residuals are too large.

        Scaled by sqrt(chi-square / degrees of freedom) where that exceeds one, and then by Student's quantile: the
        scatter of a few turns is itself uncertain.
        """
        return self.widening * float(np.sqrt(self.covariance[AZIMUTH, AZIMUTH]))

    @property
    def widening(self) -> float:
        """What the sigmas of the covariance are multiplied by."""
        spread = float(np.sum(np.square(self.normalised))) / self.freedom
        if spread <= 1.0:
            return self.sigma_scale
        return self.sigma_scale * float(np.sqrt(spread) * student_quantile(0.975, self.freedom)) / BOUND95


def estimate_azimuth(
    differences: Differences,
    run: FilterRun,
    settings: InertialSettings,
    *,
    limits: AzimuthLimits | None = None,
) -> AzimuthEstimate:
    """Estimate the azimuth error of an unaided INS, where turns make it observable.

    Parameters
    ----------
    differences : Differences
        With velocities of GNSS.
    run : FilterRun
        Of the separate channels: its model and its noise are used.
    settings : InertialSettings
        ``azimuth_sigma_max_deg``, ``gate_sigmas``.
    limits : AzimuthLimits, optional

    Returns
    -------
    AzimuthEstimate
        At the time of the last change of velocity, or why it is not observable.

    Notes
    -----
    The change of velocity error across each manoeuvre, less what the channel filter (on velocities alone) predicts from
    its state before it, is regressed on the change of the INS velocity turned by 90 deg. Beside the azimuth stand its
    drift, a time offset between GNSS and INS (difference = offset x acceleration), a scale error (along the change)
    and accelerometer biases that turn with the craft, each with a prior sigma. The variances come from the class's
    noise and the filter's covariance, enlarged where quiet stretches of the same flight scatter more, and once more
    where the turns do. The filter is run again with the azimuth found taken off, so that one turn does not
    spoil the prediction of the next.

    Source: Titterton and Weston, Strapdown Inertial Navigation Technology, 2nd ed. 2004, section 12.3 (azimuth error x
    specific force).
    """
    limits = limits or AzimuthLimits()
    both = np.concatenate([differences.epochs.velocity_mps, differences.velocity_mps], axis=1)
    known = np.asarray(np.isfinite(both).all(axis=1))
    if not known.any():
        return _refused(0, 0.0, "no velocity of both INS and GNSS")
    changes = changes_of(differences, known, limits)
    largest = float(np.hypot(*changes.velocity_mps.T).max()) if len(changes) else 0.0
    if len(changes) < limits.least_changes:
        return _refused(
            len(changes),
            largest,
            f"{len(changes)} turns or other changes of velocity of {limits.change_mps:g} m/s or more with GNSS on both "
            f"sides; at least {limits.least_changes} are needed",
        )
    if changes.point_one_way(limits):
        return _refused(len(changes), largest, "all changes of velocity point the same way")
    fit = fit_azimuth(differences, run, settings, changes, known, limits)
    error_deg, sigma_deg = (float(np.rad2deg(part)) for part in (fit.values[AZIMUTH], fit.sigma_rad))
    if not sigma_deg <= settings.azimuth_sigma_max_deg:
        text = f"sigma {sigma_deg:.2g} deg above the limit of {settings.azimuth_sigma_max_deg:g} deg"
        return AzimuthEstimate(False, None, sigma_deg, len(changes), largest, text)
    text = f"{len(changes)} changes of velocity of up to {largest:.0f} m/s"
    early = _early(differences, run, settings, changes, known, limits, fit)
    return AzimuthEstimate(True, error_deg, sigma_deg, len(changes), largest, text, changes.reference_s, early)


def _early(
    differences: Differences,
    run: FilterRun,
    settings: InertialSettings,
    changes: Changes,
    known: BoolArray,
    limits: AzimuthLimits,
    whole: AzimuthFit,
) -> EarlyAzimuth | None:
    """The azimuth from the first hour of changes; None where they are too few, or all point one way."""
    first = changes.first(EARLY_S)
    if len(first) < limits.least_changes or first.point_one_way(limits):
        return None
    is_whole = len(first) == len(changes)
    fit = whole if is_whole else fit_azimuth(differences, run, settings, first, known, limits)
    both = [AZIMUTH, AZIMUTH_DRIFT]
    sigma, rate_sigma = np.sqrt(np.diag(fit.covariance)[both])
    return EarlyAzimuth(
        error_deg=float(np.rad2deg(fit.values[AZIMUTH])),
        sigma_deg=float(np.rad2deg(fit.sigma_rad)),
        time_s=first.reference_s,
        rate_deg_per_h=float(np.rad2deg(fit.values[AZIMUTH_DRIFT])) * S_PER_H,
        rate_sigma_deg_per_h=float(np.rad2deg(fit.widening * rate_sigma)) * S_PER_H,
        correlation=float(fit.covariance[AZIMUTH, AZIMUTH_DRIFT] / max(sigma * rate_sigma, LEAST_PRODUCT)),
        turns=len(first),
    )


def changes_of(differences: Differences, known: BoolArray, limits: AzimuthLimits) -> Changes:
    """Find the changes of velocity of a flight; ``known`` (n,) says where INS and GNSS velocities are compared."""
    pieces = [
        piece
        for piece in _manoeuvres(differences, limits)
        if np.hypot(*(differences.velocity_mps[piece[1]] - differences.velocity_mps[piece[0]])) >= limits.change_mps
    ]
    return _changes_between(differences, known, np.array(pieces, dtype=np.int64).reshape(-1, 2), limits)


def quiet_intervals(differences: Differences, known: BoolArray, limits: AzimuthLimits) -> Changes:
    """Stretches without a manoeuvre, as long as the manoeuvres may be: nothing but noise changes across them."""
    time_s = differences.epochs.time_s
    busy = _is_manoeuvring(differences, limits)
    pieces, reach = [], limits.average_s + 0.5 * limits.longest_s
    for first, end in runs(~busy):
        start = time_s[first] + limits.average_s
        while start + reach <= time_s[end - 1]:
            pieces.append(np.searchsorted(time_s, [start, start + 0.5 * limits.longest_s]))
            start += reach
    return _changes_between(differences, known, np.array(pieces, dtype=np.int64).reshape(-1, 2), limits)


def fit_azimuth(
    differences: Differences,
    run: FilterRun,
    settings: InertialSettings,
    changes: Changes,
    known: BoolArray,
    limits: AzimuthLimits,
) -> AzimuthFit:
    """Fit :data:`PARAMETERS` to m >= 1 changes of velocity."""
    quiet = quiet_intervals(differences, known, limits)
    gyro = run.noise.drift_dph * RADPS_PER_DPH
    prior = np.array(
        [
            AZIMUTH_PRIOR_RAD,
            gyro,
            limits.latency_s,
            limits.scale,
            *[run.model.gravity_mps2 * run.noise.tilt_rad] * 2,
        ]
    )
    # an azimuth error drifts the north channel: azimuth x Earth rate, unless alignment has balanced it
    feigned = np.rad2deg(EARTH_RATE_RADPS) * 3600.0 * np.deg2rad(run.noise.azimuth_deg)
    noise = replace(run.noise, drift_dph=float(np.hypot(run.noise.drift_dph, feigned)))
    taken_off, fit = np.zeros(len(PARAMETERS)), None
    for _ in range(ITERATIONS):
        straightened = _without_azimuth(differences, taken_off, changes.reference_s, known)
        again = run_filter(straightened, run.model, noise, gate=settings.gate_sigmas**2)
        change, variance = _unpredicted(again, changes)
        change = change + changes.columns @ taken_off
        fit = _regression(changes.columns, change, variance * _quiet_scale(again, quiet), prior)
        taken_off[[AZIMUTH, AZIMUTH_DRIFT]] = fit.values[[AZIMUTH, AZIMUTH_DRIFT]]
        # Earth's rotation turns azimuth into tilt and back: a slow oscillation of 24 h
        prior[AZIMUTH_DRIFT] = np.hypot(gyro, EARTH_RATE_RADPS * fit.values[AZIMUTH])
    assert fit is not None
    return replace(fit, sigma_scale=limits.sigma_scale)


def _refused(changes: int, largest: float, reason: str) -> AzimuthEstimate:
    return AzimuthEstimate(False, None, None, changes, largest, reason)


def _turned(vectors: FloatArray) -> FloatArray:
    """Horizontal vectors (..., 2) turned by 90 deg clockwise: what a unit of azimuth error adds."""
    return np.stack([-vectors[..., 1], vectors[..., 0]], axis=-1)


def _is_manoeuvring(differences: Differences, limits: AzimuthLimits) -> BoolArray:
    """Where the INS velocity changes, shape (n,)."""
    time_s, velocity = differences.epochs.time_s, differences.velocity_mps
    half = 0.5 * limits.smooth_s
    early = np.maximum(np.searchsorted(time_s, time_s - half - 1e-6), 0)
    late = np.minimum(np.searchsorted(time_s, time_s + half - 1e-6), len(time_s) - 1)
    seconds = np.maximum(time_s[late] - time_s[early], 1e-6)
    change = np.nan_to_num(np.hypot(*(velocity[late] - velocity[early]).T))
    return np.asarray(change > limits.acceleration_mps2 * seconds)


def _manoeuvres(differences: Differences, limits: AzimuthLimits) -> list[tuple[int, int]]:
    """First and last epoch of each manoeuvre; those with no room for averages in between are one."""
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


def _changes_between(differences: Differences, known: BoolArray, pieces: Int64Array, limits: AzimuthLimits) -> Changes:
    """Changes across pieces (m, 2) of epochs; left out without GNSS for half of either average, or with a reset."""
    epochs, velocity = differences.epochs, _filled(differences.epochs.time_s, differences.velocity_mps)
    time_s = epochs.time_s
    start, end = time_s[pieces].T
    before = np.searchsorted(time_s, np.stack([start - limits.average_s - 1e-6, start + 1e-6], axis=1))
    after = np.searchsorted(time_s, np.stack([end - 1e-6, end + limits.average_s + 1e-6], axis=1))
    least = 0.5 * limits.average_s / epochs.interval_s
    resets = _sums(epochs.is_reset.astype(np.float64)[:, None])[:, 0]
    keep = resets[after[:, 1]] == resets[before[:, 0]]
    for part in (before, after):
        keep &= _count(part, known) >= least
    before, after = before[keep], after[keep]
    mean_s, mean_velocity, mean_acceleration = (
        tuple(_mean(part, values, known) for part in (before, after))
        for values in (time_s[:, None], velocity, _slopes(time_s, velocity))
    )
    change, middle_s = mean_velocity[1] - mean_velocity[0], 0.5 * (mean_s[0] + mean_s[1])
    columns = np.zeros((len(before), 2, len(PARAMETERS)))
    columns[:, :, AZIMUTH] = _turned(change)
    columns[:, :, AZIMUTH_DRIFT] = _turned(change) * (middle_s - middle_s[-1:])
    columns[:, :, LATENCY] = mean_acceleration[1] - mean_acceleration[0]
    columns[:, :, SCALE] = change
    columns[:, :, BIAS_FORWARD] = _turned_bias(time_s, velocity, before, after, known)
    columns[:, :, BIAS_RIGHT] = _turned(columns[:, :, BIAS_FORWARD])
    return Changes(before, after, known, mean_s[0][:, 0], mean_s[1][:, 0], change, columns)


def _turned_bias(
    time_s: FloatArray, velocity: FloatArray, before: Int64Array, after: Int64Array, known: BoolArray
) -> FloatArray:
    """Change of velocity error by a unit of forward bias that was levelled away on the track before, shape (m, 2)."""
    speed = np.hypot(*velocity.T)
    still = 1.0  # m/s; slower than this the track says nothing of the heading
    ahead = np.where((speed > still)[:, None], velocity / np.maximum(speed, still)[:, None], np.nan)
    ahead = _filled(time_s, ahead)
    gathered = np.cumsum(ahead * np.diff(time_s, prepend=time_s[:1])[:, None], axis=0)
    both = np.column_stack([gathered, time_s])
    grown = _mean(after, both, known) - _mean(before, both, known)
    return np.asarray(grown[:, :2] - grown[:, 2:] * _mean(before, ahead, known))


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


def _count(ranges: Int64Array, known: BoolArray) -> FloatArray:
    """Known rows in each half-open range (m, 2), shape (m,)."""
    total = _sums(known.astype(np.float64)[:, None])[:, 0]
    return np.asarray(total[ranges[:, 1]] - total[ranges[:, 0]])


def _mean(ranges: Int64Array, values: FloatArray, known: BoolArray) -> FloatArray:
    """Means of the known rows of values (n, c) in half-open ranges (m, 2), shape (m, c)."""
    total = _sums(np.where(known[:, None], values, 0.0))
    return np.asarray((total[ranges[:, 1]] - total[ranges[:, 0]]) / np.maximum(_count(ranges, known), 1.0)[:, None])


def _without_azimuth(differences: Differences, parameters: FloatArray, reference_s: float, known: BoolArray) -> Epochs:
    """Velocity differences less what an azimuth error makes of the velocity; positions are left out."""
    epochs = differences.epochs
    azimuth_rad = parameters[AZIMUTH] + parameters[AZIMUTH_DRIFT] * (epochs.time_s - reference_s)
    velocity = epochs.velocity_mps - azimuth_rad[:, None] * _turned(differences.velocity_mps)
    velocity = np.where(known[:, None], velocity, np.nan)
    return Epochs(epochs.time_s, np.full_like(velocity, np.nan), velocity, epochs.drag_per_s, epochs.is_reset)


def _unpredicted(run: FilterRun, changes: Changes) -> tuple[FloatArray, FloatArray]:
    """Change of velocity error that the filter did not foresee, shape (m, 2), and its variance (m,)."""
    time_s, velocity = run.epochs.time_s, np.nan_to_num(run.epochs.velocity_mps)
    out = _mean(changes.after, velocity, changes.known) - _mean(changes.before, velocity, changes.known)
    gnss, density = run.noise.gnss, run.noise.densities()
    samples = np.minimum(_count(changes.before, changes.known), _count(changes.after, changes.known))
    variance = np.zeros(len(changes))
    for index in range(len(changes)):
        last = int(changes.before[index, 1]) - 1
        rows = [run.model.transition_over(float(when - time_s[last]))[VELOCITY] for when in _ends(changes, index)]
        grown = rows[1] - rows[0]
        out[index] -= grown @ run.x[last]
        seconds = changes.after_s[index] - changes.before_s[index]
        decorrelated = -np.expm1(-seconds / max(gnss.velocity_correlation_s, 1e-6))
        variance[index] = (
            grown @ run.P[0, last] @ grown
            + run.model.process_noise_over(float(seconds), density)[VELOCITY, VELOCITY]
            + 2.0 * gnss.velocity_white_mps**2 / samples[index]
            + 2.0 * gnss.velocity_correlated_mps**2 * decorrelated
        )
    return out, variance


def _ends(changes: Changes, index: int) -> tuple[float, float]:
    return float(changes.before_s[index]), float(changes.after_s[index])


def _quiet_scale(run: FilterRun, quiet: Changes) -> float:
    """How much larger the variance across quiet stretches is than believed; 1 with few of them."""
    few = 10
    if len(quiet) < few:
        return 1.0
    change, variance = _unpredicted(run, quiet)
    return max(1.0, float(np.mean(np.square(change) / variance[:, None])))


def _regression(columns: FloatArray, change: FloatArray, variance: FloatArray, prior: FloatArray) -> AzimuthFit:
    """Weighted least squares with prior sigmas; columns (m, 2, p), change (m, 2), variance (m,), prior (p,)."""
    weight = 1.0 / np.sqrt(variance)
    rows = (columns * weight[:, None, None]).reshape(-1, columns.shape[2]) * prior  # in units of the prior sigmas
    right = (change * weight[:, None]).ravel()
    normal = rows.T @ rows
    inverse = np.linalg.inv(normal + np.eye(len(prior)))
    solved = inverse @ rows.T @ right
    residual = right - rows @ solved
    freedom = max(1.0, len(right) - float(np.trace(inverse @ normal)))
    return AzimuthFit(solved * prior, inverse * np.outer(prior, prior), residual.reshape(-1, 2), freedom)
