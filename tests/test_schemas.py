"""schemas/*.proto is the one list of columns: base/signals and the compiled descriptor set are held against it."""

import re
import subprocess
import sys
from pathlib import Path

import pytest
from google.protobuf.descriptor_pb2 import FieldDescriptorProto, FileDescriptorSet

from groundstation.base.signals import TOPICS
from groundstation.store.schema import DESCRIPTORS, MESSAGE_OF_KIND, canonical_type

SCHEMAS = Path(__file__).parents[1] / "schemas"
PROTO_TYPE = {
    "double": FieldDescriptorProto.TYPE_DOUBLE,
    "single": FieldDescriptorProto.TYPE_FLOAT,
    "bool": FieldDescriptorProto.TYPE_BOOL,
    "text": FieldDescriptorProto.TYPE_STRING,
}
VARINTS = {
    *(FieldDescriptorProto.TYPE_INT64, FieldDescriptorProto.TYPE_UINT64, FieldDescriptorProto.TYPE_INT32),
    *(FieldDescriptorProto.TYPE_UINT32, FieldDescriptorProto.TYPE_SINT32, FieldDescriptorProto.TYPE_SINT64),
    FieldDescriptorProto.TYPE_ENUM,
}


def files() -> FileDescriptorSet:
    return FileDescriptorSet.FromString(DESCRIPTORS.read_bytes())


def test_compiled_descriptors_are_fresh(tmp_path: Path) -> None:
    out = tmp_path / "fresh.binpb"
    command = [sys.executable, "-m", "grpc_tools.protoc", f"-I{SCHEMAS}", "--include_imports"]
    subprocess.run(
        [*command, f"--descriptor_set_out={out}", *map(str, sorted(SCHEMAS.glob("*.proto")))],
        check=True,
        capture_output=True,
    )
    assert FileDescriptorSet.FromString(out.read_bytes()) == files(), "run `make schemas`"


@pytest.mark.parametrize("kind", TOPICS)
def test_schema_equals_signals(kind: str) -> None:
    names_and_types = [(field.name, field.type) for field in canonical_type(kind).own_fields]
    assert names_and_types == [
        (field.name, PROTO_TYPE["single" if field.is_single else field.kind]) for field in TOPICS[kind]
    ]


def test_every_kind_has_a_message_and_every_message_a_kind() -> None:
    assert set(MESSAGE_OF_KIND) == set(TOPICS)
    assert {message.name for file in files().file for message in file.message_type} == set(MESSAGE_OF_KIND.values())


def test_fields_have_explicit_presence_and_no_number_is_a_varint() -> None:
    for file in files().file:
        for field in file.message_type[0].field:
            assert field.proto3_optional, field.name
            assert field.type not in VARINTS, field.name


def test_common_fields_have_the_first_numbers() -> None:
    for kind in TOPICS:
        common = canonical_type(kind).fields[:2]
        assert [(field.name, field.number, field.wire_type) for field in common] == [
            ("device_time_ns", 1, 1),
            ("record_index", 2, 1),
        ]


@pytest.mark.parametrize("path", sorted(SCHEMAS.glob("*.proto")), ids=lambda path: path.stem)
def test_every_field_has_a_comment(path: Path) -> None:
    lines = path.read_text(encoding="utf-8").splitlines()
    fields = [number for number, line in enumerate(lines) if re.match(r"\s+optional ", line)]
    assert fields
    for number in fields:
        assert lines[number - 1].strip().startswith("// "), lines[number]
