"""Places of the antennas of aircraft at all measurements of a session, worked out at once.

A place is linear in the states, and where dead reckoning has it is known beforehand. A wheeled vehicle's place is not:
it is asked one by one.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.records import Int64Array
from groundstation.systems.cooperative.aircraft import Aircraft
from groundstation.systems.cooperative.aircraft_motion import places
from groundstation.systems.cooperative.loop_types import PEER, Events
from groundstation.systems.cooperative.vehicles import Vehicle


class Sight(NamedTuple):
    """Antenna at one measurement: place = reading + derivative x."""

    reading: FloatArray  # (3,)
    derivative: FloatArray  # (3, n)


class Sights:
    """Antennas of receivers and of peers that send, by the number of the measurement."""

    def __init__(self, vehicles: Sequence[Vehicle], events: Events) -> None:
        self._receivers = _sights(vehicles, events.receiver, events.time_s)
        self._sources = _sights(vehicles, np.where(events.kind == PEER, events.source, -1), events.time_s)

    def receiver(self, number: int) -> Sight | None:
        """Antenna of the receiver; None where it is no aircraft."""
        return self._receivers[number]

    def source(self, number: int) -> Sight | None:
        """Antenna of the peer that sent; None where it is no aircraft."""
        return self._sources[number]


def _sights(vehicles: Sequence[Vehicle], who: Int64Array, time_s: FloatArray) -> list[Sight | None]:
    found: list[Sight | None] = [None] * len(who)
    for number, vehicle in enumerate(vehicles):
        mine = np.flatnonzero(who == number)
        if not isinstance(vehicle, Aircraft) or not len(mine):
            continue
        at = places(vehicle, time_s[mine])
        whole = np.zeros((len(mine), 3, vehicle.size))
        whole[:, :, at.states] = at.derivative
        for one, reading, derivative in zip(mine.tolist(), at.reading, whole, strict=True):
            found[one] = Sight(reading, derivative)
    return found
