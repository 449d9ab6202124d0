"""Plan of replayed outages: starts, horizons, and whether the log allows a calibration."""

import numpy as np

from groundstation.base.dataclasses import dataclass
from groundstation.base.records import Int64Array
from groundstation.results.forecast_methods import FORECAST_HORIZONS_MIN
from groundstation.systems.inertial.filter import ChannelsRun
from groundstation.systems.inertial.leads import PAST_FROM_S, built_up, leads_of, start_epochs
from groundstation.systems.inertial.model import FloatArray
from groundstation.systems.inertial.settings import InertialSettings
from groundstation.tables.gaps import seconds_covered

LEAD_STEP_S = 60.0
LEAST_STARTS = 3  # a horizon with fewer is not shown
LEAST_PAST_S = 300.0
HALF_HOUR_MIN = 30.0
SHORT_SHARE = 0.4  # of a flight too short for the settings' first start
MOST_STEPS_OF_MAP = 100


@dataclass(frozen=True)
class ReplayPlan:
    """Starts of the replayed outages and the horizons that fit.

    Parameters
    ----------
    first_start_s, step_s : float
        Flight time of the first start; distance of the starts.
    at : ndarray of int, shape (s,)
        Epochs of the starts, those before ``first_start_s`` among them that only calibrate.
    horizons_min : tuple of float
        Of the contract, as far as at least :data:`LEAST_STARTS` starts allow.
    lead_s : ndarray, shape (l,)
        Every minute up to the longest horizon.
    is_calibrated : bool
    reason : str
        Why not.
    """

    first_start_s: float
    step_s: float
    at: Int64Array
    horizons_min: tuple[float, ...]
    lead_s: FloatArray
    is_calibrated: bool
    reason: str


def plan_replay(run: ChannelsRun, settings: InertialSettings) -> ReplayPlan:
    """Choose the starts of the replay.

    They are the settings' where they show half an hour of forecast, else from 40 % of the flight on. A start counts
    where GNSS is there at it and at its horizon. Starts before the first one only calibrate.
    """
    time_s = run.epochs.time_s[run.epochs.has_gnss]
    begin, end = (float(time_s[0]), float(time_s[-1])) if len(time_s) else (0.0, 0.0)
    first, step = settings.first_start_s, settings.start_step_s
    if _judged(run, first, step, HALF_HOUR_MIN)[0] < LEAST_STARTS:
        first = min(first, begin + max(LEAST_PAST_S, SHORT_SHARE * (end - begin)))
        step = min(step, max(10.0, (end - first) / 20.0))
    past_min = seconds_covered(time_s[time_s <= first], settings.outage_s) / 60.0
    reason = ""
    if past_min < run.model.schuler_period_min:
        reason = (
            f"only {past_min:.0f} min of GNSS before the first replayed outage, less than one Schuler period "
            f"({run.model.schuler_period_min:.1f} min): the sigma depends on the class"
        )
    past = int(max(first - begin - PAST_FROM_S, 0.0) / step)
    judged = _judged(run, first, step, *FORECAST_HORIZONS_MIN)
    horizons = tuple(
        float(horizon) for horizon, count in zip(FORECAST_HORIZONS_MIN, judged, strict=True) if count >= LEAST_STARTS
    )
    lead_s = leads_of(LEAD_STEP_S, 60.0 * max(horizons, default=1.0))
    at = start_epochs(run.epochs, first - past * step, step)
    return ReplayPlan(first, step, at, horizons, lead_s, not reason, reason)


def _judged(run: ChannelsRun, first_s: float, step_s: float, *horizons_min: float) -> Int64Array:
    """Count the starts that GNSS could judge at some horizons."""
    shown = built_up(run.epochs, start_epochs(run.epochs, first_s, step_s), 60.0 * np.array(horizons_min))
    return np.asarray(np.isfinite(shown).all(axis=2).sum(axis=0))


def map_grid(run: ChannelsRun, settings: InertialSettings) -> tuple[Int64Array, FloatArray]:
    """Return starts (epochs) and leads of the map of errors over the whole flight.

    They are thinned to a picture's size.
    """
    time_s = run.epochs.time_s
    span = float(time_s[-1] - time_s[0])
    step = max(settings.map_step_s, _whole(span / MOST_STEPS_OF_MAP, settings.map_step_s))
    lead = max(LEAD_STEP_S, _whole(span / MOST_STEPS_OF_MAP, LEAD_STEP_S))
    return start_epochs(run.epochs, float(time_s[0]) + step, step), leads_of(lead, span)


def _whole(value: float, unit: float) -> float:
    return float(np.ceil(value / unit) * unit)
