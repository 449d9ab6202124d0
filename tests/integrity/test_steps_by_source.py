"""Steps back of a topic that several messages feed are those of each message, not of their mixture."""

from pathlib import Path

import pytest

from groundstation.base.records import RecordBatch
from groundstation.integrity.survey import survey
from groundstation.readers import registry
from tests.readers.dataflash_writer import DataFlash
from tests.readers.telemetry_writer import START_US, Telemetry
from tests.real_logs import real_log


def mixed(tmp_path: Path, back_at: int = -1) -> Path:
    """Write twenty cycles; the filter's record is stamped before that of the attitude and written behind it."""
    made = DataFlash()
    made.define(2, "ATT", "QccC", "TimeUS,Roll,Pitch,Yaw")
    made.define(3, "XKF1", "Qfff", "TimeUS,VN,VE,VD")
    for row in range(20):
        time_us = 1_000_000 + row * 100_000 - (500_000 if row == back_at else 0)
        made.write("ATT", time_us, 100, 200, 9000)
        made.write("XKF1", time_us - 1_500, 1.0, 2.0, 3.0)
    path = tmp_path / "mixed.BIN"
    path.write_bytes(made.content)
    return path


def steps_back(path: Path) -> dict[str, int]:
    return {one.topic: one.backward_steps for one in survey(registry.read(path)).ledger.topics}


def test_records_that_are_written_behind_others_are_no_steps_back(tmp_path: Path) -> None:
    assert steps_back(mixed(tmp_path)) == {"ins": 0, "raw.ATT": 0, "raw.FMT": 0, "raw.XKF1": 0}


def test_a_clock_that_steps_back_is_counted_once_for_each_message(tmp_path: Path) -> None:
    assert steps_back(mixed(tmp_path, back_at=10)) == {"ins": 2, "raw.ATT": 1, "raw.FMT": 0, "raw.XKF1": 1}


def test_pieces_keep_their_sources(tmp_path: Path) -> None:
    (batch,) = [one for one in registry.read(mixed(tmp_path)) if isinstance(one, RecordBatch) and one.topic == "ins"]
    assert batch.sources is not None and len(set(batch.sources.tolist())) == 2
    taken = batch.take(slice(0, 20, 2))
    assert taken.sources is not None and len(set(taken.sources.tolist())) == 1


def test_telemetry_that_steps_back_is_counted(tmp_path: Path) -> None:
    log = Telemetry()
    for row in range(10):
        time_us = START_US + row * 100_000 - (300_000 if row == 6 else 0)
        log.add("attitude", row * 100, 0.1, -0.2, 1.0, 0.0, 0.0, 0.0, time_us=time_us)
    path = tmp_path / "a.tlog"
    path.write_bytes(log.data)
    assert steps_back(path) == {"ins": 1, "raw.ATTITUDE": 1}


@pytest.mark.real_log
def test_a_recorded_log_of_an_even_clock_has_no_steps_back() -> None:
    found = steps_back(real_log("dataflash/plane_4.2.3_pilot0004.BIN"))
    assert not any(found.values())
