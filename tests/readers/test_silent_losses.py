"""Losses that no checksum shows: names of columns, types and fields that damage made into others, told all the same."""

from pathlib import Path

import numpy as np
import pytest
from mcap.writer import CompressionType, Writer

from groundstation.base.records import Damage, RecordBatch
from groundstation.base.signals import TOPICS
from groundstation.readers import registry
from groundstation.store.reader import read as store_items
from tests.fuzz.bases import bases
from tests.fuzz.silent import values_of
from tests.readers.bag_writer import START_NS
from tests.readers.dataflash_writer import flight_log
from tests.store.mcap_surgery import chunk_count, without_chunk

KINDS = ("ins", "gnss", "discrete", "magnetometer", "baro", "air")
FMT_BYTES = 89


def damages(path: Path) -> list[Damage]:
    return [item for item in registry.read(path) if isinstance(item, Damage)]


def table(path: Path, names: list[str]) -> Path:
    rows = [",".join([str(second), *("1" for _ in names)]) for second in range(5)]
    path.write_text("\n".join(["time_s," + ",".join(names), *rows, ""]), encoding="utf-8")
    return path


def test_one_byte_of_any_canonical_name_is_told_with_the_name_meant(tmp_path: Path) -> None:
    names = [f"{topic}.{one.name}" for topic in KINDS for one in TOPICS[topic] if one.kind != "text"]
    rng = np.random.default_rng(22)
    for number in range(0, len(names), 3):
        name = names[number]
        at = int(rng.integers(len(name)))
        wrong = f"{name[:at]}%{name[at + 1 :]}"
        found = damages(table(tmp_path / "a.csv", [*names[:number], wrong, *names[number + 1 :]]))
        (told,) = [one for one in found if one.kind == "misnamed"]
        assert (told.count, told.loses_data, told.place) == (5, True, "row 1")
        assert told.what.endswith(f"unknown, meant {name!r}?")


@pytest.mark.parametrize(
    "name", ["gnss.vdop", "engine.rpm", "ins.roll", "gnss.age_s", "raw.ins.roll_degg", "ins.rate_w_dps"]
)
def test_names_of_ones_own_are_no_slips(tmp_path: Path, name: str) -> None:
    assert not damages(table(tmp_path / "a.csv", ["ins.pitch_deg", "gnss.latitude_deg", name]))


def test_a_letter_in_a_long_word_is_a_slip_unless_the_right_name_is_there_too(tmp_path: Path) -> None:
    (told,) = damages(table(tmp_path / "a.csv", ["gnss.longitude_deg", "gnss.latitide_deg"]))
    assert "meant 'gnss.latitude_deg'?" in told.what and told.topic == "raw.gnss"
    assert not damages(table(tmp_path / "b.csv", ["gnss.latitude_deg", "gnss.latitide_deg"]))


@pytest.mark.parametrize(
    ("right", "wrong", "told"),
    [
        (b"TimeUS,Lat,Lng", b"TimeUQ,Lat,Lng", "field TimeUQ: unknown, meant TimeUS?"),
        (b"I,Status,GMS", b"I,Ststus,GMS", "field Ststus: unknown, meant Status?"),
        (b"MagY,MagZ", b"MagY,MaoZ", "field MaoZ: unknown, meant MagZ?"),
        (b"GPS\0QBB", b"GPW\0QBB", "type GPW: unknown, meant GPS?"),
        (b"GPS\0QBB", b"GPS\1QBB", "a name with characters that no name has"),
        (b"HDop,Lat", b"HDop.Lat", "a name with characters that no name has"),
        (b"TimeUS,Lat,Lng,Alt", b"TimeUS,Lat,LngxAlt", "3 names for 4 fields"),
        (b"QLLf\0\0", b"QLLf\0\1", "bytes behind the end of a text"),
        (b"GCrs,VZ", b"GCrslVZ", "14 names for 15 fields"),
        (b"QBffffff", b"QBnfffff", "field GyrX of kind n"),
        (b"QBhhhB\0", b"QBhhh\0\0", "6 names for 5 fields"),
    ],
)
def test_a_definition_of_dataflash_made_into_another_is_told(
    tmp_path: Path, right: bytes, wrong: bytes, told: str
) -> None:
    sound = flight_log(2).content
    assert sound.count(right) == 1
    path = tmp_path / "a.BIN"
    path.write_bytes(sound.replace(right, wrong))
    reasons = [one.what for one in damages(path) if one.what.startswith("records read by a definition that is damaged")]
    assert len(reasons) == 1 and reasons[0].endswith(told)


