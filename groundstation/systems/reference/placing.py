"""Lever arm of a subject from the reference's point and its clock offset, by one fit.

The fit is to the position error.

A subject that stands ``arm`` away in body axes and shows its positions ``offset`` seconds later errs by

    error = n_from_b(heading) . arm - velocity * offset + constant + errors of its own.

Turns tell the arm from the constant, changes of speed and of direction the offset from the arm ahead.
"""

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.dataclasses import dataclass
from groundstation.base.quantiles import student_quantile
from groundstation.systems.reference.answer import Observed, Placed
from groundstation.systems.reference.errors import Errors
from groundstation.systems.reference.settings import ReferenceSettings
from groundstation.systems.reference.statistics import independent

UNKNOWNS = 5  # arm forward and right, offset, constant north and east
FAR_SIGMAS = 5.0
ROUNDING_M = 1e-6  # errors of a constant are the rounding of positions: none of it is far
RANK = 1e-9  # of the largest singular value: below it two unknowns are one
COARSE_STEP_S, GROSS_S = 0.25, 1.0
BETTER = 0.5  # what a gross offset must leave of the difference of speeds
LEAST_COMPARED = 20


@dataclass(frozen=True)
class PlaceFit:
    """Arm forward and right (m) and clock offset (s), shape (3,), with 95 % half widths."""

    values: FloatArray
    half_widths: FloatArray
    freedom: FloatArray

    @property
    def arm_m(self) -> FloatArray:
        """Forward and right."""
        return self.values[:2]


def fit_place(errors: Errors) -> PlaceFit | None:
    """Fit arm and clock offset to the position errors; None where too little is known.

    Notes
    -----
    Least squares, once more without what is further out than 5 robust sigmas. Each unknown is a weighted sum of the
    errors; its variance is that of the sum of (weight times residual), by the effective number of those products:
    residuals may be slow as long as turns make their products quick. What it ignores: an arm up or down, which is a
    constant of height, and a constant error of the subject along its own axes.

    Source: Newey, West, A simple, positive semi-definite, heteroskedasticity and autocorrelation consistent covariance
    matrix, Econometrica 55 (1987) 703, the sum ended as Geyer (1992) does.
    """
    known = np.isfinite(errors.position_m[:, :2]).all(axis=1) & np.isfinite(errors.motion_mps).all(axis=1)
    known &= np.isfinite(errors.heading_deg)
    if known.sum() <= 2 * UNKNOWNS:
        return None
    measured, rows = errors.position_m[known, :2], _design(errors, known)
    solved = _solved(rows, measured)
    if solved is None:
        return None
    away = np.abs(measured - rows @ solved)
    near = (away <= FAR_SIGMAS * 1.4826 * np.median(away, axis=0) + ROUNDING_M).all(axis=1)
    if not near.all() and near.sum() > 2 * UNKNOWNS:
        measured, rows = measured[near], rows[near]
        solved = _solved(rows, measured)
        if solved is None:
            return None
    left = measured - rows @ solved
    weights = np.linalg.pinv(rows.reshape(-1, UNKNOWNS), rcond=RANK).T.reshape(rows.shape)
    products = np.einsum("nci,nc->ni", weights, left)[:, :3]
    return PlaceFit(np.asarray(solved[:3]), *_uncertainty(products))


def _solved(rows: FloatArray, measured: FloatArray) -> FloatArray | None:
    """The unknowns by least squares; None where the rows do not tell them apart."""
    solved, _unused, rank, _also = np.linalg.lstsq(rows.reshape(-1, UNKNOWNS), measured.reshape(-1), rcond=RANK)
    return None if rank < UNKNOWNS else np.asarray(solved)


