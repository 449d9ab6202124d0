"""Gates that accept or reject each sample, and the straight segments."""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from groundstation.base.angles import wrap_180
from groundstation.base.records import BoolArray
from groundstation.methods.taxi.samples import GATE_TEXT, USED, TaxiSamples
from groundstation.methods.taxi.settings import TaxiLimits
from groundstation.results.chosen import Interval
from groundstation.tables.phases import Phases

NOT_TAXI = ("take-off run", "landing roll")  # phases, and reasons: power and wind crab the aircraft
NOT_PROVEN = "not proven ground"  # reason of an epoch at taxi speed
SINGLE = "single epoch"  # between epochs left out, or between two gaps: no straight segment has one
CHANGING_MPS2 = 0.5  # a change of speed that is a run's, and not taxi's


def gate_samples(
    samples: TaxiSamples, settings: TaxiLimits, intervals: Sequence[Interval] = (), phases: Phases | None = None
) -> TaxiSamples:
    """Tell for every epoch why it is used or not, and number the straight segments.

    Later reasons give way to earlier ones: excluded, no heading, ground, geometry, integrity, too fast, too slow,
    turning, take-off run, landing roll, outlier, single epoch. A forced interval overrides those from ``too fast`` on.
    """
    speed = samples.speed_mps
    gate = np.full(len(samples), USED, dtype=GATE_TEXT)
    gate[_outliers(samples, settings)] = "outlier"
    if phases is not None:
        for name, mask in _not_taxi(samples, phases):
            gate[mask] = name
    with np.errstate(invalid="ignore"):
        gate[~(np.abs(samples.rate_dps) <= settings.turn_rate_max_dps)] = "turning"
    gate[~(speed > settings.taxi_speed_min_mps)] = "too slow"
    gate[speed > settings.taxi_speed_max_mps] = "too fast"
    for interval in intervals:
        inside = (samples.time_s >= interval.start_s) & (samples.time_s <= interval.end_s)
        if interval.use == "force":
            gate[inside] = USED
    gate[samples.integrity == 0.0] = "integrity"
    gate[samples.geometry > settings.geometry_max] = "geometry"
    if samples.ground_method:
        gate[~samples.on_ground] = NOT_PROVEN
        gate[~samples.on_ground & (speed > settings.taxi_speed_max_mps)] = "airborne"
    gate[~np.isfinite(samples.heading_deg)] = "no heading"
    for interval in intervals:
        inside = (samples.time_s >= interval.start_s) & (samples.time_s <= interval.end_s)
        if interval.use == "exclude":
            gate[inside] = "excluded"
    segment = _segments(samples, gate == USED, settings)
    gate[(gate == USED) & (segment == 0)] = SINGLE
    return replace(samples, gate=gate, segment=segment)


def _not_taxi(samples: TaxiSamples, phases: Phases) -> Iterator[tuple[str, BoolArray]]:
    """Yield the epochs of take-off runs and landing rolls.

    The slow epochs beside them in which the speed still changes belong to them.
    """
    phase, speed = phases.at(samples.time_s), samples.speed_mps
    earlier_mps = np.interp(samples.time_s - 0.5, samples.time_s, speed)
    later_mps = np.interp(samples.time_s + 0.5, samples.time_s, speed)
    for name, sense in zip(NOT_TAXI, (1.0, -1.0), strict=True):
        mask = phase == name
        changing = sense * (later_mps - earlier_mps) > CHANGING_MPS2
        order = range(len(samples) - 2, -1, -1) if sense > 0.0 else range(1, len(samples))
        for i in order:
            mask[i] |= changing[i] and mask[i + int(sense)]
        yield name, mask


def intervals_without_epoch(time_s: NDArray[np.float64], intervals: Sequence[Interval]) -> tuple[Interval, ...]:
    """Return the intervals, both ends included, that hold none of the times.

    They lie outside the flight, or in a gap.

    Parameters
    ----------
    time_s : ndarray, shape (n,)
        Flight seconds of the GNSS epochs.

    Examples
    --------
    >>> intervals_without_epoch(np.arange(5.0), [Interval(3.0, 9.0), Interval(7.0, 9.0), Interval(1.2, 1.8, "force")])
    (Interval(start_s=7.0, end_s=9.0, use='exclude'), Interval(start_s=1.2, end_s=1.8, use='force'))
    """
    return tuple(part for part in intervals if not ((time_s >= part.start_s) & (time_s <= part.end_s)).any())


def is_straight_and_fast(samples: TaxiSamples, settings: TaxiLimits) -> BoolArray:
    """Tell which epochs are straight taxi by speed and rate of heading alone, shape (n,)."""
    speed = samples.speed_mps
    is_straight = np.abs(np.nan_to_num(samples.rate_dps, nan=np.inf)) <= settings.turn_rate_max_dps
    return is_straight & (speed > settings.taxi_speed_min_mps) & (speed <= settings.taxi_speed_max_mps)


def _outliers(samples: TaxiSamples, settings: TaxiLimits) -> BoolArray:
    """Find differences far from the running median of 5 s.

    The distance is counted in robust sigmas of the straight and fast samples. Six robust sigmas and at least a floor:
    no sample of a normal process is ever touched, so coverage is not.
    """
    candidate = is_straight_and_fast(samples, settings) & np.isfinite(samples.heading_deg)
    out = np.zeros(len(samples), dtype=bool)
    index = np.flatnonzero(candidate)
    if len(index) < 5:
        return out
    difference = samples.difference_deg[index]
    centred = wrap_180(difference - np.median(difference))
    half = max(round(2.5 / max(samples.interval_s, 0.01)), 2)
    padded = np.pad(centred, half, mode="reflect" if len(centred) > half else "edge")
    median = np.median(np.lib.stride_tricks.sliding_window_view(padded, 2 * half + 1), axis=1)
    residual = wrap_180(centred - median)
    scale = 1.4826 * float(np.median(np.abs(residual)))
    out[index] = np.abs(residual) > max(settings.outlier_sigmas * scale, settings.outlier_floor_deg)
    return out


def _segments(samples: TaxiSamples, used: BoolArray, settings: TaxiLimits) -> NDArray[np.int64]:
    """Number the straight segments: a GNSS gap, a turn or a long unused stretch ends one."""
    segment = np.zeros(len(samples), dtype=np.int64)
    index = np.flatnonzero(used)
    if not len(index):
        return segment
    epoch_gap = np.diff(samples.time_s) > max(settings.gnss_gap_max_s, 2.5 * samples.interval_s)
    gaps_before = np.concatenate([[0], np.cumsum(epoch_gap)])
    heading = samples.heading_deg[index]
    breaks = (
        (np.diff(gaps_before[index]) > 0)
        | (np.diff(samples.time_s[index]) > max(settings.segment_break_s, 2.5 * samples.interval_s))
        | ((np.diff(index) > 1) & (np.abs(wrap_180(np.diff(heading))) > settings.segment_turn_deg))
    )
    number = np.concatenate([[1], 1 + np.cumsum(breaks)])
    sizes = np.bincount(number)
    kept = sizes[number] > 1
    _unused, renumbered = np.unique(number[kept], return_inverse=True)
    segment[index[kept]] = renumbered + 1
    return segment
