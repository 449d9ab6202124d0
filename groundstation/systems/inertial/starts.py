"""Start of a forecast: each method's state when GNSS is lost, from nothing later."""

import numpy as np

from groundstation.base.dataclasses import dataclass
from groundstation.base.records import Int64Array
from groundstation.methods.kalman.smoother import smooth_lags
from groundstation.systems.inertial.filter import ChannelsRun
from groundstation.systems.inertial.model import (
    DRIFT,
    DRIFT_RATE,
    POSITION,
    SIZE,
    TILT,
    VELOCITY,
    FloatArray,
)
from groundstation.systems.inertial.settings import InertialSettings

LAG_STEP_S = 20.0  # of the sums over past estimates that are carried forward one by one


@dataclass(frozen=True)
class AveragingWindow:
    """Averaging length per state, seconds; 0 takes the last estimate."""

    lengths_s: tuple[float, ...]

    @classmethod
    def of(cls, settings: InertialSettings, *states: int) -> "AveragingWindow":
        """The settings' lengths for the states named, the last estimate for the others."""
        lengths = {
            TILT: settings.tilt_window_s,
            DRIFT: settings.drift_window_s,
            DRIFT_RATE: settings.drift_rate_window_s,
        }
        return cls(tuple(lengths[state] if state in states else 0.0 for state in range(SIZE)))


def windows_of(method: str, settings: InertialSettings) -> AveragingWindow:
    """Window of each method that has one."""
    states = (DRIFT, DRIFT_RATE) if method == "drift_windows" else (TILT, DRIFT, DRIFT_RATE)
    return AveragingWindow.of(settings, *states)


def start_states(method: str, run: ChannelsRun, at: Int64Array, settings: InertialSettings) -> FloatArray:
    """States from which a method forecasts.

    Parameters
    ----------
    method : str
        A name of results.forecast_methods.
    run : ChannelsRun
    at : ndarray of int, shape (s,)
        Epochs at which GNSS is lost; nothing later is looked at.

    Returns
    -------
    ndarray, shape (s, 6, c)
        Position error 0: the position is known when the outage begins, and what builds up from there is forecast.
        For ``raw_ins`` all zero, for ``hold_velocity`` the velocity alone.
    """
    if method == "raw_ins":
        states = np.zeros((len(at), SIZE, run.x.shape[2]))
    elif method == "hold_velocity":
        states = _held_velocity(run, at, settings.hold_s)
    elif method == "schuler_fit":
        states = _schuler_fit(run, at, settings.schuler_fit_s)
    elif method in ("windows", "drift_windows"):
        states = _averaged(run, at, windows_of(method, settings))
    elif method == "consistent_windows":
        states = _carried_average(run, at, windows_of(method, settings))
    elif method == "smoothed_start":
        states = _smoothed(run, at, settings.smoothing_lag_s)
    else:
        states = run.x[at]
    out = np.array(states)
    out[:, POSITION] = 0.0
    return out


def _held_velocity(run: ChannelsRun, at: Int64Array, length_s: float) -> FloatArray:
    """Return the mean measured velocity error over the last seconds.

    It is that of the estimate where none was measured.
    """
    time_s, measured = run.epochs.time_s, run.measured(1)
    states = np.zeros((len(at), SIZE, run.x.shape[2]))
    known = np.isfinite(measured)
    total = _from_zero(np.cumsum(np.where(known, measured, 0.0), axis=0))
    count = _from_zero(np.cumsum(known, axis=0))
    first = np.searchsorted(time_s, time_s[at] - length_s, side="right")
    number = count[at + 1] - count[first]
    mean = (total[at + 1] - total[first]) / np.maximum(number, 1)
    states[:, VELOCITY] = np.where(number > 0, mean, run.x[at, VELOCITY])
    return states


