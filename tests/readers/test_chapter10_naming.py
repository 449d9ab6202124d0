"""Bus words become signals by ICDs: units, pairs, what is not used; the same from the log and from its MCAP."""

from pathlib import Path

import numpy as np
import pytest

from groundstation.base.errors import UsageError
from groundstation.base.geodesy import north_east_m
from groundstation.base.records import Damage, Item, RecordBatch, Remark
from groundstation.pipeline.one_flight.convert import convert_log
from groundstation.pipeline.one_flight.log import open_log
from groundstation.pipeline.verbs.catalogue import catalogue
from groundstation.pipeline.verbs.describe import describe, suggest_icd
from groundstation.readers import registry
from groundstation.readers.chapter10.bus_words import TIME_OUT
from groundstation.readers.chapter10.scan import BETWEEN_TERMINALS
from groundstation.readers.icd import Icd, load, shipped
from groundstation.store.reader import read as read_store
from tests.readers import chapter10_packets as made
from tests.readers.test_chapter10 import COUNTS_PER_S, rows
from tests.real_logs import real_log

ICD = """
translatable_message_definitions:
  ATTITUDE:
    msg_data: {command: [COMMAND, RECEIVE], lru_addr: [6, RT], lru_subaddr: [29, SA], lru_name: [ins, none], bus: '',
      wrdcnt: 2, rate: 25.0, mode_code: False, desc: ''}
    word_elem:
      time_tag: {offset: 0, cnt: 1, schema: UNSIGNED16, msbval: 32768.0, desc: '', uom: '', multifmt: False, class: 0}
      roll: {offset: 1, cnt: 1, schema: SIGNED16, msbval: 90.0, desc: '', uom: deg, multifmt: False, class: 0}
    bit_elem: {}
supplemental_bus_map_command_words: {}
"""
SENDS, TAKES = 6 << 11 | 1 << 10 | 29 << 5 | 2, 9 << 11 | 3 << 5 | 2
STATUS, STATUS_9 = 6 << 11, 9 << 11


def icd_file(folder: Path, receive: int = 0) -> Path:
    path = folder / "attitude.yaml"
    text = ICD.replace("COMMAND", str(SENDS)).replace("RECEIVE", str(receive))
    path.write_text(text.replace("RT]", f"{receive >> 11}]").replace("SA]", f"{receive >> 5 & 31}]"))
    return path


def read(folder: Path, content: bytes, *icds: Icd) -> list[Item]:
    path = folder / "recorded"
    path.write_bytes(content)
    return list(registry.read(path, icds=icds))


def texts(items: list[Item], code: str) -> list[str]:
    return [item.text for item in items if isinstance(item, Remark) and item.code == code]


def message(at: int, tag: int, roll: int, status: int = 0) -> tuple[int, int, list[int]]:
    return at * 1_000, status, [SENDS, STATUS, tag, roll & 0xFFFF]


def test_errors_short_messages_and_repeats_are_not_used(tmp_path: Path) -> None:
    messages = [
        message(0, 1, 100),
        message(1, 1, 100),
        message(2, 2, -100),
        message(3, 3, 50, TIME_OUT),
        (4_000, 0, [SENDS, STATUS, 4]),
        message(5, 5, 100),
    ]
    items = read(tmp_path, made.packet(4, 0x19, made.messages_1553(messages), 0), load(icd_file(tmp_path)))
    found = rows(items, "ins")
    assert found["roll_deg"].tolist() == [value * 180 / 2**15 for value in (100, -100, 100)]
    np.testing.assert_allclose(found["time_s"], [0.0, 2e-4, 5e-4], atol=1e-12)
    told = texts(items, "not_used")
    assert len(told) == 1 and "3 used" in told[0]
    assert all(text in told[0] for text in ("1 have a bus error", "1 are shorter", "1 repeat a sample"))
    assert len(rows(items, "raw.bus.1553.4")["word_count"]) == 6


@pytest.mark.parametrize("receive", [0, TAKES])
def test_a_transfer_between_terminals_is_the_same_message(tmp_path: Path, receive: int) -> None:
    """The receiver's command word comes first, the sender's second, its status third; then the controller reads it."""
    between = (0, BETWEEN_TERMINALS, [TAKES, SENDS, STATUS, 1, 200, STATUS_9])
    items = read(
        tmp_path,
        made.packet(4, 0x19, made.messages_1553([between, message(1, 1, 200), message(2, 2, 300)]), 0),
        load(icd_file(tmp_path, receive)),
    )
    assert rows(items, "ins")["roll_deg"].tolist() == [200 * 180 / 2**15, 300 * 180 / 2**15]


