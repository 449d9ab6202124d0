"""Message types of the store's channels.

Those of canonical topics are compiled, all others are made at run time.

Fields 1 and 2 of every message are ``device_time_ns`` and ``record_index``; the topic's own fields follow from 3 on.
A message type describes its fields to numpy (:class:`WireField`) and itself to other programs (a descriptor set).
"""

import json
import re
from collections.abc import Iterable, Mapping, Sequence
from functools import cache
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
from google.protobuf.descriptor import Descriptor
from google.protobuf.descriptor_pb2 import DescriptorProto, FieldDescriptorProto, FileDescriptorProto, FileDescriptorSet
from google.protobuf.descriptor_pool import DescriptorPool

from groundstation.base.dataclasses import dataclass
from groundstation.base.errors import GroundstationError
from groundstation.base.signals import TOPICS, kind_of
from groundstation.store.marks import PACKAGE

DESCRIPTORS = Path(__file__).with_name("descriptors.binpb")
# Message of each canonical kind. `truth` has the fields of `ins`.
MESSAGE_OF_KIND: Mapping[str, str] = {
    kind: "".join(word.capitalize() for word in kind.split("_")) for kind in TOPICS if kind != "truth"
} | {"truth": "Ins"}
DEVICE_TIME, RECORD_INDEX = "device_time_ns", "record_index"
FIRST_OWN_NUMBER = 3
MAX_FIELDS = 10_000  # fields of a message that is read: working arrays grow with them
TEXT = np.dtype("U1")  # stands for text of any width

_Type = FieldDescriptorProto.Type
# How a value stands in a message: protobuf type, dtype of its bytes (None: text), protobuf's wire type.
_WIRE: Mapping[int, tuple[np.dtype[Any] | None, int]] = {
    _Type.TYPE_DOUBLE: (np.dtype("<f8"), 1),
    _Type.TYPE_FLOAT: (np.dtype("<f4"), 5),
    _Type.TYPE_SFIXED64: (np.dtype("<i8"), 1),
    _Type.TYPE_SFIXED32: (np.dtype("<i4"), 5),
    _Type.TYPE_FIXED64: (np.dtype("<u8"), 1),
    _Type.TYPE_FIXED32: (np.dtype("<u4"), 5),
    _Type.TYPE_BOOL: (np.dtype("?"), 0),
    _Type.TYPE_STRING: (None, 2),
}
# numpy kind and size of a column -> protobuf type. Numbers are never varints: their length would depend on the value.
_TYPE_OF_DTYPE: Mapping[str, int] = {
    "f8": _Type.TYPE_DOUBLE,
    "f4": _Type.TYPE_FLOAT,
    "i8": _Type.TYPE_SFIXED64,
    **dict.fromkeys(("i4", "i2", "i1"), _Type.TYPE_SFIXED32),
    "u8": _Type.TYPE_FIXED64,
    **dict.fromkeys(("u4", "u2", "u1"), _Type.TYPE_FIXED32),
    "b1": _Type.TYPE_BOOL,
    "U": _Type.TYPE_STRING,
}


def varint(value: int) -> bytes:
    """Encode an integer as protobuf's variable-length integer.

    Examples
    --------
    >>> varint(1), varint(300)
    (b'\\x01', b'\\xac\\x02')
    """
    out = bytearray()
    while value > 0x7F:
        out.append(value & 0x7F | 0x80)
        value >>= 7
    return bytes(out + bytes([value]))


@dataclass(frozen=True)
class WireField:
    """One field of a message and the column it carries.

    Parameters
    ----------
    name : str
        Name in the message, an identifier.
    number : int
    type : int
        ``FieldDescriptorProto.Type``.
    column : str
        Name of the column: the source's own spelling.
    dtype : numpy dtype
        Of the column as it was written and is read again; ``U1`` stands for text.
    """

    name: str
    number: int
    type: int
    column: str
    dtype: np.dtype[Any]

    @property
    def wire_dtype(self) -> np.dtype[Any] | None:
        """Dtype of the bytes in a message; None for text."""
        return _WIRE[self.type][0]

    @property
    def wire_type(self) -> int:
        """Protobuf wire type: 0 varint (bool), 1 eight bytes, 2 length-delimited, 5 four bytes."""
        return _WIRE[self.type][1]

    @property
    def tag(self) -> bytes:
        """Bytes that stand before the value."""
        return varint(self.number << 3 | self.wire_type)


