"""Verdict on the stability of an approach in words, for terminal, findings and page.

Units and signs are those of a terminal; a page typesets them.
"""

from collections.abc import Sequence

from groundstation.base.units import M_PER_FOOT
from groundstation.base.words import listed
from groundstation.results.gates import Gate
from groundstation.systems.landing.answer import GatePlace, StabilisedAt

NOTHING_JUDGED = "no criterion is in the log"
DEVIATION = " deviation"  # of the title of a criterion, left out where dots follow


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
    failed = sorted(
        (gate for gate in at.gates if gate.state == "failed"),
        key=lambda gate: at.lost is None or gate.title != at.lost.criterion,
    )
    if not failed:
        return "stabilised from", counts
    what = "".join(f", {failed_words(gate, at.places)}" for gate in failed)
    if at.lost is None or at.lost.is_from_the_start:
        return "not stabilised from" if at.lost is None else "outside limits at", f"{what}{counts}"
    return "within limits at", f", left at {in_feet_too(at.lost.height_m)}{what}{counts}"
