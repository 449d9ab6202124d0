"""Logs of a run, files that are none, and what an earlier run has left to do of each."""

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cache
from pathlib import Path

from groundstation.base.errors import UsageError
from groundstation.pipeline.many_flights.inputs import collect, is_ours, is_remote
from groundstation.pipeline.many_flights.remote.folder import FarLog, far_logs
from groundstation.pipeline.many_flights.runs.known_flights import KnownFlights
from groundstation.pipeline.many_flights.runs.strangers import Strangers
from groundstation.pipeline.one_flight.configuration import Configuration
from groundstation.pipeline.one_flight.flight import Job, run_flight
from groundstation.pipeline.one_flight.log import as_log, digest_of
from groundstation.pipeline.one_flight.outcome import Outcome
from groundstation.pipeline.one_flight.progress import Listener
from groundstation.pipeline.one_flight.resume import Finished, Keys
from groundstation.results.manifest import PartOfRun


def inputs_of(
    paths: Sequence[Path | str], out: Path | str, configuration: Configuration, unclaimed: Sequence[Path] = ()
) -> tuple[FarLog, ...]:
    """List logs by path or URL, in a stable order.

    The files ``unclaimed``, which no reader claims, are among them.
    """
    near = [Path(path) for path in paths if not is_remote(str(path))]
    found = {log.url: log for path in paths if is_remote(str(path)) for log in far_logs(str(path))}
    found.update({str(path): FarLog(str(path), is_named=False, size=path.stat().st_size) for path in unclaimed})
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
    """Jobs by number, with what is to be done of each.

    With them comes the number of an earlier job that gives the same flight.

    That is one with the same log, or with another part of the flight. A log whose flights of several power-ups are
    finished has a job for each of them. Those ``without`` are passed over.
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
        if number in without:
            continue
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
    """Job with what is left to do of it, one for each power-up of its log.

    ``found`` are its finished flights.
    """
    if found and len(found[0].parts) > 1:
        return (_of_parts(job, found[0], is_as_it_was),)
    if asked is None or not found:
        return (job,)
    planned = tuple(job.going_on(one, asked[1]) for one in found)
    if len(planned) > 1 and any(one.step == "everything" for one in planned):
        return (job,)  # the log is read anew: it tells what it holds
    return planned


def _of_parts(job: Job, flight: Finished, is_as_it_was: Callable[[PartOfRun], bool]) -> Job:
    """Job of a flight of several logs.

    Where one of them has changed, it is that of its own log alone.
    """
    if not all(map(is_as_it_was, flight.parts)):
        return job
    joined = job.of_parts(flight.parts)
    planned = replace(joined.going_on(flight, joined.keys_of(flight)), power_up=0)
    is_read = planned.step in ("everything", "analysis")
    return job if is_read and not all(Path(part.path).is_file() for part in flight.parts) else planned


def skipped_files(inputs: Sequence[FarLog], strangers: Strangers) -> dict[int, Outcome]:
    """Outcomes, by their numbers, of files in folders that no reader claims."""
    found: dict[int, Outcome] = {}
    for number, one in enumerate(inputs):
        if not one.is_named and (reason := strangers.reason(Path(one.url))) is not None:
            found[number] = Outcome(one.url, "skipped", reason)
    return found


def without_parts(skipped: Mapping[int, Outcome], known: KnownFlights) -> dict[int, Outcome]:
    """Skipped files that are no parts of known flights."""
    return {
        number: one for number, one in skipped.items() if str(Path(one.source).absolute()) not in known.paths_of_parts
    }


def run_known(job: Job, listen: Listener, *, redo: bool) -> Outcome:
    """Run a log that this process has not looked at yet.

    What an earlier run finished of it is not done again.

    With ``add_suffix`` it is one of several of the same id, and run anew; with parts it is several logs.
    """
    known = KnownFlights(None if redo or job.add_suffix or job.parts else job.out)
    asked = job.asked() if len(known) else None
    if asked is None:
        return run_flight(job, listen)
    planned = _with_step(job, asked, known.of(asked[0]), _is_as_it_was)
    first, *others = [run_flight(one, listen) for one in planned]
    return replace(first, more=(*first.more, *others))


def _is_as_it_was(part: PartOfRun) -> bool:
    """Tell whether a part of a flight is unchanged; one that is gone cannot tell."""
    path = Path(part.path)
    return not path.exists() or digest_of(as_log(path)) == part.sha256
