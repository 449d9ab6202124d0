"""UTC of power-up: by the receivers of a log, else by the autopilot's own clock."""

import re
from dataclasses import field

import numpy as np

from groundstation.base.dataclasses import dataclass
from groundstation.base.errors import GroundstationError
from groundstation.base.records import Int64Array, Remark
from groundstation.base.timescales import GPS_EPOCH_NS, iso_to_utc_ns, utc_ns_to_iso
from groundstation.base.units import NS_PER_S
from groundstation.base.words import counted
from groundstation.readers.rollover import Earliest, OtherDate, rollovers
from groundstation.readers.start import ToldZero, told_at_zero
from groundstation.readers.ulog.blocks import Topic, UlogBlock
from groundstation.readers.ulog.messages import Keyed, logged_text

UTC_SOURCES = ("vehicle_gps_position", "sensor_gps", "vehicle_global_position")
FIX_3D = 3
_NS_PER_US = 1_000
_EPOCH_US = GPS_EPOCH_NS // _NS_PER_US
_EARLIEST_US = iso_to_utc_ns("1980-01-08T00:00:00Z")[0] // _NS_PER_US  # an earlier clock was not set
_OWN_EARLIEST_US = 1_234_567_890_000_000  # 2009: PX4 takes its own clock for one that was not set before it
_LATEST_US = iso_to_utc_ns("2100-01-01T00:00:00Z")[0] // _NS_PER_US
_BOOT_TIME, _OFFSET = "boot_time_utc_us", "time_ref_utc"
_LOG_NAME = re.compile(r"/(\d{4})-(\d\d)-(\d\d)/(\d\d)_(\d\d)_(\d\d)\w*\.ulg")
_MOST_OFFSET_S = 86_400
_FEW = 0.1  # share of another receiver's readings that is too few to be preferred to it
_FEWEST = 3  # readings of a date that cannot be true, as a receiver tells that missed a rollover
_APART_NS = 2 * NS_PER_S
# Minor version of PX4 1.x -> the year its development began. Source: releases of PX4-Autopilot on GitHub.
_YEARS = dict(enumerate((2016, 2016, 2016, 2017, 2017, 2018, 2019, 2019, 2020, 2021, 2022, 2023, 2024, 2025), start=4))
_FORMAT = Earliest(2016, "the ULog format", moves=False)
_FORMAT_NS = iso_to_utc_ns("2016-01-01T00:00:00Z")[0]


@dataclass(frozen=True)
class _OwnClock:
    """UTC of power-up by the autopilot's clock, a moment by it, its name, a remark."""

    zero_ns: int
    moment_ns: int
    name: str
    remark: Remark


@dataclass(frozen=True)
class PowerUpTime:
    """UTC of power-up in nanoseconds, None where nothing states it, and remarks."""

    utc_ns: int | None = None
    remarks: tuple[Remark, ...] = ()


@dataclass
class UtcCollector:
    """Collector of what states UTC, block by block."""

    _told: dict[str, list[Int64Array]] = field(default_factory=dict)  # UTC and device time of fixes, microseconds
    _boot_us: int = 0
    _offset_s: int = 0
    _line: tuple[str, int] | None = None  # name of the log, and when the line with it was written

    def take(self, block: UlogBlock, topic: Topic) -> None:
        """Take in the messages of a topic."""
        layout = topic.layout
        if topic.name not in UTC_SOURCES or layout is None or layout.timestamp_offset is None:
            return
        if "time_utc_usec" not in layout.names:
            return
        rows = block.rows(layout, np.flatnonzero(block.topic == topic.number))
        utc, device = rows["time_utc_usec"].astype(np.uint64), rows["timestamp"]
        good = (utc >= _EPOCH_US) & (utc < _LATEST_US) & (device > 0) & (device < _LATEST_US)
        if "fix_type" in layout.names:
            good &= rows["fix_type"] >= FIX_3D
        at_us = device[good].astype(np.int64)
        if "timestamp_time_relative" in layout.names:  # the message tells when its UTC was true
            at_us += rows["timestamp_time_relative"][good]
        if good.any():
            label = f"{topic.name}.{topic.instance}" if topic.instance else topic.name
            self._told.setdefault(label, []).append(np.stack([utc[good].astype(np.int64), at_us]) * _NS_PER_US)

    def heed(self, fact: Keyed) -> None:
        """Take in a piece of information, or a parameter."""
        if not isinstance(fact.value, int):
            return
        if fact.key == _BOOT_TIME and _OWN_EARLIEST_US <= fact.value < _LATEST_US:
            self._boot_us = fact.value
        elif fact.key == _OFFSET and abs(fact.value) <= _MOST_OFFSET_S:
            self._offset_s = fact.value

    def heed_line(self, kind: str, body: bytes) -> None:
        """Take in a logged line: the one with the log's name has the date."""
        if self._line is None and b".ulg" in body:
            line = logged_text(body, kind == "C")
            self._line = (line.text, line.timestamp_us) if _LOG_NAME.search(line.text) else None

    def power_up(self, release: str) -> PowerUpTime:
        """Return UTC of power-up by the surest clock; ``release`` is the firmware's version."""
        own = self._own()
        told = {name: np.concatenate(self._told[name], axis=1) for name in sorted(self._told, key=_rank)}
        told = {name: one for name, one in told.items() if _is_dated(one[0])}
        if not told:
            return PowerUpTime() if own is None else _dated(own.zero_ns, own.moment_ns, (own.remark,), release, ())
        receivers = {name: told_at_zero(*one) for name, one in told.items()}
        name, found = _chosen(receivers)
        moment_ns = int(told[name][0, -1])
        zeros = {other: one.ns for other, one in receivers.items() if other != name}
        zeros |= {} if own is None else {own.name: own.zero_ns}
        others = tuple(OtherDate(other, moment_ns + (zero_ns - found.ns)) for other, zero_ns in zeros.items())
        text = (
            f"UTC of power-up from {name}: median over {counted(len(found.zeros_ns), 'time')} with a fix, nine tenths "
            f"within {found.spread_s:.3f} s; messages come some 0.1 s after the time they tell"
        )
        remarks = (Remark("utc_from_gnss", text), *found.remarks(name))
        start = _dated(found.ns, moment_ns, remarks, release, others)
        return PowerUpTime(start.utc_ns, (*start.remarks, *_apart(own, name, start.utc_ns)))

    def _own(self) -> _OwnClock | None:
        """Return the autopilot's own clock: its start, or else the name of its log."""
        if self._boot_us:
            began_ns = self._boot_us * _NS_PER_US
            text = (
                f"UTC of power-up from {_BOOT_TIME}, {utc_ns_to_iso(began_ns)}: the autopilot's clock as the ground "
                "station (or a receiver) had set it before logging began, not GNSS time of this log"
            )
            return _OwnClock(began_ns, began_ns, _BOOT_TIME, Remark("utc_from_boot_time", text))
        if self._line is None:
            return None
        name = _LOG_NAME.search(self._line[0])
        utc_ns, device_us = _utc_of_name(self._line[0], self._offset_s), self._line[1]
        if name is None or utc_ns is None or not 0 < device_us < _LATEST_US:
            return None
        zone = f", less {self._offset_s} s of its local time" if self._offset_s else ""
        text = (
            f"UTC of power-up from the name that the autopilot gave its log, {name.group().lstrip('/')}{zone}: good to "
            "a second, by a clock that the ground station or a receiver had set before logging began, not GNSS time of "
            "this log"
        )
        remark = Remark("utc_from_log_name", text)
        return _OwnClock(utc_ns - device_us * _NS_PER_US, utc_ns, "the log's name", remark)


