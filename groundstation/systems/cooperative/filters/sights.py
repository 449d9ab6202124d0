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
        self._receivers = _Antennas(vehicles, events.receiver, events.time_s)
        self._sources = _Antennas(vehicles, np.where(events.kind == PEER, events.source, -1), events.time_s)

    def receiver(self, number: int) -> Sight | None:
        """Antenna of the receiver; None where it is no aircraft."""
        return self._receivers.at(number)

    def source(self, number: int) -> Sight | None:
        """Antenna of the peer that sent; None where it is no aircraft."""
        return self._sources.at(number)


class _Antennas:
    """Antennas of one end of all measurements."""

    def __init__(self, vehicles: Sequence[Vehicle], who: Int64Array, time_s: FloatArray) -> None:
        sizes = [vehicle.size if isinstance(vehicle, Aircraft) else 0 for vehicle in vehicles]
        self._size: list[int] = np.array([*sizes, 0])[who].tolist()
        self._reading = np.zeros((len(who), 3))
        self._derivative = np.zeros((len(who), 3, max(sizes, default=0)))
        for number, vehicle in enumerate(vehicles):
            mine = np.flatnonzero(who == number)
            if isinstance(vehicle, Aircraft) and len(mine):
                at = places(vehicle, time_s[mine])
                self._reading[mine] = at.reading
                for column, state in enumerate(at.states):
                    self._derivative[mine, :, state] = at.derivative[:, :, column]

    def at(self, number: int) -> Sight | None:
        size = self._size[number]
        return Sight(self._reading[number], self._derivative[number, :, :size]) if size else None
