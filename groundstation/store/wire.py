"""Conversion of columns to MCAP messages with protobuf payloads and back, by chunks.

A message record is a fixed head (opcode, length, channel, sequence, log and publish time) and a payload of
``tag value tag value ...``. As numbers have fixed width, rows with the same fields present differ in nothing but the
values: a chunk of such rows is a matrix of bytes, written and read by columns. Other rows are scattered to, or
gathered from, places that are computed first.

Sources: protobuf encoding, https://protobuf.dev/programming-guides/encoding; MCAP, https://mcap.dev/spec.
"""

from collections.abc import Iterable, Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from groundstation.base.dataclasses import dataclass
from groundstation.base.records import BoolArray, Column, Int64Array
from groundstation.base.sorted_values import distinct
from groundstation.store.marks import RECORD_PREFIX
from groundstation.store.messages import HEAD, MESSAGE_OPCODE, ByteArray, ChunkMessages, at_any_byte
from groundstation.store.schema import WireField, varint
from groundstation.store.walk import Located, locate_fields

MAX_TEXT_BYTES = 64 << 20  # matrix in which the texts of one piece are laid side by side
ROWS_ALIKE, MAX_PARTIAL = 512, 60  # rows with the same fields that are worth a matrix; fields that some rows lack

Rows = slice | NDArray[np.intp]
Block = tuple[Rows, bytes, ByteArray]  # rows, the bytes before each value, the values as (k, width)


class Slot(NamedTuple):
    """Values of one field on their way into messages.

    Parameters
    ----------
    prefix : bytes
        What stands before each value: the field's tag (text: its length follows, see ``lengths``).
    values : ndarray, shape (n,)
        In the dtype that is written; text as bytes (dtype kind ``S``).
    present : ndarray of bool, shape (n,), optional
        None: every value.
    lengths : ndarray of int, shape (n,), optional
        Bytes of each text; None for what has the width of its dtype.
    """

    prefix: bytes
    values: NDArray[Any]
    present: BoolArray | None = None
    lengths: NDArray[Any] | None = None

    @property
    def has_many_widths(self) -> bool:
        """Tell whether the texts that are present differ in length."""
        if self.lengths is None:
            return False
        lengths = self.lengths if self.present is None else self.lengths[self.present]
        return len(lengths) > 0 and bool(lengths.min() != lengths.max())

    def take(self, rows: Rows, present: BoolArray | None = None) -> "Slot":
        """Return the slot of some rows, which are present where ``present`` says."""
        return Slot(self.prefix, self.values[rows], present, None if self.lengths is None else self.lengths[rows])

    def alike(self) -> tuple[bytes, NDArray[Any]]:
        """Return the bytes before each value, and the values.

        For a slot whose values are all present and whose texts have one length.
        """
        if self.lengths is None:
            return self.prefix, self.values
        length = int(self.lengths[0])
        narrow = self.values.astype(f"S{length}", copy=False) if length else np.empty(len(self.values), "V0")
        return self.prefix + varint(length), narrow

    def blocks(self) -> Iterator[Block]:
        """Yield the rows whose bytes have one width.

        Their positions, the bytes before each value, the values as (k, width).
        """
        rows: Rows = slice(None)
        if self.present is not None and not self.present.all():
            rows = np.flatnonzero(self.present)
        values = np.ascontiguousarray(self.values[rows])
        if not len(values):
            return
        matrix = values.view(np.uint8).reshape(len(values), -1) if values.itemsize else np.empty((len(values), 0), "u1")
        if self.lengths is None:
            yield rows, self.prefix, matrix
            return
        lengths = self.lengths[rows]
        if lengths.min() == lengths.max():
            yield rows, self.prefix + varint(int(lengths[0])), matrix[:, : lengths[0]]
            return
        positions = np.arange(len(self.values)) if isinstance(rows, slice) else rows
        for length in distinct(lengths):
            chosen = np.flatnonzero(lengths == length)
            yield positions[chosen], self.prefix + varint(int(length)), matrix[chosen, :length]


def taken(slots: Sequence[Slot], rows: Rows) -> list[Slot]:
    """Return the slots of some rows; those that share a mask still do."""
    if isinstance(rows, slice) and rows.indices(len(slots[0].values)) == (0, len(slots[0].values), 1):
        return list(slots)
    masks = {id(mask): mask[rows] for mask in _masks(slots).values()}
    return [slot.take(rows, masks.get(id(slot.present))) for slot in slots]


