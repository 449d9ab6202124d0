"""Message definitions of ROS 1 and ROS 2 as a bag carries them.

The text of the type comes first, then those of its parts.

Source: http://wiki.ros.org/msg (ROS 1); https://docs.ros.org/en/rolling/Concepts/Basic/About-Interfaces.html (ROS 2).
"""

import re
from collections.abc import Mapping
from functools import cache
from types import MappingProxyType

import numpy as np

from groundstation.base.dataclasses import dataclass

MOST_FIELDS = 4_000  # fields of one definition with all its parts: a longer text is no definition
_SEPARATOR = re.compile(r"^=+\s*$", re.MULTILINE)
_PART = re.compile(r"\s*MSG:\s*(\S+)\s*\n")
_CONSTANT = re.compile(r"[\w/<=]+\s+\w+\s*=")
_FIELD = re.compile(
    r"(?P<type>[A-Za-z][\w/]*)(?:<=\d+)?(?P<array>\[(?P<bound><=)?(?P<count>\d*)\])?\s+(?P<name>\w+)(?:\s.*)?$"
)

TEXT, WIDE_TEXT = "string", "wstring"
PRIMITIVES: Mapping[str, np.dtype] = {
    "bool": np.dtype("?"),
    "byte": np.dtype("u1"),
    "char": np.dtype("u1"),
    **{f"{sign}int{bits}": np.dtype(f"{sign or 'i'}{bits // 8}") for sign in ("", "u") for bits in (8, 16, 32, 64)},
    "float32": np.dtype("f4"),
    "float64": np.dtype("f8"),
}
# Times are two numbers that belong together: whole seconds and nanoseconds.
TIMES: Mapping[str, tuple[np.dtype, np.dtype]] = {
    "time": (np.dtype("u4"), np.dtype("u4")),
    "duration": (np.dtype("i4"), np.dtype("i4")),
    "builtin_interfaces/Time": (np.dtype("i4"), np.dtype("u4")),
    "builtin_interfaces/Duration": (np.dtype("i4"), np.dtype("u4")),
}
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


class DefinitionError(Exception):
    """A definition that cannot be used; the text says why."""


@dataclass(frozen=True)
class MessageField:
    """A field of a message.

    Parameters
    ----------
    name : str
    type : str
        ``float64``, ``string``, or the full name of a type: ``std_msgs/Header``.
    count : int, optional
        Elements of an array; -1 where each message tells; None for a single value.
    """

    name: str
    type: str
    count: int | None = None


@dataclass(frozen=True)
class MessageDefinition:
    """A message type with all its parts.

    Parameters
    ----------
    root : str
    types : mapping of name to tuple of MessageField
    """

    root: str
    types: Mapping[str, tuple[MessageField, ...]]


def plain_name(name: str) -> str:
    """Name of a type without the ``/msg/`` of ROS 2.

    Examples
    --------
    >>> plain_name("sensor_msgs/msg/Imu")
    'sensor_msgs/Imu'
    """
    return name.replace("/msg/", "/")


def parse(root: str, text: str) -> MessageDefinition:
    """Parse the text of a definition.

    Raises
    ------
    DefinitionError
        When a line is no field, or a part is missing.

    Examples
    --------
    >>> text = "Header header\\nfloat64[3] x # m\\nuint8 UP=1\\n===\\nMSG: std_msgs/Header\\nstring frame_id"
    >>> found = parse("a/B", text)
    >>> [(field.name, field.type, field.count) for field in found.types["a/B"]]
    [('header', 'std_msgs/Header', None), ('x', 'float64', 3)]
    """
    first, *others = _SEPARATOR.split(text)
    texts = {plain_name(root): first}
    for other in others:
        named = _PART.match(other.lstrip())
        if named is None:
            raise DefinitionError("a part without a name")
        texts.setdefault(plain_name(named.group(1)), other.lstrip()[named.end() :])
    types: dict[str, tuple[MessageField, ...]] = {}
    wanted = [plain_name(root)]
    while wanted:
        name = wanted.pop()
        if name in types or name in PRIMITIVES or name in TIMES or name in (TEXT, WIDE_TEXT):
            continue
        content = texts.get(name, KNOWN_TYPES.get(name))
        if content is None:
            raise DefinitionError(f"no definition of {name}")
        types[name] = _fields(content, name, texts)
        wanted += [field.type for field in types[name]]
        if sum(len(fields) for fields in types.values()) > MOST_FIELDS:
            raise DefinitionError(f"more than {MOST_FIELDS} fields")
    _refuse_circles(types)
    return MessageDefinition(plain_name(root), types)


@cache
def known(type_name: str) -> MessageDefinition | None:
    """Return the definition of a common ROS 2 type, for bags that carry none."""
    text = KNOWN_TYPES.get(type_name)
    return None if text is None else parse(type_name, text)


def _fields(text: str, owner: str, texts: Mapping[str, str]) -> tuple[MessageField, ...]:
    fields = []
    for line in text.splitlines():
        content = line.partition("#")[0].strip()
        if not content or _CONSTANT.match(content):
            continue
        match = _FIELD.match(content)
        if match is None:
            raise DefinitionError(f"line {content[:60]!r}")
        count = None
        if match["array"]:
            count = int(match["count"]) if match["count"] and not match["bound"] else -1
        fields.append(MessageField(match["name"], _full_name(match["type"], owner, texts), count))
    return tuple(fields)


def _full_name(name: str, owner: str, texts: Mapping[str, str]) -> str:
    name = plain_name(name)
    if name in PRIMITIVES or name in TIMES or name in (TEXT, WIDE_TEXT) or "/" in name:
        return name
    if name == "Header":
        return "std_msgs/Header"
    sibling = f"{owner.rpartition('/')[0]}/{name}"
    if sibling in texts or sibling in KNOWN_TYPES:
        return sibling
    return next((known for known in texts if known.rpartition("/")[2] == name), sibling)


def _refuse_circles(types: Mapping[str, tuple[MessageField, ...]]) -> None:
    """Refuse a type that contains itself."""
    left = {name: {field.type for field in fields} & types.keys() for name, fields in types.items()}
    while ready := [name for name, parts in left.items() if not parts & left.keys()]:
        for name in ready:
            del left[name]
    if left:
        raise DefinitionError(f"{next(iter(left))} holds itself")
