"""Motion in closed form over the turning Earth, and exact integrals along it.

The integrals are those of angular rate and of specific force."""

from dataclasses import fields
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from groundstation.base.angles import wrap_360
from groundstation.base.attitude import rotation_n_from_b
from groundstation.base.dataclasses import dataclass
from groundstation.base.geodesy import EARTH_RATE_RADPS, ECCENTRICITY_SQUARED, SEMI_MAJOR_M, curvature_radii_m
from groundstation.base.gravity import normal_gravity_mps2
from groundstation.base.records import frozen
from groundstation.simulation.imu.jets import Jet, cosine, root, sine

FloatArray = NDArray[np.float64]
Triple = tuple[Jet, Jet, Jet]
NODES = 4  # of the quadrature: exact to rounding at 20 ms on motion that changes within 0.5 s
CHUNK = 16_384  # times at once: what fits in the cache
ORDER = 3  # of the position: bank follows from acceleration, and its rate is wanted


@dataclass(frozen=True)
class Place:
    """Jets of a place, and the metres that a metre on the map at the origin makes there."""

    latitude_rad: Jet
    longitude_rad: Jet
    height_m: Jet
    north_scale: Jet
    east_scale: Jet


@dataclass(frozen=True)
class Origin:
    """Place of the map's zero."""

    latitude_deg: float
    longitude_deg: float
    height_m: float

    def place(self, north_m: Jet, east_m: Jet, up_m: Jet) -> Place:
        """Return the place of map coordinates: latitude and longitude are linear in them."""
        meridian, normal = (float(one) + self.height_m for one in curvature_radii_m(self.latitude_deg))
        parallel = normal * float(np.cos(np.deg2rad(self.latitude_deg)))
        latitude = north_m / meridian + float(np.deg2rad(self.latitude_deg))
        longitude = east_m / parallel + float(np.deg2rad(self.longitude_deg))
        height = up_m + self.height_m
        at_meridian, at_normal = _radii(latitude)
        north_scale = (at_meridian + height) / meridian
        east_scale = (at_normal + height) * cosine(latitude) / parallel
        return Place(latitude, longitude, height, north_scale, east_scale)


def _radii(latitude_rad: Jet) -> tuple[Jet, Jet]:
    """Return the radii of curvature along the meridian and across it."""
    s = sine(latitude_rad)
    denominator = -(s * s * ECCENTRICITY_SQUARED) + 1.0
    one = denominator * 0.0 + 1.0
    normal = one / root(denominator) * SEMI_MAJOR_M
    return normal * (1.0 - ECCENTRICITY_SQUARED) / denominator, normal


@dataclass(frozen=True)
class MotionJets:
    """Jets of a motion: place, velocity north east down, roll, pitch and heading in radians."""

    place: Place
    velocity_mps: Triple
    attitude_rad: Triple


class Motion(Protocol):
    """Motion that is a closed function of time."""

    def jets(self, time_s: FloatArray) -> MotionJets:
        """Return the motion at times, seconds of the log."""
        ...


@dataclass(frozen=True)
class TrueStates:
    """True states of the unit at n times.

    Rate and force are in body axes forward, right, down. ``rate_radps`` is against inertial space,
    ``rate_earth_radps`` against the Earth.
    """

    time_s: FloatArray
    latitude_deg: FloatArray
    longitude_deg: FloatArray
    height_m: FloatArray
    velocity_mps: FloatArray
    roll_deg: FloatArray
    pitch_deg: FloatArray
    heading_deg: FloatArray
    rate_radps: FloatArray
    rate_earth_radps: FloatArray
    force_mps2: FloatArray

    def __post_init__(self) -> None:
        for item in fields(self):
            object.__setattr__(self, item.name, frozen(getattr(self, item.name)))

    @property
    def n_from_b(self) -> FloatArray:
        """Rotations from body axes to north, east, down, shape (n, 3, 3)."""
        return rotation_n_from_b(np.stack([self.roll_deg, self.pitch_deg, self.heading_deg], axis=1))


