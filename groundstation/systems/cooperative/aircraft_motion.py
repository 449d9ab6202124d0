"""Motion of an aircraft's error states, and places of its antenna, over many times.

Two models, both linear: in a local frame (7 states) and in the global one (13 or 15). A transition between two times is
made once and kept: all filters of a session ask for the same ones.

Source: Titterton and Weston, Strapdown Inertial Navigation Technology, 2nd ed. 2004, section 12.3 (dynamics of the
thirteen states); Van Loan, Computing integrals involving the matrix exponential, IEEE Transactions on Automatic Control
23(3), 1978 (noise of a step).
"""

from itertools import pairwise
from typing import NamedTuple, Protocol

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.geodesy import EARTH_RATE_RADPS
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
    ModelNumbers,
)

TERMS, SMALLEST = 40, 1e-16  # of the series of a step; the largest entry of a transition is 1 or more
SAME_TIME_S, SAME_STEP_S = 1e-9, 1e-12
FEWEST_TERMS, SPAN_S = 4, 1.0  # of a series; steps for which it is made
AT_ONCE = 64  # epochs whose series are made together
MOST_KEPT = 500_000  # numbers of the transitions that are kept of one aircraft


class FlownAircraft(Protocol):
    """Numbers of an aircraft that its motion needs; ``aircraft.Aircraft`` has them."""

    @property
    def model(self) -> int:
        """LOCAL or GLOBAL."""

    @property
    def size(self) -> int:
        """Number of states."""

    @property
    def epochs(self) -> FloatArray:
        """Table of its dead reckoning."""

    @property
    def density(self) -> FloatArray:
        """White noise on each state."""

    @property
    def numbers(self) -> ModelNumbers:
        """Correlation times."""

    @property
    def clock(self) -> int:
        """Index of the clock offset of the link."""

    @property
    def receiver_clock(self) -> int:
        """Index of the clock offset of the satellite receiver."""

    @property
    def bias(self) -> int:
        """Index of the range bias."""

    @property
    def height(self) -> int:
        """Index of the error of height."""

    def at(self, state: str) -> int:
        """Index of a state, -1 without it."""


