"""Verb ``check``: the integrity ledger of logs, and what they can be used for.

It writes nothing.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from groundstation.base.clock import Clock
from groundstation.base.dataclasses import dataclass
from groundstation.base.errors import UnreadableLogError, UsageError
from groundstation.base.findings import SEVERITIES, Finding, worst
from groundstation.base.ledger import DATA_LOST, Ledger
from groundstation.base.records import Damage, RecordBatch
from groundstation.base.serial import to_json_exactly
from groundstation.base.words import counted
from groundstation.integrity.limits import Thresholds
from groundstation.pipeline.many_flights.inputs import no_log
from groundstation.pipeline.one_flight.configuration import Configuration
from groundstation.pipeline.one_flight.convert import (
    census_of,
    has_other_limits,
    recounted,
    told_of_fields,
    why_nothing_is_placed,
)
from groundstation.pipeline.one_flight.log import Log, as_log, open_log, open_one_of_several
from groundstation.pipeline.one_flight.outcome import Outcome, State, reason_of
from groundstation.pipeline.one_flight.progress import Event, Listener, silent
from groundstation.pipeline.one_flight.segments import PowerUpTold, segments_in, segments_of, told_of
from groundstation.pipeline.verbs.describe import facts_of

if TYPE_CHECKING:
    from groundstation.pipeline.verbs.usable import Usability
    from groundstation.tables.table import Flight


@dataclass(frozen=True)
class CheckedLog:
    """Result of the check of one log.

    Parameters
    ----------
    outcome : Outcome
        State and exit code; the reason when the log could not be read.
    facts : mapping of str to str
        What the log is; empty when it could not be read.
    ledger : Ledger
    clock : Clock
    findings : tuple of Finding
    usability : Usability, optional
        Whether it serves the purpose that was asked for.
    power_ups : tuple of PowerUpTold
        Where the log holds several.
    """

    outcome: Outcome
    facts: Mapping[str, str]
    ledger: Ledger
    clock: Clock
    findings: tuple[Finding, ...]
    usability: "Usability | None" = None
    power_ups: tuple[PowerUpTold, ...] = ()

    def to_dict(self) -> dict[str, Any]:
        """Return plain values for JSON."""
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
            **({"power_ups": [asdict(one) for one in self.power_ups]} if self.power_ups else {}),
            **({"usability": self.usability.to_dict()} if self.usability else {}),
        }

    def judged(self, usability: "Usability", fail_on: str) -> "CheckedLog":
        """Return the result with its usability, at the limit where that falls short.

        No use is at the limit; partial use is so under ``--fail-on warn``.
        """
        is_short = usability.state == "no" or (usability.state == "in part" and fail_on == "warn")
        outcome = replace(self.outcome, state="limit_reached") if is_short else self.outcome
        return replace(self, outcome=outcome, usability=usability)


def check_many(
    paths: Sequence[Path],
    configuration: Configuration,
    *,
    purpose: str = "",
    fail_on: str = "none",
    listen: Listener = silent,
) -> tuple[CheckedLog, ...]:
    """Check logs one after the other, in the order given; a bad one never stops the others.

    Parameters
    ----------
    purpose : str
        Name of an analysis: say of each log whether it can be used for it. Those of a session are judged together.

    Raises
    ------
    UsageError
        When a log is missing, is a folder, a threshold is wrong, or there is no such purpose.
    """
    logs, is_session = require_logs(paths, purpose)
    listen(Event("begin", total=len(logs)))
    return check_here(logs, configuration, purpose, is_session, fail_on, listen, is_alone=len(logs) == 1)


def require_logs(paths: Sequence[Path], purpose: str) -> tuple[list[Path], bool]:
    """Return the logs that are named, and whether the purpose is that of a session.

    Raises
    ------
    UsageError
        As :func:`check_many`.
    """
    is_session = require_purpose_of(purpose)
    logs = [as_log(path) for path in paths]
    for path in logs:
        if not path.exists():
            raise UsageError(str(path), "no such file")
        if path.is_dir():
            raise no_log(path)
    return logs, is_session


def require_purpose_of(purpose: str) -> bool:
    """Tell whether a purpose is that of a session; empty is none.

    Raises
    ------
    UsageError
        When there is no such purpose.
    """
    if not purpose:
        return False
    from groundstation.pipeline.verbs.usable import is_of_session, require_purpose

    require_purpose(purpose)
    return is_of_session(purpose)


def check_here(
    paths: Sequence[Path],
    configuration: Configuration,
    purpose: str,
    is_session: bool,
    fail_on: str,
    listen: Listener,
    *,
    is_alone: bool,
) -> tuple[CheckedLog, ...]:
    """Return the checks of logs that exist; parameters as of :func:`check_many`.

    One that is alone is read by the profile; of several each is, that the profile describes.
    """
    found = []
    flights: dict[int, Flight] = {}
    for number, path in enumerate(paths):
        listen(Event("stage", path.name, "reading"))
        checked, flight = _check_or_reason(path, configuration, fail_on, with_flight=bool(purpose), is_alone=is_alone)
        if flight is not None and is_session:
            flights[number] = flight
        elif flight is not None:
            checked = with_purpose(checked, purpose, flight, configuration, fail_on)
        found.append(checked)
        listen(Event("end", path.name, checked.outcome.text))
    if flights:
        found = _for_session(found, purpose, flights, configuration, fail_on)
    return tuple(found)


def with_purpose(
    checked: CheckedLog, purpose: str, flight: "Flight", configuration: Configuration, fail_on: str
) -> CheckedLog:
    """Return the check with the usability of its flight for a purpose."""
    from groundstation.pipeline.verbs.usable import usability_of_flight

    try:
        return checked.judged(usability_of_flight(purpose, flight, configuration), fail_on)
    except Exception as error:  # a defect of ours stops no other log
        reason, trace = reason_of(Path(checked.outcome.source).name, error)
        return replace(checked, outcome=replace(checked.outcome, state="failed", text=reason, trace=trace))


def _for_session(
    found: Sequence[CheckedLog],
    purpose: str,
    flights: Mapping[int, "Flight"],
    configuration: Configuration,
    fail_on: str,
) -> list[CheckedLog]:
    """Return the checks with the usability of their logs together.

    The stations are those beside the first log.
    """
    from groundstation.pipeline.many_flights.sessions.found import STATIONS_TOML
    from groundstation.pipeline.many_flights.sessions.job import load_stations
    from groundstation.pipeline.verbs.usable import usability_of_session

    file = Path(found[min(flights)].outcome.source).with_name(STATIONS_TOML)
    stations = load_stations(file if file.is_file() else None)
    usability = usability_of_session(purpose, list(flights.values()), configuration, stations)
    return [one.judged(usability, fail_on) if number in flights else one for number, one in enumerate(found)]


def _check_or_reason(
    path: Path, configuration: Configuration, fail_on: str, *, with_flight: bool, is_alone: bool
) -> tuple[CheckedLog, "Flight | None"]:
    try:
        opened = open_log if is_alone else open_one_of_several
        log = opened(path, configuration.profile_path, configuration.icds)
        return checked_with_flight(log, configuration.thresholds, fail_on, with_flight=with_flight)
    except Exception as error:
        reason, trace = reason_of(path.name, error)
    return unread(path, reason, trace), None


def unread(path: Path, reason: str, trace: str = "") -> CheckedLog:
    """Return the check of a log that could not be read."""
    return CheckedLog(Outcome(str(path), "failed", reason, trace=trace), {}, Ledger(), Clock(), ())


def checked_with_flight(
    log: Log, limits: Thresholds, fail_on: str, *, with_flight: bool
) -> tuple[CheckedLog, "Flight | None"]:
    """Return the check of a log and, where wanted and readable, its tables."""
    read = _stored if log.is_store else _recorded
    checked, flight = read(log, limits, fail_on, with_flight=with_flight)
    return checked, None if checked.outcome.state == "failed" else flight


def _recorded(log: Log, limits: Thresholds, fail_on: str, *, with_flight: bool) -> tuple[CheckedLog, "Flight | None"]:
    from groundstation.integrity.ledger_findings import ledger_findings
    from groundstation.integrity.survey import survey

    items = log.replay() if with_flight else log.items()
    found = survey(items, thresholds=limits)
    ledger, flight = found.ledger.document(), None
    if with_flight and ledger.topics:
        from groundstation.integrity.ordering import corrected
        from groundstation.tables.assemble import flight_from_batches

        metadata = {**found.header.metadata, **told_of_fields(found.remarks)}
        batches = corrected(items, found.clock, for_tables=True)
        flight = flight_from_batches(
            batches,
            metadata=metadata,
            has_utc=found.clock.is_absolute,
            source_name=log.source.name,
            rows=ledger.rows,
            pauses=ledger.pauses,
        )
    facts = facts_of(log, found.header.metadata, ledger)
    findings = ledger_findings(found.ledger)
    has_lost = found.ledger.loses_data
    checked = _checked(log, facts, ledger, found.clock.document(), findings, has_lost, fail_on)
    power_ups = told_of(segments_of(found.power_ups), found.clock.is_absolute)
    return replace(checked, power_ups=power_ups), flight


def _stored(log: Log, limits: Thresholds, fail_on: str, *, with_flight: bool) -> tuple[CheckedLog, "Flight | None"]:
    from groundstation.store.reader import read_info
    from groundstation.tables.assemble import flight_from_batches

    info = read_info(log.path)
    damages: list[Damage] = []
    census = census_of(info, limits)

    def intact() -> Iterator[RecordBatch]:
        for item in log.items():
            if isinstance(item, RecordBatch):
                census.add(item)
                yield item
            elif isinstance(item, Damage):
                damages.append(item)

    flight = None
    if with_flight:
        flight = flight_from_batches(
            intact(),
            metadata=info.metadata,
            has_utc=info.has_utc,
            source_name=info.source_name,
            rows=info.ledger.rows,
            pauses=info.ledger.pauses,
        )
    else:
        for _ in intact():
            pass
    if not census.rows:
        raise UnreadableLogError(log.path.name, "no intact record", "", "the file is damaged beyond its index")
    anew = recounted(info, damages, census)
    if damages or has_other_limits(info, limits):  # else the facts found in the log stay
        info = anew
    facts = facts_of(log, info.metadata, anew.ledger)
    has_lost = any(entry.get("loses_data") for entry in info.damages)
    checked = _checked(log, facts, anew.ledger, info.clock, info.findings, has_lost, fail_on)
    return replace(checked, power_ups=told_of(segments_in(info), info.has_utc)), flight


def _checked(
    log: Log,
    facts: Mapping[str, str],
    ledger: Ledger,
    clock: Clock,
    findings: tuple[Finding, ...],
    has_lost_data: bool,
    fail_on: str,
) -> CheckedLog:
    if not ledger.topics:
        reason = f"{log.path.name}: {why_nothing_is_placed(findings)}: `info` shows what the file is"
        outcome = Outcome(str(log.path), "failed", reason, sha256=log.source.sha256)
        return CheckedLog(outcome, facts, ledger, clock, findings)
    gravest = worst(findings)
    state: State = "data_lost" if has_lost_data else "done"
    if fail_on in SEVERITIES and gravest and SEVERITIES.index(gravest) >= SEVERITIES.index(fail_on):
        state = "limit_reached"
    count = sum(finding.severity != "info" for finding in findings)
    lost = (ledger.loss or DATA_LOST) if has_lost_data else "no data lost"
    text = f"{lost}, {counted(count, 'warning')}"
    return CheckedLog(Outcome(str(log.path), state, text, sha256=log.source.sha256), facts, ledger, clock, findings)
