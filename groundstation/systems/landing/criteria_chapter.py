"""Criteria of an approach as tables of its chapter: state, value, limit, place, source."""

import math
from collections.abc import Iterable
from dataclasses import replace

from groundstation.base.quantiles import NORMAL_95
from groundstation.base.units import M_PER_FOOT, M_PER_NAUTICAL_MILE
from groundstation.base.words import capitalised
from groundstation.chapters.gates import limit_text, state_of
from groundstation.chapters.parts import Cell, Facts, Grid, Head, Mark, Note, Part, Tone
from groundstation.chapters.wording import (
    ABSENT,
    number,
    number_with_unit,
    percent,
    sentence,
    significant,
    typeset,
    unit_sign,
    with_feet,
)
from groundstation.results.gates import Gate
from groundstation.systems.landing.answer import Approach, StabilisedAt
from groundstation.systems.landing.criteria_answer import EDITIONS, KINDS, Criterion, Place
from groundstation.systems.landing.verdict_answer import counts_words

TONES: dict[str, Tone] = {
    "met": "good",
    "not met": "warn",
    "undecided": "unknown",
    "no limit": "unknown",
    "not measured": "unknown",
    "not logged": "unknown",
}
HEADS = (
    Head("State"),
    Head("Criterion"),
    Head("Value", True),
    Head("Limit", True),
    Head("Height; before threshold, as recorded"),
    Head("Source; remark"),
)
GATE_STATES = {"passed": Mark("good", "met"), "failed": Mark("warn", "not met")}
NO_VALUE = "not in the log"
SHORT = "FSF 7.1: ALAR Briefing Note 7.1. GM2: EASA GM2 ORO.AOC.130."


def criteria_parts(one: Approach, floor_m: float | str | bool | None) -> list[Part | None]:
    """Return the tables of the check heights, of the runway, and the user's score."""
    return [*(_check(one, at, floor_m) for at in one.stabilised), _rest(one), _score(one)]


def _check(one: Approach, at: StabilisedAt, floor_m: float | str | bool | None) -> Grid | Note:
    height = with_feet(at.height_m)
    if not at.gates:
        return Note(f"Approach {one.number} from {height} down: not measured, {typeset(at.reason)}.")
    places, sides = ({place.name: getattr(place, name) for place in at.places} for name in ("at", "side"))
    rows: list[tuple[Cell, ...]] = []
    for gate in at.gates:
        if gate.state == "not_measured" and gate.reason == NO_VALUE:
            continue
        source = KINDS[gate.name].source if gate.name in KINDS else ""
        rows.append(
            (
                GATE_STATES.get(gate.state) or state_of(gate),
                capitalised(gate.title),
                _value_of(gate, sides.get(gate.name, "")),
                _limit_of(gate),
                _where(places.get(gate.name)),
                _told(source, gate.reason),
            )
        )
    rows += _not_logged(gate.title for gate in at.gates if gate.state == "not_measured" and gate.reason == NO_VALUE)
    caption = f"The worst value that lasted, from {height} down to {with_feet(floor_m)}. {_kept(at)} {SHORT}"
    title = f"Approach {one.number}, from {height} down: {at.verdict}, {counts_words(at.gates)}"
    return Grid(title, HEADS, rows, caption)


def _value_of(gate: Gate, side: str) -> str:
    told = number_with_unit(significant(gate.value, 3), unit_sign(gate.unit))
    return f"{told}{_in_feet(gate.unit, gate.value)} {side}".rstrip()


def _limit_of(gate: Gate) -> str:
    ends = gate.limit if isinstance(gate.limit, tuple) else (gate.limit,)
    return f"{limit_text(gate)}{_in_feet(gate.unit, *ends)}"


def _in_feet(unit: str, *ends_m: float | None, wide_m: float | None = None) -> str:
    """Return lengths once more in feet, in brackets; empty of other units and of none.

    Examples
    --------
    >>> _in_feet("m", 0.0, 914.4), _in_feet("m", 332.0, wide_m=431.0), _in_feet("deg", 3.0)
    (' (0 … 3000\u202fft)', ' (1089 ± 1414\u202fft)', '')
    """
    told = " … ".join(number(end / M_PER_FOOT, 0) for end in ends_m if end is not None)
    if unit != "m" or not told:
        return ""
    about = "" if wide_m is None else f" ± {number(wide_m / M_PER_FOOT, 0)}"
    return f" ({number_with_unit(f'{told}{about}', 'ft')})"


