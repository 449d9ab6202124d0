"""Damaged DataFlash logs: what is intact is kept and counted, what is lost is placed, nothing raises."""

from collections import Counter
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from groundstation.base.errors import UnreadableLogError
from groundstation.base.records import Damage, Item, RecordBatch
from groundstation.readers import registry
from groundstation.readers.dataflash import blocks, read
from groundstation.readers.dataflash.blocks import Scanner
from groundstation.readers.skipped import STRETCHES_SHOWN
from groundstation.readers.source import Source
from tests.readers.dataflash_writer import DataFlash, flight_log
from tests.readers.test_contract import check
from tests.real_logs import real_log

REAL = ("dataflash/erle_plane_4-12-2014_329.BIN", "dataflash/TestLog2_REENCODED_plane.BIN")


def scanned(path: Path) -> tuple[NDArray[np.int64], list[Damage]]:
    """Places of the records of a file, and its damages."""
    scanner, places, before = Scanner(Source(path)), [], 0
    for block in scanner:
        assert block.first_index == before
        before += len(block.offsets)
        places.append(block.offsets)
    for known, block in zip(places, scanner.again(), strict=True):
        assert np.array_equal(known, block.offsets)
    return np.concatenate(places) if places else np.zeros(0, dtype=np.int64), list(scanner.spans.damages())


def items_of(path: Path) -> list[Item]:
    items = list(read(Source(path)))
    check(items)
    return items


def test_second_pass_of_a_log_of_more_records_than_are_kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "long.BIN"
    path.write_bytes(flight_log(60).content)
    usual = [block.offsets.tolist() for block in Scanner(Source(path))]
    monkeypatch.setattr(blocks, "RECORDS_KEPT", 100)
    scanner = Scanner(Source(path))
    first = [block.offsets.tolist() for block in scanner]
    assert sum(map(len, first)) > 100
    assert [block.offsets.tolist() for block in scanner.again()] == first == usual


