"""A file is known as the store's by what is left of it; foreign files, archives and other logs are not."""

import gzip
import io
import tarfile
import time
import tracemalloc
import zipfile
from collections import Counter
from pathlib import Path

import numpy as np
import pytest
from mcap.records import Channel, Header, Message
from mcap.stream_reader import StreamReader

from groundstation.base.records import Column, Damage, RecordBatch
from groundstation.pipeline.one_flight.log import open_log
from groundstation.pipeline.verbs.describe import describe
from groundstation.store.channel import CHUNK_SPAN_NS
from groundstation.store.framing import to_bytes
from groundstation.store.info import COPY_NAME, StoreInfo
from groundstation.store.marks import MAGIC
from groundstation.store.recognition import is_groundstation_mcap, is_mostly_mcap
from groundstation.store.writer import StoreWriter
from tests.fuzz.bases import dataflash, flat_csv, mcap_starts, ulog
from tests.store.test_store import T0, batch_of, written

ROWS = {"ins": 200, "event": 130, "raw.x": 120}
CHANNELS = 10_000
LIMIT_S, PEAK_BYTES = 60.0, 96 << 20  # of the processor; measured: 5 s
CHUNK, METADATA, SCHEMA, CHANNEL, DATA_END = 6, 12, 3, 4, 15


