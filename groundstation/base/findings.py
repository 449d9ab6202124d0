"""Findings: what a user must know about a flight, with its place and severity."""

from dataclasses import dataclass
from typing import Literal

Severity = Literal["info", "warn", "fail"]
SEVERITIES: tuple[Severity, ...] = ("info", "warn", "fail")


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
        How many, where that makes sense.
    """

    severity: Severity
    code: str
    text: str
    topic: str = ""
    place: str = ""
    count: int | None = None


def worst(findings: "tuple[Finding, ...]") -> Severity | None:
    """The highest severity among findings, None when there are none.

    Examples
    --------
    >>> worst((Finding("info", "a.b", "x"), Finding("warn", "a.c", "y")))
    'warn'
    """
    return max((finding.severity for finding in findings), key=SEVERITIES.index, default=None)
