"""SBET, the smoothed best estimate of trajectory of an INS with GNSS.

The file has records of 17 doubles and no header. Times are seconds of the GPS week. The file does not say which week: a
date in its name does (``sbet_20250708.out``), else the flight has no date. The accuracies stand in ``smrmsg_X.out``
beside ``sbet_X.out``, and are read along. Heading and velocity are those of a platform that a wander angle turns from
north; the positions tell which way.

Source: Applanix, POSPac MMS file formats (SBET, SMRMSG).
"""

import re
from collections.abc import Generator, Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from groundstation.base.angles import FloatArray, wrap_180, wrap_360
from groundstation.base.dataclasses import dataclass
from groundstation.base.errors import UnreadableLogError
from groundstation.base.geodesy import NO_POSITION, curvature_radii_m
from groundstation.base.records import MAX_BATCH_ROWS, Column, Damage, Int64Array, Item, LogHeader, RecordBatch, Remark
from groundstation.base.timescales import GPS_EPOCH_NS, gps_week_to_utc_ns, iso_to_utc_ns
from groundstation.base.units import ARCMIN_PER_DEG, DEG_PER_RAD, MPS2_PER_G, NS_PER_S
from groundstation.base.words import counted
from groundstation.readers.receiver.times import calendar_ns
from groundstation.readers.sbet_records import (
    ACCURACY,
    FEWEST,
    IN_A_ROW,
    RECORD,
    S_PER_WEEK,
    are_plausible,
    are_sound,
    has_place,
    next_start,
    unrolled_s,
)
from groundstation.readers.skipped import SkippedBytes, bytes_place
from groundstation.readers.source import Claim, Source

NAME = "sbet"
_LOOKED_AT, _JUDGED = 200, 4_096  # records
_DATE = re.compile(r"(?<!\d)(20\d\d)[-_.]?([01]\d)[-_.]?([0-3]\d)(?!\d)")
_PLACE = ("latitude_deg", "longitude_deg", "altitude_ellipsoid_m")
_MODE = "gnss_aided"
_MOST_APART_S = 5.0  # largest gap between two accuracies that is interpolated
_NS_PER_MS = 1_000_000
_SPECIFIC_FORCE = (0.8 * MPS2_PER_G, 1.2 * MPS2_PER_G)


@dataclass(frozen=True)
class _Sense:
    """Signs that the file does not state, found in its data.

    ``wander_sign`` turns heading and velocity back, ``force_sign`` makes the accelerations a specific force (0: they
    are without gravity).
    """

    wander_sign: int
    force_sign: int


