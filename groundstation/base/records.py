"""Records: what readers and the store yield, and what tables are made from.

A reader is an iterator of items. Most are :class:`RecordBatch` (a bounded batch of one topic's columns); beside them
come :class:`LogHeader` (facts about the log), :class:`NewLog` (where another one begins in the source),
:class:`Damage` (what could not be read, where and how much) and :class:`Remark` (what the reader derived or
assumed). Missing stays missing: absent values are marked, never filled.
"""

from collections.abc import Iterator, Mapping
from dataclasses import field
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from groundstation.base.dataclasses import dataclass

Int64Array = NDArray[np.int64]
BoolArray = NDArray[np.bool_]

MAX_BATCH_ROWS = 65_536
MAX_TEXT_CHARACTERS = 1_024


def frozen(array: NDArray[Any]) -> NDArray[Any]:
    """Return a read-only view of an array, or the array itself when it is read-only already.

    Arrays inside dataclasses never change.
    """
    if not array.flags.writeable:
        return array
    view = array.view()
    view.flags.writeable = False
    return view


def places_of(index: Any) -> Any:
    """Return the positions that a mask selects; a slice and positions as they are.

    Several arrays are indexed by positions in a third to a seventh of the time that a mask takes.

    Examples
    --------
    >>> places_of(np.array([True, False, True])).tolist(), places_of(slice(2))
    ([0, 2], slice(None, 2, None))
    """
    return np.flatnonzero(index) if isinstance(index, np.ndarray) and index.dtype == np.bool_ else index


@dataclass(frozen=True, repr=False)
class Column:
    """Values of one field, and a mask of where they are present.

    Parameters
    ----------
    values : ndarray, shape (n,)
        float64, float32, bool, an integer type, or fixed-width text (dtype kind ``U``). Where absent the value is
        a filler (0, NaN or empty) that nobody may read.
    present : ndarray of bool, shape (n,), optional
        None means: every value is present. A NaN that the device wrote is present.
    """

    values: NDArray[Any]
    present: BoolArray | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "values", frozen(self.values))
        if self.present is not None:
            object.__setattr__(self, "present", frozen(self.present))

    def __len__(self) -> int:
        return len(self.values)

    def __repr__(self) -> str:
        return f"<Column of {len(self)} {self.values.dtype}, {len(self) - np.count_nonzero(self.mask)} absent>"

    @property
    def mask(self) -> BoolArray:
        """Presence as an array, shape (n,)."""
        return np.ones(len(self.values), dtype=bool) if self.present is None else self.present

    def take(self, index: Any) -> "Column":
        """Return the rows that ``index`` (slice, mask or positions) selects."""
        return Column(self.values[index], None if self.present is None else self.present[index])


@dataclass(frozen=True)
class RecordBatch:
    """A bounded batch of one topic's records, in the order of the source.

    Parameters
    ----------
    topic : str
        Canonical (``ins``, ``gnss.2``) or ``raw.<source topic>``.
    record_index : ndarray of int64, shape (n,)
        Place of each record in the source: rows of a table, messages of a log. Increasing; shared by the topics.
    device_time_ns : Column of int64
        Time as the recorder wrote it, nanoseconds, on the clock that the header names; absent where the log had none.
    columns : mapping of name to Column
    time_ns : ndarray of int64, shape (n,), optional
        Corrected recorder time, set once the clock is known: UTC nanoseconds since 1970 when the clock is absolute,
        else nanoseconds since the log's zero. Readers leave it out; the store yields it.
    validity_time_ns : ndarray of int64, shape (n,), optional
        Time at which the values were true, where it is not ``time_ns``. Readers give it by the device's clock; where it
        is the device time itself, values are valid at the corrected time of their record.
    sources : ndarray of int64, shape (n,), optional
        Number of the messages that each row is of, where a topic is made of several: each has an order of its own.
    """

    topic: str
    record_index: Int64Array
    device_time_ns: Column
    columns: Mapping[str, Column]
    time_ns: Int64Array | None = None
    validity_time_ns: Int64Array | None = None
    sources: Int64Array | None = None

    def __len__(self) -> int:
        return len(self.record_index)

    def take(self, index: Any) -> "RecordBatch":
        """Return the rows that ``index`` (slice, mask or positions) selects.

        Columns that share a mask still share one.
        """
        index = places_of(index)
        masks = {id(column.present): column.present for column in self.columns.values() if column.present is not None}
        taken = {identity: frozen(mask[index]) for identity, mask in masks.items()}
        return RecordBatch(
            self.topic,
            self.record_index[index],
            self.device_time_ns.take(index),
            {name: Column(one.values[index], taken.get(id(one.present))) for name, one in self.columns.items()},
            None if self.time_ns is None else self.time_ns[index],
            None if self.validity_time_ns is None else self.validity_time_ns[index],
            None if self.sources is None else self.sources[index],
        )


