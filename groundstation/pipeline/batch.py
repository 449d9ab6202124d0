"""Several logs: each in its turn or several at once, one bad log never stopping the others."""

import shutil
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

from groundstation.base.errors import UsageError
from groundstation.pipeline.analyse import user_settings
from groundstation.pipeline.configuration import Configuration
from groundstation.pipeline.convert import convert_log
from groundstation.pipeline.flight import PARTIAL_PREFIX, Job, place, run_flight
from groundstation.pipeline.inputs import FLIGHT_FOLDER_MARK, collect, is_ours
from groundstation.pipeline.log import open_log
from groundstation.pipeline.outcome import Outcome
from groundstation.pipeline.progress import Event, Listener, silent


def run_many(
    paths: Sequence[Path],
    out: Path,
    configuration: Configuration,
    *,
    jobs: int = 0,
    force: bool = False,
    fail_on: str = "none",
    listen: Listener = silent,
) -> tuple[Outcome, ...]:
    """Run logs and folders of logs into ``out``; the index lists every one of them.

    Returns
    -------
    tuple of Outcome
        One per log, in the stable order of the inputs.

    Raises
    ------
    UsageError
        When an input is missing, there is nothing to run, a setting is wrong, or ``out`` is something else's.
    """
    user_settings(configuration)  # a wrong setting is told before an hour of work
    inputs = collect(paths, out)
    if not inputs:
        raise UsageError(", ".join(map(str, paths)), "no log in it")
    _prepare(out, force)
    work = [Job(one.path, out, configuration, fail_on, one.is_named) for one in inputs]
    listen(Event("begin", total=len(work)))
    shelf = Shelf(out)
    for job, outcome in zip(work, _carry_out(work, jobs, listen), strict=True):
        shelf.put(job, outcome)
    outcomes = shelf.settled(listen)
    _write_index(out, outcomes)
    return outcomes


def _prepare(out: Path, force: bool) -> None:
    if out.exists() and not out.is_dir():
        raise UsageError(str(out), "a file", "a folder for the results")
    if out.is_dir() and any(out.iterdir()) and not is_ours(out) and not force:
        raise UsageError(str(out), "a folder that groundstation did not make", "a new or own folder", "-f uses it")
    if (out / FLIGHT_FOLDER_MARK).exists():
        raise UsageError(str(out), "a flight folder", "a folder that holds flight folders", "name another -o")
    out.mkdir(parents=True, exist_ok=True)
    for left_over in out.glob(f"{PARTIAL_PREFIX}*"):
        shutil.rmtree(left_over, ignore_errors=True)


def _carry_out(work: Sequence[Job], jobs: int, listen: Listener) -> Iterator[Outcome]:
    """Run the jobs, several at once when there are several, yielding outcomes in the order of the jobs."""
    import os

    workers = min(jobs or os.cpu_count() or 1, len(work))
    if workers <= 1:
        for job in work:
            outcome = run_flight(job, listen)
            listen(Event("end", job.path.name, outcome.text))
            yield outcome
        return
    import multiprocessing
    from concurrent.futures import ProcessPoolExecutor

    # Spawned, never forked: numba, Arrow and Rerun hold threads that a fork would freeze.
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(workers, mp_context=context) as pool:
        futures = [pool.submit(run_flight, job) for job in work]
        for job, future in zip(work, futures, strict=True):
            try:
                outcome = future.result()
            except Exception as error:  # the process died under the log: killed, or out of memory
                outcome = Outcome(str(job.path), "failed", f"{job.path.name}: its process ended ({error})")
            listen(Event("end", job.path.name, outcome.text))
            yield outcome


class Shelf:
    """Where finished flights are put: into place at once, so that a run that is killed keeps what it had finished.

    Two flights of one id get the digests of their logs into their names; as that is known only when the second one
    is finished, they are run again at the end. A log that is listed twice (same content) is kept once.
    """

    def __init__(self, out: Path) -> None:
        self._out = out
        self._jobs: list[Job] = []
        self._outcomes: list[Outcome] = []
        self._first_of_content: dict[str, str] = {}
        self._ids: set[str] = set()
        self._clashes: set[str] = set()

    def put(self, job: Job, outcome: Outcome) -> None:
        """Take a finished log over."""
        twin = self._first_of_content.setdefault(outcome.sha256, outcome.source) if outcome.sha256 else outcome.source
        if outcome.flight_id and twin != outcome.source:
            shutil.rmtree(outcome.folder, ignore_errors=True)
            text = f"{job.path.name}: same content as {twin}, listed once"
            outcome = replace(outcome, state="skipped", text=text, flight_id="", folder="", row={})
        self._jobs.append(job)
        self._outcomes.append(self._placed(outcome) if outcome.flight_id else outcome)

    def _placed(self, outcome: Outcome) -> Outcome:
        target = self._out / outcome.flight_id
        is_first = outcome.flight_id not in self._ids
        self._ids.add(outcome.flight_id)
        if not is_first or _is_of_another_log(target, outcome):
            self._clashes.add(outcome.flight_id)
            return outcome
        place(Path(outcome.folder), target)
        return replace(outcome, folder=str(target))

    def settled(self, listen: Listener) -> tuple[Outcome, ...]:
        """What became of each log, in the order of the inputs, once all are put."""
        for number, (job, outcome) in enumerate(zip(self._jobs, self._outcomes, strict=True)):
            if outcome.flight_id in self._clashes:
                shutil.rmtree(outcome.folder, ignore_errors=True)
                again = run_flight(replace(job, add_suffix=True), listen)
                if again.flight_id:
                    place(Path(again.folder), self._out / again.flight_id)
                    again = replace(again, folder=str(self._out / again.flight_id))
                self._outcomes[number] = again
        return tuple(self._outcomes)


