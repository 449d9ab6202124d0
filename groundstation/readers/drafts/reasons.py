"""Reasons in the damage of a table: why the cells of a column cannot be read."""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING

from groundstation.base.errors import GroundstationError
from groundstation.base.records import Damage, Item
from groundstation.base.words import listed
from groundstation.readers.source import Source

MOST_WORDS = 5  # that are named

if TYPE_CHECKING:
    from groundstation.readers.drafts.sample import TableSample


def with_reasons(
    items: Iterator[Item],
    source: Source,
    columns: Mapping[str, str],
    time: str,
    values: Mapping[str, Mapping[str, float | str | bool]],
) -> Iterator[Item]:
    """Yield the items; damage of unreadable cells gets the cause that the cells show.

    Parameters
    ----------
    items : iterator of items
    source : Source
    columns : mapping of place to column
        Column by the place that damage names: ``topic.field``, or the columns of the time.
    time : str
        Place of the times.
    values : mapping of place to mapping
        What the cells of a column of words mean; the cause is a word that is not among them.
    """
    sample: TableSample | None = None
    for item in items:
        place = item.place.rpartition(", row")[0] if isinstance(item, Damage) else ""
        if isinstance(item, Damage) and item.kind == "unreadable_cells" and place in columns:
            from groundstation.readers.drafts.sample import sample_of  # most tables have no such damage

            try:
                sample = sample or sample_of(source)
            except GroundstationError:
                yield item
                continue
            if place in values:
                cause = _unlisted(sample, columns[place], values[place])
            else:
                cause = _cause(sample, columns[place], is_time=place == time)
            yield replace(item, what=f"{item.what} ({cause})") if cause else item
        else:
            yield item


def _unlisted(sample: "TableSample", name: str, values: Mapping[str, float | str | bool]) -> str:
    """Return words of a column that its profile does not list, with quotes."""
    if name not in sample.names:
        return ""
    import pyarrow as pa

    from groundstation.readers.cells import looked_up

    words = list(dict.fromkeys(sample.filled(sample.names.index(name))))
    unknown = looked_up(pa.array(words, pa.string()), values, "").unreadable
    found = [repr(word) for word, is_unknown in zip(words, unknown, strict=True) if is_unknown]
    return listed(found[:MOST_WORDS]) if found else ""


def _cause(sample: "TableSample", name: str, *, is_time: bool) -> str:
    if name not in sample.names:
        return ""
    from groundstation.readers.drafts.causes import cause_of_numbers, cause_of_times

    cells = sample.filled(sample.names.index(name))
    return cause_of_times(cells) if is_time and cells else cause_of_numbers(cells, sample.delimiter)
