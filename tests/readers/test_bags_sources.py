"""Who wrote a topic, and what a fix says: sources by their channels, no position at 0, 0, sigmas of covariances."""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mcap.writer import Writer as McapWriter
from rosbags.rosbag1 import Writer as Ros1Writer

from groundstation.base.records import Damage, RecordBatch, Remark
from groundstation.pipeline.one_flight.convert import convert_log
from groundstation.pipeline.one_flight.flight import read_flight
from groundstation.pipeline.one_flight.log import open_log
from groundstation.readers import registry
from groundstation.tables.table import Flight
from tests.readers.bag_writer import LAG_NS, START_NS, Messages, write_ros1, write_ros2
from tests.readers.test_contract import check
from tests.real_logs import real_log

NS = 10**9
APART_DEG = 5e-5  # some five metres


def flight_of(path: Path) -> Flight:
    mcap = path.parent / "converted.mcap"
    mcap.unlink(missing_ok=True)
    return read_flight(mcap, convert_log(open_log(path), mcap))


def mapped(path: Path) -> str:
    found = list(registry.read(path))
    check(found)
    return next(item.text for item in found if isinstance(item, Remark) and item.code == "mapped")


def fixes(rows: int, first: int = 0, *, north_deg: float = 55.0) -> list[tuple[int, Any]]:
    """Log time and fix, once a second."""
    messages = Messages(is_ros1=True)
    for row in range(first, first + rows):
        messages.fix("/fix", START_NS + row * NS, (north_deg + row * 1e-5, 37.0, 100.0))
    return [(time_ns, message) for _topic, time_ns, message in messages.rows]


def written(path: Path, nodes: Sequence[tuple[str, list[tuple[int, Any]]]]) -> Path:
    """A bag of ROS 1 in which each node has a connection of its own on one topic."""
    types = Messages(is_ros1=True).types
    with Ros1Writer(path) as writer:
        rows = []
        for name, messages in nodes:
            kind = messages[0][1].__msgtype__
            connection = writer.add_connection("/fix", kind, typestore=types, callerid=name)
            rows += [(time_ns, connection, types.serialize_ros1(message, kind)) for time_ns, message in messages]
        for time_ns, connection, data in sorted(rows, key=lambda row: row[0]):
            writer.write(connection, time_ns, data)
    return path


