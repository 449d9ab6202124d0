"""Results as pandas frames: every list of rows is a table with a name."""

import re
import typing
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import fields, is_dataclass
from functools import cache
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, NamedTuple, cast

import numpy as np

from groundstation.base.errors import UnknownNameError
from groundstation.base.unit_names import units_of
from groundstation.results.figures import FigureData

if TYPE_CHECKING:
    import pandas as pd

FIRST = ("verdict", "state", "grade", "outcome", "verdict_reason", "sentence")  # what a short text begins with
LINE, LINES, LONGEST_TEXT = 100, 3, 60  # characters and lines of a short text, characters of a value in it
ROWS = "rows"  # a name that says nothing without that of what holds them


class Brief:
    """Dataclass with a short text: its first values, and the names of its lists."""

    def __init_subclass__(cls, **options: Any) -> None:
        super().__init_subclass__(**options)
        if "__repr__" not in cls.__dict__:
            cls.__repr__ = Brief.__repr__  # type: ignore[method-assign]  # a dataclass writes none where there is one

    def __repr__(self) -> str:
        values = {part.name: getattr(self, part.name) for part in fields(cast(Any, self))}
        plain = [
            f"{name}={_shown(value, LINE - 20 if name in FIRST else LONGEST_TEXT)}"
            for name, value in _in_order(values)
            if _is_plain(value)
        ]
        told = _lines(f"<{type(self).__name__}", plain, LINES)
        if lists := [f"{name} ({len(getattr(self, name))})" for name in row_fields(type(self)) if getattr(self, name)]:
            told += _lines(" tables:", lists, 1)
        return "\n".join(told) + ">"


class Tabular(Brief):
    """A results dataclass whose lists of rows are pandas frames by the name of the field.

    A list inside the rows of another one is a table too; the row that holds it is named in its first columns.
    """

    @classmethod
    def _tables(cls) -> "Mapping[str, RowsInside]":
        return tables_of(cast(Any, cls))

    def table_names(self) -> tuple[str, ...]:
        """Names that :meth:`to_frame` takes."""
        return tuple(self._tables())

    def to_frame(self, table: str = "") -> "pd.DataFrame":
        """A list of rows as a frame; the first list when no name is given.

        ``frame.attrs["units"]`` has the unit of each column that has one.

        Parameters
        ----------
        table : str
            One of :meth:`table_names`. A list without rows gives a frame with its columns and no row.

        Raises
        ------
        UsageError
            When there is no such table.

        Examples
        --------
        >>> from groundstation.systems.inertial.forecast_answer import ForecastResult, SkillRow
        >>> rows = (SkillRow("raw_ins", 10.0, 3, 843.0, 700.0, 1500.0, None),)
        >>> forecast = ForecastResult("smoothed_start", 0.0, 300.0, True, "", rows)
        >>> forecast.to_frame()[["method", "horizon_min", "rms_m"]].values.tolist()
        [['raw_ins', 10.0, 843.0]]
        >>> forecast.to_frame().attrs["units"]["rms_m"]
        'm'
        >>> len(forecast.to_frame("gaps")), forecast.table_names()[:2]
        (0, ('skill', 'gaps'))
        """
        known = self._tables()
        name = table or next(iter(known), "")
        if name not in known:
            raise UnknownNameError("tables", name, self.table_names())
        inside = known[name]
        held = list(_held(self, inside.steps, ()))
        frame = rows_frame(inside.row, [row for _, row in held])
        for place, key in reversed(list(enumerate(inside.keys))):
            if key not in frame:
                frame.insert(0, key, [values[place] for values, _ in held])
        frame.attrs["units"] = units_of(frame.columns)
        return frame

    def _repr_html_(self) -> str:
        """Return all fields that are no list, and the names of its tables, for notebooks."""
        from html import escape

        import pandas as pd

        shown = {part.name: getattr(self, part.name) for part in fields(cast(Any, self))}
        plain = {name: value for name, value in shown.items() if value is None or isinstance(value, str | int | float)}
        told = "" if plain else f"<pre>{escape(repr(self))}</pre>"
        if names := self.table_names():
            plain["table_names()"] = ", ".join(names)
        return told + pd.Series(plain, dtype=object).to_frame().to_html(header=False)


