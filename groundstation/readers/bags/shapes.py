"""Places of the values of a message, found once for all messages that are laid out alike.

A message of ROS has no offsets: values behind a text or a sequence move with its length. One message is walked; its
shape is the place of every value and every length met. All messages of the same size with the same lengths in the same
places have that shape, so numpy reads them together.

Source: OMG DDS-XTypes 1.3, 7.4.1 (CDR); http://wiki.ros.org/ROS/Technical%20Overview (ROS 1).
"""

from collections.abc import Mapping
from functools import cached_property
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from groundstation.base.dataclasses import dataclass
from groundstation.base.records import MAX_TEXT_CHARACTERS, BoolArray, Column, Int64Array
from groundstation.base.units import NS_PER_S
from groundstation.readers.bags.definitions import PRIMITIVES, TEXT, TIMES, WIDE_TEXT, MessageDefinition
from groundstation.readers.bags.messages import ByteArray

MOST_NUMBERS, MOST_PARTS = 64, 16  # elements of an array that become columns: of a longer one only the length is kept
MOST_COLUMNS = 2_000
MOST_STEPS = 100_000  # steps of a walk through one message
COUNT = ".count"  # added to the name of an array of which only the length is kept


class ShapeError(Exception):
    """Message that its definition does not describe; ``steps`` taken to find out."""

    steps: int = 0


@dataclass(frozen=True)
class Serialisation:
    """Serialisation of values: where they start, their byte order, their alignment.

    Parameters
    ----------
    start : int
        Byte of the first value; alignment counts from it.
    order : {'<', '>'}
    alignment : int
        Largest alignment of a number; 1 where numbers are not aligned.
    is_terminated : bool
        Texts end with a zero byte, which their length counts.
    """

    start: int
    order: Literal["<", ">"]
    alignment: int
    is_terminated: bool


ROS1 = Serialisation(0, "<", 1, is_terminated=False)
# The encapsulation that stands in the first two bytes of CDR.
CDR: Mapping[bytes, Serialisation] = {
    b"\0\0": Serialisation(4, ">", 8, is_terminated=True),
    b"\0\1": Serialisation(4, "<", 8, is_terminated=True),
    b"\0\6": Serialisation(4, ">", 4, is_terminated=True),  # XCDR 2
    b"\0\7": Serialisation(4, "<", 4, is_terminated=True),
}


class Leaf(NamedTuple):
    """Column of a message: its name, its place, and how it is read.

    ``kind`` is ``number``, ``bool``, ``time``, ``text`` or ``empty``.
    """

    name: str
    offset: int
    dtype: np.dtype[Any]
    kind: str


@dataclass(frozen=True)
class Shape:
    """Places of the values in all messages of one size with the same lengths.

    Parameters
    ----------
    size : int
    leaves : tuple of Leaf
    guards : tuple of (offset, value)
        Every length that was met; the first is the encapsulation of CDR.
    order : {'<', '>'}
    shortened : tuple of str
        Arrays of which the length alone is kept.
    start : int
        Byte of the first value; the encapsulation stands before it.
    steps : int
        Values that were passed to find it.
    """

    size: int
    leaves: tuple[Leaf, ...]
    guards: tuple[tuple[int, int], ...]
    order: str
    shortened: tuple[str, ...]
    start: int = 0
    steps: int = 0

    def holds(self, buffer: ByteArray, starts: Int64Array) -> BoolArray:
        """Tell which messages of this size have this shape, shape (n,)."""
        fits = np.ones(len(starts), dtype=bool)
        words = at_any_byte(buffer, np.dtype(f"{self.order}u4"))
        for offset, value in self.guards:
            fits &= words[starts + offset] == value
        return fits

    def at_one_place(self, name: str) -> Leaf | None:
        """Return the value of a name if it stands at one place in all messages of the type.

        No length before it may move it.
        """
        leaf = next((leaf for leaf in self.leaves if leaf.name == name), None)
        lengths = [offset for offset, _value in self.guards[1 if self.start else 0 :]]
        return None if leaf is None or any(offset < leaf.offset for offset in lengths) else leaf

    @cached_property
    def _dtype(self) -> np.dtype[Any]:
        return np.dtype(
            {
                "names": [leaf.name for leaf in self.leaves],
                "formats": [leaf.dtype for leaf in self.leaves],
                "offsets": [leaf.offset for leaf in self.leaves],
                "itemsize": self._reach,
            }
        )

    @cached_property
    def _reach(self) -> int:
        return max((leaf.offset + leaf.dtype.itemsize for leaf in self.leaves), default=0)

    def columns(self, buffer: ByteArray, starts: Int64Array) -> dict[str, Column]:
        """Columns of messages that have this shape."""
        if not self.leaves:
            return {}
        rows = at_any_byte(buffer, np.dtype(f"V{self._reach}"))[starts].view(self._dtype)
        return {leaf.name: Column(_values(rows[leaf.name], leaf.kind)) for leaf in self.leaves}


def values_of(leaf: Leaf, buffer: ByteArray, starts: Int64Array) -> NDArray[Any]:
    """Return one value of messages in which it stands at one place."""
    return _values(at_any_byte(buffer, leaf.dtype)[starts + leaf.offset], leaf.kind)


def at_any_byte(buffer: ByteArray, dtype: np.dtype[Any]) -> NDArray[Any]:
    """Return a view of a buffer whose entry ``k`` is the value that starts at byte ``k``.

    Entries overlap.
    """
    return np.ndarray((max(len(buffer) - dtype.itemsize + 1, 0),), dtype, buffer.data, strides=(1,))


