"""Write a store file.

Chunks go to a spool as they fill, and into the file in order of time when all are known.
"""

import glob
import os
import re
from collections import Counter, deque
from collections.abc import Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path
from threading import local
from types import TracebackType
from typing import Any, NamedTuple, Self

import mcap
import numpy as np
import zstandard
from mcap.opcode import Opcode
from mcap.records import (
    DataEnd,
    Footer,
    Header,
    McapRecord,
    Metadata,
    MetadataIndex,
    Statistics,
    SummaryOffset,
)
from numpy.typing import NDArray

from groundstation.base.errors import GroundstationError
from groundstation.base.records import RecordBatch
from groundstation.base.signals import is_canonical, kind_of
from groundstation.base.to_disk import sync_folder, sync_open
from groundstation.base.version import __version__
from groundstation.store.channel import ChannelWriter, Chunk, Pace, TopicWriter
from groundstation.store.decompress import crc32
from groundstation.store.derived import LOG_TOPIC, LocationFixWriter, LogWriter, Origin, PoseWriter
from groundstation.store.digested import DigestedFile
from groundstation.store.framing import ChunkPlace, chunk_head, chunk_indexes, message_index, to_bytes
from groundstation.store.info import COPY_NAME, StoreInfo
from groundstation.store.marks import MAGIC, METADATA_NAME, PACKAGE
from groundstation.store.spool import Kept, Spool

LIBRARY, MCAP_VERSION = f"groundstation {__version__}", mcap.__version__
# Higher levels save 4 to 7 % of recorded flights and read random mantissas a quarter slower: docs/decisions/007.
ZSTD_LEVEL = -1
COMPRESSING = min(2, os.cpu_count() or 1)  # threads that compress; the one that encodes waits for them when it is ahead
AT_ONCE_BYTES = 256 << 10  # chunks of so many bytes are handed to a thread together
MOST_ON_THEIR_WAY = 4  # such groups that wait for those threads
PART = ".part"  # end of the name of a file that is being written
MAX_CHANNELS = 65_535  # MCAP's channel ids have 16 bits


class _Packed(NamedTuple):
    """Compressed chunk of a topic and its message index, as they are written."""

    topic: str
    place: ChunkPlace
    parts: tuple[bytes, ...]


class _Kept(NamedTuple):
    """Compressed chunk of a topic in the spool."""

    topic: str
    place: ChunkPlace
    kept: Kept