@dataclass(frozen=True, eq=False)
class UtcReadings:
    """UTC of device time zero by each reading of another clock, in the order of the source.

    Parameters
    ----------
    record_index, zero_ns : ndarray of int64, shape (n,)
    """

    record_index: Int64Array
    zero_ns: Int64Array

    def between(self, first: int, end: int) -> Int64Array:
        """Return the readings from record ``first`` on and before record ``end``, in rising order."""
        return np.sort(self.zero_ns[(self.record_index >= first) & (self.record_index < end)])


@dataclass(frozen=True)
class LogHeader:
    """Facts about a log, yielded before its first batch.

    Parameters
    ----------
    reader : str
        Name of the reader (and profile) that claimed the log: ``"flat-csv"``, ``"csv profile garmin-g1000"``.
    metadata : mapping of str to str
        ``aircraft``, ``flight``, ``start_utc``, ``reference.parking_heading_deg`` and whatever else the log says.
    utc_of_zero_ns : int, optional
        UTC (nanoseconds since 1970) of device time zero. 0 when device times are themselves UTC; None when the log
        has no absolute time (NOTIME: never today's date).
    has_counting_clock : bool
        Device times count up from power-up and nothing sets them: a record that comes after a later one of another
        topic was written late, and is no step of the clock.
    clock_offsets : tuple of (int, int)
        Offsets of the device's clock by another clock of the log: from the record of this index on, so many nanoseconds
        are to be added to device times (and to times of validity). The records before the first are moved by its offset
        too.
    utc_readings : UtcReadings, optional
        Source of ``utc_of_zero_ns`` where the device's clock starts again: each stretch has a zero of its own.
    """

    reader: str
    metadata: Mapping[str, str] = field(default_factory=dict)
    utc_of_zero_ns: int | None = None
    has_counting_clock: bool = False
    clock_offsets: tuple[tuple[int, int], ...] = ()
    utc_readings: UtcReadings | None = None


@dataclass(frozen=True)
class NewLog:
    """Place in the source where a further log begins: a header, definitions or a magic.

    Parameters
    ----------
    record_index : int
        Its first record has this place or a later one.
    metadata : mapping of str to str
        Metadata of that log.
    utc_of_zero_ns : int, optional
        UTC of its device time zero, where it says so.
    """

    record_index: int
    metadata: Mapping[str, str] = field(default_factory=dict)
    utc_of_zero_ns: int | None = None


@dataclass(frozen=True)
class Damage:
    """Data that was lost, or rows that were dropped: kind, place and count.

    Parameters
    ----------
    kind : str
        ``truncated``, ``corrupt``, ``dropped_rows``, ``unreadable_cells``, ``dropped_channel``.
    place : str
        ``"row 1207"``, ``"byte 40960"``, ``"gnss.latitude_deg, rows 14 to 15"``.
    count : int
        Number of items (records, cells or bytes, as ``what`` says).
    what : str
        Items counted, and the reason of the loss: ``"rows with 13 cells instead of 25"``.
    topic : str
        Topic it belongs to; empty when it concerns the whole log.
    loses_data : bool
        False for what is odd but lost nothing (exit code 3 is for lost data).
    between_records : (int, int), optional
        Record index of the last record before it and of the first behind it, where ``place`` does not tell.
    """

    kind: str
    place: str
    count: int
    what: str
    topic: str = ""
    loses_data: bool = True
    between_records: tuple[int, int] | None = None


HEADING_IS_TRACK = "heading_is_track"  # code of a remark: the receiver lets the nose point along the motion
# Codes of remarks on values of a receiver that cannot be, or that it contradicts itself.
AT_ODDS = ("odd_height", "impossible_dilution", "same_dilution", "hdops_differ")


@dataclass(frozen=True)
class Remark:
    """Something that the reader derived, converted or assumed and a user must know.

    ``code`` is stable (``derived``, ``assumed_utc``, :data:`HEADING_IS_TRACK`), ``text`` is for people. ``fields`` are
    those of ``topic`` that the remark is about: what a derived field was derived from is kept with the flight.
    """

    code: str
    text: str
    topic: str = ""
    fields: tuple[str, ...] = ()


Item: TypeAlias = LogHeader | NewLog | RecordBatch | Damage | Remark
Items: TypeAlias = Iterator[Item]
