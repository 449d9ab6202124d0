"""Columns of a block of messages, by the encoding of its connection."""

import json
from collections.abc import Callable, Iterator
from dataclasses import field
from typing import Any

import numpy as np

from groundstation.base.dataclasses import dataclass
from groundstation.base.records import MAX_TEXT_CHARACTERS, Column, Int64Array
from groundstation.base.units import NS_PER_S
from groundstation.readers.bags.definitions import DefinitionError, MessageDefinition, known, parse
from groundstation.readers.bags.messages import Connection, ConnectionBlock
from groundstation.readers.bags.shapes import (
    CDR,
    COUNT,
    MOST_COLUMNS,
    MOST_NUMBERS,
    MOST_PARTS,
    ROS1,
    Shape,
    ShapeError,
    at_any_byte,
    values_of,
    walk,
)
from groundstation.readers.bags.work import BYTES_PER_STEP, STEPS_PER_VALUE, StepBudget

DEEPEST = 32  # objects within objects
BYTES = "bytes"  # column of messages that cannot be read: how long they are
MOST_SHAPES = 64  # shapes kept for a connection: messages of ever new lengths are walked one by one


@dataclass(frozen=True, eq=False)
class DecodedMessages:
    """Columns of the messages ``rows`` of a block; those of one block do not overlap."""

    rows: Int64Array
    columns: dict[str, Column]


