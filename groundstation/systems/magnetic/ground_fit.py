"""A to E of a heading sensor from a few runs: what they show, and what they cannot."""

from collections.abc import Sequence
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from groundstation.base.angles import FloatArray, mean_heading, wrap_180, wrap_360
from groundstation.base.dataclasses import dataclass
from groundstation.base.words import listed
from groundstation.methods import harmonics
from groundstation.results.roles import LETTERS
from groundstation.systems.magnetic.ground_answer import AlongAxis, GroundCoefficient, GroundRun, Repeat

FLAT_DEG = 180.0  # prior of A: nothing is known of it
PLACE_STEPS, PLACE_REACH = 60, 4.0  # steps of the spread between runs, and how many of its scale they reach
TANGLED = 0.3  # correlation beyond which two coefficients are not told from each other


class KnownBefore(Protocol):
    """Settings of the fit: what is taken for known before a log is looked at."""

    @property
    def place_sigma_deg(self) -> float: ...
    @property
    def semicircular_sigma_deg(self) -> float: ...
    @property
    def quadrantal_sigma_deg(self) -> float: ...
    @property
    def known_share(self) -> float: ...


@dataclass(frozen=True)
class CurveFit:
    """Coefficients A to E, shape (5,), covariance without declination, (5, 5), run spread."""

    values_deg: FloatArray
    covariance: FloatArray
    place_sigma_deg: float


def fit_curve(
    heading_deg: FloatArray,
    error_deg: FloatArray,
    sigma_deg: FloatArray,
    settings: KnownBefore,
    *,
    columns: FloatArray | None = None,
    common: FloatArray | None = None,
    group: NDArray[np.intp] | None = None,
) -> CurveFit:
    """Posterior of A to E, with what a run has of its own integrated out.

    error = A + B sin c + C cos c + D sin 2c + E cos 2c + own + noise. B to E have normal priors, A has none worth the
    name; own is normal with a standard deviation that has a half-normal prior of scale ``place_sigma_deg``, so that two
    runs are not taken for more than they are. The sum over a grid of that deviation weighs each by its likelihood.

    Parameters
    ----------
    heading_deg, error_deg, sigma_deg : ndarray, shape (n,)
        Magnetic heading, error and its standard deviation without what is common to all runs.
    columns : ndarray, shape (n, 5), optional
        In place of those of the headings: of a display that lags.
    common : ndarray, shape (n, n), optional
        Covariance of the errors besides: of the wind they rest on.
    group : ndarray of int, shape (n,), optional
        Runs of one number have their own error together: pieces of one leg.

    Source: A. Gelman et al., Bayesian Data Analysis, third edition, 2013, sections 5.4 and 14.2.
    """
    columns = harmonics.design(heading_deg) if columns is None else columns
    prior = np.diag(_prior_sigma(settings) ** 2)
    shared = np.zeros((len(error_deg), len(error_deg))) if common is None else common
    together = np.eye(len(error_deg)) if group is None else (group[:, None] == group).astype(np.float64)
    scale = settings.place_sigma_deg
    own = np.linspace(0.0, PLACE_REACH * scale, PLACE_STEPS + 1)
    middle = mean_heading(error_deg)
    left = wrap_180(error_deg - middle)
    log_weight, means, covariances = np.empty(len(own)), [], []
    for place, spread in enumerate(own):
        noise = np.diag(sigma_deg**2) + spread**2 * together + shared
        expected = columns @ prior @ columns.T + noise
        gain = np.linalg.solve(expected, columns @ prior).T
        _sign, log_determinant = np.linalg.slogdet(expected)
        misfit = float(left @ np.linalg.solve(expected, left))
        log_weight[place] = -0.5 * (log_determinant + misfit + (spread / scale) ** 2)
        means.append(gain @ left)
        covariances.append(prior - gain @ columns @ prior)
    weight = np.exp(log_weight - log_weight.max())
    weight /= weight.sum()
    stacked = np.array(means)
    values = weight @ stacked
    away = stacked - values
    covariance = np.tensordot(weight, np.array(covariances), axes=1) + (away * weight[:, None]).T @ away
    values[0] = wrap_180(values[0] + middle)
    return CurveFit(values, covariance, float(weight @ own))


def _prior_sigma(settings: KnownBefore) -> FloatArray:
    semicircular, quadrantal = settings.semicircular_sigma_deg, settings.quadrantal_sigma_deg
    return np.array([FLAT_DEG, semicircular, semicircular, quadrantal, quadrantal])


def limits_deg(settings: KnownBefore) -> FloatArray:
    """Sigma up to which each of A to E is given, shape (5,)."""
    before = _prior_sigma(settings)
    before[0] = settings.semicircular_sigma_deg
    return settings.known_share * before


