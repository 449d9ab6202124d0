"""Sentences in the text of the computer that recorded them: stamps, words behind, and what its clock is for."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from groundstation.base.errors import GroundstationError
from groundstation.base.records import RecordBatch
from groundstation.base.timescales import utc_ns_to_iso
from groundstation.readers import registry
from groundstation.readers.receiver import stream
from groundstation.readers.receiver.host_text import CLOCKS, find
from tests.readers.receiver_writer import gga, nmea, novatel_text_log, rmc
from tests.readers.test_receiver import Read
from tests.real_logs import real_log

EPOCH_S = 1_777_896_000  # 2026-05-04T12:00:00Z


def clock(at: int) -> str:
    return f"{12 + at // 3600:02d}:{at // 60 % 60:02d}:{at % 60:02d}"


def lines(count: int, sentence: Callable[[int], bytes], host: Callable[[int, str], str]) -> bytes:
    """Lines of a log: ``host`` puts a sentence, without its line end, into the computer's text."""
    return b"".join(host(at, sentence(at).decode().rstrip()).encode() + b"\r\n" for at in range(count))


def fix(at: int) -> bytes:
    time = f"12{at // 60:02d}{at % 60:02d}.00"
    return rmc(time, "040526", at / 10) if at % 2 else gga(time, f"51{at % 60:02d}.00000,N")


HOSTS: dict[str, Callable[[int, str], str]] = {
    "date, time and port": lambda at, text: f"2026-05-04 {clock(at)}.123 COM3> {text}",
    "ISO": lambda at, text: f"2026-05-04T{clock(at)}.123456Z {text}",
    "ISO with a zone": lambda at, text: f"2026-05-04T{clock(at + 7200)}+02:00\t{text}",
    "compact": lambda at, text: f"20260504_{clock(at).replace(':', '')},{text}",
    "day first": lambda at, text: f"04.05.2026 {clock(at)},5: {text}",
    "seconds since 1970": lambda at, text: f"{EPOCH_S + at}.25 {text}",
    "milliseconds since 1970": lambda at, text: f"{EPOCH_S + at}250;{text}",
    "in brackets": lambda at, text: f"[{clock(at)}.123] {text}",
    "syslog": lambda at, text: f"May  4 {clock(at)} rover gpsd[{at + 812}]: {text}",
    "half days": lambda at, text: f"{int(clock(at)[:2]) % 12 or 12}{clock(at)[2:]} PM RX {text}",
    "seconds": lambda at, text: f"[{at + 33.5:12.6f}] {text}",
    "a word": lambda _at, text: f"NMEA,{text}",
    "behind": lambda at, text: f"NMEA,{text},{EPOCH_S + at}123",
    "JSON": lambda at, text: f'{{"t": {EPOCH_S + at}.5, "raw": "{text}\\r\\n"}}',
    "tag block": lambda at, text: f"\\s:r1,c:{EPOCH_S + at}*5A\\{text}",
    "spaces": lambda _at, text: f"    {text} ",
}


@pytest.mark.parametrize("host", HOSTS.values(), ids=HOSTS)
def test_sentences_in_a_computers_text_are_read_as_they_are_alone(
    tmp_path: Path, host: Callable[[int, str], str], monkeypatch: pytest.MonkeyPatch
) -> None:
    alone = Read(tmp_path, lines(300, fix, lambda _at, text: text))
    content = lines(300, fix, host)
    for block_bytes in (stream.BLOCK_BYTES, 30_011):
        monkeypatch.setattr(stream, "BLOCK_BYTES", block_bytes)
        read = Read(tmp_path, content)
        for topic in ("gnss", "raw.GNGGA", "raw.GNRMC"):
            assert read.times(topic) == alone.times(topic)
        for field in ("latitude_deg", "ground_speed_mps"):
            assert read.values("gnss", field) == alone.values("gnss", field)
        assert not read.damages and len(read.times("raw.host")) == 300 and None not in read.times("raw.host")
        assert "300 sentences stand in text" in read.remark("host_text") and "times are the receiver's" in read.remark(
            "host_text"
        )
        first = host(0, fix(0).decode().rstrip()).split("$")[0]
        assert read.values("raw.host", "before")[0] == (first or None)


