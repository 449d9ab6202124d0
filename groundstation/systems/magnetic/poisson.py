"""Hard and soft iron from readings and attitude: twelve parameters, three of the current."""

from dataclasses import replace

import numpy as np

from groundstation.base.angles import FloatArray, wrap_180
from groundstation.base.dataclasses import dataclass
from groundstation.base.declination import HORIZONTAL_SIGMA_NT, NORTH_EAST_DOWN_SIGMA_NT
from groundstation.methods import harmonics
from groundstation.systems.magnetic.attitude import field_in_body, levelled_heading_deg
from groundstation.systems.magnetic.iron import Iron
from groundstation.systems.magnetic.readings import Readings
from groundstation.systems.magnetic.settings import MagneticSettings

AXES = 3
MAD_SIGMA = 1.4826  # median of absolute values -> standard deviation of a normal distribution
DIP_MAX_DEG = 88.0
ROUNDS = 20
DOWN_STEP_NT = 100.0  # of the derivative by the vertical field, in which the fit is all but linear
LEAST_BANK_DEG = 1.0


@dataclass(frozen=True)
class EarthField:
    """Earth's field at the figure: declination, east positive, horizontal and down intensity.

    ``is_modelled`` False: no model said the intensities; they are those of the readings, the dip is fitted.
    """

    declination_deg: float
    horizontal_nt: float
    down_nt: float
    is_modelled: bool = True

    @property
    def per_tilt(self) -> float:
        """Return the heading error per error of roll or pitch: Z / H, the tan of dip.

        Roll turns the vertical field Z into the horizontal, angle x Z / H in C; pitch does in B.
        """
        return abs(self.down_nt) / self.horizontal_nt if self.horizontal_nt > 0.0 else 0.0


@dataclass(frozen=True)
class DipShift:
    """Vertical field that the readings show more than the model at its H, and its sigma.

    The sigma is what this shift should have.
    """

    down_nt: float
    sigma_nt: float

    @property
    def sigmas(self) -> float:
        return abs(self.down_nt) / self.sigma_nt


@dataclass(frozen=True)
class IronFit:
    """Iron with its covariance, shape (k, k), in the order of :meth:`Iron.vector`.

    The covariance is that of the readings and of the dip. ``residual_nt`` (n, 3) or, of the modulus, (n,). ``reason``
    where it is refused. ``per_azimuth_deg`` (k,): change of the parameters when the reference heading is 1 deg larger.
    ``strength_covariance`` (k, k) is what an error of the field's strength adds: the soft iron is larger for it, and no
    heading changes. ``dip_shift``: None without a model.
    """

    iron: Iron
    covariance: FloatArray
    earth: EarthField
    condition_number: float
    residual_nt: FloatArray
    per_azimuth_deg: FloatArray
    reason: str = ""
    strength_covariance: FloatArray | None = None
    dip_shift: DipShift | None = None

    def covariance_with(self, azimuth_sigma_deg: float) -> FloatArray:
        """Covariance with the error of the reference heading in it: alignment, drift, declination."""
        return self.covariance + azimuth_sigma_deg**2 * np.outer(self.per_azimuth_deg, self.per_azimuth_deg)

    def stated_covariance(self, azimuth_sigma_deg: float) -> FloatArray:
        """Return the covariance of the parameters themselves, the field's strength included."""
        covariance = self.covariance_with(azimuth_sigma_deg)
        return covariance if self.strength_covariance is None else covariance + self.strength_covariance

    @property
    def rms_nt(self) -> float:
        return float(np.sqrt(np.mean(self.residual_nt**2))) if self.residual_nt.size else float("nan")


@dataclass(frozen=True)
class _Solved:
    """Least squares against one field.

    ``influence`` (n, k) is what each reading does to the parameters.
    """

    iron: Iron
    earth: EarthField
    condition_number: float
    residual_nt: FloatArray
    weight: FloatArray
    influence: FloatArray
    correlation: float

    def variance(self, influence: FloatArray) -> FloatArray:
        """Return the covariance of what has an influence (n, m), shape (m, m).

        Residuals are correlated in time.
        """
        width = self.influence.shape[1] // AXES
        return harmonics.long_run(influence, self.correlation) * harmonics.inflation(
            len(influence), width, self.correlation
        )


@dataclass(frozen=True)
class _Field:
    """Knowledge of the field after the readings, relative to one solution.

    Parameters
    ----------
    moved : ndarray, shape (n,)
        What each reading does to Z at a given H.
    down_nt : float
        Z that the readings show more than the model at the H of the solution.
    variance, wander_variance : float
        Variance of ``down_nt``; the part of it by roll that wanders.
    gain : float
        Share of ``down_nt`` that is believed.
    shift_nt : (float, float)
        Change of H and Z that is believed.
    prior_variance : float
        Variance of Z at a given H, as the model has it.
    per_strength : float
        Relative strength of the field that goes with 1 nT of Z at a given H.
    strength_variance : float
        Variance of the relative strength beyond that.
    """

    moved: FloatArray
    down_nt: float
    variance: float
    wander_variance: float
    gain: float = 1.0
    shift_nt: tuple[float, float] = (0.0, 0.0)
    prior_variance: float = 0.0
    per_strength: float = 0.0
    strength_variance: float = 0.0


