"""Bags of ROS 2 in sqlite3 (.db3).

A file that was cut or has damaged pages gives the rows that sqlite still finds. A database is a program as well: views,
triggers, generated columns and virtual tables compute what they give. Only plain tables are read, sqlite may do nothing
else (its authorizer sees to it), and the steps of its machine and the bytes that come out are bounded by the size of
the file.

Source: rosbag2_storage_sqlite3 (schema versions 1 to 4).
"""

import sqlite3
import tempfile
from collections.abc import Iterator
from contextlib import closing, contextmanager
from dataclasses import field
from pathlib import Path
from typing import Any

import numpy as np
import zstandard

from groundstation.base.dataclasses import dataclass
from groundstation.base.errors import UnreadableLogError
from groundstation.base.records import Damage
from groundstation.readers.bags.definitions import plain_name
from groundstation.readers.bags.messages import Connection, ConnectionBlock, Missing, Part, counted_by
from groundstation.readers.bags.rosbag2_metadata import BagMetadata
from groundstation.readers.compressed import MAX_RATIO, MIN_LIMIT_BYTES
from groundstation.readers.source import Source

TOPICS, MESSAGES, DEFINITIONS, METADATA = "topics", "messages", "message_definitions", "metadata"
ROWS, BLOCK_BYTES = 2_000, 32 << 20  # taken at once, at most
STEPS, LOOKS = (
    1_000,
    4_000,
)  # machine steps of sqlite between two looks, and looks at most; plus two for each kB of the file
MOST_TOPICS = 10_000
MOST_FAILURES = 200  # failures of reading, each at another place of the table
MAX_MESSAGE_BYTES = 64 << 20
_ZSTD = b"\x28\xb5\x2f\xfd"
_COPY_BYTES = 1 << 20
_FAILURES = (sqlite3.Error, OverflowError, UnicodeDecodeError, MemoryError)  # impossible lengths raise some of them
_READABLE = frozenset({TOPICS, MESSAGES, DEFINITIONS, METADATA, "sqlite_master", "sqlite_schema"})


class Ros2Sqlite:
    """Iterable over the messages of a .db3.

    Parameters
    ----------
    source : Source
    """

    def __init__(self, source: Source) -> None:
        self._source = source
        self._met: dict[str, int] = {}
        self._count = self._odd = self._unknown = 0
        self._expanded = 0

    def __iter__(self) -> Iterator[Part]:
        with _connected(self._source) as database:
            database.refuse_programs()
            try:
                connections = _connections(database)
            except _FAILURES as error:
                raise UnreadableLogError(self._source.name, f"no topics of a ROS 2 bag ({error})") from error
            yield from self._messages(database, connections)
            yield from self._missing(database, {one.topic for one in connections.values()})

    def _messages(self, database: "_Database", connections: dict[int, Connection]) -> Iterator[Part]:
        last, missing, lost_at, jump, failures, is_cut = -(2**63), 0, "", 1, 0, False
        newest = database.newest()
        while True:
            rows, failure = database.next_rows(last)
            if rows:
                yield from self._blocks(rows, connections)
                numbers = [row[1] for row in rows if type(row[1]) is int]
                missing += max(numbers[-1] - max(last, 0) - len(numbers), 0) if numbers else 0
                last, jump, is_cut = max(row[0] for row in rows), 1, False
            if failure:
                lost_at = lost_at or f"behind message {max(last, 0)}"
                failures, is_cut = failures + 1, True
                last, jump = max(last, 0) + jump, jump * 2  # past the page that cannot be read
                if last >= max(newest, 0) or failures > MOST_FAILURES or database.is_spent:
                    break
            elif not rows:
                break
        if database.is_spent:
            what = "database that gives more than its file can hold: the rest is not read"
            yield Damage("corrupt", lost_at or "the whole log", 1, what)
        elif lost_at:
            what = "stretch of the database that cannot be read"
            yield Damage("truncated" if is_cut else "corrupt", lost_at, 1, what)
        if missing > 0 and not database.metadata.messages:
            what = "messages that are missing from the numbering"
            yield Damage("dropped_rows", "the whole log", missing, what, loses_data=bool(lost_at))
        if self._odd:
            what = "rows of messages whose number, topic or time is no integer"
            yield Damage("corrupt", "the whole log", self._odd, what)
        if self._unknown:
            what = "messages of a topic that is not in the file"
            yield Damage("dropped_channel", "the whole log", self._unknown, what)

    def _missing(self, database: "_Database", topics: set[str]) -> Iterator[Missing]:
        """Yield the messages that the bag's own account counts and that were not met."""
        gone = {name: count - self._met.get(name, 0) for name, count in database.metadata.messages.items()}
        gone = {name: count for name, count in gone.items() if count > 0 and name in topics}
        if sum(gone.values()) > self._odd + self._unknown:  # otherwise the missing ones are those
            for name, count in gone.items():
                yield Missing(name, count, counted_by("metadata in the database"))

    def _blocks(self, rows: list[Any], connections: dict[int, Connection]) -> Iterator[ConnectionBlock]:
        """Yield the rows of one stretch by topic."""
        sound = [row for row in rows if type(row[1]) is type(row[2]) is type(row[3]) is int]
        self._odd += len(rows) - len(sound)
        known = [row for row in sound if row[2] in connections]
        self._unknown += len(sound) - len(known)
        numbers = np.array([row[2] for row in known], dtype=np.int64)
        index = np.arange(self._count, self._count + len(known), dtype=np.int64)
        self._count += len(known)
        for number in np.unique(numbers).tolist():
            which = np.flatnonzero(numbers == number)
            payloads = [self._payload(known[at][4]) for at in which.tolist()]
            sizes = np.array([len(one) for one in payloads], dtype=np.int64)
            times = np.array([known[at][3] for at in which.tolist()], dtype=np.int64)
            buffer = np.frombuffer(b"".join(payloads), np.uint8)
            starts = np.cumsum(sizes) - sizes
            topic = connections[number].topic
            self._met[topic] = self._met.get(topic, 0) + len(which)
            yield ConnectionBlock(connections[number], buffer, starts, sizes, times, times, index[which])

    def _payload(self, data: Any) -> bytes:
        """Return the bytes of a message, decompressed where the bag compresses them."""
        content = data if isinstance(data, bytes) else b""
        if not content.startswith(_ZSTD):
            return content
        limit = min(MAX_MESSAGE_BYTES, max(MIN_LIMIT_BYTES, MAX_RATIO * self._source.size) - self._expanded)
        try:
            claimed = zstandard.get_frame_parameters(content).content_size  # the library allocates by it
            if claimed != zstandard.CONTENTSIZE_UNKNOWN and claimed > limit:
                return content
            expanded = zstandard.ZstdDecompressor().decompress(content, max_output_size=max(limit, 1))
        except zstandard.ZstdError:
            return content
        self._expanded += len(expanded)
        return expanded


