"""Samples of an inertial unit on lines of time, and as increments that touch."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from groundstation.base.dataclasses import dataclass
from groundstation.base.records import BoolArray
from groundstation.base.words import counted
from groundstation.systems.trajectory.gathered import InputNote
from groundstation.systems.trajectory.imu_samples import UnitSamples
from groundstation.systems.trajectory.input_settings import InputSettings
from groundstation.systems.trajectory.inputs import ImuIncrements
from groundstation.systems.trajectory.retime import blocks_of, on_a_line

FloatArray = NDArray[np.float64]

MISSING = 0.25  # of an interval: a step that is longer by more has lost samples in it


@dataclass(frozen=True)
class TimedSamples:
    """Samples with times on a line, in blocks: ``starts`` are the first samples of each."""

    samples: UnitSamples
    starts: tuple[int, ...]
    jitter_s: float
    jitter_max_s: float
    notes: tuple[InputNote, ...]


def timed_on_lines(samples: UnitSamples, settings: InputSettings) -> TimedSamples:
    """Put the stamps of the samples on lines, block by block.

    Samples that would go back in time are left out.
    """
    pieces: list[UnitSamples] = []
    starts: list[int] = []
    residuals: list[FloatArray] = []
    notes: list[InputNote] = []
    back = int(np.count_nonzero(np.diff(samples.time_s) < 0.0))
    repeated = int(np.count_nonzero(np.diff(samples.time_s) == 0.0))
    moved = wandering = dropped = 0
    parts = sorted(
        (samples.take(one) for one in blocks_of(samples.time_s, settings.segment_s)),
        key=lambda part: float(part.time_s[0]),
    )
    end_s = -np.inf
    for part in parts:
        line = on_a_line(part.time_s, part.interval_s)
        keep = _increasing(line.time_s, end_s)
        dropped += int(len(part) - np.count_nonzero(keep))
        if not keep.any():
            continue
        moved += len(part) if line.is_moved else 0
        wandering += len(part) if line.wanders else 0
        residuals.append(line.residual_s if line.is_moved else np.zeros(len(part)))
        starts.append(sum(map(len, pieces)))
        timed = replace(part, time_s=line.time_s)
        pieces.append(timed if keep.all() else timed.take(keep))
        end_s = float(pieces[-1].time_s[-1])
    residual_s = np.abs(np.concatenate(residuals)) if residuals else np.zeros(1)
    jitter_s = float(np.sqrt(np.mean(residual_s**2)))
    if moved:
        text = f"stamps of {counted(moved, 'sample')} put on a line: they scatter by {1e3 * jitter_s:.2g} ms"
        detail = [f"at most {1e3 * float(residual_s.max()):.3g} ms"]
        detail += [f"{back} go back"] if back else []
        detail += [f"{repeated} repeat"] if repeated else []
        notes.append(InputNote("retimed", f"{text} ({', '.join(detail)})", moved))
    if wandering:
        text = f"{counted(wandering, 'sample')} are not evenly spaced: their stamps are taken as they are"
        notes.append(InputNote("uneven", text, wandering))
    if dropped:
        text = f"{counted(dropped, 'sample')} whose time goes back or repeats: left out"
        notes.append(InputNote("backward", text, dropped))
    joined = pieces[0] if len(pieces) == 1 else _joined(pieces)
    return TimedSamples(joined, tuple(starts), jitter_s, float(residual_s.max()), tuple(notes))


def _joined(pieces: list[UnitSamples]) -> UnitSamples:
    return UnitSamples(
        np.concatenate([one.time_s for one in pieces]),
        np.concatenate([one.rates for one in pieces]),
        None if pieces[0].interval_s is None else np.concatenate([_of(one) for one in pieces]),
        np.concatenate([one.clipped for one in pieces]),
        None if pieces[0].repeats_after is None else np.concatenate([_repeats(one) for one in pieces]),
    )


def _of(samples: UnitSamples) -> FloatArray:
    assert samples.interval_s is not None
    return samples.interval_s


def _repeats(samples: UnitSamples) -> NDArray[np.int64]:
    assert samples.repeats_after is not None
    return samples.repeats_after


def _increasing(time_s: FloatArray, end_s: float) -> BoolArray:
    """Tell which times are later than all before."""
    before = np.maximum.accumulate(np.concatenate(([end_s], time_s[:-1])))
    return np.asarray(time_s > before)


@dataclass(frozen=True)
class Bridged:
    """Seconds bridged for missing samples, and for those left out as repeats."""

    missing_s: float
    repeats_s: float


def touching_increments(timed: TimedSamples, settings: InputSettings) -> tuple[ImuIncrements, Bridged, FloatArray]:
    """Return increments over intervals that touch, what is bridged in them, and gaps.

    Point samples stand for the interval since the sample before, by the trapezoid. An increment behind a lost one takes
    its interval too, at the mean of the rates either side. Behind a gap an interval has its usual length.
    """
    samples = timed.samples
    count = len(samples)
    step_s = np.concatenate(([np.inf], np.diff(samples.time_s)))
    usual_s = _usual_steps(step_s, timed.starts, count)
    own_s = usual_s if samples.interval_s is None else samples.interval_s
    is_gap = step_s > np.maximum(settings.gap_s, settings.gap_steps * usual_s)
    if samples.interval_s is None:
        interval_s = np.where(is_gap, own_s, step_s)
        interval_s[1:] = np.minimum(interval_s[1:], step_s[1:])
        integrals = samples.rates.copy()
        joins = ~is_gap[1:]
        integrals[1:][joins] += samples.rates[:-1][joins]
        integrals[1:][joins] *= 0.5
        integrals *= interval_s[:, None]
    else:
        missing_s = np.where(is_gap, 0.0, step_s - own_s)
        missing_s = np.where(missing_s > MISSING * np.minimum(usual_s, own_s), missing_s, 0.0)
        interval_s = own_s + missing_s
        integrals = samples.rates * own_s[:, None]
        late = np.flatnonzero(missing_s)
        integrals[late] += 0.5 * (samples.rates[late - 1] + samples.rates[late]) * missing_s[late, None]
    late_s = np.where(is_gap, 0.0, interval_s - own_s)
    is_bridged = late_s > MISSING * np.minimum(usual_s, own_s)
    by_repeats = np.zeros(count, dtype=bool)
    if samples.repeats_after is not None:
        by_repeats[1:] = samples.repeats_after[:-1] > 0
    bridged = Bridged(float(late_s[is_bridged & ~by_repeats].sum()), float(late_s[is_bridged & by_repeats].sum()))
    gaps_s = (step_s - own_s)[1:][is_gap[1:]]
    imu = ImuIncrements(
        samples.time_s, interval_s, integrals[:, :3], integrals[:, 3:], is_integral=samples.interval_s is not None
    )
    return imu, bridged, gaps_s


def _usual_steps(step_s: FloatArray, starts: tuple[int, ...], count: int) -> FloatArray:
    """Return the median step of each block, for each of its samples."""
    usual_s = np.empty(count)
    for start, end in zip(starts, (*starts[1:], count), strict=True):
        inside = step_s[start + 1 : end]
        usual_s[start:end] = np.median(inside) if inside.size else np.nan
    known = usual_s[np.isfinite(usual_s)]
    return np.where(np.isfinite(usual_s), usual_s, np.median(known) if known.size else 0.01)
