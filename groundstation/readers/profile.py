"""Profiles: TOML files that say what the columns of a table mean. A slip in one is an error that names its key.

The value of a field is ``(number in the cell x scale x sign + offset)`` in ``unit``, brought to the field's unit.
docs/profiles.md describes every key.
"""

import re
import string
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import Any, NoReturn

from groundstation.base.errors import SettingsError
from groundstation.base.signals import RAW_PREFIX, Field, field_of, is_canonical
from groundstation.base.toml_text import toml_table, toml_text
from groundstation.base.units import CONVERSIONS
from groundstation.readers.layout import METHODS, Key

SHIPPED = Path(__file__).parent / "profiles"
# Unit of time -> (digits, multiple): it is 10**digits x multiple nanoseconds.
TIME_UNITS: Mapping[str, tuple[int, int]] = MappingProxyType(
    {"ns": (0, 1), "us": (3, 1), "ms": (6, 1), "s": (9, 1), "min": (9, 60), "h": (9, 3600)}
)
_DATE_DIRECTIVES = frozenset("YymdbBj")


@dataclass(frozen=True)
class ColumnRule:
    """One column: the field it feeds, and ``number x factor + offset`` in the field's unit."""

    name: str
    topic: str
    field: Field
    factor: float = 1.0
    offset: float = 0.0


@dataclass(frozen=True)
class InputRule:
    """One input of a derived field: a field already known, or a column times ``factor``."""

    key: Key
    factor: float = 1.0
    column: str = ""


@dataclass(frozen=True)
class DerivedRule:
    """Fields of a topic computed from others by a method of :data:`groundstation.readers.layout.METHODS`."""

    method: str
    topic: str
    outputs: tuple[str, ...]
    inputs: tuple[InputRule, ...]


@dataclass(frozen=True)
class TimeColumns:
    """Time of a row: kind as in :class:`groundstation.readers.layout.TimeRule`, its columns, its unit."""

    kind: str
    columns: tuple[str, ...]
    unit: tuple[int, int] = TIME_UNITS["s"]
    date_formats: tuple[str, ...] = ()


@dataclass(frozen=True)
class Profile:
    """A layout by column names, ready to be laid over a header row."""

    name: str
    path: Path
    description: str
    raw_topic: str
    first_line: str
    required: tuple[str, ...]
    rows_after_header: int
    time: TimeColumns
    columns: tuple[ColumnRule, ...] = ()
    derived: tuple[DerivedRule, ...] = ()
    constants: Mapping[str, str] = field(default_factory=dict)
    find: Mapping[str, re.Pattern[str]] = field(default_factory=dict)
    join: Mapping[str, str] = field(default_factory=dict)


def shipped() -> tuple[Profile, ...]:
    """The profiles that come with the package, by name."""
    return tuple(load(path) for path in sorted(SHIPPED.glob("*.toml")))


def load(path: Path) -> Profile:
    """Read and check a profile.

    Raises
    ------
    SettingsError
        Naming the file and the key: not TOML, an unknown key, unit, field or method, a wrong dimension ...
    """
    return _Checker(path).profile(read_table(path))


def read_table(path: Path) -> dict[str, Any]:
    """The TOML of a profile, not checked yet.

    Raises
    ------
    SettingsError
        When it cannot be read or is no TOML.
    """
    text = toml_text(path, str(path), "a profile", "check the path")
    return toml_table(text, str(path), "a profile as docs/profiles.md describes")


