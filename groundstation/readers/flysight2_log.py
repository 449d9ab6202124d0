"""Rows of a FlySight 2 by the names of their records.

Each row has the name of its record in front, and a ``$COL`` line above names the columns of each record. Fixes become
``gnss``, pressures ``baro``. The other records are kept as ``raw.flysight.<record>``: no source tells where the axes of
the unit point. ``record_index`` is the line number in the file (from 1).
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import field
from itertools import islice
from typing import Any

import numpy as np

from groundstation.base import arrow_values as arrow
from groundstation.base.atmosphere import pressure_altitude_m
from groundstation.base.dataclasses import dataclass
from groundstation.base.geodesy import NO_POSITION
from groundstation.base.records import Column, Int64Array, Item, LogHeader, RecordBatch, Remark, UtcReadings
from groundstation.base.timescales import gps_week_to_utc_ns
from groundstation.readers import cells
from groundstation.readers.cells import TableCells
from groundstation.readers.losses import Losses
from groundstation.readers.places import placed
from groundstation.readers.source import Source
from groundstation.readers.start import told_at_zero

RAW = "raw.flysight"
LOOKED_AT = 1 << 16  # bytes of the head
LINES = 20_000  # read at a time
_LONGEST_LINE, _MOST_CELLS = 1 << 12, 200
_VARIABLES = {"FIRMWARE_VER": "firmware", "DEVICE_ID": "serial_number", "SESSION_ID": "session_id"}
_FIXES, _PRESSURES, _WEEKS = "GNSS", "BARO", "TIME"
# Column of a fix -> field, and the unit that it must have.
_FIELDS: Mapping[str, tuple[str, str]] = {
    "lat": ("latitude_deg", "deg"),
    "lon": ("longitude_deg", "deg"),
    "hMSL": ("altitude_msl_m", "m"),
    "velN": ("velocity_north_mps", "m/s"),
    "velE": ("velocity_east_mps", "m/s"),
    "velD": ("velocity_down_mps", "m/s"),
    "hAcc": ("horizontal_sigma_m", "m"),
    "vAcc": ("vertical_sigma_m", "m"),
    "sAcc": ("velocity_sigma_mps", "m/s"),
    "numSV": ("satellites_used", ""),
}


@dataclass(frozen=True)
class _Kind:
    """Columns of a record, and their units: empty where none is told."""

    names: tuple[str, ...]
    units: tuple[str, ...] = ()

    def is_in(self, at: int, unit: str) -> bool:
        """Tell whether a column is in a unit, or names none."""
        told = self.units[at] if at < len(self.units) else ""
        return told in ("", unit)


@dataclass
class _Log:
    """State of a file up to a line: its records, what is no number, what was lost."""

    kinds: dict[str, _Kind] = field(default_factory=dict)
    metadata: dict[str, str] = field(default_factory=dict)
    is_text: dict[tuple[str, str], bool] = field(default_factory=dict)
    losses: Losses = field(default_factory=Losses)
    zero_ns: int = 0  # UTC of the counter's zero
    has_counter: bool = True  # the counter's zero is known, or all rows are on it

    def take(self, line: str) -> None:
        """Take a line that tells of the rows below it."""
        word, *rest = (cell.strip() for cell in line.split(","))
        if word == "$VAR" and len(rest) > 1 and rest[0] in _VARIABLES:
            self.metadata.setdefault(_VARIABLES[rest[0]], rest[1][:200])
        elif word == "$COL" and 1 < len(rest) <= _MOST_CELLS:
            self.kinds[rest[0]] = _Kind(tuple(rest[1:]))
        elif word == "$UNIT" and len(rest) > 1 and rest[0] in self.kinds:
            self.kinds[rest[0]] = _Kind(self.kinds[rest[0]].names, tuple(rest[1 : _MOST_CELLS + 1]))


def items_of(source: Source, name: str) -> Iterator[Item]:
    """Yield the header, fixes, pressures, other records, remarks and damage."""
    log = _Log()
    for line in source.head[:LOOKED_AT].decode("utf-8", errors="replace").split("$DATA")[0].splitlines():
        log.take(line)
    header, remarks = _with_clock(source, log, name)
    yield header
    yield from remarks
    for lines in _pieces(source):
        yield from _batches(lines, log)
    yield from log.losses.damages()


def _with_clock(source: Source, log: _Log, name: str) -> tuple[LogHeader, list[Remark]]:
    """Return the header with UTC of the counter's zero, as the rows of GPS weeks tell it."""
    header = LogHeader(name, log.metadata, 0)
    if _FIXES in log.kinds and log.kinds.keys() == {_FIXES}:
        return header, []
    lines, counter_ns, utc_ns = _weeks(source, log)
    if not len(lines):
        log.has_counter = _FIXES not in log.kinds
        text = f"no row tells the GPS week: the rows of the sensors have no {'absolute ' * log.has_counter}time"
        return LogHeader(name, log.metadata, None if log.has_counter else 0), [Remark("no_utc", text)]
    found = told_at_zero(utc_ns, counter_ns)
    log.zero_ns = found.ns
    readings = UtcReadings(lines, utc_ns - counter_ns)
    header = LogHeader(name, log.metadata, found.ns, has_counting_clock=True, utc_readings=readings)
    return header, list(found.remarks("the GPS week of the rows"))


