"""Lines of a run on stdout: one for each flight, as soon as it is done, the verdict first."""

import re
from collections.abc import Mapping
from pathlib import Path

from groundstation.base.ledger import DATA_LOST
from groundstation.cli.text import printable, say, tell_line
from groundstation.pipeline.one_flight.log import log_name
from groundstation.pipeline.one_flight.outcome import Outcome, State
from groundstation.pipeline.one_flight.progress import Event

MOST_NAMED = 4  # logs of a session
LONGEST = 160  # characters of a line behind the name of the log
STATES: Mapping[State, str] = {"data_lost": DATA_LOST, "limit_reached": "at the limit", "incomplete": "incomplete"}
GRADES: Mapping[str, str] = {
    **dict.fromkeys(("accept", "pass", "good", "agree", "stabilised", "consistent"), "green"),
    **dict.fromkeys(("measured", "joined"), "green"),
    **dict.fromkeys(("reject", "refused", "fail", "failed", "bad", "wrong", "off", "not", "left GNSS"), "red"),
    **dict.fromkeys((DATA_LOST, "moved while aligning"), "red"),
    **dict.fromkeys(("doubtful", "undecided", "ambiguous", "warn", "warnings", "filter wrong"), "yellow"),
    **dict.fromkeys(("no rate", "not judged", "not measured", "joined roughly"), "yellow"),
    **dict.fromkeys(("advisory", "extend", "too sure", "not stabilised", "they differ", "it or another"), "yellow"),
}
_BESIDE = re.compile(r" \([^()]*\)")

_Key = tuple[str, int, str]


class Lines:
    """Lines of a run, each told once.

    Parameters
    ----------
    longest : int, optional
        Characters of a line behind the name of the log; left out, lines are told in full.
    is_shown : bool
        Whether lines are wanted, errors are told in any case.
    everything : bool
        Lines in full, with what each stage took and where an error came from.
    only_news : bool
        Without what an earlier run had finished.
    is_plan : bool
        Lines of what would be done: the flight first, and no state.
    """

    def __init__(
        self,
        *,
        longest: int | None = None,
        is_shown: bool = True,
        everything: bool = False,
        only_news: bool = False,
        is_plan: bool = False,
    ) -> None:
        self._longest, self._is_plan = None if everything else longest, is_plan
        self._is_shown, self._everything, self._only_news = is_shown, everything, only_news
        self._told: dict[_Key, str] = {}
        self._names: dict[str, str] = {}

    def listen(self, event: Event) -> None:
        """Tell what an event says of flights that are done."""
        self.tell(event.outcomes)

    def tell(self, outcomes: tuple[Outcome, ...]) -> None:
        """Tell of each flight on stdout, of errors on stderr; of one told before what is new."""
        for outcome in outcomes:
            key = outcome.source, outcome.power_up, outcome.flight_id or outcome.text
            if self._only_news and outcome.was_finished:
                continue
            before = self._told.get(key)
            self._told[key] = outcome.text
            if before is not None:
                self._show(outcome, outcome.text.removeprefix(f"{before}; ") if outcome.text != before else "")
                continue
            if outcome.state not in ("failed", "skipped"):
                plan = "  ".join(filter(None, (outcome.flight_id, outcome.text)))
                self._show(outcome, plan if self._is_plan else line_of(outcome, self._longest))
            if self._everything and outcome.times_s:
                say("  " + ", ".join(f"{stage} {seconds:.2f} s" for stage, seconds in outcome.times_s.items()))
            tell_errors(outcome, with_traces=self._everything)

    def _show(self, outcome: Outcome, line: str) -> None:
        if self._is_shown and line:
            found = re.match(r"[^:;,(]*", line)
            phrase = found.group() if found else ""
            verdict = next((one for one in (phrase, phrase.partition(" ")[0]) if one in GRADES), "")
            tell_line(self._name(outcome), line, verdict, GRADES.get(verdict))

    def _name(self, outcome: Outcome) -> str:
        """Return the name of a log, its path where another of that name was told before."""
        name = name_of(outcome)
        return name if self._names.setdefault(name, outcome.source) == outcome.source else outcome.source


def name_of(outcome: Outcome) -> str:
    """Return the name of a log, or of the logs of a session.

    Examples
    --------
    >>> name_of(Outcome("a/b.csv", "done", "")), name_of(Outcome("a, b, c, d, e", "done", "", is_session=True))
    ('b.csv', 'a and 4 other logs')
    """
    if not outcome.is_session:
        return log_name(Path(outcome.source))
    names = outcome.source.split(", ")
    return outcome.source if len(names) <= MOST_NAMED else f"{names[0]} and {len(names) - 1} other logs"


def line_of(outcome: Outcome, most: int | None = LONGEST) -> str:
    """Return the line behind the name of a log: the verdict, its state, the flight.

    Examples
    --------
    >>> line_of(Outcome("a.csv", "data_lost", "accept: heading error +0.9 deg", flight_id="A_1"))
    'accept: heading error +0.9 deg  data lost  A_1'
    >>> len(line_of(Outcome("a.csv", "done", "word, " * 99, flight_id="A_1", was_finished=True)))
    156
    """
    state = STATES.get(outcome.state, "")
    if outcome.state == "data_lost" and outcome.loss:
        state = outcome.loss
    is_told = outcome.text.startswith(f"{state}:")
    states = ("" if is_told else state, "finished before" if outcome.was_finished else "")
    behind = [part for part in (", ".join(filter(None, states)), outcome.flight_id) if part]
    room = None if most is None else most - sum(2 + len(part) for part in behind)
    return "  ".join(part for part in (shortened(outcome.text, room), *behind) if part)


def shortened(text: str, most: int | None) -> str:
    """Return text of at most so many characters, cut behind a clause.

    It keeps the brackets that fit.

    Examples
    --------
    >>> shortened("error +0.9 deg (+0.8 with sideslip), enter -0.9 deg; 16 satellites", 40)
    'error +0.9 deg, enter -0.9 deg ...'
    >>> shortened("no rate (state a start): INS 3 nmi (raw INS 5 nmi)", 40)
    'no rate (state a start): INS 3 nmi'
    >>> shortened("abcdefgh", 6), shortened("ab", 6)
    ('ab ...', 'ab')
    """
    if most is None or len(text) <= most:
        return text
    bare, end, tail = _BESIDE.sub("", text), len(text), ""
    if len(bare) > most:
        tail, room = " ...", max(0, most - len(" ..."))
        end = next((place for mark in ("; ", ", ", " ") if (place := bare.rfind(mark, room // 2, room + 1)) > 0), room)
    bare = bare[:end]
    room, told, before = most - len(bare) - len(tail), "", 0
    for beside in _BESIDE.finditer(text):
        plain = text[before : beside.start()]
        if len(plain) > len(bare):
            break
        fits = len(beside.group()) <= room
        told += plain + beside.group() * fits
        room -= len(beside.group()) * fits
        bare, before = bare[len(plain) :], beside.end()
    return f"{told}{bare}{tail}"


def tell_errors(outcome: Outcome, *, with_traces: bool = False) -> None:
    """Print on stderr why a log failed, and which parts of a flight did."""
    traces = [outcome.trace] if outcome.state == "failed" else []
    if outcome.state == "failed":
        say(printable(f"error: {outcome.text}"))
    for failure in outcome.failures:
        say(printable(f"error: {name_of(outcome)}: {failure.text}"))
        traces.append(failure.trace)
    for trace in filter(None, traces if with_traces else ()):
        say(trace.rstrip())
