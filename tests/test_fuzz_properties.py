"""Properties of readers and store on generated input: valid logs come back, anything else is refused in one line."""

import io
import struct
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from groundstation.base.clock import Clock
from groundstation.base.errors import GroundstationError
from groundstation.base.findings import SEVERITIES
from groundstation.base.ledger import Ledger
from groundstation.base.records import Column, RecordBatch
from groundstation.base.serial import from_json, to_json_exactly
from groundstation.readers import registry
from groundstation.readers.source import Source
from groundstation.store.info import StoreInfo, from_strings
from groundstation.store.reader import read, read_info
from groundstation.store.writer import StoreWriter
from tests.fuzz.mutation import Mutant, random_edits
from tests.fuzz.trial import check_items, try_file
from tests.readers.dataflash_writer import DataFlash
from tests.readers.ulog_writer import UlogWriter

FEW = settings(derandomize=True, deadline=None, max_examples=60, suppress_health_check=list(HealthCheck))
FEWER = settings(FEW, max_examples=25)
MAGICS = (
    *(b"ULog\x01\x12\x35\x01" + bytes(8), b"\xa3\x95\x80\x80\x59FMT\0BBnNZ", b"\x89MCAP0\r\n", b"\x1f\x8b\x08"),
    *(b"\x28\xb5\x2f\xfd", b"time_s,ins.roll_deg\n", b"#airframe_info\nLcl Date, Lcl Time, HDG\n", b""),
)
NUMBERS = {"int8_t": "b", "uint8_t": "B", "int16_t": "h", "uint32_t": "I", "int64_t": "q", "float": "f", "double": "d"}
NAMES = st.text("abcdefgh_0123456789", min_size=1, max_size=12).map(lambda text: "f" + text)
JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=5), inner, max_size=3),
    max_leaves=12,
)


def batches_of(path: Path) -> list[RecordBatch]:
    return [item for item in registry.read(path) if isinstance(item, RecordBatch)]


def values(batches: list[RecordBatch], topic: str, name: str) -> list[Any]:
    return [value for batch in batches if batch.topic == topic for value in batch.columns[name].values.tolist()]


@pytest.mark.parametrize("magic", MAGICS, ids=[magic[:8].hex() for magic in MAGICS])
@FEWER
@given(rest=st.binary(max_size=400))
def test_random_bytes_behind_a_magic(magic: bytes, rest: bytes) -> None:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "log"
        path.write_bytes(magic + rest)
        try_file(path, Path(folder), is_deep=False)


@FEW
@given(data=st.data())
def test_a_random_ulog_comes_back(data: Any) -> None:
    kinds = data.draw(st.lists(st.sampled_from(sorted(NUMBERS)), min_size=1, max_size=6))
    code = "Q" + "".join(NUMBERS[kind] for kind in kinds)
    log = UlogWriter().flags()
    fields = "".join(f"{kind} v{at};" for at, kind in enumerate(kinds))
    log.format(f"topic:uint64_t timestamp;{fields}").subscribe(7, "topic")
    raw = data.draw(st.lists(st.binary(min_size=64, max_size=64), min_size=1, max_size=20))
    rows = [struct.unpack_from("<" + code[1:], bytes_) for bytes_ in raw]
    for at, row in enumerate(rows):
        log.row(7, code, 1_000_000 + at, *row)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "log.ulg"
        path.write_bytes(bytes(log.data))
        found = batches_of(path)
    for at, kind in enumerate(kinds):
        expected = np.array([row[at] for row in rows], NUMBERS[kind])
        np.testing.assert_array_equal(np.array(values(found, "raw.topic", f"v{at}"), NUMBERS[kind]), expected)


@FEW
@given(rows=st.lists(st.tuples(st.integers(-(2**31), 2**31 - 1), st.integers(0, 255)), min_size=1, max_size=30))
def test_a_random_dataflash_log_comes_back(rows: list[tuple[int, int]]) -> None:
    log = DataFlash()
    log.define(9, "XYZ", "QiB", "TimeUS,A,B")
    log.define(10, "PAD", "QZ", "TimeUS,T")
    log.define(11, "PAE", "QZ", "TimeUS,T")
    for at, (first, second) in enumerate(rows):
        log.write("XYZ", 1_000_000 + at, first, second)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "log.BIN"
        path.write_bytes(log.content)
        found = batches_of(path)
    assert list(zip(values(found, "raw.XYZ", "A"), values(found, "raw.XYZ", "B"), strict=True)) == rows


