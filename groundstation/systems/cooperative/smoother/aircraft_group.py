"""Aircraft of a session as a group: linear motion of their errors, in arrays.

Dynamics, transitions and places are those of ``motion.py``, written for many times at once; a test compares them.
Between two knots the dynamics are the mean over the epochs of the dead reckoning there.

Source: as of ``motion.py``; Van Loan, Computing integrals involving the matrix exponential, 1978 (noise of a step).
"""

from collections.abc import Sequence

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.geodesy import EARTH_RATE_RADPS
from groundstation.base.records import Int64Array
from groundstation.systems.cooperative.aircraft import Aircraft
from groundstation.systems.cooperative.loop_types import (
    AXES,
    FORCE,
    HEADING,
    LATITUDE,
    LOCAL,
    MERIDIAN,
    NORMAL,
    PLACE,
    RATE,
    TIME,
    VELOCITY,
)
from groundstation.systems.cooperative.smoother.sight import Motion, RangeErrors, Sight

TERMS = 14  # of the series of a step; a step of 5 s needs ten
AT_ONCE = 20_000  # ends worked on together


def dynamics(vehicle: Aircraft) -> FloatArray:
    """Return the dynamics of an aircraft's errors at each epoch, (t, n, n).

    In a local frame they are the same at all, and given once.
    """
    numbers, n = vehicle.numbers, vehicle.size
    flown = vehicle.epochs if vehicle.model != LOCAL else vehicle.epochs[:1]
    F = np.zeros((len(flown), n, n))
    F[:, 0, 2] = F[:, 1, 3] = 1.0
    if vehicle.model == LOCAL:
        F[:, 2, 2] = F[:, 3, 3] = -1.0 / numbers.velocity_s
    else:
        _fill_platform(flown, numbers.gyro_s, F)
    F[:, vehicle.height, vehicle.height] = -1.0 / numbers.baro_s
    for clock in (vehicle.clock, vehicle.receiver_clock):
        F[:, clock, clock + 1] = 1.0
        F[:, clock + 1, clock + 1] = -1.0 / numbers.clock_s
    if vehicle.bias >= 0:
        F[:, vehicle.bias, vehicle.bias] = -1.0 / numbers.bias_s
    return F


def _fill_platform(flown: FloatArray, gyro_s: float, F: FloatArray) -> None:
    """Rows of position, velocity, platform angles and drifts in the global frame."""
    earth, meridian, normal = EARTH_RATE_RADPS, flown[:, MERIDIAN], flown[:, NORMAL]
    sine, cosine = np.sin(flown[:, LATITUDE]), np.cos(flown[:, LATITUDE])
    tangent = sine / cosine
    north, east, down = flown[:, VELOCITY : VELOCITY + 3].T
    f_n, f_e, f_d = flown[:, FORCE : FORCE + 3].T
    w_n = earth * cosine + east / normal
    w_e = -north / meridian
    w_d = -earth * sine - east * tangent / normal
    ie_n, ie_d = -earth * sine / meridian, -earth * cosine / meridian
    en_d = -east / (normal * cosine * cosine) / meridian
    F[:, 1, 0] = east * tangent / meridian
    F[:, 1, 1] = -tangent * north / meridian
    coriolis_d = w_d - earth * sine
    F[:, 2, 5], F[:, 2, 6], F[:, 2, 3] = -f_d, f_e, coriolis_d - tangent / normal * east
    F[:, 2, 2] = down / meridian
    F[:, 2, 0] = (2.0 * ie_d + en_d) * east
    F[:, 3, 4], F[:, 3, 6] = f_d, -f_n
    F[:, 3, 2] = -coriolis_d
    F[:, 3, 3] = down / normal + tangent / normal * north
    F[:, 3, 0] = -(2.0 * ie_d + en_d) * north + 2.0 * ie_n * down
    F[:, 4, 6], F[:, 4, 5] = -w_e, w_d
    F[:, 4, 0], F[:, 4, 3], F[:, 4, 7] = ie_n, 1.0 / normal, -1.0
    F[:, 5, 4], F[:, 5, 6] = -w_d, w_n
    F[:, 5, 2], F[:, 5, 8] = -1.0 / meridian, -1.0
    F[:, 6, 5], F[:, 6, 4] = -w_n, w_e
    F[:, 6, 0], F[:, 6, 3], F[:, 6, 9] = ie_d + en_d, -tangent / normal, -1.0
    F[:, 7, 7] = F[:, 8, 8] = F[:, 9, 9] = -1.0 / gyro_s


