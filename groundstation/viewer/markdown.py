"""Text panels: Markdown in which nothing from a log can act as markup."""

import math
import re
from collections.abc import Sequence

from groundstation.viewer.names import clean_text

_MARKUP = re.compile(r"([\\`*_{}\[\]()<>#+\-.!|~&:])")


def markdown_text(text: str, limit: int = 400) -> str:
    """Text from a log made safe for a Markdown document: no markup of its own, no link, no picture, no table cell.

    Examples
    --------
    >>> print(markdown_text("a|b ![x](http://y)"))
    a\\|b \\!\\[x\\]\\(http\\://y\\)
    """
    return _MARKUP.sub(r"\\\1", clean_text(text, limit))


def number(value: float | None, digits: int = 3, unit: str = "", *, sign: bool = False) -> str:
    """Number with its unit; a dash when it is not known.

    Examples
    --------
    >>> number(1.23456, 2, "deg", sign=True), number(None)
    ('+1.23 deg', '–')
    """
    if value is None or not math.isfinite(value):
        return "–"
    text = f"{value:+.{digits}f}" if sign else f"{value:.{digits}f}"
    return f"{text} {unit}".strip()


def table(header: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Markdown table; cells are Markdown already.

    Examples
    --------
    >>> print(table(["a", "b"], [["1", "2"]]))
    | a | b |
    |---|---|
    | 1 | 2 |
    """
    lines = ["| " + " | ".join(line) + " |" for line in (header, *rows)]
    return "\n".join([lines[0], "|" + "---|" * len(header), *lines[1:]])
