"""Telemetry logs: every field of every message equals pymavlink's own decoding; damage is placed and counted."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pymavlink.dialects.v10 import ardupilotmega as v1
from pymavlink.dialects.v20 import ardupilotmega as v2

from groundstation.base.records import Damage, RecordBatch, Remark
from groundstation.pipeline.one_flight.convert import convert_log
from groundstation.pipeline.one_flight.flight import read_flight
from groundstation.pipeline.one_flight.log import open_log
from groundstation.readers import registry
from groundstation.readers.source import Source
from groundstation.readers.tlog.dialect import messages
from tests.readers.telemetry_writer import START_US, Telemetry, telemetry
from tests.readers.test_contract import check

FLOAT32_DEG = 3e-5  # half a step of a float at two pi radians


def drawn(kind: Any, rng: np.random.Generator) -> list[Any]:
    """Values for all fields of a message, in the order of its constructor; some end with zeros."""
    values: list[Any] = []
    for name, type_name, place in zip(kind.fieldnames, kind.fieldtypes, kind.orders, strict=True):
        length = kind.array_lengths[place]
        if type_name == "char":
            values.append(bytes(rng.integers(65, 90, max(length // 2, 1), dtype=np.uint8)))
        else:
            many = [_number(type_name, rng) for _ in range(max(length, 1))]
            values.append(many if length else many[0])
        if name == "target_system":
            values[-1] = 1
    return values


def _number(type_name: str, rng: np.random.Generator) -> float | int:
    if rng.random() < 0.2:
        return 0
    if type_name in ("float", "double"):
        return float(np.float32(rng.normal()))
    bits = int("".join(letter for letter in type_name.split("_mavlink")[0] if letter.isdigit()))
    top = 1 << (bits - 1 if type_name.startswith("int") else min(bits, 63))
    return int(rng.integers(-top if type_name.startswith("int") else 0, top))


def parsed(data: bytes, dialect: Any) -> list[tuple[int, Any]]:
    """Time and message of each frame, by pymavlink."""
    reader, found, at = dialect.MAVLink(None), [], 0
    while at + 8 < len(data):
        time_us = int.from_bytes(data[at : at + 8], "big")
        end = at + 8 + (8 if data[at + 8] == 0xFE else 12) + data[at + 9]
        found.append((time_us, reader.decode(bytearray(data[at + 8 : end]))))
        at = end
    return found


@pytest.mark.parametrize("dialect", [v1, v2], ids=["version 1", "version 2"])
def test_every_field_of_every_message_equals_pymavlink(dialect: Any, tmp_path: Path) -> None:
    rng, log = np.random.default_rng(3), Telemetry(dialect)
    for number in sorted(dialect.mavlink_map):
        kind = dialect.mavlink_map[number]
        for _ in range(2):
            log.add(kind.msgname.lower(), *drawn(kind, rng))
    path = tmp_path / "a.tlog"
    path.write_bytes(log.data)
    found = list(registry.read(path))
    check(found)
    assert not [item for item in found if isinstance(item, Damage)]
    ours: dict[str, list[dict[str, Any]]] = {}
    for item in found:
        if isinstance(item, RecordBatch) and item.topic.startswith("raw."):
            for row in range(len(item)):
                values = {name: column.values[row] for name, column in item.columns.items()}
                ours.setdefault(item.topic, []).append(values | {"frame time": int(item.device_time_ns.values[row])})
    compared = 0
    for time_us, message in parsed(bytes(log.data), dialect):
        own = ours[f"raw.{message.msgname}"].pop(0)
        assert own["frame time"] == time_us * 1_000
        for name in message.fieldnames:
            value = getattr(message, name)
            for key, part in (
                [(f"{name}[{k}]", one) for k, one in enumerate(value)] if isinstance(value, list) else [(name, value)]
            ):
                assert own[key] == part or (math.isnan(own[key]) and math.isnan(part)), (message.msgname, key)
                compared += 1
    assert compared > 3_000


def test_sizes_are_those_of_the_wire() -> None:
    assert {number: one.dtype.itemsize for number, one in messages().items()} == {
        number: kind.unpacker.size for number, kind in v2.mavlink_map.items()
    }


def test_a_flight_is_mapped(tmp_path: Path) -> None:
    path = tmp_path / "a.tlog"
    path.write_bytes(telemetry().data)
    check(list(registry.read(path)))
    flight = read_flight(tmp_path / "a.mcap", convert_log(open_log(path), tmp_path / "a.mcap"))
    ins, gnss = flight["ins"], flight["gnss"]
    heading = ins.values("true_heading_deg")
    assert heading[np.isfinite(heading)][:3] == pytest.approx([350.0, 351.0, 352.0], abs=FLOAT32_DEG)
    assert np.nanmax(np.abs(ins.values("roll_deg") - np.rad2deg(0.1))) < 1e-6
    assert np.nanmin(ins.values("velocity_down_mps")) == pytest.approx(-0.5)
    assert np.isnan(gnss.values("latitude_deg")[0]), "no fix"
    assert gnss.values("latitude_deg")[1] == pytest.approx(55.0000005, abs=1e-12)
    assert gnss.values("velocity_east_mps")[1] == pytest.approx(5.0) and gnss.values("hdop")[1] == pytest.approx(1.2)
    assert gnss.values("altitude_ellipsoid_m")[1] == 214.0 and gnss.values("velocity_sigma_mps")[1] == 0.3
    assert flight["event"].columns["name"].values.tolist() == ["disarmed", "armed", "Landed; safely"]
    assert flight["event"].columns["severity"].values.tolist() == ["info", "info", "info"]
    assert ins.time_ns[0] == START_US * 1_000


def test_damage_costs_the_frames_it_touches(tmp_path: Path) -> None:
    log, path = telemetry(), tmp_path / "a.tlog"
    path.write_bytes(log.data)
    whole = sum(len(item) for item in registry.read(path) if isinstance(item, RecordBatch))
    data = bytearray(log.data)
    data[3_000:3_100] = bytes(100)
    path.write_bytes(b"".join([data[:5_000], b"noise", data[5_000:-7]]))
    found = list(registry.read(path))
    check(found)
    kinds = [item.kind for item in found if isinstance(item, Damage)]
    assert kinds == ["corrupt", "corrupt", "truncated"]
    rows = sum(len(item) for item in found if isinstance(item, RecordBatch))
    assert whole - 16 <= rows < whole


@pytest.mark.parametrize(("first", "count"), [(8, 514), (39, 3), (0, 30)])
def test_a_damaged_beginning_costs_the_frames_it_touches(tmp_path: Path, first: int, count: int) -> None:
    log, path = telemetry(), tmp_path / "a.bin"
    path.write_bytes(log.data)
    whole = sum(len(item) for item in registry.read(path) if isinstance(item, RecordBatch))
    path.write_bytes(log.data[:first] + log.data[first + count :])
    found = list(registry.read(path))
    check(found)
    assert [item.kind for item in found if isinstance(item, Damage)] == ["corrupt"]
    rows = sum(len(item) for item in found if isinstance(item, RecordBatch))
    assert whole - 3 * (2 + count // 30) <= rows < whole


def test_frames_of_others_are_told_apart(tmp_path: Path) -> None:
    log, other, path = telemetry(), Telemetry(system=255), tmp_path / "a.tlog"
    other.add("heartbeat", 6, 8, 128, 0, 4, 3, time_us=START_US)
    path.write_bytes(bytes(other.data) + bytes(log.data))
    found = list(registry.read(path))
    topics = {item.topic for item in found if isinstance(item, RecordBatch)}
    assert {"raw.HEARTBEAT", "raw.HEARTBEAT.255_1"} <= topics
    assert any(isinstance(item, Remark) and "times are those of receipt" in item.text for item in found)


def test_blocks_do_not_change_what_is_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from groundstation.readers.tlog import reader

    path = tmp_path / "a.tlog"
    path.write_bytes(b"x" * 3 + bytes(telemetry().data))
    told = []
    for size in (1 << 20, 1_000):
        monkeypatch.setattr(reader, "BLOCK_BYTES", size)
        found = list(reader.items(Source(path), "tlog"))
        check(found)
        rows = sum(len(item) for item in found if isinstance(item, RecordBatch))
        told.append((rows, [item for item in found if not isinstance(item, RecordBatch)]))
    assert told[0] == told[1]
