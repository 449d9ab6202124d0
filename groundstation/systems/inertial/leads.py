"""Starts and leads of forecasts: when they begin, and how errors build up.

The build-up is that shown by GNSS and that of states carried along by a model.
"""

from functools import lru_cache

import numpy as np

from groundstation.base.dataclasses import dataclass
from groundstation.base.records import Int64Array, frozen
from groundstation.methods.kalman.filter import forecast_driven
from groundstation.systems.inertial.filter import ChannelsRun, DifferenceEpochs
from groundstation.systems.inertial.model import POSITION, SIZE, VELOCITY, ChannelModel, FloatArray

NEAREST_S = 1.0
PAST_FROM_S = 1800.0  # outages replayed from here on tell of later ones
KEPT_ROWS = 64  # of the growths of the position made last: methods and sets of a bank share a few models
MEMORY_S = 1200.0  # errors of outages that start nearer than this to each other are not independent


def start_epochs(epochs: DifferenceEpochs, first_s: float, step_s: float) -> Int64Array:
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


def leads_of(step_s: float, longest_s: float) -> FloatArray:
    """Leads in equal steps up to the longest (the last one whole step below it, at least one)."""
    return step_s * np.arange(1, max(1, int(longest_s / step_s + 1e-6)) + 1, dtype=np.float64)


def built_up(epochs: DifferenceEpochs, at: Int64Array, lead_s: FloatArray) -> FloatArray:
    """Return the position error built up from each start to each lead, as GNSS showed it.

    Shape (s, l, c), NaN unknown. Unknown too where the INS was reset in between: what built up then is none of the
    forecast's.
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


def nearest_s(epochs: DifferenceEpochs) -> float:
    """Return how far from a start or lead the epoch compared with it may be.

    It is one interval of GNSS, a second at least.
    """
    return max(NEAREST_S, epochs.gnss_intervals_s[0])


@dataclass(frozen=True)
class Path:
    """Forecasts from s starts over l leads, in steps carried out one by one.

    Parameters
    ----------
    start_s, lead_s : ndarrays, shapes (s,), (l,)
    known_m : ndarray, shape (s, c)
        Position error at each start: as GNSS showed it, as estimated where it did not.
    drag : ndarray, shape (steps, 2, 2, s)
        Known drag of each step: the INS itself knows where it flies.
    step_s : float
    every : int
        Steps from one lead to the next.
    """

    start_s: FloatArray
    lead_s: FloatArray
    known_m: FloatArray
    drag: FloatArray
    step_s: float
    every: int

    @classmethod
    def of(cls, run: ChannelsRun, at: Int64Array, lead_s: FloatArray, longest_step_s: float) -> "Path":
        """Make a path from epochs ``at`` over leads in equal steps from the first."""
        epochs = run.epochs
        start_s, lead_step = epochs.time_s[at], float(lead_s[0]) if len(lead_s) else longest_step_s
        every = max(1, round(lead_step / longest_step_s))
        step_s = lead_step / every
        when = (np.arange(every * len(lead_s)) + 0.5)[:, None] * step_s + start_s[None, :]
        nearest = np.minimum(np.searchsorted(epochs.time_s, when), len(epochs) - 1)
        drag = np.ascontiguousarray(np.moveaxis(epochs.drag_per_s[nearest], 1, 3) * step_s)
        known = np.where(np.isfinite(epochs.position_m[at]), epochs.position_m[at], run.x[at, POSITION])
        return cls(start_s, np.asarray(lead_s), known, drag, step_s, every)

    def carried(self, model: ChannelModel | None, states: FloatArray) -> FloatArray:
        """Return what states (s, 6, c) at the starts build up to, shape (s, l, c).

        Without a model the velocity is held.
        """
        (count, _, channels), leads = states.shape, len(self.lead_s)
        if not count or not leads:
            return np.zeros((count, leads, channels))
        rows = growth_rows(model, self.step_s, self.every * leads)
        growth = (rows @ states.transpose(1, 2, 0).reshape(SIZE, -1)).reshape(len(rows), channels, count)
        start = states[:, POSITION].T
        if channels == self.drag.shape[1]:
            built = forecast_driven(growth, self.drag, self.known_m.T, self.every, start)
        else:
            built = start + np.cumsum(growth, axis=0)[self.every - 1 :: self.every]
        return np.ascontiguousarray(built.transpose(2, 0, 1))


@lru_cache(KEPT_ROWS)
def growth_rows(model: ChannelModel | None, step_s: float, steps: int) -> FloatArray:
    """Return the growth of the position over each step for each state at the start.

    Shape (steps, 6). No other state depends on the position. Without a model the velocity is held.
    """
    phi = np.eye(SIZE)
    if model is None:
        phi[POSITION, VELOCITY] = step_s
    else:
        phi = model.transition_over(step_s)
    rows = (phi[POSITION] - np.eye(SIZE)[POSITION])[None]
    while len(rows) < steps:  # phi is over as many steps as there are rows
        rows, phi = np.concatenate([rows, rows @ phi]), phi @ phi
    return frozen(rows[:steps])


def past_mean(
    values: FloatArray, start_s: FloatArray, lead_s: float, at_s: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Average over the outages that had ended by some times.

    Also returns how many independent outages they are.

    Parameters
    ----------
    values : ndarray, shape (s, k)
        Of the outages that begin at ``start_s`` (s,) and last ``lead_s``; NaN where one could not be judged.
    at_s : ndarray, shape (t,)

    Returns
    -------
    ndarrays, shapes (t, k), (t,)
        Zero where none was over.
    """
    if not len(start_s):
        return np.zeros((len(at_s), values.shape[1])), np.zeros(len(at_s))
    known = np.asarray(np.isfinite(values).all(axis=1), dtype=np.float64)
    sums, counts = (
        np.concatenate([np.zeros_like(part[:1]), np.cumsum(part, axis=0)])
        for part in (np.where(known[:, None] > 0.0, values, 0.0), known)
    )
    over = np.searchsorted(start_s, at_s - lead_s + 1e-6, side="right")
    number = counts[over]
    span = start_s[np.maximum(over - 1, 0)] - start_s[0]
    independent = np.where(number > 0.0, 1.0 + span / max(lead_s, MEMORY_S), 0.0)
    return sums[over] / np.maximum(number, 1.0)[:, None], independent
