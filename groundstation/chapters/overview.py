"""Chapter on the flight at a glance.

Track map, altitude, speed, attitude, phases and the state of GNSS.
"""

from groundstation.chapters.parts import Figure, Section
from groundstation.chapters.wording import clean
from groundstation.results.arrays.flight import Overview, PhaseSpans, StateLanes
from groundstation.results.flight import KIND_OF_VEHICLE, PHASES_BY, WHY_THAT_VEHICLE, FlightResults

NOTHING_PROVEN = "none: "  # what the method of phases begins with where nothing proves one
LEAST_SHARE = 0.005  # of the time: less is not told

FIGURES = (
    *(Figure("overview.track"), Figure("overview.profile")),
    *(Figure("overview.attitude"), Figure("overview.states")),
)


def overview(results: FlightResults) -> Section | None:
    """Return the chapter; None when the flight has no overview."""
    known = results.rows_of(Overview) is not None or results.rows_of(StateLanes) is not None
    return Section("overview", "Overview of the flight", _vehicle(results), FIGURES) if known else None


def _vehicle(results: FlightResults) -> str:
    """Return a sentence on the kind of vehicle, and one on phases that are not proven."""
    kind, why = (results.metadata.get(key, "") for key in (KIND_OF_VEHICLE, WHY_THAT_VEHICLE))
    if not kind:
        return ""
    told = f"Kind of vehicle: {'not known' if kind == 'unknown' else f'one that {kind}'} ({clean(why)})."
    phases = results.rows_of(PhaseSpans)
    share = 0.0 if phases is None else phases.likely_share()
    if share < LEAST_SHARE:
        return told
    method = clean(results.metadata.get(PHASES_BY, ""))
    why_not = method.removeprefix(NOTHING_PROVEN)
    rest = f"nothing proves them: {why_not}" if why_not != method else f"the others are proven ({method})"
    return f"{told} Phases of {100.0 * share:.0f} % of the time are likely by speed and height; {rest}."
