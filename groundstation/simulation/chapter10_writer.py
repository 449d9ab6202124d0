"""Writer of a flight as IRIG 106 Chapter 10, with the ICD beside it.

It writes TMATS, time, the layout B100 on 1553 and labels on ARINC 429.
"""

from collections.abc import Iterator
from heapq import merge
from pathlib import Path
from typing import TypeAlias

import numpy as np

from groundstation.base.records import Int64Array
from groundstation.base.units import NS_PER_S
from groundstation.readers.icd import to_yaml
from groundstation.simulation.chapter10_buses import Bus429, Bus1553, Buses, buses_of
from groundstation.simulation.chapter10_packets import (
    ARINC_429_F0,
    BUS_1553_F1,
    NS_PER_TICK,
    TIME_F1,
    TMATS,
    Packer,
    body_429,
    body_1553,
    time_body,
    tmats_body,
)
from groundstation.tables.table import Flight

TIME_CHANNEL, ARINC_CHANNEL = 1, 40
FIRST_TICK = 100_000_000  # counter at the start of the flight: the recorder has run for ten seconds
PACKET_TICKS = 1_000_000  # a packet holds what begins within 0.1 s; any gap in it fits the field of ARINC 429
Draft: TypeAlias = tuple[int, int, int, int, bytes]  # counter at its last and first word, channel, type, body


def write_chapter10(path: Path, flight: Flight, *, cut_bytes: int = 0) -> tuple[Path, tuple[str, ...]]:
    """Write a flight, and the ICD of its buses beside it: ``x.ch10`` and ``x.icd.yaml``.

    The relative time counter follows the flight's corrected time. Time packets, one a second, give UTC where the flight
    has it. :func:`groundstation.simulation.chapter10_buses.buses_of` decides what is sent.

    Parameters
    ----------
    path : Path
    flight : Flight
        Simulated or recorded.
    cut_bytes : int
        Bytes missing at the end, as after a loss of power.

    Returns
    -------
    icd : Path
    left_out : tuple of str
        Topics that are on no bus.
    """
    buses = buses_of(flight)
    packer = Packer()
    with path.open("wb") as file:
        file.write(packer.packet(0, TMATS, FIRST_TICK, tmats_body(_setup(flight, buses))))
        streams = [
            _time_packets(flight, buses),
            *(_packets_1553(bus, flight.start_ns) for bus in buses.buses_1553),
            _packets_429(buses.buses_429, flight.start_ns),
        ]
        for _last, first, channel, kind, body in merge(*streams, key=lambda draft: draft[:3]):
            file.write(packer.packet(channel, kind, first, body))
        if cut_bytes:
            file.truncate(max(file.tell() - cut_bytes, 0))
    icd = path.with_suffix(".icd.yaml")
    icd.write_text(to_yaml(buses.icd, head=[f"What the buses of {path.name} hold."]), encoding="utf-8")
    return icd, buses.left_out


