"""Loops over messages that differ in length or fields: the store's only loops over rows.

They are compiled when there is much to walk. The interpreter walks the first short chunks of a process, as loading
numba takes half a second. Everything a loop reads may be hostile: each index is checked against the end before use.
"""

from collections.abc import Callable, Sequence
from functools import cache
from typing import Any, NamedTuple

import numpy as np

from groundstation.base.compile import in_place
from groundstation.base.records import BoolArray, Int64Array
from groundstation.store.marks import RECORD_PREFIX
from groundstation.store.messages import HEAD, MESSAGE_OPCODE, ByteArray, ChunkMessages
from groundstation.store.schema import WireField

INTERPRETED_BYTES = 200_000  # in all, about 0.2 s of the interpreter
HEAD_BYTES = HEAD.itemsize


def record_starts(buffer: Any, starts: Int64Array, sizes: Int64Array) -> int:
    """Find the message records of a chunk and return their number.

    -1 when the records do not fill the chunk exactly.

    Records that are no messages (schemas and channels may stand in chunks) are passed over. ``starts`` and ``sizes``,
    each long enough for a chunk full of the shortest messages, receive place and size.
    """
    at, count, end = 0, 0, len(buffer)
    while at < end:
        if end - at < RECORD_PREFIX:
            return -1
        length = 0
        for k in range(8):
            length = (length << 8) | int(buffer[at + 8 - k])
            if length > end:
                return -1
        if length > end - at - RECORD_PREFIX:
            return -1
        if buffer[at] == MESSAGE_OPCODE:
            if length < HEAD_BYTES - RECORD_PREFIX:
                return -1
            starts[count] = at
            sizes[count] = length + RECORD_PREFIX
            count += 1
        at += length + RECORD_PREFIX
    return count


def fields_of(
    buffer: Any,
    starts: Int64Array,
    sizes: Int64Array,
    keys: Int64Array,
    places: Int64Array,
    lengths: Int64Array,
    words: Int64Array,
    good: BoolArray,
) -> None:
    """Find where each field's value stands in each message's payload.

    ``keys`` (k,) are the tags of the fields asked for: number times eight, and wire type. ``places`` and ``lengths``
    (k, n) receive the byte of the value (unchanged when absent) and the bytes of text, ``words`` (k, n) values of eight
    bytes unless it is empty, ``good`` (n,) whether the payload is protobuf. As in protobuf the last of repeated values
    counts and a field of another wire type is unknown. A bool's place is the first of its bytes that is not zero
    padding, so that this byte alone tells its value.
    """
    count = len(keys)
    for row in range(len(starts)):
        at = starts[row] + HEAD_BYTES
        end = starts[row] + sizes[row]
        cursor, is_good = 0, True
        while at < end and is_good:
            key, shift, ended = 0, 0, False
            while at < end and shift < 35 and not ended:
                byte = int(buffer[at])
                key |= (byte & 0x7F) << shift
                ended = byte < 0x80
                shift += 7
                at += 1
            wire_type = key & 7
            value, length = at, 0
            if not ended or key < 8:
                is_good = False
            elif wire_type == 1:
                at += 8
            elif wire_type == 5:
                at += 4
            elif wire_type == 0 or wire_type == 2:
                value, shift, ended = -1, 0, False
                while at < end and shift < 70 and not ended:
                    byte = int(buffer[at])
                    if value < 0 and (byte & 0x7F) != 0:
                        value = at
                    if shift < 35:
                        length |= (byte & 0x7F) << shift
                    ended = byte < 0x80
                    shift += 7
                    at += 1
                is_good = ended and (wire_type == 0 or shift <= 35)
                if wire_type == 2:
                    value = at
                    at += length
                elif value < 0:
                    value = at - 1  # all bytes say nothing: the last is a plain 0
            else:
                is_good = False
            is_good = is_good and at <= end
            if is_good:
                for step in range(count):
                    k = cursor + step  # fields mostly come in order: the next is the likely one
                    if k >= count:
                        k -= count
                    if keys[k] == key:
                        places[k, row] = value
                        if wire_type == 2:
                            lengths[k, row] = length
                        elif wire_type == 1 and len(words) > 0 and value >= 0:  # known: all eight are one load
                            word = 0
                            for byte_at in range(8):
                                word |= int(buffer[value + byte_at]) << (8 * byte_at)
                            words[k, row] = word
                        cursor = k + 1
                        break
        good[row] = is_good


@cache
def _compiled(function: Callable[..., Any]) -> Callable[..., Any]:
    return in_place(function)


class Walker:
    """Choice of who walks: the interpreter at first, then compiled code.

    The interpreter walks the first ``interpreted_bytes``.
    """

    def __init__(self, interpreted_bytes: int) -> None:
        self.left = interpreted_bytes

    def choose(self, function: Callable[..., Any], buffer: ByteArray) -> tuple[Callable[..., Any], Any]:
        """Return the function, and the buffer in the form that is fastest for it."""
        if len(buffer) > self.left:
            self.left = 0
            return _compiled(function), buffer
        self.left -= len(buffer)
        return function, buffer.tobytes()


walker = Walker(INTERPRETED_BYTES)


def find_messages(buffer: ByteArray) -> tuple[Int64Array, Int64Array] | None:
    """Return the places and sizes of a chunk's message records.

    None when the chunk is not a row of whole records.
    """
    room = len(buffer) // HEAD_BYTES + 1
    starts, sizes = np.empty(room, np.int64), np.empty(room, np.int64)
    function, data = walker.choose(record_starts, buffer)
    count = function(data, starts, sizes)
    return None if count < 0 else (starts[:count].copy(), sizes[:count].copy())


class Located(NamedTuple):
    """Values of fields in messages.

    Parameters
    ----------
    places, lengths : ndarray of int64, shape (fields, n)
        Byte of each value in the buffer (-1: absent), and the bytes of text.
    words : ndarray of int64, shape (fields, n) or (0, 0)
        Values of eight bytes, where compiled code has taken them: numpy takes five times as long where they lie.
    """

    places: Int64Array
    lengths: Int64Array
    words: Int64Array

    def take(self, rows: Int64Array) -> "Located":
        """Return the values of some messages."""
        return Located(*(matrix[:, rows] if len(matrix) else matrix for matrix in self))


def locate_fields(messages: ChunkMessages, fields: Sequence[WireField]) -> tuple[Located, BoolArray]:
    """Return the values of fields, and which messages are protobuf, shape (n,)."""
    shape = len(fields), len(messages)
    function, data = walker.choose(fields_of, messages.buffer)
    words = np.empty((0, 0) if function is fields_of else shape, np.int64)
    located = Located(np.full(shape, -1, np.int64), np.zeros(shape, np.int64), words)
    good = np.ones(len(messages), dtype=bool)
    keys = np.array([field.number << 3 | field.wire_type for field in fields], np.int64)
    function(data, messages.starts, messages.sizes, keys, *located, good)
    return located, good
