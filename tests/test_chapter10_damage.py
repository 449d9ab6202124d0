"""Damage inside one packet of a recording costs that packet alone."""

from pathlib import Path

import numpy as np
import pytest

from groundstation.base.records import RecordBatch
from groundstation.readers import registry
from groundstation.simulation.chapter10_writer import write_chapter10
from groundstation.simulation.flight import simulate
from groundstation.simulation.scenario import load_scenario
from tests.fuzz.bases import chapter10_starts

BUS_1553 = 0x19


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    path = tmp_path_factory.mktemp("ch10") / "flight.ch10"
    write_chapter10(path, simulate(load_scenario("taxi-short")).flight)
    return path.read_bytes()


def message_times(path: Path) -> np.ndarray:
    batches = (item for item in registry.read(path) if isinstance(item, RecordBatch))
    return np.concatenate([one.device_time_ns.values for one in batches if one.topic.startswith("raw.bus.1553.")])


@pytest.mark.parametrize("lost", [1, 3, 5, 11, 23, 24, 25, 60])
def test_bytes_lost_in_a_packet_cost_no_other(recorded: bytes, tmp_path: Path, lost: int) -> None:
    """The header that follows begins before the damaged packet's end by its length, by less than its own or by more."""
    starts = [at for at in chapter10_starts(recorded) if recorded[at + 15] == BUS_1553]
    at = starts[len(starts) // 2] + 40
    (tmp_path / "whole").write_bytes(recorded)
    (tmp_path / "torn").write_bytes(recorded[:at] + recorded[at + lost :])
    whole, torn = message_times(tmp_path / "whole"), message_times(tmp_path / "torn")
    of_packet = int.from_bytes(recorded[at - 16 : at - 13], "little")  # its number of messages
    assert len(torn) == len(whole) - of_packet
    assert np.isin(torn, whole).all()


def test_bytes_added_in_a_packet_cost_no_other(recorded: bytes, tmp_path: Path) -> None:
    starts = [at for at in chapter10_starts(recorded) if recorded[at + 15] == BUS_1553]
    at = starts[len(starts) // 2] + 40
    (tmp_path / "whole").write_bytes(recorded)
    (tmp_path / "longer").write_bytes(recorded[:at] + b"\x25\xeb" * 7 + recorded[at:])
    whole, longer = message_times(tmp_path / "whole"), message_times(tmp_path / "longer")
    assert len(longer) == len(whole) - int.from_bytes(recorded[at - 16 : at - 13], "little")
    assert np.isin(longer, whole).all()
