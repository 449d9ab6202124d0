"""Power-ups that one source holds; each is a flight of its own.

Whether it is read from the log or from its MCAP.
"""

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import field, replace
from typing import Any

from groundstation.base.dataclasses import dataclass
from groundstation.base.findings import Finding
from groundstation.base.records import Damage, Item, LogHeader, NewLog, RecordBatch, Remark, UtcReadings
from groundstation.base.signals import kind_of
from groundstation.base.timescales import utc_ns_to_iso
from groundstation.integrity.clock import ClockModel
from groundstation.integrity.power_ups import LAST_RECORD
from groundstation.integrity.source_clock import PowerUpClock
from groundstation.store.info import StoreInfo, from_strings

_ROWS = re.compile(r"\brows? (\d+)(?: to (\d+))?$")
_OF_THE_ZERO = ("utc_from_gps", "utc_from_gnss", "utc_from_time_packets")  # remarks that are true of one power-up
_BESIDE = "truth"  # a reference has records of its own: its times tell where they belong


@dataclass(frozen=True)
class Segment:
    """One of several power-ups in a source.

    Parameters
    ----------
    number, count : int
        Which it is, from 1, and of how many.
    first, end : int
        Its first record, and the first one of the next.
    start_ns, end_ns : int
        Corrected time of its first and last record, on the clock of the source.
    shift_ns : int
        What its times were moved by on that clock; 0 where they are UTC.
    utc_of_zero_ns : int or None
        UTC of its device time zero.
    metadata : mapping of str to str
        What the source says of it alone.
    info : StoreInfo, optional
        Its facts, where an MCAP has them.
    """

    number: int
    count: int
    first: int
    end: int
    start_ns: int
    end_ns: int
    shift_ns: int = 0
    utc_of_zero_ns: int | None = None
    metadata: Mapping[str, str] = field(default_factory=dict)
    info: StoreInfo | None = None

    def of_log(self, items: Iterable[Item]) -> Iterator[Item]:
        """Yield its items of a log, as if the log held nothing else."""
        for item in items:
            if isinstance(item, RecordBatch):
                if len(part := self._cut(item)):
                    yield part
            elif isinstance(item, LogHeader):
                yield self._header(item)
            elif isinstance(item, NewLog):
                if self.first < item.record_index < self.end:
                    yield item
            elif isinstance(item, Remark):
                if item.code not in _OF_THE_ZERO:
                    yield item
            elif self._is_mine(item):
                yield item

    def of_store(self, items: Iterable[Item]) -> Iterator[Item]:
        """Yield its items of an MCAP, at the times of a source that holds nothing else."""
        for item in items:
            if not isinstance(item, RecordBatch):
                yield item
                continue
            assert item.time_ns is not None, "the store has times"
            is_timed = kind_of(item.topic) == _BESIDE
            within = (item.time_ns >= self.start_ns) & (item.time_ns <= self.end_ns)
            part = item.take(within) if is_timed else self._cut(item)
            if not len(part) or part.time_ns is None:
                continue
            validity_ns = part.validity_time_ns
            moved = None if validity_ns is None else validity_ns - self.shift_ns
            yield replace(part, time_ns=part.time_ns - self.shift_ns, validity_time_ns=moved)

    @property
    def has_utc(self) -> bool:
        """Tell whether its times are UTC."""
        return self.info.has_utc if self.info is not None else self.utc_of_zero_ns is not None

    @property
    def finding(self) -> Finding:
        """Return the finding that a flight is one of several in its source."""
        text = f"power-up {self.number} of {self.count} in the file"
        if self.utc_of_zero_ns:
            text += f"; its counter's zero is {utc_ns_to_iso(self.utc_of_zero_ns)}"
        elif self.utc_of_zero_ns is None:
            text += "; nothing tells its UTC"
        return Finding("info", "log.power_up", text, place=f"record {self.first}")

    def _cut(self, batch: RecordBatch) -> RecordBatch:
        """Return the rows of a batch that belong to it."""
        inside = (batch.record_index >= self.first) & (batch.record_index < self.end)
        return batch if inside.all() else batch.take(inside)

    def _header(self, header: LogHeader) -> LogHeader:
        readings = header.utc_readings
        if readings is not None:
            inside = (readings.record_index >= self.first) & (readings.record_index < self.end)
            readings = UtcReadings(readings.record_index[inside], readings.zero_ns[inside])
        metadata = {**header.metadata, **self.metadata}
        return replace(header, metadata=metadata, utc_of_zero_ns=self.utc_of_zero_ns, utc_readings=readings)

    def _is_mine(self, damage: Damage) -> bool:
        """Tell whether damage belongs to it.

        The records around the damage decide, else its rows; a cut belongs to the last power-up.
        """
        if damage.between_records is not None:
            return self.first <= damage.between_records[1] - 1 < self.end or damage.between_records[1] == self.first
        if damage.kind == "truncated":
            return self.number == self.count
        rows = _ROWS.search(damage.place)
        return rows is None or (int(rows[1]) < self.end and int(rows[2] or rows[1]) >= self.first)


