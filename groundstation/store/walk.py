"""Loops over messages that differ in length or fields: the store's only loops over rows.

They are compiled when there is much to walk. The interpreter walks the first short chunks of a process, as loading
numba takes half a second. Everything a loop reads may be hostile: each index is checked against the end before use.
"""

from collections.abc import Callable, Sequence
from functools import cache
from typing import Any

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
    numbers: Int64Array,
    wire_types: Int64Array,
    places: Int64Array,
    lengths: Int64Array,
    good: BoolArray,
) -> None:
    """Find where each field's value stands in each message's payload.

    ``numbers`` and ``wire_types`` (k,) are the fields asked for; ``places`` and ``lengths`` (n, k) receive the byte of
    the value (unchanged when absent) and the bytes of text, ``good`` (n,) whether the payload is protobuf. As in
    protobuf the last of repeated values counts and a field of another wire type is unknown. A bool's place is the
    first of its bytes that is not zero padding, so that this byte alone tells its value.
    """
    for row in range(len(starts)):
        at = starts[row] + HEAD_BYTES
        end = starts[row] + sizes[row]
        cursor, is_good = 0, True
        while at < end and is_good:
            key, shift, ended = 0, 0, False
            while at < end and shift < 35 and not ended:
                key |= (int(buffer[at]) & 0x7F) << shift
                ended = int(buffer[at]) < 0x80
                shift += 7
                at += 1
            wire_type = key & 7
            value, length = at, 0
            if not ended or key < 8:
                is_good = False
            elif wire_type == 0:
                value, shift, ended = -1, 0, False
                while at < end and shift < 70 and not ended:
                    if value < 0 and (int(buffer[at]) & 0x7F) != 0:
                        value = at
                    ended = int(buffer[at]) < 0x80
                    shift += 7
                    at += 1
                if value < 0:
                    value = at - 1  # all bytes say nothing: the last is a plain 0
                is_good = ended
            elif wire_type == 1:
                at += 8
            elif wire_type == 5:
                at += 4
            elif wire_type == 2:
                shift, ended = 0, False
                while at < end and shift < 35 and not ended:
                    length |= (int(buffer[at]) & 0x7F) << shift
                    ended = int(buffer[at]) < 0x80
                    shift += 7
                    at += 1
                value = at
                at += length
                is_good = ended
            else:
                is_good = False
            is_good = is_good and at <= end
            if is_good:
                for step in range(len(numbers)):
                    k = (cursor + step) % len(numbers)  # fields mostly come in order: the next is the likely one
                    if numbers[k] == key >> 3 and wire_types[k] == wire_type:
                        places[row, k] = value
                        lengths[row, k] = length
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


def locate_fields(messages: ChunkMessages, fields: Sequence[WireField]) -> tuple[Int64Array, Int64Array, BoolArray]:
    """Return places of values, bytes of texts, and which messages are protobuf.

    Places (-1: absent) and bytes are (n, fields), the last is (n,).
    """
    shape = len(messages), len(fields)
    places, lengths = np.full(shape, -1, np.int64), np.zeros(shape, np.int64)
    good = np.ones(len(messages), dtype=bool)
    numbers = np.array([field.number for field in fields], np.int64)
    wire_types = np.array([field.wire_type for field in fields], np.int64)
    function, data = walker.choose(fields_of, messages.buffer)
    function(data, messages.starts, messages.sizes, numbers, wire_types, places, lengths, good)
    return places, lengths, good
