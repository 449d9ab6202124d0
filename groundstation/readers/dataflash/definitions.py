"""Record types as a log defines them: FMT definitions, units and multipliers.

Units and multipliers come from FMTU, UNIT and MULT records.

Source: ArduPilot, libraries/AP_Logger/README.md ("Format Types", "Units", "Multipliers") and LogStructure.h.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import field, replace
from functools import lru_cache
from types import MappingProxyType
from typing import Any

import numpy as np

from groundstation.base.dataclasses import dataclass

HEADER_BYTES = 3
FMT_ID = 128
FMT_BYTES = 89
FMT_DTYPE = np.dtype([("Type", "u1"), ("Length", "u1"), ("Name", "S4"), ("Format", "S16"), ("Columns", "S64")])

# Format character -> numpy type of its bytes.
_TYPES: Mapping[str, str] = MappingProxyType(
    {
        "b": "i1",
        "B": "u1",
        "M": "u1",
        "h": "<i2",
        "H": "<u2",
        "i": "<i4",
        "I": "<u4",
        "q": "<i8",
        "Q": "<u8",
        "f": "<f4",
        "d": "<f8",
        "g": "<f2",
        "n": "S4",
        "N": "S16",
        "Z": "S64",
        "a": "(32,)<i2",
        "c": "<i2",
        "C": "<u2",
        "e": "<i4",
        "E": "<u4",
        "L": "<i4",
    }
)
# Format characters that imply a scale: the stored integer is divided by this (dividing is exact to the last bit where
# multiplying by 0.01 is not).
DIVISORS: Mapping[str, float] = MappingProxyType({"c": 100.0, "C": 100.0, "e": 100.0, "E": 100.0, "L": 1e7})


@dataclass(frozen=True)
class Unit:
    """Unit of a field by FMTU: ``text`` ("Gauss"), and the multiplier of the stored number.

    ``multiplier`` is None where it is not given.
    """

    text: str = ""
    multiplier: float | None = None


@dataclass(frozen=True)
class FieldSpec:
    """Field of a record type: its name in the log and its format character.

    The character says how the field is stored.
    """

    name: str
    character: str

    @property
    def divisor(self) -> float | None:
        """Divisor that the format character implies for the stored integer; None without a scale."""
        return DIVISORS.get(self.character)

    @property
    def is_integer(self) -> bool:
        """Tell whether the value is a plain integer, without a scale of its own."""
        return self.character in "bBhHiIqQM"

    @property
    def is_text(self) -> bool:
        """Tell whether the value is text."""
        return self.character in "nNZ"


@dataclass(frozen=True)
class RecordDefinition:
    """One record type as its FMT record defines it.

    Parameters
    ----------
    type_id : int
        Third byte of every record of the type.
    length : int
        Bytes of a record with its header of three.
    name : str
        ``GPS``; characters other than letters, digits and ``_`` are replaced.
    fields : tuple of FieldSpec
        Empty when the format cannot be used: then records are counted, not read.
    dtype : numpy dtype
        Layout of a whole record, its item size being ``length``.
    fault : str
        Why the format cannot be used; empty when it can.
    """

    type_id: int
    length: int
    name: str
    fields: tuple[FieldSpec, ...]
    dtype: np.dtype[Any] = field(compare=False)
    fault: str = ""

    def __hash__(self) -> int:
        """Hash the little that tells most definitions apart: the fields take ten times as long."""
        return hash((self.type_id, self.length, self.name))

    def find(self, name: str) -> FieldSpec | None:
        """The field of a name, None when there is none."""
        return next((spec for spec in self.fields if spec.name == name), None)

    def has_numbers(self, *names: str) -> bool:
        """Tell whether all these fields exist and are numbers, scaled or not."""
        return all(
            (spec := self.find(name)) is not None and not spec.is_text and spec.character != "a" for name in names
        )

    def has_integers(self, *names: str) -> bool:
        """Tell whether all these fields exist and are integers without a scale."""
        return all((spec := self.find(name)) is not None and spec.is_integer for name in names)

    def has_texts(self, *names: str) -> bool:
        """Tell whether all these fields exist and are texts."""
        return all((spec := self.find(name)) is not None and spec.is_text for name in names)

    @property
    def time_field(self) -> tuple[str, int] | None:
        """Field that holds the autopilot's clock, and its unit in nanoseconds; None without one.

        It is the first field, ``TimeUS`` or (before 2015) ``TimeMS``. The old GPS types hold the satellites' time under
        that name and the autopilot's under ``T``; the old ACC and GYR types hold that of another clock.
        """
        first = self.fields[0] if self.fields else None
        if first is not None and first.is_integer:
            if first.name == "TimeUS":
                return "TimeUS", 1_000
            if first.name == "TimeMS" and not self.name.startswith(("ACC", "GYR", "GPS")):
                return "TimeMS", 1_000_000
        clock = self.find("T") if self.name in ("GPS", "GPS2") else None
        return ("T", 1_000_000) if clock is not None and clock.is_integer else None


def fmt_definition() -> RecordDefinition:
    """Return the definition of FMT records, which a log need not hold."""
    return parse(FMT_ID, FMT_BYTES, "FMT", "BBnNZ", ["Type", "Length", "Name", "Format", "Columns"])


@lru_cache(maxsize=256)  # both passes over a log meet the same ones
def parse_fmt(payload: bytes) -> RecordDefinition | None:
    """Parse the payload of a FMT record into a definition.

    None when no record could have the length that it states.
    """
    type_id, length, name, characters, labels = np.frombuffer(payload, FMT_DTYPE, 1)[0].item()
    if length < HEADER_BYTES:
        return None
    return parse(type_id, length, _text(name), _text(characters), _text(labels).split(","))


def parse(type_id: int, length: int, name: str, characters: str, labels: Sequence[str]) -> RecordDefinition:
    """Return a definition from the parts of a FMT record; a contradiction is a ``fault``.

    Examples
    --------
    >>> definition = parse(7, 3 + 8 + 2, "ATT", "Qc", ["TimeUS", "Roll"])
    >>> definition.time_field, definition.find("Roll").divisor, definition.dtype.itemsize, definition.fault
    (('TimeUS', 1000), 100.0, 13, '')
    >>> parse(7, 9, "ATT", "Qc", ["TimeUS", "Roll"]).fault
    'the format Qc takes 13 bytes, the record has 9'
    """
    safe_name = (
        "".join(letter if letter.isascii() and letter.isalnum() else "_" for letter in name) or f"type_{type_id}"
    )
    opaque = np.dtype((np.void, length))
    unknown = [character for character in characters if character not in _TYPES]
    if unknown:
        return RecordDefinition(
            type_id, length, safe_name, (), opaque, f"the format has the unknown character {unknown[0]!r}"
        )
    formats = [np.dtype(_TYPES[character]) for character in characters]
    offsets = [
        HEADER_BYTES,
        *(HEADER_BYTES + sum(kind.itemsize for kind in formats[: n + 1]) for n in range(len(formats))),
    ]
    if offsets[-1] > length:
        fault = f"the format {characters} takes {offsets[-1]} bytes, the record has {length}"
        return RecordDefinition(type_id, length, safe_name, (), opaque, fault)
    names = _distinct([*(label.strip() for label in labels), *([""] * len(formats))][: len(formats)])
    dtype = np.dtype({"names": names, "formats": formats, "offsets": offsets[:-1], "itemsize": length})
    fields = tuple(FieldSpec(label, character) for label, character in zip(names, characters, strict=True))
    return RecordDefinition(type_id, length, safe_name, fields, dtype)


def _distinct(labels: Sequence[str]) -> list[str]:
    """Return labels without empty and repeated ones."""
    names: list[str] = []
    for at, label in enumerate(labels):
        name = label or f"unnamed_{at + 1}"
        copy = 1
        while name in names:
            copy += 1
            name = f"{label or 'unnamed'}_{copy}"
        names.append(name)
    return names


def _text(raw: bytes) -> str:
    """ASCII text up to the first NUL; other bytes become ``?``."""
    return raw.partition(b"\0")[0].decode("ascii", errors="replace").replace("\ufffd", "?")


@dataclass
class Units:
    """Units, multipliers and instance fields of a log's types, by FMTU, UNIT and MULT records.

    An FMTU record applies to the definition that was in force: in logs joined end to end an id may be another type's.
    """

    texts: dict[str, str] = field(default_factory=dict)
    multipliers: dict[str, float] = field(default_factory=dict)
    of_definition: dict[RecordDefinition, tuple[str, str]] = field(default_factory=dict)

    def of(self, definition: RecordDefinition, name: str) -> Unit:
        """Unit of a field; an empty one when the log gives none."""
        unit_ids, multiplier_ids = self.of_definition.get(definition, ("", ""))
        at = next((at for at, spec in enumerate(definition.fields) if spec.name == name), len(definition.fields))
        unit = Unit(self.texts.get(unit_ids[at], "")) if at < len(unit_ids) else Unit()
        if at < len(multiplier_ids):
            unit = replace(unit, multiplier=self._multiplier(multiplier_ids[at]))
        return unit

    def _multiplier(self, code: str) -> float | None:
        """Return the multiplier of an id, or None.

        None for that of a text (0), one that was not worked out (``?``), and one that is no factor at all.
        """
        value = self.multipliers.get(code)
        return value if value is not None and code != "?" and 0.0 < value < math.inf else None

    def instance_field(self, definition: RecordDefinition) -> str | None:
        """Return the field that tells instances of a type apart (unit ``#``).

        None when there is none or it is a text.
        """
        at = self.of_definition.get(definition, ("", ""))[0].find("#")
        if not 0 <= at < len(definition.fields) or not definition.fields[at].is_integer:
            return None
        return definition.fields[at].name

    def describe(self, definition: RecordDefinition) -> str:
        """List the fields that have a unit, for people: ``"TimeUS s x 1e-06, GyrX rad/s"``.

        Implied scales are already in the values.
        """
        parts = []
        for spec in definition.fields:
            unit = self.of(definition, spec.name)
            if not unit.text or unit.text in ("UNKNOWN", "instance"):
                continue
            scale = None if spec.divisor else unit.multiplier
            plain = scale is None or math.isclose(scale, 1.0)
            parts.append(f"{spec.name} {unit.text}" + ("" if plain else f" x {scale:.7g}"))
        return ", ".join(parts)
