"""Chapter on several INS of one flight: table by unit, table of pairs, radial errors."""

from collections.abc import Callable, Sequence
from typing import Any

from groundstation.base.units import S_PER_H
from groundstation.base.words import capitalised, listed
from groundstation.chapters.assessed import without_answer
from groundstation.chapters.parts import Cell, Claim, Facts, Figure, Grid, Head, Mark, Note, Part, Rank, Section, kept
from groundstation.chapters.wording import ABSENT, clock, number, percent, typeset
from groundstation.results.flight import FlightResults
from groundstation.systems.inertial.units_answer import LEAST_S, InsPair, InsUnit, Measured, UnitsResult

TITLE = "Several INS"
LEAD = (
    "Each INS of the flight against the reference, and against the others. Error = INS − reference; the difference of "
    "a pair is the second unit less the first."
)
MARKS: dict[str, Mark] = {
    "good": Mark("good", "Good"),
    "off": Mark("bad", "Off"),
    "one_of": Mark("warn", "It or another"),
    "aided": Mark("unknown", "GNSS corrects it"),
    "copy": Mark("unknown", "Repeats another"),
    "not_judged": Mark("unknown", "Not judged"),
}
CLAIMS: dict[str, Mark] = {
    "agree": Mark("good", "Agree"),
    "off": Mark("bad", "Off"),
    "one_of": Mark("warn", "They differ"),
    "not_judged": Mark("unknown", "Not judged"),
}
VERDICTS = {
    "agree": "No unit is off",
    "off": "{} off",
    "one_of": "{}: one is off",
    "not_judged": "Not judged",
}
MAPPED = "reader.mapped"  # code of the finding on what feeds a topic
SHORT_H = LEAST_S / S_PER_H  # of less no units are judged: it is told in seconds


def units(results: FlightResults) -> Section | None:
    """Return the chapter; None when the flight was not assessed and no reason is known."""
    answer = results.answer(UnitsResult)
    if answer is None:
        return without_answer(results, "ins_units", TITLE, LEAD)
    tone = CLAIMS[answer.verdict].tone
    parts: tuple[Part | None, ...] = (
        Note(f"{typeset(answer.sentence)}.", tone),
        *_remarks(answer),
        _table(answer),
        _sources(results, answer),
        _pairs(answer),
        Figure("units.radial") if any(pair.hours >= SHORT_H for pair in answer.pairs) else None,
    )
    return Section("ins_units", TITLE, LEAD, kept(parts), _headline(answer), claim=_claim(answer))


def _headline(answer: UnitsResult) -> str:
    return VERDICTS[answer.verdict].format(listed(answer.off) if answer.off else "")


def _claim(answer: UnitsResult) -> Claim:
    is_found = answer.verdict in ("off", "one_of")
    rank = Rank.INERTIAL if is_found else Rank.OTHER
    return Claim(
        rank,
        CLAIMS[answer.verdict],
        _headline(answer),
        ", ".join(answer.off),
        f"of {len(answer.units)} INS",
        (f"{typeset(answer.sentence)}.",),
        is_danger=answer.verdict == "off",
    )


def _remarks(answer: UnitsResult) -> list[Note]:
    notes = []
    for unit in answer.units:
        if len(unit.serials) > 1:
            notes.append(Note(f"{unit.topic}: the serial changes in flight, {' → '.join(unit.serials)}.", "warn"))
        if yet := answer.against_copy(unit):
            text = f"{unit.topic} repeats position and velocity of {unit.same_as}, yet {typeset(listed(yet))}"
            notes.append(Note(f"{text}: see how the two were recorded.", "warn"))
    return notes


def _measured(value: Measured | None, places: int, unit: str = "", *, signed: bool = False) -> str:
    if value is None:
        return ABSENT
    half = f" ± {number(value.half95, places)}" if value.half95 >= 0.5 * 10.0**-places else ""
    tail = f" {unit}" if unit else ""
    return f"{number(value.value, places, signed=signed)}{half}{tail}"


def _table(answer: UnitsResult) -> Grid:
    against = f"Against {answer.against_title}. " if answer.against else "Held against neither GNSS nor a trajectory. "
    caption = (
        f"{against}± is half of the 95 % interval of the measurement, left out where it rounds to nothing. "
        "A rate marked * is the growth inside the log: nothing shows when navigation began. Heading: less that of the "
        "trajectory. Clock: later (+) than the unit by which clocks are set; more than 0.05 s is taken off."
    )
    return _grid("Units", UNIT_COLUMNS, answer.units, caption)


def _sources(results: FlightResults, answer: UnitsResult) -> Facts | None:
    """Return the messages or words that feed each unit; None where none are told."""
    told = {one.topic: one.text for one in results.findings if one.code == MAPPED}
    pairs = [
        (unit.topic, told[unit.topic].removeprefix(f"{unit.topic} from "), "")
        for unit in answer.units
        if told.get(unit.topic, "").startswith(f"{unit.topic} from ")
    ]
    return Facts("Where the units come from", pairs) if pairs else None


def _name(unit: InsUnit) -> Cell:
    name = f"{unit.topic} ({', '.join(unit.serials)})" if unit.serials else unit.topic
    return name if unit.has_position else f"{name}, no position"


