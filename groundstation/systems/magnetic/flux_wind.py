"""Wind of a flight from ground velocity and true airspeed, without the compass.

Ground velocity less wind has the length of the true airspeed: on several headings that shows the wind, and with it the
direction of the nose. The wind may change; what the flight shows of that is in the sigma.
"""

from itertools import product

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from groundstation.base.angles import FloatArray, direction_of
from groundstation.base.dataclasses import dataclass
from groundstation.base.units import DEG_PER_RAD
from groundstation.systems.magnetic.flux_epochs import FluxEpochs
from groundstation.systems.magnetic.flux_settings import MagneticFluxSettings

MOST_ROWS = 400
CHANGES_MPS = (0.3, 1.0, 2.0, 4.0)  # standard deviations of the slow part that are tried
GUSTS_MPS, GUST_S = (0.2, 0.5, 1.0), 60.0  # of the fast part
NOISE_MPS = (0.3, 1.0)
LEAST_WEIGHT = 0.01
PASSES = 4
PER_LEG = 6  # epochs of a leg that its mean is taken of
LEAST_ROWS = 30


@dataclass(frozen=True)
class SolvedWind:
    """Wind at every epoch, (n, 2), and that of every leg with its covariance.

    ``leg_mps`` (m, 2); ``leg_covariance`` (2 m, 2 m), north and east of a leg beside each other.
    """

    wind_mps: FloatArray
    leg_mps: FloatArray
    leg_covariance: FloatArray
    scale: float
    scale_sigma: float
    changes_mps: float


@dataclass(frozen=True)
class _Places:
    time_s: FloatArray
    altitude_m: FloatArray


@dataclass(frozen=True)
class _Scales:
    changes_mps: float
    gusts_mps: float
    noise_mps: float


