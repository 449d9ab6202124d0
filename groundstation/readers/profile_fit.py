"""Match of a profile to a header of a table: its columns and the lines around it."""

import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cached_property

from groundstation.base.dataclasses import dataclass
from groundstation.base.source_units import PREFIX, units_entry
from groundstation.readers.dialect import (
    DELIMITERS,
    Dialect,
    HeadLine,
    cell_count,
    normal_form,
    split_cells,
    trailing_cells,
)
from groundstation.readers.head_notes import NOTE, note_of
from groundstation.readers.profile import Profile
from groundstation.readers.sections import HeaderPlace, lines_below
from groundstation.readers.source import Source
from groundstation.readers.told import ColumnFacts, bare, told

_MOST_VOTES = 500  # rows that tell whether a delimiter ends them
_MOST_ABOVE = 20  # lines above a header in the middle of a file that belong to it
_TIMES: Mapping[str, re.Pattern[str]] = {
    "local": re.compile(r"(.*[T\s])?(\d{1,2}:\d\d(:\d\d([.,]\d*)?)?(\s*[AaPp]\.?[Mm]\.?)?|\d{6}([.,]\d*)?)"),
    "iso": re.compile(r"\d{4}[-/.]?\d\d?.*"),
    "seconds": re.compile(r"[+-]?(\d+[.,]?\d*|[.,]\d+)([eE][+-]?\d+)?"),
    "nanoseconds": re.compile(r"[+-]?\d+"),
    "utc_counter": re.compile(r".*\d.*"),
}
_LIKE = {
    "unix": "seconds",
    "gps_week": "seconds",
    "time_of_day": "local",
}  # kinds of time that are written like another
_WORDS = re.compile(r"\([^()]*\)|[^\s()]+")
_FORMAT = re.compile(r"(?=.*(yy|hh))[ymdhs:./ -]+", re.IGNORECASE)  # the unit of a date or a time of day


