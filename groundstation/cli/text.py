"""Text for a terminal and for other programs: printable lines, JSON."""

import json
from typing import Any


def printable(text: str) -> str:
    """Text of a log without control characters: a log must not drive the terminal.

    Examples
    --------
    >>> printable("L-39\\x1b[2J")
    'L-39?[2J'
    """
    return "".join(character if character.isprintable() else "?" for character in text)


def as_json(document: Any) -> str:
    """Render a document as JSON text."""
    text = json.dumps(document, indent=2, ensure_ascii=False, allow_nan=False)
    return text.encode("utf-8", "backslashreplace").decode()  # file names need not be UTF-8
