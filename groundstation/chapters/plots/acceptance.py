"""Plots of an acceptance: radial errors of all flights over the hours, and their rates.

The hours are those of navigation.
"""

from collections.abc import Callable

import numpy as np

from groundstation.chapters.acceptance_front import stated
from groundstation.chapters.plots.common import label
from groundstation.plots.marks import AnyMark, Curve, Dash, Dots, Floats, Limit, Role
from groundstation.plots.plot import Axis, Panel, Plot, one_panel
from groundstation.plots.ranges import thin
from groundstation.results import acceptance as answers
from groundstation.results.acceptance import ENSEMBLE, Acceptance

MOST_CURVES = 150
RATE, FIXED = "radial_rate_fit_nmiph", ("radial_largest_nmi", "radial_final_nmi")


def _single(found: Acceptance, *quantities: str) -> list[answers.AcceptanceLimit]:
    """Return the limits that bound one of these quantities alone."""
    return [
        limit for limit in found.standard.limits if len(limit.bounds) == 1 and limit.bounds[0].quantity in quantities
    ]


def growth(found: Acceptance) -> Plot:
    """Return the radial error of every flight with CEP50, R95, their bound and the limits."""
    data, curves = found.growth, found.curves
    shown = thin(len(found.included), MOST_CURVES)
    marks: list[AnyMark] = []
    for place in shown:
        own = curves.flight == place
        marks.append(Curve(x=curves.hours[own], y=curves.radial_nmi[own], role="unused", emphasis="faint"))
    bounds: tuple[tuple[Floats, Role, str, Dash], ...] = (
        (data.cep50_nmi, "ins", "CEP50", ""),
        (data.r95_nmi, "gnss", "R95", ""),
        (data.two_drms_nmi, "answer", "2drms", "dashed"),
        (data.bound95_nmi, "ink", "95 % stay below", ""),
    )
    for values, role, name, dash in bounds:
        if np.isfinite(values).any():
            marks.append(Curve(x=data.hours, y=values, role=role, name=name, dash=dash))
    end = float(max(curves.hours.max(), 1e-3))
    for limit in _single(found, RATE, *FIXED):
        bound = limit.bounds[0]
        hours = np.array([limit.hours_over, min(end, limit.hours_up_to or end)])
        if hours[1] > hours[0]:
            heights = bound.at_most * (hours if bound.quantity == RATE else np.ones(2))
            name = label(f"limit: {limit.title}")
            marks.append(Curve(x=hours, y=heights, role="limit", name=name, dash="dashed"))
    some = "" if len(shown) == len(found.included) else f" ({len(shown)} of them)"
    x, y = Axis("navigation, h", low=0.0, high=end), Axis("radial error, nmi", low=0.0)
    return Plot(
        "acceptance.growth",
        "Radial error against time",
        f"Grey: each flight{some}. CEP50, R95: what half and 95 % of the flights stay within; 95 % stay below: "
        "the order statistic that bounds 95 % of flights at the confidence of the standard, if there are enough. The "
        "limit is on the rate of a flight: a flight whose fit lies above the line is over.",
        "Radial error of every flight against hours of navigation with CEP50, R95, their bound and the limit.",
        one_panel(Panel(marks, x, y), 74.0),
    )


def rates(found: Acceptance) -> Plot:
    """Return the distribution of the rates of the flights, with the limits on it."""
    flights = sorted(found.included, key=lambda flight: flight.values[RATE])
    rate = np.array([flight.values[RATE] for flight in flights], dtype=np.float64)
    share = np.arange(1, len(rate) + 1) / len(rate)
    limits = _single(found, RATE)
    over = np.array(
        [
            any(one.is_for(flight.hours) and (one.part(flight.values) or 0.0) > 1.0 for one in limits)
            for flight in flights
        ],
        dtype=bool,
    )
    stairs = np.repeat(rate, 2)[1:], np.repeat(share, 2)[:-1]
    marks: list[AnyMark] = [Curve(x=stairs[0], y=stairs[1], role="ins", emphasis="faint")]
    for limit in limits:
        marks.append(Limit(value=limit.bounds[0].at_most, is_upright=True, name=label(f"limit: {limit.title}")))
        marks.append(Limit(value=limit.share, role="faint"))
    for one in found.judgements:
        judged = found.limit(one.limit)
        if one.ins == ENSEMBLE and one.share_bound is not None and judged in limits:
            at, name = one.share_bound * judged.bounds[0].at_most, f"{stated(judged.share)} stay below"
            marks.append(Limit(value=at, is_upright=True, role="ink", name=name))
    marks.append(Dots(x=rate[~over], y=share[~over], role="answer", name="within", emphasis="bold"))
    marks.append(Dots(x=rate[over], y=share[over], role="gnss", name="over", emphasis="bold"))
    x = Axis("radial error rate by time-position fit, nmi/h", low=0.0)
    return Plot(
        "acceptance.rates",
        "Distribution of the rate",
        "Share of the flights whose rate is at most that on the axis; a dot for each flight.",
        "Distribution of the radial error rate of the flights with the limit.",
        one_panel(Panel(marks, x, Axis("share of flights", low=0.0, high=1.03)), 52.0),
    )


JUDGED: dict[str, Callable[[Acceptance], Plot]] = {"acceptance.growth": growth, "acceptance.rates": rates}
