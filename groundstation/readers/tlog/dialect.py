"""Fields of MAVLink messages, from the tables of pymavlink (LGPL).

``groundstation[tlog]`` installs it.

Only its tables of fields are used; frames are found and read by our own code.
"""

from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from groundstation.base.dataclasses import dataclass
from groundstation.base.errors import UnreadableLogError

MOST_IDS = 1 << 16
UNKNOWN = -1
_DTYPES = {
    "char": "u1",
    "uint8_t": "u1",
    "int8_t": "i1",
    "uint16_t": "<u2",
    "int16_t": "<i2",
    "uint32_t": "<u4",
    "int32_t": "<i4",
    "uint64_t": "<u8",
    "int64_t": "<i8",
    "float": "<f4",
    "double": "<f8",
    "uint8_t_mavlink_version": "u1",
}


@dataclass(frozen=True)
class DialectMessage:
    """Layout of one message: its dtype, its text fields, and its arrays with their length."""

    name: str
    dtype: np.dtype[Any]
    texts: frozenset[str]
    arrays: dict[str, int]


@cache
def messages() -> dict[int, DialectMessage]:
    """Layouts by number of message: common and ArduPilot's own.

    Raises
    ------
    UnreadableLogError
        When pymavlink is not installed.
    """
    return {number: _message(kind) for number, kind in _map().items()}


@cache
def crc_extras() -> NDArray[np.int16]:
    """Return each message's extra checksum byte by number; :data:`UNKNOWN` for others."""
    extras = np.full(MOST_IDS, UNKNOWN, dtype=np.int16)
    for number, kind in _map().items():
        if 0 <= number < MOST_IDS:
            extras[number] = kind.crc_extra
    return extras


def _map() -> dict[int, Any]:
    try:
        from pymavlink.dialects.v20 import ardupilotmega
    except ImportError as error:
        step = "pip install 'groundstation[tlog]'"
        raise UnreadableLogError("MAVLink telemetry", "no tables of messages (pymavlink)", "", step) from error
    found: dict[int, Any] = ardupilotmega.mavlink_map
    return found


def _message(kind: Any) -> DialectMessage:
    by_name = dict(zip(kind.fieldnames, zip(kind.fieldtypes, range(len(kind.fieldnames)), strict=True), strict=True))
    fields: list[Any] = []
    texts, arrays = set(), {}
    for name in kind.ordered_fieldnames:
        type_name, place = by_name[name]
        length = kind.array_lengths[kind.orders[place]]
        if type_name == "char" and length:
            texts.add(name)
            fields.append((name, f"S{length}"))
        elif length:
            arrays[name] = length
            fields.append((name, _DTYPES[type_name], (length,)))
        else:
            fields.append((name, _DTYPES[type_name]))
    return DialectMessage(kind.msgname, np.dtype(fields), frozenset(texts), arrays)