def _ticks(time_ns: Int64Array, start_ns: int) -> Int64Array:
    return FIRST_TICK + (time_ns - start_ns + NS_PER_TICK // 2) // NS_PER_TICK


def _time_packets(flight: Flight, buses: Buses) -> Iterator[Draft]:
    """Make a time packet at every whole second of UTC, the first before all data."""
    times = [*(bus.time_ns for bus in buses.buses_1553), *(bus.time_ns for bus in buses.buses_429)]
    ends = [one[[0, -1]] for one in times if len(one)]
    if not flight.has_utc or not ends:
        return
    first_s, last_s = (int(one) // NS_PER_S for one in (np.min(ends), np.max(ends)))
    for utc_s in range(first_s, last_s + 2):
        tick = int(_ticks(np.array(utc_s * NS_PER_S), flight.start_ns))
        yield tick, tick, TIME_CHANNEL, TIME_F1, time_body(utc_s * NS_PER_S)


def _blocks(ticks: Int64Array) -> Iterator[slice]:
    """Return the rows of each packet."""
    edges = np.flatnonzero(np.diff(ticks // PACKET_TICKS)) + 1
    for first, last in zip([0, *edges], [*edges, len(ticks)], strict=True):
        if last > first:
            yield slice(int(first), int(last))


def _packets_1553(bus: Bus1553, start_ns: int) -> Iterator[Draft]:
    ticks = _ticks(bus.time_ns, start_ns)
    for rows in _blocks(ticks):
        body = body_1553(ticks[rows], bus.message.transmit, bus.data[rows])
        yield int(ticks[rows][-1]), int(ticks[rows][0]), bus.channel, BUS_1553_F1, body


def _packets_429(buses: tuple[Bus429, ...], start_ns: int) -> Iterator[Draft]:
    """Make the packets of all ARINC 429 buses in one channel."""
    if not buses:
        return
    ticks = np.concatenate([_ticks(bus.time_ns, start_ns) for bus in buses])
    order = np.argsort(ticks, kind="stable")
    ticks, words = ticks[order], np.concatenate([bus.words for bus in buses])[order]
    lengths = [len(bus.words) for bus in buses]
    subchannels = np.repeat(np.array([bus.subchannel for bus in buses], dtype=np.uint8), lengths)[order]
    for rows in _blocks(ticks):
        body = body_429(ticks[rows], subchannels[rows], words[rows])
        yield int(ticks[rows][-1]), int(ticks[rows][0]), ARINC_CHANNEL, ARINC_429_F0, body


def _setup(flight: Flight, buses: Buses) -> list[str]:
    """Attributes of TMATS: the flight, every channel with its id and kind, names of the buses."""
    facts = flight.metadata
    channels = [
        (TIME_CHANNEL, "TIME", "TIMEIN", ["TTF-{n}:1", "TFMT-{n}:B", "TSRC-{n}:E"]),
        *((bus.channel, bus.message.bus, "1553IN", ["BTF-{n}:1"]) for bus in buses.buses_1553),
    ]
    if buses.buses_429:
        names = [line for bus in buses.buses_429 for line in _names_429(bus)]
        count = f"NAS\\N-{{n}}:{len(buses.buses_429)}"
        channels.append((ARINC_CHANNEL, "ARINC", "429IN", ["ATF-{n}:0", count, *names]))
    lines = [f"G\\PN:{_text(facts.get('flight', ''))}", f"G\\TA:{_text(facts.get('aircraft', ''))}", "G\\106:17"]
    lines += ["G\\DSI\\N:1", "G\\DSI-1:RECORDER", "G\\DST-1:STO"]
    lines.append(f"G\\COM:{_text(', '.join(f'{key}={value}' for key, value in sorted(facts.items())))}")
    lines += ["R-1\\ID:RECORDER", f"R-1\\N:{len(channels)}"]
    for number, (channel, name, kind, more) in enumerate(channels, start=1):
        common = ["TK1-{n}:" + str(channel), "TK4-{n}:" + str(channel), "CHE-{n}:T", f"CDT-{{n}}:{kind}"]
        attributes = ["DSI-{n}:" + name, *common, "CDLN-{n}:" + name, *more]
        lines += [f"R-1\\{one.format(n=number)}" for one in attributes]
    for number, bus in enumerate(buses.buses_1553, start=1):
        name = bus.message.bus
        parts = [f"DLN:{name}", "NBS\\N:1", "BID-1:00000000", f"BNA-1:{name}", "BT-1:1553"]
        lines += [f"B-{number}\\{one}" for one in parts]
    return lines


def _names_429(bus: Bus429) -> list[str]:
    number = bus.subchannel
    return [f"ASN-{{n}}-{number}:{number}", f"ANM-{{n}}-{number}:{bus.name}"]


def _text(text: str) -> str:
    """Return a value as TMATS takes it: printable ASCII without semicolons."""
    return "".join(one if " " <= one <= "~" and one != ";" else "_" for one in text)
