"""Recorded logs to MCAP files, one by one."""

from collections.abc import Sequence
from pathlib import Path

from groundstation.base.errors import GroundstationError, UsageError
from groundstation.integrity.limits import Thresholds
from groundstation.pipeline.many_flights.inputs import no_log
from groundstation.pipeline.one_flight.configuration import Configuration
from groundstation.pipeline.one_flight.convert import convert_log
from groundstation.pipeline.one_flight.log import as_log, log_name, open_log
from groundstation.pipeline.one_flight.outcome import Outcome
from groundstation.pipeline.one_flight.progress import Event, Listener, silent


def convert_many(
    logs: Sequence[Path],
    output: Path,
    *,
    configuration: Configuration | None = None,
    force: bool = False,
    listen: Listener = silent,
) -> tuple[Outcome, ...]:
    """Convert logs to MCAP: one to the file ``output``, several into the folder ``output``.

    Of the configuration, the profile and the thresholds of the ledger count.

    Raises
    ------
    UsageError
        When a log is missing, the target exists and ``force`` is not given, or a threshold is wrong.
    """
    configuration = configuration or Configuration()
    thresholds = configuration.settings.thresholds
    profile = configuration.profile_path
    logs = [as_log(log) for log in logs]
    for log in logs:
        if not log.exists():
            raise UsageError(str(log), "no such file")
        if log.is_dir():
            raise no_log(log)
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
    outcomes = []
    for log, target in zip(logs, targets, strict=True):
        listen(Event("stage", log.name, "converting"))
        outcomes.append(_convert_one(log, target, profile, thresholds))
        listen(Event("end", log.name, outcomes[-1].text))
    return tuple(outcomes)


def _convert_one(path: Path, target: Path, profile: Path | None, thresholds: Thresholds) -> Outcome:
    try:
        converted = convert_log(open_log(path, profile), target, thresholds)
    except GroundstationError as error:
        return Outcome(str(path), "failed", str(error))
    grave = [finding.text for finding in converted.findings if finding.severity != "info"]
    text = f"-> {target}" + (f" ({'; '.join(grave)})" if grave else "")
    return Outcome(str(path), "data_lost" if converted.has_lost_data else "done", text, folder=str(target))