@dataclass(frozen=True)
class MessageType:
    """A protobuf message with fields numpy can lay out.

    ``fields`` are in order of their numbers; the first two are ``device_time_ns`` and ``record_index``.
    """

    name: str
    fields: tuple[WireField, ...]
    descriptor_set: bytes

    @property
    def own_fields(self) -> tuple[WireField, ...]:
        """Fields of the topic itself, without the two common ones."""
        return self.fields[2:]


@cache
def _compiled_files() -> Mapping[str, FileDescriptorProto]:
    """Descriptor of each canonical message, by message name."""
    files = FileDescriptorSet.FromString(DESCRIPTORS.read_bytes()).file
    return {message.name: file for file in files for message in file.message_type}


@cache
def canonical_type(kind: str) -> MessageType:
    """Return the message type of a canonical topic kind (``"ins"``).

    It has every field of schemas/<kind>.proto.
    """
    file = _compiled_files()[MESSAGE_OF_KIND[kind]]
    return message_type(FileDescriptorSet(file=[file]).SerializeToString(), f"{PACKAGE}.{file.message_type[0].name}")


def message_type(descriptor_set: bytes, name: str, columns: str = "") -> MessageType:
    """Return the message type from what a file says of a channel.

    Parameters
    ----------
    descriptor_set : bytes
        Serialised ``FileDescriptorSet``, as in an MCAP schema record.
    name : str
        Full name of the message.
    columns : str, optional
        What :func:`columns_text` made: names and dtypes of the columns. Fields that it does not name get theirs from
        the descriptor.

    Raises
    ------
    GroundstationError
        When the descriptor cannot be used or its fields are not those of the store.
    """
    try:
        descriptor = _message_descriptor(descriptor_set, name)
        noted = {entry[0]: (entry[1], np.dtype(entry[2])) for entry in json.loads(columns or "[]")}
        fields = tuple(_wire_field(field, noted) for field in sorted(descriptor.fields, key=lambda field: field.number))
    except (GroundstationError, MemoryError):
        raise
    except Exception as error:  # protobuf raises TypeError, ValueError and its own; all mean: a damaged definition
        raise GroundstationError(f"schema {name!r}", f"unusable definition ({type(error).__name__})") from error
    if [field.name for field in fields[:2]] != [DEVICE_TIME, RECORD_INDEX] or len(fields) > MAX_FIELDS:
        raise GroundstationError(f"schema {name!r}", "a message that groundstation did not define")
    return MessageType(name, fields, descriptor_set)


def _message_descriptor(descriptor_set: bytes, name: str) -> Descriptor:
    pool = DescriptorPool()
    for file in FileDescriptorSet.FromString(descriptor_set).file:
        pool.Add(file)
    return pool.FindMessageTypeByName(name)


def _wire_field(field: Any, noted: Mapping[str, tuple[str, np.dtype[Any]]]) -> WireField:
    if field.type not in _WIRE or field.is_repeated:
        raise GroundstationError(f"field {field.full_name}", "a type that the store does not write")
    wire_dtype = _WIRE[field.type][0]
    column, dtype = noted.get(field.name, (field.name, TEXT if wire_dtype is None else wire_dtype))
    if _TYPE_OF_DTYPE.get(_dtype_key(dtype)) != field.type:
        dtype = TEXT if wire_dtype is None else wire_dtype
    return WireField(field.name, field.number, field.type, column, dtype)


def _dtype_key(dtype: np.dtype[Any]) -> str:
    return "U" if dtype.kind == "U" else f"{dtype.kind}{dtype.itemsize}"


def columns_text(fields: Iterable[WireField]) -> str:
    """Return names and dtypes of columns as one line of JSON, for the channel's metadata.

    Only this tells a reader that field ``Alt_ft`` was column ``Alt (ft)`` of int16, and which fields the log had.
    """
    entries = [[field.name, field.column, "U" if field.dtype.kind == "U" else field.dtype.str] for field in fields]
    return json.dumps(entries, ensure_ascii=False, separators=(",", ":"))


def own_columns(text: str) -> tuple[str, ...] | None:
    """Parse the field names that :func:`columns_text` noted; None when not usable."""
    try:
        return tuple(str(entry[0]) for entry in json.loads(text))
    except (ValueError, TypeError, LookupError, RecursionError):
        return None


