"""Chapter on what to fly, record and check next time.

It covers every answer that this flight could not give or not decide.
"""

from collections.abc import Iterator

from groundstation.chapters.assessed import SUBJECTS
from groundstation.chapters.parts import Facts, Section
from groundstation.chapters.wording import number, significant
from groundstation.results.flight import FlightResults
from groundstation.results.gates import Gate
from groundstation.systems.heading.answer import HeadingResult
from groundstation.systems.inertial.answer import InertialResult
from groundstation.systems.inertial.claim_chapter import is_start_unknown

TITLE = "What to do next"
LEAD = ""
LINES = ("Fly", "Record", "Check")
MOST_OF_A_LINE = 4
TAXI = "taxi straight above 6 m/s for 20 s before take-off"

# What helps against a gate of the heading correction that failed or was not measured: line, advice. First come first.
BY_GATE = {
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
REFLECTIONS = ("Check", "the taxiway for reflections and gusts")
# By a part of the reason for which an analysis could not be carried out.
BY_REASON = (
    ("ground speed never above", ("Fly", TAXI)),
    ("needed for an estimate", ("Fly", TAXI)),
    ("no straight taxi", ("Fly", TAXI)),
    ("ground contact proven", ("Record", "weight on wheels")),
    ("no turn of steady bank", ("Fly", "a full circle to either side at equal bank")),
    ("expected at least 300 s", ("Fly", "5 min or more with INS and GNSS")),
    ("GNSS never had a fix", ("Check", "the GNSS antenna, its cable and its sky")),
    ("no GNSS velocity", ("Record", "GNSS velocity")),
    ("no INS position", ("Record", "INS position")),
    ("no GNSS position", ("Record", "GNSS position")),
    ("no INS heading", ("Record", "INS heading")),
    ("no three-axis magnetometer", ("Record", "a three-axis magnetometer")),
    ("no position of the aircraft", ("Record", "positions")),
    ("trusts_aided_heading", ("Check", "where the INS heading comes from (setting trusts_aided_heading)")),
)
FREE_INERTIAL = "the free-inertial output of the INS"
LOST = "the recorder: data were lost"


def next_steps(results: FlightResults) -> Section | None:
    """Return the chapter in at most three lines; None where nothing is left to advise."""
    lines: dict[str, dict[str, list[str]]] = {line: {} for line in LINES}
    for line, text, purpose in _advice(results):
        texts = lines[line].setdefault(purpose, [])
        if text not in texts and sum(map(len, lines[line].values())) < MOST_OF_A_LINE:
            texts.append(text)
    pairs = [(line, _told(lines[line]), "") for line in LINES if any(lines[line].values())]
    return Section("next", TITLE, LEAD, (Facts("", pairs),)) if pairs else None


def _told(texts: dict[str, list[str]]) -> str:
    """Return what is wanted, grouped by its purpose."""
    each = (
        f"for the {purpose}: {', '.join(some)}" if purpose else ", ".join(some)
        for purpose, some in texts.items()
        if some
    )
    told = "; ".join(each)
    return f"{told[:1].upper()}{told[1:]}."


def _advice(results: FlightResults) -> Iterator[tuple[str, str, str]]:
    """Yield line, advice and what it is for, the most pressing first."""
    heading, inertial = results.answer(HeadingResult), results.answer(InertialResult)
    if heading is not None:
        for gate in heading.gates:
            if gate.state == "failed" or (gate.state == "not_measured" and gate.required):
                yield from _against(gate)
    for one in results.not_assessable:
        purpose = SUBJECTS.get(one.analysis, one.analysis)
        purpose = purpose if purpose.startswith("INS") else purpose[:1].lower() + purpose[1:]
        for part, (line, text) in BY_REASON:
            if part in one.reason:
                yield line, text, purpose
    if inertial is not None and inertial.kind == "gnss_aided":
        yield "Record", FREE_INERTIAL, "INS errors"
    if inertial is not None and inertial.kind == "unknown":
        yield "Check", "whether GNSS corrects this INS (ins_kind of the aircraft file)", "INS errors"
    if inertial is not None and is_start_unknown(inertial):
        yield "Check", "when the INS began to navigate (nav_start_utc of the aircraft file)", "INS errors"
    if results.status != "ok":
        yield "Check", LOST, ""


def _against(gate: Gate) -> Iterator[tuple[str, str, str]]:
    if gate.name in SURROUNDINGS:
        yield *REFLECTIONS, "heading correction"
    elif gate.name in BY_GATE:
        line, text = BY_GATE[gate.name]
        limit = gate.limit if isinstance(gate.limit, float) else None
        told = text.format(limit=number(limit, 0, gate.unit), value=f"{significant(gate.value)} {gate.unit}")
        yield line, told, "heading correction"
