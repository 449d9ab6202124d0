"""Bank error and lag of a flux valve, from its turns.

A flux valve hangs in a Hooke's joint: in a turn it leans with the apparent vertical and senses a part of the vertical
field. What is displayed may be a gyro that the valve corrects over minutes.
"""

import numpy as np

from groundstation.base.angles import FloatArray, wrap_180
from groundstation.base.dataclasses import dataclass
from groundstation.base.records import BoolArray
from groundstation.methods import harmonics
from groundstation.systems.magnetic.flux_answer import BankError
from groundstation.systems.magnetic.flux_epochs import BREAK_S, FluxEpochs
from groundstation.systems.magnetic.flux_settings import MagneticFluxSettings
from groundstation.tables.motion import runs

LEANS = np.round(np.arange(-0.3, 1.31, 0.1), 1)
LAGS_S = np.array([0.0, 1.0, 2.0, 4.0, 8.0, 15.0, 25.0, 40.0, 60.0, 85.0, 120.0, 170.0, 250.0, 400.0])
CHI_SQUARE_95 = 3.84
LEAST_WEIGHT = 0.02
WIDEST_LEAN = 0.8  # of the interval, beyond which the turns do not tell
LEAST_TURN_S, LEAST_TURNS = 10.0, 1
LAGGING_S = 5.0  # from which on the display is a gyro
CIRCLE_DEG = np.arange(0.0, 360.0, 1.0)
BANKS_DEG = np.arange(0.5, 45.01, 0.5)
SLOW_S = 240.0  # over which the true heading may change by itself
BLOCK_S = 20.0
FIRST_VARIANCE, LEAST_VARIANCE = 10.0, 0.01
PRIOR_DEG = np.array([20.0, 5.0, 5.0, 1.0, 1.0, 5.0])  # of A to E and of the error by turn rate, deg per deg/s


@dataclass(frozen=True)
class LagCell:
    """A lean and a lag with their weight.

    ``columns`` (n, 5) are the harmonics of the heading as the display follows them, ``bank_deg`` (n,) the error by
    bank.
    """

    weight: float
    lean: float
    lag_s: float
    columns: FloatArray
    bank_deg: FloatArray


def lean_error_deg(heading_deg: FloatArray, lean_deg: FloatArray, per_tilt: FloatArray) -> FloatArray:
    """Return the error of a valve that leans to the right by an angle, in [-180, 180).

    The heading is magnetic and free of error, ``per_tilt`` is Z / H, down positive. What leans senses the field in its
    own plane.

    Examples
    --------
    A right turn through north where the dip is 45 deg: the compass lags by about the bank.

    >>> error = lean_error_deg(np.array([0.0, 90.0]), np.array([10.0, 10.0]), np.ones(2))
    >>> error.round(1).tolist()
    [-9.9, 0.0]
    """
    heading, lean = np.deg2rad(heading_deg), np.deg2rad(lean_deg)
    east = np.sin(heading) * np.cos(lean) - per_tilt * np.sin(lean)
    sensed = np.rad2deg(np.arctan2(east, np.cos(heading)))
    return wrap_180(sensed - heading_deg)


def followed(time_s: FloatArray, values: FloatArray, lags_s: FloatArray) -> FloatArray:
    """Return values, (n, k), as first-order lags follow them, (lags, n, k).

    A longer break starts them anew.
    """
    steps = np.diff(time_s, prepend=time_s[0] - 2.0 * BREAK_S)
    with np.errstate(divide="ignore"):
        gains = np.where(lags_s > 0.0, 1.0 - np.exp(-steps[:, None] / np.maximum(lags_s, 1e-9)), 1.0)
    gains[steps > 4.0 * BREAK_S] = 1.0
    gains[0] = 1.0
    made = np.empty((len(time_s), len(lags_s), values.shape[1]))
    state = np.zeros(made.shape[1:])
    for row in range(len(time_s)):
        state = state + gains[row][:, None] * (values[row] - state)
        made[row] = state
    return np.moveaxis(made, 1, 0)


