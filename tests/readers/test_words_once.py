"""A column of few words, each many times: every word is read once."""

from typing import Any

import pyarrow as pa
import pytest

from groundstation.readers import cells
from groundstation.readers.conversions import read_cells
from groundstation.readers.layout import LayoutRule, TableLayout, TimeRule

MODES = ["nav", " nav ", None, "align", "n\x1av", ""]


def test_distinct_words_give_what_all_cells_give() -> None:
    """Compare with the cells read one by one, the unreadable one among them."""
    column = pa.array(MODES * 3)
    distinct, index = cells.distinct(column)
    taken, whole = cells.words(cells.trimmed(distinct)).take(index), cells.words(cells.trimmed(column))
    assert taken.column.values.tolist() == whole.column.values.tolist()
    assert taken.column.mask.tolist() == whole.column.mask.tolist()
    assert taken.unreadable.tolist() == whole.unreadable.tolist() == [False, False, False, False, True, False] * 3


def test_reader_reads_each_word_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """Count the cells that are looked at for control characters."""
    seen: list[int] = []
    words = cells.words

    def counting(text: Any, *rest: Any) -> cells.TableCells:
        seen.append(len(text))
        return words(text, *rest)

    monkeypatch.setattr(cells, "words", counting)
    rule = LayoutRule(0, "ins", "mode", "text")
    read, _what = read_cells(rule, pa.array(MODES * 1000), TableLayout(TimeRule("seconds", (0,), ("t",)), (rule,)), ",")
    assert read.column.values[:4].tolist() == ["nav", "nav", "", "align"]
    assert seen == [len(set(MODES))]