def _masks(slots: Sequence[Slot]) -> dict[int, BoolArray]:
    """Return the different masks of slots."""
    return {id(slot.present): slot.present for slot in slots if slot.present is not None}


def slot_of(field: WireField, values: NDArray[Any], present: BoolArray | None) -> Slot:
    """Return the slot of a field; ``values`` in the field's wire dtype, or text."""
    if field.wire_dtype is not None:
        return Slot(field.tag, values, present)
    encoded = encode_text(values)
    return Slot(field.tag, encoded, present, np.strings.str_len(encoded))


def encode_text(values: NDArray[np.str_]) -> NDArray[np.bytes_]:
    """Encode texts as UTF-8, dtype kind ``S``.

    Each run of equal texts (modes, states) is encoded once.
    """
    if not len(values):
        return np.empty(0, "S1")
    starts = np.concatenate(([0], np.flatnonzero(values[1:] != values[:-1]) + 1))
    distinct = _utf8(values[starts])
    return np.repeat(distinct, np.diff(starts, append=len(values)))


def _utf8(values: NDArray[np.str_]) -> NDArray[np.bytes_]:
    characters = np.ascontiguousarray(values).view(np.uint32)
    if values.dtype.isnative and characters.max(initial=0) < 0x80:  # ASCII: a character is a byte
        return characters.astype(np.uint8).view(f"S{len(characters) // len(values)}")
    return np.strings.encode(values, "utf-8", "replace")


def encode(
    channel_id: int, first_sequence: int, log_time: Int64Array, publish_time: Int64Array, slots: Sequence[Slot]
) -> tuple[ByteArray, Int64Array]:
    """Encode rows as message records, in the order of the rows.

    Parameters
    ----------
    channel_id, first_sequence : int
        Sequence numbers count up from the first.
    log_time, publish_time : ndarray of int64, shape (n,)
        Nanoseconds, not negative.
    slots : sequence of Slot, each of n values
        In order of their field numbers.

    Returns
    -------
    buffer : ndarray of uint8
        The records, one after the other.
    starts : ndarray of int64, shape (n,)
        Where each record starts in the buffer.
    """
    count = len(log_time)
    sequence = np.arange(first_sequence, first_sequence + count).astype("<u4")
    head = [Slot(b"", sequence), Slot(b"", log_time), Slot(b"", publish_time)]  # what of HEAD differs from row to row
    groups = _alike(slots, count)
    if groups is None:
        return _scatter(channel_id, [*head, *slots])
    matrices = [(rows, _lay_out(channel_id, [*taken(head, rows), *of_rows])) for rows, of_rows in groups]
    if len(matrices) == 1:
        matrix = matrices[0][1]
        return matrix.reshape(-1), np.arange(count, dtype=np.int64) * matrix.shape[1]
    sizes = np.empty(count, np.int64)
    for rows, matrix in matrices:
        sizes[rows] = matrix.shape[1]
    starts = np.cumsum(sizes) - sizes
    out = np.empty(int(sizes.sum()), np.uint8)
    for rows, matrix in matrices:
        record = np.dtype(f"V{matrix.shape[1]}")
        at_any_byte(out, record)[starts[rows]] = matrix.view(record)[:, 0]
    return out, starts


def _blocks(slots: Iterable[Slot]) -> list[Block]:
    return [block for slot in slots for block in slot.blocks()]


def _alike(slots: Sequence[Slot], count: int) -> list[tuple[Rows, list[Slot]]] | None:
    """Return groups of rows that have the same fields present, with the slots of those.

    None where few are alike.
    """
    masks = {identity: mask for identity, mask in _masks(slots).items() if not mask.all()}
    absent = {identity for identity, mask in masks.items() if not mask.any()}
    partial = {identity: mask for identity, mask in masks.items() if identity not in absent}
    slots = [slot for slot in slots if id(slot.present) not in absent]
    if len(partial) > MAX_PARTIAL or any(slot.has_many_widths for slot in slots):
        return None
    if not partial:
        return [(slice(None), slots)]
    pattern = np.zeros(count, np.int64)
    for mask in partial.values():
        pattern = pattern * 2 + mask
    patterns = distinct(pattern).tolist()
    if len(patterns) * ROWS_ALIKE > count:
        return None
    groups: list[tuple[Rows, list[Slot]]] = []
    for one in patterns:
        rows = np.flatnonzero(pattern == one)
        lacking = {identity for identity, mask in partial.items() if not mask[rows[0]]}
        groups.append((rows, [slot.take(rows) for slot in slots if id(slot.present) not in lacking]))
    return groups


