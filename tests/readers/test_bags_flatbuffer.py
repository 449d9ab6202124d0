"""FlatBuffers in an MCAP: against Google's compiler and Foxglove's own classes; what is damaged or hostile."""

import json
import random
import struct
from importlib.resources import files
from pathlib import Path
from typing import Any

import flatbuffers
import pytest
from foxglove_schemas_flatbuffer import LocationFix
from foxglove_schemas_flatbuffer.Time import CreateTime

from groundstation.base.records import Damage
from groundstation.readers import registry
from groundstation.readers.bags import flatbuffer
from groundstation.readers.bags.definitions import DefinitionError
from groundstation.readers.bags.flatbuffer import message_reader
from tests.readers.bag_writer import START_NS
from tests.readers.test_bags import flight_of, mcap
from tests.readers.test_contract import check

REFERENCES = Path(__file__).parents[1] / "references" / "flatbuffers"
SCHEMA, MESSAGE = ((REFERENCES / f"every_kind.{ending}").read_bytes() for ending in ("bfbs", "bin"))
FOXGLOVE = files("foxglove_schemas_flatbuffer")
FIX = "foxglove.LocationFix"
NO_MESSAGES = ("ByteVector.bfbs", "Time.bfbs", "Duration.bfbs")  # parts of others


def fix(row: int) -> bytes:
    """A LocationFix as Foxglove's own classes write it; every second one without an altitude."""
    builder = flatbuffers.Builder(64)
    frame = builder.CreateString("gnss")
    covariance = LocationFix.LocationFixStartPositionCovarianceVector(builder, 9)
    for number in reversed(range(9)):
        builder.PrependFloat64(float(number))
    covariance = builder.EndVector()
    LocationFix.LocationFixStart(builder)
    LocationFix.LocationFixAddTimestamp(builder, CreateTime(builder, START_NS // 10**9 + row, 7))
    LocationFix.LocationFixAddFrameId(builder, frame)
    LocationFix.LocationFixAddLatitude(builder, 55.0 + row)
    LocationFix.LocationFixAddLongitude(builder, 37.5)
    if row % 2:
        LocationFix.LocationFixAddAltitude(builder, 120.5)
    LocationFix.LocationFixAddPositionCovariance(builder, covariance)
    LocationFix.LocationFixAddPositionCovarianceType(builder, 2)
    builder.Finish(LocationFix.LocationFixEnd(builder))
    return bytes(builder.Output())


def log(path: Path, messages: list[bytes], schema: bytes, kind: str = FIX) -> Path:
    rows = [("/fix", START_NS + row * 10**9 + 1000, data) for row, data in enumerate(messages)]
    return mcap(path, {"/fix": (kind, "flatbuffer", "flatbuffer", schema)}, rows)


def test_every_kind_of_value_is_as_the_compiler_wrote_it() -> None:
    written = json.loads((REFERENCES / "every_kind.json").read_text(encoding="utf-8"))
    defaults = {"single": 1.5, "ushort_one": 40_000, "left_out": -5}
    written["bytes"] = 3
    written["named"]["level"] = written["many"][1]["level"] = 7
    found = message_reader("own.State", SCHEMA)(MESSAGE)
    assert found == written | defaults
    assert "absent" not in found


def test_all_schemas_of_foxglove_can_be_used() -> None:
    listed = [one for one in FOXGLOVE.iterdir() if one.name.endswith(".bfbs") and one.name not in NO_MESSAGES]
    assert len(listed) > 30
    for one in listed:
        message_reader(f"foxglove.{one.name.removesuffix('.bfbs')}", one.read_bytes())


def test_location_fixes_are_mapped_as_of_protobuf(tmp_path: Path) -> None:
    path = log(tmp_path / "a.mcap", [fix(row) for row in range(20)], (FOXGLOVE / "LocationFix.bfbs").read_bytes())
    check(list(registry.read(path)))
    flight = flight_of(path, tmp_path)
    assert flight["gnss"].values("latitude_deg").tolist() == [55.0 + row for row in range(20)]
    assert flight["gnss"].time_ns[3] == START_NS + 3 * 10**9 + 7
    assert flight["gnss"].columns["altitude_ellipsoid_m"].mask.tolist() == [False, True] * 10
    raw = flight["raw.fix"]
    assert raw.values("position_covariance[8]").tolist() == [8.0] * 20
    assert set(raw.text("position_covariance_type")) == {"DIAGONAL_KNOWN"}


def test_a_message_and_a_schema_that_are_damaged_are_told(tmp_path: Path) -> None:
    schema = (FOXGLOVE / "LocationFix.bfbs").read_bytes()
    found = list(registry.read(log(tmp_path / "a.mcap", [fix(0), fix(1)[:40], fix(2)], schema)))
    assert [(one.count, one.topic) for one in found if isinstance(one, Damage)] == [(1, "raw.fix")]
    found = list(registry.read(log(tmp_path / "b.mcap", [fix(0), fix(1)], schema[:-400])))
    assert [one.count for one in found if isinstance(one, Damage) and "flatbuffer" in one.what] == [2]


def test_damage_raises_nothing_else_and_reads_nothing_outside() -> None:
    rng = random.Random(19)
    for _ in range(1_000):
        schema, message = bytearray(SCHEMA), bytearray(MESSAGE)
        target = rng.choice((schema, message))
        for _edit in range(rng.randint(1, 4)):
            target[rng.randrange(len(target))] = rng.choice((0, 255, rng.randrange(256)))
        if rng.random() < 0.2:
            del target[rng.randrange(len(target)) :]
        try:
            message_reader("own.State", bytes(schema))(bytes(message))
        except (DefinitionError, ValueError):
            continue


def test_offsets_to_one_table_do_not_unfold(monkeypatch: pytest.MonkeyPatch) -> None:
    """Ten levels, each with ten offsets to the one table below: 10**10 tables in some hundred bytes."""
    message = unfolding(levels=10, wide=10)
    known = flatbuffer._schema("own.State", SCHEMA)
    own = flatbuffer._Object(
        (flatbuffer._Field("part", flatbuffer._Type(14, 15, 0, 0), 4, None),), is_struct=False, size=4
    )
    counted: list[int] = []
    plain = flatbuffer._Message._object

    def counting(self: Any, *arguments: Any) -> Any:
        counted.append(1)
        return plain(self, *arguments)

    monkeypatch.setattr(flatbuffer._Message, "_object", counting)
    with pytest.raises(ValueError, match=r"without end|than bytes"):
        flatbuffer._Message(flatbuffer._Schema((own,), known.enumerations, own), message).fields()
    assert len(counted) <= flatbuffer.MOST_FIELDS + flatbuffer.VALUES_PER_BYTE * len(message)


def unfolding(levels: int, wide: int) -> bytes:
    """A root table whose field is a vector of ``wide`` offsets to one table of the same kind, and so on."""
    step = 8 + 4 + 4 * wide  # a table (offset of its list, offset of its vector), then the vector
    data = bytearray(struct.pack("<I", 12) + struct.pack("<HHHH", 6, 8, 4, 0))  # the list of offsets of all tables
    for level in range(levels):
        at = len(data)
        data += struct.pack("<iI", at - 4, 4)
        data += struct.pack("<I", wide)
        data += b"".join(struct.pack("<I", at + step - (at + 12 + 4 * number)) for number in range(wide))
        assert len(data) == at + step, level
    return bytes(data + struct.pack("<iI", len(data) - 4, 0) + bytes(4))