def test_zeros_of_a_unit_without_a_position_are_none(tmp_path: Path) -> None:
    words = [(1, 200_000, made.word_429(label, 4_000 * (at > 2))) for at in range(5) for label in (0o310, 0o311, 0o314)]
    items = read(tmp_path, made.packet(4, 0x38, made.words_429(words), 0), shipped("arinc429_inertial"))
    found = rows(items, "ins")
    assert np.isfinite(found["latitude_deg"]).sum() == 2 and np.isfinite(found["true_heading_deg"]).sum() == 5
    (damage,) = [item for item in items if isinstance(item, Damage)]
    assert (damage.kind, damage.topic, damage.count, damage.loses_data) == ("no_position", "ins", 3, False)


def test_one_terminal_on_two_channels_is_two_units(tmp_path: Path) -> None:
    icd = load(icd_file(tmp_path))
    packets = [made.packet(channel, 0x19, made.messages_1553([message(0, 1, channel)]), 0) for channel in (4, 5)]
    items = read(tmp_path, b"".join(packets), icd)
    assert [rows(items, f"ins.{unit}")["roll_deg"].tolist() for unit in (1, 2)] == [
        [4 * 180 / 2**15],
        [5 * 180 / 2**15],
    ]
    assert "2 units of ins" in texts(items, "several_units")[0]


def test_an_icd_of_another_aircraft_is_told(tmp_path: Path) -> None:
    items = read(tmp_path, made.packet(7, 0x38, made.words_429([(0, 0, 1)]), 0), shipped("b100"))
    assert texts(items, "icd_of_another") == ["ICD b100: 0 of its 1 words and messages are on the buses"]


def bnr(value: float, full_scale: float) -> int:
    """The 19 bits from bit 11 on."""
    return round(value / full_scale * 2**18) & 0x7FFFF


AXES_429 = (  # label, full scale, value: rates in deg/s, accelerations in g
    *((0o327, 128, 3.0), (0o326, 128, -2.0), (0o330, 128, 10.0)),
    *((0o331, 4, 0.125), (0o332, 4, -0.25), (0o333, 4, 1.0)),
)


def body_words(samples: int, left_out: int = -1, of: tuple[tuple[int, int, float], ...] = AXES_429) -> bytes:
    """Body rates and accelerations of an inertial reference, 50 Hz; one sample may lack its last word."""
    words = []
    for at in range(samples):
        for number, (label, full, value) in enumerate(of):
            if at != left_out or number < len(of) - 1:
                bits = round(value / full * 2**18) & 0x7FFFF & ~(0x3F if full == 4 else 0x1F)
                words.append((0, 200_000 if not number else 2_000, made.word_429(label, bits)))
    return made.packet(7, 0x38, made.words_429(words), 0)


def test_body_rates_and_accelerations_are_an_inertial_unit(tmp_path: Path) -> None:
    items = read(tmp_path, body_words(5, left_out=2), shipped("arinc429_inertial"))
    found = rows(items, "imu")
    assert len(found["rate_x_dps"]) == 4 and not found["is_integral"].any()
    rates = [found[f"rate_{axis}_dps"][0] for axis in "xyz"]
    forces = [found[f"accel_{axis}_mps2"][0] for axis in "xyz"]
    np.testing.assert_allclose(rates, [3.0, -2.0, 10.0], atol=128 / 2**13)
    np.testing.assert_allclose(forces, np.array([0.125, -0.25, -1.0]) * 9.80665, atol=9.80665 * 4 / 2**12)
    assert any("imu from the body rates and accelerations of ins" in text for text in texts(items, "mapped"))
    assert "rate_x_dps" in rows(items, "ins"), "what scripts read of `ins` stays"


def test_rates_without_accelerations_are_no_unit(tmp_path: Path) -> None:
    items = read(tmp_path, body_words(5, of=AXES_429[:5]), shipped("arinc429_inertial"))
    assert not [item for item in items if isinstance(item, RecordBatch) and item.topic == "imu"]


