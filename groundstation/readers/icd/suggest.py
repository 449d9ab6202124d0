"""Draft of an ICD from what is on the buses.

Known equipment is put in under its names, all else as numbers with their range. Equipment is known by what it sends
together, never by one label or address alone: labels mean other things on other equipment's buses. Whoever uses the
file has to check it.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import field, replace
from typing import Any, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from groundstation.base.dataclasses import dataclass
from groundstation.base.geodesy import continuous_longitude_deg
from groundstation.base.signals import kind_of
from groundstation.readers.icd.dump import to_yaml
from groundstation.readers.icd.load import shipped
from groundstation.readers.icd.model import Element, Element429, Element1553, FloatArray, Icd, Message1553, Word429
from groundstation.readers.icd.signals import signal_values
from groundstation.readers.icd.words_429 import decode_429, status_of
from groundstation.readers.icd.words_1553 import Data1553, decode_1553

TRANSMIT = 0x400
NEEDED_LABELS = 2  # labels below, with usable values, that a bus needs to count as that equipment's
_TELLING = {
    "arinc429_inertial": (0o314, 0o320, 0o324, 0o325),
    "arinc429_gnss": (0o110, 0o111, 0o120, 0o121, 0o370),
    "arinc429_air_data": (0o203, 0o206, 0o210),
}
_POSITIONS = ((0o310, 0o311), (0o110, 0o111))  # latitude, longitude: only both are a position
DOWNWARD, HALF_A_G_MPS2 = "accel_z_mps2", 4.9
HEAD = (
    "A start: what is on the buses. Equipment is guessed by what it sends together: check every name with its maker.",
    "Words without a known name are counts (msbval: 0); desc has the range seen, and of labels the sign/status matrix.",
)


class BusEntry(Protocol):
    """Entry of a bus: one command word or label, with some of its words.

    ``key`` is the command word or the label as a number; ``sub_channel`` is None on 1553; ``sample`` has words of
    shape (m,), or messages of shape (m, words) as recorded, command words first.
    """

    @property
    def channel(self) -> int: ...
    @property
    def sub_channel(self) -> int | None: ...
    @property
    def bus(self) -> str: ...
    @property
    def key(self) -> int: ...
    @property
    def rate_hz(self) -> float: ...
    @property
    def sample(self) -> NDArray[Any]: ...


Holder = TypeVar("Holder", Word429, Message1553)


@dataclass
class _Units:
    """Numbers of the units found so far, by kind of topic."""

    count: dict[str, int] = field(default_factory=dict)

    def named(self, holders: Sequence[Holder]) -> list[Holder]:
        """Return the words or messages of one piece of equipment, as the next units.

        They are the next unit of every kind that the equipment feeds.
        """
        kinds = {kind_of(one.signal) for holder in holders for one in holder.elements if one.signal}
        for kind in kinds:
            self.count[kind] = self.count.get(kind, 0) + 1
        return [self._numbered(holder) for holder in holders]

    def _numbered(self, holder: Any) -> Any:
        return replace(holder, elements=tuple(self._of_unit(one) for one in holder.elements))

    def _of_unit(self, element: Element) -> Element:
        if not element.signal:
            return element
        kind, _, name = element.signal.partition(".")
        return replace(element, signal=f"{kind}.{self.count[kind]}.{name}")


def suggest(entries: Iterable[BusEntry]) -> str:
    """Return a draft ICD in YAML that names everything on the buses.

    A bus is taken for an inertial reference's, a GNSS receiver's or an air data computer's when it has at least two of
    the labels that tell it, with values that may be used. A message is taken for one of the public layouts when its
    words hold together as that layout's do (direction cosines of length one, speeds that agree, spare words zero).
    """
    units, words, messages = _Units(), list[Word429](), list[Message1553]()
    by_bus: dict[tuple[int, int], list[BusEntry]] = {}
    for entry in entries:
        if entry.sub_channel is not None:
            by_bus.setdefault((entry.channel, entry.sub_channel), []).append(entry)
        else:
            messages += _message(entry, units)
    for on_bus in by_bus.values():
        words += _words(on_bus, units)
    single = {kind for kind, count in units.count.items() if count == 1}
    return to_yaml(Icd("", tuple(_plain(words, single)), tuple(_plain(messages, single))), head=HEAD)


def _plain(holders: Sequence[Holder], single: set[str]) -> Iterator[Holder]:
    """Holders whose signals have no number where there is one unit of a kind."""
    for holder in holders:
        elements: list[Any] = []
        for one in holder.elements:
            kind, _, rest = (one.signal or "").partition(".")
            elements.append(replace(one, signal=f"{kind}.{rest.partition('.')[2]}") if kind in single else one)
        yield replace(holder, elements=tuple(elements))


def _words(on_bus: Sequence[BusEntry], units: _Units) -> Iterator[Word429]:
    """Words of one ARINC 429 bus."""
    by_label = {entry.key: entry for entry in on_bus}
    known: dict[int, Word429] = {}
    for name, telling in _TELLING.items():
        there = [word for word in shipped(name).words_429 if word.label in by_label]
        found = _with_position({word.label: word for word in there if len(_usable(word, by_label))}, by_label)
        if len(found.keys() & set(telling)) >= NEEDED_LABELS:
            known |= {word.label: word for word in units.named(tuple(found.values()))}
    known = {label: replace(word, elements=_upright(word, by_label[label])) for label, word in known.items()}
    for entry in on_bus:
        word = known.get(entry.key, Word429(f"label_{entry.key:03o}", entry.key, elements=(_count_429(entry),)))
        place = f"ch{entry.channel}_{entry.sub_channel}"
        elements = tuple(
            replace(one, fine_of=f"{one.fine_of}_{place}" if one.fine_of else "", description=_range_429(entry, one))
            for one in word.elements
        )
        yield replace(
            word,
            name=f"{word.name}_{place}",
            bus=entry.bus,
            channel=entry.channel,
            subchannel=entry.sub_channel,
            rate_hz=_rate(entry),
            elements=elements,
        )


def _upright(word: Word429, entry: BusEntry) -> tuple[Element429, ...]:
    """Return the elements of a word, a normal acceleration with the sign that its values have.

    Units count it upwards or downwards, and an aircraft carries 1 g upwards at rest and most of the time: specific
    force down is negative then. Values below half of that decide nothing.
    """
    elements = []
    for one in word.elements:
        if one.signal is not None and one.signal.endswith(f".{DOWNWARD}"):
            values, usable = decode_429(entry.sample, one)
            usual_mps2 = float(np.median(values[usable] * one.factor)) if usable.any() else 0.0
            one = replace(one, factor=-one.factor) if usual_mps2 > HALF_A_G_MPS2 else one
        elements.append(one)
    return tuple(elements)


def _usable(word: Word429, by_label: Mapping[int, BusEntry]) -> FloatArray:
    """Return values of a word's first element; none if less than half may be used."""
    values, usable = decode_429(by_label[word.label].sample, word.elements[0])
    return values[usable] if 2 * int(np.count_nonzero(usable)) > len(usable) else values[:0]


