"""Other programs read the same values from a store file: mcap's protobuf decoder and Rerun's own loader."""

import os
import subprocess
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
import rerun_cli
from mcap.reader import make_reader
from mcap.stream_reader import StreamReader
from mcap_protobuf.decoder import DecoderFactory

from groundstation.base.records import Column, RecordBatch
from groundstation.store.info import StoreInfo
from tests.store.test_store import STEP_NS, T0, batch_of, written

RERUN = Path(rerun_cli.__file__).with_name("rerun")
HEAD_BYTES = 31  # of a message record before its payload


@pytest.fixture
def mixed_rates(tmp_path: Path) -> Path:
    """A file of several topics at different rates, with all, some and no fields present."""
    batches = [
        batch_of("ins", 30_000),
        batch_of("gnss", 600, step_ns=50 * STEP_NS, share=0.9),
        batch_of("gnss.2", 300, step_ns=100 * STEP_NS),
        batch_of("event", 5, step_ns=6_000 * STEP_NS),
        batch_of("raw.VN300 (1)", 3_000, step_ns=10 * STEP_NS, share=0.7),
    ]
    return written(tmp_path / "mixed.mcap", batches)


def rerun(*arguments: str | Path, home: Path) -> str:
    environment = {**os.environ, "CI": "1", "HOME": str(home)}
    done = subprocess.run([RERUN, *arguments], env=environment, capture_output=True, text=True, timeout=60, check=True)
    return done.stdout


def decoded(path: Path, topic: str) -> Iterator[tuple[int, int, object]]:
    with path.open("rb") as file:
        reader = make_reader(file, validate_crcs=True, decoder_factories=[DecoderFactory()])
        for _, _, message, value in reader.iter_decoded_messages(topics=[topic]):
            yield message.log_time, message.publish_time, value


@pytest.mark.parametrize("share", [1.0, 0.6])
@pytest.mark.parametrize("topic", ["ins", "gnss", "onboard", "link.3", "discrete"])
def test_mcap_library_decodes_the_same_values(tmp_path: Path, topic: str, share: float) -> None:
    batch = batch_of(topic, 200, share=share)
    path = written(tmp_path / "a.mcap", [batch])
    rows = list(decoded(path, topic))
    assert len(rows) == len(batch)
    for row, (log_time, publish_time, message) in enumerate(rows):
        assert log_time == publish_time == batch.time_ns[row]
        assert message.record_index == batch.record_index[row]
        assert message.HasField("device_time_ns") == batch.device_time_ns.mask[row]
        for name, column in batch.columns.items():
            assert message.HasField(name) == column.mask[row]
            if column.mask[row]:
                np.testing.assert_equal(getattr(message, name), column.values[row].item())


def test_mcap_library_decodes_types_made_at_run_time(tmp_path: Path) -> None:
    batch = batch_of("raw.x", 100, share=0.7)
    rows = list(decoded(written(tmp_path / "a.mcap", [batch]), "raw.x"))
    fields = [field.name for field in rows[0][2].DESCRIPTOR.fields][2:]
    for row, (_, _, message) in enumerate(rows):
        for field, column in zip(fields, batch.columns.values(), strict=True):
            assert message.HasField(field) == column.mask[row]
            if column.mask[row]:
                np.testing.assert_equal(getattr(message, field), column.values[row].item())


def test_every_record_checksum_and_index_is_right_for_the_mcap_library(mixed_rates: Path) -> None:
    with mixed_rates.open("rb") as file:
        counted = sum(type(record).__name__ == "Message" for record in StreamReader(file, validate_crcs=True).records)
    with mixed_rates.open("rb") as file:
        reader = make_reader(file, validate_crcs=True)
        summary = reader.get_summary()
        times = [message.log_time for _, _, message in reader.iter_messages(log_time_order=True)]
        assert [record.name for record in reader.iter_metadata()] == ["groundstation", "groundstation_copy"]
    assert times == sorted(times)
    assert counted == len(times) == summary.statistics.message_count


def test_rows_with_the_same_fields_have_the_same_length(tmp_path: Path) -> None:
    path = written(tmp_path / "a.mcap", [batch_of("satellite.G07", 500, share=0.5)])
    length_of: dict[tuple[str, ...], set[int]] = {}
    for _, _, message in decoded(path, "satellite.G07"):
        present = tuple(field.name for field, _ in message.ListFields())
        length_of.setdefault(present, set()).add(message.ByteSize())
    assert len(length_of) > 2
    assert all(len(lengths) == 1 for lengths in length_of.values())


def test_rerun_finds_no_issue(mixed_rates: Path, tmp_path: Path) -> None:
    for arguments in (("mcap", "check"), ("mcap", "check", "--full")):
        report = rerun(*arguments, mixed_rates, home=tmp_path)
        rows = [line for line in report.splitlines() if line.startswith(("ok", "PROBLEM"))]
        assert len(rows) == 9  # five topics, the positions of two once more, the poses of one, the log
        assert all(row.startswith("ok") for row in rows), report


def test_rerun_decodes_the_same_values(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CI", "1")
    monkeypatch.setenv("HOME", str(tmp_path))
    from rerun.chunk import McapReader

    batch = batch_of("ins", 300, share=0.6)
    path = written(tmp_path / "a.mcap", [batch])
    found = {}
    for chunk in McapReader(path).stream().to_chunks():
        columns = chunk.to_record_batch()
        if str(chunk.entity_path) == "/ins" and "message_log_time" in columns.schema.names:
            found = columns.to_pydict()
    assert [time.value for time in found["message_log_time"]] == batch.time_ns.tolist()
    messages = [row[0] for row in found["groundstation.Ins:message"]]
    for name, column in batch.columns.items():
        for row, message in enumerate(messages):
            expected = column.values[row].item() if column.mask[row] else None
            np.testing.assert_equal(message[name], expected)


def test_gnss_positions_are_a_map_in_rerun(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CI", "1")
    monkeypatch.setenv("HOME", str(tmp_path))
    from rerun.chunk import McapReader

    index = np.arange(3)
    latitude = Column(np.array([10.0, 11.0, 12.0]), np.array([True, False, True]))
    columns = {"latitude_deg": latitude, "longitude_deg": Column(np.array([20.0, 21.0, 22.0]))}
    path = written(tmp_path / "a.mcap", [RecordBatch("gnss", index, Column(index), columns, T0 + index * STEP_NS)])
    positions, times = [], []
    for chunk in McapReader(path).stream().to_chunks():
        rows = chunk.to_record_batch().to_pydict()
        if str(chunk.entity_path) == "/location_fix.gnss" and "GeoPoints:positions" in rows:
            positions += [row[0] for row in rows["GeoPoints:positions"]]
            times += [time.value for time in rows["timestamp"]]
    assert positions == [[10.0, 20.0], [12.0, 22.0]]
    assert times == [T0, T0 + 2 * STEP_NS]


@pytest.mark.parametrize("has_utc", [True, False])
def test_location_fix_has_a_timestamp_on_an_absolute_clock_only(tmp_path: Path, has_utc: bool) -> None:
    path = written(tmp_path / "a.mcap", [batch_of("gnss.2", 50)], StoreInfo(has_utc=has_utc))
    fixes = list(decoded(path, "location_fix.gnss.2"))
    assert fixes
    for log_time, _, fix in fixes:
        assert fix.HasField("timestamp") == has_utc
        if has_utc:
            assert fix.timestamp.ToNanoseconds() == log_time
