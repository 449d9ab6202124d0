"""Smoothers over a filter's run: fixed interval, fixed lag, covariances of a lag.

The covariances are those between the two epochs of a lag.
"""

from dataclasses import fields

import numpy as np

from groundstation.base.dataclasses import dataclass
from groundstation.base.records import Int64Array, frozen
from groundstation.methods.kalman.arrays import (
    Back,
    Dynamics,
    FilterRecord,
    FloatArray,
    MeasurementRows,
    Schedule,
    States,
)
from groundstation.methods.kalman.filter import FilterRun


@dataclass(frozen=True)
class Smoothed:
    """Smoothed states (n, states, c) and their variances (n, states).

    They are NaN outside the interval asked for.
    """

    x: FloatArray
    variance: FloatArray

    def __post_init__(self) -> None:
        for item in fields(self):
            object.__setattr__(self, item.name, frozen(getattr(self, item.name)))


def smooth(run: FilterRun, begin: int = 0, end: int | None = None) -> Smoothed:
    """Smooth epochs ``begin`` to ``end`` (both included) with the data up to ``end``.

    Raises
    ------
    ValueError
        Where the run kept too little, or held states: a smoother goes back over optimal gains alone.

    Source: Rauch, Tung, Striebel, 1965, in the form of Bryson and Frazier (Bierman, 1973).
    """
    from groundstation.methods.kalman import smoother_runs

    last = len(run.schedule.step) - 1 if end is None else end
    x, variance = np.full(run.x.shape, np.nan), np.full(run.x.shape[:2], np.nan)
    smoother_runs.run_smoother(*_history(run), begin, last, x, variance)
    return Smoothed(x, variance)


def smooth_lags(run: FilterRun, begin: Int64Array, end: Int64Array) -> FloatArray:
    """Smooth epoch ``begin[i]`` with the data up to ``end[i]``, for each i.

    The result is the states alone, shape (s, states, c).
    """
    from groundstation.methods.kalman import smoother_runs

    past = np.empty((len(begin), *run.x.shape[1:]))
    smoother_runs.run_fixed_lag(*_history(run), _index(begin), _index(end), past)
    return past


def lag_covariances(run: FilterRun, begin: Int64Array, end: Int64Array) -> tuple[FloatArray, FloatArray]:
    """Return the covariance of epoch ``begin[i]`` given the data up to ``end[i]``, for each i.

    The second result tells how errors travel from one epoch to the other.

    Returns
    -------
    smoothed : ndarray, shape (s, states, states)
    closed : ndarray, shape (s, states, states)
        Product of (I - K h) F from begin to end: error at end that an error at begin leaves.
    """
    from groundstation.methods.kalman import smoother_runs

    smoothed, closed = (np.empty((len(begin), *run.P.shape[1:])) for _ in range(2))
    smoother_runs.run_lag_covariance(*_history(run), _index(begin), _index(end), smoothed, closed)
    return smoothed, closed


def _history(run: FilterRun) -> tuple[States, Dynamics, Schedule, MeasurementRows, FilterRecord, Back]:
    """Return what the smoothers go back over, and their working arrays.

    Raises
    ------
    ValueError
        Where the run kept too little, or held states: a smoother goes back over optimal gains alone.
    """
    n = len(run.schedule.step)
    if not run.is_optimal:
        raise ValueError("a run with held states cannot be smoothed: estimate them")
    if not len(run.x) == len(run.P) == n or len(run.record.K) != len(run.measurements):
        raise ValueError("smoothing needs states, covariances and gains: run the filter with them kept")
    size, channels = run.x.shape[1:]
    A, C, w = (np.zeros((size, size)) for _ in range(3))
    room = Back(np.zeros((channels, size)), A, C, w, np.zeros(size))
    return run.transition.states, run.transition.dynamics, run.schedule, run.measurements.lines, run.record, room


def _index(values: Int64Array) -> Int64Array:
    return frozen(np.ascontiguousarray(values, dtype=np.int64))
