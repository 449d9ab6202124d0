"""Recorded robots from their folders: a session made of logs, store and tables."""

import re
import tempfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from groundstation.base.errors import GroundstationError, UsageError
from groundstation.base.findings import Finding
from groundstation.base.records import Damage, RecordBatch
from groundstation.pipeline.one_flight.convert import convert_log
from groundstation.pipeline.one_flight.log import open_log
from groundstation.readers.source import Source
from groundstation.store.reader import read
from groundstation.tables.assemble import flight_from_batches
from groundstation.tables.session import GroundPoint, Session
from groundstation.tables.table import Flight
from recorded_robots import miluv, utias
from recorded_robots.antennas import Antenna, AntennaLog, antenna_ranges, poses_of, start_ns
from recorded_robots.reckoning import drifting_reckoning
from recorded_robots.robots import SEES, session_of_robots
from recorded_robots.study import RecordedSet

TAGS, ANCHORS = "tags.yaml", "anchors.yaml"  # of a MILUV set
LOG_SUFFIXES = (".csv", ".gz", ".zst")
MURP_PAIR = re.compile(r"(\d+)_base-(\d+)_targ-(\d+)")
MURP_RING = {  # antennas of an agent, forward, right, down: the true distances of the data fit it to 4 mm
    number: (
        0.32 * float(np.cos(np.deg2rad(60.0 * number - 30.0))),
        -0.32 * float(np.sin(np.deg2rad(60.0 * number - 30.0))),
        -0.055,
    )
    for number in range(1, 7)
}
RANGE_SIGMA_M = {"miluv": 0.1, "murp": 0.09}  # of one range
DRAWS = {"miluv": 10, "murp": 2}  # of simulated dead reckoning: as many as take a few minutes
FIRST_SEED = 90_000
BARCODES, LANDMARKS = "barcodes", "landmark_groundtruth"  # how the names of the tables of a UTIAS set begin


def recorded_sets(folder: Path) -> tuple[RecordedSet, ...]:
    """Return the sets in a folder and below it, in the order of their paths.

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
        elif any(path.name.lower() == TAGS for path in files):
            found += [_miluv(place, files)]
        else:
            found += _murp(place, files)
    if not found:
        raise UsageError(str(folder), "no set of recorded robots", "Barcodes.dat, tags.yaml or MURP pairs, with logs")
    return tuple(found)


def _utias(place: Path, files: Sequence[Path]) -> RecordedSet:
    """Return a set with a table of barcodes, one of landmarks, and three logs per robot."""
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
    return RecordedSet(place.name, "utias", (robots.session,), robots.truth, tuple(findings))


def _miluv(place: Path, files: Sequence[Path]) -> RecordedSet:
    """Return a set with a table of tags: one of anchors, and one log of all vehicles."""
    tag_file, anchor_file = _only(place, files, TAGS), _only(place, files, ANCHORS)
    tags, constellations = (miluv.arms(Source(path)) for path in (tag_file, anchor_file))
    name, anchors = next(iter(constellations.items()))
    findings = [Finding("info", "session.anchors", f"anchors of the constellation {name!r}, the first of the file")]
    antennas = {str(tag): Antenna(owner, arm) for owner, own in tags.items() for tag, arm in own.items()}
    antennas |= {str(anchor): Antenna(f"N{anchor}") for anchor in anchors}
    flights = _flights([path for path in files if path.suffix in LOG_SUFFIXES and "ange" in path.name], findings)
    points = tuple(GroundPoint(f"N{anchor}", where) for anchor, where in anchors.items())
    logs = [AntennaLog(flight, (antennas, antennas), {owner: owner for owner in tags}) for flight in flights]
    return _with_reckoning(place.name, "miluv", logs, points, findings)


def _murp(place: Path, files: Sequence[Path]) -> list[RecordedSet]:
    """Return logs of pairs, one set for every run whose number they begin with."""
    runs: dict[str, list[tuple[Path, re.Match[str]]]] = {}
    for path in files:
        if pair := MURP_PAIR.match(path.name):
            runs.setdefault(pair.group(1), []).append((path, pair))
    sets = []
    for run, pairs in runs.items():
        findings: list[Finding] = []
        logs = []
        for path, pair in pairs:
            names = {"A": f"M{pair.group(2)}", "B": f"M{pair.group(3)}"}
            sides = tuple(
                {str(number): Antenna(names[side], arm) for number, arm in MURP_RING.items()} for side in "AB"
            )
            for flight in _flights([path], findings):
                logs.append(AntennaLog(flight, (sides[0], sides[1]), names))
        sets.append(_with_reckoning(f"{place.name} {run}", "murp", logs, (), findings))
    return sets


def _with_reckoning(
    name: str, kind: str, logs: Sequence[AntennaLog], points: tuple[GroundPoint, ...], findings: list[Finding]
) -> RecordedSet:
    """Return a set whose dead reckoning is made from its truth, in several draws."""
    zero_ns = start_ns(logs)
    poses = poses_of(logs, zero_ns)
    if not poses:
        raise GroundstationError(name, f"no poses ({'; '.join(finding.text for finding in findings)})")
    sessions = []
    for draw in range(DRAWS[kind]):
        rng = np.random.default_rng([FIRST_SEED, draw])
        drawn = [drifting_reckoning(one, rng) for one in poses.values()]
        believed = {one.name: one for _, one in drawn}
        ranges, found = antenna_ranges(logs, believed, [point.name for point in points], zero_ns, RANGE_SIGMA_M[kind])
        vehicles = tuple(track for track, _ in drawn)
        sessions.append(Session("local", vehicles, points, ranges, ranks=dict.fromkeys(poses, SEES)))
    truth = {one.name: (one.time_s, one.position_m) for one in poses.values()}
    return RecordedSet(name, kind, tuple(sessions), truth, (*findings, *found))


def _only(place: Path, files: Sequence[Path], start: str) -> Path:
    found = [path for path in files if path.name.lower().startswith(start)]
    if len(found) != 1:
        raise UsageError(str(place), f"{len(found)} files named {start}*", "one")
    return found[0]


def _of_damage(damage: Damage, place: str) -> Finding:
    return Finding("warn", "session.lost_data", f"{damage.count} {damage.what}", place=place, count=damage.count)


def _flights(files: Sequence[Path], findings: list[Finding]) -> list[Flight]:
    """Return tables of all logs, each by way of an MCAP; an unreadable file is a finding."""
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
                text = f"{path.name} lost data; `groundstation check` shows what"
                findings.append(Finding("warn", "session.lost_data", text, place=path.name))
            info = converted.info
            batches = (item for item in read(target) if isinstance(item, RecordBatch))
            flights.append(
                flight_from_batches(batches, metadata=info.metadata, has_utc=info.has_utc, source_name=info.source_name)
            )
    return flights
