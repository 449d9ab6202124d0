"""Sample of a table: its delimiter, its header row, its first rows and some later ones."""

import re
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import field, replace
from functools import cached_property

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.dataclasses import dataclass
from groundstation.base.errors import UnreadableLogError
from groundstation.readers.dialect import (
    DELIMITERS,
    HeadLine,
    detect_encoding,
    head_lines,
    split_cells,
    uses_decimal_comma,
)
from groundstation.readers.drafts.causes import is_missing
from groundstation.readers.drafts.words import Meaning, meaning_of
from groundstation.readers.magic import is_binary, is_wide_text
from groundstation.readers.source import Source
from groundstation.readers.spaced import SpacedSource

_NUMBER = re.compile(r"[+-]{0,2}(?:\d+[.,]?\d*|[.,]\d+)(?:[eE][+-]?\d+)?|nan|NaN|NAN|[+-]?inf")
_TIME = re.compile(
    r"\d{1,2}-[A-Za-z]{3}-\d{4}.*|\d{1,4}[-/.]\d{1,2}[-/.]\d{1,4}.*|\d{1,2}:\d\d(?::\d\d)?(?:[.,]\d*)?(?: ?[AaPp][Mm])?"
)
_NINES = re.compile(r"-?9{3,}(?:\.(?:0*|9*))?")  # 9999, -999.0: no value, where all others are far from it
# Numbers for no value of the automatic identification of ships (ITU-R M.1371).
_OF_SHIPS = {
    "true_heading_deg": 511.0,
    "latitude_deg": 91.0,
    "longitude_deg": 181.0,
    "track_deg": 360.0,
    "ground_speed_mps": 102.3,
}
_PLACES = ("latitude_deg", "longitude_deg")
_FIRST_LINES, _MOST_BEHIND = 2000, 10
_WINDOWS, _WINDOW_BYTES = 8, 32 << 10  # later pieces of the file that are looked at
_MOST_ROWS = 1000  # of each piece
_MOST_CELLS = 400_000  # of all pieces: a table of ten thousand columns is looked at with a few rows
ENOUGH = 0.9  # share of the cells that have to be numbers


