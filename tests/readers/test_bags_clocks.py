"""Three clocks of a bag: the smooth, plausible one is believed, whatever is set, slips or arrives in bursts."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mcap.writer import Writer as McapWriter
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as Ros2Writer

from groundstation.pipeline.one_flight.convert import Converted, convert_log
from groundstation.pipeline.one_flight.flight import read_flight
from groundstation.pipeline.one_flight.log import open_log
from groundstation.readers.two_clocks import ClockReadings, stretches_of
from groundstation.tables.table import Flight
from tests.readers.bag_writer import LAG_NS, START_NS, Messages

NS = 10**9
ROWS = 120
FIX_NS = START_NS + np.arange(ROWS) * NS
IMU_NS = START_NS + np.arange(10 * ROWS) * NS // 10 + 3_000_000
TEXT_NS = START_NS + np.arange(2 * ROWS) * NS // 2 + 7_000_000  # texts have no header
UNSET_NS = START_NS - 60 * NS  # what a computer's clock that was never set is behind
SAME_NS = 1_000  # of times that must be equal
Clock = Callable[[Any], Any]


def right(time_ns: Any) -> Any:
    return time_ns


def set_at(row: int, by_ns: int) -> Clock:
    """A clock that is behind by so much until it is set, just before the fix of a row."""
    return lambda time_ns: np.where(time_ns < FIX_NS[row] - NS // 2, time_ns - by_ns, time_ns)


def slipping(rows: list[int], by_ns: int) -> Clock:
    """A clock that is read wrong at some fixes."""
    return lambda time_ns: np.where(np.isin(time_ns, FIX_NS[rows]), time_ns + by_ns, time_ns)


def written(folder: Path, log: Clock, fix: Clock = right, imu: Clock = right, late: Clock = right) -> Path:
    """A bag in the order in which its messages were made, with log times and stamps by clocks of their own."""
    messages, made = Messages(), []
    for number, time_ns in enumerate(FIX_NS):
        messages.fix("/fix", int(fix(time_ns)), (55.0 + number * 1e-5, 37.0, 9.0))
        made.append(time_ns)
    for time_ns in IMU_NS:
        messages.imu("/imu", int(imu(time_ns)), (0.0, 0.0, 0.0, 1.0), (0.1, 0.2, 0.3), (1.0, 2.0, 9.8))
        made.append(time_ns)
    for time_ns in TEXT_NS:
        messages.text("/text", int(time_ns), "x")
        made.append(time_ns)
    with Ros2Writer(folder, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        connections: dict[str, Any] = {}
        for at in np.argsort(made, kind="stable").tolist():
            topic, _time_ns, message = messages.rows[at]
            kind = message.__msgtype__
            if topic not in connections:
                connections[topic] = writer.add_connection(topic, kind, typestore=messages.types)
            logged_ns = int(log(late(np.int64(made[at])))) + LAG_NS
            writer.write(connections[topic], logged_ns, messages.types.serialize_cdr(message, kind))
    return folder


def converted(path: Path) -> tuple[Flight, Converted]:
    found = convert_log(open_log(path), path.parent / "out.mcap")
    return read_flight(path.parent / "out.mcap", found), found


def expect(flight: Flight, found: Converted, *, lag_ns: int = 0) -> None:
    """Fixes and attitudes are valid when they were made, at their own rates, without gaps."""
    for topic, made_ns, rate_hz in (("gnss", FIX_NS, 1.0), ("ins", IMU_NS, 10.0)):
        assert np.abs(flight[topic].time_ns - made_ns - lag_ns).max() <= SAME_NS, topic
        entry = found.info.ledger.topics[topic]
        assert entry.nominal_rate_hz == pytest.approx(rate_hz) and not entry.gaps.count and not entry.duplicates


YEARS = UNSET_NS
CASES: dict[str, dict[str, Clock]] = {
    "set once, 1970 before": {"log": set_at(40, YEARS)},
    "set once, 1970 before, stamps of the attitude by the same clock": {
        "log": set_at(40, YEARS),
        "imu": set_at(40, YEARS),
    },
    "set early": {"log": set_at(3, YEARS)},
    "set late": {"log": set_at(100, YEARS)},
    "set back": {"log": set_at(50, -5 * NS // 2)},
    "set ahead": {"log": set_at(50, 35 * NS)},
    "set twice": {"log": lambda time_ns: set_at(30, YEARS)(set_at(80, -7 * NS)(time_ns))},
    "never set": {"log": lambda time_ns: time_ns - UNSET_NS},
    "two log times wrong": {"log": slipping([30, 70], -YEARS)},
    "two log times ahead": {"log": slipping([30, 70], 400 * 86_400 * NS)},
    "two stamps wrong": {"log": right, "fix": slipping([30, 70], -YEARS)},
    "three stamps ahead": {"log": right, "fix": slipping([30, 31, 70], 10**6 * NS)},
    "stamps of the receiver begin at another date": {"log": right, "fix": set_at(40, 40 * 365 * 86_400 * NS)},
}


@pytest.mark.parametrize("case", CASES)
def test_values_are_valid_when_they_were_made(tmp_path: Path, case: str) -> None:
    flight, found = converted(written(tmp_path / "bag", **CASES[case]))
    expect(flight, found)
    assert found.info.has_utc and flight["gnss"].columns["latitude_deg"].values[1] == 55.00001
    if case != "never set":  # then nothing tells when a text was logged, but for a lag
        assert np.abs(flight["raw.text"].time_ns - TEXT_NS - LAG_NS).max() <= SAME_NS
    else:
        assert np.abs(flight["raw.text"].time_ns - TEXT_NS).max() <= LAG_NS


@pytest.mark.parametrize("case", ["set once, 1970 before", "set back", "set ahead", "never set"])
def test_log_times_are_kept_as_they_were_read(tmp_path: Path, case: str) -> None:
    flight, found = converted(written(tmp_path / "bag", **CASES[case]))
    log = CASES[case]["log"]
    assert (flight["gnss"].device_time_ns.values == log(FIX_NS) + LAG_NS).all()
    told = next(
        one["text"] for one in found.info.remarks if one["code"] == "clock_used" and "log time was" in one["text"]
    )
    assert "never set" in told if case == "never set" else "set by" in told


@pytest.mark.parametrize("still_ns", [0, 5 * NS, START_NS])
def test_a_log_time_that_stands_still_is_no_time(tmp_path: Path, still_ns: int) -> None:
    flight, found = converted(written(tmp_path / "bag", log=lambda time_ns: np.full(np.shape(time_ns), still_ns)))
    for topic, made_ns in (("gnss", FIX_NS), ("ins", IMU_NS)):
        assert np.abs(flight[topic].time_ns - made_ns).max() <= SAME_NS
    assert any("log time stands still" in one["text"] for one in found.info.remarks)


def test_a_clock_that_all_stamps_follow_is_moved_to_go_on(tmp_path: Path) -> None:
    """Nothing tells how long the step took: a nominal period of the log is left between."""
    clock = set_at(40, YEARS)
    flight, found = converted(written(tmp_path / "bag", clock, fix=clock, imu=clock))
    assert np.abs(flight["gnss"].time_ns - FIX_NS).max() <= NS // 10
    assert np.abs(flight["ins"].time_ns - IMU_NS).max() <= NS // 10
    assert found.info.has_utc and len(found.info.clock.steps) == 1


@pytest.mark.parametrize("period_s", [3, 5, 20])
def test_messages_that_were_logged_in_bursts_are_valid_at_their_stamps(tmp_path: Path, period_s: int) -> None:
    def late(time_ns: Any) -> Any:
        whole = (time_ns - START_NS) // (period_s * NS) * period_s * NS
        return START_NS + whole + period_s * NS + (time_ns - START_NS - whole) // 1_000

    flight, found = converted(written(tmp_path / "bag", right, late=late))
    expect(flight, found)
    odd = {finding.code for finding in found.findings if finding.severity != "info"}
    assert odd <= {"clock.offset"}, "a fix a second is logged a second after its stamp at least"


def test_one_stall_of_the_recorder_is_no_gap(tmp_path: Path) -> None:
    def late(time_ns: Any) -> Any:
        is_waiting = (time_ns > FIX_NS[60]) & (time_ns < FIX_NS[72])
        return np.where(is_waiting, FIX_NS[72] + (time_ns - FIX_NS[60]) // 1_000, time_ns)

    expect(*converted(written(tmp_path / "bag", right, late=late)))


@pytest.mark.parametrize("rate", [1.1, 0.9])
def test_stamps_of_a_clock_that_runs_at_another_rate_are_not_believed(tmp_path: Path, rate: float) -> None:
    def away(time_ns: Any) -> Any:
        return START_NS + ((time_ns - START_NS) * rate).astype(np.int64)

    flight, found = converted(written(tmp_path / "bag", right, fix=away))
    expect(flight, found, lag_ns=LAG_NS)
    assert any(one["text"].startswith("log time is used") for one in found.info.remarks)


def test_publish_times_tell_the_time_where_the_log_time_tells_none(tmp_path: Path) -> None:
    """A recorder that wrote the time since its start; one that left the log time out."""
    for name, log in (("steady", lambda time_ns: time_ns - UNSET_NS), ("none", lambda _time_ns: 0)):
        path = tmp_path / name / "a.mcap"
        path.parent.mkdir()
        with path.open("wb") as stream:
            writer = McapWriter(stream)
            writer.start()
            schema = writer.register_schema("own", "jsonschema", b"{}")
            channel = writer.register_channel("/own", "json", schema)
            for time_ns in FIX_NS.tolist():
                writer.add_message(channel, log(time_ns), b'{"a": 1}', time_ns)
            writer.finish()
        flight, found = converted(path)
        assert found.info.has_utc and np.abs(flight["raw.own"].time_ns - FIX_NS).max() <= SAME_NS, name


@pytest.mark.parametrize("seed", range(12))
def test_steps_of_a_clock_are_found_among_late_readings(seed: int) -> None:
    """Readings wait up to 20 s, clocks drift by 50 ppm and slip; the receiver's is set, or the other starts again."""
    rng = np.random.default_rng(seed)
    count = int(rng.integers(600, 3_000))
    clock_ns = np.cumsum(rng.integers(NS // 20, NS // 2, count))
    at, size_s = int(rng.integers(50, count - 50)), float(rng.choice([-3_600.0, -20.0, 120.0, 1e8]))
    late_ns = (rng.exponential(0.05, count) * NS).astype(np.int64)
    for first in rng.integers(0, count - 200, 4).tolist():
        if abs(first - at) > 200:
            late_ns[first : first + 10] += round(rng.uniform(1, 20) * NS)
    receipt_ns = np.maximum.accumulate(clock_ns + (clock_ns * 50e-6).astype(np.int64) + late_ns) + 10**6 * NS
    is_receipt = seed % 2 == 0
    if is_receipt:
        receipt_ns[at:] += round(size_s * NS)
    else:
        clock_ns[at:] -= clock_ns[at]
    for slip in rng.integers(0, count, 2).tolist():
        (receipt_ns if is_receipt else clock_ns)[slip] = int(rng.integers(0, 2 * 10**18))
    readings = ClockReadings()
    for rows in np.array_split(np.arange(count), int(rng.integers(1, 9))):
        readings.take(rows, receipt_ns[rows], clock_ns[rows])
    found = stretches_of(readings.all(), receipt_step_s=10.0)
    assert [one.stepped for one in found] == ["", "receipt" if is_receipt else "clock"]
    assert abs(int(found[1].track.record_index[0]) - at) <= 2