def fit_bank(
    epochs: FluxEpochs,
    error_deg: FloatArray,
    slow_sigma_deg: float,
    settings: MagneticFluxSettings,
) -> tuple[BankError, tuple[LagCell, ...]]:
    """Fit lean and lag to the errors in flight, (n,), NaN where the true heading is not known.

    error = A to E of the reading and lean error, as a first-order lag follows both, + a part that is proportional to
    the turn rate (latency) + slow changes of the true heading, of ``slow_sigma_deg``. Every lean and lag of a grid is
    weighed by its likelihood.
    """
    usable = epochs.is_airborne & np.isfinite(error_deg) & np.isfinite(epochs.per_tilt) & np.isfinite(epochs.rate_dps)
    usable &= np.abs(epochs.lean_deg) <= settings.fit_bank_max_deg
    turning = usable & (np.abs(epochs.lean_deg) >= settings.turn_bank_min_deg)
    turns = [one for one in runs(turning) if epochs.time_s[one[1] - 1] - epochs.time_s[one[0]] >= LEAST_TURN_S]
    upright = _upright(epochs)
    if np.count_nonzero(turning) < settings.turn_samples_min or len(turns) < LEAST_TURNS:
        reason = f"no turn above {settings.turn_bank_min_deg:g} deg of bank with a true heading"
        return BankError("not observable", reason, len(turns)), (upright,)
    magnetic = epochs.heading_deg - np.where(np.isfinite(error_deg), error_deg, 0.0)
    per_tilt = np.where(np.isfinite(epochs.per_tilt), epochs.per_tilt, 0.0)
    leaning = np.stack([lean_error_deg(magnetic, lean * epochs.lean_deg, per_tilt) for lean in LEANS], axis=1)
    forced = np.concatenate([harmonics.design(epochs.heading_deg), leaning], axis=1)
    made = followed(epochs.time_s, forced, LAGS_S)
    fitted = _fit_grid(epochs, made, error_deg, usable, slow_sigma_deg)
    statistic = fitted.statistic
    weight = np.exp(-0.5 * (statistic - statistic.min()))
    best = np.unravel_index(np.argmin(statistic), statistic.shape)
    cells = tuple(
        LagCell(
            float(weight[lag, lean]), float(LEANS[lean]), float(LAGS_S[lag]), made[lag][:, :5], made[lag][:, 5 + lean]
        )
        for lag, lean in zip(*np.nonzero(weight >= LEAST_WEIGHT), strict=True)
    )
    lean95 = _interval(statistic.min(axis=0) - statistic.min(), LEANS)
    lag95 = _interval(statistic.min(axis=1) - statistic.min(), LAGS_S)
    if lean95[1] - lean95[0] > WIDEST_LEAN:
        reason = f"the turns leave the lean between {lean95[0]:.1f} and {lean95[1]:.1f} of the bank"
        return BankError("not observable", reason, len(turns), lean95=lean95, lag95_s=lag95), cells
    mean = float(np.sum(weight * LEANS) / weight.sum()), float(np.sum(weight * LAGS_S[:, None]) / weight.sum())
    worst = float(np.max(np.abs(made[best[0]][usable, 5 + best[1]])))
    found = BankError(
        "found",
        "",
        len(turns),
        mean[0],
        lean95,
        mean[1],
        lag95,
        fitted.rate_lag_s,
        worst,
        *_limits(mean[0], lean95, mean[1], worst, float(np.nanmedian(per_tilt[usable])), settings),
    )
    return found, cells


def turns_bias(
    cells: tuple[LagCell, ...], coefficients_deg: FloatArray, bank_deg: float, rate_dps: float, per_tilt: float
) -> FloatArray:
    """Return what lean and lag leave in the mean of opposite turns, by heading, shape (360,).

    It is the mean over the cells, less the deviation itself, in steady turns each way.
    """
    deviation = harmonics.design(CIRCLE_DEG) @ coefficients_deg
    order = np.fft.fftfreq(len(CIRCLE_DEG), 1.0 / len(CIRCLE_DEG))
    total, weights = np.zeros(len(CIRCLE_DEG)), 0.0
    for cell in cells:
        branches = []
        for side in (1.0, -1.0):
            lean = np.full(len(CIRCLE_DEG), side * cell.lean * bank_deg)
            forced = deviation + lean_error_deg(CIRCLE_DEG, lean, np.full(len(CIRCLE_DEG), per_tilt))
            slowed = 1.0 + 1j * order * side * np.deg2rad(rate_dps) * cell.lag_s
            branches.append(np.fft.ifft(np.fft.fft(forced) / slowed).real)
        total += cell.weight * (0.5 * (branches[0] + branches[1]) - deviation)
        weights += cell.weight
    return total / weights