@dataclass
class Decoder:
    """Decoder of the messages of one connection.

    Attributes
    ----------
    reason : str
        Why no message of the connection can be read; empty where some can.
    unreadable : int
        Messages that could not be read so far.
    shortened : dict of str to None
        Arrays of which only the length is kept, in the order they were met.
    """

    connection: Connection
    reason: str = ""
    unreadable: int = 0
    shortened: dict[str, None] = field(default_factory=dict)
    _shapes: dict[tuple[int, tuple[tuple[int, int], ...]], Shape] = field(default_factory=dict)
    _definition: MessageDefinition | None = None
    _object: Callable[[bytes], Any] | None = None
    kinds: dict[str, str] = field(default_factory=dict)
    work: StepBudget = field(default_factory=lambda: StepBudget.of(0))
    given_up: int = 0
    left_out: int = 0

    def __post_init__(self) -> None:
        connection = self.connection
        if connection.encoding in ("cdr", "ros1"):
            self._definition, self.reason = _definition(connection)
        elif connection.encoding == "json":
            self._object = json.loads
        elif connection.encoding == "protobuf":
            from groundstation.store.foreign_protobuf import message_reader

            self._object = message_reader(connection.type, connection.schema)
            self.reason = "" if self._object else f"a definition of {connection.type} that cannot be used"
        elif connection.encoding == "flatbuffer":
            from groundstation.readers.bags.flatbuffer import message_reader as flatbuffer_reader

            try:
                self._object = flatbuffer_reader(connection.type, connection.schema)
            except DefinitionError as error:
                self.reason = f"a flatbuffer definition of {connection.type} that cannot be used ({error})"
        else:
            self.reason = f"encoding {connection.encoding!r}"

    @property
    def has_places(self) -> bool:
        """Tell whether the values of messages stand at places that many messages share."""
        return self._definition is not None and not self.reason

    def stands_at_one_place(self, name: str) -> bool:
        """Tell whether a value stands at one place in all messages."""
        shape = next(iter(self._shapes.values()), None)
        return shape is not None and shape.at_one_place(name) is not None

    def values_at_one_place(self, block: ConnectionBlock, name: str) -> tuple[Int64Array, Column] | None:
        """Return the rows of messages that are long enough, and one value of each.

        The value must stand at one place in all messages; None otherwise.
        """
        shape = next(iter(self._shapes.values()), None)
        leaf = shape.at_one_place(name) if shape is not None else None
        if shape is None or leaf is None:
            return None
        fits = block.sizes >= leaf.offset + leaf.dtype.itemsize
        if shape.start:
            place, mark = shape.guards[0]
            rows = np.flatnonzero(fits)
            words = at_any_byte(block.buffer, np.dtype(f"{shape.order}u4"))
            fits[rows] = words[block.starts[rows] + place] == mark
        rows = np.flatnonzero(fits)
        return rows, Column(values_of(leaf, block.buffer, block.starts[rows]))

    def decode(self, block: ConnectionBlock) -> Iterator[DecodedMessages]:
        """Yield columns of the messages; unreadable ones have their length alone."""
        bad: list[Int64Array] = []
        if self.reason:
            bad.append(np.arange(len(block), dtype=np.int64))
        elif self._object is not None:
            yield from self._objects(block, self._object, bad)
        else:
            yield from self._shaped(block, bad)
        rows = np.sort(np.concatenate(bad)) if bad else np.zeros(0, dtype=np.int64)
        if len(rows):
            self.unreadable += len(rows)
            yield _sizes(block, rows)

    def _shaped(self, block: ConnectionBlock, bad: list[Int64Array]) -> Iterator[DecodedMessages]:
        order = np.argsort(block.sizes, kind="stable")
        sizes = block.sizes[order]
        for group in np.split(order, np.flatnonzero(np.diff(sizes)) + 1):
            left = np.sort(group)
            for known_shape in [one for one in self._shapes.values() if one.size == int(block.sizes[left[0]])]:
                fits = known_shape.holds(block.buffer, block.starts[left])
                if fits.any():
                    yield _read(block, known_shape, left[fits])
                    left = left[~fits]
            while len(left):
                if self.work.steps < 0:
                    bad.append(left)
                    self.given_up += len(left)
                    break
                shape = self._walked(block.payload(int(left[0])))
                if shape is None:
                    bad.append(left[:1])
                    left = left[1:]
                    continue
                fits = shape.holds(block.buffer, block.starts[left])
                yield _read(block, shape, left[fits])
                left = left[~fits]

    def _walked(self, message: bytes) -> Shape | None:
        assert self._definition is not None
        how = ROS1 if self.connection.encoding == "ros1" else CDR.get(message[:2])
        if how is None:
            return None
        try:
            shape = walk(self._definition, message, how)
        except ShapeError as error:
            self.work.spend(STEPS_PER_VALUE * error.steps)
            return None
        self.work.spend(STEPS_PER_VALUE * (shape.steps + len(shape.leaves)))
        self.shortened.update(dict.fromkeys(shape.shortened))
        if len(self._shapes) < MOST_SHAPES:
            self._shapes[shape.size, shape.guards] = shape
        return shape

    def _objects(
        self, block: ConnectionBlock, read: Callable[[bytes], Any], bad: list[Int64Array]
    ) -> Iterator[DecodedMessages]:
        """Messages that a library reads one by one."""
        found: list[dict[str, Any]] = []
        rows: list[int] = []
        for row in range(len(block)):
            if not self.work.spend(int(block.sizes[row]) // BYTES_PER_STEP):
                bad.append(np.arange(row, len(block), dtype=np.int64))
                self.given_up += len(block) - row
                break
            try:
                flat: dict[str, Any] = {}
                _flatten(read(block.payload(row)), "", flat, self.shortened)
            except (ValueError, RecursionError, TypeError):
                bad.append(np.array([row], dtype=np.int64))
                continue
            self.work.spend(STEPS_PER_VALUE * len(flat))
            found.append(flat)
            rows.append(row)
        if not rows:
            return
        yield from self._laid_out(block, np.array(rows, dtype=np.int64), found)

    def _laid_out(
        self, block: ConnectionBlock, rows: Int64Array, found: list[dict[str, Any]]
    ) -> Iterator[DecodedMessages]:
        """Yield columns of flat objects; those without any value have their length."""
        columns: dict[str, Column] = {}
        for name in dict.fromkeys(name for one in found for name in one):
            if name not in self.kinds and len(self.kinds) >= MOST_COLUMNS:
                self.left_out += sum(name in one for one in found)
                continue
            values = [one.get(name) for one in found]
            kind = self.kinds.setdefault(name, _kind(next(value for value in values if value is not None)))
            if kind == "i" and self.connection.encoding == "json" and not name.endswith("_ns"):
                kind = self.kinds[name] = "f"  # text tells no integers from other numbers
            columns[name] = _column(values, kind)
        has_any = np.zeros(len(rows), dtype=bool)
        for column in columns.values():
            has_any |= column.mask
        if has_any.any():
            yield DecodedMessages(rows[has_any], {name: column.take(has_any) for name, column in columns.items()})
        if not has_any.all():
            yield _sizes(block, rows[~has_any])


def _read(block: ConnectionBlock, shape: Shape, rows: Int64Array) -> DecodedMessages:
    columns = shape.columns(block.buffer, block.starts[rows])
    return DecodedMessages(rows, columns) if columns else _sizes(block, rows)


def _sizes(block: ConnectionBlock, rows: Int64Array) -> DecodedMessages:
    return DecodedMessages(rows, {BYTES: Column(block.sizes[rows].astype(np.uint32))})


def _definition(connection: Connection) -> tuple[MessageDefinition | None, str]:
    """Return the definition of a connection, or the reason why there is none."""
    usual = {"ros1": "ros1msg", "cdr": "ros2msg"}[connection.encoding]
    try:
        found = known(connection.type) if connection.encoding == "cdr" else None
        if connection.schema_encoding == usual and (connection.schema or found is None):  # a type may have no field
            return parse(connection.type, connection.schema.decode("utf-8", "replace")), ""
    except DefinitionError as error:
        return None, f"a definition of {connection.type} that cannot be used ({error})"
    what = f"in {connection.schema_encoding}" if connection.schema else "without a definition in the file"
    return found, "" if found else f"type {connection.type} {what}"


def _flatten(value: Any, path: str, found: dict[str, Any], shortened: dict[str, None], depth: int = 0) -> None:
    """Numbers and texts of nested objects by their paths; a time of two numbers becomes one."""
    if depth > DEEPEST:
        shortened[path[:MAX_TEXT_CHARACTERS]] = None
    elif isinstance(value, dict):
        seconds, rest = value.get("sec"), value.get("nsec", value.get("nanos"))
        if len(value) == 2 and isinstance(seconds, int) and isinstance(rest, int):
            found[f"{path}_ns"] = seconds * NS_PER_S + rest
            return
        for name, part in value.items():
            _flatten(part, f"{path}.{name}" if path else str(name), found, shortened, depth + 1)
    elif isinstance(value, list):
        is_plain = not value or not isinstance(value[0], dict | list)
        if len(value) > (MOST_NUMBERS if is_plain else MOST_PARTS):
            shortened[path] = None
            found[path + COUNT] = len(value)
            return
        for number, part in enumerate(value):
            _flatten(part, f"{path}[{number}]", found, shortened, depth + 1)
    elif value is not None and len(found) < MOST_COLUMNS:
        found[path or "value"] = value


def _kind(value: Any) -> str:
    """Kind of a column by its first value: b, i, f or U as numpy has them."""
    if isinstance(value, bool):
        return "b"
    return {int: "i", float: "f"}.get(type(value), "U")


def _column(values: list[Any], kind: str) -> Column:
    """Return a column of one kind; values of another kind are absent."""
    if kind == "U":
        present = np.array([value is not None for value in values])
        texts = [str(value)[:MAX_TEXT_CHARACTERS] if value is not None else "" for value in values]
        return Column(np.array(texts), None if present.all() else present)
    fits = np.array([_fits(value, kind) for value in values])
    filled = [value if is_fit else 0 for value, is_fit in zip(values, fits.tolist(), strict=True)]
    dtype = {"b": np.bool_, "i": np.int64, "f": np.float64}[kind]
    return Column(np.array(filled, dtype=dtype), None if fits.all() else fits)


def _fits(value: Any, kind: str) -> bool:
    """Tell whether a value fits in a column of flags, 64-bit integers or other numbers."""
    if kind == "b" or isinstance(value, bool) or value is None:
        return kind == "b" and isinstance(value, bool)
    if not isinstance(value, int | float):
        return False
    if kind == "f":
        return isinstance(value, float) or abs(value) < 2**1023
    return isinstance(value, int) and -(2**63) <= value < 2**63
