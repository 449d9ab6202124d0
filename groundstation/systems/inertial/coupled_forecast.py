"""Forecasts of the coupled north-east model, their variance, and their gain.

The gain is over the two separate channels.
"""

from collections.abc import Sequence

import numpy as np

from groundstation.base.records import Int64Array
from groundstation.methods.kalman import filter as kalman
from groundstation.methods.kalman.arrays import REJECTED
from groundstation.results.forecast_methods import FORECAST_HORIZONS_MIN
from groundstation.systems.inertial.coupled import (
    CHANNELS,
    LONGEST_STEP_S,
    RATES,
    SIZE,
    CoupledRun,
    coupled_values,
    lines_of,
    noise_of,
)
from groundstation.systems.inertial.craft_motion import CraftMotion
from groundstation.systems.inertial.forecast_answer import CoupledRow
from groundstation.systems.inertial.hindcast import Hindcast
from groundstation.systems.inertial.model import POSITION, FloatArray
from groundstation.systems.inertial.settings import InertialSettings

VARIANCE_STEP_S = 60.0  # of covariances carried forward: 0.07 of a Schuler radian


def hindcast_coupled(run: CoupledRun, at: Int64Array, lead_s: FloatArray, settings: InertialSettings) -> FloatArray:
    """Forecast from the last estimate at epochs ``at``, along the INS's own motion.

    Parameters
    ----------
    run : CoupledRun
    at : ndarray of int, shape (s,)
    lead_s : ndarray, shape (l,)
        Equal steps from the first: k times ``lead_s[0]``.

    The position error at a start is what GNSS showed; where it showed none, or none that was believed, the estimate.

    Returns
    -------
    ndarray, shape (s, l, 2)
        Position error forecast to build up since the start, metres: as ``Hindcast.forecast_m``.
    """
    out = np.zeros((len(at), len(lead_s), 2))
    if not len(lead_s):
        return out
    every, step_s, elapsed = _steps(lead_s, min(settings.forecast_step_s, LONGEST_STEP_S))
    measured = run.epochs.position_m[at]
    is_known = np.isfinite(measured) & (run.used[at, POSITION] != REJECTED)
    known = np.where(is_known, measured, run.x[at][:, CHANNELS[:, POSITION]])
    for index, epoch in enumerate(at):
        values = _values_along(run, float(run.epochs.time_s[epoch]), elapsed)
        start = run.x[epoch].copy()
        start[CHANNELS[:, POSITION]] = known[index]
        out[index] = RATES.carried(values, step_s, every, start)[:, CHANNELS[:, POSITION]] - known[index]
    return out


def coupled_variance(run: CoupledRun, at: Int64Array, lead_s: FloatArray) -> FloatArray:
    """Variance of what :func:`hindcast_coupled` forecasts by the model, m^2, shape (s, l, 2).

    It is the variance of the states at the start (last epoch whose covariance was kept), position known, plus that of
    the noise since.
    """
    out = np.zeros((len(at), len(lead_s), 2))
    if not len(lead_s):
        return out
    every, step_s, elapsed = _steps(lead_s, VARIANCE_STEP_S)
    _, densities = noise_of(run.noise, run.differences, run.epochs, 0.0)
    seconds, nothing = np.full(len(elapsed) - 1, step_s), lines_of(run.epochs, run.noise)
    unseen = kalman.Measurements(np.zeros(0, np.int64), np.zeros((0, 0)), np.zeros(0, np.int64), nothing)
    kept = kalman.KeptArrays(states=False, covariances=False, gains=False, variances=True)
    for index, epoch in enumerate(at):
        values = _values_along(run, float(run.epochs.time_s[epoch]), elapsed)
        start = np.array(run.P[epoch // run.every])
        start[CHANNELS[:, POSITION]] = start[:, CHANNELS[:, POSITION]] = 0.0
        carried = kalman.run_filter(
            RATES.transition(values, seconds, densities),
            np.arange(len(seconds)),
            unseen,
            kalman.Start(np.zeros((SIZE, 0)), start),
            kept=kept,
        )
        out[index] = carried.record.variance[every - 1 :: every][:, CHANNELS[:, POSITION]]
    return out


def _steps(lead_s: FloatArray, longest_s: float) -> tuple[int, float, FloatArray]:
    """Steps from one lead to the next, their length, and the times since the start, from zero."""
    every = max(1, round(float(lead_s[0]) / longest_s))
    step_s = float(lead_s[0]) / every
    return every, step_s, step_s * np.arange(every * len(lead_s) + 1, dtype=np.float64)


def _values_along(run: CoupledRun, start_s: float, elapsed_s: FloatArray) -> FloatArray:
    """Entries of A over steps since a start, along the INS's own motion."""
    motion = CraftMotion.between(run.differences, start_s + elapsed_s, is_strapdown=run.noise.is_strapdown)
    return coupled_values(motion, run.noise.beta_per_s)


def coupled_rows(
    run: CoupledRun,
    separate: Hindcast,
    settings: InertialSettings,
    *,
    horizons_min: Sequence[float] = FORECAST_HORIZONS_MIN,
    method: str = "last_estimate",
) -> tuple[CoupledRow, ...]:
    """Compare the coupled model with the separate channels: the gain at every horizon.

    Starts and horizons are the same, last estimate of both.

    Parameters
    ----------
    separate : Hindcast
        With ``method``; horizons that are none of its leads are left out, and those without a start.

    Returns
    -------
    tuple of CoupledRow
        ``gain`` is 1 - RMS ratio of the radial error: positive where coupling helps.
    """
    forecast = hindcast_coupled(run, separate.at, separate.lead_s, settings)
    coupled = np.sqrt(np.sum(np.square(forecast - separate.actual_m), axis=2))
    apart = separate.radial_m(method)
    rows = []
    for horizon in horizons_min:
        lead = np.flatnonzero(np.abs(separate.lead_s - 60.0 * horizon) < 0.5)
        if not lead.size:
            continue
        errors = np.stack([part[:, lead[0]] for part in (coupled, apart)])
        known = np.isfinite(errors).all(axis=0)
        if known.any():
            ours, theirs = np.sqrt(np.mean(np.square(errors[:, known]), axis=1))
            rows.append(CoupledRow(float(horizon), float(ours), float(1.0 - ours / theirs) if theirs > 0.0 else 0.0))
    return tuple(rows)
