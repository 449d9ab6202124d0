"""Clocks of several logs of one flight: the part of a system by which they are joined.

The pipeline converts the logs, moves their records onto one clock and writes them; the system relates the clocks.
"""

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any, Protocol

from groundstation.base.clock import Clock
from groundstation.base.dataclasses import dataclass
from groundstation.base.errors import GroundstationError
from groundstation.base.findings import Finding
from groundstation.base.records import Int64Array

if TYPE_CHECKING:
    from groundstation.results.flight import Source
    from groundstation.tables.table import Flight


class NotOneFlightError(GroundstationError):
    """Two logs cannot be put on one clock.

    Nothing tells the lag between them, or they are of different flights.
    """


class NoCommonClockError(NotOneFlightError):
    """Two logs have nothing that tells the lag between them.

    UTC in both would.
    """


class Timed(Protocol):
    """Log by its tables, and GNSS time where it tells it."""

    @property
    def flight(self) -> "Flight": ...
    @property
    def gnss_time(self) -> Any: ...


class FlightClock(Protocol):
    """Relation of the clock of a log to that of the flight."""

    def first_time_ns(self, other_ns: Int64Array) -> Int64Array:
        """Times of the log on the clock of the flight, shape as given."""


@dataclass(frozen=True)
class PlacedLog:
    """One log with its place in the flight.

    Parameters
    ----------
    label : str
        Ends the names of its topics; empty for the first log.
    source : Source
    duration_s : float
        Length on its own clock.
    relation : FlightClock or None
        As the system gave it; None for the log whose clock is that of the flight.
    rows : int
        Records that it has in the flight.
    reordered : int
        Records that were moved to keep order where the relation of the clocks steps.
    """

    label: str
    source: "Source"
    duration_s: float
    relation: Any
    rows: int
    reordered: int


@dataclass(frozen=True)
class JoinRecord:
    """Record of a joining: the text that the MCAP keeps for the analysis, and findings."""

    text: str
    findings: tuple[Finding, ...]


@dataclass(frozen=True)
class JoinStep:
    """Step before the flight exists, as a part of a system.

    Parameters
    ----------
    settings : type
        Of its settings, among those of the analyses.
    timed : callable
        ``timed(flight, clock, reader, settings)``: a converted log as ``relate`` takes it.
    relate : callable
        ``relate(first, other, settings)`` puts the clock of the other on that of the first; NotOneFlightError where it
        cannot.
    told : callable
        ``told(logs, start_ns)``, with the start of the flight.
    """

    settings: type[Any]
    timed: "Callable[[Flight, Clock, str, Any], Timed]"
    relate: Callable[[Any, Any, Any], FlightClock]
    told: Callable[[Sequence[PlacedLog], int], JoinRecord]


def name_in_flight(topic: str, label: str) -> str:
    """Return the name that a topic of a log has in the flight.

    Examples
    --------
    >>> name_in_flight("gnss", "b"), name_in_flight("gnss", "")
    ('gnss.b', 'gnss')
    """
    return f"{topic}.{label}" if label and topic else topic
