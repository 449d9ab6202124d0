"""Arrays behind the figures of system 2, thinned to what a page or a viewer can show."""

from dataclasses import replace

import numpy as np

from groundstation.base.angles import wrap_180
from groundstation.base.geodesy import curvature_radii_m
from groundstation.base.records import BoolArray, Int64Array
from groundstation.methods.ins_noise import RADPS2_PER_DPHPH, RADPS_PER_DPH
from groundstation.systems.inertial.arrays import (
    DifferencesOfChannel,
    InertialDifferences,
    InertialObservability,
    InertialOwnInnovations,
    InertialStates,
    InertialTrack,
    ObservabilityOfChannel,
    OwnInnovationsOfChannel,
    StatesOfChannel,
)
from groundstation.systems.inertial.differences import InsDifferences
from groundstation.systems.inertial.filter import ChannelsRun, SmoothedErrors
from groundstation.systems.inertial.forecast_arrays import (
    FanOfChannel,
    ForecastClassic,
    ForecastFan,
    ForecastGrowth,
    ForecastMap,
)
from groundstation.systems.inertial.hindcast import Hindcast
from groundstation.systems.inertial.model import POSITION, VELOCITY, FloatArray
from groundstation.systems.inertial.skill import Claimed
from groundstation.tables.own_filter import OwnInnovations
from groundstation.tables.table import Flight

ROWS = 4000
FAN_STARTS = 60
ARCSEC_PER_RAD = 180.0 / np.pi * 3600.0
CHANNELS = ("north", "east")
# Name of each state, its unit in the figures, and how many of it are one SI unit.
SHOWN = (
    ("position", "m", 1.0),
    ("velocity", "mps", 1.0),
    ("tilt", "arcsec", ARCSEC_PER_RAD),
    ("drift", "dph", 1.0 / RADPS_PER_DPH),
    ("drift_rate", "dphph", 1.0 / RADPS2_PER_DPHPH),
    ("random_drift", "dph", 1.0 / RADPS_PER_DPH),
)
PER_SI = np.array([factor for _, _, factor in SHOWN])


def thinned(count: int) -> Int64Array:
    """Epochs that are shown: evenly spaced, the last among them."""
    return np.unique(np.linspace(0, count - 1, min(count, ROWS)).round().astype(np.int64))


def states_figure(run: ChannelsRun, smoothed: SmoothedErrors) -> InertialStates:
    """States with sigma, what was measured, and the smoothed errors, over time."""
    rows = thinned(len(run.epochs))
    epochs = run.epochs
    has_gnss = epochs.has_gnss[rows]
    return InertialStates(
        time_s=epochs.time_s[rows],
        is_forecast=~has_gnss,
        is_gnss_used=(run.used[rows] == 1).any(axis=(1, 2)),
        north=_states(run, smoothed, 0, rows),
        east=_states(run, smoothed, 1, rows),
    )


def _states(run: ChannelsRun, smoothed: SmoothedErrors, channel: int, rows: Int64Array) -> StatesOfChannel:
    """Columns of one channel."""
    position, velocity, tilt, drift, drift_rate, random_drift = (PER_SI * run.x[rows, :, channel]).T
    sigmas = (PER_SI * run.sigma(channel)[rows]).T
    return StatesOfChannel(
        measured_position_m=run.epochs.position_m[rows, channel],
        measured_velocity_mps=run.epochs.velocity_mps[rows, channel],
        position_m=position,
        position_sigma_m=sigmas[0],
        velocity_mps=velocity,
        velocity_sigma_mps=sigmas[1],
        tilt_arcsec=tilt,
        tilt_sigma_arcsec=sigmas[2],
        drift_dph=drift,
        drift_sigma_dph=sigmas[3],
        drift_rate_dphph=drift_rate,
        drift_rate_sigma_dphph=sigmas[4],
        random_drift_dph=random_drift,
        random_drift_sigma_dph=sigmas[5],
        smoothed_position_m=smoothed.x[rows, POSITION, channel],
        smoothed_velocity_mps=smoothed.x[rows, VELOCITY, channel],
        normalised_innovation=_normalised(run, channel)[rows],
    )


