"""Chapter: the flight at a glance: track map, altitude, speed, attitude, phases and the state of GNSS."""

from groundstation.chapters.parts import Figure, Section
from groundstation.results.flight import FlightResults

FIGURES = (
    *(Figure("overview.track"), Figure("overview.profile")),
    *(Figure("overview.attitude"), Figure("overview.states")),
)


def overview(results: FlightResults) -> Section | None:
    """The chapter, None when the flight has no overview."""
    known = any(results.figure_with_rows(name) is not None for name in ("overview", "state_lanes"))
    return Section("overview", "Overview of the flight", "", FIGURES) if known else None
