"""Ranges of ultra-wideband radios in bags, as drivers publish them, by a profile."""

import re
from pathlib import Path

import numpy as np
import pytest
from rosbags.typesys import get_types_from_msg

from groundstation.base.errors import SettingsError
from groundstation.base.records import Remark
from groundstation.pipeline.one_flight.convert import convert_log
from groundstation.pipeline.one_flight.flight import read_flight
from groundstation.pipeline.one_flight.log import open_log
from groundstation.readers import registry
from groundstation.tables.table import Flight
from tests.readers.bag_writer import LAG_NS, START_NS, Messages, write_ros1, write_ros2

ROWS = 40
STEP_NS = 100_000_000
# Definitions as the drivers have them: a range in millimetres with both ends; a list of nodes with a range each.
RANGING = "int16 anchor_id\nint16 tag_id\nint32 range\nint32 seq\nfloat64 rss\nfloat64 error_estimation\n"
NODE = "uint8 role\nuint8 id\nfloat32 dis\nfloat32 fp_rssi\nfloat32 rx_rssi\n"
FRAME = "std_msgs/Header header\nuint8 role\nuint8 id\nuwb_msgs/Node[] nodes\n"
PROFILE = """
name = "radios"
[[messages]]
type = "uwb_msgs/Ranging"
[messages.ranges]
value = "range"
unit = "mm"
ends = ["anchor_id", "tag_id"]
own = ["5"]
names = { 1 = "A1", 2 = "A2", 6 = "R6" }
[[messages]]
type = "uwb_msgs/Frame"
[messages.ranges]
value = "nodes[*].dis"
ends = ["nodes[*].id"]
names = { 11 = "N11", 12 = "N12" }
[[messages]]
topic = "/uwb/range/*"
[messages.ranges]
value = "range"
ends = ["header.frame_id"]
names = { "anchor_3" = "N3", "anchor_4" = "N4" }
[[messages]]
topic = "/radio/mate"
[messages.ranges]
value = "range"
peer = "mate"
"""


def radios(*, is_ros1: bool) -> Messages:
    """A log of robot 5: it ranges to two anchors and to robot 6, hears two robots range, and has other radios."""
    messages = Messages(is_ros1)
    for name, text in (("Ranging", RANGING), ("Node", NODE), ("Frame", FRAME)):
        messages.types.register(get_types_from_msg(text, f"uwb_msgs/msg/{name}"))
    for row in range(ROWS):
        at_ns = START_NS + row * STEP_NS
        ends = [(1, 5), (2, 5), (5, 6), (6, 7), (9, 5)][row % 5]
        messages.add("/uwb", at_ns, messages.make("uwb_msgs/msg/Ranging", *ends, 12_345 + row, row, -80.0, 0.1), 0)
        distances = [(11, 3.5), (12, 7.25)] if row % 2 else [(12, 7.5)]
        nodes = [messages.make("uwb_msgs/msg/Node", 1, one, dis, -80.0, -81.0) for one, dis in distances]
        messages.add("/nodes", at_ns, messages.make("uwb_msgs/msg/Frame", messages.header(at_ns, "uwb"), 2, 5, nodes))
        for number, topic in ((3, "/uwb/range/a"), (4, "/uwb/range/b")):
            value = np.inf if row == 7 else 10.0 * number
            messages.add(topic, at_ns, range_of(messages, at_ns, f"anchor_{number}", value))
        messages.add("/radio/mate", at_ns, range_of(messages, at_ns, "radio", 0.0 if row == 3 else 2.5))
    return messages


def range_of(messages: Messages, at_ns: int, frame: str, value: float) -> object:
    more = () if messages.is_ros1 else (0.0,)
    kind = messages.types.types["sensor_msgs/msg/Range"]
    more = more[: len(kind.__dataclass_fields__) - 7]  # a variance in later distributions
    return messages.make("sensor_msgs/msg/Range", messages.header(at_ns, frame), 0, 0.1, 0.1, 100.0, value, *more)


@pytest.fixture(params=["ros1", "ros2"])
def log(request: pytest.FixtureRequest, tmp_path: Path) -> Path:
    if request.param == "ros1":
        return write_ros1(tmp_path / "a.bag", radios(is_ros1=True))
    return write_ros2(tmp_path / "bag", radios(is_ros1=False)) / "bag.mcap"


def flight_of(log: Path, tmp_path: Path, text: str = PROFILE) -> Flight:
    (tmp_path / "radios.toml").write_text(text)
    mcap = tmp_path / "out.mcap"
    return read_flight(mcap, convert_log(open_log(log, tmp_path / "radios.toml"), mcap))


def test_ranges_become_topics_of_their_peers(log: Path, tmp_path: Path) -> None:
    flight = flight_of(log, tmp_path)
    expected = {
        "link.A1": 1e-3 * (12_345 + np.arange(0, ROWS, 5)),
        "link.A2": 1e-3 * (12_345 + np.arange(1, ROWS, 5)),
        "link.R6": 1e-3 * (12_345 + np.arange(2, ROWS, 5)),  # 5 is the first end there
        "link.N11": np.full(ROWS // 2, 3.5),
        "link.N12": np.where(np.arange(ROWS) % 2, 7.25, 7.5),
        "link.N3": np.full(ROWS - 1, 30.0),  # infinite once: nothing answered
        "link.N4": np.full(ROWS - 1, 40.0),
        "link.mate": np.full(ROWS - 1, 2.5),  # 0 once
    }
    assert {topic for topic in flight.topics() if topic.startswith("link.")} == set(expected)
    for topic, value in expected.items():
        assert flight[topic].values("pseudorange_m") == pytest.approx(value, abs=1e-6), topic
    assert flight["link.N12"].time_ns[1] - START_NS in (STEP_NS, STEP_NS + LAG_NS)


def test_what_is_mapped_and_what_has_no_name_is_told(log: Path, tmp_path: Path) -> None:
    (tmp_path / "radios.toml").write_text(PROFILE)
    told = [one.text for one in registry.read(log, tmp_path / "radios.toml") if isinstance(one, Remark)]
    assert any(
        "ranges to A1, A2, R6 = range by anchor_id and tag_id x 0.001; no name for 7, 9" in text for text in told
    )
    assert any("ranges to N11, N12 = nodes[*].dis by nodes[*].id" in text for text in told)


@pytest.mark.parametrize(
    ("old", "new", "key"),
    [
        ('unit = "mm"', 'unit = "kg"', "messages[0].ranges.unit"),
        ('own = ["5"]\n', "", "messages[0].ranges.own"),
        ('value = "nodes[*].dis"', 'value = "dis"', "messages[1].ranges.value"),
        ('names = { 11 = "N11", 12 = "N12" }', "names = {}", "messages[1].ranges.names"),
        ('peer = "mate"', 'peer = "mate"\nown = ["1"]', "messages[3].ranges"),
        ('ends = ["anchor_id", "tag_id"]', 'ends = ["a", "b", "c"]', "messages[0].ranges.ends"),
    ],
)
def test_a_slip_in_a_rule_of_ranges_is_named(tmp_path: Path, old: str, new: str, key: str) -> None:
    log = write_ros1(tmp_path / "a.bag", radios(is_ros1=True))
    (tmp_path / "radios.toml").write_text(PROFILE.replace(old, new, 1))
    with pytest.raises(SettingsError, match=re.escape(f"radios.toml, {key}")):
        registry.identify(log, tmp_path / "radios.toml")