@dataclass(frozen=True)
class TableSample:
    """Part of a table that is looked at.

    Parameters
    ----------
    name, encoding, delimiter : str
    header : HeadLine or None
        The line of names; None of a table that has none.
    names : tuple of str
        Cells of the header row; ``column_1`` ... of a table without one.
    behind : tuple of tuple of str
        Cells of the rows between the header and the data: units, other names.
    blocks : tuple of tuple of tuple of str
        Rows that follow one another, piece by piece; each has as many cells as there are names.
    is_spaced : bool
        Blanks part the cells; they are seen as tabs.
    above : tuple of str
        Lines above the header and the rows.
    are_given : bool
        The user gave the names of a table that has none.
    """

    name: str
    encoding: str
    delimiter: str
    header: HeadLine | None
    names: tuple[str, ...]
    behind: tuple[tuple[str, ...], ...]
    blocks: tuple[tuple[tuple[str, ...], ...], ...]
    is_spaced: bool = False
    above: tuple[str, ...] = ()
    are_given: bool = False
    _numbers: dict[int, FloatArray] = field(default_factory=dict)
    _signs: dict[int, frozenset[str]] = field(default_factory=dict)

    @cached_property
    def has_decimal_comma(self) -> bool:
        """Tell whether numbers have a decimal comma that readers understand."""
        rows = [self.delimiter.join(row) for row in self.blocks[0][:100]]
        return uses_decimal_comma(rows, self.delimiter)

    @cached_property
    def is_of_ships(self) -> bool:
        """Tell whether a column names a ship (MMSI): its numbers have signs for not known."""
        return any(name.lower() == "mmsi" for name in self.names)

    @cached_property
    def columns(self) -> tuple[tuple[str, ...], ...]:
        """Cells of each column, of all pieces."""
        return tuple(zip(*(row for block in self.blocks for row in block), strict=True))

    @cached_property
    def meanings(self) -> tuple[Meaning | None, ...]:
        """Meaning of each column by its name and the rows of units."""
        if self.header is None and not self.are_given:
            return (None,) * len(self.names)
        return tuple(
            meaning_of(name, tuple(row[at] for row in self.behind if row[at])) for at, name in enumerate(self.names)
        )

    def numbers(self, at: int) -> FloatArray:
        """Return a column as numbers; NaN where a cell is none, or a sign for that."""
        if at not in self._numbers:
            signs, values = self.signs(at), self._plain_numbers(at)
            if any(_NUMBER.fullmatch(sign) for sign in signs):
                values[[cell in signs for cell in self.columns[at]]] = np.nan
            self._numbers[at] = values
        return self._numbers[at]

    def _plain_numbers(self, at: int) -> FloatArray:
        return np.array([self.number(cell) for cell in self.columns[at]], dtype=np.float64)

    def number(self, cell: str) -> float:
        """Return a cell as a number, NaN where it is none."""
        if not cell or not _NUMBER.fullmatch(cell):
            return np.nan
        text = cell.replace(",", ".") if self.has_decimal_comma else cell
        try:
            return float(text.replace("+-", "-"))
        except ValueError:
            return np.nan

    def filled(self, at: int) -> list[str]:
        """Return the cells of a column that are neither empty nor a sign for that."""
        signs = self.signs(at)
        return [cell for cell in self.columns[at] if cell and cell not in signs]

    def signs(self, at: int) -> frozenset[str]:
        """Return the signs for missing values: words, and nines that are far from all others."""
        if at not in self._signs:
            self._signs[at] = frozenset(self._found_signs(at))
        return self._signs[at]

    def _found_signs(self, at: int) -> set[str]:
        return self._words_or_nines(at) | self._of_ships(at)

    def _of_ships(self, at: int) -> set[str]:
        """Return the numbers by which ships say that a direction, a place or a speed is not known."""
        meaning = self.meanings[at]
        number = _OF_SHIPS.get(meaning.field, np.nan) if meaning is not None else np.nan
        is_sure = number > 360.0 or number in (91.0, 181.0) or self.is_of_ships
        return {cell for cell in set(self.columns[at]) if self.number(cell) == number} if is_sure else set()

    def _words_or_nines(self, at: int) -> set[str]:
        words = {cell for cell in self.columns[at] if is_missing(cell)}
        nines = {cell for cell in self.columns[at] if _NINES.fullmatch(cell)}
        if not nines:
            return words
        values, odd = self._plain_numbers(at), np.array([self.number(cell) for cell in sorted(nines)])
        known = values[np.isfinite(values) & ~np.isin(values, odd)]
        far = 10.0 * float(np.max(np.abs(known), initial=1.0))
        is_far = len(known) > 0 and bool(np.all(np.abs(odd) > min(far, 900.0)) and np.max(np.abs(known)) < 900.0)
        is_far |= len(known) > 0 and bool(np.all(np.abs(odd) > far))
        return words | nines if is_far else words

    def number_signs(self, at: int) -> tuple[str, ...]:
        """Return the numbers that mean no value in a column; elsewhere they may be values."""
        return tuple(sorted(sign for sign in self.signs(at) if _NUMBER.fullmatch(sign)))

    def is_of_numbers(self, at: int) -> bool:
        """Tell whether a column is one of numbers."""
        filled = self.filled(at)
        known = int(np.count_nonzero(np.isfinite(self.numbers(at))))
        return known > 0 and known >= ENOUGH * sum(cell.lower() != "nan" for cell in filled)

    def parts(self, at: int) -> Iterator[FloatArray]:
        """Yield the numbers of a column, piece by piece."""
        start, values = 0, self.numbers(at)
        for block in self.blocks:
            yield values[start : start + len(block)]
            start += len(block)


def sample_of(source: Source, names: Sequence[str] = ()) -> TableSample:
    """Return a sample of a table, with names for one that has none.

    Raises
    ------
    UnreadableLogError
        When the file is empty, no text, or holds no table, or has names of its own beside those given.
    """
    sample = _sampled(source)
    if not names:
        return sample
    if sample.header is not None:
        raise UnreadableLogError(
            source.name, f"names of its own in row {sample.header.number}", "a table without a row of names"
        )
    if len(names) != len(sample.names) or len(set(names)) != len(names):
        expected = f"{len(sample.names)} names, one for each column, all different"
        raise UnreadableLogError(source.name, f"{len(names)} names", expected)
    return replace(sample, names=tuple(names), are_given=True)


