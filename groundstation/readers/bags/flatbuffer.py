"""FlatBuffers messages as nested dictionaries.

They are read by the reflection schema (.bfbs) that their file carries. A message is a web of offsets. Each is held
against the ends of the message before it is followed, and the values that a message gives are counted: many offsets to
one table would unfold without end.

Source: FlatBuffers, Internals, and reflection/reflection.fbs (Google, 2025); https://flatbuffers.dev/internals.
"""

import struct
from collections.abc import Callable, Mapping
from dataclasses import field
from struct import Struct
from types import MappingProxyType
from typing import Any, NamedTuple

from groundstation.base.dataclasses import dataclass
from groundstation.base.records import MAX_TEXT_CHARACTERS
from groundstation.readers.bags.definitions import MOST_FIELDS, DefinitionError

DEEPEST = 16  # tables within tables
VALUES_PER_BYTE = 16  # and bytes of texts, beside MOST_FIELDS: defaults take no bytes, texts may be shared
_TEXT_BYTES = 4 * MAX_TEXT_CHARACTERS
_WORD, _BACK, _PLACE = Struct("<I"), Struct("<i"), Struct("<H")
_BOOL, _UBYTE, _STRING, _VECTOR, _OBJECT, _UNION, _ARRAY = 2, 4, 13, 14, 15, 16, 17
_NUMBERS: Mapping[int, Struct] = MappingProxyType(
    {number: Struct(f"<{form}") for number, form in enumerate(("B", "?", "b", "B", "h", "H", "i", "I", "q", "Q"), 1)}
    | {11: Struct("<f"), 12: Struct("<d")}
)
_OF_LISTS = (*_NUMBERS, _STRING, _OBJECT)
Reader = Callable[[bytes], dict[str, Any]]


class _Table(NamedTuple):
    """Table: its buffer, its place, and the place and size of its list of offsets."""

    data: bytes
    at: int
    offsets_at: int
    offsets_size: int

    def place(self, slot: int) -> int:
        """Place of a field by its slot in the list of offsets; 0 where it is absent."""
        offset = _PLACE.unpack_from(self.data, self.offsets_at + slot)[0] if slot + 2 <= self.offsets_size else 0
        return self.at + offset if offset else 0

    def number(self, slot: int, form: Struct, default: Any = 0) -> Any:
        place = self.place(slot)
        return form.unpack_from(self.data, place)[0] if place else default

    def text(self, slot: int) -> str:
        place = self.place(slot)
        return _text(self.data, place) if place else ""

    def table(self, slot: int) -> "_Table | None":
        place = self.place(slot)
        return _table(self.data, _followed(self.data, place)) if place else None

    def tables(self, slot: int) -> "list[_Table]":
        place = self.place(slot)
        if not place:
            return []
        count, first = _vector(self.data, place, 4)
        return [_table(self.data, _followed(self.data, first + 4 * number)) for number in range(count)]


def _table(data: bytes, at: int) -> _Table:
    offsets_at = at - _BACK.unpack_from(data, at)[0]
    if offsets_at < 0:
        raise ValueError("an offset that leads before the message")
    return _Table(data, at, offsets_at, _PLACE.unpack_from(data, offsets_at)[0])


def _followed(data: bytes, at: int) -> int:
    """Return the place that an offset leads to, always further on."""
    return int(at + _WORD.unpack_from(data, at)[0])


def _vector(data: bytes, at: int, width: int) -> tuple[int, int]:
    """Length of a vector and place of its first element."""
    start = _followed(data, at)
    count = _WORD.unpack_from(data, start)[0]
    if start + 4 + count * width > len(data):
        raise ValueError("a length that leads outside")
    return count, start + 4


def _text(data: bytes, at: int) -> str:
    count, first = _vector(data, at, 1)
    return data[first : first + min(count, _TEXT_BYTES)].decode("utf-8", "replace")


@dataclass(frozen=True)
class _Type:
    """Type of a field: base type, object or enumeration by number, and its elements.

    For elements: their base type, length and width.
    """

    base: int
    element: int
    index: int
    length: int

    @classmethod
    def of(cls, table: "_Table | None") -> "_Type":
        if table is None:
            return cls(0, 0, -1, 0)
        base, element = table.number(4, _NUMBERS[3]), table.number(6, _NUMBERS[3])
        return cls(base, element, table.number(8, _BACK, -1), table.number(10, _PLACE))


@dataclass(frozen=True)
class _Field:
    name: str
    type: _Type
    offset: int
    default: Any


@dataclass(frozen=True)
class _Object:
    fields: tuple[_Field, ...]
    is_struct: bool
    size: int


@dataclass(frozen=True)
class _Enumeration:
    """Names of an enumeration by value.

    For a union also the number of the object of each value, -1 for a text or nothing.
    """

    names: Mapping[int, str]
    objects: Mapping[int, int]


@dataclass(frozen=True)
class _Schema:
    objects: tuple[_Object, ...]
    enumerations: tuple[_Enumeration, ...]
    root: _Object


def message_reader(name: str, schema: bytes) -> Reader:
    """Return a function from the bytes of a message to its fields.

    Scalars that a message leaves out have their default; bytes are told by their length. The function raises ValueError
    for what is no such message.

    Raises
    ------
    DefinitionError
        When the schema cannot be used, or does not define the type ``name``.
    """
    try:
        known = _schema(name, schema)
    except (struct.error, ValueError) as error:
        raise DefinitionError("no reflection schema") from error

    def read(data: bytes) -> dict[str, Any]:
        try:
            return _Message(known, data).fields()
        except struct.error as error:
            raise ValueError("an offset that leads outside") from error

    return read