class RowsInside(NamedTuple):
    """Rows somewhere inside a result: their class, and the fields that lead there.

    ``keys`` are the columns that name the rows which hold them.
    """

    row: type
    steps: tuple[str, ...]
    keys: tuple[str, ...] = ()


@cache
def tables_of(results: type) -> Mapping[str, RowsInside]:
    """Return the tables of a results dataclass by name: its own lists, then those inside.

    A list inside has the name of its field; where that is no name of one table alone, the fields that lead there stand
    before it: ``position_errors.parts``. A property that gives rows is a table too.
    """
    own = {name: RowsInside(row, (name,)) for name, row in row_fields(results).items()}
    inside = [one for one in _inside(results, RowsInside(results, ()), ()) if len(one.steps) > 1]
    counts = Counter(one.steps[-1] for one in inside)
    for one in inside:
        last = one.steps[-1]
        is_told = counts[last] == 1 and last not in own and last != ROWS
        own[last if is_told else ".".join(one.steps if counts[last] == 1 else _least(one, inside))] = one
    made = {name: RowsInside(row, (name,)) for name, row in _made_rows(results).items() if name not in own}
    return MappingProxyType(own | made)


def _least(one: RowsInside, every: Sequence[RowsInside]) -> tuple[str, ...]:
    """Return the fewest last steps that no other rows end with."""
    for count in range(2, len(one.steps)):
        if sum(other.steps[-count:] == one.steps[-count:] for other in every) == 1:
            return one.steps[-count:]
    return one.steps


def _inside(holder: type, at: RowsInside, seen: tuple[type, ...]) -> Iterator[RowsInside]:
    """Walk through the lists of rows inside a dataclass, level by level."""
    if holder in seen:
        return
    for name, part in _parts(holder).items():
        steps = (*at.steps, name)
        if part.is_list:
            found = RowsInside(part.kind, steps, at.keys)
            yield found
            deeper = found._replace(keys=(*at.keys, _key(part.kind)))
        else:
            deeper = RowsInside(part.kind, steps, at.keys)
        yield from _inside(part.kind, deeper, (*seen, holder))


class _Part(NamedTuple):
    """Dataclass, or list of dataclasses, in a field."""

    kind: type
    is_list: bool


@cache
def _parts(holder: type) -> Mapping[str, _Part]:
    found: dict[str, _Part] = {}
    for name, hint in typing.get_type_hints(holder).items():
        if (row := _row_class(hint)) is not None:
            found[name] = _Part(row, True)
            continue
        for kind in (hint, *typing.get_args(hint)):
            if _is_part(kind):
                found[name] = _Part(kind, False)
    return found


def _row_class(hint: Any) -> type | None:
    """Return the class of the rows of ``tuple[Row, ...]``; None for any other hint."""
    row = typing.get_args(hint)[0] if typing.get_origin(hint) is tuple and typing.get_args(hint) else None
    return row if _is_part(row) else None


def _is_part(kind: Any) -> typing.TypeGuard[type]:
    return isinstance(kind, type) and is_dataclass(kind) and not issubclass(kind, FigureData)


def _made_rows(results: type) -> dict[str, type]:
    """Properties of a results dataclass that give rows: name to the class of a row."""
    found: dict[str, type] = {}
    for name in dir(results):
        made = getattr(results, name, None)
        if isinstance(made, property) and made.fget is not None and not name.startswith("_"):
            row = _row_class(_hint_of(made))
            if row is not None:
                found[name] = row
    return found


def _hint_of(made: property) -> Any:
    try:
        return typing.get_type_hints(made.fget).get("return")
    except NameError:  # a class that is imported for the type checker alone: no row of ours
        return None


def row_fields(results: type) -> dict[str, type]:
    """Fields of a results dataclass that are lists of rows: name to the class of a row."""
    return {name: part.kind for name, part in _parts(results).items() if part.is_list}


