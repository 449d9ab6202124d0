"""Error states of one vehicle: start, transition, and where its antenna is.

Two kinds share one interface. An aircraft's state is the error of its INS, barometer and clocks, counted off its dead
reckoning: corrected = reading - estimated error. A wheeled vehicle's state is its place and heading themselves
(wheeled_vehicle.py).
"""

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import Protocol

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.geodesy import EARTH_RATE_RADPS, curvature_radii_m
from groundstation.estimators.cooperative.settings import CooperativeSettings
from groundstation.estimators.cooperative.transition import discretise, global_dynamics, local_dynamics
from groundstation.tables.session import DeadReckoning, Frame

RAD_PER_ARCSEC = float(np.deg2rad(1.0 / 3600.0))
GRAVITY_MPS2 = 9.7803253359, 0.00193185265241, 0.00669437999  # Somigliana, WGS-84 (NIMA TR8350.2)
SAME_TIME_S = 1e-9
LEAP_M = 1e5  # of a clock
Step = tuple[FloatArray, FloatArray, FloatArray]


@dataclass(frozen=True, slots=True)
class View:
    """Where the sensor of a vehicle was and looked when it took a measurement.

    Parameters
    ----------
    place_m : ndarray, shape (3,)
        Frame of the session.
    derivative : ndarray, shape (3, n)
        By the state.
    heading_rad : float
        Of the sensor; NaN for one that takes no bearings.
    by_heading : ndarray, shape (n,)
        Derivative of the heading by the state.
    """

    place_m: FloatArray
    derivative: FloatArray
    heading_rad: float
    by_heading: FloatArray


class Vehicle(Protocol):
    """One vehicle as the filters see it.

    ``clock`` and ``receiver_clock`` are places of the clock offsets in the state, ``bias`` that of the range bias,
    ``heading`` that of the heading in radians; -1 where there is no such state. ``height`` likewise. ``doubts``
    are the states that are opened when nothing fits any more, each with the variance that it then gets on top.
    """

    name: str
    states: tuple[str, ...]
    clock: int
    receiver_clock: int
    bias: int
    heading: int
    height: int
    doubts: Mapping[int, float]
    first_s: float
    last_s: float

    @property
    def size(self) -> int:
        """Number of states."""

    def start(self) -> tuple[FloatArray, FloatArray]:
        """State and covariance at ``first_s``."""

    def step(self, x: FloatArray, from_s: float, to_s: float) -> Step:
        """State after a step, its transition matrix and the covariance of the noise."""

    def place(self, x: FloatArray, at_s: float) -> tuple[FloatArray, FloatArray]:
        """Position of the antenna in the frame of the session, and its derivative by the state, shape (3, n)."""

    def view(self, x: FloatArray, at_s: float) -> View:
        """Place and heading of the sensor of a measurement stamped ``at_s``."""

    def range_error(self, x: FloatArray, distance_m: float, *, is_peer: bool) -> tuple[float, FloatArray, float]:
        """Error of a range to a peer or point, its derivative by the state, shape (n,), and by the distance."""

    def height_m(self, at_s: float) -> float:
        """Height as dead reckoning has it."""