def _upright(epochs: FluxEpochs) -> LagCell:
    return LagCell(1.0, 0.0, 0.0, harmonics.design(epochs.heading_deg), np.zeros(len(epochs)))


@dataclass(frozen=True)
class _Fitted:
    """Statistic of every lag and lean, (lags, leans), and lag by turn rate of the best."""

    statistic: FloatArray
    rate_lag_s: float


def _fit_grid(
    epochs: FluxEpochs, made: FloatArray, error_deg: FloatArray, usable: BoolArray, slow_sigma_deg: float
) -> _Fitted:
    """Fit A to E for every lag and lean.

    A part by turn rate and slow changes of the reference are fitted beside them.

    The statistic is minus twice the log likelihood but for a constant. Residuals are correlated: their variance is that
    of means over blocks, which the first pass shows.
    """
    time = epochs.time_s[usable]
    slow = _hats(time)
    beside = np.concatenate([epochs.rate_dps[usable][:, None], slow], axis=1)
    prior = np.concatenate([PRIOR_DEG, np.full(slow.shape[1], slow_sigma_deg)])
    variances, rate_lag_s, size = [FIRST_VARIANCE], 0.0, np.zeros((len(LAGS_S), len(LEANS)))
    for _ in range(2):
        variance = variances[-1]
        left: list[tuple[FloatArray, FloatArray]] = []
        for lag in range(len(LAGS_S)):
            columns = made[lag][usable]
            wanted = wrap_180(error_deg[usable][:, None] - columns[:, 5:])
            full = np.concatenate([columns[:, :5], beside], axis=1)
            values = np.linalg.solve(full.T @ full + np.diag(variance / prior**2), full.T @ wanted)
            residual = wanted - full @ values
            size[lag] = np.sum(residual**2, axis=0) + variance * np.sum((values / prior[:, None]) ** 2, axis=0)
            lean = int(np.argmin(size[lag]))
            left.append((residual[:, lean], values[:, lean]))
        residual, values = left[int(np.argmin(size.min(axis=1)))]
        rate_lag_s = -float(values[5])
        variances.append(_long_run_variance(time, residual))
    return _Fitted(size / max(variances[1:]), rate_lag_s)


def _hats(time_s: FloatArray) -> FloatArray:
    """Return triangles over time, (n, k), that add to 1: slow changes are their sum."""
    count = max(2, int((time_s[-1] - time_s[0]) / SLOW_S) + 2)
    places = np.linspace(time_s[0], time_s[-1], count)
    return np.asarray(np.maximum(0.0, 1.0 - np.abs(time_s[:, None] - places) / (places[1] - places[0])))


def _long_run_variance(time_s: FloatArray, residual: FloatArray) -> float:
    """Return the variance of an epoch, were all independent: by means over blocks."""
    block = ((time_s - time_s[0]) / BLOCK_S).astype(int)
    sizes = np.bincount(block)
    sums = np.bincount(block, weights=residual)
    whole = sizes >= 0.5 * np.max(sizes)
    means = sums[whole] / sizes[whole]
    return max(float(np.mean(means**2) * np.mean(sizes[whole])), LEAST_VARIANCE)


def _interval(statistic: FloatArray, grid: FloatArray) -> tuple[float, float]:
    """Return the ends of the 95 % interval, a step of the grid wider to either side."""
    inside = np.flatnonzero(statistic <= CHI_SQUARE_95)
    low, high = max(int(inside[0]) - 1, 0), min(int(inside[-1]) + 1, len(grid) - 1)
    return float(grid[low]), float(grid[high])


def _limits(
    lean: float,
    lean95: tuple[float, float],
    lag_s: float,
    worst_deg: float,
    per_tilt: float,
    settings: MagneticFluxSettings,
) -> tuple[float | None, float | None]:
    """Return the largest bank of use, and the seconds to wait after a turn."""
    limit = settings.use_error_max_deg
    if lean95[0] <= 0.0 <= lean95[1]:
        return None, 0.0
    after = lag_s * float(np.log(max(worst_deg / limit, 1.0)))
    if lag_s >= LAGGING_S:
        return None, after
    worst = [
        float(np.max(np.abs(lean_error_deg(CIRCLE_DEG, np.full(360, lean * bank), np.full(360, per_tilt)))))
        for bank in BANKS_DEG
    ]
    within = BANKS_DEG[np.array(worst) <= limit]
    return (float(within[-1]) if within.size else float(BANKS_DEG[0])), after
