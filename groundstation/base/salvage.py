"""Dataclasses from JSON that may be damaged or written by anyone.

Sound parts are kept, the rest is left out.
"""

import dataclasses
import typing
from collections.abc import Mapping
from functools import cache
from typing import TYPE_CHECKING, Any

from groundstation.base.serial import (
    WANTED,
    Document,
    Hook,
    MismatchError,
    new_reader,
    origin_of,
    structured,
    tuple_reader,
)

if TYPE_CHECKING:
    import cattrs

LARGEST = 1 << 62  # largest number read from such a file


def salvaged(cls: type[Document], document: Any) -> Document:
    """Read the sound part of a document that may be damaged or written by anyone.

    The rest is left out. A value of another kind gives its field's default, or drops the entry of a list or mapping it
    stands in. Whole numbers are counts: not negative.

    Raises
    ------
    MismatchError
        When the document itself lacks what its class must have.

    Examples
    --------
    >>> @dataclasses.dataclass(frozen=True)
    ... class Wind:
    ...     samples: int = 0
    ...     levels_m: tuple[float, ...] = ()
    >>> salvaged(Wind, {"samples": -3, "levels_m": [0, "high", 500]})
    Wind(samples=0, levels_m=(0.0, 500.0))
    """
    return structured(_salvager(), cls, document)


@cache
def _salvager() -> "cattrs.Converter":
    reader = new_reader(WANTED, float_of=_sound_number)
    reader.register_structure_hook(int, _count)
    reader.register_structure_hook_factory(
        lambda hint: origin_of(hint) in (tuple, Mapping, dict) and typing.get_args(hint)[-1] is not None,
        lambda hint: _lenient_several(hint, reader),
    )
    reader.register_structure_hook_factory(dataclasses.is_dataclass, lambda cls: _lenient_object(cls, reader))
    return reader


def _sound_number(value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise TypeError
    if not abs(value) < LARGEST:
        raise TypeError
    return float(value)


def _count(value: Any, _hint: Any) -> int:
    if type(value) is not int or not 0 <= value < LARGEST:
        raise MismatchError(repr(value), "a count")
    return value


def _sound(reader: "cattrs.Converter", value: Any, hint: Any) -> tuple[Any, ...]:
    """Return the value in a tuple of one; an empty tuple where it is not of its kind."""
    import cattrs

    try:
        return (reader.structure(value, hint),)
    except (MismatchError, cattrs.BaseValidationError, RecursionError):
        return ()


def _lenient_several(hint: Any, reader: "cattrs.Converter") -> Hook:
    arguments = typing.get_args(hint)
    is_mapping = origin_of(hint) is not tuple
    if not is_mapping and arguments[-1] is not Ellipsis:
        return tuple_reader(arguments, reader)

    def read(value: Any, _hint: Any) -> Any:
        if is_mapping and isinstance(value, Mapping):
            return {str(key): one for key, item in value.items() for one in _sound(reader, item, arguments[1])}
        if is_mapping or not isinstance(value, list | tuple):
            raise MismatchError(repr(value), "an object" if is_mapping else "a list")
        return tuple(one for item in value for one in _sound(reader, item, arguments[0]))

    return read


def _lenient_object(cls: type, reader: "cattrs.Converter") -> Hook:
    hints, parts = typing.get_type_hints(cls), dataclasses.fields(cls)

    def read(value: Any, _hint: Any) -> Any:
        if not isinstance(value, Mapping):
            raise MismatchError(repr(value), "an object")
        found = {}
        for part in parts:
            sound = _sound(reader, value[part.name], hints[part.name]) if part.name in value else ()
            if sound:
                found[part.name] = sound[0]
            elif part.default is dataclasses.MISSING and part.default_factory is dataclasses.MISSING:
                raise MismatchError(repr(value.get(part.name)), "a value", part.name)
        return cls(**found)

    return read
