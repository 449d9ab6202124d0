"""Flights written as Chapter 10: packets, times and words as two other readers of the format see them.

AcraNetwork (GPL) and pychapter10 are here as oracles alone; the package imports neither.
"""

from collections.abc import Iterator
from dataclasses import replace
from datetime import UTC, datetime
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from AcraNetwork.IRIG106.Chapter10.FileParser import FileParser
from AcraNetwork.IRIG106.Chapter11 import Chapter11
from AcraNetwork.IRIG106.Chapter11.ARINC429 import ARINC429DataPacket
from AcraNetwork.IRIG106.Chapter11.MILSTD1553 import MILSTD1553DataPacket
from AcraNetwork.IRIG106.Chapter11.TimeDataFormat import TimeDataFormat1
from chapter10 import C10

from groundstation.base.errors import UsageError
from groundstation.base.units import NS_PER_S
from groundstation.pipeline.verbs.conversions import convert_many
from groundstation.pipeline.verbs.synthesis import simulate_to
from groundstation.readers.icd import decode_429, decode_1553, labels_of, load, signal_values, usable_1553
from groundstation.simulation.chapter10_buses import WORD_TIME_NS, Buses, buses_of
from groundstation.simulation.chapter10_packets import ARINC_429_F0, BUS_1553_F1, TIME_F1, TMATS
from groundstation.simulation.chapter10_writer import ARINC_CHANNEL, FIRST_TICK, write_chapter10
from groundstation.simulation.flight import simulate
from groundstation.simulation.scenario import load_scenario
from groundstation.tables.table import Flight

TICK_NS = 100
CHECKSUM_BYTES = 4


@cache
def flown() -> Flight:
    return simulate(load_scenario("taxi-good")).flight


@cache
def buses() -> Buses:
    return buses_of(flown())


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("ch10") / "flight.ch10"
    write_chapter10(path, flown())
    return path


def expected_ticks(time_ns: np.ndarray) -> np.ndarray:
    return FIRST_TICK + np.rint((time_ns - flown().start_ns) / TICK_NS).astype(np.int64)


def acra(log: Path) -> Iterator[tuple[Chapter11, bytes]]:
    """Packets and their data without filler and checksum, as AcraNetwork reads them."""
    with FileParser(str(log)) as file:
        for content in file:
            packet = Chapter11()
            packet.unpack(content)
            yield packet, packet.payload[: packet.datalen]


def test_the_file_begins_with_tmats_and_then_the_time(log: Path) -> None:
    packets = list(acra(log))
    assert [packet.datatype for packet, _data in packets[:2]] == [TMATS, TIME_F1]
    setup = packets[0][1][4:].decode("ascii")
    for line in ("G\\TA:SIM-1;", "R-1\\CDT-2:1553IN;", "B-1\\BNA-1:NAVBUS;", "R-1\\ANM-3-2:GNSS;", "R-1\\N:3;"):
        assert f"{line}\r\n" in setup
    assert sum(packet.packetlen for packet, _data in packets) == log.stat().st_size


def test_headers_checksums_and_sequences(log: Path) -> None:
    content, sequences = log.read_bytes(), {}
    place, last = 0, 0
    for packet, _data in acra(log):
        one = content[place : place + packet.packetlen]
        place += packet.packetlen
        assert packet.packetlen % 4 == 0
        assert sum(np.frombuffer(one[:22], "<u2").tolist()) & 0xFFFF == int.from_bytes(one[22:24], "little")
        assert sum(np.frombuffer(one[24:-4], "<u4").tolist()) & 0xFFFFFFFF == int.from_bytes(one[-4:], "little")
        assert packet.sequence == sequences.get(packet.channelID, 0)
        sequences[packet.channelID] = (packet.sequence + 1) & 0xFF
        assert packet.relativetimecounter >= last - 1_000_000  # packets overlap by no more than what one holds
        last = packet.relativetimecounter


def test_time_packets_give_utc_to_the_tick(log: Path) -> None:
    found = []
    for packet, data in acra(log):
        if packet.datatype == TIME_F1:
            time = TimeDataFormat1()
            time.unpack(data)
            utc_ns = time.ptptime.seconds * NS_PER_S + time.ptptime.nanoseconds
            assert packet.relativetimecounter == expected_ticks(np.array(utc_ns))
            found.append(utc_ns)
    assert np.diff(found).tolist() == [NS_PER_S] * (len(found) - 1)
    assert found[0] <= flown()["ins"].time_ns[0]
    assert found[-1] >= flown()["gnss"].time_ns[-1]


