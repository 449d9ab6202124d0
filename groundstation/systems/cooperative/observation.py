"""Compiled predictions of measurements and their derivatives.

Tests hold them against central differences.
"""

import numpy as np

from groundstation.base.compile import in_place
from groundstation.base.geodesy import EARTH_RATE_RADPS
from groundstation.systems.cooperative.loop_types import (
    HEIGHT,
    POINT,
    SATELLITE,
    Events,
    Fleet,
    FloatArray,
    LinearisedEvent,
)

LIGHT_MPS = 299_792_458.0
NEAREST_M = 1e-3  # a source on top of the receiver has no direction


@in_place
def observe(
    fleet: Fleet,
    events: Events,
    event: int,
    x: FloatArray,
    reading: FloatArray,
    derivative: FloatArray,
    source_m: FloatArray,
    source_clock_m: float,
    about_m: FloatArray,
    is_about: bool,
    rows: LinearisedEvent,
) -> int:
    """Linearise one event about the receiver's state and what is known of the source.

    Returns the number of its rows: one, none where the source is on top of the receiver.

    Parameters
    ----------
    x : ndarray, shape (n,)
        State of the receiver at the time of the event.
    reading, derivative : ndarrays, shapes (3,), (3, n)
        Its place = reading + derivative x.
    source_m : ndarray, shape (3,)
        Where the source is taken to be; means nothing for a height.
    source_clock_m : float
        Clock offset of a peer; 0 else.
    about_m : ndarray, shape (3,)
        Where ``is_about``: line from the source to the receiver about which the range is linearised, value and
        direction; else that of the estimate.
    rows : LinearisedEvent
        Filled.
    """
    who = events.receiver[event]
    n = fleet.size[who]
    if events.kind[event] == HEIGHT:
        for j in range(n):
            rows.receiver[0, j] = 0.0
        rows.receiver[0, fleet.height[who]] = -1.0
        for axis in range(3):
            rows.place[0, axis] = 0.0
        rows.clock[0], rows.variance[0] = 0.0, events.variance_m2[event]
        rows.innovation[0] = events.value_m[event] - (-reading[2] - x[fleet.height[who]])
        return 1
    line = rows.line[0]
    for axis in range(3):
        line[axis] = events.arm_m[event, axis] + reading[axis] - source_m[axis]
        for j in range(n):
            line[axis] += derivative[axis, j] * x[j]
    distance = np.sqrt(line[0] ** 2 + line[1] ** 2 + line[2] ** 2)
    if distance < NEAREST_M:
        return 0
    _range_row(fleet, events, event, x, derivative, line, source_m, source_clock_m, about_m, is_about, rows)
    return 1


@in_place
def _range_row(
    fleet: Fleet,
    events: Events,
    event: int,
    x: FloatArray,
    derivative: FloatArray,
    line: FloatArray,
    source_m: FloatArray,
    source_clock_m: float,
    about_m: FloatArray,
    is_about: bool,
    rows: LinearisedEvent,
) -> None:
    who, kind = events.receiver[event], events.kind[event]
    direction = rows.line[1]
    distance = np.sqrt(line[0] ** 2 + line[1] ** 2 + line[2] ** 2)
    for axis in range(3):
        direction[axis] = line[axis] / distance
    if is_about:
        distance = np.sqrt(about_m[0] ** 2 + about_m[1] ** 2 + about_m[2] ** 2)
        for axis in range(3):
            direction[axis] = about_m[axis] / distance
        for axis in range(3):
            distance += direction[axis] * (line[axis] - about_m[axis])
    if kind == SATELLITE:
        distance = _while_the_earth_turns(line, source_m, distance, direction, rows.line[2])
    predicted = distance
    for j in range(fleet.size[who]):
        rows.receiver[0, j] = (
            direction[0] * derivative[0, j] + direction[1] * derivative[1, j] + direction[2] * derivative[2, j]
        )
    rows.clock[0] = 0.0
    clock, bias = fleet.receiver_clock[who] if kind == SATELLITE else fleet.clock[who], fleet.bias[who]
    if clock >= 0 and not events.is_two_way[event]:
        predicted += x[clock] - source_clock_m
        rows.receiver[0, clock] += 1.0
        rows.clock[0] = 0.0 if kind in (POINT, SATELLITE) else -1.0
    if bias >= 0 and kind != SATELLITE:
        predicted += x[bias]
        rows.receiver[0, bias] += 1.0
    for axis in range(3):
        rows.place[0, axis] = -direction[axis]
    rows.innovation[0], rows.variance[0] = events.value_m[event] - predicted, events.variance_m2[event]


@in_place
def _while_the_earth_turns(
    line: FloatArray, source_m: FloatArray, distance: float, direction: FloatArray, seen: FloatArray
) -> float:
    """Return the distance from a satellite's place at emission, and fill the direction.

    Both are in the ECEF axes of the instant of reception.
    """
    for _ in range(3):  # each gains six digits
        turn = EARTH_RATE_RADPS * distance / LIGHT_MPS
        cosine, sine = np.cos(turn), np.sin(turn)
        seen[0] = line[0] + source_m[0] - (cosine * source_m[0] + sine * source_m[1])
        seen[1] = line[1] + source_m[1] - (cosine * source_m[1] - sine * source_m[0])
        seen[2] = line[2]
        distance = np.sqrt(seen[0] ** 2 + seen[1] ** 2 + seen[2] ** 2)
    for axis in range(3):
        direction[axis] = seen[axis] / distance
    return distance
