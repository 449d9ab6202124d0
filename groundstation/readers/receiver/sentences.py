"""NMEA sentences of a block: fields found by one compiled loop, then whole columns at a time.

A sentence is ``$`` + address + fields parted by commas. The address is a talker (GP, GN ...) and a formatter (GGA); P
and letters of the maker where the sentence is a maker's own. Fields have the names of the table below, in the order of
NMEA 0183 (4.11); a version that has fewer leaves the last ones out. An empty field is absent.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from groundstation.base.compile import in_place, inlined
from groundstation.base.records import BoolArray, Column, Int64Array
from groundstation.base.units import NS_PER_S
from groundstation.readers.receiver import scan
from groundstation.readers.receiver.stream import Frames

COMMA, STAR, POINT, MINUS, PLUS = 44, 42, 46, 45, 43
CHECKSUM_BYTES = 3
MOST_DIGITS = 18  # of a number: more do not fit 64 bits
MOST_BEHIND = 13  # digits behind the point of an angle
ADDRESS_BYTES = 7

# Kinds of fields: n number, t time of day, d date, a latitude or longitude (its hemisphere is the next field), c text.
_GROUP_OF_SATELLITE = " ".join(f"svid_0{k}:n elv_0{k}:n az_0{k}:n cno_0{k}:n" for k in range(1, 5))
_PLACE = "lat:a NS:c lon:a EW:c"
FORMATTERS: Mapping[str, str] = MappingProxyType(
    {
        "GGA": f"time:t {_PLACE} quality:n numSV:n HDOP:n alt:n altUnit:c sep:n sepUnit:c diffAge:n diffStation:n",
        "GNS": f"time:t {_PLACE} posMode:c numSV:n HDOP:n alt:n sep:n diffAge:n diffStation:n navStatus:c",
        "GLL": f"{_PLACE} time:t status:c posMode:c",
        "RMC": f"time:t status:c {_PLACE} spd:n cog:n date:d mv:n mvEW:c posMode:c navStatus:c",
        "VTG": "cogt:n cogtUnit:c cogm:n cogmUnit:c sogn:n sognUnit:c sogk:n sogkUnit:c posMode:c",
        "GSA": "opMode:c navMode:n " + " ".join(f"svid_{k:02d}:n" for k in range(1, 13)) + " PDOP:n HDOP:n VDOP:n "
        "systemId:c",
        "GSV": f"numMsg:n msgNum:n numSV:n {_GROUP_OF_SATELLITE} signalID:c",
        "GST": "time:t rangeRms:n stdMajor:n stdMinor:n orient:n stdLat:n stdLong:n stdAlt:n",
        "ZDA": "time:t day:n month:n year:n ltzh:c ltzn:c",
        "HDT": "headingT:n headingTu:c",
        "HDM": "headingM:n headingMag:c",
        "HDG": "headingM:n deviation:n deviationEW:c variation:n variationEW:c",
        "THS": "headt:n mi:c",
        "ROT": "rot:n valid:c",
        "TXT": "numMsg:n msgNum:n msgType:n text:c",
        "PASHR": "utctime:t trueHdg:n trueHdgInd:c roll:n pitch:n reserved:c rollAcc:n pitchAcc:n hdgAcc:n "
        "gnssQual:n imuAlign:n",
    }
)
TIMED = ("GGA", "GNS", "RMC", "GLL", "ZDA", "GST", "PASHR")
_SATELLITE_FIELDS, _BEFORE_SATELLITES, _NO_FIELD = 4, 3, -1


@in_place
def _split(data: Any, offsets: Any, ends: Any, starts: Any, counts: Any) -> None:
    """Where the fields of sentences begin, one row a field; one more start stands behind the last field's end."""
    most = len(starts) - 1
    for sentence in range(len(offsets)):
        count = 0
        for k in range(offsets[sentence], ends[sentence]):
            if data[k] == COMMA and count < most:
                starts[count, sentence] = k + 1
                count += 1
        starts[count, sentence] = ends[sentence] + 1
        counts[sentence] = count


@inlined
def _number(data: Any, at: int, end: int) -> tuple[int, int, int]:
    """Digits of a decimal number as one integer, how many stand behind the point, and whether it is one (1, 0: empty,
    -1: something else)."""
    while at < end and data[at] == 32:
        at += 1
    while at < end and data[end - 1] == 32:
        end -= 1
    if at == end:
        return 0, 0, 0
    is_negative = data[at] == MINUS
    if is_negative or data[at] == PLUS:
        at += 1
    value, behind, digits, is_behind = 0, 0, 0, False
    for k in range(at, end):
        byte = data[k]
        if byte == POINT and not is_behind:
            is_behind = True
        elif 48 <= byte <= 57 and digits < MOST_DIGITS:
            value = 10 * value + (byte - 48)
            digits += 1
            behind += 1 if is_behind else 0
        else:
            return 0, 0, -1
    if digits == 0:
        return 0, 0, -1
    return (-value if is_negative else value), behind, 1


