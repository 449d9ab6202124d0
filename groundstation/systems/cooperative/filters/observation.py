"""Predicted measurements and their derivatives; tests check them by central differences."""

from math import cos, isfinite, sin, sqrt
from typing import NamedTuple

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.geodesy import EARTH_RATE_RADPS
from groundstation.systems.cooperative.filters.sights import Sight
from groundstation.systems.cooperative.filters.steps import MeasurementEvent
from groundstation.systems.cooperative.loop_types import HEIGHT, PEER, SATELLITE
from groundstation.systems.cooperative.vehicles import Vehicle, View

LIGHT_MPS = 299_792_458.0
NEAREST_M = 1e-3  # a source on top of the receiver has no direction
NOWHERE = np.zeros(3)


class LinearisedMeasurement(NamedTuple):
    """One scalar measurement, linearised.

    innovation = h (receiver) + place (source) + clock (source) + noise.

    Parameters
    ----------
    innovation : float
        Measured minus predicted.
    receiver : ndarray, shape (n,)
        Derivative of the prediction by the receiver's state.
    place : ndarray, shape (3,)
        By the source's position.
    clock : float
        By the source's clock offset.
    variance : float
        Of the sensor alone.
    """

    innovation: float
    receiver: FloatArray
    place: FloatArray
    clock: float
    variance: float

    def by_source(self, vehicle: Vehicle, derivative: FloatArray) -> FloatArray:
        """Derivative by the state of a vehicle that is the source."""
        h = self.place @ derivative
        if vehicle.clock >= 0 and self.clock != 0.0:
            h[vehicle.clock] += self.clock
        return h


def rows_of(
    event: MeasurementEvent,
    vehicle: Vehicle,
    x: FloatArray,
    source_m: FloatArray | None,
    source_clock_m: float,
    about_m: FloatArray | None = None,
    sight: Sight | None = None,
) -> list[LinearisedMeasurement]:
    """Linearise one event about the receiver's state and what is known of the source.

    Parameters
    ----------
    event : MeasurementEvent
    vehicle : Vehicle
        The receiver.
    x : ndarray, shape (n,)
        Its state at the time of the event.
    source_m : ndarray, shape (3,), optional
        Position of a peer; points and satellites carry their own.
    source_clock_m : float
        Clock offset of a peer; 0 else.
    about_m : ndarray, shape (3,), optional
        Line from the source to the receiver about which the range is linearised; None: that of the estimate.
    sight : Sight, optional
        Antenna of the receiver, where it is known beforehand.

    Returns
    -------
    list of LinearisedMeasurement
        Range, then bearing, as far as the event has them.
    """
    if event.kind == HEIGHT:
        h = np.zeros(vehicle.size)
        h[vehicle.height] = -1.0
        reading = vehicle.height_m(event.time_s) if sight is None else -float(sight.reading[2])
        innovation = event.value_m - (reading - float(x[vehicle.height]))
        return [LinearisedMeasurement(innovation, h, NOWHERE, 0.0, event.variance_m2)]
    source = (event.place_m if source_m is None else source_m) - event.arm_m
    view = None
    if sight is None:
        view = vehicle.view(x, event.time_s)
        place_m, derivative = view.place_m, view.derivative
    else:
        derivative = sight.derivative
        place_m = sight.reading + derivative @ x
    line = place_m - source
    distance = sqrt(line @ line)
    if distance < NEAREST_M:
        return []
    rows = []
    if isfinite(event.value_m):
        direction = line / distance
        if about_m is not None:
            distance = sqrt(about_m @ about_m)
            direction = about_m / distance
            distance += float(direction @ (line - about_m))
        elif event.kind == SATELLITE:
            direction, distance = _while_the_earth_turns(place_m, source, distance)
        rows.append(_range_row(event, vehicle, x, derivative, source_clock_m, direction, distance))
    if isfinite(event.bearing_rad) and view is not None:
        rows.append(_bearing_row(event, view, -line))
    return rows


def _range_row(
    event: MeasurementEvent,
    vehicle: Vehicle,
    x: FloatArray,
    derivative: FloatArray,
    source_clock_m: float,
    direction: FloatArray,
    distance: float,
) -> LinearisedMeasurement:
    predicted, kind = distance, event.kind
    h = direction @ derivative
    by_source, by_clock = -direction, 0.0
    clock = vehicle.receiver_clock if kind == SATELLITE else vehicle.clock
    if clock >= 0 and not event.is_two_way:
        predicted += float(x[clock]) - source_clock_m
        h[clock] += 1.0
        by_clock = -1.0 if kind == PEER else 0.0
    if kind != SATELLITE and vehicle.has_range_errors:
        error, by_error, scale = vehicle.range_error(x, distance, is_peer=kind == PEER)
        predicted += error
        h = (1.0 + scale) * h + by_error if scale else h + by_error
        by_source = (1.0 + scale) * by_source
    return LinearisedMeasurement(event.value_m - predicted, h, by_source, by_clock, event.variance_m2)


def _while_the_earth_turns(place: FloatArray, source: FloatArray, distance: float) -> tuple[FloatArray, float]:
    """Return direction and distance from a satellite's place at emission.

    They are in the ECEF axes of the instant of reception.
    """
    (a, b, c), (x, y, z) = place.tolist(), source.tolist()
    north = east = up = 0.0
    for _ in range(3):  # each gains six digits
        turn = EARTH_RATE_RADPS * distance / LIGHT_MPS
        cosine, sine = cos(turn), sin(turn)
        north, east, up = a - (cosine * x + sine * y), b - (cosine * y - sine * x), c - z
        distance = sqrt(north * north + east * east + up * up)
    return np.array([north, east, up]) / distance, distance


def _bearing_row(event: MeasurementEvent, view: View, line: FloatArray) -> LinearisedMeasurement:
    """Return the row of a bearing off the sensor's heading.

    The bearing is the direction to the source less the heading; ``line`` leads from the sensor to the source.
    """
    north, east = float(line[0]), float(line[1])
    square = north * north + east * east
    by_line = np.array([-east, north, 0.0]) / square
    h = -by_line @ view.derivative - view.by_heading
    innovation = event.bearing_rad - (np.arctan2(east, north) - view.heading_rad)
    wrapped = float((innovation + np.pi) % (2.0 * np.pi) - np.pi)
    return LinearisedMeasurement(wrapped, h, by_line, 0.0, event.bearing_variance_rad2)
