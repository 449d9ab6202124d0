"""Recorded data other than bus words: bytes, discretes, events, times of time packets.

The bytes are those of messages and frames.

Bytes, ``raw.bytes.<kind>.<channel>``, stand in records of up to 64, eight in a number of 64 bits, the first in its
lowest eight: ``bytes_00``, ``bytes_08`` ...; ``piece`` counts the records of one message from 0, ``size`` is that of
the message. Each is a nanosecond later than the one before, less than the counter can tell.
"""

from collections.abc import Mapping
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from groundstation.base.records import Column, Int64Array, RecordBatch
from groundstation.base.signals import BYTES_PREFIX
from groundstation.readers.chapter10 import scan
from groundstation.readers.chapter10.kinds import DISCRETE, EVENT, TIME
from groundstation.readers.chapter10.packets import NS_PER_COUNT, PacketBlock
from groundstation.readers.chapter10.timing import reading
from groundstation.readers.chapter10.tmats import Tmats

_PIECE_BYTES, _PER_NUMBER = 64, 8
_DISCRETE_BYTES = 12  # eight of time, four of states
_STAMP_ALWAYS, _STAMP_IF_FLAGGED = True, False


class _Stamped(NamedTuple):
    """Layout of messages that stand behind headers: their time, their header, their length.

    A time is always there, or where bit 31 of the specific word says so.
    """

    name: str
    is_always_timed: bool
    header: int
    length_at: int = 0
    mask: int = 0xFFFF


# Types whose messages tell their length. Source: IRIG 106-22 Chapter 11, 11.2.9, 11.2.12, 11.2.15, 11.2.17.
_STAMPED: Mapping[int, _Stamped] = MappingProxyType(
    {
        0x30: _Stamped("message", _STAMP_ALWAYS, 4),
        0x50: _Stamped("uart", _STAMP_IF_FLAGGED, 4),
        0x68: _Stamped("ethernet", _STAMP_ALWAYS, 4, mask=0x3FFF),
        0x69: _Stamped("arinc_664", _STAMP_ALWAYS, 20, length_at=2),
        0x78: _Stamped("can", _STAMP_ALWAYS, 4),
    }
)
# Types of which the data of a packet are kept as they are, with their specific word.
_WHOLE: Mapping[int, str] = MappingProxyType(
    {
        0x08: "pcm",
        0x09: "pcm",
        0x1A: "16pp194",
        0x21: "analog",
        0x60: "parallel",
    }
)


def batch_of(block: PacketBlock, kind: int, channel: int, packets: Int64Array, tmats: Tmats) -> RecordBatch | None:
    """Return the records of a channel in a block; None without any, or if only counted."""
    if kind in _STAMPED:
        return _messages(block, _STAMPED[kind], channel, packets)
    if kind in _WHOLE:
        starts, ends = packets[:, scan.BODY], packets[:, scan.BODY_END]
        sizes = np.maximum(ends - starts, 0)
        return _bytes(
            f"{BYTES_PREFIX}{_WHOLE[kind]}.{channel}",
            block,
            starts,
            sizes,
            packets[:, scan.RTC],
            _specific(block, packets),
        )
    if kind == DISCRETE:
        return _discretes(block, channel, packets)
    if kind == EVENT:
        return _events(block, packets, tmats)
    return _times(block, channel, packets) if kind == TIME else None


def _specific(block: PacketBlock, packets: Int64Array) -> Int64Array:
    return np.array([block.specific_word(packet) for packet in packets], dtype=np.int64)


def _messages(block: PacketBlock, form: _Stamped, channel: int, packets: Int64Array) -> RecordBatch | None:
    flagged = np.full(len(packets), form.is_always_timed) | (_specific(block, packets) >> 31 & 1).astype(bool)
    parts = []
    for has_stamp in (True, False):
        some = packets[flagged == has_stamp]
        room = int(np.maximum(some[:, scan.BODY_END] - some[:, scan.BODY], 0).sum()) // form.header
        places, times, sizes = (np.empty(room, dtype=np.int64) for _ in range(3))
        count = scan.messages_stamped(
            block.data, some, has_stamp, form.header, form.length_at, form.mask, places, times, sizes
        )
        parts.append((places[:count], sizes[:count], times[:count]))
    places, sizes, times = (np.concatenate(several) for several in zip(*parts, strict=True))
    order = np.argsort(places, kind="stable")
    return _bytes(f"{BYTES_PREFIX}{form.name}.{channel}", block, places[order], sizes[order], times[order], None)


