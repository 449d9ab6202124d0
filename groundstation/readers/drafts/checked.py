"""Check of a profile against a table: what each column became, what is missing."""

from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import field, replace
from pathlib import Path

import numpy as np

from groundstation.base.dataclasses import dataclass
from groundstation.base.records import Column, Damage, RecordBatch, Remark
from groundstation.base.signals import field_of
from groundstation.readers import csv_profile
from groundstation.readers.drafts.causes import cause_of_numbers, cause_of_times
from groundstation.readers.drafts.nearest import nearest_names
from groundstation.readers.drafts.sample import TableSample, sample_of
from groundstation.readers.layout import METHODS, Key, LayoutRule, TableLayout
from groundstation.readers.profile_file import load
from groundstation.readers.profile_fit import Fit
from groundstation.readers.profile_table import laid
from groundstation.readers.source import Source


@dataclass(frozen=True)
class ColumnCheck:
    """One column of a table: what it became, its values, what is odd.

    ``became`` is ``time``, a field, or empty for one that is left; ``values`` counts those that could be read. A column
    that feeds several fields has one of these for each; ``is_first`` marks the first.
    """

    name: str
    became: str
    unit: str = ""
    values: int = 0
    shown: str = ""
    cause: str = ""
    is_first: bool = True


@dataclass(frozen=True)
class MissingColumn:
    """Column that a profile names and a table lacks; ``near`` are the columns that it may be."""

    name: str
    target: str
    near: tuple[str, ...]

    @property
    def text(self) -> str:
        """The column, and those nearest to it."""
        near = f": nearest {', '.join(map(repr, self.near))}" if self.near else ": no column is like it"
        return f"column {self.name!r} ({self.target}) is not there{near}"


@dataclass(frozen=True)
class ProfileCheck:
    """Check of a profile against a table.

    ``header`` is the line of the header row, 0 where there is none; ``rows`` counts the rows that could be read.
    """

    profile: str
    table: str
    header: int
    delimiter: str
    encoding: str
    rows: int
    columns: tuple[ColumnCheck, ...]
    derived: tuple[str, ...]
    missing: tuple[MissingColumn, ...]
    remarks: tuple[Remark, ...]
    damages: tuple[Damage, ...]

    @property
    def causes(self) -> tuple[str, ...]:
        """Columns whose cells cannot be read, and why."""
        told = " ".join(damage.what for damage in self.damages)
        return tuple(f"column {one.name!r}: {one.cause}" for one in self.columns if one.cause and one.cause not in told)

    @property
    def has_lost_data(self) -> bool:
        """Tell whether cells or rows of the table were lost."""
        return any(damage.loses_data for damage in self.damages)


@dataclass
class _Values:
    """Values of one field that were read."""

    count: int = 0
    low: float = np.inf
    high: float = -np.inf
    words: dict[str, None] = field(default_factory=dict)

    def add(self, column: Column) -> None:
        values = column.values[column.mask]
        self.count += len(values)
        if values.dtype.kind == "f":
            known = values[np.isfinite(values)]
            if len(known):
                self.low, self.high = min(self.low, float(known.min())), max(self.high, float(known.max()))
        elif len(self.words) < 4:
            self.words |= dict.fromkeys(map(str, np.unique(values[:1000])[:4]))

    @property
    def shown(self) -> str:
        """Range of the numbers, or some of the words."""
        if np.isfinite(self.low):
            low, high = f"{self.low:.7g}", f"{self.high:.7g}"
            return low if low == high else f"{low} to {high}"
        words = [word if len(word) <= 24 else f"{word[:21]}..." for word in self.words]
        return ", ".join(words[:3]) + (", ..." if len(words) > 3 else "")


