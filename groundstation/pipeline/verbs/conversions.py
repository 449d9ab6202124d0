"""Recorded logs to MCAP files, one by one; a flight to Chapter 10."""

from collections.abc import Sequence
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

from groundstation.base.dataclasses import dataclass
from groundstation.base.errors import GroundstationError, UsageError
from groundstation.base.signals import is_canonical
from groundstation.integrity.limits import Thresholds
from groundstation.pipeline.many_flights.inputs import no_log
from groundstation.pipeline.many_flights.processes.crew import Crew, in_turn
from groundstation.pipeline.one_flight.configuration import Configuration
from groundstation.pipeline.one_flight.convert import Converted, convert_log
from groundstation.pipeline.one_flight.log import Log, as_log, log_name, open_log
from groundstation.pipeline.one_flight.outcome import Outcome, State
from groundstation.pipeline.one_flight.progress import Event, Listener, silent
from groundstation.store.writer import clear_parts

if TYPE_CHECKING:
    from groundstation.pipeline.many_flights.processes.confined import ProcessLimits

WRITTEN = (".mcap", ".ch10")


def convert_many(
    logs: Sequence[Path],
    output: Path,
    *,
    configuration: Configuration | None = None,
    force: bool = False,
    bounds: "ProcessLimits | None" = None,
    listen: Listener = silent,
) -> tuple[Outcome, ...]:
    """Convert logs to MCAP: one to the file ``output``, several into the folder ``output``.

    A file ``*.ch10`` is written as Chapter 10, with the ICD of its buses beside it. Of the configuration, the profile,
    the ICDs, the thresholds of the ledger and the references count. With ``bounds`` each log is converted in a process
    of its own, which may take so much.

    Raises
    ------
    UsageError
        When a log is missing, the target exists and ``force`` is not given, or a threshold is wrong.
    """
    configuration = configuration or Configuration()
    logs = [as_log(log) for log in logs]
    for log in logs:
        if not log.exists():
            raise UsageError(str(log), "no such file")
        if log.is_dir():
            raise no_log(log)
    if len(logs) == 1 and not output.is_dir() and output.suffix.lower() not in WRITTEN:
        raise UsageError(str(output), f"the ending {output.suffix or '(none)'}", "a name *.mcap or *.ch10, or a folder")
    if len(logs) > 1 and output.is_file():
        raise UsageError(str(output), "a file", "a folder for several logs")
    into_folder = len(logs) > 1 or output.is_dir()
    targets = [output / f"{Path(log_name(log)).stem}.mcap" for log in logs] if into_folder else [output]
    if len(set(targets)) < len(targets):
        raise UsageError(str(output), "two logs of one name", "names that differ")
    for log, target in zip(logs, targets, strict=True):
        if target.exists() and (not force or target.resolve() == log.resolve()):
            raise UsageError(str(target), "a file that exists", "a new name", "-f overwrites it")
        target.parent.mkdir(parents=True, exist_ok=True)
    listen(Event("begin", total=len(logs)))
    jobs = [_Job(log, target, configuration) for log, target in zip(logs, targets, strict=True)]
    crew: Crew = partial(in_turn, listen=listen)
    if bounds is not None:
        from groundstation.pipeline.many_flights.processes.apart import outcomes_apart

        crew = partial(outcomes_apart, workers=1, listen=listen, bounds=bounds)
    outcomes = []
    for number, outcome in crew(enumerate(jobs), _convert_one):
        if outcome.state == "failed":
            clear_parts(jobs[number].target)
        listen(Event("end", jobs[number].name, outcome.text, outcomes=(outcome,)))
        outcomes.append(outcome)
    return tuple(outcomes)


@dataclass(frozen=True)
class _Job:
    """One log to convert."""

    path: Path
    target: Path
    configuration: Configuration

    @property
    def log(self) -> str:
        return str(self.path)

    @property
    def name(self) -> str:
        return self.path.name


def convert_together(
    logs: Sequence[Path],
    output: Path,
    *,
    configuration: Configuration | None = None,
    force: bool = False,
    listen: Listener = silent,
) -> tuple[Outcome, ...]:
    """Convert several logs of one flight to one MCAP, on one clock.

    Raises
    ------
    UsageError
        When a log is missing or given twice, there is but one, or the target exists and ``force`` is not given.
    """
    from groundstation.pipeline.one_flight.join import join_files

    named = " + ".join(log.name for log in logs)
    if output.suffix == ".ch10" or output.is_dir():
        raise UsageError(str(output), "Chapter 10 or a folder", "an MCAP for logs that are joined")
    if output.exists() and (not force or output.resolve() in {log.resolve() for log in logs}):
        raise UsageError(str(output), "a file that exists", "a new name", "-f overwrites it")
    listen(Event("begin", total=1))
    try:
        converted = join_files(logs, output, configuration or Configuration(), listen)
    except UsageError:
        raise
    except GroundstationError as error:
        outcome = Outcome(named, "failed", str(error))
    else:
        outcome = _converted(named, converted, output)
    listen(Event("end", output.name, outcome.text))
    return (outcome,)


def _convert_one(job: _Job, listen: Listener) -> Outcome:
    path, target, configuration = job.path, job.target, job.configuration
    listen(Event("stage", job.name, "converting"))
    told, thresholds, references = "", configuration.thresholds, configuration.references
    try:
        log = open_log(path, configuration.profile_path, configuration.icds)
        if target.suffix == ".ch10":
            converted, told = _to_chapter10(log, target, thresholds)
        else:
            converted = convert_log(log, target, thresholds, references)
    except GroundstationError as error:
        return Outcome(str(path), "failed", str(error))
    return _converted(str(path), converted, target, told)


def _converted(source: str, converted: Converted, target: Path, told: str = "") -> Outcome:
    grave = [finding.text for finding in converted.findings if finding.severity != "info"]
    text = f"-> {target}{told}" + (f" ({'; '.join(grave)})" if grave else "")
    state: State = "data_lost" if converted.has_lost_data else "done"
    return Outcome(source, state, text, folder=str(target), loss=converted.info.ledger.loss)


def _to_chapter10(log: Log, target: Path, thresholds: Thresholds) -> tuple[Converted, str]:
    """Write the flight of a log as Chapter 10.

    Returns the conversion of the log, and which topics are on no bus.
    """
    from groundstation.pipeline.one_flight.flight import read_flight
    from groundstation.simulation.chapter10_writer import write_chapter10

    with TemporaryDirectory(prefix="groundstation-") as folder:
        mcap = Path(folder) / "flight.mcap"
        converted = convert_log(log, mcap, thresholds)
        icd, left_out = write_chapter10(target, read_flight(mcap, converted))
    without = [topic for topic in left_out if is_canonical(topic)]
    return converted, f" and {icd.name}" + (f", without {', '.join(without)}" if without else "")
