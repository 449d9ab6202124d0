"""Flat CSV of any recorder: a time column, columns ``<topic>.<field>``, ``#`` metadata.

Every recorder can export it.

``record_index`` is the line number in the file (from 1), so that findings name the line an editor shows. Columns
without a canonical field go to ``raw.<topic>`` (``raw.csv`` when their name has no dot), as numbers where every cell of
the file is one, else as text.
"""

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cached_property

import numpy as np

from groundstation.base.dataclasses import dataclass
from groundstation.base.errors import UnreadableLogError, near_names
from groundstation.base.records import Damage, Item, LogHeader, Remark
from groundstation.base.signals import RAW_PREFIX, TOPICS, field_of, kind_of
from groundstation.base.slips import slips
from groundstation.readers.dialect import (
    Dialect,
    HeadLine,
    detect_delimiter,
    detect_encoding,
    head_lines,
    normal_form,
    split_cells,
    trailing_cells,
    uses_decimal_comma,
)
from groundstation.readers.head_notes import NOTE, is_entry, note_of
from groundstation.readers.layout import Derivation, LayoutRule, TableLayout, TimeRule, rule_for
from groundstation.readers.misnamed import misnamed
from groundstation.readers.sections import (
    MOST,
    HeaderPlace,
    TableSection,
    ended,
    header_places,
    left_out,
    lines_below,
    told,
    without_headers,
)
from groundstation.readers.source import Claim, Source
from groundstation.readers.start import told_at_zero, unusable_references, utc_of_zero

NAME = "flat-csv"
PAGE = "docs/flat-csv.md has ten lines to copy"
TIME_COLUMNS = {"time_ns": "nanoseconds", "time_s": "seconds", "time_utc": "iso"}  # the recorder's own clock first
_MARK = re.compile(rb"time_(?:s|ns|utc)")
_MOST_NS = 9e18  # 64 bits hold such differences
FEWEST_ROWS = 3  # below a header row that does not stand on top


@dataclass(frozen=True)
class _Top:
    """Part of the file above the rows.

    ``strange_lines`` of it are neither metadata nor the header row.
    """

    encoding: str
    metadata: Mapping[str, str]
    header: HeadLine
    names: tuple[str, ...]
    delimiter: str
    first_rows: tuple[str, ...]
    strange_lines: int

    @property
    def canonical(self) -> list[str]:
        """Names of columns that are canonical fields."""
        return [name for name in self.names if field_of(*name.rpartition(".")[::2])]

    @property
    def is_flat(self) -> bool:
        """Tell whether there is a time column, and a column ``<topic>.<field>``."""
        return _are_flat(self.names)

    @property
    def time_kind(self) -> str:
        """Form in which the time of a row is written."""
        return next(kind for name, kind in TIME_COLUMNS.items() if name in self.names)

    @cached_property
    def dialect(self) -> Dialect:
        """Dialect of the rows below."""
        return Dialect(
            self.encoding,
            self.delimiter,
            len(self.names) + trailing_cells(self.first_rows, self.delimiter, len(self.names)),
            self.header.next_byte,
            self.header.number + 1,
            frozenset({normal_form(self.header.text, self.delimiter)}),
        )

    @property
    def has_rows(self) -> bool:
        """Tell whether most of the lines below have as many cells as the header row."""
        sizes = [len(split_cells(row, self.delimiter)) for row in self.first_rows if row.strip()]
        sound = sizes.count(len(self.names))
        return sound >= FEWEST_ROWS and 2 * sound > len(sizes)


def _read_top(source: Source) -> _Top | None:
    """Read the metadata and the header row.

    The header row is the first line below the metadata; where that is damaged, the first header row that has its rows
    below it.
    """
    encoding = detect_encoding(source.head, source.name)
    metadata: dict[str, str] = {}
    lines = head_lines(source, encoding)
    first: _Top | None = None
    strange_lines = 0
    for at, line in enumerate(lines):
        if line.text.startswith("#"):
            key, colon, value = line.text.lstrip("#").partition(":")
            if colon and is_entry(key):
                metadata[key.strip()] = value.strip()
        elif line.text.strip():
            if first is None or any(name in line.text for name in TIME_COLUMNS):
                note = note_of(one.text for one in lines[:at])
                top = _top(encoding, metadata | ({NOTE: note} if note else {}), lines, at, strange_lines)
                if top.is_flat and (first is None or (top.canonical and top.has_rows)):
                    return top
                first = first or top
            strange_lines += 1
    return first