class StoreWriter:
    """Writer of batches of corrected records into an MCAP file.

    The file appears under its name when the ``with`` block ends without an exception; until then its chunks are in
    memory, or, when there are many, in an unnamed temporary file of the same folder. Chunks stand in order of their
    first log time whatever the order in which topics were written; equal input gives equal bytes. Threads compress
    chunks while the next ones are encoded.

    Parameters
    ----------
    path : path-like
        File to write; replaced when it exists. When the block has ended it is on the disk, and attribute ``sha256``
        has its digest.
    info : StoreInfo
        Facts about the file. Attribute ``info`` may be replaced until the block ends, as the ledger often is complete
        only then; ``has_utc`` is taken at the start.

    Examples
    --------
    ::

        with StoreWriter("flight.mcap", StoreInfo(source_name="flight.csv")) as writer:
            for batch in batches:
                writer.write(batch)
    """

    def __init__(self, path: str | os.PathLike[str], info: StoreInfo) -> None:
        self.path = Path(path)
        self.info = info
        self.sha256 = ""
        self._has_utc = info.has_utc
        self._channels: dict[str, ChannelWriter] = {}
        self._derived_of: dict[str, ChannelWriter] = {}
        self._log = LogWriter(self._hand_over, self._has_utc)
        self._origin = Origin()
        self._pace = Pace()
        self._names: set[str] = set()
        self._compressors = local()  # one for each thread
        self._chunks: list[_Kept] = []
        self._spool: Spool | None = None
        self._threads = ThreadPoolExecutor(COMPRESSING, "store")
        self._gathered: list[Chunk] = []
        self._bytes = 0  # of those
        self._on_their_way: deque[Future[list[_Packed]]] = deque()

    def __enter__(self) -> Self:
        with self._failing_in_one_line():
            self._spool = Spool(self.path.parent)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        assert self._spool is not None
        part = self.path.with_name(f".{self.path.name}.{os.getpid()}{PART}")
        try:
            if kind is None:
                with self._failing_in_one_line():
                    for channel in self._channels.values():
                        channel.flush()
                    self._write_log()
                    self._settle()
                    with part.open("wb") as file:
                        told = DigestedFile(file, self._threads)
                        self._finish(told)
                        file.flush()
                        sync_open(file.fileno(), self.path)
                    part.replace(self.path)
                    sync_folder(self.path.parent)
                    self.sha256 = told.sha256
        finally:
            self._threads.shutdown(cancel_futures=True)
            self._spool.close()
            part.unlink(missing_ok=True)

    def write(self, batch: RecordBatch) -> None:
        """Take in a batch with ``time_ns`` set.

        Times of a topic never decrease from one batch to the next.

        Raises
        ------
        GroundstationError
            When times are missing, negative or decrease, a canonical topic has a column that is not of it, a column
            changes its type, or the disk is full.
        """
        if not len(batch):
            return
        with self._failing_in_one_line():
            for channel in self._channels_of(batch.topic):
                channel.write(batch)
            if kind_of(batch.topic) == "event":
                self._log.add_events(batch)

    def _channels_of(self, topic: str) -> Iterator[ChannelWriter]:
        if topic not in self._channels:
            if len(self._channels) + 3 > MAX_CHANNELS:  # room for its channel, one derived from it, and the log
                raise GroundstationError(str(self.path), "more topics than an MCAP file has channels")
            new_id = len(self._channels) + 1
            self._channels[topic] = TopicWriter(new_id, topic, self._name_for(topic), self._hand_over)
            self._channels[topic].pace = self._pace
            derived = self._derived(new_id + 1, topic)
            if derived is not None:
                derived.pace = self._pace
                self._channels[derived.topic] = derived
                self._derived_of[topic] = derived
        yield self._channels[topic]
        if topic in self._derived_of:
            yield self._derived_of[topic]

    def _derived(self, channel_id: int, topic: str) -> ChannelWriter | None:
        """Return the channel made from a topic for other programs; None without one."""
        kind = kind_of(topic)
        if kind == "gnss":
            return LocationFixWriter(channel_id, topic, self._hand_over, self._has_utc)
        if kind == "ins":
            return PoseWriter(channel_id, topic, self._hand_over, self._has_utc, self._origin)
        return None

    def _write_log(self) -> None:
        """Write findings and events as one channel, behind all others."""
        self._settle()
        ends = [(chunk.place.start_ns, chunk.place.end_ns) for chunk in self._chunks]
        if ends:
            first_ns, last_ns = min(start for start, _ in ends), max(end for _, end in ends)
            self._log.finish(len(self._channels) + 1, self.info.findings, first_ns, last_ns)
            self._channels[LOG_TOPIC] = self._log

    def _name_for(self, topic: str) -> str:
        """Return a unique full message name for a topic that is not canonical."""
        if is_canonical(topic):
            return ""
        words = [word for word in re.split(r"[^A-Za-z0-9]+", topic.removeprefix("raw.")) if word]
        base = name = f"{PACKAGE}.raw.R_{'_'.join(words)}"
        copy = 1
        while name.lower() in self._names:
            copy += 1
            name = f"{base}_{copy}"
        self._names.add(name.lower())
        return name

    def _hand_over(self, chunk: Chunk) -> None:
        """Take in a chunk; a thread compresses several together, as each handing over takes time.

        Waits while too many are on their way, and raises what went wrong with those.
        """
        self._gathered.append(chunk)
        self._bytes += chunk.nbytes
        if self._bytes >= AT_ONCE_BYTES:
            self._send()

    def _send(self) -> None:
        """Let a thread compress what is gathered."""
        self._on_their_way.append(self._threads.submit(self._compressed, self._gathered))
        self._gathered, self._bytes = [], 0
        self._wait_until_left(MOST_ON_THEIR_WAY)

    def _settle(self) -> None:
        """Wait until all chunks that were handed over are in the spool."""
        if self._gathered:
            self._send()
        self._wait_until_left(0)

    def _wait_until_left(self, count: int) -> None:
        """Keep the compressed chunks, in the order in which they were handed over."""
        assert self._spool is not None
        while len(self._on_their_way) > count:
            for chunk in self._on_their_way.popleft().result():
                self._chunks.append(_Kept(chunk.topic, chunk.place, self._spool.put(chunk.parts)))

    def _compressed(self, chunks: Sequence[Chunk]) -> list[_Packed]:
        """Compress chunks; in one of the threads."""
        if not hasattr(self._compressors, "own"):
            self._compressors.own = zstandard.ZstdCompressor(level=ZSTD_LEVEL)
        return [_packed(chunk, self._compressors.own) for chunk in chunks]

    def _finish(self, file: DigestedFile) -> None:
        """Write the whole file: definitions, chunks, facts again, summary."""
        definitions = [channel.definition(self.info.metadata) for channel in self._channels.values() if channel.count]
        schemas: list[McapRecord] = [schema for schema, _ in definitions]
        channels: list[McapRecord] = [channel for _, channel in definitions]
        checksums = {f"schema {schema.id}": crc32(to_bytes(schema)) for schema, _ in definitions}
        checksums |= {f"channel {channel.id}": crc32(to_bytes(channel)) for _, channel in definitions}
        strings = self.info.to_strings(checksums)
        facts, copy = (to_bytes(Metadata(name, strings)) for name in (METADATA_NAME, COPY_NAME))
        file.write(MAGIC + to_bytes(Header(profile="", library=LIBRARY)))
        places = [MetadataIndex(offset=file.tell(), length=len(facts), name=METADATA_NAME)]
        file.write(facts + to_bytes(*schemas, *channels))
        again = {channel.id: to_bytes(schema, channel) for schema, channel in definitions}
        count = Counter[int]()
        assert self._spool is not None
        written: list[ChunkPlace] = []
        for chunk in sorted(self._chunks, key=_order):
            written.append(chunk.place._replace(at=file.tell()))
            file.write(self._spool.get(chunk.kept))
            channel_id = chunk.place.channel_id
            count[channel_id] += 1
            if count[channel_id].bit_count() == 1:  # after chunks 1, 2, 4, 8 ..., in case those at both ends are lost
                file.write(again[channel_id])
        places.append(MetadataIndex(offset=file.tell(), length=len(copy), name=COPY_NAME))
        file.write(copy + to_bytes(DataEnd(0)))
        groups = [
            (Opcode.SCHEMA, to_bytes(*schemas)),
            (Opcode.CHANNEL, to_bytes(*channels)),
            (Opcode.STATISTICS, to_bytes(self._statistics(len(schemas), written))),
            (Opcode.CHUNK_INDEX, chunk_indexes(written)),
            (Opcode.METADATA_INDEX, to_bytes(*places)),
        ]
        file.write(_summary(groups, file.tell()) + MAGIC)

    def _statistics(self, schema_count: int, written: Sequence[ChunkPlace]) -> Statistics:
        counts = {channel.id: channel.count for channel in self._channels.values() if channel.count}
        return Statistics(
            attachment_count=0,
            channel_count=len(counts),
            channel_message_counts=counts,
            chunk_count=len(written),
            message_count=sum(counts.values()),
            message_start_time=min((chunk.start_ns for chunk in written), default=0),
            message_end_time=max((chunk.end_ns for chunk in written), default=0),
            metadata_count=2,
            schema_count=schema_count,
        )

    @contextmanager
    def _failing_in_one_line(self) -> Iterator[None]:
        try:
            yield
        except OSError as error:
            reason = error.strerror or type(error).__name__
            raise GroundstationError(str(self.path), f"cannot be written ({reason})") from error


