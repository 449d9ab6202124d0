"""Ground vehicle on wheels: its place and heading are the state.

The errors of its odometry and its camera are states as well. What the camera adds to a range is bias + scale distance
(+ bias of the markers that vehicles carry); it looks past the nose by its mounting angle, and its stamps are late. Each
is a state where its sigma is above 0: nothing is calibrated beforehand.
"""

from collections.abc import Mapping
from itertools import pairwise
from types import MappingProxyType

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.systems.cooperative.settings import CooperativeSettings
from groundstation.systems.cooperative.vehicles import SAME_TIME_S, Step, View
from groundstation.tables.session import Odometry

LONG_S = 1e6  # a constant
LOST_M, LOST_RAD = 1.0, 0.5  # a vehicle that slipped or was carried away


def _squares(track: Odometry) -> tuple[float, float]:
    """Return the mean squares of speed and rate of turn, (m/s)^2 and (rad/s)^2.

    A held reading may be wrong by that.
    """
    return float(np.mean(track.speed_mps**2)), float(np.mean(np.deg2rad(track.turn_rate_dps) ** 2))


class WheeledVehicle:
    """Wheeled vehicle: north, east, heading, and the assumed errors of odometry and camera."""

    clock: int = -1
    receiver_clock: int = -1
    height: int = -1
    heading: int = 2
    has_range_errors: bool = True
    doubts: Mapping[int, float] = MappingProxyType({0: LOST_M**2, 1: LOST_M**2, 2: LOST_RAD**2})

    def __init__(self, track: Odometry, settings: CooperativeSettings) -> None:
        self.name, self._track, self._settings = track.name, track, settings
        self.first_s, self.last_s = float(track.time_s[0]), float(track.time_s[-1])
        belief, camera = settings.odometry, settings.camera
        errors = {  # name: sigma, correlation time
            "speed_scale": (belief.speed_scale, belief.scale_s),
            "turn_scale": (belief.turn_scale, belief.scale_s),
            "range_bias_m": (settings.range_bias_m, settings.range_bias_s),
            "range_scale": (camera.range_scale, LONG_S),
            "marker_bias_m": (camera.marker_bias_m, LONG_S),
            "mount_rad": (float(np.deg2rad(camera.mount_deg)), LONG_S),
            "lag_s": (camera.lag_s, LONG_S),
        }
        believed = {name: each for name, each in errors.items() if each[0] > 0.0}
        self.states: tuple[str, ...] = ("north_m", "east_m", "heading_rad", *believed)
        self._at = {name: number for number, name in enumerate(self.states)}
        self.bias = self._at.get("range_bias_m", -1)
        self._sigma = np.array([sigma for sigma, _ in believed.values()])
        self._unread = _squares(track)
        self._density = np.array([2.0 * sigma**2 / time_s for sigma, time_s in believed.values()])

    @property
    def size(self) -> int:
        """Number of states."""
        return len(self.states)

    def start(self) -> tuple[FloatArray, FloatArray]:
        """Return the start state and its covariance, at the place that the table gives."""
        belief = self._settings.odometry
        x = np.zeros(self.size)
        x[:3] = [*self._track.position_m, np.deg2rad(self._track.heading_deg)]
        sigma = np.concatenate([[belief.position_m, belief.position_m, np.deg2rad(belief.heading_deg)], self._sigma])
        return x, np.diag(np.square(sigma))

    def step(self, x: FloatArray, from_s: float, to_s: float) -> Step:
        """Integrate odometry, each reading held until the next; derivative by the state with it."""
        track, n = self._track, self.size
        early, late = min(from_s, to_s), max(from_s, to_s)
        first = max(int(np.searchsorted(track.time_s, early + SAME_TIME_S)) - 1, 0)
        last = max(int(np.searchsorted(track.time_s, late - SAME_TIME_S)) - 1, first)
        edges = [early, *track.time_s[first + 1 : last + 1].tolist(), late]
        epochs = list(range(first, first + len(edges) - 1))
        if to_s < from_s:  # back in time, for measurements that are used together
            edges, epochs = edges[::-1], epochs[::-1]
        x, transition, noise = x.copy(), np.eye(n), np.zeros((n, n))
        for epoch, (one, two) in zip(epochs, pairwise(edges), strict=True):
            x, phi, q = self._short_step(x, epoch, two - one)
            transition, noise = phi @ transition, phi @ noise @ phi.T + q
        return x, transition, noise

    def _short_step(self, x: FloatArray, epoch: int, step_s: float) -> Step:
        n, at = self.size, self._at
        speed, turn = self._readings(epoch)
        way, turned = speed * self._factor(x, "speed_scale") * step_s, turn * self._factor(x, "turn_scale") * step_s
        middle = x[2] + 0.5 * turned
        cosine, sine = np.cos(middle), np.sin(middle)
        moved = x.copy()
        moved[0], moved[1], moved[2] = x[0] + way * cosine, x[1] + way * sine, x[2] + turned
        phi = np.eye(n)
        phi[0, 2], phi[1, 2] = -way * sine, way * cosine
        if "speed_scale" in at:
            phi[0, at["speed_scale"]], phi[1, at["speed_scale"]] = -speed * step_s * cosine, -speed * step_s * sine
        if "turn_scale" in at:
            half = -0.5 * turn * step_s
            phi[0, at["turn_scale"]], phi[1, at["turn_scale"]] = -way * sine * half, way * cosine * half
            phi[2, at["turn_scale"]] = -turn * step_s
        noise = self._noise(speed != 0.0 or turn != 0.0, way, abs(step_s), cosine, sine)
        gap_s = float(self._track.gap_s[epoch]) if len(self._track.gap_s) else 0.0
        if gap_s > 0.0:  # an error as large as the motion itself, the same for the whole gap
            noise[[0, 1, 2], [0, 1, 2]] += np.array(self._unread)[[0, 0, 1]] * gap_s * abs(step_s)
        return moved, phi, noise

    def _noise(self, is_moving: bool, way: float, step_s: float, cosine: float, sine: float) -> FloatArray:
        """Covariance of the noise of a short step; a vehicle that stands has none."""
        belief, q = self._settings.odometry, np.zeros((self.size, self.size))
        if is_moving:
            across = belief.slip_m_per_sqrt_m**2 * abs(way)
            along = belief.along_m_per_sqrt_s**2 * step_s + across
            q[0, 0] = along * cosine**2 + across * sine**2
            q[1, 1] = along * sine**2 + across * cosine**2
            q[0, 1] = q[1, 0] = (along - across) * sine * cosine
            q[2, 2] = np.deg2rad(belief.turn_deg_per_sqrt_s) ** 2 * step_s
        errors = np.arange(3, self.size)
        q[errors, errors] = self._density * step_s
        return q

    def _readings(self, epoch: int) -> tuple[float, float]:
        return float(self._track.speed_mps[epoch]), float(np.deg2rad(self._track.turn_rate_dps[epoch]))

    def _factor(self, x: FloatArray, name: str) -> float:
        return 1.0 - float(x[self._at[name]]) if name in self._at else 1.0

    def _error(self, x: FloatArray, name: str) -> float:
        return float(x[self._at[name]]) if name in self._at else 0.0

    def place(self, x: FloatArray, at_s: float) -> tuple[FloatArray, FloatArray]:
        """The first two states."""
        derivative = np.zeros((3, self.size))
        derivative[0, 0] = derivative[1, 1] = 1.0
        return np.array([x[0], x[1], 0.0]), derivative

    def view(self, x: FloatArray, at_s: float) -> View:
        """Return place and direction of the camera when it took what is stamped ``at_s``."""
        place, derivative = self.place(x, at_s)
        heading, by_heading = float(x[2]) + self._error(x, "mount_rad"), np.zeros(self.size)
        by_heading[2] = 1.0
        if "mount_rad" in self._at:
            by_heading[self._at["mount_rad"]] = 1.0
        if "lag_s" in self._at:
            lag = float(x[self._at["lag_s"]])
            epoch = max(int(np.searchsorted(self._track.time_s, at_s - SAME_TIME_S)) - 1, 0)
            speed, turn = self._readings(epoch)
            way, turned = speed * self._factor(x, "speed_scale"), turn * self._factor(x, "turn_scale")
            ahead, right = np.array([np.cos(x[2]), np.sin(x[2]), 0.0]), np.array([-np.sin(x[2]), np.cos(x[2]), 0.0])
            place, heading = place - lag * way * ahead, heading - lag * turned
            derivative[:, self._at["lag_s"]], by_heading[self._at["lag_s"]] = -way * ahead, -turned
            derivative[:, 2] = -lag * way * right
            if "speed_scale" in self._at:
                derivative[:, self._at["speed_scale"]] = lag * speed * ahead
            if "turn_scale" in self._at:
                by_heading[self._at["turn_scale"]] = lag * turn
        return View(place, derivative, heading, by_heading)

    def range_error(self, x: FloatArray, distance_m: float, *, is_peer: bool) -> tuple[float, FloatArray, float]:
        """Bias, scale, and the bias of a peer's marker."""
        h, scale = np.zeros(self.size), self._error(x, "range_scale")
        value = self._error(x, "range_bias_m") + scale * distance_m
        parts = {"range_bias_m": 1.0, "range_scale": distance_m}
        if is_peer:
            value += self._error(x, "marker_bias_m")
            parts["marker_bias_m"] = 1.0
        for name, part in parts.items():
            if name in self._at:
                h[self._at[name]] = part
        return value, h, scale

    def height_m(self, at_s: float) -> float:
        """Return the height, which is that of the floor: 0."""
        return 0.0
