"""Top of the page of an acceptance: its decision in words."""

import math
from collections.abc import Sequence

from groundstation.base.timescales import utc_ns_to_iso
from groundstation.base.words import capitalised
from groundstation.chapters.parts import Cell, Front, Mark
from groundstation.chapters.wording import ABSENT, clean, number, number_with_unit, percent, plural, significant
from groundstation.results.acceptance import (
    ENSEMBLE,
    QUANTITIES,
    Acceptance,
    AcceptanceLimit,
    Bound,
    Decision,
    FlightError,
    InsRow,
    Judgement,
)

MARKS: dict[Decision, Mark] = {
    "pass": Mark("good", "Pass"),
    "fail": Mark("bad", "Fail"),
    "not enough flights": Mark("warn", "Not enough flights"),
    "not flown": Mark("unknown", "Not flown"),
    "no limit": Mark("unknown", "No limit"),
}


def front(found: Acceptance) -> Front:
    """Return the top of an acceptance report: the decision, its basis, key figures."""
    whole, included = _whole(found), found.included
    aircraft = sorted({flight.aircraft for flight in included if flight.aircraft})
    pairs: tuple[tuple[str, Cell], ...] = (
        ("Flights", f"{number(len(included), 0)} of {number(len(found.flights), 0)}"),
        ("INS", number(len({flight.ins for flight in included}), 0)),
        ("Aircraft", clean(", ".join(aircraft[:4]) + (" …" if len(aircraft) > 4 else "")) or ABSENT),
        ("Hours", number(whole.hours if whole else 0.0, 1)),
        ("Span, UTC", _span(included)),
        ("Standard", f"{found.name}, SHA-256 {found.standard_sha256[:16]}"),
        ("groundstation", found.version),
    )
    judged = [one for one in found.judgements if one.ins == ENSEMBLE]
    told = [_told(found, one) for one in judged]
    return Front(
        found.standard.title,
        pairs,
        verdict=MARKS[found.decision],
        headline=headline(found),
        sentences=told or ("The standard states no limit: errors are reported, nothing is judged.",),
        figures=_figures(found, whole),
    )


def headline(found: Acceptance) -> str:
    """Return the decision in a line."""
    if not found.included:
        return "No flight can be judged"
    judged = [one for one in found.judgements if one.ins == ENSEMBLE and one.decision != "not flown"]
    if not judged:
        return "Nothing is judged"
    worst = next(one for one in judged if one.decision == found.decision)
    limit, sure = found.limit(worst.limit), stated(found.standard.confidence)
    if worst.decision == "pass":
        return f"{stated(limit.share)} of flights within the limits: shown at {sure} confidence"
    if worst.decision == "fail":
        return f"{clean(limit.title)}: fewer than {stated(limit.share)} of flights within, at {sure} confidence"
    return f"{clean(limit.title)}: {_over(worst)}{_short(found, worst)}"


def _over(one: Judgement) -> str:
    return f"{number(one.over, 0)} of {plural(one.flights, 'flight')} over; " if one.over else ""


def _told(found: Acceptance, one: Judgement) -> str:
    limit = found.limit(one.limit)
    if one.decision == "not flown":
        return f"{clean(limit.title)}: none flown, not judged."
    asked = f"wanted {wanted(limit)} on {stated(limit.share)}"
    if not one.flights:
        told = f"{clean(limit.title)}: measured on none of {plural(one.not_measured, 'flight')}, {asked}."
        return f"{told} {_missing(found, one)}".strip()
    flown = (
        f"{number(one.over, 0)} of {plural(one.flights, 'flight')} of {number(one.ins_units, 0)} INS over"
        f"{_largest(found, limit)}"
    )
    worth = f" (worth {number(one.effective_flights, 1)} independent flights)" if is_worth_less(one) else ""
    told = (
        f"{clean(limit.title)}: {flown}, {asked}. At "
        f"{stated(found.standard.confidence)} confidence at least {at_least(one.share_low)} are within{worth}."
    )
    if one.not_measured:
        told += f" {number(one.not_measured, 0)} more not judged: the limited quantity was not measured."
    return f"{told} {_missing(found, one)}".strip()


def _largest(found: Acceptance, limit: AcceptanceLimit) -> str:
    """Return the largest figure of the flights, of a limit with one bound; empty of several."""
    values = [flight.values for flight in found.included if limit.is_for(flight.hours)]
    if len(limit.bounds) != 1:
        return ""
    (bound,) = limit.bounds
    sizes = [abs(one[bound.quantity]) for one in values if bound.quantity in one]
    return f", the largest {_of_bound(bound, max(sizes))}" if sizes else ""