def _state(unit: InsUnit) -> Cell:
    mark = MARKS[unit.state]
    return Mark(mark.tone, f"Repeats {unit.same_as}") if unit.same_as else mark


def _rate(unit: InsUnit) -> Cell:
    rate = _measured(unit.rate_fit_nmiph, 2)
    return rate if unit.start_s is not None or rate == ABSENT else f"{rate} *"


def _over_time(unit: InsUnit) -> Cell:
    if unit.rate_50_nmiph is None:
        return ABSENT
    return f"{number(unit.rate_50_nmiph, 2)} / {number(unit.rate_95_nmiph, 2)}"


def _largest(unit: InsUnit) -> Cell:
    at = "" if unit.largest_at_s is None else f" at {clock(unit.largest_at_s)}"
    return f"{_measured(unit.largest_m, 0)}{at}"


def _clock(unit: InsUnit) -> Cell:
    lag = unit.lag_s
    return ABSENT if lag is None else f"{number(lag.value, 3, signed=True)} ± {number(lag.half95, 3)}"


UNIT_COLUMNS: tuple[tuple[Head, Callable[[InsUnit], Cell]], ...] = (
    (Head("Unit"), _name),
    (Head(""), _state),
    (Head("Kind"), lambda unit: unit.kind.replace("_", "-")),
    (Head("Rate by fit, nmi/h", True), _rate),
    (Head("Over time 50 / 95 %, nmi/h", True), _over_time),
    (Head("Velocity RMS, m/s", True), lambda unit: _measured(unit.velocity_rms_mps, 2)),
    (Head("Schuler amplitude, m/s", True), lambda unit: _measured(unit.schuler_mps, 2)),
    (Head("Largest error, m", True), _largest),
    (Head("Heading, °", True), lambda unit: number(unit.heading_difference_deg, 2, signed=True)),
    (Head("Clock, s", True), _clock),
)


def _grid(title: str, columns: Sequence[tuple[Head, Callable[[Any], Cell]]], rows: Sequence[Any], caption: str) -> Grid:
    """Return a table without the columns in which nothing is known."""
    cells = [[cell(row) for row in rows] for _, cell in columns]
    kept_columns = [place for place, column in enumerate(cells) if any(cell != ABSENT for cell in column)]
    heads = [columns[place][0] for place in kept_columns]
    return Grid(title, heads, [[cells[place][row] for place in kept_columns] for row in range(len(rows))], caption)


def _pairs(answer: UnitsResult) -> Grid:
    if all(pair.hours < SHORT_H for pair in answer.pairs):
        caption = (
            "Medians over the time of both, as logged. ± is what rounding and noise of both outputs do. In so short a "
            "time nothing is judged, and clocks are not compared: in motion a late clock looks like a distance."
        )
        return _grid("Pairs", PAIR_COLUMNS, answer.pairs, caption)
    caption = (
        f"Limits: what two honest units of the {_classes(answer)} exceed in "
        f"{percent(answer.false_alarm_share, 1)} of simulated flights of this length, Schuler oscillation and all; "
        "steps and outputs that stand still are taken out before. ± is what rounding and noise of both outputs do; "
        "rates marked * are the growth inside the log."
    )
    return _grid("Pairs", PAIR_COLUMNS, answer.pairs, caption)


def _classes(answer: UnitsResult) -> str:
    names = list(dict.fromkeys(unit.ins_class for unit in answer.units if unit.ins_class))
    if len(names) > 1:
        return f"classes {listed(names)} (each its own)"
    origin = f" ({answer.ins_class_origin})" if answer.ins_class_origin else ""
    return f"class {answer.ins_class}{origin}"


def _pair_rate(pair: InsPair) -> Cell:
    rate = _measured(pair.rate_fit_nmiph, 2)
    return rate if pair.is_start_known or rate == ABSENT else f"{rate} *"


def _pair_state(pair: InsPair) -> Cell:
    if pair.why_not:
        is_name = pair.why_not.startswith((pair.first, pair.second))
        return Mark("unknown", pair.why_not if is_name else capitalised(pair.why_not))
    return Mark("warn", "Beyond") if pair.is_beyond else Mark("good", "Within")


def _together(pair: InsPair) -> Cell:
    return f"{pair.hours * S_PER_H:.2g} s" if pair.hours < SHORT_H else f"{number(pair.hours, 2)} h"


PAIR_COLUMNS: tuple[tuple[Head, Callable[[InsPair], Cell]], ...] = (
    (Head("Pair"), lambda pair: f"{pair.second} − {pair.first}"),
    (Head(""), _pair_state),
    (Head("Together", True), _together),
    (Head("Rate, nmi/h", True), _pair_rate),
    (Head("Limit", True), lambda pair: number(pair.rate_limit_nmiph, 2)),
    (Head("Velocity RMS, m/s", True), lambda pair: _measured(pair.velocity_rms_mps, 2)),
    (Head("Limit", True), lambda pair: number(pair.velocity_limit_mps, 2)),
    (Head("Schuler amplitude, m/s", True), lambda pair: _measured(pair.schuler_mps, 2)),
    (Head("Largest distance, m", True), lambda pair: _measured(pair.largest_m, 0)),
    (Head("Heading, °", True), lambda pair: _measured(pair.heading_difference_deg, 2, signed=True)),
    (Head("Limit", True), lambda pair: number(pair.heading_limit_deg, 2)),
)
