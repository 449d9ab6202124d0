"""Profiles: TOML files that map the columns of a table to canonical fields.

A mistake in one raises an error that names its key.

The value of a field is ``(number in the cell x scale x sign + offset)`` in ``unit``, brought to the field's unit.
docs/profiles.md describes every key.
"""

import re
import string
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from types import MappingProxyType
from typing import Any, NoReturn

from groundstation.base.errors import SettingsError
from groundstation.base.signals import RAW_PREFIX, Field, field_of, is_canonical
from groundstation.base.toml_text import toml_table, toml_text
from groundstation.base.units import factor_to, units_of
from groundstation.readers.layout import METHODS, Form, Key
from groundstation.readers.told import HPA_PER_INHG

SHIPPED = Path(__file__).parent / "profiles"
# Unit of time -> (digits, multiple): it is 10**digits x multiple nanoseconds.
TIME_UNITS: Mapping[str, tuple[int, int]] = MappingProxyType(
    {"ns": (0, 1), "us": (3, 1), "ms": (6, 1), "s": (9, 1), "min": (9, 60), "h": (9, 3600)}
)
DIRECTIONS = ("track_deg", "true_heading_deg")  # directions of which a profile may state the north
MOST_WIDTHS = 10_000
_OF_CELLS = ("values", "variance", "missing", "part")
_DATE_DIRECTIVES = frozenset("YymdbBj")


