"""Reading of ``runways.csv`` of OurAirports.

Source: https://ourairports.com/data, public domain, unofficial.

Rows without the coordinates of both ends, helipads and impossible places are left out and counted by reason.
"""

import csv
import gzip
import hashlib
import io
import zlib
from collections import Counter
from collections.abc import Iterator, Mapping
from pathlib import Path

import numpy as np

from groundstation.base.errors import GroundstationError, lack_of_memory
from groundstation.base.geodesy import north_east_m
from groundstation.base.runways.table import LONGEST_M, RunwayTable
from groundstation.base.units import M_PER_FOOT
from groundstation.base.words import counted

SOURCE, LICENCE = "OurAirports", "Unlicense (public domain); unofficial"
MOST_BYTES = 64_000_000  # of the text; the file of 2026 has 4 MB
MOST_ROWS = 1_000_000
ENDS = ("le", "he")
NEEDED = (
    *("airport_ident", "length_ft", "width_ft", "surface", "closed"),
    *(
        f"{end}_{name}"
        for end in ENDS
        for name in ("ident", "latitude_deg", "longitude_deg", "elevation_ft", "displaced_threshold_ft")
    ),
)
SHORTEST_M = 50.0
NO_COORDINATES = "without coordinates of both ends"
NOT_A_RUNWAY = "helipads"
IMPOSSIBLE = "with impossible values"
APART = f"with ends nearer than {SHORTEST_M:.0f} m or farther than {LONGEST_M / 1000:.0f} km apart"
LOWEST_FT, HIGHEST_FT, MOST_FT = -1_500.0, 20_000.0, 30_000.0
LONGEST_NAME, LONGEST_SURFACE = 8, 24
EXPECTED = "a runways.csv of OurAirports"
NEXT_STEP = "download it from https://ourairports.com/data"


def read_ourairports(path: Path, dated: str) -> RunwayTable:
    """Make a table of a ``runways.csv``, which may be gzipped.

    Raises
    ------
    GroundstationError
        When the file is no such table, or holds no runway.
    """
    content = _content(path)
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise GroundstationError(f"{path}, byte {error.start}", "no text in UTF-8", EXPECTED, NEXT_STEP) from error
    left_out: Counter[str] = Counter()
    kept: list[_Kept] = []
    rows = 0
    for row in _rows(path, text):
        rows += 1
        found = _runway(row)
        if isinstance(found, str):
            left_out[found] += 1
        else:
            kept.append(found)
    if not kept:
        raise GroundstationError(str(path), f"no runway in {counted(rows, 'row')}", EXPECTED, NEXT_STEP)
    kept.sort(key=lambda one: (one[3][0], one[0], one[1]))
    airport, names, surface, latitude, longitude, elevation, displaced, length, width, closed = zip(*kept, strict=True)
    return RunwayTable(
        source=SOURCE,
        licence=LICENCE,
        dated=dated,
        digest=hashlib.sha256(content).hexdigest(),
        rows=rows,
        left_out=dict(sorted(left_out.items())),
        airport=np.array(airport),
        surface=np.array(surface),
        name=np.array(names).T,
        latitude_deg=np.array(latitude).T,
        longitude_deg=np.array(longitude).T,
        elevation_m=np.array(elevation).T * M_PER_FOOT,
        displaced_m=np.array(displaced).T * M_PER_FOOT,
        length_m=np.array(length) * M_PER_FOOT,
        width_m=np.array(width) * M_PER_FOOT,
        is_closed=np.array(closed, dtype=np.bool_),
    )


Pair = tuple[float, float]
_Kept = tuple[str, tuple[str, str], str, Pair, Pair, Pair, Pair, float, float, bool]


