"""Tracks that an estimator made of a flight.

They are a role: others judge or use them without knowing the estimator.
"""

from collections.abc import Iterator, Mapping
from typing import Protocol, runtime_checkable

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.records import Column, Int64Array
from groundstation.tables.table import Table


@runtime_checkable
class HasTracks(Protocol):
    """Role of the workings of an analysis that hold tracks."""

    def tracks(self, start_ns: int) -> Iterator[tuple[str, Table]]:
        """Yield name and table of each track, with the field names of an INS.

        Positions are those of the GNSS antenna. ``start_ns`` is the start of the flight.
        """


def ins_table(time_ns: Int64Array, columns: Mapping[str, FloatArray]) -> Table:
    """Make a table with the fields of an INS, by whose names angles are interpolated as such."""
    order = np.argsort(time_ns, kind="stable")
    found = {name: Column(values[order], np.isfinite(values[order])) for name, values in columns.items()}
    index = np.arange(len(time_ns), dtype=np.int64)
    return Table("ins", time_ns[order], found, index, Column(time_ns[order]))
