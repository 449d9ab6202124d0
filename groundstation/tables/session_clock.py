"""One clock for the logs of a session.

It is UTC where that can be trusted, otherwise the link's times of transmission. A pseudo-range is the time of arrival
on the receiver's clock less the time of transmission on the sender's, in metres. So log time - pseudo-range / c - time
of transmission is how far the clock of a log stands from that of the link. It is constant while nothing leaps; a leap
of the log's clock is a step of it.

It ignores the drift of a recorder's clock between two leaps (20 ppm are 72 ms in an hour), and a delay that the
recorder has for the link and not for the INS.
"""

from collections.abc import Mapping, Sequence

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.dataclasses import dataclass
from groundstation.base.records import BoolArray, Int64Array, frozen
from groundstation.base.signals import topics_of_kind
from groundstation.base.units import LIGHT_MPS, NS_PER_S
from groundstation.tables.table import Flight, Table

WINDOW = 9  # rows of the running median that leaps are seen in
MOST_LINK_S = 4e9  # later than that is no time


@dataclass(frozen=True)
class LogClock:
    """Offset of the clock of one log from that of the link, per stretch between its leaps.

    Parameters
    ----------
    rows : int
        Ranges with a time of transmission; without any there is no stretch.
    first_record, last_record : ndarrays of int64, shape (m,)
        Places in the log of the first and the last range of each stretch.
    offset_ns : ndarray of int64, shape (m,)
        Log time less link time: the median of the stretch.
    stretch_rows : ndarray of int64, shape (m,)
    """

    rows: int
    first_record: Int64Array
    last_record: Int64Array
    offset_ns: Int64Array
    stretch_rows: Int64Array

    def __post_init__(self) -> None:
        for name in ("first_record", "last_record", "offset_ns", "stretch_rows"):
            object.__setattr__(self, name, frozen(getattr(self, name)))

    def stretch_of(self, record_index: Int64Array) -> Int64Array:
        """Return the stretch of rows of the log; rows before the first range belong to the first."""
        place = np.searchsorted(self.first_record, record_index, side="right") - 1
        return np.asarray(np.clip(place, 0, None), dtype=np.int64)

    def is_certain(self, record_index: Int64Array) -> BoolArray:
        """Tell which rows are not between two stretches.

        Nothing tells on which side of the leap the others are.
        """
        if len(self.first_record) < 2:
            return np.ones(len(record_index), dtype=bool)
        stretch = self.stretch_of(record_index)
        is_last = stretch == len(self.first_record) - 1
        return np.asarray(is_last | (record_index <= self.last_record[stretch]))

    @property
    def main_offset_ns(self) -> int:
        """Offset of the longest stretch."""
        return int(self.offset_ns[int(np.argmax(self.stretch_rows))])


@dataclass(frozen=True)
class LogOffset:
    """Time to take off the times of a log so that they are those of the session.

    Parameters
    ----------
    clock : LogClock
    residual_ns : ndarray of int64, shape (m,)
        Offset of the clock of each stretch from that of the group; empty without ranges.
    shift_ns : ndarray of int64, shape (m or 1,)
        Nanoseconds taken off.
    """

    clock: LogClock
    residual_ns: Int64Array
    shift_ns: Int64Array

    def time_ns(self, table: Table) -> Int64Array:
        """Times of a table on the session's clock."""
        if len(self.shift_ns) == 1:
            return np.asarray(table.time_ns - self.shift_ns[0])
        return np.asarray(table.time_ns - self.shift_ns[self.clock.stretch_of(table.record_index)])


def transmission_ns(table: Table) -> tuple[Int64Array, BoolArray]:
    """Times of transmission of a link topic on the link's clock, and where there are any."""
    time_s = table.values("transmission_time_s")
    known = np.isfinite(time_s) & (np.abs(time_s) < MOST_LINK_S)
    return np.rint(np.where(known, time_s, 0.0) * NS_PER_S).astype(np.int64), known


def travel_ns(pseudorange_m: FloatArray) -> Int64Array:
    """Time that a signal takes for a pseudo-range; 0 where there is none."""
    known = np.isfinite(pseudorange_m) & (np.abs(pseudorange_m) < LIGHT_MPS)
    return np.rint(np.where(known, pseudorange_m, 0.0) / LIGHT_MPS * NS_PER_S).astype(np.int64)


