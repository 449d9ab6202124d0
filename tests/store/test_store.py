"""The store gives back what was written, whatever is present, and the same input gives the same bytes."""

import errno
import hashlib
from collections.abc import Iterable
from dataclasses import replace
from io import BytesIO
from pathlib import Path
from time import sleep

import numpy as np
import pytest
from mcap.reader import make_reader
from numpy.typing import NDArray

from groundstation.base.clock import BreakEntry, Clock, RelationEntry
from groundstation.base.errors import GroundstationError
from groundstation.base.findings import Finding
from groundstation.base.ledger import (
    CounterEntry,
    Dropouts,
    FieldEntry,
    Ledger,
    OutOfRange,
    StuckStretch,
    TopicEntry,
    TopicGaps,
    Truncation,
)
from groundstation.base.records import Column, Damage, LogHeader, RecordBatch
from groundstation.base.signals import TOPICS
from groundstation.store import channel
from groundstation.store.channel import CHUNK_SPAN_NS, SHORT_SPAN_NS
from groundstation.store.framing import message_index
from groundstation.store.info import StoreInfo
from groundstation.store.reader import read, read_info
from groundstation.store.recognition import is_groundstation_mcap
from groundstation.store.writer import StoreWriter

T0 = 1_777_874_400_000_000_000
STEP_NS = 10_000_000
WORDS = np.array(["nav", "align", "gnss_aided", "", "курс 007"])
RAW_DTYPES = ("f8", "f4", "i8", "i4", "i2", "i1", "u8", "u4", "u2", "u1", "?", "U7")


def values_of(dtype: str, count: int, rng: np.random.Generator) -> NDArray:
    if dtype.startswith("U"):
        return WORDS[rng.integers(0, len(WORDS), count)]
    if dtype == "?":
        return rng.random(count) > 0.5
    if dtype.startswith("f"):
        values = rng.normal(size=count).astype(dtype)
        values[::7] = np.nan
        return values
    limits = np.iinfo(dtype)
    return rng.integers(limits.min, limits.max, count, dtype=dtype, endpoint=True)


def columns_of(topic: str, count: int, rng: np.random.Generator, share: float) -> dict[str, Column]:
    dtype_of = {"double": "f8", "bool": "?", "text": "U"}
    known = TOPICS.get(topic.partition(".")[0], ())
    kinds = {field.name: "f4" if field.is_single else dtype_of[field.kind] for field in known}
    if topic.startswith("raw."):
        kinds = {f"Column ({dtype})": dtype for dtype in RAW_DTYPES}
    out = {}
    for name, dtype in kinds.items():
        present = None if share == 1.0 else rng.random(count) < share
        out[name] = Column(values_of(dtype, count, rng), present)
    return out


def batch_of(
    topic: str, count: int = 500, *, first: int = 0, share: float = 1.0, step_ns: int = STEP_NS, seed: int = 7
) -> RecordBatch:
    rng = np.random.default_rng(seed)
    index = np.arange(first, first + count)
    time_ns = T0 + index * step_ns
    device_time = Column(index * step_ns + 3, None if share == 1.0 else rng.random(count) < share)
    return RecordBatch(topic, index, device_time, columns_of(topic, count, rng, share), time_ns)


def written(path: Path, batches: Iterable[RecordBatch], info: StoreInfo | None = None) -> Path:
    with StoreWriter(path, info or StoreInfo(has_utc=True)) as writer:
        for batch in batches:
            writer.write(batch)
    return path


def batches_of(path: Path) -> dict[str, list[RecordBatch]]:
    """Batches by topic; fails at any damage."""
    out: dict[str, list[RecordBatch]] = {}
    for item in read(path):
        assert not isinstance(item, Damage), item
        if isinstance(item, RecordBatch):
            out.setdefault(item.topic, []).append(item)
    return out


