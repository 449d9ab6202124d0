"""Ranges of a link in messages: by a profile, to topics ``link.<peer>``.

Drivers of ultra-wideband radios write a range with the numbers of both ends, a list of nodes with a range each, or a
range alone, whose other end is in the frame or in the name of the topic. The profile says where the range and the ends
stand, which ends are this log's own, and the names of the others.
"""

from collections.abc import Mapping

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.dataclasses import dataclass
from groundstation.base.records import BoolArray, Column
from groundstation.readers.bags.values import Values
from groundstation.readers.mapping import Columns

EACH = "[*]"  # any entry of a list
MOST_ENTRIES = 64
MOST_TOLD = 8
LINK, RANGE = "link.", "pseudorange_m"


@dataclass(frozen=True)
class RangesRule:
    """Rule for ranges: paths of the range and of its ends, own ends, names of the others.

    ``peer``: name of the other end where no path tells it. ``factor`` converts to metres.
    """

    value: str
    ends: tuple[str, ...]
    own: frozenset[str]
    names: Mapping[str, str]
    peer: str = ""
    factor: float = 1.0

    @property
    def topics(self) -> tuple[str, ...]:
        """Canonical topics that the rule feeds."""
        return tuple(dict.fromkeys(f"{LINK}{name}" for name in ((self.peer,) if self.peer else self.names.values())))

    def columns(self, values: Values, topic: str) -> Columns:
        """Return the ranges to one peer; absent where a message has none."""
        total = np.full(len(values), np.nan)
        wanted = [end for end, name in self.names.items() if f"{LINK}{name}" == topic]
        for entry in self._entries(values):
            read = values[_at(self.value, entry)] * self.factor
            mine = np.isfinite(read) & (read != 0.0)  # drivers write 0 or infinity where nothing answered
            if not self.peer:
                mine &= self._is_between(values, entry, wanted)
            total = np.where(mine, read, total)
        return {RANGE: Column(np.nan_to_num(total), np.isfinite(total))}

    def _is_between(self, values: Values, entry: int, wanted: list[str]) -> BoolArray:
        """Tell whether one end is a wanted peer; the other one, if it is told, is this log's own."""
        is_peer = [_is_one(values, _at(path, entry), wanted) for path in self.ends]
        if len(self.ends) == 1:
            return is_peer[0]
        is_own = [_is_one(values, _at(path, entry), sorted(self.own)) for path in self.ends]
        return np.asarray((is_peer[0] & is_own[1]) | (is_peer[1] & is_own[0]))

    def _entries(self, values: Values) -> list[int]:
        if EACH not in self.value:
            return [0] if self.value in values else []
        return [entry for entry in range(MOST_ENTRIES) if _at(self.value, entry) in values]

    def missing(self, present: Mapping[str, Column]) -> list[str]:
        """Paths that the messages lack."""
        return [path for path in (self.value, *self.ends) if _at(path, 0) not in present]

    def told(self, present: Mapping[str, Column]) -> str:
        """Describe what is mapped, and what has no name in the messages that were looked at."""
        by = f" by {' and '.join(self.ends)}" if self.ends else ""
        text = f"ranges to {', '.join(topic.removeprefix(LINK) for topic in self.topics)} = {self.value}{by}"
        if self.factor != 1.0:
            text += f" x {self.factor:g}"
        unnamed = sorted(self._ids(present) - self.own - set(self.names))
        if unnamed:
            more = f" and {len(unnamed) - MOST_TOLD} more" if len(unnamed) > MOST_TOLD else ""
            text += f"; no name for {', '.join(unnamed[:MOST_TOLD])}{more}"
        return text

    def _ids(self, present: Mapping[str, Column]) -> set[str]:
        found: set[str] = set()
        for path in self.ends:
            for name in {_at(path, entry) for entry in range(MOST_ENTRIES)} & set(present):
                column = present[name]
                found |= {_id_of(value) for value in np.unique(column.values[column.mask]).tolist()}
        return found


def _at(path: str, entry: int) -> str:
    return path.replace(EACH, f"[{entry}]")


def _id_of(value: object) -> str:
    """Return the number or text of an end as it stands in a profile.

    Examples
    --------
    >>> _id_of(3), _id_of(3.0), _id_of("anchor_3")
    ('3', '3', 'anchor_3')
    """
    return str(int(value)) if isinstance(value, float) and value.is_integer() else str(value)


def _is_one(values: Values, path: str, ids: list[str]) -> BoolArray:
    """Tell which messages have one of these ends there."""
    if path not in values:
        return np.zeros(len(values), dtype=bool)
    column = values.column(path)
    if column.values.dtype.kind == "U":
        return np.asarray(np.isin(column.values, ids) & column.mask)
    numbers: FloatArray = np.array([float(one) for one in ids if one.lstrip("-").isdigit()])
    return np.asarray(np.isin(values[path], numbers))
