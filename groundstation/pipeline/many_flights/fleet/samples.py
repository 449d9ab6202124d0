"""Dataset of the heading samples of every flight, by aircraft and month: samples.parquet/."""

import hashlib
import io
import json
import os
from collections.abc import Iterable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any
from urllib.parse import quote

import numpy as np

from groundstation.base.units import NS_PER_S
from groundstation.results.files import write_bytes
from groundstation.results.fleet_share import FleetSamples

SAMPLES = "samples.parquet"
UNKNOWN = "unknown"
VERSION = 1  # of the columns below: with another one every file is written again
LONGEST_S = 1e9
MOST_CHARACTERS = 180  # of a folder's name, of 255 bytes that file systems take
MEANINGS = {
    "flight_id": "joins fleet.parquet",
    "time_utc": "to the millisecond of the start; null for a log without absolute time",
    "time_s": "flight time",
    "segment": "number of the straight taxi segment",
    "heading_deg": "INS true heading at the GNSS epoch",
    "track_deg": "direction of the GNSS velocity; null below walking pace",
    "ground_speed_mps": "GNSS ground speed",
    "heading_error_deg": "INS heading - track, in [-180, 180); null below walking pace",
    "is_used": "whether the sample takes part in the estimate",
    "gate": "why not",
    "weight": "in the estimate, 1 on average over the used samples",
}


class SampleStore:
    """Dataset of samples in a folder of flights.

    Only what changed is written, and what is gone is removed.

    A file keeps the digest of what it was made from. Names of aircraft are percent-encoded as Hive writes them, which
    pandas, DuckDB and Polars undo; an aircraft or month that is not known is ``unknown``.
    """

    def __init__(self, out: Path) -> None:
        self._root = out / SAMPLES

    def put(self, row: Mapping[str, Any], samples: FleetSamples) -> str:
        """Keep the samples of a flight; returns its file in the dataset.

        ``row`` is that of the table of flights.

        Raises
        ------
        OSError
            When the file cannot be written.
        """
        name = f"aircraft={partition(row['aircraft'])}/month={row['month'] or UNKNOWN}/{row['flight_id']}.parquet"
        path, digest = self._root / name, _digest(row, samples)
        if _digest_in(path) != digest:
            path.parent.mkdir(parents=True, exist_ok=True)
            write_bytes(path, _encoded(row, samples, digest))
        return name

    def files(self) -> dict[str, int]:
        """Bytes of each file of the dataset, by the name that :meth:`put` gives it.

        Files that a killed run left are among them.
        """
        found: dict[str, int] = {}
        for aircraft in _folders_in(str(self._root)):
            for month in _folders_in(f"{self._root}/{aircraft}"):
                for name, size in _sizes_in(f"{self._root}/{aircraft}/{month}"):
                    if name.endswith((".parquet", ".partial")):
                        found[f"{aircraft}/{month}/{name}"] = size
        return found

    def remove(self, names: Iterable[str]) -> None:
        """Remove files, and folders that are empty then."""
        for name in sorted(names):
            path = self._root / name
            path.unlink(missing_ok=True)
            for folder in (*path.parents[:2], self._root):
                with suppress(OSError):  # it is not empty
                    folder.rmdir()


def _folders_in(folder: str) -> list[str]:
    try:
        with os.scandir(folder) as entries:
            return [entry.name for entry in entries if entry.is_dir(follow_symlinks=False)]
    except OSError:
        return []


def _sizes_in(folder: str) -> list[tuple[str, int]]:
    try:
        with os.scandir(folder) as entries:
            return [(entry.name, entry.stat().st_size) for entry in entries]
    except OSError:
        return []


def partition(aircraft: str) -> str:
    """Name of an aircraft's folder.

    Letters, digits, _ and - stay, the rest is percent-encoded.

    Examples
    --------
    >>> partition("L-39 07/.."), partition("")
    ('L-39%2007%2F%2E%2E', 'unknown')
    """
    whole = quote(aircraft, safe="").replace(".", "%2E").replace("~", "%7E")
    if len(whole) <= MOST_CHARACTERS:
        return whole or UNKNOWN
    kept = "".join(part for at, part in enumerate(map(partition, aircraft)) if at < MOST_CHARACTERS // 12)
    return f"{kept}-{hashlib.sha256(aircraft.encode()).hexdigest()[:8]}"


def _digest(row: Mapping[str, Any], samples: FleetSamples) -> str:
    told = hashlib.sha256(json.dumps([VERSION, row["flight_id"], row["start_utc"]]).encode())
    for name, values in samples.columns.items():
        told.update(f"{name} {values.dtype.str} {len(values)}".encode())
        told.update(np.ascontiguousarray(values).tobytes())
    return told.hexdigest()


def _digest_in(path: Path) -> str:
    import pyarrow.parquet as pq

    try:
        return ((pq.read_schema(path).metadata or {}).get(b"digest") or b"").decode()
    except (OSError, ValueError):
        return ""


def _encoded(row: Mapping[str, Any], samples: FleetSamples, digest: str) -> bytes:
    import pyarrow as pa
    import pyarrow.parquet as pq

    columns = samples.columns
    count = len(columns["time_s"])
    gate = pa.array(columns["gate"].tolist(), pa.string()).dictionary_encode()
    numbers = {name: pa.array(columns[name], pa.float64(), from_pandas=True) for name in columns if name != "gate"}
    arrays = {
        "flight_id": pa.DictionaryArray.from_arrays(np.zeros(count, dtype=np.int32), [row["flight_id"]]),
        "time_utc": _times(row["start_utc"], columns["time_s"]),
        "time_s": numbers["time_s"],
        "segment": pa.array(np.clip(np.nan_to_num(columns["segment"]), -1, 2**31 - 1).astype(np.int32)),
        "heading_deg": numbers["heading_deg"],
        "track_deg": numbers["track_deg"],
        "ground_speed_mps": numbers["ground_speed_mps"],
        "heading_error_deg": numbers["error_deg"],
        "is_used": pa.array(columns["used"]),
        "gate": gate,
        "weight": numbers["weight"],
    }
    metadata = {"digest": digest, "columns": json.dumps(MEANINGS)}
    buffer = io.BytesIO()
    pq.write_table(pa.table(arrays).replace_schema_metadata(metadata), buffer, compression="zstd")
    return buffer.getvalue()


def _times(start_utc_ns: int | None, time_s: np.ndarray) -> Any:
    import pyarrow as pa

    is_known = (np.abs(time_s) < LONGEST_S) & (start_utc_ns is not None)
    since_start = np.round(np.where(is_known, time_s, 0.0) * NS_PER_S).astype(np.int64)
    return pa.array((start_utc_ns or 0) + since_start, pa.timestamp("ns", tz="UTC"), mask=~is_known)