@in_place
def _numbers(data: Any, starts: Any, counts: Any, field: int, value: Any, behind: Any, state: Any) -> None:
    """Numbers of one field of all sentences."""
    begins, ends = starts[field], starts[field + 1]
    for row in range(len(counts)):
        if field < counts[row]:
            value[row], behind[row], state[row] = _number(data, begins[row], ends[row] - 1)


@in_place
def _times_of_day(value: Any, behind: Any, day_ns: Any, sound: Any) -> None:
    """Nanoseconds of the day of times written as ``hhmmss`` and digits behind the point."""
    for row in range(len(value)):
        unit = 10 ** behind[row]
        whole, fraction = value[row] // unit, value[row] % unit
        hour, minute, second = whole // 10_000, whole // 100 % 100, whole % 100
        sound[row] = value[row] >= 0 and hour < 24 and minute < 60 and second < 61
        if sound[row]:
            fraction_ns = (
                fraction * 10 ** (9 - behind[row]) if behind[row] <= 9 else fraction // 10 ** (behind[row] - 9)
            )
            day_ns[row] = ((hour * 60 + minute) * 60 + second) * NS_PER_S + fraction_ns


@in_place
def _addresses(data: Any, offsets: Any, keys: Any) -> None:
    """Addresses as numbers: their letters are the bytes, the first the highest."""
    for row in range(len(offsets)):
        for k in range(offsets[row] + 1, min(offsets[row] + 1 + ADDRESS_BYTES, len(data))):
            if data[k] == COMMA or data[k] == STAR or data[k] <= 32:
                break
            keys[row] = keys[row] * 256 + data[k]


