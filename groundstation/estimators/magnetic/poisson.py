"""Hard and soft iron from the readings and the attitude: twelve parameters, and three of the current."""

from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import minimize_scalar

from groundstation.base.angles import FloatArray, wrap_180
from groundstation.estimators.magnetic import harmonics
from groundstation.estimators.magnetic.attitude import field_in_body, levelled_heading_deg
from groundstation.estimators.magnetic.iron import Iron
from groundstation.estimators.magnetic.readings import Readings
from groundstation.estimators.magnetic.settings import MagneticSettings

AXES = 3
MAD_SIGMA = 1.4826  # median of absolute values -> standard deviation of a normal distribution
DIP_MAX_DEG = 88.0
ROUNDS = 20


@dataclass(frozen=True)
class EarthField:
    """The earth's field at the figure: declination, east positive, horizontal and downward intensity.

    ``is_modelled`` False: no model said the intensities; they are those of the readings, the dip is fitted.
    """

    declination_deg: float
    horizontal_nt: float
    down_nt: float
    is_modelled: bool = True


@dataclass(frozen=True)
class IronFit:
    """An iron with its statistical covariance, shape (k, k), in the order of :meth:`Iron.vector`.

    ``residual_nt`` (n, 3) or, of the modulus, (n,). ``reason`` where it is refused. ``per_azimuth_deg`` (k,): change of
    the parameters when the reference heading is 1 deg larger.
    """

    iron: Iron
    covariance: FloatArray
    earth: EarthField
    condition_number: float
    residual_nt: FloatArray
    per_azimuth_deg: FloatArray
    reason: str = ""

    def covariance_with(self, azimuth_sigma_deg: float) -> FloatArray:
        """Covariance with the error of the reference heading in it: alignment, drift, declination."""
        return self.covariance + azimuth_sigma_deg**2 * np.outer(self.per_azimuth_deg, self.per_azimuth_deg)

    @property
    def rms_nt(self) -> float:
        return float(np.sqrt(np.mean(self.residual_nt**2))) if self.residual_nt.size else float("nan")


def fit_iron(readings: Readings, earth: EarthField, settings: MagneticSettings) -> IronFit:
    """Fit reading = soft @ field + hard + effect x (current - mean current).

    The field is the model's, turned into the body by the attitude of the INS, so that the problem is linear: four or
    five parameters an axis. Outliers count less by Huber's weights on the length of the residual over its robust
    sigma. The covariance allows for residuals correlated in time and between the axes. Where no model serves, the dip
    is found besides, by least residual; the strength does not matter to a heading. An error of the reference heading
    turns the field about the vertical, not about the body's axis: at bank it goes into the soft iron, E above all, so
    that the fit is repeated with the heading 1 deg off.
    """
    found = _with_dip(readings, earth, settings)
    turned = replace(found.earth, declination_deg=found.earth.declination_deg - 1.0)
    return replace(found, per_azimuth_deg=_fitted(readings, turned, settings).iron.vector() - found.iron.vector())


def _with_dip(readings: Readings, earth: EarthField, settings: MagneticSettings) -> IronFit:
    """The fit against a model's field, or the best of all dips."""
    if earth.is_modelled:
        return _fitted(readings, earth, settings)
    strength = float(np.hypot(earth.horizontal_nt, earth.down_nt))

    def of_dip(dip_deg: float) -> EarthField:
        dip_rad = np.deg2rad(dip_deg)
        horizontal, down = float(strength * np.cos(dip_rad)), float(strength * np.sin(dip_rad))
        return EarthField(earth.declination_deg, horizontal, down, is_modelled=False)

    best = minimize_scalar(
        lambda dip_deg: _fitted(readings, of_dip(dip_deg), settings).rms_nt,
        bounds=(-DIP_MAX_DEG, DIP_MAX_DEG),
        method="bounded",
    )
    return _fitted(readings, of_dip(float(best.x)), settings)


def corrected_heading_deg(iron: Iron, readings: Readings) -> FloatArray:
    """Magnetic heading of readings freed of an iron, in [0, 360)."""
    field = iron.field_nt(readings.field_nt, readings.current_a)
    return levelled_heading_deg(field, readings.roll_deg, readings.pitch_deg)


