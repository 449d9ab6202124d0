"""Compiled loops over the bytes of a recording: packets, and the messages in them.

A header counts when its sync pattern and its checksum are right: 32 bits that noise does not meet. Its packet counts
where its data checksum is right, or where it has none and another header (or the end of the file) follows. Else no
other header may begin inside it: a packet that lost bytes must not pass for whole.
"""

from typing import Any

import numpy as np

from groundstation.base.compile import in_place, scanner

HEADER_BYTES, SECONDARY_BYTES, SYNC = 24, 12, 0xEB25
MOST_BYTES, MOST_COMPUTER_BYTES = 524_288, 134_217_728  # largest packet, by the standard
LAST_COMPUTER_TYPE = 7

# Columns of a packet: where it begins and ends, its data begin and end (behind the channel-specific word), its header.
AT, END, BODY, BODY_END, CHANNEL, TYPE, FLAGS, SEQUENCE, RTC, STATE, COLUMNS = range(11)
WHOLE, WRONG_CHECKSUM, TORN, CUT = range(4)
BETWEEN_TERMINALS = 0x0800  # flag of a 1553 message's block status
IEEE_1588 = 1  # format of a secondary header's time
HAS_SECONDARY, STAMPS_ARE_SECONDARY, RTC_UNSYNCED, OVERFLOW = 0x80, 0x40, 0x20, 0x10

# Places in the state array.
POSITION, COUNT, SPANS, SKIP_START, FILLER, CHECKED, STATE_SIZE = range(7)
NOWHERE = -1


@in_place
def _u16(data: Any, at: int) -> int:
    return int(data[at]) | int(data[at + 1]) << 8


@in_place
def _u32(data: Any, at: int) -> int:
    return _u16(data, at) | _u16(data, at + 2) << 16


@in_place
def _u48(data: Any, at: int) -> int:
    return _u32(data, at) | _u16(data, at + 4) << 32


@in_place
def _sum16(data: Any, at: int, words: int) -> int:
    total = 0
    for k in range(words):
        total += _u16(data, at + 2 * k)
    return total & 0xFFFF


@in_place
def _is_header(data: Any, at: int, size: int) -> bool:
    """Tell whether a packet may begin at a place: sync, checksum, lengths that fit."""
    if at + HEADER_BYTES > size or data[at] != 0x25 or data[at + 1] != 0xEB:
        return False
    if _sum16(data, at, 11) != _u16(data, at + 22):
        return False
    header = HEADER_BYTES
    if data[at + 14] & HAS_SECONDARY:
        header += SECONDARY_BYTES
        if at + header <= size and _sum16(data, at + 24, 5) != _u16(data, at + 34):
            return False
    length, content = _u32(data, at + 4), _u32(data, at + 8)
    most = MOST_COMPUTER_BYTES if data[at + 15] <= LAST_COMPUTER_TYPE else MOST_BYTES
    return header + content <= length <= most


@in_place
def _header_inside(data: Any, syncs: Any, start: int, end: int, size: int) -> int:
    """Return the first place between two others where a header begins; NOWHERE without one."""
    number = np.searchsorted(syncs, start)
    while number < len(syncs) and syncs[number] < end:
        if _is_header(data, syncs[number], size):
            return int(syncs[number])
        number += 1
    return NOWHERE


