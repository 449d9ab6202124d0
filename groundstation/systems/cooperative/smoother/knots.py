"""Knots of the smoother: the times at which the joint state stands.

Readings and outputs that are close together share a knot; they see its state through the motion from there, as if that
were exact over so short a time. How close is close follows from the noise of the motion and that of the readings.
"""

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.dataclasses import dataclass
from groundstation.base.nearest import nearest_rows
from groundstation.base.records import Int64Array
from groundstation.systems.cooperative.aircraft import Aircraft
from groundstation.systems.cooperative.aircraft_motion import dynamics
from groundstation.systems.cooperative.events import Prepared
from groundstation.systems.cooperative.loop_types import HEIGHT, PEER
from groundstation.systems.cooperative.settings import CooperativeSettings
from groundstation.systems.cooperative.smoother.aircraft_group import transitions
from groundstation.systems.cooperative.timeline import timeline

NEGLECTED = 0.02  # largest share of a reading's variance that the motion to its knot adds
STEPS_S = 5.0, 2.0, 1.0, 0.5, 0.2, 0.1, 0.05, 0.02, 0.01  # of knots, the longest that will do
LONGEST_STEP_S = 5.0
SAME_TIME_S = 1e-9


@dataclass(frozen=True)
class Knots:
    """Times of the knots, and what belongs to each.

    Parameters
    ----------
    time_s : ndarray, shape (t,)
    own_s : ndarray, shape (t, v)
        Time at which each vehicle's states stand: that of the knot, within the time it is there.
    event : ndarray of int, shape (m,)
        Measurements in the order of their knots.
    knot : ndarray of int, shape (m,)
        Knot of each of these.
    output_s, output_vehicle, output_knot : ndarrays, shape (o,)
    """

    time_s: FloatArray
    own_s: FloatArray
    event: Int64Array
    knot: Int64Array
    output_s: FloatArray
    output_vehicle: Int64Array
    output_knot: Int64Array

    def nearest(self, at_s: FloatArray) -> Int64Array:
        """Return the knot nearest to each time."""
        return nearest_rows(self.time_s, at_s, takes_later=True)


def knots_of(prepared: Prepared, settings: CooperativeSettings) -> Knots:
    """Choose the knots of a session."""
    events = prepared.events
    items = timeline(prepared, settings, together=False)
    is_output = items.vehicle >= 0
    output_s, output_vehicle = items.time_s[is_output], items.vehicle[is_output]
    spans = np.array([(vehicle.first_s, vehicle.last_s) for vehicle in prepared.vehicles])
    wanted = np.sort(np.concatenate([events.time_s, output_s]))
    time_s = _clustered(wanted, longest_step_s(prepared), float(spans[:, 0].min()))
    knot = nearest_rows(time_s, events.time_s, takes_later=True)
    order = np.argsort(knot, kind="stable")
    return Knots(
        time_s,
        np.clip(time_s[:, None], spans[:, 0], spans[:, 1]),
        order,
        knot[order],
        output_s,
        output_vehicle,
        nearest_rows(time_s, output_s, takes_later=True),
    )


def longest_step_s(prepared: Prepared) -> float:
    """Return the longest step of the knots that will do.

    The motion's noise over half of it is to count for nothing against the smallest variance of a range and of a
    bearing.
    """
    events = prepared.events
    link = (events.kind == PEER) | (events.kind != HEIGHT)
    variance = events.variance_m2[link & np.isfinite(events.value_m)]
    least_m2 = float(variance.min(initial=np.inf))
    bearing = events.bearing_variance_rad2[np.isfinite(events.bearing_rad)]
    least_rad2 = float(bearing.min(initial=np.inf))
    found = STEPS_S[0]
    for vehicle in prepared.vehicles:
        for step_s in STEPS_S:
            found = min(found, step_s)
            along_m2, turn_rad2 = _noise_of(vehicle, 0.5 * found)
            if along_m2 <= NEGLECTED * least_m2 and turn_rad2 <= NEGLECTED * least_rad2:
                break
    return found


def _noise_of(vehicle: object, step_s: float) -> tuple[float, float]:
    """Return the largest variances that a step adds to a range and to a heading."""
    if isinstance(vehicle, Aircraft):
        _, noise = transitions(dynamics(vehicle)[:1], vehicle.density, np.array([step_s]))
        into = np.diag(noise[0])[[0, 1, vehicle.height, vehicle.clock]]
        bias = noise[0, vehicle.bias, vehicle.bias] if vehicle.bias >= 0 else 0.0
        return float(into.max() + bias), 0.0
    return np.inf, np.inf  # odometry is so noisy that every reading stands at a knot of its own


def _clustered(wanted_s: FloatArray, step_s: float, first_s: float) -> FloatArray:
    """Return knots that are near to all wanted times, and not too far apart."""
    knots = [first_s]
    at, half = 0, max(0.5 * step_s, SAME_TIME_S)
    while at < len(wanted_s):
        last = int(np.searchsorted(wanted_s, wanted_s[at] + 2.0 * half, side="right")) - 1
        middle = 0.5 * float(wanted_s[at] + wanted_s[last])
        gap_s = middle - knots[-1]
        if gap_s > LONGEST_STEP_S + step_s:
            knots += np.linspace(knots[-1], middle, int(np.ceil(gap_s / LONGEST_STEP_S)) + 1)[1:].tolist()
        elif gap_s > SAME_TIME_S:
            knots.append(middle)
        at = last + 1
    return np.array(knots)
