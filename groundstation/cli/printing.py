"""Output of results on stdout: lines for people, JSON for programs."""

from collections.abc import Mapping, Sequence
from itertools import groupby
from pathlib import Path, PurePath
from typing import TYPE_CHECKING, Any

from groundstation.base.text_columns import columns
from groundstation.base.words import IN_MS_BELOW_S, counted
from groundstation.cli.lines import Lines
from groundstation.cli.text import as_json, printable, say, tell
from groundstation.pipeline.one_flight.outcome import Outcome, State, worst_code
from groundstation.results.grouped_findings import named_lines

if TYPE_CHECKING:
    from groundstation.pipeline.verbs.describe import BusWord, Description
    from groundstation.pipeline.verbs.settings_list import Setting

NAMED_SHOWN = 6  # words of a bus that an ICD names, listed one by one

__all__ = ["as_json", "catalogue", "description", "outcomes", "worst_code"]


def description(what: "Description", *, everything: bool = False) -> str:
    """Return the text of ``info``: a line for each bus, with ``everything`` for each word."""
    head = [[f"{key}:", printable(value)] for key, value in what.facts.items()]
    parts = [columns(head)]
    if what.topics:
        rows = [["topic", "rows", "rate Hz", "span s", "fields"]]
        for topic in what.topics:
            rate = "" if topic.rate_hz is None else f"{topic.rate_hz:.6g}"
            span = "" if topic.span_s is None else f"{topic.span_s:.{3 if topic.span_s < IN_MS_BELOW_S else 1}f}"
            rows.append(
                [
                    printable(topic.name),
                    "" if topic.rows is None else str(topic.rows),
                    rate,
                    span,
                    printable(", ".join(topic.fields)),
                ]
            )
        parts.append(columns(rows, right=(1, 2, 3)))
    if what.buses:
        parts.append(_every_word(what.buses) if everything else _every_bus(what.buses))
    if what.findings:
        rows = [[finding.severity, printable(finding.text)] for finding in named_lines(what.findings)]
        parts.append("findings\n" + columns(rows))
    return "\n\n".join(parts)


def _every_word(buses: "Sequence[BusWord]") -> str:
    """Return a line for each terminal and subaddress, or label."""
    rows = [["channel", "bus", "what", "count", "rate Hz", "ICD"]]
    for one in buses:
        rate = "" if one.rate_hz is None else f"{one.rate_hz:.4g}"
        rows.append([one.place, printable(one.bus), one.what, str(one.count), rate, printable(", ".join(one.names))])
    return columns(rows, right=(3, 4))


def _every_bus(buses: "Sequence[BusWord]") -> str:
    """Return a line for each bus, with what the ICD names on it."""
    rows = [["channel", "bus", "words", "kinds", "named", "by the ICD"]]
    for place, found in groupby(buses, key=lambda one: one.place):
        words = list(found)
        named = [one for one in words if one.names]
        listed = ", ".join(f"{one.what}: {' '.join(one.names)}" for one in named[:NAMED_SHOWN])
        listed += f" and {len(named) - NAMED_SHOWN} more" if len(named) > NAMED_SHOWN else ""
        total = sum(one.count for one in words)
        rows.append([place, printable(words[0].bus), str(total), str(len(words)), str(len(named)), printable(listed)])
    return columns(rows, right=(2, 3, 4))


def outcomes(
    done: Sequence[Outcome],
    *,
    as_json_text: bool = False,
    quiet: bool = False,
    with_times: bool = False,
    is_plan: bool = False,
    lines: Lines | None = None,
) -> None:
    """Print the outcome of each log: a line each on stdout, in the order of the logs.

    Those that ``lines`` told as they were done are not told again. On stderr why logs failed, what was skipped, by
    reason, then totals; of a plan there is no total.
    """
    if as_json_text:
        tell(as_json([_plain(outcome) for outcome in done]))
        return
    (lines or Lines(is_shown=not quiet, everything=with_times, is_plan=is_plan)).tell(tuple(done))
    if quiet:
        return
    for line in skipped_lines(done, most=len(done) if with_times else MOST_SKIPPED):
        say(line)
    if sum(not one.is_beside for one in done) > 1 and not is_plan:
        say(totals(done))


def removed(pdfs: Sequence[Path]) -> str:
    """Return the line on PDFs of an earlier run that a report without PDFs removed.

    Examples
    --------
    >>> removed([Path("out/summary.pdf")]), removed([Path("out/summary.pdf"), Path("out/a/report.pdf")])
    ('removed out/summary.pdf of an earlier run; --pdf makes it', 'removed 2 PDFs of an earlier run; --pdf makes them')
    """
    told, them = (str(pdfs[0]), "it") if len(pdfs) == 1 else (f"{len(pdfs)} PDFs", "them")
    return f"removed {told} of an earlier run; --pdf makes {them}"


