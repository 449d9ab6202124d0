"""Profiles of messages (TOML): the quantity, unit and frame of paths in messages.

docs/bags.md describes every key; all other keys are those of the profiles of tables.
"""

from collections.abc import Callable, Mapping
from fnmatch import fnmatchcase
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

from groundstation.base.angles import wrap_360
from groundstation.base.dataclasses import dataclass
from groundstation.base.records import Column, Int64Array
from groundstation.base.signals import is_canonical
from groundstation.readers.bags.canonical import ACCEL, FIELD, POSITION, RATES, VELOCITY
from groundstation.readers.bags.definitions import plain_name
from groundstation.readers.bags.messages import Connection
from groundstation.readers.bags.ranges import EACH, RangesRule
from groundstation.readers.bags.values import Values, attitude, body, level
from groundstation.readers.mapping import Columns
from groundstation.readers.profile import TIME_UNITS, ColumnRule
from groundstation.readers.profile_values import Checker, read_table

_EARTH, _BODY = ("enu", "ned"), ("flu", "frd")
# Quantity of a vector -> its fields, their unit, the frames it may be in (the first is that of ROS).
_VECTORS: Mapping[str, tuple[tuple[str, str, str], str, tuple[str, str]]] = MappingProxyType(
    {
        "velocity": (VELOCITY, "mps", _EARTH),
        "position": (POSITION, "m", _EARTH),
        "rates": (RATES, "dps", _BODY),
        "acceleration": (ACCEL, "mps2", _BODY),
        "magnetic_field": (FIELD, "nt", _BODY),
    }
)
LATEST_NS = 2.0**62
ATTITUDE = "attitude"  # from a quaternion x, y, z, w: flu in enu, or frd in ned


@dataclass(frozen=True)
class VectorRule:
    """Rule for a vector of the message: its topic, quantity, frame and factor.

    ``factor`` converts to the unit of the fields.
    """

    name: str
    topic: str
    quantity: str
    frame: str
    factor: float = 1.0

    def columns(self, values: Values) -> Columns:
        """Return the fields of the vector; none where the message lacks it."""
        if not values.has_triple(self.name) or (self.quantity == ATTITUDE and f"{self.name}.w" not in values):
            return {}
        if self.quantity == ATTITUDE:
            return attitude(values, self.name, None, is_turned=self.frame == "enu")
        fields = _VECTORS[self.quantity][0]
        if self.frame in _BODY:
            return body(values, self.name, fields, self.factor, None, is_turned=self.frame == "flu")
        x, y, z = (self.factor * part for part in values.triple(self.name))
        return level(x, y, z, fields) if self.frame == "enu" else level(y, x, -z, fields)


