"""Chapter of an answer that has no chapter of its own, from names and kinds of its fields.

A name gives words and unit. A number or a text is a fact, a tuple of rows a grid, a dataclass facts under a title of
their own. ``verdict`` with ``verdict_reason``, ``gates``, ``remarks`` and ``settings`` are presented as in every
chapter.
"""

import inspect
from collections.abc import Mapping, Sequence
from dataclasses import fields, is_dataclass
from typing import Any, cast

import numpy as np

from groundstation.base.digits import digits_of, rounded
from groundstation.base.words import capitalised
from groundstation.chapters.gates import gate_grid, setting_facts
from groundstation.chapters.parts import (
    Cell,
    Claim,
    Facts,
    Figure,
    Grid,
    Head,
    Mark,
    Note,
    Part,
    Rank,
    Section,
    Tone,
    kept,
)
from groundstation.chapters.wording import any_value, clean, is_number, named_quantity, sentence, typeset, words
from groundstation.results.answer import Answer
from groundstation.results.figures import FigureData
from groundstation.results.flight import FlightResults

TOLD_ALIKE = ("verdict", "verdict_reason", "gates", "remarks", "settings", "figures")
VERDICTS: dict[str, Tone] = {
    "accept": "good",
    "advisory": "warn",
    "reject": "bad",
    "extend": "warn",
    "undecided": "unknown",
}
ACRONYMS = {"ins": "INS", "gnss": "GNSS", "rms": "RMS", "utc": "UTC", "gdop": "GDOP", "pdop": "PDOP", "hdop": "HDOP"}
MORE_UNITS = {"mps2": "m/s²", "nt": "nT", "m2": "m²", "a": "A"}
SERIES = "generic.series"  # the figure of any arrays over time
MOST_ROWS, MOST_VALUES = 40, 12


def generic(results: FlightResults, answer: Answer) -> Section:
    """Return the chapter of an answer of any type."""
    title, verdict = titled(words(answer.analysis)), str(getattr(answer, "verdict", ""))
    plain = {name: value for name, value in _fields(answer) if name not in TOLD_ALIKE}
    parts: tuple[Part | None, ...] = (
        _verdict(verdict, str(getattr(answer, "verdict_reason", ""))),
        _facts("Figures", {name: value for name, value in plain.items() if not _has_parts(value)}),
        *(Figure(SERIES, name) for name in figures_over_time(results, answer.analysis)),
        gate_grid(getattr(answer, "gates", ())),
        *(_part(name, value) for name, value in plain.items() if _has_parts(value)),
        *(Note(sentence(remark)) for remark in getattr(answer, "remarks", ())),
    )
    headline = f"{title}: {verdict}" if verdict else ""
    reason = str(getattr(answer, "verdict_reason", ""))
    mark = Mark(VERDICTS.get(verdict, "plain"), titled(verdict) if verdict else "Answered")
    told = Claim(Rank.OTHER, mark, title, sentences=(sentence(reason),) if reason else ())
    settings = setting_facts(getattr(answer, "settings", {}), answer.analysis)
    lead, workings = _lead(answer), kept((settings,))
    return Section(answer.analysis, title, lead, kept(parts), headline, claim=told, appendix=workings)


def figures_over_time(results: FlightResults, analysis: str) -> tuple[str, ...]:
    """Return names of an analysis' figures that have rows and a column ``time_s``.

    A figure belongs to the analysis whose name its own begins with, of several the longest: ``wind_samples`` to
    ``wind``.
    """
    others = [name for name in results.answers if name != analysis and _is_of(name, analysis)]
    own = (
        name
        for name in results.figure_names
        if _is_of(name, analysis) and not any(_is_of(name, other) for other in others)
    )
    found = ((name, results.figure_with_rows(name)) for name in own)
    return tuple(sorted(name for name, figure in found if figure is not None and "time_s" in figure.columns))


def quantity(name: str) -> tuple[str, str]:
    """Return a field name as words, and the sign of its unit.

    Examples
    --------
    >>> quantity("field_forward_nt"), quantity("speed_sd_mps"), quantity("samples")
    (('field forward', 'nT'), ('speed sd', 'm/s'), ('samples', ''))
    """
    for suffix, sign in MORE_UNITS.items():
        if name.endswith(f"_{suffix}"):
            return words(name.removesuffix(f"_{suffix}")), sign
    return named_quantity(name)