def _values(values: NDArray[Any], kind: str) -> NDArray[Any]:
    if kind == "time":
        return values["s"].astype(np.int64) * NS_PER_S + values["ns"].astype(np.int64)
    if kind == "text":
        return decoded_text(values)
    if kind == "empty":
        return np.full(len(values), "", dtype="U1")
    if kind == "bool":
        return np.asarray(values != 0)
    return np.asarray(values.astype(values.dtype.newbyteorder("=")))


def decoded_text(values: NDArray[Any]) -> NDArray[np.str_]:
    """Decode UTF-8 texts; each different one is decoded once."""
    found, place = np.unique(values, return_inverse=True)
    texts = np.array([text.decode("utf-8", "replace").replace("\0", "") for text in found.tolist()], dtype=np.str_)
    return np.asarray(texts[place])


def walk(definition: MessageDefinition, message: bytes, serialisation: Serialisation) -> Shape:
    """Return the shape of a message.

    Raises
    ------
    ShapeError
        When the message ends before its definition does, or goes on behind it.
    """
    walker = _Walker(definition, message, serialisation)
    try:
        return _walked(walker, definition, message, serialisation)
    except ShapeError as error:
        error.steps = walker.steps
        raise


def _walked(walker: "_Walker", definition: MessageDefinition, message: bytes, serialisation: Serialisation) -> Shape:
    walker.part(definition.root, "")
    left = len(message) - walker.at
    if not 0 <= left < (serialisation.alignment if serialisation.alignment > 1 else 1):
        raise ShapeError(f"{left} bytes behind the last value")
    first = [(0, int.from_bytes(message[:4], "little" if serialisation.order == "<" else "big"))]
    guards = (first if serialisation.start else []) + walker.guards
    leaves, shortened = tuple(walker.leaves), tuple(walker.shortened)
    how = serialisation
    return Shape(len(message), leaves, tuple(guards), how.order, shortened, how.start, walker.steps)


class _Walker:
    """Walk through one message that notes the place of each value."""

    def __init__(self, definition: MessageDefinition, message: bytes, serialisation: Serialisation) -> None:
        self._types, self._message, self._how = definition.types, message, serialisation
        self._is_noted = True
        self.steps = 0
        self.at = serialisation.start
        self.leaves: list[Leaf] = []
        self.guards: list[tuple[int, int]] = []
        self.shortened: list[str] = []

    def part(self, name: str, prefix: str) -> None:
        """Walk through a message or a part of one."""
        fields = self._types[name]
        if not fields and self._how.alignment > 1:
            self._pass(1, 1)  # CDR has no empty type: ROS 2 writes a byte
        for field in fields:
            path = f"{prefix}{field.name}"
            if field.count is None:
                self.value(field.type, path)
            else:
                self.array(field.type, path, field.count)

    def array(self, kind: str, path: str, count: int) -> None:
        """Walk through an array of fixed length, or (-1) with its length before it."""
        is_told = count < 0
        if is_told:
            count = self._length()
        if count > (MOST_NUMBERS if kind in PRIMITIVES else MOST_PARTS) and self._is_noted:
            self.shortened.append(path)
            if is_told:
                self._note(Leaf(path + COUNT, self.at - 4, np.dtype(f"{self._how.order}u4"), "number"))
            self._is_noted = False
            self._elements(kind, path, count)
            self._is_noted = True
        else:
            self._elements(kind, path, count)

    def _elements(self, kind: str, path: str, count: int) -> None:
        if kind in PRIMITIVES and not self._is_noted and count:
            size = PRIMITIVES[kind].itemsize
            self._pass(size * count, size)
            return
        for number in range(count):
            self.value(kind, f"{path}[{number}]")

    def value(self, kind: str, path: str) -> None:
        """Walk over one value, or one part."""
        self.steps += 1
        if self.steps > MOST_STEPS:
            raise ShapeError("too many values")
        if kind in PRIMITIVES:
            dtype = PRIMITIVES[kind]
            place = self._pass(dtype.itemsize, dtype.itemsize)
            if kind == "bool":
                self._note(Leaf(path, place, np.dtype("u1"), "bool"))
            else:
                self._note(Leaf(path, place, dtype.newbyteorder(self._how.order), "number"))
        elif kind in TIMES:
            whole, rest = (dtype.newbyteorder(self._how.order) for dtype in TIMES[kind])
            self._note(Leaf(f"{path}_ns", self._pass(8, 4), np.dtype([("s", whole), ("ns", rest)]), "time"))
        elif kind == TEXT:
            self._text(path)
        elif kind == WIDE_TEXT:
            raise ShapeError("a wide text, which writers lay out differently")
        else:
            self.part(kind, f"{path}.")

    def _text(self, path: str) -> None:
        length = self._length()
        place = self._pass(length, 1)
        length -= self._how.is_terminated and length > 0
        if length:
            self._note(Leaf(path, place, np.dtype(f"S{min(length, MAX_TEXT_CHARACTERS)}"), "text"))
        else:
            self._note(Leaf(path, 0, np.dtype("S1"), "empty"))

    def _note(self, leaf: Leaf) -> None:
        if self._is_noted:
            if len(self.leaves) >= MOST_COLUMNS:
                raise ShapeError(f"more than {MOST_COLUMNS} values")
            self.leaves.append(leaf)

    def _length(self) -> int:
        place = self._pass(4, 4)
        value = int.from_bytes(self._message[place : place + 4], "little" if self._how.order == "<" else "big")
        self.guards.append((place, value))
        if value > len(self._message):
            raise ShapeError("a length that leads outside")
        return value

    def _pass(self, size: int, alignment: int) -> int:
        """Pass a value of so many bytes and return its place."""
        step = min(alignment, self._how.alignment)
        place = self.at + -(self.at - self._how.start) % step
        self.at = place + size
        if self.at > len(self._message):
            raise ShapeError("the message ends too early")
        return place
