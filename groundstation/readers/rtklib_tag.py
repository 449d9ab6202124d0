"""Time tags of RTKLIB: the host's clock against bytes of a log, in a file ``LOG.tag``.

A stream of a device without absolute time that RTKLIB wrote gets UTC by it. The stamps of the host scatter by the
steps of its timer and come late by the line to the device; a straight line through them follows the device's clock.

Source: RTKLIB 2.4.3 (demo5), src/stream.c, openfile_ and writefile: 64 bytes of text with the tick of the start at
their end, the start as seconds since 1970 in GPS time (4 bytes, and 8 of fraction), then for each write the ticks
since the start (milliseconds, 4 bytes) and the length of the log behind it (4 or 8 bytes); little-endian.
"""

import struct
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from groundstation.base.dataclasses import dataclass
from groundstation.base.records import Column, Int64Array, Remark
from groundstation.base.timescales import gps_to_utc_ns
from groundstation.base.units import NS_PER_S
from groundstation.readers.dialect import Dialect
from groundstation.readers.layout import TableLayout
from groundstation.readers.sections import TableSection
from groundstation.readers.source import Source

FloatArray = NDArray[np.float64]

MARK = b"TIMETAG RTKLIB"
_HEAD, _START = 64, struct.Struct("<Id")
_PIECE_BYTES = 1 << 22
FEWEST = 10  # writes of the host that tell the clock
OUTLYING = 3.0  # standard deviations
MOST_DRIFT, MOST_SCATTER_S = 1e-3, 0.2  # of a device's clock, and of the stamps: more is another log's
MOST_SECONDS = 4e9  # a start outside is none


@dataclass(frozen=True)
class TimeTag:
    """Writes of a host.

    Parameters
    ----------
    start_gps_ns : int
        Since 1970, as date and time of GPS time.
    ticks_ms : ndarray of int64, shape (n,)
        Since the start, at each write.
    lengths : ndarray of int64, shape (n,)
        Bytes of the log behind each write.
    """

    start_gps_ns: int
    ticks_ms: Int64Array
    lengths: Int64Array


@dataclass(frozen=True)
class TaggedClock:
    """Relation of a device's clock to UTC.

    Parameters
    ----------
    utc_of_zero_ns : int
    middle_ns : int
        Device time at which ``utc_of_zero_ns`` applies exactly.
    drift : float
        Seconds of the host for a second of the device, less 1.
    scatter_s : float
        Standard deviation of the host's stamps about the line.
    """

    utc_of_zero_ns: int
    middle_ns: int
    drift: float
    scatter_s: float

    def validity_ns(self, device_ns: Int64Array) -> Int64Array:
        """Return device times without the drift of the device's clock."""
        return np.asarray(device_ns + np.rint(self.drift * (device_ns - self.middle_ns)).astype(np.int64))

    @property
    def remark(self) -> Remark:
        """Remark on the clock, for people."""
        text = f"UTC by the RTKLIB time tag: the host's stamps scatter by {1e3 * self.scatter_s:.1f} ms"
        side = "slow" if self.drift > 0.0 else "fast"
        return Remark("time_tag", f"{text}, the device's clock is {1e6 * abs(self.drift):.0f} ppm {side}")


def tag_of(content: bytes) -> TimeTag | None:
    """Return the writes in a time tag; None where it is none, or has too few.

    Examples
    --------
    >>> head = MARK.ljust(_HEAD, b"\\0") + _START.pack(1_752_003_261, 0.5)
    >>> tag_of(head + struct.pack("<6I", 131, 37, 146, 99, 162, 180))  # three writes: too few
    >>> tag = tag_of(head + struct.pack("<20I", *(at for k in range(10) for at in (131 + 10 * k, 40 * (k + 1)))))
    >>> tag.start_gps_ns, int(tag.ticks_ms[0]), int(tag.lengths[-1])
    (1752003261500000000, 131, 400)
    """
    if not content.startswith(MARK) or len(content) < _HEAD + _START.size:
        return None
    seconds, fraction = _START.unpack_from(content, _HEAD)
    if not (0.0 <= fraction < 1.0 and seconds < MOST_SECONDS):
        return None
    start_ns = seconds * NS_PER_S + round(fraction * NS_PER_S)
    for kind in ("<u4", "<u8"):
        record = np.dtype([("tick", "<u4"), ("length", kind)])
        count = (len(content) - _HEAD - _START.size) // record.itemsize
        records = np.frombuffer(content, record, count, _HEAD + _START.size)
        ticks, lengths = records["tick"].astype(np.int64), records["length"].astype(np.int64)
        if count >= FEWEST and (np.diff(ticks) >= 0).all() and (np.diff(lengths) >= 0).all():
            return TimeTag(start_ns, ticks, lengths)
    return None


