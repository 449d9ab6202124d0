"""Chapter on several INS of one flight: table by unit, table of pairs, radial errors."""

from groundstation.base.words import listed
from groundstation.chapters.assessed import without_answer
from groundstation.chapters.parts import Cell, Claim, Figure, Grid, Head, Mark, Note, Part, Rank, Section, kept
from groundstation.chapters.wording import ABSENT, clock, number, percent, typeset, with_full_stop
from groundstation.results.flight import FlightResults
from groundstation.systems.inertial.units_answer import InsPair, InsUnit, Measured, UnitsResult

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


def units(results: FlightResults) -> Section | None:
    """Return the chapter; None when the flight was not assessed and no reason is known."""
    answer = results.answer(UnitsResult)
    if answer is None:
        return without_answer(results, "units", TITLE, LEAD)
    tone = CLAIMS[answer.verdict].tone
    parts: tuple[Part | None, ...] = (
        Note(with_full_stop(_capital(typeset(answer.sentence))), tone),
        *_remarks(answer),
        _table(answer),
        _pairs(answer),
        Figure("units.radial"),
    )
    return Section("units", TITLE, LEAD, kept(parts), _headline(answer), claim=_claim(answer))


def _capital(text: str) -> str:
    return f"{text[:1].upper()}{text[1:]}" if not text.startswith("ins") else text


def _headline(answer: UnitsResult) -> str:
    return VERDICTS[answer.verdict].format(listed(answer.off) if answer.off else "")


def _claim(answer: UnitsResult) -> Claim:
    is_found = answer.verdict in ("off", "one_of")
    rank = Rank.INERTIAL if is_found else Rank.OTHER
    return Claim(rank, CLAIMS[answer.verdict], _headline(answer), sentences=(with_full_stop(typeset(answer.sentence)),))


def _remarks(answer: UnitsResult) -> list[Note]:
    notes = []
    for unit in answer.units:
        if len(unit.serials) > 1:
            notes.append(Note(f"{unit.topic}: the serial changes in flight, {' → '.join(unit.serials)}.", "warn"))
    return notes


def _measured(value: Measured | None, places: int, unit: str = "") -> str:
    if value is None:
        return ABSENT
    half = f" ± {number(value.half95, places)}" if value.half95 >= 0.5 * 10.0**-places else ""
    tail = f" {unit}" if unit else ""
    return f"{number(value.value, places)}{half}{tail}"


def _table(answer: UnitsResult) -> Grid:
    heads = (
        *(Head("Unit"), Head("Kind"), Head("Rate by fit, nmi/h", True), Head("Over time 50 / 95 %, nmi/h", True)),
        *(Head("Velocity RMS, m/s", True), Head("Schuler amplitude, m/s", True), Head("Largest error, m", True)),
        *(Head("Heading, °", True), Head("Clock, s", True), Head("")),
    )
    against = answer.against_title or "nothing: there is no GNSS and no trajectory"
    caption = (
        f"Against {against}. ± is half of the 95 % interval of the measurement, left out where it rounds to nothing. "
        "A rate marked * is the growth inside the log: nothing shows when navigation began. Heading: less that of the "
        "trajectory. Clock: later (+) than the unit by which clocks are set, taken off."
    )
    return Grid("Units", heads, [_row(unit) for unit in answer.units], caption)


def _row(unit: InsUnit) -> tuple[Cell, ...]:
    rate = _measured(unit.rate_fit_nmiph, 2)
    over_time = f"{number(unit.rate_50_nmiph, 2)} / {number(unit.rate_95_nmiph, 2)}"
    largest = _measured(unit.largest_m, 0)
    at = "" if unit.largest_at_s is None else f" at {clock(unit.largest_at_s)}"
    mark = MARKS[unit.state]
    if unit.same_as:
        mark = Mark(mark.tone, f"Repeats {unit.same_as}")
    name = f"{unit.topic} ({', '.join(unit.serials)})" if unit.serials else unit.topic
    return (
        name if unit.has_position else f"{name}, no position",
        unit.kind.replace("_", "-"),
        rate if unit.is_start_known or rate == ABSENT else f"{rate} *",
        ABSENT if unit.rate_50_nmiph is None else over_time,
        _measured(unit.velocity_rms_mps, 2),
        _measured(unit.schuler_mps, 2),
        f"{largest}{at}",
        number(unit.heading_difference_deg, 2, signed=True),
        ABSENT
        if unit.lag_s is None
        else f"{number(unit.lag_s.value, 2, signed=True)} ± {number(unit.lag_s.half95, 2)}",
        mark,
    )


def _pairs(answer: UnitsResult) -> Grid:
    heads = (
        *(Head("Pair"), Head("Hours", True), Head("Rate, nmi/h", True), Head("Limit", True)),
        *(Head("Velocity RMS, m/s", True), Head("Limit", True), Head("Schuler amplitude, m/s", True)),
        *(Head("Largest distance, m", True), Head("Heading, °", True), Head("")),
    )
    origin = f" ({answer.ins_class_origin})" if answer.ins_class_origin else ""
    caption = (
        f"Limits: what two honest units of the class {answer.ins_class}{origin} exceed in "
        f"{percent(answer.false_alarm_share, 1)} of simulated flights of this length, Schuler oscillation and all; "
        "steps and outputs that stand still are taken out before."
    )
    return Grid("Pairs", heads, [_pair_row(pair) for pair in answer.pairs], caption)


def _pair_row(pair: InsPair) -> tuple[Cell, ...]:
    mark = Mark("unknown", pair.why_not[:1].upper() + pair.why_not[1:])
    if not pair.why_not:
        mark = Mark("warn", "Beyond") if pair.is_beyond else Mark("good", "Within")
    return (
        f"{pair.second} − {pair.first}",
        number(pair.hours, 2),
        number(pair.rate_fit_nmiph, 2),
        number(pair.rate_limit_nmiph, 2),
        number(pair.velocity_rms_mps, 2),
        number(pair.velocity_limit_mps, 2),
        number(pair.schuler_mps, 2),
        number(pair.largest_m, 0),
        number(pair.heading_difference_deg, 2, signed=True),
        mark,
    )