def _lay_out(channel_id: int, slots: Sequence[Slot]) -> ByteArray:
    """Return records that all have the same fields, shape (n, size).

    They are filled by columns over a copy of the constant bytes.
    """
    pairs = [slot.alike() for slot in slots]
    body = b"".join(prefix + bytes(values.itemsize) for prefix, values in pairs)
    head = _record_head(channel_id, len(body))
    size = len(head) + len(body)
    matrix = np.empty((len(slots[0].values), size), np.uint8)
    matrix[:] = np.frombuffer(head + body, np.uint8)
    at = len(head)
    for prefix, values in pairs:
        at += len(prefix)
        if values.itemsize:
            np.ndarray(values.shape, values.dtype, matrix, at, (size,))[...] = values
        at += values.itemsize
    return matrix


def _record_head(channel_id: int, rest_bytes: int) -> bytes:
    """Return opcode, length and channel of a record with so many bytes behind them."""
    return bytes([MESSAGE_OPCODE]) + (2 + rest_bytes).to_bytes(8, "little") + channel_id.to_bytes(2, "little")


def _scatter(channel_id: int, slots: Sequence[Slot]) -> tuple[ByteArray, Int64Array]:
    """Return records of mixed fields, and the start of each.

    Every block's bytes go to the next free place of its rows.
    """
    blocks = _blocks(slots)
    sizes = np.full(len(slots[0].values), len(_record_head(channel_id, 0)), np.int64)
    for rows, prefix, values in blocks:
        sizes[rows] += len(prefix) + values.shape[1]
    starts = np.cumsum(sizes) - sizes
    out = np.empty(int(sizes.sum()), np.uint8)
    free = starts.copy()
    heads = (
        Slot(bytes([MESSAGE_OPCODE]), sizes - RECORD_PREFIX),
        Slot(channel_id.to_bytes(2, "little"), np.empty(len(sizes), "V0")),
    )
    for rows, prefix, values in _blocks(heads) + blocks:
        width = len(prefix) + values.shape[1]
        block = np.empty((len(values), width), np.uint8)
        block[:, : len(prefix)] = np.frombuffer(prefix, np.uint8)
        block[:, len(prefix) :] = values
        at_any_byte(out, np.dtype(f"V{width}"))[free[rows]] = block.view(f"V{width}")[:, 0]
        free[rows] += width
    return out, starts


@dataclass(frozen=True)
class DecodedColumns:
    """Columns of some of a channel's messages.

    Parameters
    ----------
    columns : tuple of Column
        In the order of the fields asked for.
    taken : int
        How many messages were looked at.
    rows : ndarray of int, optional
        Positions of the messages that the columns hold; None: all. Messages that are no protobuf are left out.
    """

    columns: tuple[Column, ...]
    taken: int
    rows: Int64Array | None = None


def decode(messages: ChunkMessages, fields: Sequence[WireField]) -> Iterator[DecodedColumns]:
    """Yield columns of messages, one per field, mostly in one piece.

    Absent stays absent; fields that are not asked for are skipped. Text is as wide as the longest of a piece: pieces
    get smaller when a few long texts among many short ones would blow it up.
    """
    template = _template(messages, fields) if messages.stride else None
    if template is not None:
        columns = tuple(_column_of(messages, field, at) for field, at in zip(fields, template, strict=True))
        yield DecodedColumns(columns, len(messages))
        return
    located, good = locate_fields(messages, fields)
    if not good.all():
        none = np.empty(0, np.int64)
        yield DecodedColumns(tuple(absent_column(field, 0) for field in fields), int((~good).sum()), none)
        if not good.any():
            return
    texts = [k for k, field in enumerate(fields) if field.wire_dtype is None]
    pending = [np.flatnonzero(good)]
    while pending:
        rows = pending.pop()
        here = located if len(rows) == len(messages) else located.take(rows)
        if texts and len(rows) > 1 and len(rows) * int(here.lengths[texts].max(axis=1).sum()) > MAX_TEXT_BYTES:
            middle = len(rows) // 2
            pending += [rows[middle:], rows[:middle]]
            continue
        columns = tuple(_gathered_column(messages.buffer, field, here, k) for k, field in enumerate(fields))
        yield DecodedColumns(columns, len(rows), None if len(rows) == len(messages) else rows)


