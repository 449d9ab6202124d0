"""Several logs: each in its turn, several at once or on a cluster, one bad log never stopping the others."""

import math
import tempfile
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import closing
from dataclasses import replace
from functools import cache, partial
from pathlib import Path, PurePath

from groundstation.base.errors import UnclaimedLogError, UsageError
from groundstation.pipeline.many_flights.consecutive import flights_of_parts
from groundstation.pipeline.many_flights.delta_sink import delta_place, put_flights
from groundstation.pipeline.many_flights.fleet_store import Scan, refresh, scan
from groundstation.pipeline.many_flights.found_sessions import (
    STATIONS_TOML,
    Asked,
    FoundSessions,
    find_sessions,
    run_sessions,
)
from groundstation.pipeline.many_flights.inputs import collect, is_ours, session_folders
from groundstation.pipeline.many_flights.known_flights import KnownFlights
from groundstation.pipeline.many_flights.out_folder import alone_in, clear_unfinished, prepare, refuse_foreign
from groundstation.pipeline.many_flights.output import LocalOutput, RemoteOutput
from groundstation.pipeline.many_flights.placement import Placement
from groundstation.pipeline.many_flights.publishing import FLEET_FILES, write_beside, write_index_of
from groundstation.pipeline.many_flights.remote import FarLog, far_logs, is_remote
from groundstation.pipeline.many_flights.remote_runs import RemoteJob, digest_remote, run_remote
from groundstation.pipeline.many_flights.session import load_stations, planned_session
from groundstation.pipeline.many_flights.workers import TASKS_PER_PROCESS, AnyJob, Crew, in_turn, side_by_side
from groundstation.pipeline.one_flight.configuration import Configuration
from groundstation.pipeline.one_flight.cores import cores, painters_of
from groundstation.pipeline.one_flight.flight import Job, run_flight
from groundstation.pipeline.one_flight.identity import plain_id
from groundstation.pipeline.one_flight.log import open_log
from groundstation.pipeline.one_flight.outcome import Outcome, reason_of
from groundstation.pipeline.one_flight.progress import Event, Listener, silent
from groundstation.pipeline.one_flight.resume import Finished, Keys
from groundstation.results.manifest import PartOfRun

PLANS: Mapping[str, str] = {
    "everything": "to run",
    "analysis": "to analyse again: a setting changed, or a file is missing; the MCAP stays",
    "reports": "to report again",
    "nothing": "finished, nothing to do",
}


def run_many(
    paths: Sequence[Path | str],
    out: Path | str,
    configuration: Configuration,
    *,
    jobs: int = 0,
    scheduler: str = "",
    force: bool = False,
    fail_on: str = "none",
    with_pdf: bool = True,
    redo: bool = False,
    stations: Path | None = None,
    only_results: bool = False,
    timeout_s: float = math.inf,
    store: str = "",
    strangers: Sequence[Path] = (),
    listen: Listener = silent,
) -> tuple[Outcome, ...]:
    """Run logs and folders of logs into ``out``, then the sessions among the flights; the index lists all of them.

    What an earlier run finished, with the same logs and settings, is not done again unless ``redo`` is set. Interrupted
    or killed, it keeps what was finished.

    Parameters
    ----------
    paths, out
        Paths, or URLs that fsspec reaches (``s3://bucket/logs``).
    jobs : int
        Processes on this machine; 0: one per core.
    scheduler : str
        Address of a Dask scheduler, whose workers do the work; they see local paths as this machine does.
    stations : Path, optional
        TOML file with the ground stations of the sessions; left out: stations.toml beside the logs of each.
    only_results : bool
        Neither recordings nor reports, of flights or of all; a later run without it makes them.
    timeout_s : float
        A log, or a session, that takes longer has failed, and the process that ran it is ended.
    store : str
        ``delta:`` and a path or URL: a Delta table that takes the rows of these flights, too.
    strangers : sequence of Path
        Files that no reader claims: they are skipped, unless one goes on from a log.

    Returns
    -------
    tuple of Outcome
        One per log, in the stable order of the inputs, then one per session.

    Raises
    ------
    UsageError
        When an input is missing, there is nothing to run, a setting is wrong, ``out`` is something else's, another run
        is writing into it, or there is no such scheduler.
    """
    ground = None if stations is None else load_stations(stations)
    if store:
        delta_place(store)
    odd = [FarLog(str(path), is_named=False, size=path.stat().st_size) for path in strangers]
    inputs = tuple(sorted((*_inputs(paths, out, configuration, is_alone=not odd), *odd), key=lambda one: one.url))
    crew = _crew(scheduler, jobs or cores(), len(inputs), listen, timeout_s)
    painters = 1 if scheduler else painters_of(jobs or cores(), len(inputs))
    make = partial(
        Job,
        configuration=configuration,
        fail_on=fail_on,
        with_pdf=with_pdf,
        only_results=only_results,
        painters=painters,
    )
    listen(Event("begin", total=len(inputs)))
    asked = Asked(
        Path(out),
        configuration,
        ground,
        fail_on,
        with_pdf,
        redo,
        only_results=only_results,
        store=store,
        painters=jobs or cores(),
    )
    if any(is_remote(str(place)) for place in (out, *paths)):
        remote = [
            RemoteJob(make(Path(), Path(), is_named=one.is_named), one.url, str(out), redo, one.size) for one in inputs
        ]
        return _run_remote(remote, asked, crew, force, listen)
    near = [make(Path(one.url), Path(out), is_named=one.is_named) for one in inputs]
    refresher = _crew(scheduler, jobs or cores(), TASKS_PER_PROCESS + 1, listen)
    return _run_here(near, asked, crew, force, listen, refresher)


