"""Bags of ROS 2 in sqlite3 (.db3). A file that was cut or has damaged pages gives the rows that sqlite still finds.

Source: rosbag2_storage_sqlite3 (schema versions 1 to 4).
"""

import sqlite3
import tempfile
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import zstandard

from groundstation.base.errors import UnreadableLogError
from groundstation.base.records import Damage
from groundstation.readers.bags.definitions import plain_name
from groundstation.readers.bags.messages import Block, Connection, Part
from groundstation.readers.source import Source

MAGIC = b"SQLite format 3\0"
ROWS, BLOCK_BYTES = 2_000, 32 << 20  # taken at once, at most
STEPS, LOOKS = 1_000, 2_000  # of sqlite's machine between two looks, and looks at most: damaged pages lead in circles
MAX_MESSAGE_BYTES = 64 << 20
_ZSTD = b"\x28\xb5\x2f\xfd"
_COPY_BYTES = 1 << 20
_FAILURES = (sqlite3.Error, OverflowError, UnicodeDecodeError, MemoryError)  # of lengths that are none, too


class Ros2Sqlite:
    """Iterates over the messages of a .db3.

    Parameters
    ----------
    source : Source
    """

    def __init__(self, source: Source) -> None:
        self._source = source
        self._count = 0

    def __iter__(self) -> Iterator[Part]:
        with _connected(self._source) as database:
            try:
                connections = _connections(database)
            except _FAILURES as error:
                raise UnreadableLogError(self._source.name, f"no topics of a ROS 2 bag ({error})") from error
            yield from self._messages(database, connections)

    def _messages(self, database: sqlite3.Connection, connections: dict[int, Connection]) -> Iterator[Part]:
        last, unknown, lost_at, jump = -1, 0, "", 1
        try:
            newest = int(_bounded(database).execute("SELECT max(id) FROM messages").fetchone()[0] or 0)
        except (*_FAILURES, TypeError, ValueError):
            newest = 0
        failures = missing = 0
        while True:
            rows, failure = _next_rows(database, last)
            if rows:
                unknown += sum(row[1] not in connections for row in rows)
                yield from self._blocks([row for row in rows if row[1] in connections], connections)
                missing += rows[-1][0] - max(last, 0) - len(rows)
                last, jump = rows[-1][0], 1
            if failure:
                lost_at = lost_at or f"behind message {last}"
                failures += 1
                last, jump = last + jump, jump * 2  # past the page that cannot be read
                if last >= max(newest, 0) or failures > 200:
                    break
            elif not rows:
                break
        if lost_at:
            yield Damage(
                "truncated" if last >= newest else "corrupt", lost_at, 1, "stretch of the database that cannot be read"
            )
        if missing > 0:
            what = "messages that are missing from the numbering"
            yield Damage("dropped_rows", "the whole log", missing, what, loses_data=bool(lost_at))
        if unknown:
            yield Damage("dropped_channel", "the whole log", unknown, "messages of a topic that is not in the file")

    def _blocks(self, rows: list[Any], connections: dict[int, Connection]) -> Iterator[Block]:
        """Rows of one stretch by topic."""
        numbers = np.array([row[1] for row in rows], dtype=np.int64)
        index = np.arange(self._count, self._count + len(rows), dtype=np.int64)
        self._count += len(rows)
        for number in np.unique(numbers).tolist():
            which = np.flatnonzero(numbers == number)
            payloads = [_payload(rows[at][3]) for at in which.tolist()]
            sizes = np.array([len(one) for one in payloads], dtype=np.int64)
            times = np.array([rows[at][2] for at in which.tolist()], dtype=np.int64)
            buffer = np.frombuffer(b"".join(payloads), np.uint8)
            starts = np.cumsum(sizes) - sizes
            yield Block(connections[number], buffer, starts, sizes, times, times, index[which])


def _payload(data: Any) -> bytes:
    """Bytes of a message, decompressed where the bag compresses its messages."""
    content = data if isinstance(data, bytes) else b""
    if not content.startswith(_ZSTD):
        return content
    try:
        return zstandard.ZstdDecompressor().decompress(content, max_output_size=MAX_MESSAGE_BYTES)
    except zstandard.ZstdError:
        return content


def _next_rows(database: sqlite3.Connection, last: int) -> tuple[list[Any], bool]:
    """The rows behind message ``last``, and whether reading failed behind them, or what is there is not in order."""
    query = "SELECT id, topic_id, timestamp, data FROM messages WHERE id > ? AND {} ORDER BY id LIMIT ?"
    query = query.format(" AND ".join(f"typeof({name}) = 'integer'" for name in ("id", "topic_id", "timestamp")))
    rows: list[Any] = []
    size = 0
    try:
        for row in _bounded(database).execute(query, (last, ROWS)):
            if row[0] <= last:
                return rows, True
            rows.append(row)
            last, size = row[0], size + (len(row[3]) if isinstance(row[3], bytes) else 0)
            if size > BLOCK_BYTES:
                break
    except _FAILURES:
        return rows, True
    return rows, False


def _bounded(database: sqlite3.Connection) -> sqlite3.Connection:
    """The database, in which the next query ends after a bounded number of steps."""
    looks = iter(range(LOOKS))
    database.set_progress_handler(lambda: next(looks, None) is None, STEPS)
    return database


def _connections(database: sqlite3.Connection) -> dict[int, Connection]:
    topics = _bounded(database).execute("SELECT id, name, type, serialization_format FROM topics").fetchall()
    try:
        found = _bounded(database).execute(
            "SELECT topic_type, encoding, encoded_message_definition FROM message_definitions"
        )
        schemas = {str(row[0]): (str(row[1]), str(row[2]).encode()) for row in found.fetchall()}
    except _FAILURES:
        schemas = {}  # before schema version 4
    connections = {}
    sound = [row for row in topics if isinstance(row[0], int)]  # messages of the others are counted as of no topic
    for number, (key, topic, kind, encoding) in enumerate(sound):
        form, text = schemas.get(str(kind), ("", b""))
        connections[key] = Connection(number, str(topic), plain_name(str(kind)), str(encoding), form, text)
    return connections


@contextmanager
def _connected(source: Source) -> Iterator[sqlite3.Connection]:
    """The database, read only; a compressed one is laid beside in a file for the time."""
    if not source.compression:
        with closing(_open(source.path, source.name)) as database:
            yield database
        return
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "bag.db3"
        with source.open() as stream, path.open("wb") as target:
            while piece := stream.read(_COPY_BYTES):
                target.write(piece)
        with closing(_open(path, source.name)) as database:
            yield database


def _open(path: Path, name: str) -> sqlite3.Connection:
    try:
        size = path.stat().st_size
        database = sqlite3.connect(f"{path.resolve().as_uri()}?mode=ro&immutable=1", uri=True)
        database.setlimit(sqlite3.SQLITE_LIMIT_LENGTH, min(max(size, 1 << 20), 1 << 30))  # no value exceeds its file
        database.execute("PRAGMA writable_schema=ON")  # else a file shorter than its header says is refused
        database.text_factory = lambda text: text.decode("utf-8", "replace")
    except _FAILURES as error:
        raise UnreadableLogError(name, f"no database that sqlite opens ({error})") from error
    return database
