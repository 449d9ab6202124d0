"""Belief about an installation: sums over histories, crosswind factors, rates of oddity.

The sums are exact. One flight shows, on taxi, in flight and at a reference (theodolite, runway):

    taxi      = alignment error + own + steady + factor x crosswind + noise
    azimuth   = alignment error + noise
    reference = alignment error + own + noise

``own`` is the mounting of the unit that flew: that of the installation, or another one where the flight is odd (a
serial mistyped, two units under one). The mounting may change between flights without a new serial. Given a history
(which flights changed, which are odd), a factor and a rate of oddity, everything is linear and normal: a Kalman filter
of (mounting, steady, own, alignment error). The factor is a grid of values, the rate one of a few; of the histories the
likeliest are kept. What follows for a flight is therefore a mixture of normal distributions, and its quantiles are
exact but for the histories that were left out.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from groundstation.base.angles import wrap_180
from groundstation.base.dataclasses import dataclass
from groundstation.results.installations import Installed, Lesson
from groundstation.systems.heading.installation.settings import GROSS_DEG, InstallationSettings

FloatArray = NDArray[np.float64]
MOUNTING, STEADY, OWN, ALIGNMENT = range(4)
TAXI = np.array([0.0, 1.0, 1.0, 1.0])  # of (mounting, steady, own, alignment error)
AZIMUTH = np.array([0.0, 0.0, 0.0, 1.0])
REFERENCE = np.array([0.0, 0.0, 1.0, 1.0])
SAME, CHANGED, CHANGED_GROSSLY, ODD, ODD_GROSSLY = "scCoO"
BRANCHES = (SAME, CHANGED, CHANGED_GROSSLY, ODD, ODD_GROSSLY)
LEAST_VARIANCE = 1e-12
LEAST_WEIGHT = 1e-9  # of a history, against the likeliest


@dataclass(frozen=True)
class Belief:
    """Belief by the flights so far; ``weight`` sums to one.

    Parameters
    ----------
    histories : tuple of str
        A letter for each flight that taught, h of them.
    factor : ndarray, shape (k,)
        Crosswind factors, deg per m/s.
    weight : ndarray, shape (h, r, k)
        By history, rate of oddity and factor.
    mean : ndarray, shape (h, k, 2)
        Mounting and steady sideslip, deg.
    covariance : ndarray, shape (h, k, 2, 2)
    """

    histories: tuple[str, ...]
    factor: FloatArray
    weight: FloatArray
    mean: FloatArray
    covariance: FloatArray
    flights: int = 0


@dataclass(frozen=True)
class Mixture:
    """Heading errors of one flight as a mixture of n normal distributions, deg.

    Parameters
    ----------
    weight : ndarray, shape (n,)
    mean, sigma : ndarrays, shape (n, 2)
        Of the airframe's error and of the platform's.
    taxi_share : ndarray, shape (n, 2)
        How far the number follows the taxi: 1 where nothing but the taxi speaks.
    factor : ndarray, shape (n,)
    """

    weight: FloatArray
    mean: FloatArray
    sigma: FloatArray
    taxi_share: FloatArray
    factor: FloatArray


@dataclass(frozen=True)
class _Branches:
    """States of a flight for b branches and h histories, before it is seen.

    They are (mounting, steady, own, alignment error).
    """

    letters: tuple[str, ...]
    weight: FloatArray  # (b, h, r, k)
    mean: FloatArray  # (b, h, k, 4)
    covariance: FloatArray  # (b, h, k, 4, 4)


def first_belief(lesson: Lesson, settings: InstallationSettings) -> Belief:
    """Return the belief before any flight: the unit sits as usual, or anyhow (two histories)."""
    factor, factor_weight = factor_nodes(lesson.factor, lesson.factor_sigma, settings)
    rates = np.array(settings.odd_weights)
    sits = np.array([1.0 - settings.gross_share, settings.gross_share]) * np.array([1.0, settings.hazard])
    weight = (sits / sits.sum())[:, None, None] * rates[None, :, None] * factor_weight
    mean = np.zeros((2, len(factor), 2))
    mean[..., MOUNTING] = lesson.mounting_deg
    covariance = np.zeros((2, len(factor), 2, 2))
    covariance[0, :, MOUNTING, MOUNTING] = lesson.mounting_sigma_deg**2
    covariance[1, :, MOUNTING, MOUNTING] = GROSS_DEG**2
    covariance[..., STEADY, STEADY] = lesson.steady_sigma_deg**2
    return Belief(("", ""), factor, weight, mean, covariance)


def factor_nodes(mean: float, sigma: float, settings: InstallationSettings) -> tuple[FloatArray, FloatArray]:
    """Return values of a positive, lognormal factor and their weights (sum 1), shapes (k,).

    The factor has this mean and sigma.

    Examples
    --------
    >>> values, weight = factor_nodes(0.05, 0.025, InstallationSettings())
    >>> round(float(weight @ values), 3), round(float(np.sqrt(weight @ (values - 0.05) ** 2)), 3)
    (0.05, 0.025)
    """
    if not (mean > 0.0 and sigma > 0.0):
        return np.array([mean]), np.ones(1)
    spread = np.sqrt(np.log1p((sigma / mean) ** 2))
    places = np.linspace(-settings.factor_sigmas, settings.factor_sigmas, settings.nodes)
    weight = np.exp(-0.5 * places**2)
    return mean * np.exp(spread * places - 0.5 * spread**2), weight / weight.sum()


def learn(belief: Belief, lesson: Lesson, settings: InstallationSettings) -> Belief:
    """The belief after a flight that teaches."""
    branches = _branched(belief, lesson, settings)
    mean, covariance, log_likelihood = branches.mean, branches.covariance, np.zeros(branches.mean.shape[:-1])
    for row, value, variance in _seen(lesson, belief.factor):
        mean, covariance, likelihood = _update(mean, covariance, row, value, variance)
        log_likelihood = log_likelihood + likelihood
    weight = branches.weight * np.exp(log_likelihood - log_likelihood.max())[:, :, None, :]
    weight = weight / weight.sum()
    share = weight.sum(axis=(2, 3)).ravel()  # of each history, branch by branch
    order = np.argsort(-share, kind="stable")[: settings.hypotheses]
    order = order[share[order] >= LEAST_WEIGHT * share[order[0]]]
    branch, history = np.divmod(order, len(belief.histories))
    kept = weight[branch, history]
    return replace(
        belief,
        histories=tuple(
            belief.histories[h] + branches.letters[b] for b, h in zip(branch.tolist(), history.tolist(), strict=True)
        ),
        weight=kept / kept.sum(),
        mean=mean[branch, history][..., :2],
        covariance=covariance[branch, history][..., :2, :2],
        flights=belief.flights + 1,
    )


def predict(belief: Belief, lesson: Lesson, settings: InstallationSettings) -> Mixture:
    """Heading errors of a flight from its taxi and from what earlier flights taught."""
    assert lesson.number_deg is not None
    branches = _branched(belief, lesson, settings)
    noise = _taxi_variance(lesson, belief.factor)
    value = lesson.number_deg - belief.factor * lesson.crosswind_mps
    mean, covariance, log_likelihood = _update(branches.mean, branches.covariance, TAXI, value, noise)
    weight = branches.weight.sum(axis=2) * np.exp(log_likelihood - log_likelihood.max())
    weight = (weight / weight.sum()).ravel()
    rows = np.stack([REFERENCE, AZIMUTH])  # the airframe's error is alignment error + own, the platform's the former
    means = mean @ rows.T
    variance = np.einsum("ti,...ij,tj->...t", rows, covariance, rows)
    before = branches.covariance @ TAXI
    share = (before @ rows.T) / (before @ TAXI + noise)[..., None]
    size = len(weight)
    kept = weight > LEAST_WEIGHT
    factor = np.broadcast_to(belief.factor, log_likelihood.shape).ravel()
    return Mixture(
        weight[kept] / weight[kept].sum(),
        means.reshape(size, 2)[kept],
        np.sqrt(np.maximum(variance.reshape(size, 2)[kept], LEAST_VARIANCE)),
        share.reshape(size, 2)[kept],
        factor[kept],
    )


def installed(belief: Belief) -> Installed:
    """Return the belief in figures: means and standard deviations.

    They are of mounting, steady sideslip, their sum and the factor.
    """
    weight = belief.weight.sum(axis=1)

    def moments(row: FloatArray) -> tuple[float, float]:
        means = belief.mean @ row
        own = np.einsum("i,hkij,j->hk", row, belief.covariance, row)
        middle = float(np.sum(weight * means))
        return middle, float(np.sqrt(np.sum(weight * (own + (means - middle) ** 2))))

    by_factor = weight.sum(axis=0)
    factor = float(by_factor @ belief.factor)
    return Installed(
        belief.flights,
        *moments(np.array([1.0, 0.0])),
        *moments(np.array([0.0, 1.0])),
        *moments(np.array([1.0, 1.0])),
        factor,
        float(np.sqrt(by_factor @ (belief.factor - factor) ** 2)),
    )


def doubts(belief: Belief) -> tuple[FloatArray, FloatArray]:
    """Return for each flight that taught the chances that it is odd or changed, shapes (f,).

    Changed: from it on the unit sits otherwise.
    """
    share = belief.weight.sum(axis=(1, 2))
    letters = np.array([list(history) for history in belief.histories]).reshape(len(share), belief.flights)
    odd = np.isin(letters, [ODD, ODD_GROSSLY])
    changed = np.isin(letters, [CHANGED, CHANGED_GROSSLY])
    return share @ odd, share @ changed


def _branched(belief: Belief, lesson: Lesson, settings: InstallationSettings) -> _Branches:
    """Return every branch of every history, before the flight is seen.

    The first flight can change nothing.
    """
    letters = BRANCHES if belief.flights else (SAME, ODD, ODD_GROSSLY)
    rates = np.array(settings.odd_rates)
    hazard = settings.hazard if belief.flights else 0.0
    usual, gross = 1.0 - settings.gross_share, settings.gross_share
    chance = {
        SAME: 1.0 - hazard - rates,
        CHANGED: np.full(len(rates), hazard * usual),
        CHANGED_GROSSLY: np.full(len(rates), hazard * gross),
        ODD: rates * usual,
        ODD_GROSSLY: rates * gross,
    }
    h, k = belief.mean.shape[:2]
    mean = np.zeros((len(letters), h, k, 4))
    covariance = np.zeros((len(letters), h, k, 4, 4))
    mean[..., :2], covariance[..., :2, :2] = belief.mean, belief.covariance
    covariance[..., ALIGNMENT, ALIGNMENT] = lesson.alignment_sigma_deg**2
    for place, letter in enumerate(letters):
        is_gross = letter in (CHANGED_GROSSLY, ODD_GROSSLY)
        fresh = lesson.mounting_deg, (GROSS_DEG if is_gross else lesson.mounting_sigma_deg) ** 2
        if letter in (ODD, ODD_GROSSLY):
            mean[place, ..., OWN], covariance[place, ..., OWN, OWN] = fresh
            continue
        if letter != SAME:
            mean[place, ..., MOUNTING] = fresh[0]
            covariance[place, ..., MOUNTING, :] = covariance[place, ..., :, MOUNTING] = 0.0
            covariance[place, ..., MOUNTING, MOUNTING] = fresh[1]
        mean[place, ..., OWN] = mean[place, ..., MOUNTING]
        covariance[place, ..., OWN, :] = covariance[place, ..., MOUNTING, :]
        covariance[place, ..., :, OWN] = covariance[place, ..., :, MOUNTING]
        covariance[place, ..., OWN, OWN] = covariance[place, ..., MOUNTING, MOUNTING]
    weight = np.stack([belief.weight * chance[letter][None, :, None] for letter in letters])
    return _Branches(letters, weight, mean, covariance)


def _taxi_variance(lesson: Lesson, factor: FloatArray) -> FloatArray:
    """Return the variance of the taxi's number, shape (k,).

    It is by the taxi itself and by what is not known of its wind.
    """
    return np.asarray(lesson.taxi_sigma_deg**2 + (factor * lesson.crosswind_sigma_mps) ** 2)


def _seen(lesson: Lesson, factor: FloatArray) -> list[tuple[FloatArray, FloatArray, FloatArray]]:
    """Return the observations of a flight: row of the state, value and variance.

    Shapes (4,), (k,), (k,).
    """
    k = len(factor)
    found = []
    for row, value, sigma in (
        (AZIMUTH, lesson.azimuth_deg, lesson.azimuth_sigma_deg),
        (REFERENCE, lesson.reference_deg, lesson.reference_sigma_deg),
    ):
        if value is not None and sigma is not None:
            found.append((row, np.full(k, value), np.full(k, sigma**2)))
    if lesson.number_deg is not None:
        found.append((TAXI, lesson.number_deg - factor * lesson.crosswind_mps, _taxi_variance(lesson, factor)))
    return found


def _update(
    mean: FloatArray, covariance: FloatArray, row: FloatArray, value: FloatArray, variance: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Kalman update by a scalar, angles wrapped; also the log likelihood but for a constant."""
    gain = covariance @ row
    scale = gain @ row + variance
    residual = wrap_180(value - mean @ row)
    after = mean + gain * (residual / scale)[..., None]
    narrowed = covariance - gain[..., :, None] * gain[..., None, :] / scale[..., None, None]
    return after, narrowed, -0.5 * (residual**2 / scale + np.log(scale))