def run_together(
    paths: Sequence[Path | str],
    out: Path | str,
    configuration: Configuration,
    *,
    force: bool = False,
    fail_on: str = "none",
    with_pdf: bool = True,
    only_results: bool = False,
    listen: Listener = silent,
) -> tuple[Outcome, ...]:
    """Run several logs of one flight as that flight; see :func:`groundstation.pipeline.one_flight.join.join_logs`.

    The logs are read and joined each time; parameters as of :func:`run_many`.

    Raises
    ------
    UsageError
        As :func:`run_many`; when fewer than two logs are named, one of them twice, or one is a folder or elsewhere.
    """
    from groundstation.pipeline.one_flight.join import join_files

    if any(is_remote(str(place)) for place in (out, *paths)):
        raise UsageError("--together", "logs or results elsewhere", "local ones")
    named = " + ".join(PurePath(path).name for path in paths)
    refuse_foreign(Path(out), force)
    listen(Event("begin", total=1))
    with tempfile.TemporaryDirectory(prefix="groundstation-") as folder:
        try:
            mcap = Path(folder) / "joined.mcap"
            join_files([Path(path) for path in paths], mcap, configuration, listen)
        except UsageError:
            raise
        except Exception as error:
            reason, trace = reason_of(named, error)
            listen(Event("end", named, reason))
            return (Outcome(named, "failed", reason, trace=trace),)
        job = Job(
            mcap,
            Path(out),
            configuration,
            fail_on,
            with_pdf=with_pdf,
            url=named,
            only_results=only_results,
            painters=cores(),
        )
        asked = Asked(Path(out), configuration, None, fail_on, with_pdf, redo=True, only_results=only_results)
        return _run_here([job], asked, partial(in_turn, listen=listen), force, listen)


def _run_here(
    work: Sequence[Job], asked: Asked, crew: Crew, force: bool, listen: Listener, refresher: Crew | None = None
) -> tuple[Outcome, ...]:
    out = asked.out
    refuse_foreign(out, force)
    with alone_in(out):
        prepare(out)
        known = KnownFlights(None if asked.redo else out)
        placement = Placement(LocalOutput(out), [job.log for job in work])

        def left() -> Iterator[tuple[int, Job]]:
            for number, job, twin in _with_steps(work, known):
                flight = job.finished
                if twin is None:
                    yield number, job
                elif flight is not None and len(flight.parts) > 1:
                    placement.put_part(number, twin, flight.flight_id, "", was_finished=job.step == "nothing")
                    listen(Event("end", job.name, "part of a flight"))
                else:
                    placement.put_twin(number, Outcome(job.log, "skipped", ""), twin)
                    listen(Event("end", job.name, "same content as another log"))

        def suffixed(number: int) -> Job:
            return replace(work[number % len(work)], add_suffix=True, power_up=placement.power_up(number))

        _run_into(placement, out, left(), run_flight, suffixed, crew, listen, len(work))
        apart = _run_joined(placement, work, known, crew, listen)
        clear_unfinished(out)  # of processes that died or took too long
        found, unwritten = _swept(placement, out, refresher)
        sessions = _run_sessions(placement, asked, found, crew, listen)
        outcomes = (*placement.outcomes(), *sessions)
        found = found.with_sessions(one.flight_id for one in sessions if one.flight_id)
        problems = _write_beside(out, outcomes, asked, found)
        stored = put_flights(asked.store, found, outcomes) if asked.store else ()
        return (*outcomes, *apart, *unwritten, *problems, *stored)


