"""Tilt and azimuth error at the start of navigation, told by the data after it."""

from dataclasses import replace

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.records import BoolArray
from groundstation.base.words import counted
from groundstation.methods.ins_noise import InsNoise
from groundstation.methods.intervals import BOUND95
from groundstation.methods.kalman import filter as kalman
from groundstation.methods.kalman.arrays import NO_STEP
from groundstation.methods.kalman.smoother import smooth
from groundstation.results.roles import AzimuthEstimate
from groundstation.systems.inertial.alignment_answer import ErrorsAtStart
from groundstation.systems.inertial.coupled import (
    CHANNELS,
    LONGEST_STEP_S,
    PATTERN,
    RATES,
    coupled_values,
    lines_of,
    noise_of,
)
from groundstation.systems.inertial.craft_motion import CraftMotion
from groundstation.systems.inertial.differences import InsDifferences, only_used
from groundstation.systems.inertial.filter import DifferenceEpochs, patience_of
from groundstation.systems.inertial.model import VELOCITY
from groundstation.systems.inertial.settings import InertialSettings
from groundstation.systems.inertial.units_answer import Measured

SMOOTHED_S = 5400.0  # data after the start that are asked: a Schuler period and a little
LEAST_S = 900.0
LATE_S = 60.0  # the first difference may come so long after the start
LONGEST_BLIND_S = 600.0  # without GNSS: what lies beyond tells little of the start
TILT = VELOCITY + 1
ARCSEC_PER_RAD = 180.0 / np.pi * 3600.0
MOST_REJECTED = 0.02  # of the measurements
LEAST_SHARE = 0.7  # of its sigma at the start: what stays above was not seen


def errors_at_start(
    compared: InsDifferences,
    noise: InsNoise,
    settings: InertialSettings,
    start_s: float | None,
    azimuth: AzimuthEstimate | None,
) -> ErrorsAtStart:
    """Return the errors at the start of navigation."""
    north, east, tilt_reason = _tilts(compared, noise, settings, start_s)
    turned, azimuth_reason = _azimuth(start_s, azimuth)
    return ErrorsAtStart(north, east, turned, tilt_reason, azimuth_reason)


def _azimuth(start_s: float | None, azimuth: AzimuthEstimate | None) -> tuple[Measured | None, str]:
    """Return the azimuth by the turns of the first hour, carried back to the start."""
    if start_s is None:
        return None, "nothing shows when navigation began"
    if azimuth is None or not azimuth.observable:
        why = "" if azimuth is None else f": {azimuth.reason}"
        return None, f"not observable on this flight{why}"
    if azimuth.early is None:
        return None, "too few turns in the first hour of turns to carry it back"
    error_deg, sigma_deg = azimuth.early.at(start_s)
    back_min = (azimuth.early.time_s - start_s) / 60.0
    return Measured(
        error_deg, BOUND95 * sigma_deg
    ), f"{counted(azimuth.early.turns, 'turn')}, carried back {back_min:.0f} min"


def _tilts(
    compared: InsDifferences, noise: InsNoise, settings: InertialSettings, start_s: float | None
) -> tuple[Measured | None, Measured | None, str]:
    if start_s is None:
        return None, None, "nothing shows when navigation began"
    after = _after(compared, start_s)
    time_s = compared.epochs.time_s[after]
    if len(time_s) < 2 or time_s[0] - start_s > LATE_S:
        return None, None, f"the INS is not logged at the start of navigation, {-start_s:.0f} s before the log"
    if np.ptp(time_s) < LEAST_S:
        return (
            None,
            None,
            f"{np.ptp(time_s) / 60.0:.0f} min of INS and GNSS after the start, {LEAST_S / 60.0:.0f} needed",
        )
    found = _smoothed_start(taken(compared, after), noise, settings)
    if found is None:
        return None, None, "GNSS was rejected: the class does not fit this INS or this receiver"
    value, variance, before = found
    tilt = CHANNELS[:, TILT]
    sigma, known = np.sqrt(variance[tilt]), np.sqrt(before[tilt])
    if (sigma > LEAST_SHARE * known).any():
        return None, None, "the data after the start do not show it better than the class does"
    north, east = (
        Measured(float(ARCSEC_PER_RAD * value[row]), float(BOUND95 * ARCSEC_PER_RAD * np.sqrt(variance[row])))
        for row in tilt
    )
    return north, east, f"smoothed from {np.ptp(time_s) / 60.0:.0f} min of data"


