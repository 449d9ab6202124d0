"""Other clocks in a log (GNSS time, the INS's own), and the recorder's rate against them.

A field of a raw topic is a clock when the thresholds say so, ``[[clock_relation.references]]``. Some thousand readings
of each are kept, evenly spread. Corrected time is never changed by what is found.
"""

from dataclasses import field, replace
from fnmatch import fnmatchcase
from itertools import pairwise
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from groundstation.base.dataclasses import dataclass
from groundstation.base.errors import GroundstationError
from groundstation.base.records import BoolArray, Column, Int64Array, RecordBatch
from groundstation.base.timescales import WEEK_NS, gps_week_to_utc_ns, iso_to_utc_ns, whole_weeks
from groundstation.base.toml_settings import number, required_number
from groundstation.base.units import NS_PER_S
from groundstation.base.words import counted
from groundstation.integrity.clock import FIRST_NS, LARGEST_NS, ClockModel
from groundstation.integrity.clock_fit import Fitted, fit_relation
from groundstation.integrity.clock_relation import (
    ROLLOVER_S,
    WEEK_S,
    ClockRelation,
    Mistake,
    mistake_of_offset,
    mistake_of_step,
    mistake_of_told_step,
)
from groundstation.integrity.stretches import Sampler

MOST_SAMPLES = 4_096
MOST_REFERENCES = 8
_FEWEST_ZEROS = 3  # readings that tell when a counter began
_DAY_NS = 86_400 * NS_PER_S
STAMPS = "header stamp"  # a clock that is read when a message is made, and written when it reaches the recorder
_AROUND, _PROMPT_NS, _WAITED_NS = 64, NS_PER_S // 100, NS_PER_S // 2
_FLOAT_NS = 1_000  # resolution of seconds since 1970 in a float64
_FEW, _FEW_READINGS = 0.1, 5  # with the number of another week: so many are set aside, more are a step
_FEWEST = 3


@dataclass(frozen=True)
class ReferenceField:
    """Field of a log that tells the time of another clock.

    Parameters
    ----------
    clock : str
        Owner of the time: ``gnss``, ``ins``.
    topic : str
        Raw topic, * for any text.
    field : str
        Time in units of ``unit_ns``, or ISO 8601 text.
    scale : {'utc', 'gps', 'day', 'free'}
        UTC since 1970; time of the GPS week, whose number is in the field ``week``; UTC time of day; time since the
        clock's own zero.
    unit_ns : int
    week : str
        Field with the GPS week since 1980, for ``gps``.
    fix : str
        Field that must be at least ``fewest_fix`` for the time to be believed; empty for none.
    is_sampled : bool
        The recorder reads the clock when it writes a row, rather than stamps the message when it comes: the reading is
        as old as its last digit may be.
    earliest_year : int
        Nothing was recorded so before this year.
    """

    clock: str
    topic: str
    field: str
    scale: Literal["utc", "gps", "day", "free"]
    unit_ns: int = number(1_000_000_000, 1, 3_600_000_000_000)
    week: str = ""
    fix: str = ""
    fewest_fix: int = number(0, 0)
    is_sampled: bool = False
    earliest_year: int = number(1980, 1980, 2261)

    def serves(self, batch: RecordBatch) -> bool:
        """Tell whether the batch has the fields."""
        if self.field not in batch.columns or (self.week and self.week not in batch.columns):
            return False
        return fnmatchcase(batch.topic, self.topic)


@dataclass(frozen=True)
class RelationSettings:
    """Settings of the comparison of two clocks; the file explains each number."""

    references: tuple[ReferenceField, ...]
    fewest_samples: int = required_number(10)
    step_s: float = required_number(0.001)
    observable_ppm: float = required_number(0.001)
    drift_ppm: float = required_number(0.0)


