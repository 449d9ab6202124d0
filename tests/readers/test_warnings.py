"""Odd numbers in a log reach nobody as a warning of numpy: infinities, NaN that signal, numbers beyond all measure."""

import json
import warnings
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from mcap.writer import Writer as McapWriter

from groundstation.base.records import Item
from groundstation.readers import flat_csv, registry
from groundstation.readers.layout import velocity_from_track, wind_from_direction
from groundstation.readers.source import Source
from tests.readers.telemetry_writer import START_US, Telemetry
from tests.readers.test_contract import check
from tests.readers.trajectory_writer import sbet

ODD = ("inf", "-inf", "nan", "1e308", "1e999", "-1e308", "0", "1")


def read_in_silence(path: Path) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check(list(registry.read(path)))


def test_telemetry_with_odd_numbers(tmp_path: Path) -> None:
    log = Telemetry()
    for row in range(40):
        odd = float(ODD[row % len(ODD)])
        value = odd if abs(odd) < 1e38 or not np.isfinite(odd) else 3e38
        time_us = START_US + row * 100_000
        log.add("attitude", row * 100, value, value, value, value, value, value, time_us=time_us)
        log.add("wind", value, value, value, time_us=time_us)
        log.add("scaled_pressure", row * 100, value, value, 2_500, time_us=time_us)
        log.add("gps_raw_int", row * 100_000, 3, 550_000_000, 370_000_000, 0, 0, 0, 65_534, 65_534, 9, time_us=time_us)
    path = tmp_path / "a.tlog"
    path.write_bytes(log.data)
    read_in_silence(path)
    # A NaN that signals: no packer of Python writes one, so it is put into frames whose checksum is made anew.
    from groundstation.readers.tlog import scan
    from groundstation.readers.tlog.dialect import crc_extras

    data, at = bytearray(log.data), 0
    while at < len(data):
        size, number = data[at + 9], int.from_bytes(data[at + 15 : at + 18], "little")
        if number == 30 and size > 8:  # ATTITUDE: roll stands behind the time
            data[at + 22 : at + 26] = b"\1\0\xa0\x7f"
            end = at + 18 + size
            crc = scan._checksum(np.frombuffer(bytes(data), np.uint8), at + 9, end, int(crc_extras()[number]))
            data[end : end + 2] = int(crc).to_bytes(2, "little")
        at += 8 + 12 + size
    path.write_bytes(data)
    read_in_silence(path)


def test_a_bag_with_odd_numbers(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    with path.open("wb") as stream:
        writer = McapWriter(stream)
        writer.start()
        kinds = {
            "/fix": ("foxglove.LocationFix", ("latitude", "longitude", "altitude", "position_covariance_type")),
            "/pose": ("foxglove.PoseInFrame", ()),
        }
        numbers = {}
        for topic, (kind, _names) in kinds.items():
            schema = writer.register_schema(kind, "jsonschema", b"{}")
            numbers[topic] = writer.register_channel(topic, "json", schema)
        for row in range(60):
            odd, other = (float(ODD[(row * step) % len(ODD)]) for step in (1, 3))
            stamp = {"sec": START_US // 10**6 + row, "nsec": row}
            fix = {"timestamp": stamp, "latitude": odd, "longitude": other, "altitude": odd}
            fix |= {"position_covariance": [odd, 0, 0, 0, other, 0, 0, 0, odd], "position_covariance_type": 2}
            turn = dict.fromkeys("xyzw", odd)
            pose = {"timestamp": stamp, "pose": {"position": dict.fromkeys("xyz", other), "orientation": turn}}
            time_ns = START_US * 1_000 + row * 10**9
            for topic, message in (("/fix", fix), ("/pose", pose)):
                writer.add_message(numbers[topic], time_ns, json.dumps(message).encode(), time_ns)
        writer.finish()
    read_in_silence(path)


@pytest.mark.parametrize("log_ns", [0, 1, 2**62, 2**63 - 1, 2**64 - 1])
@pytest.mark.parametrize("second", [-(2**31), -1, 0, 2**31 - 1, 2**40])
def test_a_bag_with_odd_times(tmp_path: Path, log_ns: int, second: int) -> None:
    path = tmp_path / "a.mcap"
    with path.open("wb") as stream:
        writer = McapWriter(stream)
        writer.start()
        schema = writer.register_schema("foxglove.LocationFix", "jsonschema", b"{}")
        channel = writer.register_channel("/fix", "json", schema)
        for row in range(12):
            fix = {"timestamp": {"sec": second, "nsec": row}, "latitude": 55.0, "longitude": 37.0}
            time_ns = START_US * 1_000 + row if row % 3 else log_ns
            writer.add_message(channel, time_ns, json.dumps(fix).encode(), log_ns)
        writer.finish()
    read_in_silence(path)


def test_directions_that_are_infinite_give_nan() -> None:
    odd = np.array([np.inf, -np.inf, np.nan, 90.0])
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for function in (velocity_from_track, wind_from_direction):
            assert np.isnan(function(odd, np.full(4, 5.0))[0][:3]).all()
            function(np.full(4, 90.0), odd)


@pytest.mark.parametrize("number", [1e308, -1e308, np.inf, np.nan, np.finfo(np.float64).max, 5e-324])
@pytest.mark.parametrize("name", ["latitude", "longitude", "altitude", "time", "roll", "x_velocity", "wander_angle"])
def test_a_trajectory_with_odd_numbers(name: str, number: float, tmp_path: Path) -> None:
    rows = sbet(count=200)
    rows[name][[12, 90, 91]] = number
    path = tmp_path / "a.sbet"
    path.write_bytes(rows.tobytes())
    read_in_silence(path)


def test_what_a_reader_computes_of_odd_numbers_warns_nobody(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The kind: readers of others and those to come, too."""

    def warm(*_: object) -> float:
        return float((np.array([1e308, np.inf]) * 1e10 - np.inf)[0])

    sniff, read = flat_csv.sniff, flat_csv.read

    def reads(source: Source) -> Iterator[Item]:
        warm()
        for item in read(source):
            warm()
            yield item

    monkeypatch.setattr(flat_csv, "sniff", lambda source: warm() and sniff(source))
    monkeypatch.setattr(flat_csv, "read", reads)
    path = tmp_path / "a.csv"
    path.write_text("time_s,ins.roll_deg\n" + "".join(f"{row},1\n" for row in range(50)))
    read_in_silence(path)
    with warnings.catch_warnings(), pytest.raises(RuntimeWarning):
        warnings.simplefilter("error")
        warm()
