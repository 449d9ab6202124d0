"""Several logs: each in its turn or several at once, one bad log never stopping the others."""

import os
import shutil
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from groundstation.base.errors import GroundstationError, UsageError
from groundstation.pipeline.analyse import user_settings
from groundstation.pipeline.configuration import Configuration
from groundstation.pipeline.convert import convert_log
from groundstation.pipeline.flight import Job, is_abandoned, place, run_flight
from groundstation.pipeline.inputs import FLIGHT_FOLDER_MARK, OUT_FOLDER_MARK, collect, is_ours
from groundstation.pipeline.log import open_log
from groundstation.pipeline.outcome import Outcome
from groundstation.pipeline.progress import Event, Listener, silent
from groundstation.reports.index import INDEX_CSV, INDEX_JSON
from groundstation.results.files import SUMMARY

TASKS_PER_PROCESS = 32  # Rerun leaves a few threads behind for every recording


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

    Interrupted, it keeps what was finished, with its index.

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
        hint = "what groundstation made is no input" if any(path.is_dir() and is_ours(path) for path in paths) else ""
        raise UsageError(", ".join(map(str, paths)), "no log in it", "", hint)
    _prepare(out, force)
    work = [Job(one.path, out, configuration, fail_on, one.is_named, os.getpid()) for one in inputs]
    listen(Event("begin", total=len(work)))
    shelf = Shelf(out, work)
    try:
        for number, outcome in _carry_out(work, jobs, listen):
            listen(Event("end", work[number].path.name, outcome.text))
            shelf.put(number, outcome)
        shelf.settle(listen)
    finally:
        problems = _write_index(out, shelf.outcomes())
    return (*shelf.outcomes(), *problems)


def _prepare(out: Path, force: bool) -> None:
    if out.exists() and not out.is_dir():
        raise UsageError(str(out), "a file", "a folder for the results")
    if out.is_dir() and any(out.iterdir()) and not is_ours(out) and not force:
        raise UsageError(str(out), "a folder that groundstation did not make", "a new or own folder", "-f uses it")
    if (out / FLIGHT_FOLDER_MARK).exists():
        raise UsageError(str(out), "a flight folder", "a folder that holds flight folders", "name another -o")
    out.mkdir(parents=True, exist_ok=True)
    for left_over in out.iterdir():
        if is_abandoned(left_over):
            shutil.rmtree(left_over, ignore_errors=True)
    if not (out / OUT_FOLDER_MARK).exists():
        _write_index(out, ())  # from now on the folder is known for ours, whatever happens to the run


def _carry_out(work: Sequence[Job], jobs: int, listen: Listener) -> Iterator[tuple[int, Outcome]]:
    """Run the jobs, several at once when there are several; yields number and outcome as each one ends."""
    workers = min(jobs or os.cpu_count() or 1, len(work))
    if workers <= 1:
        for number, job in enumerate(work):
            yield number, run_flight(job, listen)
        return
    import multiprocessing
    from concurrent.futures import ProcessPoolExecutor, as_completed

    # Spawned, never forked: numba, Arrow and Rerun hold threads that a fork would freeze.
    context = multiprocessing.get_context("spawn")
    pool = ProcessPoolExecutor(workers, mp_context=context, max_tasks_per_child=TASKS_PER_PROCESS)
    try:
        futures = {pool.submit(run_flight, job): number for number, job in enumerate(work)}
        for future in as_completed(futures):
            number = futures[future]
            try:
                yield number, future.result()
            except Exception as error:  # the process died under the log: killed, or out of memory
                name = work[number].path.name
                yield number, Outcome(str(work[number].path), "failed", f"{name}: its process ended ({error})")
    except BaseException:  # interrupted: nobody waits for the rest
        processes = list((getattr(pool, "_processes", None) or {}).values())
        pool.shutdown(wait=False, cancel_futures=True)
        for process in processes:
            process.terminate()
        raise
    pool.shutdown()


