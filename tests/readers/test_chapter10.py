"""The Chapter 10 reader on packets made by hand: checks, time, damage, every kind of channel."""

from pathlib import Path

import numpy as np
import pytest

from groundstation.base.records import Damage, Item, LogHeader, RecordBatch, Remark
from groundstation.base.timescales import utc_ns_to_iso
from groundstation.readers import registry
from groundstation.readers.chapter10 import packets as blocks
from groundstation.readers.chapter10.bus_words import words_of
from tests.readers import chapter10_packets as made
from tests.readers.test_contract import check

COUNTS_PER_S = 10_000_000
TMATS = made.tmats("G\\TA:Test;R-1\\TK1-1:7;R-1\\CDT-1:429IN;R-1\\ASN-1-1:1;R-1\\ANM-1-1:IRS-1;R-1\\EV\\ID-3:Release;")
VELOCITY = (5, 0, [0x37A0, 0x3000, *range(32)])


def bus_packets(seconds: int = 20) -> list[bytes]:
    """A second of either bus in a packet, and a time packet each second; day 100, 12:00:00 at the counter's zero."""
    out = [made.packet(0, 0x01, TMATS, 0, checksum=2)]
    for second in range(seconds):
        rtc = second * COUNTS_PER_S
        out.append(made.packet(1, 0x11, made.time_of_day(100, 43_200 + second), rtc, sequence=second))
        messages = [
            (rtc + at * 400_000, 0x1000 if at == 3 else 0, [0x37A0, 0x3000, *range(at, at + 32)]) for at in range(25)
        ]
        out.append(made.packet(4, 0x19, made.messages_1553(messages), rtc, sequence=second, checksum=3))
        words = [(at % 2, 1_000, made.word_429(0o314, at)) for at in range(50)]
        out.append(made.packet(7, 0x38, made.words_429(words), rtc, sequence=second, checksum=1))
    return out


def read(tmp_path: Path, content: bytes) -> list[Item]:
    path = tmp_path / "recorded"
    path.write_bytes(content)
    return list(registry.read(path))


def rows(items: list[Item], topic: str) -> dict[str, np.ndarray]:
    """All columns of a topic, its times among them."""
    batches = [item for item in items if isinstance(item, RecordBatch) and item.topic == topic]
    found = {name: np.concatenate([one.columns[name].values for one in batches]) for name in batches[0].columns}
    return found | {"time_s": np.concatenate([one.device_time_ns.values for one in batches]) / 1e9}


def damages(items: list[Item]) -> dict[str, int]:
    found: dict[str, int] = {}
    for item in items:
        if isinstance(item, Damage):
            found[item.kind] = found.get(item.kind, 0) + item.count
    return found


def codes(items: list[Item]) -> set[str]:
    return {item.code for item in items if isinstance(item, Remark)}


def test_all_words_with_their_times(tmp_path: Path) -> None:
    items = read(tmp_path, b"".join(bus_packets()))
    check(items)
    header = items[0]
    assert (
        isinstance(header, LogHeader)
        and header.metadata["aircraft"] == "Test"
        and header.metadata["bus.7"] == "1=IRS-1"
    )
    messages = [item for item in items if isinstance(item, RecordBatch) and item.topic == "raw.bus.1553.4"]
    words = np.concatenate([words_of(one) for one in messages])
    assert words.shape == (500, 36) and (words[26] == [0x37A0, 0x3000, *range(1, 33), 0, 0]).all()
    np.testing.assert_allclose(rows(items, "raw.bus.1553.4")["time_s"], np.arange(500) * 0.04, atol=1e-12)
    found = rows(items, "raw.bus.429.7")
    assert len(found["word"]) == 1_000 and (found["sub_channel"][:4] == [1, 2, 1, 2]).all()
    np.testing.assert_allclose(found["time_s"][:3], [0.0, 1e-4, 2e-4], atol=1e-12)  # the first gap is to another packet
    assert damages(items) == {}


