"""Chapter on the flight at a glance.

Track map, altitude, speed, attitude, phases and the state of GNSS.
"""

from groundstation.chapters.parts import Figure, Section
from groundstation.results.arrays.flight import Overview, StateLanes
from groundstation.results.flight import FlightResults

FIGURES = (
    *(Figure("overview.track"), Figure("overview.profile")),
    *(Figure("overview.attitude"), Figure("overview.states")),
)


def overview(results: FlightResults) -> Section | None:
    """Return the chapter; None when the flight has no overview."""
    known = results.rows_of(Overview) is not None or results.rows_of(StateLanes) is not None
    return Section("overview", "Overview of the flight", "", FIGURES) if known else None
