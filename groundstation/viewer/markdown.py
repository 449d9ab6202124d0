"""Text panels: Markdown in which nothing from a log can act as markup."""

from groundstation.chapters.markdown import escaped
from groundstation.viewer.names import clean_text


def markdown_text(text: str, limit: int = 400) -> str:
    """Return text from a log made safe for a Markdown document.

    No markup of its own, no link, no picture, no table cell.

    Examples
    --------
    >>> print(markdown_text("a|b ![x](http://y)"))
    a\\|b !\\[x\\](http\\://y)
    """
    return escaped(clean_text(text, limit))