def transitions(F: FloatArray, density: FloatArray, step_s: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return transitions and noise of many steps; F (m, n, n), step_s (m,)."""
    n, step = F.shape[1], step_s[:, None, None]
    phi = np.broadcast_to(np.eye(n), F.shape).copy()
    level = np.broadcast_to(np.diag(density), F.shape)
    noise, term, factor = level * step, phi.copy(), step
    for k in range(1, TERMS):
        term = (F @ term) * (step / k)
        phi += term
        moved = F @ level
        level = moved + moved.swapaxes(1, 2)
        factor = factor * step / (k + 1)
        noise += level * factor
    return phi, np.where(step >= 0.0, noise, 0.0)


class _Dynamics:
    """Mean dynamics of one aircraft between any two times."""

    def __init__(self, vehicle: Aircraft) -> None:
        self._F = dynamics(vehicle)
        self._time_s = vehicle.epochs[:, TIME]
        if len(self._F) > 1:  # dynamics of an epoch hold until the next
            span = np.diff(self._time_s)[:, None, None]
            self._whole = np.concatenate([np.zeros_like(self._F[:1]), np.cumsum(self._F[:-1] * span, axis=0)])

    def mean(self, one_s: FloatArray, two_s: FloatArray) -> FloatArray:
        """Return the mean between times, (m, n, n); that of the instant where both are one."""
        if len(self._F) == 1:
            return np.broadcast_to(self._F, (len(one_s), *self._F.shape[1:]))
        span = two_s - one_s
        is_short = np.abs(span) < 1e-6
        at = np.clip(np.searchsorted(self._time_s, one_s, side="right") - 1, 0, len(self._time_s) - 2)
        mean = (self._until(two_s) - self._until(one_s)) / np.where(is_short, 1.0, span)[:, None, None]
        return np.where(is_short[:, None, None], self._F[at], mean)

    def _until(self, at_s: FloatArray) -> FloatArray:
        at = np.clip(np.searchsorted(self._time_s, at_s, side="right") - 1, 0, len(self._time_s) - 2)
        return np.asarray(self._whole[at] + self._F[at] * (at_s - self._time_s[at])[:, None, None])


class AircraftGroup:
    """Aircraft with the same states."""

    def __init__(self, vehicles: Sequence[Aircraft]) -> None:
        self._vehicles = tuple(vehicles)
        self._dynamics = [_Dynamics(vehicle) for vehicle in vehicles]
        self.size, self.count = vehicles[0].size, len(vehicles)
        self._own_s, self._phi, self._noise = np.zeros((0, 0)), np.zeros(0), np.zeros(0)

    def start(self) -> tuple[FloatArray, FloatArray]:
        """Return states and their variances at the start, (v, n) each."""
        sigma = np.array([vehicle.start_sigma for vehicle in self._vehicles])
        return np.zeros_like(sigma), sigma**2

    def set_knots(self, own_s: FloatArray) -> None:
        """Take the times of the knots (t, v); all motion between them is known from here on."""
        t, v, n = len(own_s) - 1, self.count, self.size
        self._own_s = own_s
        self._phi, self._noise = np.empty((t, v, n, n)), np.empty((t, v, n, n))
        for who, vehicle in enumerate(self._vehicles):
            one, two = own_s[:-1, who], own_s[1:, who]
            step = two - one
            if vehicle.model == LOCAL:  # few steps differ
                unique, inverse = np.unique(np.round(step, 9), return_inverse=True)
                F = self._dynamics[who].mean(unique, unique)
                phi, noise = transitions(F, vehicle.density, unique)
                self._phi[:, who], self._noise[:, who] = phi[inverse], noise[inverse]
            else:
                F = self._dynamics[who].mean(one, two)
                self._phi[:, who], self._noise[:, who] = transitions(F, vehicle.density, step)

    def move(self, x: FloatArray, first: int, last: int) -> Motion:
        """Move states (l, v, n) from the knots first to last - 1 to those behind them."""
        phi = self._phi[first:last]
        return (phi @ x[..., None])[..., 0], phi, self._noise[first:last]

    def ends(self, who: Int64Array, time_s: FloatArray, knot: Int64Array) -> "AircraftEnds":
        """Return ends at aircraft of this group at some times, each seen from a knot."""
        return AircraftEnds(self._vehicles, self._dynamics, who, time_s, self._own_s[knot, who])

    def states_at(
        self, who: int, time_s: FloatArray, knot: Int64Array, x: FloatArray, P: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return positions (m, 3), states and covariances of one aircraft at some times."""
        vehicle, own_s = self._vehicles[who], self._own_s[knot, who]
        phi, noise = transitions(self._dynamics[who].mean(own_s, time_s), vehicle.density, time_s - own_s)
        state = (phi @ x[..., None])[..., 0]
        reading_m, derivative, _ = _places(vehicle, time_s)
        position_m = reading_m + (derivative @ state[..., None])[..., 0]
        return position_m, state, phi @ P @ phi.swapaxes(1, 2) + 0.25 * noise


class AircraftEnds:
    """Ends of measurements at aircraft: all is linear, and known once."""

    lag = -1

    def __init__(
        self,
        vehicles: Sequence[Aircraft],
        dynamics_of: Sequence[_Dynamics],
        who: Int64Array,
        time_s: FloatArray,
        own_s: FloatArray,
    ) -> None:
        first, m, n = vehicles[0], len(who), vehicles[0].size
        self.level_m = np.empty(m)
        self._reading_m, self._velocity_mps, self._by_state = np.empty((m, 3)), np.empty((m, 3)), np.zeros((m, 3, n))
        self.clock, self.receiver_clock, self.height = np.zeros((m, n)), np.zeros((m, n)), np.zeros((m, n))
        self._bias = np.zeros((m, n)) if first.bias >= 0 else None
        rows = [0, 1, first.height, first.clock, first.receiver_clock]
        rows += [row for row in (first.bias,) if row >= 0]
        for index, vehicle in enumerate(vehicles):
            every = np.flatnonzero(who == index)
            for mine in np.array_split(every, max(1, -(-len(every) // AT_ONCE))):
                if len(mine):
                    reach = _rows_of_steps(
                        dynamics_of[index].mean(own_s[mine], time_s[mine]), time_s[mine] - own_s[mine], rows
                    )
                    reading, derivative, velocity = _places(vehicle, time_s[mine])
                    self._reading_m[mine], self._velocity_mps[mine] = reading, velocity
                    for at in (0, 1, 2):
                        self._by_state[mine] += derivative[:, :, rows[at], None] * reach[:, at, None, :]
                    if vehicle.at("lever_forward_m") >= 0:
                        lever = slice(vehicle.at("lever_forward_m"), vehicle.at("lever_forward_m") + 2)
                        self._by_state[mine, :, lever] = derivative[:, :, lever]
                    self.level_m[mine] = -reading[:, 2]
                    self.height[mine], self.clock[mine], self.receiver_clock[mine] = (
                        reach[:, 2],
                        reach[:, 3],
                        reach[:, 4],
                    )
                    if self._bias is not None:
                        self._bias[mine] = reach[:, 5]

    def sight(self, x: FloatArray, rows: slice, late_s: FloatArray | None) -> Sight:
        """See from the states (m, n) of some of the ends, ``late_s`` before their stamps."""
        by_state, velocity = self._by_state[rows], self._velocity_mps[rows]
        place = self._reading_m[rows] + (by_state @ x[..., None])[..., 0]
        return Sight(place if late_s is None else place - late_s[:, None] * velocity, by_state, velocity)

    def errors(self, x: FloatArray, rows: slice, is_peer: FloatArray) -> RangeErrors:
        """Return what the receivers add to their ranges: a bias, where it is a state."""
        m = len(x)
        if self._bias is None:
            return RangeErrors(np.zeros(m), np.zeros_like(x), np.zeros(m), -1)
        bias = self._bias[rows]
        return RangeErrors((bias * x).sum(axis=1), bias, np.zeros(m), -1)


def _rows_of_steps(F: FloatArray, step_s: FloatArray, rows: Sequence[int]) -> FloatArray:
    """Return some rows of the transitions of short steps, (m, r, n)."""
    term = np.broadcast_to(np.eye(F.shape[1])[list(rows)], (len(F), len(rows), F.shape[1]))
    whole = term.copy()
    for k in range(1, 7):
        term = (term @ F) * (step_s / k)[:, None, None]
        whole += term
    return whole


def _places(vehicle: Aircraft, at_s: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the antenna's place as read, its derivative and its velocity.

    Shapes (m, 3), (m, 3, n), (m, 3).     Between two epochs the place is cubic through both positions and velocities.
    """
    epochs, m, n = vehicle.epochs, len(at_s), vehicle.size
    nearest = np.zeros(m, dtype=np.int64)
    reading, velocity = np.tile(epochs[0, PLACE : PLACE + 3], (m, 1)), np.tile(epochs[0, RATE : RATE + 3], (m, 1))
    if len(epochs) > 1:
        after = np.clip(np.searchsorted(epochs[:, TIME], at_s), 1, len(epochs) - 1)
        before = after - 1
        span = (epochs[after, TIME] - epochs[before, TIME])[:, None]
        part = (at_s - epochs[before, TIME])[:, None] / span
        nearest = np.where(part[:, 0] < 0.5, before, after)
        a, b = part * part * (3.0 - 2.0 * part), part * (1.0 - part)
        one, two = epochs[before, PLACE : PLACE + 3], epochs[after, PLACE : PLACE + 3]
        velocity = (1.0 - part) * epochs[before, RATE : RATE + 3] + part * epochs[after, RATE : RATE + 3]
        leaving, coming = epochs[before, RATE : RATE + 3] * span, epochs[after, RATE : RATE + 3] * span
        reading = one + a * (two - one) + b * ((1.0 - part) * leaving - part * coming)
    axes = epochs[nearest, AXES : AXES + 9].reshape(m, 3, 3)
    derivative = np.zeros((m, 3, n))
    derivative[:, :, 0], derivative[:, :, 1], derivative[:, :, vehicle.height] = (
        -axes[:, :, 0],
        -axes[:, :, 1],
        axes[:, :, 2],
    )
    lever = vehicle.at("lever_forward_m")
    if lever >= 0:
        cosine, sine = np.cos(epochs[nearest, HEADING])[:, None], np.sin(epochs[nearest, HEADING])[:, None]
        derivative[:, :, lever] = cosine * axes[:, :, 0] + sine * axes[:, :, 1]
        derivative[:, :, lever + 1] = cosine * axes[:, :, 1] - sine * axes[:, :, 0]
    return reading, derivative, velocity
