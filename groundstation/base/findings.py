"""Findings: what a user must know about a flight, with its place and severity."""

import re
from typing import Literal

from groundstation.base.dataclasses import dataclass
from groundstation.base.timescales import iso_to_utc_ns
from groundstation.base.units import NS_PER_S

Severity = Literal["info", "warn", "fail"]
_AT_UTC = re.compile(r"\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d(\.\d+)?Z")
_AT_SECONDS = re.compile(r"(?:^|\b(?:at|from) )\+?(\d{1,9}(?:\.\d+)?)(?: to \+?\d{1,9}(?:\.\d+)?)? s\b")
SEVERITIES: tuple[Severity, ...] = ("info", "warn", "fail")
CONTRADICTION = "data.contradiction"  # code: the log contradicts itself


@dataclass(frozen=True)
class Finding:
    """One finding.

    Parameters
    ----------
    severity : {'info', 'warn', 'fail'}
    code : str
        Stable name scripts may test, ``<room>.<what>``: ``"clock.backward_step"``.
    text : str
        One line for people, with figures and units.
    topic : str
        Topic concerned, empty for the whole flight.
    place : str
        Where: a time, a row, a byte.
    count : int, optional
        Number of cases, where that makes sense.
    """

    severity: Severity  #: info, warn or fail: `--fail-on` compares with it.
    code: str
    text: str
    topic: str = ""
    place: str = ""
    count: int | None = None


def place_time_ns(place: str, start_ns: int, *, has_utc: bool) -> int | None:
    """Return the corrected time that the place of a finding names; None when it names none.

    The place is in seconds of the flight or in UTC.

    Examples
    --------
    >>> place_time_ns("at 12.4 s", 5, has_utc=False), place_time_ns("row 7", 5, has_utc=False)
    (12400000005, None)
    >>> place_time_ns("78.5 to 81.1 s", 0, has_utc=False)
    78500000000
    >>> place_time_ns("2026-05-04T06:00:01Z", 0, has_utc=True)
    1777874401000000000
    """
    seconds, utc = _AT_SECONDS.search(place), _AT_UTC.search(place)
    if utc and has_utc:
        return int(iso_to_utc_ns(utc.group(0))[0])
    return start_ns + round(float(seconds.group(1)) * NS_PER_S) if seconds else None


def worst(findings: "tuple[Finding, ...]") -> Severity | None:
    """The highest severity among findings, None when there are none.

    Examples
    --------
    >>> worst((Finding("info", "a.b", "x"), Finding("warn", "a.c", "y")))
    'warn'
    """
    return max((finding.severity for finding in findings), key=SEVERITIES.index, default=None)
