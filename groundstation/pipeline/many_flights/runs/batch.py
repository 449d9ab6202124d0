"""Batch of logs: each in its turn, several at once or on a cluster.

One bad log never stops the others.
"""

import math
import tempfile
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import closing, nullcontext
from dataclasses import replace
from functools import partial
from pathlib import Path, PurePath
from types import MappingProxyType

from groundstation.base.errors import UsageError
from groundstation.base.halves import cores
from groundstation.base.to_disk import sync_folder
from groundstation.pipeline.many_flights.fleet.delta_sink import delta_place, put_flights
from groundstation.pipeline.many_flights.fleet.index import write_index_of
from groundstation.pipeline.many_flights.fleet.installations import told
from groundstation.pipeline.many_flights.fleet.publishing import FLEET_FILES, write_beside
from groundstation.pipeline.many_flights.fleet.refresh import MOST_READ_EARLY, EarlyShares, refresh
from groundstation.pipeline.many_flights.fleet.scan import Scan
from groundstation.pipeline.many_flights.inputs import is_remote, session_folders
from groundstation.pipeline.many_flights.processes.apart import bounds_of
from groundstation.pipeline.many_flights.processes.crew import AnyJob, Crew, in_turn
from groundstation.pipeline.many_flights.processes.crews import crew_for, is_elsewhere
from groundstation.pipeline.many_flights.processes.workers import TASKS_PER_PROCESS
from groundstation.pipeline.many_flights.remote.jobs import RemoteJob, digest_remote, run_remote
from groundstation.pipeline.many_flights.remote.output import RemoteOutput
from groundstation.pipeline.many_flights.runs.consecutive import flights_of_parts
from groundstation.pipeline.many_flights.runs.destination import Destination, LocalOutput
from groundstation.pipeline.many_flights.runs.known_flights import KnownFlights
from groundstation.pipeline.many_flights.runs.listed_logs import (
    inputs_of,
    run_known,
    skipped_files,
    with_steps,
    without_parts,
)
from groundstation.pipeline.many_flights.runs.out_folder import alone_in, clear_unfinished, prepare, refuse_foreign
from groundstation.pipeline.many_flights.runs.strangers import Strangers
from groundstation.pipeline.many_flights.sessions.found import SessionOptions, find_sessions, sweep_sessions
from groundstation.pipeline.many_flights.sessions.job import load_stations
from groundstation.pipeline.many_flights.sessions.session import run_one
from groundstation.pipeline.one_flight.ahead import fleet_imported_meanwhile
from groundstation.pipeline.one_flight.configuration import Configuration
from groundstation.pipeline.one_flight.flight import Job, run_flight
from groundstation.pipeline.one_flight.identity import plain_id
from groundstation.pipeline.one_flight.outcome import Outcome, reason_of
from groundstation.pipeline.one_flight.progress import Event, Listener, silent