class Checker:
    """Checks the values of a profile; every complaint names the file and the key."""

    def __init__(self, path: Path) -> None:
        self._path = path

    def fail(self, key: str, found: str, expected: str = "") -> NoReturn:
        raise SettingsError(f"{self._path.name}, {key}", found, expected, "see docs/profiles.md")

    def table(self, value: Any, key: str, allowed: Sequence[str], needed: Sequence[str] = ()) -> dict[str, Any]:
        if not isinstance(value, dict):
            self.fail(key, repr(value), "a table")
        for name in value:
            if allowed and name not in allowed:
                self.fail(f"{key}.{name}".lstrip("."), "an unknown key", f"one of {', '.join(allowed)}")
        for name in needed:
            if name not in value:
                self.fail(f"{key}.{name}".lstrip("."), "nothing", "this key")
        return value

    def text(self, value: Any, key: str) -> str:
        if not isinstance(value, str) or not value:
            self.fail(key, repr(value), "a text that is not empty")
        return value

    def texts(self, value: Any, key: str) -> tuple[str, ...]:
        if not isinstance(value, list) or not value:
            self.fail(key, repr(value), "a list of texts")
        return tuple(self.text(item, key) for item in value)

    def number(self, value: Any, key: str) -> float:
        if isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) < float("inf"):
            self.fail(key, repr(value), "a finite number")
        try:
            return float(value)
        except OverflowError:
            self.fail(key, f"a number of {len(str(value))} digits", "a number")

    def canonical(self, value: Any, key: str) -> tuple[str, Field]:
        topic, _, name = self.text(value, key).rpartition(".")
        known = field_of(topic, name)
        if known is None:
            expected = "a field of that topic" if is_canonical(topic) else "<topic>.<field> of the canonical list"
            self.fail(key, repr(value), expected)
        return topic, known

    def unit(self, value: Any, key: str, wanted: str) -> float:
        units = [name for name, (base, _factor) in CONVERSIONS.items() if base == wanted and name]
        expected = f"a unit of {wanted}: {', '.join(units)}" if wanted else "no unit"
        if not isinstance(value, str) or value not in CONVERSIONS or CONVERSIONS[value][0] != wanted:
            self.fail(key, repr(value), expected)
        return CONVERSIONS[value][1]

    def column(self, name: str, key: str, topic: str, known: Field, table: dict[str, Any]) -> ColumnRule:
        if known.kind != "double":
            self.table(table, key, ("field",))
            return ColumnRule(name, topic, known)
        factor = self.unit(table.get("unit", ""), f"{key}.unit", known.unit)
        scale = self.number(table.get("scale", 1.0), f"{key}.scale")
        sign = self.number(table.get("sign", 1), f"{key}.sign")
        if sign not in (1.0, -1.0) or scale == 0.0:
            self.fail(f"{key}.sign" if scale else f"{key}.scale", f"{sign:g}" if scale else "0", "1 or -1, scale not 0")
        offset = self.number(table.get("offset", 0.0), f"{key}.offset")
        return ColumnRule(name, topic, known, scale * sign * factor, offset * factor)


