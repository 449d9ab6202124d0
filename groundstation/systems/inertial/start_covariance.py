"""Covariance of the error of each method's start, derived for the method itself.

It is not borrowed from the filter. Every start but the last estimate differs from it by d, a linear function of the
data. The error of the last estimate is independent of the data (under the model), so the covariance of the start's
error is P + Cov(d); Cov(d) over all flights the model allows follows from E[x^(s) x^(t)'] = (Pi(s) - P(s)) Phi(t, s)'
for s <= t, where Pi is the covariance of the true state without any data. d holds the lag of a window behind the true
oscillation, which P alone knows nothing of.
"""

from functools import lru_cache

import numpy as np

from groundstation.base.dataclasses import dataclass
from groundstation.base.records import Int64Array, frozen
from groundstation.methods.kalman.smoother import lag_covariances
from groundstation.systems.inertial.filter import ChannelsRun
from groundstation.systems.inertial.model import POSITION, SIZE, ChannelModel, FloatArray
from groundstation.systems.inertial.settings import InertialSettings
from groundstation.systems.inertial.starts import windows_of

WINDOW_METHODS = ("windows", "drift_windows", "consistent_windows")
WITH_COVARIANCE = ("last_estimate", *WINDOW_METHODS, "smoothed_start")
KEPT_GROWTHS = 256  # made last: every set of a bank asks for its own several times
LAG_STEP_S = 50.0  # of the double sum over a window; the covariance of the estimates changes little over it


def start_covariance(
    method: str, run: ChannelsRun, at: Int64Array, channel: int, settings: InertialSettings
) -> FloatArray:
    """Covariance of a method's start error, position known, shape (s, 6, 6).

    Parameters
    ----------
    method : str
        One of :data:`WITH_COVARIANCE`.
    run : ChannelsRun
    at : ndarray of int, shape (s,)
    channel : int
    settings : InertialSettings

    Raises
    ------
    KeyError
        For a method that has no covariance.
    """
    if method not in WITH_COVARIANCE:
        raise KeyError(method)
    if method == "last_estimate" or not len(at):
        out = np.array(run.covariance(channel)[at])
    elif method == "smoothed_start":
        out = _smoothed(run, at, channel, settings.smoothing_lag_s)
    else:
        out = _windowed(method, run, at, channel, settings)
    out[:, POSITION, :] = 0.0
    out[:, :, POSITION] = 0.0
    return out


def _smoothed(run: ChannelsRun, at: Int64Array, channel: int, lag_s: float) -> FloatArray:
    """Q(L) - Phi P(s|t) Phi' + Phi P(s) Psi' + its transpose; P(t) itself for L = 0."""
    time_s, group = run.epochs.time_s, min(channel, len(run.P) - 1)
    first = np.maximum(np.searchsorted(time_s, time_s[at] - lag_s, side="left"), 0)
    smoothed, closed = lag_covariances(run.parts[group], first, at)
    density = run.noise.densities()
    out = np.empty_like(smoothed)
    for row, seconds in enumerate(time_s[at] - time_s[first]):
        phi = run.model.transition_over(float(seconds))
        cross = phi @ run.P[group][first[row]] @ closed[row].T
        added = run.model.process_noise_over(float(seconds), density)
        out[row] = added - phi @ smoothed[row] @ phi.T + cross + cross.T
    return out


def _windowed(method: str, run: ChannelsRun, at: Int64Array, channel: int, settings: InertialSettings) -> FloatArray:
    time_s, P = run.epochs.time_s, run.covariance(channel)
    known = run.covariance_without_data - P  # of the estimates themselves
    lengths_s = windows_of(method, settings).lengths_s
    lags = np.arange(0.0, min(max(lengths_s), float(np.ptp(time_s))) + 1e-9, LAG_STEP_S)
    phi = np.stack([run.model.transition_over(float(lag)) for lag in lags])
    source = np.searchsorted(time_s, time_s[at][:, None] - lags + 1e-6, side="right") - 1
    counts = (source >= 0).sum(axis=1)
    out = np.array(P[at])
    for count in np.unique(counts):
        V, younger = _window_factors(method, lags[:count], phi[:count], lengths_s)
        rows = np.flatnonzero(counts == count)
        half = known[source[rows, :count]] @ V.transpose(0, 2, 1)  # (rows, lags, 6, 6)
        own, mixed = (np.sum(part @ half, axis=1) for part in (V, younger))
        out[rows] += own + mixed + np.swapaxes(mixed, 1, 2)
    return out


