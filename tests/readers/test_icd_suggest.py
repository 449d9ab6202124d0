"""The start of an ICD that is written from what is on the buses: known equipment is found, nothing else is named."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest

from groundstation.readers import registry
from groundstation.readers.chapter10.contents import BusContents, OnBus
from groundstation.readers.icd import Icd, encode_429, encode_1553, load, shipped, suggest, word_values
from tests.real_logs import real_log

RNG = np.random.default_rng(8)


@dataclass(frozen=True)
class Entry:
    """What is on a bus, made by hand."""

    channel: int
    sub_channel: int | None
    bus: str
    key: int
    sample: np.ndarray
    rate_hz: float = 25.0


def read_back(tmp_path: Path, *entries: Entry | OnBus) -> Icd:
    path = tmp_path / "suggested.yaml"
    path.write_text(suggest(entries), encoding="utf-8")
    found = load(path)
    assert found.notes == ()
    return found


def signals(found: Icd) -> set[str]:
    return {element.signal for _holder, element in found.elements() if element.signal}


def label(name: str, value: float, icd: str = "arinc429_inertial", sub_channel: int = 1) -> Entry:
    word = next(word for word in shipped(icd).words_429 if word.name == name)
    values = np.full(20, value)
    return Entry(40, sub_channel, "B", word.label, encode_429(word, {name: values}))


def message(layout: str, command: int, **values: float) -> Entry:
    """Messages of a shipped layout as recorded: command, status, data."""
    (known,) = shipped(layout).messages_1553
    elements = {element.name: element for element in known.elements}
    given = {name: word_values(value + RNG.normal(0.0, 1e-6, 20), elements[name]) for name, value in values.items()}
    data = encode_1553(known, given)
    heads = np.tile(np.array([command, command & 0xF800], dtype=np.uint16), (20, 1))
    return Entry(10, None, "NAV", command, np.hstack([heads, data, np.zeros((20, 2), dtype=np.uint16)]))


INERTIAL = [label("true_heading", 120.0), label("pitch", 1.0), label("latitude", 50.0), label("longitude", 30.0)]
SENT, RECEIVED = 9 << 11 | 0x400 | 3 << 5, 9 << 11 | 3 << 5


def test_an_inertial_reference_is_known_by_what_it_sends_together(tmp_path: Path) -> None:
    found = read_back(tmp_path, *INERTIAL)
    assert signals(found) == {"ins.true_heading_deg", "ins.pitch_deg", "ins.latitude_deg", "ins.longitude_deg"}
    word = found.words_429[0]
    assert (word.bus, word.channel, word.subchannel, word.label) == ("B", 40, 1, 0o314)
    assert word.elements[0].description == "119.99817, SSM 3"


def test_a_label_alone_is_a_count(tmp_path: Path) -> None:
    found = read_back(tmp_path, label("latitude", 50.0), label("true_heading", 120.0))
    assert signals(found) == set()
    assert [word.name for word in found.words_429] == ["label_310_ch40_1", "label_314_ch40_1"]


def test_a_latitude_without_its_longitude_is_a_count(tmp_path: Path) -> None:
    assert signals(read_back(tmp_path, *INERTIAL[:3])) == {"ins.true_heading_deg", "ins.pitch_deg"}


def test_a_receiver_that_stands_at_zero_is_none(tmp_path: Path) -> None:
    entries = [label(name, 0.0, "arinc429_gnss") for name in ("latitude", "longitude", "ground_speed")]
    assert signals(read_back(tmp_path, *entries)) == set()


@pytest.mark.parametrize(("seen_g", "factor_mps2"), [(-1.0, 9.80665), (1.0, -9.80665), (0.0, -9.80665)])
def test_a_normal_acceleration_has_the_sign_that_one_g_gives_it(
    tmp_path: Path, seen_g: float, factor_mps2: float
) -> None:
    """One unit of a real aircraft sent -1 g at rest and another +1 g: both were drafted with sign -1."""
    found = read_back(tmp_path, *INERTIAL, label("normal_acceleration", seen_g))
    (element,) = (one for _, one in found.elements() if one.signal == "ins.accel_z_mps2")
    assert element.factor == pytest.approx(factor_mps2), "specific force down at rest is -1 g"


def test_two_buses_are_two_units(tmp_path: Path) -> None:
    found = read_back(
        tmp_path, *INERTIAL, label("true_heading", 121.0, sub_channel=2), label("roll", 2.0, sub_channel=2)
    )
    assert {"ins.1.true_heading_deg", "ins.2.true_heading_deg", "ins.2.roll_deg"} <= signals(found)


@pytest.mark.parametrize(
    ("layout", "values"),
    [
        ("b100", {"latitude": 50.0, "longitude": 30.0, "true_heading": 77.0}),
        ("egi", {"cxx": 0.6, "cxy": 0.0, "cxz": np.rad2deg(np.arcsin(0.8)), "longitude": 30.0, "roll": 1.0}),
        ("f15_ins", {"latitude": 50.0, "longitude": 30.0, "velocity_north": 60.0, "ground_speed": 60.0, "roll": 1.0}),
    ],
)
def test_a_public_layout_is_known_by_how_its_words_hold_together(
    tmp_path: Path, layout: str, values: dict[str, float]
) -> None:
    found = read_back(tmp_path, message(layout, SENT, **values))
    (known,) = found.messages_1553
    assert (known.transmit, known.bus, known.channel, known.word_count) == (SENT, "NAV", 10, 32)
    expected = {element.signal for _holder, element in shipped(layout).elements() if element.signal}
    assert signals(found) == expected
    assert signals(read_back(tmp_path, message(layout, RECEIVED, **values))) == set()  # it tells of what another sends


def test_b100_without_a_position_is_known_by_its_flags(tmp_path: Path) -> None:
    """Flags are set with the values that they are of: without roll and pitch the attitude is not valid."""
    flown = {"velocity_north": 60.0, "roll": 1.0, "true_heading": 77.0}
    assert "ins.true_heading_deg" in signals(read_back(tmp_path, message("b100", SENT, **flown)))
    for left_out in flown:
        rest = {name: value for name, value in flown.items() if name != left_out}
        assert signals(read_back(tmp_path, message("b100", SENT, **rest))) == set(), left_out
    assert signals(read_back(tmp_path, message("b100", SENT, **flown, position_valid=1.0))) == set()


def test_a_position_at_the_date_line_is_one(tmp_path: Path) -> None:
    """Noise of rounding lies on both sides of 180 deg."""
    here = {"latitude": 50.0, "longitude": 180.0, "true_heading": 77.0}
    data = message("b100", SENT, **here)
    assert "ins.longitude_deg" in signals(read_back(tmp_path, data))
    far = replace(data, sample=np.vstack([data.sample, message("b100", SENT, **here | {"longitude": 177.0}).sample]))
    assert "ins.longitude_deg" not in signals(read_back(tmp_path, far)), "it jumps"


def test_a_message_between_terminals_is_named_once(tmp_path: Path) -> None:
    data = RNG.integers(0, 1 << 16, (20, 4), dtype=np.uint16)
    heads = np.tile(np.array([RECEIVED | 4, SENT | 4, 9 << 11], dtype=np.uint16), (20, 1))
    sample = np.hstack([heads, data, np.zeros((20, 4), dtype=np.uint16)])
    entries = [Entry(10, None, "", RECEIVED | 4, sample), Entry(10, None, "", SENT | 4, sample)]
    (found,) = read_back(tmp_path, *entries).messages_1553
    assert (found.transmit, found.word_count) == (SENT | 4, 4)
    assert [element.name for element in found.elements] == ["word_01", "word_02", "word_03", "word_04"]
    assert found.elements[1].description == f"{data[:, 1].view(np.int16).min()} to {data[:, 1].view(np.int16).max()}"


def test_mode_codes_and_constant_words_are_left_out(tmp_path: Path) -> None:
    sample = np.full((20, 36), 7, dtype=np.uint16)
    entries = [Entry(10, None, "", 9 << 11 | 0x400 | 2, sample), Entry(10, None, "", SENT | 2, sample)]
    (found,) = read_back(tmp_path, *entries).messages_1553
    assert found.elements == ()


def on_the_buses(log: Path) -> tuple[OnBus, ...]:
    contents = BusContents()
    for item in registry.read(log):
        contents.add(item)
    return contents.entries()


@pytest.mark.real_log
def test_the_inertial_systems_of_a_parked_tanker_are_found(tmp_path: Path) -> None:
    """Four solutions of two systems on 1553, among 475 messages; values as the other bus has them."""
    found = read_back(tmp_path, *on_the_buses(real_log("ch10/kc135_429_1553_1MB.c10")))
    known = {message.name: message for message in found.messages_1553 if message.name.startswith("egi")}
    assert {(message.channel, message.transmit >> 5 & 31) for message in known.values()} == {
        *((4, 29), (4, 17), (5, 29), (5, 17)),
    }
    headings = {
        (word.channel, word.subchannel): word.elements[0].description
        for word in found.words_429
        if word.label == 0o314 and word.elements[0].signal
    }
    signs = [np.sign(one.factor) for _, one in found.elements() if (one.signal or "").endswith("accel_z_mps2")]
    assert signs == [1.0, 1.0, -1.0, -1.0], "-1 g on two buses and +1 g on two"
    assert headings[6, 5].startswith("-120.76")
    assert headings[6, 6].startswith("-120.36")
    assert not [signal for signal in signals(found) if signal.startswith("gnss")]


@pytest.mark.real_log
def test_the_inertial_systems_of_a_third_aircraft_are_found(tmp_path: Path) -> None:
    found = read_back(tmp_path, *on_the_buses(real_log("ch10/iliad_1553.c10")))
    known = {(one.bus, one.transmit >> 11) for one in found.messages_1553 if any(part.signal for part in one.elements)}
    assert known == {("M1", 15), ("M2", 15), ("M2", 9)}
