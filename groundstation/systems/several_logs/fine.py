"""Fine fit of offset and drift between two clocks, over a stretch without steps.

Both come with their intervals.
"""

from dataclasses import replace

import numpy as np

from groundstation.base.angles import FloatArray, direction_of, unwrap
from groundstation.base.attitude import rotation_n_from_b
from groundstation.base.dataclasses import dataclass
from groundstation.base.quantiles import NORMAL_95, student_quantile
from groundstation.methods.lag.fit import DelayFit, fit_delay
from groundstation.methods.lag.settings import SLOW_MPS, LatencySettings
from groundstation.methods.lag.windows import ReferenceSignals, Windows, cut_windows, too_few_windows
from groundstation.systems.several_logs.channels import SignalPair, TopicSignals, averaged, running_mean
from groundstation.systems.several_logs.settings import TwoClocksSettings

REFERENCE_STEP_S, OTHER_STEP_S, SLOW_S = 0.1, 0.4, 0.35
NOISY_WIDTH_S = 1.0  # means over so long where both are GNSS: else the noise draws the fit to where it is least
SMOOTHED_NODES = 3
LOOSE_PPM = 1000.0  # the fit itself knows nothing of drifts
TURNS = 2  # the second begins with the drift that the first found
SCALE_SIGMA = {"altitude": 0.1, "heading": 0.02}
USUAL_SCALE_SIGMA, AZIMUTH_SIGMA_RAD = 0.03, 0.05


@dataclass(frozen=True)
class MotionFit:
    """Lag and drift of a clock, fitted to the motion over one stretch.

    First time = other time + ``lag_s`` - ``drift`` (other time - ``middle_s``), in seconds of the flights. Sigmas are
    such that 1.96 of them hold the truth in 95 of 100: Student's quantile is in them.
    """

    middle_s: float
    lag_s: float
    lag_sigma_s: float
    drift: float
    drift_sigma: float
    explained: float
    windows: int


def fit_motion(
    pair: SignalPair, lag_s: float, span_s: tuple[float, float], hidden_s: float, settings: TwoClocksSettings
) -> MotionFit | str:
    """Fit lag and drift over a stretch of the other log, from a lag that is nearly right.

    Parameters
    ----------
    pair : SignalPair
    lag_s : float
        From :func:`place_of`: good to ``search_s``.
    span_s : (float, float)
        Seconds of the other log.
    hidden_s : float
        One sigma of what no motion shows: the filter of an INS, messages that came late.

    Returns
    -------
    MotionFit or str
        Or why it is not observable.

    Notes
    -----
    An INS, else the faster of the two, is the reference of :func:`fit_delay`. Drift is a nuisance of it: what a delay
    that grows with time adds to the signal, time times its rate. Both are fitted again about the drift found. What may
    be wrong between two sensors (scale, azimuth, arm) is a nuisance each.
    """
    inside = (pair.other.time_s >= span_s[0]) & (pair.other.time_s <= span_s[1])
    if np.count_nonzero(inside) < settings.overlap_min_s / pair.other.interval_s * 0.5:
        return "too few samples in common"
    other = pair.other.take(inside)
    middle_s, drift, fit = float(np.mean(span_s)), 0.0, None
    is_reference = _is_reference(pair.first, other)
    for _turn in range(TURNS):
        moved_s = other.time_s + lag_s - drift * (other.time_s - middle_s)
        moved = replace(other, time_s=moved_s)
        sides = (pair.first, moved) if is_reference else (moved, pair.first)
        found = _fit(pair.names, *sides, middle_s + lag_s, settings)
        if isinstance(found, str):
            return found
        fit, middle = found
        sense = -1.0 if is_reference else 1.0
        # The middle moves to where the motion is; about it lag and drift are nearly uncorrelated.
        own = middle - lag_s
        lag_s, middle_s = lag_s - drift * (own - middle_s) + sense * fit.delay_s, own
        drift += -sense * 1e-6 * fit.nuisance
    assert fit is not None
    why = _why_not(fit, settings)
    hidden_s = float(np.hypot(hidden_s, _hidden_by_arm_s(pair, other, settings)))
    half_s = student_quantile(0.975, fit.freedom) * float(np.hypot(fit.sigma_s, hidden_s))
    slow_s = settings.slow_reference_share * _slow(min(pair.first.interval_s, pair.other.interval_s))
    half_s = float(np.hypot(half_s, NORMAL_95 * slow_s))
    if not max(half_s, NORMAL_95 * fit.modelled_sigma_s) <= settings.half_width_max_s:
        why = f"too little motion: 95 % interval of +- {half_s:.2g} s, limit {settings.half_width_max_s:g} s"
    if why:
        return why
    drift_sigma = 1e-6 * fit.nuisance_sigma * student_quantile(0.975, fit.nuisance_freedom) / NORMAL_95
    share = settings.drift_sigma_ppm**2 / (settings.drift_sigma_ppm**2 + (1e6 * drift_sigma) ** 2)
    drift, drift_sigma = share * drift, share**0.5 * drift_sigma  # with what is known of crystals
    return MotionFit(middle_s, lag_s, half_s / NORMAL_95, drift, drift_sigma, fit.explained, fit.windows)


