"""Causes of unreadable cells: what a spreadsheet or a habit makes of numbers and times."""

import re
from collections.abc import Callable, Sequence

_SHARE = 0.5  # of the cells, which have one cause
_NUMBER = re.compile(r"[+-]?(\d+[.,]?\d*|[.,]\d+)([eE][+-]?\d+)?")
_DATE = re.compile(r"(\d{1,2})[/.-](\d{1,2})[/.-](\d{4}|\d\d)(?!\d)")
_DAYS_OF_EXCEL = re.compile(r"[34]\d{4}(?:[.,]\d+)?")  # 1982 to 2036
_EXCEL = re.compile(r"\d{1,2}:\d\d[.,]\d{1,3}")
_CLOCK = re.compile(r"\d{1,2}:\d\d(?::\d\d(?:[.,]\d*)?)?(?: ?[AaPp]\.?[Mm]\.?)?")
_COMMA = re.compile(r"[+-]?\d+,\d+")
_THOUSANDS = re.compile(r"[+-]?\d{1,3}(?:,\d{3})+(?:\.\d*)?")
_DMS = re.compile(
    r"[NSEWnsew+-]?\s*\d{1,3}\s*[°:d ]\s*\d{1,2}(?:\.\d*)?\s*"
    r"(?:['′:m ]\s*(?:\d{1,2}(?:\.\d*)?\s*[\"″s]?)?)?\s*[NSEWnsew]?"
)
_SIDE = re.compile(r"[NSEWnsew]\s*\d{1,3}(?:\.\d*)?|\d{1,3}(?:\.\d*)?\s*°?\s*[NSEWnsew]")
_RUN_TOGETHER = re.compile(r"[NSEWnsew]\s*\d{4,5}\.\d+|\d{4,5}\.\d+\s*[NSEWnsew]")
_WITH_UNIT = re.compile(r"[+-]?\d+(?:\.\d*)?\s*[A-Za-z°%/²]+[A-Za-z0-9/^²]*")
_MISSING_WORDS = frozenset(
    ("n/a", "na", "null", "none", "nil", "inv", "invalid", "no data", "nodata", "no fix", "unknown", "#value!", "#n/a")
)
_MARKS = re.compile(r"[-*?_#.~/:]+")  # ***, --.-
_APART = re.compile(r"[+-]?\d{1,3}(?:[ \u00a0\u202f']\d{3})+(?:[.,]\d*)?")


def is_missing(cell: str) -> bool:
    """Tell whether a cell is a sign for no value.

    Examples
    --------
    >>> is_missing("***"), is_missing("N/A"), is_missing("--.-"), is_missing("-1"), is_missing("")
    (True, True, True, False, False)
    """
    return cell.lower() in _MISSING_WORDS or bool(_MARKS.fullmatch(cell))


def date_order(cells: Sequence[str]) -> str:
    """Return the order of dates: ``month/day``, ``day/month``, ``unclear``, or nothing.

    Examples
    --------
    >>> date_order(["6/23/2021 14:13:51"]), date_order(["23.06.2021"]), date_order(["5/6/2021"]), date_order(["12.5"])
    ('month/day', 'day/month', 'unclear', '')
    """
    found = [match for cell in cells if (match := _DATE.match(cell))]
    if not found or len(found) < _SHARE * len(cells):
        return ""
    firsts, seconds = ([int(match.group(place)) for match in found] for place in (1, 2))
    if max(firsts) > 12:
        return "day/month" if max(seconds) <= 12 else ""
    return "month/day" if max(seconds) > 12 else "unclear"


def are_angles(cells: Sequence[str]) -> bool:
    """Tell whether cells are degrees, minutes and seconds, or degrees with a letter.

    Examples
    --------
    >>> are_angles(["47:12:36.0", "12°30′18″S"]), are_angles(["47.5"]), are_angles(["047.123450N"])
    (True, False, True)
    """
    plain = [cell.strip() for cell in cells]
    return bool(plain) and all(
        (_DMS.fullmatch(cell) or _SIDE.fullmatch(cell)) and not _NUMBER.fullmatch(cell) for cell in plain
    )


