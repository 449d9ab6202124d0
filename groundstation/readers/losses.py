"""Count of what a reader could not read, and where; many alike losses give one line."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from groundstation.base.dataclasses import dataclass
from groundstation.base.records import Damage


@dataclass
class _Tally:
    count: int
    first: int
    last: int


class Losses:
    """Losses by (kind, what, topic), with the first and the last line of each."""

    def __init__(self) -> None:
        self._tallies: dict[tuple[str, str, str, str, bool], _Tally] = {}

    def add(
        self,
        kind: str,
        what: str,
        lines: NDArray[np.int64],
        *,
        where: str = "",
        topic: str = "",
        loses_data: bool = True,
    ) -> None:
        """Count one loss for each of ``lines`` (line numbers, increasing).

        ``where`` names the column, if there is one.
        """
        if not len(lines):
            return
        first, last = int(lines[0]), int(lines[-1])
        tally = self._tallies.setdefault((kind, what, where, topic, loses_data), _Tally(0, first, last))
        tally.count += len(lines)
        tally.first, tally.last = min(tally.first, first), max(tally.last, last)

    def damages(self) -> Iterator[Damage]:
        """Yield one :class:`Damage` for each kind of loss, in the order they were first met."""
        for (kind, what, where, topic, loses_data), tally in self._tallies.items():
            lines = f"row {tally.first}" if tally.first == tally.last else f"rows {tally.first} to {tally.last}"
            yield Damage(kind, f"{where}, {lines}" if where else lines, tally.count, what, topic, loses_data)
