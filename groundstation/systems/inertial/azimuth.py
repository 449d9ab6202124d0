"""Azimuth (heading) error of an INS by the effect of velocity changes on velocity error.

An INS whose north is turned by a heading error psi (INS - truth, clockwise positive) turns every change of velocity by
psi: change of velocity error = psi x (-change east, +change north). Straight flight shows nothing of it.
"""

from dataclasses import replace

import numpy as np

from groundstation.base.dataclasses import dataclass
from groundstation.base.geodesy import EARTH_RATE_RADPS
from groundstation.base.quantiles import student_quantile
from groundstation.base.records import BoolArray
from groundstation.base.words import counted
from groundstation.methods.ins_noise import RADPS_PER_DPH
from groundstation.methods.intervals import BOUND95
from groundstation.results.roles import AzimuthEstimate, EarlyAzimuth
from groundstation.systems.inertial.differences import InsDifferences
from groundstation.systems.inertial.filter import ChannelsRun, DifferenceEpochs, run_filter
from groundstation.systems.inertial.model import VELOCITY, FloatArray
from groundstation.systems.inertial.settings import InertialSettings
from groundstation.systems.inertial.velocity_changes import (
    AZIMUTH,
    AZIMUTH_DRIFT,
    PARAMETERS,
    AzimuthLimits,
    Changes,
    changes_of,
    count_known,
    mean_known,
    quiet_intervals,
    turned,
)

ITERATIONS = 3  # what the filter had taken for tilt in earlier turns shrinks by ten or more each time
AZIMUTH_PRIOR_RAD = 1.0  # no knowledge
EARLY_S = 3600.0  # of turns that tell the azimuth on taxi: it oscillates over 24 h
S_PER_H, LEAST_PRODUCT = 3600.0, 1e-300


@dataclass(frozen=True)
class AzimuthFit:
    """Fitted parameters (6,) with covariance (6, 6) and residuals over their sigma (m, 2).

    ``freedom``: degrees of freedom.
    """

    values: FloatArray
    covariance: FloatArray
    normalised: FloatArray
    freedom: float
    sigma_scale: float = 1.0

    @property
    def sigma_rad(self) -> float:
        """Sigma of the azimuth, widened where residuals are too large; +- 1.96 sigma holds 95 %.

        Scaled by sqrt(chi-square / degrees of freedom) where that exceeds one, and then by Student's quantile: the
        scatter of a few turns is itself uncertain.
        """
        return self.widening * float(np.sqrt(self.covariance[AZIMUTH, AZIMUTH]))

    @property
    def widening(self) -> float:
        """Factor by which the sigmas of the covariance are multiplied."""
        spread = float(np.sum(np.square(self.normalised))) / self.freedom
        if spread <= 1.0:
            return self.sigma_scale
        return self.sigma_scale * float(np.sqrt(spread) * student_quantile(0.975, self.freedom)) / BOUND95


