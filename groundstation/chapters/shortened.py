"""Sections cut for places where long tables are no help.

Paper, and panels that are laid out again and again.
"""

from dataclasses import replace

from groundstation.chapters.parts import Grid, Part, Section
from groundstation.chapters.wording import number


def shortened(section: Section, most: int, where: str) -> Section:
    """Return the section with its long tables cut.

    A cut table says how many rows more there are, and where.
    """
    return replace(section, parts=tuple(_cut(part, most, where) for part in section.parts))


def _cut(part: Part, most: int, where: str) -> Part:
    if not isinstance(part, Grid) or len(part.rows) <= most:
        return part
    more = f"The first {most}; {number(len(part.rows) - most, 0)} more in {where}."
    return replace(part, rows=part.rows[:most], caption=f"{part.caption} {more}".strip())
