"""Compiled loop over the bytes of a log: it finds its records and the bytes of none.

A record is ``A3 95 id`` and as many bytes as the id's definition says; there is no checksum. While records follow one
another each is believed if two magic bytes stand where it ends. Where they do not, either this record is false (a
damaged id gave it a wrong length) or the next one is damaged: it is false if a credible record begins inside it. A
wrong length may also swallow whole records and end well: their times betray them. After a damaged span a record is
credible if it ends at the header of another, which may have one flipped bit, or if its time is near that of the last
good record: so an intact record between two damaged ones is kept.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from groundstation.base.compile import in_place, scanner

LOOKAHEAD = 1_024  # bytes that must follow the record that is judged: itself and two more, at most 255 each
NEAR_US = 10_000_000  # a record whose time is within 10 s of the last good one is believed
MAGIC_BYTES = 0x95A3  # both bytes as a little-endian number
NO_TIME, TIME_US_8, TIME_US_4, TIME_MS = 0, 1, 2, 3

# Places in the state array.
POSITION, COUNT, SPANS, SKIP_START, LAST_US, CUT_AT, MAGIC, STATE_SIZE = 0, 1, 2, 3, 4, 5, 6, 7
NOWHERE = -(1 << 62)


def new_state() -> NDArray[np.int64]:
    """State of a scan at the start of a log."""
    state = np.zeros(STATE_SIZE, dtype=np.int64)
    state[SKIP_START], state[LAST_US], state[CUT_AT] = NOWHERE, NOWHERE, NOWHERE
    return state


def magic_places(data: NDArray[np.uint8], magic: int = MAGIC_BYTES) -> NDArray[np.int64]:
    """Return the places of the two magic bytes.

    The first is searched, which few other bytes are, and the second looked for behind it.
    """
    places = np.flatnonzero(data[:-1] == magic & 0xFF)
    return np.asarray(places[data[places + 1] == magic >> 8])


@in_place
def _length_at(data: Any, at: int, lengths: Any) -> int:
    """Return the length of the record that begins at a place, 0 when none does."""
    if at + 3 > len(data) or data[at] != 0xA3 or data[at + 1] != 0x95:
        return 0
    return int(lengths[data[at + 2]])


@in_place
def _time_us(data: Any, at: int, time_kind: Any) -> int:
    """Return the record's time in microseconds, -1 when it has none."""
    kind = time_kind[data[at + 2]]
    if kind == NO_TIME:
        return -1
    width = 8 if kind == TIME_US_8 else 4
    value = 0
    for k in range(width - 1, -1, -1):
        value = (value << 8) | int(data[at + 3 + k])
    return value * 1000 if kind == TIME_MS else value


@in_place
def _has_time(data: Any, at: int, time_kind: Any) -> Any:
    """Tell whether the record has a time that is not negative."""
    kind = time_kind[data[at + 2]]
    return kind != NO_TIME and (kind != TIME_US_8 or data[at + 10] < 128)


@in_place
def _is_near(data: Any, at: int, time_kind: Any, last_us: int) -> bool:
    """Tell whether the record at a place has a time near that of the last good one."""
    time = _time_us(data, at, time_kind)
    return time >= 0 and last_us >= 0 and abs(time - last_us) <= NEAR_US


@in_place
def _is_header(data: Any, at: int, lengths: Any) -> bool:
    """Tell whether three bytes begin a record of a known type, one flipped bit allowed."""
    if at + 3 > len(data):
        return False
    first, second, type_id = int(data[at]) ^ 0xA3, int(data[at + 1]) ^ 0x95, int(data[at + 2])
    if first == 0 and second == 0:
        known = int(lengths[type_id])
        for bit in range(8):
            known += int(lengths[type_id ^ (1 << bit)])
        return known > 0
    flipped = first | second << 8
    return flipped & (flipped - 1) == 0 and int(lengths[type_id]) > 0


@in_place
def _is_credible(data: Any, at: int, lengths: Any, time_kind: Any, last_us: int) -> bool:
    """Tell whether a record that begins at a place among doubtful bytes is credible.

    The module's docstring has the rule.
    """
    length = _length_at(data, at, lengths)
    if length == 0 or at + length > len(data):
        return False
    if at + length == len(data) or _is_header(data, at + length, lengths):
        return True
    return _is_near(data, at, time_kind, last_us)


@in_place
def _is_swallowed(data: Any, at: int, end: int, lengths: Any, time_kind: Any, last_us: int) -> bool:
    """Tell whether a record with a near time begins inside another and ends with it.

    It counts as well when records that follow it end there.
    """
    length = _length_at(data, at, lengths)
    if length == 0 or at + length > end or not _is_near(data, at, time_kind, last_us):
        return False
    while length > 0 and at + length < end:
        at += length
        length = _length_at(data, at, lengths)
    return length > 0 and at + length == end


