"""Logs made to harm, small and refused or read in part: they are mutated as the sound ones are."""

import io
import sqlite3
import tempfile
from collections.abc import Callable
from pathlib import Path

import h5py

COUNT = 40_000_000  # samples that a file of some kB claims to hold
EXPANDED_BYTES = 96 << 20  # of what is compressed
ENDLESS = "WITH RECURSIVE c(x) AS (SELECT 1 UNION ALL SELECT x + 1 FROM c)"
AS_A_BAG = "/* CREATE TABLE topics CREATE TABLE messages */"


def unallocated_hdf5(sound: bytes) -> bytes:
    """Parameters whose samples were never allocated, contiguous and in pieces, beside sound ones."""
    stream = io.BytesIO(sound)
    with h5py.File(stream, "a") as file:
        for number in range(6):
            group = file["series"].create_group(f"P{number}")
            group.attrs["frequency"], group.attrs["supf_offset"] = 128.0, 0.0
            for part, kind in (("data", "<f8"), ("mask", "?")):
                group.create_dataset(part, (COUNT,), kind, chunks=(1 << 20,) if number % 2 else None)
    return stream.getvalue()


def computed_sqlite3(sound: bytes) -> bytes:
    """A bag whose table of messages is a view of an endless query, each of a megabyte."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "bag.db3"
        path.write_bytes(sound)
        database = sqlite3.connect(path)
        database.executescript(
            f"DROP TABLE messages; CREATE VIEW messages AS {AS_A_BAG} {ENDLESS} "
            "SELECT x AS id, 1 AS topic_id, x AS timestamp, zeroblob(1000000) AS data FROM c; VACUUM"
        )
        database.close()
        return path.read_bytes()


def bomb(compress: Callable[[bytes], bytes]) -> bytes:
    """The beginning of a table, then many times as many bytes as the file has."""
    rows = b"time_s,ins.roll_deg,ins.pitch_deg\n" + b"".join(b"%d,1.5,2.5\n" % row for row in range(200))
    return compress(rows + bytes(EXPANDED_BYTES))
