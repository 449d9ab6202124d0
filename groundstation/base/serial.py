"""Frozen dataclasses to JSON values and back, by their types.

These are the rules of every file that is written and read. Floats are rounded by the name of their field, NaN is null,
tuples are lists. A field with ``left_out_when_default`` in its metadata is absent while it has its default; a class
with ``is_kept_apart = True`` (arrays, which have files of their own) is left out with the fields that hold it. Values
are checked when read: one of another kind is a :class:`MismatchError` that names its place. ``base.salvage`` leaves it
out instead.
"""

import dataclasses
import math
import types
import typing
from collections.abc import Callable, Mapping, Sequence
from functools import cache, partial
from typing import TYPE_CHECKING, Any, TypeAlias, TypeVar

import numpy as np

from groundstation.base.digits import USUAL, digits_of, rounded
from groundstation.base.errors import GroundstationError

if TYPE_CHECKING:
    import cattrs  # where something is read: its import takes as long as half of numpy's

Document = TypeVar("Document")
Hook = Callable[[Any, Any], Any]
Writer: TypeAlias = Callable[[Any, int | None], Any]
LEFT_OUT_WHEN_DEFAULT: Mapping[str, Any] = {"left_out_when_default": True}
WANTED = {str: "text", float: "a number", int: "a whole number", bool: "true or false"}


class MismatchError(Exception):
    """Error: a value is not of the kind that its place needs.

    Parameters
    ----------
    found, expected : str
    place : str
        Dotted path within the document; empty while it is not known.
    next_step : str
        Action of the user.
    """

    def __init__(self, found: str, expected: str, place: str = "", next_step: str = "") -> None:
        self.found, self.expected, self.place, self.next_step = found, expected, place, next_step
        text = f"found {found}, expected {expected}" if expected else found
        super().__init__(f"{place}: {text}" if place else text)


# ------------------------------------------------------------------------------------------------ writing


def to_json(value: Any, name: str = "") -> Any:
    """Turn a value into JSON: floats rounded by their name, NaN and infinities null.

    Dataclasses and arrays are opened.

    Parameters
    ----------
    value : dataclass, mapping, sequence, array or plain value
    name : str
        Says how ``value`` is rounded where it is a number, or a list of them.

    Examples
    --------
    >>> to_json({"error_deg": 1.234567, "gap_s": float("nan")})
    {'error_deg': 1.2346, 'gap_s': None}
    """
    return _json(value, digits_of(name) if name else USUAL)


def to_json_exactly(value: Any) -> Any:
    """Turn a value into JSON as :func:`to_json` does, without rounding any number."""
    return _json(value, None)


def _json(value: Any, digits: int | None) -> Any:
    """Return JSON; numbers without a name of their own have so many decimals, or all."""
    return _writer(type(value))(value, digits)  # type: ignore[arg-type]  # a class is hashable


@cache
def _writer(cls: type) -> Writer:
    """Return the writer of a class."""
    if dataclasses.is_dataclass(cls):
        return _object_writer(cls)
    if issubclass(cls, bool | int | types.NoneType):
        return lambda value, _digits: value
    if issubclass(cls, float | np.floating):
        return lambda value, digits: rounded(float(value), digits)
    if issubclass(cls, np.integer | np.bool_):
        return lambda value, _digits: value.item()
    if issubclass(cls, tuple | list | np.ndarray):
        return lambda values, digits: [_json(value, digits) for value in values]
    if issubclass(cls, Mapping):
        return lambda table, digits: {
            str(key): _json(value, _digits_below(str(key), digits)) for key, value in table.items()
        }
    return lambda value, _digits: str(value)


def _digits_below(name: str, above: int | None) -> int | None:
    """Return the decimals of what has a name of its own."""
    return None if above is None else digits_of(name)


def _object_writer(cls: type) -> Writer:
    hints = typing.get_type_hints(cls)
    parts = [field for field in dataclasses.fields(cls) if not is_kept_apart(hints[field.name])]

    def write(value: Any, digits: int | None) -> dict[str, Any]:
        found = {}
        for part in parts:
            one = getattr(value, part.name)
            if "left_out_when_default" in part.metadata and one == default_of(part):
                continue
            found[part.name] = _json(one, _digits_below(part.name, digits))
        return found

    return write


def default_of(field: "dataclasses.Field[Any]") -> Any:
    """Return the default of a field; MISSING where it has none."""
    return field.default if field.default_factory is dataclasses.MISSING else field.default_factory()