def segments_of(several: Sequence[PowerUpClock]) -> tuple[Segment, ...]:
    """Return the power-ups that a survey found in a log."""
    return tuple(
        Segment(
            number,
            len(several),
            one.records.first,
            one.records.end,
            one.start_ns,
            one.end_ns,
            one.shift_ns,
            one.utc_of_zero_ns,
            one.metadata,
        )
        for number, one in enumerate(several, start=1)
    )


@dataclass(frozen=True)
class PowerUpTold:
    """One of several power-ups in a log, for people and scripts.

    Times are text by the clock of the log.
    """

    number: int
    first_record: int
    start: str
    end: str
    is_utc: bool


def told_of(segments: Sequence[Segment], is_absolute: bool) -> tuple[PowerUpTold, ...]:
    """Return the power-ups of a log as text; ``is_absolute``: its times are UTC."""
    clock = ClockModel(is_absolute=is_absolute)
    return tuple(
        PowerUpTold(one.number, one.first, clock.text(one.start_ns), clock.text(one.end_ns), one.has_utc)
        for one in segments
    )


def document_of(segment: Segment, info: StoreInfo, clock: ClockModel) -> dict[str, Any]:
    """Return what an MCAP keeps of a power-up: its place and its facts.

    The facts are those of an MCAP of it alone.
    """
    return {
        "number": segment.number,
        "first_record": segment.first,
        "end_record": None if segment.end == LAST_RECORD else segment.end,
        "start": clock.text(segment.start_ns),
        "end": clock.text(segment.end_ns),
        "start_ns": segment.start_ns,
        "end_ns": segment.end_ns,
        "is_utc": info.has_utc,
        "moved_by_ns": segment.shift_ns,
        "facts": info.to_strings({}),
    }


def segments_in(info: StoreInfo) -> tuple[Segment, ...]:
    """Return the power-ups that an MCAP holds.

    Empty where it holds one, or where its record of them is damaged.
    """
    documents = [one for one in info.segments if isinstance(one, Mapping)]
    try:
        found = [_segment(one, len(documents)) for one in documents]
    except (KeyError, TypeError, ValueError):
        return ()
    return tuple(found) if len(found) > 1 else ()


def _segment(document: Mapping[str, Any], count: int) -> Segment:
    facts = {str(key): str(value) for key, value in document["facts"].items()}
    names = ("number", "first_record", "start_ns", "end_ns", "moved_by_ns")
    number, first, start_ns, end_ns, shift_ns = (int(document[name]) for name in names)
    end = LAST_RECORD if document["end_record"] is None else int(document["end_record"])
    return Segment(number, count, first, end, start_ns, end_ns, shift_ns, info=from_strings(facts))
