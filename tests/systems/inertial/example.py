"""INS errors and forecasts by simple formulas (Schuler sine, growing drift): what viewer and report tests show."""

from dataclasses import replace
from typing import Any

import numpy as np

from groundstation.base.geodesy import latitude_longitude_deg
from groundstation.results.figures import FigureData
from groundstation.results.forecast_methods import FORECAST_HORIZONS_MIN, FORECAST_METHODS
from groundstation.results.roles import AzimuthEstimate
from groundstation.systems.inertial.answer import (
    ChannelResult,
    Difference,
    InertialResult,
    NavigationStart,
    OwnInnovation,
    RealOutage,
    StateEstimate,
)
from groundstation.systems.inertial.forecast_answer import (
    CalibrationRow,
    ClassicStart,
    CoupledRow,
    ForecastResult,
    GapRow,
    PhaseRow,
    SkillRow,
)
from tests.figure_arrays import figure

SCHULER_S = 5064.0
LONG_S = 16_000.0  # the paper's flight
RAW_M = dict(zip(FORECAST_HORIZONS_MIN, (90.0, 430.0, 840.0, 2110.0, 1790.0, 1210.0, 2710.0), strict=True))
FACTORS = dict(zip(FORECAST_METHODS, (1.0, 1.6, 0.6, 0.34, 0.30, 0.27, 0.31, 0.29, 0.26), strict=True))
STATES = (
    ("position", "position error", "m"),
    ("velocity", "velocity error", "mps"),
    ("tilt", "platform tilt", "arcsec"),
    ("drift", "constant gyro drift", "dph"),
    ("drift_rate", "drift rate", "dphph"),
    ("random_drift", "random gyro drift", "dph"),
)


def error_m(channel: str, time_s: Any) -> Any:
    """Position error of the channel: a Schuler sine over a trend."""
    size, phase, trend = {"north": (900.0, 0.4, 0.05), "east": (700.0, 1.9, -0.11)}[channel]
    return size * (np.sin(2 * np.pi * np.asarray(time_s) / SCHULER_S + phase) - np.sin(phase)) + trend * time_s


def _states(time: Any, gone: Any, rng: np.random.Generator) -> FigureData:
    since = time - np.maximum.accumulate(np.where(gone, -np.inf, time))
    settling = np.exp(-time / (0.08 * time[-1]))
    columns: dict[str, Any] = {"time_s": time, "is_forecast": gone, "is_gnss_used": ~gone}
    for channel in ("north", "east"):
        truth = error_m(channel, time)
        velocity = np.gradient(truth, time)
        measured = np.where(gone, np.nan, truth + rng.normal(0.0, 6.0, len(time)))
        columns |= {
            f"measured_{channel}_position_m": measured,
            f"measured_{channel}_velocity_mps": np.where(gone, np.nan, velocity + rng.normal(0.0, 0.08, len(time))),
            f"{channel}_position_m": truth + 12.0 * settling + 0.05 * since,
            f"{channel}_position_sigma_m": 4.0 + 20.0 * settling + 0.2 * since,
            f"{channel}_velocity_mps": velocity + 0.2 * settling,
            f"{channel}_velocity_sigma_mps": 0.03 + 0.4 * settling + 2e-4 * since,
            f"{channel}_tilt_arcsec": 12.0 * np.cos(2 * np.pi * time / SCHULER_S) + 8.0 * settling,
            f"{channel}_tilt_sigma_arcsec": 1.5 + 12.0 * settling + 0.004 * since,
            f"{channel}_drift_dph": 0.011 + 0.02 * settling * np.sin(time / 400.0),
            f"{channel}_drift_sigma_dph": 0.004 + 0.02 * settling,
            f"{channel}_drift_rate_dphph": 0.003 * (1.0 - settling),
            f"{channel}_drift_rate_sigma_dphph": 0.003 + 0.003 * settling,
            f"{channel}_random_drift_dph": 0.003 * np.sin(time / 900.0),
            f"{channel}_random_drift_sigma_dph": np.full(len(time), 0.004),
            f"smoothed_{channel}_position_m": truth,
            f"smoothed_{channel}_velocity_mps": velocity,
            f"{channel}_normalised_innovation": np.where(gone, np.nan, rng.normal(0.0, 0.95, len(time))),
        }
    return figure("inertial_states", **columns)


