"""Compiled loop over the bytes of a receiver's stream: it finds and names its frames.

A frame is believed when its checksum is right, so frames of several protocols may stand in one stream in any order, and
after damage the next sound frame is found wherever it begins. Line ends between frames belong to none and are no loss.

Sources: u-blox interface description (UBX frame, 8-bit Fletcher); NMEA 0183 (exclusive or between ``$`` and ``*``);
RTCM 10403 (24-bit CRC of Qualcomm); NovAtel OEM7 commands and logs (32-bit CRC).
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from groundstation.base.compile import in_place, inlined

UBX, NMEA, RTCM, NOVATEL, NOVATEL_SHORT, BARE_NMEA, NOVATEL_TEXT = 1, 2, 3, 4, 5, 6, 7
UBX_EXTRA, RTCM_EXTRA, CRC_BYTES = 8, 6, 4
NOVATEL_SHORT_HEADER = 12
TEXT_CRC_BYTES = 9  # checksum of a NovAtel log as text: an asterisk and eight digits
SHORTEST_TEXT = 28  # bytes of such a log, which are those of the binary header
LONGEST = 66_000  # bytes of the longest frame that any protocol can write
LONGEST_SENTENCE, LONGEST_ADDRESS = 1_024, 31
LONGEST_TEXT = 1_024  # bytes that a computer writes in front of a sentence or behind it
DOLLAR, BANG, STAR, COMMA, CR, LF, TAB, HASH, PERCENT, SEMICOLON = 36, 33, 42, 44, 13, 10, 9, 35, 37, 59
NO_FRAME, PENDING = 0, -1

# Places in the state array.
POSITION, COUNT, SPANS, SKIP_START, DOUBTED, STATE_SIZE = 0, 1, 2, 3, 4, 5
NOWHERE = -(1 << 62)
SHORT_FRAME = 300  # bytes; longer ones are no longer tried where very many have failed
MOST_DOUBTED = 16  # bytes of failed frames that are summed up, for each byte of a block


def new_state() -> NDArray[np.int64]:
    """State of a scan at the start of a stream."""
    state = np.zeros(STATE_SIZE, dtype=np.int64)
    state[SKIP_START] = NOWHERE
    return state


def crc_tables() -> tuple[NDArray[np.uint32], NDArray[np.uint32]]:
    """Return the tables of the CRCs by byte, for RTCM and for NovAtel.

    RTCM's has 24 bits (1864CFB), NovAtel's 32 bits (EDB88320, reflected).
    """
    rtcm, novatel = np.arange(256, dtype=np.uint32) << 16, np.arange(256, dtype=np.uint32)
    for _bit in range(8):
        rtcm = np.where(rtcm & 0x800000, (rtcm << 1) ^ 0x1864CFB, rtcm << 1).astype(np.uint32)
        novatel = np.where(novatel & 1, (novatel >> 1) ^ 0xEDB88320, novatel >> 1).astype(np.uint32)
    return (rtcm & 0xFFFFFF).astype(np.uint32), novatel


@inlined
def _hexadecimal(byte: int) -> int:
    """Value of a hexadecimal digit, -1 for another character."""
    if 48 <= byte <= 57:
        return byte - 48
    if 65 <= byte <= 70:
        return byte - 55
    return byte - 87 if 97 <= byte <= 102 else -1


@in_place
def _ubx(data: Any, at: int) -> int:
    """Length of the UBX frame at a place if its checksum is right."""
    length = data[at + 4] + 256 * data[at + 5] + UBX_EXTRA
    if at + length > len(data):
        return PENDING
    first, second = 0, 0
    for k in range(at + 2, at + length - 2):
        first = (first + data[k]) & 255
        second = (second + first) & 255
    return length if data[at + length - 2] == first and data[at + length - 1] == second else NO_FRAME


@in_place
def _sentence(data: Any, at: int) -> int:
    """Length of the NMEA sentence at a place, to the end of its checksum."""
    total, end = 0, min(at + LONGEST_SENTENCE, len(data))
    for k in range(at + 1, end):
        byte = data[k]
        if byte < COMMA or byte > 126:
            if byte == STAR:
                if k + 3 > len(data):
                    return PENDING
                told = 16 * _hexadecimal(data[k + 1]) + _hexadecimal(data[k + 2])
                return k + 3 - at if _hexadecimal(data[k + 1]) >= 0 and told == total else NO_FRAME
            if byte < 32 or byte > 126 or byte == DOLLAR:
                return NO_FRAME
        total ^= byte
    return PENDING if end == len(data) else NO_FRAME


@in_place
def _bare_sentence(data: Any, at: int) -> int:
    """Length of the sentence without a checksum at a place: to the end of its line."""
    for k in range(at + 1, min(at + LONGEST_SENTENCE, len(data))):
        byte = data[k]
        if byte in (CR, LF):
            return k - at
        if byte < 32 or byte > 126 or byte in (DOLLAR, STAR):
            return NO_FRAME
    return PENDING if at + LONGEST_SENTENCE > len(data) else NO_FRAME


@in_place
def _is_address(data: Any, at: int) -> bool:
    """Tell whether an address stands behind the first character of a sentence.

    An address is two capital letters or more and a comma.
    """
    for k in range(at + 1, min(at + LONGEST_ADDRESS, len(data))):
        byte = data[k]
        if byte == COMMA:
            return k >= at + 3
        if not (65 <= byte <= 90 or 48 <= byte <= 57):
            return False
    return False


@in_place
def _rtcm(data: Any, at: int, table: Any) -> int:
    """Length of the RTCM 3 frame at a place if its checksum is right."""
    length = ((data[at + 1] & 3) << 8 | data[at + 2]) + RTCM_EXTRA
    if data[at + 1] > 3:
        return NO_FRAME
    if at + length > len(data):
        return PENDING
    crc = 0
    for k in range(at, at + length - 3):
        crc = ((crc << 8) & 0xFFFFFF) ^ table[(crc >> 16) ^ data[k]]
    end = at + length
    return length if crc == data[end - 3] << 16 | data[end - 2] << 8 | data[end - 1] else NO_FRAME


@in_place
def _novatel(data: Any, at: int, table: Any) -> int:
    """Length of the NovAtel frame at a place (long or short header) if its checksum is right."""
    if data[at + 2] == 0x12:
        length = data[at + 3] + data[at + 8] + 256 * data[at + 9] + CRC_BYTES
    else:
        length = NOVATEL_SHORT_HEADER + data[at + 3] + CRC_BYTES
    if at + length > len(data):
        return PENDING
    crc = 0
    for k in range(at, at + length - CRC_BYTES):
        crc = (crc >> 8) ^ table[(crc ^ data[k]) & 255]
    end = at + length
    told = data[end - 4] | data[end - 3] << 8 | data[end - 2] << 16 | data[end - 1] << 24
    return length if crc == told else NO_FRAME


@in_place
def _novatel_text(data: Any, at: int, table: Any) -> int:
    """Return the length of the NovAtel log in text at a place, if its checksum is right.

    A text in which another begins is none.
    """
    crc, end, has_body = 0, min(at + LONGEST, len(data)), False
    for k in range(at + 1, end):
        byte = data[k]
        if byte == STAR:
            if k + TEXT_CRC_BYTES > len(data):
                return PENDING
            told, digits = 0, 0
            for d in range(k + 1, k + TEXT_CRC_BYTES):
                digit = _hexadecimal(data[d])
                digits += digit >= 0
                told = 16 * told + digit
            is_right = has_body and digits == TEXT_CRC_BYTES - 1 and told == crc
            return k + TEXT_CRC_BYTES - at if is_right and k + TEXT_CRC_BYTES - at >= SHORTEST_TEXT else NO_FRAME
        if byte < 32 or byte > 126 or (k == at + 1 and not 65 <= byte <= 90):
            return NO_FRAME
        if byte in (HASH, PERCENT) and k + 1 < end and 65 <= data[k + 1] <= 90:
            return NO_FRAME  # otherwise every start without an end would be followed to the end
        has_body |= byte == SEMICOLON
        crc = (crc >> 8) ^ table[(crc ^ byte) & 255]
    return PENDING if end == len(data) else NO_FRAME


@in_place
def _declared(data: Any, at: int) -> int:
    """Return the length that a binary frame at a place states, 0 where none begins."""
    left, byte = len(data) - at, data[at]
    if byte == 0xB5 and left >= 6 and data[at + 1] == 0x62:
        return int(data[at + 4]) + 256 * int(data[at + 5]) + UBX_EXTRA
    if byte == 0xD3 and left >= 3:
        return int(data[at + 1] & 3) * 256 + int(data[at + 2]) + RTCM_EXTRA
    if byte == 0xAA and left >= 10 and data[at + 1] == 0x44:
        return int(data[at + 3]) + int(data[at + 8]) + 256 * int(data[at + 9]) + CRC_BYTES
    return 0


@in_place
def _frame(data: Any, at: int, bare: bool, rtcm: Any, novatel: Any) -> tuple[int, int]:
    """Return protocol and length of the frame at a place.

    The length is NO_FRAME without one, PENDING where the data end inside it.
    """
    left, byte = len(data) - at, data[at]
    if byte == 0xB5 and (left < 2 or data[at + 1] == 0x62):
        return UBX, _ubx(data, at) if left >= UBX_EXTRA else PENDING
    if byte in (DOLLAR, BANG):
        length = _sentence(data, at)
        if length == NO_FRAME and bare and _is_address(data, at):
            return BARE_NMEA, _bare_sentence(data, at)
        return NMEA, length
    if byte in (HASH, PERCENT):
        return NOVATEL_TEXT, _novatel_text(data, at, novatel)
    if byte == 0xD3:
        return RTCM, _rtcm(data, at, rtcm) if left >= RTCM_EXTRA else PENDING
    if byte == 0xAA and left >= 16 and data[at + 1] == 0x44 and (data[at + 2] == 0x12 or data[at + 2] == 0x13):
        return NOVATEL if data[at + 2] == 0x12 else NOVATEL_SHORT, _novatel(data, at, novatel)
    return 0, NO_FRAME


@in_place
def is_cut(data: Any, at: int) -> bool:
    """Tell whether a frame begins at a place and is cut off by the end of the data."""
    if data[at] == DOLLAR or data[at] == BANG or data[at] == HASH or data[at] == PERCENT:
        is_text = len(data) - at <= LONGEST
        for k in range(at + 1, len(data) if is_text else at):
            is_text &= 32 <= data[k] <= 126
        return is_text
    return _declared(data, at) > len(data) - at


@inlined
def _is_text(byte: int) -> bool:
    return 32 <= byte <= 126 or byte == TAB


@in_place
def _text_before(data: Any, start: int, at: int) -> int:
    """Return the number of text bytes from the beginning of the line to a place.

    They are counted from ``start`` on at most; 0 where other bytes are between.
    """
    k = at
    while k > start and at - k < LONGEST_TEXT and _is_text(data[k - 1]):
        k -= 1
    is_line = k == 0 or data[k - 1] == CR or data[k - 1] == LF
    return at - k if is_line else 0


@in_place
def _text_behind(data: Any, at: int) -> int:
    """Return the number of text bytes from a place to the end of its line.

    0 where another sentence or other bytes come before the end.
    """
    k = at
    while k < len(data) and k - at < LONGEST_TEXT and _is_text(data[k]) and data[k] != DOLLAR:
        k += 1
    return k - at if k == len(data) or data[k] == CR or data[k] == LF else 0


@in_place
def scan(
    data: Any,
    is_last: bool,
    bare: bool,
    hosted: bool,
    rtcm: Any,
    novatel: Any,
    offsets: Any,
    lengths: Any,
    kinds: Any,
    texts: Any,
    spans: Any,
    state: Any,
) -> None:
    """Find frames from ``state[POSITION]`` on.

    Parameters
    ----------
    data : ndarray of uint8, shape (n,)
    is_last : bool
        Nothing follows ``data`` in the file; else the last LONGEST bytes are left for the next call.
    bare : bool
        Sentences without a checksum are taken.
    hosted : bool
        Text of the computer that recorded may stand in front of a sentence and behind it, in its line.
    rtcm, novatel : ndarrays of uint32, shape (256,)
        Tables of :func:`crc_tables`.
    offsets, lengths, kinds : ndarrays, out
        Where each frame begins, its bytes and protocol; appended at ``state[COUNT]``.
    texts : ndarray of int64, shape (n, 2), out
        Where ``hosted``: bytes of text in front of each frame and behind it, zeros before.
    spans : ndarray of int64, shape (k, 2), out
        Bytes that belong to no frame, from start to end; appended at ``state[SPANS]``.
    state : ndarray of int64
        Positions count from the start of ``data``; ``DOUBTED`` is how many bytes of failed frames were summed up.
    """
    limit = len(data) if is_last else len(data) - LONGEST
    at, count, skip, doubted = state[POSITION], state[COUNT], state[SKIP_START], state[DOUBTED]
    while at < limit and count < len(offsets) and state[SPANS] < len(spans):
        kind, length = 0, NO_FRAME
        if doubted < MOST_DOUBTED * len(data) or _declared(data, at) <= SHORT_FRAME:
            kind, length = _frame(data, at, bare, rtcm, novatel)
            doubted += 0 if length > 0 else _declared(data, at)
        if length > 0:
            start, behind = at, 0
            if hosted and kind in (NMEA, BARE_NMEA, NOVATEL_TEXT):
                texts[count, 0] = _text_before(data, max(skip, 0), at) if skip != NOWHERE else 0
                start, behind = at - texts[count, 0], _text_behind(data, at + length)
                texts[count, 1] = behind
            if skip != NOWHERE and skip < start:
                spans[state[SPANS], 0], spans[state[SPANS], 1] = skip, start
                state[SPANS] += 1
            skip = NOWHERE
            offsets[count], lengths[count], kinds[count] = at, length, kind
            count += 1
            at += length + behind
        else:
            if skip == NOWHERE and data[at] != CR and data[at] != LF:
                skip = at
            at += 1
    state[POSITION], state[COUNT], state[SKIP_START], state[DOUBTED] = at, count, skip, doubted
