"""Columns of a profile, and the fields that they feed or that are derived from them."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

from groundstation.base.signals import field_of
from groundstation.readers.layout import METHODS, Form, Key
from groundstation.readers.profile import ColumnRule, DerivedRule, InputRule, Variation
from groundstation.readers.profile_values import Checker
from groundstation.readers.told import HPA_PER_INHG

DIRECTIONS = ("track_deg", "true_heading_deg")  # directions of which a profile may state the north
_ANGLES: Mapping[str, Form] = {"dms": "dms", "ddmm": "ddmm"}  # units that are written in a form of their own
_OF_CELLS = ("values", "variance", "missing", "part", "side")
_SIDED = ("latitude_deg", "longitude_deg")


class ColumnChecker(Checker):
    """Parser of the tables ``columns``, ``derived`` and ``variation``."""

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
            form = _ANGLES.get(str(table.get("unit")), "") if known.unit == "deg" else ""
            table |= {"unit": "deg"} if form else {}
            rule = replace(self.column(name, key, topic, known, table), north=north, is_optional=is_optional)
            rule = self.with_cells(replace(rule, form=form), of_cells, key, missing)
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
        side = self.text(given["side"], f"{key}.side") if "side" in given else ""
        if side and (rule.field.name not in _SIDED or rule.values):
            self.fail(f"{key}.side", rule.field.name, f"one of {', '.join(_SIDED)}, without values")
        return replace(rule, missing=(*missing, *own), part=int(part), side=side)

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

    def variation(self, value: Any) -> Variation:
        table = self.table(value, "variation", ("column", "unit", "sign"), ("column",))
        sign = self.number(table.get("sign", 1), "variation.sign")
        if sign not in (1.0, -1.0):
            self.fail("variation.sign", f"{sign:g}", "1 (east positive) or -1")
        factor = self.unit(table.get("unit", "deg"), "variation.unit", "deg")
        return Variation(self.text(table["column"], "variation.column"), sign * factor)