def sniff(source: Source) -> Claim | None:
    """Claim a file whose records are consecutive places on Earth, as near as speeds say.

    Some hundred records are looked at on top, and of a longer file in its middle or at its end.
    """
    head = np.frombuffer(source.head, RECORD, min(len(source.head) // RECORD.itemsize, _LOOKED_AT))
    if len(head) < FEWEST or not are_plausible(head, has_no_place=True):
        return None
    whole = source.size // RECORD.itemsize
    if whole <= 2 * _LOOKED_AT:
        return Claim(NAME, confidence=0.6) if are_plausible(head) else None
    is_one = any(are_plausible(_records_at(source, first)) for first in (whole // 2, whole - _LOOKED_AT))
    return Claim(NAME, confidence=0.6) if is_one else None


def _records_at(source: Source, first: int) -> NDArray[Any]:
    """Read some records from number ``first`` on.

    Where damage has shifted them, they are read from the place where they begin again.
    """
    with source.open() as stream:
        stream.seek(first * RECORD.itemsize)
        data = stream.read(2 * _LOOKED_AT * RECORD.itemsize)
    start = 0
    if not are_plausible(np.frombuffer(data, RECORD, min(_LOOKED_AT, len(data) // RECORD.itemsize))):
        start = next_start(data, 1) or 0
    return np.frombuffer(data, RECORD, min(_LOOKED_AT, (len(data) - start) // RECORD.itemsize), start)


def read(source: Source) -> Iterator[Item]:
    """Yield the header, ``ins`` and ``raw.sbet``, remarks, and damage.

    A last record that was cut is damage.
    """
    head = np.frombuffer(source.head, RECORD, len(source.head) // RECORD.itemsize)
    if not len(head):
        raise UnreadableLogError(source.name, "less than one record", f"{RECORD.itemsize} bytes", "the file was cut")
    week, sense = _week_of(source.name, float(head["time"][0])), _sense_of(head[has_place(head)])
    accuracies = _accuracies(source.path)
    yield LogHeader(NAME, {"ins_kind": _MODE}, None if week is None else 0)
    yield from _remarks(week, sense, accuracies)
    walk, last_s, first, placeless = _Walk(source), np.zeros(0), 0, _Placeless()
    for records in walk:
        week_s = unrolled_s(np.concatenate((last_s, records["time"])))[len(last_s) :]
        last_s = week_s[-1:]
        is_placed = has_place(records)
        placeless.add(first, is_placed)
        yield from _batches(records, first, is_placed, _time(week, week_s), week_s, sense, accuracies)
        first += len(records)
    yield from placeless.damages()
    yield from walk.damages()


@dataclass
class _Placeless:
    """Records without a place: how many, the first and the last."""

    count: int = 0
    first: int = 0
    last: int = 0

    def add(self, first: int, is_placed: NDArray[np.bool_]) -> None:
        """Count the records without a place among some."""
        none = np.flatnonzero(~is_placed)
        if len(none):
            self.first = self.first if self.count else first + int(none[0])
            self.count, self.last = self.count + len(none), first + int(none[-1])

    def damages(self) -> Iterator[Damage]:
        """Yield one damage for all records without a place, if there are any."""
        if self.count:
            place = f"record {self.first}" if self.count == 1 else f"records {self.first} to {self.last}"
            yield Damage("no_position", place, self.count, NO_POSITION, "ins", loses_data=False)


class _Walk:
    """Iterator over the sound records of a file.

    After a damaged record the next one is searched for at every byte.
    """

    def __init__(self, source: Source) -> None:
        self._source, self._skipped = source, SkippedBytes("record")
        self._cut: tuple[int, int] | None = None
        self._count = self._skipped_to = 0

    def __iter__(self) -> Iterator[NDArray[Any]]:
        data, base = b"", 0
        with self._source.open() as stream:
            while content := stream.read(MAX_BATCH_ROWS * RECORD.itemsize):
                data += content
                done = yield from self._of(data, base)
                data, base = data[done:], base + done
        if data:
            self._finish(base, base + len(data))

    def damages(self) -> Iterator[Damage]:
        """Yield the bytes that belong to no record, and a last record that was cut."""
        yield from self._skipped.damages()
        if self._cut is not None:
            what = "bytes of a record that was cut"
            yield Damage("truncated", bytes_place(*self._cut), self._cut[1] - self._cut[0], what)

    def _of(self, data: bytes, base: int) -> Generator[NDArray[Any], None, int]:
        """Yield the records of the data at hand; return how many bytes are done."""
        at, origin, records = 0, 1, np.zeros(0, RECORD)
        while len(data) - at >= RECORD.itemsize:
            if (at - origin) % RECORD.itemsize or at >= origin + records.nbytes:  # places not judged already
                count = min((len(data) - at) // RECORD.itemsize, _JUDGED)
                origin, records = at, np.frombuffer(data, RECORD, count, at)
                damaged = np.append(np.flatnonzero(~are_sound(records)), len(records))
            first = (at - origin) // RECORD.itemsize
            count = int(damaged[np.searchsorted(damaged, first)]) - first
            for start in range(0, count, MAX_BATCH_ROWS):
                yield records[first + start : first + min(start + MAX_BATCH_ROWS, count)]
            self._count += count
            at += count * RECORD.itemsize
            if len(data) - at < RECORD.itemsize or first + count == len(records):
                continue
            found = next_start(data, at + 1)
            if found is None:  # the rest may begin a record that the next block ends
                tail = len(data) - (IN_A_ROW + 1) * RECORD.itemsize
                found = tail if at < tail else len(data)
            self._skipped.add(base + at, base + found, self._count)
            self._skipped_to = base + found
            at = found
        return at

    def _finish(self, start: int, end: int) -> None:
        if self._skipped_to == start:
            self._skipped.add(start, end, self._count)
        else:
            self._cut = start, end


def _week_of(name: str, first_s: float) -> int | None:
    """Return the GPS week by the date in the name of the file.

    It is the week of that day, or the one in which the first second lies.
    """
    match = _DATE.search(name)
    if match is None:
        return None
    parts: list[Int64Array] = [np.array([int(text)]) for text in match.groups()]
    midnight_ns, exists = calendar_ns(*parts)
    if not exists[0]:
        return None
    noon_s = (int(midnight_ns[0]) - GPS_EPOCH_NS) / NS_PER_S + 43_200.0
    return round((noon_s - first_s % S_PER_WEEK) / S_PER_WEEK)


def _time(week: int | None, week_s: FloatArray) -> Column:
    sound = np.isfinite(week_s) & (np.abs(week_s) < 1e9)
    ns = np.round(np.where(sound, week_s, 0.0) * 1e9).astype(np.int64)
    if week is not None:
        whole_ms, rest_ns = np.divmod(ns, _NS_PER_MS)
        ns = gps_week_to_utc_ns(week, whole_ms) + rest_ns
    return Column(ns, None if sound.all() else sound)


def _sense_of(records: NDArray[Any]) -> _Sense:
    """Find the signs by comparing velocities and accelerations with the first positions.

    Velocities are compared with the way between the first records, accelerations with gravity.
    """
    with np.errstate(all="ignore"):
        meridian, normal = curvature_radii_m(np.rad2deg(records["latitude"]))
        step_s = np.diff(records["time"])
        north = np.diff(records["latitude"]) * (meridian + records["altitude"])[1:] / step_s
        east = np.deg2rad(wrap_180(np.rad2deg(np.diff(records["longitude"]))))
        east = east * ((normal + records["altitude"]) * np.cos(records["latitude"]))[1:] / step_s
        misfits = {}
        for sign in (-1, 1, 0):
            told_north, told_east = _turned(records, sign)
            off = np.hypot(told_north[1:] - north, told_east[1:] - east)
            misfits[sign] = float(np.nanmedian(off)) if np.isfinite(off).any() else np.inf
        best = min(misfits, key=lambda sign: misfits[sign])
        force = np.sqrt(sum(np.square(records[f"{axis}_acceleration"]) for axis in "xyz"))
        is_force = _SPECIFIC_FORCE[0] < np.nanmedian(force) < _SPECIFIC_FORCE[1]
        force_sign = int(-np.sign(np.nanmedian(records["z_acceleration"]))) if is_force else 0
    return _Sense(-1 if misfits[-1] <= misfits[best] + 1e-9 else best, force_sign)


def _turned(records: NDArray[Any], wander_sign: int) -> tuple[FloatArray, FloatArray]:
    """Return the velocities north and east.

    The platform's x axis stands at ``wander_sign`` times the wander angle.
    """
    azimuth = wander_sign * records["wander_angle"]
    x, y = records["x_velocity"], records["y_velocity"]
    return x * np.cos(azimuth) - y * np.sin(azimuth), x * np.sin(azimuth) + y * np.cos(azimuth)


def _batches(
    records: NDArray[Any],
    first: int,
    is_placed: NDArray[np.bool_],
    time: Column,
    week_s: FloatArray,
    sense: _Sense,
    accuracies: NDArray[Any],
) -> Iterator[RecordBatch]:
    index = np.arange(first, first + len(records), dtype=np.int64)
    with np.errstate(invalid="ignore", over="ignore"):
        north, east = _turned(records, sense.wander_sign)
        heading = records["platform_heading"] + sense.wander_sign * records["wander_angle"]
        columns = {
            "latitude_deg": records["latitude"] * DEG_PER_RAD,
            "longitude_deg": records["longitude"] * DEG_PER_RAD,
            "altitude_ellipsoid_m": records["altitude"].copy(),
            "velocity_north_mps": north,
            "velocity_east_mps": east,
            "velocity_down_mps": records["z_velocity"].copy(),
            "roll_deg": records["roll"] * DEG_PER_RAD,
            "pitch_deg": records["pitch"] * DEG_PER_RAD,
            "true_heading_deg": wrap_360(heading * DEG_PER_RAD),
        }
        columns |= {f"rate_{axis}_dps": records[f"{axis}_rate"] * DEG_PER_RAD for axis in "xyz"}
        if sense.force_sign:
            columns |= {f"accel_{axis}_mps2": sense.force_sign * records[f"{axis}_acceleration"] for axis in "xyz"}
    found = {name: Column(values) for name, values in columns.items()} | _sigmas(week_s, accuracies)
    if not is_placed.all():
        found |= {name: Column(found[name].values, is_placed) for name in _PLACE}
    found["mode"] = Column(np.full(len(records), _MODE))
    yield RecordBatch("ins", index, time, found)
    raw = {name: Column(records[name].copy()) for name in RECORD.names or () if name != "time"}
    yield RecordBatch("raw.sbet", index, time, raw)


def accuracies_beside(path: Path) -> Path | None:
    """Return the path where the accuracies of an SBET would stand.

    None where the file's name does not begin with ``sbet``.
    """
    name, is_sbet = re.subn(r"(?i)^sbet", "smrmsg", path.name)
    return path.with_name(name) if is_sbet else None


def _accuracies(path: Path) -> NDArray[Any]:
    """Read the accuracies beside an SBET; none where there is no such file."""
    beside = accuracies_beside(path)
    if beside is None:
        return np.zeros(0, ACCURACY)
    try:
        content = beside.read_bytes() if beside.stat().st_size < 1 << 28 else b""
    except OSError:
        return np.zeros(0, ACCURACY)
    records = np.frombuffer(content, ACCURACY, len(content) // ACCURACY.itemsize)
    sound = np.logical_and.reduce(
        [np.isfinite(records[name]) & (records[name] >= 0.0) for name in ACCURACY.names or ()]
    )
    records = records[sound]
    return records[np.append(True, np.diff(records["time"]) > 0.0)] if len(records) else records


def _sigmas(week_s: FloatArray, accuracies: NDArray[Any]) -> dict[str, Column]:
    """Interpolate accuracies to the times of the records, between two that are near."""
    if len(accuracies) < 2:
        return {}
    times = unrolled_s(accuracies["time"])
    after = np.clip(np.searchsorted(times, week_s), 1, len(times) - 1)
    present = (times[after] - times[after - 1] <= _MOST_APART_S) & (week_s >= times[0]) & (week_s <= times[-1])

    def at(*names: str) -> Column:
        size = np.sqrt(sum(np.square(accuracies[name]) for name in names))
        return Column(np.interp(week_s, times, size), present)

    found = {
        "horizontal_sigma_m": at("north_m", "east_m"),
        "vertical_sigma_m": at("down_m"),
        "velocity_sigma_mps": at("north_mps", "east_mps"),
    }
    for name, source in (("roll", "roll"), ("pitch", "pitch"), ("true_heading", "heading")):
        column = at(f"{source}_arcmin")
        found[f"{name}_sigma_deg"] = Column(column.values / ARCMIN_PER_DEG, present)
    return found


def _remarks(week: int | None, sense: _Sense, accuracies: NDArray[Any]) -> Iterator[Remark]:
    if week is None:
        text = (
            "times are seconds of a GPS week that the file does not name: the flight has no date; put the date in the "
            "name of the file (sbet_20250708.out) to give it one"
        )
        yield Remark("week_unknown", text)
    else:
        first = iso_to_utc_ns("1980-01-06T00:00:00Z")[0] + week * S_PER_WEEK * NS_PER_S
        day = np.datetime64(first, "ns").astype("datetime64[D]")
        yield Remark("assumed", f"GPS week {week} (from {day} on) by the date in the name of the file")
    turned = {-1: "less", 1: "plus", 0: "without"}[sense.wander_sign]
    text = f"true heading is the platform's {turned} the wander angle, velocities likewise: so they fit the positions"
    yield Remark("converted", text, "ins", ("true_heading_deg", "velocity_north_mps", "velocity_east_mps"))
    if not sense.force_sign:
        text = "accelerations are without gravity, no specific force: they stay raw"
        yield Remark("mapped", text, "ins")
    if len(accuracies):
        yield Remark(
            "mapped", f"accuracies from the smrmsg file beside it ({counted(len(accuracies), 'record')})", "ins"
        )
