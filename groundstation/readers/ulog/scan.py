"""Compiled loops over the bytes of a ULog: they find its messages and the bytes of none.

A message is a size (two bytes), a type (one byte) and as many bytes as the size says; there is no checksum. Most
messages can be checked strongly: a data message must have a known id and the size of its format, texts must be texts,
the sync message is eleven fixed bytes. Such a message is believed by itself, so an intact one between two damaged ones
is kept.

A message with little to check is believed when a strong one follows within four and none stands inside it: among
damaged bytes every letter is the type of a message, and its size may lead anywhere.

Nothing confirms the size of texts, and of data whose padding may be left out. Where no message follows one of them and
another begins inside it, its size is damaged. Where no message follows a data message and another begins in its end,
bytes of the data message are missing.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from groundstation.base.compile import in_place, scanner

HEADER = 3
MAX_MESSAGE = HEADER + 0xFFFF
LOOKAHEAD = 6 * MAX_MESSAGE  # bytes that must follow the message that is judged: itself, four more, and a header
LOOKED_AT = 256  # characters of a text or a name: bounds the work that a file made of letters causes
LONGEST_WEAK = 4_096  # bytes of a message with little to check: one that is longer has a damaged size
LONGEST_STEP = 512  # bytes of one on the way to a strong message
NOT_SUBSCRIBED = -1  # largest size of a message id without subscription

DATA, SYNC = 0x44, 0x53
NONE, WEAK, STRONG = 0, 1, 2

# Why the scan returned.
MORE_DATA, DEFINITION, FULL = 0, 1, 2
# Places in the state array: positions count from the start of the data given.
POSITION, COUNT, SPANS, SKIP_START, CUT_AT, STATE_SIZE = 0, 1, 2, 3, 4, 5
NOWHERE = -(1 << 62)


def new_state() -> NDArray[np.int64]:
    """State of a scan at the start of a section."""
    state = np.zeros(STATE_SIZE, dtype=np.int64)
    state[SKIP_START] = state[CUT_AT] = NOWHERE
    return state


@in_place
def _u16(data: Any, at: int) -> Any:
    return np.int64(data[at]) | np.int64(data[at + 1]) << 8


@in_place
def _is_text(data: Any, start: int, end: int, is_name: bool) -> bool:
    """Tell whether bytes are text.

    A name has letters, digits and ``_-/`` only; any other text has no control characters.
    """
    for at in range(start, end):
        byte = data[at]
        if is_name:
            is_letter = 0x41 <= byte <= 0x5A or 0x61 <= byte <= 0x7A or 0x2D <= byte <= 0x39 or byte == 0x5F
            if not is_letter:
                return False
        elif (byte < 0x20 and byte not in (0, 9, 10, 13, 27)) or byte == 0x7F:
            return False
    return True


@in_place
def _value_bytes(data: Any, start: Any, stop: Any) -> Any:
    """Return the size in bytes of the value of a key ``type[count] name``.

    Only the letters and digits that tell the types apart are looked at.
    """
    first = data[start]
    width, count, is_array = 8 if first == 0x64 else 4 if first == 0x66 else 1, np.int64(0), False
    if first == 0x69 or first == 0x75:  # int, uint: 8, 16, 32, 64
        digit = data[start + (3 if first == 0x69 else 4)]
        width = 2 if digit == 0x31 else 4 if digit == 0x33 else 8 if digit == 0x36 else 1
    for at in range(start, stop):
        byte = data[at]
        if byte == 0x20 or byte == 0x5D:
            break
        if is_array:
            count = min(10 * count + np.int64(byte) - 0x30, np.int64(MAX_MESSAGE))
        is_array |= byte == 0x5B
    return width * count if is_array else width


@in_place
def _keyed_strength(data: Any, start: int, end: int) -> int:
    """Grade a body as a key with its value: NONE, WEAK or STRONG.

    Such a body is a length, a key ``type name`` of that length, and a value of that type.
    """
    if start >= end:
        return NONE
    stop = start + 1 + np.int64(data[start])
    if stop < start + 6 or stop > end:
        return NONE
    first = data[start + 1]
    if first not in (0x62, 0x63, 0x64, 0x66, 0x69, 0x75):  # bool, char, double, float, int, uint
        return NONE
    spaces = 0
    for at in range(start + 1, stop):
        byte = data[at]
        spaces += byte == 0x20
        if byte < 0x20 or byte > 0x7E:
            return NONE
    if spaces != 1:
        return NONE
    return STRONG if _value_bytes(data, start + 1, stop) == end - stop else WEAK


@in_place
def _format_strength(data: Any, start: int, end: int) -> int:
    """Grade a body as a format definition: NONE, WEAK or STRONG.

    Such a body is a name that is not empty, a colon, and printable characters of which the last is a semicolon.
    """
    colons = 0
    for at in range(start, end):
        byte = data[at]
        colons += byte == 0x3A
        if byte < 0x20 or byte > 0x7E or colons > 1 or (colons == 0 and at - start > LOOKED_AT):
            return NONE
    if colons != 1 or data[start] == 0x3A:
        return NONE
    return STRONG if data[end - 1] == 0x3B else WEAK


@in_place
def _text_strength(data: Any, start: int, end: int, time_at: int) -> int:
    """Grade a body as a logged text: NONE, WEAK or STRONG.

    Such a body is a level (a digit), a time at ``time_at`` whose highest byte is zero, and a text.
    """
    if time_at + 8 > end or data[start] < 0x30 or data[start] > 0x37 or data[time_at + 7] != 0:
        return NONE
    looked_at = time_at + 8 + LOOKED_AT
    if not _is_text(data, time_at + 8, min(end, looked_at), False):
        return NONE
    return STRONG if end <= looked_at else WEAK


@in_place
def _is_sync(data: Any, start: int) -> Any:
    return (
        data[start] == 0x2F
        and data[start + 1] == 0x73
        and data[start + 2] == 0x13
        and data[start + 3] == 0x20
        and data[start + 4] == 0x25
        and data[start + 5] == 0x0C
        and data[start + 6] == 0xBB
        and data[start + 7] == 0x12
    )


@in_place
def _strength(data: Any, at: int, end: int, least: Any, most: Any) -> int:
    """Grade the evidence for a whole message at a place: NONE, WEAK or STRONG."""
    if at + 3 > end:
        return NONE
    size = _u16(data, at)
    kind = data[at + 2]
    start, stop = at + 3, at + 3 + size
    if stop > end or size == 0:
        return NONE
    if kind == 0x44:  # D: data
        if size < 2:
            return NONE
        message_id = _u16(data, start)
        if most[message_id] < 0:
            return WEAK
        return STRONG if least[message_id] <= size - 2 <= most[message_id] else NONE
    if kind == 0x53:  # S: sync
        return STRONG if size == 8 and _is_sync(data, start) else NONE
    if kind == 0x41:  # A: subscription
        return STRONG if 4 <= size <= 3 + LOOKED_AT and _is_text(data, start + 3, stop, True) else NONE
    if kind == 0x46:  # F: format
        return _format_strength(data, start, stop)
    if kind == 0x49 or kind == 0x50:  # I, P: information, parameter
        return _keyed_strength(data, start, stop)
    if kind == 0x4D or kind == 0x51:  # M, Q: multiple information, default parameter
        return _keyed_strength(data, start + 1, stop)
    if kind == 0x4C:  # L: text
        return _text_strength(data, start, stop, start + 1)
    if kind == 0x43:  # C: tagged text
        return _text_strength(data, start, stop, start + 3)
    if kind == 0x4F or kind == 0x52:  # O, R: dropout, unsubscription
        return WEAK if size == 2 else NONE
    return WEAK if 0x21 <= kind <= 0x7E else NONE  # a type that a later version may define


@in_place
def _swallows(data: Any, at: int, stop: int, least: Any, most: Any) -> bool:
    """Tell whether a stretch contains other messages.

    A definition, an information message, or two strong messages in a row are enough.
    """
    while at + 3 <= stop:
        place, found = at, 0
        while found < 2 and place + 3 <= stop and 0x41 <= data[place + 2] <= 0x53:
            if _strength(data, place, stop, least, most) != STRONG:
                break
            kind = data[place + 2]
            found += 2 if kind in (0x46, 0x49, 0x4D, 0x50, 0x51) else 1
            place += 3 + _u16(data, place)
        if found >= 2:
            return True
        at += 1
    return False


@in_place
def _is_known_type(kind: Any) -> bool:
    return kind in (0x41, 0x42, 0x43, 0x44, 0x46, 0x49, 0x4C, 0x4D, 0x4F, 0x50, 0x51, 0x52, 0x53)


@in_place
def _is_cut(data: Any, at: int, end: int, least: Any, most: Any) -> Any:
    """Tell whether a data message begins at a place and is cut by the end of the data."""
    if at + 5 > end or data[at + 2] != 0x44:
        return False
    size = _u16(data, at)
    message_id = _u16(data, at + 3)
    return at + 3 + size > end and least[message_id] <= size - 2 <= most[message_id]


@scanner
def leads_on(data: Any, at: int, end: int, least: Any, most: Any) -> bool:
    """Tell whether a strong message begins at a place, or after at most three weak ones.

    Reaching the end of the data is as good.
    """
    for _ in range(4):
        if at + 3 > end:
            return True
        strength = _strength(data, at, end, least, most)
        stop = at + 3 + _u16(data, at)
        if strength == NONE and data[at + 2] != 0x44 and _is_known_type(data[at + 2]):
            return bool(end < stop <= at + LONGEST_WEAK)  # cut by the end
        if strength != WEAK:
            return bool(strength == STRONG or _is_cut(data, at, end, least, most))
        if stop - at > LONGEST_STEP or _swallows(data, at + 3, stop, least, most):
            return False
        at = stop
    return False


@in_place
def _find(data: Any, at: int, limit: int, end: int, least: Any, most: Any) -> int:
    """Return the first place from ``at`` on where a believable message begins.

    ``limit`` when there is none before it.
    """
    while at < limit and at + 3 <= end:
        kind = data[at + 2]
        if 0x41 <= kind <= 0x53:
            strength = _strength(data, at, end, least, most)
            if strength == STRONG or (kind == 0x44 and _is_cut(data, at, end, least, most)):
                return at
            is_known = kind == 0x4F or kind == 0x52
            if strength == WEAK and is_known and leads_on(data, at + 5, end, least, most):
                return at
        at += 1
    return limit


@in_place
def _is_data(data: Any, at: int, end: int, least: Any, most: Any) -> Any:
    """Tell whether the header of a data message of known id and size stands at a place."""
    if at + 5 > end or data[at + 2] != 0x44:
        return False
    message_id = _u16(data, at + 3)
    return least[message_id] <= _u16(data, at) - 2 <= most[message_id]


@in_place
def _has_one_size(data: Any, at: int, least: Any, most: Any) -> Any:
    """Tell whether the data of a message's id has a single size.

    If not, the padding at its end may be left out.
    """
    message_id = _u16(data, at + 3)
    return least[message_id] == most[message_id]


@in_place
def _is_believed(data: Any, at: int, end: int, least: Any, most: Any, is_next: bool) -> Any:
    """Tell whether the bytes at a place are taken for a message.

    ``end`` is the end of the data; ``is_next`` says that another message ends right before the place.
    """
    strength = _strength(data, at, end, least, most)
    if strength == NONE:
        return False
    kind = data[at + 2]
    if strength == STRONG and (kind == 0x53 or (kind == 0x44 and _has_one_size(data, at, least, most))):
        return True
    stop = at + 3 + _u16(data, at)
    if is_next and (kind == 0x4F or kind == 0x52):
        return _find(data, at + 1, stop, end, least, most) == stop
    if strength == WEAK and (stop - at > LONGEST_WEAK or _swallows(data, at + 3, stop, least, most)):
        return False
    if leads_on(data, stop, end, least, most):
        return True
    return strength == STRONG and _find(data, at + 3, stop, end, least, most) == stop


@in_place
def _next_inside(data: Any, last: int, at: int, end: int, least: Any, most: Any) -> Any:
    """Return the place where a message begins inside the data message ``last``, else ``at``.

    ``last`` ends at ``at``. The message inside must lead on to others; then bytes of ``last`` are missing, and its
    stated end is too late.
    """
    if data[last + 2] != 0x44 or last + 3 + _u16(data, last) != at:
        return at
    for inside in range(last + 5, at):
        if inside + 3 <= end and _strength(data, inside, end, least, most) == STRONG:
            stop = inside + 3 + _u16(data, inside)
            if stop > at and leads_on(data, stop, end, least, most):
                return inside
    return at


@scanner
def scan(
    data: Any, ahead: int, least: Any, most: Any, topic: Any, out_at: Any, out_topic: Any, spans: Any, state: Any
) -> int:
    """Find messages from ``state[POSITION]`` on until there is a reason to return.

    Parameters
    ----------
    data : ndarray of uint8, shape (n,)
    ahead : int
        The scan stops so many bytes before the end of the data (LOOKAHEAD); 0 where the section ends there.
    least, most, topic : ndarray of int64, shape (65536,)
        By message id: sizes of its data, and the number of its topic.
    out_at : ndarray of int64, shape (m,)
        Gets the place of each message.
    out_topic : ndarray of int32, shape (m,)
        Gets the topic's number of data messages, and minus the type of all others.
    spans : ndarray of int64, shape (k, 3)
        Gets the first byte of each stretch that belongs to no message, the first after it, and the number of messages
        found before.
    state : ndarray of int64
        As :func:`new_state` made it; carried from call to call.

    Returns
    -------
    int
        MORE_DATA (all of the data was gone through), DEFINITION (the last message is one, to be heeded before the
        scan goes on), FULL (an output is).
    """
    end = len(data)
    limit, is_end = end - ahead, ahead == 0
    at, count = state[POSITION], state[COUNT]
    reason = MORE_DATA
    while at < limit:
        if count == len(out_at) or state[SPANS] == len(spans):
            reason = FULL
            break
        if at + 5 <= end and data[at + 2] == 0x44 and state[SKIP_START] == NOWHERE:  # nearly all messages are data
            size = _u16(data, at)
            message_id = _u16(data, at + 3)
            low, high, stop = least[message_id], most[message_id], at + 3 + size
            if low <= size - 2 <= high and stop <= end and (low == high or _is_data(data, stop, end, least, most)):
                out_at[count], out_topic[count] = at, topic[message_id]
                count += 1
                at = stop
                continue
        is_next = state[SKIP_START] == NOWHERE
        if not _is_believed(data, at, end, least, most, is_next):
            if is_end and _is_cut_off(data, at, end, least, most):
                state[CUT_AT] = at
                at = end
                break
            inside = _next_inside(data, out_at[count - 1], at, end, least, most) if is_next and count else at
            if inside < at:
                count -= 1
                state[SKIP_START], at = out_at[count], inside
                continue
            if is_next:
                state[SKIP_START] = at
            at = _find(data, at + 1, limit, end, least, most)
            continue
        if state[SKIP_START] != NOWHERE:
            spans[state[SPANS], 0], spans[state[SPANS], 1], spans[state[SPANS], 2] = state[SKIP_START], at, count
            state[SPANS] += 1
            state[SKIP_START] = NOWHERE
            continue  # the outputs must be checked for room again
        kind = data[at + 2]
        out_at[count] = at
        out_topic[count] = topic[_u16(data, at + 3)] if kind == 0x44 else -np.int32(kind)
        count += 1
        at += 3 + _u16(data, at)
        if kind == 0x41 or kind == 0x46 or kind == 0x42:
            reason = DEFINITION
            break
    state[POSITION], state[COUNT] = at, count
    return reason


@in_place
def _is_cut_off(data: Any, at: int, end: int, least: Any, most: Any) -> Any:
    """Tell whether a message of any type begins at a place and is cut by the end of the data.

    No other message may begin inside the bytes that are there.
    """
    if at + 3 <= end:
        kind = data[at + 2]
        size = _u16(data, at)
        if kind == 0x44:
            if at + 5 <= end:
                return _is_cut(data, at, end, least, most)
        elif not _is_known_type(kind):
            return False
        if at + 3 + size <= end:
            return False
    return _find(data, at + 1, end, end, least, most) == end
