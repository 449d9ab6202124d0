"""NMEA sentences of a block: one compiled loop finds the fields, numpy reads columns.

A sentence is ``$`` + address + fields parted by commas. The address is a talker (GP, GN ...) and a formatter (GGA); P
and letters of the maker where the sentence is a maker's own, with the word behind it where that chooses the layout
(``PUBX.00``). An empty field is absent.
"""

from collections.abc import Iterator
from dataclasses import field
from functools import cache, cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from groundstation.base.compile import in_place, inlined
from groundstation.base.dataclasses import dataclass
from groundstation.base.records import BoolArray, Column, Int64Array
from groundstation.base.sorted_values import distinct
from groundstation.base.units import NS_PER_S
from groundstation.readers.receiver import scan
from groundstation.readers.receiver.sentence_layouts import FAMILIES, FORMATTERS
from groundstation.readers.receiver.stream import Frames

COMMA, STAR, POINT, MINUS, PLUS, MAKERS = 44, 42, 46, 45, 43, 80  # P begins a maker's own address
CHECKSUM_BYTES = 3
MOST_DIGITS = 18  # digits of a number: more do not fit 64 bits
_POWERS = 10.0 ** np.arange(MOST_DIGITS + 1)  # looked up: to raise ten anew takes ten times as long
MOST_BEHIND = 13  # digits behind the point of an angle
ADDRESS_BYTES = 30  # longest address, such as PQTMCFGORIENTATIONERROR, and longest word behind it
NAMELESS = "sentence"  # in place of an address that is none: such sentences are kept as text
_EXACT_BYTES = 7  # addresses of so many bytes are their own key; longer ones are hashed
_PRIME, _LONG = (1 << 55) - 55, 1 << 57  # hashes are below the first, so that the next byte fits 64 bits

_UPPER_CASE = 0xDF  # mask that turns a letter into upper case
_HEMISPHERES = {"lat": "NS", "lon": "EW"}
_FIELDS_OF_OLD_VTG = 5  # fields of such a sentence with a mode
_SATELLITE_FIELDS, _BEFORE_SATELLITES, _NO_FIELD = 4, 3, -1


@in_place
def _split(data: Any, offsets: Any, ends: Any, starts: Any, counts: Any) -> None:
    """Find where the fields of sentences begin, one row a field.

    One more start stands behind the last field's end.
    """
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
    """Return the digits of a decimal number as one integer, its decimals, and its state.

    State 1: a number, 0: empty, -1: something else.
    """
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


@inlined
def _power_of_ten(exponent: int) -> int:
    """Return 10 to a power that is not negative.

    The operator ``**`` may fail, and code that may fail is not kept as machine code.
    """
    power = 1
    for _ in range(exponent):
        power *= 10
    return power


@in_place
def _times_of_day(value: Any, behind: Any, day_ns: Any, sound: Any) -> None:
    """Nanoseconds of the day of times written as ``hhmmss`` and digits behind the point."""
    for row in range(len(value)):
        unit = _power_of_ten(behind[row])
        whole, fraction = value[row] // unit, value[row] % unit
        hour, minute, second = whole // 10_000, whole // 100 % 100, whole % 100
        sound[row] = value[row] >= 0 and hour < 24 and minute < 60 and second < 61
        if sound[row]:
            if behind[row] <= 9:
                fraction_ns = fraction * _power_of_ten(9 - behind[row])
            else:
                fraction_ns = fraction // _power_of_ten(behind[row] - 9)
            day_ns[row] = ((hour * 60 + minute) * 60 + second) * NS_PER_S + fraction_ns


@inlined
def _is_letter(byte: int) -> bool:
    return 65 <= byte <= 90 or 97 <= byte <= 122


@inlined
def _is_word(byte: int) -> bool:
    """Tell whether a byte may stand in an address or in the word behind it."""
    return 48 <= byte <= 57 or 65 <= byte <= 90 or 97 <= byte <= 122 or byte == 95


@inlined
def _longer(key: int, byte: int, size: int) -> int:
    """Append a byte to a key of ``size`` bytes."""
    return 256 * key + byte if size < _EXACT_BYTES else _LONG + (31 * (key % _PRIME) + byte) % _PRIME


@inlined
def _is_end(byte: int) -> bool:
    """Tell whether an address or a field may end at a byte."""
    return byte in (COMMA, STAR) or byte < 32