def test_lines_of_a_small_log_are_enough_and_one_is_not(tmp_path: Path) -> None:
    host = HOSTS["date, time and port"]
    assert len(Read(tmp_path, lines(3, fix, host)).times("gnss")) == 3
    with pytest.raises(GroundstationError, match="no reader claims"):
        Read(tmp_path, lines(2, fix, host))
    with pytest.raises(GroundstationError, match="no reader claims"):
        Read(tmp_path, lines(9, fix, lambda at, text: f"{at} {text[:-2]}zz"))


def test_damage_in_a_computers_text_is_still_damage(tmp_path: Path) -> None:
    host = HOSTS["date, time and port"]
    good = lines(50, fix, host)
    bad = good.split(b"\r\n")[7].replace(b"5107", b"5108").replace(b"5130", b"5131") + b"\r\n"
    words = b"*** the cable was out ***\r\n"
    read = Read(tmp_path, good + bad + words + good)
    assert len(read.values("raw.host", "before")) == 100
    assert sum(one.count for one in read.damages) == len(bad) + len(words)
    joined = bad.rstrip() + good  # the line end is lost too
    read = Read(tmp_path, good + joined)
    assert sum(one.count for one in read.damages) >= len(bad) - 2 and len(read.values("raw.host", "before")) == 99


def test_sentences_without_a_checksum_in_a_computers_text(tmp_path: Path) -> None:
    read = Read(tmp_path, lines(9, lambda at: fix(at).split(b"*")[0], HOSTS["in brackets"]))
    assert len(read.times("gnss")) == 9 and "not seen" in read.remark("no_checksum") and not read.damages


def test_text_logs_of_novatel_in_a_computers_text(tmp_path: Path) -> None:
    plain = novatel_text_log(20)
    stamped = b"".join(b"12:00:00.5 " + line + b"\r\n" for line in plain.split(b"\r\n") if line)
    mixed = lines(40, fix, HOSTS["in brackets"]) + stamped
    read = Read(tmp_path, mixed)
    assert len(read.values("raw.BESTPOS", "latitude")) == 20 and not read.damages


# --- what the computer's clock is for


def heading(at: int) -> bytes:
    return nmea(f"HEHDT,{at % 360}.0,T")


def test_sentences_without_a_time_have_that_of_their_arrival(tmp_path: Path) -> None:
    read = Read(tmp_path, lines(30, heading, HOSTS["ISO with a zone"]))
    assert read.times("ins")[:2] == ["2026-05-04T12:00:00.000000000Z", "2026-05-04T12:00:01.000000000Z"]
    assert read.header.utc_of_zero_ns == 0 and not read.remark("assumed_utc")
    assert "times are those of arrival by the computer's clock" in read.remark("host_text")
    assert "is taken for UTC" in Read(tmp_path, lines(30, heading, HOSTS["date, time and port"])).remark("assumed_utc")


def test_arrival_by_a_clock_without_a_date_is_not_utc(tmp_path: Path) -> None:
    late = Read(
        tmp_path,
        lines(
            30,
            heading,
            lambda at, text: (
                f"[{(86_385 + at) // 3600 % 24:02d}:{(86_385 + at) // 60 % 60:02d}:{(86_385 + at) % 60:02d}] {text}"
            ),
        ),
    )
    assert late.header.utc_of_zero_ns is None
    times = np.concatenate([batch.device_time_ns.values for batch in late.batches("ins")])
    assert set(np.diff(times).tolist()) == {10**9}, "it counts on past midnight"
    since = Read(tmp_path, lines(30, heading, HOSTS["seconds"]))
    assert since.batches("ins")[0].device_time_ns.values[0] == 33_500_000_000


