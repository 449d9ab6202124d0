"""Consecutive logs of one flight: their ends, and which one continues another."""

import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from math import hypot
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from groundstation.base.errors import GroundstationError
from groundstation.base.geodesy import north_east_m
from groundstation.base.records import Int64Array, Item, RecordBatch
from groundstation.base.signals import topics_of_kind
from groundstation.base.units import NS_PER_S
from groundstation.pipeline.one_flight.log import Log, digest_of
from groundstation.results.manifest import PartOfRun
from groundstation.tables.table import Flight, Table

if TYPE_CHECKING:
    from groundstation.readers.source import Source as LogFile

LONGEST_GAP_S, LATE_S = 10.0, 3.0  # between two parts; by how much a record of the second may be older than the first's
NEAR_M, FASTEST_MPS = 100.0, 350.0
_HEAD_BYTES, _LOOKED_AT = 1 << 20, 1 << 18  # of a part with definitions, and of one without them
_NUMBER = re.compile(r"\d+|(?<=[._-])(?!gz$)[a-z]{2}$")  # what differs: a number, or the ending that `split` gives
_PLACES = ("latitude_deg", "longitude_deg")


def part_of(log: Log, path: str, reader: str, flight: Flight) -> PartOfRun:
    """Return beginning and end of a converted log.

    Parameters
    ----------
    log : Log
    path : str
        As manifests tell it.
    reader : str
        Who read it.
    flight : Flight
        Its tables.
    """
    source, tables = log.source, [table for table in flight.tables.values() if len(table)]
    ends_ns = flight.start_ns, flight.start_ns + round(flight.duration_s * NS_PER_S)
    zeros_ns = [_zero_ns(tables, at) for at in (0, -1)]
    return PartOfRun(
        path,
        source.name,
        source.sha256,
        source.size_bytes,
        reader,
        aircraft=flight.metadata.get("aircraft", ""),
        flight=flight.metadata.get("flight", ""),
        rows=sum(map(len, tables)),
        utc_ns=ends_ns if flight.has_utc else None,
        device_ns=(ends_ns[0] - zeros_ns[0], ends_ns[1] - zeros_ns[1]),
        places_deg=_places(flight),
    )


