"""Sources of a topic: the connections that wrote it, put together by who wrote them.

Connections of one topic that interlace are several sources, those one after the other are one. A node that is started
again opens another connection, and a recording that was split goes on with one of the next file: the source stays. Two
nodes that publish on one topic at the same time are two, whatever the name of the topic.
"""

import re
from collections.abc import Iterable, Sequence
from typing import TypeAlias

import numpy as np

from groundstation.base.dataclasses import dataclass
from groundstation.base.records import Int64Array
from groundstation.readers.bags.messages import Connection

OVERLAP_SHARE, OVERLAP_MESSAGES = 0.05, 3  # connections interlace with this share of one, and messages of both
Key: TypeAlias = tuple[str, str, str, bytes]


@dataclass(frozen=True)
class WriteTimes:
    """Log times at which a connection was written, in their order.

    Each stands for ``stride`` messages.
    """

    connection: Connection
    time_ns: Int64Array
    stride: int

    def overlaps(self, other: "WriteTimes") -> bool:
        """Tell whether messages of both interlace."""
        pairs = ((self, other), (other, self))
        counts = [one._within(two) for one, two in pairs]
        shares = [count / len(one.time_ns) for count, (one, _two) in zip(counts, pairs, strict=True)]
        messages = [count * one.stride for count, (one, _two) in zip(counts, pairs, strict=True)]
        return min(messages) >= OVERLAP_MESSAGES and max(shares) >= OVERLAP_SHARE

    def _within(self, other: "WriteTimes") -> int:
        first, end = np.searchsorted(self.time_ns, (other.time_ns[0], other.time_ns[-1] + 1))
        return int(end - first)


def key_of(connection: Connection) -> Key:
    """Return the key that connections of one source have in common."""
    return connection.topic, connection.type, connection.encoding, connection.schema


def in_order(connection: Connection) -> tuple[str, list[tuple[int, str]], int]:
    """Return the sort key of a connection: topic, then publisher, numbers by size."""
    parts = re.findall(r"\d+|\D+", connection.publisher)
    return (
        connection.topic,
        [(int(part), "") if part.isdigit() and part.isascii() else (-1, part) for part in parts],
        connection.number,
    )


def sources_of(lines: Iterable[WriteTimes]) -> list[list[int]]:
    """Return the numbers of each source's connections, in order of first appearance."""
    topics: dict[Key, list[WriteTimes]] = {}
    for line in lines:
        topics.setdefault(key_of(line.connection), []).append(line)
    found = [source for several in topics.values() for source in _of_topic(several)]
    found.sort(key=lambda source: source[0].connection.number)
    return [[line.connection.number for line in source] for source in found]


def _of_topic(lines: Sequence[WriteTimes]) -> list[list[WriteTimes]]:
    """Group the connections of a topic that one source wrote one after the other."""
    sources: list[list[WriteTimes]] = []
    for line in sorted(lines, key=lambda line: (int(line.time_ns[0]), line.connection.number)):
        free = [source for source in sources if not any(line.overlaps(one) for one in source)]
        if free:
            publisher = line.connection.publisher
            free.sort(key=lambda source: (source[-1].connection.publisher == publisher, int(source[-1].time_ns[-1])))
            free[-1].append(line)
        else:
            sources.append([line])
    return sources
