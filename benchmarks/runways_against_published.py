"""Thresholds of the runway table against published ones: the sigmas of ``base/runways/table.py``.

The published ones are those of the UK's aeronautical publication, as the folder ``Airports`` of
https://github.com/VATSIM-UK/UK-Sector-File has them (a clone of it; GPL, nothing of it is kept here)::

    python benchmarks/runways_against_published.py UK-Sector-File/Airports [runways.npz]
"""

import argparse
import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from groundstation.base.geodesy import north_east_m
from groundstation.base.runways.kept import shipped_runways
from groundstation.base.runways.table import RunwayDirection

LINE = re.compile(r"(\w+) +(\w+) +\d+ +\d+ +(\S+) +(\S+) +(\S+) +(\S+?)(?=\d\d[LRCG]? |\s|$)")
FARTHEST_M = 1_000.0  # farther apart, runways of the same name are not the same


def degrees(text: str) -> float:
    """Read degrees, minutes and seconds: N051.28.39.000."""
    whole, minutes, seconds = text[1:].split(".", 2)
    value = int(whole) + int(minutes) / 60.0 + float(seconds) / 3600.0
    return -value if text[0] in "SW" else value


def published(folder: Path) -> Iterator[tuple[str, str, float, float]]:
    """Yield airport, runway, latitude and longitude of published thresholds."""
    for path in sorted(folder.glob("*/Runway.txt")):
        for first, second, *places in LINE.findall(path.read_text(encoding="utf-8", errors="replace")):
            for name, at in ((first, 0), (second, 2)):
                yield path.parent.name, name, degrees(places[at]), degrees(places[at + 1])


def differences(one: RunwayDirection, latitude_deg: float, longitude_deg: float) -> tuple[float, float]:
    """Return how far a threshold lies along and across from the published one."""
    north, east = north_east_m(one.latitude_deg, one.longitude_deg, latitude_deg, longitude_deg)
    course = np.deg2rad(one.true_course_deg)
    along = float(north * np.cos(course) + east * np.sin(course))
    return along, float(east * np.cos(course) - north * np.sin(course))


def main() -> None:
    """Print the differences along and across, and how many sigmas they are."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    given = parser.parse_args()
    table, rows = shipped_runways(), []
    by_name: dict[str, list[RunwayDirection]] = {}
    missing = 0
    for airport, name, latitude_deg, longitude_deg in published(given.folder):
        listed = by_name.setdefault(airport, list(table.of_airport(airport)))
        one = next((item for item in listed if item.name == name), None)
        if one is None:
            missing += 1
            continue
        along, across = differences(one, latitude_deg, longitude_deg)
        rows.append((along, across, one.along_sigma_m, one.across_sigma_m, one.displaced_m > 0.0, one.full_name))
    along, across, along_sigma, across_sigma = np.array([row[:4] for row in rows]).T
    displaced = np.array([row[4] for row in rows])
    near = np.hypot(along, across) < FARTHEST_M
    print(f"{table.version}: {len(rows)} thresholds compared, {missing} published ones are not in the table")
    print("farther than 1 km:", ", ".join(row[5] for row, is_near in zip(rows, near, strict=True) if not is_near))
    for title, which in (("all", near), ("displaced", near & displaced), ("not displaced", near & ~displaced)):
        for axis, value, sigma in (("along", along, along_sigma), ("across", across, across_sigma)):
            some, scaled = np.abs(value[which]), np.abs(value[which] / sigma[which])
            half, most, nearly = np.quantile(some, [0.5, 0.9, 0.95])
            print(
                f"{title:14s}{axis:7s} n {some.size:4d}  50 % {half:5.1f} m  90 % {most:5.1f} m  95 % {nearly:6.1f} m"
                f"  within 1 sigma {np.mean(scaled < 1.0):.2f}  within 1.96 sigma {np.mean(scaled < 1.96):.2f}"
            )
    worst = sorted(
        (row for row, is_near in zip(rows, near, strict=True) if is_near), key=lambda row: -np.hypot(*row[:2])
    )
    for row in worst[:12]:
        print(f"  {row[5]:10s} along {row[0]:7.1f} ({row[2]:.0f})  across {row[1]:7.1f} ({row[3]:.0f})")


if __name__ == "__main__":
    main()
