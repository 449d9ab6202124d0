"""Aircraft of a session as a group: linear motion of their errors, in arrays.

Dynamics and places are those of ``aircraft_motion.py``; a test compares the steps. Between two knots the dynamics are
the mean over the epochs of the dead reckoning there.

Source: Van Loan, Computing integrals involving the matrix exponential, 1978 (noise of a step).
"""

from collections.abc import Sequence

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.records import Int64Array
from groundstation.systems.cooperative.aircraft import Aircraft
from groundstation.systems.cooperative.aircraft_motion import dynamics, places
from groundstation.systems.cooperative.loop_types import LOCAL, RATE, TIME
from groundstation.systems.cooperative.smoother.sight import Motion, OutputStates, RangeErrors, Sight

TERMS = 14  # of the series of a step; a step of 5 s needs ten
AT_ONCE = 20_000  # ends worked on together


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

    def states_at(self, who: int, time_s: FloatArray, knot: Int64Array, x: FloatArray, P: FloatArray) -> OutputStates:
        """Return positions, states and covariances of one aircraft at some times."""
        vehicle, own_s = self._vehicles[who], self._own_s[knot, who]
        phi, noise = transitions(self._dynamics[who].mean(own_s, time_s), vehicle.density, time_s - own_s)
        state = (phi @ x[..., None])[..., 0]
        seen = places(vehicle, time_s)
        position_m = seen.reading + (seen.derivative @ state[:, list(seen.states), None])[..., 0]
        return OutputStates(position_m, state, phi @ P @ phi.swapaxes(1, 2) + 0.25 * noise, phi)


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
                    seen = places(vehicle, time_s[mine])
                    self._reading_m[mine], self._velocity_mps[mine] = seen.reading, _velocities(vehicle, time_s[mine])
                    self._by_state[mine] = seen.derivative[:, :, :3] @ reach[:, :3]
                    if len(seen.states) > 3:
                        self._by_state[mine[:, None], :, list(seen.states[3:])] = seen.derivative[:, :, 3:].swapaxes(
                            1, 2
                        )
                    self.level_m[mine] = -seen.reading[:, 2]
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


def _velocities(vehicle: Aircraft, at_s: FloatArray) -> FloatArray:
    """Return velocities in the frame of the session, (m, 3)."""
    epochs = vehicle.epochs
    return np.stack([np.interp(at_s, epochs[:, TIME], epochs[:, RATE + axis]) for axis in range(3)], axis=1)