@pytest.mark.parametrize("names", [("/left", "/right"), ("/right", "/left"), ("/node_9", "/node_10")])
def test_two_nodes_on_one_topic_are_two_receivers(tmp_path: Path, names: tuple[str, str]) -> None:
    """Five metres apart, half a second after each other: taken as one they are a zigzag of ten metres a second."""
    other = [(time_ns + NS // 2, message) for time_ns, message in fixes(60, north_deg=55.0 + APART_DEG)]
    path = written(tmp_path / "a.bag", [(names[0], fixes(60)), (names[1], other)])
    order = sorted(names, key=lambda name: (len(name), name))
    assert mapped(path) == f"gnss.1 from /fix ({order[0]}); gnss.2 from /fix ({order[1]})"
    flight = flight_of(path)
    assert {"gnss.1", "gnss.2", "raw.fix"} == set(flight.topics())
    for number, name in enumerate(order, start=1):
        latitude = flight[f"gnss.{number}"].values("latitude_deg")
        first = 55.0 if name == names[0] else 55.0 + APART_DEG
        assert np.abs(latitude - first - np.arange(60) * 1e-5).max() < 1e-9
    writers = flight["raw.fix"].columns["publisher"].values
    assert len(writers) == 120 and (writers[::2] == names[0]).all() and (writers[1::2] == names[1]).all()


def test_a_node_that_was_started_again_is_one_receiver(tmp_path: Path) -> None:
    path = written(tmp_path / "a.bag", [("/gps", fixes(40)), ("/gps_2", fixes(40, 43)), ("/gps_3", fixes(20, 85))])
    assert mapped(path) == "gnss from /fix"
    flight = flight_of(path)
    assert len(flight["gnss"]) == 100 and "publisher" not in flight["raw.fix"].columns


def test_two_messages_of_an_old_node_make_no_second_receiver(tmp_path: Path) -> None:
    """While it ends the new one begins."""
    path = written(tmp_path / "a.bag", [("/gps", fixes(42)), ("/gps_2", fixes(40, 40))])
    assert mapped(path) == "gnss from /fix"


def test_of_two_receivers_the_one_that_starts_again_goes_on(tmp_path: Path) -> None:
    other = fixes(100, north_deg=56.0)
    path = written(tmp_path / "a.bag", [("/a", fixes(40)), ("/b", other), ("/c", fixes(50, 45))])
    flight = flight_of(path)
    sizes = {topic: len(flight[topic]) for topic in ("gnss.1", "gnss.2")}
    assert sizes == {"gnss.1": 90, "gnss.2": 100}


def channels(path: Path, several: Sequence[tuple[dict[str, str], Sequence[int]]], *, rows: int = 60) -> Path:
    """An MCAP of several channels of one topic with fixes in JSON, each at the rows that it has."""
    with path.open("wb") as stream:
        writer = McapWriter(stream)
        writer.start()
        schema = writer.register_schema("foxglove.LocationFix", "jsonschema", b"{}")
        numbers = [writer.register_channel("/fix", "json", schema, metadata) for metadata, _rows in several]
        for row in range(rows):
            for place, (_metadata, own) in enumerate(several):
                if row in own:
                    stamp_ns = START_NS + row * NS + place * NS // 10
                    stamp = {"sec": stamp_ns // NS, "nsec": stamp_ns % NS}
                    place_deg = {"latitude": 55.0 + place, "longitude": 37.0, "altitude": 9.0}
                    data = json.dumps({"timestamp": stamp, "frame_id": "g", **place_deg}).encode()
                    writer.add_message(numbers[place], stamp_ns + LAG_NS, data, stamp_ns + LAG_NS, row)
        writer.finish()
    return path


def test_channels_of_one_topic_are_sources_where_they_interlace(tmp_path: Path) -> None:
    both = range(60)
    path = channels(tmp_path / "a.mcap", [({"callerid": "/b"}, both), ({"callerid": "/a"}, both)])
    assert mapped(path) == "gnss.1 from /fix (/a); gnss.2 from /fix (/b)"
    path = channels(tmp_path / "b.mcap", [({"qos": "1"}, range(30)), ({"qos": "2"}, range(30, 60))])
    assert mapped(path) == "gnss from /fix"
    flight = flight_of(path)
    assert np.unique(flight["gnss"].values("latitude_deg")).tolist() == [55.0, 56.0]


@pytest.mark.real_log
def test_the_recorded_case_of_two_publishers() -> None:
    path = real_log("cases/m2_two_publishers.mcap")
    assert mapped(path) == "gnss.1 from /fix (channel 1); gnss.2 from /fix (channel 3)"
    rows = {item.topic: len(item) for item in registry.read(path) if isinstance(item, RecordBatch)}
    assert rows == {"gnss.1": 120, "gnss.2": 120, "raw.fix": 240}


def test_a_rule_of_a_profile_makes_a_topic_of_each_source(tmp_path: Path) -> None:
    rule = 'topic = "/fix"\n[messages.fields]\nlatitude = { field = "gnss.latitude_deg", unit = "deg" }\n'
    (tmp_path / "own.toml").write_text(f'name = "own"\n[[messages]]\n{rule}')
    path = channels(tmp_path / "a.mcap", [({"callerid": "/b"}, range(60)), ({"callerid": "/a"}, range(60))])
    topics = {item.topic for item in registry.read(path, tmp_path / "own.toml") if isinstance(item, RecordBatch)}
    assert topics == {"gnss.1", "gnss.2", "raw.fix"}


def test_topics_of_one_name_and_several_types_stay_apart(tmp_path: Path) -> None:
    import sqlite3

    messages = Messages()
    for row in range(20):
        messages.fix("/a", START_NS + row * NS, (55.0, 37.0, 1.0))
        messages.text("/b", START_NS + row * NS, "x")
    folder = write_ros2(tmp_path / "bag", messages, "sqlite3")
    path = next(folder.glob("*.db3"))
    database = sqlite3.connect(path)
    with database:
        database.execute("DELETE FROM metadata")
        database.execute("UPDATE topics SET name = '/same'")
    database.close()
    found = list(registry.read(path))
    check(found)
    topics = {item.topic for item in found if isinstance(item, RecordBatch)}
    assert topics == {"gnss", "raw.same", "raw.same_2"} and not [item for item in found if isinstance(item, Damage)]


def covered(kind: int, covariance: Sequence[float]) -> Messages:
    """Fixes: the first ten at 0, 0, the next ten on the equator, all with a covariance."""
    messages = Messages()
    for row in range(20):
        status = messages.make("sensor_msgs/msg/NavSatStatus", 0, 1)
        place = (0.0, 0.0, 0.0) if row < 10 else (0.0, 37.0, 10.0)
        header = messages.header(START_NS + row * NS, "gnss")
        fix = messages.make("sensor_msgs/msg/NavSatFix", header, status, *place, np.array(covariance), kind)
        messages.add("/fix", START_NS + row * NS, fix)
    return messages


COVARIANCE = (4.0, 0.0, 0.0, 0.0, 5.0, 0.0, 0.0, 0.0, 16.0)


def test_zeros_are_no_position_and_are_counted(tmp_path: Path) -> None:
    path = write_ros2(tmp_path / "bag", covered(2, COVARIANCE)) / "metadata.yaml"
    found = list(registry.read(path))
    check(found)
    (damage,) = [item for item in found if isinstance(item, Damage)]
    assert (damage.count, damage.topic, damage.loses_data) == (10, "gnss", False) and "0" in damage.what
    flight = flight_of(path.parent)
    gnss, raw = flight["gnss"], flight["raw.fix"]
    for field in ("latitude_deg", "longitude_deg", "altitude_ellipsoid_m", "horizontal_sigma_m", "vertical_sigma_m"):
        assert np.isnan(gnss.values(field)[:10]).all() and not np.isnan(gnss.values(field)[10:]).any(), field
    assert gnss.values("longitude_deg")[10] == 37.0 and gnss.values("latitude_deg")[10] == 0.0, "a place on the equator"
    assert not gnss.columns["integrity_ok"].values[:10].any() and gnss.columns["integrity_ok"].values[10:].all()
    assert (raw.values("latitude")[:10] == 0.0).all(), "as the device wrote it"


@pytest.mark.parametrize(
    ("kind", "covariance", "horizontal_m", "vertical_m"),
    [
        (0, COVARIANCE, None, None),
        (1, COVARIANCE, 3.0, 4.0),
        (2, COVARIANCE, 3.0, 4.0),
        (3, COVARIANCE, 3.0, 4.0),
        (2, [0.0] * 9, None, None),
        (2, [4.0, 0.0, 0.0, 0.0, 5.0, 0.0, 0.0, 0.0, 0.0], 3.0, None),
        (2, [-1.0] + [0.0] * 8, None, None),
        (2, [np.nan] * 9, None, None),
    ],
)
def test_covariances_that_are_known_become_sigmas(
    tmp_path: Path, kind: int, covariance: Sequence[float], horizontal_m: float | None, vertical_m: float | None
) -> None:
    gnss = flight_of(write_ros2(tmp_path / "bag", covered(kind, covariance)))["gnss"]
    for name, value in (("horizontal_sigma_m", horizontal_m), ("vertical_sigma_m", vertical_m)):
        assert gnss.has(name) == (value is not None), name
        assert value is None or gnss.values(name)[-1] == pytest.approx(value)


@pytest.mark.real_log
def test_the_recorded_case_of_zeros() -> None:
    damages = [item for item in registry.read(real_log("cases/m3_zero_fix.mcap")) if isinstance(item, Damage)]
    assert [(one.count, one.loses_data) for one in damages] == [(30, False)]


def test_a_text_where_a_number_should_be_maps_nothing(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    with path.open("wb") as stream:
        writer = McapWriter(stream)
        writer.start()
        schema = writer.register_schema("foxglove.LocationFix", "jsonschema", b"{}")
        channel = writer.register_channel("/fix", "json", schema)
        for row in range(5):
            data = json.dumps({"latitude": "55.5", "longitude": "x", "position_covariance_type": "KNOWN"}).encode()
            writer.add_message(channel, START_NS + row, data, START_NS + row)
        writer.finish()
    found = list(registry.read(path))
    check(found)
    assert {item.topic for item in found if isinstance(item, RecordBatch)} == {"raw.fix"}


def test_one_bag_of_ros_1_stays_as_it_was(tmp_path: Path) -> None:
    """One publisher each: no topic is numbered, nothing is told of publishers."""
    messages = Messages(is_ros1=True)
    for row in range(20):
        messages.fix("/gps/fix", START_NS + row * NS, (55.0, 37.0, 1.0))
    path = write_ros1(tmp_path / "a.bag", messages)
    assert mapped(path) == "gnss from /gps/fix"
