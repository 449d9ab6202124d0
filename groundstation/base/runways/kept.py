"""Runway tables on disk: the shipped one, and the user's of ``runways update``.

A table is a NumPy archive of whole numbers: coordinates in millionths of a degree (0.1 m), heights and lengths in feet
as the source has them.
"""

import json
import os
import sys
import zipfile
import zlib
from functools import lru_cache
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from groundstation.base.angles import FloatArray
from groundstation.base.errors import GroundstationError
from groundstation.base.runways.table import RunwayTable
from groundstation.base.units import M_PER_FOOT

SHIPPED = Path(__file__).with_name("runways.npz")
FORMAT = 1
UNIT_DEG = 1e-6
UNKNOWN_FT = -32_768
MOST_BYTES = 20_000_000
UNREADABLE = (
    *(OSError, ValueError, LookupError, TypeError, AttributeError, EOFError),
    *(zipfile.BadZipFile, zlib.error, MemoryError),
)
NEXT_STEP = "make it again by groundstation runways update FILE, or remove it"


def user_file() -> Path:
    """Return the file of the user's own table; it need not exist."""
    if configured := os.environ.get("XDG_DATA_HOME"):
        base = Path(configured)
    elif sys.platform == "win32":
        base = Path(os.environ.get("LOCALAPPDATA") or Path.home() / "AppData/Local")
    else:
        base = Path(os.environ.get("HOME") or "~").expanduser() / ".local" / "share"
    return base / "groundstation" / "runways.npz"


def runways() -> RunwayTable:
    """Return the user's table where there is one, else the shipped one.

    Raises
    ------
    GroundstationError
        When the user's table cannot be read.
    """
    path = user_file()
    try:
        state = path.stat()
    except OSError:
        return shipped_runways()
    return _read(path, state.st_mtime_ns, state.st_size)


def usable_runways() -> tuple[RunwayTable, str]:
    """Return the table in use, and why it is not the user's where that one cannot be read."""
    try:
        return runways(), ""
    except GroundstationError as error:
        return shipped_runways(), str(error)


def shipped_runways() -> RunwayTable:
    """Return the table that comes with groundstation."""
    return _read(SHIPPED, 0, 0)


@lru_cache(maxsize=2)
def _read(path: Path, _modified_ns: int, _size: int) -> RunwayTable:
    try:
        if path.stat().st_size > MOST_BYTES:
            raise GroundstationError(str(path), "too large", f"at most {MOST_BYTES} bytes", NEXT_STEP)
        with np.load(path, allow_pickle=False) as kept:
            return _of_arrays({name: kept[name] for name in kept.files})
    except UNREADABLE as error:
        raise GroundstationError(
            str(path), f"not a table of runways ({type(error).__name__})", "one that runways update made", NEXT_STEP
        ) from error


def bytes_of(table: RunwayTable) -> bytes:
    """Return a table as the file that :func:`runways` reads."""
    about = {name: getattr(table, name) for name in ("source", "licence", "dated", "digest", "rows", "left_out")}
    surfaces, surface = np.unique(table.surface, return_inverse=True)
    places = np.stack([*_whole(table.latitude_deg / UNIT_DEG), *_whole(table.longitude_deg / UNIT_DEG)])
    arrays = {
        "about": np.frombuffer(json.dumps({"format": FORMAT, **about}, sort_keys=True).encode(), np.uint8),
        "airport": np.char.encode(table.airport, "ascii"),
        "name": np.char.encode(table.name, "ascii"),
        "surfaces": np.char.encode(surfaces, "ascii"),
        "surface": surface.astype(np.uint16),
        "first": places[[0, 2]],
        "second_less_first": places[[1, 3]] - places[[0, 2]],
        "elevation_ft": _feet(table.elevation_m),
        "displaced_ft": _feet(table.displaced_m),
        "length_ft": _feet(table.length_m),
        "width_ft": _feet(table.width_m),
        "is_closed": table.is_closed,
    }
    out = BytesIO()
    np.savez_compressed(out, **arrays)
    return out.getvalue()


def _whole(values: FloatArray) -> NDArray[np.int32]:
    return np.asarray(np.rint(values), dtype=np.int32)


def _feet(values_m: FloatArray) -> NDArray[np.int16]:
    return np.asarray(np.where(np.isfinite(values_m), np.rint(values_m / M_PER_FOOT), UNKNOWN_FT), dtype=np.int16)


def _metres(values_ft: NDArray[Any]) -> FloatArray:
    return np.asarray(np.where(values_ft == UNKNOWN_FT, np.nan, values_ft * M_PER_FOOT), dtype=np.float64)


def _of_arrays(kept: dict[str, NDArray[Any]]) -> RunwayTable:
    """Make the table of its arrays.

    Raises
    ------
    ValueError, LookupError, TypeError, AttributeError
        When they are not those of a table.
    """
    about = json.loads(kept["about"].tobytes())
    if about.pop("format") != FORMAT:
        raise ValueError("another format")
    first = kept["first"].astype(np.int64)
    places = np.stack([first, first + kept["second_less_first"]]) * UNIT_DEG  # end, axis, row
    table = RunwayTable(
        source=str(about["source"]),
        licence=str(about["licence"]),
        dated=str(about["dated"]),
        digest=str(about["digest"]),
        rows=int(about["rows"]),
        left_out={str(name): int(count) for name, count in dict(about["left_out"]).items()},
        airport=kept["airport"].astype(np.str_),
        surface=kept["surfaces"].astype(np.str_)[kept["surface"]],
        name=kept["name"].astype(np.str_),
        latitude_deg=places[:, 0],
        longitude_deg=places[:, 1],
        elevation_m=_metres(kept["elevation_ft"]),
        displaced_m=_metres(kept["displaced_ft"]),
        length_m=_metres(kept["length_ft"]),
        width_m=_metres(kept["width_ft"]),
        is_closed=kept["is_closed"].astype(np.bool_),
    )
    _require_whole(table)
    return table


def _require_whole(table: RunwayTable) -> None:
    """Require arrays of one length, in order, with places on Earth; they become read-only.

    Raises
    ------
    ValueError
        When they are not so.
    """
    rows = (table.airport, table.surface, table.length_m, table.width_m, table.is_closed)
    ends = (table.name, table.latitude_deg, table.longitude_deg, table.elevation_m, table.displaced_m)
    if any(one.shape != (len(table),) for one in rows) or any(one.shape != (2, len(table)) for one in ends):
        raise ValueError("arrays of other lengths")
    if np.any(np.diff(table.latitude_deg[0]) < 0.0):
        raise ValueError("rows in another order")
    if np.any(np.abs(table.latitude_deg) > 90.0) or np.any(np.abs(table.longitude_deg) > 180.0):
        raise ValueError("places that are not on Earth")
    if not np.all(table.displaced_m >= 0.0):
        raise ValueError("displacements that cannot be")
    for array in (*rows, *ends):
        array.setflags(write=False)
