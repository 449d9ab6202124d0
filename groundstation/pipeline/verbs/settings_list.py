"""Settings of a user's file as the code tells them: unit, default, range, meaning."""

import dataclasses
import inspect
import math
import re
import tokenize
import types
import typing
from collections.abc import Iterator, Mapping
from io import StringIO
from typing import Any

from groundstation.base.dataclasses import dataclass
from groundstation.base.unit_names import UNITS

_OF_PARAMETERS = re.compile(r"^ {4}(\w+(?:, \w+)*)(?: : [^\n]*)?\n((?: {8}[^\n]*\n?)+)", re.MULTILINE)
FEWEST_WORDS = 4  # of a comment above a field that is about it, and no title of a group


@dataclass(frozen=True)
class Setting:
    """One setting.

    Parameters
    ----------
    table, key : str
        As in a settings file: ``[table]`` and ``key = ...``.
    unit : str
        By the end of the key; empty for a pure number, a word or a switch.
    default : str
        As TOML writes it; empty where it is left out unless stated.
    allowed : str
        Range, or the words that are taken.
    meaning : str
        Empty where the key says it all.
    """

    table: str
    key: str
    unit: str
    default: str
    allowed: str
    meaning: str


def every_setting() -> tuple[Setting, ...]:
    """Return the settings of all tables, in the order of the tables and of the code."""
    from groundstation.pipeline.one_flight.isolation import Isolation
    from groundstation.systems import systems
    from groundstation.systems.known import AircraftData
    from groundstation.tables.session_settings import SessionSettings

    every = systems()
    kinds: dict[str, type] = {}
    for analysis in (*every.analyses, *every.session_analyses):
        kinds.setdefault(analysis.settings_table, analysis.settings)
    kinds |= {"session": SessionSettings, "aircraft": AircraftData, "isolation": Isolation}
    return tuple(row for table, kind in kinds.items() for row in settings_of(table, kind))


def settings_of(table: str, kind: type, shipped: Any = None, subject: str = "") -> Iterator[Setting]:
    """Yield the settings of a dataclass as a table, those of dataclasses inside below it.

    Parameters
    ----------
    shipped : optional
        Value whose fields are the defaults, where they are not those of the class.
    subject : str
        What the table is about, said before each meaning.

    Examples
    --------
    >>> from groundstation.pipeline.one_flight.isolation import Isolation
    >>> [one.key for one in settings_of("isolation", Isolation)][:1]
    ['memory_mb']
    """
    hints, told = typing.get_type_hints(kind), meanings(kind)
    inside: list[tuple[str, type, Any, str]] = []
    for field in dataclasses.fields(kind):
        if not field.init:
            continue
        default = _default_value(field) if shipped is None else getattr(shipped, field.name)
        meaning = told.get(field.name, "")
        held = _dataclass_in(hints[field.name])
        if held is not None:
            value = default if isinstance(default, held) else None
            inside.append((f"{table}.{field.name}", held, value, meaning.rstrip(".")))
            continue
        low, high = field.metadata.get("low", -math.inf), field.metadata.get("high", math.inf)
        yield Setting(
            table,
            field.name,
            _unit(field.name),
            _default(default),
            _words(hints[field.name]) or _range(low, high),
            ": ".join(filter(None, (subject, meaning))),
        )
    for one in inside:
        yield from settings_of(*one)


def meanings(kind: type) -> Mapping[str, str]:
    """Return the meaning of each field: of the docstring, else behind it, else above it."""
    found = {name: text for one in reversed(kind.__mro__[:-1]) for name, text in _of_comments(one).items()}
    for one in reversed(kind.__mro__[:-1]):
        found |= _of_docstring(inspect.cleandoc(one.__doc__ or ""))
    return found


def _of_docstring(text: str) -> dict[str, str]:
    _head, _line, below = text.partition("Parameters\n----------\n")
    indented = "\n".join(f"    {line}" if line else "" for line in below.split("\n"))
    found: dict[str, str] = {}
    for names, told in _OF_PARAMETERS.findall(indented + "\n"):
        found |= dict.fromkeys(names.split(", "), " ".join(told.split()))
    return found


def _of_comments(kind: type) -> dict[str, str]:
    try:
        lines = inspect.getsource(kind)
    except (OSError, TypeError):
        return {}
    behind: dict[str, str] = {}
    over: dict[str, str] = {}
    above: list[str] = []
    name, last_row = "", 0
    for token in tokenize.generate_tokens(StringIO(inspect.cleandoc(lines)).readline):
        row = token.start[0]
        if token.type == tokenize.COMMENT and token.line.strip().startswith("#") and (not name or row > last_row):
            above = [*above, token.string.lstrip("# ")] if token.line[:4].isspace() else []
            name = ""
        elif token.type == tokenize.COMMENT and name:
            behind[name] = " ".join(filter(None, (behind.get(name, ""), token.string.lstrip("# "))))
        elif token.type == tokenize.NAME and token.start[1] == 4 and re.match(r"\s{4}\w+\s*:", token.line):
            name = token.string
            if above and len(" ".join(above).split()) >= FEWEST_WORDS:
                over[name] = " ".join(above)
            above = []
        elif token.type == tokenize.NL and not token.line.strip():
            above = []
        if token.type == tokenize.NEWLINE:
            last_row = token.end[0]
    return over | behind


def _dataclass_in(hint: Any) -> type | None:
    """Return the dataclass that a field holds; None for a number, word, list or union."""
    options = [one for one in _members(hint) if one is not type(None)]
    return options[0] if len(options) == 1 and dataclasses.is_dataclass(options[0]) else None  # type: ignore[return-value]


def _members(hint: Any) -> tuple[Any, ...]:
    is_union = typing.get_origin(hint) in (typing.Union, types.UnionType)
    return typing.get_args(hint) if is_union else (hint,)


def _words(hint: Any) -> str:
    found: list[str] = []
    for one in _members(hint):
        if typing.get_origin(one) is typing.Literal:
            found += [str(value) for value in typing.get_args(one)]
        elif one is bool:
            found += ["true", "false"]
        elif one is str:
            found.append("text")
        elif typing.get_origin(one) is tuple:
            found.append("a list")
    return ", ".join(found)


def _range(low: float, high: float) -> str:
    if math.isinf(low) and math.isinf(high):
        return ""
    if math.isinf(high):
        return f"{low:g} or more"
    return f"at most {high:g}" if math.isinf(low) else f"{low:g} to {high:g}"


def _default_value(field: "dataclasses.Field[Any]") -> Any:
    if field.default_factory is not dataclasses.MISSING:
        return field.default_factory()
    return field.default


def _default(value: Any) -> str:
    if value is dataclasses.MISSING:
        return "must be stated"
    if value is None:
        return ""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, float):
        return f"{value:.12g}"
    if isinstance(value, (tuple, frozenset)):
        return "[" + ", ".join(map(str, value)) + "]"
    return str(value)


def _unit(key: str) -> str:
    suffix = next((one for one in UNITS if key.endswith(f"_{one}")), None)
    stem = key.removesuffix("_max").removesuffix("_min")
    suffix = suffix or next((one for one in UNITS if stem.endswith(f"_{one}")), None)
    return UNITS[suffix].spelled if suffix else ""
