"""Buses of a flight written as Chapter 10: the topics on each, and the ICD."""

from collections.abc import Iterable
from dataclasses import replace
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from groundstation.base.dataclasses import dataclass
from groundstation.base.records import Int64Array
from groundstation.base.signals import kind_of, topics_of_kind
from groundstation.readers.icd import (
    Element,
    Element429,
    Icd,
    Message1553,
    Word429,
    encode_429,
    encode_1553,
    shipped,
    step_429,
    word_values,
)
from groundstation.tables.table import Flight, FloatArray, Table

WORD_TIME_NS = 360_000  # 36 bits of a high-speed ARINC 429 bus
FIRST_CHANNEL_1553 = 10
ON_WHEELS = Word429(  # no standard label: aircraft have their own
    "weight_on_wheels",
    0o270,
    elements=(
        Element429(
            *("weight_on_wheels", "UNSIGNEDBITS"),
            signal="discrete.weight_on_wheels",
            lsb=11,
            bit_count=1,
            status="discrete",
        ),
    ),
)
# Equipment on ARINC 429: name of its bus, ICD of its labels, topics that it sends.
SENDERS = (
    ("INS", "arinc429_inertial", ("ins",)),
    ("GNSS", "arinc429_gnss", ("gnss", "gnss_integrity")),
    ("ADC", "arinc429_air_data", ("baro", "air", "radio_altimeter", "discrete")),
)
AnyElement = TypeVar("AnyElement", bound=Element)


@dataclass(frozen=True)
class Bus1553:
    """One 1553 bus: channel, message, times of transmission, data words of shape (n, 32)."""

    channel: int
    message: Message1553
    time_ns: Int64Array
    data: NDArray[np.uint16]


@dataclass(frozen=True)
class Bus429:
    """One ARINC 429 bus: number in the channel, from 1, contents, and words in order of time."""

    subchannel: int
    name: str
    meanings: tuple[Word429, ...]
    time_ns: Int64Array
    words: NDArray[np.uint32]


@dataclass(frozen=True)
class Buses:
    """All buses of a flight, and the topics that are on none."""

    buses_1553: tuple[Bus1553, ...]
    buses_429: tuple[Bus429, ...]
    left_out: tuple[str, ...]

    @property
    def icd(self) -> Icd:
        """Return the ICD of the words.

        A signal that goes over both kinds of bus is fed by the 1553 message alone.
        """
        words = tuple(word for bus in self.buses_429 for word in bus.meanings)
        return Icd("buses", words, tuple(bus.message for bus in self.buses_1553))


def buses_of(flight: Flight) -> Buses:
    """Put the topics of a flight on buses.

    Every ``ins`` sends B100 on a 1553 bus of its own, and its labels on ARINC 429; ``gnss``, ``gnss_integrity``,
    ``baro``, ``air``, ``radio_altimeter`` and ``discrete`` send labels. An altitude above the ellipsoid is sent as that
    above sea level where an ``ins`` has no other. A sample that is missing is invalid in its message, and "no
    computed data" in its word.
    """
    topics = flight.topics()
    in_1553: list[Bus1553] = []
    for topic in topics_of_kind("ins", topics):
        in_1553 += _bus_1553(flight[topic], FIRST_CHANNEL_1553 + len(in_1553))
    fed = {one.signal for bus in in_1553 for one in bus.message.elements}
    in_429: list[Bus429] = []
    for name, icd, kinds in SENDERS:
        units = [topics_of_kind(kind, topics) for kind in kinds]
        for number in range(max(map(len, units))):
            sent = [flight[unit[number]] for unit in units if number < len(unit)]
            label = name if number == 0 else f"{name}-{number + 1}"
            in_429 += _bus_429(sent, (*shipped(icd).words_429, ON_WHEELS), label, len(in_429) + 1, fed)
    kinds_sent = {kind for _name, _icd, kinds in SENDERS for kind in kinds}
    left_out = tuple(topic for topic in topics if kind_of(topic) not in kinds_sent)
    return Buses(tuple(in_1553), tuple(in_429), left_out)