@dataclass(frozen=True)
class Fit:
    """Match of a profile to a header row.

    Parameters
    ----------
    profile : Profile
    encoding, delimiter : str
    names : tuple of str
        Cells of the header row.
    header : HeadLine
    behind : tuple of HeadLine
        Rows of units or of other names below the header.
    above : tuple of HeadLine
        Lines above the header that are no rows.
    rows_above : tuple of HeadLine
        Rows above the header.
    first_rows : tuple of str
    cells : int
        Number of cells of a row before those that belong together were joined; 0: none are.
    joined : tuple of int
        Gaps between cells of such a row that part none.
    """

    profile: Profile
    encoding: str
    delimiter: str
    names: tuple[str, ...]
    header: HeadLine
    behind: tuple[HeadLine, ...] = ()
    above: tuple[HeadLine, ...] = ()
    rows_above: tuple[HeadLine, ...] = ()
    first_rows: tuple[str, ...] = ()
    cells: int = 0
    joined: tuple[int, ...] = ()

    @property
    def _time_form(self) -> re.Pattern[str]:
        kind = self.profile.time.kind
        return _TIMES[_LIKE.get(kind, kind)]

    @cached_property
    def metadata(self) -> dict[str, str]:
        """Metadata that the lines around the header tell."""
        text = "\n".join(line.text for line in (*self.above, self.header, *self.behind))
        text = text.replace("\t", " ") if self.profile.is_spaced else text  # as the file has it
        found = dict(self.profile.constants)
        for key, pattern in self.profile.find.items():
            match = pattern.search(text)
            if match:
                found[key] = " ".join((match.group(1) or "").split())
        for key, template in self.profile.join.items():
            told = (*self.profile.find, *self.profile.find_in_name, *self.profile.constants)
            names = {name: found.get(name, "") for name in told}
            found[key] = " ".join(template.format(**names).split())
        note = note_of(line.text for line in self.above)
        found = {NOTE: note} | found if note else found
        units = units_entry(self.units)
        return found | {PREFIX + self.profile.raw_topic: units} if units else found

    @property
    def last(self) -> HeadLine:
        """Last line above the rows."""
        return self.behind[-1] if self.behind else self.header

    def dialect_to(self, end_byte: int | None, stands_again: bool = True) -> Dialect:
        """Return the dialect of the rows; ``stands_again``: the header may repeat in them."""
        lines = (*self.above, *((self.header,) if stands_again else ()), *self.behind)
        return Dialect(
            self.encoding,
            self.delimiter,
            self._cell_count,
            self.last.next_byte,
            self.last.number + 1,
            frozenset(normal_form(line.text, self.delimiter) for line in lines) - {""},
            end_byte,
        )

    @cached_property
    def _cell_count(self) -> int:
        return len(self.names) + trailing_cells(self.first_rows[:_MOST_VOTES], self.delimiter, len(self.names))

    @cached_property
    def position(self) -> Mapping[str, int]:
        """Columns by name; also by the name without a unit if the header states units."""
        found = {name: at for at, name in reversed(list(enumerate(self.names))) if name}
        if self.profile.header_tells:
            found = {bare(name): at for at, name in reversed(list(enumerate(self.names))) if bare(name)} | found
        return found

    @cached_property
    def _around(self) -> tuple[list[list[str]], list[list[str]]]:
        """Cells of the rows of names, and of those of units, around the header and with it."""
        if not self.profile.header_tells:
            return [], []
        names, units = [list(self.names)], list[list[str]]()
        for line in (*self.above, *self.behind):
            cells = self._cells(line.text)
            is_of_units = line.text.startswith("#") or any(map(_FORMAT.fullmatch, cells))
            (units if is_of_units else names).extend([cells] if cells else [])
        return names, units

    @property
    def told_count(self) -> int:
        """Number of columns whose name has more in parentheses."""
        return sum(bare(name) != name for name in self.names)

    def told(self, at: int) -> ColumnFacts:
        """Read the names of a column, and its cells in the rows around the header."""
        names, units = self._around
        return told([cells[at] for cells in names], [cells[at] for cells in units])

    @property
    def units(self) -> dict[str, str]:
        """Units by column.

        They stand in a comment above the header, or in a row below it that is left out; either has as many cells as the
        header.
        """
        comments = [line.text for line in self.above if line.text.startswith("#")]
        below = [line.text for line in self.behind[: self.profile.rows_after_header]]
        for cells in map(self._cells, (*comments, *below)):
            if cells:
                return {name: cell for name, cell in zip(self.names, cells, strict=True) if name and cell != "-"}
        return {}

    def label(self, at: int) -> str:
        """Return the name of a column under the raw topic."""
        name = self.names[at]
        return name if self.names.index(name) == at else f"{name}_{at + 1}"

    def names_as(self, other: "Fit") -> bool:
        """Tell whether another header has the same names and the same units."""
        return (self.names, self.delimiter, self._around) == (other.names, other.delimiter, other._around)

    def is_repeated(self, place: HeaderPlace) -> bool:
        """Tell whether another header has exactly the same lines."""
        above = place.above[len(place.above) - len(self.above) :] if self.above else ()
        return place.line.text == self.header.text and [one.text for one in above] == [one.text for one in self.above]

    def is_row(self, line: str) -> bool:
        """Tell whether a line is a row: a cell for each column, and a time or some number."""
        times, others = self._times(line)
        if any(times):
            return bool(self._time_form.fullmatch(times[-1]))
        return any(_TIMES["seconds"].fullmatch(cell) for cell in others)

    def is_whole(self, line: str) -> bool:
        """Tell whether a line is a row that has as many cells as are read."""
        return cell_count(line, self.delimiter) == self._cell_count and self.is_row(line)

    def is_of_names(self, line: str) -> bool:
        """Tell whether a line has names or units: words for the columns of time, no number."""
        times, others = self._times(line.lstrip("#"))
        is_time = bool(times) and bool(self._time_form.fullmatch(times[-1]))
        return bool(times) and all(times) and not is_time and not any(map(_TIMES["seconds"].fullmatch, others))

    def _times(self, line: str) -> tuple[list[str], list[str]]:
        """Return the time cells of a line, and the others; none if their number is wrong."""
        cells = split_cells(line, self.delimiter)
        if len(cells) not in (len(self.names), len(self.names) + 1) or line.startswith("#"):
            return [], []
        at = [self.position[name] for name in self.profile.time.asked]
        return [cells[one] for one in at], [cell for one, cell in enumerate(cells) if one not in at]

    def _cells(self, line: str) -> list[str]:
        """Return the cells of a line near the header; none if their number is wrong."""
        cells = [cell.strip() for cell in split_cells(line.lstrip("# "), self.delimiter)]
        if len(cells) != len(self.names) and self.profile.has_blanks and line in [one.text for one in self.behind]:
            return self._below_names(line)
        return cells if len(cells) == len(self.names) else []

    def _below_names(self, line: str) -> list[str]:
        """Return the words of a row of units by the names that they stand below.

        Blanks part names and units.
        """
        names = [one.span() for one in re.finditer(r"\S+", self.header.text)]
        if len(names) != len(self.names):
            return []
        cells = [""] * len(names)
        for word in _WORDS.finditer(line.replace("\t", " ")):
            apart = [max(first - word.end(), word.start() - end) for first, end in names]
            nearest = min(range(len(names)), key=lambda at: (apart[at], abs(names[at][1] - word.end())))
            cells[nearest] = f"{cells[nearest]} {word[0]}".strip()
        return cells