class GrowingType:
    """Message type of one topic's channel, which grows with the columns of its batches.

    Canonical topics take their fields from the compiled schemas; every other topic gets a type made from its columns,
    numbered in order of their first appearance.

    Parameters
    ----------
    topic : str
    name : str
        Full name of the message for a topic that is not canonical.
    """

    def __init__(self, topic: str, name: str) -> None:
        self.topic = topic
        self._name = name
        kind = kind_of(topic)
        self._canonical = canonical_type(kind) if kind in MESSAGE_OF_KIND else None
        self.common_fields = canonical_type("event").fields[:2]
        self._fields: dict[str, WireField] = {}
        self._taken = {_name_key(DEVICE_TIME), _name_key(RECORD_INDEX)}

    def field_for(self, column: str, dtype: np.dtype[Any]) -> WireField:
        """Return the field that carries a column, a new one at its first appearance.

        Raises
        ------
        GroundstationError
            When a canonical topic has no such field, or the dtype cannot be stored.
        """
        if column not in self._fields:
            field = self._new_field(column, dtype) if self._canonical is None else self._canonical_field(column, dtype)
            self._fields[column] = field
        return self._fields[column]

    def is_rounded(self, field: WireField, dtype: np.dtype[Any]) -> bool:
        """Tell whether values are rounded to the single precision of a canonical field."""
        return self._canonical is not None and field.dtype == np.float32 and dtype == np.float64

    def _canonical_field(self, column: str, dtype: np.dtype[Any]) -> WireField:
        assert self._canonical is not None
        for field in self._canonical.own_fields:
            if field.name == column:
                return field
        names = ", ".join(field.name for field in self._canonical.own_fields)
        raise GroundstationError(f"topic {self.topic}", f"column {column!r}", f"one of {names}", "keep it under raw.*")

    def _new_field(self, column: str, dtype: np.dtype[Any]) -> WireField:
        proto_type = _TYPE_OF_DTYPE.get(_dtype_key(dtype))
        if proto_type is None:
            raise GroundstationError(f"topic {self.topic}, column {column}", f"dtype {dtype}", "numbers, bool or text")
        name = base = identifier(column)
        copy = 1
        while _name_key(name) in self._taken:
            copy += 1
            name = f"{base}_{copy}"
        self._taken.add(_name_key(name))
        kept = TEXT if dtype.kind == "U" else dtype.newbyteorder("<")
        return WireField(name, FIRST_OWN_NUMBER + len(self._fields), proto_type, column, kept)

    @property
    def own_fields(self) -> tuple[WireField, ...]:
        """Fields of the columns met so far, in order of their numbers."""
        return tuple(sorted(self._fields.values(), key=lambda field: field.number))

    def message_type(self, units: Mapping[str, str] = MappingProxyType({})) -> MessageType:
        """Return the type as it stands now.

        ``units`` of columns, as the source tells them, describe fields made for them.
        """
        if self._canonical is not None:
            return self._canonical
        fields = (*self.common_fields, *self.own_fields)
        return MessageType(self._name, fields, _describe(self._name, fields, units))


def identifier(text: str) -> str:
    """Return the protobuf field name for a column's name.

    Examples
    --------
    >>> identifier("Alt (ft)"), identifier("2nd"), identifier("Курс")
    ('Alt_ft', 'f_2nd', 'f')
    """
    name = re.sub(r"[^A-Za-z0-9]+", "_", text).strip("_")
    return name if re.match(r"[A-Za-z]", name) else f"f_{name}".rstrip("_")


def _name_key(name: str) -> str:
    """Return the form of a name that must differ between fields of a message.

    Protobuf's JSON names drop underscores and change case.
    """
    return name.replace("_", "").lower()


def _describe(name: str, fields: Sequence[WireField], units: Mapping[str, str]) -> bytes:
    """Return the serialised descriptor set of a message type made at run time.

    Every field has explicit presence.

    A field's unit is its comment, as if it stood before it in a .proto file.
    """
    package, _, message_name = name.rpartition(".")
    message = DescriptorProto(name=message_name)
    for index, field in enumerate(fields):
        message.field.add(
            name=field.name,
            number=field.number,
            type=field.type,
            label=FieldDescriptorProto.LABEL_OPTIONAL,
            proto3_optional=True,
            oneof_index=index,
        )
        message.oneof_decl.add(name=f"_{field.name}")  # proto3 `optional` is a oneof of one
    file = FileDescriptorProto(name=f"{name}.proto", package=package, syntax="proto3", message_type=[message])
    for index, field in enumerate(fields):
        if field.column in units:
            path = [FileDescriptorProto.MESSAGE_TYPE_FIELD_NUMBER, 0, DescriptorProto.FIELD_FIELD_NUMBER, index]
            file.source_code_info.location.add(path=path, span=[0, 0, 0], leading_comments=f" {units[field.column]}\n")
    return FileDescriptorSet(file=[file]).SerializeToString()