def test_a_type_that_a_script_names_in_small_letters_is_no_damage(tmp_path: Path) -> None:
    path = tmp_path / "a.BIN"
    path.write_bytes(flight_log(2).content.replace(b"MAG\0QBhhhB", b"wing" + b"QBhhhB"))
    assert path.read_bytes().count(b"wing") == 1
    assert not [one for one in damages(path) if one.what.startswith("records read by a definition")]


def test_an_instance_that_no_autopilot_has_is_no_sensor_of_its_own(tmp_path: Path) -> None:
    content = bytearray(flight_log(2).content)
    at = content.find(b"\xa3\x95\x0a")
    content[at + 11] = 255
    path = tmp_path / "a.BIN"
    path.write_bytes(bytes(content))
    values, tells = values_of(path)
    assert tells and values["magnetometer.field_forward_nt"] == 9
    assert [one.count for one in damages(path)] == [1]


def test_a_flipped_bit_in_definitions_is_seldom_silent(tmp_path: Path) -> None:
    """What stays silent: a letter that is of the same size, or one in a name that nothing here knows."""
    sound = flight_log(1).content
    starts = [at for at in range(len(sound)) if sound[at : at + 3] == b"\xa3\x95\x80"]
    path = tmp_path / "a.BIN"
    path.write_bytes(sound)
    values, _tells = values_of(path)
    rng = np.random.default_rng(22)
    silent = []
    for _ in range(100):
        content = bytearray(sound)
        at = int(rng.choice(starts)) + int(rng.integers(FMT_BYTES))
        content[at] ^= 1 << int(rng.integers(8))
        path.write_bytes(bytes(content))
        found, tells = values_of(path)
        if not tells and any(found[name] < count for name, count in values.items()):
            silent.append(at)
    assert not silent


def foreign(path: Path, times: range, *, counts: bool = True) -> Path:
    """An MCAP of another program: messages of 100 in a chunk, numbered as they are made."""
    with path.open("wb") as stream:
        writer = Writer(stream, chunk_size=4_000, compression=CompressionType.NONE, use_statistics=counts)
        writer.start()
        schema = writer.register_schema("own.State", "jsonschema", b"{}")
        channel = writer.register_channel("/state", "json", schema)
        for at in times:
            writer.add_message(channel, START_NS + at * 10**7, f'{{"x": {at + 0.5}}}'.encode(), 0, at)
        writer.finish()
    return path


@pytest.mark.parametrize("number", [0, 3, -1])
@pytest.mark.parametrize("is_mended", [True, False])
def test_a_chunk_taken_out_of_an_mcap_of_ours_is_told(tmp_path: Path, number: int, is_mended: bool) -> None:
    sound = bases("mcap", recorded=False)[0].data
    path = tmp_path / "a.mcap"
    path.write_bytes(sound)
    before, tells = values_of(path)
    assert not tells
    path.write_bytes(without_chunk(sound, number % chunk_count(sound), is_mended=is_mended))
    after, tells = values_of(path)
    is_derived = after == before  # a chunk of the map: nothing recorded was in it
    assert tells or is_derived
    if is_mended and not is_derived:
        told = [item for item in store_items(path) if isinstance(item, Damage) and item.loses_data]
        assert told and all("ledger in the file counts" in one.what for one in told)


@pytest.mark.parametrize("number", [0, 3, -1])
def test_a_chunk_taken_out_of_a_foreign_mcap_is_told_by_the_statistics(tmp_path: Path, number: int) -> None:
    sound = foreign(tmp_path / "a.mcap", range(1_000)).read_bytes()
    path = tmp_path / "b.mcap"
    path.write_bytes(without_chunk(sound, number % chunk_count(sound), is_mended=False))
    (told,) = [one for one in damages(path) if "statistics of the file count" in one.what]
    rows = sum(len(item) for item in registry.read(path) if isinstance(item, RecordBatch))
    assert told.count == 1_000 - rows > 0 and told.loses_data


def test_a_chunk_taken_out_of_a_foreign_mcap_is_told_by_the_numbers_of_its_messages(tmp_path: Path) -> None:
    sound = foreign(tmp_path / "a.mcap", range(1_000)).read_bytes()
    path = tmp_path / "b.mcap"
    path.write_bytes(without_chunk(sound, 3, is_mended=True))
    (told,) = damages(path)
    rows = sum(len(item) for item in registry.read(path) if isinstance(item, RecordBatch))
    assert "sequence numbers" in told.what and told.count == 1_000 - rows


def test_a_sound_foreign_mcap_and_one_that_lost_messages_before_it_was_written_are_told_nothing(tmp_path: Path) -> None:
    assert not damages(foreign(tmp_path / "a.mcap", range(1_000)))
    assert not damages(foreign(tmp_path / "b.mcap", range(0, 3_000, 3), counts=False))
    assert not damages(foreign(tmp_path / "c.mcap", range(5), counts=False))