def _sampled(source: Source) -> TableSample:
    if source.is_empty:
        raise UnreadableLogError(source.name, "an empty file", "a table", "check how it was copied")
    encoding = detect_encoding(source.head, source.name)
    if is_binary(source):
        if is_wide_text(source):
            raise UnreadableLogError(source.name, "UTF-16 text without its mark", "UTF-8", "save it as CSV in UTF-8")
        raise UnreadableLogError(source.name, "binary data", "a table of text", "export the log as CSV")
    lines = head_lines(source, encoding, _FIRST_LINES)
    shapes = [found for delimiter in DELIMITERS if (found := _Shape.of(lines, delimiter)) is not None]
    is_spaced = not any(one.first_row is not None for one in shapes)
    if is_spaced and (spaced := _spaced(source, encoding)) is not None:
        source, lines, shape = spaced
        return _sample(source, encoding, lines, shape, is_spaced=True)
    if not shapes:
        raise UnreadableLogError(
            source.name,
            "no table",
            "a row of names and rows of as many cells, parted by comma, semicolon, tab or blanks",
        )
    shape = max(shapes, key=lambda one: (one.first_row is not None and one.header is not None, one.share, one.cells))
    if shape.first_row is None:
        raise UnreadableLogError(source.name, "names but no rows of numbers below", "a header and rows")
    return _sample(source, encoding, lines, shape)


def _spaced(source: Source, encoding: str) -> "tuple[Source, list[HeadLine], _Shape] | None":
    """Return a table whose cells are parted by blanks, with tabs for them, or None."""
    seen = SpacedSource(source.path, source)
    lines = head_lines(seen, encoding, _FIRST_LINES)
    cells, joined = _parts_of_angles([_cells(line.text, "\t") for line in lines[:300]])
    if joined:
        seen = SpacedSource(source.path, source, cells, joined)
        lines = head_lines(seen, encoding, _FIRST_LINES)
    shape = _Shape.of(lines, "\t")
    return None if shape is None or shape.first_row is None or shape.share < ENOUGH / 2 else (seen, lines, shape)


def _parts_of_angles(rows: Sequence[Sequence[str]]) -> tuple[int, tuple[int, ...]]:
    """Return cells of a row, and gaps between parts of degrees, minutes and seconds.

    A latitude or longitude has three cells below its name; 0 and no gaps where the names do not tell that.
    """
    counts = Counter(len(row) for row in rows if len(row) > 1 and _is_row(row))
    cells = max(counts, key=lambda count: counts[count], default=0)
    first = next((at for at, row in enumerate(rows) if len(row) == cells and _is_row(row)), 0)
    for row in rows[max(0, first - _MOST_BEHIND) : first]:
        meanings = [meaning_of(name.lstrip("# ")) for name in row[:500]]
        places = [at for at, one in enumerate(meanings) if one is not None and one.field in _PLACES]
        if places and len(row) + 2 * len(places) == cells:
            return cells, tuple(at + 2 * number + more for number, at in enumerate(places) for more in (0, 1))
    return 0, ()


@dataclass(frozen=True)
class _Shape:
    """Shape of lines by one delimiter: cells of a row, places of header and first row."""

    delimiter: str
    cells: int
    share: float
    header: int | None
    first_row: int | None

    @classmethod
    def of(cls, lines: Sequence[HeadLine], delimiter: str) -> "_Shape | None":
        rows = [_cells(line.text, delimiter) for line in lines[:300]]
        counts = Counter(len(row) for row in rows if len(row) > 1)
        if not counts:
            return None
        cells = max(counts, key=lambda count: (counts[count], count))
        share = round(counts[cells] / max(1, sum(1 for line in lines[:300] if line.text.strip())), 1)
        first = next((at for at, row in enumerate(rows) if len(row) == cells and _is_row(row)), None)
        header = None if first is None else _header_above(rows, first, cells)
        if first is not None and header is None:  # rows that end with a delimiter that the header lacks
            header = _header_above(rows, first, cells - 1) if cells > 2 and not rows[first][-1] else None
        return cls(delimiter, cells, share, header, first)


