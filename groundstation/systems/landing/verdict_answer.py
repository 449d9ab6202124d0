"""Verdict on the stability of an approach in words, for terminal, findings and page.

Units and signs are those of a terminal; a page typesets them.
"""

import re
from collections import Counter
from collections.abc import Sequence

from groundstation.base.units import M_PER_FOOT
from groundstation.base.words import counted, listed
from groundstation.results.gates import Gate
from groundstation.systems.landing.answer import Approach, GatePlace, LandingResult, StabilisedAt, StabilisedVerdict

NOTHING_JUDGED = "no criterion is in the log"
MOST_OF_A_LINE = 3  # kinds of further approaches that the line of a flight tells
PLURALS = {"touch-and-go": "touch-and-goes"}
DEVIATION = " deviation"  # of the title of a criterion, left out where dots follow
_BRACKETS = re.compile(r" \([^()]*\)")  # within which there is no room for brackets


def line_of_approaches(answer: LandingResult) -> str:
    """Return the approaches of a flight in a line, the last landing first.

    Its touchdown stands behind the others.
    """
    if answer.last is None:
        return ""
    others = Counter(
        (one.outcome, _where(one), _verdict_behind(one)) for one in answer.approaches if one is not answer.last
    )
    also = [
        f"{outcome if count == 1 else counted(count, outcome, PLURALS.get(outcome, ''))}{where}{verdict}"
        for (outcome, where, verdict), count in others.items()
    ]
    more = sum(list(others.values())[MOST_OF_A_LINE:])
    also = [*also[:MOST_OF_A_LINE], *([counted(more, "further approach", "further approaches")] if more else [])]
    down = answer.last.touchdown
    return "; ".join((_told(answer.last), *also, *([] if down is None else [f"touchdown {down.moment}"])))


def _told(one: Approach) -> str:
    """An approach in a line: its stability, else how close to the course it was."""
    measured = [row for row in one.stabilised if row.time_s is not None]
    name = f"{one.outcome}{_where(one)}"
    if told := line_words(measured):
        return f"{name} {told}"
    if one.established is not None:
        return f"{name}, {one.established.lateral_rms_dots:.2f} dot RMS off the course"
    return f"{name}{''.join(f': {word}' for word in verdict_words(measured)[:1])}"


def _where(one: Approach) -> str:
    """Return where an approach led, behind a space: the word runway where no airport is named."""
    name = one.runway.name
    if not name:
        return f" on course {one.runway.true_course_deg:.1f} deg"
    return f" runway {name}" if name[0].isdigit() else f" {name}"


def _verdict_behind(one: Approach) -> str:
    """Return the verdict on an approach behind a space; empty where nothing was measured."""
    worst = worst_verdict(one.stabilised)
    return "" if worst == "not measured" else f" {worst}"


def verdict_words(checks: Sequence[StabilisedAt]) -> tuple[str, ...]:
    """Return the verdicts from the check heights down, those not measured last.

    Those that agree are told together. Each names what failed and by how much, and counts the criteria that failed,
    held, and were not judged.

    Examples
    --------
    >>> from groundstation.results.gates import judged_gate
    >>> from groundstation.systems.landing.answer import StabilityLost
    >>> from groundstation.systems.landing.criteria_answer import Place
    >>> path = judged_gate((None, 1.0), "vertical", "glide path deviation", 1.43, unit="dots")
    >>> bank = judged_gate((None, 7.0), "bank", "bank", None, unit="deg")
    >>> high = (GatePlace("vertical", Place(1.0), "high"),)
    >>> lost = StabilityLost(84.0, 9.0, "glide path deviation", False, "high")
    >>> from functools import partial
    >>> check = partial(StabilisedAt, verdict="not stabilised", time_s=0.0, gates=(path, bank), places=high, lost=lost)
    >>> verdict_words([check(304.8), check(152.4)])
    ('within limits at 305 m (1000 ft) and 152 m (500 ft), left at 84 m (276 ft), glide path up to 1.4 dots high: \
1 failed, 1 not judged',)
    """
    told: dict[tuple[str, str], list[str]] = {}
    for at in sorted(checks, key=lambda at: at.verdict == "not measured"):
        told.setdefault(_words(at), []).append(in_feet_too(at.height_m))
    return tuple(f"{before} {listed(heights)}{after}" for (before, after), heights in told.items())


def worst_verdict(checks: Sequence[StabilisedAt]) -> StabilisedVerdict:
    """Return the worse of the verdicts from the check heights."""
    verdicts = {at.verdict for at in checks}
    order: tuple[StabilisedVerdict, ...] = ("not stabilised", "stabilised")
    return next((word for word in order if word in verdicts), "not measured")


