"""Messages of px4_msgs (PX4 over ROS 2), mapped by the ULog reader's rules.

They are those of PX4's own log under other names.
"""

import re
from collections.abc import Callable, Mapping
from typing import Any

from groundstation.base.records import Remark
from groundstation.readers.mapping import OfferedMessages, assigned
from groundstation.readers.ulog.canonical import ROLES
from groundstation.readers.ulog.inertial import IMU_ROLES

_PACKAGE = "px4_msgs/"
_UPPER = re.compile(r"(?<=[a-z0-9])(?=[A-Z])")


def is_px4(type_name: str) -> bool:
    """Tell whether a type is one of px4_msgs."""
    return type_name.startswith(_PACKAGE)


def log_topic(type_name: str) -> str:
    """Return the topic of PX4's own log for a type of px4_msgs.

    Examples
    --------
    >>> log_topic("px4_msgs/VehicleGpsPosition")
    'vehicle_gps_position'
    """
    return _UPPER.sub("_", type_name.removeprefix(_PACKAGE)).lower()


def feed(seen: Mapping[int, Any], feeds: dict[int, list[Any]], remarks: list[Remark], make: Callable[..., Any]) -> None:
    """Add to ``feeds`` what messages of px4_msgs give.

    Each feed is made by ``make(topic, needs, columns)``. Topics that other messages of the log serve already are left
    to those.
    """
    taken = {one.topic.partition(".")[0] for several in feeds.values() for one in several}
    offers = [
        OfferedMessages(log_topic(one.connection.type), number, frozenset(one.columns))
        for number, one in seen.items()
        if is_px4(one.connection.type)
    ]
    of_imu = next((roles for roles in IMU_ROLES if len(list(assigned(roles, offers))) >= len(roles)), ())
    for one in assigned((role for role in (*ROLES, *of_imu) if role.topic not in taken), offers):
        feeds.setdefault(one.offer.instance, []).append(make(one.topic, one.rule.needs, one.rule.columns))
        remarks += one.rule.told(one.topic)
