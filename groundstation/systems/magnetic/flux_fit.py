"""A to E of a flux valve from its legs, weighed over the lags that the turns leave open."""

import numpy as np
from numpy.typing import NDArray

from groundstation.base.angles import FloatArray, mean_heading, wrap_180
from groundstation.base.dataclasses import dataclass
from groundstation.base.units import DEG_PER_RAD
from groundstation.methods import harmonics
from groundstation.systems.magnetic.answer import Residual
from groundstation.systems.magnetic.flux_bank import LagCell
from groundstation.systems.magnetic.flux_epochs import GRAVITY_MPS2, FluxEpochs
from groundstation.systems.magnetic.flux_reference import Rows, TrueHeadings
from groundstation.systems.magnetic.flux_settings import MagneticFluxSettings
from groundstation.systems.magnetic.ground_fit import CurveFit, directions_of, fit_curve

BLOCK_S = 10.0  # over which the noise of a heading is one
MOST_CELLS = 25
LEAST_JUDGED = 2  # legs that judge opposite turns
LEAST_DIRECTIONS = 6  # for legs to be predicted by others


@dataclass(frozen=True)
class LegValues:
    """Legs with a true heading; arrays of shape (m,), ``common`` (m, m).

    Legs of one ``group`` follow each other on one heading: what is their own they have together.
    """

    rows: list[Rows]
    heading_deg: FloatArray
    true_deg: FloatArray
    error_deg: FloatArray
    noise_deg: FloatArray
    own_deg: FloatArray
    common: FloatArray
    group: NDArray[np.intp]


def leg_values(
    epochs: FluxEpochs,
    legs: list[Rows],
    known: TrueHeadings,
    error_deg: FloatArray,
    step_deg: float | None,
    settings: MagneticFluxSettings,
) -> LegValues:
    """Return heading, error and noise of the legs that have a true heading."""
    chosen = [
        place
        for place, one in enumerate(legs)
        if np.isfinite(known.leg_true_deg[place]) and _is_straight(epochs, one, settings)
    ]
    rows = [legs[place] for place in chosen]
    heading = np.array([mean_heading(epochs.heading_deg[first:last]) for first, last in rows])
    declination = np.array([np.mean(epochs.declination_deg[first:last]) for first, last in rows])
    true = known.leg_true_deg[chosen]
    rounding = (step_deg or 0.0) / np.sqrt(12.0)
    noise = np.array(
        [np.hypot(_noise_deg(epochs.time_s[one:other], error_deg[one:other]), rounding) for one, other in rows]
    )
    leaning = np.array([_by_acceleration(epochs, first, last) for first, last in rows])
    own = np.sqrt(noise**2 + leaning**2) if rows else noise
    group = _groups(heading, settings)
    together = known.own_sigma_deg**2 * (group[:, None] == group)
    common = known.leg_covariance[np.ix_(chosen, chosen)] + together
    return LegValues(rows, heading, true, wrap_180(heading + declination - true), noise, own, common, group)


def fit_legs(values: LegValues, cells: tuple[LagCell, ...], settings: MagneticFluxSettings) -> CurveFit:
    """Return A to E of the legs: those by each lean and lag, weighed."""
    chosen = sorted(cells, key=lambda one: -one.weight)[:MOST_CELLS]
    weights = np.array([one.weight for one in chosen]) / sum(one.weight for one in chosen)
    fits = [_fit(values, one, settings) for one in chosen]
    middle = fits[0].values_deg[0]
    each = np.array([one.values_deg for one in fits])
    each[:, 0] = middle + wrap_180(each[:, 0] - middle)
    mean = weights @ each
    away = each - mean
    covariance = np.tensordot(weights, np.array([one.covariance for one in fits]), axes=1)
    covariance = covariance + (away * weights[:, None]).T @ away
    mean[0] = wrap_180(mean[0])
    return CurveFit(mean, covariance, float(weights @ np.array([one.place_sigma_deg for one in fits])))


