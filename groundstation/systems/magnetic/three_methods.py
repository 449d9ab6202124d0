"""The three ways to find the deviation, side by side, and the one to correct by."""

import math
from dataclasses import replace

import numpy as np

from groundstation.base.angles import FloatArray, wrap_180
from groundstation.base.dataclasses import dataclass
from groundstation.methods import harmonics
from groundstation.results.roles import LETTERS
from groundstation.systems.magnetic.answer import Method, MethodName
from groundstation.systems.magnetic.compass_table import CompassTable, fit_to_circle
from groundstation.systems.magnetic.held_out import (
    LONGEST_STEP_S,
    Remaining,
    Unseen,
    remaining_by_iron,
    remaining_by_table,
    remaining_uncorrected,
    seen_wander,
)
from groundstation.systems.magnetic.iron import Iron, bank_bias, derivatives, level_coefficients
from groundstation.systems.magnetic.modulus import PARAMETERS, fit_modulus
from groundstation.systems.magnetic.poisson import EarthField, IronFit, fit_iron
from groundstation.systems.magnetic.readings import Readings
from groundstation.systems.magnetic.settings import MagneticSettings

NO_CIRCULAR = (
    "cannot observe the constant deviation A, as no heading is used; soft iron along the vertical is assumed zero: "
    "no sigma here covers that"
)
WANDER_IN_A_TO_E = np.array([0.3, 1.0, 1.0, 0.3, 0.3])  # what wanders with the turn rate goes into A, D, E
WANDER_FREEDOM = 4.0  # what the settings say of the wander counts as so many stretches
# Twice a correlation time of the wander of roll and pitch: over a longer figure it averages out as the inverse. 250 s
# lies between the 120 and the 400 s of docs/evidence/magnetic.md; FLIGHT_WANDER_S takes another time for the same
# wander.
FIGURE_WANDER_S = 500.0
TELLING_SIGMAS = 2.0  # held-out errors that differ by less may do so by chance
FORECAST_BANKS_DEG = (10.0, 20.0, 30.0)


@dataclass(frozen=True)
class Fits:
    """Table with its forecast bank bias, shape (360,), and two irons.

    ``pitch_deg`` is the mean of the figure. ``attitude_wander_deg`` is what roll and pitch of the INS are wrong by in
    the mean of the figure as they wander, ``wander`` (5, 5) what that adds to the covariance of A to E: no residual of
    the figure shows it.
    """

    table: CompassTable
    bias_deg: FloatArray
    attitude: IronFit
    modulus: IronFit
    pitch_deg: float
    bank_deg: float
    attitude_wander_deg: float
    wander: FloatArray

    @property
    def forecast(self) -> IronFit | None:
        """The iron that the bank bias is forecast from."""
        return None if self.attitude.reason else self.attitude


def fit_all(
    figure: Readings, table: CompassTable, earth: EarthField, unseen: Unseen | None, settings: MagneticSettings
) -> Fits:
    """Fit both irons to the readings of the figures and forecast the bank bias of the table."""
    attitude = fit_iron(figure, earth, settings)
    found = attitude.earth
    pitch, bank = float(np.mean(figure.pitch_deg)), float(np.mean(np.abs(figure.roll_deg)))
    modulus = fit_modulus(figure.field_nt, found, settings)
    if not modulus.reason:
        sigma = _curve_sigma(level_coefficients(modulus.iron, modulus.covariance, *_strengths(found), pitch)[1])
        if sigma > settings.modulus_sigma_max_deg:
            reason = f"heading error known to {sigma:.2g} deg rms, at most {settings.modulus_sigma_max_deg:g}"
            modulus = replace(modulus, reason=f"{reason}: condition number {modulus.condition_number:.3g}")
    bias = np.zeros(360) if attitude.reason else bank_bias(attitude.iron, *_strengths(found), bank, pitch)
    seconds = float(np.sum(np.minimum(np.diff(figure.time_s), LONGEST_STEP_S)))
    wander_deg = _wander_deg(attitude, unseen, settings) * math.sqrt(min(1.0, FIGURE_WANDER_S / max(seconds, 1.0)))
    wander = np.diag((wander_deg * found.per_tilt * WANDER_IN_A_TO_E) ** 2)
    return Fits(table, bias, attitude, modulus, pitch, bank, wander_deg, wander)