def _with_position(found: dict[int, Word429], by_label: Mapping[int, BusEntry]) -> dict[int, Word429]:
    """Drop latitudes and longitudes that are no part of a position."""
    for pair in _POSITIONS:
        there = [_usable(found[label], by_label) for label in pair if label in found]
        if len(there) < 2 or not _is_position(*there):
            found = {label: word for label, word in found.items() if label not in pair}
    return found


def _count_429(entry: BusEntry) -> Element429:
    return Element429("value", "SIGNEDBITS", 0.0, lsb=11, bit_count=19, status="none")


def _range_429(entry: BusEntry, element: Element429) -> str:
    values, usable = decode_429(entry.sample, element)
    states = ", ".join(str(one) for one in np.unique(status_of(entry.sample)))
    return f"{_range(values[usable])}, SSM {states}"


def _message(entry: BusEntry, units: _Units) -> list[Message1553]:
    """Return the message of a command word.

    None for the receiver of what another terminal sends: the message is named by its sender.
    """
    data = _data(entry)
    if data is None:
        return []
    is_sent = bool(entry.key & TRANSMIT)
    command = (entry.key, 0) if is_sent else (0, entry.key)
    side, count = "T" if is_sent else "R", entry.key & 31 or 32
    place = f"RT{entry.key >> 11}_{side}_SA{entry.key >> 5 & 31}_{count}_words_ch{entry.channel}"
    message = Message1553(
        place, *command, bus=entry.bus, channel=entry.channel, word_count=data.shape[1], rate_hz=_rate(entry)
    )
    fitting = (name for name, fits in _LAYOUTS.items() if fits(data)) if is_sent and count == 32 else iter(())
    layout = next(fitting, None)
    if layout is None:
        return [replace(message, elements=tuple(_counts_1553(data)))]
    (known,) = shipped(layout).messages_1553
    elements = tuple(replace(one, description=_range(_values(data, one))) for one in known.elements)
    return units.named([replace(message, name=f"{layout}_{place}", elements=elements)])


