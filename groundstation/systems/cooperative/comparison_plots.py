"""Plots of the navigation between aircraft of two sessions over each other."""

from groundstation.chapters.plots.comparison import Compared, Overlay, TimeLine, overlaid
from groundstation.systems.cooperative.arrays import SessionErrors
from groundstation.systems.cooperative.errors_arrays import session_errors


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
