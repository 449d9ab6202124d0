"""A log of messages as one: a single file, or the files that a bag of ROS 2 was split into."""

import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from groundstation.base.errors import GroundstationError
from groundstation.base.records import Damage
from groundstation.readers.bags.mcap import MAGIC as MCAP_MAGIC
from groundstation.readers.bags.mcap import Mcap
from groundstation.readers.bags.messages import Block, Connection, Part
from groundstation.readers.bags.ros1 import MAGIC as ROS1_MAGIC
from groundstation.readers.bags.ros1 import Ros1Bag, has_chunk
from groundstation.readers.bags.sqlite import MAGIC as SQLITE_MAGIC
from groundstation.readers.bags.sqlite import Ros2Sqlite
from groundstation.readers.joined import JoinedSource
from groundstation.readers.source import Source

METADATA = "metadata.yaml"
METADATA_MARK = b"rosbag2_bagfile_information:"
KEPT_BYTES, MESSAGE_BYTES = 64 << 20, 64  # of messages kept for the second pass; beside its own, of each
_ENDINGS = ("", ".zstd")  # rosbag2 names a file it compressed later without the ending
_CONTAINERS: Mapping[bytes, tuple[str, Callable[[Source], Iterable[Part]]]] = {
    MCAP_MAGIC: ("MCAP", Mcap),
    ROS1_MAGIC: ("ROS 1", Ros1Bag),
    SQLITE_MAGIC: ("ROS 2", Ros2Sqlite),
}
_TABLES = (b"CREATE TABLE topics", b"CREATE TABLE messages")  # in the head of an sqlite3 file that is a bag


def kind_of(source: Source) -> str:
    """What kind of bag a file is, by its first bytes; empty for none."""
    if source.head.lstrip().startswith(METADATA_MARK):
        return "ROS 2"
    if source.head.startswith(SQLITE_MAGIC):
        return "ROS 2" if all(table in source.head for table in _TABLES) else ""
    kind = next((name for magic, (name, _container) in _CONTAINERS.items() if source.head.startswith(magic)), "")
    if not kind and has_chunk(source.head):
        return "ROS 1"
    return "" if kind == "MCAP" and _is_ours(source) else kind


def is_begun(source: Source) -> bool:
    """Whether a file has the first bytes of a bag, or is the metadata of one."""
    return source.head.lstrip().startswith(METADATA_MARK) or source.head.startswith(tuple(_CONTAINERS))


def _is_ours(source: Source) -> bool:
    """Whether groundstation wrote an MCAP: the store reads it."""
    from groundstation.store.recognition import is_groundstation_mcap

    return is_groundstation_mcap(source.head) or is_groundstation_mcap(source.path)  # the second: by what is left of it


def is_bag_folder(folder: Path) -> bool:
    """Whether a folder is a bag of ROS 2: rosbag2 lays its metadata into it."""
    try:
        with (folder / METADATA).open("rb") as stream:
            return stream.read(4096).lstrip().startswith(METADATA_MARK)
    except OSError:
        return False


def files_of(metadata: Path) -> tuple[Path, ...]:
    """Files of a bag in their order, as its metadata names them.

    Names outside the folder of the metadata are left out.
    """
    text = metadata.read_text(encoding="utf-8", errors="replace")
    found = re.search(r"^\s*relative_file_paths:\s*\n((?:\s*-\s*.+\n?)+)", text, re.MULTILINE)
    names = re.findall(r"^\s*-\s*(.+?)\s*$", found.group(1), re.MULTILINE) if found else []
    files = []
    for name in names:
        plain = Path(name.strip("'\""))
        if plain.is_absolute() or ".." in plain.parts:
            continue
        known = [metadata.parent / f"{plain}{ending}" for ending in _ENDINGS]
        known += [metadata.parent / f"{plain.name}{ending}" for ending in _ENDINGS]  # old bags begin with the folder
        files.append(next((path for path in known if path.is_file()), known[0]))
    return tuple(files)


@dataclass
class Bag:
    """Iterates over the messages of a log; may be iterated over again, then from memory where they are few.

    Parameters
    ----------
    source : Source
    """

    source: Source
    _kept: list[Part] | None = None

    def files(self) -> tuple[Source, ...]:
        """The files that hold messages."""
        if isinstance(self.source, JoinedSource):
            return self.source.files
        if not self.source.head.lstrip().startswith(METADATA_MARK):
            return (self.source,)
        return tuple(Source(path) for path in files_of(self.source.path))

    def __iter__(self) -> Iterator[Part]:
        if self._kept is not None:
            yield from self._kept
            return
        kept: list[Part] | None = []
        size, last_buffer = 0, None
        for part in self._read():
            if kept is not None and isinstance(part, Block):
                size += MESSAGE_BYTES * len(part) + (0 if part.buffer is last_buffer else len(part.buffer))
                last_buffer = part.buffer
            if kept is not None:
                kept.append(part)
            if size > KEPT_BYTES:
                kept = last_buffer = None  # it is read again: memory does not grow with the log
            yield part
        self._kept = kept

    def _read(self) -> Iterator[Part]:
        known: dict[tuple[str, str, str, bytes], Connection] = {}
        files = self.files()
        first = 0
        for file in files:
            behind = first
            try:
                for part in _parts(file):
                    if isinstance(part, Damage):
                        yield part if len(files) == 1 else replace(part, place=f"{file.name}, {part.place}")
                        continue
                    one = part.connection
                    key = one.topic, one.type, one.encoding, one.schema
                    connection = known.setdefault(key, replace(one, number=len(known)))
                    yield replace(part, connection=connection, record_index=part.record_index + first)
                    behind = max(behind, first + int(part.record_index[-1]) + 1)
                if len(files) > 1:
                    yield from file.damages()
            except GroundstationError as error:
                if len(files) == 1:
                    raise
                yield Damage("dropped_channel", file.name, 1, f"file of the bag that cannot be read ({error})")
            first = behind


def _parts(file: Source) -> Iterator[Part]:
    for magic, (_name, container) in _CONTAINERS.items():
        if file.head.startswith(magic):
            yield from container(file)
            return
    if has_chunk(file.head):
        yield from Ros1Bag(file)
        return
    yield Damage("corrupt", file.name, 1, "file of the bag that is none")