def _schema(name: str, data: bytes) -> _Schema:
    root = _table(data, _followed(data, 0))
    left = MOST_FIELDS
    objects, enumerations, names = [], [], []
    for table in root.tables(6):
        values = table.tables(6)
        left -= 1 + len(values)
        _require(left)
        enumerations.append(_enumeration(values))
    for table in root.tables(4):
        fields = table.tables(6)
        left -= 1 + len(fields)
        _require(left)
        names.append(table.text(4))
        objects.append(_object(table, fields))
    if name not in names:
        raise DefinitionError(f"no type {name} in it")
    return _Schema(tuple(objects), tuple(enumerations), objects[names.index(name)])


def _require(left: int) -> None:
    if left < 0:
        raise DefinitionError(f"more than {MOST_FIELDS} fields")


def _enumeration(values: list[_Table]) -> _Enumeration:
    names, objects = {}, {}
    for value in values:
        number, kind = value.number(6, _NUMBERS[9]), _Type.of(value.table(10))
        names[number] = value.text(4)
        objects[number] = kind.index if kind.base == _OBJECT else -1
    return _Enumeration(names, objects)


def _object(table: _Table, fields: list[_Table]) -> _Object:
    found = []
    for one in fields:
        kind = _Type.of(one.table(6))
        is_list = kind.base in (_VECTOR, _ARRAY)
        if not 1 <= kind.base <= _ARRAY or (is_list and kind.element not in _OF_LISTS):
            raise DefinitionError(f"field {one.text(4)[:60]!r} of a kind that is not known")
        form = _NUMBERS.get(kind.base)
        default: Any = None
        if form is not None and not one.number(26, _NUMBERS[2]):  # optional ones are absent where they are left out
            default = one.number(14, _NUMBERS[12], 0.0) if kind.base > 10 else one.number(12, _NUMBERS[9])
            default = bool(default) if kind.base == _BOOL else default
        found.append(_Field(one.text(4), kind, one.number(10, _PLACE), default))
    found.sort(key=lambda one: one.offset)
    return _Object(tuple(found), bool(table.number(8, _NUMBERS[2])), table.number(12, _BACK))


@dataclass
class _Message:
    """Reader of one message."""

    schema: _Schema
    data: bytes
    _left: int = field(init=False)

    def __post_init__(self) -> None:
        self._left = MOST_FIELDS + VALUES_PER_BYTE * len(self.data)

    def fields(self) -> dict[str, Any]:
        """Fields of the root table by name."""
        return self._object(self.schema.root, _followed(self.data, 0), 0)

    def _object(self, known: _Object, at: int, depth: int) -> dict[str, Any]:
        self._left -= 1 + len(known.fields)
        if depth > DEEPEST or self._left < 0:
            raise ValueError("parts within parts without end")
        table = None if known.is_struct else _table(self.data, at)
        found = {}
        for one in known.fields:
            place = at + one.offset if table is None else table.place(one.offset)
            if one.type.base == _UNION:
                value = None if table is None else self._union(one, table, place, depth)
            elif place:
                value = self._value(one.type, place, depth)
            else:
                value = self._named(one.type, one.default)
            if value is not None:
                found[one.name] = value
        return found

    def _value(self, kind: _Type, at: int, depth: int) -> Any:
        """Return a value that stands at a place, or that the place leads to."""
        if kind.base == _STRING:
            text = _text(self.data, at)
            self._left -= len(text)
            return text
        if kind.base == _OBJECT:
            known = self._known(kind.index)
            return self._object(known, at if known.is_struct else _followed(self.data, at), depth + 1)
        if kind.base == _ARRAY:
            return self._elements(kind, kind.length, at, depth)
        if kind.base == _VECTOR:
            count, first = _vector(self.data, at, self._width(kind))
            return self._elements(kind, count, first, depth)
        return self._named(kind, _NUMBERS[kind.base].unpack_from(self.data, at)[0])

    def _elements(self, kind: _Type, count: int, first: int, depth: int) -> Any:
        if kind.element == _UBYTE and kind.index < 0:
            return count
        self._left -= count
        if self._left < 0:
            raise ValueError("more values than bytes")
        width, one = self._width(kind), _Type(kind.element, 0, kind.index, 0)
        return [self._value(one, first + width * number, depth) for number in range(count)]

    def _width(self, kind: _Type) -> int:
        """Bytes from one element to the next."""
        if kind.element in _NUMBERS:
            return _NUMBERS[kind.element].size
        known = self._known(kind.index) if kind.element == _OBJECT else None
        return known.size if known is not None and known.is_struct and known.size > 0 else 4

    def _known(self, index: int) -> _Object:
        if not 0 <= index < len(self.schema.objects):
            raise ValueError("a type that is not defined")
        return self.schema.objects[index]

    def _named(self, kind: _Type, value: Any) -> Any:
        """Return a number, or its name where it is of an enumeration."""
        if value is None or not 0 <= kind.index < len(self.schema.enumerations):
            return value
        return self.schema.enumerations[kind.index].names.get(value, str(value))

    def _union(self, one: _Field, table: _Table, place: int, depth: int) -> Any:
        """Return the table of a union; the field before it states its kind."""
        if not place or not 0 <= one.type.index < len(self.schema.enumerations):
            return None
        objects = self.schema.enumerations[one.type.index].objects
        index = objects.get(table.number(one.offset - 2, _NUMBERS[1]), -1)
        if index < 0:
            return None
        return self._value(_Type(_OBJECT, 0, index, 0), place, depth)