def _key(row: type) -> str:
    """Name the column that tells which row holds others.

    It is the class of the row, with the unit of its first field.

    Examples
    --------
    >>> from groundstation.systems.landing.answer import Approach, StabilisedAt
    >>> _key(Approach), _key(StabilisedAt)
    ('approach', 'stabilised_at_m')
    """
    first = fields(cast(Any, row))[0].name
    name = re.sub(r"(?<!^)(?=[A-Z])", "_", row.__name__).lower()
    unit = units_of((first,))
    return name + first[first.rindex("_") :] if unit else name


def _held(holder: Any, steps: tuple[str, ...], keys: tuple[Any, ...]) -> Iterator[tuple[tuple[Any, ...], Any]]:
    """Walk through the rows at the end of some steps, each with the names of its holders."""
    if not steps:
        yield keys, holder
        return
    found = getattr(holder, steps[0])
    if found is None:
        return
    if not isinstance(found, tuple):
        yield from _held(found, steps[1:], keys)
        return
    for one in found:
        own = (getattr(one, fields(one)[0].name),) if len(steps) > 1 else ()
        yield from _held(one, steps[1:], (*keys, *own))


def rows_frame(row_class: type, rows: Sequence[Any]) -> "pd.DataFrame":
    """Rows as a frame; a missing number is NaN, lists inside a row are left out.

    A dataclass inside a row gives a column for each of its fields: ``runway.length_m``. Properties that a row names in
    ``also_in_frames`` are its last columns.
    """
    import pandas as pd

    frame = pd.DataFrame(dict(_columns(row_class, rows, "")))
    frame.attrs["units"] = units_of(frame.columns)
    return frame


def _columns(row_class: type, rows: Sequence[Any], before: str) -> Iterator[tuple[str, Any]]:
    hints, parts = typing.get_type_hints(row_class), _parts(row_class)
    for name in (part.name for part in fields(cast(Any, row_class))):
        values = [None if row is None else getattr(row, name) for row in rows]
        if name not in parts:
            is_number = hints[name] in (float, float | None)
            yield before + name, np.array(values, dtype=np.float64) if is_number else values
        elif not parts[name].is_list:
            yield from _columns(parts[name].kind, values, f"{before}{name}.")
    for name in getattr(row_class, "also_in_frames", ()):
        yield before + name, [None if row is None else getattr(row, name) for row in rows]


def _in_order(values: Mapping[str, Any]) -> list[tuple[str, Any]]:
    """Order the values of a short text: the verdict and its reason, numbers, the rest."""
    ahead = [(name, values[name]) for name in FIRST if name in values]
    rest = [(name, value) for name, value in values.items() if name not in FIRST]
    return [*ahead, *sorted(rest, key=lambda one: isinstance(one[1], str | bool))]


def _is_plain(value: Any) -> bool:
    """Tell whether a short text shows a value: a number, a text or a pair of numbers."""
    if isinstance(value, tuple):
        return 0 < len(value) <= 2 and all(isinstance(one, int | float) for one in value)
    return isinstance(value, bool | int | float) or (isinstance(value, str) and value != "")


def _shown(value: Any, longest: int = LONGEST_TEXT) -> str:
    if isinstance(value, tuple):
        return f"({', '.join(map(_shown, value))})"
    if isinstance(value, float):
        return f"{value:.6g}"
    text = repr(value)
    return text if len(text) <= longest else f"{text[: longest - 4]}...{text[-1]}"


def _lines(head: str, parts: Sequence[str], most: int) -> list[str]:
    """Fill lines with parts; what does not fit is counted."""
    lines, room = [head], LINE - len(" and 99 more")
    for place, part in enumerate(parts):
        joint = " " if place == 0 else ", "
        if len(lines[-1]) + len(joint) + len(part) <= room:
            lines[-1] += joint + part
        elif len(lines) < most:
            lines[-1] += joint.rstrip()
            lines.append(" " + part)
        else:
            lines[-1] += f" and {len(parts) - place} more"
            break
    return lines