@dataclass
class _Database:
    """Untrusted database whose tables are read within bounds.

    Attributes
    ----------
    name : str
        Of the file, for messages.
    looks, bytes : int
        What sqlite may still do, and how many bytes of messages it may still give.
    metadata : BagMetadata
        What rosbag2 says in it about itself.
    """

    connection: sqlite3.Connection
    name: str
    looks: int
    bytes: int
    has_rowid: bool = True
    metadata: BagMetadata = field(default_factory=BagMetadata)
    _stream: Iterator[Any] | None = None

    @property
    def is_spent(self) -> bool:
        """Tell whether the database gave or did more than its file can hold."""
        return self.looks <= 0 or self.bytes <= 0

    def execute(self, query: str, *values: Any) -> sqlite3.Cursor:
        """Run a query; it fails when the bounds are spent."""
        self.connection.set_progress_handler(self._look, STEPS)
        return self.connection.execute(query, values)

    def _look(self) -> bool:
        self.looks -= 1
        return self.looks <= 0

    def refuse_programs(self) -> None:
        """Check that topics and messages are plain tables, and let sqlite read only those.

        Raises
        ------
        UnreadableLogError
            When one of them is a view, is virtual, or has columns that are computed.
        """
        for table in (TOPICS, MESSAGES):
            try:
                kinds = self.execute("SELECT type, sql FROM sqlite_master WHERE name = ?", table).fetchall()
                columns = self.execute(f"PRAGMA table_xinfo({table})").fetchall()
            except _FAILURES as error:
                raise UnreadableLogError(self.name, f"no {table} of a ROS 2 bag ({error})") from error
            texts = [str(text).split(maxsplit=2) for kind, text in kinds if kind == "table"]
            if kinds and (
                len(texts) != len(kinds) or any([word.upper() for word in one[1:2]] != ["TABLE"] for one in texts)
            ):
                raise UnreadableLogError(self.name, f"{table} that are computed (no plain table)", "a bag of ROS 2")
            if any(column[6] for column in columns):
                raise UnreadableLogError(self.name, f"{table} with columns that are computed", "a bag of ROS 2")
        self.connection.set_authorizer(_authorized)
        try:
            self.execute("SELECT _rowid_ FROM messages LIMIT 1").fetchall()
        except sqlite3.OperationalError:
            self.has_rowid = False
        except _FAILURES:
            pass  # told when the rows are read
        try:
            row = self.execute(f"SELECT metadata FROM {METADATA} ORDER BY id DESC LIMIT 1").fetchone()
            self.metadata = BagMetadata.of(str(row[0])) if row else BagMetadata()
        except _FAILURES:
            pass  # before schema version 4

    def newest(self) -> int:
        """Return the largest row number."""
        try:
            return int(self.execute("SELECT max(_rowid_) FROM messages").fetchone()[0] or 0) if self.has_rowid else 0
        except (*_FAILURES, TypeError, ValueError):
            return 0

    def next_rows(self, last: int) -> tuple[list[Any], bool]:
        """Return the rows after number ``last``, and whether reading failed after them.

        Each is (number of the row, id, topic_id, timestamp, data). A table without row numbers is read in one go.
        """
        rows: list[Any] = []
        size, most = 0, min(BLOCK_BYTES, self.bytes)
        try:
            for row in self._rows(last):
                if self.has_rowid and row[0] <= last and _is_sound(row):  # pages lead in circles
                    return rows, True
                rows.append(row)
                number, data = row[0], row[4]
                if number > last:
                    last = number
                if type(data) is bytes or type(data) is str:
                    size += len(data)
                if size > most or len(rows) >= ROWS:
                    break
        except _FAILURES:
            return rows, True
        finally:
            self.bytes -= size
        return rows, self.bytes <= 0

    def _rows(self, last: int) -> Iterator[Any]:
        columns = "id, topic_id, timestamp, data"
        if self.has_rowid:
            query = f"SELECT _rowid_, {columns} FROM messages WHERE _rowid_ > ? ORDER BY _rowid_ LIMIT ?"
            return self.execute(query, last, ROWS)
        if self._stream is None:
            cursor = self.execute(f"SELECT 0, {columns} FROM messages")
            self._stream = ((number, *row[1:]) for number, row in enumerate(cursor, start=1))
        return self._stream