@pytest.fixture(scope="module")
def sound(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    """A file of several chunks of each topic."""
    path = tmp_path_factory.mktemp("store") / "a.mcap"
    written(path, [batch_of(topic, rows, step_ns=CHUNK_SPAN_NS // 40) for topic, rows in ROWS.items()])
    return path.read_bytes()


def spans(data: bytes, *opcodes: int) -> list[tuple[int, int]]:
    """Records of these kinds, up to the end of data."""
    found = []
    for at in mcap_starts(data):
        if data[at] in opcodes:
            found.append((at, at + 9 + int.from_bytes(data[at + 1 : at + 9], "little")))
        if data[at] == DATA_END:
            break
    return found


def wiped(data: bytes, *places: tuple[int, int], value: int = 0) -> bytes:
    out = bytearray(data)
    for start, end in places:
        out[start:end] = bytes([value]) * (end - start)
    return bytes(out)


def read(path: Path, data: bytes) -> tuple[str, dict[str, int], list[Damage]]:
    """Reader, rows by topic, damages."""
    path.write_bytes(data)
    log = open_log(path)
    rows: dict[str, int] = {}
    damages = []
    for item in log.items():
        if isinstance(item, RecordBatch):
            rows[item.topic] = rows.get(item.topic, 0) + len(item)
        elif isinstance(item, Damage):
            damages.append(item)
    return log.source.reader, rows, damages


@pytest.mark.parametrize("value", [0, 0x20, 0x80, 0xFF])
def test_header_and_metadata_overwritten(sound: bytes, tmp_path: Path, value: int) -> None:
    (first, copy) = spans(sound, METADATA)
    _, rows, damages = read(tmp_path / "a", wiped(sound, (8, first[1]), copy, value=value))
    assert rows == ROWS
    assert "what the file is of is uncertain" in damages[0].what


def test_magic_header_metadata_and_all_definitions_above_the_chunks_overwritten(sound: bytes, tmp_path: Path) -> None:
    start = spans(sound, CHUNK)[0][0]
    _, rows, damages = read(tmp_path / "a", wiped(sound, (0, start)))
    assert rows == ROWS and all(damage.kind == "corrupt" for damage in damages)


def test_definitions_at_both_ends_overwritten(sound: bytes, tmp_path: Path) -> None:
    """Those behind the first chunks are left."""
    start, end = spans(sound, CHUNK)[0][0], spans(sound, DATA_END)[0][0]
    _, rows, _ = read(tmp_path / "a", wiped(sound, (44, start), (end, len(sound))))
    assert rows == ROWS


def test_bytes_in_front(sound: bytes, tmp_path: Path) -> None:
    for junk in (b"x" * 300, ulog()[:5000], dataflash()[:2000], bytes(9)):
        assert read(tmp_path / "a", junk + sound)[1] == ROWS


def test_a_damaged_definition_gives_way_to_a_sound_one(sound: bytes, tmp_path: Path) -> None:
    """Without metadata there are no checksums: the copy that can be used, or the one that stands most often, counts."""
    schemas = [place for place in spans(sound, SCHEMA) if place[0] < spans(sound, CHUNK)[0][0]]
    data = bytearray(wiped(sound, *spans(sound, METADATA)))
    for _start, end in schemas:
        data[end - 40] ^= 0x55
    data[-12] ^= 1  # the summary's checksum
    assert read(tmp_path / "a", bytes(data))[1] == ROWS


def test_a_summary_that_bytes_before_it_shifted_is_found(sound: bytes, tmp_path: Path) -> None:
    chunk, end = spans(sound, CHUNK)[1], spans(sound, DATA_END)[0][0]
    data = wiped(sound, *spans(sound, METADATA, SCHEMA, CHANNEL))
    lost = data[: chunk[0] + 50] + data[chunk[0] + 60 :]
    _, rows, _ = read(tmp_path / "a", lost)
    assert sum(ROWS.values()) > sum(rows.values()) > sum(ROWS.values()) - 60 and rows.keys() == ROWS.keys()
    assert sound[end] == DATA_END


def test_a_record_whose_end_is_cut_out_takes_no_chunk_with_it(sound: bytes, tmp_path: Path) -> None:
    """Its length then leads into the chunk behind it."""
    chunks = spans(sound, CHUNK)
    schema = next(place for place in spans(sound, SCHEMA) if place[0] > chunks[0][0])
    assert read(tmp_path / "a", sound[: schema[1] - 30] + sound[schema[1] :])[1] == ROWS


def test_the_end_of_another_file_in_the_middle(sound: bytes, tmp_path: Path) -> None:
    end = spans(sound, DATA_END)[0][0]
    at = spans(sound, CHUNK)[3][0]
    _, rows, damages = read(tmp_path / "a", sound[:at] + sound[end:] + sound[at:])
    assert rows == ROWS and any("follow the end of the data" in damage.what for damage in damages)


def test_another_programs_file_with_our_definitions_is_not_ours(sound: bytes, tmp_path: Path) -> None:
    (first, *_) = spans(sound, METADATA)
    path = tmp_path / "a.mcap"
    for library in ("mcap go v1.7.0", "", "python mcap 1.2; mcap-protobuf"):
        path.write_bytes(MAGIC + to_bytes(Header(profile="", library=library)) + sound[first[1] :])
        assert not is_groundstation_mcap(path)


def _tar(data: bytes) -> bytes:
    stream = io.BytesIO()
    with tarfile.open(fileobj=stream, mode="w") as archive:
        for name in ("a.mcap", "b.mcap"):
            entry = tarfile.TarInfo(name)
            entry.size = len(data)
            archive.addfile(entry, io.BytesIO(data))
    return stream.getvalue()


def _zip(data: bytes) -> bytes:
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w") as archive:
        archive.writestr("a.mcap", data)
    return stream.getvalue()


def test_archives_random_bytes_and_texts_are_not_ours(sound: bytes, tmp_path: Path) -> None:
    rng = np.random.default_rng(5)
    noise = [rng.bytes(50_000) + b"groundstation." + rng.bytes(50_000) for _ in range(20)]
    texts = [b"groundstation.Ins and groundstation_copy\n" * 500, ulog(), dataflash(), flat_csv(), b"", MAGIC]
    for content in (_tar(sound), _zip(sound), gzip.compress(sound), sound[:8] + bytes(100), *noise, *texts):
        path = tmp_path / "a"
        path.write_bytes(content)
        assert not is_groundstation_mcap(path)


@pytest.mark.parametrize(
    ("log", "reader"), [(flat_csv(), "flat-csv"), (dataflash(), "dataflash"), (ulog(), "px4-ulog")]
)
def test_another_log_that_begins_with_the_magic_number_is_described_as_what_it_is(
    log: bytes, reader: str, tmp_path: Path
) -> None:
    path = tmp_path / "a.log"
    path.write_bytes(MAGIC + log[len(MAGIC) :])
    assert describe(path).facts["format"].startswith(reader)


def test_an_mcap_of_another_program_is_a_robots_log(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    path.write_bytes(MAGIC + to_bytes(Header("", "another program")) + MAGIC)
    assert describe(path).facts["format"].startswith("bag MCAP")


@pytest.mark.parametrize(
    ("log", "reader"), [(flat_csv(), "flat-csv"), (dataflash(), "dataflash"), (ulog(), "px4-ulog")]
)
def test_another_log_with_a_part_of_an_mcap_stays_what_it_is(
    sound: bytes, tmp_path: Path, log: bytes, reader: str
) -> None:
    start = spans(sound, CHUNK)[0][0]
    end = sound.index(COPY_NAME.encode()) - 13
    assert read(tmp_path / "a", log + sound[end:])[0] == reader
    if reader == "flat-csv":
        assert read(tmp_path / "a", sound[:start] + b"\n" + log)[0] == reader
        assert not is_mostly_mcap(tmp_path / "a")


def test_a_definition_stands_behind_chunks_1_2_4_and_8_of_its_channel(sound: bytes) -> None:
    chunks, definitions = [0], []
    seen: dict[int, int] = {}
    for at in mcap_starts(sound):
        if sound[at] == DATA_END:
            break
        if sound[at] == 7:  # message index: channel
            channel = int.from_bytes(sound[at + 9 : at + 11], "little")
            seen[channel] = seen.get(channel, 0) + 1
            chunks.append(channel)
        elif sound[at] == CHANNEL and seen:
            assert int.from_bytes(sound[at + 9 : at + 11], "little") == chunks[-1]
            definitions.append((chunks[-1], seen[chunks[-1]]))
    assert definitions and {count for _, count in definitions} <= {1, 2, 4, 8}
    assert {(channel, 1 << bit) for channel in seen for bit in range(seen[channel].bit_length())} == set(definitions)


def test_the_peer_reads_the_file_with_its_repeated_definitions(sound: bytes) -> None:
    counted, topics = Counter[str](), dict[int, str]()
    for record in StreamReader(io.BytesIO(sound), validate_crcs=True).records:
        if isinstance(record, Channel):
            topics[record.id] = record.topic
        elif isinstance(record, Message):
            counted[topics[record.channel_id]] += 1
    assert {topic: counted[topic] for topic in ROWS} == ROWS


@pytest.mark.slow
def test_ten_thousand_channels_without_metadata_and_summary(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    index = np.arange(3)
    with StoreWriter(path, StoreInfo(source_name="a", has_utc=True)) as writer:
        for at in range(CHANNELS):
            values = {"x": Column(index * 1.0)}
            writer.write(RecordBatch(f"raw.t{at}", index, Column(index), values, T0 + index + at))
    data = path.read_bytes()
    first, copy = spans(data, METADATA)
    path.write_bytes(wiped(data, (8, first[1]), copy, (len(data) - 60, len(data))))
    began = time.process_time()
    topics = {item.topic for item in open_log(path).items() if isinstance(item, RecordBatch)}
    assert len(topics) == CHANNELS and time.process_time() - began < LIMIT_S
    tracemalloc.start()
    rows = sum(len(item) for item in open_log(path).items() if isinstance(item, RecordBatch))
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert rows == 3 * CHANNELS and peak < PEAK_BYTES