class Shelf:
    """Where finished flights are put: into place at once, so that a run that is killed keeps what it had finished.

    Two flights of one id get the digests of their logs into their names; as that is known only when the second one
    is finished, they are run again at the end. Of logs with the same content the first in the list is kept, whichever
    was finished first.
    """

    def __init__(self, out: Path, work: Sequence[Job]) -> None:
        self._out, self._work = out, work
        self._outcomes: dict[int, Outcome] = {}
        self._kept: dict[str, int] = {}  # content -> number of the log that is kept
        self._owner: dict[str, str] = {}  # flight id -> content
        self._clashes: set[str] = set()

    def put(self, number: int, outcome: Outcome) -> None:
        """Take a finished log over."""
        if not outcome.flight_id:
            self._outcomes[number] = outcome
            return
        twin = self._kept.get(outcome.sha256)
        if twin is not None and twin < number:
            self._outcomes[number] = self._as_twin(outcome, twin)
            return
        self._kept[outcome.sha256] = number
        self._outcomes[number] = self._placed(outcome)
        if twin is not None:
            self._outcomes[twin] = self._as_twin(replace(self._outcomes[twin], folder=""), number)

    def _as_twin(self, outcome: Outcome, kept: int) -> Outcome:
        if outcome.folder:
            shutil.rmtree(outcome.folder, ignore_errors=True)
        text = f"{Path(outcome.source).name}: same content as {self._work[kept].path}, listed once"
        return Outcome(outcome.source, "skipped", text, sha256=outcome.sha256)

    def _placed(self, outcome: Outcome) -> Outcome:
        identity = outcome.flight_id
        target = self._out / identity
        owner = self._owner.setdefault(identity, outcome.sha256)
        had_suffix = (self._out / f"{identity}_{outcome.sha256[:8]}").exists()
        if owner != outcome.sha256 or had_suffix or _is_of_another_log(target, outcome):
            self._clashes.add(identity)
            return outcome
        place(Path(outcome.folder), target)
        return replace(outcome, folder=str(target))

    def settle(self, listen: Listener) -> None:
        """Give flights of one id their digests, once all are put."""
        for number, outcome in sorted(self._outcomes.items()):
            if outcome.flight_id in self._clashes:
                shutil.rmtree(outcome.folder, ignore_errors=True)
                again = run_flight(replace(self._work[number], add_suffix=True), listen)
                if again.flight_id:
                    place(Path(again.folder), self._out / again.flight_id)
                    again = replace(again, folder=str(self._out / again.flight_id))
                self._outcomes[number] = again

    def outcomes(self) -> tuple[Outcome, ...]:
        """What became of the logs put so far, in the order of the inputs."""
        return tuple(outcome for _, outcome in sorted(self._outcomes.items()))


def _is_of_another_log(folder: Path, outcome: Outcome) -> bool:
    from groundstation.results.files import load

    if not folder.exists():
        return False
    try:
        return str(load(folder).summary["flight"]["source"]["sha256"]) != outcome.sha256
    except (GroundstationError, KeyError, TypeError):
        return False


def _write_index(
    out: Path, outcomes: Sequence[Outcome], kept_rows: Sequence[dict[str, Any]] = ()
) -> tuple[Outcome, ...]:
    """Write index.json and index.csv: every flight in ``out``, and the logs of this run that gave none.

    Returns what could not be listed: flight folders that cannot be read, an index that cannot be written.
    """
    from groundstation.reports.index import failed_row, index_row, write_index
    from groundstation.results.files import load

    problems: list[Outcome] = []
    rows = list(kept_rows)
    for folder in flight_folders(out):
        try:
            rows.append(index_row(load(folder)))
        except GroundstationError as error:
            problems.append(Outcome(str(folder), "failed", str(error)))
    without_flight = [outcome for outcome in outcomes if not outcome.flight_id]
    rows += [failed_row(one.source, one.state, one.text) for one in (*without_flight, *problems)]
    try:
        write_index(out, rows)
    except OSError as error:
        problems.append(Outcome(str(out), "failed", f"{out}: the index cannot be written ({error.strerror or error})"))
    return tuple(problems)


def flight_folders(out: Path) -> list[Path]:
    """Flight folders in an OUT, in the order of their names."""
    return sorted(folder for folder in out.iterdir() if folder.name[0] != "." and (folder / SUMMARY).is_file())


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
    if len(logs) > 1 and output.is_file():
        raise UsageError(str(output), "a file", "a folder for several logs")
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
    try:
        converted = convert_log(open_log(path, profile), target)
    except GroundstationError as error:
        return Outcome(str(path), "failed", str(error))
    grave = [finding.text for finding in converted.findings if finding.severity != "info"]
    text = f"-> {target}" + (f" ({'; '.join(grave)})" if grave else "")
    return Outcome(str(path), "data_lost" if converted.has_lost_data else "done", text, folder=str(target))


def report_again(out: Path) -> tuple[list[Path], tuple[Outcome, ...]]:
    """Make reports and index of an OUT (or the report of one flight folder) again from the saved results.

    Returns
    -------
    list of Path, tuple of Outcome
        What was written, and the flight folders that could not be read.

    Raises
    ------
    UsageError
        When the folder is not one that ``run`` made.
    """
    from groundstation.reports.flight_report import write_flight_report

    if (out / FLIGHT_FOLDER_MARK).is_file():
        return [write_flight_report(out)], ()
    if not out.is_dir() or not (is_ours(out) or flight_folders(out)):
        raise UsageError(str(out), "no results", "a folder that `run` made")
    written = []
    for folder in flight_folders(out):
        try:
            written.append(write_flight_report(folder))
        except GroundstationError:
            continue  # the index names it
    problems = _write_index(out, (), _rows_without_flight(out))
    return [*written, out / INDEX_JSON, out / INDEX_CSV], problems


def _rows_without_flight(out: Path) -> list[dict[str, Any]]:
    """Rows of the logs that gave no flight, from the index as it stands: nothing else remembers them."""
    import json

    try:
        rows = json.loads((out / OUT_FOLDER_MARK).read_text(encoding="utf-8"))["rows"]
        folders = {str(folder) for folder in flight_folders(out)}
        return [row for row in rows if row["kind"] != "flight" and row["source"] not in folders]
    except (OSError, ValueError, KeyError, TypeError):
        return []
