"""MURP ranges between two agents with six antennas each (CSV, motion capture beside them).

A table, read by the profile murp_pair.toml.
"""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

from groundstation.base.errors import UnreadableLogError
from groundstation.base.records import Item, LogHeader
from groundstation.readers import csv_profile
from groundstation.readers.source import Claim, Source

NAME = "murp"
PROFILE = Path(__file__).with_name("murp_pair.toml")
COLUMNS = (b"A_x", b"B_x", b"1_1", b"6_6")  # a file without them is not looked at further


def sniff(source: Source) -> Claim | None:
    """Claim a table with the columns of a pair."""
    head = source.head[:4096]
    if not all(name in head for name in COLUMNS):
        return None
    try:
        csv_profile.claim_by(source, PROFILE)
    except UnreadableLogError:
        return None
    return Claim(NAME)


def read(source: Source) -> Iterator[Item]:
    """Yield the header, batches, remarks and damage of a pair."""
    for item in csv_profile.read(source, PROFILE):
        yield replace(item, reader=NAME) if isinstance(item, LogHeader) else item