def _why_not(fit: DelayFit, settings: TwoClocksSettings) -> str:
    if fit.explained < settings.explained_min:
        return f"one explains only {fit.explained:.0%} of the motion of the other"
    return "" if fit.is_converged else "no minimum near the place of the first search"


def _hidden_by_arm_s(pair: SignalPair, other: TopicSignals, settings: TwoClocksSettings) -> float:
    """Return the lag, one sigma, that a lever arm between two antennas can hide.

    It is the length of the arm over the speed, where no attitude tells the two apart. In a turn of one radius an
    antenna that stands ahead looks as one that is early.
    """
    if "north" not in pair.names or any(side.attitude_deg is not None for side in (pair.first, other)):
        return 0.0
    speed_mps = float(np.quantile(np.hypot(other.values[:, 0], other.values[:, 1]), 0.9))
    return settings.arm_sigma_m / max(speed_mps, SLOW_MPS)


def _slow(interval_s: float) -> float:
    return interval_s if interval_s > SLOW_S else 0.0


def _is_reference(first: TopicSignals, other: TopicSignals) -> bool:
    """Tell whether the first side is to be the reference.

    An INS goes before GNSS, whose noise would draw the fit to its samples. Between two of a kind it is the faster one.
    """
    first_is_ins, other_is_ins = _is_quiet(first), _is_quiet(other)
    return first_is_ins > other_is_ins or (first_is_ins == other_is_ins and first.interval_s <= other.interval_s)


def _is_quiet(side: TopicSignals) -> bool:
    """Tell whether single samples have little noise, as those of a fast INS."""
    return side.topic.startswith("ins") and side.interval_s <= SLOW_S


def _nodes(width_s: float, interval_s: float) -> int:
    """Odd number of samples, three or more, that are as long as a width."""
    return max(SMOOTHED_NODES, 2 * round(0.5 * width_s / interval_s) + 1)


def _fit(
    names: tuple[str, ...], fast: TopicSignals, slow: TopicSignals, middle_s: float, settings: TwoClocksSettings
) -> tuple[DelayFit, float] | str:
    """Fit one side (``slow``) to the reference (``fast``); return the fit and its middle time.

    Both sides are on the seconds of the first log. Where it fails the reason is returned.
    """
    reference = averaged(fast, REFERENCE_STEP_S)
    if _is_quiet(fast):
        sensor = averaged(slow, OTHER_STEP_S)
        width_s = OTHER_STEP_S if sensor is not slow else 0.0
    else:
        width_s = max(NOISY_WIDTH_S, 3.0 * max(fast.interval_s, slow.interval_s))
        sensor = running_mean(slow, _nodes(width_s, slow.interval_s))
    fine = LatencySettings(
        search_s=settings.search_s,
        window_s=settings.window_s,
        windows_max=settings.windows_max,
        gap_max_s=max(0.6, 2.2 * reference.interval_s),
    )
    size = _noise(names, reference, sensor)
    reference = replace(reference, values=reference.values / size)
    if reference.attitude_deg is None and sensor.attitude_deg is not None:
        turned = [np.interp(reference.time_s, sensor.time_s, angle) for angle in sensor.attitude_deg.T]
        reference = replace(reference, attitude_deg=np.column_stack(turned))
    series, _priors, _drift = _series(names, reference, size, middle_s, width_s, settings, fine)
    windows = cut_windows(series, sensor.time_s, sensor.values / size, fine)
    if windows is None:
        return too_few_windows(fine)
    middle_s = _middle(series, windows)
    series, priors, drift = _series(names, reference, size, middle_s, width_s, settings, fine)
    return fit_delay(series, windows, priors, fine, wanted=drift), middle_s


