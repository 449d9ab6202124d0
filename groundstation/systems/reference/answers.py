"""Single answers against the reference: heading error found, replayed forecast."""

import numpy as np

from groundstation.base.angles import FloatArray, wrap_180
from groundstation.base.quantiles import NORMAL_95
from groundstation.base.signals import kind_of
from groundstation.results.arrays.typed import found_in
from groundstation.results.forecast_methods import FORECAST_HORIZONS_MIN
from groundstation.systems.heading.answer import HeadingResult
from groundstation.systems.heading.arrays import HeadingSamples
from groundstation.systems.inertial.answer import InertialResult
from groundstation.systems.inertial.forecast_answer import ForecastResult
from groundstation.systems.inertial.forecast_arrays import ForecastFan
from groundstation.systems.reference.answer import ForecastCheck, HeadingCheck
from groundstation.systems.reference.errors import Errors
from groundstation.systems.reference.statistics import share_of, spread_of

SAMPLES = "heading_samples"
LEAST_SAMPLES, LEAST_STARTS = 10, 3
NEAR_S = 2.0  # between a time of the forecast and the nearest error that is known


def heading_check(heading: HeadingResult, errors: Errors) -> HeadingCheck | None:
    """Compare the heading error found with INS minus reference at the same samples.

    None where too few are known.

    ``errors`` are those of the INS as logged. Interval and reference are independent: their variances add.
    """
    figure = found_in(heading.figures, HeadingSamples)
    if figure is None or heading.ins_topic != errors.subject:
        return None
    at = figure.time_s[figure.is_used]
    seen = _at(errors.time_s, errors.angles_deg[:, 2], at)
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


def forecast_checks(forecast: ForecastResult, inertial: InertialResult, errors: Errors) -> tuple[ForecastCheck, ...]:
    """Compare the replayed forecast with the growth of the INS error by the reference.

    It is the default method of the replay, at the usual horizons.
    """
    fan = found_in(forecast.figures, ForecastFan)
    if fan is None or inertial.ins_topic != errors.subject or kind_of(errors.subject) != "ins":
        return ()
    rows = []
    for horizon_min in FORECAST_HORIZONS_MIN:
        row = _forecast_row(fan, forecast.default_method, float(horizon_min), errors)
        if row is not None:
            rows.append(row)
    return tuple(rows)


def _forecast_row(fan: ForecastFan, method: str, horizon_min: float, errors: Errors) -> ForecastCheck | None:
    rows = np.abs(fan.lead_s - 60.0 * horizon_min) < 1e-6
    start_s = fan.start_s[rows]
    if rows.sum() < LEAST_STARTS:
        return None
    grown = np.stack(
        [
            _at(errors.time_s, column, start_s + 60.0 * horizon_min) - _at(errors.time_s, column, start_s)
            for column in errors.position_m[:, :2].T
        ],
        axis=1,
    )
    forecast = np.stack([fan.north.forecast_m[rows], fan.east.forecast_m[rows]], axis=1)
    sigma = np.stack([fan.north.sigma_m[rows], fan.east.sigma_m[rows]], axis=1)
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
        *(method, horizon_min, int(known.sum())),
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
