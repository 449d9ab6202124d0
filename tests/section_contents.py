"""What a chapter says, as its tests read it: tables by title, rows by their first cell, notes as lines."""

from groundstation.chapters.parts import Cell, Facts, Figure, Grid, Note, Section


def told(cell: Cell) -> str:
    """A cell as a page shows it: a mark with its symbol, plain spaces."""
    text = cell if isinstance(cell, str) else f"{cell.symbol} {cell.text}".strip()
    return text.replace("\u202f", " ")


def grid(section: Section, title: str) -> Grid:
    """The only table of that title."""
    (found,) = (part for part in (*section.parts, *section.appendix) if isinstance(part, Grid) and part.title == title)
    return found


def rows(section: Section, title: str) -> list[tuple[str, ...]]:
    """The rows of a table, as shown."""
    return [tuple(told(cell) for cell in row) for row in grid(section, title).rows]


def row(section: Section, title: str, first: str) -> tuple[str, ...]:
    """What stands behind the first cell in the only row that begins so."""
    (found,) = (cells[1:] for cells in rows(section, title) if cells[0] == first)
    return found


def facts(section: Section, title: str) -> dict[str, tuple[str, str]]:
    """Value and remark by label of the facts of that title."""
    (found,) = (part for part in (*section.parts, *section.appendix) if isinstance(part, Facts) and part.title == title)
    return {told(label): (told(value), told(remark)) for label, value, remark in found.pairs}


def notes(section: Section) -> list[str]:
    """The paragraphs, as shown."""
    return [told(part.text) for part in (*section.parts, *section.appendix) if isinstance(part, Note)]


def tones(section: Section) -> list[str]:
    """The tones of the paragraphs."""
    return [part.tone for part in (*section.parts, *section.appendix) if isinstance(part, Note)]


def titles(section: Section) -> list[str]:
    """Titles of tables and facts, names of figures, in the order they stand."""
    names = []
    for part in (*section.parts, *section.appendix):
        if isinstance(part, Figure):
            names.append(f"{part.name} {part.of}".strip())
        elif isinstance(part, Grid | Facts):
            names.append(part.title)
    return names


def every_text(section: Section) -> list[str]:
    """Every text of a chapter, as shown."""
    texts = [section.headline, section.title, section.lead, *notes(section)]
    for part in (*section.parts, *section.appendix):
        if isinstance(part, Grid):
            cells = [told(cell) for line in part.rows for cell in line]
            texts += [part.title, part.caption, *(head.title for head in part.heads), *cells]
        elif isinstance(part, Facts):
            texts += [part.title, part.caption, *(told(text) for pair in part.pairs for text in pair)]
    return texts
