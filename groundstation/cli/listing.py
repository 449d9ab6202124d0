"""Lists of the logs in a folder: what each is, or what its check found, a line each."""

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

from groundstation.base.errors import UsageError
from groundstation.base.words import counted
from groundstation.cli.application import DATA_LOST, DONE, FAILED
from groundstation.cli.lines import LONGEST, STATES, shortened, tell_errors
from groundstation.cli.printing import totals
from groundstation.cli.text import as_json, printable, say, tell
from groundstation.pipeline.one_flight.outcome import reason_of

if TYPE_CHECKING:
    from pathlib import Path

    from groundstation.pipeline.verbs.check import CheckedLog
    from groundstation.pipeline.verbs.describe import Description
    from groundstation.pipeline.verbs.named_logs import NamedLogs


def show_checked(named: "NamedLogs", checked: "Sequence[CheckedLog]", *, quiet: bool) -> None:
    """Print a line for each log, usability first where that was asked.

    Failures go to stderr with their reasons.
    """
    for one in checked:
        if one.outcome.state == "failed":
            tell_errors(one.outcome)
        elif not quiet:
            usable = one.usability.text.partition(": ")[2] if one.usability else ""
            _tell(named.name(one.outcome.source), "; ".join(filter(None, (usable, one.outcome.text))))
    if not quiet:
        say(totals([one.outcome for one in checked]) + _others(named))


def describe_listed(
    named: "NamedLogs", described: "Callable[[Path], Description]", *, as_json_text: bool = False
) -> int:
    """Print a line for each log of a folder, and return the exit code."""
    codes, told = [], []
    for path in named.logs:
        try:
            found = described(path)
        except UsageError:
            raise
        except Exception as error:  # one bad log never stops the others
            say(f"error: {printable(reason_of(path.name, error)[0])}")
            codes.append(FAILED)
            continue
        codes.append(DATA_LOST if found.has_lost_data else DONE if found.has_records else FAILED)
        if as_json_text:
            told.append({"source": str(path), **found.to_dict()})
        else:
            _tell(named.name(path), summary_of(found))
    if as_json_text:
        tell(as_json(told))
    else:
        say(counted(len(named.logs), "log") + _others(named))
    return next((code for code in (FAILED, DATA_LOST) if code in codes), DONE)


def summary_of(found: "Description") -> str:
    """Return in a line what a log is: format, span, topics, rows and losses."""
    facts = found.facts
    span = " to ".join(facts[key] for key in ("first sample", "last sample") if key in facts)
    rows = sum(topic.rows or 0 for topic in found.topics)
    size = f"{counted(len(found.topics), 'topic')}, {counted(rows, 'row')}" if found.topics else "no records"
    lost = (found.loss or STATES["data_lost"]) if found.has_lost_data else ""
    return "  ".join(filter(None, (facts.get("format", ""), span, size, lost)))


def _tell(name: str, text: str) -> None:
    tell(f"{printable(name)}  {shortened(printable(text), LONGEST)}")


def _others(named: "NamedLogs") -> str:
    return f"; {named.passed_over}" if named.others else ""
