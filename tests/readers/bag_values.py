"""Messages of a bag as rosbags decodes them, laid flat as the reader's raw columns are."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from rosbags.highlevel import AnyReader

NS_PER_S = 1_000_000_000
MOST_NUMBERS, MOST_PARTS = 64, 16


def flat(value: Any, path: str = "") -> Iterator[tuple[str, Any]]:
    """Name and value of everything in a message."""
    if hasattr(value, "sec") and hasattr(value, "nanosec"):
        yield f"{path}_ns", value.sec * NS_PER_S + value.nanosec
    elif hasattr(value, "__dataclass_fields__"):
        for name in value.__dataclass_fields__:
            if name not in ("__msgtype__", "structure_needs_at_least_one_member") and not name.isupper():
                yield from flat(getattr(value, name), f"{path}.{name}" if path else name)
    elif isinstance(value, list | np.ndarray):
        plain = isinstance(value, np.ndarray)
        if len(value) > (MOST_NUMBERS if plain else MOST_PARTS):
            yield f"{path}.count", len(value)
        else:
            for number, part in enumerate(value):
                yield from flat(part, f"{path}[{number}]")
    else:
        yield path, value


def decoded(path: Path) -> dict[str, list[tuple[int, dict[str, Any]]]]:
    """Log time and flat values of every message, by topic, in the order of log time."""
    found: dict[str, list[tuple[int, dict[str, Any]]]] = {}
    with AnyReader([path]) as reader:
        for connection, time_ns, data in reader.messages():
            message = reader.deserialize(data, connection.msgtype)
            found.setdefault(connection.topic, []).append((time_ns, dict(flat(message))))
    return found
