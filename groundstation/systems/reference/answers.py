"""Single answers against the reference: heading error found, replayed forecast."""

import numpy as np

from groundstation.base.angles import FloatArray, wrap_180
from groundstation.base.quantiles import NORMAL_95
from groundstation.base.signals import kind_of
from groundstation.results.forecast_methods import FORECAST_HORIZONS_MIN
from groundstation.results.roles import HeadingByTrack, ReplayedForecasts
from groundstation.systems.reference.answer import ForecastCheck, HeadingCheck
from groundstation.systems.reference.errors import Errors
from groundstation.systems.reference.statistics import share_of, spread_of

LEAST_SAMPLES, LEAST_STARTS = 10, 3
NEAR_S = 2.0  # between a time of the forecast and the nearest error that is known


def heading_check(heading: HeadingByTrack, errors: Errors) -> HeadingCheck | None:
    """Compare the heading error found with INS minus reference at the same samples.

    None where too few are known.

    ``errors`` are those of the INS as logged. Interval and reference are independent: their variances add.
    """
    if heading.ins_topic != errors.subject:
        return None
    seen = _at(errors.time_s, errors.angles_deg[:, 2], heading.epochs_s())
    seen = seen[np.isfinite(seen)]
    if len(seen) < LEAST_SAMPLES:
        return None
    found = spread_of(heading.error_deg + np.asarray(wrap_180(seen - heading.error_deg)))
    if found.mean95 is None:
        return None
    own = errors.reference.get("true_heading_sigma_deg")
    own_sigma = 0.0 if own is None or not np.isfinite(own).any() else float(np.sqrt(np.nanmean(np.square(own))))
    seen_sigma = 0.5 * (found.mean95[1] - found.mean95[0]) / NORMAL_95
    low, high = heading.confidence95_deg
    sigma = float(np.sqrt((0.5 * (high - low) / NORMAL_95) ** 2 + seen_sigma**2 + own_sigma**2))
    difference = heading.error_deg - found.mean
    return HeadingCheck(
        *(heading.ins_topic, heading.error_deg, heading.confidence95_deg, found.mean, found.mean95),
        difference_deg=difference,
        sigma_deg=sigma,
        samples=len(seen),
        is_inside=abs(difference) <= NORMAL_95 * sigma,
    )


def forecast_checks(replayed: ReplayedForecasts, ins_topic: str, errors: Errors) -> tuple[ForecastCheck, ...]:
    """Compare replayed forecasts with the growth of the INS error by the reference.

    They are those of one INS, at the usual horizons.
    """
    if ins_topic != errors.subject or kind_of(errors.subject) != "ins":
        return ()
    rows = (_forecast_row(replayed, float(horizon_min), errors) for horizon_min in FORECAST_HORIZONS_MIN)
    return tuple(row for row in rows if row is not None)


def _forecast_row(replayed: ReplayedForecasts, horizon_min: float, errors: Errors) -> ForecastCheck | None:
    rows = np.abs(replayed.lead_s - 60.0 * horizon_min) < 1e-6
    start_s = replayed.start_s[rows]
    if rows.sum() < LEAST_STARTS:
        return None
    grown = np.stack(
        [
            _at(errors.time_s, column, start_s + 60.0 * horizon_min) - _at(errors.time_s, column, start_s)
            for column in errors.position_m[:, :2].T
        ],
        axis=1,
    )
    forecast, sigma = replayed.forecast_m[rows], replayed.sigma_m[rows]
    known = np.isfinite(grown).all(axis=1) & np.isfinite(forecast).all(axis=1)
    if known.sum() < LEAST_STARTS:
        return None
    error = (forecast - grown)[known]
    radial = np.hypot(*error.T)
    share = None
    if np.isfinite(sigma[known]).all():
        z = error / sigma[known]
        share = share_of(np.abs(z).ravel() <= NORMAL_95, z.reshape(-1, 1))
    return ForecastCheck(
        *(replayed.method, horizon_min, int(known.sum())),
        rmse_m=float(np.sqrt(np.mean(np.square(radial)))),
        raw_rmse_m=float(np.sqrt(np.mean(np.sum(np.square(grown[known]), axis=1)))),
        share_inside95=None if share is None else share.inside,
        confidence95=None if share is None else share.confidence95,
    )


def _at(time_s: FloatArray, values: FloatArray, at: FloatArray) -> FloatArray:
    """The nearest known value at other times, NaN where none is near, shape as ``at``."""
    known = np.flatnonzero(np.isfinite(values))
    if not known.size:
        return np.full(len(at), np.nan)
    times = time_s[known]
    after = np.clip(np.searchsorted(times, at), 1, max(len(times) - 1, 1)).clip(max=len(times) - 1)
    before = np.maximum(after - 1, 0)
    nearest = np.where(np.abs(times[before] - at) <= np.abs(times[after] - at), before, after)
    return np.where(np.abs(times[nearest] - at) <= NEAR_S, values[known[nearest]], np.nan)