def check_profile(path: Path, table: Path) -> ProfileCheck:
    """Read a table by a profile, and tell what each column became.

    Raises
    ------
    SettingsError
        When the profile cannot be used.
    UnreadableLogError
        When the table has no header row of the profile, or cannot be read.
    """
    profile, source = load(path), Source(table)
    fit, layout = laid(source, profile)
    values: dict[Key, _Values] = {}
    remarks, damages = list[Remark](), list[Damage]()
    rows, timed = Counter[str](), 0
    for item in csv_profile.read(source, path):
        if isinstance(item, RecordBatch):
            for name, column in item.columns.items():
                values.setdefault((item.topic, name), _Values()).add(column)
            rows[item.topic] += len(item)
            timed += int(np.count_nonzero(item.device_time_ns.mask))
        elif isinstance(item, Remark):
            remarks.append(item)
        elif isinstance(item, Damage):
            damages.append(item)
    columns = tuple(_columns(fit, layout, values, is_timed=timed > 0))
    if any(_is_unread(one) for one in columns):
        sample = sample_of(source)
        columns = tuple(_with_cause(one, sample) if _is_unread(one) else one for one in columns)
    return ProfileCheck(
        profile.name,
        source.name,
        0 if profile.names else fit.header.number,
        fit.delimiter,
        fit.encoding,
        max(rows.values(), default=0),
        columns,
        tuple(f"{one.topic}: {', '.join(one.outputs)} from {METHODS[one.method].text}" for one in layout.derivations),
        tuple(_missing(fit, layout)),
        tuple(one for one in remarks if one.code not in ("derived", "missing_columns")),
        tuple(damages),
    )


def _is_unread(column: ColumnCheck) -> bool:
    return bool(column.became) and not column.values


def _columns(fit: Fit, layout: TableLayout, values: Mapping[Key, _Values], *, is_timed: bool) -> Iterator[ColumnCheck]:
    by_place: dict[int, list[LayoutRule]] = {}
    for rule in layout.rules:
        by_place.setdefault(rule.column, []).append(rule)
    inputs = {key: f"{one.topic}.{one.outputs[0]}" for one in layout.derivations for key in one.inputs}
    sides = {rule.side: rule for rule in layout.rules if rule.side is not None}
    for at, name in enumerate(fit.names):
        if at in layout.time.columns:
            yield ColumnCheck(name, "time", values=int(is_timed))
            continue
        if at in sides:
            count = values.get(sides[at].key, _Values()).count
            yield ColumnCheck(name, f"sign of {sides[at].target}", values=count)
            continue
        for nth, rule in enumerate(by_place.get(at, ())):
            found = values.get(rule.key, _Values())
            known = field_of(*rule.key)
            became = rule.target if known is not None else ""
            if rule.key in inputs and known is None:
                became = f"input of {inputs[rule.key]}"
            unit = "" if known is None or known.kind != "double" else known.unit
            yield ColumnCheck(name, became, unit, found.count, found.shown, is_first=nth == 0)


def _with_cause(column: ColumnCheck, sample: TableSample) -> ColumnCheck:
    """Return an unread column with the cause."""
    if column.name not in sample.names:
        return column
    cells = sample.filled(sample.names.index(column.name))
    if not cells:
        return replace(column, cause="cells that are all empty")
    if column.became == "time":
        return replace(column, cause=cause_of_times(cells) or f"times that cannot be read, such as {cells[0][:40]!r}")
    cause = cause_of_numbers(cells, sample.delimiter)
    return replace(column, cause=cause or f"cells that cannot be read, such as {cells[0][:40]!r}")


def _missing(fit: Fit, layout: TableLayout) -> Iterator[MissingColumn]:
    """Yield columns that the profile names and the table lacks, unless their field is fed."""
    fed = {rule.key for rule in layout.rules} | {
        (one.topic, name) for one in layout.derivations for name in one.outputs
    }
    taken = {name for rule in fit.profile.columns for name in rule.names} | set(fit.profile.time.columns)
    free = [name for name in fit.names if name and name not in taken]
    for rule in fit.profile.columns:
        lacking = [name for name in rule.names if name not in fit.position]
        if lacking and not (rule.is_optional or (rule.topic, rule.field.name) in fed):
            target = f"{rule.topic}.{rule.field.name}"
            yield MissingColumn(lacking[0], target, nearest_names(lacking[0], target, free))
