"""Plots of the navigation between aircraft of two sessions over each other."""

import numpy as np

from groundstation.chapters.plots.comparison import Compared, Overlay, TimeLine, overlaid
from groundstation.results.files import SavedFlight
from groundstation.systems.cooperative.answer import CooperativeResult
from groundstation.systems.cooperative.arrays import CooperativeTracks, SessionErrors


def session_errors(saved: SavedFlight) -> SessionErrors | None:
    """Return the worst computed 2 sigma_r and the RMS error of all aircraft with time.

    The algorithm is the default one; None for a flight.
    """
    answer, tracks = saved.results.answer(CooperativeResult), saved.rows_of(CooperativeTracks)
    if answer is None or tracks is None:
        return None
    rows = tracks.algorithm == answer.default_algorithm
    time_s, epoch = np.unique(np.round(tracks.time_s[rows], 3), return_inverse=True)
    worst_m, error_m = np.full(len(time_s), np.nan), tracks.error_m[rows]
    np.fmax.at(worst_m, epoch, tracks.two_sigma_r_m[rows])
    known = np.isfinite(error_m)
    counts = np.bincount(epoch[known], minlength=len(time_s))
    squares = np.bincount(epoch[known], error_m[known] ** 2, minlength=len(time_s))
    rms_m = np.sqrt(np.divide(squares, counts, out=np.full(len(time_s), np.nan), where=counts > 0))
    return SessionErrors(time_s=time_s, two_sigma_r_m=worst_m, rms_error_m=rms_m)


def _computed(data: SessionErrors) -> TimeLine:
    return TimeLine(data.time_s, data.two_sigma_r_m)


def _error(data: SessionErrors) -> TimeLine:
    return TimeLine(data.time_s, data.rms_error_m)


COMPARED = Compared(
    "cooperative",
    "Cooperative",
    overlaid(
        Overlay(
            SessionErrors,
            "two_sigma_r_m",
            _computed,
            "2σ_r as computed, m",
            "2σ_r as computed, worst aircraft",
            session_errors,
        ),
        Overlay(
            SessionErrors,
            "rms_error_m",
            _error,
            "RMS error, m",
            "Horizontal error against the truth, RMS of all aircraft",
            session_errors,
        ),
    ),
    (("session_errors-two_sigma_r_m",), ("session_errors-rms_error_m",)),
)
