"""Draft of a profile for a table, by its names, units and values.

What the values show wins over what is assumed, and what the header tells over both. Whatever is assumed carries a
question mark in the draft.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from groundstation.base.dataclasses import dataclass
from groundstation.readers.drafts.column import ColumnGuess, columns_in_doubt
from groundstation.readers.drafts.guesses import Guesses
from groundstation.readers.drafts.sample import sample_of
from groundstation.readers.drafts.time_guess import TimeGuess
from groundstation.readers.drafts.times import time_of
from groundstation.readers.drafts.written import written
from groundstation.readers.rtklib_tag import beside, has_tag
from groundstation.readers.source import Source


@dataclass(frozen=True)
class Draft:
    """Draft of a profile for a table: its text, and what was understood.

    Parameters
    ----------
    text : str
        TOML.
    header : int
        Line of the header row; 0 of a table without one.
    delimiter : str
    time : TimeGuess
    time_names : tuple of str
    columns : tuple of ColumnGuess
        In the order of the file, without those of the time.
    """

    text: str
    header: int
    delimiter: str
    time: TimeGuess
    time_names: tuple[str, ...]
    columns: tuple[ColumnGuess, ...]

    @property
    def understood(self) -> tuple[ColumnGuess, ...]:
        """Columns that become fields."""
        return tuple(one for one in self.columns if one.target)

    @property
    def doubts(self) -> tuple[str, ...]:
        """Lines that tell what the user has to look at."""
        told = [f"time: {self.time.doubt}"] if self.time.doubt else []
        each = columns_in_doubt(self.columns)
        return (*told, *(f"{', '.join(of)}: {doubt}" for doubt, of in each.items()))


@np.errstate(all="ignore")  # a table may hold any number
def draft_of(source: Source, names: Sequence[str] = ()) -> Draft:
    """Return the draft of a profile for a table, with names for one that has none.

    Raises
    ------
    UnreadableLogError
        When the file is no table, or has no time that can be read; the cause is named.
    """
    sample = sample_of(source, names)
    time = _by_tag(source, time_of(sample))
    guesses = Guesses(sample, time).columns()
    return Draft(
        written(sample, time, guesses),
        0 if sample.header is None else sample.header.number,
        sample.delimiter,
        time,
        tuple(sample.names[at] for at in time.columns),
        guesses,
    )


def _by_tag(source: Source, time: TimeGuess) -> TimeGuess:
    """Return a time in seconds of a device with UTC by the time tag of RTKLIB beside it."""
    if time.is_absolute or 'kind = "seconds"' not in time.lines or not has_tag(source):
        return time
    why = f"{time.why}; UTC by {beside(source).name}, the time tag of RTKLIB"
    return replace(time, lines=(*time.lines, "rtklib_tag = true"), why=why, is_absolute=True)


def facts_of(draft: Draft) -> Mapping[str, object]:
    """Return what a draft understood as plain values."""
    return {
        "header_row": draft.header,
        "delimiter": draft.delimiter,
        "time": {"columns": list(draft.time_names), "why": draft.time.why, "doubt": draft.time.doubt},
        "columns": [
            {
                "name": one.name,
                "field": one.target,
                "unit": one.unit,
                "scale": one.scale,
                "sign": one.sign,
                "offset": one.offset,
                "values": one.values,
                "why": one.why,
                "doubt": one.doubt,
            }
            for one in draft.columns
        ],
        "profile": draft.text,
    }
