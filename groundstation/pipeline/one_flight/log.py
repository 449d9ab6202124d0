"""Log of any kind that a user names: a recorded log, or an MCAP from groundstation."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import field, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

from groundstation.base.dataclasses import dataclass
from groundstation.base.errors import GroundstationError, UnreadableLogError
from groundstation.base.records import Item, RecordBatch
from groundstation.base.signals import BUS_PREFIX
from groundstation.pipeline.one_flight.identity import sha256_of
from groundstation.pipeline.one_flight.segments import Segment
from groundstation.results.flight import Source

if TYPE_CHECKING:
    from groundstation.readers.icd import Icd
    from groundstation.readers.source import Source as LogFile
    from groundstation.store.info import StoreInfo

NAMES_TOLD = 3  # of files that are one recording
REPLAY_LIMIT_BYTES = 96 << 20  # an hour of CSV at 100 Hz is kept; the peak of a conversion has this part in it


@dataclass(frozen=True)
class Log:
    """A log that a reader (or the store) claims.

    ``is_store``: an MCAP that groundstation wrote; its records carry corrected time already. ``icds`` are files or
    names of shipped ones; with ``has_new_names`` it is an MCAP whose bus words they name, and read as its log again.
    ``segment`` is the only one of the power-ups in it that is read; ``whole`` then gives the items of all, if they are
    kept. ``parts`` are the consecutive files that are read as one; its source has the digest of the first, and
    ``digests`` are those of all. ``file`` is what was asked for its reader.
    """

    path: Path
    source: Source
    is_store: bool
    profile: Path | None = None
    icds: tuple[str, ...] = ()
    has_new_names: bool = False
    segment: Segment | None = None
    whole: "Replay | None" = None
    parts: tuple[Path, ...] = ()
    digests: tuple[str, ...] = ()
    file: "LogFile | None" = field(default=None, repr=False, compare=False)

    def items(self) -> Iterator[Item]:
        """Read the log from its beginning, in bounded batches."""
        items = self._whole_items() if self.whole is None else iter(self.whole)
        if self.segment is None:
            return items
        return self.segment.of_store(items) if self.is_store else self.segment.of_log(items)

    def only(self, segment: Segment, whole: "Replay | None" = None) -> "Log":
        """Return the log as if it held only one of its power-ups."""
        return replace(self, segment=segment, whole=whole)

    def _whole_items(self) -> Iterator[Item]:
        if self.is_store:
            from groundstation.store.reader import read

            return read(self.path)
        if self.has_new_names:
            from groundstation.pipeline.one_flight.renamed import items_named

            return items_named(self.path, self.loaded_icds)
        from groundstation.readers.registry import read as read_log

        return read_log(self._file, self.profile, self.loaded_icds)

    def info(self) -> "StoreInfo":
        """Return facts of an MCAP, or of the one power-up in it that is read."""
        from groundstation.store.reader import read_info

        if self.segment is not None and self.segment.info is not None:
            return self.segment.info
        return read_info(self.path)

    def replay(self) -> "Replay":
        """Return the items for two passes; those of a large file are not kept."""
        is_small = self.source.size_bytes <= REPLAY_LIMIT_BYTES and self.whole is None
        return Replay(self.items, REPLAY_LIMIT_BYTES if is_small else 0)

    @cached_property
    def loaded_icds(self) -> "tuple[Icd, ...]":
        """The ICDs, read and checked."""
        if not self.icds:  # what reads them is not loaded for nothing
            return ()
        from groundstation.readers.icd import named_icd

        return tuple(named_icd(one) for one in self.icds)

    @cached_property
    def _file(self) -> "LogFile":
        """File as readers see it; a compressed one is decompressed once, however often it is read."""
        from groundstation.readers.source import Source as LogFile

        if not self.parts:
            return self.file or LogFile(self.path)
        from groundstation.readers.joined import JoinedSource

        return JoinedSource(self.path, tuple(map(LogFile, self.parts)))


def as_log(path: Path) -> Path:
    """Return the file by which a log is opened: the path itself, or a ROS 2 bag's metadata.

    The metadata for the folder of a bag.
    """
    from groundstation.readers.bags.kinds import is_bag_folder
    from groundstation.readers.bags.marks import METADATA

    return path / METADATA if path.is_dir() and is_bag_folder(path) else path


def log_name(path: Path) -> str:
    """Return the name of a log: that of its file, or of the folder that is a bag of ROS 2."""
    return path.resolve().parent.name if _is_metadata(path) else path.name


def digest_of(path: Path) -> str:
    """Return the SHA-256 of a log, over all its files."""
    return sha256_of(*_files_of(path))


def _files_of(path: Path) -> tuple[Path, ...]:
    """Return the files of a log, including files that are read along with it.

    A ROS 2 bag has its metadata and the files named there.
    """
    if _is_metadata(path):
        from groundstation.readers.bags.bag import files_of

        return (path, *(file for file in files_of(path) if file.is_file()))
    from groundstation.readers.sbet import accuracies_beside

    accuracies = accuracies_beside(path)
    return (path, accuracies) if accuracies is not None and accuracies.is_file() else (path,)


def _is_metadata(path: Path) -> bool:
    from groundstation.readers.bags.kinds import is_bag_folder
    from groundstation.readers.bags.marks import METADATA

    return path.name == METADATA and is_bag_folder(path.parent)


def open_log(path: Path, profile: Path | None = None, icds: tuple[str, ...] = ()) -> Log:
    """Find the reader of a file and open it.

    ``icds``, files or names, tell what the words of its buses mean.

    Raises
    ------
    UnreadableLogError
        When no reader claims it, or it is an MCAP of another program.
    """
    from groundstation.readers.registry import identify
    from groundstation.readers.source import Source as LogFile

    path = as_log(path)
    if not path.is_file():
        raise UnreadableLogError(str(path), "no regular file", "a recorded log")
    size = path.stat().st_size
    if _is_store(path, profile):
        from groundstation.store.reader import read_info

        info = read_info(path)  # the flight is that of the log, whichever of the two is run
        name, sha256 = info.source_name or path.name, info.source_sha256 or sha256_of(path)
        source = Source(name, sha256, size, f"groundstation-mcap of {info.reader}")
        is_renamed = bool(icds) and any(topic.startswith(BUS_PREFIX) for topic in info.ledger.topics)
        return Log(path, source, not is_renamed, profile, icds, has_new_names=is_renamed)
    file = LogFile(path)
    claim = identify(file, profile)
    size = sum(file.stat().st_size for file in _files_of(path))
    source = Source(log_name(path), digest_of(path), size, claim.title)
    return Log(path, source, False, profile, icds, file=file)


def open_one_of_several(path: Path, profile: Path | None = None, icds: tuple[str, ...] = ()) -> Log:
    """Open one of several logs, by the profile if it describes it, else as known.

    Raises as :func:`open_log`, of the profile.
    """
    try:
        return open_log(path, profile, icds)
    except UnreadableLogError:
        if profile is None:
            raise
        with suppress(UnreadableLogError):
            return open_log(path, None, icds)
        raise


def is_claimed(path: Path, profile: Path | None = None) -> bool:
    """Tell whether a reader, or the store, claims a file, by the profile or without it."""
    from groundstation.readers.registry import identify

    for one in dict.fromkeys((profile, None)):
        with suppress(UnreadableLogError):
            if not _is_store(as_log(path), one):
                identify(as_log(path), one)
            return True
    return False


def open_parts(paths: Sequence[Path], profile: Path | None = None, icds: tuple[str, ...] = ()) -> Log:
    """Find the reader of consecutive files of one recording and open them as one.

    The first file decides.

    Raises
    ------
    UnreadableLogError
        When no reader claims the first, or one of them is missing.
    """
    first = open_log(paths[0], profile, icds)
    if len(paths) == 1:
        return first
    if first.is_store or first.has_new_names or _is_metadata(first.path):
        raise UnreadableLogError(first.path.name, "no file that a recorder continues in another one", "a recorded log")
    try:
        digests = (first.source.sha256, *map(digest_of, paths[1:]))
        size = first.source.size_bytes + sum(path.stat().st_size for path in paths[1:])
    except OSError as error:
        raise UnreadableLogError(str(error.filename), error.strerror or "cannot be read", "a part of a log") from error
    source = replace(first.source, name=parts_name([path.name for path in paths]), size_bytes=size)
    return replace(first, source=source, parts=tuple(paths), digests=digests)


def parts_name(names: Sequence[str]) -> str:
    """Return the name of several files together.

    Examples
    --------
    >>> parts_name(["a.bin", "b.bin"]), parts_name(["1.csv", "2.csv", "3.csv", "4.csv"])
    ('a.bin + b.bin', '1.csv and 3 more')
    """
    return " + ".join(names) if len(names) <= NAMES_TOLD else f"{names[0]} and {len(names) - 1} more"


def _is_store(path: Path, profile: Path | None) -> bool:
    """Tell whether the store reads a file: an MCAP of ours.

    A log that has only a part of one spliced into it does not count.
    """
    from groundstation.readers.registry import identify
    from groundstation.store.recognition import is_groundstation_mcap, is_mostly_mcap

    if not is_groundstation_mcap(path):
        return False
    if is_mostly_mcap(path):
        return True
    try:
        identify(path, profile)
    except GroundstationError:
        return True
    return False


class Replay:
    """Items of a log that are needed twice.

    Small logs are kept in memory, large ones read again.

    Examples
    --------
    >>> from groundstation.base.records import Remark
    >>> replay = Replay(lambda: iter([Remark("a", "b")]))
    >>> [item.code for item in replay], [item.code for item in replay]
    (['a'], ['a'])
    """

    def __init__(self, read: Callable[[], Iterator[Item]], limit_bytes: int = REPLAY_LIMIT_BYTES) -> None:
        self._read = read
        self._limit_bytes = limit_bytes
        self._kept: list[Item] | None = None

    def __iter__(self) -> Iterator[Item]:
        if self._kept is not None:
            yield from self._kept
            return
        kept: list[Item] | None = []
        size = 0
        for item in self._read():
            size += _size_bytes(item)
            if size > self._limit_bytes:
                kept = None  # it is read again: the peak does not grow with the log
            if kept is not None:
                kept.append(item)
            yield item
        self._kept = kept


def _size_bytes(item: Item) -> int:
    if not isinstance(item, RecordBatch):
        return 200
    columns = (item.device_time_ns, *item.columns.values())
    present = sum(len(item) for column in columns if column.present is not None)
    return item.record_index.nbytes + present + sum(column.values.nbytes for column in columns)
