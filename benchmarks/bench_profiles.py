"""Tables read by a profile against the same table as a flat CSV, by turns in one run: ratios of processor time.

Every table has the same rows and columns; they differ in how cells are parted, in units, and in how angles are written.
"""

import argparse
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

from benchmarks.record import ROUNDS, Book, Goal, by_turns
from groundstation.base.records import RecordBatch
from groundstation.readers import registry

ROWS, GOAL = 100_000, Goal(1.1)
# Name in the profile, field, unit of the profile, format of the cells.
COLUMNS = (
    ("Lat", "ins.latitude_deg", "deg", "%.8f"),
    ("Lon", "ins.longitude_deg", "deg", "%.8f"),
    ("Alt", "ins.altitude_msl_m", "m", "%.3f"),
    ("VN", "ins.velocity_north_mps", "mps", "%.4f"),
    ("VE", "ins.velocity_east_mps", "mps", "%.4f"),
    ("VD", "ins.velocity_down_mps", "mps", "%.4f"),
    ("Roll", "ins.roll_deg", "deg", "%.5f"),
    ("Pitch", "ins.pitch_deg", "deg", "%.5f"),
    ("Hdg", "ins.true_heading_deg", "deg", "%.5f"),
    ("GLat", "gnss.latitude_deg", "deg", "%.8f"),
    ("GLon", "gnss.longitude_deg", "deg", "%.8f"),
    ("GAlt", "gnss.altitude_msl_m", "m", "%.3f"),
    ("GVN", "gnss.velocity_north_mps", "mps", "%.4f"),
    ("GVE", "gnss.velocity_east_mps", "mps", "%.4f"),
    ("GVD", "gnss.velocity_down_mps", "mps", "%.4f"),
    ("Hdop", "gnss.hdop", "", "%.2f"),
    ("Amps", "electric.current_a", "a", "%.2f"),
)
OTHER_UNITS = {"deg": "rad", "m": "ft", "mps": "kt"}
RAW = ("EGT1", "EGT2", "CHT1", "OilP", "Volt")  # columns that no rule names


@dataclass(frozen=True)
class Table:
    """A table and its profile; a flat CSV has none."""

    title: str
    log: Path
    profile: Path | None = None


def values_of(rows: int) -> dict[str, np.ndarray]:
    """The columns of a flight that turns, by their names in the profile, and the time."""
    rng, time_s = np.random.default_rng(1), np.arange(rows) / 50.0
    heading = np.mod(30.0 + 0.5 * time_s, 360.0)
    north, east = 60.0 * np.cos(np.deg2rad(heading)), 60.0 * np.sin(np.deg2rad(heading))
    motion = {
        "Lat": 47.5 + np.cumsum(north) / 50.0 / 111_000.0,
        "Lon": 8.5 + np.cumsum(east) / 50.0 / 75_000.0,
        "Alt": 900.0 + 20.0 * np.sin(time_s / 60.0),
        "VN": north,
        "VE": east,
        "VD": np.cos(time_s / 60.0) / 3.0,
    }
    noisy = {f"G{name}": one + rng.normal(0.0, 1e-6 if "L" in name else 0.02, rows) for name, one in motion.items()}
    attitude = {"Roll": 20.0 * np.sin(time_s / 20.0), "Pitch": 3.0 * np.cos(time_s / 30.0), "Hdg": heading}
    other = {"Hdop": 0.8 + rng.random(rows) / 10.0, "Amps": 4.0 + rng.random(rows)}
    raw = {name: 100.0 * at + rng.normal(0.0, 2.0, rows) for at, name in enumerate(RAW, start=1)}
    return {"t": time_s, **motion, **attitude, **noisy, **other, **raw}


def dms(value_deg: float) -> str:
    """An angle as degrees, minutes and seconds with blanks between."""
    second = round(abs(value_deg) * 3_600e5)
    sign, (minute, second) = "-" if value_deg < 0 else "", divmod(second, 60 * 10**5)
    return f"{sign}{minute // 60} {minute % 60:02d} {second / 1e5:08.5f}"


def cells_of(values: dict[str, np.ndarray], angles: Callable[[float], str] | None = None) -> list[list[str]]:
    """The cells of each column; positions by ``angles``."""
    found = [[f"{one:.2f}" for one in values["t"].tolist()]]
    for name, _field, _unit, form in COLUMNS:
        is_place = angles is not None and name.endswith(("Lat", "Lon"))
        found.append([angles(one) if is_place else form % one for one in values[name].tolist()])  # type: ignore[misc]
    return found