def _observability(time: Any) -> FigureData:
    columns: dict[str, Any] = {"time_s": time}
    for channel in ("north", "east"):
        for place, (name, _, _) in enumerate(STATES):
            columns[f"{channel}_{name}"] = (1.0 - 0.16 * place) * (
                1.0 - np.exp(-time / ((0.02 + 0.05 * place) * LONG_S))
            )
    return figure("inertial_observability", **columns)


def _track(states: FigureData) -> FigureData:
    time = states["time_s"]
    gone = states["is_forecast"]
    north, east = 120.0 * time, 160.0 * time
    columns: dict[str, Any] = {"time_s": time}
    errors = {name: (error_m("north", time), error_m("east", time)) for name in ("ins",)}
    errors["gnss"] = (np.where(gone, np.nan, 0.0), np.where(gone, np.nan, 0.0))
    left = [states[f"{name}_position_m"] - error_m(name, time) for name in ("north", "east")]
    errors["corrected"] = (-left[0], -left[1])
    errors["reference"] = (np.zeros(len(time)), np.zeros(len(time)))
    for name, (north_error, east_error) in errors.items():
        latitude, longitude = latitude_longitude_deg(north + north_error, east + east_error, 56.0, 38.0)
        columns |= {f"{name}_latitude_deg": latitude, f"{name}_longitude_deg": longitude}
    columns["ins_error_m"] = np.where(gone, np.nan, np.hypot(*errors["ins"]))
    columns["corrected_error_m"] = np.where(gone, np.nan, np.hypot(*errors["corrected"]) + 4.0)
    return figure("inertial_track", **columns)


def inertial_figures(duration_s: float = LONG_S, epochs: int = 2000, seed: int = 5) -> tuple[FigureData, ...]:
    """Figures of the estimator over a flight with one real outage at six tenths of it and one that lasts to the end."""
    rng = np.random.default_rng(seed)
    time = np.linspace(0.0, duration_s, epochs)
    gone = ((time > 0.6 * duration_s) & (time < 0.68 * duration_s)) | (time > 0.97 * duration_s)
    states = _states(time, gone, rng)
    return states, _observability(time), _track(states)


def channel_result(name: str) -> ChannelResult:
    """One channel at the end of the flight."""
    values = ((812.4, 4.1), (-0.42, 0.03), (11.2, 1.5), (0.0113, 0.004), (0.0029, 0.003), (0.0021, 0.004))
    observability = (0.98, 0.94, 0.81, 0.62, 0.31, 0.08)
    states = tuple(
        StateEstimate(state, title, unit, value, sigma, seen, None if seen < 0.5 else 300.0 * place)
        for place, ((state, title, unit), (value, sigma), seen) in enumerate(
            zip(STATES, values, observability, strict=True)
        )
    )
    return ChannelResult(name, states, 0.97, 0.93, 1.07, 0.953, 15_210, 12, 0.61, 744.0)


def inertial_result(duration_s: float = LONG_S, **changes: Any) -> InertialResult:
    """An INS of navigation grade, in full; ``changes`` replace fields."""
    start, end = 0.6 * duration_s, 0.68 * duration_s
    whole = InertialResult(
        ins_topic="ins",
        gnss_topic="gnss",
        ins_class="navigation",
        ins_class_origin="chosen by the spread of the velocity error",
        kind="unaided",
        kind_reason="the position error grows to 2.1 km and swings with the Schuler period",
        transition="exact",
        epochs=15_222,
        gnss_seconds=0.92 * duration_s,
        north=channel_result("north"),
        east=channel_result("east"),
        radial_error_rate_50_nmiph=0.41,
        radial_error_rate_95_nmiph=1.32,
        radial_error_rate_fit_nmiph=0.37,
        velocity_error_rms_mps=0.87,
        largest_radial_error_m=2140.0,
        navigation_start=NavigationStart(
            0.0, "standstill", "the log begins at a standstill, with the INS 3 m from GNSS"
        ),
        radial_error_first_m=3.0,
        radial_error_last_m=1900.0,
        compared_hours=duration_s / 3600.0,
        outages=(
            RealOutage(start, end, end - start, 212.0, 260.0),
            RealOutage(0.97 * duration_s, duration_s, 0.03 * duration_s, None, None, "gnss"),
        ),
        azimuth=AzimuthEstimate(True, 0.042, 0.015, 7, 410.0, "seven turns, 410 m/s of velocity change"),
        settings={"position_sigma_m": 6.0, "correlation_time_s": 300.0, "beta_per_h": 1.0, "velocity_used": False},
        figures=inertial_figures(duration_s),
    )
    return replace(whole, **changes)


