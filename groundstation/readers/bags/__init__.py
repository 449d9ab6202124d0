"""Robots' logs: MCAP of other programs, ROS 1 bags (.bag), ROS 2 bags (sqlite3, MCAP).

A ROS 2 bag that was split is read by its folder.
"""

from collections.abc import Iterator
from pathlib import Path

from groundstation.base.records import Item
from groundstation.readers.bags.kinds import is_begun, kind_of
from groundstation.readers.source import Claim, Source

NAME = "bag"


def sniff(source: Source) -> Claim | None:
    """Claim a file by its first bytes, by ROS 2 metadata, or by a chunk in it.

    The chunk counts where the first bytes are lost.
    """
    kind = kind_of(source)
    return Claim(NAME, kind, confidence=1.0 if is_begun(source) else 0.5) if kind else None


def claim_by(source: Source, profile: Path) -> Claim:
    """Claim a bag whose messages the user's profile explains.

    Raises
    ------
    SettingsError
        When the profile cannot be used.
    """
    from groundstation.readers.bags.profile import load

    return Claim(NAME, f"{kind_of(source)} {load(profile).name}")


def read(source: Source, profile: Path | None = None) -> Iterator[Item]:
    """Yield the header, batches of every topic (raw and canonical), remarks and damage."""
    from groundstation.readers.bags.profile import load
    from groundstation.readers.bags.reader import items

    yield from items(source, NAME, load(profile) if profile is not None else None)