def columns_by_unit(figure: FigureData) -> dict[str, tuple[str, ...]]:
    """Return the columns of numbers beside ``time_s`` of a figure, by the sign of their unit.

    Columns without a finite number are left out.

    Examples
    --------
    >>> speed = FigureData("wind", {"time_s": [0.0], "north_mps": [1.0], "east_mps": [2.0], "place": ["a"]}, {})
    >>> columns_by_unit(speed)
    {'m/s': ('north_mps', 'east_mps')}
    """
    found: dict[str, tuple[str, ...]] = {}
    for name, values in figure.columns.items():
        if name != "time_s" and values.dtype.kind in "fiu" and np.isfinite(values).any():
            unit = quantity(name)[1]
            found[unit] = (*found.get(unit, ()), name)
    return found


def _is_of(name: str, analysis: str) -> bool:
    return name == analysis or name.startswith(f"{analysis}_")


def titled(text: str) -> str:
    """Return words as a title; abbreviations keep their capitals.

    Examples
    --------
    >>> titled("gnss noise"), titled("speed rms")
    ('GNSS noise', 'Speed RMS')
    """
    told = " ".join(ACRONYMS.get(word, word) for word in text.split(" "))
    return capitalised(told)


def _fields(holder: Any) -> list[tuple[str, Any]]:
    return [(part.name, getattr(holder, part.name)) for part in fields(cast(Any, holder))]


def _lead(answer: Answer) -> str:
    """Return the first paragraph of the answer's docstring; empty without one."""
    kind = type(answer)
    told = " ".join((inspect.cleandoc(kind.__doc__ or "").partition("\n\n")[0]).split())
    return "" if told.startswith(f"{kind.__name__}(") else told  # which a dataclass writes itself


def _verdict(verdict: str, reason: str) -> Note | None:
    if not verdict:
        return None
    text = f"{titled(verdict)}: {sentence(reason)}" if reason else f"{titled(verdict)}."
    return Note(text, VERDICTS.get(verdict, "plain"))


def _has_parts(value: Any) -> bool:
    """Tell whether a value is more than a fact: a dataclass, a mapping, rows."""
    rows = isinstance(value, tuple) and bool(value) and all(is_dataclass(row) for row in value)
    return rows or is_dataclass(value) or isinstance(value, Mapping)


def _part(name: str, value: Any) -> Part | None:
    title = titled(quantity(name)[0])
    if isinstance(value, tuple):
        return _grid(title, value)
    pairs = dict(value) if isinstance(value, Mapping) else dict(_fields(value))
    unit = quantity(name)[1] if isinstance(value, Mapping) else ""  # of a mapping the name tells the unit of all
    return _facts(title, pairs, unit)


def _facts(title: str, values: Mapping[str, Any], unit_of_all: str = "") -> Facts | None:
    pairs = []
    for name, value in values.items():
        label, unit = quantity(str(name))
        pairs.append((titled(label), _told(str(name), value, unit or unit_of_all), ""))
    return Facts(title, pairs) if pairs else None


def _grid(title: str, rows: Sequence[Any]) -> Grid:
    names = [name for name, value in _fields(rows[0]) if not _has_parts(value)]
    heads = []
    for name in names:
        label, unit = quantity(name)
        is_numeric = all(getattr(row, name) is None or is_number(getattr(row, name)) for row in rows)
        heads.append(Head(f"{titled(label)}, {unit}" if unit else titled(label), is_numeric))
    cells: list[tuple[Cell, ...]] = [
        tuple(_told(name, getattr(row, name), "") for name in names) for row in rows[:MOST_ROWS]
    ]
    more = len(rows) - MOST_ROWS
    return Grid(title, heads, cells, f"{more} further rows are left out." if more > 0 else "")


def _told(name: str, value: Any, unit: str) -> str:
    """Return a value in words, numbers rounded as they are saved.

    So the recording and the report show the same.
    """
    if isinstance(value, list | tuple) and len(value) > MOST_VALUES:
        return f"{len(value)} values"
    if isinstance(value, list | tuple):
        return ", ".join(_told(name, one, unit) for one in value) or "none"
    if isinstance(value, float):
        return any_value(rounded(value, digits_of(name)), unit)
    return typeset(clean(value)) if isinstance(value, str) and value else any_value(value, unit)