def _top(encoding: str, metadata: Mapping[str, str], lines: Sequence[HeadLine], at: int, strange_lines: int) -> _Top:
    """Return the part above the rows when line ``at`` is the header row."""
    header = lines[at]
    delimiter = detect_delimiter(header.text)
    names = tuple(split_cells(header.text, delimiter))
    below = tuple(line.text for line in lines[at + 1 :])
    return _Top(encoding, metadata, header, names, delimiter, below, strange_lines)


def sniff(source: Source) -> Claim | None:
    """Claim a text whose header row has a time column and at least one ``<topic>.<field>``."""
    top = _read_top(source)
    if top is None:
        return None
    canonical = top.canonical
    if canonical and not any(name in TIME_COLUMNS for name in top.names):
        raise UnreadableLogError(
            f"{source.name}, row {top.header.number}",
            f"columns such as {canonical[0]!r} but no time column",
            "time_s, time_ns or time_utc",
            f"name the time column so ({PAGE}), or describe the file by a profile",
        )
    return Claim(NAME, "", 0.9 if canonical else 0.4) if top.is_flat else None


def read(source: Source) -> Iterator[Item]:
    """Yield the header, batches, remarks and damage of a flat CSV.

    Raises
    ------
    UnreadableLogError
        When the header row is not that of a flat CSV.
    """
    from groundstation.readers.table_reader import TableReader, truncated_header

    top = _read_top(source)
    if top is None or sniff(source) is None:
        raise UnreadableLogError(
            source.name, "no flat-CSV header row", f"a time column and <topic>.<field> columns ({PAGE})"
        )
    layout, remarks = _layout(top)
    remarks += _mistakes(top) + unusable_references(top.metadata)
    if not top.header.ended:
        yield LogHeader(NAME, top.metadata, None)
        yield from remarks
        yield truncated_header(top.header.number)
        return
    utc_of_zero_ns, clock_remarks = _utc_of_zero(source, top.dialect, layout, top.metadata, top.names)
    sections, section_remarks = _sections(source, top, layout, utc_of_zero_ns)
    items = TableReader(source, sections).items(LogHeader(NAME, top.metadata, utc_of_zero_ns))
    yield next(items)
    yield from dict.fromkeys([*remarks, *clock_remarks, *section_remarks])
    if top.strange_lines:
        what = "lines above the header row that are no metadata"
        yield Damage("corrupt", f"rows 1 to {top.header.number - 1}", top.strange_lines, what)
    yield from misnamed(items, _slips(top), top.header.number)


def _sections(
    source: Source, top: _Top, layout: TableLayout, utc_of_zero_ns: int | None
) -> tuple[list[TableSection], list[Remark | Damage]]:
    """Rows below each header that names other columns or another zero of time."""
    sections, remarks = [TableSection(top.dialect, layout)], list[Remark | Damage]()
    last, last_utc_ns, stands_again = top, utc_of_zero_ns, False
    for place in header_places(source, top.header, top.encoding, _MARK, _is_header):
        stands_again = True
        above, first_byte = _belonging(place)
        metadata = dict(_entries(above))
        delimiter = detect_delimiter(place.line.text)
        names = tuple(split_cells(place.line.text, delimiter))
        is_same = (names, delimiter) == (last.names, last.delimiter)
        if is_same and utc_of_zero(metadata)[0] in (None, last_utc_ns):
            continue
        if len(sections) == MOST:
            sections[-1] = ended(sections[-1], first_byte)
            return sections, [*remarks, left_out(source, place.line.number, place.first_byte)]
        below = tuple(line.text for line in lines_below(source, place.line, top.encoding))
        found = _Top(top.encoding, metadata, place.line, names, delimiter, below, 0)
        found_layout, more = _layout(found)
        utc_ns, clock_remarks = _utc_of_zero(source, found.dialect, found_layout, metadata, names)
        shift_ns = _shift_ns(utc_of_zero_ns, utc_ns, found, last, sections[-1].shift_ns)
        sections[-1] = ended(sections[-1], first_byte)
        sections.append(TableSection(found.dialect, found_layout, shift_ns, metadata))
        remarks += [told(place, is_same, shift_ns), *more, *_mistakes(found), *clock_remarks]
        last, last_utc_ns = found, last_utc_ns if utc_ns is None else utc_ns
    return sections if stands_again else [without_headers(sections[0])], remarks