@in_place
def _addresses(data: Any, offsets: Any, families: Any, keys: Any, sizes: Any) -> None:
    """Compute a number and the length in bytes of each address.

    The word behind the address is included in a family of makers' sentences. Both are 0 where there is no address.
    """
    for row in range(len(offsets)):
        start, key = offsets[row] + 1, 0
        k, end = start, min(start + ADDRESS_BYTES, len(data))
        while k < end and _is_word(data[k]):
            key = _longer(key, data[k], k - start)
            k += 1
        if k == start or (k < len(data) and not _is_end(data[k])):
            continue
        keys[row], sizes[row] = key, k - start
        for number in range(len(families) if data[start] == MAKERS else 0):
            if families[number, 0] == key and k + 1 < end and (families[number, 1] or _is_letter(data[k + 1])):
                key = _longer(key, COMMA, k - start)
                k += 1
                while k < end and _is_word(data[k]):
                    key = _longer(key, data[k], k - start)
                    k += 1
                if data[k - 1] != COMMA and (k == len(data) or _is_end(data[k])):
                    keys[row], sizes[row] = key, k - start
                break


@cache
def _families() -> Int64Array:
    """Keys of the addresses of several layouts, and whether digits choose one too."""
    keys = np.zeros((len(FAMILIES), 2), dtype=np.int64)
    for row, (address, is_numbered) in enumerate(FAMILIES.items()):
        keys[row] = int.from_bytes(address.encode(), "big"), is_numbered
    return keys


@dataclass(frozen=True, eq=False)
class Sentences:
    """Sentences of one address in one block.

    Parameters
    ----------
    address : str
        ``GNGGA``, ``PASHR``, ``PUBX.00``.
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
        """Formatter, such as ``GGA`` of ``GNGGA``; a maker's own address as it is."""
        return formatter_of(self.address)

    @property
    def places(self) -> Int64Array:
        """Byte of the file at which each begins."""
        return self.frames.places[self.which]

    @cached_property
    def _fields(self) -> tuple[Int64Array, Int64Array]:
        most = len(FORMATTERS.get(self.formatter, "").split()) + 1
        starts = np.zeros((most + 1, len(self)), dtype=np.int64)
        counts = np.zeros(len(self), dtype=np.int64)
        _split(self.frames.data, self._behind_address - 1, self._ends, starts, counts)
        return starts, counts

    @property
    def _behind_address(self) -> Int64Array:
        """Places where the fields of each sentence begin.

        A sentence without an address has all of its text there.
        """
        bytes_before = 1 if self.address == NAMELESS else len(self.address) + 2
        return self.frames.offsets[self.which] + bytes_before

    @property
    def _ends(self) -> Int64Array:
        """Places where the last field of each sentence ends."""
        checksum = np.where(self.frames.kinds[self.which] == scan.NMEA, CHECKSUM_BYTES, 0)
        return self.frames.offsets[self.which] + self.frames.lengths[self.which] - checksum

    @cached_property
    def columns(self) -> dict[str, Column]:
        """Fields by name in the units of the sentence, times of day in seconds, angles in degrees.

        A sentence that is not known here has one column ``text`` of all its fields.
        """
        text = FORMATTERS.get(self.formatter)
        if text is None:
            return {"text": self._rest()}
        kinds = [word.split(":") for word in text.split()]
        found: dict[str, Column] = {}
        for number, (name, kind) in enumerate(kinds):
            found[name] = self._column(number, name, kind)
        if self.formatter == "VTG":
            return self._with_old_form(found)
        return self._with_signal(found) if self.formatter == "GSV" else found

    def numbers(self, number: int) -> tuple[Int64Array, Int64Array, NDArray[np.int8]]:
        """Return digits, decimals and state of one field, shape (n,) each.

        State 1: a number, 0: empty, -1: something else.
        """
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
        content = np.where(np.arange(width) < size[:, None], self.frames.bytes_at(begin, width), 0)
        texts = content.astype(np.uint32, order="C").view(f"U{width}")[:, 0]  # a sentence is ASCII
        return Column(texts, None if (size > 0).all() else size > 0)

    def _rest(self) -> Column:
        begin = self._behind_address
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
            return self._angle(number, name, Column(value, present & (behind <= MOST_BEHIND)), behind)
        if kind == "t":
            day_ns, sound = time_of_day_ns(value, behind)
            return Column(day_ns / NS_PER_S, present & sound)
        if kind == "d":
            return self._date(value, present)
        return Column(_decimal(value, behind), present)

    def _angle(self, number: int, name: str, told: Column, behind: Int64Array) -> Column:
        """Return the latitude or longitude with the sign of its hemisphere, in the next field.

        Absent where the hemisphere or the minutes cannot be.
        """
        starts, counts = self._fields
        letters = self.frames.data[np.minimum(starts[number + 1], len(self.frames.data) - 1)] & _UPPER_CASE
        letters = np.where(counts > number + 1, letters, 0)
        positive, negative = (ord(letter) for letter in _HEMISPHERES[name])
        degrees, has_minutes = _degrees(np.abs(told.values), behind)
        is_angle = has_minutes & ((letters == positive) | (letters == negative))
        if (told.mask & ~is_angle).any():
            self.unreadable[name] = self.unreadable.get(name, 0) + int((told.mask & ~is_angle).sum())
        return Column(np.where(letters == negative, -degrees, degrees), told.mask & is_angle)

    def _date(self, value: Int64Array, present: BoolArray) -> Column:
        dates = distinct(value)
        texts = np.array([f"{date:06d}" for date in dates.tolist()] or [""])
        where = np.searchsorted(dates, value)
        return Column(texts[where], present)

    def _with_old_form(self, found: dict[str, Column]) -> dict[str, Column]:
        """Read VTG sentences in the form before NMEA 3.

        They have true and magnetic track, knots and km/h without a word of their units between them.
        """
        old = (self._fields[1] <= _FIELDS_OF_OLD_VTG) & (self.numbers(1)[2] == 1)
        if not old.any():
            return found
        for number, name in enumerate(("cogt", "cogm", "sogn", "sogk")):
            value, behind, state = self.numbers(number)
            column = found[name]
            told = Column(np.where(old, _decimal(value, behind), column.values), np.where(old, state == 1, column.mask))
            unit = found[f"{name}Unit"]
            found |= {name: told, f"{name}Unit": Column(unit.values, unit.mask & ~old)}
        return found

    @cached_property
    def _signal(self) -> Int64Array:
        """Number of the field of GSV with the signal (NMEA 4.11); -1 without one.

        It follows the fields of as many satellites as the sentence has.
        """
        counts = self._fields[1]
        has = (counts - _BEFORE_SATELLITES) % _SATELLITE_FIELDS == 1
        return np.where(has, counts - 1, _NO_FIELD)

    def _with_signal(self, found: dict[str, Column]) -> dict[str, Column]:
        signals = np.zeros(len(self), dtype="<U4")
        for number in distinct(self._signal[self._signal != _NO_FIELD]).tolist():
            rows = self._signal == number
            signals[rows] = self.texts(number).values[rows]
        return found | {"signalID": Column(signals, signals != "")}


