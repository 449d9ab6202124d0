"""Read a delimited table by its dialect and layout, as batches of typed columns."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.csv as pa_csv

from groundstation.base.angles import wrap_360
from groundstation.base.geodesy import NO_POSITION
from groundstation.base.records import (
    MAX_BATCH_ROWS,
    MAX_TEXT_CHARACTERS,
    BoolArray,
    Column,
    Damage,
    Int64Array,
    Item,
    LogHeader,
    RecordBatch,
    Remark,
)
from groundstation.base.signals import kind_of
from groundstation.base.words import counted
from groundstation.readers import cells
from groundstation.readers.conversions import read_cells, sided
from groundstation.readers.days import DayCount
from groundstation.readers.dialect import Dialect
from groundstation.readers.inside import new_logs, with_own_zeros
from groundstation.readers.layout import METHODS, Key, LayoutRule, TableLayout, apply
from groundstation.readers.losses import Losses
from groundstation.readers.places import PLACED, without_place, zeroed
from groundstation.readers.row_times import times_of
from groundstation.readers.rows import RowBlock, RowScanner
from groundstation.readers.sections import TableSection
from groundstation.readers.source import Source

MAX_BATCH_BYTES = 32 << 20  # a text field is as wide as its longest value: a batch of long texts has fewer rows


class TableReader:
    """Reader of one delimited file, section by section.

    Parameters
    ----------
    source : Source
    sections : sequence of TableSection
        In the order of the file. Rules of kind ``raw`` are settled here by a first pass over the file.
    losses : Losses, optional
        What was lost before.

    Attributes
    ----------
    zoneless : int
        Times read so far that name no zone.
    """

    def __init__(self, source: Source, sections: Sequence[TableSection], losses: Losses | None = None) -> None:
        self._source = source
        self._losses = losses or Losses()
        self._wrapped: dict[str, int] = {}
        self.zoneless = 0
        self._placeless: set[str] = set()  # topics that had a row without a place
        self._days = DayCount()
        self._sections = self._settled(sections)
        self._dialect, self._layout = self._sections[0].dialect, self._sections[0].layout

    def items(self, header: LogHeader) -> Iterator[Item]:
        """Yield the header, batches in the order of the file, remarks and damage."""
        yield header
        lines: dict[int, str] = {}
        facts: dict[int, Mapping[str, str]] = {}
        for number, section in enumerate(self._sections):
            self._dialect, self._layout, self._days = section.dialect, section.layout, DayCount()
            scanner = RowScanner(self._source, section.dialect, self._losses)
            zero_ns = _zero_of(header, section)
            for block in scanner:
                time, columns = self._typed(block)
                time = with_own_zeros(time, block.line_numbers, scanner.skipped, zero_ns)
                yield from self._batches(block.line_numbers, _shifted(time, section.shift_ns), columns)
            above = section.dialect.first_line - 1
            lines |= ({above: ""} if number else {}) | scanner.skipped
            facts |= {above: section.facts} if number else {}
        yield from new_logs(lines, facts, header.utc_of_zero_ns)
        yield from self._remarks(scanner)
        yield from self._losses.damages()

    def columns(self) -> Iterator[dict[Key, Column]]:
        """Columns of the rows of the first section without their times, block by block."""
        for block in RowScanner(self._source, self._dialect, Losses()):
            yield self._fields(self._arrays(block, with_time=False), block.line_numbers)

    def first_times(self) -> Column:
        """Times of the first block of rows; none when there are no rows."""
        for block in RowScanner(self._source, self._dialect, Losses()):
            return self._time(self._arrays(block), block.line_numbers)
        return Column(np.zeros(0, dtype=np.int64))

    def times(self) -> Iterator[tuple[Int64Array, Column]]:
        """Line numbers and times of the rows of the first section, block by block."""
        for block in RowScanner(self._source, self._dialect, Losses()):
            yield block.line_numbers, self._time(self._arrays(block), block.line_numbers)

    def _settled(self, sections: Sequence[TableSection]) -> tuple[TableSection, ...]:
        """Settle columns of kind ``raw``: float64 where every cell is a number, else text.

        A column's type must not change between batches, so it takes a pass of its own; only raw columns are parsed. A
        field that is a number by the rule of one section is one in all.
        """
        kinds = {rule.key: rule.kind for section in sections for rule in section.layout.rules if rule.kind != "raw"}
        for section in sections:
            raw = {rule.column: rule.key for rule in section.layout.rules if rule.kind == "raw"}
            texts = self._texts(section, {column for column, key in raw.items() if key not in kinds})
            kinds |= {raw[column]: "text" for column in texts}
        settled = []
        for section in sections:
            rules = tuple(
                replace(rule, kind=kinds.get(rule.key, "double")) if rule.kind == "raw" else rule
                for rule in section.layout.rules
            )
            settled.append(replace(section, layout=replace(section.layout, rules=rules)))
        return tuple(settled)

    def _texts(self, section: TableSection, columns: set[int]) -> set[int]:
        """Return those of some columns of a section that have a cell which is no number."""
        self._dialect, self._layout = section.dialect, section.layout
        texts: set[int] = set()
        for block in RowScanner(self._source, section.dialect, Losses()) if columns else ():
            parsed = self._parse(block, dict.fromkeys(sorted(columns - texts), pa.string()))
            for column, array in parsed.items():
                text = cells.cleaned(array, section.layout.missing)
                if not cells.are_numbers(cells.with_point(text) if section.layout.decimal_comma else text):
                    texts.add(column)
            if texts == columns:
                break
        return texts

    def _parse(self, block: RowBlock, types: Mapping[int, Any], decimal_point: str = ".") -> dict[int, Any]:
        """Return columns of a block as arrow arrays, empty cells null.

        Raises pa.ArrowInvalid where a type does not fit.
        """
        names = [str(column) for column in range(self._dialect.cells)]
        table = pa_csv.read_csv(
            pa.BufferReader(block.text),
            read_options=pa_csv.ReadOptions(column_names=names, use_threads=False, block_size=len(block.text) + 1),
            parse_options=pa_csv.ParseOptions(
                delimiter=self._dialect.delimiter, quote_char=False, escape_char=False, ignore_empty_lines=False
            ),
            convert_options=pa_csv.ConvertOptions(
                column_types={str(column): kind for column, kind in types.items()},
                include_columns=[str(column) for column in types],
                null_values=["", *self._layout.missing],
                strings_can_be_null=True,
                decimal_point=decimal_point,
            ),
        )
        return {column: _whole(table.column(str(column))) for column in types}

    def _typed(self, block: RowBlock) -> tuple[Column, dict[Key, Column]]:
        arrays = self._arrays(block)
        return self._time(arrays, block.line_numbers), self._fields(arrays, block.line_numbers)

    def _arrays(self, block: RowBlock, with_time: bool = True) -> dict[int, Any]:
        """Return the cells of the columns that have rules, and of the time.

        As numbers where they can be, else as text as it stands.
        """
        layout = self._layout
        types = {rule.column: pa.float64() for rule in layout.rules}
        types |= {rule.column: pa.string() for rule in layout.rules if not rule.is_parsed}
        types |= {rule.side: pa.string() for rule in layout.rules if rule.side is not None}
        types |= dict.fromkeys(layout.time.columns if with_time else (), pa.string())
        try:
            return self._parse(block, types, "," if layout.decimal_comma else ".")
        except pa.ArrowInvalid:  # some cell is no number: take all as text and find out which
            return self._parse(block, dict.fromkeys(types, pa.string()))

    def _fields(self, arrays: Mapping[int, Any], lines: Int64Array) -> dict[Key, Column]:
        """Columns of the rules, and those that are derived from them."""
        columns = {rule.key: self._column(rule, arrays, lines) for rule in self._layout.rules}
        for topic, by_field in self._places():
            columns |= self._placed(topic, by_field, columns, lines)
        for derivation in self._layout.derivations:
            columns |= apply(derivation, columns)
        return columns

    def _places(self) -> Iterator[tuple[str, dict[str, LayoutRule]]]:
        """Yield topics whose rows state a position, with rules by field; truth is left out."""
        topics: dict[str, dict[str, LayoutRule]] = {}
        for rule in self._layout.rules:
            topics.setdefault(rule.topic, {})[rule.field] = rule
        for topic, by_field in topics.items():
            if kind_of(topic) in PLACED and by_field.keys() >= {"latitude_deg", "longitude_deg"}:
                yield topic, by_field

    def _placed(
        self, topic: str, by_field: Mapping[str, LayoutRule], columns: Mapping[Key, Column], lines: Int64Array
    ) -> dict[Key, Column]:
        """Drop values without a position; keep their raw numbers in raw columns."""
        latitude, longitude = (columns[topic, f"{name}_deg"] for name in ("latitude", "longitude"))
        is_zero = without_place(latitude, longitude)
        self._losses.add("no_position", NO_POSITION, lines[is_zero], topic=topic, loses_data=False)
        if not is_zero.any() and topic not in self._placeless:
            return {}
        self._placeless.add(topic)
        fields = {name: columns[topic, name] for name in by_field}
        found: dict[Key, Column] = {}
        for name, absent in zeroed(kind_of(topic), fields, is_zero).items():
            column, rule = fields[name], by_field[name]
            found[rule.key] = Column(column.values, column.mask & ~absent)
            if rule.raw is not None and rule.raw not in columns:
                found[rule.raw] = Column((column.values - rule.offset) / rule.factor, column.present)
        return found

    def _time(self, arrays: Mapping[int, Any], lines: Int64Array) -> Column:
        rule = self._layout.time
        texts = [cells.cleaned(arrays[column], self._layout.missing) for column in rule.columns]
        if self._layout.decimal_comma:
            texts = [cells.with_point(text) for text in texts]
        read, zoneless = times_of(rule, texts, self._days)
        self.zoneless += zoneless
        self._losses.add("unreadable_cells", "times that cannot be read", lines[read.unreadable], where=rule.names[0])
        return read.column

    def _column(self, rule: LayoutRule, arrays: Mapping[int, Any], lines: Int64Array) -> Column:
        read, what = read_cells(rule, arrays[rule.column], self._layout, self._dialect.delimiter)
        if rule.side is not None:
            read, what = sided(read, arrays[rule.side], rule.field)
        self._losses.add("unreadable_cells", what, lines[read.unreadable], where=rule.target, topic=rule.topic)
        if read.cut is not None:
            what = f"texts cut to {MAX_TEXT_CHARACTERS} characters"
            self._losses.add("cut_text", what, lines[read.cut], where=rule.target, topic=rule.topic)
        column = read.column
        if rule.factor != 1.0 or rule.offset != 0.0:
            with np.errstate(over="ignore"):  # becomes infinite: the ledger flags it
                column = Column(column.values * rule.factor + rule.offset, column.present)
        return self._on_the_circle(rule, column) if rule.is_heading else column

    def _on_the_circle(self, rule: LayoutRule, column: Column) -> Column:
        """Bring headings into [0, 360).

        A value more than a turn outside is no heading: it is left for the ledger to flag.
        """
        values = column.values
        astray = ((values < 0.0) | (values >= 360.0)) & (values >= -360.0) & (values <= 720.0) & column.mask
        if not astray.any():
            return column
        self._wrapped[rule.target] = self._wrapped.get(rule.target, 0) + int(astray.sum())
        whole = values.copy()
        whole[astray] = wrap_360(values[astray])
        return Column(whole, column.present)

    def _batches(self, lines: Int64Array, time: Column, columns: Mapping[Key, Column]) -> Iterator[RecordBatch]:
        topics: dict[str, dict[str, Column]] = {}
        for (topic, name), column in columns.items():
            topics.setdefault(topic, {})[name] = column
        for topic, fields in topics.items():
            batch = RecordBatch(topic, lines, time, fields)
            rows = _occupied(fields)
            if rows is not None:
                batch = batch.take(rows)
            row_bytes = sum(column.values.dtype.itemsize for column in fields.values())
            step = max(1, min(MAX_BATCH_ROWS, MAX_BATCH_BYTES // max(1, row_bytes)))
            for start in range(0, len(batch), step):
                yield batch if len(batch) <= step else batch.take(slice(start, start + step))

    def _remarks(self, scanner: RowScanner) -> Iterator[Remark]:
        layouts = [section.layout for section in self._sections]
        for derivation in dict.fromkeys(derivation for layout in layouts for derivation in layout.derivations):
            outputs = ", ".join(derivation.outputs)
            text = f"{derivation.topic}: {outputs} derived from {METHODS[derivation.method].text}"
            yield Remark("derived", text, derivation.topic, derivation.outputs)
        for target, count in self._wrapped.items():
            text = f"{target}: {counted(count, 'value')} outside [0, 360) brought into it by whole turns"
            yield Remark("wrapped_heading", text, target.rpartition(".")[0])
        if self.zoneless:
            yield Remark("assumed_utc", f"{counted(self.zoneless, 'time')} without a zone: read as UTC")
        if late := self._days.weeks.rows:
            rows = counted(late, "row has", "rows have")
            text = f"{rows} the week before theirs: their seconds began anew, and the week did not"
            yield Remark("late_week", text)
        if any(layout.decimal_comma for layout in layouts):
            yield Remark("decimal_comma", "numbers are written with a decimal comma")
        if scanner.ends_without_newline:
            yield Remark("no_final_newline", "the last row has no line end: its last cell may be cut short")


def _whole(column: Any) -> Any:
    """Return a column as one array; that of one chunk is not copied."""
    return column.chunk(0) if column.num_chunks == 1 else column.combine_chunks()


def _zero_of(header: LogHeader, section: TableSection) -> int | None:
    """UTC of time zero of the rows of a section."""
    if header.utc_of_zero_ns is None or section.shift_ns is None:
        return None
    return header.utc_of_zero_ns + section.shift_ns


def _shifted(time: Column, shift_ns: int | None) -> Column:
    """Return times by the clock of the log's header; none where the shift is unknown."""
    if shift_ns is None:
        return Column(time.values, np.zeros(len(time), dtype=bool))
    return Column(time.values + shift_ns, time.present) if shift_ns else time


def _occupied(fields: Mapping[str, Column]) -> BoolArray | None:
    """Rows in which any field has a cell; None when all have."""
    if any(column.present is None for column in fields.values()):
        return None
    rows: BoolArray = np.logical_or.reduce([column.mask for column in fields.values()])
    return None if rows.all() else rows


def first_times(source: Source, dialect: Dialect, layout: TableLayout) -> tuple[Column, int]:
    """Return the times of the first block of rows, and how many name no time zone.

    There are no times when there are no rows.
    """
    reader = TableReader(source, [TableSection(dialect, replace(layout, rules=(), derivations=()))])
    return reader.first_times(), reader.zoneless


def all_times(source: Source, section: TableSection) -> Iterator[tuple[Int64Array, Column]]:
    """Line numbers and times of the rows of a section, block by block."""
    bare = replace(section, layout=replace(section.layout, rules=(), derivations=()))
    yield from TableReader(source, [bare]).times()


def truncated_header(line: int) -> Damage:
    """Damage of a file that ends inside its header row."""
    return Damage("truncated", f"row {line}", 1, "header row cut by the end of the file: no data")
