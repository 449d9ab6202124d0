"""Results that lean on damage: samples of an answer against damaged spans and gaps.

The spans and gaps are the ledger's.
"""

from collections.abc import Mapping, Sequence

import numpy as np

from groundstation.base.findings import Finding, Severity
from groundstation.base.gaps import Gaps
from groundstation.base.ledger import DamagedSpan, Ledger
from groundstation.base.timescales import duration_text
from groundstation.base.words import counted
from groundstation.systems.analysis import RestsOn
from groundstation.tables.table import Flight

SHOWN = 3
LEAST_TOLD_S = 0.05  # a shorter span is told as a moment
Spans = Sequence[tuple[float, float]]


def damage_finding(
    code: str, subject: str, use: RestsOn, ledger: Ledger, flight: Flight, gaps_of: Mapping[str, Gaps]
) -> Finding | None:
    """Make the finding on an answer whose samples overlap damage or gaps.

    Damage is a warning; gaps alone are for information. ``gaps_of`` has the gaps of every topic in use. Damage without
    a place in time is in the ledger, in no such finding.
    """
    damaged = [span for span in ledger.spans if _concerns(span, use)]
    gaps = _gaps(use, flight, gaps_of)
    if not damaged and not gaps:
        return None
    severity: Severity = "warn" if damaged else "info"
    told = [_told(entry) for entry in damaged[:SHOWN]]
    if len(damaged) > SHOWN:
        told.append(counted(len(damaged) - SHOWN, "more damaged span"))
    told += gaps
    place = "+" + duration_text(damaged[0].start_s) if damaged else ""
    text = f"{subject}: uses samples in or around {'; '.join(told)}"
    return Finding(severity, code, text, "", place, len(damaged) + len(gaps))


def _concerns(span: DamagedSpan, use: RestsOn) -> bool:
    """Tell whether a damaged span is of what the answer uses, and when it does."""
    if (span.topic and span.topic not in use.topics) or (span.field and span.field not in use.fields):
        return False
    return _overlaps(span.start_s, span.start_s + span.length_s, use.spans_s)


def _overlaps(start_s: float, end_s: float, spans_s: Spans) -> bool:
    """Tell whether a span overlaps others; touching the end of one alone does not count."""
    return any(start_s < high and end_s >= low for low, high in spans_s)


def _told(span: DamagedSpan) -> str:
    name = ".".join(part for part in (span.topic, span.field) if part)
    what = span.cause.replace("_", " ") + (f" of {name}" if name else "")
    where = "" if span.is_exact else "somewhere "
    start = duration_text(span.start_s)
    when = f"from +{start} for {span.length_s:.1f} s" if span.length_s >= LEAST_TOLD_S else f"at +{start}"
    return f"{what} ({where}{when})"


def _gaps(use: RestsOn, flight: Flight, gaps_of: Mapping[str, Gaps]) -> list[str]:
    """Gaps of the topics within the spans used, one line a topic."""
    told = []
    for topic in use.topics:
        gaps = gaps_of[topic]
        starts_s = flight.seconds(gaps.start_ns)
        inside = np.array(
            [_overlaps(a, a + b, use.spans_s) for a, b in zip(starts_s, gaps.length_s, strict=True)], dtype=bool
        )
        if inside.any():
            count, total_s = int(inside.sum()), float(gaps.length_s[inside].sum())
            told.append(f"{counted(count, 'gap')} of {topic}, {total_s:.1f} s together")
    return told