def test_messages_are_those_of_the_flight(log: Path) -> None:
    (bus,) = buses().buses_1553
    ticks, data = [], []
    for packet, payload in acra(log):
        if packet.datatype == BUS_1553_F1:
            body = MILSTD1553DataPacket()
            body.unpack(payload)
            assert (body.msgcount, body.ttb, packet.channelID) == (len(body), 1, bus.channel)
            for message in body:
                words = np.frombuffer(message.message, "<u2")
                assert (message.blockstatus, words[0], words[1]) == (0, 0x37A0, 6 << 11)
                ticks.append(message.ipts.count)
                data.append(words[2:])
    assert ticks == expected_ticks(bus.time_ns).tolist()
    assert np.array_equal(np.array(data), bus.data)


def test_words_are_those_of_the_flight(log: Path) -> None:
    found: dict[int, list[tuple[int, int]]] = {}
    for packet, payload in acra(log):
        if packet.datatype == ARINC_429_F0:
            assert packet.channelID == ARINC_CHANNEL
            body = ARINC429DataPacket()
            body.unpack(payload)
            tick = packet.relativetimecounter
            for word in body:
                tick += word.gaptime
                assert (word.bus_speed, word.parity_error, word.format_error) == (1, False, False)
                found.setdefault(word.bus + 1, []).append((tick, int.from_bytes(word.payload, "little")))
    for bus in buses().buses_429:
        ticks, words = zip(*found.pop(bus.subchannel), strict=True)
        assert list(ticks) == expected_ticks(bus.time_ns).tolist()
        assert list(words) == bus.words.tolist()
    assert not found


def test_pychapter10_sees_the_same(log: Path) -> None:
    messages, words, count = [], [], 0
    for packet in C10(str(log)):
        count += 1
        if packet.data_type == BUS_1553_F1:
            messages += [(message.ipts, message.length, bytes(message.data)) for message in packet]
        elif packet.data_type == ARINC_429_F0:
            words += [int.from_bytes(message.data, "little") for message in packet]
        elif packet.data_type == TIME_F1:
            utc_ns = int(packet.time.replace(tzinfo=UTC).timestamp()) * NS_PER_S
            assert packet.rtc == expected_ticks(np.array(utc_ns))
    (bus,) = buses().buses_1553
    assert count == len(list(acra(log)))
    assert [time for time, _length, _data in messages] == expected_ticks(bus.time_ns).tolist()
    assert {length for _time, length, _data in messages} == {68}
    data = np.array([np.frombuffer(data, "<u2")[2:] for _time, _length, data in messages])
    assert np.array_equal(data, bus.data)
    assert sorted(words) == sorted(np.concatenate([bus.words for bus in buses().buses_429]).tolist())


def test_the_icd_beside_it_gives_the_signals_back(log: Path) -> None:
    found, ins = load(log.with_suffix(".icd.yaml")), flown()["ins"]
    assert found.notes == ()
    (message,), (bus,) = found.messages_1553, buses().buses_1553
    for element in message.elements:
        if element.signal:
            values = signal_values(decode_1553(bus.data, element), element)
            expected = ins.values(element.signal.rpartition(".")[2])
            assert np.array_equal(usable_1553(bus.data, element), np.isfinite(expected))
            assert np.nanmax(np.abs((values - expected + 180.0) % 360.0 - 180.0)) <= 0.003
    parts = [element for _holder, element in found.elements() if element.signal]
    signals = [element.signal for element in parts if not getattr(element, "fine_of", "")]
    assert len(signals) == len(set(signals))  # nothing is fed by two buses
    assert {"ins.true_heading_deg", "gnss.latitude_deg", "discrete.weight_on_wheels"} <= set(signals)


def test_a_fine_word_follows_its_coarse_one() -> None:
    gnss = next(bus for bus in buses().buses_429 if bus.name == "GNSS")
    words = {word.name: word for word in gnss.meanings}
    parts = {}
    for name in ("GNSS_latitude", "GNSS_latitude_fine"):
        taken = words[name].takes(gnss.words)
        parts[name] = gnss.time_ns[taken], decode_429(gnss.words[taken], words[name].elements[0])
    (coarse_ns, (coarse, usable)), (fine_ns, (fine, _fine_usable)) = parts.values()
    expected = flown()["gnss"].values("latitude_deg")
    assert np.array_equal(usable, np.isfinite(expected))
    assert (fine_ns - coarse_ns).max() <= 10 * WORD_TIME_NS
    assert np.nanmax(np.abs(coarse + fine - expected)) <= 180.0 / 2**31