def are_run_together(cells: Sequence[str]) -> bool:
    """Tell whether cells are degrees and minutes run together, with a letter.

    Examples
    --------
    >>> are_run_together(["5530.1200N", "S 00102.5"]), are_run_together(["030.5E"])
    (True, False)
    """
    return bool(cells) and all(_RUN_TOGETHER.fullmatch(cell.strip()) for cell in cells)


def cause_of_times(cells: Sequence[str]) -> str:
    """Return why times cannot be read, with an example; empty where no cause is known.

    Parameters
    ----------
    cells : sequence of str
        Cells that are not empty.

    Examples
    --------
    >>> cause_of_times(["12:03.5", "12:03.6"])[:47]
    "minutes and seconds alone, such as '12:03.5': E"
    >>> cause_of_times(["6/23/2021 2:13:51 PM"])[:42], cause_of_times(["12.5"])
    ("US dates (month/day/year), such as '6/23/2", '')
    """
    if not cells:
        return "cells that are all empty"
    example = repr(cells[0][:40])
    if _most(cells, _EXCEL.fullmatch):
        return (
            f"minutes and seconds alone, such as {example}: Excel's mm:ss.0 has cut off the hours: show the cells as "
            "yyyy-mm-dd hh:mm:ss.000 and save again"
        )
    orders = {
        "month/day": f"US dates (month/day/year), such as {example}",
        "day/month": f"dates with the day first, such as {example}",
        "unclear": f"dates of which day and month cannot be told apart, such as {example}",
    }
    if order := date_order(cells):
        return f'{orders[order]}: read them by kind = "local" with date_formats, or write them as 2026-05-04 12:00:00'
    if _most(cells, _DAYS_OF_EXCEL.fullmatch):
        return (
            f"days since 1900, such as {example}, as Excel counts them: show them as yyyy-mm-dd hh:mm:ss.000 and save "
            "again"
        )
    if _most(cells, _CLOCK.fullmatch):
        return f'times of day without a date, such as {example}: read them by kind = "time_of_day", or add the date'
    if _most(cells, _COMMA.fullmatch):
        return f"numbers with a decimal comma in quotes, such as {example}: save them with a decimal point"
    return ""


def cause_of_numbers(cells: Sequence[str], delimiter: str) -> str:
    """Return why numbers cannot be read, with an example; empty where no cause is known.

    Examples
    --------
    >>> cause_of_numbers(["55,7512"], ",")[:58]
    "a decimal comma in quotes, such as '55,7512': save them wi"
    >>> cause_of_numbers(["1,234.5"], ",")[:24], cause_of_numbers(["12.5 kt"], ",")[:20], cause_of_numbers(["on"], ",")
    ('commas between thousands', 'a unit in each cell,', '')
    """
    cells = [cell for cell in cells if cell]
    odd = [cell for cell in cells if not re.fullmatch(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?|nan", cell)]
    if not odd:
        return ""
    example = repr(odd[0][:40])
    missing = [cell for cell in odd if is_missing(cell)]
    if len(missing) >= _SHARE * len(odd):
        return f"a sign for a missing value, {missing[0]!r}"
    if _most(odd, _COMMA.fullmatch) and delimiter == ",":
        return (
            f"a decimal comma in quotes, such as {example}: save them with a decimal point, or with ; between the cells"
        )
    if _most(odd, _THOUSANDS.fullmatch):
        return f"commas between thousands, such as {example}: save them without"
    if _most(odd, _APART.fullmatch):
        return f"blanks between thousands, such as {example}: save them without"
    if _most(odd, _SIDE.fullmatch):
        return f"a letter for north, south, east or west in each cell, such as {example}"
    if _most(odd, _DMS.fullmatch):
        return f"degrees, minutes and seconds, such as {example}"
    if _most(odd, _WITH_UNIT.fullmatch):
        return f"a unit in each cell, such as {example}: write it into the header"
    if order := date_order(odd):
        return f"dates ({order}), such as {example}"
    return ""


def _most(cells: Sequence[str], fits: Callable[[str], object]) -> bool:
    return sum(fits(cell.strip()) is not None for cell in cells) > _SHARE * len(cells)