def _weeks(source: Source, log: _Log) -> tuple[Int64Array, Int64Array, Int64Array]:
    """Return line numbers, counter and UTC of the rows of GPS weeks."""
    rows = [row for lines in _pieces(source) for row in lines if row[1].startswith(f"${_WEEKS},")]
    kind, words = log.kinds.get(_WEEKS), [line.split(",")[1:] for _number, line, _ended in rows]
    nothing = np.zeros(0, dtype=np.int64)
    if kind is None or not {"time", "tow", "week"} <= set(kind.names):
        return nothing, nothing, nothing
    whole = [at for at, row in enumerate(words) if len(row) == len(kind.names)]
    columns = [[words[at][kind.names.index(name)] for at in whole] for name in ("time", "tow", "week")]
    counter, second = (cells.decimal_ns(_texts(column)) for column in columns[:2])
    week = cells.numbers(_texts(columns[2])).column
    number = np.where(week.mask & np.isfinite(week.values), week.values, -1.0)
    use = counter.column.mask & second.column.mask & (second.column.values >= 0) & (number >= 0) & (number < 10_000)
    whole_ms, rest_ns = np.divmod(second.column.values[use], 1_000_000)
    utc_ns = gps_week_to_utc_ns(number[use].astype(np.int64), whole_ms) + rest_ns
    lines = np.array([rows[at][0] for at in whole], dtype=np.int64)
    return lines[use], counter.column.values[use], utc_ns


def _texts(column: Sequence[str]) -> Any:
    return cells.trimmed(arrow.texts(column))


def _pieces(source: Source) -> Iterator[list[tuple[int, str, bool]]]:
    """Yield lines with their numbers and whether they are ended, a bounded number at a time."""
    with source.open() as stream:
        numbered = enumerate(iter(lambda: stream.readline(_LONGEST_LINE), b""), start=1)
        while piece := list(islice(numbered, LINES)):
            yield [
                (number, line.decode("utf-8", errors="replace").strip("\r\n\ufeff"), line.endswith(b"\n"))
                for number, line in piece
            ]


def _batches(lines: Sequence[tuple[int, str, bool]], log: _Log) -> Iterator[RecordBatch]:
    rows: dict[str, list[tuple[int, list[str]]]] = {}
    broken, cut, unnamed = list[int](), list[int](), list[int]()
    for number, line, is_ended in lines:
        if line.startswith(("$VAR,", "$COL,", "$UNIT,")):
            yield from _of_rows(rows, log)
            rows.clear()
            log.take(line)
            continue
        word, *rest = line.split(",")
        kind = log.kinds.get(word[1:]) if word[:1] == "$" else None
        if kind is None:
            is_other = not line.strip() or word in ("$FLYS", "$DATA")
            unnamed += [] if is_other else [number]
        elif not is_ended:
            cut.append(number)
        elif len(rest) != len(kind.names):
            broken.append(number)
        else:
            rows.setdefault(word[1:], []).append((number, rest))
    losses = log.losses
    losses.add("dropped_rows", "rows with another number of cells than their record has", _numbers(broken))
    losses.add("dropped_rows", "rows of no record that a $COL line names", _numbers(unnamed))
    losses.add("truncated", "row cut by the end of the file", _numbers(cut))
    yield from _of_rows(rows, log)