def joined(batches: list[RecordBatch]) -> RecordBatch:
    def column(parts: list[Column]) -> Column:
        return Column(np.concatenate([part.values for part in parts]), np.concatenate([part.mask for part in parts]))

    columns = {name: column([batch.columns[name] for batch in batches]) for name in batches[0].columns}
    validity = [batch.time_ns if batch.validity_time_ns is None else batch.validity_time_ns for batch in batches]
    return RecordBatch(
        batches[0].topic,
        np.concatenate([batch.record_index for batch in batches]),
        column([batch.device_time_ns for batch in batches]),
        columns,
        np.concatenate([batch.time_ns for batch in batches]),
        np.concatenate(validity),
    )


def assert_same_column(found: Column, expected: Column) -> None:
    np.testing.assert_array_equal(found.mask, expected.mask)
    kept = expected.mask
    assert found.values.dtype.kind == expected.values.dtype.kind
    np.testing.assert_array_equal(found.values[kept], expected.values[kept])


def assert_same(found: RecordBatch, expected: RecordBatch) -> None:
    np.testing.assert_array_equal(found.record_index, expected.record_index)
    np.testing.assert_array_equal(found.time_ns, expected.time_ns)
    assert_same_column(found.device_time_ns, expected.device_time_ns)
    assert set(found.columns) == set(expected.columns)
    for name, column in expected.columns.items():
        assert_same_column(found.columns[name], column)


@pytest.mark.parametrize("share", [1.0, 0.0, 0.6], ids=["all present", "none present", "mixed"])
@pytest.mark.parametrize("topic", [*TOPICS, "ins.2", "link.tanker.2", "raw.VN300 (port 1)"])
def test_topic_comes_back_as_written(tmp_path: Path, topic: str, share: float) -> None:
    batch = batch_of(topic, share=share)
    found = batches_of(written(tmp_path / "a.mcap", [batch]))
    assert list(found) == [topic]
    assert_same(joined(found[topic]), batch)


@pytest.mark.parametrize("count", [1, 3, 40_000])
@pytest.mark.parametrize("share", [1.0, 0.7])
def test_any_length_comes_back(tmp_path: Path, count: int, share: float) -> None:
    batch = batch_of("onboard", count, share=share)
    assert_same(joined(batches_of(written(tmp_path / "a.mcap", [batch]))["onboard"]), batch)


def test_raw_columns_keep_their_names_and_types(tmp_path: Path) -> None:
    batch = batch_of("raw.recorder", share=0.5)
    (found,) = batches_of(written(tmp_path / "a.mcap", [batch]))["raw.recorder"]
    assert list(found.columns) == list(batch.columns)
    for name, column in batch.columns.items():
        if column.values.dtype.kind != "U":
            assert found.columns[name].values.dtype == column.values.dtype


def test_raw_names_that_clash_as_identifiers_are_kept_apart(tmp_path: Path) -> None:
    names = ["Alt (ft)", "Alt [ft]", "alt_ft", "AltFt", "Курс", "Крен", "record_index", "class", "2nd", ""]
    columns = {name: Column(np.full(4, float(k))) for k, name in enumerate(names)}
    index = np.arange(4)
    batch = RecordBatch("raw.x", index, Column(index), columns, T0 + index)
    assert_same(joined(batches_of(written(tmp_path / "a.mcap", [batch]))["raw.x"]), batch)


def test_nan_that_the_device_wrote_is_nan_and_absent_is_absent(tmp_path: Path) -> None:
    column = Column(np.array([1.0, np.nan, 3.0]), np.array([True, True, False]))
    index = np.arange(3)
    batch = RecordBatch("baro", index, Column(index), {"pressure_altitude_m": column}, T0 + index)
    (found,) = batches_of(written(tmp_path / "a.mcap", [batch]))["baro"]
    altitude = found.columns["pressure_altitude_m"]
    assert altitude.mask.tolist() == [True, True, False]
    assert np.isnan(altitude.values[1])