def _noise(names: tuple[str, ...], reference: TopicSignals, sensor: TopicSignals) -> FloatArray:
    """Return the noise of each signal of the sensor, shape (c,).

    It is the scatter about the reference from sample to sample; north has that of east.
    """
    inside = (sensor.time_s > reference.time_s[0]) & (sensor.time_s < reference.time_s[-1])
    left = np.column_stack(
        [
            values[inside] - np.interp(sensor.time_s[inside], reference.time_s, shown)
            for values, shown in zip(sensor.values.T, reference.values.T, strict=True)
        ]
    )
    if len(left) < 3:
        return np.ones(left.shape[1])
    scatter = 1.4826 * np.median(np.abs(np.diff(left, n=2, axis=0)), axis=0) / 6.0**0.5
    most = np.maximum(np.std(sensor.values, axis=0), 1e-6)
    size = np.clip(scatter, 1e-3 * most, most)
    if "north" in names:
        size[:2] = np.mean(size[:2])  # they turn into each other
    return np.asarray(size)


def _series(
    names: tuple[str, ...],
    side: TopicSignals,
    size: FloatArray,
    middle_s: float,
    width_s: float,
    settings: TwoClocksSettings,
    fine: LatencySettings,
) -> tuple[ReferenceSignals, FloatArray, int]:
    """Return the reference with its nuisances, their priors, and the index of the drift.

    It is averaged over ``width_s`` as the sensor was, and so that the noise of its single samples does not show.
    """
    count = len(names)
    rate = np.gradient(side.values, side.time_s, axis=0)
    base = np.concatenate([side.values, 1e-6 * (side.time_s - middle_s)[:, None] * rate], axis=1)
    turns = "north" in names
    if turns:
        base = np.concatenate([base, _arms(names, side, size)], axis=1)

    def build(base: FloatArray) -> FloatArray:
        signal, later = base[..., :count], base[..., count : 2 * count]
        columns = [signal, -later]
        columns += [np.where(np.arange(count) == number, signal, 0.0) for number in range(count)]
        if turns:
            turned = np.zeros_like(signal)
            turned[..., 0], turned[..., 1] = -signal[..., 1], signal[..., 0]
            arms = base[..., 2 * count :].reshape(*signal.shape, 3)
            columns += [turned, *np.moveaxis(arms, -1, 0)]
        return np.stack(columns, axis=-1)

    sigma = [LOOSE_PPM, *(SCALE_SIGMA.get(name, USUAL_SCALE_SIGMA) for name in names)]
    sigma += [AZIMUTH_SIGMA_RAD, *[settings.arm_sigma_m] * 3] if turns else []
    series = ReferenceSignals(side.time_s, base, build, fine.gap_max_s)
    return series.smoothed(_nodes(width_s, side.interval_s)), np.array(sigma), 0


def _arms(names: tuple[str, ...], side: TopicSignals, size: FloatArray) -> FloatArray:
    """Return what a lever arm of 1 m along each body axis adds to the signals, shape (n, 3 c).

    It adds the velocity of a turning body.
    """
    north, east = side.values[:, 0] * size[0], side.values[:, 1] * size[1]
    if side.attitude_deg is None:
        attitude = np.column_stack([np.zeros((len(north), 2)), _track(north, east)])
    else:
        attitude = side.attitude_deg
    moved = np.gradient(rotation_n_from_b(attitude), side.time_s, axis=0)
    arms = np.zeros((len(north), len(names), 3))
    for row, name in enumerate(("north", "east", "down")):
        if name in names:
            number = names.index(name)
            arms[:, number] = moved[:, row] / size[number]
    return arms.reshape(len(north), -1)


def _track(north_mps: FloatArray, east_mps: FloatArray) -> FloatArray:
    """Return the direction of motion, continuous, held where it is slow.

    It stands for the heading of a body that logs none.
    """
    known = np.flatnonzero(np.hypot(north_mps, east_mps) > SLOW_MPS)
    if not known.size:
        return np.zeros(len(north_mps))
    return np.interp(np.arange(len(north_mps)), known, unwrap(direction_of(north_mps[known], east_mps[known])))


def _middle(series: ReferenceSignals, windows: Windows) -> float:
    """Return the mean time of the motion, about which the offset is known best."""
    rate = series.at(windows.time_s)[1][..., 0]
    weight = np.sum(rate**2, axis=-1) * windows.weight
    return float(np.sum(weight * windows.time_s) / max(float(np.sum(weight)), 1e-12))