def _window_factors(
    method: str, lags: FloatArray, phi: FloatArray, lengths_s: tuple[float, ...]
) -> tuple[FloatArray, FloatArray]:
    """Return factors of the estimate at each lag in d, and in what younger ones share.

    Both have the shape (lags, 6, 6). An estimate is correlated with a younger one as with itself carried to it. The
    lags are equal steps: what is carried to one of them is that of the lag before, carried over one step more.
    """
    weights = _weights(lags, lengths_s)
    V = weights[:, :, None] * (phi if method == "consistent_windows" else np.eye(SIZE))
    V[0] -= np.eye(SIZE)
    younger = np.zeros_like(V)
    for lag in range(1, len(lags)):
        younger[lag] = (younger[lag - 1] + V[lag - 1]) @ phi[1]
    return V, younger


def _weights(lags: FloatArray, lengths_s: tuple[float, ...]) -> FloatArray:
    """Return the weight of each lag in the mean of each state, shape (lags, 6).

    All is on lag 0 for a state without window.
    """
    inside = lags[:, None] < np.maximum(np.array(lengths_s)[None, :], 1e-9)
    return np.asarray(inside / inside.sum(axis=0))


@dataclass(frozen=True)
class LeadGrowth:
    """Growth of a start at each lead: ``rows`` (l, 6) of Phi, and ``added_m2`` (l,) by noise.

    ``judge_m2`` (l,) is what GNSS errs at both ends, against which the forecast is judged.
    """

    rows: FloatArray
    added_m2: FloatArray
    judge_m2: FloatArray

    def variance(self, covariance: FloatArray) -> FloatArray:
        """Return the variance of the position error that builds up from starts (s, 6, 6).

        m^2, shape (s, l).
        """
        products = (self.rows[:, :, None] * self.rows[:, None, :]).reshape(len(self.rows), -1)
        carried = covariance.reshape(len(covariance), -1) @ products.T
        return np.asarray(np.maximum(carried, 0.0) + self.added_m2)


def lead_growth(run: ChannelsRun, lead_s: FloatArray) -> LeadGrowth:
    """Growth of a forecast's error over leads in equal steps from the first.

    Source: the model; errors of GNSS at the two ends are correlated as the noise of the class says.
    """
    gnss = run.noise.gnss
    first_s = float(lead_s[0]) if len(lead_s) else 0.0
    rows, added = _grown(run.model, tuple(run.noise.densities().tolist()), first_s, len(lead_s))
    decay = np.exp(-np.asarray(lead_s) / max(gnss.position_correlation_s, 1e-9))
    ends = 2.0 * (gnss.position_white_m**2 + gnss.position_correlated_m**2 * (1.0 - decay))
    return LeadGrowth(rows, added, ends)


@lru_cache(KEPT_GROWTHS)
def _grown(model: ChannelModel, density: tuple[float, ...], step_s: float, leads: int) -> tuple[FloatArray, FloatArray]:
    """Return rows (l, 6) of Phi and variances (l,) added by noise, both read-only.

    They are over leads in equal steps.
    """
    rows, added = np.zeros((leads, SIZE)), np.zeros(leads)
    phi = model.transition_over(step_s)
    once = model.process_noise_over(step_s, np.array(density))
    carried, noise = np.eye(SIZE), np.zeros((SIZE, SIZE))
    for lead in range(leads):
        carried, noise = phi @ carried, phi @ noise @ phi.T + once
        rows[lead], added[lead] = carried[POSITION], noise[POSITION, POSITION]
    return frozen(rows), frozen(added)
