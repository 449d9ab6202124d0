"""A table: the samples of one topic as named numpy columns on the corrected clock."""

from collections.abc import Callable, Hashable, Iterator, Mapping
from dataclasses import field, replace
from importlib.util import find_spec
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Literal, Self, TypeVar, cast

import numpy as np
from numpy.typing import NDArray

from groundstation.base.dataclasses import dataclass
from groundstation.base.errors import NotAssessableError, UnknownNameError, UsageError
from groundstation.base.gaps import Pause
from groundstation.base.records import BoolArray, Column, Int64Array, frozen
from groundstation.base.signals import RAW_PREFIX, TOPICS, field_of, is_canonical, is_field_name, kind_of
from groundstation.base.source_units import source_units
from groundstation.base.unit_names import split_unit
from groundstation.base.units import NS_PER_S
from groundstation.base.words import counted

if TYPE_CHECKING:
    import pandas as pd

FloatArray = NDArray[np.float64]
T = TypeVar("T")


@dataclass(frozen=True, repr=False)
class Table:
    """Samples of one topic, in order of corrected time.

    ``table["roll_deg"]`` is a column; ``"gdop" in table`` tells whether there is one.

    Parameters
    ----------
    topic : str
    time_ns : ndarray of int64, shape (n,)
        Corrected time of validity, never decreasing; duplicated times may occur (see :meth:`unique_times`).
    columns : mapping of name to Column, each of length n
    record_index, device_time_ns
        Place in the source and time as read.
    """

    topic: str
    time_ns: Int64Array
    columns: Mapping[str, Column]
    record_index: Int64Array
    device_time_ns: Column

    def __post_init__(self) -> None:
        object.__setattr__(self, "time_ns", frozen(self.time_ns))
        object.__setattr__(self, "record_index", frozen(self.record_index))
        object.__setattr__(self, "columns", MappingProxyType(dict(self.columns)))

    @classmethod
    def empty(cls, topic: str) -> "Table":
        """A table without samples: every field of it has shape (0,)."""
        nothing = np.zeros(0, dtype=np.int64)
        return cls(topic, nothing, {}, nothing, Column(nothing))

    def __len__(self) -> int:
        return len(self.time_ns)

    def __contains__(self, name: str) -> bool:
        return name in self.columns

    def __getitem__(self, name: str) -> NDArray[Any]:
        """Return a column of the log as it is read, shape (n,).

        Numbers as :meth:`values` gives them, text as :meth:`text` does.

        Raises
        ------
        UnknownNameError
            When the log has none of that name, with the names that are near.
        """
        if name not in self.columns:
            raise UnknownNameError(f"table {self.topic}", name, self.columns)
        return self.text(name) if self.columns[name].values.dtype.kind == "U" else self.values(name)

    def __repr__(self) -> str:
        return f"<{type(self).__name__} {self.topic}: {counted(len(self), 'row')} of {', '.join(self.columns)}>"

    def _absent(self, name: str) -> None:
        """Refuse a name that no signal has; a field that this log merely lacks is absent."""
        if not is_field_name(name):
            names = dict.fromkeys((*self.columns, *(field.name for field in TOPICS.get(kind_of(self.topic), ()))))
            raise UnknownNameError(f"table {self.topic}", name, names)

    def has(self, *names: str) -> bool:
        """Tell whether every named field is there with at least one present value."""
        return all(name in self.columns and bool(self.columns[name].mask.any()) for name in names)

    def values(self, name: str) -> FloatArray:
        """Return a field as float64, shape (n,), NaN where it is absent.

        It is absent also where the device wrote NaN, and if the log lacks the field. It is NaN also where a measured
        quantity is further outside its physical range than that range is wide (1e308 m/s, infinity): nothing is
        computed with it. Quality figures (dilutions, sigmas) are given as they are.

        Raises
        ------
        UnknownNameError
            For a name that is neither in the log nor that of any signal.
        """
        if name not in self.columns:
            self._absent(name)
            return np.full(len(self), np.nan)
        column = self.columns[name]
        out = np.asarray(column.values, dtype=np.float64)
        if column.present is not None:
            out = np.where(column.present, out, np.nan)
        known = field_of(self.topic, name)
        if known is None or not known.unit or "sigma" in name or not np.isfinite(known.high - known.low):
            return out
        width = known.high - known.low
        absurd = (out < known.low - width) | (out > known.high + width)
        return np.where(absurd, np.nan, out) if absurd.any() else out

    def valid(self, *names: str) -> BoolArray:
        """Tell where every named field is present and finite, shape (n,)."""
        mask = np.ones(len(self), dtype=bool)
        for name in names:
            mask &= np.isfinite(self.values(name))
        return mask

    def text(self, name: str) -> NDArray[np.str_]:
        """Text field, shape (n,), empty where absent; raises as :meth:`values`."""
        if name not in self.columns:
            self._absent(name)
            return np.full(len(self), "", dtype="U1")
        column = self.columns[name]
        texts = column.values.astype(np.str_, copy=False)
        return texts if column.mask.all() else np.where(column.mask, texts, "")

    def take(self, index: Any) -> Self:
        """The rows that ``index`` (slice, mask or positions) selects.

        A mask that selects all gives the table itself.
        """
        if isinstance(index, np.ndarray) and index.dtype == bool and len(index) == len(self) and index.all():
            return self
        return replace(
            self,
            time_ns=self.time_ns[index],
            columns={name: column.take(index) for name, column in self.columns.items()},
            record_index=self.record_index[index],
            device_time_ns=self.device_time_ns.take(index),
        )

    def trusted(self) -> Self:
        """Return the rows that the source itself trusts.

        They are called valid, of whole integrity, and not of alignment. Where the source says nothing, the row counts
        as trusted.
        """
        bad = (self.values("valid") == 0.0) | (self.values("integrity_ok") == 0.0) | (self.text("mode") == "align")
        return self.take(~bad) if bad.any() else self

    def unique_times(self) -> Self:
        """Return the table without repeated times.

        Among several samples of one time, the first present value of each field stays. Two messages of a log may give
        parts of one topic at the same time.
        """
        keep = np.ones(len(self), dtype=bool)
        keep[1:] = np.diff(self.time_ns) > 0
        if keep.all():
            return self
        first, group = np.flatnonzero(keep), np.cumsum(keep) - 1
        columns = {name: _first_present(column, first, group) for name, column in self.columns.items()}
        return replace(self.take(first), columns=columns)

    def to_frame(self) -> "pd.DataFrame":
        """Pandas frame of the columns, index ``time_ns`` (int64 nanoseconds).

        Types depend on the field alone, never on what a log lacks: floats stay floats (absent and NaN are NaN), bool
        is ``boolean``, integers are ``Int64`` and the like, text is ``string``; there absent is ``NA``.
        """
        import pandas as pd

        data: dict[str, Any] = {}
        for name, column in self.columns.items():
            absent, kind = ~column.mask, column.values.dtype.kind
            if kind == "f":
                filled = column.values.copy()
                filled[absent] = np.nan
                data[name] = filled
            elif kind == "b":
                data[name] = pd.arrays.BooleanArray(column.values.copy(), absent)
            elif kind in "iu":
                data[name] = pd.arrays.IntegerArray(column.values.copy(), absent)
            else:
                text = column.values.astype(object)
                text[absent] = pd.NA
                data[name] = pd.array(text, dtype="string")
        return pd.DataFrame(data, index=pd.Index(self.time_ns, name="time_ns"))