@dataclass(frozen=True, eq=False)
class Sentences:
    """Sentences of one address in one block.

    Parameters
    ----------
    address : str
        ``GNGGA``, ``PASHR``.
    frames : Frames
    which : ndarray of int64, shape (n,)
        Which frames of the block they are.
    unreadable : dict of field to int
        Numbers that are none, counted as the columns are made.
    """

    address: str
    frames: Frames
    which: Int64Array
    unreadable: dict[str, int] = field(default_factory=dict)

    def __len__(self) -> int:
        return len(self.which)

    @property
    def formatter(self) -> str:
        """``GGA`` of ``GNGGA``; a maker's own address as it is."""
        return self.address if self.address.startswith("P") else self.address[2:]

    @property
    def places(self) -> Int64Array:
        """Byte of the file at which each begins."""
        return self.frames.places[self.which]

    @cached_property
    def _fields(self) -> tuple[Int64Array, Int64Array]:
        most = len(FORMATTERS.get(self.formatter, "").split()) + 1
        starts = np.zeros((most + 1, len(self)), dtype=np.int64)
        counts = np.zeros(len(self), dtype=np.int64)
        _split(self.frames.data, self.frames.offsets[self.which], self._ends, starts, counts)
        return starts, counts

    @property
    def _ends(self) -> Int64Array:
        """Where the last field of each sentence ends."""
        checksum = np.where(self.frames.kinds[self.which] == scan.NMEA, CHECKSUM_BYTES, 0)
        return self.frames.offsets[self.which] + self.frames.lengths[self.which] - checksum

    @cached_property
    def columns(self) -> dict[str, Column]:
        """Fields by name in the units of the sentence, times of day in seconds, angles in degrees; ``text`` of all
        fields where the sentence is not known here."""
        text = FORMATTERS.get(self.formatter)
        if text is None:
            return {"text": self._rest()}
        kinds = [word.split(":") for word in text.split()]
        found: dict[str, Column] = {}
        for number, (name, kind) in enumerate(kinds):
            found[name] = self._column(number, name, kind)
        return self._with_signal(found) if self.formatter == "GSV" else found

    def numbers(self, number: int) -> tuple[Int64Array, Int64Array, NDArray[np.int8]]:
        """Digits, decimals and state (1 a number, 0 empty, -1 something else) of one field, shape (n,) each."""
        starts, counts = self._fields
        value, behind = np.zeros(len(self), dtype=np.int64), np.zeros(len(self), dtype=np.int64)
        state = np.zeros(len(self), dtype=np.int8)
        _numbers(self.frames.data, starts, counts, number, value, behind, state)
        return value, behind, state

    def texts(self, number: int) -> Column:
        """One field as text."""
        starts, counts = self._fields
        has = counts > number
        begin = np.where(has, starts[number], 0)
        size = np.where(has, starts[number + 1] - 1 - begin, 0)
        return self._text(begin, size)

    def _text(self, begin: Int64Array, size: Int64Array) -> Column:
        width = max(int(size.max(initial=0)), 1)
        content = self.frames.bytes_at(begin, width)
        content = np.where(np.arange(width) < size[:, None], content, 0).astype(np.uint8)
        texts = np.ascontiguousarray(content).view(f"S{width}")[:, 0].astype(f"U{width}")
        return Column(texts, None if (size > 0).all() else size > 0)

    def _rest(self) -> Column:
        begin = self.frames.offsets[self.which] + len(self.address) + 2
        return Column(self._text(begin, np.maximum(self._ends - begin, 0)).values)

    def _column(self, number: int, name: str, kind: str) -> Column:
        if kind == "c":
            return self.texts(number)
        value, behind, state = self.numbers(number)
        if self.formatter == "GSV":
            state[self._signal == number] = 0
        present = state == 1
        if (state < 0).any():
            self.unreadable[name] = int((state < 0).sum())
        if kind == "a":
            return Column(_degrees(value, behind) * self._sign(number + 1), present & (behind <= MOST_BEHIND))
        if kind == "t":
            day_ns, sound = time_of_day_ns(value, behind)
            return Column(day_ns / NS_PER_S, present & sound)
        if kind == "d":
            return self._date(value, present)
        return Column(value / 10.0**behind, present)

    def _sign(self, number: int) -> NDArray[np.float64]:
        """-1 where the hemisphere in a field is south or west."""
        starts, counts = self._fields
        letters = self.frames.data[np.minimum(starts[number], len(self.frames.data) - 1)]
        return np.where((counts > number) & np.isin(letters, (ord("S"), ord("W"))), -1.0, 1.0)

    def _date(self, value: Int64Array, present: BoolArray) -> Column:
        texts = np.array([f"{date:06d}" for date in np.unique(value).tolist()] or [""])
        where = np.searchsorted(np.unique(value), value)
        return Column(texts[where], present)

    @cached_property
    def _signal(self) -> Int64Array:
        """GSV has as many satellites as there are; which field behind them is the signal (NMEA 4.11), -1: none."""
        counts = self._fields[1]
        has = (counts - _BEFORE_SATELLITES) % _SATELLITE_FIELDS == 1
        return np.where(has, counts - 1, _NO_FIELD)

    def _with_signal(self, found: dict[str, Column]) -> dict[str, Column]:
        signals = np.zeros(len(self), dtype="<U4")
        for number in np.unique(self._signal[self._signal != _NO_FIELD]).tolist():
            rows = self._signal == number
            signals[rows] = self.texts(number).values[rows]
        return found | {"signalID": Column(signals, signals != "")}


def sentences_of(frames: Frames) -> Iterator[Sentences]:
    """Sentences of a block by address."""
    which = frames.of(scan.NMEA, scan.BARE_NMEA)
    keys = np.zeros(len(which), dtype=np.int64)
    _addresses(frames.data, frames.offsets[which], keys)
    order = np.argsort(keys, kind="stable")
    distinct, starts = np.unique(keys[order], return_index=True)
    for key, rows in zip(distinct.tolist(), np.split(order, starts[1:]), strict=True) if len(which) else ():
        name = key.to_bytes(ADDRESS_BYTES, "big").lstrip(b"\0").decode("ascii", errors="replace")
        if name.isalnum():
            yield Sentences(name, frames, which[rows])


def by_address(frames: Frames) -> dict[str, Sentences]:
    """Sentences of a block by their address."""
    return {one.address: one for one in sentences_of(frames)}


def time_of_day_ns(value: Int64Array, behind: Int64Array) -> tuple[Int64Array, BoolArray]:
    """Nanoseconds of the day of ``hhmmss.sss`` written as one integer, and whether there is such a time.

    Examples
    --------
    >>> [array.tolist() for array in time_of_day_ns(np.array([161503500, 246000]), np.array([3, 0]))]
    [[58503500000000, 0], [True, False]]
    """
    day_ns, sound = np.zeros(len(value), dtype=np.int64), np.zeros(len(value), dtype=bool)
    _times_of_day(value, behind, day_ns, sound)
    return day_ns, sound


def _degrees(value: Int64Array, behind: Int64Array) -> NDArray[np.float64]:
    """Degrees of ``dddmm.mmmm`` written as one integer."""
    unit = 10**behind
    degrees, minutes = np.divmod(value, 100 * unit)
    return np.asarray((degrees * (60 * unit) + minutes) / (60 * unit))
