"""Rows of the answer: errors along every axis with their statistics, claimed against seen."""

from collections.abc import Iterator, Mapping
from dataclasses import replace

import numpy as np

from groundstation.base.angles import FloatArray, wrap_180
from groundstation.base.dataclasses import dataclass
from groundstation.base.records import BoolArray, frozen
from groundstation.systems.reference.answer import ClaimRow, ErrorRow, Quantity
from groundstation.systems.reference.errors import Errors
from groundstation.systems.reference.settings import ReferenceSettings
from groundstation.systems.reference.statistics import share_of, spread_of

ANGLE_AXES = ("roll", "pitch", "heading")
ANGLE_SIGMAS = ("roll_sigma_deg", "pitch_sigma_deg", "true_heading_sigma_deg")
SHARE = 0.95
LEAST_SIGMA = 1e-9  # m, m/s or deg: no device measures so well, and a smaller one is a zero that arithmetic left over


@dataclass(frozen=True)
class JudgedAxis:
    """One axis of an error: values (n,), NaN where unknown; ``sigma`` names the claim on it.

    ``parts`` (n, c) are its components: north and east of a length, which the sigma counts together; else itself.
    """

    quantity: Quantity
    name: str
    unit: str
    values: FloatArray
    sigma: str
    parts: FloatArray

    def __post_init__(self) -> None:
        object.__setattr__(self, "values", frozen(self.values))
        object.__setattr__(self, "parts", frozen(self.parts))

    @property
    def components(self) -> int:
        """Number of components that its sigma counts together."""
        return int(self.parts.shape[1])


@dataclass(frozen=True)
class CheckedClaim:
    """A claim checked sample by sample.

    ``z`` is each error as a standard normal variable if the claim is true; ``is_inside`` tells whether the error is
    inside the claimed region.
    """

    row: ClaimRow
    time_s: FloatArray
    z: FloatArray
    is_inside: BoolArray


def axes_of(errors: Errors, settings: ReferenceSettings) -> Iterator[JudgedAxis]:
    """Every axis with a known value."""
    for quantity, unit, sigma, vectors in (
        ("position", "m", "horizontal_sigma_m", errors.position_m),
        ("velocity", "mps", "velocity_sigma_mps", errors.velocity_mps),
    ):
        along, cross = errors.along_cross(vectors[:, :2], settings.moving_mps)
        vertical_sigma = "vertical_sigma_m" if quantity == "position" else ""
        listed = (
            ("along", along, "", along[:, None]),
            ("cross", cross, "", cross[:, None]),
            ("horizontal", np.hypot(vectors[:, 0], vectors[:, 1]), sigma, vectors[:, :2]),
            ("vertical", vectors[:, 2], vertical_sigma, vectors[:, 2:]),
        )
        for name, values, claim, parts in listed:
            if np.isfinite(values).any():
                yield JudgedAxis(quantity, name, unit, values, claim, parts)  # type: ignore[arg-type]
    for name, sigma, values in zip(ANGLE_AXES, ANGLE_SIGMAS, errors.angles_deg.T, strict=True):
        if np.isfinite(values).any():
            whole = _about_its_mean(values)
            yield JudgedAxis("attitude", name, "deg", whole, sigma, whole[:, None])


def _about_its_mean(angle_deg: FloatArray) -> FloatArray:
    """Return the angles without a jump at 0 or 180 deg, within 180 deg of their mean."""
    known = angle_deg[np.isfinite(angle_deg)]
    middle = float(np.rad2deg(np.angle(np.mean(np.exp(1j * np.deg2rad(known))))))
    return middle + np.where(np.isfinite(angle_deg), wrap_180(np.nan_to_num(angle_deg) - middle), np.nan)


def without_mounting(axis: JudgedAxis) -> JudgedAxis:
    """Return an angle less its mean; another axis as it is.

    The mean of a subject that has a unit of its own is how that unit stands to the reference's: nobody claims it.
    """
    if axis.quantity != "attitude":
        return axis
    values = axis.values - np.nanmean(axis.values)
    return replace(axis, values=values, parts=values[:, None])


def error_row(errors: Errors, axis: JudgedAxis, settings: ReferenceSettings) -> ErrorRow:
    """Statistics of one axis, and whether the reference's own sigma is too large to see it."""
    known = np.isfinite(axis.values)
    spread, sigma = spread_of(axis.values[known]), _rms_of(errors.reference, _reference_sigma(axis), known)
    if sigma is not None and axis.name in ("along", "cross"):
        sigma /= np.sqrt(2.0)
    is_coarse = sigma is not None and spread.rmse < settings.accuracy_ratio_min * sigma
    return ErrorRow(errors.subject, axis.quantity, axis.name, axis.unit, spread, sigma, bool(is_coarse))


def _reference_sigma(axis: JudgedAxis) -> str:
    """Name the sigma of the reference on an axis.

    A single horizontal component has the sigma of both.
    """
    if axis.name in ("along", "cross"):
        return "horizontal_sigma_m" if axis.quantity == "position" else "velocity_sigma_mps"
    return axis.sigma


def _rms_of(sigmas: Mapping[str, FloatArray], name: str, rows: BoolArray) -> float | None:
    values = sigmas.get(name)
    if values is None:
        return None
    known = values[rows & np.isfinite(values)]
    return float(np.sqrt(np.mean(np.square(known)))) if known.size else None


def checked(errors: Errors, axis: JudgedAxis) -> CheckedClaim | None:
    """Check an error against the 95 % region that subject and reference claim together.

    None without a claim.

    A length of north and east has a chi distribution with two degrees of freedom, both components taken to be equal.
    Sigmas that the reference does not tell count as nothing: then the share seen is at most that of honest claims.
    """
    from scipy.special import chdtr, ndtri

    claimed = errors.claimed.get(axis.sigma)
    if claimed is None:
        return None
    own = errors.reference.get(axis.sigma)
    own = np.zeros(len(errors)) if own is None else np.nan_to_num(own)
    total = np.hypot(claimed, own)
    known = np.isfinite(axis.values) & (total > LEAST_SIGMA)
    if known.sum() < 2:
        return None
    squares = axis.components * np.square(axis.values[known] / total[known])
    below = np.clip(chdtr(axis.components, squares), 1e-12, 1.0 - 1e-12)
    z = ndtri(below) if axis.components == 2 else axis.values[known] / total[known]
    is_inside = below <= SHARE
    share = share_of(is_inside, axis.parts[known] / (total[known, None] / np.sqrt(axis.components)))
    reference = _rms_of(errors.reference, axis.sigma, known)
    claimed_rms = float(np.sqrt(np.mean(np.square(claimed[known]))))
    is_coarse = reference is not None and reference > claimed_rms
    row = ClaimRow(
        *(errors.subject, axis.quantity, axis.name, axis.unit, int(known.sum()), share.effective_samples),
        claimed_sigma=claimed_rms,
        reference_sigma=reference,
        share_inside95=share.inside,
        confidence95=share.confidence95,
        state="reference_too_coarse" if is_coarse else share.state,
    )
    return CheckedClaim(row, errors.time_s[known], np.asarray(z), is_inside)
