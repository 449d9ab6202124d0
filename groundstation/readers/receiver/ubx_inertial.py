"""Topic ``imu`` from a u-blox receiver's own sensors, ESF-MEAS or ESF-RAW.

Axes are those of the receiver; the alignment that it finds is not applied. Times are those of its counter, set by the
messages with a full time around: the delay of their output stays in them.

ESF-RAW has several samples of each sensor in a message. Receivers that write milliseconds since their start into its
first four bytes (which u-blox calls reserved) tell the time of the first; the others follow by the own counter of the
sensor.
Without those milliseconds the message stays raw: the counter alone drifts by a percent.

Source: u-blox, interface description M8 and F9, "ESF Measurement Data" and UBX-ESF-RAW: data types and scales. Swift
Navigation, gnss_converters (MIT), ubx_sbp.c: msss, and the counter's step of 39.0625 us, of 24 bits.
"""

from collections.abc import Mapping
from types import MappingProxyType

import numpy as np

from groundstation.base.dataclasses import dataclass
from groundstation.base.records import Column, Int64Array, RecordBatch
from groundstation.readers import imu
from groundstation.readers.receiver.messages import MessagesByName
from groundstation.readers.receiver.times import Anchors

MEASURED, RAW = "ESF-MEAS", "ESF-RAW"
SOURCES = (MEASURED, RAW)  # of both the one with more samples
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
_NS_PER_SENSOR_TICK, _SENSOR_TICKS = 39_062.5, 1 << 24
_TEMPERATURE = 12


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


@dataclass(frozen=True)
class _Measurements:
    """Values of sensors in the messages of a block: message, type, number and counter of each."""

    owner: Int64Array
    kinds: Int64Array
    values: Int64Array
    counter_ns: Int64Array


def samples_in(block: MessagesByName, source: str) -> int:
    """Return how many inertial values with a time the messages of a block hold."""
    found = _measurements(block, source)
    return 0 if found is None else int((found.kinds != _TEMPERATURE).sum())


def _measurements(block: MessagesByName, source: str) -> _Measurements | None:
    messages = block.get(source)
    if messages is None or messages.layout is None or messages.layout.group is None or not len(messages):
        return None
    records, owner, _places = messages.group()
    group, head = messages.layout.group, messages.head()
    kinds = group.values(records, "dataType").astype(np.int64)
    used = np.isin(kinds, list(_FIELDS))
    if source == MEASURED:
        counter_ns = head["timeTag"].astype(np.int64)[owner] * _NS_PER_TICK
    else:
        msss, tags = head["msss"].astype(np.int64)[owner], group.values(records, "sTtag").astype(np.int64)
        first = np.flatnonzero(np.diff(owner, prepend=-1))
        since = (tags - np.repeat(tags[first], np.diff(first, append=len(owner)))) % _SENSOR_TICKS
        counter_ns = msss * _NS_PER_TICK + np.rint(since * _NS_PER_SENSOR_TICK).astype(np.int64)
        used &= msss > 0
    if not used.any():
        return None
    values = group.values(records, "dataField").astype(np.int64)
    return _Measurements(owner[used], kinds[used], values[used], counter_ns[used])


def imu_batch(block: MessagesByName, source: str, clock: CounterClock, anchors: Anchors) -> RecordBatch | None:
    """Return one row for each instant of measurement in a block; None where it has none."""
    messages, found = block.get(source), _measurements(block, source)
    if messages is None or found is None:
        return None
    owner, kinds, values = found.owner, found.kinds, found.values
    values = np.where(values >= _SIGN, values - _FULL, values)
    instants, row = np.unique(np.stack((owner, found.counter_ns)), axis=1, return_inverse=True)
    row = row.reshape(-1)
    columns: dict[str, Column] = {}
    for kind, (name, unit) in _FIELDS.items():
        mine = kinds == kind
        if mine.any():
            measured, present = np.zeros(instants.shape[1]), np.zeros(instants.shape[1], dtype=bool)
            measured[row[mine]], present[row[mine]] = values[mine] * unit, True
            columns[name] = Column(measured, None if present.all() else present)
    columns = imu.samples(columns)
    if not columns:
        return None
    told = columns["is_integral"].mask
    places = messages.places[instants[0]] + _number_in_message(instants[0])
    time = clock.time(places, instants[1], anchors)
    return RecordBatch("imu", places, time, columns).take(told)


def _number_in_message(owner: Int64Array) -> Int64Array:
    """Return the number of each instant within its message."""
    first = np.flatnonzero(np.diff(owner, prepend=-1))
    return np.arange(len(owner)) - np.repeat(first, np.diff(first, append=len(owner)))
