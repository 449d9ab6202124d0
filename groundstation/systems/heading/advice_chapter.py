"""Advice of the heading correction: what to fly, record and check, and what it needs."""

from collections.abc import Iterator

from groundstation.base.quantiles import NORMAL_95
from groundstation.chapters.assessed import reason_of
from groundstation.chapters.chapter import Advice, Remedies
from groundstation.chapters.held_signals import is_held
from groundstation.chapters.wording import number, significant
from groundstation.results.flight import KIND_OF_VEHICLE, WHY_THAT_VEHICLE, FlightResults
from groundstation.results.gates import NO_CONTACT, NOT_PROVEN, WITHOUT_ROLLING, Gate, in_plain_words
from groundstation.systems.heading.answer import HeadingResult
from groundstation.systems.heading.gates_answer import (
    GATES,
    LONGER,
    STATE_THE_KIND,
    TAXI_ALONE,
    UNPROVEN,
    UNPROVEN_OPEN,
)

PURPOSE = "heading correction"
WHEELS = "weight on wheels"
FROM_THE_STAND = "the ground run too (by weight on wheels this log holds none)"
STANDSTILL_S = 30.0
LONGEST_TAXI_S = 300.0  # no taxiway is straight for longer
NO_GROUND_RUN = ("ground speed never above", "no straight taxi", NO_CONTACT)
WHAT_IT_NEEDS = (
    "The method needs a straight run on the ground at taxi speed, where the nose points along the motion, with ground "
    "contact proven; this log has none, or hardly any"
)


def remedies(taxi_speed_min_mps: float, taxi_min_s: float) -> Remedies:
    """Return what mends a missing answer, by the shipped limits.

    The answer is what would keep those of the run.
    """
    taxi = f"taxi straight above {taxi_speed_min_mps:g} m/s for {taxi_min_s:g} s before take-off"
    return (
        ("ground speed never above", ("Fly", taxi)),
        ("needed for an estimate", ("Fly", taxi)),
        ("no straight taxi", ("Fly", taxi)),
    )


def advise(results: FlightResults) -> Iterator[Advice]:
    """Yield what helps against each gate that keeps the number from being typed."""
    answer = results.answer(HeadingResult)
    if answer is None:
        reason = reason_of(results, HeadingResult.analysis)
        if _has_no_wheels(results):
            return
        if NO_CONTACT in reason or (NOT_PROVEN in reason and _is_found_to_roll(results)):
            yield _on_proof(results)
        return
    standstill = f"{answer.setting('standstill_max_s', STANDSTILL_S):g} s"
    for gate in answer.gates:
        if gate.state == "failed" or (gate.state == "not_measured" and gate.required):
            yield from _against(gate, answer, standstill)
    is_told = any(gate.name in (UNPROVEN, UNPROVEN_OPEN) and gate.state == "failed" for gate in answer.gates)
    if answer.unproven_ground is not None and not is_told:
        yield _on_proof(results)


def _on_proof(results: FlightResults) -> Advice:
    """Return what proves the ground: the kind of what is found to roll, else a flag."""
    if _is_found_to_roll(results):
        return Advice("Check", STATE_THE_KIND, PURPOSE)
    return Advice("Record", FROM_THE_STAND if is_held(results, WHEELS) else WHEELS, PURPOSE)


def _has_no_wheels(results: FlightResults) -> bool:
    """Tell whether it set down without rolling, or is a copter: it has no taxi."""
    firmware = f"{results.metadata.get('vehicle', '')} {results.metadata.get('firmware', '')}".lower()
    return "copter" in firmware or any(WITHOUT_ROLLING in one.reason for one in results.not_assessable)


def _is_found_to_roll(results: FlightResults) -> bool:
    is_stated = results.metadata.get(WHY_THAT_VEHICLE, "").startswith("stated")
    return results.metadata.get(KIND_OF_VEHICLE) == "rolls" and not is_stated


def _longer(gate: Gate, answer: HeadingResult) -> Advice:
    """Return how long a taxi reaches the limit, or what keeps any from it.

    A half width falls with the square root of the time. A wander of minutes does not average out within a taxi.
    """
    if not isinstance(gate.limit, float) or gate.value is None or gate.limit <= 0.0:
        return Advice("Fly", LONGER, PURPOSE, is_pressing=True)
    if gate.name == TAXI_ALONE and _is_mostly_wander(gate.value, answer):
        wander, over = number(answer.wander_spread_deg, 2, "deg"), number(answer.wander_s, 0, "s")
        text = (
            f"the alignment of the INS: its heading wanders by {wander} (one sigma) over {over}, which a longer taxi "
            "hardly averages: let it settle, and repeat the run"
        )
        return Advice("Check", text, PURPOSE, is_pressing=True)
    needed_s = answer.taxi_seconds * (gate.value / gate.limit) ** 2
    needed, now = number(needed_s, 0, "s"), number(answer.taxi_seconds, 0, "s")
    text = f"taxi straight for {needed} or more in all (now {now})"
    if needed_s > LONGEST_TAXI_S:
        text = f"repeat the run: the limit needs {needed} of straight taxi (now {now}), more than one taxi has"
    return Advice("Fly", text, PURPOSE, is_pressing=True)


def _is_mostly_wander(half_width_deg: float, answer: HeadingResult) -> bool:
    """Tell whether the wander makes half of the variance of an interval."""
    if not answer.wander_spread_deg or not answer.wander_s or answer.taxi_seconds <= 0.0:
        return False
    averaged = min(2.0 * answer.wander_s / answer.taxi_seconds, 1.0)
    return (NORMAL_95 * answer.wander_spread_deg) ** 2 * averaged >= 0.5 * half_width_deg**2


def _against(gate: Gate, answer: HeadingResult, standstill: str) -> Iterator[Advice]:
    kind = GATES.get(gate.name)
    if kind is None or not kind.advice:
        return
    if kind.advice == LONGER:
        yield _longer(gate, answer)
        return
    limit = gate.limit if isinstance(gate.limit, float) else None
    value = f"{significant(gate.value)} {gate.unit}"
    text = kind.advice.format(limit=number(limit, 0, gate.unit), value=value, standstill=standstill)
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
