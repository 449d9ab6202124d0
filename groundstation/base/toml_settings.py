"""Frozen dataclasses filled strictly from TOML.

An unknown key, a wrong type or a value out of range is an error. A field states its range in its metadata:
``number(0.5, low=0.0)``; a class that is also built without a file calls :func:`check_ranges` in its ``__post_init__``.
A SettingsError raised there says the field as its place, and :func:`settings_from` puts file and table before it. A
field that holds one of several classes (legs, faults) is a union whose members carry a class attribute ``kind``; the
TOML table names it with the key ``kind``.
"""

import dataclasses
import math
import typing
from collections.abc import Callable, Mapping
from functools import cache
from typing import TYPE_CHECKING, Any, ClassVar, Protocol, TypeVar

from groundstation.base.errors import SettingsError

if TYPE_CHECKING:
    import cattrs

Settings = TypeVar("Settings")


class HasKind(Protocol):
    """A settings class that a TOML table selects with ``kind = "..."``."""

    kind: ClassVar[str]


def number(default: float | None, low: float = -math.inf, high: float = math.inf) -> Any:
    """Declare a dataclass field: a number with its range, both ends allowed."""
    return dataclasses.field(default=default, metadata={"low": low, "high": high})


def required_number(low: float = -math.inf, high: float = math.inf) -> Any:
    """Declare a field for a number that the file must state, with its range, ends included."""
    return dataclasses.field(metadata={"low": low, "high": high})


def check_ranges(settings: Any) -> None:
    """Refuse numbers of a settings dataclass that are not finite or out of range.

    Each field states its range.

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
    import cattrs  # not for `--help`

    from groundstation.base.serial import MismatchError, first_mismatch, join

    try:
        found: Settings = _reader().structure(table, cls)
    except (cattrs.BaseValidationError, MismatchError) as error:
        told = first_mismatch(error)
        raise SettingsError(
            f"{where}, key {join(key, told.place)}", told.found, told.expected, told.next_step
        ) from error
    return found


def trusted(cls: type[Settings], table: Mapping[str, Any]) -> Settings:
    """Fill a dataclass from a table of our own, which a test reads strictly.

    Examples
    --------
    >>> @dataclasses.dataclass(frozen=True)
    ... class Wind:
    ...     north_mps: float
    ...     levels_m: tuple[float, ...] = ()
    >>> trusted(Wind, {"north_mps": 3, "levels_m": [10.0]})
    Wind(north_mps=3.0, levels_m=(10.0,))
    """
    hints = _hints(cls)  # type: ignore[arg-type]  # a class can be hashed
    return cls(**{name: _trusted(hints[name], value) for name, value in table.items()})


@cache
def _hints(cls: type[Any]) -> dict[str, Any]:
    return typing.get_type_hints(cls)


def _trusted(kind: Any, value: Any) -> Any:
    if dataclasses.is_dataclass(kind):
        return trusted(typing.cast("type[Any]", kind), value)
    if isinstance(value, list):
        return tuple(_trusted(typing.get_args(kind)[0], one) for one in value)
    is_number = isinstance(value, int) and float in (kind, *typing.get_args(kind))
    return float(value) if is_number else value


@cache
def _reader() -> "cattrs.Converter":
    from groundstation.base.serial import new_reader

    wanted = {str: "text in quotes", float: "a number", int: "a whole number", bool: "true or false"}
    reader = new_reader(wanted, "a table", float_of=_finite)
    reader.register_structure_hook_factory(dataclasses.is_dataclass, lambda cls: _table_reader(cls, reader))
    return reader


def _finite(value: Any) -> float:
    from groundstation.base.serial import MismatchError

    if isinstance(value, bool) or not isinstance(value, int | float):
        raise TypeError
    if not math.isfinite(value):
        raise MismatchError(repr(value), "a finite number")
    return float(value)


def _table_reader(cls: type, reader: "cattrs.Converter") -> Callable[[Any, Any], Any]:
    """Return a reader of a TOML table.

    It refuses keys that the class does not know, and numbers out of the range of their field.
    """
    from cattrs.gen import make_dict_structure_fn, override

    from groundstation.base.serial import MismatchError

    fields = {field.name: field for field in dataclasses.fields(cls)}
    hints = typing.get_type_hints(cls)
    ranged = {
        name: override(struct_hook=_ranged_reader(field, hints[name], reader))
        for name, field in fields.items()
        if field.metadata
    }
    make: Callable[..., Callable[[Any, Any], Any]] = make_dict_structure_fn
    read = make(cls, reader, **ranged)

    def strict(value: Any, kind: Any) -> Any:
        if not isinstance(value, Mapping):
            raise MismatchError(repr(value), "a table")
        for name in value:
            if name not in fields and not (name == "kind" and hasattr(cls, "kind")):
                raise MismatchError("a key that nothing reads", f"one of {', '.join(fields)}", str(name))
        return read(value, kind)

    return strict


def _ranged_reader(field: "dataclasses.Field[Any]", hint: Any, reader: "cattrs.Converter") -> Callable[[Any, Any], Any]:
    from groundstation.base.serial import MismatchError

    def read(value: Any, _hint: Any) -> Any:
        found = reader.structure(value, hint)
        problem = _out_of_range(found, field)
        if problem:
            raise MismatchError(*problem)
        return found

    return read


def _out_of_range(value: Any, field: "dataclasses.Field[Any]") -> tuple[str, str] | None:
    """Return what was found and what was expected where a number is out of its field's range."""
    low, high = field.metadata.get("low", -math.inf), field.metadata.get("high", math.inf)
    for item in value if isinstance(value, tuple) else (value,):
        if isinstance(item, int | float) and not low <= item <= high:
            return f"{item:g}", f"{low:g} or more" if math.isinf(high) else f"within [{low:g}, {high:g}]"
    return None
