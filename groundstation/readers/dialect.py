"""Dialect of a delimited text file: its encoding, its delimiter, where its rows begin."""

import re
from collections.abc import Sequence
from dataclasses import field
from itertools import accumulate
from typing import NamedTuple

from groundstation.base.dataclasses import dataclass
from groundstation.base.errors import UnreadableLogError
from groundstation.readers.source import HEAD_BYTES, Source

DELIMITERS = (",", ";", "\t")
_UTF8_BOM = b"\xef\xbb\xbf"
_CYRILLIC_RUN = re.compile(rb"[\xc0-\xff\xa8\xb8]{2,}")
_DECIMAL_COMMA = re.compile(r"[+-]?\d+,\d+")
_DECIMAL_POINT = re.compile(r"[+-]?\d+\.\d+")


class HeadLine(NamedTuple):
    """Line of the head: its number, where the next one starts, its text without line end.

    Numbers count from 1; ``next_byte`` is the byte where the next line starts.
    """

    number: int
    next_byte: int
    text: str
    ended: bool


@dataclass(frozen=True)
class Dialect:
    """Facts that the row scanner needs about a delimited file.

    Parameters
    ----------
    encoding : {'utf-8', 'cp1251'}
    delimiter : str
        One ASCII character.
    cells : int
        Number of cells of a sound row, a trailing empty one counted.
    first_byte, first_line : int
        Where the rows after the header begin.
    header_lines : frozenset of str
        Header lines as :func:`normal_form` gives them; repeats inside the file are skipped.
    end_byte : int, optional
        Where the rows end; None at the end of the file.
    """

    encoding: str
    delimiter: str
    cells: int
    first_byte: int
    first_line: int
    header_lines: frozenset[str] = field(default_factory=frozenset)
    end_byte: int | None = None


def detect_encoding(head: bytes, name: str) -> str:
    """Return the encoding of a text: UTF-8 or cp1251.

    It is cp1251 where the bytes are no UTF-8 and look like Cyrillic words.

    A stray high byte in an otherwise plain file is damage of that cell, not another encoding.

    Raises
    ------
    UnreadableLogError
        For UTF-16, which spreadsheet programs call "Unicode text".
    """
    if head.startswith((b"\xff\xfe", b"\xfe\xff")):
        raise UnreadableLogError(name, "UTF-16 text", "UTF-8 or cp1251", "save it as CSV in UTF-8")
    try:
        head.decode("utf-8")
    except UnicodeDecodeError as error:
        cut_character = len(head) == HEAD_BYTES and error.start >= len(head) - 3
        if not cut_character and _CYRILLIC_RUN.search(head[error.start - 1 if error.start else 0 :]):
            return "cp1251"
    return "utf-8"


def head_lines(source: Source, encoding: str, limit: int = 1000) -> list[HeadLine]:
    """Return the first lines of a file, at most ``limit``.

    A last line that the head cuts off is left out.
    """
    head = source.head
    first = len(_UTF8_BOM) if head.startswith(_UTF8_BOM) else 0
    separator = b"\n" if b"\n" in head or b"\r" not in head else b"\r"
    lines = head[first:].split(separator, limit)
    rest = lines.pop()
    ends = [first + end for end in accumulate(len(line) + 1 for line in lines)]
    is_ended = [True] * len(lines)
    if rest and len(lines) < limit and len(head) == source.size:
        lines, ends, is_ended = [*lines, rest], [*ends, len(head)], [*is_ended, False]
    texts = b"\n".join(lines).decode(encoding, errors="replace").split("\n")
    if b"\r" in head:
        texts = [text.rstrip("\r") for text in texts]
    return list(map(HeadLine, range(1, len(lines) + 1), ends, texts, is_ended))


def detect_delimiter(header: str) -> str:
    """The delimiter that occurs most often in a header row, ``,`` when none does.

    Examples
    --------
    >>> detect_delimiter("time_s;ins.latitude_deg;gnss.latitude_deg")
    ';'
    """
    return max(DELIMITERS, key=header.count)


def split_cells(line: str, delimiter: str) -> list[str]:
    """Split a line into trimmed cells without quotes; a plain split if quoting is broken.

    Examples
    --------
    >>> split_cells('a, "b,c" ,d', ","), split_cells('1,"2,3', ",")
    (['a', 'b,c', 'd'], ['1', '"2', '3'])
    """
    if '"' in line:
        import csv

        try:
            rows = list(csv.reader([line], delimiter=delimiter, skipinitialspace=True, strict=False))
            if len(rows) == 1 and line.count('"') % 2 == 0:
                return [cell.strip() for cell in rows[0]]
        except csv.Error:
            pass
    return [cell.strip() for cell in line.split(delimiter)]


def cell_count(line: str, delimiter: str) -> int:
    """Return the number of cells of a line."""
    return len(split_cells(line, delimiter)) if '"' in line else line.count(delimiter) + 1


def normal_form(line: str, delimiter: str) -> str:
    """Return a line with its cells trimmed, so that padding makes no difference."""
    return delimiter.join(split_cells(line, delimiter))


def uses_decimal_comma(rows: Sequence[str], delimiter: str) -> bool:
    """Tell whether numbers in the first rows have a decimal comma.

    Never with ``,`` as delimiter.

    Examples
    --------
    >>> uses_decimal_comma(["0;55", "0,02;55,75"], ";"), uses_decimal_comma(["0,02,55"], ",")
    (True, False)
    >>> uses_decimal_comma(["0.5;1,234"], ";")
    False
    """
    if delimiter == ",":
        return False
    if not any("," in row for row in rows):
        return False
    cells = [cell for row in rows for cell in split_cells(row, delimiter)]
    if any(_DECIMAL_POINT.fullmatch(cell) for cell in cells):
        return False  # with decimal points a comma separates thousands, or stands in a text
    return any(_DECIMAL_COMMA.fullmatch(cell) for cell in cells)


def trailing_cells(rows: Sequence[str], delimiter: str, names: int) -> int:
    """Return 1 where most rows end with a delimiter that the header row lacks, else 0.

    The first row decides a tie.

    Examples
    --------
    >>> trailing_cells(["1,2,"], ",", 2), trailing_cells(["1,"], ",", 2), trailing_cells(["1", "1,2,", "3,4,"], ",", 2)
    (1, 0, 1)
    """
    votes = []
    for row in rows:
        cells = cell_count(row, delimiter)
        if cells == names:
            votes.append(-1)
        elif cells == names + 1 and row.rstrip(" ").endswith(delimiter):
            votes.append(1)
    return int(bool(votes) and (sum(votes) or votes[0]) > 0)
