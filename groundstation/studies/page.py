"""What every study hands back, and tables as Markdown."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from groundstation.results.figures import FigureData


@dataclass(frozen=True)
class StudyResult:
    """What a study found: tables (arrays with units in their names) and a page of text."""

    name: str
    tables: tuple[FigureData, ...]
    markdown: str


def markdown_table(table: FigureData) -> list[str]:
    """A table as Markdown, numbers rounded to the digits of their columns."""

    def cell(name: str, value: object) -> str:
        if isinstance(value, float | np.floating):
            return "" if np.isnan(value) else f"{value:.{table.digits.get(name, 2)}f}"
        return str(value)

    names = list(table.columns)
    head = [name.replace("_", " ") for name in names]
    return markdown_rows(head, [[cell(name, table[name][row]) for name in names] for row in range(len(table))])


def markdown_rows(head: Sequence[str], rows: Sequence[Sequence[str]]) -> list[str]:
    """Lines of a Markdown table from its cells."""
    return [f"| {' | '.join(row)} |" for row in (head, ["---"] * len(head), *rows)]