@dataclass(frozen=True)
class MessageRule:
    """Rule for the messages of a topic, or of a type."""

    topic: str
    type: str
    columns: tuple[ColumnRule, ...]
    vectors: tuple[VectorRule, ...]
    units: Mapping[str, str]
    time: tuple[str, str] | None = None
    ranges: RangesRule | None = None

    def serves(self, connection: Connection) -> bool:
        """Tell whether the rule is for a connection's messages."""
        return fnmatchcase(connection.topic, self.topic) and (not self.type or connection.type == self.type)

    @property
    def topics(self) -> tuple[str, ...]:
        """Canonical topics that the rule feeds."""
        fed = [*(rule.topic for rule in self.columns), *(vector.topic for vector in self.vectors)]
        fed += self.ranges.topics if self.ranges is not None else ()
        return tuple(dict.fromkeys(fed))

    def feeding(self, topic: str) -> Callable[[Values], Columns]:
        """Return the function from messages to the fields of one canonical topic."""

        def columns(values: Values) -> Columns:
            found: Columns = {}
            if self.ranges is not None and topic in self.ranges.topics:
                found |= self.ranges.columns(values, topic)
            for vector in self.vectors:
                found |= vector.columns(values) if vector.topic == topic else {}
            for rule in self.columns:
                if rule.topic == topic and rule.name in values:
                    found[rule.field.name] = _column(values, rule)
            return found

        return columns

    def stamp_ns(self, columns: Mapping[str, Column]) -> Int64Array | None:
        """Return the time of validity of messages by the rule, shape (n,); None without one."""
        if self.time is None or self.time[0] not in columns:
            return None
        digits, multiple = TIME_UNITS[self.time[1]]
        values, unit_ns = columns[self.time[0]].values, 10**digits * multiple
        if values.dtype.kind in "iu":
            return np.asarray(values.astype(np.int64) * unit_ns)
        number = np.nan_to_num(values.astype(np.float64), nan=0.0, posinf=0.0, neginf=0.0)
        number = np.clip(number, 0.0, LATEST_NS / unit_ns)
        whole = np.floor(number)
        return np.asarray(whole.astype(np.int64) * unit_ns + np.rint((number - whole) * unit_ns).astype(np.int64))

    def told(self, present: Mapping[str, Column]) -> tuple[str, tuple[str, ...]]:
        """Describe what the rule maps, and list its names that the messages lack.

        The description has units and frames.
        """
        parts, missing = [], []
        for rule in self.columns:
            factor = f" x {rule.factor:g}" if rule.factor != 1.0 else ""
            offset = f" + {rule.offset:g}" if rule.offset else ""
            parts.append(f"{rule.topic}.{rule.field.name} = {self._named(rule.name)}{factor}{offset}")
            missing += [rule.name] if rule.name not in present else []
        for vector in self.vectors:
            factor = f" x {vector.factor:g}" if vector.factor != 1.0 else ""
            parts.append(f"{vector.topic} {vector.quantity} = {self._named(vector.name)} in {vector.frame}{factor}")
            missing += [vector.name] if f"{vector.name}.x" not in present else []
        if self.ranges is not None:
            parts.append(self.ranges.told(present))
            missing += self.ranges.missing(present)
        if self.time is not None:
            parts.append(f"time of validity = {self.time[0]} ({self.time[1]})")
            missing += [self.time[0]] if self.time[0] not in present else []
        return "; ".join(parts), tuple(missing)

    def _named(self, name: str) -> str:
        return f"{name} ({self.units[name]})" if self.units.get(name) else name


@dataclass(frozen=True)
class MessageProfile:
    """Rules for the messages of a robot."""

    name: str
    rules: tuple[MessageRule, ...]

    def rule_for(self, connection: Connection) -> MessageRule | None:
        """The first rule that serves a connection."""
        return next((rule for rule in self.rules if rule.serves(connection)), None)


def _column(values: Values, rule: ColumnRule) -> Column:
    column = values.column(rule.name)
    if rule.field.kind == "text":
        return Column(column.values.astype(np.str_), column.present)
    if rule.field.kind == "bool":
        return Column(column.values != 0, column.present)
    numbers = values[rule.name] * rule.factor + rule.offset
    present = column.present
    if rule.field.is_heading:
        present = column.mask & np.isfinite(numbers)
        numbers = np.asarray(wrap_360(np.where(present, numbers, 0.0)))
    return Column(numbers, present)


def load(path: Path) -> MessageProfile:
    """Read and check a profile of messages.

    Raises
    ------
    SettingsError
        Naming the file and the key.
    """
    return _Checker(path).messages(read_table(path))


