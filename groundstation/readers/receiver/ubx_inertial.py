"""Topic ``imu`` from the measurements of a u-blox receiver's own sensors, ESF-MEAS.

Axes are those of the receiver; the alignment that it finds is not applied. Times are those of its counter, set by the
messages with a full time around: the delay of their output stays in them.

Source: u-blox, interface description M8 and F9, "ESF Measurement Data": data types and scales.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from groundstation.base.records import Column, Int64Array, RecordBatch
from groundstation.readers import imu
from groundstation.readers.receiver.messages import MessagesByName
from groundstation.readers.receiver.times import Anchors

SOURCE = "ESF-MEAS"
# Type of a measurement -> its field and the unit of a bit.
_FIELDS: Mapping[int, tuple[str, float]] = MappingProxyType(
    {
        14: ("rate_x_dps", 2.0**-12),
        13: ("rate_y_dps", 2.0**-12),
        5: ("rate_z_dps", 2.0**-12),
        16: ("accel_x_mps2", 2.0**-10),
        17: ("accel_y_mps2", 2.0**-10),
        18: ("accel_z_mps2", 2.0**-10),
        12: ("temperature_c", 1e-2),
    }
)
_SIGN, _FULL = 1 << 23, 1 << 24  # of numbers of 24 bits
_NS_PER_TICK = 1_000_000


@dataclass
class CounterClock:
    """Difference between UTC and the counter of the measurements, from block to block."""

    zero_ns: int | None = None

    def time(self, places: Int64Array, counter_ns: Int64Array, anchors: Anchors) -> Column:
        """Return the UTC of measurements by their counter; absent before the first full time.

        No message comes before the time it tells, so the largest difference between the full time before a measurement
        and its counter is nearest to that between the two clocks.
        """
        at = np.searchsorted(anchors.places, places) - 1
        known = at >= 0
        if known.any():
            ahead_ns = int((anchors.utc_ns[at[known]] - counter_ns[known]).max())
            self.zero_ns = ahead_ns if self.zero_ns is None else max(self.zero_ns, ahead_ns)
        if self.zero_ns is None:
            return Column(np.zeros(len(places), dtype=np.int64), np.zeros(len(places), dtype=bool))
        return Column(counter_ns + self.zero_ns)


def imu_batch(block: MessagesByName, clock: CounterClock, anchors: Anchors) -> RecordBatch | None:
    """Return one row for each instant of measurement in a block; None where it has none."""
    messages = block.get(SOURCE)
    if messages is None or messages.layout is None or messages.layout.group is None or not len(messages):
        return None
    records, owner, _places = messages.group()
    group = messages.layout.group
    kinds, data = group.values(records, "dataType").astype(np.int64), group.values(records, "dataField")
    ticks = messages.head()["timeTag"].astype(np.int64)[owner]
    used = np.isin(kinds, list(_FIELDS))
    if not used.any():
        return None
    kinds, owner, ticks = kinds[used], owner[used], ticks[used]
    values = data[used].astype(np.int64)
    values = np.where(values >= _SIGN, values - _FULL, values)
    instants, row = np.unique(np.stack((owner, ticks)), axis=1, return_inverse=True)
    row = row.reshape(-1)
    columns: dict[str, Column] = {}
    for kind, (name, unit) in _FIELDS.items():
        mine = kinds == kind
        if mine.any():
            found, present = np.zeros(instants.shape[1]), np.zeros(instants.shape[1], dtype=bool)
            found[row[mine]], present[row[mine]] = values[mine] * unit, True
            columns[name] = Column(found, None if present.all() else present)
    columns = imu.samples(columns)
    if not columns:
        return None
    told = columns["is_integral"].mask
    places = messages.places[instants[0]] + _number_in_message(instants[0])
    time = clock.time(places, instants[1] * _NS_PER_TICK, anchors)
    return RecordBatch("imu", places, time, columns).take(told)


def _number_in_message(owner: Int64Array) -> Int64Array:
    """Return the number of each instant within its message."""
    first = np.flatnonzero(np.diff(owner, prepend=-1))
    return np.arange(len(owner)) - np.repeat(first, np.diff(first, append=len(owner)))
