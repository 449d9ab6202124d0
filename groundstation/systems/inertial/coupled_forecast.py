"""Forecasts of the coupled north-east model, their variance, and their gain.

The gain is over the two separate channels.
"""

from collections.abc import Iterator, Sequence

import numpy as np

from groundstation.base.dataclasses import dataclass
from groundstation.base.records import Int64Array
from groundstation.base.units import NS_PER_S
from groundstation.methods.ins_noise import InsNoise
from groundstation.methods.kalman.arrays import REJECTED
from groundstation.results.forecast_methods import FORECAST_HORIZONS_MIN
from groundstation.systems.inertial.coupled import (
    CHANNELS,
    LONGEST_STEP_S,
    RATES,
    CoupledRun,
    coupled_values,
    noise_of,
)
from groundstation.systems.inertial.craft_motion import CraftMotion
from groundstation.systems.inertial.differences import InsDifferences
from groundstation.systems.inertial.forecast_answer import CoupledRow
from groundstation.systems.inertial.hindcast import Hindcast
from groundstation.systems.inertial.model import POSITION, FloatArray
from groundstation.systems.inertial.settings import InertialSettings

PLACES = CHANNELS[:, POSITION]
STEPS_AT_ONCE = 16_384  # whose entries are held in memory, 5 MB where no two are the same
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
    measured, starts = run.epochs.position_m[at], np.array(run.x[at])
    is_known = np.isfinite(measured) & (run.used[at, POSITION] != REJECTED)
    known = np.where(is_known, measured, starts[:, PLACES])
    starts[:, PLACES] = known
    for ahead in _ahead(run, at, lead_s, min(settings.forecast_step_s, LONGEST_STEP_S)):
        use = ahead.starts
        built = RATES.carried(ahead.values, ahead.step, ahead.step_s, ahead.every, starts[use])
        out[use] = built[:, :, PLACES] - known[use, None]
    return out


def coupled_variance(run: CoupledRun, at: Int64Array, lead_s: FloatArray) -> FloatArray:
    """Variance of what :func:`hindcast_coupled` forecasts by the model, m^2, shape (s, l, 2).

    It is the variance of the states at the start (last epoch whose covariance was kept), position known, plus that of
    the noise since.
    """
    out = np.zeros((len(at), len(lead_s), 2))
    _, densities = noise_of(run.noise, run.differences, run.epochs, 0.0)
    starts = run.P[at // run.every]
    starts[:, PLACES] = starts[:, :, PLACES] = 0.0
    for ahead in _ahead(run, at, lead_s, VARIANCE_STEP_S):
        use = ahead.starts
        carried = RATES.variances(ahead.values, ahead.step, ahead.step_s, ahead.every, starts[use], densities)
        out[use] = carried[:, :, PLACES]
    return out


@dataclass(frozen=True)
class StepsAhead:
    """Equal steps ahead of some starts, along the INS's own motion.

    Parameters
    ----------
    starts : slice
        Which of the starts.
    values : ndarray, shape (d, 41)
        Entries of A over each distinct step: starts a whole number of steps apart share theirs.
    step : ndarray of int, shape (s, k)
        Which of the distinct steps each step of a start is.
    step_s : float
    every : int
        Steps from one lead to the next.
    """

    starts: slice
    values: FloatArray
    step: Int64Array
    step_s: float
    every: int


def _ahead(run: CoupledRun, at: Int64Array, lead_s: FloatArray, longest_s: float) -> Iterator[StepsAhead]:
    return steps_ahead(run.differences, run.noise, run.epochs.time_s[at], lead_s, longest_s)


def steps_ahead(
    differences: InsDifferences, noise: InsNoise, start_s: FloatArray, lead_s: FloatArray, longest_s: float
) -> Iterator[StepsAhead]:
    """Steps of at most ``longest_s`` ahead of some times, so many starts at once as memory allows."""
    if not len(lead_s):
        return
    every = max(1, round(float(lead_s[0]) / longest_s))
    step_s, count = float(lead_s[0]) / every, every * len(lead_s)
    elapsed, each = step_s * np.arange(count), max(1, STEPS_AT_ONCE // count)
    for first in range(0, len(start_s), each):
        begin = start_s[first : first + each, None] + elapsed
        _, rows, step = np.unique(np.round(begin * NS_PER_S).astype(np.int64), return_index=True, return_inverse=True)
        motion = CraftMotion.over(differences, begin.ravel()[rows], step_s, is_strapdown=noise.is_strapdown)
        values = coupled_values(motion, noise.beta_per_s)
        yield StepsAhead(slice(first, first + each), values, step.reshape(begin.shape), step_s, every)


def coupled_rows(
    forecast_m: FloatArray,
    separate: Hindcast,
    *,
    horizons_min: Sequence[float] = FORECAST_HORIZONS_MIN,
    method: str = "last_estimate",
) -> tuple[CoupledRow, ...]:
    """Compare the coupled model with the separate channels: the gain at every horizon.

    Starts and horizons are the same, last estimate of both.

    Parameters
    ----------
    forecast_m : ndarray, shape (s, l, 2)
        Of the coupled model, from the starts and at the leads of ``separate``.
    separate : Hindcast
        With ``method``; horizons that are none of its leads are left out, and those without a start.

    Returns
    -------
    tuple of CoupledRow
        ``gain`` is 1 - RMS ratio of the radial error: positive where coupling helps.
    """
    coupled = np.sqrt(np.sum(np.square(forecast_m - separate.actual_m), axis=2))
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