@dataclass(frozen=True, repr=False)
class TimedTable(Table):
    """A table that knows the flight's clock, so that its frame is indexed by time.

    Parameters
    ----------
    start_ns : int
        Corrected time of flight time zero.
    has_utc : bool
        True where corrected time is UTC.
    units : mapping of str to str
        Units by column, where the name or the log tells one; ``frame.attrs["units"]`` has them too.
    """

    start_ns: int = 0
    has_utc: bool = False
    units: Mapping[str, str] = field(default_factory=dict)

    @property
    def flight_time_s(self) -> FloatArray:
        """Seconds since the start of the flight, shape (n,)."""
        return (self.time_ns - self.start_ns) / NS_PER_S

    @property
    def utc(self) -> NDArray[np.datetime64]:
        """UTC of every row, datetime64[ns], shape (n,).

        Raises
        ------
        NotAssessableError
            When the flight has none.
        """
        if not self.has_utc:
            raise NotAssessableError(self.topic, "no UTC in this flight", "flight_time_s")
        return self.time_ns.astype("datetime64[ns]")

    def to_frame(self, index: Literal["auto", "utc", "flight_time"] = "auto") -> "pd.DataFrame":
        """Pandas frame as of :meth:`Table.to_frame`, indexed by time.

        Parameters
        ----------
        index : {'auto', 'utc', 'flight_time'}
            ``utc``: a DatetimeIndex in UTC; ``flight_time``: a TimedeltaIndex since the start of the flight; ``auto``:
            the first where the flight has UTC.

        Raises
        ------
        NotAssessableError
            When UTC is asked for and the flight has none.

        Examples
        --------
        >>> time_ns, nothing = np.array([5_000_000_000, 5_500_000_000]), Column(np.zeros(2))
        >>> table = TimedTable("baro", time_ns, {}, np.arange(2), nothing, start_ns=5_000_000_000)
        >>> table.to_frame().index.total_seconds().tolist()
        [0.0, 0.5]
        """
        import pandas as pd

        if index == "utc" and not self.has_utc:
            raise NotAssessableError(self.topic, "no UTC in this flight", "index='flight_time'")
        frame = super().to_frame()
        frame.attrs["units"] = dict(self.units)
        if index == "flight_time" or not self.has_utc:
            since = (self.time_ns - self.start_ns).astype("timedelta64[ns]")
            return frame.set_index(pd.TimedeltaIndex(since, name="flight_time"))
        return frame.set_index(pd.DatetimeIndex(self.time_ns.astype("datetime64[ns]"), tz="UTC", name="utc"))

    def to_xarray(self) -> Any:
        """Return the columns as an xarray Dataset over ``time``; absent numbers are NaN.

        ``time`` is UTC (datetime64[ns], no time zone) or, without UTC, time since the start of the flight
        (timedelta64[ns]); ``flight_time_s`` stands beside it. ``dataset["roll_deg"].attrs["units"]`` is the unit of a
        variable.

        Returns
        -------
        xarray.Dataset

        Raises
        ------
        UsageError
            When xarray is not installed.
        """
        if find_spec("xarray") is None:
            raise UsageError(f"table {self.topic}", "no package xarray", "", "pip install 'groundstation[xarray]'")
        import pandas as pd

        since = (self.time_ns - self.start_ns).astype("timedelta64[ns]")
        columns = {"flight_time_s": self.flight_time_s, **{name: self._plain(name) for name in self.columns}}
        times = pd.Index(self.utc if self.has_utc else since, name="time")
        dataset = pd.DataFrame(columns, index=times).to_xarray().set_coords("flight_time_s")
        for name, unit in {**self.units, "flight_time_s": "s"}.items():
            dataset[name].attrs["units"] = unit
        dataset.attrs |= {"topic": self.topic, "time": "UTC" if self.has_utc else "since the start of the flight"}
        return dataset

    def _plain(self, name: str) -> NDArray[Any]:
        """Return a column as it is; as float64 where a number is absent somewhere."""
        column = self.columns[name]
        if column.values.dtype.kind == "U":
            return self.text(name)
        return np.array(column.values) if bool(column.mask.all()) else np.where(column.mask, column.values, np.nan)


