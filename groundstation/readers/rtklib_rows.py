"""Rows of an RTKLIB solution: as the file has them, and as a GNSS receiver's."""

import io
import re
from collections.abc import Iterator, Sequence
from itertools import groupby
from typing import TYPE_CHECKING, Any, BinaryIO

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.dataclasses import dataclass
from groundstation.base.ecef import ecef_from_n, ecef_m, geodetic_deg_m
from groundstation.base.errors import UnreadableLogError
from groundstation.base.geodesy import NO_POSITION
from groundstation.base.records import Column, Item, LogHeader, RecordBatch, Remark
from groundstation.base.timescales import gps_to_utc_ns, gps_week_to_utc_ns
from groundstation.base.units import NS_PER_S
from groundstation.readers.dialect import Dialect
from groundstation.readers.layout import LayoutRule, TableLayout, TimeRule
from groundstation.readers.losses import Losses
from groundstation.readers.places import placed
from groundstation.readers.rtklib_header import Form, Governed, form_of, forms_of
from groundstation.readers.sections import TableSection
from groundstation.readers.source import Source

if TYPE_CHECKING:
    from _typeshed import WriteableBuffer

RAW = "raw.pos"
_PARTING = re.compile(rb"[ \t]+(?:[,;][ \t]*)?|[,;][ \t]*")
_TOUCHING = re.compile(rb"(?<=[0-9.])(?=[-+][0-9.])")
_OF_NO_ROW = re.compile(rb"(?m)^\t?%[^\n]*|^\t|\t?\r?$")  # parts to drop of lines whose cells are separated by tabs
_PLUS, _MINUS, _POINT, _DIGITS_FROM, _DIGITS_TO = b"+-.09"
_FIXES = np.array(["none", "rtk_fixed", "rtk_float", "dgnss", "dgnss", "3d", "ppp", "dead_reckoning"])
_CORRECTED = (1, 2, 3, 4)  # fixed, float, SBAS, DGPS: solutions by corrections, which have an age
_JST_NS = 9 * 3_600 * NS_PER_S
_PIECE_BYTES, _LONGEST_LINE = 1 << 20, 1 << 16
_CALENDAR = TimeRule("local", (0, 1), ("date", "time"), date_formats=("%Y/%m/%d",))


def items(source: Source, reader: str) -> Iterator[Item]:
    """Yield the header, rows as ``raw.pos`` and as ``gnss``, remarks and damage."""
    first = form_of(source)
    if first is None:
        raise UnreadableLogError(source.name, "no line of names", "%  GPST latitude(deg) ... of RTKLIB")
    governed, left = forms_of(source, first)
    yield LogHeader(reader, first.form.metadata, 0)
    yield from dict.fromkeys(_remarks(governed))
    losses = Losses()
    for _names, group in groupby(governed, key=lambda one: (one.form.names, one.form.has_week)):
        yield from _rows(source, list(group), losses)
    yield from losses.damages()
    if left is not None:
        yield left


def _rows(source: Source, governed: Sequence[Governed], losses: Losses) -> Iterator[Item]:
    """Yield the rows below headers that name the same columns."""
    from groundstation.readers.table_reader import TableReader

    form, first = governed[0].form, governed[0]
    time = TimeRule("seconds", (1,), ("tow",)) if form.has_week else _CALENDAR
    rules = [LayoutRule(at, RAW, name, "double") for at, name in enumerate(form.names) if at >= 2]
    rules += [LayoutRule(0, RAW, "week", "double")] if form.has_week else []
    dialect = Dialect("utf-8", "\t", len(form.names), 0, first.first_line)
    table = TableReader(
        _Tabbed(source.path, source, first.first_byte, governed[-1].end_byte),
        [TableSection(dialect, TableLayout(time, tuple(rules)))],
    )
    found = table.items(LogHeader(RAW))
    next(found)
    lines = np.array([one.first_line for one in governed])
    for item in found:
        if not isinstance(item, RecordBatch):
            yield item
            continue
        ends = np.searchsorted(item.record_index, lines[1:])
        for start, end, one in zip((0, *ends), (*ends, len(item)), governed, strict=True):
            if end > start:
                batch = _in_utc(item if end - start == len(item) else item.take(slice(start, end)), one.form)
                yield batch
                gnss = _gnss(batch, one.form, losses)
                if gnss is not None:
                    yield gnss


