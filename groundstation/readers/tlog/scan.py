"""Compiled loop over the bytes of a telemetry log: it finds frames by their checksum.

Source: MAVLink developer guide, packet serialization; the checksum is CRC-16/MCRF4XX over all but the first byte, then
over one byte that the message's definition gives.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from groundstation.base.compile import in_place

LONGEST = 8 + 10 + 255 + 2 + 13
# Columns of a frame that was found.
TIME_US, NUMBER, SYSTEM, PAYLOAD_AT, PAYLOAD_BYTES, COLUMNS = 0, 1, 2, 3, 4, 5
SPANS, DONE, UNKNOWN = 0, 1, 2  # places in what a scan tells


@in_place
def _checksum(data: Any, start: int, end: int, extra: int) -> int:
    crc = 0xFFFF
    for at in range(start, end + 1):
        byte = int(data[at]) if at < end else extra
        low = (byte ^ crc) & 0xFF
        low = (low ^ (low << 4)) & 0xFF
        crc = ((crc >> 8) ^ (low << 8) ^ (low << 3) ^ (low >> 4)) & 0xFFFF
    return crc


@in_place
def _frame_end(data: Any, at: int, limit: int) -> int:
    """Return the end of the frame behind the time at ``at``.

    0 when no frame begins there, -1 when it ends behind the data.
    """
    if at + 10 > limit:
        return -1
    start = at + 8
    if data[start] == 0xFE:
        end = start + 8 + int(data[start + 1])
    elif data[start] == 0xFD and at + 11 <= limit:
        end = start + 12 + int(data[start + 1]) + (13 if data[start + 2] & 1 else 0)
    elif data[start] == 0xFD:
        return -1
    else:
        return 0
    return end if end <= limit else -1


@in_place
def scan(data: Any, is_last: bool, extras: Any, frames: Any, skipped: Any, told: Any) -> int:
    """Find frames and return their number.

    ``frames`` (m, 5) receives time, number of message, system x 256 + component, place and bytes of the payload;
    ``skipped`` (k, 3) first byte, the first behind, and the frames before; ``told`` (3,) how many stretches were
    skipped, where to go on, and how many frames are unknown. A frame of an unknown number has no checksum that can be
    computed: it is passed over if another begins where it ends.
    """
    limit, at, count, spans, unknown, lost_from = len(data), 0, 0, 0, 0, -1
    while at < limit and count < len(frames) and spans < len(skipped) - 1:
        if not is_last and at + LONGEST > limit:
            break
        end = _frame_end(data, at, limit)
        good, number, extra = False, 0, -1
        if end > 0:
            start = at + 8
            if data[start] == 0xFE:
                number, head = int(data[start + 5]), 6
                system = int(data[start + 3]) * 256 + int(data[start + 4])
            else:
                number = int(data[start + 7]) + int(data[start + 8]) * 256 + int(data[start + 9]) * 65536
                head = 10
                system = int(data[start + 5]) * 256 + int(data[start + 6])
            payload_end = start + head + int(data[start + 1])
            extra = int(extras[number]) if number < len(extras) else -1
            if extra >= 0:
                stored = int(data[payload_end]) + int(data[payload_end + 1]) * 256
                good = _checksum(data, start + 1, payload_end, extra) == stored
                if good:
                    time_us = 0
                    for k in range(8):
                        time_us = (time_us << 8) | int(data[at + k])
                    frames[count, 0] = time_us
                    frames[count, 1] = number
                    frames[count, 2] = system
                    frames[count, 3] = start + head
                    frames[count, 4] = int(data[start + 1])
            elif lost_from < 0:
                good = end == limit or _frame_end(data, end, limit) != 0
        if good:
            if lost_from >= 0:
                skipped[spans, 0], skipped[spans, 1], skipped[spans, 2] = lost_from, at, count
                spans += 1
                lost_from = -1
            if extra >= 0:
                count += 1
            else:
                unknown += 1
            at = end
        else:
            if lost_from < 0:
                lost_from = at
            at += 1
    if lost_from >= 0:
        skipped[spans, 0], skipped[spans, 1], skipped[spans, 2] = lost_from, at, count
        spans += 1
    told[SPANS], told[DONE], told[UNKNOWN] = spans, at, unknown
    return count


def room(size: int) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]:
    """Return arrays for the frames and skipped stretches of so many bytes, and the state."""
    return np.empty((size // 16 + 1, COLUMNS), np.int64), np.empty((4_096, 3), np.int64), np.empty(3, np.int64)