def fit_iron(readings: Readings, earth: EarthField, settings: MagneticSettings) -> IronFit:
    """Fit reading = soft @ field + hard + effect x (current - mean current).

    The field is turned into the body by the attitude of the INS, so that the problem is linear: four or five parameters
    an axis. Outliers count less by Huber's weights on the length of the residual over its robust sigma. The covariance
    allows for residuals correlated in time and between the axes.

    The strength of the field goes into the soft iron alike on all axes and does not matter to a heading. Z at a given H
    does: between opposite banks it moves the mean of the sideways axis by twice sin(bank) Z, so that the readings show
    it. It is weighed against the model's, or stands alone where no model serves.

    An error of the reference heading turns the field about the vertical, not about the body's axis: at bank it goes
    into the soft iron, E above all, so that the fit is repeated with the heading 1 deg off.
    """
    by_model = _with_dip(readings, earth, settings)
    raised = _solved(readings, _raised(by_model.earth, 0.0, DOWN_STEP_NT), settings)
    iron_per_down = (raised.iron.vector() - by_model.iron.vector()) / DOWN_STEP_NT
    residual_per_down = (raised.residual_nt - by_model.residual_nt) / DOWN_STEP_NT
    seen_down_nt = float(np.sum(_moved(by_model, residual_per_down)))
    by_readings = _solved(readings, _raised(by_model.earth, 0.0, seen_down_nt), settings)
    field = _field(readings, by_model.earth, by_readings, residual_per_down, settings)
    found = _solved(readings, _raised(by_model.earth, *field.shift_nt), settings)
    turned = replace(found.earth, declination_deg=found.earth.declination_deg - 1.0)
    down_variance = (1.0 - field.gain) ** 2 * field.prior_variance + field.gain**2 * field.wander_variance
    influence = by_readings.influence + field.gain * np.outer(field.moved, iron_per_down)
    dip_shift = DipShift(field.down_nt, float(np.sqrt(field.prior_variance + field.variance)))
    return IronFit(
        iron=found.iron,
        covariance=by_readings.variance(influence) + down_variance * np.outer(iron_per_down, iron_per_down),
        earth=found.earth,
        condition_number=found.condition_number,
        residual_nt=found.residual_nt,
        per_azimuth_deg=_solved(readings, turned, settings).iron.vector() - found.iron.vector(),
        reason=_objection(found.iron, found.condition_number, settings),
        strength_covariance=_strength_covariance(found.iron, iron_per_down, field) if earth.is_modelled else None,
        dip_shift=dip_shift if earth.is_modelled else None,
    )


def _raised(earth: EarthField, horizontal_nt: float, down_nt: float) -> EarthField:
    return replace(earth, horizontal_nt=earth.horizontal_nt + horizontal_nt, down_nt=earth.down_nt + down_nt)


def _moved(solved: _Solved, seen: FloatArray) -> FloatArray:
    """Return what each reading does to Z at a given H, shape (n,).

    ``seen`` (n, 3) is the residual per nT of it.
    """
    power = max(float(np.sum(solved.weight[:, None] * seen**2)), 1e-12)
    return np.asarray(-solved.weight * np.sum(seen * solved.residual_nt, axis=1) / power)


def _field(
    readings: Readings, model: EarthField, solved: _Solved, seen: FloatArray, settings: MagneticSettings
) -> _Field:
    """Return Z at a given H as the readings show it, and as the model has it.

    ``solved`` is in the field of the readings. Strength s = dH / H and d = dZ - Z s have the covariance of the model's
    H and Z; d is measured. Roll that wanders by w between the banks looks like Z w / tan(bank) of it.

    Source: Gelb, Applied Optimal Estimation, 1974, section 4.2.
    """
    earth, moved = solved.earth, _moved(solved, seen)
    bank_rad = np.deg2rad(max(float(np.mean(np.abs(readings.roll_deg))), LEAST_BANK_DEG))
    wander = (np.deg2rad(settings.attitude_wander_deg) * earth.down_nt / np.tan(bank_rad)) ** 2
    down = earth.down_nt - model.down_nt + float(np.sum(moved))
    variance = float(solved.variance(moved[:, None])[0, 0]) + float(wander)
    if not earth.is_modelled or earth.horizontal_nt <= 0.0:
        return _Field(moved, down, variance, float(wander), shift_nt=(0.0, down))
    strength = (HORIZONTAL_SIGMA_NT / earth.horizontal_nt) ** 2
    prior = NORTH_EAST_DOWN_SIGMA_NT[2] ** 2 + earth.down_nt**2 * strength
    per_strength = -earth.down_nt * strength / prior
    gain = prior / (prior + variance)
    relative = per_strength * gain * down
    return _Field(
        moved=moved,
        down_nt=down,
        variance=variance,
        wander_variance=float(wander),
        gain=gain,
        shift_nt=(earth.horizontal_nt * relative, gain * down + earth.down_nt * relative),
        prior_variance=prior,
        per_strength=per_strength,
        strength_variance=strength - per_strength**2 * prior,
    )