def _zero_ns(tables: Iterable[Table], at: int) -> int:
    """Return corrected time minus the device's own at one end, the median of the topics."""
    zeros = [
        int(table.time_ns[at] - table.device_time_ns.values[at]) for table in tables if table.device_time_ns.mask[at]
    ]
    return sorted(zeros)[len(zeros) // 2] if zeros else 0


def _places(flight: Flight) -> tuple[tuple[float, float], ...]:
    """Return latitude and longitude at both ends, of the first topic that tells them."""
    for topic in (*topics_of_kind("gnss", flight.topics()), *topics_of_kind("ins", flight.topics())):
        table = flight[topic]
        if not all(name in table for name in _PLACES):
            continue
        rows = np.flatnonzero(table.columns[_PLACES[0]].mask & table.columns[_PLACES[1]].mask)
        if len(rows):
            ends = ((float(table.columns[name].values[row]) for name in _PLACES) for row in rows[[0, -1]])
            return tuple((latitude, longitude) for latitude, longitude in ends)
    return ()


def goes_on(before: PartOfRun, behind: PartOfRun, *, is_beside: bool) -> bool:
    """Tell whether a log continues another one.

    Parameters
    ----------
    is_beside : bool
        Their files stand beside each other in a folder, and their names differ in a number alone.
    """
    names = (before.aircraft, behind.aircraft), (before.flight, behind.flight)
    if before.reader != behind.reader or any(one != other and one and other for one, other in names):
        return False
    is_named = all(names[0]) and before.utc_ns is not None and behind.utc_ns is not None
    in_one_folder = Path(before.path).parent == Path(behind.path).parent
    has_utc = before.utc_ns is not None and behind.utc_ns is not None and names[0][0] == names[0][1]
    if not (is_beside or is_named or (has_utc and in_one_folder)):
        return False
    gap_s = gap_ns(before, behind) / NS_PER_S
    return -LATE_S <= gap_s < LONGEST_GAP_S and _is_near(before, behind, gap_s)


def gap_ns(before: PartOfRun, behind: PartOfRun) -> int:
    """Return the time from the last record of a log to the first of another.

    The clock is UTC where both have it, else the device's.
    """
    if before.utc_ns is not None and behind.utc_ns is not None:
        return behind.utc_ns[0] - before.utc_ns[1]
    return behind.device_ns[0] - before.device_ns[1]


def _is_near(before: PartOfRun, behind: PartOfRun, gap_s: float) -> bool:
    """Tell whether a log begins at the place where another one ended.

    True where one of them has no position.
    """
    if not before.places_deg or not behind.places_deg:
        return True
    north_m, east_m = north_east_m(*behind.places_deg[0], *before.places_deg[-1])
    return hypot(float(north_m), float(east_m)) <= NEAR_M + FASTEST_MPS * (abs(gap_s) + 1.0)


def family(name: str) -> str:
    """Return the common part of the names of consecutive files.

    Examples
    --------
    >>> family("log_07.bin"), family("x.csv.ab"), family("a1.csv.gz")
    ('log_#.bin', 'x.csv.#', 'a#.csv.gz')
    """
    return _NUMBER.sub("#", name.lower())


def order_of(name: str) -> tuple[tuple[int, int | str], ...]:
    """Return the sort key of a name in which numbers count as numbers.

    Examples
    --------
    >>> sorted(["b10", "b9", "a"], key=order_of)
    ['a', 'b9', 'b10']
    """
    parts = re.split(r"(\d+)", name.lower())
    return tuple((1, int(part)) if part.isdecimal() else (0, part) for part in parts if part)


def behind_it(log: Log, before: PartOfRun, path: Path) -> PartOfRun | None:
    """Return the span of a file that cannot be read alone, on the clock of the log before it.

    The span is that of the device's clock. Its first and last bytes are read behind the beginning of the log, which has
    what they lack: a header, definitions. None where they are not of the same recording.

    Parameters
    ----------
    log : Log
        The first part, which can be read.
    before : PartOfRun
        The part right before the file.
    """
    from groundstation.readers.joined import BytesSource
    from groundstation.readers.source import Source as LogFile

    file, first = LogFile(path), LogFile(log.path)
    try:
        head = first.head[:_HEAD_BYTES]
        own = _last_index(log, BytesSource(log.path, head))
        times = [
            np.concatenate([*_times(log, BytesSource(log.path, head + part), own), np.zeros(0, np.int64)])
            for part in (file.head[:_LOOKED_AT], _tail(file))
        ]
        sha256, size = digest_of(path), file.size
    except (GroundstationError, OSError):
        return None
    if not len(times[0]) or not len(times[1]):
        return None
    device_ns = int(np.median(times[0][:3])), int(times[1][-1])
    zero_ns = None if before.utc_ns is None else before.utc_ns[1] - before.device_ns[1]
    utc_ns = None if zero_ns is None else (device_ns[0] + zero_ns, device_ns[1] + zero_ns)
    return replace(
        before,
        path=str(path.absolute()),
        name=path.name,
        sha256=sha256,
        size_bytes=size,
        rows=0,
        utc_ns=utc_ns,
        device_ns=device_ns,
        places_deg=(),
    )


def _tail(file: "LogFile") -> bytes:
    """Return the last bytes of a file."""
    with file.open() as stream:
        stream.seek(max(0, file.size - _LOOKED_AT))
        return stream.read()


def _read(log: Log, source: "LogFile") -> Iterator[Item]:
    from groundstation.readers.registry import read

    return read(source, log.profile, log.loaded_icds)


def _last_index(log: Log, source: "LogFile") -> int:
    """Return the index of the last record in some bytes."""
    return max((int(item.record_index[-1]) for item in _read(log, source) if isinstance(item, RecordBatch)), default=-1)


def _times(log: Log, source: "LogFile", own: int) -> Sequence[Int64Array]:
    """Return device times of the records after record ``own`` in some bytes, in order."""
    index, time = [], []
    for item in _read(log, source):
        if isinstance(item, RecordBatch):
            rows = (item.record_index > own + 1) & item.device_time_ns.mask  # the next one may have been cut
            index.append(item.record_index[rows])
            time.append(item.device_time_ns.values[rows])
    if not index:
        return ()
    return (np.concatenate(time)[np.argsort(np.concatenate(index), kind="stable")],)