def _template(messages: ChunkMessages, fields: Sequence[WireField]) -> list[tuple[int, int] | None] | None:
    """Return place and width of each field's value in records laid out like the first.

    An absent field is None. The result is None when some record has another layout, or when the first has anything but
    the fields asked for, each once, with one-byte bools: such messages are walked one by one.
    """
    by_tag = {field.tag: k for k, field in enumerate(fields)}
    first = messages.matrix()[0].tobytes()
    found: list[tuple[int, int] | None] = [None] * len(fields)
    at = HEAD.itemsize
    while at < len(first):
        constant = at
        at = _after_varint(first, at)
        k = by_tag.get(first[constant:at])
        if k is None or found[k] is not None:
            return None
        dtype = fields[k].wire_dtype
        if dtype is None:
            size_at, at = at, _after_varint(first, at)
            width = sum((byte & 0x7F) << 7 * place for place, byte in enumerate(first[size_at:at]))
        else:
            width = dtype.itemsize
        if at + width > len(first):
            return None
        if not messages.is_alike(constant, at):
            return None
        if fields[k].wire_type == 0 and (messages.column(np.dtype("u1"), at) > 1).any():
            return None
        found[k] = (at, width)
        at += width
    return found


def _after_varint(data: bytes, at: int) -> int:
    """Return the place after the variable-length integer that starts at ``at``.

    At most five bytes are taken.
    """
    end = min(at + 5, len(data))
    while at < end and data[at] & 0x80:
        at += 1
    return at + 1


def _column_of(messages: ChunkMessages, field: WireField, place: tuple[int, int] | None) -> Column:
    if place is None:
        return absent_column(field, len(messages))
    at, width = place
    if field.wire_dtype is None:
        return Column(_decode_text(messages.matrix()[:, at : at + width]))
    return Column(messages.column(field.wire_dtype, at).astype(field.dtype))  # a copy, free of the chunk


def _gathered_column(buffer: ByteArray, field: WireField, located: Located, k: int) -> Column:
    """Return the column of a field, the ``k``-th that was located."""
    places = located.places[k]
    present = places >= 0
    count = np.count_nonzero(present)
    if not count:
        return absent_column(field, len(places))
    if field.wire_dtype is None:
        lengths = located.lengths[k]
        width = int(lengths.max(initial=0, where=present))
        inside = present[:, np.newaxis] & (np.arange(width) < lengths[:, np.newaxis])
        last = len(buffer) - 1
        matrix = buffer[np.minimum(places[:, np.newaxis] + np.arange(width), last)]
        values: NDArray[Any] = _decode_text(np.where(inside, matrix, 0).astype(np.uint8))
    elif field.wire_type == 0:
        values = buffer[places] != 0
    elif field.wire_type == 1 and len(located.words):
        values = located.words[k].view(field.wire_dtype).astype(field.dtype, copy=False)
    else:
        values = at_any_byte(buffer, field.wire_dtype)[places].astype(field.dtype, copy=False)
    if count == len(places):
        return Column(values)
    values[~present] = _filler(field)  # a place of -1 had the end of the buffer
    return Column(values, present)


def _filler(field: WireField) -> Any:
    return np.nan if field.dtype.kind == "f" else field.dtype.type()


def absent_column(field: WireField, count: int) -> Column:
    """Return a column of ``count`` absent values."""
    return Column(np.full(count, _filler(field), field.dtype), np.zeros(count, dtype=bool))


def _decode_text(matrix: ByteArray) -> NDArray[np.str_]:
    """Return the text of each row of UTF-8 bytes padded with zeros.

    Each run of equal rows is decoded once.
    """
    count, width = matrix.shape
    if not count or not width:
        return np.full(count, "", "U1")
    texts = np.ascontiguousarray(matrix).view(f"S{width}")[:, 0]
    starts = np.concatenate(([0], np.flatnonzero(texts[1:] != texts[:-1]) + 1))
    distinct = np.strings.decode(texts[starts], "utf-8", "replace")
    return np.repeat(distinct, np.diff(starts, append=count))