@in_place
def _is_false(data: Any, at: int, length: int, lengths: Any, time_kind: Any, last_us: int) -> bool:
    """Tell whether a record is false, with a damaged id: another record begins inside it.

    Where magic (or the end of the file) follows it, only a record that ends there too and has a near time counts: a
    payload is most unlikely to look like that by chance.
    """
    end = at + length
    ends_well = end + 2 > len(data) or (data[end] == 0xA3 and data[end + 1] == 0x95)
    for inside in range(at + 3, end - 1 if ends_well else end):
        if data[inside] == 0xA3 and data[inside + 1] == 0x95:
            if ends_well and _is_swallowed(data, inside, end, lengths, time_kind, last_us):
                return True
            if not ends_well and _is_credible(data, inside, lengths, time_kind, last_us):
                return True
    return False


@in_place
def _is_cut(data: Any, at: int, length: int, lengths: Any, time_kind: Any, last_us: int) -> bool:
    """Tell whether the rest of the file is the beginning of one record.

    No other record may begin inside it.
    """
    left = len(data) - at
    if length == 0:
        return left < 3 and data[at] == 0xA3 and (left < 2 or data[at + 1] == 0x95)
    for inside in range(at + 3, len(data)):
        if data[inside] == 0xA3 and _is_credible(data, inside, lengths, time_kind, last_us):
            return False
    return True


@scanner
def scan(
    data: Any,
    magic: Any,
    is_last: bool,
    stop_at: int,
    lengths: Any,
    time_kind: Any,
    offsets: Any,
    types: Any,
    spans: Any,
    state: Any,
) -> bool:
    """Find records from ``state[POSITION]`` on.

    Returns whether it stopped after a record of type ``stop_at``.

    Parameters
    ----------
    data : ndarray of uint8, shape (n,)
    magic : ndarray of int64
        Where the two bytes of magic stand in ``data``.
    is_last : bool
        Nothing follows ``data`` in the file; else the last LOOKAHEAD bytes are left for the next call.
    stop_at : int
        Type id (that of definitions) behind whose records the scan stops, so that the caller can take them in.
    lengths : ndarray of int64, shape (256,)
        Length of the records of each type, 0 when unknown.
    time_kind : ndarray of int64, shape (256,)
        How the record's time stands behind the header: NO_TIME, TIME_US_8, TIME_US_4, TIME_MS.
    offsets, types : ndarrays of int64 and uint8, out
        Where each record begins, and its type; appended at ``state[COUNT]``.
    spans : ndarray of int64, shape (k, 3), out
        Bytes that belong to no record, from start to end, and the number of records found before; appended at
        ``state[SPANS]``.
    state : ndarray of int64
        Positions count from the start of ``data``; ``CUT_AT`` is where the file cuts a record off.
    """
    size = len(data)
    limit = size if is_last else size - LOOKAHEAD
    at, count, skip, last_us = state[POSITION], state[COUNT], state[SKIP_START], state[LAST_US]
    after = state[MAGIC]  # first magic behind the header that is judged
    timed = NOWHERE  # the last good record with a time, which is looked at when somebody asks for it
    stopped = False
    while at < limit and count < len(offsets) and state[SPANS] < len(spans):
        length = _length_at(data, at, lengths)
        is_record = length > 0 and at + length <= size
        while after < len(magic) and magic[after] < at + 3:
            after += 1
        is_doubtful = not is_record or skip != NOWHERE or (after < len(magic) and magic[after] < at + length)
        if is_doubtful:
            if timed != NOWHERE:
                last_us, timed = _time_us(data, timed, time_kind), NOWHERE
            if skip == NOWHERE and not is_record and is_last and _is_cut(data, at, length, lengths, time_kind, last_us):
                state[CUT_AT] = at
                at = size
                break
            if is_record and skip != NOWHERE:
                is_record = _is_credible(data, at, lengths, time_kind, last_us)
            if is_record:
                is_record = not _is_false(data, at, length, lengths, time_kind, last_us)
            if not is_record:
                skip = at if skip == NOWHERE else skip
                at += 1
                while at < size and data[at] != 0xA3:
                    at += 1
                continue
            if skip != NOWHERE:
                spans[state[SPANS], 0], spans[state[SPANS], 1], spans[state[SPANS], 2] = skip, at, count
                state[SPANS] += 1
                skip = NOWHERE
        if _has_time(data, at, time_kind):
            timed = at
        offsets[count] = at
        types[count] = data[at + 2]
        count += 1
        at += length
        if types[count - 1] == stop_at:
            stopped = True
            break
    if timed != NOWHERE:
        last_us = _time_us(data, timed, time_kind)
    state[POSITION], state[COUNT], state[SKIP_START], state[LAST_US], state[MAGIC] = at, count, skip, last_us, after
    return stopped
