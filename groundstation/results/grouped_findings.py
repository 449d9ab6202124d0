"""Findings grouped for the reader: remarks on many raw topics in one line with a count."""

from collections.abc import Iterable, Sequence
from itertools import groupby

from groundstation.base.findings import Finding
from groundstation.base.signals import RAW_PREFIX

FEW = 3  # so many of one kind stand one by one
NAMED = 5  # topics named in a line
KINDS = {
    "values.nan": "fields of raw topics hold NaN as the device wrote it",
    "time.duplicates": "raw topics repeat times: records at the time of the one before",
    "data.breaks_off": "raw topics end before the log does",
    "data.gaps": "raw topics have gaps; where, is drawn under data quality",
}


def grouped(findings: Iterable[Finding]) -> tuple[Finding, ...]:
    """Join remarks on raw topics by kind.

    Warnings, failures and findings on canonical topics stand alone. Nothing is estimated from raw topics, and an
    autopilot's log has a hundred of them with thousands of fields. Where more than three remarks are of one kind they
    become one: how many there are, in which topics, and the sum of their counts. ``summary.json`` lists each.

    Examples
    --------
    >>> many = [Finding("info", "values.nan", "...", f"raw.t{number // 2}", "", 10) for number in range(8)]
    >>> joined, = grouped(many)
    >>> joined.text, joined.count
    ('8 fields of raw topics hold NaN as the device wrote it: t0, t1, t2, t3', 80)
    """
    listed = tuple(findings)
    kinds: dict[str, list[Finding]] = {}
    for finding in listed:
        if _is_remark_on_raw(finding):
            kinds.setdefault(finding.code, []).append(finding)
    out: list[Finding] = []
    told: set[str] = set()
    for finding in listed:
        alike = kinds.get(finding.code, []) if _is_remark_on_raw(finding) else []
        if len(alike) <= FEW:
            out.append(finding)
        elif finding.code not in told:
            told.add(finding.code)
            out.append(_joined(alike))
    return tuple(out)


def _is_remark_on_raw(finding: Finding) -> bool:
    return finding.severity == "info" and finding.code in KINDS and finding.topic.startswith(RAW_PREFIX)


def _joined(alike: Sequence[Finding]) -> Finding:
    topics = [topic.removeprefix(RAW_PREFIX) for topic, _ in groupby(finding.topic for finding in alike)]
    names = ", ".join(topics[:NAMED]) + (f" and {len(topics) - NAMED} more" if len(topics) > NAMED else "")
    count = sum(finding.count or 0 for finding in alike)
    return Finding("info", alike[0].code, f"{len(alike)} {KINDS[alike[0].code]}: {names}", "", "", count or None)
