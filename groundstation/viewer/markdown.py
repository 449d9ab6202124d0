"""Text panels: Markdown in which nothing from a log can act as markup."""

import math

from groundstation.chapters.markdown import escaped
from groundstation.viewer.names import clean_text


def markdown_text(text: str, limit: int = 400) -> str:
    """Text from a log made safe for a Markdown document: no markup of its own, no link, no picture, no table cell.

    Examples
    --------
    >>> print(markdown_text("a|b ![x](http://y)"))
    a\\|b !\\[x\\](http\\://y)
    """
    return escaped(clean_text(text, limit))


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