class InertialVehicle:
    """An aircraft with INS, barometric altimeter and clock: 7 states in a local frame, 13 or 15 in the global one."""

    heading: int = -1

    def __init__(self, track: DeadReckoning, frame: Frame, settings: CooperativeSettings) -> None:
        self.name, self._track, self._frame, self._settings = track.name, track, frame, settings
        self.first_s, self.last_s = float(track.time_s[0]), float(track.time_s[-1])
        belief = settings.ins
        self.states: tuple[str, ...] = ("north_m", "east_m", "velocity_north_mps", "velocity_east_mps")
        if frame == "ecef":
            self.states += _PLATFORM
        self.height = len(self.states)
        self.clock = self.receiver_clock = self.height + 1
        self.states += ("height_m", "clock_m", "clock_mps")
        if belief.has_separate_clocks:
            self.receiver_clock = len(self.states)
            self.states += ("receiver_clock_m", "receiver_clock_mps")
        self.doubts: Mapping[int, float] = {self.clock: LEAP_M**2, self.receiver_clock: LEAP_M**2}
        self.bias, self._lever = -1, -1
        if settings.range_bias_m > 0.0:
            self.bias = len(self.states)
            self.states += ("range_bias_m",)
        if settings.lever_arm_m > 0.0:
            self._lever = len(self.states)
            self.states += ("lever_forward_m", "lever_right_m")
        self._steps: dict[tuple[float, float], tuple[FloatArray, FloatArray]] = {}
        self._places: dict[float, tuple[FloatArray, FloatArray]] = {}
        self._dynamics_at: dict[int, FloatArray] = {}
        self._density = self._noise_density()

    @property
    def size(self) -> int:
        """Number of states."""
        return len(self.states)

    def start(self) -> tuple[FloatArray, FloatArray]:
        """No error known, with the sigmas of the belief."""
        b = self._settings.ins
        sigma = [b.position_m, b.position_m, b.velocity_mps, b.velocity_mps]
        if self._frame == "ecef":
            tilt, azimuth = b.tilt_arcsec * RAD_PER_ARCSEC, 60.0 * b.azimuth_arcmin * RAD_PER_ARCSEC
            sigma += [tilt, tilt, azimuth] + 3 * [b.gyro_dph * RAD_PER_ARCSEC]
        sigma += [b.baro_m, b.clock_m, b.clock_mps]
        if b.has_separate_clocks:
            sigma += [b.clock_m, b.clock_mps]
        sigma += [self._settings.range_bias_m] if self.bias >= 0 else []
        sigma += 2 * [self._settings.lever_arm_m] if self._lever >= 0 else []
        return np.zeros(self.size), np.diag(np.square(sigma))

    def step(self, x: FloatArray, from_s: float, to_s: float) -> Step:
        """Linear: the matrices of a pair of times are kept, all algorithms ask for the same."""
        key = (0.0, round(to_s - from_s, 9)) if self._frame == "local" else (from_s, to_s)
        if key not in self._steps:
            self._steps[key] = self._matrices(from_s, to_s)
        transition, noise = self._steps[key]
        return transition @ x, transition, noise

    def place(self, x: FloatArray, at_s: float) -> tuple[FloatArray, FloatArray]:
        """Dead-reckoned position less the estimated error."""
        if at_s not in self._places:
            self._places[at_s] = self._reading(at_s)
        reading, derivative = self._places[at_s]
        return reading + derivative @ x, derivative

    def view(self, x: FloatArray, at_s: float) -> View:
        """That of the antenna."""
        place, derivative = self.place(x, at_s)
        return View(place, derivative, float("nan"), np.zeros(self.size))

    def range_error(self, x: FloatArray, distance_m: float, *, is_peer: bool) -> tuple[float, FloatArray, float]:
        """Bias of the receiver."""
        h = np.zeros(self.size)
        if self.bias < 0:
            return 0.0, h, 0.0
        h[self.bias] = 1.0
        return float(x[self.bias]), h, 0.0

    def height_m(self, at_s: float) -> float:
        """Barometric height; meaningful in a local frame."""
        return -float(self.place(np.zeros(self.size), at_s)[0][2])

    def _reading(self, at_s: float) -> tuple[FloatArray, FloatArray]:
        """Position between two epochs (cubic through both positions and velocities) and derivative by the state."""
        track = self._track
        after = min(max(int(np.searchsorted(track.time_s, at_s)), 1), len(track) - 1)
        nearest = after
        if len(track) == 1:
            position = track.position_m[0]
        else:
            before = after - 1
            span = float(track.time_s[after] - track.time_s[before])
            part = (at_s - float(track.time_s[before])) / span
            nearest = before if part < 0.5 else after
            one, two = track.position_m[before], track.position_m[after]
            rate_one = track.axes[before] @ track.velocity_mps[before] * span
            rate_two = track.axes[after] @ track.velocity_mps[after] * span
            a, b = part * part * (3.0 - 2.0 * part), part * (1.0 - part)
            position = one + a * (two - one) + b * ((1.0 - part) * rate_one - part * rate_two)
        axes = track.axes[nearest]
        derivative = np.zeros((3, self.size))
        derivative[:, 0], derivative[:, 1], derivative[:, self.height] = -axes[:, 0], -axes[:, 1], axes[:, 2]
        if self._lever >= 0:
            heading_rad = np.deg2rad(track.heading_deg[nearest])
            cosine, sine = np.cos(heading_rad), np.sin(heading_rad)
            derivative[:, self._lever] = cosine * axes[:, 0] + sine * axes[:, 1]
            derivative[:, self._lever + 1] = cosine * axes[:, 1] - sine * axes[:, 0]
        return position, derivative

    def _matrices(self, from_s: float, to_s: float) -> tuple[FloatArray, FloatArray]:
        """Transition and noise over a step, piece by piece between the epochs of the dead reckoning."""
        if self._frame == "local":
            return discretise(self._dynamics(0), self._density, to_s - from_s)
        cuts = self._track.time_s[(self._track.time_s > from_s + SAME_TIME_S) & (self._track.time_s < to_s)]
        edges = [from_s, *cuts.tolist(), to_s]
        transition, noise = np.eye(self.size), np.zeros((self.size, self.size))
        for one, two in pairwise(edges):
            at = int(
                np.clip(np.searchsorted(self._track.time_s, 0.5 * (one + two)) - 1, 0, max(len(self._track) - 2, 0))
            )
            if at not in self._dynamics_at:
                self._dynamics_at[at] = self._dynamics(at)
            phi, q = discretise(self._dynamics_at[at], self._density, two - one)
            transition, noise = phi @ transition, phi @ noise @ phi.T + q
        return transition, noise

    def _dynamics(self, epoch: int) -> FloatArray:
        b, track = self._settings.ins, self._track
        F = np.zeros((self.size, self.size))
        if self._frame == "local":
            F[:7, :7] = local_dynamics(b.velocity_s, b.baro_s, b.clock_s)
            base = 7
        else:
            after = min(epoch + 1, len(track) - 1)
            velocity = 0.5 * (track.velocity_mps[epoch] + track.velocity_mps[after])
            latitude = 0.5 * float(track.latitude_deg[epoch] + track.latitude_deg[after])
            height = self._ellipsoid_height_m(epoch)
            span = float(track.time_s[after] - track.time_s[epoch]) or 1.0
            change = (track.velocity_mps[after] - track.velocity_mps[epoch]) / span
            force = _specific_force(latitude, height, velocity, change)
            F[:13, :13] = global_dynamics(latitude, height, velocity, force, b.gyro_s, b.baro_s, b.clock_s)
            base = 13
        if b.has_separate_clocks:
            F[base, base + 1], F[base + 1, base + 1] = 1.0, -1.0 / b.clock_s
        if self.bias >= 0:
            F[self.bias, self.bias] = -1.0 / self._settings.range_bias_s
        return F

    def _ellipsoid_height_m(self, epoch: int) -> float:
        place, up = self._track.position_m[epoch], -self._track.axes[epoch][:, 2]
        radius = 6_378_137.0 * (1.0 - 0.00335281 * float(up[2]) ** 2)
        return float(np.linalg.norm(place)) - radius

    def _noise_density(self) -> FloatArray:
        b = self._settings.ins
        density = np.zeros(self.size)
        if self._frame == "local":
            density[2:4] = 2.0 * b.velocity_mps**2 / b.velocity_s
        else:
            density[7:10] = 2.0 * (b.gyro_dph * RAD_PER_ARCSEC) ** 2 / b.gyro_s
        density[self.height] = 2.0 * b.baro_m**2 / b.baro_s
        for clock in {self.clock, self.receiver_clock}:
            density[clock + 1] = 2.0 * b.clock_mps**2 / b.clock_s
        if self.bias >= 0:
            density[self.bias] = 2.0 * self._settings.range_bias_m**2 / self._settings.range_bias_s
        return density


