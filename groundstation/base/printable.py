"""Text of a log made fit for terminals, spreadsheets and pages: it drives nothing.

Control characters move the cursor, set titles and colours of a terminal; marks of direction rearrange the line around
them; a cell that begins like a formula is one to a spreadsheet. Data stay as they are: this is for what is shown.
"""

import re
import unicodedata
from functools import cache

JOINERS = "\u200c\u200d"  # some scripts need them; they hide nothing
FORMULA_STARTS = ("=", "+", "-", "@", "＝", "＋", "－", "＠")
_OTHERS = re.compile("[^\x20-\x7e]")  # than what shows in any program


@cache
def is_hidden(mark: str) -> bool:
    """Tell whether a character acts instead of being seen: a control, a mark of direction.

    Examples
    --------
    >>> [is_hidden(mark) for mark in ("a", "ж", "\\u00a0", "\\x1b", "\\u009b", "\\u202e", "\\u2028")]
    [False, False, False, True, True, True, True]
    """
    return not mark.isprintable() and mark not in JOINERS and unicodedata.category(mark) != "Zs"


def printable(text: str, instead: str = "?") -> str:
    """Text in one line, ``instead`` for each hidden character, a space for tabs and line ends.

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
    """Text as :func:`printable` has it, its words one space apart.

    Examples
    --------
    >>> in_a_line("no such\\n  file \\x00")
    'no such file ?'
    """
    return " ".join(printable(text).split())


def spreadsheet_text(text: str) -> str:
    """Text of a cell that shows and is not run: an apostrophe stands before a formula.

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
    """JSON with its hidden characters as escapes: it says the same, and may be printed.

    Examples
    --------
    >>> print(printable_json('["a\\u202eb", "\\x7f", "ж"]'))
    ["a\\u202eb", "\\u007f", "ж"]
    """
    return _OTHERS.sub(_escaped, text)


def _escaped(match: re.Match[str]) -> str:
    mark = match[0]
    if mark == "\n" or not is_hidden(mark):  # between the parts of a document; within a text it is an escape
        return mark
    units = mark.encode("utf-16-be", "surrogatepass")
    return "".join(f"\\u{units[at]:02x}{units[at + 1]:02x}" for at in range(0, len(units), 2))