@dataclass(frozen=True, repr=False)
class Flight:
    """The tables of one flight on one clock.

    Parameters
    ----------
    tables : mapping of topic to Table
    metadata : mapping of str to str
        ``aircraft``, ``flight``, ``start_utc``, ``reference.parking_heading_deg`` and what the log says.
    start_ns : int
        Corrected time of the first sample of any topic: flight time zero.
    has_utc : bool
        True where corrected time is UTC; False means NOTIME: nanoseconds since the log's own zero.
    source_name : str
        Name of the log file, without folders.
    pauses : tuple of Pause
        Times in which nothing was logged, as the vehicle was disarmed, in order.
    end_ns : int, optional
        Corrected time of the last record that has no table: words and bytes as recorded.
    """

    tables: Mapping[str, Table]
    metadata: Mapping[str, str] = field(default_factory=dict)
    start_ns: int = 0
    has_utc: bool = False
    source_name: str = ""
    pauses: tuple[Pause, ...] = ()
    end_ns: int | None = None
    _made: dict[Hashable, Any] = field(default_factory=dict, init=False, compare=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "tables", MappingProxyType(dict(self.tables)))
        object.__setattr__(self, "metadata", MappingProxyType(dict(self.metadata)))

    def __contains__(self, topic: str) -> bool:
        return topic in self.tables

    def __getitem__(self, topic: str) -> Table:
        if topic not in self.tables:
            raise UnknownNameError(f"flight of {self.source_name or 'no log'}", topic, self.topics())
        return self.tables[topic]

    def __repr__(self) -> str:
        clock = "UTC" if self.has_utc else "no UTC"
        return f"<Flight {self.source_name}: {self.duration_s:.1f} s, {clock}, {_rows(self.tables)}>"

    def topics(self) -> tuple[str, ...]:
        """Topics in alphabetical order."""
        return tuple(sorted(self.tables))

    def once(self, key: Hashable, make: Callable[["Flight"], T]) -> T:
        """Return a function's result for the flight, computed once for each key."""
        if key not in self._made:
            self._made[key] = make(self)
        return cast(T, self._made[key])

    def without(self, kind: str) -> "Flight":
        """Return the flight without the topics of a kind; its clock stays as it is."""
        return replace(self, tables={name: one for name, one in self.tables.items() if kind_of(name) != kind})

    def seconds(self, time_ns: Int64Array) -> FloatArray:
        """Seconds since the start of the flight, float64, shape as ``time_ns``."""
        return (np.asarray(time_ns, dtype=np.int64) - self.start_ns) / NS_PER_S

    def time_s(self, topic: str) -> FloatArray:
        """Flight seconds of a topic's samples, shape (n,)."""
        return self.seconds(self.tables[topic].time_ns)

    @property
    def duration_s(self) -> float:
        """Seconds from the first to the last record of any topic."""
        ends = [int(table.time_ns[-1]) for table in self.tables.values() if len(table)]
        ends += [] if self.end_ns is None else [self.end_ns]
        return (max(ends) - self.start_ns) / NS_PER_S if ends else 0.0