def clear_parts(path: Path) -> None:
    """Remove the partial files of processes that died while they wrote a file."""
    for part in path.parent.glob(f".{glob.escape(path.name)}.*{PART}"):
        number = part.name.removesuffix(PART).rpartition(".")[2]
        if number.isdecimal() and not _is_alive(int(number)):
            part.unlink(missing_ok=True)


def _is_alive(process: int) -> bool:
    if os.name != "posix":  # signal 0 means something else there
        return True
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except OSError:
        return True
    return True


def _packed(chunk: Chunk, compressor: zstandard.ZstdCompressor) -> _Packed:
    """Return a chunk compressed, with its message index."""
    buffer, log_time, starts = (_joined(parts) for parts in (chunk.buffers, chunk.log_times, chunk.starts))
    start, end = int(log_time[0]), int(log_time[-1])
    raw = buffer.data
    data: bytes = compressor.compress(raw)
    head = chunk_head(start, end, len(raw), crc32(raw), len(data))
    messages = message_index(chunk.channel_id, log_time, starts)
    sizes = len(head) + len(data), len(messages), len(data), len(raw)
    return _Packed(chunk.topic, ChunkPlace(chunk.channel_id, start, end, *sizes), (head, data, messages))


def _joined(parts: Sequence[NDArray[Any]]) -> NDArray[Any]:
    return parts[0] if len(parts) == 1 else np.concatenate(parts)


def _order(chunk: _Kept) -> tuple[int, str]:
    """Sort chunks by first log time, then by topic; others stay as they came."""
    return chunk.place.start_ns, chunk.topic


def _summary(groups: Sequence[tuple[Opcode, bytes]], start: int) -> bytes:
    """Return the summary section with its offsets and the footer, which has the checksum."""
    body, offsets = b"", []
    for opcode, data in groups:
        if data:
            offsets.append(SummaryOffset(group_opcode=opcode, group_start=start + len(body), group_length=len(data)))
        body += data
    offset_start = start + len(body)
    body += to_bytes(*offsets)
    footer = to_bytes(Footer(summary_start=start, summary_offset_start=offset_start, summary_crc=0))
    crc = crc32(footer[:-4], crc32(body))
    return body + footer[:-4] + crc.to_bytes(4, "little")