# Changes that make of inertial_result() the answer for an INS that GNSS corrects.
AIDED: dict[str, Any] = {
    "kind": "gnss_aided",
    "kind_reason": "its own mode says so",
    "north": None,
    "east": None,
    "outages": (),
    "azimuth": None,
    "radial_error_rate_50_nmiph": None,
    "radial_error_rate_95_nmiph": None,
    "radial_error_rate_fit_nmiph": None,
    "velocity_error_rms_mps": None,
    "largest_radial_error_m": None,
    "navigation_start": None,
    "radial_error_first_m": None,
    "radial_error_last_m": None,
    "compared_hours": None,
    "differences": (
        Difference("position", "north", "m", 600, 0.2, 1.0, 2.5, 9.0),
        Difference("position", "horizontal", "m", 600, 1.3, 1.2, 3.0, 10.0),
        Difference("velocity", "east", "mps", 600, -0.02, 0.1, 0.4, 1.5),
    ),
    "own_filter": "EKF3",
    "own_innovations": (OwnInnovation("velocity", "east", "mps", 3000, -0.01, 0.1, 0.3, 0.2, 0.91, 0.04),),
}


def aided_figures(duration_s: float, rows: int = 200) -> tuple[FigureData, ...]:
    """Figures of an INS that GNSS corrects: differences, and the innovations of its filter with their sigma."""
    time, rng = np.linspace(0.0, duration_s, rows), np.random.default_rng(6)
    columns: dict[str, Any] = {"time_s": time}
    sigmas: dict[str, Any] = {}
    for channel in ("north", "east"):
        for name, suffix, size in (("position", "m", 1.5), ("velocity", "mps", 0.2)):
            columns[f"{channel}_{name}_{suffix}"] = rng.normal(0.0, size, rows)
            sigmas[f"{channel}_{name}_sigma_{suffix}"] = np.full(rows, size)
    return figure("inertial_differences", **columns), figure("inertial_own_innovations", **columns, **sigmas)


def _map(duration_s: float) -> FigureData:
    starts = np.linspace(0.3 * duration_s, 0.9 * duration_s, 60)
    horizons = np.arange(2.0, 121.0, 2.0)
    start, horizon = (grid.ravel() for grid in np.meshgrid(starts, horizons, indexing="ij"))
    later = start + 60.0 * horizon
    built = [error_m(name, later) - error_m(name, start) for name in ("north", "east")]
    raw = np.hypot(*built)
    raw[later > max(duration_s, starts[0] + 7300.0)] = np.nan
    columns = {f"{name}_m": raw * factor * (1.0 + 0.2 * np.sin(start / 700.0)) for name, factor in FACTORS.items()}
    columns["raw_ins_m"] = raw
    return figure("forecast_map", start_s=start, horizon_min=horizon, **columns)


def _fan(duration_s: float) -> FigureData:
    starts, leads = np.linspace(0.3 * duration_s, 0.8 * duration_s, 9), np.arange(0.0, 7201.0, 60.0)
    start, lead = (grid.ravel() for grid in np.meshgrid(starts, leads, indexing="ij"))
    columns: dict[str, Any] = {"start_s": start, "lead_s": lead}
    for name in ("north", "east"):
        actual = error_m(name, start + lead) - error_m(name, start)
        columns[f"{name}_m"] = actual * (0.8 + 0.1 * np.sin(start / 900.0)) + 0.02 * lead
        columns[f"{name}_sigma_m"] = 5.0 + 0.05 * lead
        columns[f"actual_{name}_m"] = np.where(start + lead > max(duration_s, starts[0] + 7300.0), np.nan, actual)
    return figure("forecast_fan", **columns)