def _normalised(run: ChannelsRun, channel: int) -> FloatArray:
    """Return the position innovation over its sigma; the velocity's where none was measured."""
    ratio = run.innovation[:, :, channel] / np.sqrt(run.innovation_variance[:, :, channel])
    return np.where(np.isfinite(ratio[:, 0]), ratio[:, 0], ratio[:, 1])


def observability_figure(run: ChannelsRun, observability: FloatArray) -> InertialObservability:
    """Return how far each state's sigma is below what it would be without GNSS.

    ``observability`` has shape (n, 6, c).
    """
    rows = thinned(len(run.epochs))
    north, east = (_observability(observability[rows, :, channel]) for channel in (0, 1))
    return InertialObservability(time_s=run.epochs.time_s[rows], north=north, east=east)


def _observability(values: FloatArray) -> ObservabilityOfChannel:
    """Columns of one channel from shape (n, 6)."""
    position, velocity, tilt, drift, drift_rate, random_drift = values.T
    return ObservabilityOfChannel(
        position=position,
        velocity=velocity,
        tilt=tilt,
        drift=drift,
        drift_rate=drift_rate,
        random_drift=random_drift,
    )


def track_figure(compared: InsDifferences, corrected_m: FloatArray, smoothed_m: FloatArray) -> InertialTrack:
    """Return the tracks of the INS, of GNSS, and of the INS as corrected and as smoothed.

    The last two are the INS minus its estimated error, and minus its smoothed error.
    """
    measured = compared.epochs.position_m
    rows = thinned(len(measured))
    corrected, reference = _places(compared, corrected_m, rows), _places(compared, smoothed_m, rows)
    return replace(
        plain_track_figure(compared),
        corrected_latitude_deg=corrected[0],
        corrected_longitude_deg=corrected[1],
        reference_latitude_deg=reference[0],
        reference_longitude_deg=reference[1],
        ins_error_m=np.hypot(*measured.T)[rows],
        corrected_error_m=np.hypot(*(measured - corrected_m).T)[rows],
    )


def plain_track_figure(compared: InsDifferences) -> InertialTrack:
    """Track of the INS and of GNSS."""
    measured = compared.epochs.position_m
    rows = thinned(len(measured))
    ins, gnss = _places(compared, np.zeros_like(measured), rows), _places(compared, measured, rows)
    return InertialTrack(
        time_s=compared.epochs.time_s[rows],
        ins_latitude_deg=ins[0],
        ins_longitude_deg=ins[1],
        gnss_latitude_deg=gnss[0],
        gnss_longitude_deg=gnss[1],
    )


def _places(compared: InsDifferences, error_m: FloatArray, rows: Int64Array) -> tuple[FloatArray, FloatArray]:
    """Latitude and longitude of the INS minus an error, of some rows."""
    latitude, longitude = moved(compared, error_m)
    return latitude[rows], longitude[rows]


def differences_figure(compared: InsDifferences) -> InertialDifferences:
    """INS minus GNSS over time."""
    epochs = compared.epochs
    rows = thinned(len(epochs))
    north, east = (
        DifferencesOfChannel(
            position_m=epochs.position_m[rows, channel], velocity_mps=epochs.velocity_mps[rows, channel]
        )
        for channel in (0, 1)
    )
    return InertialDifferences(time_s=epochs.time_s[rows], north=north, east=east)


def own_innovations_figure(flight: Flight, own: OwnInnovations) -> InertialOwnInnovations:
    """Innovations of the INS's own filter over time, with its sigma where it logs one."""
    rows = thinned(len(own.time_ns))
    sigma = np.sqrt(own.variance[rows])
    north, east = (
        OwnInnovationsOfChannel(
            position_m=own.innovation[rows, 0, channel],
            position_sigma_m=sigma[:, 0, channel],
            velocity_mps=own.innovation[rows, 1, channel],
            velocity_sigma_mps=sigma[:, 1, channel],
        )
        for channel in (0, 1)
    )
    return InertialOwnInnovations(time_s=flight.seconds(own.time_ns[rows]), north=north, east=east)