def _schuler_fit(run: ChannelsRun, at: Int64Array, length_s: float) -> FloatArray:
    """Fit velocity error = bias + a cos + b sin at the Schuler rate over the last seconds.

    By least squares. As a state: the bias is a constant drift of -bias / R, the slope a tilt of -slope / g.
    """
    time_s = run.epochs.time_s
    measured = run.measured(1) if np.isfinite(run.epochs.velocity_mps).any() else run.x[:, VELOCITY]
    rate = run.model.schuler_rate_radps
    phase = rate * time_s
    basis = np.stack([np.ones_like(phase), np.cos(phase), np.sin(phase)], axis=1)
    states = np.zeros((len(at), SIZE, run.x.shape[2]))
    first = np.searchsorted(time_s, time_s[at] - length_s, side="left")
    for channel in range(run.x.shape[2]):
        known = np.isfinite(measured[:, channel])
        rows = np.where(known[:, None], basis, 0.0)
        values = np.where(known, measured[:, channel], 0.0)
        normal = _from_zero(np.cumsum(rows[:, :, None] * rows[:, None, :], axis=0))
        right = _from_zero(np.cumsum(rows * values[:, None], axis=0))
        left = normal[at + 1] - normal[first] + 1e-9 * np.eye(3)
        solved = np.linalg.solve(left, (right[at + 1] - right[first])[:, :, None])[:, :, 0]
        sine, cosine = basis[at, 2], basis[at, 1]
        states[:, VELOCITY, channel] = solved[:, 0] + solved[:, 1] * cosine + solved[:, 2] * sine
        slope = rate * (solved[:, 2] * cosine - solved[:, 1] * sine)
        states[:, TILT, channel] = -slope / run.model.gravity_mps2
        states[:, DRIFT, channel] = -solved[:, 0] / run.model.radius_m
    return states


def _averaged(run: ChannelsRun, at: Int64Array, window: AveragingWindow) -> FloatArray:
    """Average past estimates over the paper's windows: plain means, one length per state.

    Only epochs that had GNSS count.
    """
    time_s, weight = run.epochs.time_s, run.epochs.has_gnss.astype(np.float64)
    total = _from_zero(np.cumsum(run.x * weight[:, None, None], axis=0))
    count = _from_zero(np.cumsum(weight))
    states = np.array(run.x[at])
    for state, length_s in enumerate(window.lengths_s):
        if length_s > 0.0:
            first = np.searchsorted(time_s, time_s[at] - length_s, side="right")
            number = count[at + 1] - count[first]
            mean = (total[at + 1, state] - total[first, state]) / np.maximum(number, 1.0)[:, None]
            states[:, state] = np.where(number[:, None] > 0.0, mean, states[:, state])
    return states


def _carried_average(run: ChannelsRun, at: Int64Array, window: AveragingWindow) -> FloatArray:
    """Average past estimates, each carried to the start by the model first.

    Nothing true is smoothed away.
    """
    time_s = run.epochs.time_s
    states = np.array(run.x[at])
    span_s = float(np.ptp(time_s)) if len(time_s) else 0.0
    lags = np.arange(0.0, min(max(window.lengths_s), span_s) + 1e-9, LAG_STEP_S)
    carried = np.stack([run.model.transition_over(float(lag)) for lag in lags])
    source = np.searchsorted(time_s, time_s[at][:, None] - lags[None, :] + 1e-6, side="right") - 1
    is_there = source >= 0
    past = run.x[np.maximum(source, 0)]
    now = np.einsum("lij,sljc->slic", carried, past, optimize=True)
    for state, length_s in enumerate(window.lengths_s):
        if length_s > 0.0:
            use = is_there & (lags[None, :] < length_s)
            states[:, state] = np.einsum("sl,slc->sc", use, now[:, :, state]) / use.sum(axis=1)[:, None]
    return states


def _smoothed(run: ChannelsRun, at: Int64Array, lag_s: float) -> FloatArray:
    """Smooth the state ``lag_s`` before the start and carry it forward by the model.

    All data up to the start are used.
    """
    time_s = run.epochs.time_s
    states = np.empty((len(at), SIZE, run.x.shape[2]))
    first = np.maximum(np.searchsorted(time_s, time_s[at] - lag_s, side="left"), 0)
    seconds = time_s[at] - time_s[first]
    carried = {float(part): run.model.transition_over(float(part)) for part in np.unique(seconds)}
    forward = np.stack([carried[float(part)] for part in seconds]) if len(at) else np.zeros((0, SIZE, SIZE))
    for part, group in zip(run.parts, run.groups, strict=True):
        states[:, :, group] = np.einsum("sij,sjc->sic", forward, smooth_lags(part, first, at))
    return states


def _from_zero(sums: FloatArray) -> FloatArray:
    """Prepend a zero to running sums: differences of two entries are then sums of a slice."""
    return np.concatenate([np.zeros_like(sums[:1]), sums])
