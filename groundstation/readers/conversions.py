"""Cells of a column to values of its field, as the rule of the column has it."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pyarrow as pa

from groundstation.base.records import Column
from groundstation.readers import cells, dms
from groundstation.readers.cells import TableCells
from groundstation.readers.layout import LayoutRule, TableLayout, number_of
from groundstation.readers.rows import restore_delimiters

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


def _without_numbers(read: TableCells, missing: Sequence[str]) -> TableCells:
    """Return a column without the numbers that mean no value."""
    numbers = [number for text in missing if (number := number_of(text)) is not None]
    if not numbers:
        return read
    is_none = np.isin(read.column.values, numbers) & read.column.mask
    return replace(read, column=Column(read.column.values, read.column.mask & ~is_none)) if is_none.any() else read
