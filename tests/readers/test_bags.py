"""Robots' bags: values, frames, clocks, containers; every value of recorded ones equals rosbags' own decoding."""

import json
import re
import struct
from pathlib import Path

import numpy as np
import pytest
from mcap.writer import CompressionType
from mcap.writer import Writer as McapWriter
from rosbags.rosbag1 import Writer as Ros1Writer

from groundstation.base.errors import SettingsError
from groundstation.base.records import Damage, RecordBatch, Remark
from groundstation.pipeline.one_flight.convert import convert_log
from groundstation.pipeline.one_flight.flight import read_flight
from groundstation.pipeline.one_flight.log import open_log
from groundstation.readers import registry
from groundstation.readers.bags import definitions, shapes
from groundstation.readers.bags.bag import files_of
from groundstation.readers.bags.marks import METADATA
from groundstation.tables.table import Flight
from tests.readers.bag_values import decoded
from tests.readers.bag_writer import LAG_NS, START_NS, Messages, small_flight, write_ros1, write_ros2
from tests.readers.test_contract import check
from tests.real_logs import real_log

ROUNDING = 1e-12


def log_of(path: Path) -> Path:
    return path / METADATA if path.is_dir() else path


def flight_of(path: Path, folder: Path) -> Flight:
    mcap = folder / "converted.mcap"
    mcap.unlink(missing_ok=True)
    return read_flight(mcap, convert_log(open_log(path), mcap))


def written(folder: Path, form: str) -> Path:
    kind, _, more = form.partition("-")
    messages = small_flight(is_ros1=kind == "ros1")
    if kind == "ros1":
        return write_ros1(folder / "a.bag", messages, more)
    return write_ros2(folder / "bag", messages, kind, is_compressed=bool(more))


FORMS = ("ros1", "ros1-lz4", "ros1-bz2", "mcap", "mcap-zstd", "sqlite3", "sqlite3-zstd")


@pytest.mark.parametrize("form", FORMS)
def test_every_container_gives_the_same_flight(tmp_path: Path, form: str) -> None:
    path = written(tmp_path, form)
    check(list(registry.read(log_of(path))))
    flight = flight_of(path, tmp_path)
    ins, gnss = flight["ins"], flight["gnss"]
    assert len(ins) == 200 and len(gnss) == 20 and len(flight["odometry"]) == 20
    row = np.arange(200)
    assert (ins.time_ns == START_NS + row * 10**8).all(), "valid at the header stamp"
    assert (ins.device_time_ns.values == ins.time_ns + LAG_NS).all(), "log time is kept"
    heading = (350.0 + row) % 360.0
    assert np.abs((ins.values("true_heading_deg") - heading + 180.0) % 360.0 - 180.0).max() < 1e-10
    for name, value in {
        "roll_deg": 2.0,
        "pitch_deg": -3.0,
        "rate_x_dps": np.rad2deg(0.1),
        "rate_y_dps": -np.rad2deg(0.2),
        "rate_z_dps": -np.rad2deg(0.3),
        "accel_x_mps2": 1.0,
        "accel_y_mps2": -2.0,
        "accel_z_mps2": -9.8,
    }.items():
        assert np.abs(ins.values(name) - value).max() < 1e-10, name
    north = 10.0 * np.cos(np.deg2rad(-3.0)) * np.cos(np.deg2rad(heading))
    assert np.abs(ins.values("velocity_north_mps") - north).max() < 1e-10
    assert np.abs(ins.values("velocity_down_mps") - 10.0 * np.sin(np.deg2rad(3.0))).max() < 1e-10
    assert gnss.values("velocity_north_mps")[0] == 4.0 and gnss.values("velocity_east_mps")[0] == 3.0
    assert gnss.values("velocity_down_mps")[0] == 1.0 and not gnss.has("altitude_ellipsoid_m")
    latitude = gnss.values("latitude_deg")
    assert np.isnan(latitude[0]), "no fix, no position"
    assert latitude[1] == 55.0 + 10 * 1e-5
    assert flight["odometry"].values("turn_rate_dps")[0] == pytest.approx(-np.rad2deg(0.1), abs=ROUNDING)


@pytest.mark.parametrize("form", ["ros1", "mcap", "sqlite3"])
def test_raw_values_equal_those_of_rosbags(tmp_path: Path, form: str) -> None:
    compare(written(tmp_path, form))