@dataclass
class _Readings:
    """Readings of one reference: each of its times once, at the first record that has it."""

    topic: str
    reference: ReferenceField
    sampler: Sampler = field(default_factory=lambda: Sampler(MOST_SAMPLES))
    rows: int = 0
    times: int = 0
    first_ns: int = 0
    last_ns: int = 0
    _last: Any = None

    def add(self, batch: RecordBatch) -> None:
        reference, device = self.reference, batch.device_time_ns
        time = batch.columns[reference.field]
        good = time.mask & device.mask
        if time.values.dtype.kind == "f":
            good = good & np.isfinite(time.values)
        if reference.week:
            good = good & batch.columns[reference.week].mask
        if reference.fix in batch.columns:
            fix = batch.columns[reference.fix]
            good = good & fix.mask & (fix.values.astype(np.float64) >= reference.fewest_fix)
        rows = np.flatnonzero(good)
        if not len(rows):
            return
        values = time.values[rows]
        is_new = np.ones(len(rows), dtype=bool)
        is_new[1:] = values[1:] != values[:-1]
        is_new[0] = self._last is None or bool(values[0] != self._last)
        self.first_ns = self.first_ns if self.rows else int(device.values[rows[0]])
        self.rows, self.last_ns, self._last = self.rows + len(rows), int(device.values[rows[-1]]), values[-1]
        rows = rows[is_new]
        self.times += len(rows)
        rows = rows[self.sampler.rows(len(rows))]
        kept = {"device": np.array(device.values[rows]), "time": np.array(time.values[rows])}
        if reference.week:
            kept["week"] = np.array(batch.columns[reference.week].values[rows])
        self.sampler.put(np.array(batch.record_index[rows]), kept)

    @property
    def every_s(self) -> float:
        """Mean time between readings."""
        return max(self.last_ns - self.first_ns, 0) / NS_PER_S / max(self.rows - 1, 1)

    @property
    def is_held(self) -> bool:
        """Tell whether a time is usually repeated.

        Such a time may be older than its first reading by one of them.
        """
        return self.times < 0.75 * self.rows


class ClockReferences:
    """Collector of the readings of other clocks in the batches of a log."""

    def __init__(self, settings: RelationSettings) -> None:
        self._settings = settings
        self._readings: dict[str, list[_Readings]] = {}

    def add(self, batch: RecordBatch) -> None:
        """Add the readings of a batch; the first batch of a topic settles which fields are used."""
        found = self._readings.get(batch.topic)
        if found is None:
            found = [_Readings(batch.topic, one) for one in self._settings.references if one.serves(batch)]
            self._readings[batch.topic] = found
        for readings in found:
            if readings.reference.serves(batch):
                readings.add(batch)

    def zeros_ns(self, first: int, end: int) -> Int64Array:
        """Return UTC of device time zero by the readings between two records, in rising order.

        They are those from record ``first`` on and before ``end``. They are of the first clock, in the order of the
        topics, that tells UTC with its date there. There are none without such a clock.
        """
        for readings in (one for topic in sorted(self._readings) for one in self._readings[topic]):
            index, columns = readings.sampler.all()
            if readings.reference.scale not in ("utc", "gps") or not len(index):
                continue
            told_ns, good = _told(readings.reference, columns)
            good &= (index >= first) & (index < end) & (told_ns >= FIRST_NS)
            if np.count_nonzero(good) >= _FEWEST_ZEROS:
                return np.sort(told_ns[good] - columns["device"][good])
        return np.zeros(0, dtype=np.int64)

    def relations(self, clock: ClockModel) -> tuple[ClockRelation, ...]:
        """Compare the recorder's corrected clock with each of them, in the order of their topics."""
        known = [one for topic in sorted(self._readings) for one in self._readings[topic]]
        return tuple(_relation(one, clock, self._settings) for one in known[:MOST_REFERENCES])