def moved(compared: InsDifferences, error_m: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Position of the INS minus an error in metres."""
    meridian, prime_vertical = curvature_radii_m(np.nan_to_num(compared.latitude_deg))
    height = np.nan_to_num(compared.altitude_m)
    latitude = compared.latitude_deg - np.rad2deg(error_m[:, 0] / (meridian + height))
    parallel = (prime_vertical + height) * np.cos(np.deg2rad(latitude))
    longitude = compared.longitude_deg - np.rad2deg(error_m[:, 1] / parallel)
    return latitude, np.where(np.isfinite(longitude), wrap_180(np.nan_to_num(longitude)), np.nan)


def map_figure(replay: Hindcast) -> ForecastMap:
    """Radial error by start and lead, one column per method."""
    starts, leads = len(replay.start_s), len(replay.lead_s)
    return ForecastMap(
        start_s=np.repeat(replay.start_s, leads),
        horizon_min=np.tile(replay.lead_s / 60.0, starts),
        radial_m={method: replay.radial_m(method).ravel() for method in replay.forecast_m},
    )


def growth_figure(replay: Hindcast, claimed: Claimed | None) -> ForecastGrowth:
    """Return the RMS error over the starts at every lead, one column per method.

    With it comes what the default method claims.
    """
    known = np.asarray(np.isfinite(replay.actual_m).all(axis=2))
    starts = known.sum(axis=0)
    sigma_m = None
    if claimed is not None:
        sigma_m = _rms(np.sqrt(np.sum(np.square(claimed.scaled_m), axis=2)), known)
    return ForecastGrowth(
        horizon_min=replay.lead_s / 60.0,
        starts=starts,
        rms_m={method: _rms(replay.radial_m(method), known) for method in replay.forecast_m},
        sigma_m=sigma_m,
    )


def _rms(values: FloatArray, known: BoolArray) -> FloatArray:
    total = np.sum(np.square(np.where(known, values, 0.0)), axis=0)
    count = known.sum(axis=0)
    return np.asarray(np.sqrt(np.where(count > 0, total / np.maximum(count, 1), np.nan)))


def fan_figure(replay: Hindcast, method: str, claimed: Claimed | None) -> ForecastFan:
    """Forecast, its sigma and what GNSS showed, of some starts."""
    step = max(1, -(-len(replay.at) // FAN_STARTS))
    picked, leads = np.arange(0, len(replay.at), step), len(replay.lead_s)
    sigma = np.full_like(replay.actual_m, np.nan) if claimed is None else claimed.scaled_m
    north, east = (
        FanOfChannel(
            forecast_m=replay.forecast_m[method][picked, :, channel].ravel(),
            sigma_m=sigma[picked, :, channel].ravel(),
            actual_m=replay.actual_m[picked, :, channel].ravel(),
        )
        for channel in (0, 1)
    )
    return ForecastFan(
        start_s=np.repeat(replay.start_s[picked], leads),
        lead_s=np.tile(replay.lead_s, len(picked)),
        north=north,
        east=east,
    )


def classic_figure(replay: Hindcast, known_m: FloatArray, default_method: str) -> ForecastClassic:
    """Return the paper's figure 2: error east over the rest of the flight, from four starts.

    It is shown as measured and as forecast. ``known_m`` is the measured position error at each start, shape (s, c):
    errors are shown, not their growth.
    """
    leads = len(replay.lead_s)
    east = known_m[:, 1][:, None]
    return ForecastClassic(
        start_s=np.repeat(replay.start_s, leads),
        time_s=(replay.start_s[:, None] + replay.lead_s[None, :]).ravel(),
        measured_east_m=(east + replay.actual_m[:, :, 1]).ravel(),
        last_estimate_east_m=(east + replay.forecast_m["last_estimate"][:, :, 1]).ravel(),
        windows_east_m=(east + replay.forecast_m["windows"][:, :, 1]).ravel(),
        default_east_m=(east + replay.forecast_m[default_method][:, :, 1]).ravel(),
    )
