"""Events of an approach in order of time: where it began, lost its limits, met the ground."""

from typing import Literal

from groundstation.base.dataclasses import dataclass

EventKind = Literal[
    "start",
    "established",
    "end of established",
    "limit left",
    "criterion not met",
    "touchdown",
    "second contact",
    "end",
]


@dataclass(frozen=True, kw_only=True)
class LandingEvent:
    """One event of an approach.

    Parameters
    ----------
    approach : int
        Number of the approach.
    time_s : float
        Flight time.
    event : str
        Kind of event.
    what : str
        Name of the criterion, outcome of the approach, or what the touchdown was found by.
    value : float or None
        Of the criterion in ``unit``, load of a contact in g.
    height_m, before_threshold_m : float or None
        Height above the threshold, and distance before it.
    """

    approach: int
    time_s: float
    event: EventKind
    what: str = ""
    value: float | None = None
    unit: str = ""
    height_m: float | None = None
    before_threshold_m: float | None = None