class _Tabs(io.RawIOBase):
    """Rows of a file with one tab between cells; lines stay lines.

    At most ``left`` bytes of the file are read.
    """

    def __init__(self, stream: BinaryIO, left: int | None) -> None:
        self._stream, self._left, self._rest, self._ready = stream, left, b"", b""

    def readable(self) -> bool:
        return True

    def seekable(self) -> bool:
        return True

    def seek(self, offset: int, whence: int = 0) -> int:
        """Return 0 without moving: the rows are read once, from the first on."""
        return 0

    def close(self) -> None:
        self._stream.close()
        super().close()

    def readinto(self, buffer: "WriteableBuffer") -> int:
        view = memoryview(buffer).cast("B")
        while not self._ready:
            data = self._stream.read(_PIECE_BYTES if self._left is None else min(_PIECE_BYTES, self._left))
            if self._left is not None:
                self._left -= len(data)
            whole = self._rest + data
            end = whole.rfind(b"\n") + 1 if data and len(self._rest) < _LONGEST_LINE else len(whole)
            self._rest, self._ready = whole[end:], _OF_NO_ROW.sub(b"", _PARTING.sub(b"\t", _parted(whole[:end])))
            if not data:
                break
        count = min(len(view), len(self._ready))
        view[:count], self._ready = self._ready[:count], self._ready[count:]
        return count


def _parted(rows: bytes) -> bytes:
    """Insert a tab between numbers that touch: where a sign follows a digit.

    Examples
    --------
    >>> _parted(b"40.086179918-105.206044414 1.0e-5 -0.1")
    b'40.086179918\\t-105.206044414 1.0e-5 -0.1'
    """
    content = np.frombuffer(rows, dtype=np.uint8)
    signs = np.flatnonzero((content == _MINUS) | (content == _PLUS))
    before = content[signs[signs > 0] - 1]
    if not (((before >= _DIGITS_FROM) & (before <= _DIGITS_TO)) | (before == _POINT)).any():
        return rows
    return _TOUCHING.sub(b"\t", rows)


@dataclass(frozen=True)
class _Tabbed(Source):
    """Another source with tabs between cells, from ``first_byte`` to ``end_byte``.

    ``end_byte`` None is the end of the file.
    """

    whole: Source
    first_byte: int
    end_byte: int | None

    @property
    def head(self) -> bytes:
        """Head of the whole file."""
        return self.whole.head

    def open(self) -> BinaryIO:
        """Open the rows, from the first on."""
        stream = self.whole.open()
        stream.seek(self.first_byte)
        return io.BufferedReader(_Tabs(stream, None if self.end_byte is None else self.end_byte - self.first_byte))


def _in_utc(batch: RecordBatch, form: Form) -> RecordBatch:
    time = batch.device_time_ns
    present = time.mask
    if form.has_week:
        week = batch.columns["week"]
        present = present & week.mask & (np.abs(week.values) < 1e4)
        whole_ms, rest_ns = np.divmod(time.values, 1_000_000)
        gps_week = np.where(present, week.values, 0.0).astype(np.int64)
        utc_ns = gps_week_to_utc_ns(gps_week, whole_ms) + rest_ns
    elif form.scale == "GPST":
        utc_ns = gps_to_utc_ns(time.values)
    else:
        utc_ns = time.values - (_JST_NS if form.scale == "JST" else 0)
    when = Column(np.where(present, utc_ns, 0), None if present.all() else present)
    return RecordBatch(batch.topic, batch.record_index, when, batch.columns)


def _gnss(batch: RecordBatch, form: Form, losses: Losses) -> RecordBatch | None:
    """Return the canonical row of each solution."""
    columns = _Cells(batch)
    found = _placed(_position(columns, form), batch, losses)
    if "Q" in columns:
        quality = columns["Q"]
        known = quality.mask & (quality.values >= 0) & (quality.values < len(_FIXES))
        found["fix"] = Column(_FIXES[np.where(known, quality.values, 0).astype(np.int64)], known)
        if "age" in columns:
            age, corrected = columns["age"], known & np.isin(quality.values, _CORRECTED)
            found["age_of_corrections_s"] = Column(age.values, age.mask & corrected & (age.values >= 0.0))
    if "ns" in columns:
        found["satellites_used"] = columns["ns"]
    rows = np.logical_or.reduce([column.mask for column in found.values()]) if found else np.zeros(len(batch), bool)
    batch = RecordBatch("gnss", batch.record_index, batch.device_time_ns, found)
    return None if not rows.any() else batch if rows.all() else batch.take(rows)


def _placed(found: dict[str, Column], batch: RecordBatch, losses: Losses) -> dict[str, Column]:
    """Columns without the rows that have no place."""
    found, zeros = placed("gnss", found)
    losses.add("no_position", NO_POSITION, batch.record_index[zeros], topic="gnss", loses_data=False)
    return found


class _Cells(dict[str, Column]):
    """Columns of a batch by RTKLIB's name."""

    def __init__(self, batch: RecordBatch) -> None:
        super().__init__(batch.columns)

    def vector(self, *names: str) -> tuple[FloatArray, Any] | None:
        """Return three columns as (n, 3), and where all are present; None if one is missing."""
        if not all(name in self for name in names):
            return None
        parts = [self[name] for name in names]
        return np.stack([part.values for part in parts], axis=-1), np.logical_and.reduce([part.mask for part in parts])

    def spread(self, one: str, other: str) -> Column | None:
        """Root of the sum of two variances."""
        if one not in self or other not in self:
            return None
        return Column(np.hypot(self[one].values, self[other].values), self[one].mask & self[other].mask)