def line_words(checks: Sequence[StabilisedAt]) -> str:
    """Return the worst verdict with its counts, short enough for the line of a flight.

    What failed stands in brackets, from the height at which a limit was first left: a line without room drops it. Empty
    where nothing was measured.

    Examples
    --------
    >>> from groundstation.results.gates import judged_gate
    >>> from groundstation.systems.landing.answer import StabilityLost
    >>> path = judged_gate((None, 1.0), "vertical", "glide path deviation", 1.43, unit="dots")
    >>> bank = judged_gate((None, 7.0), "bank", "bank", 3.0, unit="deg")
    >>> lost = StabilityLost(304.8, 9.0, "glide path deviation", True, "high")
    >>> high = StabilisedAt(304.8, "not stabilised", 0.0, (path, bank), lost=lost)
    >>> low = StabilisedAt(152.4, "stabilised", 0.0, (path.under((None, 2.0)), bank))
    >>> line_words([low])
    'stabilised from 152 m (500 ft): all 2 held'
    >>> line_words([high, low])
    'not stabilised: 1 failed (from 305 m: glide path up to 1.4 dots), 1 held; stabilised from 152 m (500 ft)'
    """
    worst = worst_verdict(checks)
    at = max((one for one in checks if one.verdict == worst), key=lambda one: one.height_m, default=None)
    if at is None or worst == "not measured":
        return ""
    if worst == "stabilised":
        return f"stabilised from {in_feet_too(at.height_m)}: {counts_words(at.gates)}"
    failed = _failed_first_lost(at)
    what = ", ".join(_BRACKETS.sub("", failed_words(gate, at.places)) for gate in failed)
    since = "" if at.lost is None else f"from {at.lost.height_m:.0f} m: "
    count, *others = counts_words(at.gates).split(", ")
    held = [one for one in checks if one.verdict == "stabilised"]
    then = f"; stabilised from {in_feet_too(max(one.height_m for one in held))}" if held else ""
    return f"not stabilised: {', '.join((f'{count} ({since}{what})', *others))}{then}"


def in_feet_too(height_m: float) -> str:
    """Return a height or a length in metres, and in feet as crews speak of it.

    Examples
    --------
    >>> in_feet_too(152.4)
    '152 m (500 ft)'
    """
    return f"{height_m:.0f} m ({height_m / M_PER_FOOT:.0f} ft)"


def failed_words(gate: Gate, places: Sequence[GatePlace]) -> str:
    """Return a criterion that failed with its worst value and its side.

    Examples
    --------
    >>> from groundstation.results.gates import judged_gate
    >>> from groundstation.systems.landing.criteria_answer import Place
    >>> gate = judged_gate((None, 1.0), "lateral", "course deviation", 1.52, unit="dots")
    >>> failed_words(gate, [GatePlace("lateral", Place(1.0), "left")])
    'course up to 1.5 dots left'
    >>> failed_words(judged_gate((304.8, None), "gear", "gear down at", 250.0, unit="m"), ())
    'gear down at 250 m (820 ft)'
    """
    title = gate.title.removesuffix(DEVIATION) if gate.unit == "dots" else gate.title
    if gate.value is None or not gate.unit:
        return gate.title
    if gate.unit == "m":
        return f"{title} {in_feet_too(gate.value)}"
    most = "up to " if gate.sense == "at_most" else ""
    side = next((place.side for place in places if place.name == gate.name), "")
    return f"{title} {most}{gate.value:.1f} {gate.unit} {side}".rstrip()


def counts_words(gates: Sequence[Gate]) -> str:
    """Return how many criteria failed, held, and were not judged; empty without any.

    Examples
    --------
    >>> from groundstation.results.gates import judged_gate
    >>> held = judged_gate((None, 7.0), "bank", "bank", 3.0, unit="deg")
    >>> counts_words([held, held.under((None, 1.0))]), counts_words([held, held])
    ('1 failed, 1 held', 'all 2 held')
    """
    counts = {
        word: sum(gate.state == state for gate in gates)
        for word, state in (("failed", "failed"), ("held", "passed"), ("not judged", "not_measured"))
    }
    told = [f"{count} {word}" for word, count in counts.items() if count]
    return f"all {told[0]}" if len(told) == 1 and counts["held"] else ", ".join(told)


def _words(at: StabilisedAt) -> tuple[str, str]:
    """Return what stands before and behind the height of a check."""
    if at.verdict == "not measured":
        return "not measured from", f", {at.reason or NOTHING_JUDGED}"
    counts = f": {counts_words(at.gates)}"
    failed = _failed_first_lost(at)
    if not failed:
        return "stabilised from", counts
    what = "".join(f", {failed_words(gate, at.places)}" for gate in failed)
    if at.lost is None or at.lost.is_from_the_start:
        return "not stabilised from" if at.lost is None else "outside limits at", f"{what}{counts}"
    return "within limits at", f", left at {in_feet_too(at.lost.height_m)}{what}{counts}"


def _failed_first_lost(at: StabilisedAt) -> list[Gate]:
    """Return the criteria that failed, the one first whose limit was left first."""
    failed = (gate for gate in at.gates if gate.state == "failed")
    return sorted(failed, key=lambda gate: at.lost is None or gate.title != at.lost.criterion)