_PLATFORM = tuple(
    f"{what}_{axis}_{unit}"
    for what, unit in (("tilt", "rad"), ("drift", "radps"))
    for axis in ("north", "east", "down")
)


def _specific_force(latitude_deg: float, height_m: float, velocity: FloatArray, change: FloatArray) -> FloatArray:
    """Specific force north, east, down: change of velocity, Coriolis and transport terms, less gravity."""
    latitude_rad = np.deg2rad(latitude_deg)
    sine, cosine = float(np.sin(latitude_rad)), float(np.cos(latitude_rad))
    meridian, normal = (float(radius) + height_m for radius in curvature_radii_m(latitude_deg))
    north, east, down = (float(value) for value in velocity)
    equator, k, e2 = GRAVITY_MPS2
    gravity = equator * (1.0 + k * sine**2) / (1.0 - e2 * sine**2) ** 0.5 * (1.0 - 2.0 * height_m / 6_371_000.0)
    w_n = 2.0 * EARTH_RATE_RADPS * cosine + east / normal
    w_e = -north / meridian
    w_d = -2.0 * EARTH_RATE_RADPS * sine - east * sine / cosine / normal
    coriolis = [w_e * down - w_d * east, w_d * north - w_n * down, w_n * east - w_e * north - gravity]
    return np.asarray(change + np.array(coriolis))
