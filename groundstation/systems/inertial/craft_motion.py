"""Motion of the craft by its INS, with Earth and craft rates and specific force."""

from dataclasses import fields

import numpy as np

from groundstation.base.dataclasses import dataclass
from groundstation.base.geodesy import EARTH_RATE_RADPS, curvature_radii_m
from groundstation.base.records import frozen
from groundstation.systems.inertial.differences import InsDifferences
from groundstation.systems.inertial.model import FloatArray, normal_gravity_mps2

LATITUDE_MAX_DEG = 88.0  # beyond, north is no axis for an error model
VELOCITIES = slice(2, 4)  # among the columns of the INS at a time
ACCELERATION_MAX_MPS2 = 50.0  # a faster change of the INS velocity is a reset of it


@dataclass(frozen=True)
class CraftMotion:
    """Motion of the craft over m intervals, as its INS knows it: the means of each interval.

    Parameters
    ----------
    latitude_deg, altitude_m : ndarrays, shape (m,)
    velocity_mps, acceleration_mps2 : ndarrays, shape (m, 2)
        Over the ground, north and east; the acceleration is change of velocity over the interval.
    heading_rad : ndarray, shape (m,)
        Of what the sensors are fixed to: the nose of a strapdown, north of a platform that is slaved to it.
    """

    latitude_deg: FloatArray
    altitude_m: FloatArray
    velocity_mps: FloatArray
    acceleration_mps2: FloatArray
    heading_rad: FloatArray

    def __post_init__(self) -> None:
        for item in fields(self):
            object.__setattr__(self, item.name, frozen(np.asarray(getattr(self, item.name), dtype=np.float64)))

    @classmethod
    def between(cls, differences: InsDifferences, time_s: FloatArray, *, is_strapdown: bool = True) -> "CraftMotion":
        """The motion between neighbouring times, m of them, from the INS alone; m - 1 intervals.

        It is held where the INS has no samples; without any it is at rest on the equator.
        """
        ends = _columns_at(differences, time_s, is_strapdown=is_strapdown)
        return cls._over(ends[:, :-1], ends[:, 1:], np.diff(time_s))

    @classmethod
    def over(
        cls, differences: InsDifferences, begin_s: FloatArray, seconds: float | FloatArray, *, is_strapdown: bool = True
    ) -> "CraftMotion":
        """The motion over intervals that begin at some times, m of them, in any order."""
        first, last = (
            _columns_at(differences, time_s, is_strapdown=is_strapdown) for time_s in (begin_s, begin_s + seconds)
        )
        return cls._over(first, last, np.asarray(np.broadcast_to(seconds, begin_s.shape)))

    @classmethod
    def _over(cls, first: FloatArray, last: FloatArray, seconds: FloatArray) -> "CraftMotion":
        """The motion between the columns at both ends, each (5, m)."""
        latitude, altitude, north, east, heading = 0.5 * (last + first)
        acceleration = (last - first)[VELOCITIES] / np.where(seconds > 0.0, seconds, np.inf)
        is_step = (np.abs(acceleration) > ACCELERATION_MAX_MPS2).any(axis=0)
        acceleration[:, is_step] = 0.0
        return cls(latitude, altitude, np.stack([north, east], axis=1), acceleration.T, heading)

    def specific_force_mps2(self) -> FloatArray:
        """Specific force north, east and down, shape (m, 3), m/s^2; vertical motion is left out.

        f = acceleration + (2 Earth rate + craft rate) x velocity - gravity.
        """
        earth_north, earth_down, craft_north, craft_east, craft_down = rates_radps(self)
        north, east = self.velocity_mps.T
        down_rate = 2.0 * earth_down + craft_down
        gravity = normal_gravity_mps2(self.latitude_deg, self.altitude_m)
        return np.stack(
            [
                self.acceleration_mps2[:, 0] - down_rate * east,
                self.acceleration_mps2[:, 1] + down_rate * north,
                (2.0 * earth_north + craft_north) * east - craft_east * north - gravity,
            ],
            axis=1,
        )


def _columns_at(differences: InsDifferences, time_s: FloatArray, *, is_strapdown: bool) -> FloatArray:
    """Return the motion of the INS at some times, shape (5, n).

    Latitude and altitude, velocity north and east, heading in radians.
    """
    own_s = differences.epochs.time_s
    known = [np.interp(time_s, own_s, column) for column in differences.motion_known]
    heading = np.interp(time_s, own_s, differences.unwrapped_heading_rad) if is_strapdown else np.zeros(len(time_s))
    return np.stack([*known, heading])


def latitude_rad(motion: CraftMotion) -> FloatArray:
    """Latitude, held where north is hardly an axis any more, shape (m,)."""
    return np.deg2rad(np.clip(motion.latitude_deg, -LATITUDE_MAX_DEG, LATITUDE_MAX_DEG))


def radii_m(motion: CraftMotion) -> tuple[FloatArray, FloatArray]:
    """Radii of the meridian and of the prime vertical at the craft's altitude, each (m,)."""
    meridian, prime_vertical = curvature_radii_m(motion.latitude_deg)
    return meridian + motion.altitude_m, prime_vertical + motion.altitude_m


def rates_radps(motion: CraftMotion) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray, FloatArray]:
    """Earth rate north and down, craft rate (transport rate) north, east and down, each (m,)."""
    latitude = latitude_rad(motion)
    meridian, normal = radii_m(motion)
    north, east = motion.velocity_mps.T
    earth = (EARTH_RATE_RADPS * np.cos(latitude), -EARTH_RATE_RADPS * np.sin(latitude))
    return *earth, east / normal, -north / meridian, -east * np.tan(latitude) / normal