def is_kept_apart(hint: Any) -> bool:
    """Tell whether a type holds arrays that have files of their own."""
    return getattr(hint, "is_kept_apart", False) is True or any(map(is_kept_apart, typing.get_args(hint)))


# ------------------------------------------------------------------------------------------------ reading


def from_json(cls: type[Document], document: Any) -> Document:
    """Read a dataclass back from the JSON values of :func:`to_json`.

    Null is NaN where a number is meant. Keys that the class does not know are passed over: a later version may have
    written them.

    Raises
    ------
    MismatchError
        For the first value that is missing or of another kind.

    Examples
    --------
    >>> @dataclasses.dataclass(frozen=True)
    ... class Wind:
    ...     north_mps: float
    ...     levels_m: tuple[float, ...] = ()
    >>> from_json(Wind, {"north_mps": None, "levels_m": [0, 500]})
    Wind(north_mps=nan, levels_m=(0.0, 500.0))
    >>> from_json(Wind, {"north_mps": 1, "levels_m": [0, "high"]})
    Traceback (most recent call last):
    groundstation.base.serial.MismatchError: levels_m[1]: found 'high', expected a number
    """
    return structured(_json_reader(), cls, document)


def structured(reader: "cattrs.Converter", cls: type[Document], document: Any) -> Document:
    """Convert a document to a dataclass; raise the first fault as a :class:`MismatchError`."""
    import cattrs

    try:
        return reader.structure(document, cls)
    except (cattrs.BaseValidationError, MismatchError) as error:
        raise first_mismatch(error) from error


def first_mismatch(error: Exception) -> MismatchError:
    """The first complaint of a converter, with its place in the document."""
    place, cause = _leaf(error, "")
    if isinstance(cause, MismatchError):
        return MismatchError(cause.found, cause.expected, join(place, cause.place), cause.next_step)
    if isinstance(cause, KeyError):
        return MismatchError("nothing", "a value", place)
    if isinstance(cause, GroundstationError):  # raised by the class itself, which knows neither file nor table
        return MismatchError(cause.found, cause.expected, join(place, cause.where), cause.next_step)
    return MismatchError(f"{type(cause).__name__}: {cause}", "", place)


def _leaf(error: BaseException, place: str) -> tuple[str, BaseException]:
    """Follow the first complaint of a group down to its leaf; return its place and itself."""
    import cattrs

    if not isinstance(error, cattrs.BaseValidationError):
        return place, error
    first = error.exceptions[0]
    for note in getattr(first, "__notes__", ()):
        if isinstance(note, cattrs.AttributeValidationNote):
            place = join(place, note.name)
        elif isinstance(note, cattrs.IterableValidationNote):
            place = join(place, f"[{note.index}]" if isinstance(note.index, int) else str(note.index))
    return _leaf(first, place)


def join(place: str, name: str) -> str:
    """Return the dotted path of a name within a place.

    Examples
    --------
    >>> join("", "a"), join("a", "b"), join("a", "[0]"), join("a", "")
    ('a', 'a.b', 'a[0]', 'a')
    """
    return f"{place}.{name}" if place and name and not name.startswith("[") else place + name


@cache
def _json_reader() -> "cattrs.Converter":
    reader = new_reader(WANTED, float_of=_json_number)
    reader.register_structure_hook_factory(dataclasses.is_dataclass, lambda cls: _object_reader(cls, reader))
    return reader


def _object_reader(cls: type, reader: "cattrs.Converter") -> Hook:
    import cattrs.gen

    read: Hook = cattrs.gen.make_dict_structure_fn(cls, reader)

    def strict(value: Any, kind: Any) -> Any:
        if not isinstance(value, Mapping):
            raise MismatchError(repr(value), "an object")
        return read(value, kind)

    return strict


def new_reader(
    wanted: Mapping[type, str], table: str = "an object", *, float_of: Callable[[Any], float]
) -> "cattrs.Converter":
    """Return a strict converter without a rule for dataclasses.

    Parameters
    ----------
    wanted : mapping of plain type to text
        Expectation of a value of that type, for messages.
    table : str
        Name of a mapping, for messages.
    float_of : callable
        Reads a number; raises TypeError for anything else.
    """
    import cattrs

    reader = cattrs.Converter()
    for kind in (str, int, bool):
        reader.register_structure_hook(kind, partial(_plain, wanted=wanted))
    reader.register_structure_hook(float, partial(_number, float_of=float_of, wanted=wanted[float]))
    reader.register_structure_hook_func(lambda hint: origin_of(hint) is typing.Literal, _literal)
    reader.register_structure_hook_func(lambda hint: hint in (Any, object), lambda value, _hint: value)
    reader.register_structure_hook_factory(
        lambda hint: origin_of(hint) in (typing.Union, types.UnionType),
        lambda hint: _union_reader(hint, reader),
    )
    reader.register_structure_hook_factory(
        lambda hint: origin_of(hint) is tuple, lambda hint: tuple_reader(typing.get_args(hint), reader)
    )
    reader.register_structure_hook_factory(
        lambda hint: origin_of(hint) in (Mapping, dict), lambda hint: _mapping_reader(hint, table, reader)
    )
    return reader


