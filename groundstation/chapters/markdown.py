"""Sections as Markdown, in which nothing from a log can act as markup: text panels of the recording, study pages."""

import re
from collections.abc import Iterable, Sequence

from groundstation.chapters.parts import Cell, Facts, Grid, Mark, Note, Part, Section
from groundstation.chapters.wording import clean

_MARKUP = re.compile(r"([\\`*_{}\[\]()<>#+\-.!|~&:])")
WIDEST_CELL = 60  # characters: a panel does not wrap cells, so longer remarks stand below the table


def escaped(text: str) -> str:
    """Text made safe for a Markdown document: no markup of its own, no link, no picture, no table cell.

    Examples
    --------
    >>> print(escaped("a|b ![x](http://y)"))
    a\\|b \\!\\[x\\]\\(http\\://y\\)
    """
    return _MARKUP.sub(r"\\\1", clean(text))


def table(heads: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A Markdown table; cells are Markdown already.

    Examples
    --------
    >>> print(table(["a", "b"], [["1", "2"]]))
    | a | b |
    |---|---|
    | 1 | 2 |
    """
    lines = ["| " + " | ".join(line) + " |" for line in (heads, *rows)]
    return "\n".join([lines[0], "|" + "---|" * len(heads), *lines[1:]])


def markdown(section: Section, *, level: int = 1) -> str:
    """A section as a Markdown document; its figures and the parts set small are left out.

    Parameters
    ----------
    section : Section
    level : int
        Of its heading: 1 is ``#``.
    """
    parts = [f"{'#' * level} {escaped(section.headline or section.title)}"]
    for part in section.parts:
        parts += _part(part, level + 1)
    return "\n\n".join(parts)


def _part(part: Part, level: int) -> list[str]:
    if isinstance(part, Note) and part.files:  # they lie beside a report
        return []
    if isinstance(part, Note):
        return [f"**{mark}** {escaped(part.text)}" if (mark := Mark(part.tone, "").symbol) else escaped(part.text)]
    if isinstance(part, Facts):
        return [] if part.compact else _facts(part, level)
    return _grid(part, level) if isinstance(part, Grid) else []


def _facts(facts: Facts, level: int) -> list[str]:
    rows = [(escaped(label), escaped(value)) for label, value, _remark in facts.pairs]
    return [f"{'#' * level} {escaped(facts.title)}", table(("", "value"), rows), *_caption(facts.caption)]


def _grid(grid: Grid, level: int) -> list[str]:
    title = [f"{'#' * level} {escaped(grid.title)}"] if grid.title else []
    rows = [[_cell(cell) for cell in row] for row in grid.rows]
    long = {place for row in grid.rows for place, cell in enumerate(row) if place and len(_text(cell)) > WIDEST_CELL}
    shown = [place for place in range(len(grid.heads)) if place not in long]
    heads = [escaped(grid.heads[place].title) for place in shown]
    cells = table(heads, [[row[place] for place in shown] for row in rows])
    below = [f"{row[0]}: {row[place]}" for row in rows for place in sorted(long) if row[place]]
    return [*title, cells, *below, *_caption(grid.caption)]


def _caption(caption: str) -> list[str]:
    return [f"*{escaped(caption)}*"] if caption else []


def _text(cell: Cell) -> str:
    return cell if isinstance(cell, str) else cell.text


def _cell(cell: Cell) -> str:
    if isinstance(cell, str):
        return escaped(cell)
    return f"**{cell.symbol} {escaped(cell.text)}**" if cell.symbol else escaped(cell.text)
