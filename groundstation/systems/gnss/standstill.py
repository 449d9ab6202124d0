"""Scatter of a receiver at standstill against the claimed sigmas, duration of errors."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from groundstation.base.angles import FloatArray
from groundstation.base.records import BoolArray
from groundstation.systems.gnss.answer import COARSE, STATE_NAMES, StandstillScatter
from groundstation.systems.gnss.series import ReceiverRows
from groundstation.systems.gnss.settings import GnssSettings
from groundstation.systems.gnss.spells import known
from groundstation.tables.motion import runs
from groundstation.tables.phases import Phases

IN_MOTION = ("take-off run", "airborne", "landing roll")
CREEP = 0.2  # of the speed that stands: the mean over the whole of it may be no more
MOVED_SIGMAS, LEAST_MOVED_M = 4.0, 0.02  # a place that moves by more than its claimed sigma allows does not stand
LEAST_AVERAGES = 4  # means of one length that make a scatter
BELIEVED = 10  # a longer correlation than this part of the standstill is not known
FINE_M = 0.005  # a finer step of logged places would show errors: repeated places are held
HELD_SHARE = 0.9  # share of rows at the place of the row before: the receiver repeats it


class Stood(NamedTuple):
    """Standstill with its rows, their places about the mean, and the scatter of means."""

    answer: StandstillScatter
    rows: NDArray[np.intp]
    offset_m: FloatArray
    averaged_s: FloatArray
    scatter_m: FloatArray


def standstills_of(one: ReceiverRows, phases: Phases, settings: GnssSettings) -> tuple[Stood, ...]:
    """Return the longest standstill of each kind of fix, the best kind first."""
    if len(one.time_s) < settings.standstill_samples_min:
        return ()
    still = _is_still(one, settings) & ~np.isin(phases.at(one.time_s), IN_MOTION)
    still &= np.isfinite(one.latitude_deg) & np.isfinite(one.longitude_deg) & one.has_fix
    breaks = np.append(False, one.is_gap | (one.state[1:] != one.state[:-1]))
    best: dict[str, tuple[float, NDArray[np.intp]]] = {}
    for first, behind in runs(still):
        cuts = first + 1 + np.flatnonzero(breaks[first + 1 : behind])
        for start, end in zip([first, *cuts], [*cuts, behind], strict=True):
            rows = np.arange(start, end)
            time_s = one.time_s[rows]
            inside = (time_s >= time_s[0] + settings.standstill_guard_s) & (
                time_s <= time_s[-1] - settings.standstill_guard_s
            )
            rows = rows[inside]
            if len(rows) < settings.standstill_samples_min:
                continue
            length_s = float(one.time_s[rows[-1]] - one.time_s[rows[0]])
            state = str(one.state[rows[0]])
            is_longest = length_s >= settings.standstill_min_s and (state not in best or length_s > best[state][0])
            if is_longest and not _creeps(one, rows, settings):
                best[state] = length_s, rows
    order = (*(name for name in STATE_NAMES if name in best), *sorted(best.keys() - STATE_NAMES.keys()))
    return tuple(_judged(one, best[name][1], phases) for name in order)


def longest_of(stood: tuple[Stood, ...]) -> Stood | None:
    """Return the longest standstill, of the better kind where two are as long; else None."""
    return max(stood, key=lambda one: one.answer.end_s - one.answer.start_s, default=None)


def _phase_of(phases: Phases, start_s: float, end_s: float) -> tuple[float | None, float | None]:
    """Return the standstill of the overview that holds the middle of a stretch."""
    middle_s = 0.5 * (start_s + end_s)
    shown = phases.likely or phases.intervals
    found = [one for one in shown if one.phase == "standstill" and one.start_s <= middle_s <= one.end_s]
    return (found[0].start_s, found[0].end_s) if found else (None, None)


def _is_still(one: ReceiverRows, settings: GnssSettings) -> BoolArray:
    """Tell where the mean velocity about a row is that of something that stands.

    Without velocities, where the mean places before and behind it are the same.
    """
    half_s = 0.5 * settings.still_window_s
    has_velocity = np.isfinite(one.velocity_mps[:, 0])
    if has_velocity.mean() > 0.5:
        mean = _window_mean(one.time_s, one.velocity_mps[:, :2], -half_s, half_s)
        return np.asarray(np.hypot(mean[:, 0], mean[:, 1]) < settings.still_mps)
    if np.isfinite(one.speed_mps).mean() > 0.5:
        mean = _window_mean(one.time_s, one.speed_mps[:, None], -half_s, half_s)
        return np.asarray(mean[:, 0] < settings.still_mps)
    place = np.column_stack([one.latitude_deg, one.longitude_deg])
    before = _window_mean(one.time_s, place, -settings.still_window_s, 0.0)
    behind = _window_mean(one.time_s, place, 0.0, settings.still_window_s)
    sigma_m = one.table.values("horizontal_sigma_m")
    limit_m = np.full(len(place), settings.still_mps * settings.still_window_s)
    limit_m = np.where(
        np.isfinite(sigma_m), np.minimum(limit_m, np.maximum(MOVED_SIGMAS * sigma_m, LEAST_MOVED_M)), limit_m
    )
    moved_deg = behind - before
    moved_m = np.deg2rad(moved_deg) * 6.37e6 * np.column_stack([np.ones(len(place)), np.cos(np.deg2rad(place[:, 0]))])
    return np.asarray(np.hypot(moved_m[:, 0], moved_m[:, 1]) < limit_m)


def _window_mean(time_s: FloatArray, values: FloatArray, from_s: float, to_s: float) -> FloatArray:
    """Mean of the finite values between two moments about each row, NaN without any.

    Its shape is that of the values.
    """
    is_known = np.isfinite(values)
    first = np.searchsorted(time_s, time_s + from_s - 1e-9, side="left")
    behind = np.searchsorted(time_s, time_s + to_s + 1e-9, side="right")
    middle = np.where(is_known, values, 0.0).sum(axis=0) / np.maximum(is_known.sum(axis=0), 1)
    total = np.vstack([np.zeros(values.shape[1]), np.cumsum(np.where(is_known, values - middle, 0.0), axis=0)])
    count = np.vstack([np.zeros(values.shape[1]), np.cumsum(is_known, axis=0)])
    number = count[behind] - count[first]
    return np.where(number > 0, middle + (total[behind] - total[first]) / np.maximum(number, 1), np.nan)


def _creeps(one: ReceiverRows, rows: NDArray[np.intp], settings: GnssSettings) -> bool:
    """Tell whether the mean velocity of a whole standstill is that of a slow motion."""
    velocity = one.velocity_mps[rows, :2]
    velocity = velocity[np.isfinite(velocity).all(axis=1)]
    return bool(len(velocity)) and float(np.hypot(*velocity.mean(axis=0))) > CREEP * settings.still_mps


def _judged(one: ReceiverRows, rows: NDArray[np.intp], phases: Phases) -> Stood:
    middle = np.mean(one.latitude_deg[rows]), np.mean(one.longitude_deg[rows])
    plan = one.plan_m(rows, np.full(len(rows), middle[0]), np.full(len(rows), middle[1]))
    up = one.up_m[rows] - np.nanmean(one.up_m[rows]) if np.isfinite(one.up_m[rows]).any() else one.up_m[rows]
    offset = np.column_stack([plan - plan.mean(axis=0), up])
    step_s = float(np.median(np.diff(one.time_s[rows])))
    length_s = float(one.time_s[rows[-1]] - one.time_s[rows[0]])
    resolution_m = one.resolution_m
    repeats = bool(np.mean(np.all(np.diff(offset[:, :2], axis=0) == 0.0, axis=1)) > HELD_SHARE)
    is_held = repeats and resolution_m < FINE_M
    is_coarse = not is_held and resolution_m > COARSE * _spread(offset[:, :2])
    averaged_s, scatter = scatter_of_means(offset[:, :2], step_s)
    correlation_s = None if is_held or is_coarse else correlation_time_s(offset[:, :2], step_s)
    if correlation_s is not None:
        correlation_s = max(correlation_s, memory_of_means_s(averaged_s, scatter))
        correlation_s = correlation_s if BELIEVED * correlation_s <= length_s else None
    independent = 1.0
    if correlation_s is not None:
        independent = max(min(length_s / max(2.0 * correlation_s, step_s), float(len(rows))), 1.0)
    speed = one.speed_mps[rows]
    phase_start_s, phase_end_s = _phase_of(phases, float(one.time_s[rows[0]]), float(one.time_s[rows[-1]]))
    answer = StandstillScatter(
        start_s=float(one.time_s[rows[0]]),
        end_s=float(one.time_s[rows[-1]]),
        state=str(one.state[rows[0]]),
        samples=len(rows),
        scatter_m=_spread(offset[:, :2]),
        up_scatter_m=known(_spread(offset[:, 2:][np.isfinite(offset[:, 2])])),
        claimed_m=_median(one.table.values("horizontal_sigma_m")[rows]),
        up_claimed_m=_median(one.table.values("vertical_sigma_m")[rows]),
        correlation_s=correlation_s,
        independent=independent,
        speed_rms_mps=known(float(np.sqrt(np.nanmean(speed**2)))) if np.isfinite(speed).any() else None,
        claimed_mps=_median(one.table.values("velocity_sigma_mps")[rows]),
        resolution_m=resolution_m,
        is_held=is_held,
        phase_start_s=phase_start_s,
        phase_end_s=phase_end_s,
        averaged_s=float(averaged_s[-1]) if len(averaged_s) else None,
        averaged_scatter_m=float(scatter[-1]) if len(averaged_s) else None,
    )
    return Stood(answer, rows, offset, averaged_s, scatter)


def _median(values: FloatArray) -> float | None:
    values = values[np.isfinite(values)]
    return float(np.median(values)) if values.size else None


def _spread(offset_m: FloatArray) -> float:
    """Standard deviation about the mean, axes together; NaN of fewer than two."""
    if len(offset_m) < 2:
        return float("nan")
    return float(np.sqrt(np.var(offset_m, axis=0, ddof=1).sum()))


def correlation_time_s(offset_m: FloatArray, step_s: float) -> float | None:
    """Return the time after which errors are correlated by less than 1/e.

    None where that is longer than a tenth of the samples: a mean taken away makes errors that last look shorter.

    Examples
    --------
    >>> noise = np.random.default_rng(1).normal(size=(400, 2))
    >>> correlation_time_s(noise, 0.5)
    0.5
    >>> correlation_time_s(np.cumsum(noise, axis=0), 0.5) is None
    True
    """
    count = len(offset_m)
    size = 1 << (2 * count - 1).bit_length()
    spectrum = np.fft.rfft(offset_m - offset_m.mean(axis=0), size, axis=0)
    together = np.fft.irfft((np.abs(spectrum) ** 2).sum(axis=1), size)[: count // BELIEVED + 1]
    if len(together) < 2 or not together[0] > 0.0:
        return None
    below = np.flatnonzero(together / together[0] < np.exp(-1.0))
    return float(below[0] * step_s) if below.size else None


def memory_of_means_s(averaged_s: FloatArray, scatter_m: FloatArray) -> float:
    """Return how long errors last by the scatter of means, the longest of all.

    Values that are independent after ``2 t`` leave ``scatter * sqrt(2 t / T)`` of a mean over ``T``. Errors of several
    durations look shorter where they are first correlated by less than 1/e: their means tell the longest.

    Examples
    --------
    >>> times_s = np.array([0.5, 16.0, 256.0])
    >>> memory_of_means_s(times_s, np.array([0.94, 0.94 / np.sqrt(32.0), 0.94 / np.sqrt(512.0)]))
    0.25
    >>> round(memory_of_means_s(times_s, np.array([0.94077, 0.93177, 0.74909])))
    81
    """
    if not len(averaged_s) or not scatter_m[0] > 0.0:
        return 0.0
    return float(np.round(np.max(0.5 * averaged_s * (scatter_m / scatter_m[0]) ** 2), 9))


def scatter_of_means(offset_m: FloatArray, step_s: float) -> tuple[FloatArray, FloatArray]:
    """Return times of averaging, doubled each time, and the scatter of the means over them.

    Errors without memory fall by the root of the time; errors that last do not fall.
    """
    sizes, scatter = [], []
    size = 1
    while len(offset_m) // size >= LEAST_AVERAGES:
        count = len(offset_m) // size
        means = offset_m[: count * size].reshape(count, size, -1).mean(axis=1)
        sizes.append(size * step_s)
        scatter.append(_spread(means))
        size *= 2
    return np.array(sizes), np.array(scatter)
