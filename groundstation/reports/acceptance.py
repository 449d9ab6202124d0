"""The acceptance report: a page and a PDF ready to sign, from an acceptance alone."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from groundstation.base.failures import attempt, gathered_failures
from groundstation.chapters import acceptance as chapters
from groundstation.chapters.acceptance_front import front, stated
from groundstation.chapters.parts import Document
from groundstation.plots.ranges import thin
from groundstation.reports import drawing as d
from groundstation.reports import layout
from groundstation.reports.drawing import Drawing
from groundstation.reports.figures import drawn_by
from groundstation.reports.flight_report import ACCEPTANCE, Written, flight_report_html, write_pages
from groundstation.results.acceptance import ENSEMBLE, Acceptance, Limit

MOST_CURVES = 150
RATE, FIXED = "radial_rate_fit_nmiph", ("radial_largest_nmi", "radial_final_nmi")


def write_acceptance_report(page: Path, found: Acceptance) -> Written:
    """Write the page and, beside it, the PDF; equal acceptances give equal bytes.

    Raises
    ------
    OSError
        When a file cannot be written.
    """
    beside = page.with_suffix(".json").name
    with gathered_failures():
        document = acceptance_document(found)
        return write_pages(page, lambda shown: flight_report_html(shown, beside), document, document, with_pdf=True)


def acceptance_document(found: Acceptance) -> Document:
    """Put the report of an acceptance together, its figures drawn."""
    drawn = (attempt("chapter", one.key, drawn_by, DRAWN, one, found) for one in chapters.sections(found))
    sections = tuple(section for section in drawn if section is not None)
    return Document(ACCEPTANCE, f"{ACCEPTANCE} {found.name}", front(found), sections)


def _single(found: Acceptance, *quantities: str) -> list[Limit]:
    """Limits on one of these figures alone."""
    return [
        limit for limit in found.standard.limits if len(limit.bounds) == 1 and limit.bounds[0].quantity in quantities
    ]


def _growth(found: Acceptance) -> Drawing:
    growth, curves = found.growth, found.curves
    hours, flight = growth.hours, curves.flight
    shown = thin(len(found.included), MOST_CURVES)

    def paint(figure: Any) -> None:
        axes = layout.place(figure, 16, 12, 174, 86)
        for place in shown:
            own = flight == place
            d.line(axes, curves.hours[own], curves.radial_nmi[own], d.UNUSED, 0.5, zorder=1)
        for values, colour, title, style in (
            (growth.cep50_nmi, d.INS, "CEP50", "-"),
            (growth.r95_nmi, d.GNSS, "R95", "-"),
            (growth.two_drms_nmi, d.USED, "2drms", "--"),
            (growth.bound95_nmi, d.INK, "95 % stay below", "-"),
        ):
            if np.isfinite(values).any():
                d.line(axes, hours, values, colour, 1.4, label=title, linestyle=style, zorder=3)
        end = float(max(curves.hours.max(), 1e-3))
        for limit in _single(found, RATE, *FIXED):
            bound, last = limit.bounds[0], min(end, limit.hours_up_to or end)
            times = np.array([limit.hours_over, last])
            if times[1] > times[0]:
                heights = bound.at_most * (times if bound.quantity == RATE else np.ones(2))
                title = d.label(f"limit: {limit.title}")
                d.line(axes, times, heights, d.LIMIT, 1.0, label=title, linestyle=(0, (4, 2)), zorder=4)
        axes.set_xlim(0.0, end)
        axes.set_ylim(bottom=0.0)
        axes.set_xlabel("navigation, h")
        axes.set_ylabel("radial error, nmi")
        layout.legend_above(axes)

    some = "" if len(shown) == len(found.included) else f" ({len(shown)} of them)"
    caption = (
        f"Grey: each flight{some}. CEP50, R95: what half and 95 % of the flights stay within; 95 % stay below: "
        "the order statistic that bounds 95 % of flights at the confidence of the standard, if there are enough. The "
        "limit is on the rate of a flight: a flight whose fit lies above the line is over."
    )
    alt = "Radial error of every flight against hours of navigation with CEP50, R95, their bound and the limit."
    return Drawing("Radial error against time", caption, alt, d.draw("acceptance-growth", 94, paint))


def _rates(found: Acceptance) -> Drawing:
    flights = sorted(found.included, key=lambda flight: flight.values[RATE])
    rate = np.array([flight.values[RATE] for flight in flights])
    share = np.arange(1, len(rate) + 1) / len(rate)
    limits = _single(found, RATE)
    over = np.array(
        [
            any(one.is_for(flight.hours) and (one.part(flight.values) or 0.0) > 1.0 for one in limits)
            for flight in flights
        ]
    )

    def paint(figure: Any) -> None:
        axes = layout.place(figure, 16, 12, 174, 64)
        d.line(axes, rate, share, d.INS, 0.6, drawstyle="steps-post")
        d.dots(axes, rate[~over], share[~over], d.USED, 3.4, label="within")
        d.dots(axes, rate[over], share[over], d.GNSS, 3.4, label="over")
        for limit in limits:
            layout.limit_line(axes, limit.bounds[0].at_most, d.label(f"limit: {limit.title}"), vertical=True)
            layout.limit_line(axes, limit.share, "", colour=d.FAINT)
        for one in found.judgements:
            limit = found.limit(one.limit)
            if one.ins == ENSEMBLE and one.share_bound is not None and limit in limits:
                bound, told = one.share_bound * limit.bounds[0].at_most, f"{stated(limit.share)} stay below"
                layout.limit_line(axes, bound, told, vertical=True, colour=d.INK)
        axes.set_xlim(left=0.0)
        axes.set_ylim(0.0, 1.03)
        axes.set_xlabel("radial error rate by time-position fit, nmi/h")
        axes.set_ylabel("share of flights")
        layout.legend_above(axes)

    caption = "Share of the flights whose rate is at most that on the axis; a dot for each flight."
    alt = "Distribution of the radial error rate of the flights with the limit."
    return Drawing("Distribution of the rate", caption, alt, d.draw("acceptance-rates", 72, paint))


DRAWN: dict[str, Callable[[Acceptance], Drawing]] = {"acceptance.growth": _growth, "acceptance.rates": _rates}
