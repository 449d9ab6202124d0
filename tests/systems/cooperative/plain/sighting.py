"""Fix in the plane that a vehicle tells another after measuring its range and bearing.

Along the line of sight the fix is as good as the range, across it as the bearing; the error of the observer's own place
and heading is in both. Without it a vehicle would learn only from what it measures itself.
"""

from typing import NamedTuple

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.systems.cooperative.filters.observation import NEAREST_M
from groundstation.systems.cooperative.loop_types import PEER
from groundstation.systems.cooperative.vehicles import Vehicle
from tests.systems.cooperative.plain.observation import LinearisedMeasurement
from tests.systems.cooperative.plain.steps import MeasurementEvent


class Sighting(NamedTuple):
    """Place where an observer saw another vehicle.

    ``place_m`` (3,) with its derivative by the observer's state, (3, n); the line of sight as a unit vector; variances
    of the sensor along and across it.
    """

    place_m: FloatArray
    derivative: FloatArray
    line: FloatArray
    along_m2: float
    across_m2: float

    def rows(self, seen: Vehicle, x: FloatArray, at_s: float, told_m: FloatArray) -> list[LinearisedMeasurement]:
        """Return the fix as two scalar measurements of the vehicle that was seen.

        ``told_m`` is the place as it arrived.
        """
        place, derivative = seen.place(x, at_s)
        across = np.array([-self.line[1], self.line[0], 0.0])
        return [
            LinearisedMeasurement(float(axis @ (told_m - place)), axis @ derivative, -axis, 0.0, variance)
            for axis, variance in ((self.line, self.along_m2), (across, self.across_m2))
        ]


def sighting_of(event: MeasurementEvent, observer: Vehicle, x: FloatArray) -> Sighting | None:
    """Return the fix that an observer with state ``x`` can tell; None without one.

    ``x`` is the state at the time of the event; range and bearing are both needed.
    """
    view = observer.view(x, event.time_s)
    if event.kind != PEER or not np.isfinite([event.value_m, event.bearing_rad, view.heading_rad]).all():
        return None
    error, _, scale = observer.range_error(x, 0.0, is_peer=True)
    distance = (event.value_m - error) / (1.0 + scale)
    if distance < NEAREST_M:
        return None
    by_distance = -observer.range_error(x, distance, is_peer=True)[1] / (1.0 + scale)
    direction = view.heading_rad + event.bearing_rad
    line = np.array([np.cos(direction), np.sin(direction), 0.0])
    across = np.array([-line[1], line[0], 0.0])
    derivative = view.derivative + np.outer(line, by_distance) + distance * np.outer(across, view.by_heading)
    return Sighting(
        view.place_m + distance * line,
        derivative,
        line,
        event.variance_m2 / (1.0 + scale) ** 2,
        distance**2 * event.bearing_variance_rad2,
    )
