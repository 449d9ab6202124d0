"""Airliner flight data in HDF5 (FlightDataAnalyzer): every parameter, canonical ones too.

The canonical parameters are in their units.
"""

from collections.abc import Iterator

from groundstation.base.records import Item
from groundstation.readers.source import Claim, Source

NAME = "flightdata-hdf5"
_MAGIC = b"\x89HDF\r\n\x1a\n"
_MARKS = (b"series", b"supf_offset")


def sniff(source: Source) -> Claim | None:
    """Claim an HDF5 file by a group or attribute name in its first bytes.

    Only these recordings have it.
    """
    if not source.head.startswith(_MAGIC) or not any(mark in source.head for mark in _MARKS):
        return None
    return Claim(NAME)


def read(source: Source) -> Iterator[Item]:
    """Yield the header, batches, remarks and damage of a recording.

    Raises
    ------
    UnreadableLogError
        When the container cannot be opened, or holds no parameter that can be read.
    """
    from groundstation.readers.flightdata_hdf5.reader import items

    return items(source, NAME)
