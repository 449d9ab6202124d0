"""Frozen dataclasses filled from TOML, strictly: an unknown key, a wrong type or a value out of range is an error.

A field states its range in its metadata: ``number(0.5, low=0.0)``; a class that is also built without a file calls
:func:`check_ranges` in its ``__post_init__``. A SettingsError raised there says the field as its place, and
:func:`settings_from` puts file and table before it. A field that holds one of several classes (legs,
faults) is a union whose members carry a class attribute ``kind``; the TOML table names it with the key ``kind``.
"""

import dataclasses
import math
import types
import typing
from collections.abc import Mapping
from typing import Any, ClassVar, Protocol, TypeVar

from groundstation.base.errors import SettingsError

Settings = TypeVar("Settings")


class HasKind(Protocol):
    """A settings class that a TOML table selects with ``kind = "..."``."""

    kind: ClassVar[str]


def number(default: float | None, low: float = -math.inf, high: float = math.inf) -> Any:
    """Declare a dataclass field: a number with its range, both ends allowed."""
    return dataclasses.field(default=default, metadata={"low": low, "high": high})


def required_number(low: float = -math.inf, high: float = math.inf) -> Any:
    """Declare a dataclass field: a number that the file must state, with its range, both ends allowed."""
    return dataclasses.field(metadata={"low": low, "high": high})


def check_ranges(settings: Any) -> None:
    """Refuse numbers of a settings dataclass that are not finite or out of the range their field states.

    Raises
    ------
    SettingsError
        Naming the field.

    Examples
    --------
    >>> @dataclasses.dataclass(frozen=True)
    ... class Wind:
    ...     north_mps: float = number(0.0, -100.0, 100.0)
    >>> check_ranges(Wind(300.0))
    Traceback (most recent call last):
    groundstation.base.errors.SettingsError: north_mps: found 300, expected within [-100, 100]
    """
    for field in dataclasses.fields(settings):
        value = getattr(settings, field.name)
        for item in value if isinstance(value, tuple) else (value,):
            if isinstance(item, float) and not math.isfinite(item):
                raise SettingsError(field.name, f"{item:g}", "a finite number")
        expected = _out_of_range(value, field)
        if expected:
            raise SettingsError(field.name, *expected)


def settings_from(cls: type[Settings], table: Mapping[str, Any], where: str, key: str = "") -> Settings:
    """Fill a settings dataclass from a TOML table.

    Parameters
    ----------
    cls : type
        Frozen dataclass; nested dataclasses, tuples of them and unions by ``kind`` are filled too.
    table : mapping
        As ``tomllib`` gives it.
    where : str
        Name of the file, for errors.
    key : str
        Dotted place of the table in the file, for errors.

    Raises
    ------
    SettingsError
        Naming the file and the key.

    Examples
    --------
    >>> @dataclasses.dataclass(frozen=True)
    ... class Wind:
    ...     north_mps: float = number(0.0, -100.0, 100.0)
    >>> settings_from(Wind, {"north_mps": 3}, "a.toml")
    Wind(north_mps=3.0)
    >>> settings_from(Wind, {"nort_mps": 3}, "a.toml", "wind")
    Traceback (most recent call last):
    groundstation.base.errors.SettingsError: a.toml, key wind.nort_mps: found a key that nothing reads, expected
    one of north_mps
    """
    fields = {field.name: field for field in dataclasses.fields(cls)}  # type: ignore[arg-type]
    hints = typing.get_type_hints(cls)
    for name in table:
        if name not in fields and not (name == "kind" and hasattr(cls, "kind")):
            raise _error(where, _join(key, name), "a key that nothing reads", f"one of {', '.join(fields)}")
    values: dict[str, Any] = {}
    for name, field in fields.items():
        place = _join(key, name)
        if name in table:
            values[name] = _convert(hints[name], table[name], where, place)
            _check_range(values[name], field, where, place)
        elif field.default is dataclasses.MISSING and field.default_factory is dataclasses.MISSING:
            raise _error(where, place, "nothing", "a value")
    try:
        return cls(**values)
    except SettingsError as error:  # raised by the class itself, which knows neither file nor table
        place = f"{where}, key {_join(key, error.where)}"
        raise SettingsError(place, error.found, error.expected, error.next_step) from error


def _convert(hint: Any, value: Any, where: str, key: str) -> Any:
    origin, arguments = typing.get_origin(hint), typing.get_args(hint)
    if origin in (typing.Union, types.UnionType):
        members = [member for member in arguments if member is not type(None)]
        if len(members) == 1:
            return _convert(members[0], value, where, key)
        return _convert_by_kind(members, value, where, key)
    if origin is tuple:
        return _convert_tuple(arguments, value, where, key)
    if dataclasses.is_dataclass(hint):
        if not isinstance(value, Mapping):
            raise _error(where, key, repr(value), "a table")
        return settings_from(typing.cast(type[Any], hint), value, where, key)
    if origin is typing.Literal:
        if value not in arguments:
            raise _error(where, key, repr(value), f"one of {', '.join(arguments)}")
        return value
    return _convert_plain(hint, value, where, key)


def _convert_by_kind(members: list[type[HasKind]], value: Any, where: str, key: str) -> Any:
    kinds = {member.kind: member for member in members}
    kind = value.get("kind") if isinstance(value, Mapping) else None
    if kind not in kinds:
        raise _error(where, _join(key, "kind"), repr(kind), f"one of {', '.join(kinds)}")
    return settings_from(kinds[kind], value, where, key)


def _convert_tuple(arguments: tuple[Any, ...], value: Any, where: str, key: str) -> tuple[Any, ...]:
    if not isinstance(value, list):
        raise _error(where, key, repr(value), "a list")
    if len(arguments) == 2 and arguments[1] is Ellipsis:
        arguments = (arguments[0],) * len(value)
    if len(value) != len(arguments):
        raise _error(where, key, f"{len(value)} values", f"{len(arguments)} values")
    pairs = enumerate(zip(arguments, value, strict=True))
    return tuple(_convert(hint, item, where, f"{key}[{i}]") for i, (hint, item) in pairs)


def _convert_plain(hint: Any, value: Any, where: str, key: str) -> Any:
    if hint is float and isinstance(value, int) and not isinstance(value, bool):
        value = float(value)
    if not isinstance(value, hint) or (hint is not bool and isinstance(value, bool)):
        wanted = {"str": "text in quotes", "float": "a number", "int": "a whole number", "bool": "true or false"}
        raise _error(where, key, repr(value), wanted.get(hint.__name__, hint.__name__))
    if isinstance(value, float) and not math.isfinite(value):
        raise _error(where, key, repr(value), "a finite number")
    return value


def _check_range(value: Any, field: "dataclasses.Field[Any]", where: str, key: str) -> None:
    expected = _out_of_range(value, field)
    if expected:
        raise _error(where, key, *expected)


def _out_of_range(value: Any, field: "dataclasses.Field[Any]") -> tuple[str, str] | None:
    """What was found and what was expected, where a number is out of the range of its field."""
    low, high = field.metadata.get("low", -math.inf), field.metadata.get("high", math.inf)
    for item in value if isinstance(value, tuple) else (value,):
        if isinstance(item, int | float) and not low <= item <= high:
            return f"{item:g}", f"{low:g} or more" if math.isinf(high) else f"within [{low:g}, {high:g}]"
    return None


def _join(key: str, name: str) -> str:
    return f"{key}.{name}" if key else name


def _error(where: str, key: str, found: str, expected: str) -> SettingsError:
    return SettingsError(f"{where}, key {key}", found, expected)
