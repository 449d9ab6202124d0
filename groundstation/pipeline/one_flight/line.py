"""Line of a flight on the terminal: verdict and answers in the order of its page."""

import re
from typing import TYPE_CHECKING

from groundstation.base.failures import attempt
from groundstation.base.ledger import DATA_LOST
from groundstation.chapters.by_answer import answers_in_order, loss_above
from groundstation.results.flight import FlightResults
from groundstation.results.recorded import clock_steps, recorded, simulated

if TYPE_CHECKING:
    from groundstation.systems.system import Systems


def line_of_results(results: FlightResults, systems: "Systems") -> str:
    """Return the results of a flight in one line, the answer first that its page opens with.

    Before all stands that a simulator made the log, behind the first answer that the recorder's clock stepped.
    """
    return "; ".join(filter(None, (simulated(results), _told(results, systems))))


def _told(results: FlightResults, systems: "Systems") -> str:
    said = ((one.name, attempt("line", one.name, one.sentence, results.answers)) for one in systems.analyses)
    texts = {name: text for name, text in said if text}
    if not texts:
        return _without_answer(results)
    order = answers_in_order(results, systems.chapters)
    names = dict.fromkeys(name for one in order for name in one.analyses if name in texts)
    first_told, *others = (texts[name] for name in names | texts)
    told = [first_told, *filter(None, [clock_steps(results)]), *others]
    claims = [one.section.claim for one in order if not texts.keys().isdisjoint(one.analyses)]
    first = claims[0] if claims else None
    if loss := loss_above(results, first):
        return "; ".join((f"{DATA_LOST}: {loss}", *told))
    return "; ".join(told if first is None else (verdict_first(first.mark.text, told[0]), *told[1:]))


def verdict_first(verdict: str, text: str) -> str:
    """Return a text behind the word of its verdict, which is told once.

    Examples
    --------
    >>> verdict_first("Accept", "accept: heading error +0.9 deg"), verdict_first("Good", "RTK fixed 99 %")
    ('accept: heading error +0.9 deg', 'good: RTK fixed 99 %')
    >>> verdict_first("Bad", "autopilot health bad: gyros disagree")
    'bad: autopilot health: gyros disagree'
    >>> verdict_first("Reject", "magnetic deviation reject (no turn)")
    'reject: magnetic deviation (no turn)'
    >>> verdict_first("Off", "ins.1 is off: velocity error 3.2 m/s")
    'off: ins.1: velocity error 3.2 m/s'
    """
    word = f"{verdict[:1].lower()}{verdict[1:]}"
    if text.lower().startswith(word.lower()):
        return text
    head = re.match(rf"([^:;,(]*?)(?: is)? {re.escape(word)}(?=[:;,( ]|$)", text, re.IGNORECASE)
    return f"{word}: {text if head is None else head.group(1) + text[head.end() :]}"


def _without_answer(results: FlightResults) -> str:
    told = "; ".join(filter(None, (recorded(results), clock_steps(results))))
    if not results.not_assessable:
        return told
    first, *others = results.not_assessable
    more = f" and {len(others)} more" if others else ""
    return f"{told}; not assessable: {first.analysis} ({first.reason}){more}"