def _strength_covariance(iron: Iron, per_down: FloatArray, field: _Field) -> FloatArray:
    """Return what the error of the strength adds to the covariance of the iron.

    The strength adds through Z at a given H and by itself.
    """
    per_strength = np.zeros(len(per_down))
    per_strength[: AXES * AXES] = -iron.soft.ravel()
    left = (1.0 - field.gain) ** 2 * field.prior_variance + field.gain**2 * field.variance
    both = per_down + field.per_strength * per_strength
    added = left * (np.outer(both, both) - np.outer(per_down, per_down))
    return np.asarray(added + field.strength_variance * np.outer(per_strength, per_strength))


def _with_dip(readings: Readings, earth: EarthField, settings: MagneticSettings) -> _Solved:
    """The fit against a model's field, or the best of all dips."""
    if earth.is_modelled:
        return _solved(readings, earth, settings)
    strength = float(np.hypot(earth.horizontal_nt, earth.down_nt))

    def of_dip(dip_deg: float) -> EarthField:
        dip_rad = np.deg2rad(dip_deg)
        horizontal, down = float(strength * np.cos(dip_rad)), float(strength * np.sin(dip_rad))
        return EarthField(earth.declination_deg, horizontal, down, is_modelled=False)

    from scipy.optimize import minimize_scalar  # 0.15 s to import, which flights without a magnetometer are spared

    best = minimize_scalar(
        lambda dip_deg: float(np.mean(_solved(readings, of_dip(dip_deg), settings).residual_nt ** 2)),
        bounds=(-DIP_MAX_DEG, DIP_MAX_DEG),
        method="bounded",
    )
    return _solved(readings, of_dip(float(best.x)), settings)


def corrected_heading_deg(iron: Iron, readings: Readings) -> FloatArray:
    """Magnetic heading of readings freed of an iron, in [0, 360)."""
    field = iron.field_nt(readings.field_nt, readings.current_a)
    return levelled_heading_deg(field, readings.roll_deg, readings.pitch_deg)


def _solved(readings: Readings, earth: EarthField, settings: MagneticSettings) -> _Solved:
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
    parameters = parameters / scale[:, None]
    current = parameters[AXES + 1] if columns.shape[1] > AXES + 1 else None
    return _Solved(
        Iron(parameters[:AXES].T.copy(), parameters[AXES], current, reference_a),
        earth,
        float(np.linalg.cond(scaled)),
        residual,
        weight,
        _influence(scaled, scale, residual, weight),
        max(harmonics.autocorrelation(residual[:, axis], scaled.shape[1]) for axis in range(AXES)),
    )


def _influence(scaled: FloatArray, scale: FloatArray, residual: FloatArray, weight: FloatArray) -> FloatArray:
    """Return what each reading does to the parameters, shape (n, k).

    Parameters are in the order of :meth:`Iron.vector`.
    """
    bread = np.linalg.pinv(scaled.T @ (scaled * weight[:, None]))
    of_unit = (scaled * weight[:, None]) @ bread / scale
    whole = np.concatenate([of_unit * residual[:, axis, None] for axis in range(AXES)], axis=1)
    return np.asarray(whole[:, _order(scaled.shape[1])])


def _columns(readings: Readings, earth: EarthField, settings: MagneticSettings) -> tuple[FloatArray, float]:
    """Return what multiplies the parameters of an axis.

    Columns are the field along the body, 1, and the current where it varies.
    """
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


def _order(width: int) -> list[int]:
    """Return the indices of soft iron, hard iron and current effect among the parameters.

    The parameters stand axis by axis; soft iron is given by rows.
    """
    soft = [axis * width + column for axis in range(AXES) for column in range(AXES)]
    return soft + [axis * width + column for column in range(AXES, width) for axis in range(AXES)]


def _objection(iron: Iron, condition: float, settings: MagneticSettings) -> str:
    if not np.isfinite(condition) or condition > settings.attitude_condition_max:
        return (
            f"condition number {condition:.3g}, at most {settings.attitude_condition_max:g}: the attitudes flown do "
            "not separate hard from soft iron"
        )
    if not np.isfinite(iron.vector()).all() or np.linalg.cond(iron.soft) > settings.attitude_condition_max:
        return "the soft iron found is not plausible: an axis of the magnetometer does not follow the field"
    return ""