def _bus_1553(table: Table, channel: int) -> list[Bus1553]:
    """Return the bus of one inertial system; none when it has nothing of B100."""
    (layout,) = shipped("b100").messages_1553
    given = {one.name: _values(table, one) for one in layout.elements if one.signal}
    sent = {name: values for name, values in given.items() if values is not None}
    if not sent:
        return []
    elements = tuple(_of_unit(one, table.topic, (), is_sent=one.name in sent) for one in layout.elements)
    number = channel - FIRST_CHANNEL_1553
    name = "NAVBUS" if number == 0 else f"NAVBUS-{number + 1}"
    message = replace(layout, name=f"NAV_B100_{number + 1}", bus=name, elements=elements)
    return [Bus1553(channel, message, table.time_ns, encode_1553(message, sent))]


def _bus_429(
    tables: Iterable[Table], words: Iterable[Word429], name: str, subchannel: int, fed: set[str | None]
) -> list[Bus429]:
    """The bus of one piece of equipment; none when it has nothing to send.

    The words of a sample follow each other, each ``WORD_TIME_NS`` after the one before, those that no other bus feeds
    first; where samples come faster than the bus carries their words only every second, third ... is sent.
    """
    known, meanings = tuple(words), list[Word429]()
    times, made = list[Int64Array](), list[NDArray[np.uint32]]()
    sent = [(table, _carried(table, known)) for table in tables]
    count = sum(len(carried) for _table, carried in sent)
    for table, carried in sent:
        rows = slice(None, None, _every(table, count))
        units = [(word, values, _of_unit(word.elements[0], table.topic, fed)) for word, values in carried]
        for word, values, element in sorted(units, key=lambda unit: unit[2].signal is None):
            times.append(table.time_ns[rows] + len(made) * WORD_TIME_NS)
            made.append(encode_429(word, {element.name: values[rows]}))
            fine_of = f"{name}_{element.fine_of}" if element.fine_of else ""
            elements = (replace(element, fine_of=fine_of),)
            meanings.append(replace(word, name=f"{name}_{word.name}", bus=name, elements=elements))
    if not made:
        return []
    time_ns = np.concatenate(times)
    order = np.argsort(time_ns, kind="stable")
    return [Bus429(subchannel, name, tuple(meanings), time_ns[order], np.concatenate(made)[order])]


def _carried(table: Table, words: tuple[Word429, ...]) -> list[tuple[Word429, FloatArray]]:
    """Return the words that a table feeds, with their values.

    A fine word holds what is cut off its coarse word.
    """
    found: dict[str, tuple[Word429, FloatArray]] = {}
    for word in words:
        values = _values(table, word.elements[0])
        if values is not None:
            found[word.name] = word, values
    for word in words:
        coarse = word.elements[0].fine_of
        if coarse in found:
            holder, values = found[coarse]
            step, fine_step = step_429(holder.elements[0]), step_429(word.elements[0])
            values = np.round(values / fine_step) * fine_step  # first, so that the rest never rounds up to a whole step
            cut_off = np.floor(values / step) * step
            found[coarse], found[word.name] = (holder, cut_off), (word, values - cut_off)
    return list(found.values())


def _every(table: Table, words: int) -> int:
    """Return the number of samples of which one is sent.

    All words of one sample fit between it and the next.
    """
    if len(table) < 2:
        return 1
    period_ns = max(float(np.median(np.diff(table.time_ns))), 1.0)
    return max(int(np.ceil(words * WORD_TIME_NS / period_ns)), 1)


def _values(table: Table, element: Element) -> FloatArray | None:
    """Return the words' values of an element for every row; None if the table lacks it."""
    topic, _, name = (element.signal or "").rpartition(".")
    if not topic or kind_of(topic) != kind_of(table.topic):
        return None
    if topic == "ins" and name == "altitude_msl_m" and not table.has(name):
        name = "altitude_ellipsoid_m"
    return word_values(table.values(name), element) if table.has(name) else None


def _of_unit(element: AnyElement, topic: str, fed: Iterable[str | None], *, is_sent: bool = True) -> AnyElement:
    """Return the element as one of this topic.

    It has no signal where it is not sent or another bus feeds it.
    """
    signal = f"{topic}.{(element.signal or '').rpartition('.')[2]}" if element.signal else None
    return replace(element, signal=signal if is_sent and signal not in fed else None)
