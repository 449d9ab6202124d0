"""Reasons that flights share, each told once: a rejected heading, failed health."""

import re
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from groundstation.chapters.parts import Grid, Head
from groundstation.chapters.wording import clean, number, plural, typeset
from groundstation.results.fleet import FleetResults

SHORT = 40  # characters of a reason that stands beside its flight
MOST_NAMED, MOST_REASONS = 8, 60
HEADS = (Head("No."), Head("Reason"), Head("Flights"))
_NUMBER = re.compile(r"[-+−]?\d[\d.,:]*")


class Reasons(NamedTuple):
    """Remarks on flights by their ids, and the table of the reasons they refer to.

    The table is None where they refer to none.
    """

    remarks: Mapping[str, str]
    table: Grid | None


def reasons_of(fleet: FleetResults) -> Reasons:
    """Return why flights were rejected or failed, each reason once with its flights.

    Reasons that differ in numbers alone are one; its text is that of the first flight.
    """
    flights, groups = fleet.flights, dict[tuple[str, str], list[tuple[str, str]]]()
    kinds = (
        ("rejected", flights["verdict"] == "reject", flights["verdict_reason"]),
        ("health bad", flights["health_verdict"] == "fail", flights["health_sentence"]),
    )
    for word, chosen, texts in kinds:
        for row in np.flatnonzero(chosen):
            text = typeset(clean(str(texts[row])))
            groups.setdefault((word, _NUMBER.sub("#", text)), []).append((str(flights["flight_id"][row]), text))
    remarks, rows = dict[str, str](), list[tuple[str, str, str]]()
    for (word, _), found in groups.items():
        text = found[0][1]
        is_short = len(text) <= SHORT and len(found) == 1
        if not is_short and len(rows) < MOST_REASONS:
            rows.append((str(len(rows) + 1), f"{word}: {text}" if text else word, _named([one for one, _ in found])))
            told = f"{word} (reason {len(rows)})"
        else:
            told = f"{word}: {text}" if is_short and text else word
        remarks |= {one: _joined(remarks.get(one, ""), told) for one, _ in found}
    caption = "Numbers are those of the first flight." if rows else ""
    return Reasons(remarks, Grid("Reasons", HEADS, rows, caption) if rows else None)


def _named(ids: list[str]) -> str:
    more = len(ids) - MOST_NAMED
    named = ", ".join(ids[:MOST_NAMED])
    return f"{plural(len(ids), 'flight')}: {named}{f' and {number(more, 0)} more' if more > 0 else ''}"


def _joined(before: str, told: str) -> str:
    return f"{before}; {told}" if before else told