def run_many(
    paths: Sequence[Path | str],
    out: Path | str,
    configuration: Configuration,
    *,
    jobs: int = 0,
    scheduler: str = "",
    force: bool = False,
    fail_on: str = "none",
    with_pdf: bool = False,
    redo: bool = False,
    stations: Path | None = None,
    only_results: bool = False,
    timeout_s: float = math.inf,
    is_isolated: bool = False,
    store: str = "",
    unclaimed: Sequence[Path] = (),
    listen: Listener = silent,
) -> tuple[Outcome, ...]:
    """Run logs and folders of logs into ``out``, then the sessions among the flights.

    The index lists all of them.

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
    is_isolated : bool
        Each log, and each session, in a process of its own that may take what ``[isolation]`` of the settings allows.
    store : str
        ``delta:`` and a path or URL: a Delta table that takes the rows of these flights, too.
    unclaimed : sequence of Path
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
    inputs = inputs_of(paths, out, configuration, unclaimed)
    is_near = not any(is_remote(str(place)) for place in (out, *paths))
    listen(Event("begin", total=len(inputs)))
    strangers = Strangers(Path(out) if is_near else None)
    skipped = skipped_files(inputs, strangers) if is_near and configuration.profile is None else {}
    logs = len(inputs) - len(skipped)
    bounds = bounds_of(configuration.isolation, timeout_s) if is_isolated else None
    crew = crew_for(scheduler, jobs or cores(), logs, listen, timeout_s, bounds, only_results=only_results)
    make = partial(
        Job,
        configuration=configuration,
        fail_on=fail_on,
        with_pdf=with_pdf,
        only_results=only_results,
    )
    asked = SessionOptions(
        Path(out),
        configuration,
        ground,
        fail_on,
        with_pdf,
        redo,
        only_results=only_results,
        store=store,
    )
    if not is_near:
        remote = [
            RemoteJob(make(Path(), Path(), is_named=one.is_named), one.url, str(out), redo, one.size) for one in inputs
        ]
        return _run_remote(remote, asked, crew, force, listen)
    near = [make(Path(one.url), Path(out), is_named=one.is_named) for one in inputs]
    refresher = crew_for(scheduler, jobs or cores(), TASKS_PER_PROCESS + 1, listen)
    outcomes = _run_here(near, asked, crew, force, listen, refresher, skipped, is_isolated=is_isolated)
    strangers.keep(outcomes)
    return outcomes


def run_together(
    paths: Sequence[Path | str],
    out: Path | str,
    configuration: Configuration,
    *,
    force: bool = False,
    fail_on: str = "none",
    with_pdf: bool = False,
    only_results: bool = False,
    listen: Listener = silent,
) -> tuple[Outcome, ...]:
    """Run several logs of one flight as that flight.

    See :func:`groundstation.pipeline.one_flight.join.join_logs`.

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
            failed = Outcome(named, "failed", reason, trace=trace)
            listen(Event("end", named, reason, outcomes=(failed,)))
            return (failed,)
        job = Job(
            mcap,
            Path(out),
            configuration,
            fail_on,
            with_pdf=with_pdf,
            url=named,
            only_results=only_results,
        )
        asked = SessionOptions(Path(out), configuration, None, fail_on, with_pdf, redo=True, only_results=only_results)
        return _run_here([job], asked, partial(in_turn, listen=listen), force, listen)


def _run_here(
    work: Sequence[Job],
    asked: SessionOptions,
    crew: Crew,
    force: bool,
    listen: Listener,
    refresher: Crew | None = None,
    skipped: Mapping[int, Outcome] = MappingProxyType({}),
    *,
    is_isolated: bool = False,
) -> tuple[Outcome, ...]:
    out = asked.out
    refuse_foreign(out, force)
    with alone_in(out):
        prepare(out)
        in_out = KnownFlights(None if asked.redo else out)
        known = KnownFlights() if is_isolated else in_out  # isolated, no log is read in this process
        run = partial(run_known, redo=asked.redo) if is_isolated else run_flight
        skipped = without_parts(skipped, known)
        destination = Destination(LocalOutput(out), [job.log for job in work])
        for number, outcome in skipped.items():
            destination.put(number, outcome)

        def left() -> Iterator[tuple[int, Job]]:
            for outcome in skipped.values():
                listen(Event("end", PurePath(outcome.source).name, outcome.text))
            for number, job, twin in with_steps(work, known, skipped):
                flight = job.finished
                if twin is None:
                    yield number, job
                elif flight is not None and len(flight.parts) > 1:
                    destination.put_part(number, twin, flight.flight_id, "", was_finished=job.step == "nothing")
                    listen(Event("end", job.name, "part of a flight"))
                else:
                    destination.put_twin(number, Outcome(job.log, "skipped", ""), twin)
                    listen(Event("end", job.name, "same content as another log"))

        def suffixed(number: int) -> Job:
            return replace(work[number % len(work)], add_suffix=True, power_up=destination.power_up(number))

        early = EarlyShares(out) if is_elsewhere(crew) and len(work) <= MOST_READ_EARLY else None
        with fleet_imported_meanwhile(with_pages=not asked.only_results) if is_elsewhere(crew) else nullcontext():
            _run_into(destination, out, left(), run, suffixed, crew, listen, len(work), early)
        apart = _run_joined(destination, work, in_out, crew, listen, is_isolated=is_isolated)
        clear_unfinished(out)  # of processes that died or took too long
        found, unwritten = _swept(destination, out, refresher, early)
        sessions = _run_sessions(destination, asked, found, crew, listen)
        outcomes = (*destination.outcomes(), *sessions)
        found = found.with_sessions(one.flight_id for one in sessions if one.flight_id)
        problems = _beside(out, outcomes, asked, found)
        sync_folder(out)
        stored = put_flights(asked.store, found, outcomes) if asked.store else ()
        if asked.configuration.lessons is None:  # else the answer by the file is told
            outcomes = told(outcomes, out)
        return (*outcomes, *apart, *unwritten, *problems, *stored)


