"""Findings grouped for the reader: remarks on many raw topics in one line with a count."""

import re
from collections.abc import Iterable, Sequence
from dataclasses import replace
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


def named_lines(findings: Iterable[Finding]) -> tuple[Finding, ...]:
    """Return findings for lines of a terminal, which show no topic beside the text.

    Equal findings on several topics become one. Topics that the text does not name stand before it.

    Examples
    --------
    >>> text = "from measured pressure"
    >>> alike = [Finding("info", "reader.derived", text, f"baro.{number}") for number in (1, 2, 3)]
    >>> [one.text for one in named_lines([*alike, Finding("warn", "data.gaps", "ins: 2 gaps", "ins")])]
    ['baro.1, baro.2, baro.3: from measured pressure', 'ins: 2 gaps']
    >>> [one.text for one in named_lines([Finding("info", "", "ins.mode is made", "ins")])]
    ['ins.mode is made']
    """
    alike: dict[tuple[str, str, str], list[Finding]] = {}
    for finding in findings:
        body = finding.text.removeprefix(f"{finding.topic}: ")
        alike.setdefault((finding.severity, finding.code, body), []).append(finding)
    return tuple(replace(several[0], text=_line(several, body)) for (_, _, body), several in alike.items())


def _line(alike: Sequence[Finding], body: str) -> str:
    """Return the text of equal findings behind the topics that it does not name."""
    topics = list(dict.fromkeys(one.topic for one in alike if one.topic and not _names(body, one.topic)))
    return f"{_named(topics)}: {body}" if topics else body


def _names(text: str, topic: str) -> bool:
    """Tell whether a text names a topic or a field of it; ``ins.2`` does not name ``ins``."""
    name = re.escape(topic.removeprefix(RAW_PREFIX))
    return re.search(rf"(?<!\w){name}(?!\w|\.\d)", text) is not None


def _named(topics: Sequence[str]) -> str:
    return ", ".join(topics[:NAMED]) + (f" and {len(topics) - NAMED} more" if len(topics) > NAMED else "")


def _is_remark_on_raw(finding: Finding) -> bool:
    return finding.severity == "info" and finding.code in KINDS and finding.topic.startswith(RAW_PREFIX)


def _joined(alike: Sequence[Finding]) -> Finding:
    topics = [topic.removeprefix(RAW_PREFIX) for topic, _ in groupby(finding.topic for finding in alike)]
    names = _named(topics)
    count = sum(finding.count or 0 for finding in alike)
    return Finding("info", alike[0].code, f"{len(alike)} {KINDS[alike[0].code]}: {names}", "", "", count or None)