def estimate_azimuth(
    differences: InsDifferences,
    run: ChannelsRun,
    settings: InertialSettings,
    *,
    limits: AzimuthLimits | None = None,
) -> AzimuthEstimate:
    """Estimate the azimuth error of an unaided INS, where turns make it observable.

    Parameters
    ----------
    differences : InsDifferences
        With velocities of GNSS.
    run : ChannelsRun
        Of the separate channels: its model and its noise are used.
    settings : InertialSettings
        ``azimuth_sigma_max_deg``, ``gate_sigmas``.
    limits : AzimuthLimits, optional

    Returns
    -------
    AzimuthEstimate
        At the time of the last change of velocity, or why it is not observable.

    Notes
    -----
    The change of velocity error across each manoeuvre, less what the channel filter (on velocities alone) predicts from
    its state before it, is regressed on the change of the INS velocity turned by 90 deg. Beside the azimuth stand its
    drift, a time offset between GNSS and INS (difference = offset x acceleration), a scale error (along the change)
    and accelerometer biases that turn with the craft, each with a prior sigma. The variances come from the class's
    noise and the filter's covariance, enlarged where quiet stretches of the same flight scatter more, and once more
    where the turns do. The filter is run again with the azimuth found taken off, so that one turn does not
    spoil the prediction of the next.

    Source: Titterton and Weston, Strapdown Inertial Navigation Technology, 2nd ed. 2004, section 12.3 (azimuth error x
    specific force).
    """
    limits = limits or AzimuthLimits()
    both = np.concatenate([differences.epochs.velocity_mps, differences.velocity_mps], axis=1)
    known = np.asarray(np.isfinite(both).all(axis=1))
    if not known.any():
        return _refused(0, 0.0, "no velocity of both INS and GNSS")
    changes = changes_of(differences, known, limits)
    largest = float(np.hypot(*changes.velocity_mps.T).max()) if len(changes) else 0.0
    if len(changes) < limits.least_changes:
        return _refused(
            len(changes),
            largest,
            f"{counted(len(changes), 'turn or other change', 'turns or other changes')} of velocity of "
            f"{limits.change_mps:g} m/s or more with GNSS on both sides; at least {limits.least_changes} are needed",
        )
    if changes.point_one_way(limits):
        return _refused(len(changes), largest, "all changes of velocity point the same way")
    fit = fit_azimuth(differences, run, settings, changes, known, limits)
    error_deg, sigma_deg = (float(np.rad2deg(part)) for part in (fit.values[AZIMUTH], fit.sigma_rad))
    if not sigma_deg <= settings.azimuth_sigma_max_deg:
        text = f"sigma {sigma_deg:.2g} deg above the limit of {settings.azimuth_sigma_max_deg:g} deg"
        return AzimuthEstimate(False, None, sigma_deg, len(changes), largest, text)
    text = f"{len(changes)} changes of velocity of up to {largest:.0f} m/s"
    early = _early(differences, run, settings, changes, known, limits, fit)
    return AzimuthEstimate(True, error_deg, sigma_deg, len(changes), largest, text, changes.reference_s, early)


def _early(
    differences: InsDifferences,
    run: ChannelsRun,
    settings: InertialSettings,
    changes: Changes,
    known: BoolArray,
    limits: AzimuthLimits,
    whole: AzimuthFit,
) -> EarlyAzimuth | None:
    """Return the azimuth from the first hour of changes.

    None where they are too few, or all point one way.
    """
    first = changes.first(EARLY_S)
    if len(first) < limits.least_changes or first.point_one_way(limits):
        return None
    is_whole = len(first) == len(changes)
    fit = whole if is_whole else fit_azimuth(differences, run, settings, first, known, limits)
    both = [AZIMUTH, AZIMUTH_DRIFT]
    sigma, rate_sigma = np.sqrt(np.diag(fit.covariance)[both])
    return EarlyAzimuth(
        error_deg=float(np.rad2deg(fit.values[AZIMUTH])),
        sigma_deg=float(np.rad2deg(fit.sigma_rad)),
        time_s=first.reference_s,
        rate_deg_per_h=float(np.rad2deg(fit.values[AZIMUTH_DRIFT])) * S_PER_H,
        rate_sigma_deg_per_h=float(np.rad2deg(fit.widening * rate_sigma)) * S_PER_H,
        correlation=float(fit.covariance[AZIMUTH, AZIMUTH_DRIFT] / max(sigma * rate_sigma, LEAST_PRODUCT)),
        turns=len(first),
    )


def fit_azimuth(
    differences: InsDifferences,
    run: ChannelsRun,
    settings: InertialSettings,
    changes: Changes,
    known: BoolArray,
    limits: AzimuthLimits,
) -> AzimuthFit:
    """Fit :data:`PARAMETERS` to m >= 1 changes of velocity."""
    quiet = quiet_intervals(differences, known, limits)
    gyro = run.noise.drift_dph * RADPS_PER_DPH
    prior = np.array(
        [
            AZIMUTH_PRIOR_RAD,
            gyro,
            limits.latency_s,
            limits.scale,
            *[run.model.gravity_mps2 * run.noise.tilt_rad] * 2,
        ]
    )
    # an azimuth error drifts the north channel: azimuth x Earth rate, unless alignment has balanced it
    feigned = np.rad2deg(EARTH_RATE_RADPS) * 3600.0 * np.deg2rad(run.noise.azimuth_deg)
    noise = replace(run.noise, drift_dph=float(np.hypot(run.noise.drift_dph, feigned)))
    taken_off, fit = np.zeros(len(PARAMETERS)), None
    for _ in range(ITERATIONS):
        straightened = _without_azimuth(differences, taken_off, changes.reference_s, known)
        again = run_filter(straightened, run.model, noise, gate=settings.gate_sigmas**2)
        change, variance = _unpredicted(again, changes)
        change = change + changes.columns @ taken_off
        fit = _regression(changes.columns, change, variance * _quiet_scale(again, quiet), prior)
        taken_off[[AZIMUTH, AZIMUTH_DRIFT]] = fit.values[[AZIMUTH, AZIMUTH_DRIFT]]
        # Earth's rotation turns azimuth into tilt and back: a slow oscillation of 24 h
        prior[AZIMUTH_DRIFT] = np.hypot(gyro, EARTH_RATE_RADPS * fit.values[AZIMUTH])
    assert fit is not None
    return replace(fit, sigma_scale=limits.sigma_scale)