def formatter_of(address: str) -> str:
    """Formatter of an address.

    Examples
    --------
    >>> formatter_of("GNGGA"), formatter_of("PASHR"), formatter_of("PUBX.00"), formatter_of(NAMELESS)
    ('GGA', 'PASHR', 'PUBX.00', '')
    """
    if address == NAMELESS:
        return ""
    return address if address.startswith("P") else address[2:]


def sentences_of(frames: Frames) -> Iterator[Sentences]:
    """Sentences of a block by address."""
    which = frames.of(scan.NMEA, scan.BARE_NMEA)
    if not len(which):
        return
    keys, sizes = np.zeros(len(which), dtype=np.int64), np.zeros(len(which), dtype=np.int64)
    _addresses(frames.data, frames.offsets[which], _families(), keys, sizes)
    order = np.argsort(keys, kind="stable")
    ordered = keys[order]
    for rows in np.split(order, np.flatnonzero(ordered[1:] != ordered[:-1]) + 1):
        at, size = int(frames.offsets[which[rows[0]]]) + 1, int(sizes[rows[0]])
        name = frames.data[at : at + size].tobytes().decode("ascii").replace(",", ".")
        yield Sentences(name or NAMELESS, frames, which[rows])


def by_address(frames: Frames) -> dict[str, Sentences]:
    """Sentences of a block by their address, in alphabetical order."""
    return {one.address: one for one in sorted(sentences_of(frames), key=lambda one: one.address)}


def time_of_day_ns(value: Int64Array, behind: Int64Array) -> tuple[Int64Array, BoolArray]:
    """Convert ``hhmmss.sss`` written as one integer to nanoseconds of the day.

    The second array tells where there is such a time.

    Examples
    --------
    >>> [array.tolist() for array in time_of_day_ns(np.array([161503500, 246000]), np.array([3, 0]))]
    [[58503500000000, 0], [True, False]]
    """
    day_ns, sound = np.zeros(len(value), dtype=np.int64), np.zeros(len(value), dtype=bool)
    _times_of_day(value, behind, day_ns, sound)
    return day_ns, sound


def _decimal(value: Int64Array, behind: Int64Array) -> NDArray[np.float64]:
    """Return numbers, of their digits as one integer and how many stand behind the point.

    Examples
    --------
    >>> _decimal(np.array([4_705, -12]), np.array([2, 0])).tolist()
    [47.05, -12.0]
    """
    return np.asarray(value / _POWERS[behind])


def _degrees(value: Int64Array, behind: Int64Array) -> tuple[NDArray[np.float64], BoolArray]:
    """Convert ``dddmm.mmmm`` written as one integer to degrees.

    The second array tells where the minutes are at most 60, as some devices round them.
    """
    unit = 10**behind
    degrees, minutes = np.divmod(value, 100 * unit)
    return np.asarray((degrees * (60 * unit) + minutes) / (60 * unit)), minutes <= 60 * unit