def _bytes(
    topic: str,
    block: PacketBlock,
    places: Int64Array,
    sizes: Int64Array,
    times: Int64Array,
    specific: Int64Array | None,
) -> RecordBatch | None:
    """Stretches of bytes as records of up to 64."""
    pieces = -(-sizes // _PIECE_BYTES)
    total = int(pieces.sum())
    if not total:
        return None
    which = np.repeat(np.arange(len(places)), pieces)
    piece = np.arange(total) - np.repeat(np.cumsum(pieces) - pieces, pieces)
    start = places[which] + piece * _PIECE_BYTES
    length = np.minimum(sizes[which] - piece * _PIECE_BYTES, _PIECE_BYTES)
    inside = np.arange(_PIECE_BYTES) < length[:, None]
    at = np.minimum(start[:, None] + np.arange(_PIECE_BYTES), len(block.data) - 1)
    numbers = np.where(inside, block.data[at], 0).astype(np.uint8).view("<u8")
    columns = {"size": Column(sizes[which].astype(np.uint32)), "piece": Column(piece.astype(np.uint32))}
    if specific is not None:
        columns["specific_word"] = Column(specific[which].astype(np.uint32))
    for number in range(_PIECE_BYTES // _PER_NUMBER):
        present = length > number * _PER_NUMBER
        if present.any():
            name = f"bytes_{number * _PER_NUMBER:02d}"
            columns[name] = Column(numbers[:, number].copy(), None if present.all() else present)
    return RecordBatch(topic, start + block.base, Column(times[which] * NS_PER_COUNT + piece), columns)


def _discretes(block: PacketBlock, channel: int, packets: Int64Array) -> RecordBatch | None:
    """States of discretes, as 32 bits with the time of each change or sample."""
    places, times = [], []
    for packet in packets:
        whole = max(0, int(packet[scan.BODY_END] - packet[scan.BODY])) // _DISCRETE_BYTES
        starts = packet[scan.BODY] + _DISCRETE_BYTES * np.arange(whole)
        places.append(starts)
        times.append(_numbers(block, starts, "<u8") & 0xFFFFFFFFFFFF)
    at, time = np.concatenate(places), np.concatenate(times)
    if not len(at):
        return None
    states = _numbers(block, at + 8, "<u4").astype(np.uint32)
    columns = {"states": Column(states)}
    return RecordBatch(f"raw.discrete.{channel}", at + block.base, Column(time * NS_PER_COUNT), columns)


def _numbers(block: PacketBlock, at: Int64Array, dtype: str) -> Int64Array:
    """Numbers that begin at any byte."""
    width = np.dtype(dtype).itemsize
    return np.asarray(block.data[at[:, None] + np.arange(width)].view(dtype)[:, 0], dtype=np.int64)


def _events(block: PacketBlock, packets: Int64Array, tmats: Tmats) -> RecordBatch | None:
    """Recording events by the names that TMATS gives them, else their numbers."""
    places, times, names = [], [], []
    for packet in packets:
        word = block.specific_word(packet)
        size = 20 if word >> 31 else 12
        for at in range(int(packet[scan.BODY]), int(packet[scan.BODY_END]) - size + 1, size)[: word & 0xFFF]:
            fields = block.data[at : at + size].tobytes()
            number = int.from_bytes(fields[-4:], "little") & 0xFFF
            places.append(at)
            times.append(int.from_bytes(fields[:6], "little"))
            names.append(tmats.get(rf"R-\d+\\EV\\ID-{number}") or f"event {number}")
    if not places:
        return None
    index, time = np.array(places, dtype=np.int64), np.array(times, dtype=np.int64)
    return RecordBatch("event", index + block.base, Column(time * NS_PER_COUNT), {"name": Column(np.array(names))})


def _times(block: PacketBlock, channel: int, packets: Int64Array) -> RecordBatch | None:
    """Return the time packets that state a time: ``day_of_year``, ``time_of_day_ms``."""
    told = [
        (
            packet,
            reading(channel, int(packet[scan.RTC]) * NS_PER_COUNT, block.specific_word(packet), block.body(packet)),
        )
        for packet in packets
    ]
    known = [(packet[scan.AT], one) for packet, one in told if one]
    if not known:
        return None
    columns = {
        "day_of_year": Column(np.array([one.day for _at, one in known], dtype=np.uint16)),
        "time_of_day_ms": Column(np.array([one.time_of_day_ns // 1_000_000 for _at, one in known], dtype=np.uint32)),
    }
    time = Column(np.array([one.device_ns for _at, one in known], dtype=np.int64))
    index = np.array([at for at, _one in known], dtype=np.int64)
    return RecordBatch(f"raw.irig_time.{channel}", index + block.base, time, columns)