def delimiter_of(line: str, profile: Profile) -> str:
    """Return the delimiter of a line that is a header row of a profile, else nothing."""
    wanted = {*profile.required, *profile.time.asked, *((profile.key,) if profile.key else ())}
    if not all(name in line for name in wanted):
        return ""
    for delimiter in delimiters_of(profile):
        names = _names(line, delimiter, profile)
        if wanted.issubset(names) or (profile.header_tells and wanted.issubset(map(bare, names))):
            return delimiter
    return ""


def delimiters_of(profile: Profile) -> tuple[str, ...]:
    """Return the delimiters that may part the columns; blanks are seen as tabs."""
    return ("\t",) if profile.is_spaced else DELIMITERS


def joined_gaps(profile: Profile, names: Sequence[str], rows: Sequence[str]) -> tuple[int, tuple[int, ...]]:
    """Return the number of cells of rows that have degrees, minutes, seconds apart.

    Returns also the gaps between these cells, counted from 0; 0 and none where the rows have a cell for each name.
    """
    if not profile.has_blanks:
        return 0, ()
    of_angles = {rule.name for rule in profile.columns if rule.form == "dms"}
    places = [at for at, name in enumerate(names) if name in of_angles or bare(name) in of_angles]
    if not places:
        return 0, ()
    counts = Counter(cell_count(row, "\t") for row in rows if row.strip())
    cells = counts.most_common(1)[0][0] if counts else 0
    if cells != len(names) + 2 * len(places):
        return 0, ()
    return cells, tuple(gap for number, at in enumerate(places) for gap in (at + 2 * number, at + 2 * number + 1))


def fit_at(profile: Profile, encoding: str, delimiter: str, lines: Sequence[HeadLine], at: int) -> Fit:
    """Match a profile to the header row ``at`` of the lines at the top of a file."""
    fit = _with_names(profile, encoding, delimiter, lines, at)
    is_row = [fit.is_row(line.text) for line in lines[:at]]
    return replace(
        fit,
        above=tuple(line for line, is_one in zip(lines, is_row, strict=False) if not is_one),
        rows_above=tuple(line for line, is_one in zip(lines, is_row, strict=False) if is_one),
    )


def fit_below(source: Source, before: Fit, place: HeaderPlace) -> tuple[Fit, int]:
    """Match a profile to a header inside a file.

    Returns also the byte that ends the rows above.
    """
    lines = [place.line, *lines_below(source, place.line, before.encoding)]
    fit = _with_names(before.profile, before.encoding, delimiter_of(place.line.text, before.profile), lines, 0)
    count = 0
    while count < min(len(place.above), _MOST_ABOVE) and not before.is_row(place.above[-count - 1].text):
        count += 1
    end_byte = place.above_from[-count] if count else place.first_byte
    return replace(fit, above=place.above[len(place.above) - count :]), end_byte


def _with_names(profile: Profile, encoding: str, delimiter: str, lines: Sequence[HeadLine], at: int) -> Fit:
    """Return a match with names and the lines below them, without the lines above."""
    names = _names(lines[at].text, delimiter, profile)
    first = at + 1 + profile.rows_after_header
    fit = Fit(profile, encoding, delimiter, names, lines[at], tuple(lines[at + 1 : first]))
    if profile.has_second_names and first < len(lines) and fit.is_of_names(lines[first].text):
        first += 1
    below = tuple(line.text for line in lines[first:])
    return replace(fit, behind=tuple(lines[at + 1 : first]), first_rows=below)


def _names(line: str, delimiter: str, profile: Profile) -> tuple[str, ...]:
    if profile.has_blanks:
        line = line.strip()
    if profile.header_tells:
        line = line.lstrip("# \t" if profile.has_blanks else "#")
    return tuple(split_cells(line, delimiter))