def _is_sound(row: Any) -> bool:
    """Tell whether the number, topic and time of a message are integers."""
    return isinstance(row[1], int) and isinstance(row[2], int) and isinstance(row[3], int)


def _authorized(action: int, first: str | None, _second: str | None, _base: str | None, inside: str | None) -> int:
    """Return whether sqlite may do something, as its code.

    It may read plain tables, with the functions that the queries here have.
    """
    if action == sqlite3.SQLITE_SELECT and inside is None:
        return sqlite3.SQLITE_OK
    if action == sqlite3.SQLITE_READ and inside is None and first in _READABLE:
        return sqlite3.SQLITE_OK
    if action == sqlite3.SQLITE_FUNCTION and inside is None and _second == "max":
        return sqlite3.SQLITE_OK
    return sqlite3.SQLITE_DENY


def _connections(database: _Database) -> dict[int, Connection]:
    query = f"SELECT id, name, type, serialization_format FROM {TOPICS} LIMIT {MOST_TOPICS}"
    topics = database.execute(query).fetchall()
    try:
        found = database.execute(
            f"SELECT topic_type, encoding, encoded_message_definition FROM {DEFINITIONS} LIMIT {MOST_TOPICS}"
        )
        schemas = {str(row[0]): (str(row[1]), str(row[2]).encode()) for row in found.fetchall()}
    except _FAILURES:
        schemas = {}  # before schema version 4
    connections = {}
    sound = [row for row in topics if isinstance(row[0], int)]  # messages of the others are counted as of no topic
    for number, (key, topic, kind, encoding) in enumerate(sound):
        form, text = schemas.get(str(kind), ("", b""))
        connections[key] = Connection(
            number, str(topic), plain_name(str(kind)), str(encoding), form, text, f"topic {key}"
        )
    return connections


@contextmanager
def _connected(source: Source) -> Iterator[_Database]:
    """Open the database read-only; a compressed one is unpacked to a temporary file."""
    if not source.compression:
        with closing(_open(source.path, source.name)) as connection:
            yield _bounded(connection, source)
        return
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "bag.db3"
        with source.open() as stream, path.open("wb") as target:
            while piece := stream.read(_COPY_BYTES):
                target.write(piece)
        with closing(_open(path, source.name)) as connection:
            yield _bounded(connection, source)


def _bounded(connection: sqlite3.Connection, source: Source) -> _Database:
    return _Database(connection, source.name, LOOKS + 2 * source.size // STEPS, source.size)


def _open(path: Path, name: str) -> sqlite3.Connection:
    try:
        size = path.stat().st_size
        database = sqlite3.connect(f"{path.resolve().as_uri()}?mode=ro&immutable=1", uri=True)
        database.setlimit(sqlite3.SQLITE_LIMIT_LENGTH, min(max(size, 1 << 16), 1 << 30))  # no value exceeds its file
        database.execute("PRAGMA trusted_schema=OFF")
        database.execute("PRAGMA writable_schema=ON")  # else a file shorter than its header says is refused
        database.text_factory = lambda text: text.decode("utf-8", "replace")
    except _FAILURES as error:
        raise UnreadableLogError(name, f"no database that sqlite opens ({error})") from error
    return database