class _Checker(Checker):
    """Turns the TOML tables into the rules of a table's columns."""

    def profile(self, table: dict[str, Any]) -> Profile:
        allowed = ("name", "description", "raw_topic", "recognise", "time", "metadata", "columns", "derived")
        table = self.table(table, "", allowed, ("name", "time", "columns"))
        name = self.text(table["name"], "name")
        raw_topic = RAW_PREFIX + self.text(table.get("raw_topic", name), "raw_topic").removeprefix(RAW_PREFIX)
        recognise = self.table(table.get("recognise", {}), "recognise", ("first_line", "columns", "rows_after_header"))
        time = self.time(table["time"])
        columns = self.columns(table["columns"])
        metadata = self.table(table.get("metadata", {}), "metadata", ("find", "join", "set"))
        find, constants, join = (
            self.table(metadata.get(name, {}), f"metadata.{name}", ()) for name in ("find", "set", "join")
        )
        find = {key: self.pattern(value, f"metadata.find.{key}") for key, value in find.items()}
        constants = {key: self.text(value, f"metadata.set.{key}") for key, value in constants.items()}
        known = find.keys() | constants.keys()
        rows_after = self.number(recognise.get("rows_after_header", 0), "recognise.rows_after_header")
        if rows_after != int(rows_after) or not 0 <= rows_after <= 10:
            self.fail("recognise.rows_after_header", repr(rows_after), "a whole number from 0 to 10")
        return Profile(
            name=name,
            path=self._path,
            description=str(table.get("description", "")),
            raw_topic=raw_topic,
            first_line=str(recognise.get("first_line", "")),
            required=self.texts(recognise["columns"], "recognise.columns")
            if "columns" in recognise
            else time.columns[:1],
            rows_after_header=int(rows_after),
            time=time,
            columns=columns,
            derived=self.derivations(table.get("derived", []), columns, raw_topic),
            constants=constants,
            find=find,
            join={key: self.template(value, key, known) for key, value in join.items()},
        )

    def pattern(self, value: Any, key: str) -> re.Pattern[str]:
        try:
            pattern = re.compile(self.text(value, key))
        except re.error as error:
            self.fail(key, f"{value!r} ({error})", "a regular expression")
        if pattern.groups != 1:
            self.fail(key, f"{pattern.groups} groups", "one group, around the value")
        return pattern

    def template(self, value: Any, key: str, known: Any) -> str:
        text = self.text(value, f"metadata.join.{key}")
        try:
            names = [name for _text, name, _form, _conversion in string.Formatter().parse(text) if name is not None]
        except ValueError as error:
            self.fail(f"metadata.join.{key}", f"{text!r} ({error})", "text with {names} in braces")
        for name in names:
            if name not in known:
                self.fail(f"metadata.join.{key}", f"{{{name}}}", "names from metadata.find or metadata.set")
        return text

    def time(self, value: Any) -> TimeColumns:
        kinds = ("seconds", "nanoseconds", "iso", "local")
        table = self.table(value, "time", (), ("kind",))
        kind = self.text(table["kind"], "time.kind")
        if kind not in kinds:
            self.fail("time.kind", repr(kind), f"one of {', '.join(kinds)}")
        if kind == "local":
            return self.local_time(table)
        allowed = ("kind", "column", "unit") if kind == "seconds" else ("kind", "column")
        self.table(table, "time", allowed, ("column",))
        unit = table.get("unit", "s")
        if not isinstance(unit, str) or unit not in TIME_UNITS:
            self.fail("time.unit", repr(unit), f"one of {', '.join(TIME_UNITS)}")
        return TimeColumns(kind, (self.text(table["column"], "time.column"),), TIME_UNITS[unit])

    def local_time(self, table: dict[str, Any]) -> TimeColumns:
        self.table(table, "time", ("kind", "date", "time", "offset", "date_formats"), ("date", "time"))
        names = [self.text(table[key], f"time.{key}") for key in ("date", "time", "offset") if key in table]
        formats = self.texts(table.get("date_formats", ["%Y-%m-%d"]), "time.date_formats")
        for form in formats:
            used = set(re.findall(r"%(.)", form))
            if not used or not used <= _DATE_DIRECTIVES:
                self.fail("time.date_formats", repr(form), "a date such as %Y-%m-%d")
        return TimeColumns("local", tuple(names), date_formats=formats)

    def columns(self, value: Any) -> tuple[ColumnRule, ...]:
        rules: dict[str, ColumnRule] = {}
        for name, entry in self.table(value, "columns", ()).items():
            key = f"columns.{name}"
            table = self.table(entry, key, ("field", "unit", "scale", "sign", "offset"), ("field",))
            topic, known = self.canonical(table["field"], f"{key}.field")
            target = f"{topic}.{known.name}"
            if target in rules:
                self.fail(f"{key}.field", target, f"a field that {rules[target].name!r} does not feed already")
            rules[target] = self.column(name, key, topic, known, table)
        return tuple(rules.values())

    def derivations(self, value: Any, columns: tuple[ColumnRule, ...], raw_topic: str) -> tuple[DerivedRule, ...]:
        if not isinstance(value, list):
            self.fail("derived", repr(value), "a list of tables ([[derived]])")
        known = {(rule.topic, rule.field.name) for rule in columns}
        rules: list[DerivedRule] = []
        for number, entry in enumerate(value):
            rule = self.derivation(entry, f"derived[{number}]", known, raw_topic)
            outputs = {(rule.topic, name) for name in rule.outputs}
            if outputs & known:
                self.fail(f"derived[{number}]", f"{rule.topic}.{rule.outputs[0]}", "a field that nothing feeds already")
            known |= outputs
            rules.append(rule)
        return tuple(rules)

    def derivation(self, entry: Any, key: str, known: set[Key], raw_topic: str) -> DerivedRule:
        self.table(entry, key, (), ("method",))
        method = METHODS.get(entry["method"]) if isinstance(entry["method"], str) else None
        if method is None:
            self.fail(f"{key}.method", repr(entry["method"]), f"one of {', '.join(METHODS)}")
        target = "topic" if method.outputs else "field"
        self.table(entry, key, ("method", target, *method.inputs), (target, *method.inputs))
        if method.outputs:
            topic, outputs = self.text(entry["topic"], f"{key}.topic"), method.outputs
            if field_of(topic, outputs[0]) is None:
                self.fail(f"{key}.topic", repr(topic), f"a canonical topic with {outputs[0]}")
        else:
            topic, single = self.canonical(entry["field"], f"{key}.field")
            outputs = (single.name,)
        inputs = tuple(
            self.input(entry[name], f"{key}.{name}", unit, known, raw_topic)
            for name, unit in zip(method.inputs, method.units, strict=True)
        )
        return DerivedRule(entry["method"], topic, outputs, inputs)

    def input(self, value: Any, key: str, unit: str, known: set[Key], raw_topic: str) -> InputRule:
        if isinstance(value, str):
            topic, _, name = value.rpartition(".")
            if (topic, name) not in known:
                self.fail(key, repr(value), "a field fed above, or { column = ..., unit = ... }")
            return InputRule((topic, name))
        table = self.table(value, key, ("column", "unit"), ("column", "unit"))
        column = self.text(table["column"], f"{key}.column")
        if unit == "inhg":  # the one input that is in no canonical unit
            factors = {"inhg": 1.0, "hpa": 1.0 / 33.8638866667}
            if not isinstance(table["unit"], str) or table["unit"] not in factors:
                self.fail(f"{key}.unit", repr(table["unit"]), "inhg or hpa")
            return InputRule((raw_topic, column), factors[table["unit"]], column)
        return InputRule((raw_topic, column), self.unit(table["unit"], f"{key}.unit", unit), column)
