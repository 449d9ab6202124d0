"""Work per byte of a damaged MCAP, counted: bytes read and copied, whatever its heads and lengths claim."""

import io
import struct
from pathlib import Path
from typing import Any

import pytest

from groundstation.store import foreign, recovery
from groundstation.store.framing import chunk_head
from tests.fuzz.bases import bases

SMALL = 1 << 16


class Counting(io.BytesIO):
    """Counts what is read of it."""

    def __init__(self, data: bytes) -> None:
        super().__init__(data)
        self.count = 0

    def read(self, size: int | None = -1, /) -> bytes:
        data = super().read(size)
        self.count += len(data)
        return data


def false_definitions(count: int) -> bytes:
    """Heads of channels, each with a length that leads to the end of the file."""
    body = struct.pack("<HHI", 1, 1, 1) + b"t" + recovery._ENCODING
    return b"".join(b"\x04" + struct.pack("<Q", 30 * (count - at)) + body for at in range(count))


def false_chunks(count: int) -> bytes:
    """Chunks that are none, behind each a record that claims the rest of the file."""
    chunk = chunk_head(0, 1, 100, 1, 20) + recovery.ZSTD_MAGIC + bytes(16)
    size = len(chunk) + 9
    return b"".join(chunk + b"\x0c" + struct.pack("<Q", size * (count - at - 1)) for at in range(count))


@pytest.fixture
def counted(monkeypatch: pytest.MonkeyPatch) -> bytes:
    """The beginning of a file of ours; what may be read beside its size is small, so that the test can be."""
    monkeypatch.setattr(recovery, "MAX_RECORD_BYTES", 1 << 24)
    monkeypatch.setattr(recovery, "_READ_AGAIN", 8)
    return bases("mcap", recorded=False)[0].data[:2_000]


def test_definitions_that_claim_the_rest_of_the_file_are_not_read_each(
    counted: bytes, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = Counting(counted + false_definitions(4_000))
    size = len(file.getvalue())
    list(recovery._definitions_in(file, 0, size))
    unbounded = file.count
    file.count = 0
    monkeypatch.setattr(recovery, "MAX_RECORD_BYTES", SMALL)
    list(recovery.definitions_in(file, 0, size))
    assert file.count <= 9 * size + SMALL < unbounded / 100


def test_chunks_that_are_none_are_given_up_where_they_cost_too_much(
    counted: bytes, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = Counting(counted + false_chunks(2_000))
    size = len(file.getvalue())
    list(recovery._walked(file, 8, size, has_end=False))
    unbounded = file.count
    file.count = 0
    monkeypatch.setattr(recovery, "MAX_RECORD_BYTES", SMALL)
    found = list(recovery.chunks_by_walk(file, size))
    last = found[-1]
    assert isinstance(last, recovery.Lost) and "given up" in last.reason and last.end == size
    assert file.count <= 10 * size + SMALL < unbounded


def test_a_sound_file_is_walked_far_below_the_bound(tmp_path: Path) -> None:
    data = bases("mcap", recorded=False)[0].data
    file = Counting(data)
    found = list(recovery.chunks_by_walk(file, len(data)))
    assert all(isinstance(one, recovery.Intact) for one in found)
    assert file.count < 3 * len(data)


def test_whole_records_are_found_without_copying_what_follows() -> None:
    copied = 0

    class Sliced(bytes):
        def __getitem__(self, key: Any) -> Any:
            nonlocal copied
            found = super().__getitem__(key)
            copied += len(found) if isinstance(key, slice) else 0
            return found

    record = b"\x04" + struct.pack("<Q", 20) + bytes(20)
    data = Sliced(record * 1_000 + b"\x04")
    assert foreign._whole_records(data) == 29_000
    assert foreign._whole_records(data, 29 * 500) == 29_000
    assert copied <= 8 * 1_600
