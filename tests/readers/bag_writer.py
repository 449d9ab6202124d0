"""Bags written by rosbags: messages of a simulated flight, and single ones."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from rosbags.rosbag1 import Writer as Ros1Writer
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin
from rosbags.rosbag2 import Writer as Ros2Writer
from rosbags.typesys import Stores, get_typestore

NS_PER_S = 1_000_000_000
NO_COVARIANCE = np.zeros(9)
START_NS = 1_777_874_400 * NS_PER_S
LAG_NS = 20_000_000


@dataclass
class Messages:
    """Messages in the order in which they are logged: topic, log time, message."""

    is_ros1: bool = False
    rows: list[tuple[str, int, Any]] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.types = get_typestore(Stores.ROS1_NOETIC if self.is_ros1 else Stores.ROS2_HUMBLE)

    def make(self, name: str, *values: Any) -> Any:
        """A message of a type (``sensor_msgs/msg/Imu``)."""
        return self.types.types[name](*values)

    def header(self, stamp_ns: int, frame: str) -> Any:
        """A header; ROS 1 counts headers as well."""
        time = self.make("builtin_interfaces/msg/Time", *divmod(stamp_ns, NS_PER_S))
        return self.make("std_msgs/msg/Header", *((0,) if self.is_ros1 else ()), time, frame)

    def vector(self, x: float, y: float, z: float, name: str = "Vector3") -> Any:
        """A vector or point."""
        return self.make(f"geometry_msgs/msg/{name}", x, y, z)

    def add(self, topic: str, stamp_ns: int, message: Any, lag_ns: int = LAG_NS) -> None:
        """Log a message some time after its stamp."""
        self.rows.append((topic, stamp_ns + lag_ns, message))

    def imu(
        self,
        topic: str,
        stamp_ns: int,
        quaternion_xyzw: Sequence[float],
        rates: Sequence[float] | None = None,
        accel: Sequence[float] | None = None,
    ) -> None:
        """An Imu; rates and specific force are declared absent where they are not given."""
        absent = np.array([-1.0, *[0.0] * 8])
        message = self.make(
            "sensor_msgs/msg/Imu",
            self.header(stamp_ns, "imu_link"),
            self.make("geometry_msgs/msg/Quaternion", *quaternion_xyzw),
            NO_COVARIANCE,
            self.vector(*(rates or (0.0, 0.0, 0.0))),
            NO_COVARIANCE if rates else absent,
            self.vector(*(accel or (0.0, 0.0, 0.0))),
            NO_COVARIANCE if accel else absent,
        )
        self.add(topic, stamp_ns, message)

    def fix(self, topic: str, stamp_ns: int, place: Sequence[float], status: int = 0) -> None:
        """A NavSatFix: latitude, longitude, altitude."""
        of_fix = self.make("sensor_msgs/msg/NavSatStatus", status, 1)
        header = self.header(stamp_ns, "gnss")
        self.add(topic, stamp_ns, self.make("sensor_msgs/msg/NavSatFix", header, of_fix, *place, NO_COVARIANCE, 0))

    def twist(self, topic: str, stamp_ns: int, east_north_up: Sequence[float]) -> None:
        """A TwistStamped."""
        twist = self.make("geometry_msgs/msg/Twist", self.vector(*east_north_up), self.vector(0.0, 0.0, 0.0))
        self.add(topic, stamp_ns, self.make("geometry_msgs/msg/TwistStamped", self.header(stamp_ns, "gnss"), twist))

    def odometry(
        self,
        topic: str,
        stamp_ns: int,
        quaternion_xyzw: Sequence[float],
        forward_left_up: Sequence[float],
        turn_radps: float = 0.0,
        frame: str = "odom",
    ) -> None:
        """An Odometry; its velocity is along the axes of the body."""
        place = self.vector(0.0, 0.0, 0.0, "Point")
        pose = self.make("geometry_msgs/msg/Pose", place, self.make("geometry_msgs/msg/Quaternion", *quaternion_xyzw))
        twist = self.make("geometry_msgs/msg/Twist", self.vector(*forward_left_up), self.vector(0.0, 0.0, turn_radps))
        message = self.make(
            "nav_msgs/msg/Odometry",
            self.header(stamp_ns, frame),
            "base_link",
            self.make("geometry_msgs/msg/PoseWithCovariance", pose, np.zeros(36)),
            self.make("geometry_msgs/msg/TwistWithCovariance", twist, np.zeros(36)),
        )
        self.add(topic, stamp_ns, message)

    def text(self, topic: str, stamp_ns: int, text: str) -> None:
        """A String."""
        self.add(topic, stamp_ns, self.make("std_msgs/msg/String", text))


def write_ros1(path: Path, messages: Messages, compression: str = "") -> Path:
    """A bag of ROS 1; compression is ``lz4``, ``bz2`` or none."""
    writer = Ros1Writer(path)
    if compression:
        writer.set_compression(Ros1Writer.CompressionFormat[compression.upper()])
    with writer:
        connections: dict[str, Any] = {}
        for topic, time_ns, message in sorted(messages.rows, key=lambda row: row[1]):
            kind = message.__msgtype__
            if topic not in connections:
                connections[topic] = writer.add_connection(topic, kind, typestore=messages.types)
            writer.write(connections[topic], time_ns, messages.types.serialize_ros1(message, kind))
    return path


def write_ros2(folder: Path, messages: Messages, storage: str = "mcap", *, is_compressed: bool = False) -> Path:
    """A bag of ROS 2, a folder; storage is ``mcap`` or ``sqlite3``."""
    plugin = StoragePlugin.MCAP if storage == "mcap" else StoragePlugin.SQLITE3
    writer = Ros2Writer(folder, version=9, storage_plugin=plugin)
    if is_compressed:
        mode = CompressionMode.STORAGE if storage == "mcap" else CompressionMode.MESSAGE
        writer.set_compression(mode, CompressionFormat.ZSTD)
    with writer:
        connections: dict[str, Any] = {}
        for topic, time_ns, message in sorted(messages.rows, key=lambda row: row[1]):
            kind = message.__msgtype__
            if topic not in connections:
                connections[topic] = writer.add_connection(topic, kind, typestore=messages.types)
            writer.write(connections[topic], time_ns, messages.types.serialize_cdr(message, kind))
    return folder


def enu_quaternion_xyzw(roll_deg: float, pitch_deg: float, heading_deg: float) -> tuple[float, float, float, float]:
    """The quaternion that turns forward-left-up into east-north-up, of an attitude by our angles."""
    roll, pitch, yaw = np.deg2rad([roll_deg, -pitch_deg, 90.0 - heading_deg]) / 2
    (cr, cp, cy), (sr, sp, sy) = np.cos([roll, pitch, yaw]), np.sin([roll, pitch, yaw])
    return (
        sr * cp * cy - cr * sp * sy,
        cr * sp * cy + sr * cp * sy,
        cr * cp * sy - sr * sp * cy,
        cr * cp * cy + sr * sp * sy,
    )


def small_flight(*, is_ros1: bool = False, rows: int = 200) -> Messages:
    """Messages of one unit, a receiver, wheels and a log of texts, 10 Hz."""
    messages = Messages(is_ros1)
    for row in range(rows):
        stamp_ns = START_NS + row * NS_PER_S // 10
        quaternion = enu_quaternion_xyzw(2.0, -3.0, (350.0 + row) % 360.0)
        messages.imu("/nav/imu", stamp_ns, quaternion, (0.1, 0.2, 0.3), (1.0, 2.0, 9.8))
        messages.odometry("/nav/odom", stamp_ns, quaternion, (10.0, 0.0, 0.0))
        if row % 10 == 0:
            messages.fix("/gps/fix", stamp_ns + 3_000_000, (55.0 + row * 1e-5, 37.0, np.nan), 0 if row else -1)
            messages.twist("/gps/vel", stamp_ns + 3_000_000, (3.0, 4.0, -1.0))
            messages.odometry("/wheels/odom", stamp_ns + 5_000_000, (0.0, 0.0, 0.0, 1.0), (5.0, 0.0, 0.0), 0.1)
            messages.text("/log", stamp_ns + 7_000_000, "r" * (row % 30))
    return messages