def _content(path: Path) -> bytes:
    """Return the text of a file, unpacked."""
    try:
        with path.open("rb") as file:
            is_packed = file.read(2) == b"\x1f\x8b"
        with gzip.open(path, "rb") if is_packed else path.open("rb") as file:
            content = file.read(MOST_BYTES + 1)
    except (OSError, EOFError, zlib.error) as error:
        reason = getattr(error, "strerror", None) or "a damaged gzip file"
        raise GroundstationError(str(path), reason, EXPECTED, NEXT_STEP) from error
    except MemoryError as error:
        raise GroundstationError(str(path), lack_of_memory(error), "", "free memory") from error
    if len(content) > MOST_BYTES:
        raise GroundstationError(str(path), f"more than {MOST_BYTES // 1_000_000} MB", EXPECTED, NEXT_STEP)
    return content


def _rows(path: Path, text: str) -> Iterator[Mapping[str, str | None]]:
    """Yield the rows of a table of text by the names of its columns."""
    reader = csv.DictReader(io.StringIO(text, newline=""))
    try:
        missing = [name for name in NEEDED if name not in (reader.fieldnames or ())]
        if missing:
            raise GroundstationError(str(path), f"no column {missing[0]}", EXPECTED, NEXT_STEP)
        for row in reader:
            if reader.line_num > MOST_ROWS:
                raise GroundstationError(str(path), f"more than {MOST_ROWS} rows", EXPECTED, NEXT_STEP)
            yield row
    except csv.Error as error:
        raise GroundstationError(f"{path}, row {reader.line_num}", str(error), EXPECTED, NEXT_STEP) from error


def _runway(row: Mapping[str, str | None]) -> "_Kept | str":
    """Return a row as numbers, or why it is left out."""
    names = _text(row, "le_ident"), _text(row, "he_ident")
    if any(name[:1] == "H" for name in names):
        return NOT_A_RUNWAY
    texts = [row.get(f"{end}_{axis}_deg") or "" for end in ENDS for axis in ("latitude", "longitude")]
    if not all(text.strip() for text in texts):
        return NO_COORDINATES
    try:
        first_latitude, first_longitude, second_latitude, second_longitude = (float(text) for text in texts)
        elevation, displaced = (
            (_feet(row, f"le_{name}", *limits), _feet(row, f"he_{name}", *limits))
            for name, limits in (("elevation_ft", (LOWEST_FT, HIGHEST_FT)), ("displaced_threshold_ft", (0.0, MOST_FT)))
        )
        displaced = (max(0.0, displaced[0]), max(0.0, displaced[1]))  # NaN: none
        length, width = (_feet(row, name, 0.0, MOST_FT) for name in ("length_ft", "width_ft"))
    except ValueError:
        return IMPOSSIBLE
    airport, surface = _text(row, "airport_ident"), _text(row, "surface")[:LONGEST_SURFACE]
    latitude, longitude = (first_latitude, second_latitude), (first_longitude, second_longitude)
    is_named = airport and all(name.isascii() and name.isprintable() for name in (airport, *names, surface))
    is_short = max(len(airport), *(len(name) for name in names)) <= LONGEST_NAME
    is_on_earth = all(abs(one) <= 90.0 for one in latitude) and all(abs(one) <= 180.0 for one in longitude)
    between_m = float(np.hypot(*north_east_m(second_latitude, second_longitude, *(first_latitude, first_longitude))))
    if not (is_named and is_short and is_on_earth) or max(displaced) >= (length or np.inf):
        return IMPOSSIBLE
    if not SHORTEST_M <= between_m <= LONGEST_M:
        return APART
    is_closed = _text(row, "closed") == "1"
    return airport, names, surface, latitude, longitude, elevation, displaced, length, width, is_closed


def _text(row: Mapping[str, str | None], name: str) -> str:
    return (row.get(name) or "").strip()


def _feet(row: Mapping[str, str | None], name: str, lowest: float, highest: float) -> float:
    """Return a number of a row, NaN where there is none.

    Raises
    ------
    ValueError
        When it is no number, or one that cannot be.
    """
    text = _text(row, name)
    value = float(text) if text else np.nan
    if text and not lowest <= value <= highest:
        raise ValueError(name)
    return value
