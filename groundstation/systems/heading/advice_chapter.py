"""Advice of the heading correction: what to fly, record and check, and what it needs."""

from collections.abc import Iterator, Mapping

from groundstation.chapters.chapter import Advice, NextLine, Remedies
from groundstation.chapters.wording import number, significant
from groundstation.results.flight import FlightResults
from groundstation.results.gates import NO_CONTACT, Gate, in_plain_words
from groundstation.systems.heading.answer import HeadingResult

PURPOSE = "heading correction"
TAXI = "taxi straight above 6 m/s for 20 s before take-off"
# What helps against a gate that failed or was not measured: line, advice.
BY_GATE: Mapping[str, tuple[NextLine, str]] = {
    "taxi_seconds": ("Fly", "taxi straight for {limit} or more before take-off"),
    "before_take_off": ("Fly", "taxi straight before take-off: taxi after landing does not count"),
    "half_width": ("Fly", "taxi straight for longer"),
    "precision": ("Fly", "taxi straight for longer"),
    "whole_half_width": (
        "Fly",
        "taxi the other way too, state the wind (--weather) and aircraft_class, or let the tool learn the installation",
    ),
    "standstill_duration": ("Fly", "stand still for 30 s before taxi"),
    "standstill_speed_of_mean": ("Fly", "stand still for 30 s before taxi, with an open sky"),
    "geometry": ("Record", "GDOP, PDOP or HDOP"),
    "integrity": ("Record", "the integrity flag of GNSS"),
    "ground": ("Record", "weight on wheels"),
    "gnss_rate": ("Record", "GNSS velocity at 10 Hz (now {value})"),
    "held_velocity": ("Check", "the receiver: it holds its velocity in turns (static hold, dynamic model)"),
    "drift": ("Check", "the alignment of the INS: let it settle before taxi"),
    "steps": ("Check", "the alignment of the INS: its heading stepped"),
    "ins_mode": ("Check", "the alignment of the INS: it changed its mode"),
}
SURROUNDINGS = ("outliers", "segments", "quality", "variance_ratio", "normal_distance", "skewness", "kurtosis")
REFLECTIONS = "the taxiway for reflections and gusts"
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
    if gate.name in SURROUNDINGS:
        yield Advice("Check", REFLECTIONS, PURPOSE, is_pressing=True)
    elif gate.name in BY_GATE:
        line, text = BY_GATE[gate.name]
        limit = gate.limit if isinstance(gate.limit, float) else None
        told = text.format(limit=number(limit, 0, gate.unit), value=f"{significant(gate.value)} {gate.unit}")
        yield Advice(line, told, PURPOSE, is_pressing=True)


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
