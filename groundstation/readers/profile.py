"""Profile of a table: the rules that map its columns to canonical fields.

The value of a field is ``(number in the cell x scale x sign + offset)`` in ``unit``, brought to the field's unit.
docs/profiles.md describes every key of the TOML files that ``profile_file`` reads.
"""

import re
from collections.abc import Mapping
from dataclasses import field, replace
from pathlib import Path
from types import MappingProxyType

from groundstation.base.dataclasses import dataclass
from groundstation.base.signals import Field
from groundstation.readers.layout import Form, Key

# Unit of time -> (digits, multiple): it is 10**digits x multiple nanoseconds.
TIME_UNITS: Mapping[str, tuple[int, int]] = MappingProxyType(
    {"ns": (0, 1), "us": (3, 1), "ms": (6, 1), "s": (9, 1), "min": (9, 60), "h": (9, 3600)}
)


@dataclass(frozen=True)
class ColumnRule:
    """One column: the field it feeds, and ``number x factor + offset`` in the field's unit.

    ``north`` is that of a direction where the file says nothing else; ``unit_factor`` is the unit's part of the factor.
    A column that is optional is not missed. ``form``, ``values``, ``missing`` and ``part`` are those of
    :class:`groundstation.readers.layout.LayoutRule`. ``side``: the column of letters that gives the sign.
    """

    name: str
    topic: str
    field: Field
    factor: float = 1.0
    offset: float = 0.0
    unit_factor: float = 1.0
    north: str = ""
    is_optional: bool = False
    form: Form = ""
    values: tuple[tuple[str, float | str | bool], ...] = ()
    missing: tuple[str, ...] = ()
    part: int = 0
    side: str = ""

    @property
    def names(self) -> tuple[str, ...]:
        """Columns that the rule needs."""
        return (self.name, self.side) if self.side else (self.name,)


@dataclass(frozen=True)
class InputRule:
    """One input of a derived field: a field already known, or a column times ``factor``."""

    key: Key
    factor: float = 1.0
    column: str = ""


@dataclass(frozen=True)
class DerivedRule:
    """Fields of a topic that a method computes from other fields.

    The methods are :data:`groundstation.readers.layout.METHODS`.
    """

    method: str
    topic: str
    outputs: tuple[str, ...]
    inputs: tuple[InputRule, ...]


@dataclass(frozen=True)
class TimeColumns:
    """Time of a row: its kind, its columns, its unit.

    The kinds are those of :class:`groundstation.readers.layout.TimeRule`.

    ``is_utc``: date and time of kind ``local`` are UTC. ``has_tag``: a time tag of RTKLIB beside the file tells UTC.
    ``date``: key of the metadata that tells the day, for ``time_of_day``. ``earliest_year``: before it the format did
    not exist, for ``gps_week``.
    """

    kind: str
    columns: tuple[str, ...]
    unit: tuple[int, int] = TIME_UNITS["s"]
    date_formats: tuple[str, ...] = ()
    is_utc: bool = False
    has_tag: bool = False
    date: str = ""
    earliest_year: int = 0

    @property
    def asked(self) -> tuple[str, ...]:
        """Columns that a header row must have."""
        return self.columns[:2]


@dataclass(frozen=True)
class Variation:
    """Column of the magnetic variation, and the factor to degrees, east positive."""

    column: str
    factor: float


@dataclass(frozen=True)
class Profile:
    """A layout by column names, ready to be laid over a header row.

    ``header_tells``: the file's own names and rows of units settle unit, north and height where they say something, and
    a column may have its unit in parentheses behind its name. ``has_second_names``: a row of other names may follow.
    ``names`` are those of the columns of a file that has no header row. ``has_blanks``: blanks part the columns;
    ``widths``: they stand at fixed places. ``missing``: texts and numbers that mean no value. ``key``: the column that
    tells vehicles apart, each of which has a log of its own; ``only``: those that are read, all if empty.
    ``doubts``: question marks of a draft that nobody has taken away.
    """

    name: str
    path: Path
    description: str
    raw_topic: str
    first_lines: tuple[str, ...]
    required: tuple[str, ...]
    rows_after_header: int
    header_tells: bool
    has_second_names: bool
    time: TimeColumns
    variation: Variation | None = None
    names: tuple[str, ...] = ()
    has_blanks: bool = False
    widths: tuple[int, ...] = ()
    missing: tuple[str, ...] = ()
    key: str = ""
    only: tuple[str, ...] = ()
    columns: tuple[ColumnRule, ...] = ()
    derived: tuple[DerivedRule, ...] = ()
    constants: Mapping[str, str] = field(default_factory=dict)
    find: Mapping[str, re.Pattern[str]] = field(default_factory=dict)
    find_in_name: Mapping[str, re.Pattern[str]] = field(default_factory=dict)
    join: Mapping[str, str] = field(default_factory=dict)
    doubts: tuple[str, ...] = ()

    def for_file(self, name: str) -> "Profile":
        """Return the profile with the metadata that the name of a file tells."""
        matches = {key: pattern.search(name) for key, pattern in self.find_in_name.items()}
        told = {key: " ".join((match[1] or "").split()) for key, match in matches.items() if match}
        return replace(self, constants={**self.constants, **told}) if told else self

    @property
    def is_spaced(self) -> bool:
        """Tell whether no delimiter parts the columns."""
        return self.has_blanks or bool(self.widths)
