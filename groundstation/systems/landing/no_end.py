"""Reasons why a log has no end of an approach, though it may have landed."""

import re
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from groundstation.base.signals import EVENT_SEPARATOR
from groundstation.base.words import clock_text
from groundstation.results.gates import WITHOUT_ROLLING
from groundstation.systems.landing.evidence import SLOWEST_MPS
from groundstation.systems.landing.finals import ON_LANDING
from groundstation.systems.landing.path import FlightPath

if TYPE_CHECKING:
    from groundstation.tables.phases import Phases
    from groundstation.tables.table import Flight

NONE = "no landing in the log, and no guided descent followed by a climb"
_DOWN = re.compile(r"\bland(?:ing)? ?(?:complete|detected)$|\blanded$", re.I)  # not "land complete maybe", "not landed"
_NOT = re.compile(r"\bnot\b", re.I)


def why_no_end(flight: "Flight", path: FlightPath, phases: "Phases") -> str:
    """Return the reason: set down without rolling, a landing not proven, or none.

    Between proven flight and proven ground it may hover down for seconds; no approach to a runway ends there.
    """
    said = _said(flight)
    between = _between(phases)
    if between is None:
        return f"{said}, but nothing proves a flight down to it" if said else NONE
    start_s, end_s = between
    told = f"between {clock_text(start_s)} and {clock_text(end_s)}" + (f" ({said})" if said else "")
    known = np.isfinite(path.ground_speed_mps)
    speed_mps = np.interp(start_s, path.time_s[known], path.ground_speed_mps[known]) if known.any() else np.inf
    if speed_mps < SLOWEST_MPS:
        return f"set down {told} {WITHOUT_ROLLING}: no approach to a runway"
    return f"it came down {told}, where neither flight nor ground is proven: no touchdown to judge an approach by"


def _between(phases: "Phases") -> tuple[float, float] | None:
    """Return from and to between the last proven flight and the ground behind it."""
    known = [one for one in phases.intervals if one.phase != "unknown"]
    found = [
        (before.end_s, after.start_s)
        for before, after in pairwise(known)
        if before.phase == "airborne" and after.phase in ON_LANDING
    ]
    return found[-1] if found else None


def _said(flight: "Flight") -> str:
    """Return the last event that says that the aircraft is down, and when; or nothing."""
    if "event" not in flight or not flight["event"].has("name"):
        return ""
    table = flight["event"]
    names = zip(flight.seconds(table.time_ns).tolist(), table.text("name").tolist(), strict=True)
    each = [(time_s, name.strip()) for time_s, joined in names for name in joined.split(EVENT_SEPARATOR)]
    down = [(time_s, name) for time_s, name in each if _DOWN.search(name) and not _NOT.search(name)]
    return f"“{down[-1][1]}” at {clock_text(down[-1][0])}" if down else ""