def _of_rows(rows: Mapping[str, Sequence[tuple[int, list[str]]]], log: _Log) -> Iterator[RecordBatch]:
    for name, found in rows.items():
        yield from _of_kind(name, log.kinds[name], found, log)


def _numbers(found: Sequence[int]) -> Int64Array:
    return np.array(found, dtype=np.int64)


def _of_kind(name: str, kind: _Kind, rows: Sequence[tuple[int, list[str]]], log: _Log) -> Iterator[RecordBatch]:
    """Yield the batches of one record: a canonical one, and what is left of its columns."""
    index = _numbers([number for number, _cells in rows])
    by_column = zip(*(row for _number, row in rows), strict=True)
    columns = {one: _texts(column) for one, column in zip(kind.names, by_column, strict=True)}
    when = _times(name, columns.pop("time", None), index, log)
    if name == _FIXES:
        taken = [
            one
            for at, one in enumerate(kind.names)
            if one in columns and one in _FIELDS and kind.is_in(at, _FIELDS[one][1])
        ]
        fields = {_FIELDS[one][0]: _read(name, one, columns.pop(one), index, log) for one in taken}
        fields, nowhere = placed("gnss", fields)
        log.losses.add("no_position", NO_POSITION, index[nowhere], topic="gnss", loses_data=False)
        yield from _batch("gnss", index, when, fields)
    elif name == _PRESSURES and "pressure" in columns and kind.is_in(kind.names.index("pressure"), "Pa"):
        pressure = _read(name, "pressure", columns.pop("pressure"), index, log)
        altitude_m, is_refused = pressure_altitude_m(pressure.values)
        log.losses.add(
            "unreadable_cells",
            "pressures that cannot be",
            index[is_refused & pressure.mask],
            where=f"{name} pressure",
        )
        altitude = Column(altitude_m, pressure.mask & ~is_refused)
        yield from _batch("baro", index, when, {"pressure_altitude_m": altitude})
    raw = {one: _read(name, one, text, index, log) for one, text in columns.items() if one}
    yield from _batch(f"{RAW}.{name}", index, when, raw)


def _times(name: str, text: Any, index: Int64Array, log: _Log) -> Column:
    """Return times on the counter of the unit: those of fixes are UTC."""
    if text is None or (name != _FIXES and not log.has_counter):
        return Column(np.zeros(len(index), dtype=np.int64), np.zeros(len(index), dtype=bool))
    if name != _FIXES:
        return _kept(cells.decimal_ns(text), name, "time", index, log)
    read = _kept(cells.iso_ns(text)[0], name, "time", index, log)
    return Column(np.where(read.mask, read.values - log.zero_ns, 0), read.mask)


def _read(name: str, column: str, text: Any, index: Int64Array, log: _Log) -> Column:
    """Return a column of numbers, or of text where its first cells are none."""
    is_field = column in _FIELDS if name == _FIXES else (name, column) == (_PRESSURES, "pressure")
    if not is_field and log.is_text.setdefault((name, column), not cells.are_numbers(text)):
        return _kept(cells.words(text), name, column, index, log)
    return _kept(cells.numbers(text), name, column, index, log)


def _kept(read: TableCells, name: str, column: str, index: Int64Array, log: _Log) -> Column:
    log.losses.add("unreadable_cells", "cells that cannot be read", index[read.unreadable], where=f"{name} {column}")
    return read.column


def _batch(topic: str, index: Int64Array, when: Column, columns: Mapping[str, Column]) -> Iterator[RecordBatch]:
    """Yield the rows that have any value."""
    if not columns:
        return
    use = np.logical_or.reduce([one.mask for one in columns.values()])
    if use.any():
        yield RecordBatch(topic, index[use], _some(when, use), {name: _some(one, use) for name, one in columns.items()})


def _some(column: Column, use: np.ndarray) -> Column:
    return Column(column.values[use], column.mask[use])