def _relation(readings: _Readings, clock: ClockModel, settings: RelationSettings) -> ClockRelation:
    reference, source = readings.reference, f"{readings.topic}.{readings.reference.field}"
    index, columns = readings.sampler.all()
    told_ns, good = _told(reference, columns) if len(index) else (index, np.zeros(0, dtype=bool))
    if not good.any():
        return ClockRelation(reference.clock, source, reason="no plausible reading")
    own_ns = clock.time_ns(index, Column(columns["device"]))[good]
    told_ns = told_ns[good]
    order = np.argsort(own_ns, kind="stable")
    own_ns, told_ns = own_ns[order], told_ns[order]
    if reference.clock == STAMPS:
        prompt = _prompt(own_ns - told_ns)
        own_ns, told_ns = own_ns[prompt], told_ns[prompt]
    if len(own_ns) < settings.fewest_samples:
        too_few = f"{counted(len(own_ns), 'reading')} {'is' if len(own_ns) == 1 else 'are'} too few"
        return ClockRelation(reference.clock, source, samples=len(own_ns), reason=too_few)
    if reference.scale == "day":
        told_ns = _unfolded(told_ns, own_ns)
    is_aside, aside = _other_weeks(own_ns, told_ns, clock.is_absolute)
    own_ns, told_ns = own_ns[~is_aside], told_ns[~is_aside]
    bound_s = min(_last_digit_s(told_ns), readings.every_s) if reference.is_sampled else reference.unit_ns / NS_PER_S
    held_s = readings.every_s if readings.is_held else 0.0
    fitted = fit_relation(
        own_ns, told_ns, step_s=settings.step_s, observable_ppm=settings.observable_ppm, bound_s=bound_s
    )
    return ClockRelation(
        reference.clock,
        source,
        samples=len(own_ns),
        segments=tuple(
            replace(one, offset_sigma_s=float(np.hypot(one.offset_sigma_s, held_s / 12**0.5)))
            for one in fitted.segments
        ),
        breaks=fitted.breaks,
        residual_s=fitted.residual_s,
        resolution_s=bound_s,
        is_utc=reference.scale != "free",
        is_absolute=reference.scale in ("utc", "gps"),
        mistakes=(*aside, *_mistakes(reference, fitted, clock, told_ns)),
    )


