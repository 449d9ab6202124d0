"""What other programs draw of a store file: positions with covariance, poses, the log; read with the peer's decoder."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from foxglove_schemas_protobuf.LocationFix_pb2 import LocationFix
from foxglove_schemas_protobuf.Log_pb2 import Log
from foxglove_schemas_protobuf.PoseInFrame_pb2 import PoseInFrame
from google.protobuf.descriptor_pb2 import FileDescriptorSet
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory

from groundstation.base.attitude import quaternion_enu_from_flu_xyzw
from groundstation.base.findings import Finding
from groundstation.base.geodesy import latitude_longitude_deg
from groundstation.base.records import Column, RecordBatch
from groundstation.store.derived import RANGE_SIGMA_M, position_variances_m2
from groundstation.store.info import StoreInfo
from groundstation.store.reader import read
from groundstation.store.writer import StoreWriter

T0_NS = 1_777_874_400_000_000_000
STEP_NS = 20_000_000


def batch(topic: str, count: int, first: int = 0, **columns: Any) -> RecordBatch:
    """Rows at 50 Hz; a column is an array or a Column."""
    index = np.arange(first, first + count)
    kept = {name: one if isinstance(one, Column) else Column(np.asarray(one)) for name, one in columns.items()}
    return RecordBatch(topic, index, Column(index), kept, T0_NS + index * STEP_NS)


def written(path: Path, *batches: RecordBatch, findings: tuple[Finding, ...] = (), has_utc: bool = True) -> Path:
    with StoreWriter(path, StoreInfo(has_utc=has_utc, findings=findings)) as writer:
        for one in batches:
            writer.write(one)
    return path


def messages(path: Path, topic: str) -> list[tuple[int, Any]]:
    """Log time and message, as mcap and protobuf decode them."""
    with path.open("rb") as file:
        reader = make_reader(file, validate_crcs=True, decoder_factories=[DecoderFactory()])
        return [(message.log_time, value) for _, _, message, value in reader.iter_decoded_messages(topics=[topic])]


def test_a_place_beyond_the_earth_is_on_no_map(tmp_path: Path) -> None:
    latitudes = np.array([56.0, 95.0, -90.0, np.nan, 56.0, -1e308, 90.0])
    longitudes = np.array([38.0, 38.0, 180.0, 38.0, np.inf, 38.0, 361.0])
    path = written(tmp_path / "a.mcap", batch("gnss", 7, latitude_deg=latitudes, longitude_deg=longitudes))
    assert [(fix.latitude, fix.longitude) for _, fix in messages(path, "location_fix.gnss")] == [(56, 38), (-90, 180)]
    kept = [item for item in read(path) if isinstance(item, RecordBatch) and item.topic == "gnss"]
    assert [value for item in kept for value in item.columns["latitude_deg"].values][1] == 95.0, "as it was logged"


def test_a_position_has_the_covariance_of_its_geometry_where_that_is_known(tmp_path: Path) -> None:
    geometry = Column(np.full(4, 2.0), np.array([True, True, False, True]))
    rows = batch(
        "gnss", 4, latitude_deg=np.full(4, 56.0), longitude_deg=np.full(4, 38.0), hdop=np.full(4, 1.2), pdop=geometry
    )
    fixes = [fix for _, fix in messages(written(tmp_path / "a.mcap", rows), "location_fix.gnss")]
    assert {fix.frame_id for fix in fixes} == {"gnss"}
    assert [fix.position_covariance_type for fix in fixes] == [1, 1, 0, 1], "approximated, or unknown"
    level, up = (1.2 * RANGE_SIGMA_M) ** 2 / 2.0, (2.0**2 - 1.2**2) * RANGE_SIGMA_M**2
    assert list(fixes[0].position_covariance) == pytest.approx([level, 0, 0, 0, level, 0, 0, 0, up])
    assert not list(fixes[2].position_covariance)


def test_what_the_receiver_states_comes_before_its_geometry() -> None:
    rows = batch(
        "gnss",
        *(3,),
        horizontal_sigma_m=np.array([1.0, 1.0, np.nan]),
        vertical_sigma_m=np.array([3.0, np.nan, 3.0]),
        hdop=np.full(3, 1.0),
        pdop=np.array([2.0, 2.0, 0.5]),
    )
    stated, of_geometry, unknown = position_variances_m2(rows)
    assert stated == pytest.approx([0.5, 0.5, 9.0])
    assert of_geometry == pytest.approx(RANGE_SIGMA_M**2 * np.array([0.5, 0.5, 3.0]))
    assert np.isnan(unknown[2]), "a geometry that contradicts itself is none"


@pytest.mark.parametrize("pieces", [1, 7])
def test_poses_are_attitude_and_place_ten_times_a_second(tmp_path: Path, pieces: int) -> None:
    count = 500
    time_s = np.arange(count) * STEP_NS / 1e9
    latitude, longitude = latitude_longitude_deg(30.0 * time_s, -10.0 * time_s, 56.0, 38.0)
    is_position = np.arange(count) % 5 == 0  # rows of another source
    angles = {"roll_deg": 20.0 * np.sin(time_s), "pitch_deg": 5.0 + time_s, "true_heading_deg": np.full(count, 350.0)}
    columns: dict[str, Column] = {name: Column(values, ~is_position) for name, values in angles.items()}
    columns |= {
        "latitude_deg": Column(latitude, is_position),
        "longitude_deg": Column(longitude, is_position),
        "altitude_msl_m": Column(100.0 + 2.0 * time_s, is_position),
    }
    whole = batch("ins", count, **columns)
    parts = [whole.take(rows) for rows in np.array_split(np.arange(count), pieces)]
    found = messages(written(tmp_path / "a.mcap", *parts), "pose.ins")
    times = np.array([time_ns for time_ns, _ in found])
    assert len(found) == 100 and (np.diff(times // 100_000_000) == 1).all()
    rows = (times - T0_NS) // STEP_NS
    expected = quaternion_enu_from_flu_xyzw(*(values[rows] for values in angles.values()))
    turn = np.array([[getattr(pose.pose.orientation, axis) for axis in "xyzw"] for _, pose in found])
    assert turn == pytest.approx(expected, abs=1e-6)
    place = np.array([[getattr(pose.pose.position, axis) for axis in "xyz"] for _, pose in found])
    held_s = time_s[rows - rows % 5]
    assert place == pytest.approx(held_s[:, None] * np.array([-10.0, 30.0, 2.0]), abs=0.05)
    assert {pose.frame_id for _, pose in found} == {"local_enu"}
    assert all(pose.timestamp.ToNanoseconds() == time_ns for time_ns, pose in found)


def test_without_a_place_on_earth_the_log_s_own_frame_is_taken(tmp_path: Path) -> None:
    level = {name: np.zeros(50) for name in ("roll_deg", "pitch_deg", "true_heading_deg")}
    rows = batch(
        "ins",
        50,
        **level,
        **{
            f"position_{axis}_m": np.full(50, value)
            for axis, value in zip(("north", "east", "down"), (1.0, 2.0, 3.0), strict=True)
        },
    )
    poses = [pose for _, pose in messages(written(tmp_path / "a.mcap", rows, has_utc=False), "pose.ins")]
    assert len(poses) == 10 and not poses[0].HasField("timestamp")
    position = poses[0].pose.position
    assert (position.x, position.y, position.z) == (2.0, 1.0, -3.0)


def test_findings_and_events_are_one_log_in_order_of_time(tmp_path: Path) -> None:
    findings = (
        Finding("warn", "gaps.long", "no data", "gnss", "at 1.5 s"),
        Finding("info", "header.odd", "odd header", place="row 3"),
        Finding("fail", "clock.reset", "the clock began anew", place="2026-05-04T06:00:01Z"),
    )
    events = batch("event", 100, name=Column(np.full(100, "armed"), np.arange(100) == 60))
    found = messages(written(tmp_path / "a.mcap", events, findings=findings), "log")
    assert [(time_ns - T0_NS) / 1e9 for time_ns, _ in found] == [0.0, 1.0, 1.2, 1.5]
    assert [(line.level, line.message) for _, line in found] == [
        (2, "odd header (row 3)"),
        (4, "the clock began anew (2026-05-04T06:00:01Z)"),
        (2, "armed"),
        (3, "no data (gnss, at 1.5 s)"),
    ]
    assert [line.name for _, line in found] == ["header.odd", "clock.reset", "event", "gaps.long"]


def test_the_source_s_units_are_the_comments_of_the_fields(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    info = StoreInfo(has_utc=True, metadata={"units.raw.IMU": "Gyr X rad/s, T deg C"})
    with StoreWriter(path, info) as writer:
        writer.write(batch("raw.IMU.1", 3, **{"Gyr X": np.zeros(3), "N": np.arange(3), "T": np.zeros(3)}))
    with path.open("rb") as file:
        (schema,) = make_reader(file).get_summary().schemas.values()
    (described,) = FileDescriptorSet.FromString(schema.data).file
    fields = described.message_type[0].field
    comments = {
        fields[place.path[3]].name: place.leading_comments.strip() for place in described.source_code_info.location
    }
    assert comments == {"Gyr_X": "rad/s", "T": "deg C"}
    assert [item.columns["T"].values.tolist() for item in read(path) if isinstance(item, RecordBatch)] == [[0.0] * 3]


def test_reading_skips_them_and_a_copy_has_them_again(tmp_path: Path) -> None:
    findings = (Finding("warn", "gaps.long", "no data", "gnss", "at 0.5 s"),)
    level = {name: np.linspace(0.0, 10.0, 60) for name in ("roll_deg", "pitch_deg", "true_heading_deg")}
    rows = (
        batch("ins", 60, **level),
        batch("gnss", 60, latitude_deg=np.full(60, 56.0), longitude_deg=np.full(60, 38.0)),
    )
    first, same = (written(tmp_path / name, *rows, findings=findings) for name in ("a.mcap", "b.mcap"))
    assert first.read_bytes() == same.read_bytes()
    items = [item for item in read(first) if isinstance(item, RecordBatch)]
    assert {item.topic for item in items} == {"ins", "gnss"}
    copy = written(tmp_path / "c.mcap", *items, findings=findings)
    for topic in ("pose.ins", "location_fix.gnss", "log"):
        told = [[(time_ns, str(message)) for time_ns, message in messages(path, topic)] for path in (first, copy)]
        assert told[0] == told[1] != []


def test_schemas_and_messages_are_those_that_foxglove_publishes(tmp_path: Path) -> None:
    turn = {name: np.linspace(0.0, 10.0, 60) for name in ("roll_deg", "pitch_deg", "true_heading_deg")}
    place = {"latitude_deg": np.full(60, 56.0), "longitude_deg": np.full(60, 38.0)}
    geometry = {"hdop": np.full(60, 1.2), "pdop": np.full(60, 2.0)}
    rows = batch("ins", 60, **turn, **place), batch("gnss", 60, **place, **geometry)
    path = written(tmp_path / "a.mcap", *rows, findings=(Finding("warn", "gaps.long", "no data", "gnss", "at 0.5 s"),))
    published = {one.DESCRIPTOR.full_name: one for one in (LocationFix, PoseInFrame, Log)}
    seen = set()
    with path.open("rb") as file:
        for schema, _, message in make_reader(file).iter_messages():
            if schema is None or not schema.name.startswith("foxglove."):
                continue
            kind = published[schema.name]
            if schema.name not in seen:
                seen.add(schema.name)
                own = {item.name: item for item in FileDescriptorSet.FromString(schema.data).file}
                pool = kind.DESCRIPTOR.file.pool
                for name, item in own.items():
                    assert item.SerializeToString() == pool.FindFileByName(name).serialized_pb, name
                assert schema.encoding == "protobuf" and kind.DESCRIPTOR.file.name in own
            decoded = kind.FromString(message.data)
            assert decoded.timestamp.ToNanoseconds() == message.log_time
            whole = decoded.ByteSize()
            decoded.DiscardUnknownFields()
            assert decoded.ByteSize() == whole, "a field that the schema does not have"
            if schema.name == "foxglove.PoseInFrame":
                turned = decoded.pose.orientation
                assert np.hypot(np.hypot(turned.x, turned.y), np.hypot(turned.z, turned.w)) == pytest.approx(1.0)
    assert seen == set(published)
