"""Message formats that the log defines, as flat lists of columns with their offsets."""

import re
from collections.abc import Iterator, Mapping
from functools import cached_property
from typing import Any

import numpy as np

from groundstation.base.dataclasses import dataclass
from groundstation.base.errors import GroundstationError

DTYPES: Mapping[str, str] = {
    "int8_t": "i1", "uint8_t": "u1", "int16_t": "<i2", "uint16_t": "<u2", "int32_t": "<i4", "uint32_t": "<u4",
    "int64_t": "<i8", "uint64_t": "<u8", "float": "<f4", "double": "<f8", "bool": "u1", "char": "i1",
}  # fmt: skip
MAX_DATA_BYTES = 0xFFFF - 2
MAX_COLUMNS = 9_000  # columns of one topic; the store reads no more
MAX_DEPTH = 20
MAX_STEPS = 2_000_000  # steps of flattening all formats of a log
TIMESTAMP = "timestamp"
_FIELD = re.compile(r"([A-Za-z0-9_\-/]+)(?:\[(\d{1,6})\])? +(\S{1,200})")


@dataclass(frozen=True)
class FormatField:
    """A field as its format spells it; ``count`` is None unless it is an array."""

    type: str
    count: int | None
    name: str


@dataclass(frozen=True)
class MessageFormat:
    """A message format: name and fields."""

    name: str
    fields: tuple[FormatField, ...]


@dataclass(frozen=True)
class LayoutColumn:
    """Number in a message: its name (``q[0]``, ``a.b``), the log's type, and its offset.

    The offset counts from the start of the message's data.
    """

    name: str
    type: str
    offset: int


@dataclass(frozen=True)
class TopicLayout:
    """Columns of a topic and their places in a message's data.

    Parameters
    ----------
    columns : tuple of LayoutColumn
        Without padding.
    least_bytes, most_bytes : int
        Size of the data without and with the padding at its end, which a writer may leave out.
    """

    columns: tuple[LayoutColumn, ...]
    least_bytes: int
    most_bytes: int

    @cached_property
    def row_bytes(self) -> int:
        """Bytes of a row of gathered data, a multiple of eight so that numbers stay aligned."""
        return (self.least_bytes + 7) // 8 * 8

    @cached_property
    def dtype(self) -> np.dtype[Any]:
        """Structured type of a row; flags are bytes."""
        columns = self.columns
        return np.dtype(
            {
                "names": [column.name for column in columns],
                "formats": [DTYPES[column.type] for column in columns],
                "offsets": [column.offset for column in columns],
                "itemsize": self.row_bytes,
            }
        )

    @cached_property
    def flags(self) -> frozenset[str]:
        """Names of the columns of type bool."""
        return frozenset(column.name for column in self.columns if column.type == "bool")

    @cached_property
    def names(self) -> frozenset[str]:
        """Names of all columns."""
        return frozenset(column.name for column in self.columns)

    @cached_property
    def timestamp_offset(self) -> int | None:
        """Offset of the time of publication; None in a format without one."""
        return next((c.offset for c in self.columns if c.name == TIMESTAMP and c.type == "uint64_t"), None)


def parse_format(text: str) -> MessageFormat:
    """Read a format definition.

    Raises
    ------
    GroundstationError
        When it is none.

    Examples
    --------
    >>> parse_format("imu:uint64_t timestamp;float[3] rate;").fields[1]
    FormatField(type='float', count=3, name='rate')
    """
    name, colon, body = text.partition(":")
    fields = []
    for part in body.split(";"):
        if not part.strip():
            continue
        match = _FIELD.fullmatch(part.strip())
        if match is None:
            raise GroundstationError(f"format {name[:80]!r}", f"field {part[:80]!r}", "type[count] name")
        kind, count, field_name = match.groups()
        fields.append(FormatField(kind, None if count is None else int(count), field_name))
    if not (colon and name and fields):
        raise GroundstationError(f"format {text[:80]!r}", "no name or no fields")
    return MessageFormat(name, tuple(fields))


class Flattener:
    """Builder of layouts from formats, within a bound on the work of one log.

    Examples
    --------
    >>> pair = parse_format("pair:float a;uint8_t[4] _padding0;")
    >>> flight = parse_format("flight:uint64_t timestamp;pair[2] of;bool ok;")
    >>> layout = Flattener({"pair": pair, "flight": flight}).layout("flight")
    >>> [(column.name, column.offset) for column in layout.columns], layout.most_bytes
    ([('timestamp', 0), ('of[0].a', 8), ('of[1].a', 16), ('ok', 24)], 25)
    """

    def __init__(self, formats: Mapping[str, MessageFormat]) -> None:
        self._formats = formats
        self._steps = 0
        self._offset = 0

    def layout(self, name: str) -> TopicLayout:
        """Flatten a format and those nested in it.

        Raises
        ------
        GroundstationError
            When a format is missing, contains itself, or is larger than a message can be.
        """
        self._offset = 0
        columns = list(self._columns("", name, 0))
        most, end = self._offset, len(columns)
        while end and _is_padding(columns[end - 1]) and "." not in columns[end - 1].name:
            end -= 1
        least = most if end == len(columns) else columns[end].offset
        kept = [column for column in columns[:end] if not _is_padding(column)]
        if len(kept) > MAX_COLUMNS:
            raise GroundstationError(f"format {name!r}", f"{len(kept)} columns", f"at most {MAX_COLUMNS}")
        return TopicLayout(tuple(_unique(kept)), least, most)

    def _columns(self, prefix: str, format_name: str, depth: int) -> Iterator[LayoutColumn]:
        """Columns of a format under a prefix, depth first."""
        if depth > MAX_DEPTH:
            raise GroundstationError(f"format {format_name!r}", "formats nested without end", "", "the log is damaged")
        if format_name not in self._formats:
            raise GroundstationError(f"format {format_name!r}", "no definition of it")
        for part in self._formats[format_name].fields:
            for number in range(1 if part.count is None else part.count):
                name = f"{prefix}{part.name}" + ("" if part.count is None else f"[{number}]")
                self._steps += 1
                if self._steps > MAX_STEPS or self._offset > MAX_DATA_BYTES:
                    raise GroundstationError(f"format {format_name!r}", "more bytes than a message can have")
                if part.type in DTYPES:
                    yield LayoutColumn(name, part.type, self._offset)
                    self._offset += int(DTYPES[part.type][-1])
                else:
                    yield from self._columns(f"{name}.", part.type, depth + 1)


def _is_padding(column: LayoutColumn) -> bool:
    return column.name.rpartition(".")[2].startswith("_padding")


def _unique(columns: list[LayoutColumn]) -> Iterator[LayoutColumn]:
    """Yield columns with a number behind names that occur again."""
    taken: set[str] = set()
    for column in columns:
        name, copy = column.name, 1
        while name in taken:
            copy += 1
            name = f"{column.name}_{copy}"
        taken.add(name)
        yield column if name == column.name else LayoutColumn(name, column.type, column.offset)
