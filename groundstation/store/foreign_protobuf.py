"""Protobuf messages of other programs as nested dictionaries.

They are decoded by the descriptors that their file carries.
"""

from collections.abc import Callable
from typing import Any

from google.protobuf.descriptor import Descriptor, FieldDescriptor
from google.protobuf.descriptor_pb2 import FileDescriptorSet
from google.protobuf.descriptor_pool import DescriptorPool
from google.protobuf.message import DecodeError
from google.protobuf.message_factory import GetMessageClass

DEEPEST = 16  # parts within parts
_TIMES = {"google.protobuf.Timestamp", "google.protobuf.Duration"}


def message_reader(name: str, descriptor_set: bytes) -> Callable[[bytes], dict[str, Any]] | None:
    """Return a function from the bytes of a message to its fields.

    None when the definition cannot be used.

    Fields without presence have their default where a message leaves them out; bytes are told by their length. The
    function raises ValueError for what is no such message.
    """
    try:
        pool = DescriptorPool()
        for file in FileDescriptorSet.FromString(descriptor_set).file:
            pool.Add(file)
        descriptor = pool.FindMessageTypeByName(name)
        kind = GetMessageClass(descriptor)
    except Exception:  # protobuf raises TypeError, KeyError and its own; all mean: a damaged definition
        return None

    def read(data: bytes) -> dict[str, Any]:
        try:
            return _fields(kind.FromString(data), descriptor, 0)
        except DecodeError as error:
            raise ValueError("no such message") from error

    return read


def _fields(message: Any, descriptor: Descriptor, depth: int) -> dict[str, Any]:
    if depth > DEEPEST:
        raise ValueError("parts within parts without end")
    if descriptor.full_name in _TIMES:
        return {"sec": message.seconds, "nsec": message.nanos}
    found: dict[str, Any] = {}
    for field in descriptor.fields:
        if field.is_repeated:
            if not _is_map(field):
                found[field.name] = [_value(item, field, depth) for item in getattr(message, field.name)]
        elif not field.has_presence or message.HasField(field.name):
            found[field.name] = _value(getattr(message, field.name), field, depth)
    return found


def _is_map(field: FieldDescriptor) -> bool:
    return field.message_type is not None and field.message_type.GetOptions().map_entry


def _value(value: Any, field: FieldDescriptor, depth: int) -> Any:
    if field.message_type is not None:
        return _fields(value, field.message_type, depth + 1)
    if field.enum_type is not None:
        known = field.enum_type.values_by_number.get(value)
        return known.name if known is not None else str(value)
    return len(value) if isinstance(value, bytes) else value
