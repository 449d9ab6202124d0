"""Advice of the heading correction: what to fly, record and check, and what it needs."""

from collections.abc import Iterator

from groundstation.chapters.chapter import Advice, Remedies
from groundstation.chapters.wording import number, significant
from groundstation.results.flight import FlightResults
from groundstation.results.gates import NO_CONTACT, Gate, in_plain_words
from groundstation.systems.heading.answer import HeadingResult
from groundstation.systems.heading.gates_answer import GATES

PURPOSE = "heading correction"
TAXI = "taxi straight above 6 m/s for 20 s before take-off"
REMEDIES: Remedies = (
    ("ground speed never above", ("Fly", TAXI)),
    ("needed for an estimate", ("Fly", TAXI)),
    ("no straight taxi", ("Fly", TAXI)),
    ("ground contact proven", ("Record", "weight on wheels")),
)
NO_GROUND_RUN = ("ground speed never above", "no straight taxi", NO_CONTACT)
WHAT_IT_NEEDS = (
    "The method needs a straight run on the ground at taxi speed, where the nose points along the motion, with ground "
    "contact proven; this log has none, or hardly any"
)


def advise(results: FlightResults) -> Iterator[Advice]:
    """Yield what helps against each gate that keeps the number from being typed."""
    answer = results.answer(HeadingResult)
    for gate in () if answer is None else answer.gates:
        if gate.state == "failed" or (gate.state == "not_measured" and gate.required):
            yield from _against(gate)


def _against(gate: Gate) -> Iterator[Advice]:
    kind = GATES.get(gate.name)
    if kind is None or not kind.advice:
        return
    limit = gate.limit if isinstance(gate.limit, float) else None
    text = kind.advice.format(limit=number(limit, 0, gate.unit), value=f"{significant(gate.value)} {gate.unit}")
    yield Advice(kind.line, text, PURPOSE, is_pressing=True)


def explained(reason: str) -> str:
    """Return the reason, with the needs of the method where the aircraft did not taxi.

    Examples
    --------
    >>> explained("no INS heading in the log")
    'no INS heading in the log'
    >>> explained("no straight taxi: of 9 epochs above 6 m/s before lift-off: not proven ground 9")[:91]
    'no straight taxi: of 9 epochs above 6 m/s before lift-off: ground contact not proven for 9.'
    """
    told = in_plain_words(reason)
    return f"{told}. {WHAT_IT_NEEDS}" if reason.startswith(NO_GROUND_RUN) else told