def _run_joined(
    placement: Placement, work: Sequence[Job], known: KnownFlights, crew: Crew, listen: Listener
) -> tuple[Outcome, ...]:
    """Run as one flight the consecutive logs among those in place; returns what could not be joined, and why."""
    found = flights_of_parts(placement.flights(), known, work[0].configuration)
    if not found:
        return ()
    tasks: list[tuple[int, Job]] = []
    for number, stretch in enumerate(found):
        first = placement.flights()[stretch.numbers[0]]
        add_suffix = bool(first.flight_id) and plain_id(first.flight_id, first.sha256) != first.flight_id
        tasks.append((number, work[stretch.numbers[0] % len(work)].of_parts(stretch.parts, add_suffix=add_suffix)))
    apart = []
    with closing(crew(tasks, run_flight)) as ended:
        for number, outcome in ended:
            stretch = found[number]
            listen(Event("end", tasks[number][1].name, outcome.text))
            problem = placement.put_joined(stretch.numbers, outcome)
            apart += [problem] if problem else []
    return tuple(apart)


def _write_beside(out: Path, outcomes: Sequence[Outcome], asked: Asked, found: Scan) -> tuple[Outcome, ...]:
    """Write everything that stands beside the flights of a run; returns what went wrong."""
    return write_beside(
        out,
        outcomes,
        with_pdf=asked.with_pdf,
        only_results=asked.only_results,
        found=found,
        painters=asked.painters,
    )


def _swept(placement: Placement, out: Path, crew: Crew | None = None) -> tuple[Scan, tuple[Outcome, ...]]:
    """Bring the dataset of flights up to date, flights that these logs have no longer being removed."""
    found, unwritten = refresh(out, crew)
    return refresh(out) if placement.sweep(found) else (found, unwritten)


def _run_sessions(placement: Placement, asked: Asked, among: Scan, crew: Crew, listen: Listener) -> tuple[Outcome, ...]:
    """Run the sessions among the flights that are in place; interrupted, the index at least is written."""
    flights = placement.outcomes()
    try:
        found = find_sessions(asked, among, {one.flight_id for one in flights if one.flight_id})
        if found.jobs:
            listen(Event("begin", total=len(flights) + len(found.jobs)))
        return run_sessions(found, crew, listen)
    except BaseException:
        write_index_of(asked.out, flights)
        raise


def _run_remote(
    work: Sequence[RemoteJob], asked: Asked, crew: Crew, force: bool, listen: Listener
) -> tuple[Outcome, ...]:
    def suffixed(number: int) -> RemoteJob:
        one = work[number % len(work)]
        job = replace(one.job, add_suffix=True, power_up=placement.power_up(number))
        return replace(one, job=job, redo=True)

    with tempfile.TemporaryDirectory(prefix="groundstation-") as folder:
        copy = Path(folder)
        output = RemoteOutput(work[0].out, copy)
        output.refuse_foreign(force=force)
        with output.alone():
            output.copy_all()
            placement = Placement(output, [one.log for one in work])
            is_whole = False
            try:
                tasks = _once(work, placement, crew, listen)
                _run_into(placement, copy, tasks, run_remote, suffixed, crew, listen, len(work))
                found, unwritten = _swept(placement, copy)
                sessions = _run_remote_sessions(placement, output, asked, found, listen)
                outcomes = (*placement.outcomes(), *sessions)
                found = found.with_sessions(one.flight_id for one in sessions if one.flight_id)
                beside = _write_beside(copy, outcomes, asked, found)
                stored = put_flights(asked.store, found, outcomes) if asked.store else ()
                problems = (*unwritten, *beside, *stored)
                is_whole = True
            finally:
                output.publish(FLEET_FILES, is_whole=is_whole)
            return (*outcomes, *problems)


def _once(
    work: Sequence[RemoteJob], placement: Placement, crew: Crew, listen: Listener
) -> Iterator[tuple[int, RemoteJob]]:
    """The jobs by number, without those whose content another one before them has.

    Only logs of one size can be equal: those are fetched for their digests first.
    """
    like = Counter(job.size for job in work)
    alike = [(number, job) for number, job in enumerate(work) if like[job.size] > 1]
    digests: dict[int, str] = {}
    if alike:
        with closing(crew(alike, digest_remote)) as ended:
            digests = {number: outcome.sha256 for number, outcome in ended if outcome.sha256}
    first: dict[str, int] = {}
    for number, job in enumerate(work):
        kept = first.setdefault(digests[number], number) if number in digests else number
        if kept == number:
            yield number, job
        else:
            placement.put_twin(number, Outcome(job.log, "skipped", "", sha256=digests[number]), kept)
            listen(Event("end", job.name, "same content as another log"))