def _beside(out: Path, outcomes: Sequence[Outcome], asked: SessionOptions, found: Scan) -> tuple[Outcome, ...]:
    """Write what stands beside the flight folders, as asked for."""
    layout = asked.configuration.layout_bytes("fleet")
    with_pdf, only_results = asked.with_pdf, asked.only_results
    return write_beside(out, outcomes, with_pdf=with_pdf, only_results=only_results, found=found, layout=layout)


def _run_joined(
    destination: Destination,
    work: Sequence[Job],
    known: KnownFlights,
    crew: Crew,
    listen: Listener,
    *,
    is_isolated: bool = False,
) -> tuple[Outcome, ...]:
    """Run as one flight the consecutive logs among those in place.

    Returns what could not be joined, and why.

    Isolated, files that cannot be read alone are not looked at: that would read them in this process.
    """
    outcomes = {number: one for number, one in destination.flights().items() if one.flight_id or not is_isolated}
    found = flights_of_parts(outcomes, known, work[0].configuration)
    if not found:
        return ()
    tasks: list[tuple[int, Job]] = []
    for number, stretch in enumerate(found):
        first = outcomes[stretch.numbers[0]]
        add_suffix = bool(first.flight_id) and plain_id(first.flight_id, first.sha256) != first.flight_id
        tasks.append((number, work[stretch.numbers[0] % len(work)].of_parts(stretch.parts, add_suffix=add_suffix)))
    apart = []
    with closing(crew(tasks, run_flight)) as ended:
        for number, outcome in ended:
            listen(Event("end", tasks[number][1].name, outcome.text))
            problem = destination.put_joined(found[number].numbers, outcome)
            apart += [problem] if problem else []
    return tuple(apart)


def _swept(
    destination: Destination, out: Path, crew: Crew | None = None, early: EarlyShares | None = None
) -> tuple[Scan, tuple[Outcome, ...]]:
    """Bring the dataset of flights up to date.

    Flights that these logs have no longer are removed.
    """
    found, unwritten = refresh(out, crew, early)
    return refresh(out) if destination.sweep(found) else (found, unwritten)


def _run_sessions(
    destination: Destination, asked: SessionOptions, among: Scan, crew: Crew, listen: Listener
) -> tuple[Outcome, ...]:
    """Run the sessions among the flights that are in place.

    Interrupted, the index at least is written.
    """
    flights = destination.outcomes()
    outcomes: dict[int, Outcome] = {}
    try:
        found = find_sessions(asked, among, {one.flight_id for one in flights if one.flight_id})
        if found.jobs:
            listen(Event("begin", total=len(flights) + len(found.jobs)))
            with closing(crew(enumerate(found.jobs), run_one)) as ended:
                for number, outcome in ended:
                    listen(Event("end", outcome.source, outcome.text, outcomes=(outcome,)))
                    outcomes[number] = outcome
            sweep_sessions([(job, outcomes[number]) for number, job in enumerate(found.jobs)])
        return (*(outcome for _, outcome in sorted(outcomes.items())), *found.told)
    except BaseException:
        write_index_of(asked.out, flights)
        raise


