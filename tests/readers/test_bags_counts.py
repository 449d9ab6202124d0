"""What a bag says of itself is held against what is in it: chunks and messages that are gone are counted."""

import sqlite3
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from groundstation.base.errors import UnreadableLogError
from groundstation.base.records import Damage, RecordBatch
from groundstation.readers import registry
from groundstation.readers.bags.marks import METADATA, ROS1_MAGIC
from groundstation.readers.bags.ros1_records import CHUNK, CHUNK_INFO, CONNECTION, INDEX, head_at
from groundstation.readers.source import Source
from tests.readers.bag_writer import small_flight, write_ros1, write_ros2
from tests.readers.test_contract import check

CHUNK_BYTES = 20_000
NOTHING_MISSING = 0


def read(path: Path) -> tuple[int, list[Damage]]:
    """Raw messages that are read of a file, and its damage."""
    found = list(registry.read(path))
    check(found)
    rows = sum(len(item) for item in found if isinstance(item, RecordBatch) and item.topic.startswith("raw."))
    return rows, [item for item in found if isinstance(item, Damage)]


def missing(damages: list[Damage]) -> int:
    """Messages that are told to be gone."""
    return sum(one.count for one in damages if one.kind == "dropped_rows" and "that are not in it" in one.what)


def records(data: bytes) -> Iterator[tuple[int, int, int]]:
    """Operation, first byte and end of each record outside of chunks."""
    at = len(ROS1_MAGIC)
    while (head := head_at(data, at)) is not None:
        yield head.op, at, head.end
        at = head.end


def chunks(data: bytes) -> list[tuple[int, int]]:
    """Bytes of each chunk with the indexes behind it."""
    found: list[tuple[int, int]] = []
    for op, start, end in records(data):
        if op == CHUNK:
            found.append((start, end))
        elif op == INDEX:
            found[-1] = found[-1][0], end
    return found