def clock_of(flight: Flight, leap_s: float) -> LogClock:
    """Compare the clock of a log with the link's; see the module.

    Parameters
    ----------
    flight : Flight
    leap_s : float
        A step of the offset beyond this is a leap.
    """
    records, offsets = [], []
    for topic in topics_of_kind("link", flight.topics()):
        table = flight[topic]
        sent_ns, known = transmission_ns(table)
        read = table.values("pseudorange_m")
        known &= np.isfinite(read)
        offsets.append((table.time_ns - travel_ns(read) - sent_ns)[known])
        records.append(table.record_index[known])
    none = np.zeros(0, dtype=np.int64)
    record, offset = (np.concatenate(parts) if parts else none for parts in (records, offsets))
    if not len(record):
        return LogClock(0, none, none, none, none)
    order = np.argsort(record, kind="stable")
    record, offset = record[order], offset[order]
    leap_ns = int(leap_s * NS_PER_S)
    starts = np.concatenate([[0], np.flatnonzero(np.abs(np.diff(_running_median(offset))) > leap_ns) + 1])
    parts = np.split(offset, starts[1:])
    middles = np.array([_median(part) for part in parts], dtype=np.int64)
    rows = np.array([len(part) for part in parts], dtype=np.int64)
    lasts = np.concatenate([starts[1:], [len(record)]]) - 1
    return LogClock(len(record), record[starts], record[lasts], middles, rows)


def _median(values: Int64Array) -> int:
    """Return the median without floats: UTC in nanoseconds has more digits than float64."""
    return int(np.sort(values)[len(values) // 2])


def _running_median(values: Int64Array) -> Int64Array:
    window = min(WINDOW, len(values) - (len(values) + 1) % 2)
    half = window // 2
    padded = np.pad(values, half, mode="edge")
    return np.asarray(np.sort(np.lib.stride_tricks.sliding_window_view(padded, window), axis=1)[:, half])


def group_offset_ns(clocks: Sequence[LogClock], limit_s: float) -> tuple[int, int]:
    """Return the offset that most clocks share, and how many share it.

    In a tie the first one counts. Clocks without ranges do not count.

    Examples
    --------
    >>> one = lambda offset: LogClock(5, np.array([0]), np.array([9]), np.array([offset]), np.array([5]))
    >>> group_offset_ns([one(7), one(604800 * 10**9), one(9)], 0.25)
    (9, 2)
    """
    offsets = np.array([clock.main_offset_ns for clock in clocks if clock.rows], dtype=np.int64)
    if not len(offsets):
        return 0, 0
    near = np.abs(offsets[:, None] - offsets[None, :]) <= int(limit_s * NS_PER_S)
    best = int(np.argmax(near.sum(axis=1)))
    return _median(offsets[near[best]]), int(near[best].sum())


def place_logs(flights: Mapping[str, Flight], limit_s: float) -> tuple[dict[str, LogOffset], int, int]:
    """Place logs on one clock: that of UTC where any has it, else the link's.

    Parameters
    ----------
    flights : mapping of name to Flight
    limit_s : float
        A log in UTC that is nearer to the group is left as it is: such a difference may be a delay of its recorder.

    Returns
    -------
    dict of str to PlacedLog
        Without the logs that nothing places: no UTC, and no times of transmission.
    int, int
        Session time less link time in nanoseconds, and how many logs share it.
    """
    clocks = {name: clock_of(flight, limit_s) for name, flight in flights.items()}
    group_ns, agreeing = group_offset_ns([clocks[name] for name, one in flights.items() if one.has_utc], limit_s)
    some_utc = any(flight.has_utc for flight in flights.values())
    placed = {}
    for name, flight in flights.items():
        clock = clocks[name]
        residual = clock.offset_ns - group_ns
        if not clock.rows:
            if flight.has_utc or (not some_utc and len(flights) == 1):
                placed[name] = LogOffset(clock, residual, np.zeros(1, dtype=np.int64))
            continue
        if some_utc and not agreeing and not flight.has_utc:
            continue  # UTC without a time of transmission beside a log that has those alone
        is_near = np.abs(residual) <= int(limit_s * NS_PER_S)
        shift = np.where(is_near, 0, residual) if flight.has_utc else residual
        placed[name] = LogOffset(clock, residual, shift)
    return placed, group_ns, agreeing