def _uncertainty(products: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Half widths and degrees of freedom of sums of correlated products, shape (n, k)."""
    count = np.array([independent(column) for column in products.T])
    variance = len(products) ** 2 * np.mean(np.square(products), axis=0) / (count - 1.0)
    freedom = count - 1.0
    quantiles = np.array([student_quantile(0.975, one) for one in freedom.tolist()])
    return quantiles * np.sqrt(variance), freedom


def _design(errors: Errors, known: np.ndarray) -> FloatArray:
    """Rows (n, 2, 5) of the fit: what each unknown adds north and east."""
    heading_rad = np.deg2rad(errors.heading_deg[known])
    rows = np.zeros((len(heading_rad), 2, UNKNOWNS))
    rows[:, 0, 0], rows[:, 1, 0] = np.cos(heading_rad), np.sin(heading_rad)
    rows[:, 0, 1], rows[:, 1, 1] = -np.sin(heading_rad), np.cos(heading_rad)
    rows[:, :, 2] = -errors.motion_mps[known]
    rows[:, 0, 3] = rows[:, 1, 4] = 1.0
    return rows


def place(errors: Errors, settings: ReferenceSettings, *, takes_stated: bool) -> tuple[Placed, Errors]:
    """Estimate arm and clock offset of a subject, and return its errors without the arm.

    The arm is taken out where it is known.

    ``takes_stated``: whether the arm of the settings is this subject's.
    """
    fit, with_arm = fit_place(errors), _rms(errors.horizontal_m)
    half_m, half_s = (np.inf, np.inf) if fit is None else (float(fit.half_widths[:2].max()), float(fit.half_widths[2]))
    state: Observed = "not_observable"
    arm: FloatArray | None = None
    if takes_stated and (settings.arm_forward_m is not None or settings.arm_right_m is not None):
        state, arm = "stated", np.array([settings.arm_forward_m or 0.0, settings.arm_right_m or 0.0])
    elif fit is not None and half_m <= settings.arm_half_width_max_m:
        state, arm = "observed", fit.arm_m
    is_taken = arm is not None and (state == "stated" or settings.use_arm == "when_observed")
    judged = errors.without_arm(float(arm[0]), float(arm[1])) if arm is not None and is_taken else errors
    offset_s = None if fit is None or half_s > settings.clock_half_width_max_s else float(fit.values[2])
    placed = Placed(
        errors.subject,
        arm_state=state,
        clock_state="not_observable" if offset_s is None else "observed",
        reason=_reason(fit, half_m, half_s, settings),
        arm_forward_m=None if arm is None else float(arm[0]),
        arm_right_m=None if arm is None else float(arm[1]),
        arm_half_width_m=half_m if state == "observed" else None,
        clock_offset_s=offset_s,
        clock_offset95_s=None if offset_s is None else (offset_s - half_s, offset_s + half_s),
        rmse_with_arm_m=with_arm,
        rmse_m=_rms(judged.horizontal_m),
        is_arm_taken_out=is_taken,
    )
    return placed, judged


def _reason(fit: PlaceFit | None, half_m: float, half_s: float, settings: ReferenceSettings) -> str:
    """Return what the fit rests on, or why arm or clock are not observable."""
    if fit is None:
        return "too few positions with motion and heading"
    parts = [f"{fit.freedom.min():.0f} degrees of freedom at least"]
    for what, values, half, most, unit in (
        ("arm", fit.arm_m, half_m, settings.arm_half_width_max_m, "m"),
        ("clock", fit.values[2:], half_s, settings.clock_half_width_max_s, "s"),
    ):
        if half > most:
            found = ", ".join(f"{value:+.2g}" for value in values.tolist())
            parts.append(f"{what} {found} {unit} known to +- {half:.2g} {unit} only, limit {most:g} {unit}")
    return "; ".join(parts)


def gross_offset_s(
    errors_at: FloatArray, speed: FloatArray, true_s: FloatArray, true_speed: FloatArray, most: float
) -> float:
    """Return how many seconds later a subject shows the speeds of the reference.

    0 where the offset is not grossly different from zero.

    Parameters
    ----------
    errors_at, speed : ndarrays, shape (n,)
        Times and ground speeds of the subject.
    true_s, true_speed : ndarrays, shape (m,)
        Of the reference.
    most : float
        Offset searched either way.
    """
    steps = np.arange(-most, most + COARSE_STEP_S, COARSE_STEP_S)
    left = np.full(len(steps), np.inf)
    for place_, offset in enumerate(steps):
        inside = (errors_at - offset >= true_s[0]) & (errors_at - offset <= true_s[-1])
        if inside.sum() >= max(LEAST_COMPARED, 0.5 * len(errors_at)):
            shown = np.interp(errors_at[inside] - offset, true_s, true_speed)
            left[place_] = float(np.sqrt(np.mean(np.square(speed[inside] - shown))))
    here, best = left[int(np.argmin(np.abs(steps)))], int(np.argmin(left))
    is_gross = abs(steps[best]) >= GROSS_S and np.isfinite(here) and left[best] < BETTER * here
    return float(steps[best]) if is_gross else 0.0


def _rms(values: FloatArray) -> float:
    known = values[np.isfinite(values)]
    return float(np.sqrt(np.mean(np.square(known)))) if known.size else float("nan")