def _run_remote_sessions(
    placement: Placement, output: RemoteOutput, asked: Asked, among: Scan, listen: Listener
) -> tuple[Outcome, ...]:
    """Run the sessions in the copy of an OUT elsewhere, in this process, where the MCAPs are fetched to."""
    before = session_folders(output.root)
    here = replace(asked, out=output.root, mcap_in=output.mcap_in)
    outcomes = _run_sessions(placement, here, among, partial(in_turn, listen=listen), listen)
    sent = []
    for outcome in outcomes:
        if outcome.folder:
            output.send_session(outcome.flight_id)
        sent.append(replace(outcome, folder=outcome.flight_id))
    for folder in before:
        if not folder.exists():
            output.discard(folder.name)
    return tuple(sent)


def _run_into(
    placement: Placement,
    out: Path,
    tasks: Iterable[tuple[int, AnyJob]],
    run: Callable[[AnyJob, Listener], Outcome],
    suffixed: Callable[[int], AnyJob],
    crew: Crew,
    listen: Listener,
    logs: int,
) -> None:
    """Carry out jobs and put their flights into place; interrupted, the index at least is written.

    ``logs`` is how many logs there are: the flights of a log have its number, and that and multiples of their count.
    """
    try:
        with closing(crew(tasks, run)) as ended:  # closed at once when something is wrong here: its processes end
            for number, outcome in ended:
                listen(Event("end", PurePath(outcome.source).name, outcome.text))
                placement.put(number, replace(outcome, more=()))
                for place, other in enumerate(outcome.more, start=1):
                    placement.put(number + place * logs, other)
        clashing = placement.clashing()
        if clashing:
            with closing(crew(((number, suffixed(number)) for number in clashing), run)) as ended:
                for number, outcome in ended:
                    placement.put_again(number, outcome)
    except BaseException:
        write_index_of(out, placement.outcomes())
        raise


def _crew(scheduler: str, workers: int, logs: int, listen: Listener, timeout_s: float = math.inf) -> Crew:
    """Who does the work: a cluster, processes, or this process alone, where there is little and no limit of time."""
    if scheduler:
        from groundstation.pipeline.many_flights.cluster import on_cluster

        return partial(on_cluster, scheduler=scheduler, timeout_s=timeout_s)
    if min(workers, logs) <= 1 and logs <= TASKS_PER_PROCESS and math.isinf(timeout_s):
        return partial(in_turn, listen=listen)
    return partial(side_by_side, workers=min(workers, logs), listen=listen, timeout_s=timeout_s)


def plan_many(
    paths: Sequence[Path | str],
    out: Path | str,
    configuration: Configuration,
    *,
    with_pdf: bool = True,
    redo: bool = False,
    stations: Path | None = None,
    only_results: bool = False,
) -> tuple[Outcome, ...]:
    """Say what :func:`run_many` would do of each log, and of the sessions among finished flights; nothing is written.

    Raises
    ------
    UsageError
        As :func:`run_many`, and for logs or results elsewhere, which would have to be fetched first.
    """
    if any(is_remote(str(place)) for place in (out, *paths)):
        raise UsageError("--dry-run", "logs or results elsewhere", "local ones")
    inputs, out = _inputs(paths, out, configuration), Path(out)
    refuse_foreign(out, force=True)
    before = scan(out)
    known = KnownFlights(None if redo else out)
    make = partial(Job, out=out, configuration=configuration, with_pdf=with_pdf, only_results=only_results)
    work = [make(Path(one.url), is_named=one.is_named) for one in inputs]
    outcomes = []
    for number, job, twin in _with_steps(work, known):
        if twin is not None and job.finished is not None and len(job.finished.parts) > 1:
            text = f"part of {job.finished.flight_id}, with {work[twin].name}"
            outcomes.append(Outcome(work[number % len(work)].log, "done", text, was_finished=job.step == "nothing"))
        elif twin is not None:
            outcomes.append(Outcome(job.log, "done", f"same content as {work[twin].log}, listed once"))
        else:
            outcomes.append(_planned(job))
    ground = None if stations is None else load_stations(stations)
    asked = Asked(out, configuration, ground, "none", with_pdf, redo, only_results=only_results)
    return (*outcomes, *_planned_sessions(asked, before, outcomes))


