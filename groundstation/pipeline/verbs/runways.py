"""``runways``: the table of runways, asked for a place or an airport, and updated."""

import os
import re
import tempfile
from datetime import UTC, date, datetime
from pathlib import Path
from typing import Any

from groundstation.base.dataclasses import dataclass
from groundstation.base.errors import GroundstationError, UnknownNameError, UsageError
from groundstation.base.runways.kept import MOST_BYTES, bytes_of, shipped_runways, usable_runways, user_file
from groundstation.base.runways.ourairports import read_ourairports
from groundstation.base.runways.table import RunwayDirection, RunwayTable
from groundstation.base.serial import to_json
from groundstation.base.to_disk import sync_file, sync_folder

FARTHEST_KM = 200.0
MOST_SHOWN = 100
EXPECTED = "an identifier of OurAirports such as ENGM; runways near LAT LON lists those of a place"


@dataclass(frozen=True)
class TableInUse:
    """The table in use, the file it stands in, and why it is not the user's own."""

    version: str
    source: str
    licence: str
    dated: str
    digest: str
    file: str
    runways: int
    rows: int
    left_out: dict[str, int]
    problem: str = ""


@dataclass(frozen=True)
class NearRunway:
    """A direction of a runway, and its distance from the place asked for.

    None where an airport was asked for.
    """

    runway: RunwayDirection
    distance_m: float | None = None


@dataclass(frozen=True)
class FoundRunways:
    """Directions of runways that were asked for, with the table they stand in."""

    table: TableInUse
    found: tuple[NearRunway, ...]

    def to_dict(self) -> dict[str, Any]:
        """Return plain JSON values."""
        rows = [{**to_json(one.runway), "distance_m": one.distance_m} for one in self.found]
        return {"table": to_json(self.table), "runways": rows}


def table_in_use() -> TableInUse:
    """Return what is known of the table in use."""
    return _told(*usable_runways())


def _told(table: RunwayTable, problem: str) -> TableInUse:
    is_shipped = table is shipped_runways()
    return TableInUse(
        version=table.version,
        source=table.source,
        licence=table.licence,
        dated=table.dated,
        digest=table.digest,
        file="shipped" if is_shipped else str(user_file()),
        runways=len(table),
        rows=table.rows,
        left_out=table.left_out,
        problem=problem,
    )


def runways_near(latitude_deg: float, longitude_deg: float, within_km: float) -> FoundRunways:
    """Return directions of runways near a place, the nearest first.

    Raises
    ------
    UsageError
        For a place that is not on Earth.
    """
    for name, value, most in (("LAT", latitude_deg, 90.0), ("LON", longitude_deg, 180.0)):
        if not abs(value) <= most:
            raise UsageError(name, f"{value:g}", f"degrees within {most:g}")
    if not 0.0 < within_km <= FARTHEST_KM:
        raise UsageError("--within", f"{within_km:g} km", f"more than 0, at most {FARTHEST_KM:g} km")
    table, problem = usable_runways()
    near = table.near(latitude_deg, longitude_deg, 1000.0 * within_km)[:MOST_SHOWN]
    found = tuple(NearRunway(one, one.distance_m(latitude_deg, longitude_deg)) for one in near)
    return FoundRunways(_told(table, problem), found)


def runways_of(ident: str) -> FoundRunways:
    """Return directions of the runways of an airport, or of one runway: "ENGM", "ENGM 01L".

    Raises
    ------
    UsageError
        When the table has no such airport or runway; :class:`UnknownNameError` where similar names are known.
    """
    table, problem = usable_runways()
    airport, _, name = ident.strip().partition(" ")
    listed = table.of_airport(airport)
    if not listed:
        likely = {str(one) for one in table.airport if str(one)[:2] == airport.upper()[:2]}
        if not likely:
            raise UsageError("runways", f"no {airport!r}", EXPECTED)
        raise UnknownNameError("runways", airport, sorted(likely))
    some = [one for one in listed if not name or one.name == name.strip().upper()]
    if not some:
        raise UnknownNameError(f"runways of {airport.upper()}", name.strip(), [one.name for one in listed])
    return FoundRunways(_told(table, problem), tuple(NearRunway(one) for one in some))


def update_runways(file: Path, dated: str = "") -> TableInUse:
    """Make the user's table of a downloaded ``runways.csv``.

    The one before it stays where that fails.

    ``dated`` is the ISO date of the file; empty: the day on which it was last modified.

    Raises
    ------
    GroundstationError
        When the file is no such table, or the user's folder cannot be written.
    """
    if dated and not re.fullmatch(r"\d{4}-\d\d-\d\d", dated):
        raise UsageError("--dated", repr(dated), "a date such as 2026-08-22")
    try:
        day = date.fromisoformat(dated) if dated else datetime.fromtimestamp(file.stat().st_mtime, UTC).date()
    except ValueError as error:
        raise UsageError("--dated", repr(dated), "a date such as 2026-08-22") from error
    except OSError as error:
        raise GroundstationError(
            str(file), error.strerror or "cannot be read", "a runways.csv of OurAirports"
        ) from error
    table = read_ourairports(file, day.isoformat())
    write_table(table, user_file())
    return table_in_use()


def write_table(table: RunwayTable, target: Path) -> None:
    """Write a table in one step: a reader sees the old one or the new one.

    Raises
    ------
    GroundstationError
        When it cannot be written.
    """
    content = bytes_of(table)
    if len(content) > MOST_BYTES:
        raise GroundstationError(str(target), f"{len(content)} bytes", f"at most {MOST_BYTES}", "leave out rows")
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        number, name = tempfile.mkstemp(dir=target.parent, prefix=f".{target.name}.")
        try:
            with os.fdopen(number, "wb") as out:
                out.write(content)
            sync_file(Path(name))
            Path(name).replace(target)
        except OSError:
            Path(name).unlink(missing_ok=True)
            raise
        sync_folder(target.parent)
    except OSError as error:
        raise GroundstationError(str(target), error.strerror or "cannot be written", "a folder to write to") from error
