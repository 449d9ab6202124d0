"""Samples of an inertial unit from its table, in the order in which it made them."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from groundstation.base.dataclasses import dataclass
from groundstation.base.errors import NotAssessableError
from groundstation.base.records import BoolArray, Column
from groundstation.base.units import DEG_PER_RAD
from groundstation.base.words import counted
from groundstation.systems.trajectory.gathered import InputNote
from groundstation.systems.trajectory.input_settings import InputSettings
from groundstation.tables.table import Flight, Table

FloatArray = NDArray[np.float64]

SUBJECT = "trajectory"
ANGLES = tuple(f"delta_angle_{axis}_rad" for axis in "xyz")
VELOCITIES = tuple(f"delta_velocity_{axis}_mps" for axis in "xyz")
RATES = tuple(f"rate_{axis}_dps" for axis in "xyz")
ACCELERATIONS = tuple(f"accel_{axis}_mps2" for axis in "xyz")
INTEGRAL, SAMPLES = (*ANGLES, *VELOCITIES), (*RATES, *ACCELERATIONS)
REPEATED_SHARE = 0.02  # of the samples: a log that writes more of them twice holds values
FEWEST = 10


@dataclass(frozen=True)
class UnitSamples:
    """Samples in the order in which the unit made them.

    ``rates`` has rates in rad/s and specific force, shape (n, 6); ``interval_s`` is None where they are point samples.
    ``repeats_after``: samples left out just behind each, that repeat it.
    """

    time_s: FloatArray
    rates: FloatArray
    interval_s: FloatArray | None
    clipped: BoolArray
    repeats_after: NDArray[np.int64] | None = None

    def __len__(self) -> int:
        return len(self.time_s)

    def take(self, rows: NDArray[np.intp] | BoolArray | slice) -> "UnitSamples":
        """Return some of the samples."""
        interval_s = None if self.interval_s is None else self.interval_s[rows]
        repeats = None if self.repeats_after is None else self.repeats_after[rows]
        return UnitSamples(self.time_s[rows], self.rates[rows], interval_s, self.clipped[rows], repeats)


def fields_of(table: Table) -> tuple[str, ...]:
    """Return the fields of a table that make six axes; empty where there are none."""
    return next((fields for fields in (INTEGRAL, SAMPLES) if table.has(*fields)), ())


def samples_of(flight: Flight, topic: str, settings: InputSettings, notes: list[InputNote]) -> tuple[UnitSamples, bool]:
    """Return the whole samples of a topic, and whether the unit integrated them."""
    table = flight[topic]
    fields = fields_of(table)
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
        return _without_repeats(UnitSamples(time_s, values, None, clipped)), False
    return _integrated(UnitSamples(time_s, values, None, clipped), table, settings, notes)


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
    samples: UnitSamples, table: Table, settings: InputSettings, notes: list[InputNote]
) -> tuple[UnitSamples, bool]:
    """Return increments as means over their intervals."""
    interval_s = table.values("interval_s")
    usual_s = _usual_interval(samples.time_s, interval_s)
    told = np.isfinite(interval_s) & (interval_s > 0.0)
    interval_s = np.where(told, interval_s, usual_s)
    velocity_s = table.values("velocity_interval_s")
    other = np.isfinite(velocity_s) & (velocity_s > 0.0)
    velocity_s = np.where(other, velocity_s, interval_s)
    rates = samples.rates / np.column_stack([*[interval_s] * 3, *[velocity_s] * 3])
    found = UnitSamples(samples.time_s, rates, interval_s, samples.clipped)
    apart = int(np.count_nonzero(np.abs(velocity_s - interval_s) > 0.01 * interval_s))
    if apart:
        text = f"{counted(apart, 'increment')} of velocity over another interval than those of angle: brought to it"
        notes.append(InputNote("other_interval", text, apart))
    if not told.all():
        text = f"{counted(int(np.count_nonzero(~told)), 'increment')} without an interval: {1e3 * usual_s:.3g} ms taken"
        notes.append(InputNote("assumed_interval", text, int(np.count_nonzero(~told))))
    found = _without_repeats(found)
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


def _without_repeats(samples: UnitSamples) -> UnitSamples:
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
    if not drop.any():
        return samples
    rows = np.flatnonzero(~drop)  # the first sample is always one of them
    return replace(samples.take(rows), repeats_after=np.diff(np.append(rows, len(drop))) - 1)


def _long_runs(same: BoolArray, longest: int = 20) -> BoolArray:
    """Tell which samples stand in runs too long for a log that holds values."""
    edges = np.flatnonzero(np.diff(np.concatenate(([False], same, [False])).astype(np.int8)))
    found = np.zeros(len(same), dtype=bool)
    for start, end in zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True):
        found[start:end] = end - start > longest
    return found