def _data(entry: BusEntry) -> Data1553 | None:
    """Return the data words of the sample, shape (m, n).

    They follow the command word, of a sender the status word too.
    """
    rows, count = entry.sample, entry.key & 31 or 32
    if entry.key >> 5 & 31 in (0, 31):
        return None  # a mode code
    if entry.key & TRANSMIT:
        is_between = rows[:, 0] != entry.key
        first = np.where(is_between, 3, 2)
    else:
        is_between = (
            (rows[:, 1] & TRANSMIT > 0) & (rows[:, 1] & 31 == entry.key & 31) & (rows[:, 2] >> 11 == rows[:, 1] >> 11)
        )
        if is_between.all():
            return None
        first = np.ones(len(rows), dtype=np.int64)
    columns = np.minimum(first[:, None] + np.arange(count), rows.shape[1] - 1)
    return np.asarray(np.take_along_axis(rows, columns, axis=1)).astype(np.uint16)


def _counts_1553(data: Data1553) -> Iterator[Element1553]:
    """Yield a count for every word that changes; constant words are left out."""
    for place in np.flatnonzero((data != data[:1]).any(axis=0)).tolist():
        name = f"word_{place + 1:02d}"
        yield Element1553(name, "SIGNED16", 0.0, "", _range(data[:, place].view(np.int16)), offset=place)


def _rate(entry: BusEntry) -> float:
    return round(entry.rate_hz, 3) if np.isfinite(entry.rate_hz) else 0.0


def _range(values: NDArray[Any]) -> str:
    """Lowest and highest value, for people."""
    known = values[np.isfinite(values)]
    if not len(known):
        return "nothing that may be used"
    low, high = f"{known.min():.8g}", f"{known.max():.8g}"
    return low if low == high else f"{low} to {high}"


def _values(data: Data1553, element: Element1553) -> FloatArray:
    values = decode_1553(data, element)
    return signal_values(values, replace(element, factor=1.0)) if element.transform else values


def _named_values(data: Data1553, layout: str, *names: str) -> list[FloatArray]:
    elements = {one.name: one for one in shipped(layout).messages_1553[0].elements}
    return [decode_1553(data, elements[name]) for name in names]


def _is_position(latitude_deg: FloatArray, longitude_deg: FloatArray) -> bool:
    """Tell whether values are a place on Earth, not 0, 0, without jumps over a degree."""
    if not len(latitude_deg) or not len(longitude_deg) or not latitude_deg.all():
        return False
    is_inside = np.abs(latitude_deg).max() <= 90.0 and np.abs(longitude_deg).max() <= 180.0
    return bool(is_inside and np.ptp(latitude_deg) < 1.0 and np.ptp(continuous_longitude_deg(longitude_deg)) < 1.0)


def _fits_egi(data: Data1553) -> bool:
    """Tell whether the direction cosines have length one."""
    cxx, cxy, cxz, longitude_deg = _named_values(data, "egi", "cxx", "cxy", "cxz", "longitude")
    return bool(np.abs(np.sqrt(cxx**2 + cxy**2 + cxz**2) - 1.0).max() < 1e-3) and _is_position(cxz, longitude_deg)


def _fits_b100(data: Data1553) -> bool:
    """Tell whether the unused words are zero and there is a position.

    Without a position its flag says so and its words are zero, while heading, attitude and velocity are flagged valid.
    """
    unused = [1, *range(16, 20), *range(25, 32)]
    if data[:, unused].any():
        return False
    if data[:, 20:24].any():
        return _is_position(*_named_values(data, "b100", "latitude", "longitude"))
    names = ("position", "velocity", "true_heading", "attitude")
    position, *others = _named_values(data, "b100", *(f"{name}_valid" for name in names))
    is_told = bool(not position.any() and all(one.all() for one in others))
    return is_told and bool(data[:, 2:8].any() and data[:, 9:11].any() and data[:, 11].any())


def _fits_f15(data: Data1553) -> bool:
    """Tell whether the spare words are zero, there is a position, and ground speed agrees.

    The ground speed must be that of its north and east parts.
    """
    latitude_deg, longitude_deg, north, east, speed = _named_values(
        data, "f15_ins", "latitude", "longitude", "velocity_north", "velocity_east", "ground_speed"
    )
    agrees = bool(np.abs(np.hypot(north, east) - speed).max() < 2.0)  # ft/s
    has_attitude = bool(data[:, 9:12].any())
    return agrees and has_attitude and not data[:, 22:32].any() and _is_position(latitude_deg, longitude_deg)


_LAYOUTS: Mapping[str, Callable[[Data1553], bool]] = {"egi": _fits_egi, "b100": _fits_b100, "f15_ins": _fits_f15}