def in_other_units(values: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """The values as a recorder in radians, feet and knots has them."""
    factors = {"deg": np.pi / 180.0, "m": 1.0 / 0.3048, "mps": 3600.0 / 1852.0}
    units = {name: unit for name, _field, unit, _form in COLUMNS}
    return {name: one * factors.get(units.get(name, ""), 1.0) for name, one in values.items()}


def profile_of(folder: Path, name: str, head: str, units: dict[str, str], dms_names: Sequence[str] = ()) -> Path:
    """Write a profile of the columns."""
    lines = [f'name = "{name}"', head, "[columns]"]
    for column, field, unit, _form in COLUMNS:
        given = "dms" if column in dms_names else units.get(unit, unit)
        lines.append(f'{column} = {{ field = "{field}", unit = "{given}" }}')
    path = folder / f"{name}.toml"
    path.write_text("\n".join(lines) + "\n")
    return path


def tables(folder: Path, rows: int) -> tuple[list[Table], ...]:
    """Tables that have the same columns, a flat CSV first: without raw columns, with them, with a key."""
    values = values_of(rows)
    names, fields = [name for name, *_rest in COLUMNS], [field for _name, field, *_rest in COLUMNS]
    time = '[time]\nkind = "seconds"\ncolumn = "t"'
    plain, angles = cells_of(values), cells_of(values, dms)
    places = [name for name in names if name.endswith(("Lat", "Lon"))]
    raw = [[f"{one:.1f}" for one in values[name].tolist()] for name in RAW]

    def written(name: str, head: Sequence[str], columns: Sequence[Sequence[str]], delimiter: str) -> Path:
        path = folder / name
        lines = (delimiter.join(row) for row in zip(*columns, strict=True))
        path.write_text("\n".join([delimiter.join(head), *lines, ""]))
        return path

    widths = [max(map(len, column)) + 1 for column in plain]
    wide = [
        [cell.rjust(width) for cell in (name, *column)]
        for name, column, width in zip(("t", *names), plain, widths, strict=True)
    ]
    spaced = "\n".join([*map("".join, zip(*wide, strict=True)), ""])
    blanks, fixed = folder / "blanks.txt", folder / "fixed.txt"
    blanks.write_text(spaced)
    fixed.write_text(spaced)
    keyed = [*plain, [("4b1814", "4b1815", "3c6444")[at // 50 % 3] for at in range(rows)]]
    flat = Table("flat CSV", written("flat.csv", ("time_s", *fields), plain, ","))
    by_profile = [
        Table("comma", written("comma.csv", ("t", *names), plain, ","), profile_of(folder, "comma", time, {})),
        Table(
            "comma, other units",
            written("units.csv", ("t", *names), cells_of(in_other_units(values)), ","),
            profile_of(folder, "units", time, OTHER_UNITS),
        ),
        Table(
            "comma, texts that mean missing",
            written("missing.csv", ("t", *names), plain, ","),
            profile_of(folder, "missing", f'missing = ["N/A", "-", 9999]\n{time}', {}),
        ),
        Table(
            "comma, degrees minutes seconds",
            written("dms.csv", ("t", *names), angles, ","),
            profile_of(folder, "dms", time, {}, places),
        ),
        Table(
            "blanks, columns of 14",
            written(
                "wide.txt",
                [name.rjust(14) for name in ("t", *names)],
                [[one.rjust(14) for one in c] for c in plain],
                "",
            ),
            profile_of(folder, "wide", f'[recognise]\ndelimiter = "blanks"\n{time}', {}),
        ),
        Table("blanks", blanks, profile_of(folder, "blanks", f'[recognise]\ndelimiter = "blanks"\n{time}', {})),
        Table(
            "blanks, degrees minutes seconds",
            written("blanks_dms.txt", ("t", *names), angles, "   "),
            profile_of(folder, "blanks_dms", f'[recognise]\ndelimiter = "blanks"\n{time}', {}, places),
        ),
        Table(
            "fixed width",
            fixed,
            profile_of(folder, "fixed", f"[recognise]\nwidths = {widths}\n{time}", {}),
        ),
    ]
    with_raw = [
        Table("flat CSV, raw columns", written("flat_raw.csv", ("time_s", *fields, *RAW), [*plain, *raw], ",")),
        Table(
            "comma, raw columns",
            written("comma_raw.csv", ("t", *names, *RAW), [*plain, *raw], ","),
            profile_of(folder, "comma_raw", time, {}),
        ),
        Table(
            "blanks, raw columns",
            written("blanks_raw.txt", ("t", *names, *RAW), [*plain, *raw], "  "),
            profile_of(folder, "blanks_raw", f'[recognise]\ndelimiter = "blanks"\n{time}', {}),
        ),
    ]
    with_key = [
        Table("flat CSV, a column of text", written("flat_text.csv", ("time_s", *fields, "id"), keyed, ",")),
        Table(
            "comma, three vehicles",
            written("keyed.csv", ("t", *names, "id"), keyed, ","),
            profile_of(folder, "keyed", f'[key]\ncolumn = "id"\n{time}', {}),
        ),
    ]
    return [flat, *by_profile], with_raw, with_key


def read(table: Table) -> int:
    """Read a table to batches; returns the number of values."""
    batches = (one for one in registry.read(table.log, table.profile) if isinstance(one, RecordBatch))
    return sum(len(one) * len(one.columns) for one in batches)


def main() -> None:
    """Record the ratio of each table to the flat CSV of its group."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--rows", type=int, default=ROWS)
    options = parser.parse_args()
    with Book("profiles") as book, tempfile.TemporaryDirectory() as folder:
        for group in tables(Path(folder), options.rows):
            counts = {read(table) for table in group}  # compiles, and fills what is kept
            assert len(counts) == 1, counts
            times = by_turns({table.title: partial(read, table) for table in group}, ROUNDS)
            flat, *others = group
            for table in others:
                what = f"table of {table.log.stat().st_size / 1e6:.0f} MB by a profile: {table.title}"
                book.against(what, times[table.title], times[flat.title], flat.title, goal=GOAL)


if __name__ == "__main__":
    main()