def _wander_deg(fit: IronFit, unseen: Unseen | None, settings: MagneticSettings) -> float:
    """Return the wander of roll and pitch over minutes.

    The wander is weighed from that of the settings and from what level flight beside the figure shows.

    Source: Gelman et al., Bayesian Data Analysis, 3rd ed. 2013, section 2.6 (scaled inverse chi-square).
    """
    per_tilt, known = fit.earth.per_tilt, settings.attitude_wander_deg
    if fit.reason or unseen is None or per_tilt <= 0.0:
        return known
    spread_deg, freedom = seen_wander(unseen, fit)
    seen_deg = spread_deg / per_tilt
    return math.sqrt((WANDER_FREEDOM * known**2 + freedom * seen_deg**2) / (WANDER_FREEDOM + freedom))


def method_rows(
    fits: Fits,
    unseen: Unseen | None,
    deviation_deg: FloatArray,
    declination_deg: float,
    a_sigma_deg: float,
) -> tuple[Method, ...]:
    """Return a row for each method.

    ``a_sigma_deg`` is what alignment and declination add to the sigma of A.
    """
    table = fits.table
    values = table.coefficients_deg + np.array([declination_deg, 0.0, 0.0, 0.0, 0.0])
    values[0] = wrap_180(values[0])
    bias, bias_covariance = bias_coefficients(fits, a_sigma_deg)
    covariance = table.covariance + np.diag(bias**2) + bias_covariance + fits.wander
    covariance[0, 0] += a_sigma_deg**2
    before = remaining_uncorrected(unseen).rms_deg if unseen else None
    after = remaining_by_table(unseen, table, deviation_deg, fits.bias_deg) if unseen else None
    by_table = Method("compass_table", "fitted", "", table.samples, 720, held_out_before_deg=before)
    return (
        _with(by_table, after, values, covariance),
        _by_iron("poisson_attitude", fits.attitude, fits, unseen, before, a_sigma_deg),
        _by_iron("constant_modulus", fits.modulus, fits, unseen, before, a_sigma_deg),
    )


def bias_coefficients(fits: Fits, azimuth_sigma_deg: float) -> tuple[FloatArray, FloatArray]:
    """Return A to E of the forecast bank bias, shape (5,), and their covariance.

    The coefficients tell how far the table's may be from level flight. The covariance is that of the iron, with the
    error of the reference heading.
    """
    fit = fits.forecast
    if fit is None:
        return np.zeros(harmonics.COEFFICIENTS), np.zeros((harmonics.COEFFICIENTS, harmonics.COEFFICIENTS))

    def coefficients(iron: Iron) -> FloatArray:
        bias = bank_bias(iron, *_strengths(fit.earth), fits.bank_deg, fits.pitch_deg)
        return fit_to_circle(bias)

    slopes = derivatives(fit.iron, coefficients, max(abs(fit.earth.horizontal_nt), 1.0))
    return coefficients(fit.iron), slopes @ fit.covariance_with(azimuth_sigma_deg) @ slopes.T