@FEW
@given(cells=st.lists(st.text(st.characters(exclude_categories=["Cs"]), max_size=20), min_size=1, max_size=12))
def test_cells_of_all_kinds(cells: list[str]) -> None:
    """Whatever stands in one column, the number beside it is read in every row that is one row."""
    lines = ["time_s,ins.roll_deg,note"]
    plain = [not set(cell) & set(',;"\t\n\r\0\x1a#') for cell in cells]
    lines += [f"{at},{at}.5,{cell}" for at, cell in enumerate(cells)]
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "log.csv"
        path.write_bytes(("\n".join(lines) + "\n").encode())
        try:
            items = list(registry.read(path))
        except GroundstationError:
            assert not all(plain)
            return
        check_items(items)
        found = [item for item in items if isinstance(item, RecordBatch)]
        if all(plain):
            assert values(found, "ins", "roll_deg") == [at + 0.5 for at in range(len(cells))]


@FEW
@given(data=st.data())
def test_a_random_table_comes_back_from_the_store(data: Any) -> None:
    rows = data.draw(st.integers(1, 30))
    seed = data.draw(st.integers(0, 2**32 - 1))
    kinds = data.draw(st.lists(st.sampled_from(["f8", "f4", "i4", "u8", "i8", "?", "U6"]), min_size=1, max_size=5))
    names = data.draw(st.lists(NAMES, min_size=len(kinds), max_size=len(kinds), unique=True))
    rng = np.random.default_rng(seed)
    columns = {}
    for name, kind in zip(names, kinds, strict=True):
        raw = rng.bytes(rows * 8)
        if kind == "U6":
            column = np.array([f"t{byte}" for byte in raw[:rows]], "U6")
        elif kind == "?":
            column = np.frombuffer(raw[:rows], "u1") > 127
        else:
            column = np.frombuffer(raw, kind)[:rows]
        columns[name] = Column(column, rng.random(rows) < 0.8 if data.draw(st.booleans()) else None)
    time_ns = np.sort(rng.integers(0, 2**61, rows))
    index = np.arange(rows, dtype=np.int64)
    batch = RecordBatch("raw.t", index, Column(rng.integers(-(2**62), 2**62, rows)), columns, time_ns)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "a.mcap"
        with StoreWriter(path, StoreInfo(source_name="a")) as writer:
            writer.write(batch)
        back = [item for item in read(path) if isinstance(item, RecordBatch)]
    np.testing.assert_array_equal(np.concatenate([one.time_ns for one in back]), time_ns)
    for name, column in columns.items():
        mask = np.concatenate([one.columns[name].mask for one in back])
        found = np.concatenate([one.columns[name].values for one in back])
        np.testing.assert_array_equal(mask, column.mask)
        np.testing.assert_array_equal(found[mask], column.values[column.mask])


@FEW
@given(ledger=st.dictionaries(st.sampled_from(["topics", "damages", "findings", "remarks", "x"]), JSON), other=JSON)
def test_facts_of_any_shape_are_taken(ledger: dict[str, Any], other: Any) -> None:
    import json

    try:
        texts = {name: json.dumps(other) for name in ("clock", "metadata", "start_ns", "damages", "remarks", "has_utc")}
        info = from_strings({**texts, "ledger": json.dumps(ledger)})
    except UnicodeEncodeError:  # a lone surrogate cannot stand in an MCAP
        return
    assert all(isinstance(entry, dict) for entry in (*info.damages, *info.remarks))
    # Whatever was kept has its types: the strict reader takes what the lenient one left.
    assert from_json(Ledger, to_json_exactly(info.ledger)) == info.ledger
    assert from_json(Clock, to_json_exactly(info.clock)) == info.clock
    assert all(finding.severity in SEVERITIES for finding in info.findings)


@FEW
@given(size=st.integers(0, 300), other=st.integers(0, 300), seed=st.integers(0, 2**32 - 1))
def test_mutants_hold_what_they_say(size: int, other: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    original = rng.bytes(size)
    mutant = Mutant(original, rng.bytes(other), random_edits(size, other, (0, 3), rng))
    assert len(mutant) == len(mutant.content)
    for at in range(0, size, 7):
        if mutant.is_kept(at, min(size, at + 7)):
            assert original[at : at + 7] in mutant.content


def test_a_source_of_nothing_has_an_empty_head(tmp_path: Path) -> None:
    (tmp_path / "log").write_bytes(b"")
    assert Source(tmp_path / "log").head == b"" and io.BytesIO(b"").read() == b""
    with pytest.raises(GroundstationError):
        read_info(tmp_path / "log")