def test_429_words_that_belong_together(tmp_path: Path) -> None:
    """One sample at the time of its first word; velocities from track and speed; no computed data is absent."""
    gap = 4_000
    words = [
        (0, 0, made.word_429(0o310, bnr(34.5, 180))),
        (0, gap, made.word_429(0o311, bnr(-117.5, 180))),
        (0, gap, made.word_429(0o312, bnr(100, 4096))),
        (0, gap, made.word_429(0o313, bnr(-90, 180))),
        (0, gap, made.word_429(0o314, bnr(-90, 180))),
        (0, gap, made.word_429(0o314, bnr(45, 180), status=1)),
        (0, gap, made.word_429(0o325, bnr(1, 180)) ^ 1 << 31),
        (1, gap, made.word_429(0o314, bnr(10, 180))),
    ]
    items = read(tmp_path, made.packet(7, 0x38, made.words_429(words), COUNTS_PER_S), shipped("arinc429_inertial"))
    batches = [item for item in items if isinstance(item, RecordBatch) and item.topic == "ins.1"]
    assert len(batches) == 1
    batch = batches[0]
    told = {name: column.values[column.mask] for name, column in batch.columns.items()}
    assert told["true_heading_deg"].tolist() == [270.0] and "roll_deg" not in told
    assert batch.device_time_ns.values.tolist() == [1_000_000_000]
    np.testing.assert_allclose([told["latitude_deg"][0], told["longitude_deg"][0]], [34.5, -117.5], atol=180 / 2**18)
    speed_mps = 100 * 1852 / 3600
    np.testing.assert_allclose(
        [told["velocity_north_mps"][0], told["velocity_east_mps"][0]], [0, -speed_mps], atol=0.002 * speed_mps
    )
    assert "true_track_deg" not in told
    assert any("velocity_north_mps" in text for text in texts(items, "derived"))
    assert len(texts(items, "not_used")) == 2
    other = rows(items, "ins.2")["true_heading_deg"]
    np.testing.assert_allclose(other, [10.0], atol=180 / 2**15)


def test_samples_of_429_words(tmp_path: Path) -> None:
    """A word that comes again, or late, begins a new sample."""
    near, far = 4_000, 200_000
    pitch, roll = made.word_429(0o324, bnr(2, 180)), made.word_429(0o325, bnr(1, 180))
    words = [(0, 0, pitch), (0, near, roll), (0, near, pitch), (0, near, roll), (0, far, roll), (0, far, pitch)]
    items = read(tmp_path, made.packet(7, 0x38, made.words_429(words), 0), shipped("arinc429_inertial"))
    (batch,) = [item for item in items if isinstance(item, RecordBatch) and item.topic == "ins"]
    assert batch.columns["pitch_deg"].mask.tolist() == [True, True, False, True]
    assert batch.columns["roll_deg"].mask.tolist() == [True, True, True, False]
    np.testing.assert_allclose(batch.device_time_ns.values / 1e9, [0.0, 8e-4, 0.0212, 0.0412], atol=1e-12)


def canonical(path: Path) -> dict[str, tuple[list[float], list[int]]]:
    """Values and times of every signal of a store file."""
    found: dict[str, tuple[list[float], list[int]]] = {}
    for item in read_store(path):
        if isinstance(item, RecordBatch) and not item.topic.startswith("raw."):
            assert item.time_ns is not None
            for name, column in item.columns.items():
                values, times = found.setdefault(f"{item.topic}.{name}", ([], []))
                values += column.values[column.mask].tolist()
                times += item.time_ns[column.mask].tolist()
    return found


def test_an_icd_applied_to_the_mcap_gives_what_it_gives_of_the_log(tmp_path: Path) -> None:
    icd = str(icd_file(tmp_path))
    log = tmp_path / "flight.ch10"
    packets = [made.packet(1, 0x11, made.time_of_day(0, 3600, year=2020, month=2, day_of_month=3), COUNTS_PER_S)]
    for number in range(30):
        messages = [message(at, at, at - 300) for at in range(number * 20, number * 20 + 20)]
        packets.append(made.packet(4, 0x19, made.messages_1553(messages), number * 20_000, sequence=number))
    log.write_bytes(b"".join(packets))
    plain, named, again, other = (tmp_path / f"{name}.mcap" for name in ("plain", "named", "again", "other"))
    assert not convert_log(open_log(log), plain).has_lost_data
    convert_log(open_log(log, icds=(icd,)), named)
    convert_log(open_log(plain, icds=(icd,)), again)
    assert canonical(plain) == {} and len(canonical(named)["ins.roll_deg"][0]) == 600
    assert canonical(again) == canonical(named)
    convert_log(open_log(named, icds=("b100",)), other)
    assert canonical(other) == {}, "signals that the other ICD gave are gone"
    before, after = catalogue(plain), catalogue(plain, icds=(icd,))
    assert before[0]["kind"] == "note" and "--icd FILE names them" in before[0]["title"]
    assert all(one["kind"] == "analysis" for one in after)
    assert any("without ICD: --icd FILE names them" in one.text for one in describe(plain).findings)
    told = describe(plain, icds=(icd,))
    assert not any("without ICD" in one.text for one in told.findings)
    assert [(one.place, one.what, one.names) for one in told.buses] == [("4", "RT 6 T SA 29", ("ATTITUDE",))]


def medians(items: list[Item], topic: str) -> dict[str, float]:
    return {name: float(np.median(values)) for name, values in rows(items, topic).items()}


