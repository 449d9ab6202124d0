"""ICDs: what is read, what is refused and how, words to values and back."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from groundstation.base.errors import SettingsError
from groundstation.readers.icd import (
    Element429,
    Element1553,
    Icd,
    Message1553,
    Word429,
    decode_429,
    decode_1553,
    encode_429,
    encode_1553,
    has_odd_parity,
    labels_of,
    load,
    named_icd,
    numbered,
    shipped,
    shipped_names,
    signal_values,
    status_of,
    to_yaml,
    usable_1553,
    word_values,
)
from groundstation.readers.icd.model import Element
from groundstation.readers.icd.signals import by_name
from groundstation.readers.icd.yaml_text import parse_yaml
from tests.real_logs import real_log

MESSAGE = """\
translatable_message_definitions:
  NAV:
    msg_data: {command: [14240, 0], lru_addr: [6, 0], lru_subaddr: [29, 0], lru_name: [nav, none], bus: "B",
               wrdcnt: 32, rate: 25.0, mode_code: False, desc: ""}
    word_elem:
      latitude: {offset: 20, cnt: 2, schema: SIGNED32, msbval: 90.0, desc: "", uom: "deg", multifmt: False, class: 0}
    bit_elem:
      ok: {offset: 0, cnt: 1, schema: UNSIGNEDBITS, msbval: 1.0, uom: "", msb: 10, lsb: 10, bitcnt: 1}
supplemental_bus_map_command_words: {}
"""
WORD = """\
translatable_word_definitions:
  height:
    wrd_data: {label: 076, bus: 'GPS-1', sdi: -1, rate: 1.0, desc: '', lru_name: ''}
    elem:
      altitude: {schema: 'SIGNEDBITS', msbval: 65536.0, lsb: 9, bitcnt: 21, desc: '', uom: 'ft', class: 0}