@pytest.mark.parametrize(
    "host",
    [
        lambda at, text: f"{(at * 37) % 24:02d}:00:00 {text}",
        lambda _at, text: f"12:00:00 {text}",
        HOSTS["a word"],
    ],
)
def test_a_clock_that_is_not_in_order_does_not_serve(tmp_path: Path, host: Callable[[int, str], str]) -> None:
    read = Read(tmp_path, lines(30, heading, host))
    assert set(read.times("raw.HEHDT")) == {None} and "arrival" not in read.remark("host_text")


@pytest.mark.parametrize("zone_s", [0, 7_200, -5 * 3_600, 20_700])
def test_the_date_of_the_computer_serves_where_the_receiver_tells_none(tmp_path: Path, zone_s: int) -> None:
    """Its zone is some quarters of an hour, the time of the day stays the receiver's."""

    def host(at: int, text: str) -> str:
        return f"{utc_ns_to_iso((EPOCH_S + at + zone_s) * 10**9, 3).replace('Z', '').replace('T', ' ')} {text}"

    read = Read(tmp_path, lines(30, lambda at: gga(f"1200{at:02d}.00"), host))
    assert read.times("gnss")[:2] == ["2026-05-04T12:00:00.000000000Z", "2026-05-04T12:00:01.000000000Z"]
    assert f"it is that of the computer's clock, {zone_s / 3600:g} h ahead" in read.remark("host_text")
    assert read.header.utc_of_zero_ns == 0


def test_a_computers_date_that_runs_apart_does_not_serve(tmp_path: Path) -> None:
    read = Read(tmp_path, lines(30, lambda at: gga(f"12{at:02d}00.00"), HOSTS["date, time and port"]))
    assert read.header.utc_of_zero_ns is None and "the receiver tells no date" in read.remark("host_text")


@pytest.mark.parametrize(
    ("text", "told"),
    [
        (b"2026-05-04 12:00:01.5 ", [1.5, 1.5]),
        (b"2026/05/04,12:00:01,5;", [1.5, 1.5]),
        (b"04.05.2026 12:00:01 ", [1.0, 1.0]),
        (b"2026-13-04 12:00:01 ", [None, 1.0]),
        (b"2026-05-04 25:00:01 ", [None, None]),
        (b"1777896001250 ", [1.25, None]),
        (b"1777896001250000 ", [1.25, None]),
        (b"1777896001.25 ", [1.25, None]),
        (b"12:00:01 AM ", [None, -43_199.0]),
        (b"12:00:01 pm ", [None, 1.0]),
        (b"COM3 ", [None, None]),
    ],
)
def test_clocks(text: bytes, told: list[float | None]) -> None:
    found = {
        kind: next((one.read(text) for one in CLOCKS if one.kind == kind and one.read(text)), None)
        for kind in ("date and time", "time of the day")
    }
    zeros = {"date and time": EPOCH_S, "time of the day": 43_200}
    assert [None if ns is None else (ns - zeros[kind] * 10**9) / 1e9 for kind, ns in found.items()] == told


def test_what_is_no_log_of_sentences_is_not_taken_for_one() -> None:
    assert find(b"a line of text\n" * 100 + b"x $GPHDT,123.4,T*31\r\n") is None
    assert find(b"cost: $USD,5 and $EUR,7\n" * 100) is None
    assert find(b"$" * 60_000 + b"A,*00") is None and find(bytes(range(256)) * 200) is None


@pytest.mark.real_log
def test_recorded_case() -> None:
    items = registry.read(real_log("cases/n7_host_prefix.nmea"))
    gnss = [item for item in items if isinstance(item, RecordBatch) and item.topic == "gnss"]
    assert sum(len(batch) for batch in gnss) == 60
    assert utc_ns_to_iso(int(gnss[0].device_time_ns.values[0]), 0) == "2024-05-06T10:00:00Z"