def coefficients_of(
    fit: CurveFit, declination_sigma_deg: float, settings: KnownBefore
) -> tuple[GroundCoefficient, ...]:
    """A to E, each given or not, with the reason; the declination counts in A alone."""
    covariance = with_declination(fit.covariance, declination_sigma_deg)
    sigma = np.sqrt(np.diag(covariance))
    correlation = covariance / np.outer(sigma, sigma)
    rows = []
    for place, (letter, limit) in enumerate(zip(LETTERS, limits_deg(settings), strict=True)):
        if sigma[place] <= limit:
            rows.append(GroundCoefficient(letter, float(fit.values_deg[place]), float(sigma[place]), "found"))
            continue
        others = [LETTERS[k] for k in range(len(LETTERS)) if k != place and abs(correlation[place, k]) > TANGLED]
        cause = (
            f"not separable from {listed(others)} by these directions" if others else "no runs on headings that show it"
        )
        rows.append(GroundCoefficient(letter, None, float(sigma[place]), "not observable", cause))
    return tuple(rows)


def with_declination(covariance: FloatArray, declination_sigma_deg: float) -> FloatArray:
    """The covariance with an error common to all runs added, which is A's alone."""
    widened = covariance.copy()
    widened[0, 0] += declination_sigma_deg**2
    return widened


def along_axis(fit: CurveFit, coefficients: Sequence[GroundCoefficient], settings: KnownBefore) -> AlongAxis | None:
    """Return the best seen axis of the semicircular error where B or C alone is not seen.

    None where no axis is either. B sin c + C cos c on the axis a is (B sin a + C cos a) cos(c - a), and another part
    across it.
    """
    if all(item.state == "found" for item in coefficients if item.letter in "BC"):
        return None
    variances, axes = np.linalg.eigh(fit.covariance[1:3, 1:3])
    sigma, axis = float(np.sqrt(max(variances[0], 0.0))), axes[:, 0]
    if sigma > settings.known_share * settings.semicircular_sigma_deg:
        return None
    direction = float(wrap_360(np.rad2deg(np.arctan2(axis[0], axis[1]))))
    value = float(fit.values_deg[1:3] @ axis)
    return AlongAxis(direction - 180.0, -value, sigma) if direction >= 180.0 else AlongAxis(direction, value, sigma)


def curve(
    fit: CurveFit, heading_deg: FloatArray, declination_sigma_deg: float, settings: KnownBefore
) -> tuple[FloatArray, FloatArray]:
    """Return the error and its sigma at magnetic headings, shapes (n,).

    NaN where it is known no better than B alone need be.
    """
    error, sigma = whole_curve(fit, heading_deg, declination_sigma_deg)
    is_known = sigma <= settings.known_share * settings.semicircular_sigma_deg
    return np.where(is_known, error, np.nan), np.where(is_known, sigma, np.nan)


def whole_curve(fit: CurveFit, heading_deg: FloatArray, declination_sigma_deg: float) -> tuple[FloatArray, FloatArray]:
    """Return the error and its sigma at magnetic headings, shapes (n,), known well or not."""
    columns = harmonics.design(heading_deg)
    covariance = with_declination(fit.covariance, declination_sigma_deg)
    sigma = np.sqrt(np.einsum("ni,ij,nj->n", columns, covariance, columns))
    return wrap_180(columns @ fit.values_deg), sigma


def directions_of(heading_deg: FloatArray, within_deg: float) -> list[list[int]]:
    """Group headings by direction, in order of heading; rows of each group.

    Headings of a group are no farther than ``within_deg`` from its first.

    Examples
    --------
    >>> directions_of(np.array([358.0, 90.0, 4.0, 271.0]), 10.0)
    [[0, 2], [1], [3]]
    """
    if not len(heading_deg):
        return []
    order = np.argsort(heading_deg)
    steps = np.diff(heading_deg[order], append=heading_deg[order[0]] + 360.0)
    start = (int(np.argmax(steps)) + 1) % len(order)
    groups: list[list[int]] = []
    for row in np.roll(order, -start).tolist():
        first = heading_deg[groups[-1][0]] if groups else 0.0
        if groups and float(wrap_360(heading_deg[row] - first)) <= within_deg:
            groups[-1].append(row)
        else:
            groups.append([row])
    return sorted(groups, key=lambda group: group[0])


def widest_gap_deg(heading_deg: FloatArray) -> float:
    """Widest part of the circle between neighbouring headings; 360 where there is one.

    Examples
    --------
    >>> widest_gap_deg(np.array([10.0, 200.0, 350.0])), widest_gap_deg(np.array([10.0]))
    (190.0, 360.0)
    """
    order = np.sort(heading_deg)
    return float(np.max(np.diff(order, append=order[0] + 360.0))) if len(order) else 360.0


def repeats_of(runs: Sequence[GroundRun], slip_sigma_deg: float, within_deg: float) -> tuple[Repeat, ...]:
    """Compare runs on about one heading: their spread, and that by noise and slip."""
    heading = np.array([run.magnetic_heading_deg for run in runs])
    rows = []
    for group in directions_of(heading, within_deg):
        members = [runs[place] for place in group]
        errors = np.array([run.error_deg for run in members if run.error_deg is not None])
        if len(errors) < 2:
            continue
        noise = np.array([run.noise_sigma_deg for run in members if run.noise_sigma_deg is not None])
        spread = float(np.std(wrap_180(errors - mean_heading(errors)), ddof=1))
        expected = float(np.sqrt(np.mean(noise**2) + slip_sigma_deg**2))
        rows.append(Repeat(mean_heading(heading[group]), len(errors), spread, expected))
    return tuple(rows)