def test_log_that_becomes_shorter_between_the_passes(tmp_path: Path) -> None:
    path = tmp_path / "shorter.BIN"
    content = flight_log(60).content
    path.write_bytes(content)
    scanner = Scanner(Source(path))
    assert len(list(scanner)) >= 1
    path.write_bytes(content[: len(content) // 2])
    with pytest.raises(UnreadableLogError, match=r"shorter\.BIN: changed while it was read"):
        list(scanner.again())


def test_cut_at_every_byte(tmp_path: Path) -> None:
    log = DataFlash()
    log.define(1, "ATT", "QccC", "TimeUS,Roll,Pitch,Yaw")
    for at in range(4):
        log.write("ATT", 10**6 + at, at, 0, 0)
    starts, content, path = log.starts(), log.content, tmp_path / "cut.BIN"
    for size in range(1, len(content)):
        path.write_bytes(content[:size])
        places, damages = scanned(path)
        whole = sum(start <= size for start in starts[1:])
        assert places.tolist() == list(starts[:whole]), size
        lost = size - starts[whole]
        assert [(d.kind, d.count) for d in damages] == ([("truncated", lost)] if lost else []), size
        if size > 8:
            check(list(registry.read(path)))


@pytest.mark.parametrize("seed", range(8))
def test_records_that_no_flipped_bit_touched_are_kept(tmp_path: Path, seed: int) -> None:
    log = flight_log(60)
    _flip_and_count(tmp_path, np.frombuffer(log.content, np.uint8), np.array(log.starts()), seed)


@pytest.mark.real_log
@pytest.mark.parametrize("name", REAL)
@pytest.mark.parametrize("seed", range(3))
def test_records_of_a_real_log_that_no_flipped_bit_touched_are_kept(tmp_path: Path, name: str, seed: int) -> None:
    data = np.fromfile(real_log(name), np.uint8)
    starts, _ = scanned(real_log(name))
    _flip_and_count(tmp_path, data, np.append(starts, len(data)), seed)


def _flip_and_count(tmp_path: Path, data: NDArray[np.uint8], starts: NDArray[np.int64], seed: int) -> None:
    """Flip one bit in about every 2000th byte behind the definitions, and look for every untouched record."""
    rng = np.random.default_rng(seed)
    types = data[starts[:-1] + 2]
    first = int(starts[np.flatnonzero(types == 128)[-1] + 1])
    flipped = np.unique(rng.integers(first, len(data), max(3, len(data) // 2000)))
    damaged = data.copy()
    damaged[flipped] ^= (1 << rng.integers(0, 8, len(flipped))).astype(np.uint8)
    path = tmp_path / "flipped.BIN"
    damaged.tofile(path)
    found, damages = scanned(path)
    touched = np.unique(np.searchsorted(starts, flipped, side="right") - 1)
    untouched = np.delete(starts[:-1], touched)
    missing = np.setdiff1d(untouched, found)
    assert not len(missing), f"{len(missing)} of {len(untouched)} intact records are lost"
    skipped = sum(damage.count for damage in damages if damage.kind == "corrupt")
    kept = int(np.diff(starts)[np.isin(starts[:-1], found)].sum())
    false = len(np.setdiff1d(found, starts))
    assert kept + skipped >= len(data) - 255 * (false + 1), "every byte is in a record or counted"
    check(list(read(Source(path))))


def test_a_flipped_id_costs_its_own_record_alone(tmp_path: Path) -> None:
    log = flight_log()
    at = log.names.index("GPS")
    for other in (1, 3, 4, 5, 6, 7, 9, 10, 77, 128):
        records = list(log.records)
        records[at] = records[at][:2] + bytes((other,)) + records[at][3:]
        path = tmp_path / "id.BIN"
        path.write_bytes(b"".join(records))
        places, _ = scanned(path)
        intact = set(log.starts()[:-1]) - {log.starts()[at]}
        assert intact <= set(places.tolist()), other


@pytest.mark.parametrize("every", [3, pytest.param(1, marks=pytest.mark.slow)])
def test_an_intact_record_between_damaged_headers_is_kept(tmp_path: Path, every: int) -> None:
    """Any one bit in the header before it and any one in that behind it, be it with a time or without."""
    log = DataFlash()
    log.define(1, "ATT", "QccC", "TimeUS,Roll,Pitch,Yaw")
    log.define(9, "OLD", "Bf", "Name,Value")  # an id that a flipped bit makes of ATT's
    for at in range(6):
        log.write("ATT", 10**6 + at, at, 0, 0)
        log.write("OLD", at, 1.5)
    starts, path = log.starts(), tmp_path / "between.BIN"
    for middle in (8, 9):
        for before in range(24):
            for behind in range(before % every, 24, every):
                data = bytearray(log.content)
                for record, bit in ((middle - 1, before), (middle + 1, behind)):
                    data[starts[record] + bit // 8] ^= 1 << bit % 8
                path.write_bytes(data)
                places = scanned(path)[0].tolist()
                assert starts[middle] in places, (middle, before, behind)
                assert set(starts[:-1]) - {starts[middle - 1], starts[middle + 1]} <= set(places)


def test_a_wrong_time_costs_no_record_behind_it(tmp_path: Path) -> None:
    log = DataFlash()
    log.define(1, "ATT", "IccC", "TimeMS,Roll,Pitch,Yaw")
    for at in range(12):
        log.write("ATT", 60_000 + at, at, 0, 0)
    starts, data, path = log.starts(), bytearray(log.content), tmp_path / "time.BIN"
    data[starts[4] + 4] ^= 0x40  # 16 s late, then two intact records between two damaged ones
    data[starts[5] + 1] ^= 0x02
    data[starts[8] + 2] ^= 0x10
    path.write_bytes(data)
    assert set(starts[:-1]) - {starts[5], starts[8]} <= set(scanned(path)[0].tolist())


def test_lost_and_foreign_bytes_are_placed_and_counted(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    log = flight_log()
    starts, content = log.starts(), log.content
    here, there = starts[60], starts[90]
    path = tmp_path / "spans.BIN"
    path.write_bytes(content[:here] + b"\xa3\x95\x04junk" * 3 + content[here:there] + bytes(700) + content[there:])
    for block_bytes in (1 << 22, 900):
        monkeypatch.setattr(blocks, "BLOCK_BYTES", block_bytes)
        items = items_of(path)
        found = [(d.kind, d.place, d.count) for d in items if isinstance(d, Damage)]
        assert found == [
            ("corrupt", f"bytes {here} to {here + 20}", 21),
            ("corrupt", f"bytes {there + 21} to {there + 720}", 700),
        ]
        raw = sum(len(item) for item in items if isinstance(item, RecordBatch) and item.topic.startswith("raw."))
        assert raw == len(log.records)


def test_very_many_damaged_places_are_told_together(tmp_path: Path) -> None:
    log = flight_log(30)
    content = b"".join(record + b"\0" if at > 40 else record for at, record in enumerate(log.records))
    path = tmp_path / "many.BIN"
    path.write_bytes(content)
    places, damages = scanned(path)
    assert len(places) == len(log.records) and len(damages) <= STRETCHES_SHOWN + 2
    assert sum(damage.count for damage in damages) == len(log.records) - 41


def test_filler_behind_the_last_record_is_no_loss(tmp_path: Path) -> None:
    path = tmp_path / "page.BIN"
    path.write_bytes(flight_log().content + b"\xff" * 200)
    damages = scanned(path)[1]
    assert [(damage.kind, damage.count, damage.loses_data) for damage in damages] == [("padding", 200, False)]


def test_a_damaged_start_does_not_hide_the_format(tmp_path: Path) -> None:
    path = tmp_path / "start.BIN"
    path.write_bytes(b"\0" * 50 + flight_log().content[50:])
    assert registry.identify(path).reader == "dataflash"
    topics = {item.topic for item in registry.read(path) if isinstance(item, RecordBatch)}
    assert "gnss" in topics


def test_a_damaged_late_definition_costs_no_other_type(tmp_path: Path) -> None:
    log = flight_log()
    late = DataFlash()
    late.define(8, "OOPS", "B", "X")  # the id of GPS: one flipped bit in a definition of another type
    path = tmp_path / "late.BIN"
    path.write_bytes(b"".join(log.records[:400]) + late.records[1] + b"".join(log.records[400:]))
    items = items_of(path)
    kinds = Counter(item.kind for item in items if isinstance(item, Damage))
    assert kinds == {"corrupt": 1}
    fixes = sum(len(item) for item in items if isinstance(item, RecordBatch) and item.topic == "raw.GPS.0")
    assert fixes == log.names.count("GPS")


@pytest.mark.parametrize("seed", range(30))
def test_noise_is_read_without_a_failure(tmp_path: Path, seed: int) -> None:
    """Bytes replaced anywhere, definitions included."""
    rng = np.random.default_rng(seed)
    data = np.frombuffer(flight_log().content, np.uint8).copy()
    at = rng.integers(0, len(data), 60)
    data[at] = rng.integers(0, 256, len(at))
    path = tmp_path / "noise.BIN"
    path.write_bytes(b"\xa3\x95\x80" + data.tobytes()[3:])
    items_of(path)


@pytest.mark.parametrize("definitions", [5_000, pytest.param(20_000, marks=pytest.mark.slow)])
def test_very_many_definitions_take_linear_time(tmp_path: Path, definitions: int) -> None:
    log = flight_log()
    odd = DataFlash()
    odd.define(99, "ONE", "B", "X")
    odd.define(99, "TWO", "H", "X")
    path = tmp_path / "definitions.BIN"
    path.write_bytes(log.content + b"".join(odd.records) * definitions)
    items = items_of(path)
    damages = [item for item in items if isinstance(item, Damage)]
    assert len(damages) < 50
    fixes = sum(len(item) for item in items if isinstance(item, RecordBatch) and item.topic == "raw.GPS.0")
    assert fixes == log.names.count("GPS")


@pytest.mark.parametrize("unit", [b"\xa3", b"\xa3\x95", b"\xa3\x95\x80", b"\xa3\x95\x01\x00"])
def test_repeated_magic_takes_linear_time(tmp_path: Path, unit: bytes) -> None:
    path = tmp_path / "magic.BIN"
    path.write_bytes(flight_log().content + unit * (2_000_000 // len(unit)))
    items_of(path)