def true_states(motion: Motion, time_s: FloatArray) -> TrueStates:
    """Return the true states of a motion at times, shape (n,)."""
    time = np.asarray(time_s, dtype=np.float64)
    parts = [_states(motion, time[start : start + CHUNK]) for start in range(0, max(len(time), 1), CHUNK)]
    joined = {item.name: np.concatenate([getattr(part, item.name) for part in parts]) for item in fields(TrueStates)}
    return TrueStates(**joined)


def exact_increments(motion: Motion, start_s: FloatArray, end_s: FloatArray, nodes: int = NODES) -> FloatArray:
    """Integrate angular rate and specific force in body axes over intervals.

    Parameters
    ----------
    motion : Motion
    start_s, end_s : ndarray, shape (n,)
    nodes : int
        Of Gauss and Legendre's rule in each interval.

    Returns
    -------
    ndarray, shape (n, 6)
        Angles in radians, then velocities in metres per second, about and along forward, right, down.
    """
    at, weight = np.polynomial.legendre.leggauss(nodes)
    middle, half = 0.5 * (start_s + end_s), 0.5 * (end_s - start_s)
    total = np.zeros((len(middle), 6))
    for place, share in zip(at, weight, strict=True):
        states = true_states(motion, middle + place * half)
        total += share * half[:, None] * np.concatenate([states.rate_radps, states.force_mps2], axis=1)
    return total


def _states(motion: Motion, time_s: FloatArray) -> TrueStates:
    """Angular rate and specific force by the equations of navigation.

    w_ib = w_nb + b_from_n (w_ie + w_en), f = v' + (2 w_ie + w_en) x v - g.

    Source: Groves, Principles of GNSS, Inertial, and Multisensor Integrated Navigation Systems, 2nd ed. 2013,
    equations 5.53 and 5.54, and 2.1 for gravity.
    """
    jets = motion.jets(time_s)
    latitude, height = jets.place.latitude_rad.value, jets.place.height_m.value
    velocity = np.stack([one.value for one in jets.velocity_mps], axis=1)
    acceleration = np.stack([one.rate for one in jets.velocity_mps], axis=1)
    roll, pitch, heading = attitude = np.rad2deg(np.stack([one.value for one in jets.attitude_rad]))
    n_from_b = rotation_n_from_b(attitude.T)
    earth, transport = earth_and_transport_radps(latitude, height, velocity)
    gravity = np.zeros_like(velocity)
    gravity[:, 2] = normal_gravity_mps2(np.rad2deg(latitude), height)
    force_n = acceleration + np.cross(2.0 * earth + transport, velocity) - gravity
    rate_earth = _body_rate(jets.attitude_rad) + _to_body(n_from_b, transport)
    return TrueStates(
        time_s,
        np.rad2deg(latitude),
        np.rad2deg(jets.place.longitude_rad.value),
        height,
        velocity,
        roll,
        pitch,
        wrap_360(heading),
        rate_earth + _to_body(n_from_b, earth),
        rate_earth,
        _to_body(n_from_b, force_n),
    )


def earth_and_transport_radps(
    latitude_rad: FloatArray, height_m: FloatArray, velocity_mps: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Rotation of the Earth, and of north-east-down against it, in north, east, down."""
    meridian, normal = curvature_radii_m(np.rad2deg(latitude_rad))
    north, east, _down = velocity_mps.T
    zero = np.zeros_like(latitude_rad)
    earth = EARTH_RATE_RADPS * np.stack([np.cos(latitude_rad), zero, -np.sin(latitude_rad)], axis=1)
    across = east / (normal + height_m)
    transport = np.stack([across, -north / (meridian + height_m), -across * np.tan(latitude_rad)], axis=1)
    return earth, transport


def _body_rate(attitude_rad: Triple) -> FloatArray:
    """Rate of the body against north-east-down by those of the Euler angles, body axes."""
    roll, pitch, heading = attitude_rad
    sr, cr, sp, cp = np.sin(roll.value), np.cos(roll.value), np.sin(pitch.value), np.cos(pitch.value)
    return np.stack(
        [
            roll.rate - heading.rate * sp,
            pitch.rate * cr + heading.rate * sr * cp,
            heading.rate * cr * cp - pitch.rate * sr,
        ],
        axis=1,
    )


def _to_body(n_from_b: FloatArray, vector: FloatArray) -> FloatArray:
    return np.asarray(np.einsum("nij,ni->nj", n_from_b, vector))
