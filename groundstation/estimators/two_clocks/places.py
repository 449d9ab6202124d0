"""Distance between the positions of two logs at one time; those of one flight are near."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from groundstation.base.geodesy import north_east_m
from groundstation.base.records import Int64Array
from groundstation.base.signals import topics_of_kind
from groundstation.tables.resample import join
from groundstation.tables.table import Flight, Table

POSITION = ("latitude_deg", "longitude_deg")
LARGEST_GAP_S = 10.0


@dataclass(frozen=True)
class Apart:
    """Median distance over the ground; ``is_inertial``: one position is that of an INS.

    An INS may drift.
    """

    distance_m: float
    is_inertial: bool


def apart_m(first: Flight, other: Flight, first_time_ns: Callable[[Int64Array], Int64Array]) -> Apart | None:
    """Return the distance between the positions of two logs at one time.

    None where one has no position or they never overlap.
    """
    a, b = _positions(first), _positions(other)
    if a is None or b is None:
        return None
    moved = join(a, first_time_ns(b.time_ns), POSITION, largest_gap_s=LARGEST_GAP_S)
    latitude, longitude = (moved.values(name) for name in POSITION)
    known = np.isfinite(latitude) & np.isfinite(longitude)
    if not known.any():
        return None
    distance = []
    for row in np.flatnonzero(known)[:: max(int(known.sum()) // 200, 1)]:
        north, east = north_east_m(
            b.values("latitude_deg")[row], b.values("longitude_deg")[row], float(latitude[row]), float(longitude[row])
        )
        distance.append(float(np.hypot(north, east)))
    return Apart(float(np.median(distance)), any(one.topic.startswith("ins") for one in (a, b)))


def _positions(flight: Flight) -> Table | None:
    topics = [*topics_of_kind("gnss", flight.topics()), *topics_of_kind("ins", flight.topics())]
    found = next((flight[topic] for topic in topics if flight[topic].has(*POSITION)), None)
    if found is None:
        return None
    known = found.unique_times()
    known = known.take(known.valid(*POSITION))
    return known if len(known) > 1 else None
