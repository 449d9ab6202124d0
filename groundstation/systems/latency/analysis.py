"""Latencies as an analysis: estimated once for a flight, a finding where they are large."""

from typing import TYPE_CHECKING

from groundstation.base.findings import Finding
from groundstation.methods.lag.settings import LatencySettings
from groundstation.results.roles import KindOfIns
from groundstation.systems.analysis import Analysis, Found, Shortfall
from groundstation.systems.known import Known
from groundstation.systems.latency.answer import Latencies

if TYPE_CHECKING:
    from groundstation.tables.table import Flight

TOLD_S = 0.02  # a latency that is surely larger is worth a line


def _run(flight: "Flight", known: Known, settings: LatencySettings) -> Found[Latencies]:
    from groundstation.systems.latency.estimate import estimate_latencies

    known_ins = known.answer_meeting(KindOfIns)
    found = estimate_latencies(flight, settings=settings, kinds=known_ins.kinds if known_ins else {})
    return Found(found, _findings(found))


def _examine(flight: "Flight", known: Known, settings: LatencySettings) -> tuple[Shortfall, ...]:
    """Return the sensors whose latency the motion does not show; the estimate itself is short."""
    rows = _run(flight, known, settings).answer.rows
    return tuple(
        Shortfall(f"{row.quantity} of {row.other}: {row.reason}") for row in rows if row.state == "not_observable"
    )


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


def _is_expected(_flight: "Flight", _known: Known) -> bool:
    """Tell whether a finding says why there is no latency: never, nobody looks for it first."""
    return False


LATENCY = Analysis(
    name="latency",
    title="latency of GNSS, barometer, magnetometer and further INS behind the INS, from ordinary motion",
    subject="latency",
    page_title="Latency between sensors",
    needs="ins velocity with gnss velocities, vertical speed with baro, or attitude with a magnetometer; turns and "
    "climbs",
    settings=LatencySettings,
    answer=Latencies,
    run=_run,
    builds_on=("inertial",),
    is_expected=_is_expected,
    examine=_examine,
)