@pytest.mark.real_log
def test_two_inertial_units_of_a_parked_aircraft() -> None:
    """Free inertial is 105 and 73 m from the blended position; the headings of 1553 and ARINC 429 agree."""
    log = real_log("ch10/kc135_429_1553_1MB.c10")
    icds = [load(real_log(f"ch10/icd/example_{name}.yaml")) for name in ("1553_egi", "429_nav")]
    items = list(registry.read(log, icds=icds))
    inertial, blended, inertial_2, blended_2 = (medians(items, f"ins.{unit}") for unit in (2, 3, 4, 5))
    for one, other, metres in ((inertial, blended, 105.0), (inertial_2, blended_2, 73.0)):
        north, east = north_east_m(
            one["latitude_deg"], one["longitude_deg"], other["latitude_deg"], other["longitude_deg"]
        )
        assert np.hypot(north, east) == pytest.approx(metres, abs=1.0)
    assert inertial["latitude_deg"] == pytest.approx(34.919474, abs=5e-7)
    assert inertial["longitude_deg"] == pytest.approx(-117.885779, abs=5e-7)
    assert inertial["true_heading_deg"] == pytest.approx(360 - 120.762, abs=5e-4)
    assert blended_2["true_heading_deg"] == pytest.approx(360 - 120.361, abs=5e-4)
    assert inertial["altitude_msl_m"] == pytest.approx(1984 * 0.3048) and blended["altitude_msl_m"] == pytest.approx(
        2320 * 0.3048
    )
    attitude = [item for item in items if isinstance(item, RecordBatch) and item.topic == "ins.1"]
    told = {
        name: np.concatenate([b.columns[name].values[b.columns[name].mask] for b in attitude])
        for name in attitude[0].columns
    }
    assert len(told["true_heading_deg"]) == 21
    for name, value in (("true_heading_deg", 239.238), ("magnetic_heading_deg", 226.582), ("pitch_deg", -0.253)):
        assert np.median(told[name]) == pytest.approx(value, abs=1e-3)


@pytest.mark.real_log
def test_a_label_means_something_only_on_its_bus() -> None:
    """311 of other equipment is no longitude; the position of both units is, where the ICD names their buses."""
    log = real_log("ch10/kc135_429_1553_1MB.c10")
    items = list(registry.read(log, icds=[shipped("arinc429_inertial")]))
    positions = {}
    for item in items:
        if isinstance(item, RecordBatch) and "latitude_deg" in item.columns:
            column = item.columns["latitude_deg"]
            positions[item.topic] = float(column.values[column.mask][0])
    assert len(positions) == 7 and all(value == pytest.approx(34.9195, abs=1e-4) for value in positions.values())
    alone = {
        item.topic
        for item in items
        if isinstance(item, RecordBatch)
        and set(item.columns) == {"longitude_deg"}
        and item.columns["longitude_deg"].mask.all()
    }
    assert len(alone - positions.keys()) == 2, "two buses of other equipment, each a unit of its own"


@pytest.mark.real_log
def test_an_egi_at_25_hz() -> None:
    log = real_log("ch10/iliad_1553.c10")
    items = list(registry.read(log, icds=[load(real_log("ch10/icd/example_1553_egi.yaml"))]))
    for unit, (samples, heading, altitude_ft) in {
        1: (51, 105.19, 2456),
        2: (54, 105.18, 2416),
        3: (54, 105.205, 2348),
    }.items():
        found = rows(items, f"ins.{unit}")
        assert len(found["time_s"]) == samples
        assert np.median(found["true_heading_deg"]) == pytest.approx(heading, abs=0.01)
        assert np.median(found["altitude_msl_m"]) == pytest.approx(altitude_ft * 0.3048)
        steps = np.diff(found["time_s"])
        assert steps.min() > 0.036 and np.median(steps) == pytest.approx(0.04, abs=0.003)
    errors = sum(int(text.split(": ")[1].split()[0]) for text in texts(items, "bus_errors"))
    assert errors == 992 + 213


def test_a_suggested_icd_is_read_back_and_names_all(tmp_path: Path) -> None:
    packets = made.packet(4, 0x19, made.messages_1553([message(at, at, at) for at in range(9)]), 0)
    words = [(0, 1_000, made.word_429(0o314, at)) for at in range(9)]
    log = tmp_path / "log.ch10"
    log.write_bytes(packets + made.packet(7, 0x38, made.words_429(words), 0))
    suggested = tmp_path / "suggested.yaml"
    suggested.write_text(suggest_icd(log))
    told = describe(log, icds=(str(suggested),))
    assert [one.what for one in told.buses] == ["RT 6 T SA 29", "label 314"]
    assert all(len(one.names) == 1 for one in told.buses)
    with pytest.raises(UsageError, match="no words"):
        table = tmp_path / "flat.csv"
        table.write_text("time_s,ins.roll_deg\n0,1\n1,2\n")
        suggest_icd(table)