def test_missing_samples_are_invalid() -> None:
    table = flown()["gnss"]
    rows = np.arange(len(table))
    column = replace(table.columns["velocity_north_mps"], present=rows % 2 == 0)
    holed = replace(table, columns={**table.columns, "velocity_north_mps": column})
    (bus,) = buses_of(replace(flown(), tables={"gnss": holed})).buses_429
    north = next(word for word in bus.meanings if word.label == 0o166)
    _values, usable = decode_429(bus.words[north.takes(bus.words)], north.elements[0])
    assert usable.tolist() == (rows % 2 == 0).tolist()


def test_two_inertial_systems_have_buses_of_their_own() -> None:
    ins = flown()["ins"]
    tables = {"ins.1": replace(ins, topic="ins.1"), "ins.2": replace(ins, topic="ins.2")}
    made = buses_of(replace(flown(), tables=tables))
    assert [bus.message.bus for bus in made.buses_1553] == ["NAVBUS", "NAVBUS-2"]
    assert [bus.name for bus in made.buses_429] == ["INS", "INS-2"]
    assert {element.signal.rpartition(".")[0] for _holder, element in made.icd.elements() if element.signal} == {
        "ins.1",
        "ins.2",
    }


def test_words_of_a_bus_do_not_overlap() -> None:
    assert [bus.name for bus in buses().buses_429] == ["INS", "GNSS", "ADC"]
    for bus in buses().buses_429:
        assert np.diff(bus.time_ns).min() >= WORD_TIME_NS


def test_words_that_only_arinc_429_has_come_with_the_message() -> None:
    ins = flown()["ins"]
    rate = {"rate_z_dps": replace(ins.columns["roll_deg"])}
    made = buses_of(replace(flown(), tables={"ins": replace(ins, columns={**ins.columns, **rate})}))
    (message,), (words,) = made.buses_1553, made.buses_429
    first = words.words[np.isin(words.time_ns, message.time_ns)]
    assert set(labels_of(first).tolist()) == {0o330}
    assert [one.signal for word in words.meanings for one in word.elements if one.signal] == ["ins.rate_z_dps"]


def test_a_slow_bus_sends_every_second_sample() -> None:
    ins = flown()["ins"]
    fast = replace(ins, time_ns=ins.time_ns[0] + np.arange(len(ins)) * 1_000_000)  # 1000 Hz; five words take 1.8 ms
    (bus,) = buses_of(replace(flown(), tables={"ins": fast})).buses_429
    count = int((labels_of(bus.words) == 0o314).sum())
    assert count == (len(ins) + 1) // 2
    assert np.diff(bus.time_ns).min() >= 0


def test_without_utc_there_are_no_time_packets(tmp_path: Path) -> None:
    write_chapter10(tmp_path / "x.ch10", replace(flown(), has_utc=False))
    assert TIME_F1 not in {packet.datatype for packet, _data in acra(tmp_path / "x.ch10")}


def test_what_is_on_no_bus_is_told(tmp_path: Path) -> None:
    icd, left_out = write_chapter10(tmp_path / "x.ch10", flown(), cut_bytes=100)
    assert icd == tmp_path / "x.icd.yaml"
    assert left_out == ("event", "magnetometer", "onboard", "truth")
    assert (tmp_path / "x.ch10").stat().st_size % 4 == 0


def test_the_same_flight_gives_the_same_bytes(log: Path, tmp_path: Path) -> None:
    write_chapter10(tmp_path / "x.ch10", flown())
    assert (tmp_path / "x.ch10").read_bytes() == log.read_bytes()
    assert datetime.fromtimestamp(flown().start_ns / NS_PER_S, UTC).year == 2026  # no clock of this machine is asked


def test_simulate_and_convert_write_it(tmp_path: Path) -> None:
    log, icd = simulate_to("taxi-short", tmp_path, form="ch10")
    assert (log.name, icd.name) == ("taxi-short.ch10", "taxi-short.icd.yaml")
    with pytest.raises(UsageError, match="exists"):
        simulate_to("taxi-short", tmp_path, form="ch10")
    with pytest.raises(UsageError, match="one flight"):
        simulate_to("ils-approach", tmp_path, form="ch10")
    (csv,) = simulate_to("taxi-short", tmp_path)
    (outcome,) = convert_many([csv], tmp_path / "again.ch10")
    assert outcome.state == "done"
    assert outcome.text.endswith("again.ch10 and again.icd.yaml, without onboard")

    def messages(path: Path) -> list[bytes]:
        return [data for packet, data in acra(path) if packet.datatype in (BUS_1553_F1, TIME_F1)]

    assert messages(tmp_path / "again.ch10") == messages(log)