def _shift_ns(zero_ns: int | None, utc_ns: int | None, found: _Top, last: _Top, shift_ns: int | None) -> int | None:
    """Return the shift from the times below a header to those of the log.

    None where nothing tells it.
    """
    is_continued = (found.time_kind == "iso") == (last.time_kind == "iso")
    if utc_ns is not None and zero_ns is not None:
        return utc_ns - zero_ns
    return shift_ns if is_continued else None


def _is_header(line: str) -> bool:
    """Tell whether a line in the middle of the file is a header row.

    It names a time column, and a column ``<topic>.<field>``.
    """
    return _are_flat(split_cells(line, detect_delimiter(line)))


def _are_flat(names: Sequence[str]) -> bool:
    return any(name in TIME_COLUMNS for name in names) and any("." in name.strip(".") for name in names)


def _belonging(place: HeaderPlace) -> tuple[tuple[HeadLine, ...], int]:
    """Lines of metadata right above a header, and the byte where they begin."""
    count = 0
    for line in reversed(place.above):
        if line.text.strip() and not line.text.startswith("#"):
            break
        count += 1
    return place.above[len(place.above) - count :], place.above_from[-count] if count else place.first_byte


def _entries(lines: Sequence[HeadLine]) -> Iterator[tuple[str, str]]:
    for line in lines:
        key, colon, value = line.text.lstrip("#").partition(":")
        if colon and key.strip():
            yield key.strip(), value.strip()


def _utc_of_zero(
    source: Source, dialect: Dialect, layout: TableLayout, metadata: Mapping[str, str], names: tuple[str, ...]
) -> tuple[int | None, list[Remark]]:
    """Return the UTC of device time zero, and remarks.

    It follows from the kind of the time column, the metadata, or a column ``time_utc``.
    """
    if layout.time.kind == "iso":
        return 0, []
    utc_ns, remarks = utc_of_zero(metadata)
    if utc_ns is not None or "time_utc" not in names:
        return utc_ns, remarks
    return _utc_from_rows(source, dialect, layout, names.index("time_utc"))


def _utc_from_rows(
    source: Source, dialect: Dialect, layout: TableLayout, column: int
) -> tuple[int | None, list[Remark]]:
    """Return the UTC of device time zero, and remarks, by the column ``time_utc``.

    The first rows that have both a recorder time and a ``time_utc`` tell it.
    """
    from groundstation.readers.table_reader import first_times

    device, _none = first_times(source, dialect, layout)
    utc, zoneless = first_times(source, dialect, replace(layout, time=TimeRule("iso", (column,), ("time_utc",))))
    fits = np.abs(utc.values.astype(np.float64) - device.values) < _MOST_NS
    both = (device.mask & utc.mask & fits).nonzero()[0]
    if not len(both):
        return None, []
    zero = told_at_zero(utc.values[both], device.values[both])
    text = f"UTC of the recorder's zero from time_utc: median over its first {len(zero.zeros_ns)} times"
    remarks = [Remark("derived", text), *zero.remarks("time_utc")]
    remarks += [Remark("assumed_utc", "time_utc names no zone: read as UTC")] if zoneless else []
    return zero.ns, remarks


