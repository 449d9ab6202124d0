"""Satellites that a u-blox receiver tracks, and the strength of their signals, by epoch.

NAV-SAT has them by satellite, with those in the solution marked; RXM-RAWX by measurement.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from groundstation.base.angles import FloatArray
from groundstation.base.records import BoolArray, Column, Int64Array
from groundstation.readers.receiver.messages import Columns, MessagesByName

_MS_PER_WEEK = 604_800_000
SAME_EPOCH_MS = 50  # a receiver's own time of reception is some milliseconds from the epoch's round one


def signals(block: MessagesByName, family: str, fields: Mapping[str, NDArray[Any]]) -> Columns:
    """Return satellites tracked and mean C/N0 on the rows of the leading message."""
    week_ms = fields["iTOW"].astype(np.int64)
    for name in (f"{family}-SAT", "RXM-RAWX"):
        found = _of(block, name)
        if found is None:
            continue
        told_ms, tracked, cn0_dbhz = found
        order = np.argsort(told_ms, kind="stable")
        right = np.minimum(np.searchsorted(told_ms, week_ms, sorter=order), len(order) - 1)
        left = np.maximum(right - 1, 0)
        is_left = np.abs(told_ms[order[left]] - week_ms) < np.abs(told_ms[order[right]] - week_ms)
        at = order[np.where(is_left, left, right)]
        known = np.abs(told_ms[at] - week_ms) <= SAME_EPOCH_MS
        return {
            "satellites_tracked": Column(tracked[at], known),
            "cn0_dbhz": Column(np.nan_to_num(cn0_dbhz[at]), known & np.isfinite(cn0_dbhz[at])),
        }
    return {}


def _of(block: MessagesByName, name: str) -> tuple[Int64Array, FloatArray, FloatArray] | None:
    """Return time of the week (ms), satellites tracked and mean C/N0 of each message.

    None without any message.
    """
    messages, fields = block.get(name), block.fields(name)
    if messages is None or fields is None or messages.layout is None or messages.layout.group is None:
        return None
    records, owner, _places = messages.group()
    group = messages.layout.group
    strength = group.values(records, "cno").astype(np.float64)
    satellite = group.values(records, "gnssId").astype(np.int64) * 256 + group.values(records, "svId")
    is_tracked = strength > 0.0
    count = len(messages)
    if name == "RXM-RAWX":
        seconds = np.where(np.isfinite(fields["rcvTow"]), fields["rcvTow"], -1.0)
        told_ms = np.round(np.clip(seconds, -1.0, 1e6) * 1e3).astype(np.int64) % _MS_PER_WEEK
        used = is_tracked
    else:
        told_ms, used = fields["iTOW"].astype(np.int64), is_tracked & group.values(records, "svUsed")
    pairs = np.unique(owner[is_tracked] * 65_536 + satellite[is_tracked])  # several signals of one satellite count once
    tracked = np.bincount(pairs // 65_536, minlength=count).astype(np.float64)
    of_used, of_all = (_mean(strength, owner, rows, count) for rows in (used, is_tracked))
    return told_ms, tracked, np.where(np.isfinite(of_used), of_used, of_all)


def _mean(values: FloatArray, owner: Int64Array, rows: BoolArray, count: int) -> FloatArray:
    """Mean of some rows by owner, NaN where there is none."""
    number = np.bincount(owner[rows], minlength=count)
    total = np.bincount(owner[rows], weights=values[rows], minlength=count)
    return np.where(number > 0, total / np.maximum(number, 1), np.nan)
