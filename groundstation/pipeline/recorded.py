"""Recorded robots from their folders: logs through the store into tables, and from these a session to run on."""

import tempfile
from collections.abc import Sequence
from pathlib import Path

from groundstation.base.errors import GroundstationError, UsageError
from groundstation.base.findings import Finding
from groundstation.base.records import Damage, RecordBatch
from groundstation.pipeline.convert import convert_log
from groundstation.pipeline.log import open_log
from groundstation.readers import utias
from groundstation.readers.source import Source
from groundstation.store.reader import read
from groundstation.studies.recorded import RecordedSet
from groundstation.tables.assemble import flight_from_batches
from groundstation.tables.session import GroundPoint
from groundstation.tables.session_robots import session_of_robots
from groundstation.tables.table import Flight

BARCODES, LANDMARKS = "barcodes", "landmark_groundtruth"  # how the names of the tables of a UTIAS set begin


def recorded_sets(folder: Path) -> tuple[RecordedSet, ...]:
    """The sets in a folder and below it, in the order of their paths.

    Raises
    ------
    UsageError
        When there is no such folder, or no set in it.
    GroundstationError
        When a set cannot be used at all.
    """
    if not folder.is_dir():
        raise UsageError(str(folder), "no folder", "a folder with the files of a set")
    found = []
    for place in sorted({path.parent for path in folder.rglob("*") if path.is_file()}):
        files = sorted(path for path in place.iterdir() if path.is_file())
        if any(path.name.lower().startswith(BARCODES) for path in files):
            found.append(_utias(place, files))
    if not found:
        raise UsageError(str(folder), "no set of recorded robots", "Barcodes.dat with the files of its robots")
    return tuple(found)


def _utias(place: Path, files: Sequence[Path]) -> RecordedSet:
    """A set with a table of barcodes: one of landmarks, and three logs of each robot."""
    barcode_file, landmark_file = (_only(place, files, start) for start in (BARCODES, LANDMARKS))
    numbers, bad = utias.barcodes(Source(barcode_file))
    marks, more = utias.landmarks(Source(landmark_file))
    findings = [_of_damage(damage, name) for name, part in ((BARCODES, bad), (LANDMARKS, more)) for damage in part]
    others = [path for path in files if path not in (barcode_file, landmark_file)]
    flights = _flights(others, findings)
    points = tuple(GroundPoint(f"L{mark.subject}", (mark.north_m, mark.east_m, 0.0)) for mark in marks)
    places = {point.name for point in points}
    subjects = {
        str(barcode): f"L{subject}" if f"L{subject}" in places else f"R{subject}"
        for barcode, subject in numbers.items()
    }
    robots = session_of_robots(flights, points, subjects)
    findings += robots.findings
    if not robots.session.vehicles:
        raise GroundstationError(str(place), f"no robot to run ({'; '.join(finding.text for finding in findings)})")
    return RecordedSet(place.name, "utias", robots.session, robots.truth, tuple(findings))


def _only(place: Path, files: Sequence[Path], start: str) -> Path:
    found = [path for path in files if path.name.lower().startswith(start)]
    if len(found) != 1:
        raise UsageError(str(place), f"{len(found)} files named {start}*", "one")
    return found[0]


def _of_damage(damage: Damage, place: str) -> Finding:
    return Finding("warn", "session.lost_data", f"{damage.count} {damage.what}", place=place, count=damage.count)


def _flights(files: Sequence[Path], findings: list[Finding]) -> list[Flight]:
    """Tables of all logs, each by way of an MCAP; a file that nobody can read is a finding."""
    flights = []
    with tempfile.TemporaryDirectory() as folder:
        for number, path in enumerate(files):
            try:
                log, target = open_log(path), Path(folder) / f"{number}.mcap"
                converted = convert_log(log, target)
            except GroundstationError as error:
                findings.append(Finding("warn", "session.unreadable", str(error), place=path.name))
                continue
            if converted.has_lost_data:
                text = f"{path.name} lost data; `groundstation check` tells what"
                findings.append(Finding("warn", "session.lost_data", text, place=path.name))
            info = converted.info
            batches = (item for item in read(target) if isinstance(item, RecordBatch))
            flights.append(
                flight_from_batches(batches, metadata=info.metadata, has_utc=info.has_utc, source_name=info.source_name)
            )
    return flights