def _layout(top: _Top) -> tuple[TableLayout, list[Remark]]:
    time_name = next(name for name in TIME_COLUMNS if name in top.names)
    time_column = top.names.index(time_name)
    time = TimeRule(TIME_COLUMNS[time_name], (time_column,), (time_name,))  # type: ignore[arg-type]
    rules: dict[tuple[str, str], LayoutRule] = {}
    remarks: list[Remark] = []
    for column, name in enumerate(top.names):
        if column == time_column or not name:
            continue
        rule = _rule(column, name)
        if rule.key in rules:
            renamed = replace(
                rule, topic=f"{RAW_PREFIX}csv", field=f"{name}_{column + 1}", kind="raw", is_heading=False
            )
            remarks.append(Remark("duplicate_column", f"column {name!r} occurs twice: the second is {renamed.target}"))
            rule = renamed
        rules[rule.key] = rule
    layout = TableLayout(time, tuple(rules.values()), decimal_comma=uses_decimal_comma(top.first_rows, top.delimiter))
    return replace(layout, derivations=_derivations(layout.rules)), remarks


def _rule(column: int, name: str) -> LayoutRule:
    topic, _, field = name.rpartition(".")
    known = field_of(topic, field)
    if known is not None:
        return rule_for(column, topic, known, raw=(f"{RAW_PREFIX}{topic}", field))
    raw_topic = topic if topic.startswith(RAW_PREFIX) else f"{RAW_PREFIX}{topic or 'csv'}"
    return LayoutRule(column, raw_topic, field, "raw")


def _derivations(rules: tuple[LayoutRule, ...]) -> tuple[Derivation, ...]:
    """Velocities from track and ground speed, for topics that have no velocities of their own."""
    keys = {rule.key for rule in rules}
    found = []
    for topic in dict.fromkeys(rule.topic for rule in rules):
        inputs = ((topic, "track_deg"), (topic, "ground_speed_mps"))
        outputs = ("velocity_north_mps", "velocity_east_mps")
        canonical = field_of(topic, "velocity_north_mps") is not None
        if canonical and keys.issuperset(inputs) and not keys.intersection((topic, name) for name in outputs):
            found.append(Derivation("velocity_from_track", topic, outputs, inputs))
    return tuple(found)


def _mistakes(top: _Top) -> list[Remark]:
    """Return a remark on columns that name no canonical field: they are kept as raw."""
    unknown = [name for name in _unknown(top) if "." in name and not name.startswith(RAW_PREFIX)]
    if not unknown:
        return []
    shown = ", ".join(map(_with_near, unknown[:5])) + (", ..." if len(unknown) > 5 else "")
    return [Remark("unknown_columns", f"{len(unknown)} columns name no canonical field and are kept as raw: {shown}")]


def _unknown(top: _Top) -> list[str]:
    return [name for name in top.names if field_of(*name.rpartition(".")[::2]) is None and name not in TIME_COLUMNS]


def _slips(top: _Top) -> Mapping[tuple[str, str], tuple[str, str]]:
    """Find columns whose names are almost canonical.

    Returns, by topic and field, the name found and the name that was probably meant.
    """
    topics = dict.fromkeys((*(name.rpartition(".")[0] for name in top.canonical), *TOPICS))
    known = [f"{topic}.{one.name}" for topic in topics for one in TOPICS.get(kind_of(topic), ())]
    found = slips(top.names, known)
    return {_rule(0, name).key: (name, meant) for name, meant in found.items() if not name.startswith(RAW_PREFIX)}


def _with_near(name: str) -> str:
    """Name a column, with the canonical one that was probably meant.

    Examples
    --------
    >>> _with_near("ins.roll"), _with_near("engine.rpm")
    ('ins.roll (ins.roll_deg?)', 'engine.rpm')
    """
    topic, _, field = name.rpartition(".")
    near = near_names(field, (one.name for one in TOPICS.get(kind_of(topic), ())), 1)
    return f"{name} ({topic}.{near[0]}?)" if near else name
