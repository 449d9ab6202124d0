"""Typed arrays: one class per figure, whose fields are its columns.

So the type checker finds a renamed column.
"""

import re
import typing
from collections.abc import Callable, Iterator, Mapping
from dataclasses import field, fields
from functools import cache
from types import MappingProxyType
from typing import Any, ClassVar, Self, TypeAlias, TypeVar, cast, dataclass_transform

import numpy as np
from numpy.typing import NDArray

from groundstation.base.dataclasses import dataclass
from groundstation.base.errors import GroundstationError
from groundstation.base.records import frozen
from groundstation.results.figures import FigureData

Floats: TypeAlias = NDArray[np.float64]  # NaN is a gap
Flags: TypeAlias = NDArray[np.bool_]
Counts: TypeAlias = NDArray[np.int64]
Texts: TypeAlias = NDArray[np.str_]
Times: TypeAlias = NDArray[np.datetime64]  # UTC, nanoseconds
ByName: TypeAlias = Mapping[str, Floats]  # a column each, by what their names differ in

_KINDS: Mapping[Any, type[np.generic]] = {
    Floats: np.float64,
    Flags: np.bool_,
    Counts: np.int64,
    Texts: np.str_,
    Times: np.datetime64,
}
_FILLERS: Mapping[str, Any] = {"f": np.nan, "b": False, "i": 0, "U": ""}
P = TypeVar("P")


def column(name: str) -> Any:
    """Declare a field whose column has another name.

    ``{}`` in a name of a :class:`Part` stands for the name of the part.
    """
    return field(metadata={"name": name})


def family(name: str) -> Any:
    """Declare a field of columns :data:`ByName`.

    ``{}`` in the name stands for the part in which they differ.
    """
    return field(metadata={"name": name})


@dataclass_transform(frozen_default=True, kw_only_default=True, field_specifiers=(column, family, field))
class Part:
    """Columns that a figure has several times, as for the channels north and east.

    The field of a figure that holds one gives it its name: ``north`` for ``north_tilt_arcsec``.
    """

    def __init_subclass__(cls) -> None:
        dataclass(frozen=True, eq=False, kw_only=True)(cls)


@dataclass_transform(frozen_default=True, kw_only_default=True, field_specifiers=(column, family, field))
class Arrays(FigureData):
    """Arrays of one figure, each a field.

    A field that may be None is a column that the figure may lack.

    Parameters
    ----------
    figure : str
        Keyword of the class: file name in arrays/ and tables/.
    digits : mapping of str to int
        Keyword of the class: decimals a column is rounded to in tables/; ``*_dph`` is every column that ends so.

    Examples
    --------
    >>> class Wind(Arrays, figure="wind", digits={"*_mps": 1}):
    ...     time_s: Floats
    ...     north_mps: Floats
    ...     gust_mps: Floats | None = None
    >>> wind = Wind(time_s=np.array([0.0, 1.0]), north_mps=np.array([3.0, 4.0]))
    >>> wind, wind.digits["north_mps"], len(wind)
    (<FigureData wind: 2 rows of time_s, north_mps>, 1, 2)
    >>> Wind.of(FigureData("wind", {"time_s": np.array([0.0]), "north_mps": np.array([2.0])}, {})).north_mps.tolist()
    [2.0]
    """

    figure: ClassVar[str]
    _digits: ClassVar[Mapping[str, int]]

    def __init_subclass__(cls, *, figure: str, digits: Mapping[str, int] = MappingProxyType({})) -> None:
        dataclass(frozen=True, eq=False, repr=False, kw_only=True)(cls)
        cls.figure, cls._digits = figure, digits

    def __post_init__(self) -> None:
        _make_typed(self)
        columns = MappingProxyType({name: value for name, value in _named(self) if value is not None})
        digits = {name: places for name in columns if (places := _places(self._digits, name)) is not None}
        vars(self).update(name=self.figure, columns=columns, digits=MappingProxyType(digits))

    @classmethod
    def of(cls, figure: FigureData) -> Self:
        """Read the typed columns of a saved figure; columns that it does not know are left out.

        Raises
        ------
        MissingColumnError
            When one is missing that is not optional.
        """
        if isinstance(figure, cls):
            return figure
        taken = set[str]()
        made: Self = _made(cls, figure, "", taken)
        vars(made)["name"] = figure.name
        return made

    @classmethod
    def empty(cls) -> Self:
        """The figure without a row."""
        made: Self = _empty(cls)
        return made

    def of_one(self, *of: str) -> Self:
        """Return the same arrays under the name of one of several figures of a kind."""
        made = self._each(lambda values: values)
        vars(made)["name"] = self.figure.format(*of)
        return made

    def where(self, chosen: Any) -> Self:
        """Return the figure with some of its rows: a mask, positions or a slice."""
        return self._each(lambda values: values[chosen])

    def with_breaks(self, after: Any, **filled: Any) -> Self:
        """Return the figure with a row inserted behind each position in ``after``.

        It has no values (NaN, False, 0, no text) but for the columns in ``filled``.
        """
        made = self._each(lambda values: np.insert(values, np.asarray(after) + 1, _FILLERS[values.dtype.kind]))
        at = np.asarray(after) + 1 + np.arange(len(after))
        changed = {}
        for name, values in filled.items():
            changed[name] = np.array(getattr(made, name))
            changed[name][at] = values
        return made if not changed else type(made)(**{**_values(made), **changed})

    def _each(self, change: Callable[[NDArray[Any]], NDArray[Any]]) -> Self:
        made = type(self)(**{name: _changed(value, change) for name, value in _values(self).items()})
        vars(made)["name"] = self.name
        return made


T = TypeVar("T", bound=Arrays)