@pytest.fixture
def bag(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A bag of ROS 1 of several chunks."""
    from rosbags.rosbag1 import Writer

    begin = Writer.__init__

    def small_chunks(self: Writer, path: Path) -> None:
        begin(self, path)
        self.chunk_threshold = CHUNK_BYTES

    monkeypatch.setattr(Writer, "__init__", small_chunks)
    return write_ros1(tmp_path / "a.bag", small_flight(is_ros1=True), "lz4")


@pytest.mark.parametrize("which", [0, 1, -1])
def test_a_chunk_that_was_cut_out_is_counted(bag: Path, which: int) -> None:
    data = bag.read_bytes()
    whole, damages = read(bag)
    assert whole == 480 and not damages and len(chunks(data)) > 3
    start, end = chunks(data)[which]
    bag.write_bytes(data[:start] + data[end:])
    rows, damages = read(bag)
    assert rows < whole and missing(damages) == whole - rows
    assert all(one.loses_data for one in damages)


@pytest.mark.parametrize("which", [0, 2])
def test_without_header_and_chunk_the_index_still_counts(bag: Path, which: int) -> None:
    data = bag.read_bytes()
    (first, _), (start, end) = chunks(data)[0], chunks(data)[which]
    bag.write_bytes(data[first:start] + data[end:])
    rows, damages = read(bag)
    assert 0 < rows < 480 and missing(damages) == 480 - rows


@pytest.mark.parametrize("chunks_kept", [1, 3])
def test_a_file_that_ends_behind_a_chunk_is_cut(bag: Path, chunks_kept: int) -> None:
    data = bag.read_bytes()
    many = len(chunks(data))
    bag.write_bytes(data[: chunks(data)[chunks_kept - 1][1]])
    rows, (damage,) = read(bag)
    assert 0 < rows < 480 and (damage.kind, damage.count) == ("truncated", many - chunks_kept)


def test_a_bag_that_was_never_closed_is_told(bag: Path) -> None:
    """Its first record counts no chunks; every message is there."""
    data = bag.read_bytes()
    at = data.index(b"index_pos=") + len(b"index_pos=")
    count_at = data.index(b"chunk_count=") + len(b"chunk_count=")
    opened = data[:at] + bytes(8) + data[at + 8 : count_at] + bytes(4) + data[count_at + 4 :]
    bag.write_bytes(opened[: chunks(data)[-1][1]])
    rows, (damage,) = read(bag)
    assert rows == 480 and damage.kind == "truncated" and "not closed" in damage.what


@pytest.mark.parametrize("place", ["beyond any file", "behind the end", "in the first chunk", "within the index"])
def test_an_index_that_is_not_where_the_header_says_is_found(bag: Path, place: str) -> None:
    data = bag.read_bytes()
    last = [start for op, start, _ in records(data) if op == CHUNK_INFO][-1]
    stated = {
        "beyond any file": 2**64 - 1,
        "behind the end": len(data) + 7,
        "in the first chunk": chunks(data)[0][0] + 90,
        "within the index": last,
    }
    at = data.index(b"index_pos=") + len(b"index_pos=")
    start, end = chunks(data)[1]
    moved = data[:at] + stated[place].to_bytes(8, "little") + data[at + 8 :]
    bag.write_bytes(moved)
    assert read(bag) == (480, [])
    bag.write_bytes(moved[:start] + moved[end:])
    rows, damages = read(bag)
    assert rows < 480 and missing(damages) == 480 - rows


def test_half_an_index_costs_nothing_but_a_chunk_gone_as_well_is_told(bag: Path) -> None:
    data = bag.read_bytes()
    infos = [start for op, start, _end in records(data) if op == CHUNK_INFO]
    bag.write_bytes(data[: infos[0]])
    assert read(bag) == (480, [])
    start, end = chunks(data)[1]
    bag.write_bytes(data[:start] + data[end : infos[0]])
    rows, (damage,) = read(bag)
    assert rows < 480 and (damage.kind, damage.count) == ("dropped_rows", 1)


def test_a_header_that_is_gone_alone_costs_nothing(bag: Path) -> None:
    data = bag.read_bytes()
    bag.write_bytes(data[chunks(data)[0][0] :])
    rows, (damage,) = read(bag)
    assert rows == 480 and not damage.loses_data


def test_connections_are_known_before_the_first_chunk(bag: Path) -> None:
    """Those that stand within chunks are damaged: what the index repeats is enough."""
    from groundstation.readers.bags.ros1_records import Index

    data = bag.read_bytes()
    outside = {start for op, start, _end in records(data) if op == CONNECTION}
    assert len(outside) == 6
    with Source(bag).open() as stream:
        index = Index.of(stream, len(data))
    assert len(index.connections) == 6 and sum(index.messages.values()) == 480


def metadata_of(folder: Path, change: Callable[[str], str]) -> Path:
    path = folder / METADATA
    path.write_text(change(path.read_text()))
    return path


@pytest.mark.parametrize("storage", ["mcap", "sqlite3"])
def test_metadata_of_a_folder_is_held_to_its_counts(tmp_path: Path, storage: str) -> None:
    folder = write_ros2(tmp_path / "bag", small_flight(), storage)
    path = folder / METADATA
    assert read(path) == (480, [])
    metadata_of(folder, lambda text: text.replace("message_count: 20\n", "message_count: 23\n", 1))
    rows, (damage,) = read(path)
    assert rows == 480 and damage.count == 3 and "/gps/fix" in damage.what and METADATA in damage.what


def test_metadata_as_rosbag2_lays_it_out() -> None:
    from groundstation.readers.bags.rosbag2_metadata import BagMetadata

    text = """rosbag2_bagfile_information:
  version: 5
  message_count: 30
  topics_with_message_count:
    - topic_metadata:
        name: "/fix"
        type: sensor_msgs/msg/NavSatFix
        offered_qos_profiles: "- history: 3\\n  depth: 0\\n  name: odd"
      message_count: 10
    - topic_metadata:
        name: /imu
        type: sensor_msgs/msg/Imu
      message_count: 20
  compression_format: ""
  relative_file_paths:
    - "a_0.db3"
    - a_1.db3
  files:
    - path: a_0.db3
      message_count: 7
"""
    found = BagMetadata.of(text)
    assert found.messages == {"/fix": 10, "/imu": 20} and found.files == ("a_0.db3", "a_1.db3")
    assert BagMetadata.of("nothing") == BagMetadata()


def changed(folder: Path, *statements: str) -> Path:
    """A bag in sqlite whose database was changed."""
    path = next(write_ros2(folder / "bag", small_flight(rows=60), "sqlite3").glob("*.db3"))
    database = sqlite3.connect(path)
    with database:
        for statement in statements:
            database.execute(statement)
    database.close()
    return path


def test_rows_gone_from_a_database_are_counted_by_its_metadata(tmp_path: Path) -> None:
    rows, damages = read(changed(tmp_path, "DELETE FROM messages WHERE id BETWEEN 50 AND 60"))
    assert rows == 144 - 11 and missing(damages) == 11


COPIED = (
    "CREATE TABLE copied AS SELECT * FROM messages",
    "DROP TABLE messages",
    "ALTER TABLE copied RENAME TO messages",
)


@pytest.mark.parametrize("column", ["id", "topic_id", "timestamp"])
@pytest.mark.parametrize("value", ["NULL", "'x'", "0.5", "zeroblob(8)"])
def test_a_row_without_numbers_is_counted_once(tmp_path: Path, column: str, value: str) -> None:
    path = changed(tmp_path, *COPIED, f"UPDATE messages SET {column} = {value} WHERE rowid IN (5, 6)")
    rows, (damage,) = read(path)
    assert rows == 142 and (damage.kind, damage.count) == ("corrupt", 2) and damage.loses_data


ENDLESS = "WITH RECURSIVE c(x) AS (SELECT 1 UNION ALL SELECT x + 1 FROM c)"
AS_A_BAG = "/* CREATE TABLE topics CREATE TABLE messages */"
PROGRAMS = {
    "view": (
        "DROP TABLE messages",
        f"CREATE VIEW messages AS {AS_A_BAG} {ENDLESS} "
        "SELECT x AS id, 1 AS topic_id, x AS timestamp, zeroblob(1000000) AS data FROM c",
    ),
    "view of topics": (
        "DROP TABLE topics",
        f"CREATE VIEW topics AS {AS_A_BAG} {ENDLESS} "
        "SELECT x AS id, x AS name, x AS type, 'cdr' AS serialization_format FROM c",
    ),
    "generated": (
        "ALTER TABLE messages RENAME TO plain",
        "CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp INTEGER, "
        "data AS (zeroblob(100000000)))",
        "INSERT INTO messages SELECT id, topic_id, timestamp FROM plain",
    ),
    "virtual": (
        "DROP TABLE messages",
        f"CREATE VIRTUAL TABLE messages USING fts4(id, topic_id, timestamp, data {AS_A_BAG})",
    ),
}


@pytest.mark.parametrize("name", PROGRAMS)
def test_a_database_that_computes_its_messages_is_refused(tmp_path: Path, name: str) -> None:
    path = changed(tmp_path, *PROGRAMS[name])
    with pytest.raises(UnreadableLogError, match="computed"):
        read(path)


@pytest.mark.parametrize(
    "statements",
    [
        ("CREATE TRIGGER t AFTER INSERT ON messages BEGIN DELETE FROM messages; END",),
        ("DROP TABLE message_definitions", f"CREATE VIEW message_definitions AS {ENDLESS} SELECT x FROM c"),
        ("DROP TABLE metadata", f"CREATE VIEW metadata AS {ENDLESS} SELECT x AS id, x AS metadata FROM c"),
        (*COPIED, "CREATE INDEX computed ON messages (abs(id))"),
        (
            "ALTER TABLE messages RENAME TO plain",
            "CREATE TABLE messages(id INTEGER, topic_id INTEGER, timestamp INTEGER, data BLOB, "
            "PRIMARY KEY (timestamp, topic_id)) WITHOUT ROWID",
            "INSERT INTO messages SELECT id, topic_id, timestamp, data FROM plain",
        ),
    ],
    ids=["trigger", "view of definitions", "view of metadata", "computed index", "without row numbers"],
)
def test_what_else_a_database_holds_costs_no_message(tmp_path: Path, statements: tuple[str, ...]) -> None:
    assert read(changed(tmp_path, *statements)) == (144, [])


def test_sqlite_may_read_plain_tables_only(tmp_path: Path) -> None:
    from groundstation.readers.bags import sqlite

    path = changed(tmp_path)
    with sqlite._connected(Source(path)) as database:
        database.refuse_programs()
        for query in (
            "ATTACH DATABASE ':memory:' AS other",
            "PRAGMA writable_schema=OFF",
            "SELECT zeroblob(10)",
            f"{ENDLESS} SELECT x FROM c",
            "SELECT name FROM pragma_table_info('messages')",
            "DELETE FROM messages",
        ):
            with pytest.raises(sqlite3.DatabaseError, match=r"prohibited|authorized|readonly"):
                database.execute(query).fetchall()


def test_a_database_gives_no_more_than_its_file_holds(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Pages that several rows share give more bytes than there are."""
    from groundstation.readers.bags import sqlite

    path = changed(tmp_path)
    bounded = sqlite._bounded

    def poor(connection: sqlite3.Connection, source: Source) -> sqlite._Database:
        database = bounded(connection, source)
        database.bytes = 10_000
        return database

    monkeypatch.setattr(sqlite, "_bounded", poor)
    rows, damages = read(path)
    assert 0 < rows < 144 and "more than its file can hold" in damages[0].what


def record(fields: dict[bytes, bytes], data: bytes) -> bytes:
    """A record of a bag of ROS 1."""
    header = b"".join(
        (len(name) + 1 + len(value)).to_bytes(4, "little") + name + b"=" + value for name, value in fields.items()
    )
    return len(header).to_bytes(4, "little") + header + len(data).to_bytes(4, "little") + data


def packed(content: bytes) -> bytes:
    """A chunk of a bag of ROS 1, in lz4."""
    import lz4.frame

    fields = {b"op": b"\x05", b"compression": b"lz4", b"size": len(content).to_bytes(4, "little")}
    return record(fields, lz4.frame.compress(content))


def message(at: int, data: bytes) -> bytes:
    """A message of connection 0."""
    time = (1_777_874_400 + at // 1_000).to_bytes(4, "little") + (at % 1_000).to_bytes(4, "little")
    return record({b"op": b"\x02", b"conn": bytes(4), b"time": time}, data)


def connection(definition: bytes) -> bytes:
    """Connection 0."""
    fields = {b"type": b"own/Type", b"md5sum": b"*", b"message_definition": definition}
    data = b"".join(
        (len(name) + 1 + len(value)).to_bytes(4, "little") + name + b"=" + value for name, value in fields.items()
    )
    return record({b"op": b"\x07", b"conn": bytes(4), b"topic": b"/own"}, data)


LOOKS_LIKE_ONE = b"\x10\0\0\0\x04\0\0\0op=\x05"  # the beginning of a header that is none, again and again
FEW_STEPS = 2_000


@pytest.mark.parametrize("is_packed", [False, True])
def test_what_looks_like_a_record_is_looked_at_so_often(
    bag: Path, is_packed: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    from groundstation.readers.bags import ros1_records

    looked_at: list[int] = []
    known = ros1_records.head_at

    def counted(data: bytes, at: int) -> ros1_records.RecordHeader | None:
        looked_at.append(at)
        return known(data, at)

    monkeypatch.setattr(ros1_records, "head_at", counted)
    data = bag.read_bytes()
    junk = LOOKS_LIKE_ONE * 50_000
    at = chunks(data)[1][0]
    bag.write_bytes(data[:at] + (packed(junk) if is_packed else junk) + data[at:])
    rows, damages = read(bag)
    assert rows > 0 and damages and len(looked_at) < 10 * 3 * ros1_records.MOST_TRIES


def test_layouts_that_are_ever_new_are_given_up(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Each message has a text more than the one before."""
    from groundstation.readers.bags import work

    texts = [message(at, at.to_bytes(4, "little") + bytes(4 * at)) for at in range(300)]
    path = tmp_path / "a.bag"
    path.write_bytes(ROS1_MAGIC + packed(connection(b"string[] texts") + b"".join(texts)))
    rows, damages = read(path)
    assert rows == 300 and not [one for one in damages if "work" in one.what]
    monkeypatch.setattr(work, "FREE_STEPS", FEW_STEPS)
    monkeypatch.setattr(work, "STEPS_PER_BYTE", 0)
    rows, damages = read(path)
    (given_up,) = [one for one in damages if "work" in one.what]
    assert rows == 300 and 0 < given_up.count < 300 and given_up.loses_data


def test_more_messages_than_a_file_can_hold_are_not_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from groundstation.readers.bags import work

    monkeypatch.setattr(work, "FREE_MESSAGES", 100)
    path = tmp_path / "a.bag"
    one = message(0, bytes(8))
    path.write_bytes(ROS1_MAGIC + packed(connection(b"float64 value") + one * 20_000))
    rows, damages = read(path)
    assert 100 < rows < 20_000 and any("no file of its size holds" in damage.what for damage in damages)


def test_chunks_expand_to_so_many_times_the_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from groundstation.readers.bags import ros1

    monkeypatch.setattr(ros1, "FREE_BYTES", 50_000)
    path = tmp_path / "a.bag"
    one = packed(message(0, bytes(1_000_000)))
    path.write_bytes(
        ROS1_MAGIC + packed(connection(b"uint8[1000000] image") + message(0, bytes(1_000_000))) + one * 300
    )
    rows, damages = read(path)
    assert 0 < rows < 301 and any("cannot" in damage.what or "size" in damage.what for damage in damages)


def test_objects_of_ever_new_names_fill_so_many_columns(tmp_path: Path) -> None:
    import json

    from mcap.writer import Writer as McapWriter

    path = tmp_path / "a.mcap"
    with path.open("wb") as stream:
        writer = McapWriter(stream)
        writer.start()
        channel = writer.register_channel("/own", "json", writer.register_schema("own", "jsonschema", b"{}"))
        for row in range(60):
            deep = '{"a":' * 300 + "1" + "}" * 300
            names = {f"name{row}_{number}": number for number in range(100)}
            data = (json.dumps(names)[:-1] + f', "deep": {deep}}}').encode()
            writer.add_message(channel, 1_777_874_400 * 10**9 + row, data, 0)
        writer.finish()
    found = list(registry.read(path))
    check(found)
    columns = {name for item in found if isinstance(item, RecordBatch) for name in item.columns}
    assert len(columns) <= 2_002 and all(len(name) < 100 for name in columns), "with bytes and publish time"
    (damage,) = [item for item in found if isinstance(item, Damage)]
    assert damage.count == 60 * 100 - 2_000 and damage.loses_data
