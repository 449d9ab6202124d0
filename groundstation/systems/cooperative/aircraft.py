"""An aircraft as seen by the filters: its error states, their start and their dynamics.

Its motion stands in aircraft_motion.py.
"""

from collections.abc import Mapping
from functools import cached_property

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.dataclasses import dataclass
from groundstation.base.geodesy import EARTH_RATE_RADPS, curvature_radii_m
from groundstation.systems.cooperative.aircraft_motion import AircraftMotion, places
from groundstation.systems.cooperative.loop_types import (
    AXES,
    EPOCH_COLUMNS,
    FORCE,
    GLOBAL,
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
from groundstation.systems.cooperative.settings import CooperativeSettings
from groundstation.systems.cooperative.vehicles import LEAP_M, Step, View
from groundstation.tables.session import DeadReckoning, Frame

RAD_PER_ARCSEC = float(np.deg2rad(1.0 / 3600.0))
GRAVITY_MPS2 = 9.7803253359, 0.00193185265241, 0.00669437999  # Somigliana, WGS-84 (NIMA TR8350.2)
_LOCAL = ("north_m", "east_m", "velocity_north_mps", "velocity_east_mps")
_PLATFORM = tuple(
    f"{what}_{axis}_{unit}"
    for what, unit in (("tilt", "rad"), ("drift", "radps"))
    for axis in ("north", "east", "down")
)


@dataclass(frozen=True)
class Aircraft:
    """One aircraft as the filters see it.

    Parameters
    ----------
    name : str
    model : int
        LOCAL or GLOBAL.
    states : tuple of str
        Names with units.
    start_sigma : ndarray, shape (n,)
        Of each state at the first epoch.
    density : ndarray, shape (n,)
        Of the white noise on each state.
    epochs : ndarray, shape (t, EPOCH_COLUMNS)
    numbers : ModelNumbers
    """

    name: str
    model: int
    states: tuple[str, ...]
    start_sigma: FloatArray
    density: FloatArray
    epochs: FloatArray
    numbers: ModelNumbers

    @cached_property
    def size(self) -> int:
        """Number of states."""
        return len(self.states)

    @property
    def first_s(self) -> float:
        """First epoch of its own navigation."""
        return float(self.epochs[0, TIME])

    @property
    def last_s(self) -> float:
        """Last epoch."""
        return float(self.epochs[-1, TIME])

    def at(self, state: str) -> int:
        """Index of a state, -1 without it."""
        return self.states.index(state) if state in self.states else -1

    @cached_property
    def clock(self) -> int:
        """Index of the clock offset of the link."""
        return self.at("clock_m")

    @cached_property
    def receiver_clock(self) -> int:
        """Index of the clock offset of the satellite receiver.

        It is that of the link where there is one clock.
        """
        return self.at("receiver_clock_m") if "receiver_clock_m" in self.states else self.clock

    @cached_property
    def bias(self) -> int:
        """Index of the range bias."""
        return self.at("range_bias_m")

    @cached_property
    def height(self) -> int:
        """Index of the error of height."""
        return self.at("height_m")

    @cached_property
    def has_range_errors(self) -> bool:
        """Tell whether a range has an error that is a state."""
        return self.bias >= 0

    @property
    def heading(self) -> int:
        """Index of the heading: none, for it takes no bearings."""
        return -1

    @cached_property
    def doubts(self) -> Mapping[int, float]:
        """Clock states, which may leap, with the variance added when they are reopened."""
        return {self.clock: LEAP_M**2, self.receiver_clock: LEAP_M**2}

    def start(self) -> tuple[FloatArray, FloatArray]:
        """Return the start: zero errors with the assumed sigmas."""
        return np.zeros(self.size), np.diag(np.square(self.start_sigma))

    def step(self, x: FloatArray, from_s: float, to_s: float) -> Step:
        """State after a step, its transition matrix and the covariance of the noise."""
        phi, noise = self._motion.step(from_s, to_s)
        return phi @ x, phi, noise

    def place(self, x: FloatArray, at_s: float) -> tuple[FloatArray, FloatArray]:
        """Return the antenna's position and its derivative by the state, shape (3, n).

        The position is in the frame of the session.
        """
        at, derivative = places(self, np.array([at_s])), np.zeros((3, self.size))
        derivative[:, at.states] = at.derivative[0]
        return at.reading[0] + derivative @ x, derivative

    def view(self, x: FloatArray, at_s: float) -> View:
        """Return the view of the antenna; it has no heading."""
        place_m, derivative = self.place(x, at_s)
        return View(place_m, derivative, float("nan"), np.zeros(self.size))

    def range_error(self, x: FloatArray, distance_m: float, *, is_peer: bool) -> tuple[float, FloatArray, float]:
        """Return the error of a range: the bias of the receiver."""
        h = np.zeros(self.size)
        if self.bias < 0:
            return 0.0, h, 0.0
        h[self.bias] = 1.0
        return float(x[self.bias]), h, 0.0

    def height_m(self, at_s: float) -> float:
        """Barometric height; meaningful in a local frame."""
        return -float(self.place(np.zeros(self.size), at_s)[0][2])

    @cached_property
    def _motion(self) -> AircraftMotion:
        return AircraftMotion(self)


def aircraft_of(track: DeadReckoning, frame: Frame, settings: CooperativeSettings) -> Aircraft:
    """Make an aircraft with INS, barometric altimeter and clock.

    It has 7 states in a local frame, 13 or 15 in the global one.
    """
    b = settings.ins
    tilt, azimuth = b.tilt_arcsec * RAD_PER_ARCSEC, 60.0 * b.azimuth_arcmin * RAD_PER_ARCSEC
    gyro = b.gyro_dph * RAD_PER_ARCSEC
    sigma = dict(zip(_LOCAL, (b.position_m, b.position_m, b.velocity_mps, b.velocity_mps), strict=True))
    density: dict[str, float] = {}
    if frame == "ecef":
        sigma |= dict(zip(_PLATFORM, (tilt, tilt, azimuth, gyro, gyro, gyro), strict=True))
        density |= dict.fromkeys(_PLATFORM[3:], 2.0 * gyro**2 / b.gyro_s)
    else:
        density |= dict.fromkeys(_LOCAL[2:], 2.0 * b.velocity_mps**2 / b.velocity_s)
    sigma |= {"height_m": b.baro_m, "clock_m": b.clock_m, "clock_mps": b.clock_mps}
    density |= {"height_m": 2.0 * b.baro_m**2 / b.baro_s, "clock_mps": 2.0 * b.clock_mps**2 / b.clock_s}
    if b.has_separate_clocks:
        sigma |= {"receiver_clock_m": b.clock_m, "receiver_clock_mps": b.clock_mps}
        density["receiver_clock_mps"] = density["clock_mps"]
    if settings.range_bias_m > 0.0:
        sigma["range_bias_m"] = settings.range_bias_m
        density["range_bias_m"] = 2.0 * settings.range_bias_m**2 / settings.range_bias_s
    if settings.lever_arm_m > 0.0:
        sigma |= {"lever_forward_m": settings.lever_arm_m, "lever_right_m": settings.lever_arm_m}
    return Aircraft(
        track.name,
        GLOBAL if frame == "ecef" else LOCAL,
        tuple(sigma),
        np.array(list(sigma.values())),
        np.array([density.get(name, 0.0) for name in sigma]),
        _epochs_of(track, frame),
        ModelNumbers(b.velocity_s, b.gyro_s, b.baro_s, b.clock_s, settings.range_bias_s),
    )


def _epochs_of(track: DeadReckoning, frame: Frame) -> FloatArray:
    """Return the table of an aircraft's epochs.

    Columns for the step to the next epoch hold the mean of both.
    """
    table = np.zeros((len(track), EPOCH_COLUMNS))
    table[:, TIME], table[:, PLACE : PLACE + 3] = track.time_s, track.position_m
    table[:, RATE : RATE + 3] = np.einsum("nij,nj->ni", track.axes, track.velocity_mps)
    table[:, AXES : AXES + 9] = track.axes.reshape(-1, 9)
    table[:, HEADING] = np.deg2rad(track.heading_deg)
    if frame == "local":
        return table
    after = np.minimum(np.arange(1, len(track) + 1), len(track) - 1)
    velocity = 0.5 * (track.velocity_mps + track.velocity_mps[after])
    latitude_deg = 0.5 * (track.latitude_deg + track.latitude_deg[after])
    up = -track.axes[:, 2, 2]
    height_m = np.linalg.norm(track.position_m, axis=1) - 6_378_137.0 * (1.0 - 0.00335281 * up**2)
    span = track.time_s[after] - track.time_s
    change = (track.velocity_mps[after] - track.velocity_mps) / np.where(span > 0.0, span, 1.0)[:, None]
    meridian, normal = curvature_radii_m(latitude_deg)
    table[:, LATITUDE], table[:, MERIDIAN], table[:, NORMAL] = (
        np.deg2rad(latitude_deg),
        meridian + height_m,
        normal + height_m,
    )
    table[:, VELOCITY : VELOCITY + 3] = velocity
    table[:, FORCE : FORCE + 3] = _specific_force(table, height_m, change)
    return table


def _specific_force(table: FloatArray, height_m: FloatArray, change: FloatArray) -> FloatArray:
    """Return the specific force north, east, down.

    It is change of velocity, Coriolis and transport terms, less gravity.
    """
    sine, cosine = np.sin(table[:, LATITUDE]), np.cos(table[:, LATITUDE])
    meridian, normal = table[:, MERIDIAN], table[:, NORMAL]
    north, east, down = table[:, VELOCITY : VELOCITY + 3].T
    equator, k, e2 = GRAVITY_MPS2
    gravity = equator * (1.0 + k * sine**2) / (1.0 - e2 * sine**2) ** 0.5 * (1.0 - 2.0 * height_m / 6_371_000.0)
    w_n = 2.0 * EARTH_RATE_RADPS * cosine + east / normal
    w_e = -north / meridian
    w_d = -2.0 * EARTH_RATE_RADPS * sine - east * sine / cosine / normal
    coriolis = [w_e * down - w_d * east, w_d * north - w_n * down, w_n * east - w_e * north - gravity]
    return np.asarray(change + np.array(coriolis).T)