def test_many_small_batches_of_several_topics_come_back(tmp_path: Path) -> None:
    topics = ["ins", "gnss", "raw.x"]
    parts = [batch_of(topic, 37, first=37 * k, share=0.8, seed=k) for k in range(60) for topic in topics]
    found = batches_of(written(tmp_path / "a.mcap", parts))
    assert list(found) == sorted(topics)
    for topic in topics:
        assert len(found[topic]) == 1, "small batches are joined into one chunk"
        assert_same(joined(found[topic]), joined([part for part in parts if part.topic == topic]))


def test_columns_that_come_later_are_absent_before(tmp_path: Path) -> None:
    first, second = batch_of("raw.x", 10), batch_of("raw.x", 10, first=10)
    early = RecordBatch("raw.x", first.record_index, first.device_time_ns, {}, first.time_ns)
    found = joined(batches_of(written(tmp_path / "a.mcap", [early, second]))["raw.x"])
    for name, column in second.columns.items():
        assert not found.columns[name].mask[:10].any()
        assert_same_column(found.columns[name].take(slice(10, 20)), column)


def test_a_number_column_may_change_its_type_where_nothing_is_lost(tmp_path: Path) -> None:
    index = np.arange(3)
    floats = RecordBatch("raw.x", index, Column(index), {"a": Column(index + 0.5)}, T0 + index)
    whole = RecordBatch("raw.x", index, Column(index), {"a": Column(index)}, T0 + 3 + index)
    found = joined(batches_of(written(tmp_path / "a.mcap", [floats, whole]))["raw.x"])
    assert found.columns["a"].values.tolist() == [0.5, 1.5, 2.5, 0.0, 1.0, 2.0]
    later = RecordBatch("raw.x", index, Column(index), floats.columns, T0 + 6 + index)
    with_nan = RecordBatch("raw.x", index, Column(index), {"a": Column(np.full(3, np.nan))}, T0 + 6 + index)
    for batch in (later, with_nan):
        with pytest.raises(GroundstationError, match=r"column a: found values of float64, expected int64"):
            written(tmp_path / "b.mcap", [whole, batch])
    large = RecordBatch("raw.x", index, Column(index), {"a": Column(index + 2**53)}, T0 + 6 + index)
    with pytest.raises(GroundstationError, match=r"column a: found values of int64, expected float64"):
        written(tmp_path / "b.mcap", [floats, large])


def test_time_of_validity_comes_back(tmp_path: Path) -> None:
    batch = batch_of("gnss", 100)
    validity = batch.time_ns - 120_000_000
    late = RecordBatch("gnss", batch.record_index, batch.device_time_ns, batch.columns, batch.time_ns, validity)
    (found,) = batches_of(written(tmp_path / "a.mcap", [late]))["gnss"]
    np.testing.assert_array_equal(found.validity_time_ns, validity)
    (plain,) = batches_of(written(tmp_path / "b.mcap", [batch]))["gnss"]
    assert plain.validity_time_ns is None


def test_validity_before_the_zero_of_a_log_without_utc_comes_back(tmp_path: Path) -> None:
    index = np.arange(5)
    batch = RecordBatch("electric", index, Column(index), {"current_a": Column(index * 1.0)}, index, index - 3)
    (found,) = batches_of(written(tmp_path / "a.mcap", [batch], StoreInfo()))["electric"]
    np.testing.assert_array_equal(found.validity_time_ns, index - 3)


