"""Log of an inertial unit as a ROS 1 bag.

It has sensor_msgs/Imu, sensor_msgs/NavSatFix and geometry_msgs/TwistStamped.

Source: http://wiki.ros.org/Bags/Format/2.0; definitions of common_msgs 1.12.
"""

import struct
from pathlib import Path

import numpy as np

from groundstation.base.dataclasses import dataclass
from groundstation.base.records import Int64Array
from groundstation.base.units import NS_PER_S
from groundstation.simulation.imu.flight import ImuFlight
from groundstation.simulation.imu.packed import Packed, interleaved, records
from groundstation.simulation.imu.scenario import ImuScenario
from groundstation.simulation.imu.tables import nanoseconds

MAGIC = b"#ROSBAG V2.0\n"
HEAD_BYTES = 4096
MESSAGE, BAG, INDEX, CHUNK, CHUNK_INFO, CONNECTION = 2, 3, 4, 5, 6, 7
CHUNK_RUNS = 400  # runs of messages of one topic in a chunk
_LINE = "=" * 80
_HEADER = f"{_LINE}\nMSG: std_msgs/Header\nuint32 seq\ntime stamp\nstring frame_id\n"
_VECTOR = f"{_LINE}\nMSG: geometry_msgs/Vector3\nfloat64 x\nfloat64 y\nfloat64 z\n"


@dataclass(frozen=True)
class _Topic:
    name: str
    type: str
    md5: str
    definition: str


_TOPICS = (
    _Topic(
        "/imu/data_raw",
        "sensor_msgs/Imu",
        "6a62c6daae103f4ff57a132d6f95cec2",
        "Header header\ngeometry_msgs/Quaternion orientation\nfloat64[9] orientation_covariance\n"
        "geometry_msgs/Vector3 angular_velocity\nfloat64[9] angular_velocity_covariance\n"
        "geometry_msgs/Vector3 linear_acceleration\nfloat64[9] linear_acceleration_covariance\n"
        f"{_HEADER}{_LINE}\nMSG: geometry_msgs/Quaternion\nfloat64 x\nfloat64 y\nfloat64 z\nfloat64 w\n{_VECTOR}",
    ),
    _Topic(
        "/gps/fix",
        "sensor_msgs/NavSatFix",
        "2d3a8cd499b9b4a0249fb98fd05cfa48",
        "uint8 COVARIANCE_TYPE_UNKNOWN=0\nuint8 COVARIANCE_TYPE_APPROXIMATED=1\n"
        "uint8 COVARIANCE_TYPE_DIAGONAL_KNOWN=2\nuint8 COVARIANCE_TYPE_KNOWN=3\nHeader header\nNavSatStatus status\n"
        "float64 latitude\nfloat64 longitude\nfloat64 altitude\nfloat64[9] position_covariance\n"
        f"uint8 position_covariance_type\n{_HEADER}{_LINE}\nMSG: sensor_msgs/NavSatStatus\n"
        "int8 STATUS_NO_FIX=-1\nint8 STATUS_FIX=0\nint8 STATUS_SBAS_FIX=1\nint8 STATUS_GBAS_FIX=2\n"
        "uint16 SERVICE_GPS=1\nuint16 SERVICE_GLONASS=2\nuint16 SERVICE_COMPASS=4\nuint16 SERVICE_GALILEO=8\n"
        "int8 status\nuint16 service\n",
    ),
    _Topic(
        "/gps/vel",
        "geometry_msgs/TwistStamped",
        "98d34b0043a2093cf9d9345ab6eef12e",
        f"Header header\nTwist twist\n{_HEADER}{_LINE}\nMSG: geometry_msgs/Twist\nVector3 linear\nVector3 angular\n"
        f"{_VECTOR}",
    ),
)


def write_ros1(path: Path, flight: ImuFlight, scenario: ImuScenario) -> None:
    """Write the log as a bag; rates and specific forces are the means of the intervals."""
    unit_ns = scenario.start_utc_ns + nanoseconds(flight.time_s)
    fix_ns = scenario.start_utc_ns + nanoseconds(flight.gnss.time_s)
    logged = (np.maximum.accumulate(unit_ns), fix_ns, fix_ns)
    bodies = (_imu(flight, unit_ns), _fix(flight, fix_ns), _velocity(flight, fix_ns))
    streams = [(at, _messages(number, at, body)) for number, (at, body) in enumerate(zip(logged, bodies, strict=True))]
    runs = interleaved(streams)
    connections = [_connection(number, topic) for number, topic in enumerate(_TOPICS)]
    parts, infos, at = [], [], len(MAGIC) + HEAD_BYTES
    for first in range(0, len(runs), CHUNK_RUNS):
        chunk, info = _chunk(runs[first : first + CHUNK_RUNS], streams, connections if first == 0 else [], at)
        parts.append(chunk)
        infos.append(info)
        at += len(chunk)
    fields = {"index_pos": struct.pack("<Q", at), "conn_count": struct.pack("<I", len(_TOPICS))}
    head = _record(BAG, fields | {"chunk_count": struct.pack("<I", len(infos))}, b"")[:-4]
    room = HEAD_BYTES - len(head) - 4
    path.write_bytes(b"".join([MAGIC, head, struct.pack("<I", room), b" " * room, *parts, *connections, *infos]))


