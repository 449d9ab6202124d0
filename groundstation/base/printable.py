"""Text of a log made safe for terminals, spreadsheets and pages.

Control characters move the cursor, set titles and colours of a terminal; marks of direction rearrange the line around
them; a cell that begins like a formula is one to a spreadsheet. Data stay as they are: this is for what is shown.
"""

import re
import unicodedata
from functools import cache

JOINERS = "\u200c\u200d"  # some scripts need them; they hide nothing
FORMULA_STARTS = ("=", "+", "-", "@", "＝", "＋", "－", "＠")
_OTHERS = re.compile("[^\x20-\x7e]")  # than what shows in any program
_OTHERS_IN_JSON = re.compile("[^\n\x20-\x7e]")  # a line end stands between its parts; within a text it is an escape


@cache
def is_hidden(mark: str) -> bool:
    """Tell whether a character acts instead of being seen (control, direction mark).

    Examples
    --------
    >>> [is_hidden(mark) for mark in ("a", "ж", "\\u00a0", "\\x1b", "\\u009b", "\\u202e", "\\u2028")]
    [False, False, False, True, True, True, True]
    """
    return not mark.isprintable() and mark not in JOINERS and unicodedata.category(mark) != "Zs"


def printable(text: str, instead: str = "?") -> str:
    """Return text in one line, ``instead`` for each hidden character.

    Tabs and line ends become spaces.

    Examples
    --------
    >>> printable("L-39\\x1b[2J\\r\\nA\\u202eB")
    'L-39?[2J  A?B'
    """
    if text.isprintable():
        return text
    return _OTHERS.sub(lambda match: _shown(match[0], instead), text)


def _shown(mark: str, instead: str) -> str:
    if not is_hidden(mark):
        return mark
    return " " if mark in "\t\n\v\f\r\x85\u2028\u2029" else instead


def in_a_line(text: str) -> str:
    """Return text as :func:`printable` does, its words one space apart.

    Examples
    --------
    >>> in_a_line("no such\\n  file \\x00")
    'no such file ?'
    """
    return " ".join(printable(text).split())


def spreadsheet_text(text: str) -> str:
    """Return the text of a cell that is shown and not run: a formula gets an apostrophe.

    Examples
    --------
    >>> spreadsheet_text("@SUM(A1)"), spreadsheet_text("a+b")
    ("'@SUM(A1)", 'a+b')
    """
    shown = printable(text)
    return "'" + shown if shown.lstrip().startswith(FORMULA_STARTS) else shown


def csv_cell(text: str) -> str:
    """Write text as a CSV cell that no spreadsheet runs, quoted where needed.

    Examples
    --------
    >>> csv_cell("=1+1"), csv_cell("a,b"), csv_cell("ab"), csv_cell("\\x1b[2J\\n=1")
    ("'=1+1", '"a,b"', 'ab', '?[2J =1')
    """
    safe = spreadsheet_text(text)
    return '"' + safe.replace('"', '""') + '"' if any(mark in safe for mark in ',;"') else safe


def printable_json(text: str) -> str:
    """Return JSON with its hidden characters as escapes: equal in meaning and safe to print.

    Examples
    --------
    >>> print(printable_json('["a\\u202eb", "\\x7f", "ж"]'))
    ["a\\u202eb", "\\u007f", "ж"]
    """
    return _OTHERS_IN_JSON.sub(_escaped, text)


def _escaped(match: re.Match[str]) -> str:
    mark = match[0]
    if not is_hidden(mark):
        return mark
    units = mark.encode("utf-16-be", "surrogatepass")
    return "".join(f"\\u{units[at]:02x}{units[at + 1]:02x}" for at in range(0, len(units), 2))
