"""The ULog reader against pyulog: every value of every topic of recorded logs, and the text and parameters beside."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from groundstation.integrity import corrected, survey
from groundstation.readers import registry
from tests.readers.test_ulog import Read
from tests.real_logs import real_log

pyulog = pytest.importorskip("pyulog")

LOGS = [
    "ulog/Proto_FLT09_REENCODED_fixedwing.ulg",
    "ulog/pyulog_sample.ulg",
    "ulog/pyulog_sample_log_small_vtol.ulg",
    "ulog/quadrotor_local.ulg",
    "ulog/sample_px4_events.ulg",
    "damaged/sample_appended_multiple.ulg",
    "damaged/sample_unordered.ulg",
]


def joined(found: Read, topic: str, name: str) -> Any:
    return np.concatenate([batch.columns[name].values for batch in found.batches[topic]])


def assert_topics_equal(found: Read, peer: Any) -> int:
    """Every topic, field and value is the same; returns how many values there were."""
    raw = {topic for topic in found.batches if topic.startswith("raw.") and not topic.startswith("raw.ulog.")}
    theirs = {f"raw.{data.name}" + (f".{data.multi_id}" if data.multi_id else ""): data for data in peer.data_list}
    assert raw == set(theirs)
    values = 0
    for topic, data in theirs.items():
        fields = [name for name in data.data if "_padding" not in name]
        assert set(fields) - {"timestamp"} == set(found.batches[topic][0].columns)
        times = np.concatenate([batch.device_time_ns.values for batch in found.batches[topic]])
        np.testing.assert_array_equal(times // 1000, data.data["timestamp"])
        for name in set(fields) - {"timestamp"}:
            np.testing.assert_array_equal(joined(found, topic, name), data.data[name], err_msg=f"{topic}.{name}")
            values += len(data.data[name])
    return values


@pytest.mark.real_log
@pytest.mark.parametrize("name", LOGS)
def test_every_value_equals_pyulogs(name: str) -> None:
    path = real_log(name)
    found, peer = Read(path), pyulog.ULog(str(path))
    assert assert_topics_equal(found, peer) > 10_000
    texts = [] if "raw.ulog.text" not in found.batches else found.values("raw.ulog.text", "text")
    assert texts == [line.message.strip() for line in peer.logged_messages]
    if peer.initial_parameters:
        names, kinds = found.values("raw.ulog.parameters", "name"), found.values("raw.ulog.parameters", "kind")
        numbers = found.values("raw.ulog.parameters", "value")
        initial = {name: value for name, kind, value in zip(names, kinds, numbers, strict=True) if kind == "initial"}
        assert initial == pytest.approx(peer.initial_parameters)
        assert kinds.count("changed") == len(peer.changed_parameters)
    lasting = found.values("raw.ulog.dropouts", "duration_ms") if peer.dropouts else []
    assert lasting == [dropout.duration for dropout in peer.dropouts]


@pytest.mark.real_log
@pytest.mark.parametrize("name", LOGS)
def test_the_clock_of_recorded_logs_has_no_steps(name: str) -> None:
    path = real_log(name)
    found = survey(registry.read(path))
    assert not found.clock.steps and found.clock.has_times
    assert found.clock.is_unordered == ("unordered" in name)
    first = min(
        int(batch.time_ns[0]) for batch in corrected(registry.read(path), found.clock) if batch.time_ns is not None
    )
    last = max(topic.last_ns for topic in found.ledger.topics)
    seconds = {"Proto": 531, "pyulog_sample.": 69, "small_vtol": 7, "quadrotor": 94, "px4_events": 31, "appended": 10}
    expected = next((length for key, length in seconds.items() if key in path.name), 69)
    assert (last - first) / 1e9 == pytest.approx(expected, abs=1.5), "old values do not stretch the flight"


@pytest.mark.real_log
def test_facts_of_the_fixed_wing_flight() -> None:
    found = Read(real_log(LOGS[0]))
    assert found.rows("raw.vehicle_attitude") == 47_116 and found.rows("gnss") == 2_622
    assert found.header.utc_of_zero_ns is not None and not found.damages
    heading, north = (
        np.array(found.values("ins", name), dtype=float) for name in ("true_heading_deg", "velocity_north_mps")
    )
    assert np.isfinite(heading).sum() == 47_116 and np.isfinite(north).sum() == 5_157


@pytest.mark.real_log
def test_compressed_logs_give_the_same(tmp_path: Path) -> None:
    import gzip

    import zstandard

    path = real_log(LOGS[5])
    data, whole = path.read_bytes(), Read(path)
    for name, packed in (("a.gz", gzip.compress(data, 1)), ("b.zst", zstandard.compress(data))):
        (tmp_path / name).write_bytes(packed)
        found = Read(tmp_path / name)
        assert {topic: found.times_us(topic) for topic in found.batches} == {
            topic: whole.times_us(topic) for topic in whole.batches
        }
