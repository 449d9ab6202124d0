"""Prior art: iron from the constancy of the field's modulus, without any heading.

The modulus is nearly blind at small banks.
"""

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.methods import harmonics
from groundstation.systems.magnetic.iron import Iron
from groundstation.systems.magnetic.poisson import EarthField, IronFit
from groundstation.systems.magnetic.settings import MagneticSettings

PARAMETERS = 6  # p, q, r, a, e, b
SOFT_PLACES = ((0, 0, 3), (1, 1, 4), (0, 1, 5), (1, 0, 5))  # row, column, parameter
CONVERGED = 1e-7
LARGEST = 0.45  # of the field: what is larger is no iron, and the soft iron stays invertible


def fit_modulus(reading_nt: FloatArray, earth: EarthField, settings: MagneticSettings) -> IronFit:
    """Fit hard iron p, q, r and horizontal soft iron a, e, b = d to a constant modulus.

    Gauss-Newton: sensitivities are differences by a small increment of each coefficient; the residual is the modulus
    of the freed readings minus its mean over the manoeuvre. It cannot see a turn of the magnetometer about the vertical
    (the constant deviation A), and a strength common to all axes.

    Source: patent RU 2550774 (2015).
    """
    unit = float(np.median(np.linalg.norm(reading_nt, axis=1))) if len(reading_nt) else 0.0
    if not unit > 0.0:
        nothing = Iron(np.eye(3), np.zeros(3))
        return IronFit(
            nothing, np.zeros((12, 12)), earth, float("inf"), np.zeros(0), np.zeros(12), "no field in the readings"
        )
    scaled = reading_nt / unit
    parameters = np.zeros(PARAMETERS)
    is_converged = False
    for _ in range(settings.iterations_max):
        step = np.linalg.lstsq(_sensitivity(scaled, parameters), -_residual(scaled, parameters), rcond=None)[0]
        step *= min(1.0, 0.3 / max(float(np.max(np.abs(step))), 1e-12))
        parameters = parameters + step
        if not np.isfinite(parameters).all() or np.max(np.abs(parameters)) > LARGEST:
            break
        if np.max(np.abs(step)) < CONVERGED:
            is_converged = True
            break
    if not np.isfinite(parameters).all() or np.max(np.abs(parameters)) > LARGEST:
        parameters = np.zeros(PARAMETERS)
    sensitivity, residual = _sensitivity(scaled, parameters), _residual(scaled, parameters)
    size = np.maximum(np.linalg.norm(sensitivity, axis=0), 1e-300)
    condition = float(np.linalg.cond(sensitivity / size))
    bread = np.linalg.pinv(sensitivity.T @ sensitivity)
    middle = harmonics.long_run(sensitivity * residual[:, None], harmonics.autocorrelation(residual, PARAMETERS))
    covariance = _spread(bread @ middle @ bread, unit)
    reason = ""
    if not is_converged:
        reason = f"did not converge in {settings.iterations_max} rounds"
    elif condition > settings.modulus_condition_max:
        reason = f"condition number {condition:.3g}, at most {settings.modulus_condition_max:g}"
    soft, hard = _iron(parameters)
    return IronFit(Iron(soft, hard * unit), covariance, earth, condition, residual * unit, np.zeros(12), reason)


def _iron(parameters: FloatArray) -> tuple[FloatArray, FloatArray]:
    soft = np.eye(3)
    for row, column, place in SOFT_PLACES:
        soft[row, column] += parameters[place]
    return soft, parameters[:3]


def _modulus(scaled: FloatArray, parameters: FloatArray) -> FloatArray:
    soft, hard = _iron(parameters)
    return np.asarray(np.linalg.norm(np.linalg.solve(soft, (scaled - hard).T), axis=0), dtype=np.float64)


def _residual(scaled: FloatArray, parameters: FloatArray) -> FloatArray:
    modulus = _modulus(scaled, parameters)
    return np.asarray(modulus - np.mean(modulus))


def _sensitivity(scaled: FloatArray, parameters: FloatArray) -> FloatArray:
    """Change of the residual by each coefficient, shape (n, 6)."""
    small = 1e-5
    columns = []
    for place in range(PARAMETERS):
        nudge = np.where(np.arange(PARAMETERS) == place, small, 0.0)
        columns.append((_residual(scaled, parameters + nudge) - _residual(scaled, parameters - nudge)) / (2 * small))
    return np.stack(columns, axis=-1)


def _spread(covariance: FloatArray, unit: float) -> FloatArray:
    """Convert the covariance of the six coefficients to that of an :class:`Iron`, (12, 12).

    In nanotesla.
    """
    spread = np.zeros((12, PARAMETERS))
    spread[[9, 10, 11], [0, 1, 2]] = unit
    for row, column, place in SOFT_PLACES:
        spread[3 * row + column, place] = 1.0
    return spread @ covariance @ spread.T
