"""Arrays behind the figures of system 2, thinned to what a page or a viewer can show."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from groundstation.base.angles import wrap_180
from groundstation.base.geodesy import curvature_radii_m
from groundstation.base.records import BoolArray, Int64Array
from groundstation.estimators.inertial.differences import Differences
from groundstation.estimators.inertial.filter import FilterRun, Smoothed
from groundstation.estimators.inertial.hindcast import Hindcast
from groundstation.estimators.inertial.model import POSITION, STATES, VELOCITY, FloatArray
from groundstation.estimators.inertial.noise import RADPS2_PER_DPHPH, RADPS_PER_DPH
from groundstation.estimators.inertial.skill import Claimed
from groundstation.results.figures import FigureData
from groundstation.tables.own_filter import OwnInnovations
from groundstation.tables.table import Flight

CHANNELS = ("north", "east")
ROWS = 4000
FAN_STARTS = 60
ARCSEC_PER_RAD = 180.0 / np.pi * 3600.0
# name of each state, its unit in the figures, and how many of it are one SI unit
SHOWN = (
    ("position", "m", 1.0),
    ("velocity", "mps", 1.0),
    ("tilt", "arcsec", ARCSEC_PER_RAD),
    ("drift", "dph", 1.0 / RADPS_PER_DPH),
    ("drift_rate", "dphph", 1.0 / RADPS2_PER_DPHPH),
    ("random_drift", "dph", 1.0 / RADPS_PER_DPH),
)
DIGITS = {"time_s": 2, "start_s": 1, "lead_s": 1, "horizon_min": 2}


def thinned(count: int) -> Int64Array:
    """Epochs that are shown: evenly spaced, the last among them."""
    return np.unique(np.linspace(0, count - 1, min(count, ROWS)).round().astype(np.int64))


def states_figure(run: FilterRun, smoothed: Smoothed) -> FigureData:
    """States with sigma, what was measured, and the smoothed errors, over time."""
    rows = thinned(len(run.epochs))
    epochs = run.epochs
    has_gnss = epochs.has_gnss[rows]
    columns: dict[str, NDArray[Any]] = {"time_s": epochs.time_s[rows], "is_forecast": ~has_gnss}
    columns["gnss_used"] = (run.used[rows] == 1).any(axis=(1, 2))
    digits = dict(DIGITS)
    for channel, name in enumerate(CHANNELS):
        sigma = run.sigma(channel)
        columns[f"measured_{name}_position_m"] = epochs.position_m[rows, channel]
        columns[f"measured_{name}_velocity_mps"] = epochs.velocity_mps[rows, channel]
        for state, (title, unit, factor) in enumerate(SHOWN):
            columns[f"{name}_{title}_{unit}"] = factor * run.x[rows, state, channel]
            columns[f"{name}_{title}_sigma_{unit}"] = factor * sigma[rows, state]
        columns[f"smoothed_{name}_position_m"] = smoothed.x[rows, POSITION, channel]
        columns[f"smoothed_{name}_velocity_mps"] = smoothed.x[rows, VELOCITY, channel]
        columns[f"{name}_normalised_innovation"] = _normalised(run, channel)[rows]
    digits |= {name: 5 for name in columns if name.endswith(("_dph", "_dphph"))}
    return FigureData("inertial_states", columns, digits)


def _normalised(run: FilterRun, channel: int) -> FloatArray:
    """Innovation of the position over its sigma, of the velocity where no position was measured."""
    ratio = run.innovation[:, :, channel] / np.sqrt(run.innovation_variance[:, :, channel])
    return np.where(np.isfinite(ratio[:, 0]), ratio[:, 0], ratio[:, 1])


def observability_figure(run: FilterRun, observability: FloatArray) -> FigureData:
    """How far each state's sigma is below what it would be without GNSS; ``observability`` has shape (n, 6, c)."""
    rows = thinned(len(run.epochs))
    columns: dict[str, FloatArray] = {"time_s": run.epochs.time_s[rows]}
    for channel, name in enumerate(CHANNELS):
        columns |= {f"{name}_{state}": observability[rows, index, channel] for index, state in enumerate(STATES)}
    return FigureData("inertial_observability", columns, DIGITS)


def track_figure(compared: Differences, corrected_m: FloatArray, smoothed_m: FloatArray) -> FigureData:
    """Track of the INS, of GNSS, of the INS minus its estimated error, and minus its smoothed error."""
    measured = compared.epochs.position_m
    rows = thinned(len(measured))
    errors_m = {"ins": np.zeros_like(measured), "gnss": measured, "corrected": corrected_m, "reference": smoothed_m}
    columns = _tracks(compared, rows, errors_m)
    columns["ins_error_m"] = np.hypot(*measured.T)[rows]
    columns["corrected_error_m"] = np.hypot(*(measured - corrected_m).T)[rows]
    return _track_figure(columns)


def plain_track_figure(compared: Differences) -> FigureData:
    """Track of the INS and of GNSS."""
    measured = compared.epochs.position_m
    errors_m = {"ins": np.zeros_like(measured), "gnss": measured}
    return _track_figure(_tracks(compared, thinned(len(measured)), errors_m))


def _track_figure(columns: dict[str, FloatArray]) -> FigureData:
    return FigureData("inertial_track", columns, DIGITS | {name: 7 for name in columns if name.endswith("_deg")})


def _tracks(compared: Differences, rows: Int64Array, errors_m: Mapping[str, FloatArray]) -> dict[str, FloatArray]:
    columns: dict[str, FloatArray] = {"time_s": compared.epochs.time_s[rows]}
    for name, error_m in errors_m.items():
        latitude, longitude = moved(compared, error_m)
        columns |= {f"{name}_latitude_deg": latitude[rows], f"{name}_longitude_deg": longitude[rows]}
    return columns