def test_blocks_do_not_matter(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    content = b"".join(bus_packets())
    whole = read(tmp_path, content + content[:1000])
    monkeypatch.setattr(blocks, "BLOCK_BYTES", 3_001)
    pieces = read(tmp_path, content + content[:1000])
    for topic in ("raw.bus.1553.4", "raw.bus.429.7", "raw.irig_time.1"):
        for name, values in rows(whole, topic).items():
            assert (rows(pieces, topic)[name] == values).all()
    assert [one for one in whole if isinstance(one, Damage | Remark)] == [
        one for one in pieces if isinstance(one, Damage | Remark)
    ]


@pytest.mark.parametrize("checksum", [1, 2, 3])
def test_a_wrong_data_checksum_costs_its_packet(tmp_path: Path, checksum: int) -> None:
    several = [
        made.packet(4, 0x19, made.messages_1553([VELOCITY]), at, sequence=at, checksum=checksum) for at in range(5)
    ]
    broken = bytearray(several[2])
    broken[60] ^= 4
    items = read(tmp_path, b"".join([*several[:2], bytes(broken), *several[3:]]))
    assert len(rows(items, "raw.bus.1553.4")["word_count"]) == 4 and damages(items) == {"corrupt": 1}


def test_bytes_between_lost_bytes_and_a_cut_end(tmp_path: Path) -> None:
    several = bus_packets(6)
    lost = several[5][:200]  # the packet of the 1553 bus at 1 s, its end lost
    noise = bytes(range(256))
    content = b"".join([*several[:5], lost, *several[6:9], noise, *several[9:]])[:-150]
    items = read(tmp_path, content)
    second = rows(items, "raw.bus.1553.4")["time_s"].astype(int)
    assert np.bincount(second).tolist() == [25, 0, 25, 25, 25, 25]
    assert len(rows(items, "raw.bus.429.7")["word"]) == 6 * 50 - 19  # the last packet is cut: whole words stay
    # One packet ends early, bytes of no packet, and words that the cut packet says it holds.
    assert damages(items) == {"corrupt": 1 + len(noise) + 19, "truncated": 1}


def test_a_flipped_header_costs_one_packet_and_is_counted(tmp_path: Path) -> None:
    several = bus_packets(6)
    broken = bytearray(several[8])
    broken[17] ^= 1
    items = read(tmp_path, b"".join([*several[:8], bytes(broken), *several[9:]]))
    assert len(rows(items, "raw.bus.1553.4")["time_s"]) == 125
    assert damages(items) == {"corrupt": len(broken), "lost_packets": 1}


def test_stamps_of_the_secondary_header(tmp_path: Path) -> None:
    """Messages are stamped with IEEE 1588 time: they are as much later than the packet as the stamps say."""
    stamps = [(1_000 + at // 2) << 32 | at % 2 * 500_000_000 for at in range(4)]
    data = made.messages_1553([(stamp, 0, [0x37A0, 1]) for stamp in stamps])
    one = made.packet(4, 0x19, data, 7 * COUNTS_PER_S, secondary=made.secondary_1588(1_000, 0), flags=0x40 | 1 << 2)
    items = read(tmp_path, one)
    assert rows(items, "raw.bus.1553.4")["time_s"].tolist() == [7.0, 7.5, 8.0, 8.5]
    broken = bytearray(one)
    broken[26] ^= 1
    items = read(tmp_path, bytes(broken))
    assert not any(isinstance(item, RecordBatch) for item in items) and damages(items) == {"corrupt": len(broken)}


def start_of(items: list[Item]) -> str | None:
    header = items[0]
    assert isinstance(header, LogHeader)
    return None if header.utc_of_zero_ns is None else utc_ns_to_iso(header.utc_of_zero_ns)


def test_year_of_a_time_packet_with_a_date(tmp_path: Path) -> None:
    data = made.time_of_day(0, 3600.5, year=2019, month=3, day_of_month=1)
    items = read(tmp_path, made.packet(1, 0x11, data, COUNTS_PER_S))
    assert start_of(items) == "2019-03-01T00:59:59.500Z"


def test_year_from_label_260_in_a_leap_year(tmp_path: Path) -> None:
    day = made.word_429(0o260, 1 << 17 | 2 << 13 | 0 << 12 | 3 << 8 | 2 << 4 | 0, status=0)  # 12 March 2020
    items = read(
        tmp_path,
        made.packet(1, 0x11, made.time_of_day(72, 60), 60 * COUNTS_PER_S)
        + made.packet(7, 0x38, made.words_429([(0, 0, day)]), 0),
    )
    assert start_of(items) == "2020-03-12T00:00:00.000Z" and "year_from_bus" in codes(items)


def test_year_near_the_date_of_tmats_and_over_new_year(tmp_path: Path) -> None:
    setup = made.packet(0, 0x01, made.tmats("G\\OD:01-02-2015;"), 0)
    times = [(365, 86_398.0), (365, 86_399.0), (1, 0.0), (1, 1.0), (1, 2.0)]
    readings = [made.packet(1, 0x11, made.time_of_day(*one), at * COUNTS_PER_S) for at, one in enumerate(times)]
    items = read(tmp_path, setup + b"".join(readings))
    assert start_of(items) == "2014-12-31T23:59:58.000Z" and "assumed_year" in codes(items)


def test_no_year_at_all_is_no_utc(tmp_path: Path) -> None:
    items = read(tmp_path, made.packet(1, 0x11, made.time_of_day(100, 5), 0))
    assert start_of(items) is None and "year_unknown" in codes(items)
    items = read(tmp_path, made.packet(4, 0x19, made.messages_1553([VELOCITY]), 0))
    assert start_of(items) is None and "no_time_packets" in codes(items)


def test_several_time_channels_and_one_that_was_set(tmp_path: Path) -> None:
    def channel(number: int, offsets: list[float]) -> list[bytes]:
        return [
            made.packet(
                number, 0x11, made.time_of_day(0, 100 + at + off, year=2020, month=1, day_of_month=1), at * COUNTS_PER_S
            )
            for at, off in enumerate(offsets)
        ]

    items = read(tmp_path, b"".join([*channel(1, [0.0] * 9), *channel(2, [40.0] * 4)]))
    assert start_of(items) == "2020-01-01T00:01:40.000Z"
    told = [item.text for item in items if isinstance(item, Remark) and item.code == "clock_disagrees"]
    assert len(told) == 1 and "+40.000 s" in told[0]
    items = read(tmp_path, b"".join(channel(1, [-3600.0 + 4000, *[0.0] * 8])))
    assert start_of(items) == "2020-01-01T00:01:40.000Z" and "clock_disagrees" in codes(items)


def stamped(header: bytes, content: bytes, rtc: int | None) -> bytes:
    stamp = b"" if rtc is None else rtc.to_bytes(8, "little")
    return stamp + header + content + bytes(len(content) % 2)


@pytest.mark.parametrize(
    ("kind", "name", "specific", "header"),
    [
        (0x30, "message", 2, lambda size: size.to_bytes(2, "little") + b"\x01\x00"),
        (0x50, "uart", 1 << 31, lambda size: size.to_bytes(2, "little") + b"\x01\x00"),
        (0x50, "uart", 0, lambda size: size.to_bytes(2, "little") + b"\x01\x00"),
        (0x68, "ethernet", 2, lambda size: (size | 0x8000).to_bytes(2, "little") + b"\x00\x20"),
        (0x69, "arinc_664", 2 | 28 << 16, lambda size: bytes(2) + size.to_bytes(2, "little") + bytes(16)),
        (0x78, "can", 2, lambda size: size.to_bytes(2, "little") + b"\x01\x00"),
    ],
)
def test_messages_that_tell_their_length(tmp_path: Path, kind: int, name: str, specific: int, header: object) -> None:
    assert callable(header)
    contents = [bytes(range(70)), b"hello"]
    is_timed = not (name == "uart" and specific == 0)
    body = b"".join(
        stamped(header(len(one)), one, 100 + at * COUNTS_PER_S if is_timed else None) for at, one in enumerate(contents)
    )
    items = read(tmp_path, made.packet(3, kind, specific.to_bytes(4, "little") + body, 100))
    check(items)
    found = rows(items, f"raw.bytes.{name}.3")
    assert found["size"].tolist() == [70, 70, 5] and found["piece"].tolist() == [0, 1, 0]
    assert found["bytes_00"][0] == int.from_bytes(bytes(range(8)), "little")
    assert int(found["bytes_00"][2]).to_bytes(8, "little") == b"hello\0\0\0"
    later = 1.0 if is_timed else 0.0
    np.testing.assert_allclose(found["time_s"], [1e-5, 1.0001e-5, 1e-5 + later], rtol=0, atol=1e-12)


def test_frames_discretes_and_events(tmp_path: Path) -> None:
    frames = made.packet(2, 0x09, (0x2000_0000).to_bytes(4, "little") + bytes(range(100)), 5)
    states = b"".join((10 * at).to_bytes(8, "little") + (at & 1).to_bytes(4, "little") for at in range(4))
    discretes = made.packet(8, 0x29, bytes(4) + states, 0)
    event = (30).to_bytes(8, "little") + (3 | 1 << 12).to_bytes(4, "little")
    events = made.packet(0, 0x02, (1).to_bytes(4, "little") + event, 0)
    items = read(tmp_path, made.packet(0, 0x01, TMATS, 0) + frames + discretes + events)
    check(items)
    pcm = rows(items, "raw.bytes.pcm.2")
    assert pcm["size"].tolist() == [100, 100] and pcm["specific_word"].tolist() == [0x2000_0000] * 2
    assert rows(items, "raw.discrete.8")["states"].tolist() == [0, 1, 0, 1]
    assert rows(items, "event")["name"].tolist() == ["Release"]


def test_messages_that_a_packet_lacks_are_told(tmp_path: Path) -> None:
    data = bytearray(made.messages_1553([VELOCITY, VELOCITY]))
    data[0] = 5
    items = read(tmp_path, made.packet(4, 0x19, bytes(data), 0))
    assert len(rows(items, "raw.bus.1553.4")["word_count"]) == 2
    assert [item.count for item in items if isinstance(item, Damage)] == [3]


def test_tmats_that_is_missing_contradicts_the_packets_or_describes_frames(tmp_path: Path) -> None:
    words = made.packet(7, 0x38, made.words_429([(0, 0, 1)]), 0)
    assert "no_tmats" in codes(read(tmp_path, words))
    setup = made.tmats(
        "R-1\\TK1-1:7;R-1\\CDT-1:1553IN;R-1\\TK1-2:2;R-1\\CDT-2:PCMIN;R-1\\CDLN-2:P1;P-1\\DLN:P1;P-1\\F1:16;"
    )
    packet = bytearray(made.packet(0, 0x01, setup, 0, checksum=2))
    packet[-1] ^= 1
    items = read(tmp_path, bytes(packet) + words)
    told = [item.text for item in items if isinstance(item, Remark) and item.code == "tmats_contradicted"]
    assert told == ["channel 7 is 1553IN by TMATS and has 1 ARINC-429 packet: they are believed"]
    header = items[0]
    assert isinstance(header, LogHeader) and header.metadata["pcm.2"] == "F1=16"
    assert [item.loses_data for item in items if isinstance(item, Damage)] == [False]


def test_stamps_that_are_not_read_are_told(tmp_path: Path) -> None:
    data = made.messages_1553([(99, 0, [0x37A0, 1])])
    one = made.packet(4, 0x19, data, COUNTS_PER_S, secondary=made.secondary_1588(1_000, 0), flags=0x40)
    items = read(tmp_path, one)
    assert rows(items, "raw.bus.1553.4")["time_s"].tolist() == [1.0] and "clock_disagrees" in codes(items)
