"""Sessions that a run finds among its flights.

They are jobs on the MCAPs just made, with the stations beside the logs.
"""

from collections.abc import Callable, Sequence
from collections.abc import Set as AbstractSet
from contextlib import suppress
from pathlib import Path

from groundstation.base.dataclasses import dataclass
from groundstation.base.errors import GroundstationError, SettingsError
from groundstation.base.findings import Finding
from groundstation.pipeline.many_flights.fleet.scan import Scan
from groundstation.pipeline.many_flights.inputs import file_in, is_remote
from groundstation.pipeline.many_flights.sessions.job import SessionJob, load_stations, sessions_of
from groundstation.pipeline.many_flights.sessions.search import (
    Member,
    Span,
    heard_span_ns,
    members_of,
    ranging_with,
    sessions_among,
)
from groundstation.pipeline.one_flight.configuration import Configuration
from groundstation.pipeline.one_flight.flight import remove
from groundstation.pipeline.one_flight.log import open_log
from groundstation.pipeline.one_flight.outcome import Outcome, reason_of
from groundstation.results.files import load_manifest
from groundstation.tables.session_settings import Stations

STATIONS_TOML = "stations.toml"  # beside the logs


@dataclass(frozen=True)
class SessionOptions:
    """Options of a run for its sessions; the fields are those of :class:`SessionJob`.

    ``stations`` is None where no file was named: then there may be one beside the logs. ``mcap_in`` gives the MCAP of a
    flight folder. ``store`` is the table that takes the rows of the flights; empty without one.
    """

    out: Path
    configuration: Configuration
    stations: Stations | None
    fail_on: str
    with_pdf: bool
    redo: bool = False
    mcap_in: Callable[[Path], Path] = lambda folder: file_in(folder, ".mcap")
    only_results: bool = False
    store: str = ""
    is_copy: bool = False


@dataclass(frozen=True)
class FoundSessions:
    """Sessions to run, and what is told of flights in none and of logs that cannot be opened."""

    jobs: tuple[SessionJob, ...] = ()
    told: tuple[Outcome, ...] = ()


def find_sessions(asked: SessionOptions, found: Scan, flight_ids: AbstractSet[str]) -> FoundSessions:
    """Find the sessions in which one of these flights takes part.

    Any other flight of the folder may be in them.
    """
    if not any(one.hears for one in members_of(found, flight_ids)):
        return FoundSessions()
    members = ranging_with(found, flight_ids)
    groups, apart = sessions_among(members, lambda folder: _heard(asked.mcap_in, folder), flight_ids)
    jobs: list[SessionJob] = []
    told: list[Outcome] = []
    for group in groups:
        if flight_ids.isdisjoint(one.folder.name for one in group):
            continue
        names = ", ".join(one.folder.name for one in group)
        try:
            jobs.append(_job(asked, group))
        except Exception as error:
            reason, trace = reason_of(f"session of {names}", error)
            told.append(Outcome(names, "failed", reason, trace=trace, is_session=True))
    told += [Outcome(one.folder.name, "skipped", f"{one.folder.name}: {one.reason}", is_session=True) for one in apart]
    return FoundSessions(tuple(jobs), tuple(told))


def _heard(mcap_in: Callable[[Path], Path], folder: Path) -> Span | None:
    """Span that a flight heard, by :func:`heard_span_ns`.

    None where its MCAP cannot be read, which its own row tells.
    """
    try:
        return heard_span_ns(mcap_in(folder))
    except (GroundstationError, OSError):
        return None


def _job(asked: SessionOptions, group: Sequence[Member]) -> SessionJob:
    logs = [open_log(asked.mcap_in(one.folder)) for one in group]
    stations, notes = (asked.stations, ()) if asked.stations is not None else _stations_beside(group)
    return SessionJob(
        tuple(sorted(logs, key=lambda log: (log.source.sha256, log.source.name))),
        stations,
        asked.out,
        asked.configuration,
        asked.fail_on,
        asked.with_pdf,
        asked.redo,
        is_found=True,
        notes=notes,
        only_results=asked.only_results,
        is_copy=asked.is_copy,
    )


def _stations_beside(group: Sequence[Member]) -> tuple[Stations, tuple[Finding, ...]]:
    """Ground stations of the file beside the logs.

    None where there is no file, or where several differ.
    """
    sources = [load_manifest(one.folder).source.path for one in group]
    folders = {Path(path).parent for path in sources if path and not is_remote(path)}
    found: list[Stations] = []
    for folder in sorted(folders):
        file = folder / STATIONS_TOML
        if not file.is_file():
            continue
        try:
            found.append(load_stations(file))
        except SettingsError as error:
            text = f"no ground stations: {STATIONS_TOML} beside the logs cannot be used ({error.found})"
            return Stations(), (Finding("warn", "session.stations", text, place=STATIONS_TOML),)
    if not found:
        return Stations(), ()
    if any(one != found[0] for one in found):
        text = f"no ground stations: {len(found)} files {STATIONS_TOML} beside the logs differ; name one by --stations"
        return Stations(), (Finding("warn", "session.stations", text, place=STATIONS_TOML),)
    text = f"ground stations and origin are those of {STATIONS_TOML} beside the logs"
    return found[0], (Finding("info", "session.stations", text, place=STATIONS_TOML),)


def sweep_sessions(done: Sequence[tuple[SessionJob, Outcome]]) -> None:
    """Remove sessions that an earlier run found of the same flights, and that are others now."""
    placed = {outcome.flight_id for _, outcome in done}
    logs = {log.source.sha256 for job, outcome in done if outcome.flight_id for log in job.logs}
    for folder, manifest in sessions_of(done[0][0].out):
        is_of_these = not logs.isdisjoint(log.sha256 for log in manifest.logs)
        if manifest.is_found and is_of_these and folder.name not in placed:
            with suppress(OSError, GroundstationError):  # the next run tries again
                remove(folder)