def _fitted(readings: Readings, earth: EarthField, settings: MagneticSettings) -> IronFit:
    columns, reference_a = _columns(readings, earth, settings)
    scale = np.sqrt(np.mean(columns**2, axis=0))
    scaled = columns / scale
    weight = np.ones(len(columns))
    for _ in range(ROUNDS):
        root = np.sqrt(weight)[:, None]
        parameters = np.linalg.lstsq(scaled * root, readings.field_nt * root, rcond=None)[0]
        residual = readings.field_nt - scaled @ parameters
        lengths = _lengths(residual)
        fresh = np.minimum(1.0, settings.robust_sigmas / np.maximum(lengths, 1e-12))
        if np.max(np.abs(fresh - weight)) < 1e-6:
            break
        weight = fresh
    condition = float(np.linalg.cond(scaled))
    covariance = _covariance(scaled, residual, weight) / np.outer(*[np.tile(scale, AXES)] * 2)
    parameters = parameters / scale[:, None]
    current = parameters[AXES + 1] if columns.shape[1] > AXES + 1 else None
    iron = Iron(parameters[:AXES].T.copy(), parameters[AXES], current, reference_a)
    order = _order(columns.shape[1])
    reason = _objection(iron, condition, settings)
    return IronFit(iron, covariance[np.ix_(order, order)], earth, condition, residual, np.zeros(len(order)), reason)


def _columns(readings: Readings, earth: EarthField, settings: MagneticSettings) -> tuple[FloatArray, float]:
    """What multiplies the parameters of an axis: the field along the body, 1, and the current where it varies."""
    heading = wrap_180(readings.true_heading_deg - earth.declination_deg)
    field = field_in_body(earth.horizontal_nt, earth.down_nt, heading, readings.roll_deg, readings.pitch_deg)
    parts, current = [field, np.ones((len(field), 1))], readings.current_a
    reference_a = float(np.mean(current)) if len(current) and np.isfinite(current).all() else 0.0
    if np.isfinite(current).all() and len(current) and float(np.std(current)) >= settings.current_spread_min_a:
        parts.append((current - reference_a)[:, None])
    return np.concatenate(parts, axis=1), reference_a


def _lengths(residual: FloatArray) -> FloatArray:
    """Lengths of residuals over their robust sigma, root mean square of the axes."""
    sigma = MAD_SIGMA * np.median(np.abs(residual), axis=0)
    sigma = np.maximum(sigma, 1e-9 + 1e-12 * np.max(np.abs(residual), initial=0.0))
    return np.asarray(np.sqrt(np.mean((residual / sigma) ** 2, axis=1)))


def _covariance(scaled: FloatArray, residual: FloatArray, weight: FloatArray) -> FloatArray:
    """Covariance of the parameters of the three axes, one axis after the other."""
    bread = np.linalg.pinv(scaled.T @ (scaled * weight[:, None]))
    scores = np.concatenate([scaled * (weight * residual[:, axis])[:, None] for axis in range(AXES)], axis=1)
    correlation = max(harmonics.autocorrelation(residual[:, axis], scaled.shape[1]) for axis in range(AXES))
    whole = np.kron(np.eye(AXES), bread)
    middle: FloatArray = harmonics.long_run(scores, correlation)
    middle = middle * harmonics.inflation(len(residual), scaled.shape[1], correlation)
    return np.asarray(whole @ middle @ whole)


def _order(width: int) -> list[int]:
    """Places of soft iron by rows, hard iron and current effect among the parameters axis by axis."""
    soft = [axis * width + column for axis in range(AXES) for column in range(AXES)]
    return soft + [axis * width + column for column in range(AXES, width) for axis in range(AXES)]


def _objection(iron: Iron, condition: float, settings: MagneticSettings) -> str:
    if not np.isfinite(condition) or condition > settings.attitude_condition_max:
        return (
            f"condition number {condition:.3g}, at most {settings.attitude_condition_max:g}: the attitudes flown do "
            "not tell hard from soft iron"
        )
    if not np.isfinite(iron.vector()).all() or np.linalg.cond(iron.soft) > settings.attitude_condition_max:
        return "the soft iron found is no aircraft's: an axis of the magnetometer does not follow the field"
    return ""
