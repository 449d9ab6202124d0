"""Fields of common ROS 2 message types, for bags that carry no definitions.

Such bags are sqlite3 before Iron.

Source: common_interfaces (message definitions of ROS 2 Humble); names and types alone.
"""

from collections.abc import Mapping
from types import MappingProxyType

_COVARIANT = "{part} {name}\nfloat64[36] covariance"

KNOWN_TYPES: Mapping[str, str] = MappingProxyType(
    {
        "std_msgs/Header": "builtin_interfaces/Time stamp\nstring frame_id",
        "std_msgs/String": "string data",
        "std_msgs/Bool": "bool data",
        "std_msgs/Float64": "float64 data",
        "geometry_msgs/Vector3": "float64 x\nfloat64 y\nfloat64 z",
        "geometry_msgs/Point": "float64 x\nfloat64 y\nfloat64 z",
        "geometry_msgs/Quaternion": "float64 x\nfloat64 y\nfloat64 z\nfloat64 w",
        "geometry_msgs/Pose": "geometry_msgs/Point position\ngeometry_msgs/Quaternion orientation",
        "geometry_msgs/Twist": "geometry_msgs/Vector3 linear\ngeometry_msgs/Vector3 angular",
        "geometry_msgs/PoseWithCovariance": _COVARIANT.format(part="geometry_msgs/Pose", name="pose"),
        "geometry_msgs/TwistWithCovariance": _COVARIANT.format(part="geometry_msgs/Twist", name="twist"),
        "geometry_msgs/PoseStamped": "std_msgs/Header header\ngeometry_msgs/Pose pose",
        "geometry_msgs/PoseWithCovarianceStamped": ("std_msgs/Header header\ngeometry_msgs/PoseWithCovariance pose"),
        "geometry_msgs/TwistStamped": "std_msgs/Header header\ngeometry_msgs/Twist twist",
        "geometry_msgs/TwistWithCovarianceStamped": ("std_msgs/Header header\ngeometry_msgs/TwistWithCovariance twist"),
        "nav_msgs/Odometry": (
            "std_msgs/Header header\nstring child_frame_id\n"
            "geometry_msgs/PoseWithCovariance pose\ngeometry_msgs/TwistWithCovariance twist"
        ),
        "sensor_msgs/NavSatStatus": "int8 status\nuint16 service",
        "sensor_msgs/NavSatFix": (
            "std_msgs/Header header\nsensor_msgs/NavSatStatus status\nfloat64 latitude\nfloat64 longitude\n"
            "float64 altitude\nfloat64[9] position_covariance\nuint8 position_covariance_type"
        ),
        "sensor_msgs/Imu": (
            "std_msgs/Header header\ngeometry_msgs/Quaternion orientation\nfloat64[9] orientation_covariance\n"
            "geometry_msgs/Vector3 angular_velocity\nfloat64[9] angular_velocity_covariance\n"
            "geometry_msgs/Vector3 linear_acceleration\nfloat64[9] linear_acceleration_covariance"
        ),
        "sensor_msgs/MagneticField": (
            "std_msgs/Header header\ngeometry_msgs/Vector3 magnetic_field\nfloat64[9] magnetic_field_covariance"
        ),
        "sensor_msgs/TimeReference": ("std_msgs/Header header\nbuiltin_interfaces/Time time_ref\nstring source"),
    }
)