def _first_present(column: Column, first: NDArray[np.intp], group: NDArray[np.intp]) -> Column:
    """Return the first present value of each group of rows; absent where there is none.

    ``first`` are the first rows of the groups.
    """
    if column.present is None:
        return column.take(first)
    rows = np.flatnonzero(column.present)
    groups, places = np.unique(group[rows], return_index=True)
    index = first.copy()
    index[groups] = rows[places]
    return column.take(index)


class Tables(Mapping[str, TimedTable]):
    """Tables of a flight by topic, each with the flight's clock.

    The error for an unknown topic lists similar names.
    """

    def __init__(self, flight: Flight) -> None:
        self._flight = flight
        self._tables = {topic: timed(flight, topic) for topic in flight.topics()}

    def __getitem__(self, topic: str) -> TimedTable:
        if topic not in self._tables:
            raise UnknownNameError("tables", topic, self._tables)
        return self._tables[topic]

    def __iter__(self) -> Iterator[str]:
        return iter(self._tables)

    def __len__(self) -> int:
        return len(self._tables)

    def __repr__(self) -> str:
        return f"<Tables of {self._flight.source_name}: {_rows(self._tables)}>"


def _rows(tables: Mapping[str, Table]) -> str:
    """Topics with their number of rows, canonical ones first, the rest counted."""
    shown = [topic for topic in sorted(tables) if is_canonical(topic)]
    told = [f"{topic} ({len(tables[topic])})" for topic in shown]
    others = len(tables) - len(shown)
    return ", ".join([*told, *([f"{others} raw topics"] if others else [])]) or "no topic"


def timed(flight: Flight, topic: str) -> TimedTable:
    """The table of a topic with the flight's clock."""
    table = flight[topic]
    named = {name: unit.spelled for name in table.columns if (unit := split_unit(name)[1]) is not None}
    return TimedTable(
        topic,
        table.time_ns,
        table.columns,
        table.record_index,
        table.device_time_ns,
        start_ns=flight.start_ns,
        has_utc=flight.has_utc,
        units=source_units(flight.metadata, topic, table.columns) if topic.startswith(RAW_PREFIX) else named,
    )
