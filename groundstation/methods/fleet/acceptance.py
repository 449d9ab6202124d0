"""Acceptance of flights by the limits of a standard, for each INS and for all.

It tells what they show and how sure that is.
"""

from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from groundstation.methods.fleet.confidence import (
    correlation_within,
    effective_flights,
    flights_needed,
    flights_needed_at_share,
    order_bound,
    share_high,
    share_low,
)
from groundstation.methods.fleet.ins_errors import FEWEST, Growth, PositionErrors
from groundstation.results.acceptance import (
    ENSEMBLE,
    UNKNOWN_INS,
    AcceptanceLimit,
    Decision,
    FlightError,
    InsRow,
    Judgement,
    Standard,
)
from groundstation.results.arrays.acceptance import AcceptanceCurves, AcceptanceGrowth

FloatArray = NDArray[np.float64]
# The correlation is reckoned with at the limit that it exceeds with one in five: see docs/acceptance.md.
CORRELATION_CONFIDENCE = 0.8
CURVE_POINTS = 200
WORST_FIRST: tuple[Decision, ...] = ("fail", "not enough flights", "pass", "not flown", "no limit")


def accuracy_ratio(flight: FlightError, limit: AcceptanceLimit) -> float | None:
    """Limit over what the reference may err by, both 95 %, the smallest of its bounds."""
    ratios = []
    for bound in limit.bounds:
        reference = flight.reference95.get(bound.quantity)
        if reference:
            ratios.append(bound.at_most / reference)
    return min(ratios, default=None)


def judge(flights: Sequence[FlightError], limit: AcceptanceLimit, standard: Standard, ins: str = ENSEMBLE) -> Judgement:
    """Judge one limit by the flights that it is for: of all INS, or of one.

    Flights of one INS are taken as independent given the INS; a claim on all of a type counts them by their
    correlation. The exact binomial limit of the share from effective numbers decides (Korn and Graubard, 1998).
    """
    meant = [flight for flight in flights if limit.is_for(flight.hours)]
    judged = [(flight, part) for flight in meant if (part := limit.part(flight.values)) is not None]
    parts = np.array([part for _, part in judged], dtype=np.float64)
    units = [flight.ins for flight, _ in judged]
    count, over = len(judged), int(np.sum(parts > 1.0))
    correlation = _correlation(parts, units, standard, is_one=ins != ENSEMBLE)
    effective = effective_flights(units, correlation)
    worth = effective / count if count else 1.0
    low, high = (find(effective, over * worth, standard.confidence) for find in (share_low, share_high))
    ratios = [ratio for flight, _ in judged if (ratio := accuracy_ratio(flight, limit)) is not None]
    is_shown = count > 0 and low >= limit.share
    decision: Decision = (
        "not flown" if not meant else "pass" if is_shown else "fail" if high < limit.share else "not enough flights"
    )
    at_share = flights_needed_at_share(over / count, limit.share, standard.confidence) if count else None
    needed = flights_needed(over * worth, limit.share, standard.confidence)
    return Judgement(
        limit.name,
        ins,
        decision,
        flights=count,
        over=over,
        ins_units=len(set(units)),
        not_measured=len(meant) - count,
        effective_flights=effective,
        correlation=correlation,
        share_low=low,
        share_high=high,
        share_low_these=share_low(count, over, standard.confidence),
        share_bound=order_bound(parts, effective, limit.share, standard.confidence),
        flights_needed=needed,
        more_with_none_over=0 if is_shown else _whole(needed - effective),
        more_at_present_share=0 if is_shown else None if at_share is None else max(_whole(at_share - effective), 0),
        accuracy_ratio=min(ratios, default=None),
    )


def _whole(flights: float) -> int:
    return int(np.ceil(flights - 1e-9))


def _correlation(parts: FloatArray, units: Sequence[str], standard: Standard, *, is_one: bool) -> float:
    if is_one or standard.claim == "these" or not len(parts):
        return 0.0
    if standard.claim == "units":
        return 1.0
    return correlation_within(np.log(np.maximum(parts, 1e-12)), units, CORRELATION_CONFIDENCE)


def judgements(flights: Sequence[FlightError], standard: Standard) -> tuple[Judgement, ...]:
    """Judge every limit against all flights, then against those of each INS.

    The INS must be known, and the limit be for it.
    """
    found = [judge(flights, limit, standard) for limit in standard.limits]
    for ins in sorted({flight.ins for flight in flights} - {UNKNOWN_INS}):
        own = [flight for flight in flights if flight.ins == ins]
        each = (judge(own, limit, standard, ins) for limit in standard.limits)
        found += [one for one in each if one.decision != "not flown"]
    return tuple(found)


