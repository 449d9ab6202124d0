"""Spans of damage: time in which data was lost or is wrong, and bytes that were skipped."""

import re
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from groundstation.base.dataclasses import dataclass
from groundstation.base.ledger import DamagedSpan, Truncation
from groundstation.base.records import Column, Damage, Int64Array, frozen
from groundstation.base.timescales import iso_to_utc_ns
from groundstation.base.units import NS_PER_S
from groundstation.integrity.clock import ClockModel

LISTED = 100
_ROWS = re.compile(r"\brows? (\d+)(?: to (\d+))?$")
_BYTES = re.compile(r"\bbytes? (\d+)(?: to (\d+))?$")
_TIMES = re.compile(r", (\d{4}-\S+Z) to (\d{4}-\S+Z): ")


class RecorderDropout(NamedTuple):
    """Time in which the recorder could not write.

    It has the corrected time of the newest record before it, and its length.
    """

    start_ns: int
    length_s: float


@dataclass(frozen=True)
class Span:
    """A span of time with damage.

    Parameters
    ----------
    cause : str
        ``dropout``, ``stuck``, ``out_of_range``, ``sequence``, or the kind of damage (``dropped_rows`` ...).
    topic, field : str
        Damaged topic and field; an empty topic is the whole log, an empty field the whole topic.
    start_ns, end_ns : int
        Corrected time.
    is_exact : bool
        Everything within is damaged; else the damage lies somewhere within.
    count : int
        Records, values, bytes or milliseconds, as the damage counts them.
    """

    cause: str
    topic: str
    field: str
    start_ns: int
    end_ns: int
    is_exact: bool
    count: int

    def entry(self, clock: ClockModel, zero_ns: int) -> DamagedSpan:
        """Return the form to keep.

        ``start_s`` counts from the first record of the log, as flight time does.
        """
        return DamagedSpan(
            cause=self.cause,
            topic=self.topic,
            field=self.field,
            start=clock.text(self.start_ns),
            start_s=round((self.start_ns - zero_ns) / NS_PER_S, 3),
            length_s=round((self.end_ns - self.start_ns) / NS_PER_S, 3),
            is_exact=self.is_exact,
            count=self.count,
        )


@dataclass(frozen=True)
class Timeline:
    """Corrected times of some rows of a log, in order of their places."""

    index: Int64Array
    time_ns: Int64Array

    @classmethod
    def of(cls, index: Int64Array, device_ns: Int64Array, clock: ClockModel) -> "Timeline":
        """Make a timeline from rows in any order."""
        index, first = np.unique(index, return_index=True)
        return cls(frozen(index), frozen(clock.time_ns(index, Column(device_ns[first]))))

    def around(self, first: int, last: int) -> tuple[int, int] | None:
        """Return the times of the row before ``first`` and of the row after ``last``.

        Beyond the ends of the log they are the times of these ends.
        """
        if not len(self.index):
            return None
        before = max(0, int(np.searchsorted(self.index, first)) - 1)
        after = min(len(self.index) - 1, int(np.searchsorted(self.index, last, side="right")))
        times = sorted((int(self.time_ns[before]), int(self.time_ns[after])))
        return times[0], times[1]


def spans_of(
    damages: Sequence[Damage], dropouts: Sequence[RecorderDropout], timeline: Timeline, end_ns: int
) -> list[Span]:
    """Return the spans of what the reader lost, where their place in time is known.

    Rows of a table, and bytes of a binary log that were skipped, lie between the records around them; what the end of a
    file cuts off lies at the end of the log.
    """
    found = [
        Span("dropout", "", "", one.start_ns, one.start_ns + round(one.length_s * NS_PER_S), True, _ms(one))
        for one in dropouts
    ]
    for damage in damages:
        if not damage.loses_data or damage.kind == "dropout":
            continue
        times, is_exact = _times(damage, timeline, end_ns)
        if times is not None:
            name = damage.place.partition(",")[0] if "," in damage.place else ""
            field = name.removeprefix(f"{damage.topic}.") if damage.topic and name.startswith(damage.topic) else ""
            found.append(Span(damage.kind, damage.topic, field, *times, is_exact, damage.count))
    return found


def _ms(dropout: RecorderDropout) -> int:
    return round(dropout.length_s * 1e3)


def _times(damage: Damage, timeline: Timeline, end_ns: int) -> tuple[tuple[int, int] | None, bool]:
    """Return the time of damage, and whether all within it is damaged."""
    rows, stated = _ROWS.search(damage.place), _TIMES.search(damage.what)
    if damage.between_records is not None:
        before, behind = damage.between_records
        return timeline.around(before + 1, behind - 1), False
    if damage.kind == "truncated":
        return (end_ns, end_ns), True
    if rows:
        first, last = int(rows[1]), int(rows[2] or rows[1])
        return timeline.around(first, last), damage.count >= last - first + 1
    if stated:
        return (iso_to_utc_ns(stated[1])[0], iso_to_utc_ns(stated[2])[0]), True
    return None, False


def skipped_bytes(damages: Sequence[Damage]) -> tuple[int, tuple[tuple[int, int, int], ...]]:
    """Count the bytes that no record was made of, and list their spans (first, last, bytes)."""
    spans = []
    for damage in damages:
        place = _BYTES.search(damage.place)
        if damage.loses_data and place and damage.what.startswith("bytes"):
            first = int(place[1])
            spans.append((first, int(place[2]) if place[2] else first + damage.count - 1, damage.count))
    return sum(count for _first, _last, count in spans), tuple(sorted(spans)[:LISTED])


def truncation(damages: Sequence[Damage]) -> Truncation | None:
    """Return the place where the log is cut and how much is lost; None when it is whole."""
    cut = next((damage for damage in damages if damage.kind == "truncated"), None)
    return None if cut is None else Truncation(place=cut.place, what=cut.what, count=cut.count)
