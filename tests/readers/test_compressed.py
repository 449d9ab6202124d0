"""Compressed logs are read as what is in them, within bounds; a cut one keeps what decompressed."""

import gzip
import io
import zlib
from pathlib import Path

import pytest
import zstandard

from groundstation.base.errors import UnreadableLogError
from groundstation.base.records import Damage, RecordBatch
from groundstation.readers import compressed, registry
from groundstation.readers.source import Source
from tests.readers.test_contract import FLAT, check, summary
from tests.readers.ulog_writer import small_flight

PACKERS = {"gzip": gzip.compress, "zstd": zstandard.compress}


@pytest.mark.parametrize("kind", PACKERS)
def test_a_packed_table_reads_like_the_table(tmp_path: Path, kind: str) -> None:
    (tmp_path / "a.csv").write_text(FLAT)
    (tmp_path / "b").write_bytes(PACKERS[kind](FLAT.encode()))  # the name means nothing
    items = list(registry.read(tmp_path / "b"))
    check(items)
    assert summary(items) == summary(list(registry.read(tmp_path / "a.csv")))
    source = Source(tmp_path / "b")
    assert source.compression == kind and source.size == len(FLAT) and source.head == FLAT.encode()


@pytest.mark.parametrize("kind", PACKERS)
def test_several_members_are_one_log(tmp_path: Path, kind: str) -> None:
    data, pack = bytes(small_flight(100).data), PACKERS[kind]
    packed = pack(data[:999]) + pack(data[999:]) + (bytes(600) if kind == "gzip" else b"")
    (tmp_path / "log").write_bytes(packed)
    with Source(tmp_path / "log").open() as stream:
        assert stream.read() == data
        assert stream.seek(-10, io.SEEK_END) == len(data) - 10 and stream.read() == data[-10:]


@pytest.mark.parametrize("kind", PACKERS)
def test_streams_have_positions_of_their_own(tmp_path: Path, kind: str) -> None:
    (tmp_path / "log").write_bytes(PACKERS[kind](bytes(range(256)) * 9))
    source = Source(tmp_path / "log")
    with source.open() as one, source.open() as two:
        assert one.read(3) == bytes([0, 1, 2]) and two.read(2) == bytes([0, 1]) and one.read(1) == bytes([3])


@pytest.mark.parametrize("kind", PACKERS)
def test_a_cut_file_keeps_what_decompressed(tmp_path: Path, kind: str) -> None:
    import numpy as np

    log = small_flight(20_000)
    rng = np.random.default_rng(1)
    for start in log.starts:  # random numbers: they compress badly, so half of the file holds half of the log
        if log.data[start + 2] == ord("D"):
            log.data[start + 14 : start + 17] = rng.bytes(3)
    packed = PACKERS[kind](bytes(log.data))
    (tmp_path / "log").write_bytes(packed[: len(packed) // 2])
    items = list(registry.read(tmp_path / "log"))
    damages = [item for item in items if isinstance(item, Damage)]
    rows = sum(len(item) for item in items if isinstance(item, RecordBatch) and item.topic == "raw.vehicle_attitude")
    assert 3_000 < rows < 20_000
    assert any(damage.kind == "truncated" and kind in damage.what for damage in damages)


@pytest.mark.parametrize("every", [7, pytest.param(1, marks=pytest.mark.slow)])
@pytest.mark.parametrize("kind", PACKERS)
def test_cut_anywhere_and_flipped_bits_throw_nothing_else(tmp_path: Path, kind: str, every: int) -> None:
    import numpy as np

    packed = PACKERS[kind](bytes(small_flight(20).data))
    rng, path = np.random.default_rng(5), tmp_path / "log"
    flipped = []
    for at in range(len(packed)):
        data = bytearray(packed)
        data[at] ^= 1 << int(rng.integers(8))
        flipped.append(bytes(data))
    for data in [*(packed[:size] for size in range(1, len(packed), every)), *flipped[::every]]:
        path.write_bytes(data)
        try:
            list(registry.read(path))
        except UnreadableLogError as error:
            assert "log" in str(error)


def test_a_bomb_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(compressed, "MIN_LIMIT_BYTES", 1 << 20)
    head = bytes(small_flight(5).data)
    for kind, pack in PACKERS.items():
        (tmp_path / "bomb").write_bytes(pack(head + bytes(40 << 20)))
        assert registry.identify(tmp_path / "bomb").reader == "px4-ulog", "the head alone is harmless"
        with pytest.raises(UnreadableLogError, match=f"{kind} data that expands beyond"):
            list(registry.read(tmp_path / "bomb"))


def test_declared_sizes_are_not_believed(tmp_path: Path) -> None:
    packed = bytearray(gzip.compress(FLAT.encode()))
    packed[-4:] = b"\xff\xff\xff\x7f"  # the size a gzip declares: 2 GB
    (tmp_path / "log").write_bytes(packed)
    assert any(isinstance(item, Damage) and item.kind == "corrupt" for item in registry.read(tmp_path / "log"))


def test_packed_unknown_content_is_named_by_what_it_is(tmp_path: Path) -> None:
    (tmp_path / "log").write_bytes(gzip.compress(b"PAR1" + bytes(100)))
    with pytest.raises(UnreadableLogError, match="recognised as Parquet"):
        registry.identify(tmp_path / "log")
    for content, kind in ((b"\x1f\x8b\x08" + bytes(20), "gzip"), (b"\x28\xb5\x2f\xfd" + b"\xff" * 20, "zstd")):
        (tmp_path / "log").write_bytes(content)
        with pytest.raises(UnreadableLogError, match=f"{kind} data that cannot be decompressed"):
            registry.identify(tmp_path / "log")
    (tmp_path / "log").write_bytes(b"\x1f\x8b\x08" + zlib.compress(b"x"))
    with pytest.raises(UnreadableLogError):
        registry.identify(tmp_path / "log")


def test_a_log_that_is_read_twice_is_decompressed_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from groundstation.pipeline.one_flight import log
    from groundstation.readers import source

    calls: list[int] = []
    monkeypatch.setattr(source, "expand", lambda *given: calls.append(1) or compressed.expand(*given))
    monkeypatch.setattr(log, "REPLAY_LIMIT_BYTES", 10)
    (tmp_path / "a").write_bytes(gzip.compress(FLAT.encode()))
    items = log.open_log(tmp_path / "a").replay()
    assert summary(list(items)) == summary(list(items)) and calls == [1]