def _run_remote(
    work: Sequence[RemoteJob], asked: SessionOptions, crew: Crew, force: bool, listen: Listener
) -> tuple[Outcome, ...]:
    def suffixed(number: int) -> RemoteJob:
        one = work[number % len(work)]
        job = replace(one.job, add_suffix=True, power_up=destination.power_up(number))
        return replace(one, job=job, redo=True)

    with tempfile.TemporaryDirectory(prefix="groundstation-") as folder:
        copy = Path(folder)
        output = RemoteOutput(work[0].out, copy)
        output.refuse_foreign(force=force)
        with output.alone():
            output.copy_all()
            destination = Destination(output, [one.log for one in work])
            is_whole = False
            try:
                tasks = _once(work, destination, crew, listen)
                _run_into(destination, copy, tasks, run_remote, suffixed, crew, listen, len(work))
                found, unwritten = _swept(destination, copy)
                sessions = _run_remote_sessions(destination, output, asked, found, listen)
                outcomes = (*destination.outcomes(), *sessions)
                found = found.with_sessions(one.flight_id for one in sessions if one.flight_id)
                beside = _beside(copy, outcomes, asked, found)
                stored = put_flights(asked.store, found, outcomes) if asked.store else ()
                problems = (*unwritten, *beside, *stored)
                outcomes = told(outcomes, copy)
                is_whole = True
            finally:
                output.publish(FLEET_FILES, is_whole=is_whole)
            return (*outcomes, *problems)


def _once(
    work: Sequence[RemoteJob], destination: Destination, crew: Crew, listen: Listener
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
            destination.put_twin(number, Outcome(job.log, "skipped", "", sha256=digests[number]), kept)
            listen(Event("end", job.name, "same content as another log"))


def _run_remote_sessions(
    destination: Destination, output: RemoteOutput, asked: SessionOptions, among: Scan, listen: Listener
) -> tuple[Outcome, ...]:
    """Run the sessions in the copy of an OUT elsewhere.

    They run in this process, where the MCAPs are fetched to.
    """
    before = session_folders(output.root)
    here = replace(asked, out=output.root, mcap_in=output.mcap_in, is_copy=True)
    outcomes = _run_sessions(destination, here, among, partial(in_turn, listen=listen), listen)
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
    destination: Destination,
    out: Path,
    tasks: Iterable[tuple[int, AnyJob]],
    run: Callable[[AnyJob, Listener], Outcome],
    suffixed: Callable[[int], AnyJob],
    crew: Crew,
    listen: Listener,
    logs: int,
    early: EarlyShares | None = None,
) -> None:
    """Carry out jobs and put their flights into place.

    Interrupted, the index at least is written. What a flight adds to the fleet is read as it ends, with ``early``.

    ``logs`` is how many logs there are: the flights of a log have its number, and that and multiples of their count.
    """
    try:
        with closing(crew(tasks, run)) as ended:  # closed at once when something is wrong here: its processes end
            for number, outcome in ended:
                destination.put(number, replace(outcome, more=()))
                for place, other in enumerate(outcome.more, start=1):
                    destination.put(number + place * logs, other)
                flights = destination.flights_of(number, 1 + len(outcome.more))
                listen(Event("end", PurePath(outcome.source).name, outcome.text, outcomes=flights))
                if early is not None:
                    early.read(one.flight_id for one in flights if one.folder and not one.was_finished)
        clashing = destination.clashing()
        if clashing:
            with closing(crew(((number, suffixed(number)) for number in clashing), run)) as ended:
                for number, outcome in ended:
                    destination.put_again(number, outcome)
    except BaseException:
        write_index_of(out, destination.outcomes())
        raise
