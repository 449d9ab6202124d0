"""Robots' logs: MCAP of other programs, ROS 1 bags (.bag), ROS 2 bags (sqlite3, MCAP, split ones by their folder)."""

from collections.abc import Iterator

from groundstation.base.records import Item
from groundstation.readers.bags.bag import kind_of
from groundstation.readers.source import Claim, Source

NAME = "bag"


def sniff(source: Source) -> Claim | None:
    """Claim a file by its first bytes, and the metadata of a bag of ROS 2."""
    kind = kind_of(source)
    return Claim(NAME, kind) if kind else None


def read(source: Source) -> Iterator[Item]:
    """Yield the header, batches of every topic (raw and canonical), remarks and damages."""
    from groundstation.readers.bags.reader import items

    yield from items(source, NAME)