def decision_of(found: Sequence[Judgement]) -> Decision:
    """Return the worst decision of the limits for all flights.

    A limit that no flight is for does not count beside others.
    """
    decisions = {one.decision for one in found if one.ins == ENSEMBLE}
    return next((one for one in WORST_FIRST if one in decisions), "no limit")


def ins_rows(flights: Sequence[FlightError], growth: Growth) -> tuple[InsRow, ...]:
    """Return what all flights show, then those of each INS.

    ``growth`` has a row for each flight.
    """
    units = np.array([flight.ins for flight in flights])
    groups = {ENSEMBLE: np.arange(len(flights))}
    groups |= {name: np.flatnonzero(units == name) for name in sorted(set(units.tolist()))}
    return tuple(_row(name, [flights[one] for one in rows.tolist()], growth.of(rows)) for name, rows in groups.items())


def _row(name: str, flights: Sequence[FlightError], growth: Growth) -> InsRow:
    fit, along, cross, heading = (
        np.abs([flight.values[key] for flight in flights if key in flight.values])
        for key in ("radial_rate_fit_nmiph", "along_largest_nmi", "cross_largest_nmi", "heading_error_deg")
    )
    with_velocity = [flight for flight in flights if "velocity_error_rms_mps" in flight.values]
    squares = sum(flight.epochs * flight.values["velocity_error_rms_mps"] ** 2 for flight in with_velocity)
    epochs = sum(flight.epochs for flight in with_velocity)
    return InsRow(
        name,
        _joined(flight.aircraft for flight in flights),
        _joined(flight.alignment for flight in flights),
        flights=len(flights),
        hours=sum(flight.hours for flight in flights),
        fit_median_nmiph=_quantile(fit, 0.5),
        fit_largest_nmiph=_quantile(fit, 1.0),
        cep50_rate_nmiph=growth.rate(growth.within(0.5)),
        r95_rate_nmiph=growth.rate(growth.within(0.95)),
        two_drms_rate_nmiph=growth.rate(growth.two_drms()),
        along95_nmi=_quantile(along, 0.95),
        cross95_nmi=_quantile(cross, 0.95),
        velocity_rms_mps=float(np.sqrt(squares / epochs)) if epochs else None,
        heading_flights=len(heading),
        heading95_deg=_quantile(heading, 0.95),
        heading_largest_deg=_quantile(heading, 1.0),
    )


def _joined(names: Iterable[str]) -> str:
    return ", ".join(sorted({name for name in names if name}))


def _quantile(values: FloatArray, share: float) -> float | None:
    return float(np.quantile(values, share)) if len(values) else None


def growth_figure(growth: Growth, flights: Sequence[FlightError], standard: Standard) -> AcceptanceGrowth:
    """Return the errors of all flights by hours of navigation.

    With them comes the order statistic that bounds 95 % of them.
    """
    fits = np.log([max(flight.values["radial_rate_fit_nmiph"], 1e-12) for flight in flights])
    units = [flight.ins for flight in flights]
    correlation = _correlation(fits, units, standard, is_one=False)
    bound = np.full(len(growth.hours), np.nan)
    for place in np.flatnonzero(growth.flights >= FEWEST):
        known = np.flatnonzero(np.isfinite(growth.radial_nmi[:, place]))
        effective = effective_flights([units[one] for one in known], correlation)
        found = order_bound(growth.radial_nmi[known, place], effective, 0.95, standard.confidence)
        bound[place] = np.nan if found is None else found
    return AcceptanceGrowth(
        hours=growth.hours,
        flights=growth.flights.astype(np.int64),
        cep50_nmi=growth.within(0.5),
        r95_nmi=growth.within(0.95),
        two_drms_nmi=growth.two_drms(),
        bound95_nmi=bound,
    )


def curves_figure(errors: Sequence[PositionErrors]) -> AcceptanceCurves:
    """Radial error of each flight over its hours, thinned to what a page shows."""
    rows = [np.unique(np.linspace(0, len(one.hours) - 1, CURVE_POINTS).round().astype(int)) for one in errors]
    none = np.zeros(0)
    return AcceptanceCurves(
        flight=np.repeat(np.arange(len(errors)), [len(row) for row in rows]),
        hours=np.concatenate([none, *(one.hours[row] for one, row in zip(errors, rows, strict=True))]),
        radial_nmi=np.concatenate([none, *(one.radial_nmi[row] for one, row in zip(errors, rows, strict=True))]),
    )