def found_in(figures: typing.Iterable[FigureData], kind: type[T]) -> T | None:
    """The typed arrays of a kind among the figures of an answer, None where it has none."""
    found = next((figure for figure in figures if figure.name == kind.figure), None)
    return None if found is None else kind.of(found)


class MissingColumnError(GroundstationError):
    """Error: a saved figure lacks a column, which holds numbers, flags or text by ``kind``."""

    def __init__(self, figure: str, column: str, kind: type[np.generic]) -> None:
        super().__init__(f"arrays/{figure}.parquet", f"no column {column}", next_step="run the log again")
        self.column, self.kind = column, kind


def joined(parts: typing.Sequence[P]) -> P:
    """Join figures of one type, their rows one behind the other.

    A column that one of them lacks is left out.
    """
    first = parts[0]
    values = {
        name: _joined([getattr(one, name) for one in parts])
        for name in (part.name for part in fields(cast(Any, first)))
    }
    return type(first)(**values)


def _joined(values: list[Any]) -> Any:
    if any(value is None for value in values):
        return None
    if isinstance(values[0], Mapping):
        return {name: np.concatenate([one[name] for one in values]) for name in values[0]}
    return joined(values) if isinstance(values[0], Part) else np.concatenate(values)


def _values(one: Any) -> dict[str, Any]:
    return {part.name: getattr(one, part.name) for part in fields(one)}


def _changed(value: Any, change: Callable[[NDArray[Any]], NDArray[Any]]) -> Any:
    """Change the arrays of a field, each by the same function."""
    if value is None:
        return None
    if isinstance(value, Mapping):
        return {name: change(values) for name, values in value.items()}
    if isinstance(value, Part):
        return type(value)(**{name: _changed(values, change) for name, values in _values(value).items()})
    return change(value)


def _make_typed(one: Any) -> None:
    """Give each column of a figure or part its type, read-only."""
    for part in _fields(cast(type, type(one))):
        value = getattr(one, part.name)
        if isinstance(value, Mapping):
            value = MappingProxyType({name: frozen(_as(Floats, values)) for name, values in value.items()})
        elif isinstance(value, Part):
            _make_typed(value)
        elif value is not None:
            value = frozen(_as(part.kind, np.asarray(value)))
        object.__setattr__(one, part.name, value)


@dataclass(frozen=True)
class _Field:
    """Field of a figure or part: name, name of its columns, type, and whether it may be None."""

    name: str
    pattern: str
    kind: Any
    is_optional: bool


@cache
def _fields(kind: type) -> tuple[_Field, ...]:
    hints = typing.get_type_hints(kind)
    usual = "{}_" if issubclass(kind, Part) else ""
    found = []
    for part in fields(cast(Any, kind)):
        hint = hints[part.name]
        options = [one for one in typing.get_args(hint) if one is not type(None)]
        is_optional = type(None) in typing.get_args(hint)
        held = options[0] if is_optional else hint
        found.append(_Field(part.name, part.metadata.get("name", usual + part.name), held, is_optional))
    return tuple(found)


def _named(one: Any, of: str = "") -> Iterator[tuple[str, Any]]:
    """Names of columns and their values in the order of the fields."""
    for part in _fields(cast(type, type(one))):
        value = getattr(one, part.name)
        if isinstance(value, Part):
            yield from _named(value, part.name)
        elif isinstance(value, Mapping):
            yield from ((part.pattern.format(name), values) for name, values in value.items())
        else:
            yield part.pattern.format(of), value


def _made(kind: type, figure: FigureData, of: str, taken: set[str]) -> Any:
    """Make a figure or part from columns by their names; ``taken`` gathers these."""
    found: dict[str, Any] = {}
    families = []
    for part in _fields(kind):
        if part.kind == ByName:
            families.append(part)
        elif isinstance(part.kind, type) and issubclass(part.kind, Part):
            found[part.name] = _made(part.kind, figure, part.name, taken)
        else:
            name = part.pattern.format(of)
            taken.add(name)
            values = figure.columns.get(name)
            if values is None and not part.is_optional:
                raise MissingColumnError(figure.name, name, _KINDS[part.kind])
            found[part.name] = None if values is None else _as(part.kind, values)
    for part in families:
        before, _, behind = part.pattern.partition("{}")
        pattern = re.compile(re.escape(before) + "(.+)" + re.escape(behind))
        matches = ((name, pattern.fullmatch(name)) for name in figure.columns if name not in taken)
        members = {match[1]: _as(Floats, figure.columns[name]) for name, match in matches if match}
        taken.update(part.pattern.format(name) for name in members)
        found[part.name] = members if members or not part.is_optional else None
    return kind(**found)


def _empty(kind: type) -> Any:
    """Make a figure or part whose columns have no rows; optional columns are left out."""
    columns: dict[str, Any] = {}
    for part in _fields(kind):
        if part.is_optional:
            columns[part.name] = None
        elif part.kind == ByName:
            columns[part.name] = {}
        elif isinstance(part.kind, type) and issubclass(part.kind, Part):
            columns[part.name] = _empty(part.kind)
        else:
            columns[part.name] = _as(part.kind, np.zeros(0))
    return kind(**columns)


def _as(kind: Any, values: NDArray[Any]) -> NDArray[Any]:
    wanted = _KINDS[kind]
    if wanted is np.datetime64:
        return np.asarray(values, dtype="datetime64[ns]")
    if wanted is np.bool_ and values.dtype.kind == "f":
        return np.asarray(np.isfinite(values) & (values != 0.0))
    return np.asarray(values, dtype=wanted)


def _places(digits: Mapping[str, int], name: str) -> int | None:
    """Decimals of a column: by its name, else by its end."""
    if name in digits:
        return digits[name]
    return next((places for key, places in digits.items() if key[0] == "*" and name.endswith(key[1:])), None)