def stated(share: float) -> str:
    """Return a share as the standard states it, not rounded: 99.99 % is not 100 %.

    Examples
    --------
    >>> stated(0.95), stated(0.995), stated(0.9999)
    ('95%', '99.5%', '99.99%')
    """
    places = next((some for some in range(4) if abs(round(100.0 * share, some) - 100.0 * share) < 1e-9), 4)
    return percent(share, places)


def at_least(share: float) -> str:
    """Return a lower limit, rounded down: one that just misses 95 % must not read 95.0 %.

    Examples
    --------
    >>> at_least(0.9499), at_least(0.95), at_least(0.95051)
    ('94.9%', '95.0%', '95.0%')
    """
    return percent(math.floor(1000.0 * share + 1e-9) / 1000.0, 1)


def is_worth_less(one: Judgement) -> bool:
    """Tell whether the flights count as fewer independent ones."""
    return one.effective_flights < one.flights - 0.05


def _short(found: Acceptance, one: Judgement) -> str:
    """Return how many flights the claim takes, and how many these are short of it."""
    share, sure = stated(found.limit(one.limit).share), stated(found.standard.confidence)
    needed = f"a claim on {share} of flights at {sure} confidence takes {plural(one.flights_needed, 'flight')}"
    if not one.flights:
        return f"{needed}, none is there"
    are = "this 1 is" if one.flights == 1 else f"these {number(one.flights, 0)} are"
    if is_worth_less(one):
        are = f"these {number(one.flights, 0)} count as {number(one.effective_flights, 1)} and are"
    return f"{needed}; {are} {number(one.more_with_none_over, 0)} short"


def _missing(found: Acceptance, one: Judgement) -> str:
    if one.decision != "not enough flights":
        return ""
    short = _short(found, one)
    told = capitalised(short)
    if not one.over:
        return f"{told}."
    at_share = (
        "no number suffices at the present share"
        if one.more_at_present_share is None
        else f"{number(one.more_at_present_share, 0)} at the present share"
    )
    return f"{told} if none more is over, {at_share}."


def wanted(limit: AcceptanceLimit) -> str:
    """Return the bounds of a limit in words.

    Examples
    --------
    >>> wanted(AcceptanceLimit("a", "", (Bound("radial_rate_fit_nmiph", 2.0),)))
    'radial error rate, time-position fit ≤ 2\u202fnmi/h'
    """
    return " and ".join(f"{QUANTITIES[one.quantity].title} ≤ {_of_bound(one, one.at_most)}" for one in limit.bounds)


def _of_bound(bound: Bound, value: float) -> str:
    return number_with_unit(significant(value, 3), QUANTITIES[bound.quantity].unit)


def bound_text(limit: AcceptanceLimit, one: Judgement) -> str:
    """Return the upper bound of the share, in the unit of the limit where it has one bound."""
    if one.share_bound is None:
        return ABSENT
    if len(limit.bounds) == 1:
        return _of_bound(limit.bounds[0], one.share_bound * limit.bounds[0].at_most)
    return f"{significant(one.share_bound, 3)} of the limit"


def _figures(found: Acceptance, whole: InsRow | None) -> tuple[tuple[str, str, str], ...]:
    if whole is None or not whole.flights:
        return ()
    heading = f"95 % over {plural(whole.heading_flights, 'flight')}"
    return (
        ("CEP50", number(whole.cep50_rate_nmiph, 2, "nmi/h"), "half of the flights, time-position fit"),
        ("R95", number(whole.r95_rate_nmiph, 2, "nmi/h"), "95 % of the flights, time-position fit"),
        ("Velocity error", number(whole.velocity_rms_mps, 2, "m/s"), "root mean square"),
        ("Heading error", number(whole.heading95_deg, 2, "°"), heading),
    )


def _whole(found: Acceptance) -> InsRow | None:
    return next((row for row in found.rows if row.ins == ENSEMBLE), None)


def _span(flights: Sequence[FlightError]) -> str:
    known = [flight.start_utc_ns for flight in flights if flight.start_utc_ns is not None]
    if not known:
        return ABSENT
    first, last = (utc_ns_to_iso(time)[:10] for time in (min(known), max(known)))
    return first if first == last else f"{first} … {last}"
