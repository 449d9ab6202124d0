"""Changes of level in a series of flights, and the control chart between them."""

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from groundstation.base.dataclasses import dataclass
from groundstation.methods.fleet.robust import (
    VALUES_PER_FREEDOM_STEP,
    limit_in_sigmas,
    sigma_of_steps,
)

FloatArray = NDArray[np.float64]
VALUES_AT_ONCE = 1_000_000  # of simulated series


@dataclass(frozen=True)
class ChangeSettings:
    """Limits of the search for changes and of the control chart.

    Parameters
    ----------
    fewest : int
        Flights a series needs; with fewer nothing is said.
    fewest_in_level : int
        Flights that make a level.
    false_change : float
        Chance of a change being found in a series that has none.
    false_alarm : float
        Chance of a flight of a steady series being outside the control limits: that of 3 sigma.
    draws, seed : int
        Orders drawn to learn what chance does.
    """

    fewest: int = 8
    fewest_in_level: int = 3
    false_change: float = 0.01
    false_alarm: float = 0.0027
    draws: int = 9999
    seed: int = 2015


@dataclass(frozen=True)
class Change:
    """Change of level of a series from ``index`` on.

    ``p_value`` is the chance of such a step in a steady series.
    """

    index: int
    p_value: float


@dataclass(frozen=True)
class ControlChart:
    """Control chart of a series, shapes (n,).

    Level (median between changes) and limits, NaN where there are none.
    """

    changes: tuple[Change, ...]
    level: FloatArray
    low: FloatArray
    high: FloatArray

    def is_outside(self, value: FloatArray) -> NDArray[np.bool_]:
        """Tell whether values are outside the limits."""
        return np.asarray((value < self.low) | (value > self.high))


def find_changes(value: FloatArray, *, settings: ChangeSettings | None = None) -> tuple[Change, ...]:
    """Find where the level of a series changes, by binary segmentation of its ranks.

    Parameters
    ----------
    value : ndarray, shape (n,)
        In order of time, finite.
    settings : ChangeSettings, optional

    Returns
    -------
    tuple of Change
        In order of index.

    Notes
    -----
    Statistic of a stretch: the largest over k of |S_k| / sigma(S_k), S_k the sum of the ranks of its first k values
    about their expectation, sigma(S_k)^2 = k (n - k) (n + 1) / 12 for a random order. Its distribution when all orders
    are equally likely is drawn, so the chance of finding anything in a series without a change is ``false_change``
    whatever the distribution of its values. Where the largest is beyond that, the stretch is cut there and both parts
    are looked at in the same way. Ranks: one wild flight is no change of level. A slow drift is shown as steps.

    Source: Pettitt, Applied Statistics 28 (1979), 126-135 (ranks); Scott, Knott, Biometrics 30 (1974), 507-512
    (binary segmentation).

    Examples
    --------
    >>> steady = np.array([1.0, 3.0, 2.0, 5.0, 4.0, 1.5, 3.5, 2.5])
    >>> find_changes(steady), [change.index for change in find_changes(np.concatenate([steady, steady + 10.0]))]
    ((), [8])
    """
    settings = settings or ChangeSettings()
    found: list[Change] = []
    waiting = [(0, len(value))]
    while waiting:
        begin, end = waiting.pop()
        if end - begin < settings.fewest:
            continue
        index, statistic = _largest_step(value[begin:end], settings.fewest_in_level)
        chance = _null_statistics(end - begin, settings.fewest_in_level, settings.draws, settings.seed)
        p_value = (1 + int(np.sum(chance >= statistic - 1e-9))) / (1 + len(chance))
        if p_value <= settings.false_change:
            found.append(Change(begin + index, p_value))
            waiting += [(begin, begin + index), (begin + index, end)]
    return tuple(sorted(found, key=lambda change: change.index))


def control_chart(
    value: FloatArray, *, settings: ChangeSettings | None = None, changes: tuple[Change, ...] | None = None
) -> ControlChart | None:
    """Draw the control chart of individual flights, with a level of its own between changes.

    limits = level +- L sigma; sigma from the median of successive differences within levels, L such that a flight of a
    steady series is outside with the chance ``false_alarm`` (3 for a long series, more for a short one).

    Parameters
    ----------
    value : ndarray, shape (n,)
        In order of time, finite.
    settings : ChangeSettings, optional
    changes : tuple of Change, optional
        Where they are known already.

    Returns
    -------
    ControlChart or None
        None for a series that is too short.
    """
    settings = settings or ChangeSettings()
    if len(value) < settings.fewest:
        return None
    changes = find_changes(value, settings=settings) if changes is None else changes
    starts = [change.index for change in changes]
    level = np.concatenate([np.full(len(part), np.median(part)) for part in np.split(value, starts)])
    within = np.delete(np.diff(value), [start - 1 for start in starts])
    sigma = sigma_of_steps(within) or np.nan  # most flights agree to the last digit: no limits
    reach = limit_in_sigmas(len(value), settings.false_alarm, VALUES_PER_FREEDOM_STEP) * sigma
    return ControlChart(changes, level, level - reach, level + reach)


def _ranks(value: FloatArray) -> FloatArray:
    """Ranks from 1 on, equal values sharing theirs."""
    _, place, count = np.unique(value, return_inverse=True, return_counts=True)
    last = np.cumsum(count)
    return np.asarray((last - 0.5 * (count - 1))[place])


def _largest_step(value: FloatArray, fewest_in_level: int) -> tuple[int, float]:
    steps = _step_statistics(_ranks(value)[None, :], fewest_in_level)[0]
    index = int(np.argmax(steps))
    return index + fewest_in_level, float(steps[index])


def _step_statistics(rank: FloatArray, fewest_in_level: int) -> FloatArray:
    """|S_k| / sigma(S_k) of series in rows, for every k that leaves a level on both sides."""
    n = rank.shape[1]
    before = np.arange(fewest_in_level, n - fewest_in_level + 1)
    sums = np.cumsum(rank - 0.5 * (n + 1), axis=1)[:, before - 1]
    return np.asarray(np.abs(sums) / np.sqrt(before * (n - before) * (n + 1) / 12.0))


@lru_cache(maxsize=128)
def _null_statistics(n: int, fewest_in_level: int, draws: int, seed: int) -> FloatArray:
    """Largest step of random orders of n ranks; depends on nothing but its arguments."""
    rng = np.random.default_rng([seed, n])
    rank = np.arange(1.0, n + 1.0)
    out: list[FloatArray] = []
    rows = max(1, min(draws, VALUES_AT_ONCE // n))
    for first in range(0, draws, rows):
        orders = rng.permuted(np.tile(rank, (min(rows, draws - first), 1)), axis=1)
        out.append(_step_statistics(orders, fewest_in_level).max(axis=1))
    return np.concatenate(out)
