"""The recordings of real aircraft against pychapter10: every packet, message and word."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from groundstation.base.records import LogHeader, RecordBatch
from groundstation.readers.chapter10 import scan
from groundstation.readers.chapter10.bus_words import words_of
from groundstation.readers.chapter10.packets import PacketWalk
from groundstation.readers.chapter10.reader import items
from groundstation.readers.source import Source
from tests.real_logs import real_log

NAMES = ("kc135_429_1553_1MB.c10", "iliad_1553.c10", "wideband_discrete.c10")


def peer_packets(path: Path) -> Iterator[Any]:
    chapter10 = pytest.importorskip("chapter10")
    with path.open("rb") as stream:
        yield from chapter10.C10(stream)


def joined(path: Path, topic: str) -> dict[str, np.ndarray]:
    """Columns of a raw topic as they are told, block by block."""
    batches = [item for item in items(Source(path)) if isinstance(item, RecordBatch) and item.topic == topic]
    if not batches:
        return {}
    columns = {name: np.concatenate([one.columns[name].values for one in batches]) for name in batches[0].columns}
    columns["words"] = np.concatenate([words_of(one) for one in batches])
    return columns | {"time_ns": np.concatenate([one.device_time_ns.values for one in batches])}


@pytest.mark.real_log
@pytest.mark.parametrize("name", NAMES)
def test_every_packet(name: str) -> None:
    path = real_log(f"ch10/{name}")
    ours = [row for block in PacketWalk(Source(path)) for row in block.packets]
    peers = [(one.channel_id, one.data_type, one.rtc, one.sequence_number) for one in peer_packets(path)]
    found = [tuple(row[[scan.CHANNEL, scan.TYPE, scan.RTC, scan.SEQUENCE]].tolist()) for row in ours]
    # A packet that the end of the file cuts off is none for the peer.
    assert found[: len(peers)] == peers and len(peers) > 80
    assert all(row[scan.STATE] == scan.CUT for row in ours[len(peers) :])


@pytest.mark.real_log
@pytest.mark.parametrize(("name", "count"), [(NAMES[0], 475), (NAMES[1], 21_849)])
def test_every_1553_message(name: str, count: int) -> None:
    path, compared = real_log(f"ch10/{name}"), 0
    peers: dict[int, list[Any]] = {}
    for packet in peer_packets(path):
        if packet.data_type == 0x19:
            peers.setdefault(packet.channel_id, []).extend(packet)
    for channel, messages in peers.items():
        ours = joined(path, f"raw.bus.1553.{channel}")
        assert (ours["time_ns"] == 100 * np.array([one.ipts for one in messages])).all()
        assert (ours["word_count"] == [len(one.data) // 2 for one in messages]).all()
        recorded = [np.pad(np.frombuffer(one.data, "<u2"), (0, 36 - len(one.data) // 2)) for one in messages]
        assert (ours["words"] == recorded).all()
        for bit, field in ((0x2000, "bus"), (0x1000, "me"), (0x0800, "rt2rt"), (0x0400, "fe"), (0x0200, "timeout")):
            assert ((ours["block_status"] & bit > 0) == [getattr(one, field) for one in messages]).all()
        assert (ours["gap_times"] == [one.gap_time for one in messages]).all()
        compared += len(messages)
    assert compared == count


@pytest.mark.real_log
def test_every_429_word() -> None:
    path, compared = real_log(f"ch10/{NAMES[0]}"), 0
    peers: dict[int, list[Any]] = {}
    times: dict[int, list[int]] = {}
    for packet in peer_packets(path):
        if packet.data_type == 0x38:
            words = list(packet)
            gaps = [0, *(one.gap_time for one in words[1:])]
            peers.setdefault(packet.channel_id, []).extend(words)
            times.setdefault(packet.channel_id, []).extend((packet.rtc + np.cumsum(gaps)).tolist())
    for channel, words in peers.items():
        ours = joined(path, f"raw.bus.429.{channel}")
        assert (ours["word"] == [int.from_bytes(one.data, "little") for one in words]).all()
        assert (ours["sub_channel"] == [one.bus + 1 for one in words]).all()
        flags = [4 * one.format_error + 2 * one.parity_error + one.bus_speed for one in words]
        assert (ours["flags"] == flags).all()
        assert (ours["time_ns"] == 100 * np.array(times[channel])).all()
        compared += len(words)
    assert compared == 4_861


@pytest.mark.real_log
def test_every_message_of_the_message_channel() -> None:
    path = real_log(f"ch10/{NAMES[0]}")
    contents = b"".join(one.data for packet in peer_packets(path) if packet.data_type == 0x30 for one in packet)
    found = []
    for item in items(Source(path)):
        if isinstance(item, RecordBatch) and item.topic == "raw.bytes.message.12":
            numbers = np.stack([item.columns[f"bytes_{at:02d}"].values for at in range(0, 64, 8)], axis=1)
            rest = np.minimum(item.columns["size"].values - 64 * item.columns["piece"].values.astype(int), 64)
            found += [row.tobytes()[:size] for row, size in zip(numbers.astype("<u8"), rest.tolist(), strict=True)]
    assert b"".join(found) == contents and len(contents) > 50_000


@pytest.mark.real_log
def test_a_damaged_copy_keeps_what_is_whole() -> None:
    whole, damaged = real_log(f"ch10/{NAMES[0]}"), real_log("damaged/bad.c10")
    topics = {item.topic for item in items(Source(whole)) if isinstance(item, RecordBatch)}
    for topic in sorted(topics):
        ours, before = joined(damaged, topic), joined(whole, topic)
        if topic != "raw.bus.1553.3":
            # The damaged copy was written anew by a program that did not keep every status bit and gap.
            rewritten = {"block_status", *(["time_ns"] if "429" in topic else [])}
            assert all((ours[name] == values).all() for name, values in before.items() if name not in rewritten), topic
    # Of channel 3 one packet lost its data, 82 messages.
    ours, before = joined(damaged, "raw.bus.1553.3"), joined(whole, "raw.bus.1553.3")
    assert (ours["words"] == before["words"][82:]).all() and len(before["words"]) == 223


@pytest.mark.real_log
@pytest.mark.parametrize(
    ("name", "start", "code"),
    [
        (NAMES[0], "2011-12-09T00:00:00.000Z", "year_from_bus"),
        (NAMES[1], "2015-05-12T00:00:00.000Z", "assumed_year"),
        (NAMES[2], "2018-01-22T20:31:48.748Z", "assumed_year"),
    ],
)
def test_dates(name: str, start: str, code: str) -> None:
    from groundstation.base.records import Remark
    from groundstation.base.timescales import utc_ns_to_iso

    found = list(items(Source(real_log(f"ch10/{name}"))))
    header = found[0]
    assert isinstance(header, LogHeader) and header.utc_of_zero_ns is not None
    assert utc_ns_to_iso(header.utc_of_zero_ns) == start
    assert code in {item.code for item in found if isinstance(item, Remark)}