def test_chunks_are_in_order_of_time_whatever_the_order_of_writing(tmp_path: Path) -> None:
    step = CHUNK_SPAN_NS // 50
    batches = [batch_of(topic, 300, step_ns=step) for topic in ("truth", "ins", "baro")]
    one = written(tmp_path / "one.mcap", batches)
    starts = [item.time_ns[0] for item in read(one) if isinstance(item, RecordBatch)]
    assert len(starts) == 3 * 6
    assert starts == sorted(starts)
    for found in batches_of(one).values():
        assert all((batch.time_ns // CHUNK_SPAN_NS).min() == (batch.time_ns // CHUNK_SPAN_NS).max() for batch in found)


def test_one_chunk_of_a_busy_topic_is_no_more_than_a_minute(tmp_path: Path) -> None:
    path = written(tmp_path / "a.mcap", [batch_of("gnss", 3_000, step_ns=10 * STEP_NS), batch_of("event", 300)])
    found = batches_of(path)
    assert len(found["gnss"]) == 5
    assert len(found["event"]) == 1
    for batch in found["gnss"]:
        assert batch.time_ns[-1] // SHORT_SPAN_NS == batch.time_ns[0] // SHORT_SPAN_NS


def test_of_small_chunks_a_file_has_few_however_slow_its_topics_are(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(channel, "MOST_SMALL", 50)
    slow = [batch_of(f"raw.t{number}", count=400, step_ns=CHUNK_SPAN_NS, seed=number) for number in range(20)]
    thin = [replace(one, columns={"a": Column(one.record_index.astype("f8"))}) for one in slow]
    path = written(tmp_path / "a.mcap", thin)
    with path.open("rb") as file:
        count = make_reader(file).get_summary().statistics.chunk_count
    assert 50 < count < 500  # each row would have one: 8 000
    for one in thin:
        assert joined(batches_of(path)[one.topic]).columns["a"].values.tolist() == list(range(400))


def test_equal_input_gives_equal_bytes(tmp_path: Path) -> None:
    batches = [batch_of(topic, share=0.6) for topic in ("ins", "gnss", "raw.x", "event")]
    info = StoreInfo(source_name="a.csv", versions={"b": "1", "a": "2"}, ledger=Ledger(bytes_skipped=1))
    same = StoreInfo(source_name="a.csv", versions={"a": "2", "b": "1"}, ledger=Ledger(bytes_skipped=1))
    one, two = written(tmp_path / "one.mcap", batches, info), written(tmp_path / "two.mcap", batches, same)
    assert one.read_bytes() == two.read_bytes()


def test_what_is_kept_in_memory_and_laid_out_at_once_changes_no_byte(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    step = CHUNK_SPAN_NS // 700
    shares = {"ins": 1.0, "gnss": 0.6, "raw.x": 0.6, "event": 1.0}
    batches = [batch_of(topic, 2_000, share=share, step_ns=step) for topic, share in shares.items()]
    before = written(tmp_path / "a.mcap", batches).read_bytes()
    for most in (1, 20_000):  # bytes in memory
        monkeypatch.setattr("groundstation.store.spool.ROOM_BYTES", most)
        assert written(tmp_path / "b.mcap", batches).read_bytes() == before
    monkeypatch.setattr("groundstation.store.channel._together", lambda pieces, _rows: ([piece] for piece in pieces))
    assert written(tmp_path / "c.mcap", batches).read_bytes() == before


def test_chunks_beyond_the_memory_go_to_a_file_that_is_closed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    batches = [batch_of("ins", 2_000, first=2_000 * k, step_ns=CHUNK_SPAN_NS // 700) for k in range(4)]
    path, most = written(tmp_path / "a.mcap", batches), 60_000
    spooled = list[int]()

    class Told(BytesIO):
        def writelines(self, parts: Iterable[bytes]) -> None:  # type: ignore[override]
            spooled.append(self.write(b"".join(parts)))

    spool = Told()
    monkeypatch.setattr("groundstation.store.spool.tempfile.TemporaryFile", lambda dir: spool)
    monkeypatch.setattr("groundstation.store.spool.ROOM_BYTES", most)
    assert written(tmp_path / "b.mcap", batches).read_bytes() == path.read_bytes()
    with path.open("rb") as file:
        index = make_reader(file).get_summary().chunk_indexes
    sizes = [one.chunk_length + one.message_index_length for one in index if one.message_index_offsets]
    assert sum(sizes) - most <= sum(spooled) < sum(sizes) - most + max(sizes)
    assert spool.closed


@pytest.mark.parametrize("threads", [1, 2, 5])
def test_threads_that_compress_change_no_byte_whichever_is_done_first(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, threads: int
) -> None:
    def late(channel_id: int, log_time: NDArray, starts: NDArray) -> bytes:
        sleep(0.02 if channel_id % 2 else 0.0)
        return message_index(channel_id, log_time, starts)

    batches = [batch_of(topic, 2_000, step_ns=CHUNK_SPAN_NS // 700) for topic in ("ins", "raw.x", "gnss", "event")]
    before = written(tmp_path / "a.mcap", batches, StoreInfo(has_utc=True)).read_bytes()
    monkeypatch.setattr("groundstation.store.writer.COMPRESSING", threads)
    monkeypatch.setattr("groundstation.store.writer.message_index", late)
    with StoreWriter(tmp_path / "b.mcap", StoreInfo(has_utc=True)) as writer:
        for batch in batches:
            writer.write(batch)
    found = (tmp_path / "b.mcap").read_bytes()
    assert found == before
    assert writer.sha256 == hashlib.sha256(found).hexdigest()


OUTSIDE = OutOfRange(record=7, time="+0:01.0", range=(None, 90.0))
STUCK = StuckStretch(record=3, start="+0:00.2", length_s=4.0, samples=40, value=1.25, why="gnss moves")
TOPIC = TopicEntry(
    rows=5,
    first="+0:00.0",
    last="+0:02.0",
    span_s=2.0,
    nominal_rate_hz=2.5,
    actual_rate_hz=None,
    coverage=0.987654,
    duplicates=0,
    backward_steps=1,
    stray_rows=0,
    gaps=TopicGaps(count=1, longest_s=1.5, total_s=1.5, listed=(("+0:00.5", 1.5),)),
    fields={
        "a_deg": FieldEntry(present=5, out_of_range=1, first_out_of_range=OUTSIDE),
        "b": FieldEntry(stuck=(STUCK,)),
    },
    sequences=(CounterEntry(field="count", kind="records", lost=2, listed=(("+0:00.5", 2),)),),
    losses={"corrupt": 3},
)
RELATION = RelationEntry(
    clock="gnss",
    source="raw.time",
    samples=2,
    reason="too few readings",
    residual_s=0.001,
    resolution_s=0.0,
    breaks=(BreakEntry(drift_change_ppm=None, kind="step", step_s=1.0, step_sigma_s=0.1, time="x", time_sigma_s=0.2),),
)


def test_info_comes_back(tmp_path: Path) -> None:
    info = StoreInfo(
        source_name="полёт 3.csv",
        source_sha256="ab" * 32,
        reader="flat-csv",
        versions={"groundstation": "0.1.0"},
        configuration={"gate": {"gdop": 4.0, "names": ("a", "b")}},
        metadata={"aircraft": "T-1", "flight": "7"},
        has_utc=True,
        start_ns=np.int64(T0),
        clock=Clock(first_device_time="5.000 s", nominal_period_s=0.0123456789, relations=(RELATION,)),
        ledger=Ledger(
            topics={"ins": TOPIC},
            skipped_spans=((100, 163, 64),),
            dropouts=Dropouts(count=1, total_s=0.5),
            truncated=Truncation(place="byte 900", what="bytes", count=5),
        ),
        findings=(Finding("warn", "data.truncated", "cut at byte 900", place="byte 900", count=5),),
        remarks=[{"code": "derived", "text": "velocities"}],
        damages=[{"kind": "truncated", "count": 1}],
    )
    path = written(tmp_path / "a.mcap", [batch_of("ins", 5)], info)
    assert read_info(path) == info
    header = next(iter(read(path)))
    assert header == LogHeader("groundstation-mcap", {"aircraft": "T-1", "flight": "7"}, 0)


def test_info_may_be_completed_until_the_end(tmp_path: Path) -> None:
    with StoreWriter(tmp_path / "a.mcap", StoreInfo()) as writer:
        writer.write(batch_of("ins", 5))
        writer.info = StoreInfo(ledger=Ledger(bytes_skipped=5))
    assert read_info(tmp_path / "a.mcap").ledger == Ledger(bytes_skipped=5)


def test_file_without_rows_is_a_file(tmp_path: Path) -> None:
    assert batches_of(written(tmp_path / "a.mcap", [])) == {}


def test_nothing_is_left_of_a_failed_write(tmp_path: Path) -> None:
    target = tmp_path / "a.mcap"
    target.write_bytes(b"before")
    with pytest.raises(ZeroDivisionError), StoreWriter(target, StoreInfo()) as writer:
        writer.write(batch_of("ins"))
        raise ZeroDivisionError
    assert [path.name for path in tmp_path.iterdir()] == ["a.mcap"]
    assert target.read_bytes() == b"before"


def test_a_disk_that_fills_while_chunks_are_written_is_one_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(*_: object) -> bytes:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr("groundstation.store.writer.message_index", full)  # in a thread that compresses
    with (
        pytest.raises(GroundstationError, match="No space left"),
        StoreWriter(tmp_path / "a.mcap", StoreInfo()) as writer,
    ):
        writer.write(batch_of("ins"))
    assert not list(tmp_path.iterdir())


def test_unwritable_place_is_one_line(tmp_path: Path) -> None:
    with pytest.raises(GroundstationError, match="cannot be written"):
        written(tmp_path / "no such folder" / "a.mcap", [])


def test_decreasing_missing_and_negative_times_are_refused(tmp_path: Path) -> None:
    batch = batch_of("ins", 10)
    without = RecordBatch("ins", batch.record_index, batch.device_time_ns, batch.columns)
    negative = RecordBatch("ins", batch.record_index, batch.device_time_ns, batch.columns, np.arange(-5, 5))
    for batches, message in (
        ([batch.take(slice(None, None, -1))], r"topic ins, record 8: found time .* no less than the time before"),
        ([batch, batch], "record 0: found time"),
        ([without], "no corrected time"),
        ([negative], "expected not negative"),
    ):
        with pytest.raises(GroundstationError, match=message):
            written(tmp_path / "a.mcap", batches)


def test_column_that_is_not_of_a_canonical_topic_is_refused(tmp_path: Path) -> None:
    index = np.arange(2)
    batch = RecordBatch("baro", index, Column(index), {"colour": Column(index * 1.0)}, T0 + index)
    with pytest.raises(GroundstationError, match="topic baro: found column 'colour'"):
        written(tmp_path / "a.mcap", [batch])


def test_own_files_are_recognised(tmp_path: Path) -> None:
    path = written(tmp_path / "a.mcap", [batch_of("ins", 5)])
    assert is_groundstation_mcap(path)
    assert is_groundstation_mcap(path.read_bytes()[:4096])
    other = tmp_path / "b.mcap"
    other.write_bytes(b"\x89MCAP0\r\n" + bytes(100))
    assert not is_groundstation_mcap(other)
    assert not is_groundstation_mcap(tmp_path / "missing")


def test_text_with_odd_characters_comes_back(tmp_path: Path) -> None:
    texts = np.array(["a", "é" * 200, "x" * 1024, "\U0001f6eb", "", "tab\there", "a"])
    index = np.arange(len(texts))
    batch = RecordBatch("event", index, Column(index), {"name": Column(texts)}, T0 + index)
    assert_same(joined(batches_of(written(tmp_path / "a.mcap", [batch]))["event"]), batch)


def test_fields_of_an_inertial_unit_are_rounded_to_single_precision(tmp_path: Path) -> None:
    index = np.arange(3)
    given = np.array([1.0 + 1e-12, np.nan, -9.80665])
    time_ns = T0 + index * STEP_NS
    log = RecordBatch("imu", index, Column(index), {"accel_z_mps2": Column(given)}, time_ns)
    later = RecordBatch(
        "imu", index + 3, Column(index), {"accel_z_mps2": Column(given.astype("f4"))}, time_ns + STEP_NS * 3
    )
    found = joined(batches_of(written(tmp_path / "a.mcap", [log, later]))["imu"]).columns["accel_z_mps2"]
    np.testing.assert_array_equal(found.values, np.tile(given.astype("f4"), 2))