def left_over(values: LegValues, cells: tuple[LagCell, ...], settings: MagneticFluxSettings) -> Residual | None:
    """Return the RMS error of legs before and after correction by other directions.

    None with fewer than six directions: five coefficients are fitted.
    """
    groups = directions_of(values.heading_deg, settings.repeat_within_deg)
    if len(groups) < LEAST_DIRECTIONS:
        return None
    best = max(cells, key=lambda one: one.weight)
    after = np.empty(len(values.rows))
    for group in groups:
        kept = np.setdiff1d(np.arange(len(values.rows)), group)
        fit = _fit(_some(values, kept), best, settings)
        columns, by_bank = _of_legs(values, best)
        after[group] = wrap_180(values.error_deg[group] - by_bank[group] - columns[group] @ fit.values_deg)
    before, left = (float(np.sqrt(np.mean(part**2))) for part in (values.error_deg, after))
    return Residual(before, left)


def left_by_turns(values: LegValues, coefficients_deg: FloatArray) -> Residual | None:
    """Return the RMS error of legs, before and after correction by opposite turns."""
    if len(values.rows) < LEAST_JUDGED:
        return None
    after = wrap_180(values.error_deg - harmonics.design(values.heading_deg) @ coefficients_deg)
    before, left = (float(np.sqrt(np.mean(part**2))) for part in (values.error_deg, after))
    return Residual(before, left)


def _of_legs(values: LegValues, cell: LagCell) -> tuple[FloatArray, FloatArray]:
    """Return the columns of every leg, (m, 5), and its error by bank, (m,)."""
    columns = np.array([cell.columns[first:last].mean(axis=0) for first, last in values.rows])
    return columns, np.array([cell.bank_deg[first:last].mean() for first, last in values.rows])


def _fit(values: LegValues, cell: LagCell, settings: MagneticFluxSettings) -> CurveFit:
    columns, by_bank = _of_legs(values, cell)
    return fit_curve(
        values.heading_deg,
        wrap_180(values.error_deg - by_bank),
        values.own_deg,
        settings,
        columns=columns,
        common=values.common,
        group=values.group,
    )


def _some(values: LegValues, kept: np.ndarray) -> LegValues:
    return LegValues(
        [values.rows[place] for place in kept],
        values.heading_deg[kept],
        values.true_deg[kept],
        values.error_deg[kept],
        values.noise_deg[kept],
        values.own_deg[kept],
        values.common[np.ix_(kept, kept)],
        values.group[kept],
    )


def _groups(heading_deg: FloatArray, settings: MagneticFluxSettings) -> NDArray[np.intp]:
    """Return the number of the group of every leg: a new one where the direction is another."""
    if not len(heading_deg):
        return np.zeros(0, dtype=np.intp)
    turned = np.abs(wrap_180(np.diff(heading_deg))) > settings.repeat_within_deg
    return np.concatenate([[0], np.cumsum(turned)]).astype(np.intp)


def _is_straight(epochs: FluxEpochs, leg: Rows, settings: MagneticFluxSettings) -> bool:
    mine = epochs.heading_deg[leg[0] : leg[1]]
    return bool(np.ptp(wrap_180(mine - mean_heading(mine))) <= settings.leg_change_max_deg)


def _noise_deg(time_s: FloatArray, error_deg: FloatArray) -> float:
    """Standard deviation of the mean, from means over blocks about a line."""
    known = np.isfinite(error_deg)
    time, values = time_s[known], error_deg[known]
    block = ((time - time[0]) / BLOCK_S).astype(int) if len(time) else np.zeros(0, dtype=int)
    count = int(block[-1]) + 1 if len(block) else 0
    about = wrap_180(values - mean_heading(values)) if len(values) else values
    if count < 3:
        return float(np.std(about)) if len(about) else 0.0
    sizes = np.bincount(block, minlength=count)
    means = np.bincount(block, weights=about, minlength=count) / np.maximum(sizes, 1)
    return float(np.std(means[sizes > 0], ddof=1) / np.sqrt(np.count_nonzero(sizes)))


def _by_acceleration(epochs: FluxEpochs, first: int, last: int) -> float:
    """Error by a mean acceleration on a leg, of a valve that hangs, as a standard deviation."""
    gained = epochs.speed_mps[last - 1] - epochs.speed_mps[first]
    seconds = epochs.time_s[last - 1] - epochs.time_s[first]
    tilt = float(epochs.per_tilt[first]) if np.isfinite(epochs.per_tilt[first]) else 0.0
    return float(abs(np.nan_to_num(gained) / max(seconds, 1.0) / GRAVITY_MPS2 * DEG_PER_RAD * tilt))