supplemental_bus_map_labels: {}
"""


def icd(tmp_path: Path, text: str) -> Icd:
    path = tmp_path / "x.yaml"
    path.write_text(text, encoding="utf-8")
    return load(path)


def uint16(*words: int) -> np.ndarray:
    return np.array([words], dtype=np.uint16)


def test_a_message_as_it_is_written(tmp_path: Path) -> None:
    (message,) = icd(tmp_path, MESSAGE).messages_1553
    latitude = message.elements[0]
    assert (message.name, message.transmit, message.bus, message.word_count) == ("NAV", 0x37A0, "B", 32)
    assert (latitude.offset, latitude.count, latitude.signal, latitude.is_by_name) == (20, 2, "ins.latitude_deg", True)
    assert message.is_on("B", 7)
    assert not message.is_on("C", 7)
    commands = np.array([0x37A0, 0x37A1, 0x0000], dtype=np.uint16)
    assert message.takes(commands).tolist() == [True, False, False]
    assert message.takes(commands, np.array([0, 0, 0x37A0], dtype=np.uint16)).tolist() == [True, False, True]


def test_off_is_read_as_offset(tmp_path: Path) -> None:
    older = MESSAGE.replace("offset:", "off:")
    assert icd(tmp_path, older) == icd(tmp_path, MESSAGE)


def test_a_label_is_octal_with_or_without_its_zero(tmp_path: Path) -> None:
    (word,) = icd(tmp_path, WORD).words_429
    assert word.label == 0o76
    assert icd(tmp_path, WORD.replace("076", "76")).words_429 == (word,)
    assert word.elements[0].signal == "ins.altitude_msl_m"  # no name says GNSS: the bus is not asked


def test_a_gnss_name_makes_it_gnss(tmp_path: Path) -> None:
    (word,) = icd(tmp_path, WORD.replace("height:", "gps_height:")).words_429
    assert word.elements[0].signal == "gnss.altitude_msl_m"


def test_a_count_is_no_angle(tmp_path: Path) -> None:
    """A most significant bit of no value: the unit says nothing of the counts, which stay raw."""
    counts = MESSAGE.replace("msbval: 90.0", "msbval: 0.0")
    assert icd(tmp_path, counts).messages_1553[0].elements[0].signal is None
    with pytest.raises(SettingsError, match="found 0, a count"):
        icd(tmp_path, counts.replace('uom: "deg"', 'uom: "deg", signal: ins.latitude_deg'))
    numbers = counts.replace("SIGNED32", "FLOAT32_IEEE")
    assert icd(tmp_path, numbers).messages_1553[0].elements[0].signal == "ins.latitude_deg"


def test_unknown_keys_are_told(tmp_path: Path) -> None:
    found = icd(tmp_path, MESSAGE.replace('uom: "deg"', 'uom: "deg", signl: x'))
    assert found.notes == ("x.yaml: key 'signl' is not known, 1 times",)


REFUSED: Mapping[str, tuple[str, str, str]] = {
    "no offset": ("offset: 20, ", "", "NAV, latitude: offset"),
    "outside the message": ("offset: 20", "offset: 31", "words 31 to 32"),
    "unknown schema": ("SIGNED32", "SIGNED33", "SIGNED33"),
    "words of a schema": ("SIGNED32", "SIGNED16", "expected 1 for SIGNED16"),
    "no number": ("msbval: 90.0", "msbval: many", "NAV, latitude: msbval"),
    "negative": ("msbval: 90.0", "msbval: -90", "NAV, latitude: msbval"),
    "no word count": ("wrdcnt: 32", "wrdcnt: 0", "NAV: wrdcnt"),
    "count against command": ("wrdcnt: 32", "wrdcnt: 30", "the command word 14240 says"),
    "terminal against command": ("lru_addr: [6, 0]", "lru_addr: [7, 0]", "terminal 6 subaddress 29"),
    "sides changed": (
        "command: [14240, 0], lru_addr: [6, 0], lru_subaddr: [29, 0]",
        "command: [0, 14240], lru_addr: [0, 6], lru_subaddr: [0, 29]",
        "[transmit, receive]",
    ),
    "no command": ("command: [14240, 0]", "command: [0, 0]", "no command word"),
    "bit count": ("bitcnt: 1", "bitcnt: 2", "NAV, ok: bitcnt"),
    "bits upside down": ("msb: 10, lsb: 10", "msb: 12, lsb: 10", "NAV, ok: lsb"),
    "signal": ('uom: "deg"', 'uom: "deg", signal: ins.latitude', "NAV, latitude: signal"),
    "unit of a signal": ('uom: "deg"', 'uom: "kt", signal: ins.latitude_deg', "NAV, latitude: uom"),
    "truth": ('uom: "deg"', 'uom: "deg", signal: truth.latitude_deg', "NAV, latitude: signal"),
    "validity": ('uom: "deg"', 'uom: "deg", valid_if: not_there', "NAV, latitude: valid_if"),
    "validity of several bits": (
        'uom: "deg", multifmt: False, class: 0}\n    bit_elem:\n      ok: {offset: 0, cnt: 1, schema: UNSIGNEDBITS,'
        ' msbval: 1.0, uom: "", msb: 10, lsb: 10, bitcnt: 1}',
        'uom: "deg", valid_if: ok}\n    bit_elem:\n      ok: {offset: 0, cnt: 1, schema: UNSIGNEDBITS,'
        ' msbval: 1.0, uom: "", msb: 9, lsb: 10, bitcnt: 2}',
        "an element of the message of one bit",
    ),
    "key twice": ("wrdcnt: 32,", "wrdcnt: 32, wrdcnt: 32,", "'wrdcnt' twice"),
}


@pytest.mark.parametrize("slip", REFUSED)
def test_a_slip_names_the_word_and_the_key(tmp_path: Path, slip: str) -> None:
    before, after, told = REFUSED[slip]
    assert before in MESSAGE
    with pytest.raises(SettingsError) as caught:
        icd(tmp_path, MESSAGE.replace(before, after))
    assert told in str(caught.value)
    assert "x.yaml" in str(caught.value)
    assert "\n" not in str(caught.value)


REFUSED_429 = {
    "label": ("label: 076", "label: 378", "height: label"),
    "above 377": ("label: 076", "label: 400", "height: label"),
    "over the sign/status matrix": ("bitcnt: 21", "bitcnt: 24", "height, altitude: bitcnt"),
    "data over the SDI": ("sdi: -1", "sdi: 2", "bits 9 and 10"),
    "sdi": ("sdi: -1", "sdi: 4", "height: sdi"),
    "no elements": ("elem:", "element:", "height: elem"),
}


@pytest.mark.parametrize("slip", REFUSED_429)
def test_a_slip_in_a_429_word_names_it(tmp_path: Path, slip: str) -> None:
    before, after, told = REFUSED_429[slip]
    assert before in WORD
    with pytest.raises(SettingsError, match=r"x\.yaml") as caught:
        icd(tmp_path, WORD.replace(before, after))
    assert told in str(caught.value)


BOMB = "a: &a [x, x, x, x, x, x, x, x, x]\n" + "".join(
    f"{name}: &{name} [{', '.join([f'*{before}'] * 9)}]\n"
    for before, name in zip("abcdefghi", "bcdefghij", strict=True)
)
HOSTILE = {
    "empty": "",
    "a list": "- 1\n- 2\n",
    "a text": "hello",
    "nothing defined": "a: 1\n",
    "definitions are a list": "translatable_message_definitions: [1, 2]\n",
    "no YAML": "a: [1\nb: }{",
    "deep": "a: " + "[" * 5000 + "]" * 5000,
    "bomb": BOMB,
    "itself": "a: &a [*a]\n",
    "two documents": "a: 1\n---\nb: 2\n",
    "an object": "a: !!python/object/apply:os.system ['echo']\n",
    "list as key": "[1, 2]: 3\n",
    "control characters": "a: \x07\n",
}


@pytest.mark.parametrize("kind", HOSTILE)
def test_hostile_yaml_is_one_line(tmp_path: Path, kind: str) -> None:
    with pytest.raises(SettingsError) as caught:
        icd(tmp_path, HOSTILE[kind])
    assert "\n" not in str(caught.value)
    assert len(str(caught.value)) < 500


def test_no_yaml_file_at_all(tmp_path: Path) -> None:
    (tmp_path / "x.yaml").write_bytes(b"\xff\xfe\x00\x00" * 9)
    with pytest.raises(SettingsError, match="UTF-8"):
        load(tmp_path / "x.yaml")
    with pytest.raises(SettingsError, match="no such file"):
        load(tmp_path / "y.yaml")


def test_aliases_and_anchors_are_values() -> None:
    assert parse_yaml("a: &x {b: 1}\nc: *x\n", "x") == {"a": {"b": "1"}, "c": {"b": "1"}}


# ---- words of ARINC 429

LATITUDE_WORD = 0x631A9D13  # label 310 as a recorder wrote it


def element(schema: str, msbval: float = 0.0, **more: object) -> Element429:
    return Element429("x", schema, msbval, **more)  # type: ignore[arg-type]


def test_status_and_parity_decide_what_may_be_used() -> None:
    latitude = element("SIGNEDBITS", 90.0, lsb=9, bit_count=21)
    failed = LATITUDE_WORD & ~(3 << 29)
    words = np.array([LATITUDE_WORD, LATITUDE_WORD ^ 1 << 31, failed, failed | 1 << 29, failed | 2 << 29])
    words = np.where(has_odd_parity(words.astype(np.uint32)), words, words ^ (1 << 31)).astype(np.uint32)
    words[1] = LATITUDE_WORD ^ 1 << 31  # of even parity
    values, usable = decode_429(words, latitude)
    assert labels_of(words).tolist() == [0o310] * 5
    assert status_of(words).tolist() == [3, 3, 0, 1, 2]
    assert usable.tolist() == [True, False, False, False, False]
    assert values[0] == pytest.approx(34.919491, abs=1e-4)  # as its 1553 bus says
    assert decode_429(words, replace(latitude, status="none"))[1].tolist() == [True, False, True, True, True]


def test_a_word_is_taken_by_label_and_sdi() -> None:
    words = np.array([LATITUDE_WORD, LATITUDE_WORD ^ 0x300, LATITUDE_WORD ^ 1], dtype=np.uint32)
    assert Word429("latitude", 0o310).takes(words).tolist() == [True, True, False]
    assert Word429("latitude", 0o310, sdi=1).takes(words).tolist() == [True, False, False]


BITS_429 = {
    "signed": (element("SIGNEDBITS", 64.0, lsb=16, bit_count=14), 64.0 / 2**12, -128.0, 127.9),
    "unsigned": (element("UNSIGNEDBITS", 64.0, lsb=18, bit_count=11), 64.0 / 2**10, 0.0, 127.9),
    "sign and magnitude": (element("SIGNMAG", 64.0, lsb=16, bit_count=14), 64.0 / 2**12, -127.9, 127.9),
    "digits": (element("BCD", lsb=11, bit_count=19, status="bcd", step=0.1), 0.1, -7999.9, 7999.9),
    "count": (element("UNSIGNEDBITS", 0.0, lsb=11, bit_count=4, status="discrete"), 1.0, 0.0, 15.0),
}


@pytest.mark.parametrize("kind", BITS_429)
def test_a_429_value_comes_back_within_half_a_step(kind: str) -> None:
    one, step, low, high = BITS_429[kind]
    word = Word429("w", 0o123, elements=(one,))
    given = np.append(np.random.default_rng(3).uniform(low, high, 500), [low, high, 0.0])
    words = encode_429(word, {"x": given})
    values, usable = decode_429(words, one)
    assert usable.all()
    assert word.takes(words).all()
    assert np.abs(values - given).max() <= step / 2 + 1e-9 * abs(high) + (step / 2 if kind != "digits" else 0.0)
    inner = slice(0, 500)
    assert np.abs(values[inner] - given[inner]).max() <= step / 2 * (1 + 1e-9) + 1e-9


def test_a_missing_value_has_no_computed_data() -> None:
    word = shipped("arinc429_inertial").words_429[4]
    words = encode_429(word, {word.elements[0].name: np.array([10.0, np.nan])})
    assert status_of(words).tolist() == [3, 1]
    assert decode_429(words, word.elements[0])[1].tolist() == [True, False]


def test_an_angle_goes_on_and_a_speed_saturates() -> None:
    words = {word.name: word for word in shipped("arinc429_inertial").words_429}
    heading, speed = words["true_heading"], words["velocity_north"]
    turned = decode_429(encode_429(heading, {"true_heading": np.array([350.0, 180.0])}), heading.elements[0])[0]
    assert turned == pytest.approx([-10.0, -180.0], abs=0.003)
    fast = decode_429(encode_429(speed, {"velocity_north": np.array([1e6, -1e6])}), speed.elements[0])[0]
    assert fast == pytest.approx([4096.0, -4096.0], abs=0.126)


def test_a_digit_above_nine_is_not_usable() -> None:
    date = next(word for word in shipped("arinc429_gnss").words_429 if word.name == "date")
    words = encode_429(date, {"day": np.array([9.0]), "month": np.array([12.0]), "year": np.array([11.0])})
    assert [int(decode_429(words, one)[0][0]) for one in date.elements] == [9, 12, 11]
    assert int(words[0]) == 0x04C8440D | (0 if has_odd_parity(np.array([0x04C8440D], dtype=np.uint32))[0] else 1 << 31)
    assert decode_429(words | np.uint32(0xF << 24), date.elements[0])[1].tolist() == [False]


def test_coarse_and_fine_make_a_position() -> None:
    words = {word.name: word for word in shipped("arinc429_gnss").words_429}
    coarse, fine = words["latitude"].elements[0], words["latitude_fine"].elements[0]
    step_deg = 180.0 / 2**20
    given = np.array([-35.123456789, 48.000000001])
    high = np.floor(given / step_deg) * step_deg
    found = decode_429(encode_429(words["latitude"], {"latitude": high}), coarse)[0]
    found = found + decode_429(encode_429(words["latitude_fine"], {"latitude_fine": given - high}), fine)[0]
    assert fine.fine_of == "latitude"
    assert np.abs(found - given).max() <= 180.0 / 2**31


# ---- words of MIL-STD-1553

WORDS_1553 = {
    "SIGNED16": (1, 90.0, 180 / 2**15, -180, 179.99),
    "SIGNED32": (2, 4096.0, 2**-18, -8192, 8191.9),
    "UNSIGNED16": (1, 32768.0, 1.0, 0, 65535),
    "UNSIGNED32": (2, 2.0**31, 1.0, 0, 2**32 - 1),
}
FLOATS_1553 = {  # words, relative step
    "FLOAT32_1750": (2, 2.0**-22),
    "FLOAT32_IEEE": (2, 2.0**-23),
    "FLOAT64_IEEE": (4, 0.0),
    "FLOAT32_GPS": (2, 2.0**-23),
    "FLOAT64_GPS": (4, 2.0**-52),
    "CAPS": (3, 2.0**-39),
}


def there_and_back(one: Element1553, given: np.ndarray) -> np.ndarray:
    message = Message1553("m", 0x37A0, 0, elements=(one,))
    return decode_1553(encode_1553(message, {one.name: given}), one)


@pytest.mark.parametrize("schema", WORDS_1553)
def test_whole_numbers_come_back_within_half_a_step(schema: str) -> None:
    count, msbval, step, low, high = WORDS_1553[schema]
    one = Element1553("x", schema, msbval, offset=3, count=count)
    given = np.append(np.random.default_rng(4).uniform(low, high, 500), [low, high])
    assert np.abs(there_and_back(one, given) - given).max() <= step * 0.500001


@pytest.mark.parametrize("schema", FLOATS_1553)
def test_floating_point_comes_back_within_its_last_bit(schema: str) -> None:
    count, step = FLOATS_1553[schema]
    rng = np.random.default_rng(5)
    given = rng.normal(size=500) * 10.0 ** rng.uniform(-20, 20, 500)
    given = np.append(given, [0.0, 1.0, -1.0, 0.5, -0.5, 1 - 2.0**-30])
    found = there_and_back(Element1553("x", schema, 0.0, offset=1, count=count), given)
    assert np.abs(found - given).max() <= np.abs(given).max() * step
    assert np.abs(found / np.where(given == 0.0, 1.0, given) - (given != 0.0)).max() <= step


def test_sixteen_bit_floating_point() -> None:
    one = Element1553("x", "FLOAT16", 0.0)
    given = np.array([0.0, 1.0, -2047.0, 16.0 * 2000, 16.0**3 * -1500])
    assert there_and_back(one, given).tolist() == given.tolist()


# Worked examples by the standards: MIL-STD-1750A, IEEE 754, IS-GPS-059.
EXAMPLES = {
    ("FLOAT32_1750", (0x4000, 0x0000)): 0.5,
    ("FLOAT32_1750", (0x7FFF, 0xFF7F)): (1 - 2.0**-23) * 2.0**127,
    ("FLOAT32_1750", (0x4000, 0x007F)): 0.5 * 2.0**127,
    ("FLOAT32_1750", (0x5000, 0x0005)): 0.625 * 2.0**5,
    ("FLOAT32_1750", (0x8000, 0x0000)): -1.0,
    ("FLOAT32_1750", (0xA000, 0x0002)): -0.75 * 2.0**2,
    ("FLOAT32_1750", (0x4000, 0x0080)): 0.5 * 2.0**-128,
    ("FLOAT32_IEEE", (0xC0A0, 0x0000)): -5.0,
    ("FLOAT64_IEEE", (0x4009, 0x21FB, 0x5444, 0x2D18)): np.pi,
    ("FLOAT32_GPS", (0x4080, 0x0000)): 1.0,  # exponent 129, fraction 0: 2 x 1/2
    ("FLOAT32_GPS", (0xC0C0, 0x0000)): -1.5,
    ("FLOAT64_GPS", (0x4040, 0x0000, 0x0000, 0x0000)): 0.75,
    ("CAPS", (0x0081, 0x0000, 0x4000)): 1.5,  # exponent in the low byte of the first word, sign in the last
    ("CAPS", (0x0081, 0x0000, 0xC000)): -1.5,
    ("FLOAT16", (0xFFF2,)): -2047.0 * 256.0,
    ("SIGNED16", (0x8000,)): -32768.0,
    ("UNSIGNED32", (0x0001, 0x0002)): 65538.0,
}


@pytest.mark.parametrize(("schema", "words"), EXAMPLES)
def test_worked_examples(schema: str, words: tuple[int, ...]) -> None:
    one = Element1553("x", schema, 0.0, count=len(words))
    assert decode_1553(uint16(*words), one)[0] == EXAMPLES[schema, words]
    assert encode_1553(Message1553("m", 1, 0, word_count=len(words), elements=(one,)), {
        "x": np.array([EXAMPLES[schema, words]])
    }).tolist() == [list(words)]  # fmt: skip


def test_undefined_numbers_are_nan() -> None:
    assert np.isnan(decode_1553(uint16(0x8000, 0x1234), Element1553("x", "FLOAT32_GPS", 0.0, count=2))[0])


def test_bits_count_from_the_most_significant() -> None:
    data = uint16(0b0000_0000_0110_0000, 0xF000)
    assert decode_1553(data, Element1553("x", "UNSIGNEDBITS", 1.0, msb=10, lsb=10))[0] == 1.0
    assert decode_1553(data, Element1553("x", "UNSIGNEDBITS", 0.0, msb=10, lsb=12))[0] == 6.0
    assert decode_1553(data, Element1553("x", "SIGNEDBITS", 0.0, msb=10, lsb=12))[0] == -2.0
    over = Element1553("x", "SIGNEDBITS", 0.0, count=2, msb=12, lsb=5)  # 00000 11110
    assert decode_1553(data, over)[0] == 30.0
    assert there_and_back(over, np.array([-30.0]))[0] == -30.0


def test_the_latitude_of_an_egi_is_the_arc_sine() -> None:
    (message,) = shipped("egi").messages_1553
    cxz = next(one for one in message.elements if one.name == "cxz")
    given = np.array([34.919474, -89.9, 0.0])
    data = encode_1553(message, {"cxz": word_values(given, cxz)})
    assert signal_values(decode_1553(data, cxz), cxz) == pytest.approx(given, abs=2e-5)
    assert np.isnan(signal_values(np.array([1.5]), cxz)[0])


def test_a_message_tells_what_is_valid() -> None:
    (message,) = shipped("b100").messages_1553
    latitude, heading = (
        next(one for one in message.elements if one.name == name) for name in ("latitude", "true_heading")
    )
    data = encode_1553(message, {"latitude": np.array([1.0, np.nan]), "true_heading": np.array([350.0, 20.0])})
    assert usable_1553(data, latitude).tolist() == [True, False]
    assert usable_1553(data, heading).tolist() == [True, True]
    assert signal_values(decode_1553(data, heading), heading) == pytest.approx([350.0, 20.0], abs=0.003)
    assert data[:, 0].tolist() == [0x0044, 0x0004]


# ---- meaning


def test_signs_and_units_reach_the_signal() -> None:
    words = {word.name: word.elements[0] for word in shipped("arinc429_inertial").words_429}
    assert signal_values(np.array([1.0]), words["normal_acceleration"]) == pytest.approx([-9.80665])
    assert signal_values(np.array([600.0]), words["vertical_speed"]) == pytest.approx([-3.048])
    assert signal_values(np.array([-90.0]), words["true_heading"]) == pytest.approx([270.0])


def test_two_units_are_numbered_and_a_terminal_is_one(tmp_path: Path) -> None:
    entry = MESSAGE.split("  NAV:")[1].split("supplemental")[0]
    second = entry.replace('bus: "B"', 'bus: "C"')
    attitude = entry.replace("latitude:", "roll:").replace("14240", "14112").replace("[29, 0]", "[25, 0]")
    text = "translatable_message_definitions:\n  ONE:" + entry + "  TWO:" + second + "  ATT:" + attitude
    found = icd(tmp_path, text)
    signals = [one.signal for _holder, one in found.elements() if one.signal]
    assert signals == ["ins.1.latitude_deg", "ins.2.latitude_deg", "ins.1.roll_deg"]
    alone = numbered((), found.messages_1553[1:2])[1]
    assert alone[0].elements[0].signal == "ins.latitude_deg"


@pytest.mark.parametrize("name", shipped_names())
def test_shipped_icds_load_without_a_remark(name: str) -> None:
    found = shipped(name)
    assert len(found)
    assert found.notes == ()
    assert not [one.name for _holder, one in found.elements() if one.is_by_name]


def test_an_icd_is_a_file_or_a_shipped_name(tmp_path: Path) -> None:
    (tmp_path / "mine").write_text(WORD, encoding="utf-8")
    assert named_icd("egi") == shipped("egi")
    assert len(named_icd(str(tmp_path / "mine"))) == 1
    with pytest.raises(SettingsError, match="no such file"):
        named_icd("egi.yaml")
    with pytest.raises(SettingsError, match="arinc429_inertial"):
        named_icd("egy")


def test_an_unknown_shipped_icd_is_refused() -> None:
    with pytest.raises(SettingsError, match="arinc429_inertial"):
        shipped("x")


@pytest.mark.real_log
@pytest.mark.parametrize(("name", "count"), [("1553_b100", 1), ("1553_egi", 7), ("429_nav", 9)])
def test_icds_of_others_load_as_they_are(name: str, count: int) -> None:
    found = load(real_log(f"ch10/icd/example_{name}.yaml"))
    assert len(found) == count
    assert found.notes == ()


@pytest.mark.parametrize("name", shipped_names())
def test_an_icd_written_and_read_back_is_the_same(tmp_path: Path, name: str) -> None:
    found = shipped(name)
    path = tmp_path / f"{name}.yaml"
    path.write_text(to_yaml(found, {holder.name: "seen" for holder, _one in found.elements()}, ["x"]), encoding="utf-8")
    assert load(path) == found


def test_an_element_kept_from_its_name_stays_so(tmp_path: Path) -> None:
    found = icd(tmp_path, MESSAGE.replace('uom: "deg"', 'uom: "deg", signal: ""'))
    assert found.messages_1553[0].elements[0].signal is None
    assert icd(tmp_path, to_yaml(found)).messages_1553 == found.messages_1553


@pytest.mark.parametrize(
    ("name", "unit", "signal", "factor"),
    [
        ("body_roll_rate", "deg/s", "ins.rate_x_dps", 1.0),
        ("body_yaw_rate", "rad/s", "ins.rate_z_dps", 57.29577951308232),
        ("body longitudinal acceleration", "g", "ins.accel_x_mps2", 9.80665),
        ("body_lateral_acceleration", "ft/s^2", "ins.accel_y_mps2", 0.3048),
        ("body_normal_acceleration", "g", "ins.accel_z_mps2", -9.80665),
    ],
)
def test_body_rates_and_accelerations_by_name(name: str, unit: str, signal: str, factor: float) -> None:
    element = by_name(Element(name, "SIGNED16", 64.0, unit), ["EGI"])
    assert element.signal == signal and element.factor == pytest.approx(factor, rel=1e-12)