def _after(compared: InsDifferences, start_s: float) -> BoolArray:
    """Epochs from the start on, to the first reset, or long gap, or as many as are asked."""
    epochs = compared.epochs
    rows = (epochs.time_s >= start_s) & (epochs.time_s <= start_s + SMOOTHED_S)
    found = np.flatnonzero(rows)
    if not len(found):
        return np.asarray(rows)
    first = int(found[0])
    seen_s = np.where(epochs.has_gnss, epochs.time_s, -np.inf)
    last_seen = np.maximum(np.maximum.accumulate(seen_s), epochs.time_s[first])
    ends = epochs.is_reset | (np.diff(epochs.time_s, prepend=epochs.time_s[:1]) > LONGEST_STEP_S)
    ends |= epochs.time_s - last_seen > LONGEST_BLIND_S
    ends[: first + 1] = False
    if ends.any():
        rows[int(np.argmax(ends)) :] = False
    return np.asarray(rows)


def taken(compared: InsDifferences, rows: BoolArray) -> InsDifferences:
    """Return some of the epochs."""
    one = compared.epochs
    epochs = DifferenceEpochs(
        one.time_s[rows], one.position_m[rows], one.velocity_mps[rows], one.drag_per_s[rows], one.is_reset[rows]
    )
    heading = None if compared.heading_deg is None else compared.heading_deg[rows]
    return replace(
        compared,
        epochs=epochs,
        latitude_deg=compared.latitude_deg[rows],
        longitude_deg=compared.longitude_deg[rows],
        altitude_m=compared.altitude_m[rows],
        velocity_mps=compared.velocity_mps[rows],
        heading_deg=heading,
    )


def _smoothed_start(
    compared: InsDifferences, noise: InsNoise, settings: InertialSettings
) -> tuple[FloatArray, FloatArray, FloatArray] | None:
    """Return states at the first epoch, smoothed, their variances, and those before any data.

    None where the filter was opened on the way, or rejected much: the class does not fit.
    """
    epochs = only_used(compared.epochs, settings)
    n = len(epochs)
    motion = CraftMotion.between(compared, epochs.time_s, is_strapdown=noise.is_strapdown)
    values = np.zeros((n, len(PATTERN)))
    values[1:] = coupled_values(motion, noise.beta_per_s)
    covariance, densities = noise_of(noise, compared, epochs, float(motion.heading_rad[0]))
    interval_s = np.diff(epochs.time_s, prepend=epochs.time_s[:1])
    step = np.arange(n)
    step[0] = NO_STEP
    z = np.stack([epochs.position_m, epochs.velocity_mps], axis=1).reshape(-1)
    gate = kalman.InnovationGate(
        settings.gate_sigmas, patience_of(epochs), np.zeros(len(covariance)), is_by_innovation=True
    )
    seen = kalman.Measurements(np.repeat(np.arange(n), 4), z, np.tile(np.arange(4), n), lines_of(epochs, noise))
    run = kalman.run_filter(
        RATES.transition(values, interval_s, densities),
        step,
        seen,
        kalman.Start(np.zeros(len(covariance)), covariance),
        gate=gate,
        kept=kalman.KeptArrays(),
    )
    if run.reopened or run.rejected > MOST_REJECTED * max(int(np.isfinite(z).sum()), 1):
        return None
    smoothed = smooth(run)
    return smoothed.x[0, :, 0], smoothed.variance[0], np.asarray(np.diag(covariance))
