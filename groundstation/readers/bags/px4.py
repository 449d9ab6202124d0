"""Messages of px4_msgs (PX4 over ROS 2): those of its own log by other names, mapped by the ULog reader's rules."""

import re
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from groundstation.base.records import Remark
from groundstation.readers.bags.values import Columns, Values
from groundstation.readers.ulog.canonical import ROLES, Rows, Rule

_PACKAGE = "px4_msgs/"
_UPPER = re.compile(r"(?<=[a-z0-9])(?=[A-Z])")


def is_px4(type_name: str) -> bool:
    """Whether a type is one of px4_msgs."""
    return type_name.startswith(_PACKAGE)


def log_topic(type_name: str) -> str:
    """Topic of PX4's own log for a type of px4_msgs.

    Examples
    --------
    >>> log_topic("px4_msgs/VehicleGpsPosition")
    'vehicle_gps_position'
    """
    return _UPPER.sub("_", type_name.removeprefix(_PACKAGE)).lower()


def feed(seen: Mapping[int, Any], feeds: dict[int, list[Any]], remarks: list[Remark], make: Callable[..., Any]) -> None:
    """Add what messages of px4_msgs give to ``feeds``, each made by ``make(topic, needs, columns)``.

    Topics that other messages of the log serve already are left to those.
    """
    taken = {one.topic.partition(".")[0] for several in feeds.values() for one in several}
    topics = {number: log_topic(one.connection.type) for number, one in seen.items() if is_px4(one.connection.type)}
    for role in ROLES:
        if role.topic in taken:
            continue
        for rule in role.rules:
            served = [
                number
                for number, topic in topics.items()
                if topic == rule.source and all(name in seen[number].columns for name in rule.needs)
            ]
            for place, number in enumerate(served if role.has_instances else served[:1], start=1):
                topic = f"{role.topic}.{place}" if role.has_instances and len(served) > 1 else role.topic
                feeds.setdefault(number, []).append(make(topic, rule.needs, _columns_by(rule)))
                for text in dict.fromkeys(rule.derived.values()):
                    fields = tuple(name for name, one in rule.derived.items() if one == text)
                    remarks.append(Remark("derived", f"{topic}: {', '.join(fields)} from {text}", topic, fields))
            if served:
                break


def _columns_by(rule: Rule) -> Callable[[Values], Columns]:
    def columns(values: Values) -> Columns:
        return rule.columns(Rows(_rows(values)))

    return columns


def _rows(values: Values) -> np.ndarray:
    """Columns as rows of a structured array, as the log of PX4 has them."""
    columns = {name: column.values for name, column in values.items() if column.values.dtype.kind != "U"}
    rows = np.empty(len(values), [(name, array.dtype) for name, array in columns.items()])
    for name, array in columns.items():
        rows[name] = array
    return rows