def _position(columns: _Cells, form: Form) -> dict[str, Column]:
    for name in ("latitude", "longitude"):
        if all(f"{name}_{part}" in columns for part in ("deg", "min", "s")):
            columns[name] = _of_minutes(columns, name)
    if "latitude" in columns:
        places = ("latitude", "longitude")  # damage may have taken one of the names
        found = {f"{name}_deg": columns[name] for name in places if name in columns}
        heights = "altitude_msl_m" if form.heights == "geodetic" else "altitude_ellipsoid_m"
        found |= {heights: columns["height"]} if "height" in columns else {}
        velocity = columns.vector("vn", "ve", "vu")
        return found | _sigmas(columns, "n", "e", "u") | _velocities(velocity)
    return _of_vectors(columns, form)


def _of_minutes(columns: _Cells, name: str) -> Column:
    degrees, minutes, seconds = (columns[f"{name}_{part}"] for part in ("deg", "min", "s"))
    size = np.abs(degrees.values) + minutes.values / 60.0 + seconds.values / 3600.0
    return Column(np.copysign(size, degrees.values), degrees.mask & minutes.mask & seconds.mask)


def _of_vectors(columns: _Cells, form: Form) -> dict[str, Column]:
    """Return positions in ECEF, or east, north, up of a base station with a known place."""
    ecef, baseline = (
        columns.vector("x-ecef", "y-ecef", "z-ecef"),
        columns.vector("e-baseline", "n-baseline", "u-baseline"),
    )
    if ecef is not None:
        position_m, present = ecef
    elif baseline is not None and form.reference is not None:
        enu_m, present = baseline
        axes = ecef_from_n(*form.reference[:2])
        position_m = ecef_m(*form.reference) + (enu_m[:, [1, 0, 2]] * (1.0, 1.0, -1.0)) @ axes.T
    else:
        return {}
    with np.errstate(invalid="ignore", over="ignore"):
        latitude, longitude, height = geodetic_deg_m(np.where(present[:, None], position_m, 1.0))
    found = {
        "latitude_deg": Column(latitude, present),
        "longitude_deg": Column(longitude, present),
        "altitude_ellipsoid_m": Column(height, present),
    }
    velocity = columns.vector("vx", "vy", "vz") if ecef is not None else columns.vector("vn", "ve", "vu")
    if ecef is not None and velocity is not None:
        ned = np.einsum("nij,ni->nj", ecef_from_n(latitude, longitude), velocity[0])
        velocity = ned * (1.0, 1.0, -1.0), velocity[1] & present
    return found | (_sigmas(columns, "n", "e", "u") if ecef is None else {}) | _velocities(velocity)


def _sigmas(columns: _Cells, *axes: str) -> dict[str, Column]:
    north, east, up = (f"sd{axis}" for axis in axes)
    found = {"horizontal_sigma_m": columns.spread(north, east), "velocity_sigma_mps": columns.spread("sdvn", "sdve")}
    single = {"vertical_sigma_m": up, "position_north_sigma_m": north, "position_east_sigma_m": east}
    single |= {f"velocity_{name}_sigma_mps": f"sdv{name[0]}" for name in ("north", "east")}
    single["velocity_down_sigma_mps"] = "sdvu"
    found |= {name: columns[source] for name, source in single.items() if source in columns}
    return {name: column for name, column in found.items() if column is not None}


def _velocities(velocity: tuple[FloatArray, Any] | None) -> dict[str, Column]:
    """Velocities from north, east, up."""
    if velocity is None:
        return {}
    (north, east, up), present = velocity[0].T, velocity[1]
    return {
        "velocity_north_mps": Column(north, present),
        "velocity_east_mps": Column(east, present),
        "velocity_down_mps": Column(-up, present),
    }


def _remarks(governed: Sequence[Governed]) -> Iterator[Remark]:
    for one in governed[1:]:
        form = one.form
        text = f"a header above row {one.first_line} governs the rows below it: times in {form.scale}"
        yield Remark("second_header", f"{text}, {', '.join(form.names[2:5])}")
    for form in (one.form for one in governed):
        if form.scale == "GPST":
            yield Remark("converted", "times are GPS time: UTC is less the leap seconds of the day", "gnss")
        elif form.scale == "JST":
            yield Remark("converted", "times are Japan's: UTC is 9 h less", "gnss")
        if "latitude" in form.names or "latitude_deg" in form.names:
            if not form.heights:
                text = (
                    "the file does not say above what its heights are: taken as above the ellipsoid, RTKLIB's default"
                )
                yield Remark("assumed", text, "gnss", ("altitude_ellipsoid_m",))
        elif "e-baseline" in form.names and form.reference is None:
            text = "baselines from a base station whose place the file does not tell: no position"
            yield Remark("no_position", text)
