"""Rows of words in aligned columns, for a terminal."""

from collections.abc import Collection, Sequence

from groundstation.base.printable import printable

GAP = "  "


def columns(rows: Sequence[Sequence[str]], right: Collection[int] = ()) -> str:
    """Lay rows out in aligned columns of printable cells; those in ``right`` stand right.

    Examples
    --------
    >>> print(columns([["topic", "rows"], ["ins", "3020"], ["baro", "302"]], right=(1,)))
    topic  rows
    ins    3020
    baro    302
    """
    rows = [[printable(cell) for cell in row] for row in rows]
    widths = [max(len(row[place]) for row in rows) for place in range(len(rows[0]))]
    lines = []
    for row in rows:
        cells = [
            cell.rjust(width) if place in right else cell.ljust(width)
            for place, (cell, width) in enumerate(zip(row, widths, strict=True))
        ]
        lines.append(GAP.join(cells).rstrip())
    return "\n".join(lines)
