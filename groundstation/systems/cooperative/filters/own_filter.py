"""One vehicle's own filter, what it hears, and what it makes an update of."""

from typing import NamedTuple

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.systems.cooperative.filters.observation import LinearisedMeasurement
from groundstation.systems.cooperative.filters.sighting import Sighting
from groundstation.systems.cooperative.filters.steps import MeasurementEvent
from groundstation.systems.cooperative.vehicles import Vehicle


class OwnFilter(NamedTuple):
    """One vehicle's filter: state, covariance, independent part (split), error map rows.

    Also the covariance with the points (modified). Nothing of it changes: an update makes a new one.
    """

    time_s: float
    x: FloatArray
    P: FloatArray
    independent: FloatArray | None  # None: an algorithm that does not split
    shared: FloatArray  # (n, q)
    map_rows: FloatArray  # (n, N)

    def moved(self, vehicle: Vehicle, to_s: float) -> "OwnFilter":
        """Return the filter at another time; back in time nothing is added."""
        if abs(to_s - self.time_s) < 1e-12:
            return self
        x, phi, noise = vehicle.step(self.x, self.time_s, to_s)
        P = phi @ self.P @ phi.T
        independent = None if self.independent is None else phi @ self.independent @ phi.T
        if to_s > self.time_s:
            P += noise
            if independent is not None:
                independent += noise
        return OwnFilter(to_s, x, P, independent, phi @ self.shared, phi @ self.map_rows)


class HeardBroadcast(NamedTuple):
    """A broadcast as it arrived: place, clock, covariances of 4-byte numbers.

    For the error map alone: derivative and rows of its sender.
    """

    place_m: FloatArray
    clock_m: float
    covariance: FloatArray  # (4, 4), zero where the algorithm sends none
    shared: FloatArray | None
    derivative: FloatArray
    map_rows: FloatArray


class OfferedMeasurement(NamedTuple):
    """A measurement for one vehicle.

    It is its own with what the source broadcast, or where another has seen it.
    """

    who: int
    event: MeasurementEvent
    heard: HeardBroadcast | None
    sighting: Sighting | None = None


class UsedRow(NamedTuple):
    """One row ready for an update: its derivatives and what its source brings.

    The derivatives are by the state now and by the shared errors.
    """

    offer: OfferedMeasurement
    row: LinearisedMeasurement
    h: FloatArray
    by_shared: FloatArray
    told: FloatArray  # by the place and clock that its source told

    @property
    def source(self) -> tuple[int, int]:
        """Vehicle or point whose error the row brings."""
        event = self.offer.event
        return event.kind, event.receiver if self.offer.sighting is not None else event.source

    def mixed(self, own: OwnFilter) -> FloatArray:
        """Errors that the row brings in, by those of all at the beginning of the window."""
        found, heard = self.h @ own.map_rows, self.offer.heard
        if heard is not None:
            found += self.told @ heard.derivative @ heard.map_rows
        return found


def brought(rows: list[UsedRow], exact: bool, Pc: FloatArray) -> FloatArray:
    """Return the covariance of what the sources of rows bring.

    Errors of one source are common to all its rows: between two of its messages the covariance is the product of their
    symmetric square roots, a covariance whatever the two are.
    """
    if exact:
        return np.zeros((len(rows), len(rows)))
    found = np.diag([brought_alone(used, exact, Pc) for used in rows])
    for i, used in enumerate(rows):
        for j in range(i):
            one, two = used.offer.heard, rows[j].offer.heard
            if one is None or two is None or rows[j].source != used.source:
                continue
            between = one.covariance if one is two else _root(one.covariance) @ _root(two.covariance)
            found[i, j] = found[j, i] = float(used.told @ between @ rows[j].told)
    return found


def brought_alone(used: UsedRow, exact: bool, Pc: FloatArray) -> float:
    """Return the variance that the source of one row brings."""
    if exact:
        return 0.0
    heard = used.offer.heard
    if heard is not None:
        return max(float(used.told @ heard.covariance @ used.told), 0.0)
    return float(used.by_shared @ Pc @ used.by_shared) if len(Pc) else 0.0


def _root(covariance: FloatArray) -> FloatArray:
    """Return the symmetric square root.

    Rounding to 4-byte numbers may leave an eigenvalue below 0.
    """
    values, vectors = np.linalg.eigh(covariance)
    return np.asarray(vectors * np.sqrt(np.maximum(values, 0.0)) @ vectors.T)
