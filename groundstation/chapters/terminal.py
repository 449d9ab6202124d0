"""Sections as plain text for a terminal: aligned columns, no control sequences."""

from groundstation.base.text_columns import columns
from groundstation.chapters.parts import Cell, Facts, Figure, Grid, Mark, Note, Part, Section
from groundstation.chapters.wording import clean


def terminal(section: Section) -> str:
    """Return a section as plain text, headed by its headline or its title.

    Parts in small type and figures are left out; a figure's replacement stays.

    Examples
    --------
    >>> from groundstation.chapters.parts import Head
    >>> heads, rows = (Head("Gate"), Head("Figure", True)), [("Precision e", "0.022°"), ("Quality", "0.1°")]
    >>> print(terminal(Section("heading", "Heading", "", (Note("Enter it.", "good"), Grid("Gates", heads, rows)))))
    Heading
    <BLANKLINE>
    ✓ Enter it.
    <BLANKLINE>
    Gates
    Gate         Figure
    Precision e  0.022°
    Quality        0.1°
    """
    told = (part_text(part) for part in (*section.above, *section.parts))
    return "\n\n".join(filter(None, (clean(section.headline or section.title), *told)))


def part_text(part: Part | None) -> str:
    """Return a part of a section alone, as text; empty for one that is left out."""
    if isinstance(part, Figure):
        return part_text(part.instead)
    if isinstance(part, Note):
        return " ".join(filter(None, (Mark(part.tone, "").symbol, clean(part.text))))
    if isinstance(part, Facts):
        return "" if part.compact else _facts(part)
    return grid_text(part) if isinstance(part, Grid) else ""


def grid_text(grid: Grid) -> str:
    """Return a table under its title; empty without rows.

    No line of heads where no head has a title.
    """
    if not grid.rows:
        return ""
    heads = [[head.title for head in grid.heads]] if any(head.title for head in grid.heads) else []
    right = [place for place, head in enumerate(grid.heads) if head.numeric]
    rows = columns([*heads, *([_cell(cell) for cell in row] for row in grid.rows)], right)
    return "\n".join(filter(None, (clean(grid.title), rows, clean(grid.caption))))


def _facts(facts: Facts) -> str:
    rows = [[clean(text) for text in pair] for pair in facts.pairs]
    return "\n".join(filter(None, (clean(facts.title), columns(rows) if rows else "", clean(facts.caption))))


def _cell(cell: Cell) -> str:
    return clean(cell) if isinstance(cell, str) else f"{cell.symbol} {clean(cell.text)}".strip()