@in_place
def _checksum_is_right(data: Any, halves: Any, words: Any, at: int, start: int, end: int) -> bool:
    """Tell whether the data checksum at the end of a packet is right.

    It is the sum of what precedes it, filler included.
    """
    kind = int(data[at + 14]) & 3
    total = 0
    if kind == 1:
        for k in range(start, end - 1):
            total += int(data[k])
        return total & 0xFF == int(data[end - 1])
    if kind == 2:
        if start % 2 == 0:
            for k in range(start // 2, (end - 2) // 2):
                total += int(halves[k])
        else:
            for k in range(start, end - 3, 2):
                total += _u16(data, k)
        return total & 0xFFFF == _u16(data, end - 2)
    if start % 4 == 0:
        for k in range(start // 4, (end - 4) // 4):
            total += int(words[k])
    else:
        for k in range(start, end - 7, 4):
            total += _u32(data, k)
    return total & 0xFFFFFFFF == _u32(data, end - 4)


@scanner
def scan(
    data: Any, halves: Any, words: Any, syncs: Any, size: int, is_last: bool, packets: Any, spans: Any, state: Any
) -> None:
    """Find packets from ``state[POSITION]`` on, until data or room run out.

    Parameters
    ----------
    data : ndarray of uint8
        Its first ``size`` bytes are of the file.
    halves, words : ndarrays of uint16 and uint32
        The same bytes.
    syncs : ndarray of int64
        Where the sync pattern stands in ``data``.
    is_last : bool
        Nothing follows in the file; else a packet that reaches beyond the data waits for more.
    packets : ndarray of int64, shape (m, COLUMNS), out
        Appended at ``state[COUNT]``; places count from the start of ``data``.
    spans : ndarray of int64, shape (k, 3), out
        Bytes of no packet, from start to end, and the number of packets found before; appended at ``state[SPANS]``.
    state : ndarray of int64
    """
    at, count, skip = state[POSITION], state[COUNT], state[SKIP_START]
    while at < size and count < len(packets) and state[SPANS] < len(spans):
        if at + HEADER_BYTES + SECONDARY_BYTES > size and not is_last:
            break
        if not _is_header(data, at, size):
            skip = at if skip == NOWHERE else skip
            at += 1
            while at < size and data[at] != 0x25:
                at += 1
            continue
        end = at + _u32(data, at + 4)
        if end + HEADER_BYTES + SECONDARY_BYTES > size and not is_last:
            break
        header = HEADER_BYTES + (SECONDARY_BYTES if data[at + 14] & HAS_SECONDARY else 0)
        body, content = at + header, _u32(data, at + 8)
        has_checksum = data[at + 14] & 3 != 0
        verdict, resume = WHOLE, end
        is_right = end <= size and has_checksum and _checksum_is_right(data, halves, words, at, body, end)
        is_wrong = has_checksum and not is_right
        if end > size or is_wrong or not (is_right or end == size or _is_header(data, end, size)):
            inner = _header_inside(data, syncs, at + header, end, size)
            if inner != NOWHERE:
                verdict, resume = TORN, inner
            elif end > size:
                verdict, resume = CUT, size
        if verdict == WHOLE and is_wrong:
            verdict = WRONG_CHECKSUM
        if skip != NOWHERE:
            spans[state[SPANS], 0], spans[state[SPANS], 1], spans[state[SPANS], 2] = skip, at, count
            state[SPANS] += 1
            skip = NOWHERE
        kind = int(data[at + 14]) & 3
        state[CHECKED] += 1 if has_checksum else 0
        if verdict == WHOLE:
            state[FILLER] += end - body - content - (1 << (kind - 1) if kind else 0)
        row = packets[count]
        row[AT], row[END], row[BODY], row[BODY_END] = at, resume, body + 4, min(body + content, size, resume)
        row[CHANNEL], row[TYPE], row[FLAGS] = _u16(data, at + 2), data[at + 15], data[at + 14]
        row[SEQUENCE], row[RTC], row[STATE] = data[at + 13], _u48(data, at + 16), verdict
        count += 1
        at = resume
    state[POSITION], state[COUNT], state[SKIP_START] = at, count, skip


@in_place
def _stamp(data: Any, at: int, packet: Any) -> int:
    """Return the time of a message in counts of 100 ns.

    It is the message's own counter, or that of the packet plus how much later the message is.
    """
    flags = packet[FLAGS]
    if not flags & STAMPS_ARE_SECONDARY or not flags & HAS_SECONDARY:
        return _u48(data, at)
    first = packet[BODY] - 4 - SECONDARY_BYTES
    if (flags >> 2) & 3 == IEEE_1588:  # nanoseconds, seconds
        seconds = _u32(data, at + 4) - _u32(data, first + 4)
        return int(packet[RTC] + seconds * 10_000_000 + (_u32(data, at) - _u32(data, first)) // 100)
    return int(packet[RTC])


@scanner
def messages_1553(data: Any, packets: Any, places: Any, times: Any, heads: Any, words: Any, lost: Any) -> int:
    """Find the messages of MIL-STD-1553 packets and return their number.

    Parameters
    ----------
    data : ndarray of uint8
    packets : ndarray of int64, shape (m, COLUMNS)
    places, times : ndarrays of int64, out
        Where each message begins in ``data``; its time in counts of 100 ns.
    heads : ndarray of uint16, shape (n, 3), out
        Block status, gap times, bytes of the message.
    words : ndarray of uint8, shape (n, 72), out
        As recorded, two bytes each; as they were behind the last.
    lost : ndarray of int64, shape (m,), out
        Messages that a packet says it has, less those found.
    """
    count = 0
    for k in range(len(packets)):
        packet = packets[k]
        at, end = packet[BODY], packet[BODY_END]
        stated = (_u32(data, at - 4) & 0xFFFFFF) if end >= at else 0
        found = 0
        while found < stated and at + 14 <= end and count < len(places):
            length = _u16(data, at + 12)
            if at + 14 + length > end:
                break
            places[count], times[count] = at, _stamp(data, at, packet)
            for column in range(3):
                heads[count, column] = _u16(data, at + 8 + 2 * column)
            for byte in range(min(length, words.shape[1])):
                words[count, byte] = data[at + 14 + byte]
            at += 14 + length + length % 2
            count += 1
            found += 1
        lost[k] = stated - found
    return count


@in_place
def see_1553(data: Any, packets: Any, seen: Any) -> None:
    """Mark the command words of all messages in ``seen``: see messages_1553.

    ``seen`` is an ndarray of bool of shape (65536,).
    """
    for k in range(len(packets)):
        at, end = packets[k, BODY], packets[k, BODY_END]
        while at + 16 <= end:
            length = _u16(data, at + 12)
            seen[_u16(data, at + 14)] = True
            if _u16(data, at + 8) & BETWEEN_TERMINALS and length >= 4 and at + 18 <= end:
                seen[_u16(data, at + 16)] = True
            at += 14 + length + length % 2


@in_place
def see_429(data: Any, packets: Any, seen: Any) -> None:
    """Mark bus (from 0) and label byte of all words in ``seen``.

    ``seen`` is an ndarray of bool of shape (65536,).
    """
    for k in range(len(packets)):
        for at in range(packets[k, BODY], packets[k, BODY_END] - 7, 8):
            seen[int(data[at + 3]) << 8 | int(data[at + 4])] = True


@scanner
def words_429(data: Any, packets: Any, places: Any, times: Any, heads: Any, words: Any, lost: Any) -> int:
    """Find the words of ARINC-429 packets and return their number.

    ``heads`` is each word's header (bus, errors, gap to the word before), ``words`` the word; both uint32, shape (n,).
    The first word has the packet's time, and each gap is counted in its unit. Else as :func:`messages_1553`.
    """
    count = 0
    for k in range(len(packets)):
        at, end, time = packets[k, BODY], packets[k, BODY_END], packets[k, RTC]
        stated = (_u32(data, at - 4) & 0xFFFF) if end >= at else 0
        found = min(stated, (end - at) // 8, len(places) - count)
        for word in range(found):
            head = _u32(data, at)
            time += (head & 0xFFFFF) if word else 0
            places[count], times[count], heads[count], words[count] = at, time, head, _u32(data, at + 4)
            at += 8
            count += 1
        lost[k] = stated - found
    return count


@in_place
def messages_stamped(
    data: Any,
    packets: Any,
    has_stamp: bool,
    header: int,
    length_at: int,
    mask: int,
    places: Any,
    times: Any,
    sizes: Any,
) -> int:
    """Find messages whose length stands in a header behind their time; return their number.

    Such are UART, Ethernet, message and CAN.

    Parameters
    ----------
    has_stamp : bool
        Whether eight bytes of time come first; else the packet's time counts.
    header, length_at, mask : int
        Bytes of the header, where in it the 16 bits of the length stand, and which of them count.
    sizes : ndarray of int64, out
        Bytes of each message behind its header. ``places`` are those bytes; the rest as :func:`messages_1553`.
    """
    count = 0
    for k in range(len(packets)):
        at, end = packets[k, BODY], packets[k, BODY_END]
        stamp = 8 if has_stamp else 0
        while at + stamp + header <= end and count < len(places):
            size = _u16(data, at + stamp + length_at) & mask
            start = at + stamp + header
            if start + size > end:
                break
            places[count], sizes[count] = start, size
            times[count] = _stamp(data, at, packets[k]) if has_stamp else packets[k, RTC]
            at = start + size + size % 2
            count += 1
    return count


@in_place
def samples(time_ns: Any, fields: Any, span_ns: int, sample: Any) -> int:
    """Group words into samples and return the number of samples.

    A sample ends where a word tells a field again, or comes more than a span after its first word.

    Parameters
    ----------
    time_ns : ndarray of int64, shape (n,)
    fields : ndarray of int64, shape (n,)
        A bit for each field that a word tells.
    span_ns : int
    sample : ndarray of int64, shape (n,), out
        Number of each word's sample.
    """
    count, told, start = 0, 0, 0
    for k in range(len(time_ns)):
        if k == 0 or told & fields[k] != 0 or abs(time_ns[k] - start) > span_ns:
            count += 1
            told, start = 0, time_ns[k]
        told |= fields[k]
        sample[k] = count - 1
    return count