def _prompt(late_ns: Int64Array) -> BoolArray:
    """Tell which messages were written soon after their stamp, shape (n,).

    They are all messages where none waited longer than those around it.
    """
    window = min(_AROUND, len(late_ns))
    if not window:
        return np.ones(len(late_ns), dtype=bool)
    least = np.lib.stride_tricks.sliding_window_view(late_ns, window).min(axis=1)
    around = np.clip(np.arange(len(late_ns)) - window // 2, 0, len(least) - 1)
    waited_ns = late_ns - least[around]
    return waited_ns < _PROMPT_NS if (waited_ns > _WAITED_NS).any() else np.ones(len(late_ns), dtype=bool)


def _told(reference: ReferenceField, columns: dict[str, NDArray[Any]]) -> tuple[Int64Array, BoolArray]:
    """Return the times of a clock, nanoseconds, and a mask of possible ones, shape (n,) each."""
    time_ns, good = _nanoseconds(columns["time"], reference.unit_ns)
    if reference.scale == "gps":
        week, has_week = _nanoseconds(columns["week"], 1)
        good &= has_week & (week > 0) & (week < 2**14) & (time_ns >= 0) & (time_ns < WEEK_NS)
        week, time_ns = np.where(good, week, 0), np.where(good, time_ns, 0)
        return gps_week_to_utc_ns(week, time_ns // 1_000_000) + time_ns % 1_000_000, good
    if reference.scale == "day":
        good &= (time_ns >= 0) & (time_ns <= _DAY_NS)
    return time_ns, good & (time_ns > 0 if reference.scale == "utc" else time_ns >= 0)


def _nanoseconds(values: NDArray[Any], unit_ns: int) -> tuple[Int64Array, BoolArray]:
    """Return values of any type in nanoseconds, and a mask of numbers that 62 bits hold."""
    if values.dtype.kind == "U":
        texts = [_utc_of(str(value)) for value in values]
        return np.array([text or 0 for text in texts], dtype=np.int64), np.array([text is not None for text in texts])
    if values.dtype.kind == "f":
        with np.errstate(over="ignore", invalid="ignore"):
            scaled = values.astype(np.float64) * unit_ns
        good = np.abs(scaled) < LARGEST_NS  # False of NaN
        step = _FLOAT_NS if unit_ns > 1 else 1
        return np.rint(np.where(good, scaled, 0.0) / step).astype(np.int64) * step, good
    good = np.asarray(values <= LARGEST_NS // unit_ns)
    if values.dtype.kind == "i":
        good &= values >= 0
    return np.where(good, values, 0).astype(np.int64) * unit_ns, good


def _utc_of(text: str) -> int | None:
    try:
        return iso_to_utc_ns(text)[0]
    except GroundstationError:
        return None


def _unfolded(told_ns: Int64Array, own_ns: Int64Array) -> Int64Array:
    """Place times of day on the days that bring them next to the recorder's clock.

    All follow the choice for the first one.
    """
    half = _DAY_NS // 2
    first = (int(told_ns[0] - own_ns[0]) + half) % _DAY_NS - half
    return np.asarray(own_ns + first + (told_ns - own_ns - first + half) % _DAY_NS - half, dtype=np.int64)


def _other_weeks(own_ns: Int64Array, told_ns: Int64Array, is_utc: bool) -> tuple[BoolArray, list[Mistake]]:
    """Readings of another GPS week for a short while, shape (n,), and each while by name.

    A receiver may know the time of the week before the week; at the turn of a week the new number may come late. The
    week that counts is that of the recorder, where it runs by UTC and some readings agree, else that of most readings.
    """
    away_ns = told_ns - own_ns
    agrees = np.abs(away_ns) < WEEK_NS // 2
    usual_ns = 0 if is_utc and agrees.sum() >= _FEWEST else int(np.sort(away_ns)[len(away_ns) // 2])
    number = np.rint((away_ns - usual_ns) / WEEK_NS).astype(np.int64)
    is_aside, found = np.zeros(len(number), dtype=bool), []
    starts = np.flatnonzero(np.diff(number, prepend=number[:1] - 1))
    for first, stop in pairwise([*starts.tolist(), len(number)]):
        few = stop - first <= max(_FEW * len(number), min(_FEW_READINGS, len(number) // 3))
        if number[first] and few and whole_weeks(int(away_ns[first]) - usual_ns):
            is_aside[first:stop] = True
            found.append(
                Mistake("week_number", float(number[first] * WEEK_S), int(own_ns[first]), readings=stop - first)
            )
    return is_aside, found


def _last_digit_s(time_ns: Int64Array) -> float:
    """Return the largest power of ten, at most a second, of which all times are multiples."""
    step = NS_PER_S
    while step > 1 and (time_ns % step).any():
        step //= 10
    return step / NS_PER_S


def _mistakes(reference: ReferenceField, fitted: Fitted, clock: ClockModel, told_ns: Int64Array) -> tuple[Mistake, ...]:
    """Return the errors that have a name, of steps and of the offset at the end."""
    if reference.scale == "free":
        return ()
    last_ns = int(told_ns[-1])
    name = mistake_of_step if reference.scale == "gps" else mistake_of_told_step
    named = [(one, name(one.step_s, last_ns)) for one in fitted.breaks if one.kind == "step"]
    found = [Mistake(kind, one.step_s, one.time_ns) for one, kind in named if kind]
    if clock.is_absolute:
        offset_s = fitted.segments[-1].offset_ns / NS_PER_S
        kind = mistake_of_offset(offset_s)
        found += [Mistake(kind, offset_s)] if kind else []
    earliest_ns = iso_to_utc_ns(f"{reference.earliest_year}-01-01T00:00:00Z")[0]
    is_named = any(one.kind == "week_number" and one.time_ns is None for one in found)
    if reference.scale != "day" and FIRST_NS <= last_ns < earliest_ns and not is_named:  # before that it was never set
        found.append(Mistake("week_number", -float(ROLLOVER_S)))
    return tuple(found)
