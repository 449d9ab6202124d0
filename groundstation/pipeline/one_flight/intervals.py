"""Times as users write them, turned into flight seconds.

Flight seconds, +mm:ss or ISO UTC.
"""

import math
import re
from collections.abc import Sequence
from typing import Protocol

from groundstation.base.errors import GroundstationError, SettingsError
from groundstation.base.timescales import iso_to_utc_ns
from groundstation.base.units import NS_PER_S
from groundstation.tables.table import Flight

_CLOCK = re.compile(r"\+?(?:(\d+):)?(\d+):(\d+(?:\.\d*)?)$")


def flight_seconds(text: str, start_ns: int, has_utc: bool) -> float:
    """Return flight seconds of a time as a user writes it.

    Raises
    ------
    SettingsError
        When the text is no time, or a UTC for a flight without absolute time.

    Examples
    --------
    >>> flight_seconds("+02:10", 0, False), flight_seconds("12.5", 0, False)
    (130.0, 12.5)
    >>> flight_seconds("1970-01-01T00:00:30Z", 10_000_000_000, True)
    20.0
    """
    match = _CLOCK.match(text.strip())
    if match:
        hours, minutes, last = match.groups()
        seconds = float(hours or 0) * 3600.0 + float(minutes) * 60.0 + float(last)
    else:
        try:
            seconds = float(text)
        except ValueError:
            seconds = math.nan
    if math.isfinite(seconds):
        return seconds
    if not has_utc:
        raise SettingsError("time", repr(text), "flight seconds or +mm:ss: the flight has no UTC")
    try:
        utc_ns, _ = iso_to_utc_ns(text)
    except GroundstationError as error:
        raise SettingsError("time", repr(text), "flight seconds, +mm:ss or ISO UTC") from error
    return (utc_ns - start_ns) / NS_PER_S


class HasEnds(Protocol):
    """An interval whose ends are written as users write times."""

    @property
    def start(self) -> str: ...
    @property
    def end(self) -> str: ...


def seconds_of(flight: Flight, intervals: Sequence[HasEnds]) -> tuple[tuple[float, float], ...]:
    """Return intervals as pairs of flight seconds.

    Raises
    ------
    SettingsError
        When an end lies before its start.
    """
    pairs = []
    for part in intervals:
        start_s, end_s = (flight_seconds(text, flight.start_ns, flight.has_utc) for text in (part.start, part.end))
        if end_s < start_s:
            raise SettingsError("interval", f"{part.start} to {part.end}", "an end after its start")
        pairs.append((start_s, end_s))
    return tuple(pairs)
