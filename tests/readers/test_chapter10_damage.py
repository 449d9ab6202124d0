"""Damage inside one packet of a recording costs that packet alone."""

from pathlib import Path

import numpy as np
import pytest

from groundstation.base.records import LogHeader, RecordBatch, Remark
from groundstation.readers import registry
from groundstation.simulation.chapter10_writer import write_chapter10
from groundstation.simulation.flight import simulate
from groundstation.simulation.scenario import load_scenario
from tests.fuzz.bases import chapter10_starts
from tests.readers import chapter10_packets as made

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


def test_a_packet_that_lost_whole_others_costs_itself_alone(recorded: bytes, tmp_path: Path) -> None:
    """Bytes are lost from the setup on, so that another packet ends where the setup would."""
    starts = list(chapter10_starts(recorded))
    length = int.from_bytes(recorded[4:8], "little")
    kept = next(at for at in starts if at - starts[20] >= length - 400)
    torn = recorded[:400] + recorded[kept - (length - 400) :]
    (tmp_path / "whole").write_bytes(recorded)
    (tmp_path / "torn").write_bytes(torn)
    behind = [at for at in starts if at >= kept - (length - 400) and recorded[at + 15] == BUS_1553]
    expected = [int.from_bytes(recorded[at + 28 : at + 34], "little") * 100 for at in behind]  # of the first messages
    assert set(expected) <= set(message_times(tmp_path / "torn").tolist())


@pytest.mark.parametrize("year", ["0204", "2511", "9999"])
def test_a_year_of_no_recording_is_not_known(tmp_path: Path, year: str) -> None:
    setup = made.tmats(f"G\\OD:05/07/{year};")
    packets = made.packet(0, 0x01, setup, 0), made.packet(1, 0x11, made.time_of_day(100, 43_200), 0)
    (tmp_path / "x").write_bytes(b"".join(packets))
    header, *items = registry.read(tmp_path / "x")
    assert isinstance(header, LogHeader)
    assert header.utc_of_zero_ns is None
    assert "year_unknown" in {item.code for item in items if isinstance(item, Remark)}
