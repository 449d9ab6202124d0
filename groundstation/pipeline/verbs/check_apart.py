"""Checks and descriptions of logs, each in a process of its own.

The process has a limit of time, or is isolated.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from groundstation.base.clock import Clock
from groundstation.base.dataclasses import dataclass
from groundstation.base.errors import GroundstationError, UsageError
from groundstation.base.findings import Finding
from groundstation.base.ledger import Ledger
from groundstation.pipeline.many_flights.processes.apart import each_apart
from groundstation.pipeline.many_flights.processes.confined import ProcessLimits
from groundstation.pipeline.one_flight.configuration import Configuration
from groundstation.pipeline.one_flight.outcome import Outcome, reason_of
from groundstation.pipeline.one_flight.progress import Event, Listener, silent
from groundstation.pipeline.one_flight.segments import PowerUpTold
from groundstation.pipeline.verbs.check import CheckedLog, check_here, require_logs, unread
from groundstation.pipeline.verbs.describe import Description, describe, suggest_icd

DRAFT = "draft of an ICD"


@dataclass(frozen=True)
class CheckJob:
    """Logs to look at in one process: several of a session, else one.

    ``is_alone``: no other was named beside it.
    """

    paths: tuple[Path, ...]
    configuration: Configuration
    purpose: str = ""
    is_session: bool = False
    fail_on: str = "none"
    is_alone: bool = True

    @property
    def log(self) -> str:
        """The first of them."""
        return str(self.paths[0])

    @property
    def name(self) -> str:
        """Name of the first of them."""
        return self.paths[0].name


@dataclass(frozen=True)
class _Told:
    """A check as it comes from another process."""

    outcome: Outcome
    facts: Mapping[str, str]
    ledger: Ledger
    clock: Clock
    findings: tuple[Finding, ...]
    usability: Mapping[str, Any] | None
    power_ups: tuple[PowerUpTold, ...]

    @classmethod
    def of(cls, checked: CheckedLog) -> "_Told":
        usability = None if checked.usability is None else checked.usability.to_dict()
        return cls(**(vars(checked) | {"usability": usability}))

    def checked(self) -> CheckedLog:
        """Return the check as it was in the other process."""
        found = CheckedLog(**(vars(self) | {"usability": None}))
        if self.usability is None:
            return found
        from groundstation.pipeline.verbs.usable import usability_from

        return replace(found, usability=usability_from(self.usability))


@dataclass(frozen=True)
class _Several:
    checks: tuple[_Told, ...]


def _check(job: CheckJob, listen: Listener) -> _Several:
    found = check_here(
        job.paths, job.configuration, job.purpose, job.is_session, job.fail_on, listen, is_alone=job.is_alone
    )
    return _Several(tuple(map(_Told.of, found)))


def check_apart(
    paths: Sequence[Path],
    configuration: Configuration,
    bounds: ProcessLimits,
    *,
    purpose: str = "",
    fail_on: str = "none",
    listen: Listener = silent,
) -> tuple[CheckedLog, ...]:
    """Check logs as :func:`~groundstation.pipeline.verbs.check.check_many`, in processes.

    The processes run one after the other. Logs of a session, which are judged together, are checked in one process.

    Raises
    ------
    UsageError
        As there.
    """
    logs, is_session = require_logs(paths, purpose)
    listen(Event("begin", total=len(logs)))
    groups = [tuple(logs)] if is_session else [(log,) for log in logs]

    def failed(job: CheckJob, reason: str) -> _Several:
        return _Several(tuple(_Told.of(unread(path, f"{path.name}: {reason}")) for path in job.paths))

    is_alone = len(logs) == 1
    jobs = enumerate(CheckJob(group, configuration, purpose, is_session, fail_on, is_alone) for group in groups)
    found = each_apart(jobs, _check, _Several, failed, workers=1, listen=listen, bounds=bounds)
    return tuple(told.checked() for _, several in sorted(found, key=lambda item: item[0]) for told in several.checks)


@dataclass(frozen=True)
class _Described:
    """A description or the draft of an ICD, or why there is none."""

    description: Description | None = None
    draft: str | None = None
    failure: str = ""
    is_usage: bool = False


def _describe(job: CheckJob, _listen: Listener) -> _Described:
    configuration = job.configuration
    try:
        if job.purpose == DRAFT:
            return _Described(draft=suggest_icd(job.paths[0]))
        found = describe(job.paths[0], configuration.profile_path, configuration.icds, is_alone=job.is_alone)
        return _Described(found)
    except UsageError as error:
        return _Described(failure=str(error), is_usage=True)
    except Exception as error:
        return _Described(failure=reason_of(job.name, error)[0])


def describe_apart(
    path: Path, profile: Path | None, icds: tuple[str, ...], bounds: ProcessLimits, *, is_alone: bool = True
) -> Description:
    """Describe a log in a process of its own.

    Raises
    ------
    UsageError, GroundstationError
        As :func:`groundstation.pipeline.verbs.describe.describe`; where the process went beyond its limits.
    """
    configuration = Configuration(profile=str(profile) if profile else None, icds=icds)
    found = _described_apart(CheckJob((path,), configuration, is_alone=is_alone), bounds)
    assert found.description is not None
    return found.description


def suggest_icd_apart(path: Path, bounds: ProcessLimits) -> str:
    """Return the draft of an ICD that a process of its own makes of a log.

    Raises
    ------
    UsageError, GroundstationError
        As :func:`groundstation.pipeline.verbs.describe.suggest_icd`; where the process went beyond its limits.
    """
    found = _described_apart(CheckJob((path,), Configuration(), DRAFT), bounds)
    assert found.draft is not None
    return found.draft


def _described_apart(job: CheckJob, bounds: ProcessLimits) -> _Described:
    ((_, found),) = each_apart(
        [(0, job)],
        _describe,
        _Described,
        lambda _job, reason: _Described(failure=f"{job.name}: {reason}"),
        workers=1,
        listen=silent,
        bounds=bounds,
    )
    if found.failure:
        raise (UsageError if found.is_usage else GroundstationError)(*_parts(found.failure))
    return found


def _parts(line: str) -> tuple[str, str]:
    """Split an error told in one line into where and what."""
    where, _, what = line.partition(": ")
    return where, what
