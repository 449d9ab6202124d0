"""A damaged file gives back every intact chunk and says what is missing; nothing in it makes the reader fail."""

import struct
import tracemalloc
import zlib
from collections import Counter
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path

import lz4.frame
import numpy as np
import pytest
import zstandard
from mcap.reader import make_reader
from mcap.records import Channel, Chunk, Header, Message, Schema

from groundstation.base.errors import GroundstationError, UnreadableLogError
from groundstation.base.records import Column, Damage, LogHeader, RecordBatch
from groundstation.store import walk
from groundstation.store.channel import CHUNK_SPAN_NS
from groundstation.store.decompress import MAX_CHUNK_BYTES
from groundstation.store.foreign import ForeignLost, ForeignMcap, ForeignMessages, UnknownChannel
from groundstation.store.framing import to_bytes
from groundstation.store.info import StoreInfo
from groundstation.store.marks import MAGIC
from groundstation.store.messages import ChunkMessages
from groundstation.store.reader import read, read_info
from groundstation.store.schema import canonical_type
from tests.store.test_store import assert_same, batch_of, joined, written

STEP_NS = CHUNK_SPAN_NS // 40
ROWS = {"ins": 200, "gnss": 150, "raw.x": 120, "event": 130}
DERIVED = ("location_fix.", "pose.", "log")  # what topics of channels made of others begin with
INFO = StoreInfo(source_name="a.csv", metadata={"aircraft": "T-1"}, has_utc=True)
FLIPS = 60
EVERY = [9, pytest.param(1, marks=pytest.mark.slow)]  # ninth place of a sweep; the slow tests take all
FEW = [4, pytest.param(1, marks=pytest.mark.slow)]  # fourth place, of shorter sweeps
MANY = 100
MUTATIONS = [MANY // 4, pytest.param(MANY, marks=pytest.mark.slow)]
EXTREMES = (0, 1, 2**31, 2**40, 2**63, 2**64 - 1)
PEAK_BYTES = 16 << 20  # a file of 100 kB needs no more; a trusted length would


@pytest.fixture(autouse=True)
def always_compiled(monkeypatch: pytest.MonkeyPatch) -> None:
    """Thousands of short reads are faster so; test_store.py has the interpreted walk."""
    monkeypatch.setattr(walk, "walker", walk.Walker(0))


@dataclass(frozen=True)
class Place:
    start: int
    end: int
    topic: str
    rows: range


@dataclass(frozen=True)
class Sample:
    data: bytes
    rows: dict[str, RecordBatch]
    chunks: tuple[Place, ...]
    data_end: int


@pytest.fixture(scope="module")
def sample(tmp_path_factory: pytest.TempPathFactory) -> Sample:
    """A small file of some 20 chunks, some of them of derived channels, and where each one stands."""
    path = tmp_path_factory.mktemp("store") / "a.mcap"
    batches = [batch_of(topic, count, share=0.8, step_ns=STEP_NS) for topic, count in ROWS.items()]
    written(path, batches, INFO)
    chunks, seen = [], Counter[str]()
    with path.open("rb") as file:
        summary = make_reader(file).get_summary()
        for index in summary.chunk_indexes:
            (channel,) = index.message_index_offsets
            topic = summary.channels[channel].topic
            file.seek(index.chunk_start_offset + index.chunk_length + 11)
            count = struct.unpack("<I", file.read(4))[0] // 16
            end = index.chunk_start_offset + index.chunk_length
            rows = range(seen[topic], seen[topic] + count)
            chunks.append(Place(index.chunk_start_offset, end, topic, rows))
            seen[topic] += count
    data = path.read_bytes()
    data_end = data.rindex(b"\x0f" + struct.pack("<Q", 4))
    return Sample(data, {batch.topic: batch for batch in batches}, tuple(chunks), data_end)


def recovered(path: Path, data: bytes, sample: Sample) -> tuple[dict[str, set[int]], list[Damage]]:
    """Rows found by topic, each equal to what was written, and damages."""
    path.write_bytes(data)
    batches: dict[str, list[RecordBatch]] = {topic: [] for topic in ROWS}
    damages = []
    for number, item in enumerate(read(path)):
        assert isinstance(item, LogHeader) == (number == 0)
        if isinstance(item, RecordBatch):
            batches[item.topic].append(item)
        elif isinstance(item, Damage):
            damages.append(item)
    found = {}
    for topic, parts in batches.items():
        found[topic] = set()
        if parts:
            whole = joined(parts)
            assert_same(whole, sample.rows[topic].take(whole.record_index))
            found[topic] = set(whole.record_index.tolist())
            assert len(found[topic]) == len(whole), "no row twice"
    return found, damages


def missing(found: dict[str, set[int]]) -> dict[str, set[int]]:
    lost = {topic: set(range(count)) - found[topic] for topic, count in ROWS.items()}
    return {topic: rows for topic, rows in lost.items() if rows}


def flipped(data: bytes, place: int, bit: int = 0) -> bytes:
    out = bytearray(data)
    out[place] ^= 1 << bit
    return bytes(out)


def flip_places(sample: Sample) -> list[tuple[int, int]]:
    """Seeded bits all over the file, and one in every byte where structure is densest."""
    rng = np.random.default_rng(11)
    places = rng.integers(0, len(sample.data), FLIPS).tolist()
    head = sample.chunks[3].start
    places += [*range(60), *range(head, head + 60), *range(sample.data_end, sample.data_end + 30)]
    places += range(len(sample.data) - 40, len(sample.data))
    return [(place, int(rng.integers(0, 8))) for place in places]


def test_sample_has_several_chunks_of_every_topic(sample: Sample) -> None:
    assert {topic: sum(place.topic == topic for place in sample.chunks) for topic in ROWS} == {
        "ins": 5,
        "gnss": 4,
        "raw.x": 3,
        "event": 4,
    }


@pytest.mark.parametrize("every", EVERY)
def test_flipped_bit_loses_no_more_than_its_chunk_and_the_loss_is_stated(
    sample: Sample, tmp_path: Path, every: int
) -> None:
    for place, bit in flip_places(sample)[::every]:
        found, damages = recovered(tmp_path / "a.mcap", flipped(sample.data, place, bit), sample)
        lost = missing(found)
        hit = [chunk for chunk in sample.chunks if chunk.start <= place < chunk.end]
        stated = [damage for damage in damages if damage.loses_data]
        if not lost:
            assert not stated, (place, stated)
            continue
        (chunk,) = hit
        assert lost == {chunk.topic: set(chunk.rows)}, place
        (damage,) = stated
        assert (damage.kind, damage.topic, damage.count) == ("corrupt", chunk.topic, len(chunk.rows))
        assert damage.place == f"byte {chunk.start} to {chunk.end}"
        assert damage.what.startswith("messages, 2026-05-04T06:")


@pytest.mark.parametrize("shares", [(0.6,), pytest.param((0.3, 0.9), marks=pytest.mark.slow)])
def test_flipped_bit_in_compressed_data_is_always_found(
    sample: Sample, tmp_path: Path, shares: tuple[float, ...]
) -> None:
    for chunk in sample.chunks:
        for share in shares:
            place = chunk.start + 60 + int(share * (chunk.end - chunk.start - 60))
            _, damages = recovered(tmp_path / "a.mcap", flipped(sample.data, place), sample)
            (damage,) = damages
            assert damage.topic == chunk.topic
            assert damage.loses_data == (not chunk.topic.startswith(DERIVED))


def test_flipped_bit_leaves_the_facts_readable(sample: Sample, tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    for place in range(0, sample.chunks[0].start, 11):
        path.write_bytes(flipped(sample.data, place, place % 8))
        assert read_info(path) == INFO, place


@pytest.mark.parametrize("every", [5, pytest.param(1, marks=pytest.mark.slow)])
def test_cut_file_gives_every_whole_chunk(sample: Sample, tmp_path: Path, every: int) -> None:
    rng = np.random.default_rng(5)
    edges = [place + shift for chunk in sample.chunks for place in (chunk.start, chunk.end) for shift in (-1, 0, 1)]
    cuts = (*edges, *rng.integers(100, len(sample.data), 40).tolist(), len(sample.data) - 1)
    for cut in (*cuts[::every], cuts[-1]):
        found, damages = recovered(tmp_path / "a.mcap", sample.data[:cut], sample)
        for topic, rows in found.items():
            whole = [chunk.rows for chunk in sample.chunks if chunk.topic == topic and chunk.end <= cut]
            assert rows == {row for chunk in whole for row in chunk}, cut
        stated = [damage for damage in damages if damage.place != "metadata"]
        assert len(stated) == 1, (cut, stated)
        if cut <= sample.data_end:
            assert stated[0].kind == "truncated"
            assert stated[0].loses_data
            assert int(stated[0].place.removeprefix("byte ")) + stated[0].count == cut
        else:
            assert not stated[0].loses_data


def test_file_cut_before_anything_can_be_known_is_one_line(sample: Sample, tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    for cut in range(25):
        path.write_bytes(sample.data[:cut])
        with pytest.raises(UnreadableLogError, match=r"a\.mcap: found a file of another program"):
            list(read(path))


@pytest.mark.parametrize("every", EVERY)
def test_without_a_summary_a_flipped_bit_still_loses_only_its_chunk(sample: Sample, tmp_path: Path, every: int) -> None:
    cut = sample.data[: sample.data_end]
    for place, bit in flip_places(sample)[::every]:
        if not sample.chunks[0].start <= place < sample.data_end:
            continue
        found, damages = recovered(tmp_path / "a.mcap", flipped(cut, place, bit), sample)
        hit = [chunk for chunk in sample.chunks if chunk.start <= place < chunk.end]
        lost = missing(found)
        assert lost in ({}, *({chunk.topic: set(chunk.rows)} for chunk in hit)), place
        assert not lost or any(damage.kind == "corrupt" and damage.loses_data for damage in damages)


def test_without_a_summary_the_message_index_tells_what_was_lost(sample: Sample, tmp_path: Path) -> None:
    cut = sample.data[: sample.data_end]
    for chunk in sample.chunks[:8]:
        _, damages = recovered(tmp_path / "a.mcap", flipped(cut, chunk.end - 5), sample)
        lost = next(damage for damage in damages if damage.kind == "corrupt")
        assert (lost.topic, lost.count) == (chunk.topic, len(chunk.rows))


@pytest.mark.parametrize("every", EVERY)
def test_definitions_lost_with_the_summary_never_give_wrong_columns(sample: Sample, tmp_path: Path, every: int) -> None:
    cut = sample.data[: sample.data_end]
    for place in range(100, sample.chunks[0].start, 37 * every):
        found, damages = recovered(tmp_path / "a.mcap", flipped(cut, place, place % 8), sample)
        if missing(found):
            assert any(damage.loses_data and damage.kind != "truncated" for damage in damages), place


@pytest.mark.parametrize("every", FEW)
def test_overwritten_block_loses_only_the_chunks_it_touches(sample: Sample, tmp_path: Path, every: int) -> None:
    size = 3_000
    for start in range(sample.chunks[0].start, sample.data_end - size, 2_111 * every):
        data = sample.data[:start] + bytes(size) + sample.data[start + size :]
        found, damages = recovered(tmp_path / "a.mcap", data, sample)
        for topic, rows in found.items():
            whole = [c.rows for c in sample.chunks if c.topic == topic and (c.end <= start or c.start >= start + size)]
            assert rows >= {row for chunk in whole for row in chunk}
        hit = [chunk for chunk in sample.chunks if chunk.start < start + size and start < chunk.end]
        if all(chunk.topic.startswith(DERIVED) for chunk in hit):  # of what is unrecognisable it is not known
            assert not missing(found)
        else:
            assert bool(missing(found)) == any(damage.loses_data for damage in damages)


@pytest.mark.parametrize("every", EVERY)
def test_removed_and_inserted_bytes_lose_only_the_chunks_they_touch(sample: Sample, tmp_path: Path, every: int) -> None:
    rng = np.random.default_rng(3)
    for start in range(sample.chunks[0].start + 10, sample.data_end, 1_777 * every):
        before, after = sample.data[:start], sample.data[start:]
        for data in (before + after[7:], before + rng.bytes(9) + after):
            found, _ = recovered(tmp_path / "a.mcap", data, sample)
            lost = missing(found)
            hit = [chunk for chunk in sample.chunks if chunk.start < start + 7 and start < chunk.end]
            assert sum(map(len, lost.values())) <= sum(len(chunk.rows) for chunk in hit)


@pytest.mark.parametrize("every", FEW)
def test_repeated_chunk_is_read_once(sample: Sample, tmp_path: Path, every: int) -> None:
    whole = sample.data[: sample.data_end]
    for chunk in sample.chunks[::every]:
        copy = whole[chunk.start : chunk.end]
        found, damages = recovered(tmp_path / "a.mcap", whole[: chunk.end] + copy + whole[chunk.end :], sample)
        assert not missing(found)
        assert [damage.kind for damage in damages if damage.loses_data] == ["truncated"]
        if not chunk.topic.startswith(DERIVED):
            assert any(damage.what == "messages that stand in the file twice" for damage in damages)


def test_chunk_in_the_wrong_place_is_left_out_and_stated(sample: Sample, tmp_path: Path) -> None:
    first, *_, last = (chunk for chunk in sample.chunks if chunk.topic == "ins")
    moved = sample.data[: first.start] + sample.data[last.start : last.end] + sample.data[first.start : sample.data_end]
    found, damages = recovered(tmp_path / "a.mcap", moved, sample)
    assert found["ins"] == set(last.rows)
    stated = [damage for damage in damages if damage.what == "messages that are not in order of time"]
    assert sum(damage.count for damage in stated) == len(missing(found)["ins"])


def test_trailing_bytes_lose_nothing(sample: Sample, tmp_path: Path) -> None:
    found, damages = recovered(tmp_path / "a.mcap", sample.data + b"\0" * 100, sample)
    assert not missing(found)
    assert not any(damage.loses_data for damage in damages)


def mutated(data: bytes, rng: np.random.Generator) -> bytes:
    """A file with several kinds of damage at once, extreme numbers among them."""
    out = bytearray(data)
    for _ in range(int(rng.integers(1, 9))):
        place = int(rng.integers(0, len(out) - 8))
        kind = rng.integers(0, 5)
        if kind == 0:
            out[place] ^= 1 << int(rng.integers(0, 8))
        elif kind == 1:
            out[place : place + 8] = struct.pack("<Q", EXTREMES[rng.integers(len(EXTREMES))])
        elif kind == 2:
            del out[place : place + int(rng.integers(1, 2_000))]
        elif kind == 3:
            out[place:place] = rng.bytes(int(rng.integers(1, 200)))
        else:
            source = int(rng.integers(0, len(out) - 8))
            out[place : place + 500] = out[source : source + 500]
        if len(out) < 100:
            break
    return bytes(out[: int(rng.integers(len(out) // 2, len(out) + 1))]) if rng.random() < 0.3 else bytes(out)


@pytest.mark.parametrize("mutations", MUTATIONS)
def test_random_mutations_never_fail_and_never_give_wrong_rows(sample: Sample, tmp_path: Path, mutations: int) -> None:
    rng = np.random.default_rng(2026)
    path = tmp_path / "a.mcap"
    for _ in range(mutations):
        data = mutated(sample.data, rng)
        try:
            found, damages = recovered(path, data, sample)
            read_info(path)
        except GroundstationError as error:
            assert "\n" not in str(error)
            continue
        assert not missing(found) or any(damage.loses_data for damage in damages)


@pytest.mark.parametrize("mutations", MUTATIONS)
def test_random_mutations_of_a_foreign_file_never_fail_and_tell_what_they_cost(sample: Sample, mutations: int) -> None:
    rng = np.random.default_rng(9)
    for _ in range(mutations):
        data = mutated(sample.data, rng)
        found = list(ForeignMcap(BytesIO(data), len(data)))
        messages = [item for item in found if isinstance(item, ForeignMessages)]
        rows = sum(len(item.messages) for item in messages if item.channel.topic in ROWS)
        assert rows >= sum(ROWS.values()) or len(messages) < len(found), "what is lost is told"


def hostile(*records: bytes) -> bytes:
    return MAGIC + to_bytes(Header("", "groundstation 0")) + b"".join(records)


def chunk_of(raw: bytes, *, size: int | None = None, data: bytes | None = None) -> bytes:
    return to_bytes(
        Chunk(
            compression="zstd",
            data=zstandard.compress(raw) if data is None else data,
            message_start_time=0,
            message_end_time=0,
            uncompressed_crc=zlib.crc32(raw),
            uncompressed_size=len(raw) if size is None else size,
        )
    )


def ins_definition() -> bytes:
    kind = canonical_type("ins")
    schema = Schema(id=1, name=kind.name, encoding="protobuf", data=kind.descriptor_set)
    return to_bytes(schema, Channel(id=1, topic="ins", message_encoding="protobuf", metadata={}, schema_id=1))


def messages_of(*payloads: bytes) -> bytes:
    return to_bytes(*(Message(channel_id=1, log_time=1, publish_time=1, sequence=0, data=data) for data in payloads))


@pytest.mark.parametrize(
    "data",
    [
        hostile(chunk_of(bytes(MAX_CHUNK_BYTES + 1), size=MAX_CHUNK_BYTES + 1)),
        hostile(chunk_of(b"", size=2**63)),
        hostile(chunk_of(bytes(50 << 20), size=100)),
        hostile(chunk_of(b"abc", size=3, data=zstandard.compress(bytes(60 << 20)))),
        hostile(b"\x06" + struct.pack("<Q", 2**62) + bytes(100)),
        hostile(b"\x03" + struct.pack("<Q", 2**63) + bytes(100)),
        hostile(b"\x0c" + struct.pack("<QI", 20, 2**32 - 1) + b"groundstation" + bytes(100)),
        hostile(to_bytes(Schema(1, b"\xff" * 50, "protobuf", "groundstation.Ins"))),
        hostile(*[chunk_of(b"\x05" + struct.pack("<Q", 2**64 - 1) + bytes(40))] * 3),
    ],
    ids=[
        "large chunk",
        "huge size",
        "bomb",
        "bomb in frame",
        "huge chunk",
        "huge schema",
        "facts",
        "schema",
        "message",
    ],
)
def test_stated_sizes_are_never_trusted(tmp_path: Path, data: bytes) -> None:
    path = tmp_path / "a.mcap"
    path.write_bytes(data)
    tracemalloc.start()
    try:
        items = list(read(path))
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert isinstance(items[0], LogHeader)
    assert all(isinstance(item, Damage) for item in items[1:])
    assert peak < PEAK_BYTES + len(data)


def test_messages_that_are_no_protobuf_are_counted_and_left_out(tmp_path: Path) -> None:
    good = b"\x11" + struct.pack("<Q", 7) + b"\x19" + struct.pack("<d", 45.0)
    bad = (b"\x19\0", b"\xff" * 12, b"\x0b", b"\x00\x00", b"\x9a\x01\xff\xff\xff\xff\x07", b"\x19" + bytes(8))
    unknown = b"\xf8\x3f\x96\x01" + b"\xfa\x3f\x02ab" + b"\xfd\x3f\0\0\0\0" + good
    path = tmp_path / "a.mcap"
    path.write_bytes(hostile(ins_definition(), chunk_of(messages_of(good, *bad, unknown, good[9:] + good))))
    items = list(read(path))
    batches = [item for item in items if isinstance(item, RecordBatch)]
    found = joined(batches)
    assert found.columns["latitude_deg"].values.tolist() == [45.0, 45.0, 45.0]
    lost = next(item for item in items if isinstance(item, Damage) and "schema" in item.what)
    assert (lost.kind, lost.count, lost.topic) == ("corrupt", len(bad), "ins")


def test_bools_are_read_as_protobuf_reads_them(tmp_path: Path) -> None:
    index = b"\x11" + bytes(8)
    valid = b"\xa8\x01"
    for ending, expected in ((b"\x01", True), (b"\0", False), (b"\x80\x01", True), (b"\x80\0", False), (b"\x02", True)):
        path = tmp_path / "a.mcap"
        path.write_bytes(hostile(ins_definition(), chunk_of(messages_of(*[index + valid + ending] * 3))))
        (batch,) = [item for item in read(path) if isinstance(item, RecordBatch)]
        assert batch.columns["valid"].values.tolist() == [expected] * 3


def test_hostile_messages_and_schemas_with_right_checksums_never_fail(
    sample: Sample, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Interpreted, so that a place outside the chunk would be an IndexError."""
    monkeypatch.setattr(walk, "walker", walk.Walker(1 << 40))
    rng = np.random.default_rng(4)
    path = tmp_path / "a.mcap"
    payload = b"\x11" + bytes(8) + b"\x19" + bytes(8) + b"\xa2\x01\x03nav" + b"\xa8\x01\x01"
    raw, definition = messages_of(*[payload] * 12, payload[:9]), ins_definition()
    for number in range(MANY):
        spoilt, kind = bytearray(raw), bytearray(definition)
        target = spoilt if number % 3 else kind
        for place in rng.integers(20, len(target), int(rng.integers(1, 6))):
            target[place] = rng.integers(0, 256)
        path.write_bytes(
            hostile(bytes(kind), chunk_of(bytes(spoilt[: int(rng.integers(len(raw) - 20, len(raw) + 1))])))
        )
        assert all(isinstance(item, LogHeader | Damage | RecordBatch) for item in read(path))


def test_several_channels_in_a_chunk_are_told_apart(tmp_path: Path) -> None:
    second = Channel(id=2, topic="ins.2", message_encoding="protobuf", metadata={}, schema_id=1)
    payloads = [b"\x11" + struct.pack("<Q", k) for k in range(10)]
    records = [Message(1 + k % 2, k, payload, k, 0) for k, payload in enumerate(payloads)]
    path = tmp_path / "a.mcap"
    path.write_bytes(hostile(ins_definition(), to_bytes(second), chunk_of(b""), chunk_of(to_bytes(*records))))
    found = {item.topic: item.record_index.tolist() for item in read(path) if isinstance(item, RecordBatch)}
    assert found == {"ins": [0, 2, 4, 6, 8], "ins.2": [1, 3, 5, 7, 9]}


@pytest.mark.parametrize("compression", ["", "lz4", "zstd"])
def test_every_compression_of_mcap_is_read(tmp_path: Path, compression: str) -> None:
    raw = messages_of(*[b"\x11" + struct.pack("<Q", k) for k in range(10)])
    data = {"": raw, "lz4": lz4.frame.compress(raw), "zstd": zstandard.compress(raw)}[compression]
    chunk = Chunk(
        compression=compression,
        data=data,
        message_start_time=1,
        message_end_time=1,
        uncompressed_crc=zlib.crc32(raw),
        uncompressed_size=len(raw),
    )
    path = tmp_path / "a.mcap"
    path.write_bytes(hostile(ins_definition(), to_bytes(chunk)))
    (batch,) = [item for item in read(path) if isinstance(item, RecordBatch)]
    assert batch.record_index.tolist() == list(range(10))


def test_few_long_texts_among_many_short_ones_stay_in_bounds(tmp_path: Path) -> None:
    short = b"\x11" + bytes(8)
    long = short + b"\xa2\x01\x80\x80\x40" + b"x" * (1 << 20)
    raw = messages_of(*[short] * 5_000, long, *[short] * 5_000)
    path = tmp_path / "a.mcap"
    path.write_bytes(hostile(ins_definition(), chunk_of(raw)))
    batches = [item for item in read(path) if isinstance(item, RecordBatch)]
    assert sum(map(len, batches)) == 10_001
    assert max(batch.columns["mode"].values.nbytes for batch in batches) <= 4 * (64 << 20)


def test_compiled_and_interpreted_walks_agree(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    batch = batch_of("gnss", 400, share=0.5)
    path = written(tmp_path / "a.mcap", [batch])
    for limit in (0, 1 << 40):
        monkeypatch.setattr(walk, "walker", walk.Walker(limit))
        assert_same(joined([item for item in read(path) if isinstance(item, RecordBatch)]), batch)


@pytest.mark.parametrize("odd", [0, 1, 1_500, 2_998, 2_999])
def test_one_record_of_other_fields_is_seen_wherever_it_stands(tmp_path: Path, odd: int) -> None:
    count = 3_000
    values = np.arange(count, dtype=float)
    is_odd = np.arange(count) == odd  # pitch in place of roll: as many bytes, under another tag
    columns = {"roll_deg": Column(values, ~is_odd), "pitch_deg": Column(values, is_odd)}
    index = np.arange(count)
    batch = RecordBatch("ins", index, Column(index), columns, index * 1_000_000)
    path = written(tmp_path / "a.mcap", [batch])
    assert_same(joined([item for item in read(path) if isinstance(item, RecordBatch)]), batch)


@pytest.mark.parametrize("stride", [31, 33, 139, 5_000])
@pytest.mark.parametrize("count", [1, 63, 64, 700])
def test_bytes_that_differ_in_any_record_are_found(count: int, stride: int) -> None:
    rng = np.random.default_rng(count)
    matrix = np.tile(rng.integers(0, 256, stride, dtype=np.uint8), (count, 1))
    for row in {0, count // 2, count - 1} - ({0} if count == 1 else set()):
        column = int(rng.integers(stride))
        other = matrix.copy()
        other[row, column] ^= 1 << int(rng.integers(8))
        records = ChunkMessages(other.reshape(-1), 1, stride * np.arange(count), np.full(count, stride), stride)
        alike = [records.is_alike(at, at + 1) for at in range(stride)]
        assert alike == [count == 1 or at != column for at in range(stride)]
        assert records.is_alike(0, column) and records.is_alike(column + 1, stride)


def test_messages_of_any_mcap_are_read_and_of_a_cut_one_those_before_the_cut(sample: Sample) -> None:
    counts = {}
    for size in (len(sample.data), sample.data_end, sample.data_end // 2):
        found = list(ForeignMcap(BytesIO(sample.data[:size]), size))
        lost = [item for item in found if isinstance(item, ForeignLost)]
        assert [item.is_cut for item in lost] == ([] if size == len(sample.data) else [True] * len(lost))
        rows: dict[str, int] = {}
        for item in found:
            if isinstance(item, ForeignMessages):
                rows[item.channel.topic] = rows.get(item.channel.topic, 0) + len(item.messages)
                assert (np.diff(item.places) > 0).all()
        counts[size] = rows
        rows["unknown"] = sum(item.messages for item in found if isinstance(item, UnknownChannel))
    whole, uncut, half = counts.values()
    assert {topic: whole[topic] for topic in ROWS} == ROWS and not whole["unknown"]
    assert sum(uncut.values()) == sum(whole.values()), "without a summary some are of no known channel"
    assert 0 < sum(half.values()) < sum(whole.values())