def _is_of_another_log(folder: Path, outcome: Outcome) -> bool:
    from groundstation.base.errors import GroundstationError
    from groundstation.results.files import load

    if not folder.exists():
        return False
    try:
        return str(load(folder).summary["flight"]["source"]["sha256"]) != outcome.sha256
    except (GroundstationError, KeyError, TypeError):
        return False


def _write_index(out: Path, outcomes: Sequence[Outcome]) -> None:
    """Write index.json and index.csv: every flight in ``out``, and the logs of this run that gave none."""
    from groundstation.reports.index import failed_row, index_row, write_index
    from groundstation.results.files import load

    rows = [index_row(load(folder)) for folder in flight_folders(out)]
    rows += [
        failed_row(Path(outcome.source).name, outcome.state, outcome.text)
        for outcome in outcomes
        if not outcome.flight_id
    ]
    write_index(out, rows)


def flight_folders(out: Path) -> list[Path]:
    """Flight folders in an OUT, in the order of their names."""
    return sorted(
        folder for folder in out.iterdir() if (folder / FLIGHT_FOLDER_MARK).is_file() and folder.name[0] != "."
    )


def convert_many(
    logs: Sequence[Path],
    output: Path,
    *,
    profile: Path | None = None,
    force: bool = False,
    listen: Listener = silent,
) -> tuple[Outcome, ...]:
    """Convert logs to MCAP: one to the file ``output``, several into the folder ``output``.

    Raises
    ------
    UsageError
        When a log is missing, or the target exists and ``force`` is not given.
    """
    for log in logs:
        if not log.exists():
            raise UsageError(str(log), "no such file")
        if log.is_dir():
            raise UsageError(str(log), "a folder", "a log", "`run` takes folders")
    into_folder = len(logs) > 1 or output.is_dir()
    targets = [output / f"{log.stem}.mcap" for log in logs] if into_folder else [output]
    if len(set(targets)) < len(targets):
        raise UsageError(str(output), "two logs of one name", "names that differ")
    for log, target in zip(logs, targets, strict=True):
        if target.exists() and (not force or target.resolve() == log.resolve()):
            raise UsageError(str(target), "a file that exists", "a new name", "-f overwrites it")
        target.parent.mkdir(parents=True, exist_ok=True)
    listen(Event("begin", total=len(logs)))
    outcomes = []
    for log, target in zip(logs, targets, strict=True):
        listen(Event("stage", log.name, "converting"))
        outcomes.append(_convert_one(log, target, profile))
        listen(Event("end", log.name, outcomes[-1].text))
    return tuple(outcomes)


def _convert_one(path: Path, target: Path, profile: Path | None) -> Outcome:
    from groundstation.base.errors import GroundstationError

    try:
        converted = convert_log(open_log(path, profile), target)
    except GroundstationError as error:
        return Outcome(str(path), "failed", str(error))
    grave = [finding.text for finding in converted.findings if finding.severity != "info"]
    text = f"-> {target}" + (f" ({'; '.join(grave)})" if grave else "")
    return Outcome(str(path), "data_lost" if converted.has_lost_data else "done", text, folder=str(target))


def report_again(out: Path) -> Iterator[Path]:
    """Make reports and index of an OUT (or of one flight folder) again from the saved results.

    Raises
    ------
    UsageError
        When the folder is not one that ``run`` made.
    """
    from groundstation.reports.flight_report import write_flight_report

    if (out / FLIGHT_FOLDER_MARK).is_file():
        yield write_flight_report(out)
        return
    if not is_ours(out):
        raise UsageError(str(out), "no results", "a folder that `run` made")
    for folder in flight_folders(out):
        yield write_flight_report(folder)
