"""The logs of a run: which there are, which are none, and what an earlier run has left to do of each."""

from collections.abc import Collection, Iterator, Sequence
from pathlib import Path, PurePath

from groundstation.base.errors import UsageError
from groundstation.pipeline.many_flights.inputs import collect, is_ours
from groundstation.pipeline.many_flights.known_flights import KnownFlights
from groundstation.pipeline.many_flights.remote import FarLog, far_logs, is_remote
from groundstation.pipeline.many_flights.strangers import Strangers
from groundstation.pipeline.one_flight.configuration import Configuration
from groundstation.pipeline.one_flight.flight import Job, run_flight
from groundstation.pipeline.one_flight.outcome import Outcome
from groundstation.pipeline.one_flight.progress import Event, Listener


def inputs_of(paths: Sequence[Path | str], out: Path | str, configuration: Configuration) -> tuple[FarLog, ...]:
    """Logs by path or URL, in a stable order."""
    near = [Path(path) for path in paths if not is_remote(str(path))]
    found = {log.url: log for path in paths if is_remote(str(path)) for log in far_logs(str(path))}
    judges = {path.resolve() for path in configuration.references.paths}  # in a folder they are no logs to run
    for one in collect(near, None if is_remote(str(out)) else Path(out)):
        if one.is_named or not judges or one.path.resolve() not in judges:
            found[str(one.path)] = FarLog(str(one.path), one.is_named, one.path.stat().st_size)
    if not found:
        hint = "output of groundstation is no input" if any(path.is_dir() and is_ours(path) for path in near) else ""
        raise UsageError(", ".join(map(str, paths)), "no log in it", "", hint)
    return tuple(log for _, log in sorted(found.items()))


def with_steps(
    jobs: Sequence[Job], known: KnownFlights, without: Collection[int] = ()
) -> Iterator[tuple[int, Job, int | None]]:
    """Jobs by number, with what is to be done of each, and the number of an earlier one with the same finished log."""
    first: dict[str, int] = {}
    for number, job in enumerate(jobs):
        if number in without:
            continue
        planned = _with_step(job, known) if len(known) else job
        kept = first.setdefault(planned.finished.sha256, number) if planned.finished else number
        yield number, planned, kept if kept != number else None


def _with_step(job: Job, known: KnownFlights) -> Job:
    asked = job.asked()
    found = None if asked is None else known.of(asked[0])
    return job if asked is None or found is None else job.going_on(found, asked[1])


def skipped_files(inputs: Sequence[FarLog], strangers: Strangers, listen: Listener) -> dict[int, Outcome]:
    """Outcomes, by their numbers, of files in folders that no reader claims."""
    found: dict[int, Outcome] = {}
    for number, one in enumerate(inputs):
        if not one.is_named and (reason := strangers.reason(Path(one.url))) is not None:
            found[number] = Outcome(one.url, "skipped", reason)
            listen(Event("end", PurePath(one.url).name, reason))
    return found


def run_known(job: Job, listen: Listener, *, redo: bool) -> Outcome:
    """Run a log that this process has not looked at yet: what an earlier run finished of it is not done again.

    With ``add_suffix`` it is one of several of the same id, and run anew.
    """
    known = KnownFlights(None if redo or job.add_suffix else job.out)
    return run_flight(_with_step(job, known) if len(known) else job, listen)
