"""The verb ``check``: the integrity ledger of logs, which is computed and told, and written nowhere."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from groundstation.base.clock import Clock
from groundstation.base.errors import UnreadableLogError, UsageError
from groundstation.base.findings import SEVERITIES, Finding, worst
from groundstation.base.ledger import Ledger
from groundstation.base.records import Damage, RecordBatch
from groundstation.base.serial import to_json_exactly
from groundstation.integrity.limits import Thresholds, shipped
from groundstation.pipeline.many_flights.inputs import no_log
from groundstation.pipeline.one_flight.configuration import Configuration
from groundstation.pipeline.one_flight.convert import census_of, has_other_limits, recounted
from groundstation.pipeline.one_flight.log import Log, as_log, open_log
from groundstation.pipeline.one_flight.outcome import Outcome, State, reason_of
from groundstation.pipeline.one_flight.progress import Event, Listener, silent
from groundstation.pipeline.verbs.describe import facts_of


@dataclass(frozen=True)
class Checked:
    """What a check of one log found.

    Parameters
    ----------
    outcome : Outcome
        State and exit code; the reason when the log could not be read.
    facts : mapping of str to str
        What the log is; empty when it could not be read.
    ledger : Ledger
    clock : Clock
    findings : tuple of Finding
    """

    outcome: Outcome
    facts: Mapping[str, str]
    ledger: Ledger
    clock: Clock
    findings: tuple[Finding, ...]

    def to_dict(self) -> dict[str, Any]:
        """JSON-able."""
        return {
            "source": self.outcome.source,
            "state": self.outcome.state,
            "exit_code": self.outcome.code,
            "text": self.outcome.text,
            "sha256": self.outcome.sha256,
            "facts": dict(self.facts),
            "clock": to_json_exactly(self.clock),
            "ledger": to_json_exactly(self.ledger),
            "findings": [asdict(finding) for finding in self.findings],
        }


def check_many(
    paths: Sequence[Path],
    configuration: Configuration,
    *,
    fail_on: str = "none",
    listen: Listener = silent,
) -> tuple[Checked, ...]:
    """Check logs one after the other, in the order given; a bad one never stops the others.

    Raises
    ------
    UsageError
        When a log is missing, is a folder, or a threshold is wrong.
    """
    paths = [as_log(path) for path in paths]
    for path in paths:
        if not path.exists():
            raise UsageError(str(path), "no such file")
        if path.is_dir():
            raise no_log(path)
    listen(Event("begin", total=len(paths)))
    found = []
    for path in paths:
        listen(Event("stage", path.name, "reading"))
        found.append(_check_or_reason(path, configuration, fail_on))
        listen(Event("end", path.name, found[-1].outcome.text))
    return tuple(found)


def check_log(log: Log, thresholds: Thresholds | None = None, *, fail_on: str = "none") -> Checked:
    """Compute the ledger of a log.

    The topics of a groundstation MCAP are counted anew; what only the log could tell is taken from the ledger in it.
    """
    limits = thresholds or shipped()
    return _stored(log, limits, fail_on) if log.is_store else _recorded(log, limits, fail_on)


def _check_or_reason(path: Path, configuration: Configuration, fail_on: str) -> Checked:
    try:
        log = open_log(path, configuration.profile_path, configuration.icds)
        return check_log(log, configuration.thresholds, fail_on=fail_on)
    except Exception as error:
        reason, trace = reason_of(path.name, error)
    return Checked(Outcome(str(path), "failed", reason, trace=trace), {}, Ledger(), Clock(), ())


def _recorded(log: Log, limits: Thresholds, fail_on: str) -> Checked:
    from groundstation.integrity.ledger_findings import ledger_findings
    from groundstation.integrity.survey import survey

    found = survey(log.items(), thresholds=limits)
    ledger = found.ledger.document()
    facts = facts_of(log, found.header.metadata, ledger)
    findings = ledger_findings(found.ledger)
    return _checked(log, facts, ledger, found.clock.document(), findings, found.ledger.loses_data, fail_on)


def _stored(log: Log, limits: Thresholds, fail_on: str) -> Checked:
    from groundstation.store.reader import read_info

    info = read_info(log.path)
    damages: list[Damage] = []
    census = census_of(info, limits)
    for item in log.items():
        if isinstance(item, RecordBatch):
            census.add(item)
        elif isinstance(item, Damage):
            damages.append(item)
    if not census.rows:
        raise UnreadableLogError(log.path.name, "no intact record", "", "the file is damaged beyond its index")
    anew = recounted(info, damages, census)
    if damages or has_other_limits(info, limits):  # else what was found in the log is told as it was
        info = anew
    facts = facts_of(log, info.metadata, anew.ledger)
    has_lost = any(entry.get("loses_data") for entry in info.damages)
    return _checked(log, facts, anew.ledger, info.clock, info.findings, has_lost, fail_on)


def _checked(
    log: Log,
    facts: Mapping[str, str],
    ledger: Ledger,
    clock: Clock,
    findings: tuple[Finding, ...],
    has_lost_data: bool,
    fail_on: str,
) -> Checked:
    if not ledger.topics:
        reason = f"{log.path.name}: no record that could be read: `info` tells what the file is"
        outcome = Outcome(str(log.path), "failed", reason, sha256=log.source.sha256)
        return Checked(outcome, facts, ledger, clock, findings)
    gravest = worst(findings)
    state: State = "data_lost" if has_lost_data else "done"
    if fail_on in SEVERITIES and gravest and SEVERITIES.index(gravest) >= SEVERITIES.index(fail_on):
        state = "limit_reached"
    count = sum(finding.severity != "info" for finding in findings)
    text = f"{'data lost' if has_lost_data else 'no data lost'}, {count} warning{'' if count == 1 else 's'}"
    return Checked(Outcome(str(log.path), state, text, sha256=log.source.sha256), facts, ledger, clock, findings)