def _planned(job: Job) -> Outcome:
    """What would become of a log."""
    if job.finished is not None:
        is_there = job.step == "nothing"
        return Outcome(job.log, "done", PLANS[job.step], flight_id=job.finished.flight_id, was_finished=is_there)
    try:
        open_log(job.path, job.configuration.profile_path)
    except UnclaimedLogError as error:
        return Outcome(job.log, "failed" if job.is_named else "skipped", str(error))
    except Exception as error:
        return Outcome(job.log, "failed", reason_of(job.name, error)[0])
    return Outcome(job.log, "done", PLANS[job.step])


def _planned_sessions(asked: Asked, among: Scan, planned: Sequence[Outcome]) -> list[Outcome]:
    """Sessions among the finished flights; that those of unread logs are looked for, where stations are given."""
    flight_ids = {one.flight_id for one in planned if one.flight_id}
    found = find_sessions(asked, among, flight_ids) if flight_ids else FoundSessions()
    sessions = [*map(planned_session, found.jobs), *(one for one in found.told if one.state == "failed")]
    logs = [one for one in planned if one.state == "done"]
    unread = [one.source for one in logs if one.text == PLANS["everything"]]
    has_stations = asked.stations is not None or any(Path(log).with_name(STATIONS_TOML).is_file() for log in unread)
    if unread and len(logs) > 1 and has_stations:
        text = "looked for among the flights once the logs are read"
        sessions.append(Outcome("sessions", "done", text, is_session=True))
    return sessions


def _inputs(
    paths: Sequence[Path | str], out: Path | str, configuration: Configuration, *, is_alone: bool = True
) -> tuple[FarLog, ...]:
    """Logs by path or URL, in a stable order; there may be none where they do not stand alone."""
    near = [Path(path) for path in paths if not is_remote(str(path))]
    found = {log.url: log for path in paths if is_remote(str(path)) for log in far_logs(str(path))}
    judges = {path.resolve() for path in configuration.references.paths}  # in a folder they are no logs to run
    for one in collect(near, None if is_remote(str(out)) else Path(out)):
        if one.is_named or one.path.resolve() not in judges:
            found[str(one.path)] = FarLog(str(one.path), one.is_named, one.path.stat().st_size)
    if not found and is_alone:
        hint = "output of groundstation is no input" if any(path.is_dir() and is_ours(path) for path in near) else ""
        raise UsageError(", ".join(map(str, paths)), "no log in it", "", hint)
    return tuple(log for _, log in sorted(found.items()))


def _with_steps(jobs: Sequence[Job], known: KnownFlights) -> Iterator[tuple[int, Job, int | None]]:
    """Jobs by number, with what is to be done of each, and the number of an earlier one that gives its flight.

    That is one with the same log, or with another part of the flight. A log whose flights of several power-ups are
    finished has a job for each of them.
    """
    first: dict[str, int] = {}
    numbers = {str(job.path.absolute()): number for number, job in enumerate(jobs)}
    asked = cache(lambda number: jobs[number].asked())

    @cache
    def digest(number: int) -> str:
        found = asked(number)
        return found[0] if found else jobs[number].digest()

    def is_as_it_was(part: PartOfRun) -> bool:
        return part.path not in numbers or digest(numbers[part.path]) == part.sha256

    for number, job in enumerate(jobs):
        found = known.of(digest(number)) if len(known) else ()
        for place, planned in enumerate(_with_step(job, asked(number) if found else None, found, is_as_it_was)):
            flight = planned.finished
            kept = number if flight is None else first.setdefault(flight.sha256, number)
            yield number + place * len(jobs), planned, kept if kept != number else None


def _with_step(
    job: Job,
    asked: tuple[str, Keys] | None,
    found: Sequence[Finished],
    is_as_it_was: Callable[[PartOfRun], bool],
) -> tuple[Job, ...]:
    """A job with what is left to do of it, one for each power-up of its log; ``found`` are its finished flights."""
    if found and len(found[0].parts) > 1:
        return (_of_parts(job, found[0], is_as_it_was),)
    if asked is None or not found:
        return (job,)
    planned = tuple(job.going_on(one, asked[1]) for one in found)
    if len(planned) > 1 and any(one.step == "everything" for one in planned):
        return (job,)  # the log is read anew: it tells what it holds
    return planned


def _of_parts(job: Job, flight: Finished, is_as_it_was: Callable[[PartOfRun], bool]) -> Job:
    """The job of a flight of several logs; where one of them has changed, that of its own log alone."""
    if not all(map(is_as_it_was, flight.parts)):
        return job
    joined = job.of_parts(flight.parts)
    planned = replace(joined.going_on(flight, joined.keys_of(flight)), power_up=0)
    is_read = planned.step in ("everything", "analysis")
    return job if is_read and not all(Path(part.path).is_file() for part in flight.parts) else planned