def beside(source: Source) -> Path:
    """Return the path at which RTKLIB puts the time tag of a log."""
    return source.path.with_name(source.path.name + ".tag")


def has_tag(source: Source) -> bool:
    """Tell whether a time tag of RTKLIB stands beside a log."""
    path = beside(source)
    try:
        return path.is_file() and tag_of(path.read_bytes()) is not None
    except OSError:
        return False


def clock_by_tag(source: Source, dialect: Dialect, layout: TableLayout) -> tuple[TaggedClock | None, list[Remark]]:
    """Return the clock of a table's rows by the time tag beside it, and remarks.

    None where there is no tag, or one of another log. A log whose line ends were made shorter since it was written is
    understood: the bytes are counted as they were.
    """
    path = beside(source)
    tag = tag_of(path.read_bytes()) if path.is_file() else None
    if tag is None:
        why = "is no time tag of RTKLIB" if path.is_file() else "is not there"
        return None, [Remark("time_tag", f"{path.name} {why}: no absolute time by it")]
    lines, device_ns = _times(source, dialect, layout)
    clock = _fitted(tag, _row_ends(source, tag)[lines - 1], device_ns) if len(lines) else None
    if clock is None:
        return None, [Remark("time_tag", f"{path.name} does not fit {source.name}: no absolute time by it")]
    return clock, [clock.remark]


def _times(source: Source, dialect: Dialect, layout: TableLayout) -> tuple[Int64Array, Int64Array]:
    """Return line numbers and device times of the rows that have one."""
    from groundstation.readers.table_reader import all_times

    found: list[tuple[Int64Array, Column]] = list(all_times(source, TableSection(dialect, layout)))
    lines = [numbers[time.mask] for numbers, time in found]
    times = [time.values[time.mask].astype(np.int64) for _numbers, time in found]
    nothing = np.zeros(0, dtype=np.int64)
    return np.concatenate([nothing, *lines]), np.concatenate([nothing, *times])


def _row_ends(source: Source, tag: TimeTag) -> Int64Array:
    """Return the byte behind each line, as the log was written."""
    ends: list[Int64Array] = []
    base, has_return = 0, b"\r\n" in source.head
    with source.open() as stream:
        while data := stream.read(_PIECE_BYTES):
            ends.append(np.flatnonzero(np.frombuffer(data, dtype=np.uint8) == ord("\n")) + base + 1)
            base += len(data)
    behind = np.concatenate([*ends, np.array([base + 1])])  # the last row may have no end
    longer = behind + np.arange(1, len(behind) + 1)
    last = int(tag.lengths[-1])
    return longer if not has_return and abs(int(longer[-2:][0]) - last) < abs(int(behind[-2:][0]) - last) else behind


def _fitted(tag: TimeTag, row_ends: Int64Array, device_ns: Int64Array) -> TaggedClock | None:
    """Return the line of the host's clock against the device's; None where there is none."""
    write = np.searchsorted(tag.lengths, row_ends)
    known = (write < len(tag.ticks_ms)) & (device_ns < np.iinfo(np.int64).max // 4)
    if np.count_nonzero(known) < FEWEST:
        return None
    device, host_ms = device_ns[known], tag.ticks_ms[write[known]]
    middle_ns = int(np.median(device))
    x, y = (device - middle_ns) / NS_PER_S, host_ms / 1e3 - (device - device[0]) / NS_PER_S
    keep = np.abs(y - np.median(y)) < max(10.0 * float(np.median(np.abs(y - np.median(y)))), 1.0)
    for _ in range(3):
        if np.count_nonzero(keep) < FEWEST or np.ptp(x[keep]) <= 0.0:
            return None
        slope, level = _line(x[keep], y[keep])
        residual = y - (level + slope * x)
        scatter_s = float(np.std(residual[keep]))
        keep = np.abs(residual) <= OUTLYING * max(scatter_s, 1e-3)
    if abs(slope) > MOST_DRIFT or scatter_s > MOST_SCATTER_S:
        return None
    host_gps_ns = tag.start_gps_ns + round(level * NS_PER_S) + middle_ns - int(device[0])
    utc_ns = int(gps_to_utc_ns(np.array([host_gps_ns]))[0])
    return TaggedClock(utc_ns - middle_ns, middle_ns, slope, scatter_s)


def _line(x: FloatArray, y: FloatArray) -> tuple[float, float]:
    """Return slope and level at 0 of the least squares line."""
    centre = float(np.mean(x))
    slope = float(np.sum((x - centre) * (y - np.mean(y))) / np.sum((x - centre) ** 2))
    return slope, float(np.mean(y)) - slope * centre