def compare(path: Path) -> int:
    """Number of values compared; log time, name and value of each must agree."""
    expected, count = decoded(path), 0
    found: dict[str, list[tuple[int, dict[str, object]]]] = {}
    for item in registry.read(log_of(path)):
        if isinstance(item, RecordBatch) and item.topic.startswith("raw."):
            for row in range(len(item)):
                values = {name: column.values[row] for name, column in item.columns.items() if column.mask[row]}
                found.setdefault(item.topic, []).append((int(item.device_time_ns.values[row]), values))
    assert {f"raw.{topic.strip('/')}" for topic in expected} == found.keys()
    for topic, rows in expected.items():
        ours = sorted(found[f"raw.{topic.strip('/')}"], key=lambda row: row[0])
        assert [time for time, _values in ours] == [time for time, _values in rows]
        for (_time, own), (_same, theirs) in zip(ours, rows, strict=True):
            own.pop("bytes", None) if not theirs else None  # of a type without fields the length is kept
            assert own.keys() == theirs.keys()
            for name, value in theirs.items():
                assert own[name] == value or (value != value and own[name] != own[name]), (topic, name)
            count += len(theirs)
    return count


@pytest.mark.real_log
@pytest.mark.parametrize(
    ("name", "values"),
    [
        ("robot_localization_jackal_test2.bag", 394_780),
        ("pntos_120s_ros1.bag", 179_640),
        ("pntos_120s_ros2_mcap", 175_800),
        ("pntos_120s_ros2_sqlite", 175_800),
        ("rosbags_rs_94types_sqlite", 2_266),
        ("rosbags_rs_94types.mcap", 2_266),
        ("rosbag2_split_no_metadata/multiple_files_1.mcap", 1_324),
    ],
)
def test_recorded_bags_equal_rosbags(name: str, values: int) -> None:
    path = real_log(f"foreign/{name}")
    check(list(registry.read(log_of(path))))
    assert compare(path) == values


@pytest.mark.real_log
@pytest.mark.parametrize("name", ["ros1.bag", "ros2_mcap", "ros2_sqlite", "protobuf_none.mcap"])
def test_a_turned_drive_equals_what_it_was_made_from(name: str, tmp_path: Path) -> None:
    truth = flight_of(real_log("reference_heading/pntos_drive_first_half.csv"), tmp_path)
    bag = flight_of(real_log(f"foreign/pntos_120s_{name}"), tmp_path)
    compared = set()
    for topic in ("ins", "gnss"):
        there, here = truth[topic], bag[topic]
        rows = np.searchsorted(there.time_ns, here.time_ns)
        assert (there.time_ns[rows] == here.time_ns).all(), "header stamps, to the nanosecond"
        for field in set(here.columns) & set(there.columns):
            difference = here.values(field) - there.values(field)[rows]
            assert np.nanmax(np.abs((difference + 180.0) % 360.0 - 180.0)) < 1e-9, field
            compared.add(f"{topic}.{field}")
    assert {"ins.true_heading_deg", "ins.roll_deg", "ins.pitch_deg", "gnss.latitude_deg"} <= compared


def mcap(path: Path, channels: dict[str, tuple[str, str, str, bytes]], rows: list[tuple[str, int, bytes]]) -> Path:
    """An MCAP of channels (type, schema encoding, message encoding, schema) and rows (topic, log time, payload)."""
    with path.open("wb") as stream:
        writer = McapWriter(stream, compression=CompressionType.LZ4, chunk_size=4_000)
        writer.start()
        numbers = {}
        for topic, (kind, schema_encoding, encoding, schema) in channels.items():
            number = writer.register_schema(kind, schema_encoding, schema)
            numbers[topic] = writer.register_channel(topic, encoding, number)
        for row, (topic, time_ns, data) in enumerate(rows):
            writer.add_message(numbers[topic], time_ns, data, time_ns - 5, row)
        writer.finish()
    return path