def _classic(duration_s: float) -> FigureData:
    parts = []
    for hours in (1.5, 2.0, 2.5, 3.0):
        time = np.arange(3600.0 * hours, duration_s, 60.0)
        lead = time - time[0]
        actual = error_m("east", time) - error_m("east", time[0])
        parts.append(np.column_stack([np.full(len(time), 3600.0 * hours), time, actual, 0.6 * actual + 0.1 * lead]))
    start, time, measured, last = np.concatenate(parts).T
    return figure(
        "forecast_classic",
        start_s=start,
        time_s=time,
        measured_east_m=measured,
        last_estimate_east_m=last,
        windows_east_m=0.5 * (last + measured),
        default_east_m=0.4 * last + 0.6 * measured,
    )


def forecast_figures(duration_s: float = LONG_S) -> tuple[FigureData, ...]:
    """Figures of the forecast; the classic starts where the flight is long enough for them."""
    growth = {f"{name}_rms_m": [factor * RAW_M[h] for h in FORECAST_HORIZONS_MIN] for name, factor in FACTORS.items()}
    figures = [
        _map(duration_s),
        _fan(duration_s),
        figure(
            "forecast_growth",
            horizon_min=[float(horizon) for horizon in FORECAST_HORIZONS_MIN],
            starts=[43, 42, 41, 37, 31, 25, 19],
            **growth,
            sigma_m=[30.0, 110.0, 220.0, 520.0, 640.0, 700.0, 900.0],
        ),
    ]
    return (*figures, _classic(duration_s)) if duration_s > 4.0 * 3600.0 else tuple(figures)


def forecast_result(duration_s: float = LONG_S, **changes: Any) -> ForecastResult:
    """Forecast skill in full; ``changes`` replace fields."""
    without_band = ("raw_ins", "hold_velocity", "schuler_fit")
    skill = tuple(
        SkillRow(
            *(method, float(horizon), 43 - horizon // 5, factor * RAW_M[horizon]),
            *(0.7 * factor * RAW_M[horizon], 1.9 * factor * RAW_M[horizon]),
            *((None, None) if method in without_band else (0.94, 0.71)),
        )
        for method, factor in FACTORS.items()
        for horizon in FORECAST_HORIZONS_MIN
    )
    whole = ForecastResult(
        default_method="drift_windows",
        first_start_s=0.3 * duration_s,
        start_step_s=300.0,
        is_calibrated=True,
        calibration_reason="",
        skill=skill,
        gaps=tuple(
            GapRow(method, float(length), 30, size, 0.95)
            for method, sizes in (("forward", (65.0, 419.0, 1029.0, 1400.0)), ("rts", (7.0, 34.0, 111.0, 331.0)))
            for length, size in zip((10, 30, 60, 90), sizes, strict=True)
        ),
        phases=(
            *(
                PhaseRow("airborne", length, 31, 0.4 * length, 0.9 * length, is_early=False)
                for length in (10.0, 60.0, 600.0, 3600.0)
            ),
            PhaseRow("taxi", 60.0, 4, 12.0, 30.0, is_early=True),
        ),
        classic_starts=tuple(
            ClassicStart(hours, method, 60.0, size / hours, -0.8 * size / hours)
            for hours in (1.5, 2.0, 2.5, 3.0)
            for method, size in (("raw_ins", 2700.0), ("last_estimate", 1500.0), ("windows", 1300.0))
        ),
        calibration=tuple(
            CalibrationRow(method, float(h), 31, 6, 0.48, 0.70, share, nees, 0.6, 1.5, 1.8)
            for method, share, nees in (("drift_windows", 0.94, 1.1), ("windows", 0.81, 2.3))
            for h in (10, 30, 60, 90, 120)
        ),
        coupled=tuple(
            CoupledRow(float(h), 0.98 * FACTORS["last_estimate"] * RAW_M[h], 0.02) for h in FORECAST_HORIZONS_MIN
        ),
        best_method={str(horizon): "drift_windows" for horizon in FORECAST_HORIZONS_MIN},
        figures=forecast_figures(duration_s),
    )
    return replace(whole, **changes)