def recommend(
    rows: tuple[Method, ...],
    gain_sigmas: float,
    bias_rms_deg: float,
    bank_deg: float,
    settings: MagneticSettings,
) -> tuple[MethodName, str]:
    """The method to correct by, and why; never one branch, never the modulus alone.

    Where what is left on level flight differs beyond chance, the smaller; else the curve B to E that is known best.
    ``gain_sigmas``: by how many sigma the iron leaves less than the table.
    """
    table, attitude, limit_deg = rows[0], rows[1], settings.bank_bias_max_deg
    if attitude.state == "refused":
        return "compass_table", f"the fit of the iron is refused: {attitude.reason}"
    text = f"the average of branches has a bias of {bias_rms_deg:.2f} deg rms at {bank_deg:.0f} deg of bank"
    if bias_rms_deg > limit_deg > 0.0:
        best = bank_deg * math.sqrt(limit_deg / bias_rms_deg)
        text += f" (it grows as bank squared: {limit_deg:g} deg at {best:.0f} deg of bank)"
    if abs(gain_sigmas) >= TELLING_SIGMAS and attitude.held_out_after_deg is not None:
        left = f"{attitude.held_out_after_deg:.2f} against {table.held_out_after_deg:.2f} deg rms"
        better = "less" if gain_sigmas > 0.0 else "more"
        chosen: MethodName = "poisson_attitude" if gain_sigmas > 0.0 else "compass_table"
        return chosen, f"{text}; in level flight that no fit used, the iron leaves {better}: {left}"
    sigmas = [_rms_of(row.coefficients_sigma_deg) for row in (table, attitude)]
    if sigmas[1] <= sigmas[0]:
        return "poisson_attitude", f"{text}; the iron fitted with the INS attitude has none"
    return "compass_table", f"{text}; the iron is known less well ({sigmas[1]:.2f} against {sigmas[0]:.2f} deg)"


def _by_iron(
    name: MethodName, fit: IronFit, fits: Fits, unseen: Unseen | None, before_deg: float | None, a_sigma_deg: float
) -> Method:
    is_modulus = name == "constant_modulus"
    parameters = PARAMETERS if is_modulus else len(fit.iron.vector())
    row = Method(
        name,
        "refused" if fit.reason else "fitted",
        fit.reason or (NO_CIRCULAR if is_modulus else ""),
        len(fit.residual_nt),
        parameters,
        fit.condition_number,
        fit.rms_nt,
        before_deg,
    )
    if fit.reason:
        return row
    spread = fit.covariance_with(a_sigma_deg)
    values, covariance = level_coefficients(fit.iron, spread, *_strengths(fit.earth), fits.pitch_deg)
    if not is_modulus:
        covariance = covariance + fits.wander
    row = _with(row, remaining_by_iron(unseen, fit, a_sigma_deg) if unseen else None, values, covariance)
    if not is_modulus:
        return row
    seen = {letter: value for letter, value in row.coefficients_deg.items() if letter != "A"}
    sigma = {letter: value for letter, value in row.coefficients_sigma_deg.items() if letter != "A"}
    return replace(row, coefficients_deg=seen, coefficients_sigma_deg=sigma)


def _with(row: Method, remaining: Remaining | None, values: FloatArray, covariance: FloatArray) -> Method:
    variance = np.diag(covariance)
    row = replace(
        row,
        coefficients_deg=dict(zip(LETTERS, map(float, values), strict=True)),
        coefficients_sigma_deg=dict(zip(LETTERS, map(float, np.sqrt(variance)), strict=True)),
    )
    if remaining is None:
        return row
    return replace(
        row,
        held_out_after_deg=remaining.rms_deg,
        held_out_mean_deg=remaining.mean_deg,
        held_out_mean_sigma_deg=remaining.mean_sigma_deg,
    )


def _strengths(earth: EarthField) -> tuple[float, float]:
    return earth.horizontal_nt, earth.down_nt


def _curve_sigma(covariance: FloatArray) -> float:
    """Sigma of a curve of A to E, RMS over the circle."""
    variance = np.diag(covariance)
    return float(np.sqrt(variance[0] + 0.5 * np.sum(variance[1:])))


def _rms_of(sigma_deg: dict[str, float]) -> float:
    return float(np.sqrt(0.5 * sum(sigma_deg[letter] ** 2 for letter in LETTERS[1:])))
