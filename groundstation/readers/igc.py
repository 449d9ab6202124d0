"""IGC flight records of gliders and paragliders: fixes with pressure and GNSS altitude.

``record_index`` is the line number in the file (from 1). B records give the fixes; what the I record adds to them is
kept as text under ``raw.igc``. E records are events.

Source: FAI Gliding Commission, Technical Specification for IGC-Approved GNSS Flight Recorders, annex A.
"""

import re
from collections.abc import Iterator, Sequence
from dataclasses import field
from datetime import datetime
from itertools import islice
from typing import NamedTuple

import numpy as np

from groundstation.base.dataclasses import dataclass
from groundstation.base.geodesy import NO_POSITION
from groundstation.base.records import Column, Int64Array, Item, LogHeader, RecordBatch, Remark
from groundstation.base.signals import EVENT_SEPARATOR
from groundstation.base.units import NS_PER_S
from groundstation.readers.days import DayCount
from groundstation.readers.losses import Losses
from groundstation.readers.places import placed
from groundstation.readers.source import Claim, Source

NAME = "igc"
RAW = "raw.igc"
LINES = 20_000  # read at a time
_LOOKED_AT = 1 << 16
_LONGEST_LINE, _MOST_ADDED = 1 << 12, 50
_MAKER = re.compile(rb"\A(?:\xef\xbb\xbf)?A[A-Z0-9]{3}")
_DATE = re.compile(r"HFDTE(?:DATE:)?\s*(\d\d)(\d\d)(\d\d)")
_FIX = re.compile(r"B(\d\d)(\d\d)(\d\d)(\d\d)(\d{5})([NS])(\d{3})(\d{5})([EW])([AV])(-\d{4}|\d{5})(-\d{4}|\d{5})")
_A_FIX = re.compile(rb"^B\d{13}[NS]\d{8}[EW][AV]", re.MULTILINE)
_EVENT = re.compile(r"E(\d\d)(\d\d)(\d\d)([A-Z0-9]{3})(.*)")
_ADDED = re.compile(r"(\d\d)(\d\d)([A-Z0-9]{3})")
_HEAD = {"GTY": "aircraft_type", "GID": "aircraft", "FTY": "recorder", "RFW": "firmware", "GPS": "receiver"}
_FIXES = {"A": "3d", "V": "2d"}
_CENTURY = 80  # two digits of a year from here on are of the last century: GPS began in 1980


class _Fix(NamedTuple):
    line: int
    second: int
    latitude_deg: float
    longitude_deg: float
    fix: str
    pressure_altitude_m: float
    altitude_m: float
    added: tuple[str, ...]


@dataclass
class _Record:
    """State of the file up to a line: its columns, the day, what was lost."""

    added: tuple[tuple[str, int, int], ...] = ()
    days: DayCount = field(default_factory=DayCount)
    losses: Losses = field(default_factory=Losses)


def sniff(source: Source) -> Claim | None:
    """Claim a file that begins with a maker's code and has a fix near its beginning."""
    head = source.head[:_LOOKED_AT]
    is_one = bool(_MAKER.match(head)) and bool(_A_FIX.search(head.replace(b"\r", b"\n")))
    return Claim(NAME) if is_one else None


def read(source: Source) -> Iterator[Item]:
    """Yield the header, fixes, events, remarks and damage."""
    record = _Record()
    metadata, day_ns, is_above_sea = _head(source)
    yield LogHeader(NAME, metadata, None if day_ns is None else 0)
    yield from _remarks(day_ns, is_above_sea)
    for lines in _pieces(source):
        fixes, events = _read_lines(lines, record)
        yield from _batches(fixes, events, record, day_ns or 0, altitude_name(is_above_sea))
    yield from record.losses.damages()


def altitude_name(is_above_sea: bool | None) -> str:
    """Return the field of the GNSS altitude; None: the file does not say which it is."""
    return "altitude_msl_m" if is_above_sea else "altitude_ellipsoid_m"


def _head(source: Source) -> tuple[dict[str, str], int | None, bool | None]:
    """Return metadata, the beginning of the day, and whether GNSS altitudes are above the sea."""
    metadata: dict[str, str] = {}
    day_ns: int | None = None
    is_above_sea: bool | None = None
    for line in source.head.decode("utf-8", errors="replace").splitlines():
        if line[:1] == "H" and (name := _HEAD.get(line[2:5])):
            told = line.partition(":")[2].strip()
            metadata |= {name: told[:200]} if told else {}
        if line[2:5] == "ALG":
            is_above_sea = "GEO" in line.upper()
        if day_ns is None and (found := _DATE.match(line)):
            day_ns = _day_ns(*map(int, found.groups()))
    return metadata, day_ns, is_above_sea


def _day_ns(day: int, month: int, year: int) -> int | None:
    try:
        moment = datetime(year + (1900 if year >= _CENTURY else 2000), month, day)
    except ValueError:
        return None
    return (moment - datetime(1970, 1, 1)).days * 86_400 * NS_PER_S


def _remarks(day_ns: int | None, is_above_sea: bool | None) -> Iterator[Remark]:
    if day_ns is None:
        yield Remark("no_date", "no date (HFDTE): the flight has no absolute time")
    if is_above_sea is None:
        text = "the file does not say what its GNSS altitudes are above: taken as above the ellipsoid, as IGC has it"
        yield Remark("assumed", text, "gnss", ("altitude_ellipsoid_m",))


