"""Events by which the clocks of two saved flights are aligned, from saved results."""

import math
from typing import get_args

from groundstation.base.errors import UsageError
from groundstation.base.timescales import duration_text
from groundstation.base.units import NS_PER_S
from groundstation.pipeline.verbs.clip import zero_s
from groundstation.results.arrays.flight import GnssLanes, PhaseSpans
from groundstation.results.comparison import ClockAlignment, Event
from groundstation.results.files import SavedFlight
from groundstation.results.roles import ErrorsAlongTheFlight

EVENTS: tuple[Event, ...] = get_args(Event)
AT_REST, UNKNOWN, AIRBORNE, TAKE_OFF_RUN = "standstill", "unknown", "airborne", "take-off run"
NO_GNSS = "no GNSS"


def align(a: SavedFlight, b: SavedFlight, event: Event | None, *, is_same_log: bool) -> ClockAlignment:
    """Align two flights on an event that both have.

    Parameters
    ----------
    a, b : SavedFlight
    event : str, optional
        Left out: UTC for two runs of one log (its start where it has no UTC), else the first movement where both show
        it, else the start.

    Raises
    ------
    UsageError
        When one of the flights does not have the event.
    """
    if event is None:
        event = _default(a, b, is_same_log)
    if event == "utc":
        start_a_ns, start_b_ns = (saved.results.start_utc_ns for saved in (a, b))
        if start_a_ns is None or start_b_ns is None:
            raise _missing(a if start_a_ns is None else b, event)
        return ClockAlignment(event, 0.0, (start_a_ns - start_b_ns) / NS_PER_S)
    moments = []
    for saved in (a, b):
        found = events_of(saved)
        if event not in found:
            raise _missing(saved, event)
        moments.append(found[event])
    if event == "start" and is_same_log:  # a part of a flight begins where it was cut
        moments = [-zero_s(saved.results.metadata) for saved in (a, b)]
    return ClockAlignment(event, moments[0], moments[1])


def events_of(saved: SavedFlight) -> dict[Event, float]:
    """Return the events of a flight that others can be aligned on, in flight seconds.

    ``utc`` is no moment and not among them. The first movement follows a standstill and the lift-off something else
    than an unknown phase: a log that begins later shows neither. The last part of a run need not be proven. An outage
    is the first interval without GNSS.
    """
    found: dict[Event, float] = {"start": 0.0}
    phases = saved.rows_of(PhaseSpans)
    if phases is not None:
        start_s, names = phases.start_s.tolist(), phases.proven_phase().tolist()
        moving = next((row for row, name in enumerate(names) if name not in (AT_REST, UNKNOWN)), 0)
        if moving and names[moving - 1] == AT_REST and math.isfinite(start_s[moving]):
            found["first-movement"] = start_s[moving]
        flying = names.index(AIRBORNE) if AIRBORNE in names else 0
        is_shown = names[flying - 1] != UNKNOWN or phases.phase[flying - 1] == TAKE_OFF_RUN
        if flying and is_shown and math.isfinite(start_s[flying]):
            found["lift-off"] = start_s[flying]
    outage_s = _first_outage_s(saved)
    if outage_s is not None:
        found["outage"] = outage_s
    return found


def _first_outage_s(saved: SavedFlight) -> float | None:
    found = saved.results.answer_meeting(ErrorsAlongTheFlight)
    starts = [one.start_s for one in found.outages if one.missing in ("gnss", "both")] if found else []
    lanes = saved.rows_of(GnssLanes)
    if lanes is not None:
        starts += lanes.start_s[lanes.state == NO_GNSS].tolist()
    return min((start for start in starts if math.isfinite(start)), default=None)


def _default(a: SavedFlight, b: SavedFlight, is_same_log: bool) -> Event:
    if is_same_log:
        return "start" if None in (a.results.start_utc_ns, b.results.start_utc_ns) else "utc"
    return "first-movement" if all("first-movement" in events_of(saved) for saved in (a, b)) else "start"


def _missing(saved: SavedFlight, event: Event) -> UsageError:
    has = [f"{name} (+{duration_text(moment)})" for name, moment in events_of(saved).items()]
    has += ["utc"] if saved.results.start_utc_ns is not None else []
    return UsageError(saved.folder.name, f"no {event}", f"one of {', '.join(has)}", "choose another --align")