def dynamics(vehicle: FlownAircraft) -> FloatArray:
    """Return the dynamics of an aircraft's errors at each epoch, (t, n, n).

    Epochs are those of its dead reckoning. In a local frame the dynamics are the same at all, and given once: x, y, vx,
    vy, height, clock offset, clock frequency. Global: position error north, east (m), velocity error north, east (m/s),
    platform angles about north, east, down (rad), drifts about the same (rad/s), height, clock offset (m), clock
    frequency (m/s). The angles have the sign with which the computed attitude is (I - [angle x]) times the true one; a
    positive drift makes its angle fall.
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
    # error of Earth and transport rate per metre north and per metre a second
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


class Powers(NamedTuple):
    """Terms of the series of steps of dx/dt = F x + w, each up to ``span_s`` long.

    They are those of some epochs. Phi = sum (F h)^k / k!; Q = sum L_k h^(k+1) / (k+1)! with L_0 = diag(q),
    L_(k+1) = F L_k + L_k F'.
    """

    first: int  # epoch
    transition: FloatArray  # (epochs, terms, n n)
    noise: FloatArray  # the same
    exponents: FloatArray  # (terms,) 0, 1, ...
    span_s: float

    @classmethod
    def of(cls, first: int, F: FloatArray, density: FloatArray, span_s: float) -> "Powers":
        """Sum no further than a step of ``span_s`` needs; F (epochs, n, n)."""
        term, level = np.broadcast_to(np.eye(len(density)), F.shape), np.broadcast_to(np.diag(density), F.shape)
        terms, levels = [term], [level]
        for k in range(1, TERMS):
            term, moved = F @ term / k, F @ level
            level = (moved + moved.swapaxes(1, 2)) / (k + 1)
            terms.append(term)
            levels.append(level)
            if k >= FEWEST_TERMS and float(np.abs(term).max()) * span_s**k < SMALLEST:
                break
        shape = (len(F), len(terms), -1)
        exponents = np.arange(float(len(terms)))
        return cls(first, np.stack(terms, 1).reshape(shape), np.stack(levels, 1).reshape(shape), exponents, span_s)

    def step(self, epoch: int, n: int, step_s: float) -> tuple[FloatArray, FloatArray]:
        """Transition and covariance of the noise; the latter means nothing for a step back."""
        powers, at = step_s**self.exponents, epoch - self.first
        return (powers @ self.transition[at]).reshape(n, n), (powers * step_s @ self.noise[at]).reshape(n, n)


class AircraftMotion:
    """Transitions of one aircraft between any two times."""

    def __init__(self, vehicle: FlownAircraft) -> None:
        self._vehicle, self._dynamics = vehicle, dynamics(vehicle)
        self._time_s: list[float] = vehicle.epochs[:, TIME].tolist()
        self._times = vehicle.epochs[:, TIME]
        self._powers: Powers | None = None
        self._kept: dict[tuple[float, float], tuple[FloatArray, FloatArray]] = {}
        self._is_local = vehicle.model == LOCAL

    def step(self, from_s: float, to_s: float) -> tuple[FloatArray, FloatArray]:
        """Transition and covariance of the noise, read-only; back in time the noise means nothing."""
        key = (0.0, round(to_s - from_s, 12)) if self._is_local else (from_s, to_s)
        found = self._kept.get(key)
        if found is None:
            found = self._short(0, to_s - from_s) if self._is_local else self._over_epochs(from_s, to_s)
            for part in found:
                part.flags.writeable = False
            if len(self._kept) * found[0].size >= MOST_KEPT:
                self._kept.clear()
            self._kept[key] = found
        return found

    def _short(self, epoch: int, step_s: float) -> tuple[FloatArray, FloatArray]:
        """Step with the dynamics of one epoch."""
        powers, length = self._powers, abs(step_s)
        if powers is None or length > powers.span_s or not powers.first <= epoch < powers.first + len(powers.noise):
            first = epoch - epoch % AT_ONCE
            part = self._dynamics[first : first + AT_ONCE]
            powers = self._powers = Powers.of(first, part, self._vehicle.density, max(length, SPAN_S))
        return powers.step(epoch, self._vehicle.size, step_s)

    def _over_epochs(self, from_s: float, to_s: float) -> tuple[FloatArray, FloatArray]:
        """Step in the global frame, piece by piece between the epochs of the dead reckoning."""
        times, count = self._times, len(self._time_s)
        first = int(times.searchsorted(from_s + SAME_TIME_S, side="right"))
        last = max(int(times.searchsorted(to_s)), first)
        edges = [from_s, *self._time_s[first:last], to_s]
        found: tuple[FloatArray, FloatArray] | None = None
        for one, two in pairwise(edges):
            epoch = min(max(int(times.searchsorted(0.5 * (one + two))) - 1, 0), max(count - 2, 0))
            phi, noise = self._short(epoch, two - one)
            found = (phi, noise) if found is None else (phi @ found[0], phi @ found[1] @ phi.T + noise)
        assert found is not None
        return found


class Places(NamedTuple):
    """Antenna at some times: place = reading + derivative x, by the states ``states`` alone."""

    reading: FloatArray  # (m, 3) as dead reckoning has it
    derivative: FloatArray  # (m, 3, s)
    states: tuple[int, ...]


def places(vehicle: FlownAircraft, at_s: FloatArray) -> Places:
    """Return where the antenna is at some times.

    Between two epochs the place is cubic through both positions and velocities.
    """
    epochs, m = vehicle.epochs, len(at_s)
    nearest, reading = np.zeros(m, dtype=np.int64), np.tile(epochs[0, PLACE : PLACE + 3], (m, 1))
    if len(epochs) > 1:
        after = np.clip(np.searchsorted(epochs[:, TIME], at_s), 1, len(epochs) - 1)
        before = after - 1
        span = (epochs[after, TIME] - epochs[before, TIME])[:, None]
        part = (at_s - epochs[before, TIME])[:, None] / span
        nearest = np.where(part[:, 0] < 0.5, before, after)
        a, b = part * part * (3.0 - 2.0 * part), part * (1.0 - part)
        one, two = epochs[before, PLACE : PLACE + 3], epochs[after, PLACE : PLACE + 3]
        leaving, coming = epochs[before, RATE : RATE + 3] * span, epochs[after, RATE : RATE + 3] * span
        reading = one + a * (two - one) + b * ((1.0 - part) * leaving - part * coming)
    axes = epochs[nearest, AXES : AXES + 9].reshape(m, 3, 3)
    columns, states = [-axes[:, :, 0], -axes[:, :, 1], axes[:, :, 2]], [0, 1, vehicle.height]
    if (lever := vehicle.at("lever_forward_m")) >= 0:
        heading = epochs[nearest, HEADING][:, None]
        cosine, sine = np.cos(heading), np.sin(heading)
        columns += [cosine * axes[:, :, 0] + sine * axes[:, :, 1], cosine * axes[:, :, 1] - sine * axes[:, :, 0]]
        states += [lever, lever + 1]
    return Places(reading, np.stack(columns, axis=2), tuple(states))
