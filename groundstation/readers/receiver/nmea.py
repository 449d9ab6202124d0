"""Epochs of NMEA sentences and their times.

A sentence with a time belongs to the epoch of that time, one without to the epoch that is open. A time in whole seconds
without a fraction is the same as any within that second: some receivers cut the fraction off in RMC.
"""

from collections.abc import Callable, Mapping

import numpy as np

from groundstation.base.dataclasses import dataclass
from groundstation.base.records import BoolArray, Column, Int64Array
from groundstation.base.units import NS_PER_S
from groundstation.readers.receiver.sentence_layouts import TIME_FIELD, TIMED
from groundstation.readers.receiver.sentences import Sentences, time_of_day_ns
from groundstation.readers.receiver.stream import Frames
from groundstation.readers.receiver.times import DAY_NS, Anchors, calendar_ns

Columns = dict[str, Column]
_NOT_TIMED = -1
_MAKERS_DATES = {"PUBX.04": False, "PTNL.GGK": True}  # with time and date in front; whether the month comes first
_CENTURY = 80  # two digits of a year from here on are of the last century


@dataclass(frozen=True)
class Choice:
    """Choice of the sentences of a stream that give ``gnss``.

    Parameters
    ----------
    maker : str
        A maker's own sentence that gives the positions, where no standard one does.
    passed_over : frozenset of str
        Addresses of other devices than a receiver (``INGGA`` of an integrated navigation), where a receiver talks too.
    """

    maker: str = ""
    passed_over: frozenset[str] = frozenset()

    @property
    def timed(self) -> tuple[str, ...]:
        """Formatters of the sentences that state the time of their epoch."""
        return (*TIMED, self.maker) if self.maker else TIMED


ALL = Choice()


@dataclass(frozen=True, eq=False)
class SentenceEpochs:
    """Epochs of a block.

    Parameters
    ----------
    sentences : mapping of address to Sentences
    epoch : mapping of address to ndarray of int64
        Number of the epoch of each sentence, -1 before the first.
    day_ns : ndarray of int64, shape (n,)
        Time of the day of each epoch.
    places : ndarray of int64, shape (n,)
        Byte of the file at which each begins.
    choice : Choice
    arrivals : Anchors, optional
        Times of arrival of the sentences, for a stream that tells no time.
    """

    sentences: Mapping[str, Sentences]
    epoch: Mapping[str, Int64Array]
    day_ns: Int64Array
    places: Int64Array
    choice: Choice = ALL
    arrivals: Anchors | None = None

    def __len__(self) -> int:
        return len(self.day_ns)

    def time_of(self, address: str, time: Column) -> Column:
        """Return the time of each sentence, given that of the epochs."""
        epoch = self.epoch[address]
        if not len(self) and self.arrivals is not None:
            return _arrival(self.arrivals, self.sentences[address].places)
        if not len(self):
            return Column(np.zeros(len(epoch), dtype=np.int64), np.zeros(len(epoch), dtype=bool))
        at = np.maximum(epoch, 0)
        return Column(time.values[at], time.mask[at] & (epoch >= 0))

    def of(self, *formatters: str) -> list[tuple[Sentences, Int64Array]]:
        """Return sentences with a formatter and their epochs, combined solutions (GN) last."""
        several = (one for one in self.sentences.values() if one.address not in self.choice.passed_over)
        found = [one for one in several if one.formatter in formatters]
        return [(one, self.epoch[one.address]) for one in sorted(found, key=lambda one: one.address.startswith("GN"))]

    def values(
        self, formatter: str, names: tuple[str, ...], rows_of: Callable[[Sentences], BoolArray] | None = None
    ) -> Columns:
        """Return the fields of a formatter by epoch.

        Where an epoch has several such sentences the last that has the field counts.

        ``rows_of`` tells which sentences count, all where it is left out.
        """
        columns: Columns = {}
        for sentences, epoch in self.of(formatter):
            counts = epoch >= 0 if rows_of is None else (epoch >= 0) & rows_of(sentences)
            for name in names:
                column = sentences.columns[name]
                before = columns.get(name)
                values = np.zeros(len(self), dtype=column.values.dtype) if before is None else before.values.copy()
                present = np.zeros(len(self), dtype=bool) if before is None else before.mask.copy()
                rows = column.mask & counts
                if column.values.dtype.kind == "U":
                    values = values.astype(np.result_type(values.dtype, column.values.dtype))
                values[epoch[rows]], present[epoch[rows]] = column.values[rows], True
                columns[name] = Column(values, present)
        return columns


def _arrival(arrivals: Anchors, places: Int64Array) -> Column:
    """Return times of arrival of the sentences at given places; absent where unknown."""
    at = np.minimum(np.searchsorted(arrivals.places, places), len(arrivals) - 1)
    return Column(arrivals.utc_ns[at], arrivals.places[at] == places)