def origin_of(hint: Any) -> Any:
    """Return the origin of a generic type (``tuple`` of ``tuple[int, ...]``), else None."""
    return typing.get_origin(hint)


def _json_number(value: Any) -> float:
    if value is None:
        return math.nan
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise TypeError
    return float(value)


def _number(value: Any, _hint: Any, *, float_of: Callable[[Any], float], wanted: str) -> float:
    try:
        return float_of(value)
    except TypeError:
        raise MismatchError(repr(value), wanted) from None


def _plain(value: Any, hint: type, *, wanted: Mapping[type, str]) -> Any:
    if not isinstance(value, hint) or (hint is not bool and isinstance(value, bool)):
        raise MismatchError(repr(value), wanted[hint])
    return value


def _literal(value: Any, hint: Any) -> Any:
    if value not in typing.get_args(hint):
        raise MismatchError(repr(value), f"one of {', '.join(map(str, typing.get_args(hint)))}")
    return value


def tuple_reader(hints: tuple[Any, ...], reader: "cattrs.Converter") -> Hook:
    """Return a reader of tuples, item by item, from lists alone."""
    is_fixed = len(hints) != 2 or hints[1] is not Ellipsis

    def read(value: Any, _hint: Any) -> Any:
        if not isinstance(value, list | tuple):
            raise MismatchError(repr(value), "a list")
        if is_fixed and len(value) != len(hints):
            raise MismatchError(f"{len(value)} values", f"{len(hints)} values")
        return _items(value, hints if is_fixed else hints[:1] * len(value), reader)

    return read


def _mapping_reader(hint: Any, table: str, reader: "cattrs.Converter") -> Hook:
    """Return a reader of mappings, entry by entry."""
    import cattrs.gen

    make: Callable[..., Hook] = cattrs.gen.mapping_structure_factory
    entries = make(hint, reader, structure_to=dict)

    def read(value: Any, kind: Any) -> Any:
        if not isinstance(value, Mapping):
            raise MismatchError(repr(value), table)
        return entries(value, kind)

    return read


def _items(values: Sequence[Any], hints: Sequence[Any], reader: "cattrs.Converter") -> tuple[Any, ...]:
    import cattrs

    found = []
    for index, (value, hint) in enumerate(zip(values, hints, strict=True)):
        try:
            found.append(reader.structure(value, hint))
        except Exception as error:
            error.add_note(cattrs.IterableValidationNote(f"item {index}", index, hint))
            raise cattrs.IterableValidationError("list", [error], tuple) from None
    return tuple(found)


def _union_reader(hint: Any, reader: "cattrs.Converter") -> Hook:
    """Return a reader of a value that may be of several types.

    It reads nothing, a dataclass named by ``kind``, a list, or the plain type that fits.
    """
    members = [member for member in typing.get_args(hint) if member is not type(None)]
    may_be_absent = len(members) < len(typing.get_args(hint))
    kinds = {member.kind: member for member in members if hasattr(member, "kind")}

    def read(value: Any, _hint: Any) -> Any:
        if value is None and may_be_absent:
            return None
        if len(kinds) > 1:
            kind = value.get("kind") if isinstance(value, Mapping) else None
            if not isinstance(kind, str) or kind not in kinds:
                raise MismatchError(repr(kind), f"one of {', '.join(kinds)}", "kind")
            return reader.structure(value, kinds[kind])
        if type(value) is int and float in members and len(members) > 1:  # settings: 400 draws stay 400
            return value
        return reader.structure(value, next((one for one in members if _fits(value, one)), members[0]))

    return read


def _fits(value: Any, hint: Any) -> bool:
    """Tell whether a value looks like one of a type, among the members of a union."""
    origin = origin_of(hint)
    if origin is tuple:
        return isinstance(value, list | tuple)
    if origin in (Mapping, dict) or dataclasses.is_dataclass(hint):
        return isinstance(value, Mapping)
    if hint is float:
        return isinstance(value, int | float) and not isinstance(value, bool)
    return isinstance(hint, type) and type(value) is hint
