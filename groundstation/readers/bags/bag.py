"""Log of messages as one: a single file, or the files that a ROS 2 bag was split into."""

from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import TypeAlias

from groundstation.base.dataclasses import dataclass
from groundstation.base.errors import GroundstationError
from groundstation.base.records import Damage
from groundstation.readers.bags.marks import MCAP_MAGIC, METADATA, METADATA_BEGINS, ROS1_MAGIC, SQLITE_MAGIC
from groundstation.readers.bags.mcap import Mcap
from groundstation.readers.bags.messages import Connection, ConnectionBlock, Missing, Part, counted_by
from groundstation.readers.bags.ros1 import Ros1Bag
from groundstation.readers.bags.ros1_records import has_chunk
from groundstation.readers.bags.rosbag2_metadata import BagMetadata
from groundstation.readers.bags.sources import Key, key_of
from groundstation.readers.bags.sqlite import Ros2Sqlite
from groundstation.readers.bags.work import most_messages
from groundstation.readers.joined import JoinedSource
from groundstation.readers.source import Source

KEPT_BYTES, MESSAGE_BYTES = 64 << 20, 64  # messages kept for the second pass; what each adds to its own
MOST_METADATA_BYTES = 16 << 20
_ENDINGS = ("", ".zstd")  # rosbag2 names a file it compressed later without the ending
Item: TypeAlias = ConnectionBlock | Damage
_CONTAINERS: Mapping[bytes, Callable[[Source], Iterable[Part]]] = {
    MCAP_MAGIC: Mcap,
    ROS1_MAGIC: Ros1Bag,
    SQLITE_MAGIC: Ros2Sqlite,
}


def files_of(metadata: Path) -> tuple[Path, ...]:
    """Files of a bag in their order, as its metadata names them.

    Names outside the folder of the metadata are left out.
    """
    names = _account_of(metadata).files
    files = []
    for name in names:
        plain = Path(name)
        if plain.is_absolute() or ".." in plain.parts:
            continue
        known = [metadata.parent / f"{plain}{ending}" for ending in _ENDINGS]
        known += [metadata.parent / f"{plain.name}{ending}" for ending in _ENDINGS]  # old bags begin with the folder
        files.append(next((path for path in known if path.is_file()), known[0]))
    return tuple(files)


def _account_of(metadata: Path) -> BagMetadata:
    with metadata.open("rb") as stream:
        return BagMetadata.of(stream.read(MOST_METADATA_BYTES).decode("utf-8", "replace"))


@dataclass
class Bag:
    """Iterable over the messages of a log.

    It may be iterated over again, then from memory where the messages are few.

    Parameters
    ----------
    source : Source
    """

    source: Source
    _kept: list[Item] | None = None

    def files(self) -> tuple[Source, ...]:
        """The files that hold messages."""
        if isinstance(self.source, JoinedSource):
            return self.source.files
        if not self._is_folder:
            return (self.source,)
        return tuple(Source(path) for path in files_of(self.source.path))

    @property
    def _is_folder(self) -> bool:
        return self.source.head.lstrip().startswith(METADATA_BEGINS)

    @cached_property
    def size(self) -> int:
        """Bytes of all files of the bag that are present."""
        size = 0
        for file in self.files():
            try:
                size += file.size
            except GroundstationError:  # told when it is read
                continue
        return size

    def __iter__(self) -> Iterator[Item]:
        if self._kept is not None:
            yield from self._kept
            return
        kept: list[Item] | None = []
        size, last_buffer = 0, None
        for part in self._read():
            if kept is not None and isinstance(part, ConnectionBlock):
                size += MESSAGE_BYTES * len(part) + (0 if part.buffer is last_buffer else len(part.buffer))
                last_buffer = part.buffer
            if kept is not None:
                kept.append(part)
            if size > KEPT_BYTES:
                kept = last_buffer = None  # it is read again: memory does not grow with the log
            yield part
        self._kept = kept

    def _read(self) -> Iterator[Item]:
        """Yield messages and damage, then what the bag's metadata counts beyond them."""
        account = _account_of(self.source.path).messages if self._is_folder else {}
        told: Counter[str] = Counter()
        count, most = 0, most_messages(self.size)
        for part in self._of_files():
            if isinstance(part, ConnectionBlock):
                told[part.connection.topic] += len(part)
                count += len(part)
                yield part
                if count > most:
                    what = f"log of more than {most} messages, which no file of its size holds: the rest is not read"
                    yield Damage("corrupt", "the whole log", 1, what)
                    return
            elif isinstance(part, Missing):
                told[part.topic] += part.count
                yield part.damage()
            else:
                yield part
        for topic, count in account.items():
            if count > told[topic]:
                yield Missing(topic, count - told[topic], counted_by(f"{METADATA} of the bag")).damage()

    def _of_files(self) -> Iterator[Part]:
        known: dict[tuple[Key, str, int], Connection] = {}
        files = self.files()
        first = 0
        for file in files:
            behind = first
            try:
                for part in _parts(file):
                    if isinstance(part, Missing):
                        yield part
                        continue
                    if isinstance(part, Damage):
                        yield part if len(files) == 1 else replace(part, place=f"{file.name}, {part.place}")
                        continue
                    one = part.connection
                    key = key_of(one), one.publisher, one.number  # a part of a split bag goes on with its connections
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
    for magic, container in _CONTAINERS.items():
        if file.head.startswith(magic):
            yield from container(file)
            return
    if has_chunk(file.head):
        yield from Ros1Bag(file)
        return
    yield Damage("corrupt", file.name, 1, "file of the bag that is none")
