"""Increments of the inertial unit of a flight, from the tables of its log."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from groundstation.base.errors import NotAssessableError
from groundstation.base.records import BoolArray, Column
from groundstation.base.signals import topics_of_kind
from groundstation.base.units import DEG_PER_RAD
from groundstation.base.words import clock_text, counted, listed
from groundstation.systems.trajectory.gathered import ImuFacts, InputNote
from groundstation.systems.trajectory.input_settings import InputSettings
from groundstation.systems.trajectory.inputs import ImuIncrements
from groundstation.systems.trajectory.retime import blocks_of, on_a_line
from groundstation.tables.sources import WHOLE_SHARE
from groundstation.tables.table import Flight, Table

FloatArray = NDArray[np.float64]

SUBJECT = "trajectory"
ANGLES = tuple(f"delta_angle_{axis}_rad" for axis in "xyz")
VELOCITIES = tuple(f"delta_velocity_{axis}_mps" for axis in "xyz")
RATES = tuple(f"rate_{axis}_dps" for axis in "xyz")
ACCELERATIONS = tuple(f"accel_{axis}_mps2" for axis in "xyz")
INTEGRAL, SAMPLES = (*ANGLES, *VELOCITIES), (*RATES, *ACCELERATIONS)
AXES = tuple(f"{what} {axis}" for what in ("gyro", "accelerometer") for axis in "xyz")
REPEATED_SHARE = 0.02  # of the samples: a log that writes more of them twice holds values
AT_END, FEWEST_AT_END = 1e-6, 3  # relative nearness to the largest value, and how many in a row are saturated
LEAST_END = (100.0 / DEG_PER_RAD, 18.0)  # no gyro and no accelerometer ends below
MOVES = (5.0 / DEG_PER_RAD, 2.0)  # rad/s, m/s2: spread over 90 % of the samples of what moves
MISSING = 0.25  # of an interval: a step that is longer by more has lost samples in it
BRIDGED_SHARE = 1e-3  # of the time, from which on it is told
FEWEST = 10


@dataclass(frozen=True)
class ImuInput:
    """Increments, facts and notes of a unit."""

    imu: ImuIncrements
    facts: ImuFacts
    notes: tuple[InputNote, ...]


@dataclass(frozen=True)
class _Samples:
    """Samples in the order in which the unit made them.

    ``rates`` has rates in rad/s and specific force, shape (n, 6); ``interval_s`` is None where they are point samples.
    """

    time_s: FloatArray
    rates: FloatArray
    interval_s: FloatArray | None
    clipped: BoolArray

    def __len__(self) -> int:
        return len(self.time_s)

    def take(self, rows: NDArray[np.intp] | BoolArray | slice) -> "_Samples":
        """Return some of the samples."""
        interval_s = None if self.interval_s is None else self.interval_s[rows]
        return _Samples(self.time_s[rows], self.rates[rows], interval_s, self.clipped[rows])


def imu_of(flight: Flight, settings: InputSettings) -> ImuInput:
    """Return the increments of the best inertial unit of a flight.

    Raises
    ------
    NotAssessableError
        Where there is no unit with six axes, or its values are none.
    """
    topic, others = _chosen(flight, settings)
    notes: list[InputNote] = []
    if others:
        notes.append(InputNote("several_units", f"{topic} is used; {listed(others)} not", len(others)))
    samples, integral = _samples(flight, topic, settings, notes)
    samples = _without_stuck(samples, topic, settings, notes)
    _require_gravity(samples, topic, settings)
    clipped, saturated = _told_ends(samples, notes)
    timed = _timed(samples, settings)
    notes += timed.notes
    imu, bridged_s, gaps_s = _increments(timed, settings)
    if len(imu) < FEWEST:
        raise NotAssessableError(SUBJECT, f"{topic} has only {counted(len(imu), 'usable sample')}")
    if bridged_s > BRIDGED_SHARE * float(imu.interval_s.sum()):
        text = f"samples of {topic} are missing in steps below {settings.gap_s:g} s, {bridged_s:.1f} s in all: bridged"
        notes.append(InputNote("bridged", text))
    if gaps_s.size:
        text = (
            f"{counted(gaps_s.size, 'gap')} of {topic}, {gaps_s.sum():.1f} s in all, the longest {gaps_s.max():.2f} s"
        )
        notes.append(InputNote("gaps", text, int(gaps_s.size)))
    rate_hz = 1.0 / float(np.median(imu.interval_s))
    facts = ImuFacts(
        topic,
        integral,
        rate_hz,
        timed.jitter_s,
        timed.jitter_max_s,
        bridged_s,
        int(gaps_s.size),
        float(gaps_s.max(initial=0.0)),
        clipped,
        saturated,
    )
    return ImuInput(imu, facts, tuple(notes))


def _chosen(flight: Flight, settings: InputSettings) -> tuple[str, tuple[str, ...]]:
    """Return the topic to use, and the others that could be used.

    Increments come before point samples, a higher rate before a lower one, then the one with more samples, among those
    that cover most of the time of the fullest.
    """
    topics = [one for one in topics_of_kind("imu", flight.topics()) if len(flight[one])]
    named = settings.imu_topic
    if named and named not in topics:
        raise NotAssessableError(SUBJECT, f"no topic {named}")
    if not topics:
        raise NotAssessableError(SUBJECT, "no inertial unit (topic imu) in the log")
    whole = [one for one in topics if _fields_of(flight[one])]
    if named:
        whole = [one for one in whole if one == named]
    if not whole:
        raise NotAssessableError(SUBJECT, f"{listed(topics)}: no unit with three gyros and three accelerometers")
    spans_s = {one: _span_s(flight[one]) for one in whole}
    enough = [one for one in whole if spans_s[one] >= WHOLE_SHARE * max(spans_s.values())]

    def key(one: str) -> tuple[bool, float, int]:
        table = flight[one]
        rate_hz = len(table) / max(spans_s[one], 1e-3)
        return _fields_of(table) != INTEGRAL, -round(rate_hz, -1 if rate_hz > 20.0 else 0), -len(table)

    best = min(enough, key=key)
    return best, tuple(one for one in whole if one != best)


def _fields_of(table: Table) -> tuple[str, ...]:
    """Return the fields of a table that make six axes; empty where there are none."""
    return next((fields for fields in (INTEGRAL, SAMPLES) if table.has(*fields)), ())


def _span_s(table: Table) -> float:
    return float(table.time_ns[-1] - table.time_ns[0]) / 1e9


def _samples(flight: Flight, topic: str, settings: InputSettings, notes: list[InputNote]) -> tuple[_Samples, bool]:
    """Return the whole samples of a topic, and whether the unit integrated them."""
    table = flight[topic]
    fields = _fields_of(table)
    if 2 * np.count_nonzero(table.valid(*fields)) < len(table) and not (np.diff(table.time_ns) > 0).all():
        table = table.unique_times()  # parts of a sample in several rows
    if fields == SAMPLES:
        table = _at_one_time(table, settings, notes)
    whole = table.valid(*fields)
    absent = int(len(table) - np.count_nonzero(whole))
    if absent:
        notes.append(
            InputNote("absent_samples", f"{counted(absent, 'sample')} of {topic} without all six axes", absent)
        )
    table = table.take(np.flatnonzero(whole)[_order(table.record_index[whole], table.time_ns[whole])])
    if len(table) < FEWEST:
        raise NotAssessableError(SUBJECT, f"{topic} has only {counted(len(table), 'whole sample')}")
    values = np.column_stack([table.values(name) for name in fields])
    clipped = np.zeros(len(table), dtype=bool)
    for name in ("gyro_clipping", "accel_clipping"):
        clipped |= np.nan_to_num(table.values(name)) > 0.0
    time_s = flight.seconds(table.time_ns)
    if fields == SAMPLES:
        notes.append(InputNote("point_samples", f"{topic} has point samples: what happens between them is not known"))
        values[:, :3] /= DEG_PER_RAD
        return _without_repeats(_Samples(time_s, values, None, clipped), topic, notes), False
    return _integrated(_Samples(time_s, values, None, clipped), table, settings, notes)


def _at_one_time(table: Table, settings: InputSettings, notes: list[InputNote]) -> Table:
    """Return a table whose rows have all six axes.

    Where rates and specific force are sampled apart, the one with fewer samples is interpolated to the times of the
    other.
    """
    has_rate, has_force = table.valid(*RATES), table.valid(*ACCELERATIONS)
    most = max(int(has_rate.sum()), int(has_force.sum()))
    if 2 * np.count_nonzero(has_rate & has_force) >= most:
        return table
    base, other, fields, what = has_rate, has_force, ACCELERATIONS, "specific force"
    if has_force.sum() > has_rate.sum():
        base, other, fields, what = has_force, has_rate, RATES, "rates"
    made, source = table.take(base), table.take(other)
    start_ns = int(table.time_ns[0])
    at_s, known_s = (made.time_ns - start_ns) / 1e9, (source.time_ns - start_ns) / 1e9
    after = np.clip(np.searchsorted(known_s, at_s), 1, len(known_s) - 1) if len(known_s) > 1 else None
    if after is None:
        return table
    step_s = known_s[after] - known_s[after - 1]
    longest_s = max(settings.gap_s, settings.gap_steps * float(np.median(np.diff(known_s))))
    near = (step_s <= longest_s) & (at_s >= known_s[0]) & (at_s <= known_s[-1])
    columns = {name: Column(np.interp(at_s, known_s, source.values(name)), near) for name in fields}
    notes.append(InputNote("sampled_apart", f"{what} of {table.topic} interpolated to the times of the other sensor"))
    return replace(made, columns=dict(made.columns) | columns)


def _order(record_index: NDArray[np.int64], time_ns: NDArray[np.int64]) -> NDArray[np.intp]:
    """Return the order in which a unit made its samples.

    It is that of the log, unless that is no order of time at all.
    """
    by_record = np.argsort(record_index, kind="stable")
    back = np.diff(time_ns[by_record]) < -1_000_000_000
    return np.arange(len(time_ns)) if np.count_nonzero(back) > 1 + len(time_ns) // 1000 else by_record


def _integrated(
    samples: _Samples, table: Table, settings: InputSettings, notes: list[InputNote]
) -> tuple[_Samples, bool]:
    """Return increments as means over their intervals."""
    interval_s = table.values("interval_s")
    usual_s = _usual_interval(samples.time_s, interval_s)
    told = np.isfinite(interval_s) & (interval_s > 0.0)
    interval_s = np.where(told, interval_s, usual_s)
    velocity_s = table.values("velocity_interval_s")
    other = np.isfinite(velocity_s) & (velocity_s > 0.0)
    velocity_s = np.where(other, velocity_s, interval_s)
    rates = samples.rates / np.column_stack([*[interval_s] * 3, *[velocity_s] * 3])
    found = _Samples(samples.time_s, rates, interval_s, samples.clipped)
    apart = int(np.count_nonzero(np.abs(velocity_s - interval_s) > 0.01 * interval_s))
    if apart:
        text = f"{counted(apart, 'increment')} of velocity over another interval than those of angle: brought to it"
        notes.append(InputNote("other_interval", text, apart))
    if not told.all():
        text = f"{counted(int(np.count_nonzero(~told)), 'increment')} without an interval: {1e3 * usual_s:.3g} ms taken"
        notes.append(InputNote("assumed_interval", text, int(np.count_nonzero(~told))))
    found = _without_repeats(found, table.topic, notes)
    assert found.interval_s is not None
    step = np.diff(found.time_s)
    near = np.abs(step) <= settings.segment_s  # jitter cancels
    covered = float(found.interval_s[1:][near].sum() / max(float(step[near].sum()), 1e-9)) if near.any() else 1.0
    if covered > settings.covered_share_max:
        text = f"increments of {table.topic} cover {100.0 * covered:.0f} % of the time: they overlap"
        raise NotAssessableError(SUBJECT, text)
    if covered < settings.covered_share_min:
        text = f"increments of {table.topic} cover {100.0 * covered:.0f} % of the time: they are taken as samples"
        notes.append(InputNote("point_samples", text))
        return replace(found, interval_s=None), False
    return found, True


def _usual_interval(time_s: FloatArray, interval_s: FloatArray) -> float:
    """Return the interval of increments without one: the usual step of their stamps."""
    known = interval_s[np.isfinite(interval_s) & (interval_s > 0.0)]
    if known.size:
        return float(np.median(known))
    window = int(np.clip(len(time_s) // 8, 1, 400))
    ordered = np.sort(time_s)
    return max(float(np.median((ordered[window:] - ordered[:-window]) / window)), 1e-6)


def _without_repeats(samples: _Samples, topic: str, notes: list[InputNote]) -> _Samples:
    """Drop samples that the log has twice.

    They have the same stamp and values; or the same values, where the log holds many.
    """
    same = np.ones(len(samples), dtype=bool)
    same[0] = False
    kept = [samples.rates[1:, axis] == samples.rates[:-1, axis] for axis in range(6)]
    for one in kept:
        same[1:] &= one
    at_once = same.copy()
    at_once[1:] &= np.diff(samples.time_s) == 0.0
    others = ~same[1:]
    by_chance = float(np.prod([np.mean(one[others]) for one in kept])) if others.any() else 1.0
    held = same & ~at_once
    drop = at_once
    if np.mean(held) > max(REPEATED_SHARE, 3.0 * by_chance):
        drop = same & ~_long_runs(same)
    count = int(np.count_nonzero(drop))
    if count:
        notes.append(InputNote("duplicates", f"{counted(count, 'sample')} of {topic} logged twice: left out", count))
    return samples.take(~drop) if count else samples


def _long_runs(same: BoolArray, longest: int = 20) -> BoolArray:
    """Tell which samples stand in runs too long for a log that holds values."""
    edges = np.flatnonzero(np.diff(np.concatenate(([False], same, [False])).astype(np.int8)))
    found = np.zeros(len(same), dtype=bool)
    for start, end in zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True):
        found[start:end] = end - start > longest
    return found


def _without_stuck(samples: _Samples, topic: str, settings: InputSettings, notes: list[InputNote]) -> _Samples:
    """Drop the samples during which an axis is stuck: it keeps one value while others move.

    Raises
    ------
    NotAssessableError
        Where hardly anything is left.
    """
    bad = np.zeros(len(samples), dtype=bool)
    for axis, name in enumerate(AXES):
        keeps = samples.rates[1:, axis] == samples.rates[:-1, axis]
        edges = np.flatnonzero(np.diff(np.concatenate(([False], keeps, [False])).astype(np.int8)))
        places, count = [], 0
        for start, end in zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True):
            if samples.time_s[end] - samples.time_s[start] > settings.stuck_s and _moves(samples.rates[start:end]):
                bad[start : end + 1] = True
                places.append(float(samples.time_s[start]))
                count += end + 1 - start
        if count:
            text = f"{name} of {topic} keeps one value from {clock_text(places[0])} on, {counted(count, 'sample')}"
            notes.append(InputNote("stuck_axis", f"{text}: left out", count, is_doubt=True))
    if not bad.any():
        return samples
    if np.mean(bad) > settings.stuck_share_max:
        stuck = [note.text.removesuffix(": left out") for note in notes if note.code == "stuck_axis"]
        raise NotAssessableError(SUBJECT, stuck[0])
    return samples.take(~bad)


def _moves(rates: FloatArray) -> bool:
    """Tell whether a unit is turned or shaken by more than the resolution of a coarse one."""
    low, high = np.percentile(rates, (5.0, 95.0), axis=0)
    return bool((high - low >= np.repeat(MOVES, 3)).any())


def _require_gravity(samples: _Samples, topic: str, settings: InputSettings) -> None:
    """Refuse a unit whose specific force is in another unit, or none.

    Raises
    ------
    NotAssessableError
    """
    usual = float(np.median(np.linalg.norm(samples.rates[:, 3:], axis=1)))
    if not settings.accel_low_mps2 <= usual <= settings.accel_high_mps2:
        hint = ": is it in g?" if 0.8 < usual < 1.2 else ": gravity is not in it" if usual < 0.8 else ""
        raise NotAssessableError(SUBJECT, f"specific force of {topic} is {usual:.3g} m/s2 by the median, not 9.8{hint}")


def _told_ends(samples: _Samples, notes: list[InputNote]) -> tuple[int, int]:
    """Note samples that are clipped and those at the end of the range; return how many."""
    clipped = int(np.count_nonzero(samples.clipped))
    if clipped:
        first_s = float(samples.time_s[int(np.argmax(samples.clipped))])
        text = f"{counted(clipped, 'sample')} clipped by the unit's own count, the first at {clock_text(first_s)}"
        notes.append(InputNote("clipped", text, clipped, is_doubt=True))
    saturated = 0
    for axis, name in enumerate(AXES):
        values = np.abs(samples.rates[:, axis])
        most = float(values.max())
        if most < LEAST_END[axis // 3]:
            continue
        at_end = values >= most * (1.0 - AT_END)
        edges = np.flatnonzero(np.diff(np.concatenate(([False], at_end, [False])).astype(np.int8)))
        runs = [
            (a, b) for a, b in zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True) if b - a >= FEWEST_AT_END
        ]
        count = sum(b - a for a, b in runs)
        if count:
            first_s = float(samples.time_s[runs[0][0]])
            text = (
                f"{name} stays at {_shown(axis, most)} for {counted(count, 'sample')}, first at {clock_text(first_s)}"
            )
            notes.append(InputNote("saturated", text, count, is_doubt=True))
            saturated += count
    return clipped, saturated


def _shown(axis: int, value: float) -> str:
    return f"{value * DEG_PER_RAD:.0f} deg/s" if axis < 3 else f"{value:.0f} m/s2"


@dataclass(frozen=True)
class _Timed:
    """Samples with times on a line, in blocks: ``starts`` are the first samples of each."""

    samples: _Samples
    starts: tuple[int, ...]
    jitter_s: float
    jitter_max_s: float
    notes: tuple[InputNote, ...]


def _timed(samples: _Samples, settings: InputSettings) -> _Timed:
    """Put the stamps of the samples on lines, block by block.

    Samples that would go back in time are left out.
    """
    pieces: list[_Samples] = []
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
    return _Timed(joined, tuple(starts), jitter_s, float(residual_s.max()), tuple(notes))


def _joined(pieces: list[_Samples]) -> _Samples:
    return _Samples(
        np.concatenate([one.time_s for one in pieces]),
        np.concatenate([one.rates for one in pieces]),
        None if pieces[0].interval_s is None else np.concatenate([_of(one) for one in pieces]),
        np.concatenate([one.clipped for one in pieces]),
    )


def _of(samples: _Samples) -> FloatArray:
    assert samples.interval_s is not None
    return samples.interval_s


def _increasing(time_s: FloatArray, end_s: float) -> BoolArray:
    """Tell which times are later than all before."""
    before = np.maximum.accumulate(np.concatenate(([end_s], time_s[:-1])))
    return np.asarray(time_s > before)


def _increments(timed: _Timed, settings: InputSettings) -> tuple[ImuIncrements, float, FloatArray]:
    """Return increments over intervals that touch, seconds bridged in them, and gaps.

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
    bridged_s = float(late_s[late_s > MISSING * np.minimum(usual_s, own_s)].sum())
    gaps_s = (step_s - own_s)[1:][is_gap[1:]]
    imu = ImuIncrements(
        samples.time_s, interval_s, integrals[:, :3], integrals[:, 3:], is_integral=samples.interval_s is not None
    )
    return imu, bridged_s, gaps_s


def _usual_steps(step_s: FloatArray, starts: tuple[int, ...], count: int) -> FloatArray:
    """Return the median step of each block, for each of its samples."""
    usual_s = np.empty(count)
    for start, end in zip(starts, (*starts[1:], count), strict=True):
        inside = step_s[start + 1 : end]
        usual_s[start:end] = np.median(inside) if inside.size else np.nan
    known = usual_s[np.isfinite(usual_s)]
    return np.where(np.isfinite(usual_s), usual_s, np.median(known) if known.size else 0.01)