def _kept(at: StabilisedAt) -> str:
    """Return where a limit was first left, and from where all were kept."""
    if at.lost is None:
        return "Every limit was kept." if at.stable_m is not None else ""
    lost = at.lost
    when = "at the check height already" if lost.is_from_the_start else f"at {with_feet(lost.height_m)}"
    again = f"all kept again below {with_feet(at.stable_m)}" if at.stable_m is not None else "not regained"
    return f"Stability lost {when} ({f'{lost.criterion} {lost.side}'.rstrip()}); {again}."


def _rest(one: Approach) -> Grid | None:
    if not one.criteria:
        return None
    rows: list[tuple[Cell, ...]] = [
        (
            Mark(TONES[criterion.state], criterion.state),
            capitalised(criterion.kind.title),
            value_text(criterion),
            limits_text(criterion),
            _place_of(criterion),
            _told(criterion.kind.source, criterion.reason),
        )
        for criterion in one.criteria
        if criterion.value is not None
    ]
    reasons = dict.fromkeys(criterion.reason for criterion in one.criteria if criterion.value is None)
    for reason in reasons:
        lacking = [row.kind.title for row in one.criteria if row.value is None and row.reason == reason]
        rows += _not_logged(lacking, reason)
    caption = (
        "±: 95 %, where the value has an uncertainty; undecided: it reaches over the limit. No limit: that of "
        "the type or the operator, set in [landing.criteria]. Wind: mean from the lower check height, a headwind is "
        f"a negative tailwind. Corrected: less the error of the positions at the threshold. {EDITIONS}"
    )
    return Grid(f"Approach {one.number}: wind, thrust, threshold and landing", HEADS, rows, caption)


def _not_logged(titles: Iterable[str], reason: str = NO_VALUE) -> list[tuple[Cell, ...]]:
    """Return one row for all that lack for one reason."""
    listed = ", ".join(titles)
    if not listed:
        return []
    state, told = ("not logged", "") if reason == NO_VALUE else ("not measured", reason)
    return [(Mark("unknown", state), sentence(listed).rstrip("."), ABSENT, ABSENT, "", typeset(told))]


def value_text(one: Criterion) -> str:
    """Return a value with its 95 % interval, to the digits that this lets it have.

    Examples
    --------
    >>> value_text(Criterion(name="tailwind", state="met", unit="m/s", value=0.757, sigma=2.5))
    '0.8 ± 4.9\u202fm/s'
    """
    unit = unit_sign(one.unit)
    if one.value is None or not one.sigma:
        return number_with_unit(significant(one.value, 3), unit) + _in_feet(one.unit, one.value)
    wide = NORMAL_95 * one.sigma
    places = max(0, 1 - math.floor(math.log10(wide)))
    told = number_with_unit(f"{number(one.value, places)} ± {number(wide, places)}", unit)
    return told + _in_feet(one.unit, one.value, wide_m=wide)


def limits_text(one: Criterion) -> str:
    """Return the limits of a criterion with their sense.

    Examples
    --------
    >>> limits_text(Criterion(name="tailwind", state="met", unit="m/s", value=1.0, at_most=5.0))
    '≤ 5\u202fm/s'
    """
    return _limits_in_metres(one) + _in_feet(one.unit, one.at_least, one.at_most)


def _limits_in_metres(one: Criterion) -> str:
    unit = unit_sign(one.unit)
    if one.at_least is not None and one.at_most is not None:
        return number_with_unit(f"{significant(one.at_least, 4)} … {significant(one.at_most, 4)}", unit)
    if one.at_most is not None:
        return "≤ " + number_with_unit(significant(one.at_most, 4), unit)
    return ABSENT if one.at_least is None else "≥ " + number_with_unit(significant(one.at_least, 4), unit)


def _place_of(one: Criterion) -> str:
    """Return where the value was found; over the threshold the height alone."""
    if one.at is None or one.kind.group == "landing":
        return ""
    return _where(one.at if one.kind.group == "approach" else replace(one.at, before_threshold_m=None))


def _where(at: Place | None) -> str:
    if at is None:
        return ""
    height = with_feet(at.height_m) if at.height_m is not None else ""
    before = at.before_threshold_m
    along = (
        ""
        if before is None
        else f"{number(before / 1000.0, 1, 'km')} ({number(before / M_PER_NAUTICAL_MILE, 1, 'nmi')})"
    )
    return "; ".join(filter(None, (height, along)))


def _told(source: str, reason: str) -> str:
    return "; ".join(filter(None, (typeset(source), typeset(reason))))


def _score(one: Approach) -> Facts | None:
    if one.score is None:
        return None
    score = one.score
    told = f"of weights {number(score.judged, 1)} that were judged, {number(score.given, 1)} given"
    return Facts(f"Approach {one.number}: score by your own weights", (("Met", percent(score.share), told),))