def epochs_of(
    sentences: Mapping[str, Sentences], choice: Choice = ALL, arrivals: Anchors | None = None
) -> SentenceEpochs:
    """Group the sentences of a block into epochs."""
    which, day_ns, is_whole = [], [], []
    for one in sentences.values():
        if one.formatter in choice.timed:
            value, behind, state = one.numbers(TIME_FIELD.get(one.formatter, 0))
            told_ns, sound = time_of_day_ns(value, behind)
            which.append(one.which)
            day_ns.append(np.where(sound & (state == 1), told_ns, _NOT_TIMED))
            is_whole.append(behind == 0)
    nothing = np.zeros(0, dtype=np.int64)
    order = np.argsort(np.concatenate([nothing, *which]), kind="stable")
    timed, told_ns = np.concatenate([nothing, *which])[order], np.concatenate([nothing, *day_ns])[order]
    whole = np.concatenate([np.zeros(0, dtype=bool), *is_whole])[order]
    has_time = told_ns >= 0
    timed, told_ns, whole = timed[has_time], told_ns[has_time], whole[has_time]
    told_ns = _with_fractions(told_ns, whole)
    is_new = np.append(True, told_ns[1:] != told_ns[:-1]) if len(told_ns) else np.zeros(0, dtype=bool)
    starts = timed[is_new]
    epoch = {
        address: np.searchsorted(starts, one.which, side="right").astype(np.int64) - 1
        for address, one in sentences.items()
    }
    frames = next(iter(sentences.values())).frames if sentences else None
    places = nothing if frames is None else frames.places[starts]
    return SentenceEpochs(sentences, epoch, told_ns[is_new], places, choice, arrivals)


def _with_fractions(told_ns: Int64Array, is_whole: BoolArray) -> Int64Array:
    """Give times in whole seconds the fraction of an earlier time in the same second."""
    if not len(told_ns) or not is_whole.any() or is_whole.all():
        return told_ns
    last = np.maximum.accumulate(np.where(is_whole, -1, np.arange(len(told_ns))))
    before_ns = np.where(last >= 0, told_ns[np.maximum(last, 0)], _NOT_TIMED)
    is_same = is_whole & (before_ns // NS_PER_S * NS_PER_S == told_ns)
    return np.where(is_same, before_ns, told_ns)


def epoch_start(frames: Frames, sentences: Mapping[str, Sentences], choice: Choice = ALL) -> int:
    """Return the number of the frame with which the last second of a block begins.

    ``len(frames)`` where no frame has a time.
    """
    epochs = epochs_of(sentences, choice)
    if not len(epochs):
        return len(frames)
    seconds = epochs.day_ns // NS_PER_S
    earlier = np.flatnonzero(seconds != seconds[-1])
    first = epochs.places[earlier[-1] + 1] if len(earlier) else epochs.places[0]
    return int(np.searchsorted(frames.places, first))


def full_times(sentences: Mapping[str, Sentences]) -> tuple[Int64Array, Int64Array]:
    """Return places and UTC nanoseconds of the sentences that state date and time.

    These are RMC (two digits of the year) and ZDA, or makers' sentences where there is none of them. Where some RMC
    calls its fix valid, those that do not are left out: before the fix a receiver guesses.
    """
    places, utc_ns = [np.zeros(0, dtype=np.int64)], [np.zeros(0, dtype=np.int64)]
    has_standard = any(one.formatter in ("RMC", "ZDA") for one in sentences.values())
    for one in sentences.values():
        if one.formatter not in (("RMC", "ZDA") if has_standard else _MAKERS_DATES):
            continue
        value, behind, state = one.numbers(0)
        day_ns, sound = time_of_day_ns(value, behind)
        sound = sound & (state == 1)
        if one.formatter != "ZDA":
            date, _behind, state = one.numbers(8 if one.formatter == "RMC" else 1)
            first, second, year = date // 10_000, date // 100 % 100, date % 100
            day, month = (second, first) if _MAKERS_DATES.get(one.formatter) else (first, second)
            year = year + np.where(year < _CENTURY, 2000, 1900)
            is_valid = one.texts(1).values == "A" if one.formatter == "RMC" else np.zeros(len(one), dtype=bool)
            sound &= (state == 1) & (is_valid | ~is_valid.any())
        else:
            (day, _d, has_day), (month, _m, has_month), (year, _y, has_year) = (one.numbers(at) for at in (1, 2, 3))
            sound &= (has_day == 1) & (has_month == 1) & (has_year == 1)
        midnight_ns, exists = calendar_ns(year, month, day)
        sound &= exists
        places.append(one.places[sound])
        utc_ns.append((midnight_ns + day_ns)[sound])
    return np.concatenate(places), np.concatenate(utc_ns)


class DayTimes:
    """UTC of the epochs of consecutive blocks.

    Where no date is stated it is the time of the day, counted on past midnight.
    """

    def __init__(self, anchors: Anchors) -> None:
        self._anchors = anchors
        self._last_ns: int | None = None

    def of(self, epochs: SentenceEpochs) -> Column:
        """Return the times of the epochs of the next block."""
        time = self._anchors.of_day(epochs.places, epochs.day_ns)
        if len(self._anchors) or not len(time):
            return time
        days = 0 if self._last_ns is None else round((self._last_ns - int(time.values[0])) / DAY_NS)
        time = Column(time.values + days * DAY_NS, time.present)
        self._last_ns = int(time.values[-1])
        return time
