"""Layouts of binary messages: a line of text lists the fields, numpy reads them.

``iTOW:u4 lon:i4/1e7+lonHp lonHp:i1/1e9 valid:x1(date time -:6) | numSvs gnssId:u1``: a field is its name and its
little-endian type (u, i, r, and c for texts, with a number of bytes); ``/1e7`` divides; ``+lonHp`` adds a finer part
that stands in a field of its own; ``x`` is a field of bits from the lowest on, one bit each unless a number says more;
``-`` is passed over; ``@12`` goes to a byte of the payload. Behind ``|`` stands the group that repeats: as often as the
field named first says, ``*`` to the end of the message. Behind another ``|`` stands how many bytes may follow.
"""

import re
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from groundstation.base.dataclasses import dataclass
from groundstation.base.records import Column

_TYPES = {"u": "<u", "i": "<i", "r": "<f", "c": "S", "x": "<u"}
_FIELD = re.compile(r"(?P<name>[\w-]+):(?P<kind>[uirxc])(?P<size>\d+)(?:/(?P<divisor>[\d.e]+))?(?:\+(?P<fine>\w+))?$")


@dataclass(frozen=True)
class LayoutField:
    """Field of a message: its name and the name of the structure's member.

    ``shift`` and ``width`` are those of bits, else -1 and 0.
    """

    name: str
    member: str
    divisor: float = 1.0
    shift: int = -1
    width: int = 0
    fine: str = ""


@dataclass(frozen=True, eq=False)
class LayoutPart:
    """Head of a message, or the group in it that repeats: a structure and its fields.

    ``ends`` is where each member ends, bytes: a message of an older version may be shorter.
    """

    dtype: np.dtype[Any]
    fields: tuple[LayoutField, ...]
    ends: dict[str, int]

    def values(self, records: NDArray[Any], name: str) -> NDArray[Any]:
        """Values of one field, which has no finer part."""
        field = next(field for field in self.fields if field.name == name)
        return _values(records, field, {})

    def columns(self, records: NDArray[Any], size: int | None = None) -> dict[str, Column]:
        """Values by name; members that end behind byte ``size`` of the payload are left out."""
        fine = {field.fine for field in self.fields if field.fine}
        divisors = {field.name: field.divisor for field in self.fields}
        return {
            field.name: Column(_values(records, field, divisors))
            for field in self.fields
            if field.name not in fine and (size is None or self.ends[field.fine or field.member] <= size)
        }


@dataclass(frozen=True, eq=False)
class MessageLayout:
    """Layout of a message: its head, the group that repeats, and the count of groups.

    ``count`` names the field with the number of groups (``*``: as many as fit).

    ``tail`` bytes may stand behind the groups; they are not read.
    """

    head: LayoutPart
    group: LayoutPart | None = None
    count: str = ""
    tail: int = 0

    @property
    def size(self) -> int:
        """Bytes of the head."""
        return self.head.dtype.itemsize

    @property
    def needed(self) -> int:
        """Bytes of the head without those behind its last field, which are passed over."""
        return max(self.head.ends.values())


@cache
def layout(text: str) -> MessageLayout:
    """Layout of a message from its line of text.

    Examples
    --------
    >>> short = layout("version:u1 -:u1 lon:i4/1e7 flags:x1(valid kind:3) | * id:u1 -:u1")
    >>> records = np.array([(1, 22_403_003, 0b0111)], dtype=short.head.dtype)
    >>> {name: column.values.tolist() for name, column in short.head.columns(records).items()}
    {'version': [1], 'lon': [2.2403003], 'valid': [True], 'kind': [3]}
    >>> short.count, short.group.dtype.itemsize
    ('*', 2)
    """
    head, group, tail = (*text.split("|"), "", "")[:3]
    count, _, repeated = group.strip().partition(" ")
    return MessageLayout(_part(head), _part(repeated) if group else None, count, int(tail or 0))


def _part(text: str) -> LayoutPart:
    names: list[str] = []
    types: list[str] = []
    offsets: list[int] = []
    fields: list[LayoutField] = []
    at = 0
    for word in re.findall(r"@\d+|[\w-]+:x\d+\([^)]*\)|\S+", text):
        if word.startswith("@"):
            at = int(word[1:])
            continue
        plain, _, bits = word.partition("(")
        match = _FIELD.match(plain)
        assert match is not None, word
        name, kind, size = match["name"], match["kind"], int(match["size"])
        if name != "-":
            names.append(name)
            types.append(f"{_TYPES[kind]}{size}" if kind != "c" else f"S{size}")
            offsets.append(at)
            plain_field = LayoutField(name, name, float(match["divisor"] or 1.0), fine=match["fine"] or "")
            fields += _bits(name, bits.rstrip(")")) if kind == "x" else [plain_field]
        at += size
    dtype = np.dtype({"names": names, "formats": types, "offsets": offsets, "itemsize": at})
    ends = {name: offset + np.dtype(kind).itemsize for name, kind, offset in zip(names, types, offsets, strict=True)}
    return LayoutPart(dtype, tuple(fields), ends)


def _bits(member: str, text: str) -> list[LayoutField]:
    fields, shift = [], 0
    for word in text.split():
        name, _, width = word.partition(":")
        if name != "-":
            fields.append(LayoutField(name, member, shift=shift, width=int(width or 1)))
        shift += int(width or 1)
    return fields


def _values(records: NDArray[Any], field: LayoutField, divisors: dict[str, float]) -> NDArray[Any]:
    values = records[field.member]
    if field.width:
        bits = (values >> values.dtype.type(field.shift)) & values.dtype.type((1 << field.width) - 1)
        return np.asarray(bits.astype(bool) if field.width == 1 else bits)
    if field.fine:
        finer = divisors[field.fine]
        whole = values.astype(np.int64) * round(finer / field.divisor) + records[field.fine]
        return np.asarray(whole / finer)
    if values.dtype.kind == "S":
        return np.asarray(np.char.decode(np.ascontiguousarray(values), "latin-1"))
    return np.asarray(values / field.divisor if field.divisor != 1.0 else values)