class _Checker(Checker):
    """Parser of the TOML tables into rules of messages."""

    def messages(self, table: dict[str, Any]) -> MessageProfile:
        self.table(table, "", ("name", "description", "messages"), ("name", "messages"))
        rules = table["messages"]
        if not isinstance(rules, list) or not rules:
            self.fail("messages", repr(rules)[:60], "tables ([[messages]])")
        found = tuple(self.message(rule, f"messages[{number}]") for number, rule in enumerate(rules))
        return MessageProfile(self.text(table["name"], "name"), found)

    def message(self, value: Any, key: str) -> MessageRule:
        table = self.table(value, key, ("topic", "type", "time", "fields", "vectors", "ranges"))
        if "topic" not in table and "type" not in table:
            self.fail(key, "neither topic nor type", "one of them")
        columns = []
        fields = self.table(table.get("fields", {}), f"{key}.fields", ())
        for name, entry in fields.items():
            at = f"{key}.fields.{name}"
            one = self.table(entry, at, ("field", "unit", "scale", "sign", "offset"), ("field",))
            topic, known = self.canonical(one["field"], f"{at}.field")
            columns.append(self.column(name, at, topic, known, one))
        vectors = self.table(table.get("vectors", {}), f"{key}.vectors", ())
        return MessageRule(
            self.text(table.get("topic", "*"), f"{key}.topic"),
            plain_name(self.text(table["type"], f"{key}.type")) if "type" in table else "",
            tuple(columns),
            tuple(self.vector(name, entry, f"{key}.vectors.{name}") for name, entry in vectors.items()),
            {name: str(entry.get("unit", "")) for name, entry in {**fields, **vectors}.items()},
            self.time(table["time"], f"{key}.time") if "time" in table else None,
            self.ranges(table["ranges"], f"{key}.ranges") if "ranges" in table else None,
        )

    def ranges(self, value: Any, key: str) -> RangesRule:
        table = self.table(value, key, ("value", "unit", "ends", "own", "names", "peer"), ("value",))
        path = self.text(table["value"], f"{key}.value")
        factor = self.unit(table.get("unit", "m"), f"{key}.unit", "m")
        if "peer" in table:
            if len(table.keys() & {"ends", "own", "names"}):
                self.fail(key, "peer beside ends, own or names", "peer alone: it is the other end of every range")
            return RangesRule(path, (), frozenset(), {}, self.text(table["peer"], f"{key}.peer"), factor)
        self.table(table, key, (), ("ends", "names"))
        ends = self.texts(table["ends"], f"{key}.ends")
        if len(ends) > 2:
            self.fail(f"{key}.ends", f"{len(ends)} paths", "one or two")
        if EACH not in path and any(EACH in end for end in ends):
            self.fail(f"{key}.value", repr(path), f"a path with {EACH}, as the ends have it")
        own = frozenset(self.texts(table["own"], f"{key}.own")) if "own" in table else frozenset()
        if len(ends) == 2 and not own:
            self.fail(f"{key}.own", "nothing", "the ends of this log: one of two ends is its own")
        names = self.table(table["names"], f"{key}.names", ())
        if not names:
            self.fail(f"{key}.names", "nothing", "a name for each other end")
        named = {end: self.text(name, f"{key}.names.{end}") for end, name in names.items()}
        return RangesRule(path, ends, own, named, factor=factor)

    def vector(self, name: str, value: Any, key: str) -> VectorRule:
        table = self.table(value, key, ("topic", "quantity", "frame", "unit"), ("topic", "quantity", "frame"))
        topic, quantity = self.text(table["topic"], f"{key}.topic"), self.text(table["quantity"], f"{key}.quantity")
        if not is_canonical(topic):
            self.fail(f"{key}.topic", repr(topic), "a canonical topic")
        if quantity != ATTITUDE and quantity not in _VECTORS:
            self.fail(f"{key}.quantity", repr(quantity), f"one of {', '.join((ATTITUDE, *_VECTORS))}")
        _fields, unit, frames = _VECTORS.get(quantity, ((), "", _EARTH))
        frame = self.text(table["frame"], f"{key}.frame")
        if frame not in frames:
            self.fail(f"{key}.frame", repr(frame), f"one of {', '.join(frames)}")
        factor = self.unit(table.get("unit", ""), f"{key}.unit", unit) if unit else 1.0
        return VectorRule(name, topic, quantity, frame, factor)

    def time(self, value: Any, key: str) -> tuple[str, str]:
        table = self.table(value, key, ("field", "unit"), ("field", "unit"))
        unit = table["unit"]
        if not isinstance(unit, str) or unit not in TIME_UNITS:
            self.fail(f"{key}.unit", repr(unit), f"one of {', '.join(TIME_UNITS)}")
        return self.text(table["field"], f"{key}.field"), unit
