"""Values of records as columns.

Implied scales are applied, texts end at their first NUL, times are in nanoseconds.
"""

from collections.abc import Iterator
from dataclasses import field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from groundstation.base.angles import FloatArray
from groundstation.base.dataclasses import dataclass
from groundstation.base.records import Column, Int64Array, frozen
from groundstation.base.sorted_values import distinct
from groundstation.readers.dataflash.definitions import FieldSpec, RecordDefinition

LATEST_NS = 1 << 61  # 73 years after power-up: a time past it was not written by a clock


@dataclass(frozen=True, eq=False)
class RecordRows:
    """Records of one type, or of one instance of it, from one block.

    A column that was made is kept, read-only: raw and canonical topics share it.

    Parameters
    ----------
    definition : RecordDefinition
    instance : int or None
        Which of several sensors; None where the type has no instance field.
    record_index : ndarray of int64, shape (n,)
    time_ns : Column of int64, shape (n,)
        The autopilot's clock, nanoseconds since power-up; absent where the type has none.
    records : structured ndarray, shape (n,)
    """

    definition: RecordDefinition
    instance: int | None
    record_index: Int64Array
    time_ns: Column
    records: NDArray[Any]
    _made: dict[tuple[str, float | None], NDArray[Any]] = field(default_factory=dict, repr=False)

    def __len__(self) -> int:
        return len(self.record_index)

    def values(self, name: str) -> NDArray[Any]:
        """Column of one field that is no array, as :func:`column` gives it."""
        if (name, None) not in self._made:
            spec = self.definition.find(name)
            assert spec is not None, f"{self.definition.name} has no {name}"
            self._made[name, None] = frozen(column(self.records, spec))
        return self._made[name, None]

    def doubles(self, name: str, factor: float = 1.0) -> FloatArray:
        """Column of one field of numbers in double precision, times a factor.

        A signalling NaN is made a quiet one.
        """
        if (name, factor) not in self._made:
            with np.errstate(invalid="ignore"):
                values = self.values(name).astype(np.float64, copy=False)
            self._made[name, factor] = values if factor == 1.0 else frozen(values * factor)
        return self._made[name, factor]

    def columns(self) -> dict[str, Column]:
        """All columns; a field of 32 numbers becomes 32 columns."""
        found: dict[str, Column] = {}
        for spec in self.definition.fields:
            if spec.character == "a":
                found |= {f"{spec.name}_{at}": Column(_plain(self.records[spec.name][:, at])) for at in range(32)}
            elif self.definition.name == "FILE" and spec.character == "Z":
                found[spec.name] = Column(_hexadecimal(self.records[spec.name]))
            else:
                found[spec.name] = Column(self.values(spec.name))
        return found

    def take(self, which: Any) -> "RecordRows":
        """The rows that ``which`` (mask or positions) selects."""
        return RecordRows(
            self.definition, self.instance, self.record_index[which], self.time_ns.take(which), self.records[which]
        )


def rows_of(definition: RecordDefinition, records: NDArray[Any], record_index: Int64Array) -> RecordRows:
    """Rows of a type, all instances together."""
    return RecordRows(definition, None, record_index, device_time(definition, records), records)


def by_instance(rows: RecordRows, name: str) -> Iterator[RecordRows]:
    """Rows of each value of an instance field, by increasing value."""
    values = rows.values(name).astype(np.int64)
    for value in distinct(values).tolist():
        part = rows.take(np.flatnonzero(values == value))
        yield RecordRows(part.definition, value, part.record_index, part.time_ns, part.records)


def device_time(definition: RecordDefinition, records: NDArray[Any]) -> Column:
    """Return times of records; absent without a clock, and where a number is no time."""
    if definition.time_field is None:
        return Column(np.zeros(len(records), dtype=np.int64), np.zeros(len(records), dtype=bool))
    name, scale = definition.time_field
    values = records[name]
    if len(values) and values.max() <= LATEST_NS // scale and values.min() >= 0:
        time = values.astype(np.int64, order="C")
        time *= scale
        return Column(time)
    sound = values <= LATEST_NS // scale
    if values.dtype.kind == "i":
        sound &= values >= 0
    time = np.where(sound, values, 0).astype(np.int64) * scale
    return Column(time, None if sound.all() else sound)


def column(records: NDArray[Any], spec: FieldSpec) -> NDArray[Any]:
    """Return the values of one field, contiguous: scaled numbers, or texts."""
    values = records[spec.name]
    if spec.is_text:
        return texts(values)
    return values / spec.divisor if spec.divisor else _plain(values)


def _plain(values: NDArray[Any]) -> NDArray[Any]:
    if values.dtype != np.float16:
        return np.ascontiguousarray(values)
    with np.errstate(invalid="ignore"):
        return values.astype(np.float32)


def texts(values: NDArray[np.bytes_]) -> NDArray[np.str_]:
    """Return texts up to their first NUL, decoded as UTF-8, or else Latin-1.

    Examples
    --------
    >>> texts(np.array([b"GPS\\0x", b"\\xb5T", "µT".encode()], dtype="S8")).tolist()
    ['GPS', 'µT', 'µT']
    """
    width = values.dtype.itemsize
    raw = np.ascontiguousarray(values).view(np.uint8).reshape(len(values), width)
    raw = np.where(np.logical_or.accumulate(raw == 0, axis=1), 0, raw)
    cut = np.ascontiguousarray(raw, dtype=np.uint8).view(f"S{width}")[:, 0]
    if not (raw > 127).any():
        return cut.astype(f"U{width}")
    distinct, which = np.unique(cut, return_inverse=True)
    return np.array([_decoded(text) for text in distinct.tolist()], dtype=f"U{width}")[which]


def _decoded(text: bytes) -> str:
    try:
        return text.decode("utf-8")
    except UnicodeDecodeError:
        return text.decode("latin-1")


def _hexadecimal(values: NDArray[np.bytes_]) -> NDArray[np.str_]:
    """Return bytes as hexadecimal digits.

    They are of a file that the autopilot logged in pieces, and are no text.
    """
    width = values.dtype.itemsize
    digits = np.frombuffer(b"0123456789abcdef", dtype=np.uint8)
    raw = np.ascontiguousarray(values).view(np.uint8).reshape(len(values), width)
    both = np.stack((digits[raw >> 4], digits[raw & 15]), axis=2).reshape(len(values), 2 * width)
    return both.view(f"S{2 * width}")[:, 0].astype(f"U{2 * width}")
