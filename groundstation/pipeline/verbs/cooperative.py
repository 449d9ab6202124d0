"""Verb ``cooperative``: the logs of several aircraft, named one by one, as a session."""

from collections.abc import Sequence
from pathlib import Path

from groundstation.base.errors import UsageError
from groundstation.pipeline.many_flights.fleet.index import rows_without_flight, write_index_of
from groundstation.pipeline.many_flights.inputs import file_in, is_session
from groundstation.pipeline.many_flights.runs.out_folder import alone_in, prepare, refuse_foreign
from groundstation.pipeline.many_flights.sessions.job import SessionJob, load_stations
from groundstation.pipeline.many_flights.sessions.session import run_one
from groundstation.pipeline.one_flight.configuration import Configuration
from groundstation.pipeline.one_flight.log import Log, open_log
from groundstation.pipeline.one_flight.outcome import Outcome, reason_of
from groundstation.pipeline.one_flight.progress import Event, Listener, silent
from groundstation.results.files import load_manifest


def run_session(
    paths: Sequence[Path],
    out: Path,
    configuration: Configuration,
    *,
    stations: Path | None = None,
    force: bool = False,
    fail_on: str = "none",
    with_pdf: bool = False,
    listen: Listener = silent,
) -> tuple[Outcome, ...]:
    """Analyse the logs of several aircraft together, into ``<out>/<session_id>/``.

    Parameters
    ----------
    paths : sequence of Path
        Logs of any format a reader knows, MCAPs, flight folders, or the folder of a session: its logs again.
    out : Path
        A session in it with the same logs, stations, settings and versions is not run again.
    configuration : Configuration
    stations : Path, optional
        TOML file with the ground stations.

    Returns
    -------
    tuple of Outcome
        Of the session, behind those of the logs that could not be read.

    Raises
    ------
    UsageError
        When a path is missing, a setting is wrong, or ``out`` is something else's.
    """
    ground = load_stations(stations)
    files = [file for path in paths for file in _files_of(path)]
    refuse_foreign(out, force)
    listen(Event("begin", total=1))
    logs, failed = _opened(files, configuration)
    if not logs:
        return failed
    job = SessionJob(logs, ground, out, configuration, fail_on, with_pdf)
    with alone_in(out):
        prepare(out)
        outcome = run_one(job, listen)
        problems = write_index_of(out, (*failed, outcome), rows_without_flight(out))
    listen(Event("end", outcome.source, outcome.text))
    return (*failed, outcome, *problems)


def _files_of(path: Path) -> list[Path]:
    """Return a log, the MCAP of a flight folder, or those of the flights of a session."""
    if not path.exists():
        raise UsageError(str(path), "no such file")
    if is_session(path):
        return [path / log.mcap for log in load_manifest(path).logs]
    return [file_in(path, ".mcap") if path.is_dir() else path]


def _opened(files: Sequence[Path], configuration: Configuration) -> tuple[tuple[Log, ...], tuple[Outcome, ...]]:
    """Return the logs that a reader claims, by digest, and the outcomes of the others."""
    logs, failed = [], []
    for path in dict.fromkeys(files):
        try:
            logs.append(open_log(path, configuration.profile_path, configuration.icds))
        except Exception as error:
            reason, trace = reason_of(path.name, error)
            failed.append(Outcome(str(path), "failed", reason, trace=trace))
    return tuple(sorted(logs, key=lambda log: (log.source.sha256, log.source.name))), tuple(failed)