@dataclass(frozen=True)
class ColumnRule:
    """One column: the field it feeds, and ``number x factor + offset`` in the field's unit.

    ``north`` is that of a direction where the file says nothing else; ``unit_factor`` is the unit's part of the factor.
    A column that is optional is not missed. ``form``, ``values``, ``missing`` and ``part`` are those of
    :class:`groundstation.readers.layout.LayoutRule`.
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
    join: Mapping[str, str] = field(default_factory=dict)

    @property
    def is_spaced(self) -> bool:
        """Tell whether no delimiter parts the columns."""
        return self.has_blanks or bool(self.widths)


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
    path = known_as(path)
    return _Checker(path).profile(read_table(path))


def known_as(path: Path) -> Path:
    """Return the path of a profile: of a shipped one where its name is given.

    A file of that name comes first.
    """
    shipped_path = SHIPPED / f"{path.name.replace('-', '_')}.toml"
    return shipped_path if not path.exists() and len(path.parts) == 1 and shipped_path.exists() else path


def read_table(path: Path) -> dict[str, Any]:
    """Read the TOML of a profile without checks.

    Raises
    ------
    SettingsError
        When it cannot be read or is no TOML.
    """
    text = toml_text(path, str(path), "a profile", "check the path")
    return toml_table(text, str(path), "a profile as docs/profiles.md describes")


class Checker:
    """Checker of the values of a profile; every error names the file and the key."""

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
        expected = f"a unit of {wanted}: {', '.join(units_of(wanted))}" if wanted else "no unit"
        factor = factor_to(value, wanted) if isinstance(value, str) else None
        if factor is None:
            self.fail(key, repr(value), expected)
        return factor

    def column(self, name: str, key: str, topic: str, known: Field, table: dict[str, Any]) -> ColumnRule:
        if known.kind != "double":
            self.table(table, key, ("field",))
            return ColumnRule(name, topic, known)
        unit_factor = self.unit(table.get("unit", ""), f"{key}.unit", known.unit)
        scale = self.number(table.get("scale", 1.0), f"{key}.scale")
        sign = self.number(table.get("sign", 1), f"{key}.sign")
        if sign not in (1.0, -1.0) or scale == 0.0:
            self.fail(f"{key}.sign" if scale else f"{key}.scale", f"{sign:g}" if scale else "0", "1 or -1, scale not 0")
        offset = self.number(table.get("offset", 0.0), f"{key}.offset")
        return ColumnRule(name, topic, known, scale * sign * unit_factor, offset * unit_factor, unit_factor)


class _Checker(Checker):
    """Parser of the TOML tables into rules for a table's columns."""

    def profile(self, table: dict[str, Any]) -> Profile:
        allowed = (
            *("name", "description", "raw_topic", "recognise", "time", "metadata", "variation", "columns", "derived"),
            *("missing", "key"),
        )
        table = self.table(table, "", allowed, ("name", "time", "columns"))
        name = self.text(table["name"], "name")
        raw_topic = RAW_PREFIX + self.text(table.get("raw_topic", name), "raw_topic").removeprefix(RAW_PREFIX)
        keys = (
            "first_line",
            "columns",
            "names",
            "rows_after_header",
            "header_tells",
            "second_names",
            "delimiter",
            "widths",
        )
        recognise = self.table(table.get("recognise", {}), "recognise", keys)
        time = self.time(table["time"])
        missing = self.missing(table.get("missing", []), "missing")
        columns = self.columns(table["columns"], missing)
        key = self.table(table.get("key", {}), "key", ("column", "only"), ("column",) if "key" in table else ())
        metadata = self.table(table.get("metadata", {}), "metadata", ("find", "join", "set"))
        find, constants, join = (
            self.table(metadata.get(name, {}), f"metadata.{name}", ()) for name in ("find", "set", "join")
        )
        find = {key: self.pattern(value, f"metadata.find.{key}") for key, value in find.items()}
        constants = {key: self.text(value, f"metadata.set.{key}") for key, value in constants.items()}
        known = find.keys() | constants.keys()
        names = self.texts(recognise["names"], "recognise.names") if "names" in recognise else ()
        if time.date and time.date not in known:
            self.fail("time.date", repr(time.date), "a name of metadata.find or metadata.set")
        if names and not {*(rule.name for rule in columns), *time.columns} <= set(names):
            self.fail("recognise.names", ", ".join(names), "every column that the profile names")
        rows_after = self.number(recognise.get("rows_after_header", 0), "recognise.rows_after_header")
        if rows_after != int(rows_after) or not 0 <= rows_after <= 10:
            self.fail("recognise.rows_after_header", repr(rows_after), "a whole number from 0 to 10")
        return Profile(
            name=name,
            path=self._path,
            description=str(table.get("description", "")),
            raw_topic=raw_topic,
            first_lines=self.first_lines(recognise.get("first_line", [])),
            required=self.texts(recognise["columns"], "recognise.columns")
            if "columns" in recognise
            else time.columns[:1],
            has_blanks=self.has_blanks(recognise),
            widths=self.widths(recognise.get("widths", [])),
            missing=missing,
            key=self.text(key["column"], "key.column") if key else "",
            only=self.texts(key["only"], "key.only") if "only" in key else (),
            rows_after_header=int(rows_after),
            header_tells=self.flag(recognise.get("header_tells", False), "recognise.header_tells"),
            has_second_names=self.flag(recognise.get("second_names", False), "recognise.second_names"),
            time=time,
            names=names,
            variation=self.variation(table["variation"]) if "variation" in table else None,
            columns=columns,
            derived=self.derivations(table.get("derived", []), columns, raw_topic),
            constants=constants,
            find=find,
            join={key: self.template(value, key, known) for key, value in join.items()},
        )

    def first_lines(self, value: Any) -> tuple[str, ...]:
        texts = value if isinstance(value, list) else [value]
        return tuple(self.text(text, "recognise.first_line") for text in texts)

    def has_blanks(self, recognise: Mapping[str, Any]) -> bool:
        if recognise.get("delimiter", "blanks") != "blanks":
            self.fail(
                "recognise.delimiter", repr(recognise["delimiter"]), '"blanks" (comma, semicolon and tab are found)'
            )
        if "delimiter" in recognise and "widths" in recognise:
            self.fail("recognise.delimiter", "widths beside it", "one of the two")
        return "delimiter" in recognise

    def widths(self, value: Any) -> tuple[int, ...]:
        if not isinstance(value, list) or len(value) > MOST_WIDTHS:
            self.fail("recognise.widths", repr(value)[:40], f"a list of up to {MOST_WIDTHS} whole numbers")
        found = [self.number(width, "recognise.widths") for width in value]
        if any(width != int(width) or not 1 <= width <= MOST_WIDTHS for width in found):
            self.fail("recognise.widths", repr(value)[:40], f"whole numbers from 1 to {MOST_WIDTHS}")
        return tuple(map(int, found))

    def missing(self, value: Any, key: str) -> tuple[str, ...]:
        """Return texts; numbers in the list are texts too."""
        if not isinstance(value, list):
            self.fail(key, repr(value), 'a list such as ["N/A", "-", 9999]')
        return tuple(one if isinstance(one, str) else f"{self.number(one, key):g}" for one in value)

    def listed(self, value: Any, key: str, kind: str) -> tuple[tuple[str, float | str | bool], ...]:
        """Return the values of the texts that a cell may hold."""
        readers: dict[str, Callable[[Any, str], float | str | bool]]
        readers = {"double": self.number, "text": self.text, "bool": self.flag}
        read = readers[kind]
        found = [(text, read(one, f"{key}.{text}")) for text, one in self.table(value, key, ()).items()]
        if not found:
            self.fail(key, "nothing", "a value for each text of the column")
        return tuple(found)

    def flag(self, value: Any, key: str) -> bool:
        if not isinstance(value, bool):
            self.fail(key, repr(value), "true or false")
        return value

    def variation(self, value: Any) -> Variation:
        table = self.table(value, "variation", ("column", "unit", "sign"), ("column",))
        sign = self.number(table.get("sign", 1), "variation.sign")
        if sign not in (1.0, -1.0):
            self.fail("variation.sign", f"{sign:g}", "1 (east positive) or -1")
        factor = self.unit(table.get("unit", "deg"), "variation.unit", "deg")
        return Variation(self.text(table["column"], "variation.column"), sign * factor)

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
        kinds = ("seconds", "nanoseconds", "iso", "local", "unix", "gps_week", "time_of_day", "utc_counter")
        table = self.table(value, "time", (), ("kind",))
        kind = self.text(table["kind"], "time.kind")
        if kind not in kinds:
            self.fail("time.kind", repr(kind), f"one of {', '.join(kinds)}")
        if kind == "local":
            return self.local_time(table)
        if kind == "utc_counter":
            return self.counter_time(table)
        if kind == "gps_week":
            self.table(table, "time", ("kind", "week", "seconds", "unit", "earliest_year"), ("week", "seconds"))
            year = self.number(table.get("earliest_year", 0), "time.earliest_year")
            names = tuple(self.text(table[key], f"time.{key}") for key in ("week", "seconds"))
            return TimeColumns(kind, names, self.time_unit(table), earliest_year=self.year(year))
        if kind == "time_of_day":
            self.table(table, "time", ("kind", "column", "date", "date_formats"), ("column", "date"))
            names = (self.text(table["column"], "time.column"),)
            return TimeColumns(
                kind, names, date_formats=self.date_formats(table), date=self.text(table["date"], "time.date")
            )
        allowed = {"seconds": ("kind", "column", "unit", "rtklib_tag"), "unix": ("kind", "column", "unit")}
        self.table(table, "time", allowed.get(kind, ("kind", "column")), ("column",))
        has_tag = self.flag(table.get("rtklib_tag", False), "time.rtklib_tag")
        return TimeColumns(kind, (self.text(table["column"], "time.column"),), self.time_unit(table), has_tag=has_tag)

    def time_unit(self, table: dict[str, Any]) -> tuple[int, int]:
        unit = table.get("unit", "s")
        if not isinstance(unit, str) or unit not in TIME_UNITS:
            self.fail("time.unit", repr(unit), f"one of {', '.join(TIME_UNITS)}")
        return TIME_UNITS[unit]

    def year(self, value: float) -> int:
        if value != int(value) or (value and not 1980 <= value <= 2100):
            self.fail("time.earliest_year", f"{value:g}", "a year from 1980 on")
        return int(value)

    def counter_time(self, table: dict[str, Any]) -> TimeColumns:
        """Return the columns of a counter and of UTC in whole seconds."""
        allowed = ("kind", "counter", "unit", "utc", "date", "time", "date_formats")
        self.table(table, "time", allowed, ("counter",))
        keys = ["counter", *(["utc"] if "utc" in table else ["date", "time"])]
        self.table(table, "time", ("kind", "unit", "date_formats", *keys), keys)
        names = tuple(self.text(table[key], f"time.{key}") for key in keys)
        return TimeColumns("utc_counter", names, self.time_unit(table), self.date_formats(table))

    def local_time(self, table: dict[str, Any]) -> TimeColumns:
        self.table(table, "time", ("kind", "date", "time", "offset", "date_formats"), ("date", "time"))
        is_utc = table.get("offset") == "UTC"
        keys = [key for key in ("date", "time", "offset") if key in table and not (key == "offset" and is_utc)]
        names = [self.text(table[key], f"time.{key}") for key in keys]
        return TimeColumns("local", tuple(names), date_formats=self.date_formats(table), is_utc=is_utc)

    def date_formats(self, table: dict[str, Any]) -> tuple[str, ...]:
        formats = self.texts(table.get("date_formats", ["%Y-%m-%d"]), "time.date_formats")
        for form in formats:
            used = set(re.findall(r"%(.)", form))
            if not used or not used <= _DATE_DIRECTIVES:
                self.fail("time.date_formats", repr(form), "a date such as %Y-%m-%d")
        return formats

    def columns(self, value: Any, missing: tuple[str, ...] = ()) -> tuple[ColumnRule, ...]:
        rules: list[ColumnRule] = []
        feeding: dict[str, ColumnRule] = {}
        entries = [
            (name, one)
            for name, entry in self.table(value, "columns", ()).items()
            for one in (entry if isinstance(entry, list) else [entry])
        ]
        for name, entry in entries:
            key = f"columns.{name}"
            allowed = ("field", "unit", "scale", "sign", "offset", "north", "optional", *_OF_CELLS)
            table = dict(self.table(entry, key, allowed, ("field",)))
            of_cells = {name: table.pop(name) for name in _OF_CELLS if name in table}
            north = self.north(table.pop("north", ""), f"{key}.north")
            is_optional = self.flag(table.pop("optional", False), f"{key}.optional")
            topic, known = self.canonical(table["field"], f"{key}.field")
            if north and known.name not in DIRECTIONS:
                self.fail(f"{key}.north", known.name, f"one of {', '.join(DIRECTIONS)}")
            target = f"{topic}.{known.name}"
            other = feeding.get(target)
            if other is not None and not (is_optional and other.is_optional):
                self.fail(f"{key}.field", target, f"a field that {other.name!r} does not feed already")
            is_dms = table.get("unit") == "dms" and known.unit == "deg"
            table |= {"unit": "deg"} if is_dms else {}
            rule = replace(self.column(name, key, topic, known, table), north=north, is_optional=is_optional)
            rule = self.with_cells(replace(rule, form="dms" if is_dms else ""), of_cells, key, missing)
            feeding.setdefault(target, rule)
            rules.append(rule)
        return tuple(rules)

    def with_cells(self, rule: ColumnRule, given: dict[str, Any], key: str, missing: tuple[str, ...]) -> ColumnRule:
        """Return a rule with what is said of the cells of its column."""
        kind = rule.field.kind
        if self.flag(given.get("variance", False), f"{key}.variance"):
            if kind != "double" or rule.form or not rule.field.name.rpartition("_")[0].endswith("sigma"):
                self.fail(f"{key}.variance", rule.field.name, "a field of a sigma")
            rule = replace(rule, form="variance")
        if "values" in given:
            if rule.form:
                self.fail(f"{key}.values", "a variance or degrees, minutes and seconds", "one of the two")
            rule = replace(rule, values=self.listed(given["values"], f"{key}.values", kind))
        part = self.number(given.get("part", 0), f"{key}.part")
        if part != int(part) or not 0 <= part <= 20:
            self.fail(f"{key}.part", f"{part:g}", "a whole number from 1 to 20")
        own = self.missing(given.get("missing", []), f"{key}.missing")
        return replace(rule, missing=(*missing, *own), part=int(part))

    def north(self, value: Any, key: str) -> str:
        if value not in ("", "true", "magnetic"):
            self.fail(key, repr(value), "true or magnetic")
        return str(value)

    def derivations(self, value: Any, columns: tuple[ColumnRule, ...], raw_topic: str) -> tuple[DerivedRule, ...]:
        if not isinstance(value, list):
            self.fail("derived", repr(value), "a list of tables ([[derived]])")
        known = {(rule.topic, rule.field.name) for rule in columns}
        optional = {(rule.topic, rule.field.name) for rule in columns if rule.is_optional}
        rules: list[DerivedRule] = []
        for number, entry in enumerate(value):
            rule = self.derivation(entry, f"derived[{number}]", known, raw_topic)
            outputs = {(rule.topic, name) for name in rule.outputs}
            if outputs & (known - optional):
                self.fail(f"derived[{number}]", f"{rule.topic}.{rule.outputs[0]}", "a field that nothing feeds already")
            known |= outputs
            optional -= outputs
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
            factors = {"inhg": 1.0, "hpa": 1.0 / HPA_PER_INHG}
            if not isinstance(table["unit"], str) or table["unit"] not in factors:
                self.fail(f"{key}.unit", repr(table["unit"]), "inhg or hpa")
            return InputRule((raw_topic, column), factors[table["unit"]], column)
        return InputRule((raw_topic, column), self.unit(table["unit"], f"{key}.unit", unit), column)