def test_json_is_laid_flat(tmp_path: Path) -> None:
    rows = []
    for row in range(20):
        stamp = {"sec": START_NS // 10**9 + row, "nsec": 7}
        message = {
            "timestamp": stamp,
            "frame_id": "gnss",
            "latitude": 55 if row else 55.5,
            "longitude": 37.5,
            "x": None,
        }
        rows.append(("/fix", START_NS + row * 10**9 + 1000, json.dumps(message).encode()))
    rows.append(("/fix", START_NS + 10**11, b"{nothing"))
    path = mcap(tmp_path / "a.mcap", {"/fix": ("foxglove.LocationFix", "jsonschema", "json", b"{}")}, rows)
    found = list(registry.read(path))
    check(found)
    flight = flight_of(path, tmp_path)
    assert flight["gnss"].values("latitude_deg").tolist() == [55.5] + [55.0] * 19
    assert flight["gnss"].time_ns[1] == START_NS + 10**9 + 7
    lost = [item for item in found if isinstance(item, Damage)]
    assert [(damage.count, damage.topic) for damage in lost] == [(1, "raw.fix")]
    assert flight["raw.fix"].values("publish_time_ns")[0] == START_NS + 1000 - 5


def test_unknown_encodings_are_counted_and_their_bytes_told(tmp_path: Path) -> None:
    rows = [("/odd", START_NS + row, bytes(row + 1)) for row in range(5)]
    path = mcap(tmp_path / "a.mcap", {"/odd": ("a.B", "flatbuffer", "flatbuffer", b"abc")}, rows)
    found = list(registry.read(path))
    batches = [item for item in found if isinstance(item, RecordBatch)]
    assert np.concatenate([batch.columns["bytes"].values for batch in batches]).tolist() == [1, 2, 3, 4, 5]
    damage = next(item for item in found if isinstance(item, Damage))
    assert (damage.kind, damage.count, damage.loses_data) == ("dropped_channel", 5, True)
    assert "flatbuffer" in damage.what


def test_stamps_of_another_clock_are_not_believed(tmp_path: Path) -> None:
    messages = Messages()
    for row in range(20):
        messages.fix("/fix", START_NS + row * 10**9 - 35 * 10**9, (55.0, 37.0, 10.0))
    messages.rows = [(topic, time_ns + 35 * 10**9, message) for topic, time_ns, message in messages.rows]
    path = write_ros2(tmp_path / "bag", messages)
    remark = next(
        item for item in registry.read(path / METADATA) if isinstance(item, Remark) and item.code == "clock_used"
    )
    assert remark.text.startswith("log time is used") and "35.0" in remark.text
    assert flight_of(path, tmp_path)["gnss"].time_ns[0] == START_NS + LAG_NS


def test_two_receivers_are_two_topics_and_a_lone_velocity_is_none(tmp_path: Path) -> None:
    messages = Messages()
    for row in range(20):
        stamp_ns = START_NS + row * 10**9
        messages.fix("/left/fix", stamp_ns, (55.0, 37.0, 10.0))
        messages.fix("/right/fix", stamp_ns, (56.0, 37.0, 10.0))
        messages.twist("/cmd_vel", stamp_ns, (1.0, 0.0, 0.0))
    found = list(registry.read(write_ros2(tmp_path / "bag", messages) / METADATA))
    topics = {item.topic for item in found if isinstance(item, RecordBatch)}
    assert topics == {"gnss.1", "gnss.2", "raw.left/fix", "raw.right/fix", "raw.cmd_vel"}
    remarks = {item.code: item.text for item in found if isinstance(item, Remark)}
    assert remarks["mapped"] == "gnss.1 from /left/fix; gnss.2 from /right/fix"
    assert remarks["not_mapped"].startswith("/cmd_vel")


def test_files_of_a_split_bag_are_one_log_in_their_order(tmp_path: Path) -> None:
    parts = [small_flight(rows=200) for _ in range(2)]
    parts[0].rows = [row for row in parts[0].rows if row[1] < START_NS + 10**10]
    parts[1].rows = [row for row in parts[1].rows if row[1] >= START_NS + 10**10]
    whole = write_ros2(tmp_path / "whole", small_flight(rows=200))
    folder = tmp_path / "split"
    folder.mkdir()
    names = []
    for number, messages in enumerate(parts):
        made = next(write_ros2(tmp_path / f"part{number}", messages).glob("*.mcap"))
        names.append(made.rename(folder / f"split_{number}.mcap").name)
    lines = "".join(f"  - {name}\n" for name in names)
    (folder / METADATA).write_text(f"rosbag2_bagfile_information:\n  relative_file_paths:\n{lines}  version: 8\n")
    one, two = flight_of(whole, tmp_path), flight_of(folder, tmp_path)
    for topic in one.topics():
        assert (one[topic].time_ns == two[topic].time_ns).all()
    (folder / names[1]).unlink()
    damages = [item for item in registry.read(folder / METADATA) if isinstance(item, Damage)]
    assert len(damages) == 1 and names[1] in damages[0].place
    assert len(flight_of(folder, tmp_path)["ins"]) == 100


def test_metadata_names_no_file_elsewhere(tmp_path: Path) -> None:
    text = "rosbag2_bagfile_information:\n  relative_file_paths:\n    - /etc/passwd\n    - ../a.mcap\n    - b.mcap\n"
    (tmp_path / METADATA).write_text(text)
    assert [path.name for path in files_of(tmp_path / METADATA)] == ["b.mcap"]


def test_a_folder_walk_takes_a_bag_as_one_log(tmp_path: Path) -> None:
    from groundstation.pipeline.many_flights.inputs import collect

    write_ros2(tmp_path / "logs" / "bag", small_flight(rows=20))
    (tmp_path / "logs" / "other.csv").write_text("time_s,ins.roll_deg\n0,1\n")
    found = [item.path.relative_to(tmp_path / "logs").as_posix() for item in collect([tmp_path / "logs"])]
    assert found == ["bag/metadata.yaml", "other.csv"]
    log = open_log(tmp_path / "logs" / "bag")
    assert log.source.name == "bag" and log.source.size_bytes > (log.path.stat().st_size)


def test_types_that_a_file_does_not_define(tmp_path: Path) -> None:
    import sqlite3

    folder = write_ros2(tmp_path / "bag", small_flight(rows=50), "sqlite3")
    database = sqlite3.connect(next(folder.glob("*.db3")))
    with database:
        database.execute("DROP TABLE message_definitions")
    database.close()
    assert len(flight_of(folder, tmp_path)["ins"]) == 50, "common types are known"


def test_messages_without_a_number_are_left_out(tmp_path: Path) -> None:
    import sqlite3

    folder = write_ros2(tmp_path / "bag", small_flight(rows=50), "sqlite3")
    database = sqlite3.connect(next(folder.glob("*.db3")))
    with database:
        database.execute("CREATE TABLE copied AS SELECT * FROM messages")
        database.execute("DROP TABLE messages")
        database.execute("ALTER TABLE copied RENAME TO messages")
        count = database.execute("UPDATE messages SET id = 'x' || id WHERE id IN (3, 4)").rowcount
        whole = int(database.execute("SELECT count(*) FROM messages").fetchone()[0])
    database.close()
    assert count == 2 and rows_of(folder / METADATA)[0] == whole - count


def test_definitions_that_hold_themselves_or_lack_a_part_are_refused() -> None:
    for text in ("a/B x", "a/C x\n===\nMSG: a/C\na/B y", "float64", "nothing/Here x", "===\n"):
        with pytest.raises(definitions.DefinitionError):
            definitions.parse("a/B", text)


def test_a_message_is_walked_in_both_orders_of_bytes() -> None:
    found = definitions.parse("a/B", "uint8 a\nfloat64 b\nstring c\nint16[] d\nuint8 e")
    for order, mark in (("<", 1), (">", 0)):
        body = struct.pack(f"{order}B7xdI4sI2hB", 1, 2.5, 4, b"abc\0", 2, -3, 4, 5)
        message = bytes([0, mark, 0, 0]) + body
        shape = shapes.walk(found, message, shapes.CDR[message[:2]])
        buffer = np.frombuffer(message * 2, np.uint8)
        columns = shape.columns(buffer, np.array([0, len(message)]))
        assert {name: column.values.tolist() for name, column in columns.items()} == {
            "a": [1, 1],
            "b": [2.5, 2.5],
            "c": ["abc", "abc"],
            "d[0]": [-3, -3],
            "d[1]": [4, 4],
            "e": [5, 5],
        }
        for cut in range(5, len(message)):
            with pytest.raises(shapes.ShapeError):
                shapes.walk(found, message[:cut], shapes.CDR[message[:2]])


def test_long_arrays_are_counted_and_what_follows_is_read() -> None:
    found = definitions.parse("a/B", "uint8[] image\nfloat64 after")
    message = struct.pack("<I100sd", 100, b"", 7.5)
    shape = shapes.walk(found, message, shapes.ROS1)
    columns = shape.columns(np.frombuffer(message, np.uint8), np.array([0]))
    assert {name: column.values.tolist() for name, column in columns.items()} == {"image.count": [100], "after": [7.5]}
    assert shape.shortened == ("image",)


def rows_of(path: Path) -> tuple[int, list[Damage]]:
    """Raw messages that are read of a file, and its damage."""
    found = list(registry.read(path))
    check(found)
    rows = sum(len(item) for item in found if isinstance(item, RecordBatch) and item.topic.startswith("raw."))
    return rows, [item for item in found if isinstance(item, Damage)]


@pytest.mark.parametrize("form", ["ros1", "mcap", "sqlite3"])
def test_a_cut_file_gives_what_stands_before_the_cut(tmp_path: Path, form: str) -> None:
    made = written(tmp_path, form)
    path = next(file for file in made.iterdir() if file.suffix != ".yaml") if made.is_dir() else made
    data = path.read_bytes()
    whole, damages = rows_of(path)
    assert whole == 480 and not damages
    kept = []
    for share in (0.9, 0.6, 0.4):
        path.write_bytes(data[: int(share * len(data))])
        rows, damages = rows_of(path)
        kept.append(rows)
        assert any(damage.kind == "truncated" and damage.loses_data for damage in damages)
    assert whole >= kept[0] >= kept[1] >= kept[2] and whole > kept[1]
    assert kept[1] > 0, "not only whole chunks"


@pytest.mark.parametrize("form", ["ros1", "mcap", "sqlite3"])
def test_a_damaged_record_costs_little_of_the_rest(tmp_path: Path, form: str) -> None:
    made = written(tmp_path, form)
    path = next(file for file in made.iterdir() if file.suffix != ".yaml") if made.is_dir() else made
    data = path.read_bytes()
    whole, _ = rows_of(path)
    at = len(data) // 2
    path.write_bytes(data[:at] + bytes(b ^ 0x5A for b in data[at : at + 600]) + data[at + 600 :])
    rows, damages = rows_of(path)
    assert damages and whole > rows > 0.9 * whole


def test_several_nodes_may_publish_on_one_topic(tmp_path: Path) -> None:
    """Each has a connection of its own in a bag of ROS 1; their messages interlace."""
    made, path = small_flight(is_ros1=True), tmp_path / "a.bag"
    rows = [(time_ns, message) for topic, time_ns, message in made.rows if topic == "/nav/imu"]
    with Ros1Writer(path) as writer:
        kind = rows[0][1].__msgtype__
        nodes = [writer.add_connection("/nav/imu", kind, typestore=made.types, callerid=name) for name in ("/a", "/b")]
        for at, (time_ns, message) in enumerate(rows):
            writer.write(nodes[at % 2], time_ns, made.types.serialize_ros1(message, kind))
    found = list(registry.read(path))
    check(found)
    (batch,) = [one for one in found if isinstance(one, RecordBatch) and one.topic == "raw.nav/imu"]
    assert len(rows) > 20 and batch.record_index.tolist() == list(range(len(rows)))
    assert batch.device_time_ns.values.tolist() == [time_ns for time_ns, _ in rows]
    assert convert_log(open_log(path), tmp_path / "out.mcap").info.ledger.topics["raw.nav/imu"].rows == len(rows)


@pytest.mark.parametrize(("first", "count"), [(3511, 23), (906, 2003), (2, 714), (0, 4000)])
def test_bytes_missing_in_the_header_of_a_bag_cost_no_message(tmp_path: Path, first: int, count: int) -> None:
    """The header claims 4 KiB, and the first chunk begins within them; without its first bytes it is a bag still."""
    path = written(tmp_path, "ros1")
    data, (whole, _) = path.read_bytes(), rows_of(path)
    path.write_bytes(data[:first] + data[first + count :])
    rows, damages = rows_of(path)
    assert rows == whole and [one.what for one in damages] == ["bytes that belong to no record, skipped"]


PROFILE = """
name = "own"
[[messages]]
topic = "/state"
time = { field = "when", unit = "ms" }
[messages.fields]
"psi" = { field = "ins.true_heading_deg", unit = "rad", offset = 6.283185307179586 }
"ok" = { field = "ins.valid" }
"up" = { field = "ins.altitude_msl_m", unit = "ft", sign = -1 }
"none" = { field = "ins.mode" }
[messages.vectors]
"v" = { topic = "ins", quantity = "velocity", frame = "enu", unit = "kmh" }
"w" = { topic = "ins", quantity = "rates", frame = "flu", unit = "radps" }
"""


def profiled(tmp_path: Path, text: str) -> tuple[Path, Path]:
    """A log of messages of its own in JSON, and a profile."""
    rows = []
    for row in range(20):
        message = {
            "when": START_NS // 10**6 + row * 100,
            "psi": -1.0,
            "ok": True,
            "up": 1000.0,
            "v": {"x": 36.0, "y": 72.0, "z": 3.6},
            "w": {"x": 1.0, "y": 1.0, "z": 1.0},
        }
        rows.append(("/state", START_NS + row * 10**8 + LAG_NS, json.dumps(message).encode()))
    (tmp_path / "own.toml").write_text(text)
    log = mcap(tmp_path / "a.mcap", {"/state": ("own.State", "jsonschema", "json", b"{}")}, rows)
    return log, tmp_path / "own.toml"


def test_a_profile_says_what_messages_mean_and_is_told_with_its_units(tmp_path: Path) -> None:
    path, profile = profiled(tmp_path, PROFILE)
    items = list(registry.read(path, profile))
    check(items)
    remarks = {item.code: item.text for item in items if isinstance(item, Remark)}
    assert "ins velocity = v (kmh) in enu x 0.277778" in remarks["profile"]
    assert "ins.altitude_msl_m = up (ft) x -0.3048" in remarks["profile"]
    assert "/state has no none" in remarks["missing_columns"]
    flight = read_flight(tmp_path / "b.mcap", convert_log(open_log(path, profile), tmp_path / "b.mcap"))
    ins = flight["ins"]
    expected = {
        "true_heading_deg": 360.0 - np.rad2deg(1.0),
        "altitude_msl_m": -304.8,
        "velocity_north_mps": 20.0,
        "velocity_east_mps": 10.0,
        "velocity_down_mps": -1.0,
        "rate_x_dps": np.rad2deg(1.0),
        "rate_y_dps": -np.rad2deg(1.0),
    }
    for name, value in expected.items():
        assert np.abs(ins.values(name) - value).max() < 1e-9, name
    assert ins.columns["valid"].values.all()
    assert ins.time_ns[3] == START_NS + 3 * 10**8, "the profile's time"


@pytest.mark.parametrize(
    ("old", "new", "key"),
    [
        ('quantity = "velocity"', 'quantity = "speed"', "messages[0].vectors.v.quantity"),
        ('frame = "enu"', 'frame = "flu"', "messages[0].vectors.v.frame"),
        ('unit = "rad"', 'unit = "m"', "messages[0].fields.psi.unit"),
        ("ins.valid", "ins.colour", "messages[0].fields.ok.field"),
        ('topic = "/state"', 'topik = "/state"', "messages[0].topik"),
        ('unit = "ms"', 'unit = "fortnight"', "messages[0].time.unit"),
    ],
)
def test_a_slip_in_a_profile_is_named(tmp_path: Path, old: str, new: str, key: str) -> None:
    path, profile = profiled(tmp_path, PROFILE.replace(old, new, 1))
    with pytest.raises(SettingsError, match=re.escape(f"own.toml, {key}")):
        registry.identify(path, profile)


def test_messages_of_px4_are_mapped_as_in_its_own_log(tmp_path: Path) -> None:
    definition = "uint64 timestamp\nfloat32[4] q\n"
    rows = []
    for row in range(20):
        stamp_us = START_NS // 1000 + row * 100_000
        message = struct.pack("<4xQ4f", stamp_us, np.sqrt(0.5), 0.0, 0.0, np.sqrt(0.5))
        rows.append(("/fmu/out/vehicle_attitude", stamp_us * 1000 + 1_000, b"\0\1" + message[2:]))
    channel = ("px4_msgs/msg/VehicleAttitude", "ros2msg", "cdr", definition.encode())
    path = mcap(tmp_path / "a.mcap", {"/fmu/out/vehicle_attitude": channel}, rows)
    flight = flight_of(path, tmp_path)
    assert flight["ins"].values("true_heading_deg") == pytest.approx(np.full(20, 90.0), abs=1e-5)
    assert flight["ins"].time_ns[0] == START_NS
