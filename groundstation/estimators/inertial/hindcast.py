"""The forecast replayed: started at many moments of a flight, against what GNSS showed later."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from groundstation.base.records import Int64Array
from groundstation.estimators.inertial.filter import Epochs, FilterRun
from groundstation.estimators.inertial.model import POSITION, SIZE, VELOCITY, FloatArray
from groundstation.estimators.inertial.settings import InertialSettings
from groundstation.estimators.inertial.starts import start_states
from groundstation.estimators.kalman.arrays import Drive
from groundstation.estimators.kalman.filter import forecast
from groundstation.estimators.kalman.transition import Transition

NEAREST_S = 1.0


@dataclass(frozen=True)
class Hindcast:
    """Forecasts of some methods from some starts at some leads.

    Parameters
    ----------
    at : ndarray of int, shape (s,)
        Epochs of the starts.
    start_s : ndarray, shape (s,)
    lead_s : ndarray, shape (l,)
    forecast_m : mapping of method to ndarray, shape (s, l, c)
        Position error forecast to build up since the start.
    actual_m : ndarray, shape (s, l, c)
        What GNSS showed to build up; NaN where it was absent at the start or at the lead.
    """

    at: Int64Array
    start_s: FloatArray
    lead_s: FloatArray
    forecast_m: dict[str, FloatArray]
    actual_m: FloatArray

    def of(self, rows: slice) -> "Hindcast":
        """The starts that ``rows`` selects."""
        forecasts = {method: values[rows] for method, values in self.forecast_m.items()}
        return Hindcast(self.at[rows], self.start_s[rows], self.lead_s, forecasts, self.actual_m[rows])

    def error_m(self, method: str) -> FloatArray:
        """Forecast minus actual per channel, shape (s, l, c)."""
        return self.forecast_m[method] - self.actual_m

    def radial_m(self, method: str) -> FloatArray:
        """Length of the error, shape (s, l)."""
        return np.asarray(np.sqrt(np.sum(np.square(self.error_m(method)), axis=2)))


def start_epochs(epochs: Epochs, first_s: float, step_s: float) -> Int64Array:
    """Epochs with GNSS at or just after ``first_s``, ``first_s + step_s`` ... , as indices."""
    if not len(epochs):
        return np.zeros(0, dtype=np.int64)
    known = np.flatnonzero(np.isfinite(epochs.position_m).all(axis=1))
    if not len(known):
        return np.zeros(0, dtype=np.int64)
    times = epochs.time_s[known]
    wanted = np.arange(first_s, times[-1], step_s)
    at = np.minimum(np.searchsorted(times, wanted - 1e-6), len(known) - 1)
    near = np.abs(times[at] - wanted) <= nearest_s(epochs)
    return np.unique(known[at[near]])


def hindcast(
    run: FilterRun, at: Int64Array, lead_s: FloatArray, methods: Sequence[str], settings: InertialSettings
) -> Hindcast:
    """Forecast from epochs ``at`` with every method.

    Parameters
    ----------
    run : FilterRun
    at : ndarray of int, shape (s,)
    lead_s : ndarray, shape (l,)
        Equal steps from the first: k times ``lead_s[0]``.
    """
    epochs = run.epochs
    start_s = epochs.time_s[at]
    lead_step = float(lead_s[0]) if len(lead_s) else settings.forecast_step_s
    every = max(1, round(lead_step / settings.forecast_step_s))
    step_s = lead_step / every
    drag = _drag_along(epochs, start_s, step_s, every * len(lead_s))
    known = np.where(np.isfinite(epochs.position_m[at]), epochs.position_m[at], run.x[at, POSITION])
    forecasts = {
        method: _forecast(run, method, start_states(method, run, at, settings), drag, known, step_s, every, len(lead_s))
        for method in methods
    }
    return Hindcast(at, start_s, np.asarray(lead_s), forecasts, built_up(epochs, at, lead_s))


def leads_of(step_s: float, longest_s: float) -> FloatArray:
    """Leads in equal steps up to the longest (the last one whole step below it, at least one)."""
    return step_s * np.arange(1, max(1, int(longest_s / step_s + 1e-6)) + 1, dtype=np.float64)


def built_up(epochs: Epochs, at: Int64Array, lead_s: FloatArray) -> FloatArray:
    """Position error that built up from each start to each lead as GNSS showed it, shape (s, l, c), NaN unknown.

    Unknown too where the INS was reset in between: what built up then is none of the forecast's.
    """
    when = epochs.time_s[at][:, None] + np.asarray(lead_s)[None, :]
    known = np.flatnonzero(np.isfinite(epochs.position_m).all(axis=1))
    if not len(known):
        return np.full((*when.shape, epochs.position_m.shape[1]), np.nan)
    times = epochs.time_s[known]
    after = np.minimum(np.searchsorted(times, when - 1e-6), len(known) - 1)
    before = np.maximum(after - 1, 0)
    is_before = np.abs(times[before] - when) < np.abs(times[after] - when)
    nearest = known[np.where(is_before, before, after)]
    resets = np.cumsum(epochs.is_reset)
    is_shown = np.abs(epochs.time_s[nearest] - when) <= nearest_s(epochs)
    is_shown &= resets[nearest] == resets[at][:, None]
    change = epochs.position_m[nearest] - epochs.position_m[at][:, None]
    return np.where(is_shown[:, :, None], change, np.nan)


def nearest_s(epochs: Epochs) -> float:
    """How far from a start or a lead an epoch may be that is compared: one interval of GNSS, a second at least."""
    return max(NEAREST_S, epochs.gnss_intervals_s[0])


def _forecast(
    run: FilterRun,
    method: str,
    states: FloatArray,
    drag: FloatArray,
    known: FloatArray,
    step_s: float,
    every: int,
    leads: int,
) -> FloatArray:
    """Forecast by a method, shape (s, leads, c), from states (s, 6, c); ``drag`` (steps, 2, 2, s), ``known`` (s, c)."""
    count, _, channels = states.shape
    if method == "raw_ins" or not leads:
        return np.zeros((count, leads, channels))
    phi = np.eye(SIZE)
    phi[POSITION, VELOCITY] = step_s  # the velocity is held and the model not used
    if method != "hold_velocity":
        phi = run.model.transition_over(step_s)
    built = forecast(
        Transition.blocks(phi[None], np.zeros((1, SIZE, SIZE)), 1),
        np.zeros(every * leads, dtype=np.int64),
        np.ascontiguousarray(states.transpose(1, 2, 0)),
        known.T,
        every,
        Drive(POSITION, drag if channels == 2 else drag[:0], np.zeros((0, channels))),
    )
    return np.ascontiguousarray(built.transpose(2, 0, 1))


def _drag_along(epochs: Epochs, start_s: FloatArray, step_s: float, steps: int) -> FloatArray:
    """Known drag of each forecast step, shape (steps, 2, 2, s): the INS itself knows where it flies."""
    when = (np.arange(steps) + 0.5)[:, None] * step_s + start_s[None, :]
    nearest = np.minimum(np.searchsorted(epochs.time_s, when), len(epochs) - 1)
    return np.ascontiguousarray(np.moveaxis(epochs.drag_per_s[nearest], 1, 3) * step_s)