def skipped_lines(done: Sequence[Outcome], most: int) -> list[str]:
    """Return logs that were skipped: one line for each reason, with at most so many names.

    Examples
    --------
    >>> notes = [Outcome(name, "skipped", f"{name}: no log") for name in ("a.txt", "b.txt")]
    >>> skipped_lines(notes, 1), skipped_lines(notes[:1], 1)
    (['skipped 2 files, a.txt and 1 more: no log'], ['skipped: a.txt: no log'])
    """
    by_reason: dict[str, list[str]] = {}
    for outcome in done:
        if outcome.state == "skipped":
            name = PurePath(outcome.source).name
            by_reason.setdefault(outcome.text.removeprefix(f"{name}: "), []).append(name)
    lines = []
    for reason, names in by_reason.items():
        if len(names) == 1:
            lines.append(printable(f"skipped: {names[0]}: {reason}"))
            continue
        more = f" and {len(names) - most} more" if len(names) > most else ""
        lines.append(printable(f"skipped {len(names)} files, {', '.join(names[:most])}{more}: {reason}"))
    return lines


def totals(done: Sequence[Outcome]) -> str:
    """Return the totals line: how many logs, and sessions of several, ended in which state.

    Examples
    --------
    >>> totals([Outcome("a", "done", ""), Outcome("b", "failed", "x")])
    '2 logs: 1 done, 0 with data lost, 0 at the limit, 1 failed, 0 skipped'
    >>> totals([Outcome("a", "done", ""), Outcome("a, b", "done", "", is_session=True)]).partition("; ")[2]
    '1 session: 1 done, 0 with data lost, 0 at the limit, 0 failed'
    >>> totals([Outcome("a", "incomplete", "")])
    '1 log: 0 done, 0 with data lost, 0 at the limit, 0 failed, 0 skipped, 1 incomplete'
    >>> totals([Outcome("a", "done", "", power_up=1), Outcome("a", "done", "", power_up=2)]).partition(":")[0]
    '1 log with 2 power-ups'
    >>> several = [Outcome("a", "done", ""), *(Outcome("b", "done", "", power_up=at) for at in (1, 2, 3))]
    >>> totals(several).partition(":")[0]
    '2 logs, 1 of them with 3 power-ups'
    >>> totals([Outcome("a", "done", "", was_finished=True)])
    '1 log: 1 done, 0 with data lost, 0 at the limit, 0 failed, 0 skipped; 1 was finished before'
    """
    done = [one for one in done if not one.is_beside]
    logs = _counted("log", [one for one in done if not one.is_session], list(_STATE_WORDS))
    sessions = [one for one in done if one.is_session and one.state != "skipped"]
    parts = [logs, *([_counted("session", sessions, list(_STATE_WORDS)[:-1])] if sessions else [])]
    before = sum(one.was_finished for one in done)
    if before:
        parts.append(f"{before} {'was' if before == 1 else 'were'} finished before")
    return "; ".join(parts)


def _counted(noun: str, done: Sequence[Outcome], states: Sequence[State]) -> str:
    counts = ", ".join(f"{sum(one.state == state for one in done)} {_STATE_WORDS[state]}" for state in states)
    incomplete = sum(one.state == "incomplete" for one in done)
    more = f", {incomplete} incomplete" if incomplete else ""
    power_ups = [one.source for one in done if one.power_up]
    several = len(set(power_ups))
    count = len(done) - len(power_ups) + several
    which = "" if count == 1 else f", {several} of them"
    told = f"{which} with {counted(len(power_ups), 'power-up')}" if several else ""
    return f"{counted(count, noun)}{told}: {counts}{more}"


MOST_SKIPPED = 5  # named in a line
_STATE_WORDS: Mapping[State, str] = {
    "done": "done",
    "data_lost": "with data lost",
    "limit_reached": "at the limit",
    "failed": "failed",
    "skipped": "skipped",
}


def _plain(outcome: Outcome) -> dict[str, Any]:
    return {
        **({"kind": "session"} if outcome.is_session else {"kind": "output"} if outcome.is_beside else {}),
        "source": outcome.source,
        "state": outcome.state,
        "exit_code": outcome.code,
        "flight_id": outcome.flight_id,
        "folder": outcome.folder,
        "was_finished": outcome.was_finished,
        **({"power_up": outcome.power_up} if outcome.power_up else {}),
        "text": outcome.text,
        **({"left_out": [failure.text for failure in outcome.failures]} if outcome.failures else {}),
    }


KINDS = {
    "note": "note",
    "analysis": "analyses",
    "format": "formats",
    "scenario": "scenarios",
    "session": "sessions",
    "plan": "plans",
    "study": "studies",
    "not loaded": "not loaded",
}


def settings(every: "Sequence[Setting]") -> str:
    """Return the text of ``list --settings``: a block for each table of a settings file."""
    parts = []
    for table, found in groupby(every, key=lambda one: one.table):
        rows = [[one.key, one.default, one.unit, one.allowed, one.meaning] for one in found]
        parts.append(f"[{table}]\n" + columns([["setting", "default", "unit", "allowed", "meaning"], *rows]))
    return "\n\n".join(parts)


def catalogue(entries: Sequence[Mapping[str, Any]], is_about_a_log: bool) -> str:
    """Return text of ``list``."""
    lines: list[str] = []
    kind = ""
    for entry in entries:
        if entry["kind"] != kind:
            kind = entry["kind"]
            lines += [*([""] if lines else []), KINDS[kind]]
        lines.append(f"  {entry['name']}  {entry['title']}")
        if entry["needs"] != "nothing":
            lines.append(f"    needs: {entry['needs']}")
        if is_about_a_log and "would_run" in entry:
            lines.append("    would run" if entry["would_run"] else f"    would not run: {printable(entry['reason'])}")
    return "\n".join(lines)
