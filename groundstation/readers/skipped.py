"""Bytes of a binary log that belong to no record.

The first stretches are reported one by one, the others together.
"""

from collections.abc import Iterator
from dataclasses import field
from typing import NamedTuple

from groundstation.base.dataclasses import dataclass
from groundstation.base.records import Damage

STRETCHES_SHOWN = 20


class _Stretch(NamedTuple):
    """First byte, end byte (exclusive), and index of the first record behind it."""

    start: int
    end: int
    behind: int


@dataclass
class SkippedBytes:
    """Skipped stretches of bytes in the order of the file.

    Parameters
    ----------
    record : str
        What the format calls a record.

    Examples
    --------
    >>> skipped = SkippedBytes("message")
    >>> skipped.add(100, 164, 7)
    >>> [(damage.place, damage.count, damage.between_records) for damage in skipped.damages()]
    [('bytes 100 to 163', 64, (6, 7))]
    """

    record: str
    _shown: list[_Stretch] = field(default_factory=list)
    _others: int = 0
    _other_bytes: int = 0
    _other_ends: tuple[_Stretch, ...] = ()

    def __bool__(self) -> bool:
        """Tell whether any bytes were skipped."""
        return bool(self._shown)

    def add(self, start: int, end: int, index: int) -> None:
        """Count the bytes from ``start`` to ``end`` of the file, in front of the record ``index``."""
        stretch = _Stretch(start, end, index)
        if len(self._shown) < STRETCHES_SHOWN:
            self._shown.append(stretch)
            return
        self._others, self._other_bytes = self._others + 1, self._other_bytes + end - start
        self._other_ends = (*self._other_ends[:1], stretch)

    def damages(self) -> Iterator[Damage]:
        """Yield the skipped bytes as damage, in the order of the file."""
        what = f"bytes that belong to no {self.record}"
        for start, end, behind in self._shown:
            place = bytes_place(start, end)
            yield Damage("corrupt", place, end - start, f"{what}, skipped", between_records=(behind - 1, behind))
        if self._others:
            first, last = self._other_ends[0], self._other_ends[-1]
            what = f"{what} in {self._others} more {'place' if self._others == 1 else 'places'}, skipped"
            between = first.behind - 1, last.behind
            yield Damage(
                "corrupt", bytes_place(first.start, last.end), self._other_bytes, what, between_records=between
            )


def bytes_place(start: int, end: int) -> str:
    """Return the text that says where bytes stand; ``end`` is the first after them."""
    return f"byte {start}" if end - start == 1 else f"bytes {start} to {end - 1}"
