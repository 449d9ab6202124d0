"""Results that lean on damage: the samples an answer rests on, held against the ledger's damaged spans and gaps."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from groundstation.base.findings import Finding, Severity
from groundstation.base.timescales import duration_text
from groundstation.estimators.analysis import RestsOn
from groundstation.integrity.ledger import gaps_of
from groundstation.integrity.limits import Thresholds
from groundstation.integrity.spans import is_span
from groundstation.tables.table import Flight

SHOWN = 3
Spans = Sequence[tuple[float, float]]


def damage_finding(
    code: str, subject: str, use: RestsOn, ledger: Mapping[str, Any], flight: Flight, thresholds: Thresholds
) -> Finding | None:
    """The finding on an answer whose samples overlap damage: a warning; gaps alone are for information.

    Damage without a place in time is in the ledger, and in no such finding.
    """
    damaged = [entry for entry in ledger.get("spans", ()) if is_span(entry) and _concerns(entry, use)]
    gaps = _gaps(use, flight, thresholds)
    if not damaged and not gaps:
        return None
    severity: Severity = "warn" if damaged else "info"
    told = [_told(entry) for entry in damaged[:SHOWN]]
    if len(damaged) > SHOWN:
        told.append(f"{len(damaged) - SHOWN} more damaged spans")
    told += gaps
    place = "+" + duration_text(float(damaged[0]["start_s"])) if damaged else ""
    text = f"{subject}: rests on samples in or around {'; '.join(told)}"
    return Finding(severity, code, text, "", place, len(damaged) + len(gaps))


def _concerns(entry: Mapping[str, Any], use: RestsOn) -> bool:
    """Whether a span is of what the answer uses, and when it does."""
    topic, field, start_s = entry["topic"], entry["field"], float(entry["start_s"])
    if (topic and topic not in use.topics) or (field and field not in use.fields):
        return False
    return _overlaps(start_s, start_s + float(entry["length_s"]), use.spans_s)


def _overlaps(start_s: float, end_s: float, spans_s: Spans) -> bool:
    """Whether a span overlaps others; what touches the end of one alone took nothing from it."""
    return any(start_s < high and end_s >= low for low, high in spans_s)


def _told(entry: Mapping[str, Any]) -> str:
    name = ".".join(part for part in (entry["topic"], entry["field"]) if part)
    what = str(entry["cause"]).replace("_", " ") + (f" of {name}" if name else "")
    where = "" if entry["is_exact"] else "somewhere "
    return f"{what} ({where}from +{duration_text(float(entry['start_s']))} for {float(entry['length_s']):.1f} s)"


def _gaps(use: RestsOn, flight: Flight, thresholds: Thresholds) -> list[str]:
    """Gaps of the topics within the spans used, one line a topic."""
    told = []
    for topic in use.topics:
        gaps = gaps_of(topic, flight[topic].time_ns, thresholds=thresholds)
        starts_s = flight.seconds(gaps.start_ns)
        inside = np.array(
            [_overlaps(a, a + b, use.spans_s) for a, b in zip(starts_s, gaps.length_s, strict=True)], dtype=bool
        )
        if inside.any():
            count, total_s = int(inside.sum()), float(gaps.length_s[inside].sum())
            told.append(f"{count} {'gap' if count == 1 else 'gaps'} of {topic}, {total_s:.1f} s together")
    return told