def _rank(name: str) -> tuple[int, str]:
    """Return the sort key of a receiver: its topic, then its instance."""
    topic, _point, instance = name.partition(".")
    return UTC_SOURCES.index(topic), instance.zfill(3)


def _utc_of_name(text: str, offset_s: int) -> int | None:
    """Return UTC of the date and time in a log's name, which are local by ``offset_s``.

    Examples
    --------
    >>> utc_ns_to_iso(_utc_of_name("[logger] ./log/2024-03-18/14_49_10.ulg", 3_600))
    '2024-03-18T13:49:10.000Z'
    """
    found = _LOG_NAME.search(text)
    if found is None:
        return None
    year, month, day, hour, minute, second = found.groups()
    try:
        utc_ns = iso_to_utc_ns(f"{year}-{month}-{day}T{hour}:{minute}:{second}Z")[0] - offset_s * NS_PER_S
    except GroundstationError:
        return None
    return utc_ns if _OWN_EARLIEST_US <= utc_ns // _NS_PER_US < _LATEST_US else None


def _is_dated(utc_ns: Int64Array) -> bool:
    """Tell whether a receiver knew a date, even one that cannot be true."""
    return bool(utc_ns[-1] >= _FORMAT_NS or (utc_ns >= _EARLIEST_US * _NS_PER_US).sum() >= _FEWEST)


def _chosen(receivers: dict[str, ToldZero]) -> tuple[str, ToldZero]:
    """Return the first receiver that did not fall silent after a few readings."""
    most = max(len(one.zeros_ns) for one in receivers.values())
    return next((name, one) for name, one in receivers.items() if len(one.zeros_ns) >= _FEW * most)


def _dated(
    zero_ns: int, moment_ns: int, remarks: tuple[Remark, ...], release: str, others: tuple[OtherDate, ...]
) -> PowerUpTime:
    """Return UTC of power-up on a date that it can have, as far as the log shows it."""
    found = rollovers(moment_ns, earliest=_earliest(release), others=others)
    return PowerUpTime(zero_ns + found.shift_ns(moment_ns, is_gps_time=False), (*remarks, *found.remarks))


def _earliest(release: str) -> Earliest:
    """Return the year before which a version of PX4, or else the format, did not exist.

    Examples
    --------
    >>> _earliest("v1.11.2").year, _earliest("v1.99.0 rc").year, _earliest("v2.3.0").what, _earliest("").year
    (2019, 2025, 'the ULog format', 2016)
    """
    found = re.match(r"v1\.(\d+)\.", release)
    if found is None or int(found[1]) < min(_YEARS):
        return _FORMAT
    return Earliest(_YEARS.get(int(found[1]), max(_YEARS.values())), f"PX4 {release}")


def _apart(own: _OwnClock | None, receiver: str, utc_ns: int | None) -> list[Remark]:
    """Return a remark that the autopilot's clock and a receiver disagree."""
    if own is None or utc_ns is None or abs(own.zero_ns - utc_ns) <= _APART_NS:
        return []
    away_s = (own.zero_ns - utc_ns) / NS_PER_S
    text = f"{own.name} tells a power-up {away_s:+.3f} s off that by {receiver}: it is not used"
    return [Remark("clock_disagrees", text)]
