"""Times of arrival by the clock of the computer that recorded.

They are used where the receiver states no time or no date. The receiver's time comes first. Sentences without any time
(a compass alone) get that of their arrival. Where the receiver states the time of the day and no date, the computer's
clock gives the date: its offset from the receiver's must be some quarters of an hour (its zone) and at most a minute.
"""

from collections.abc import Iterator
from dataclasses import field

import numpy as np

from groundstation.base.dataclasses import dataclass
from groundstation.base.records import Column, Int64Array, RecordBatch, Remark
from groundstation.base.units import NS_PER_S
from groundstation.readers.receiver.host_text import DATE, DAY, HostText
from groundstation.readers.receiver.nmea import SentenceEpochs
from groundstation.readers.receiver.stream import Frames
from groundstation.readers.receiver.times import DAY_NS, Anchors, unrolled

TOPIC = "raw.host"
HOUR_NS, QUARTER_NS, MINUTE_NS = 3_600 * NS_PER_S, 900 * NS_PER_S, 60 * NS_PER_S
_SHARE_IN_ORDER = 0.99
_SHARE_BESIDE = 0.9


def texts_of(frames: Frames, is_before: bool) -> list[bytes]:
    """Return the computer's text before the frames of a block, or behind them."""
    if frames.texts is None:
        return [b""] * len(frames)
    ends = frames.offsets + (0 if is_before else frames.lengths + frames.texts[:, 1])
    sizes = frames.texts[:, 0 if is_before else 1]
    return [frames.data[end - size : end].tobytes() for end, size in zip(ends.tolist(), sizes.tolist(), strict=True)]


def times_of(host: HostText, frames: Frames) -> Column:
    """Return the time of each frame of a block by the computer's clock, nanoseconds."""
    values, present = np.zeros(len(frames), dtype=np.int64), np.zeros(len(frames), dtype=bool)
    if host.clock is not None:
        for row, text in enumerate(texts_of(frames, host.clock_is_before)):
            told = host.clock.read(text) if text else None
            if told is not None:
                values[row], present[row] = told, True
    return Column(values, present)


def raw_batch(frames: Frames, epochs: SentenceEpochs, time: Column) -> RecordBatch | None:
    """Return the text around the sentences of a block, a row for each that has any.

    ``time`` is that of the epochs.
    """
    if frames.texts is None or not frames.texts.any():
        return None
    columns = {}
    for name, is_before in (("before", True), ("behind", False)):
        texts = np.array([text.decode("ascii", "replace") for text in texts_of(frames, is_before)], dtype=np.str_)
        columns[name] = Column(texts, texts != "")
    when, known = np.zeros(len(frames), dtype=np.int64), np.zeros(len(frames), dtype=bool)
    for address, sentences in epochs.sentences.items():
        told = epochs.time_of(address, time)
        when[sentences.which], known[sentences.which] = told.values, told.mask
    rows = columns["before"].mask | columns["behind"].mask
    return RecordBatch(TOPIC, frames.places, Column(when, known), columns).take(rows)