def solve_wind(epochs: FluxEpochs, legs: list[tuple[int, int]], settings: MagneticFluxSettings) -> SolvedWind | None:
    """Return the wind, None where hardly an epoch has ground velocity and airspeed.

    Each epoch says airspeed x scale + wind along the nose = ground velocity along the nose; the direction of the nose
    comes from the wind of the pass before. The wind is a constant, a slow and a fast process, the sizes of the latter
    weighed by their likelihood.

    Source: Rasmussen and Williams, Gaussian Processes for Machine Learning, 2006, equations 2.23 to 2.30 and 5.8.
    """
    known = np.isfinite(epochs.velocity_mps).all(axis=1) & np.isfinite(epochs.airspeed_mps) & epochs.is_airborne
    with np.errstate(invalid="ignore"):
        known &= ~(np.abs(epochs.acceleration_mps2) > 5.0 * settings.acceleration_max_mps2)
    rows = np.flatnonzero(known)
    if len(rows) < LEAST_ROWS or not legs:
        return None
    rows = rows[:: max(1, -(-len(rows) // MOST_ROWS))]
    velocity, airspeed = epochs.velocity_mps[rows], epochs.airspeed_mps[rows]
    seen = _places(epochs, rows)
    chosen = [np.unique(np.linspace(first, last - 1, PER_LEG).round().astype(int)) for first, last in legs]
    nose_rad = np.deg2rad(epochs.heading_deg[rows] + epochs.declination_deg[rows])
    nose = np.stack([np.cos(nose_rad), np.sin(nose_rad)], axis=1)
    middle = _Scales(1.0, 0.5, 0.5)
    for _ in range(PASSES):
        factor, misfit = _factored(seen, nose, airspeed, velocity, middle, settings)[:2]
        wind = _wind(seen, seen, nose, cho_solve(factor, misfit), middle, settings)
        air = velocity - wind
        nose = air / np.maximum(np.hypot(*air.T), 1.0)[:, None]
    return _averaged(epochs, seen, chosen, nose, airspeed, velocity, settings)


def leg_errors_by_wind(
    epochs: FluxEpochs, legs: list[tuple[int, int]], wind: SolvedWind
) -> tuple[FloatArray, FloatArray]:
    """Return the true heading of every leg and the covariance that the wind makes."""
    ground = np.array([np.nanmean(epochs.velocity_mps[first:last], axis=0) for first, last in legs])
    air = ground - wind.leg_mps
    length = np.maximum(np.hypot(*air.T), 1.0)
    across = np.stack([-air[:, 1], air[:, 0]], axis=1) / (length**2)[:, None] * DEG_PER_RAD
    slopes = np.zeros((len(legs), 2 * len(legs)))
    for place in range(len(legs)):
        slopes[place, 2 * place : 2 * place + 2] = -across[place]
    return direction_of(air[:, 0], air[:, 1]), slopes @ wind.leg_covariance @ slopes.T


def _averaged(
    epochs: FluxEpochs,
    seen: _Places,
    chosen: list[np.ndarray],
    nose: FloatArray,
    airspeed: FloatArray,
    velocity: FloatArray,
    settings: MagneticFluxSettings,
) -> SolvedWind:
    tried = [_Scales(*one) for one in product(CHANGES_MPS, GUSTS_MPS, NOISE_MPS)]
    fitted = [_factored(seen, nose, airspeed, velocity, one, settings) for one in tried]
    likelihood = np.array([one[2] for one in fitted])
    weight = np.exp(likelihood - likelihood.max())
    weight = np.where(weight < LEAST_WEIGHT, 0.0, weight)
    weight /= weight.sum()
    everywhere = _places(epochs, np.arange(len(epochs)))
    members, groups = np.concatenate(chosen), np.repeat(np.arange(len(chosen)), [len(one) for one in chosen])
    at_legs = _places(epochs, members)
    mean = np.zeros((len(chosen), len(members)))
    mean[groups, np.arange(len(members))] = 1.0 / np.bincount(groups)[groups]
    wind, legs, scales = [], [], []
    for share, one, (factor, misfit, _) in zip(weight, tried, fitted, strict=True):
        if share == 0.0:
            continue
        solved = cho_solve(factor, misfit)
        wind.append(share * _wind(everywhere, seen, nose, solved, one, settings))
        legs.append((share, *_at_legs(at_legs, seen, nose, mean, factor, misfit, one, settings)))
        gain = settings.airspeed_scale_sigma**2 * airspeed
        variance = settings.airspeed_scale_sigma**2 - gain @ cho_solve(factor, gain)
        scales.append((share, 1.0 + gain @ solved, max(float(variance), 0.0)))
    leg = sum(share * value for share, value, _ in legs)
    covariance = sum(
        share * (spread + np.outer((value - leg).ravel(), (value - leg).ravel())) for share, value, spread in legs
    )
    scale = sum(share * value for share, value, _ in scales)
    variance = sum(share * (spread + (value - scale) ** 2) for share, value, spread in scales)
    changes = float(sum(share * one.changes_mps for share, one in zip(weight, tried, strict=True)))
    return SolvedWind(
        np.sum(wind, axis=0), np.asarray(leg), np.asarray(covariance), float(scale), float(np.sqrt(variance)), changes
    )


def _factored(
    seen: _Places,
    nose: FloatArray,
    airspeed: FloatArray,
    velocity: FloatArray,
    scales: _Scales,
    settings: MagneticFluxSettings,
) -> tuple[tuple[FloatArray, bool], FloatArray, float]:
    """Return the factored covariance of the epochs, what they say of the wind, the likelihood."""
    covariance = (nose @ nose.T) * _kernel(seen, seen, scales, settings)
    covariance += settings.airspeed_scale_sigma**2 * np.outer(airspeed, airspeed)
    covariance[np.diag_indices(len(airspeed))] += scales.noise_mps**2
    misfit = np.einsum("ni,ni->n", nose, velocity) - airspeed
    factor = cho_factor(covariance, lower=True)
    determinant = 2.0 * float(np.sum(np.log(np.diag(factor[0]))))
    return factor, misfit, -0.5 * (float(misfit @ cho_solve(factor, misfit)) + determinant)


def _wind(
    at: _Places, seen: _Places, nose: FloatArray, solved: FloatArray, scales: _Scales, settings: MagneticFluxSettings
) -> FloatArray:
    return np.asarray(_kernel(at, seen, scales, settings) @ (nose * solved[:, None]))


def _at_legs(
    at: _Places,
    seen: _Places,
    nose: FloatArray,
    mean: FloatArray,
    factor: tuple[FloatArray, bool],
    misfit: FloatArray,
    scales: _Scales,
    settings: MagneticFluxSettings,
) -> tuple[FloatArray, FloatArray]:
    """Return the mean wind of every leg, (m, 2), and its covariance, (2 m, 2 m)."""
    cross = mean @ _kernel(at, seen, scales, settings)
    both = np.stack([cross * nose[:, 0], cross * nose[:, 1]], axis=1).reshape(2 * len(mean), -1)
    before = np.kron(mean @ _kernel(at, at, scales, settings) @ mean.T, np.eye(2))
    value = both @ cho_solve(factor, misfit)
    return value.reshape(-1, 2), before - both @ cho_solve(factor, both.T)


def _kernel(one: _Places, other: _Places, scales: _Scales, settings: MagneticFluxSettings) -> FloatArray:
    """Covariance of a component of the wind between places."""
    apart = np.abs(one.time_s[:, None] - other.time_s)
    higher = np.abs(one.altitude_m[:, None] - other.altitude_m)
    slow = scales.changes_mps**2 * np.exp(-apart / settings.wind_time_s - higher / settings.wind_height_m)
    fast = scales.gusts_mps**2 * np.exp(-apart / GUST_S)
    return np.asarray(settings.wind_sigma_mps**2 + slow + fast)


def _places(epochs: FluxEpochs, rows: np.ndarray) -> _Places:
    altitude = epochs.altitude_m[rows]
    return _Places(epochs.time_s[rows], np.where(np.isfinite(altitude), altitude, 0.0))
