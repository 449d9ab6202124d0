"""Kinds of bags, by the first bytes of a file or the metadata of a folder.

Every log is asked for them: what reads the bags is loaded where there is one.
"""

import re
from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType

from groundstation.readers.bags.marks import MCAP_MAGIC, METADATA, METADATA_BEGINS, ROS1_MAGIC, SQLITE_MAGIC
from groundstation.readers.source import Source

_KINDS: Mapping[bytes, str] = MappingProxyType({MCAP_MAGIC: "MCAP", ROS1_MAGIC: "ROS 1", SQLITE_MAGIC: "ROS 2"})
_OP = b"\x04\0\0\0op="  # a field that every record of a ROS 1 bag has
# In the head of an sqlite3 file that is a bag; a table that was renamed has its name in quotes.
_TABLE = rb"(?i)CREATE TABLE (IF NOT EXISTS )?[\"'`\[]?"


def kind_of(source: Source) -> str:
    """Return the kind of bag that a file is, by its first bytes; empty for none."""
    if source.head.lstrip().startswith(METADATA_BEGINS):
        return "ROS 2"
    if source.head.startswith(SQLITE_MAGIC):
        return "ROS 2" if all(re.search(_TABLE + name, source.head) for name in (b"topics", b"messages")) else ""
    kind = next((name for magic, name in _KINDS.items() if source.head.startswith(magic)), "")
    if not kind and _has_chunk(source.head):
        return "ROS 1"
    return "" if kind == "MCAP" and _is_ours(source) else kind


def is_begun(source: Source) -> bool:
    """Tell whether a file has the first bytes of a bag, or is the metadata of one."""
    return source.head.lstrip().startswith(METADATA_BEGINS) or source.head.startswith(tuple(_KINDS))


def is_bag_folder(folder: Path) -> bool:
    """Tell whether a folder is a bag of ROS 2: rosbag2 puts its metadata there."""
    try:
        with (folder / METADATA).open("rb") as stream:
            return stream.read(4096).lstrip().startswith(METADATA_BEGINS)
    except OSError:
        return False


def _has_chunk(head: bytes) -> bool:
    if _OP not in head:
        return False
    from groundstation.readers.bags.ros1_records import has_chunk

    return has_chunk(head)


def _is_ours(source: Source) -> bool:
    """Tell whether groundstation wrote an MCAP: then the store reads it."""
    from groundstation.store.recognition import is_groundstation_mcap

    return is_groundstation_mcap(source.head) or is_groundstation_mcap(source.path)  # the second: by what is left of it