def _pieces(source: Source) -> Iterator[list[tuple[int, str]]]:
    """Yield lines with their numbers, a bounded number at a time."""
    with source.open() as stream:
        numbered = enumerate(iter(lambda: stream.readline(_LONGEST_LINE), b""), start=1)
        while piece := list(islice(numbered, LINES)):
            yield [(number, line.decode("utf-8", errors="replace").strip("\r\n\ufeff")) for number, line in piece]


def _read_lines(lines: Sequence[tuple[int, str]], record: _Record) -> tuple[list[_Fix], list[tuple[int, int, str]]]:
    """Return the fixes and the events of some lines: line, second of the day, name."""
    fixes, events, broken = list[_Fix](), list[tuple[int, int, str]](), list[int]()
    for number, line in lines:
        kind = line[:1]
        if kind == "B":
            fix = _fix(number, line, record.added)
            fixes += [fix] if fix is not None else []
            broken += [number] if fix is None else []
        elif kind == "I":
            found = _ADDED.findall(line[3:])[:_MOST_ADDED]
            record.added = tuple((name, int(first) - 1, int(end)) for first, end, name in found)
        elif kind == "E" and (event := _EVENT.match(line)):
            second = _second(*map(int, event.groups()[:3]))
            name = f"{event[4]} {event[5].strip()}".strip().replace(EVENT_SEPARATOR.strip(), ";")[:200]
            events += [(number, second, name)] if second is not None else []
    record.losses.add("dropped_rows", "B records that cannot be read", np.array(broken, dtype=np.int64))
    return fixes, events


def _second(hour: int, minute: int, second: int) -> int | None:
    return hour * 3600 + minute * 60 + second if hour < 24 and minute < 60 and second < 61 else None


def _fix(number: int, line: str, added: Sequence[tuple[str, int, int]]) -> _Fix | None:
    found = _FIX.match(line)
    if found is None:
        return None
    hour, minute, second, north, north_min, side, east, east_min, other, fix, pressure, height = found.groups()
    latitude = int(north) + int(north_min) / 60_000.0
    longitude = int(east) + int(east_min) / 60_000.0
    of_day = _second(int(hour), int(minute), int(second))
    if of_day is None or latitude > 90.0 or longitude > 180.0:
        return None
    words = tuple(line[first:end].strip() for _name, first, end in added)
    place = (-latitude if side == "S" else latitude, -longitude if other == "W" else longitude)
    return _Fix(number, of_day, *place, _FIXES[fix], float(pressure), float(height), words)


def _batches(
    fixes: Sequence[_Fix], events: Sequence[tuple[int, int, str]], record: _Record, day_ns: int, altitude: str
) -> Iterator[RecordBatch]:
    if not fixes and not events:
        return
    order = sorted([(one.line, one.second) for one in fixes] + [(line, second) for line, second, _name in events])
    seconds_ns = np.array([second for _line, second in order], dtype=np.int64) * NS_PER_S
    times_ns = seconds_ns + record.days.days_ns(seconds_ns, np.ones(len(order), dtype=bool)) + day_ns
    at = dict(zip((line for line, _second in order), times_ns.tolist(), strict=True))
    if fixes:
        index = np.array([one.line for one in fixes], dtype=np.int64)
        when = Column(np.array([at[one.line] for one in fixes], dtype=np.int64))
        yield from _of_fixes(fixes, index, when, record, altitude)
    if events:
        index = np.array([line for line, _second, _name in events], dtype=np.int64)
        when = Column(np.array([at[line] for line, _second, _name in events], dtype=np.int64))
        yield RecordBatch("event", index, when, {"name": Column(np.array([one[2] for one in events], dtype=np.str_))})


def _of_fixes(
    fixes: Sequence[_Fix], index: Int64Array, when: Column, record: _Record, altitude: str
) -> Iterator[RecordBatch]:
    height = np.array([one.altitude_m for one in fixes])
    is_3d = np.array([one.fix == "3d" for one in fixes])
    columns = {
        "latitude_deg": Column(np.array([one.latitude_deg for one in fixes])),
        "longitude_deg": Column(np.array([one.longitude_deg for one in fixes])),
        altitude: Column(height, is_3d | (height != 0.0)),
        "fix": Column(np.array([one.fix for one in fixes], dtype=np.str_)),
    }
    words = _words(fixes, record)
    if "SIU" in words:
        known = np.array([word.isdecimal() for word in words["SIU"]])
        count = np.array([float(word) if word.isdecimal() else np.nan for word in words["SIU"]])
        columns["satellites_used"] = Column(count, known)
    found, nowhere = placed("gnss", columns)
    record.losses.add("no_position", NO_POSITION, index[nowhere], topic="gnss", loses_data=False)
    yield RecordBatch("gnss", index, when, found)
    pressure = np.array([one.pressure_altitude_m for one in fixes])
    yield RecordBatch("baro", index, when, {"pressure_altitude_m": Column(pressure)})
    if words:
        raw = {name: np.array(told, dtype=np.str_) for name, told in words.items()}
        yield RecordBatch(RAW, index, when, {name: Column(told, told != "") for name, told in raw.items()})


def _words(fixes: Sequence[_Fix], record: _Record) -> dict[str, list[str]]:
    """Return what the I record adds to each fix, by its code."""
    return {
        name: [one.added[number] if number < len(one.added) else "" for one in fixes]
        for number, (name, _first, _end) in enumerate(record.added)
    }
