"""Cut, flipped and hostile ULogs: every intact record is kept, losses are counted to the byte, nothing is thrown."""

import re
import struct
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from groundstation.base.errors import GroundstationError
from groundstation.base.records import Damage, RecordBatch
from groundstation.readers.source import Source
from groundstation.readers.ulog import read as read_ulog
from groundstation.readers.ulog import scan
from groundstation.readers.ulog.blocks import MessageWalk
from tests.readers.test_ulog import BARO, T0_US, UlogWriter
from tests.readers.test_ulog import read as read_log
from tests.readers.ulog_writer import small_flight

RAW = ("raw.vehicle_attitude", "raw.vehicle_air_data", "raw.ulog.text")


def times_us(items: list[Any], topic: str) -> list[int]:
    batches = [item for item in items if isinstance(item, RecordBatch) and item.topic == topic]
    return [int(time) // 1000 for batch in batches for time in batch.device_time_ns.values]


def items_of(path: Path, data: bytes) -> list[Any]:
    path.write_bytes(data)
    return list(read_ulog(Source(path)))


def damages_of(items: list[Any]) -> list[Damage]:
    return [item for item in items if isinstance(item, Damage)]


def test_cut_at_every_byte(tmp_path: Path) -> None:
    """All messages in front of the cut are there, and a cut within a message is told with the bytes it left."""
    log = small_flight(8)
    path, ends = tmp_path / "cut.ulg", [*log.starts[1:], len(log.data)]
    kinds = [chr(log.data[start + 2]) for start in log.starts]
    for size in range(log.starts[0], len(log.data)):
        items = items_of(path, bytes(log.data[:size]))
        whole = [kind for kind, end in zip(kinds, ends, strict=True) if end <= size]
        counted = sum(len(times_us(items, topic)) for topic in RAW)
        assert counted == whole.count("D") + whole.count("L"), size
        left = size - max([log.starts[0], *(end for end in ends if end <= size)])
        told = [(damage.kind, damage.count) for damage in damages_of(items)]
        assert told == ([("truncated", left)] if left else []), size
    for size in range(log.starts[0]):
        with pytest.raises(GroundstationError):
            items_of(path, bytes(log.data[:size]))


def spans_of(damages: list[Damage]) -> list[tuple[int, int]]:
    """Bytes told as skipped, (first, behind the last)."""
    found = (re.fullmatch(r"bytes (\d+) to (\d+)", damage.place) for damage in damages if damage.kind == "corrupt")
    return [(int(match[1]), int(match[2]) + 1) for match in found if match]


def test_flipped_bits_lose_no_other_record(tmp_path: Path) -> None:
    """Seeded flips in the data section: every record that was not hit is there; skipped bytes lie around the hits."""
    rng, path = np.random.default_rng(20_240_607), tmp_path / "flipped.ulg"
    log = small_flight(400)
    starts = np.array(log.starts)
    first = next(place for place in log.starts if log.data[place + 2] == ord("D"))
    for _ in range(150):
        data, hits = bytearray(log.data), rng.integers(first, len(log.data), size=int(rng.integers(1, 12)))
        for hit in hits.tolist():
            data[hit] ^= 1 << int(rng.integers(8))
        touched = {int(np.searchsorted(starts, hit, side="right")) - 1 for hit in hits.tolist()}
        expected: dict[str, list[int]] = {topic: [] for topic in RAW}
        for number, start in enumerate(log.starts):
            kind = chr(log.data[start + 2])
            if number in touched or kind not in "DL":
                continue
            topic = RAW[2] if kind == "L" else RAW[log.data[start + 3]]
            expected[topic].append(struct.unpack_from("<Q", log.data, start + (4 if kind == "L" else 5))[0])
        items = items_of(path, bytes(data))
        for topic in RAW:
            assert set(expected[topic]) <= set(times_us(items, topic))
        ends = np.append(starts[1:], len(data))
        for start, end in spans_of(damages_of(items)):
            assert any(start < ends[number] and end > starts[number] for number in touched)


def test_garbage_between_messages_is_counted_to_the_byte(tmp_path: Path) -> None:
    rng = np.random.default_rng(7)
    log = small_flight(50)
    place = log.starts[60]
    garbage = rng.integers(0, 256, 300_000, dtype=np.uint8).tobytes()
    items = items_of(tmp_path / "x.ulg", bytes(log.data[:place]) + garbage + bytes(log.data[place:]))
    assert spans_of(damages_of(items)) == [(place, place + len(garbage))]
    assert sum(len(times_us(items, topic)) for topic in RAW) == 106
    filled = items_of(tmp_path / "x.ulg", bytes(log.data) + bytes(70_000))
    assert [(damage.kind, damage.count, damage.loses_data) for damage in damages_of(filled)] == [
        ("filler", 70_000, False)
    ]


def test_an_intact_record_between_two_damaged_ones_is_kept(tmp_path: Path) -> None:
    log = small_flight(10)
    rows = [start for start in log.starts if log.data[start + 2] == ord("D")]
    for damaged in (rows[6], rows[8]):
        log.data[damaged + 2] ^= 0xFF
    items = items_of(tmp_path / "x.ulg", bytes(log.data))
    assert len(times_us(items, RAW[0])) == 8 and len(times_us(items, RAW[1])) == 10
    assert [end - start for start, end in spans_of(damages_of(items))] == [29, 29]


def test_a_false_message_of_an_unknown_type_swallows_nothing(tmp_path: Path) -> None:
    """A flipped type and size make a long message of a type that a later version may define, ending at a true one."""
    log = small_flight(400)
    rows = [start for start in log.starts if log.data[start + 2] == ord("D")]
    first, behind = rows[100], rows[500]
    for kind in (ord("T"), ord("d"), ord("D")):
        data = bytearray(log.data)
        data[first : first + 3] = struct.pack("<HB", behind - first - 3, kind)
        if kind == ord("D"):
            data[first + 3 : first + 5] = b"\xff\x7f"  # a topic that nobody subscribed
        items = items_of(tmp_path / "x.ulg", bytes(data))
        assert len(times_us(items, RAW[0])) + len(times_us(items, RAW[1])) == len(rows) - 1


@pytest.mark.parametrize("size", [600, 3_000, 9_000])
@pytest.mark.parametrize("head", [b"g", b"E", b"D\xff\x7f", b"L6" + bytes(8), b"M\0\x08char[9] x"])
def test_a_false_message_swallows_no_definitions(tmp_path: Path, head: bytes, size: int) -> None:
    """Every letter of a damaged definition is the type of a message; some end where a true one begins."""
    rows = small_flight(10)
    log, columns = UlogWriter().flags(), "".join(f"float field_{number};" for number in range(10))
    for number in range(120):
        log.format(f"topic_{number:03}:uint64_t timestamp;{columns}")
    place = log.starts[31]  # behind the flags and thirty formats
    behind = next(start for start in log.starts[32:] if start - place >= size)
    log.data[place : place + 2 + len(head)] = struct.pack("<H", behind - place - 3) + head
    for number in range(120):
        log.subscribe(100 + number, f"topic_{number:03}").row(100 + number, "Q10f", T0_US, *range(10))
    log.data += rows.data[rows.starts[0] + 43 :]
    items = items_of(tmp_path / "x.ulg", bytes(log.data))
    topics = {item.topic for item in items if isinstance(item, RecordBatch)}
    assert {f"raw.topic_{number:03}" for number in range(120)} - topics == {"raw.topic_030"}
    assert len(times_us(items, RAW[0])) == len(times_us(items, RAW[1])) == 10


def test_the_message_behind_one_that_lost_bytes_is_kept(tmp_path: Path) -> None:
    """A data message that lost bytes ends inside the next one: it is none, and the next one is whole."""
    log = small_flight(40)
    rows = [start for start in log.starts if log.data[start + 2] == ord("D")]
    for lost in (1, 3, 8):
        items = items_of(tmp_path / "x.ulg", bytes(log.data[: rows[21] + 9] + log.data[rows[21] + 9 + lost :]))
        assert len(times_us(items, RAW[0])) == 40 and len(times_us(items, RAW[1])) == 39
        assert spans_of(damages_of(items)) == [(rows[21], rows[22] - lost)]


def test_a_dropout_in_front_of_garbage_is_kept(tmp_path: Path) -> None:
    log = small_flight(10)
    place = log.starts[12]
    for garbage in (b"\xff" * 50, bytes(50), np.random.default_rng(1).bytes(50)):
        data = bytes(log.data[:place]) + b"\2\0O\x40\1" + garbage + bytes(log.data[place:])
        items = items_of(tmp_path / "x.ulg", data)
        assert [(damage.kind, damage.count) for damage in damages_of(items)] == [("corrupt", 50), ("dropout", 320)]
        among_garbage = bytes(log.data[:place]) + garbage + b"\2\0O\x40\1" + garbage + bytes(log.data[place:])
        items = items_of(tmp_path / "x.ulg", among_garbage)
        assert [(damage.kind, damage.count) for damage in damages_of(items)] == [("corrupt", 105)]


@pytest.mark.parametrize("where", [20, 28, 46, 58])
def test_flags_that_lost_or_gained_bytes_cost_no_definition(tmp_path: Path, where: int) -> None:
    log = small_flight(10)
    for data in (log.data[:where] + log.data[where + 1 :], log.data[:where] + b"\x37\x20" + log.data[where:]):
        items = items_of(tmp_path / "x.ulg", bytes(data))
        assert len(times_us(items, RAW[0])) == len(times_us(items, RAW[1])) == 10


def test_flags_that_no_version_has_are_damage(tmp_path: Path) -> None:
    """Flags are given from the lowest bit on, so one far up, or a byte full of them, was not set by a writer."""
    for flags in (b"\0\0\0\x10" + bytes(4), b"\xff" + bytes(7), b"\xff" * 8):
        log = small_flight(10)
        log.data[27:35] = flags
        items = items_of(tmp_path / "x.ulg", bytes(log.data))
        assert len(times_us(items, RAW[0])) == 10
        (damage,) = damages_of(items)
        assert (damage.kind, damage.place, damage.count) == ("corrupt", "bytes 16 to 58", 43)
        assert flags.hex() in damage.what


def test_skipped_bytes_stand_between_the_records_around_them(tmp_path: Path) -> None:
    """Those told one by one, those told together, and a message that appended data cuts off."""
    log = small_flight(100)
    places = [number for number in range(10, 200, 6) if log.data[log.starts[number] + 2] == ord("D")]
    first = 1  # the flags are no record
    for number in places:
        log.data[log.starts[number] + 2] ^= 0xFF
    log.data += log.data[log.starts[-1] : log.starts[-1] + 7]
    log.append_section().row(1, "Qf", T0_US + 10**7, 1e5)
    damages = damages_of(items_of(tmp_path / "x.ulg", bytes(log.data)))
    before = [number - first - count for count, number in enumerate(places)]
    assert [one.between_records for one in damages[:20]] == [(index - 1, index) for index in before[:20]]
    assert damages[20].between_records == (before[20] - 1, before[-1])
    last = len(log.starts) - 1 - first - len(places)
    assert damages[21].kind == "truncated" and damages[21].between_records == (last - 1, last)


def test_a_short_body_is_no_format(tmp_path: Path) -> None:
    """``01 00 F :`` inside a record, the next one being damaged, is no definition that ends it."""
    log = small_flight(40)
    rows = [start for start in log.starts if log.data[start + 2] == ord("D")]
    log.data[rows[20] + 5 : rows[20] + 9] = b"\x01\x00F:"
    log.data[rows[21] + 1] ^= 0x40
    items = items_of(tmp_path / "x.ulg", bytes(log.data))
    assert len(times_us(items, RAW[0])) + len(times_us(items, RAW[1])) == len(rows) - 1


def test_a_damaged_size_of_a_text_swallows_nothing(tmp_path: Path) -> None:
    log = small_flight(16)
    text = next(start for start in log.starts if log.data[start + 2] == ord("L"))
    log.data[text] ^= 0x40
    items = items_of(tmp_path / "x.ulg", bytes(log.data))
    assert len(times_us(items, RAW[0])) == len(times_us(items, RAW[1])) == 16


def test_damaged_definitions_cost_their_topic_alone(tmp_path: Path) -> None:
    log = small_flight(10)
    definition = bytes(log.data).index(b"vehicle_air_data:uint64_t")
    log.data[definition + 18] = ord("?")
    items = items_of(tmp_path / "x.ulg", bytes(log.data))
    assert len(times_us(items, RAW[0])) == 10 and not times_us(items, RAW[1])
    lost = {damage.kind: damage.count for damage in damages_of(items)}
    assert lost["dropped_channel"] == 10


@pytest.mark.parametrize(
    "formats",
    [
        ["a:a x;", "b:c[2] x;", "c:b[2] x;"],
        ["a:uint64_t timestamp;uint8_t[999999] x;"],
        [*(f"f{n}:f{n + 1}[9999] x;" for n in range(19)), "f19:uint8_t y;"],
        [*(f"g{n}:g{n + 1}[2] x;" for n in range(60)), "g60:;"],
        ["noname", ":", "x:;", "x:float;", "x:float[-1] y;", "x:float[3 y;", "x:missing y;"],
        ["dup:uint64_t timestamp;float x;float x;float x_2;"],
        ["odd:uint64_t timestamp;float \u00e4\u00f6;float a/b;float [0];"],
    ],
    ids=["loops", "huge", "deep", "empty", "malformed", "duplicates", "odd names"],
)
def test_hostile_formats(tmp_path: Path, formats: list[str]) -> None:
    log = UlogWriter().flags().format(BARO)
    for number, text in enumerate(formats):
        log.format(text).subscribe(number + 10, text.partition(":")[0] or "x")
    log.subscribe(0, "vehicle_air_data")
    for row in range(20):
        log.row(0, "Qf", T0_US + row, 1e5)
        log.row(10, "Q3f", T0_US + row, 1.0, 2.0, 3.0)
    found = read_log(tmp_path, log)
    assert found.rows("raw.vehicle_air_data") == 20


@pytest.mark.parametrize("topics", [1_000, pytest.param(10_000, marks=pytest.mark.slow)])
def test_very_many_topics(tmp_path: Path, topics: int) -> None:
    log = UlogWriter().flags()
    for number in range(topics):
        log.format(f"t{number}:uint64_t timestamp;float x;").subscribe(number, f"t{number}")
    for number in range(topics):
        log.row(number, "Qf", T0_US + number, number)
    found = read_log(tmp_path, log)
    assert len([topic for topic in found.batches if topic.startswith("raw.t")]) == topics and not found.damages


def test_more_topics_than_are_counted(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("groundstation.readers.ulog.blocks.MAX_TOPICS", 30)
    log = UlogWriter().flags()
    for number in range(60):
        log.format(f"t{number}:uint64_t timestamp;float x;").subscribe(number, f"t{number}").row(
            number, "Qf", T0_US, 1.0
        )
    items = items_of(tmp_path / "x.ulg", bytes(log.data))
    assert any("more than 30 topics" in damage.what for damage in damages_of(items))


def test_random_bytes_after_a_header_raise_nothing(tmp_path: Path) -> None:
    rng = np.random.default_rng(3)
    header = bytes(UlogWriter().flags().format(BARO).subscribe(0, "vehicle_air_data").data)
    for size in (1, 10, 1_000, 400_000):
        items = items_of(tmp_path / "x.ulg", header + rng.integers(0, 256, size, dtype=np.uint8).tobytes())
        assert sum(damage.count for damage in damages_of(items)) >= 1
    mostly_types = rng.choice(np.frombuffer(b"\0\x01\x05DALIPMQFSCOR0[]:; ", dtype=np.uint8), 300_000).tobytes()
    items_of(tmp_path / "x.ulg", header + mostly_types)


def test_many_damaged_places_are_told_in_few_lines(tmp_path: Path) -> None:
    log = small_flight(2_000)
    rows = [start for start in log.starts if log.data[start + 2] == ord("D")]
    for start in rows[10::4]:
        log.data[start + 2] ^= 0xFF
    walk = MessageWalk(Source(tmp_path / "x.ulg"))
    (tmp_path / "x.ulg").write_bytes(log.data)
    found = sum(int((block.topic >= 0).sum()) for block in walk)
    damages = list(walk.damages())
    assert found == len(rows) - len(rows[10::4]) and len(damages) < 30
    skipped = sum(damage.count for damage in damages)
    assert skipped == sum(scan.HEADER + log.data[start] for start in rows[10::4])


def test_offsets_of_appended_data_behind_the_end(tmp_path: Path) -> None:
    log = small_flight(5)
    log.append_section()
    items = items_of(tmp_path / "x.ulg", bytes(log.data))
    assert len(times_us(items, RAW[0])) == 5 and not damages_of(items)
    log.data[16 + 3 + 16 : 16 + 3 + 24] = struct.pack("<Q", 10**15)
    items = items_of(tmp_path / "x.ulg", bytes(log.data))
    assert len(times_us(items, RAW[0])) == 5 and [damage.kind for damage in damages_of(items)] == ["truncated"]


@pytest.mark.parametrize("pattern", [b"AAAAAA!", b"~~F a:", b"~~L0123456\0 ", b"~~I\x08uint x y", b"\x02\0O12", b"~}Z"])
def test_files_made_to_be_slow_take_time_by_their_length(tmp_path: Path, pattern: bytes) -> None:
    """Eight times the bytes: 8 times as long; 64 times, were every start followed to the end of the file."""
    header = bytes(UlogWriter().flags().format(BARO).subscribe(0, "vehicle_air_data").data)
    took_s = {}
    for size in (1_000, 100_000, 800_000):  # the first compiles what is to be compiled
        (tmp_path / "x.ulg").write_bytes(header + pattern * (size // len(pattern)))
        began = time.process_time()
        list(read_ulog(Source(tmp_path / "x.ulg")))
        took_s[size] = time.process_time() - began
    assert took_s[800_000] < 24.0 * max(took_s[100_000], 0.02)  # the machine may be thrice as busy
