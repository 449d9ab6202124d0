"""Cells of a column to values of its field, as the rule of the column has it."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pyarrow as pa

from groundstation.base import arrow_compute as pc
from groundstation.base import arrow_values as arrow
from groundstation.base.records import Column
from groundstation.readers import cells, dms
from groundstation.readers.cells import TableCells
from groundstation.readers.layout import LayoutRule, TableLayout, number_of
from groundstation.readers.rows import restore_delimiters

_SIDES = {"latitude_deg": ("N", "S"), "longitude_deg": ("E", "W")}  # letters of a positive sign and a negative one
_FILLERS: Mapping[str, float | str | bool] = {"double": float("nan"), "bool": False, "text": ""}


def read_cells(rule: LayoutRule, array: Any, layout: TableLayout, delimiter: str) -> tuple[TableCells, str]:
    """Return the values of a column, and words for the cells that cannot be read.

    Factor and offset of the rule are not applied.

    Parameters
    ----------
    rule : LayoutRule
    array : pyarrow array of string or float64
        Cells, or the numbers that the CSV parser made of them.
    layout : TableLayout
        Layout of the table that the column is of.
    delimiter : str
    """
    if pa.types.is_string(array.type) and (rule.kind in ("text", "bool") or rule.values):
        distinct, index = cells.distinct(array)
        read, what = _read_each(rule, distinct, layout, delimiter)
        return read.take(index), what
    return _read_each(rule, array, layout, delimiter)


def _read_each(rule: LayoutRule, array: Any, layout: TableLayout, delimiter: str) -> tuple[TableCells, str]:
    is_text = pa.types.is_string(array.type)
    has_comma = layout.decimal_comma and rule.kind == "double"

    def pointed(text: Any) -> Any:
        return cells.with_point(text) if has_comma else text

    def cleaned(text: Any) -> Any:
        text = pointed(cells.cleaned(text, layout.missing))
        return cells.without(text, rule.missing) if rule.missing else text

    if rule.form == "dms" and not rule.part and dms.is_quick((*rule.missing, *layout.missing), len(array)):
        read = dms.degrees(pointed(array), cleaned)
        return _without_numbers(read, rule.missing), "cells that are not degrees, minutes and seconds"
    array = cleaned(array) if is_text else array
    if is_text and rule.part:
        array = cells.part_of(array, rule.part)
    if rule.values:
        return cells.looked_up(array, dict(rule.values), _FILLERS[rule.kind]), "cells that the profile does not list"
    if rule.kind == "bool":
        return cells.flags(array), "cells that are not 0, 1, true or false"
    if rule.kind == "text":
        return cells.words(array, lambda word: restore_delimiters(word, delimiter)), "cells that are no text"
    what = "cells that are not a number"
    if rule.form == "ddmm":
        read, what = cells.degrees_and_minutes(array), "cells that are not degrees and minutes, run together"
    elif rule.form == "dms":
        read, what = cells.degrees(array), "cells that are not degrees, minutes and seconds"
    else:
        read = cells.numbers(array) if is_text else cells.ready_numbers(array)
    read = _without_numbers(read, rule.missing)
    if rule.form == "variance":
        return cells.roots(read), "cells that are not a variance"
    return read, what


def sided(read: TableCells, letters: Any, field: str) -> tuple[TableCells, str]:
    """Return latitudes or longitudes with the sign that letters of another column give.

    The letter is the first of the cell: N, S, north. A row without one, or with a minus that the letter contradicts, is
    unreadable. Returns also words for that.

    Examples
    --------
    >>> read = cells.numbers(pa.array(["47.5", "33.8", "-33.8", "-1", "2"]))
    >>> read, _what = sided(read, pa.array(["N", "s", "South", "N", None]), "latitude_deg")
    >>> read.column.values.tolist(), read.unreadable.tolist()
    ([47.5, -33.8, -33.8, nan, nan], [False, False, False, True, True])
    """
    plus, minus = _SIDES[field]
    first = pc.utf8_slice_codeunits(pc.utf8_upper(cells.trimmed(letters)), 0, 1)
    is_plus, is_minus = (arrow.mask(pc.fill_null(pc.equal(first, one), arrow.FALSE)) for one in (plus, minus))
    values = read.column.values
    is_told = (is_plus & ~(values < 0.0)) | is_minus
    mask = read.column.mask
    signed = np.where(is_minus, -np.abs(values), values)
    found = Column(np.where(mask & is_told, signed, np.nan), mask & is_told)
    what = f"cells that are no number, or have no {plus} or {minus} that agrees with it beside them"
    return TableCells(found, read.unreadable | (mask & ~is_told)), what


def _without_numbers(read: TableCells, missing: Sequence[str]) -> TableCells:
    """Return a column without the numbers that mean no value."""
    numbers = [number for text in missing if (number := number_of(text)) is not None]
    if not numbers:
        return read
    is_none = np.isin(read.column.values, numbers) & read.column.mask
    return replace(read, column=Column(read.column.values, read.column.mask & ~is_none)) if is_none.any() else read
