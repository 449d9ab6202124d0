"""Sections as Markdown, for text panels of the recording and for study pages.

Nothing from a log can act as markup.
"""

import re
from collections.abc import Iterable, Mapping, Sequence

from groundstation.chapters.parts import Cell, Facts, Figure, Front, Grid, Mark, Note, Part, Section
from groundstation.chapters.wording import clean

# What can be markup anywhere or make an address a link; and what only a line can begin with: a title, a list, a rule.
_ANYWHERE = re.compile(r"([\\`*_\[\]<>|~&]|:(?=//)|(?<=www)\.)", re.IGNORECASE)
_AT_START = re.compile(r"^(\s*\d*)(#(?=#*(?:\s|$))|[-+.)](?=\s|$)|-(?=-)|=)")
NO_LINKS: Mapping[str, str] = {}
WIDEST_CELL = 60  # characters: a panel does not wrap cells, so longer remarks stand below the table


def escaped(text: str) -> str:
    """Return text made safe for a Markdown document.

    No markup of its own, no link, no picture, no table cell.

    Examples
    --------
    >>> print(escaped("a|b ![x](http://y)"))
    a\\|b !\\[x\\](http\\://y)
    >>> print(escaped("1. -0.5 (about)"))
    1\\. -0.5 (about)
    """
    return _AT_START.sub(r"\1\\\2", _ANYWHERE.sub(r"\\\1", clean(text)))


def table(heads: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return a Markdown table; cells are Markdown already.

    Examples
    --------
    >>> print(table(["a", "b"], [["1", "2"]]))
    | a | b |
    |---|---|
    | 1 | 2 |
    """
    lines = ["| " + " | ".join(line) + " |" for line in (heads, *rows)]
    return "\n".join([lines[0], "|" + "---|" * len(heads), *lines[1:]])


def markdown(
    section: Section, *, level: int = 1, widest: int = WIDEST_CELL, links: Mapping[str, str] = NO_LINKS
) -> str:
    """Return a section as a Markdown document, headed by its headline or its title.

    Parts in small type and figures are left out; a figure's replacement stays.

    Parameters
    ----------
    section : Section
    level : int
        Of its heading: 1 is ``#``.
    widest : int
        Characters of a cell; a longer remark stands below its table.
    links : mapping of str to str
        Where the names of rows lead to: a table's first cell with such a text is a link. Addresses stand as they are.
    """
    parts = [f"{'#' * level} {escaped(section.headline or section.title)}"]
    for part in (*section.above, *section.parts):
        parts += _part(part, level + 1, widest, links)
    return "\n\n".join(parts)


def part_markdown(part: Part, *, level: int = 2) -> str:
    """Return a part of a section alone, as Markdown."""
    return "\n\n".join(_part(part, level))


def front_markdown(front: Front) -> str:
    """Return the front of a report as a Markdown document.

    Which flight it is, a row for each answer, why, what is missing.
    """
    parts = [f"# {escaped(front.title)}"]
    if front.headline:
        parts.append(f"## {escaped(front.line)}")  # before the rest: a small panel shows it without scrolling
    if front.recorded:
        parts.append(escaped(front.recorded))
    if front.note:
        parts.append(escaped(f"Note of the log: {front.note}"))
    if front.others:
        rows = [(front.subject, front.line), *((tile.title, tile.claim.line) for tile in front.others)]
        parts.append(table(("Answer", "Found"), [(escaped(title), escaped(line)) for title, line in rows]))
    parts.append(table(("", ""), [(escaped(label), _cell(cell)) for label, cell in front.pairs]))
    parts += [escaped(sentence) for sentence in front.sentences]
    if front.figures:
        parts += _facts(Facts("", front.figures), 2)
    if front.missing:
        parts.append("## Not assessable")
        parts += [f"**{escaped(subject)}**: {escaped(reason)}" for subject, reason in front.missing]
    parts += [escaped(f"{mark.symbol} {mark.text}: {meaning}".strip()) for mark, meaning in front.legend]
    return "\n\n".join(parts)


def _part(part: Part | None, level: int, widest: int = WIDEST_CELL, links: Mapping[str, str] = NO_LINKS) -> list[str]:
    if isinstance(part, Figure):
        return _part(part.instead, level, widest, links)
    if isinstance(part, Note) and part.files:  # they lie beside a report
        return []
    if isinstance(part, Note):
        return [f"**{mark}** {escaped(part.text)}" if (mark := Mark(part.tone, "").symbol) else escaped(part.text)]
    if isinstance(part, Facts):
        return [] if part.compact else _facts(part, level, widest)
    return _grid(part, level, widest, links) if isinstance(part, Grid) else []


def _facts(facts: Facts, level: int, widest: int = WIDEST_CELL) -> list[str]:
    short = [remark if len(remark) <= widest else "" for _label, _value, remark in facts.pairs]
    rows = [(label, value, remark) for (label, value, _), remark in zip(facts.pairs, short, strict=True)]
    shown = 3 if any(short) else 2
    cells = table(("", "value", "")[:shown], [[escaped(text) for text in row[:shown]] for row in rows])
    long = [f"{escaped(label)}: {escaped(remark)}" for label, _, remark in facts.pairs if len(remark) > widest]
    return [*_title(facts.title, level), cells, *long, *_caption(facts.caption)]


def _grid(grid: Grid, level: int, widest: int, links: Mapping[str, str]) -> list[str]:
    """Return a table as Markdown.

    Long remarks of a column stand below it, each under the name of its row.
    """
    rows = [[_cell(cell) for cell in row] for row in grid.rows]
    named = min((place for row in grid.rows for place, cell in enumerate(row) if isinstance(cell, str)), default=0)
    for row, told in zip(rows, grid.rows, strict=True):
        if named < len(told) and (link := links.get(_text(told[named]))):
            row[named] = f"[{row[named]}]({link})"
    long = {place for row in grid.rows for place, cell in enumerate(row) if len(_text(cell)) > widest}
    shown = [place for place in _in_sight(grid, named in long, named) if place == named or place not in long]
    heads = [escaped(grid.heads[place].title) for place in shown]
    cells = [table(heads, [[row[place] for place in shown] for row in rows])] if shown != [named] else []
    below = [f"{row[named]}: {row[place]}" for row in rows for place in sorted(long - {named}) if row[place]]
    return [*_title(grid.title, level), *cells, *below, *_caption(grid.caption)]


def _in_sight(grid: Grid, has_long_names: bool, named: int) -> list[int]:
    """Return the order of the columns, long names after the figures.

    Otherwise a narrow panel would show no figure.
    """
    places = list(range(len(grid.heads)))
    last_figure = max((place for place in places if grid.heads[place].numeric), default=named)
    if not has_long_names or last_figure < named:
        return places
    return [*places[:named], *places[named + 1 : last_figure + 1], named, *places[last_figure + 1 :]]


def _title(title: str, level: int) -> list[str]:
    return [f"{'#' * level} {escaped(title)}"] if title else []


def _caption(caption: str) -> list[str]:
    return [f"*{escaped(caption)}*"] if caption else []


def _text(cell: Cell) -> str:
    return cell if isinstance(cell, str) else cell.text


def _cell(cell: Cell) -> str:
    if isinstance(cell, str):
        return escaped(cell)
    return f"**{cell.symbol} {escaped(cell.text)}**" if cell.symbol else escaped(cell.text)