@dataclass
class HostTimes:
    """Computer's times gathered over a stream; it finds out whether they are of use."""

    host: HostText
    lines: int = 0
    _places: list[Int64Array] = field(default_factory=list)
    _told_ns: list[Int64Array] = field(default_factory=list)
    _day_places: list[Int64Array] = field(default_factory=list)
    _day_ns: list[Int64Array] = field(default_factory=list)

    def take(self, frames: Frames, epochs: SentenceEpochs) -> None:
        """Take in a block, and the receiver's times of the day in it."""
        if frames.texts is not None:
            self.lines += int(np.count_nonzero(frames.texts.any(axis=1)))
        told = times_of(self.host, frames)
        self._places.append(frames.places[told.mask])
        self._told_ns.append(told.values[told.mask])
        self._day_places.append(epochs.places)
        self._day_ns.append(epochs.day_ns)

    def serve(self) -> "Served":
        """Return the times that the computer's clock gives where the receiver states none in full."""
        clock = self.host.clock
        if any(len(places) for places in self._day_places):
            return self._dates() if clock is not None and clock.kind == DATE else Served("no date")
        arrivals = self._arrivals()
        if clock is None or arrivals is None:
            return Served("no time")
        return Served("", arrivals=arrivals, is_absolute=clock.kind == DATE)

    def _told(self) -> tuple[Int64Array, Int64Array]:
        places, told_ns = np.concatenate(self._places), np.concatenate(self._told_ns)
        is_day = self.host.clock is not None and self.host.clock.kind == DAY
        return places, unrolled(told_ns, DAY_NS) if is_day else told_ns

    def _arrivals(self) -> Anchors | None:
        """Return places and times of arrival, where the clock is in order.

        None where it is not.
        """
        places, told_ns = self._told()
        if len(places) < 2 or np.mean(np.diff(told_ns) >= 0) < _SHARE_IN_ORDER or told_ns[-1] <= told_ns[0]:
            return None
        return Anchors(places, np.maximum.accumulate(told_ns), np.full(len(places), -1, dtype=np.int64))

    def _dates(self) -> "Served":
        """Return full times of the epochs that arrived close to their time of the day.

        They are in the zone that most of them agree on.
        """
        places, told_ns = self._told()
        day_places, day_ns = np.concatenate(self._day_places), np.concatenate(self._day_ns)
        at = np.minimum(np.searchsorted(places, day_places), max(len(places) - 1, 0))
        stamped = np.isin(day_places, places)
        if not stamped.any():
            return Served("no date")
        host_ns, day_ns, day_places = told_ns[at[stamped]], day_ns[stamped], day_places[stamped]
        apart_ns = _half_day(host_ns - day_ns)
        quarters, counts = np.unique(np.round(apart_ns / QUARTER_NS).astype(np.int64), return_counts=True)
        zone_ns = int(quarters[counts.argmax()]) * QUARTER_NS
        late_ns = _half_day(apart_ns - zone_ns)
        beside = np.abs(late_ns) <= MINUTE_NS
        if beside.mean() < _SHARE_BESIDE:
            return Served("no date")
        utc_ns = (host_ns - zone_ns - late_ns)[beside]
        anchors = Anchors(day_places[beside], utc_ns, np.full(len(utc_ns), -1, dtype=np.int64))
        return Served("", dates=anchors, zone_ns=zone_ns)


def _half_day(ns: Int64Array) -> Int64Array:
    """Wrap differences of times of the day to half a day before or after."""
    return np.asarray((ns + DAY_NS // 2) % DAY_NS - DAY_NS // 2, dtype=np.int64)


@dataclass(frozen=True)
class Served:
    """Times that the computer's clock gave.

    Parameters
    ----------
    lacks : str
        What is still not known: ``no time``, ``no date`` or nothing.
    arrivals : Anchors, optional
        Times of arrival of the sentences by their place; since 1970 where ``is_absolute``.
    dates : Anchors, optional
        Full times of the receiver's epochs.
    zone_ns : int
        How far the computer's clock is from the receiver's.
    """

    lacks: str = ""
    arrivals: Anchors | None = None
    is_absolute: bool = False
    dates: Anchors | None = None
    zone_ns: int = 0


def remarks(host: HostText, lines: int, served: Served | None) -> Iterator[Remark]:
    """Yield remarks on the text around the sentences and on the use of its time."""
    text = f"{lines} sentences stand in text of the computer that recorded, as {host.example!r}: kept as {TOPIC}"
    if served is None:
        text += "; times are the receiver's"
    elif served.arrivals is not None:
        text += "; the receiver tells no time: times are those of arrival by the computer's clock"
    elif served.dates is not None:
        text += (
            f"; the receiver tells no date: it is that of the computer's clock, {served.zone_ns / HOUR_NS:g} h ahead"
        )
    elif host.clock is not None:
        text += f"; the receiver tells {served.lacks}, and the computer's clock does not serve"
    yield Remark("host_text", text)
    if served is not None and served.is_absolute and not host.tells_zone:
        yield Remark("assumed_utc", "the computer that recorded writes no time zone: its clock is taken for UTC")