def differences_figure(compared: Differences) -> FigureData:
    """INS minus GNSS over time."""
    epochs = compared.epochs
    rows = thinned(len(epochs))
    columns: dict[str, FloatArray] = {"time_s": epochs.time_s[rows]}
    for channel, name in enumerate(CHANNELS):
        columns[f"{name}_position_m"] = epochs.position_m[rows, channel]
        columns[f"{name}_velocity_mps"] = epochs.velocity_mps[rows, channel]
    return FigureData("inertial_differences", columns, DIGITS)


def own_innovations_figure(flight: Flight, own: OwnInnovations) -> FigureData:
    """Innovations of the INS's own filter over time, with its sigma where it logs one."""
    rows = thinned(len(own.time_ns))
    columns: dict[str, FloatArray] = {"time_s": flight.seconds(own.time_ns[rows])}
    for channel, name in enumerate(CHANNELS):
        for place, (quantity, unit) in enumerate((("position", "m"), ("velocity", "mps"))):
            columns[f"{name}_{quantity}_{unit}"] = own.innovation[rows, place, channel]
            columns[f"{name}_{quantity}_sigma_{unit}"] = np.sqrt(own.variance[rows, place, channel])
    return FigureData("inertial_own_innovations", columns, DIGITS)


def moved(compared: Differences, error_m: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Position of the INS minus an error in metres."""
    meridian, prime_vertical = curvature_radii_m(np.nan_to_num(compared.latitude_deg))
    height = np.nan_to_num(compared.altitude_m)
    latitude = compared.latitude_deg - np.rad2deg(error_m[:, 0] / (meridian + height))
    parallel = (prime_vertical + height) * np.cos(np.deg2rad(latitude))
    longitude = compared.longitude_deg - np.rad2deg(error_m[:, 1] / parallel)
    return latitude, np.where(np.isfinite(longitude), wrap_180(np.nan_to_num(longitude)), np.nan)


def map_figure(replay: Hindcast) -> FigureData:
    """Radial error by start and lead, one column per method."""
    starts, leads = len(replay.start_s), len(replay.lead_s)
    columns: dict[str, FloatArray] = {
        "start_s": np.repeat(replay.start_s, leads),
        "horizon_min": np.tile(replay.lead_s / 60.0, starts),
    }
    columns |= {f"{method}_m": replay.radial_m(method).ravel() for method in replay.forecast_m}
    return FigureData("forecast_map", columns, DIGITS | {name: 1 for name in columns if name.endswith("_m")})


def growth_figure(replay: Hindcast, claimed: Claimed | None) -> FigureData:
    """RMS over the starts at every lead, one column per method, and what the default method claims."""
    known = np.asarray(np.isfinite(replay.actual_m).all(axis=2))
    starts = known.sum(axis=0)
    columns: dict[str, FloatArray] = {"horizon_min": replay.lead_s / 60.0, "starts": starts}
    for method in replay.forecast_m:
        columns[f"{method}_rms_m"] = _rms(replay.radial_m(method), known)
    if claimed is not None:
        radial = np.sqrt(np.sum(np.square(claimed.scaled_m), axis=2))
        columns["sigma_m"] = _rms(radial, known)
    return FigureData("forecast_growth", columns, DIGITS | {name: 1 for name in columns if name.endswith("_m")})


def _rms(values: FloatArray, known: BoolArray) -> FloatArray:
    total = np.sum(np.square(np.where(known, values, 0.0)), axis=0)
    count = known.sum(axis=0)
    return np.asarray(np.sqrt(np.where(count > 0, total / np.maximum(count, 1), np.nan)))


def fan_figure(replay: Hindcast, method: str, claimed: Claimed | None) -> FigureData:
    """Forecast, its sigma and what GNSS showed, of some starts."""
    step = max(1, -(-len(replay.at) // FAN_STARTS))
    picked, leads = np.arange(0, len(replay.at), step), len(replay.lead_s)
    columns: dict[str, FloatArray] = {
        "start_s": np.repeat(replay.start_s[picked], leads),
        "lead_s": np.tile(replay.lead_s, len(picked)),
    }
    for channel, name in enumerate(CHANNELS):
        columns[f"{name}_m"] = replay.forecast_m[method][picked, :, channel].ravel()
        sigma = np.full_like(replay.actual_m, np.nan) if claimed is None else claimed.scaled_m
        columns[f"{name}_sigma_m"] = sigma[picked, :, channel].ravel()
        columns[f"actual_{name}_m"] = replay.actual_m[picked, :, channel].ravel()
    return FigureData("forecast_fan", columns, DIGITS | {name: 1 for name in columns if name.endswith("_m")})


def classic_figure(replay: Hindcast, known_m: FloatArray, default_method: str) -> FigureData:
    """The paper's figure 2: error east of the whole rest of the flight, measured and forecast, for its four starts.

    ``known_m`` is the measured position error at each start, shape (s, c): errors are shown, not their growth.
    """
    leads = len(replay.lead_s)
    east = known_m[:, 1][:, None]
    shown: Mapping[str, FloatArray] = {
        "measured": replay.actual_m[:, :, 1],
        "last_estimate": replay.forecast_m["last_estimate"][:, :, 1],
        "windows": replay.forecast_m["windows"][:, :, 1],
        "default": replay.forecast_m[default_method][:, :, 1],
    }
    columns: dict[str, FloatArray] = {
        "start_s": np.repeat(replay.start_s, leads),
        "time_s": (replay.start_s[:, None] + replay.lead_s[None, :]).ravel(),
    }
    columns |= {f"{name}_east_m": (east + values).ravel() for name, values in shown.items()}
    return FigureData("forecast_classic", columns, DIGITS | {name: 1 for name in columns if name.endswith("_m")})