def _refused(changes: int, largest: float, reason: str) -> AzimuthEstimate:
    return AzimuthEstimate(False, None, None, changes, largest, reason)


def _without_azimuth(
    differences: InsDifferences, parameters: FloatArray, reference_s: float, known: BoolArray
) -> DifferenceEpochs:
    """Return the velocity differences less the effect of an azimuth error on the velocity.

    Positions are left out.
    """
    epochs = differences.epochs
    azimuth_rad = parameters[AZIMUTH] + parameters[AZIMUTH_DRIFT] * (epochs.time_s - reference_s)
    velocity = epochs.velocity_mps - azimuth_rad[:, None] * turned(differences.velocity_mps)
    velocity = np.where(known[:, None], velocity, np.nan)
    return DifferenceEpochs(epochs.time_s, np.full_like(velocity, np.nan), velocity, epochs.drag_per_s, epochs.is_reset)


def _unpredicted(run: ChannelsRun, changes: Changes) -> tuple[FloatArray, FloatArray]:
    """Return the change of velocity error that the filter did not predict, and its variance.

    Shapes (m, 2) and (m,).
    """
    time_s, velocity = run.epochs.time_s, np.nan_to_num(run.epochs.velocity_mps)
    out = mean_known(changes.after, velocity, changes.known) - mean_known(changes.before, velocity, changes.known)
    gnss, density = run.noise.gnss, run.noise.densities()
    samples = np.minimum(count_known(changes.before, changes.known), count_known(changes.after, changes.known))
    variance = np.zeros(len(changes))
    for index in range(len(changes)):
        last = int(changes.before[index, 1]) - 1
        rows = [run.model.transition_over(float(when - time_s[last]))[VELOCITY] for when in _ends(changes, index)]
        grown = rows[1] - rows[0]
        out[index] -= grown @ run.x[last]
        seconds = changes.after_s[index] - changes.before_s[index]
        decorrelated = -np.expm1(-seconds / max(gnss.velocity_correlation_s, 1e-6))
        variance[index] = (
            grown @ run.P[0, last] @ grown
            + run.model.process_noise_over(float(seconds), density)[VELOCITY, VELOCITY]
            + 2.0 * gnss.velocity_white_mps**2 / samples[index]
            + 2.0 * gnss.velocity_correlated_mps**2 * decorrelated
        )
    return out, variance


def _ends(changes: Changes, index: int) -> tuple[float, float]:
    return float(changes.before_s[index]), float(changes.after_s[index])


def _quiet_scale(run: ChannelsRun, quiet: Changes) -> float:
    """Return how much larger the variance across quiet stretches is than modelled.

    1 with few of them.
    """
    few = 10
    if len(quiet) < few:
        return 1.0
    change, variance = _unpredicted(run, quiet)
    return max(1.0, float(np.mean(np.square(change) / variance[:, None])))


def _regression(columns: FloatArray, change: FloatArray, variance: FloatArray, prior: FloatArray) -> AzimuthFit:
    """Fit by weighted least squares with prior sigmas.

    Columns (m, 2, p), change (m, 2), variance (m,), prior (p,).
    """
    weight = 1.0 / np.sqrt(variance)
    rows = (columns * weight[:, None, None]).reshape(-1, columns.shape[2]) * prior  # in units of the prior sigmas
    right = (change * weight[:, None]).ravel()
    normal = rows.T @ rows
    inverse = np.linalg.inv(normal + np.eye(len(prior)))
    solved = inverse @ rows.T @ right
    residual = right - rows @ solved
    freedom = max(1.0, len(right) - float(np.trace(inverse @ normal)))
    return AzimuthFit(solved * prior, inverse * np.outer(prior, prior), residual.reshape(-1, 2), freedom)
