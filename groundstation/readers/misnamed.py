"""Columns of a table whose names are almost known ones: kept as raw, and reported as lost."""

from collections import Counter
from collections.abc import Iterator, Mapping

import numpy as np

from groundstation.base.records import Damage, Item, RecordBatch

Key = tuple[str, str]


def misnamed(items: Iterator[Item], wanted: Mapping[Key, tuple[str, str]], row: int) -> Iterator[Item]:
    """Yield the items, then damage for columns whose names are almost known ones.

    Parameters
    ----------
    items : iterator of items
    wanted : mapping of (topic, field) to (name of the column, known name)
    row : int
        Line of the header row.
    """
    counts: Counter[Key] = Counter()
    for item in items:
        yield item
        if isinstance(item, RecordBatch):
            for field, column in item.columns.items():
                if (item.topic, field) in wanted:
                    counts[item.topic, field] += int(np.count_nonzero(column.mask))
    for key, count in counts.items():
        name, meant = wanted[key]
        yield Damage("misnamed", f"row {row}", count, f"values of column {name!r}: unknown, meant {meant!r}?", key[0])
