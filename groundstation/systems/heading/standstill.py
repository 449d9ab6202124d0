"""Stage A: the GNSS velocity assessed while the aircraft stands."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from groundstation.base.angles import unwrap
from groundstation.base.dataclasses import dataclass
from groundstation.base.quantiles import length_quantile
from groundstation.base.records import BoolArray
from groundstation.methods.intervals import effective_samples
from groundstation.methods.moving_lines import window_bounds
from groundstation.methods.taxi.samples import TaxiSamples
from groundstation.systems.heading.answer import Standstill
from groundstation.systems.heading.settings import HeadingSettings

FloatArray = NDArray[np.float64]
PROBABILITY = 0.97  # of the bound of the mean speed (paper)


@dataclass(frozen=True)
class StandstillData:
    """Epochs at standstill before take-off.

    Parameters
    ----------
    answer : Standstill or None
        The interval assessed; None where there is none of ``standstill_min_s``.
    in_interval : ndarray of bool, shape (n,)
        Epochs of that interval.
    is_still : ndarray of bool, shape (n,)
        All epochs at standstill, guards cut off.
    stretches : tuple of (first, last + 1)
        Index ranges of the stretches at standstill.
    is_informative : bool
        False where the receiver holds its velocity (mostly exact zeros or repetitions): nothing to learn from.
    """

    answer: Standstill | None
    in_interval: BoolArray
    is_still: BoolArray
    stretches: tuple[tuple[int, int], ...]
    is_informative: bool

    def start_s(self, samples: TaxiSamples) -> float:
        """Start of the interval assessed; without one, of the used samples."""
        return float(samples.time_s[self.in_interval if self.in_interval.any() else samples.is_used][0])


def _moving_mean(time_s: FloatArray, values: FloatArray, window_s: float) -> FloatArray:
    low, high = window_bounds(time_s, time_s, window_s)
    total = np.concatenate([[0.0], np.cumsum(values)])
    return np.asarray((total[high] - total[low]) / (high - low))


def find_standstill(samples: TaxiSamples, settings: HeadingSettings) -> StandstillData:
    """Find the standstill before the first straight taxi, and assess its last 10 to 30 s.

    At standstill: ground contact proven where anything proves it, length of the 1-s mean velocity within the limit, INS
    heading steady (or not known), geometry and integrity good; no GNSS gap inside; ``standstill_guard_s`` cut from both
    ends. The interval assessed is the last ``standstill_max_s`` of the last stretch of at least
    ``standstill_min_s`` that ends before the first used taxi sample: a rule that does not look at the answer.

    Where there is none, but the aircraft is on its wheels and its heading quite still while GNSS shows up to
    ``standstill_doubt_mps``, it stands and GNSS errs: that stretch is assessed, and fails the gate.
    """
    mean_speed = np.hypot(
        _moving_mean(samples.time_s, samples.north_mps, settings.standstill_mean_s),
        _moving_mean(samples.time_s, samples.east_mps, settings.standstill_mean_s),
    )
    steady = ~(np.abs(samples.rate_dps) > settings.standstill_rate_max_dps)
    steady &= ~(samples.geometry > settings.geometry_max) & ~(samples.integrity == 0.0)
    if samples.ground_method:
        steady &= samples.on_ground
    used = np.flatnonzero(samples.is_used)
    before = int(used[0]) if len(used) else len(samples)
    stretches = _stretches(samples, steady & (mean_speed <= settings.standstill_speed_max_mps), settings)
    part = _last_long(samples, stretches, before, settings)
    if part is None and samples.ground_method:
        doubted = _stretches(samples, steady & (mean_speed <= settings.standstill_doubt_mps), settings)
        found = _last_long(samples, doubted, before, settings)
        shown_mps = 0.0 if found is None else float(np.median(mean_speed[found]))
        is_moving = shown_mps > settings.standstill_speed_max_mps  # else it is a standstill too short, rolling added
        if found is not None and is_moving and _is_heading_still(samples.heading_deg[found], settings):
            stretches, part = (*stretches, (found.start, found.stop)), found
    is_still, in_interval = np.zeros(len(samples), dtype=bool), np.zeros(len(samples), dtype=bool)
    for first, end in stretches:
        is_still[first:end] = True
    answer = None
    if part is not None:
        in_interval[part] = True
        answer = assess_standstill(samples, part, settings)
    is_informative = _is_informative(samples, is_still)
    if answer is not None:
        answer = replace(answer, velocity_is_held=not is_informative)
    return StandstillData(answer, in_interval, is_still, stretches, is_informative)


def _last_long(
    samples: TaxiSamples, stretches: tuple[tuple[int, int], ...], before: int, settings: HeadingSettings
) -> slice | None:
    """The last ``standstill_max_s`` of the last stretch long enough that ends before an epoch."""
    for first, end in reversed(stretches):
        last_s = float(samples.time_s[end - 1])
        if end <= before and last_s - samples.time_s[first] >= settings.standstill_min_s - 1e-6:
            start_s = max(float(samples.time_s[first]), last_s - settings.standstill_max_s)
            return slice(int(np.searchsorted(samples.time_s, start_s - 1e-6)), end)
    return None


def _is_heading_still(heading_deg: FloatArray, settings: HeadingSettings) -> bool:
    """Tell whether a heading is known and as steady as that of an aircraft that stands."""
    known = heading_deg[np.isfinite(heading_deg)]
    return bool(len(known)) and float(np.ptp(unwrap(known))) <= settings.standstill_still_deg


def _stretches(samples: TaxiSamples, still: BoolArray, settings: HeadingSettings) -> tuple[tuple[int, int], ...]:
    gap = np.concatenate([[False], np.diff(samples.time_s) > max(settings.gnss_gap_max_s, 2.5 * samples.interval_s)])
    found = []
    start = None
    for i in range(len(samples) + 1):
        is_end = i == len(samples) or not still[i] or gap[i]
        if start is not None and is_end:
            low = np.searchsorted(
                samples.time_s, samples.time_s[start] + (settings.standstill_guard_s if start else 0.0)
            )
            high = np.searchsorted(samples.time_s, samples.time_s[i - 1] - settings.standstill_guard_s, side="right")
            if high - low > 2:
                found.append((int(low), int(high)))
            start = None
        if i < len(samples) and still[i] and start is None:
            start = i
    return tuple(found)


def _is_informative(samples: TaxiSamples, still: BoolArray) -> bool:
    """Tell whether the velocity says anything at standstill.

    A receiver that holds its velocity repeats itself; one with coarse steps has few distinct values.
    """
    if still.sum() < 5:
        return False
    north, east = samples.north_mps[still], samples.east_mps[still]
    changed = (np.diff(north) != 0.0) | (np.diff(east) != 0.0)
    return bool(np.mean(changed) > 0.5 and len(np.unique(north)) + len(np.unique(east)) > 6)


def speed_bound_mps(length_mps: float, sigma_mps: float) -> float:
    """Return the 0.97 bound of the length of the true mean velocity.

    A Rice distribution about the measured length is taken. Both components of the mean have the standard error
    ``sigma_mps``.
    """
    if sigma_mps <= 0.0:
        return length_mps
    return length_quantile(PROBABILITY, length_mps, sigma_mps)


def assess_standstill(samples: TaxiSamples, part: slice, settings: HeadingSettings) -> Standstill:
    """Return mean and spread of the velocity over one interval.

    Both readings of the paper's mean speed are given.
    """
    north, east = samples.north_mps[part], samples.east_mps[part]
    time_s, speed = samples.time_s[part], np.hypot(samples.north_mps[part], samples.east_mps[part])
    length = float(np.hypot(np.mean(north), np.mean(east)))
    errors = [float(np.std(values)) / np.sqrt(effective_samples(values)) for values in (north, east)]
    return Standstill(
        start_s=float(time_s[0]),
        end_s=float(time_s[-1]),
        samples=len(north),
        mean_north_mps=float(np.mean(north)),
        mean_east_mps=float(np.mean(east)),
        sigma_north_mps=float(np.std(north)),
        sigma_east_mps=float(np.std(east)),
        mean_of_speed_mps=float(np.mean(speed)),
        speed_of_mean_mps=length,
        speed_bound97_mps=speed_bound_mps(length, float(np.sqrt(np.mean(np.square(errors))))),
        share_above_limit=float(np.mean(speed > settings.standstill_speed_max_mps)),
        ground_proof=samples.ground_method or "not proven",
    )