def _chunk(
    runs: list[tuple[int, int, int]], streams: list[tuple[Int64Array, Packed]], connections: list[bytes], at: int
) -> tuple[bytes, bytes]:
    """Return a chunk with its indexes, and the record that tells of it at the end of the bag."""
    data = b"".join(connections)
    places: dict[int, list[tuple[Int64Array, Int64Array]]] = {}
    for number, first, end in runs:
        time_ns, rows = streams[number]
        offsets = len(data) + rows.itemsize * np.arange(end - first)
        places.setdefault(number, []).append((time_ns[first:end], offsets))
        data += rows[first:end].tobytes()
    chunk = _record(CHUNK, {"compression": b"none", "size": struct.pack("<I", len(data))}, data)
    counts, begin_ns, end_ns = b"", None, None
    for number, found in places.items():
        time_ns, offsets = (np.concatenate(part) for part in zip(*found, strict=True))
        index = records(len(time_ns), *_time_parts(time_ns), ("offset", "<u4", offsets))
        fields = {"ver": struct.pack("<I", 1), "conn": struct.pack("<I", number)}
        chunk += _record(INDEX, fields | {"count": struct.pack("<I", len(index))}, index.tobytes())
        counts += struct.pack("<II", number, len(index))
        begin_ns = int(time_ns.min()) if begin_ns is None else min(begin_ns, int(time_ns.min()))
        end_ns = int(time_ns.max()) if end_ns is None else max(end_ns, int(time_ns.max()))
    times = {"start_time": _time(begin_ns or 0), "end_time": _time(end_ns or 0)}
    of_chunk = {"ver": struct.pack("<I", 1), "chunk_pos": struct.pack("<Q", at)}
    return chunk, _record(CHUNK_INFO, of_chunk | times | {"count": struct.pack("<I", len(places))}, counts)


def _record(op: int, fields: dict[str, bytes], data: bytes) -> bytes:
    head = _fields({"op": bytes([op])} | fields)
    return struct.pack("<I", len(head)) + head + struct.pack("<I", len(data)) + data


def _fields(fields: dict[str, bytes]) -> bytes:
    parts = [name.encode() + b"=" + value for name, value in fields.items()]
    return b"".join(struct.pack("<I", len(part)) + part for part in parts)


def _connection(number: int, topic: _Topic) -> bytes:
    about = {"topic": topic.name, "type": topic.type, "md5sum": topic.md5, "message_definition": topic.definition}
    data = _fields({name: value.encode() for name, value in about.items()})
    return _record(CONNECTION, {"conn": struct.pack("<I", number), "topic": topic.name.encode()}, data)


def _time(time_ns: int) -> bytes:
    return struct.pack("<II", *divmod(time_ns, NS_PER_S))


def _time_parts(time_ns: Int64Array) -> tuple[tuple[str, str, object], tuple[str, str, object]]:
    return ("seconds", "<u4", time_ns // NS_PER_S), ("nanoseconds", "<u4", time_ns % NS_PER_S)


def _messages(number: int, time_ns: Int64Array, body: Packed) -> Packed:
    """Return whole records of messages: header, then the serialised message."""
    before, behind = _fields({"op": bytes([MESSAGE]), "conn": struct.pack("<I", number)}), b"time="
    head = before + struct.pack("<I", len(behind) + 8) + behind
    return records(
        len(time_ns),
        ("head_size", "<u4", len(head) + 8),
        ("head", f"V{len(head)}", np.void(head)),
        *_time_parts(time_ns),
        ("size", "<u4", body.itemsize),
        ("body", body.dtype.str if body.dtype.names is None else f"V{body.itemsize}", body.view(f"V{body.itemsize}")),
    )


def _header(time_ns: Int64Array, frame: bytes) -> tuple[tuple[str, str, object], ...]:
    frame_size = ("frame_size", "<u4", len(frame))
    sequence = ("seq", "<u4", np.arange(len(time_ns)))
    return (sequence, *_time_parts(time_ns), frame_size, ("frame", f"S{len(frame)}", frame))


def _imu(flight: ImuFlight, time_ns: Int64Array) -> Packed:
    """Return Imu messages in axes forward, left, up; the attitude is declared absent."""
    to_ros, step_s = np.array([1.0, -1.0, -1.0]), flight.interval_s[:, None]
    absent = np.zeros(9)
    absent[0] = -1.0
    return records(
        len(time_ns),
        *_header(time_ns, b"imu_link"),
        ("orientation", "<4f8", [0.0, 0.0, 0.0, 1.0]),
        ("orientation_covariance", "<9f8", absent),
        ("rates", "<3f8", flight.delta_angle_rad / step_s * to_ros),
        ("rates_covariance", "<9f8", 0.0),
        ("forces", "<3f8", flight.delta_velocity_mps / step_s * to_ros),
        ("forces_covariance", "<9f8", 0.0),
    )


def _fix(flight: ImuFlight, time_ns: Int64Array) -> Packed:
    fixes = flight.gnss
    covariance = np.zeros((len(time_ns), 9))
    covariance[:, [4, 0, 8]] = fixes.position_sigma_m**2  # east, north, up
    return records(
        len(time_ns),
        *_header(time_ns, b"gps"),
        ("status", "i1", np.where(fixes.is_precise, 2, 0)),
        ("service", "<u2", 1),
        ("latitude", "<f8", fixes.latitude_deg),
        ("longitude", "<f8", fixes.longitude_deg),
        ("altitude", "<f8", fixes.height_m),
        ("covariance", "<9f8", covariance),
        ("covariance_type", "u1", 2),
    )


def _velocity(flight: ImuFlight, time_ns: Int64Array) -> Packed:
    """Return TwistStamped messages: velocity east, north, up."""
    velocity = flight.gnss.velocity_mps[:, [1, 0, 2]] * [1.0, 1.0, -1.0]
    return records(len(time_ns), *_header(time_ns, b"gps"), ("linear", "<3f8", velocity), ("angular", "<3f8", 0.0))
