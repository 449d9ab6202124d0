"""Plan of a run: what it would do of each log, found without running any."""

from collections.abc import Sequence
from functools import partial
from pathlib import Path

from groundstation.base.errors import UnclaimedLogError, UsageError
from groundstation.pipeline.many_flights.fleet.scan import Scan, scan
from groundstation.pipeline.many_flights.inputs import is_remote
from groundstation.pipeline.many_flights.runs.known_flights import KnownFlights
from groundstation.pipeline.many_flights.runs.listed_logs import inputs_of, skipped_files, with_steps, without_parts
from groundstation.pipeline.many_flights.runs.out_folder import refuse_foreign
from groundstation.pipeline.many_flights.runs.strangers import Strangers
from groundstation.pipeline.many_flights.sessions.found import (
    STATIONS_TOML,
    FoundSessions,
    SessionOptions,
    find_sessions,
)
from groundstation.pipeline.many_flights.sessions.job import load_stations, planned_session
from groundstation.pipeline.one_flight.configuration import Configuration
from groundstation.pipeline.one_flight.flight import Job
from groundstation.pipeline.one_flight.log import open_log
from groundstation.pipeline.one_flight.outcome import Outcome, reason_of
from groundstation.pipeline.one_flight.resume import TO_DO


def plan_many(
    paths: Sequence[Path | str],
    out: Path | str,
    configuration: Configuration,
    *,
    with_pdf: bool = False,
    redo: bool = False,
    stations: Path | None = None,
    only_results: bool = False,
) -> tuple[Outcome, ...]:
    """Say what ``run_many`` would do of each log, and of the sessions among finished flights.

    Nothing is written.

    Raises
    ------
    UsageError
        As ``run_many``, and for logs or results elsewhere, which would have to be fetched first.
    """
    if any(is_remote(str(place)) for place in (out, *paths)):
        raise UsageError("--dry-run", "logs or results elsewhere", "local ones")
    inputs, out = inputs_of(paths, out, configuration), Path(out)
    refuse_foreign(out, force=True)
    before = scan(out)
    known = KnownFlights(None if redo else out)
    make = partial(Job, out=out, configuration=configuration, with_pdf=with_pdf, only_results=only_results)
    work = [make(Path(one.url), is_named=one.is_named) for one in inputs]
    found = {} if configuration.profile is not None else without_parts(skipped_files(inputs, Strangers(out)), known)
    for number, job, twin in with_steps(work, known, found):
        if twin is not None and job.finished is not None and len(job.finished.parts) > 1:
            text = f"part of {job.finished.flight_id}, with {work[twin].name}"
            found[number] = Outcome(work[number % len(work)].log, "done", text, was_finished=job.step == "nothing")
        elif twin is not None:
            found[number] = Outcome(job.log, "done", f"same content as {work[twin].log}, listed once")
        else:
            found[number] = _planned(job)
    outcomes = [outcome for _, outcome in sorted(found.items())]
    ground = None if stations is None else load_stations(stations)
    asked = SessionOptions(out, configuration, ground, "none", with_pdf, redo, only_results=only_results)
    return (*outcomes, *_planned_sessions(asked, before, outcomes))


def _planned(job: Job) -> Outcome:
    """Outcome that a log would have."""
    if job.finished is not None:
        is_there = job.step == "nothing"
        return Outcome(job.log, "done", TO_DO[job.step], flight_id=job.finished.flight_id, was_finished=is_there)
    try:
        open_log(job.path, job.configuration.profile_path)
    except UnclaimedLogError as error:
        return Outcome(job.log, "failed" if job.is_named else "skipped", str(error))
    except Exception as error:
        return Outcome(job.log, "failed", reason_of(job.name, error)[0])
    return Outcome(job.log, "done", TO_DO[job.step])


def _planned_sessions(asked: SessionOptions, among: Scan, planned: Sequence[Outcome]) -> list[Outcome]:
    """Sessions among the finished flights.

    Those of unread logs are looked for, where stations are given.
    """
    flight_ids = {one.flight_id for one in planned if one.flight_id}
    found = find_sessions(asked, among, flight_ids) if flight_ids else FoundSessions()
    sessions = [*map(planned_session, found.jobs), *(one for one in found.told if one.state == "failed")]
    logs = [one for one in planned if one.state == "done"]
    unread = [one.source for one in logs if one.text == TO_DO["everything"]]
    has_stations = asked.stations is not None or any(Path(log).with_name(STATIONS_TOML).is_file() for log in unread)
    if unread and len(logs) > 1 and has_stations:
        text = "looked for among the flights once the logs are read"
        sessions.append(Outcome("sessions", "done", text, is_session=True))
    return sessions
