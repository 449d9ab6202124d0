"""Latencies in the pipeline: estimated once for a flight, told as findings where they are large."""

from dataclasses import dataclass

from groundstation.base.errors import NotAssessableError
from groundstation.base.findings import Finding
from groundstation.estimators.latency.settings import LatencySettings
from groundstation.results.flight import NotAssessable
from groundstation.results.inertial import InertialResult
from groundstation.results.latency import Latencies
from groundstation.tables.table import Flight

TOLD_S = 0.02  # a latency that is surely larger is worth a line


@dataclass(frozen=True)
class LatencyAnswers:
    """What is known of the latencies of a flight; the reason where nothing is."""

    latency: Latencies | None = None
    findings: tuple[Finding, ...] = ()
    not_assessable: tuple[NotAssessable, ...] = ()


def analyse_latency(flight: Flight, settings: LatencySettings, inertial: InertialResult | None) -> LatencyAnswers:
    """Estimate latencies; never raises for what the flight lacks. ``inertial``: what system 2 knows of the INS."""
    from groundstation.estimators.latency.estimate import estimate_latencies

    kinds = {inertial.ins_topic: inertial.kind} if inertial else {}
    try:
        found = estimate_latencies(flight, settings=settings, kinds=kinds)
    except NotAssessableError as error:
        return LatencyAnswers(not_assessable=(NotAssessable("latency", str(error).removeprefix("latency: ")),))
    return LatencyAnswers(found, _findings(found))


def _findings(found: Latencies) -> tuple[Finding, ...]:
    lines = []
    for row in found.rows:
        if row.latency_s is None or row.confidence95_s is None:
            continue
        low, high = row.confidence95_s
        if low > TOLD_S or high < -TOLD_S:
            sense = "later" if row.latency_s > 0.0 else "earlier"
            text = (
                f"{row.quantity} of {row.other} {sense} than that of {row.reference} by {abs(row.latency_s):.3f} s "
                f"(95 %: {low:+.3f} to {high:+.3f} s)"
            )
            lines.append(Finding("info", "latency.observed", text, row.other))
    return tuple(lines)