def _cells(line: str, delimiter: str) -> list[str]:
    """Return the cells of a line, without the sign of a comment before names with blanks."""
    return split_cells(line.lstrip("# \t") if delimiter == "\t" and line.startswith("#") else line, delimiter)


def _is_row(cells: Sequence[str]) -> bool:
    """Tell whether cells are those of a row: numbers or times among them."""
    return any(_NUMBER.fullmatch(cell) or _TIME.fullmatch(cell) for cell in cells)


def _header_above(rows: Sequence[Sequence[str]], first: int, cells: int) -> int | None:
    """Return the place of the header row: the line above the first row that names the most."""
    places = []
    for at in range(first - 1, max(-1, first - _MOST_BEHIND - 2), -1):
        row = rows[at]
        if len(row) == cells and any(row) and not _is_row(row):
            places.append(at)
        elif any(row) and not _is_section(row):
            break
    if not places:
        return None
    return max(places, key=lambda at: (_known_names(rows[at]), len(set(filter(None, rows[at]))) > cells // 2, -at))


def _is_section(row: Sequence[str]) -> bool:
    """Tell whether a line names a section, ``[data]``, or is a comment."""
    return len(row) == 1 and bool(re.fullmatch(r"\[.*\]|#.*", row[0].strip()))


def _known_names(row: Sequence[str]) -> int:
    found = [meaning_of(name.lstrip("# ")) for name in row[:500]]
    return len({one.target or one.role for one in found if one is not None})


def _sample(
    source: Source, encoding: str, lines: Sequence[HeadLine], shape: _Shape, *, is_spaced: bool = False
) -> TableSample:
    header = None if shape.header is None else lines[shape.header]
    assert shape.first_row is not None
    behind: tuple[tuple[str, ...], ...] = ()
    if header is None:
        names = tuple(f"column_{at + 1}" for at in range(shape.cells))
    else:
        first, *rest = _cells(header.text, shape.delimiter)
        names = (first.lstrip("# "), *rest)
        between = lines[shape.header + 1 : shape.first_row]  # type: ignore[operator]
        is_of_comments = all(
            line.text.startswith("#") and len(_cells(line.text, shape.delimiter)) == 1 for line in between
        )
        rows = [] if is_of_comments else [split_cells(line.text, shape.delimiter) for line in between]
        behind = tuple(tuple(row[: len(names)] + [""] * (len(names) - len(row))) for row in rows)
    count = len(names)
    most = max(20, min(_MOST_ROWS, _MOST_CELLS // (count * (_WINDOWS + 1))))
    blocks = [tuple(_rows((line.text for line in lines[shape.first_row :]), shape.delimiter, count, most))]
    blocks += [tuple(_rows(piece, shape.delimiter, count, most)) for piece in _later(source, encoding)]
    kept = tuple(block for block in blocks if block)
    if not kept:
        raise UnreadableLogError(source.name, "names but no rows below", "a header and rows")
    top = shape.first_row if shape.header is None else shape.header
    above = tuple(line.text for line in lines[:top])
    return TableSample(source.name, encoding, shape.delimiter, header, names, behind, kept, is_spaced, above)


def _rows(texts: Iterator[str] | Sequence[str], delimiter: str, count: int, most: int) -> Iterator[tuple[str, ...]]:
    found = 0
    for text in texts:
        cells = split_cells(text, delimiter)
        is_row = len(cells) == count or (len(cells) == count + 1 and not cells[-1])
        if is_row and _is_row(cells):
            yield tuple(cells[:count])
            found += 1
        if found == most:
            return


def _later(source: Source, encoding: str) -> Iterator[list[str]]:
    """Yield the whole lines of some pieces behind the head of a file."""
    begin = len(source.head)
    room = source.size - begin
    if room < _WINDOWS * _WINDOW_BYTES:
        return
    with source.open() as stream:
        for place in range(_WINDOWS):
            stream.seek(begin + place * (room - _WINDOW_BYTES) // (_WINDOWS - 1))
            text = stream.read(_WINDOW_BYTES).decode(encoding, errors="replace")
            yield text.replace("\r", "\n").split("\n")[1:-1]
