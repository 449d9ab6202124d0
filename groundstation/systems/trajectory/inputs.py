"""Input of the trajectory estimator: increments of an inertial unit, fixes of a receiver."""

from dataclasses import fields, replace

import numpy as np
from numpy.typing import NDArray

from groundstation.base.dataclasses import dataclass
from groundstation.base.records import BoolArray, frozen

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class ImuIncrements:
    """Increments of one inertial unit in the axes of its case, right-handed, in order of time.

    Parameters
    ----------
    time_s : ndarray, shape (n,)
        End of each interval, flight time, strictly increasing.
    interval_s : ndarray, shape (n,)
        Length of each interval; positive. A gap stands between two samples whose times differ by more.
    delta_angle_rad, delta_velocity_mps : ndarrays, shape (n, 3)
        Integrals of angular rate and of specific force over each interval. A unit at rest whose z axis points down
        measures -9.8 m/s2 on it.
    is_integral : bool
        True where the unit integrated; else they are point samples times the interval.
    """

    time_s: FloatArray
    interval_s: FloatArray
    delta_angle_rad: FloatArray
    delta_velocity_mps: FloatArray
    is_integral: bool = True

    def __post_init__(self) -> None:
        _freeze(self)

    def __len__(self) -> int:
        return len(self.time_s)


@dataclass(frozen=True)
class GnssFixes:
    """Fixes of one GNSS receiver at their times of validity, in order of time; NaN: absent.

    Parameters
    ----------
    time_s : ndarray, shape (m,)
        Flight time, strictly increasing.
    latitude_deg, longitude_deg, height_m : ndarrays, shape (m,)
        Of the antenna; height above the ellipsoid, or above mean sea level where there is no other.
    velocity_mps : ndarray, shape (m, 3)
        Of the antenna, north, east, down.
    position_sigma_m, velocity_sigma_mps : ndarrays, shape (m, 3)
        North, east, down, as the receiver states them, else of its class.
    is_precise : ndarray of bool, shape (m,)
        True where the fix is a carrier-phase one (RTK, PPP).
    """

    time_s: FloatArray
    latitude_deg: FloatArray
    longitude_deg: FloatArray
    height_m: FloatArray
    velocity_mps: FloatArray
    position_sigma_m: FloatArray
    velocity_sigma_mps: FloatArray
    is_precise: BoolArray

    def __post_init__(self) -> None:
        _freeze(self)

    def __len__(self) -> int:
        return len(self.time_s)


@dataclass(frozen=True)
class AidReadings:
    """Readings of an aid of one number, in order of time.

    Parameters
    ----------
    time_s : ndarray, shape (k,)
        Flight time, strictly increasing.
    value : ndarray, shape (k,)
        Height above some level, m; speed ahead, m/s.
    change : ndarray, shape (k,)
        Its rate of change.
    """

    time_s: FloatArray
    value: FloatArray
    change: FloatArray

    def __post_init__(self) -> None:
        _freeze(self)

    def __len__(self) -> int:
        return len(self.time_s)

    def take(self, index: BoolArray) -> "AidReadings":
        """The readings that a mask selects."""
        return AidReadings(self.time_s[index], self.value[index], self.change[index])


@dataclass(frozen=True)
class CompassReadings:
    """Readings of a compass whose deviation is stated, in order of time.

    Parameters
    ----------
    time_s : ndarray, shape (k,)
        Flight time, strictly increasing.
    field_nt : ndarray, shape (k, 3)
        Along body axes; NaN where the compass gives a heading itself.
    heading_deg : ndarray, shape (k,)
        Of the compass; NaN where it is to be levelled.
    declination_deg : ndarray, shape (k,)
    deviation_deg : tuple of five floats
        A to E of what is added to the compass.
    sigma_deg : float
        Of the heading so corrected; its error lasts.
    """

    time_s: FloatArray
    field_nt: FloatArray
    heading_deg: FloatArray
    declination_deg: FloatArray
    deviation_deg: tuple[float, float, float, float, float]
    sigma_deg: float

    def __post_init__(self) -> None:
        _freeze(self)

    def __len__(self) -> int:
        return len(self.time_s)

    def take(self, index: BoolArray) -> "CompassReadings":
        """The readings that a mask selects."""
        return replace(
            self,
            time_s=self.time_s[index],
            field_nt=self.field_nt[index],
            heading_deg=self.heading_deg[index],
            declination_deg=self.declination_deg[index],
        )


def _freeze(table: ImuIncrements | GnssFixes | AidReadings | CompassReadings) -> None:
    """Make the arrays of a table read-only."""
    for item in fields(table):
        if isinstance(value := getattr(table, item.name), np.ndarray):
            object.__setattr__(table, item.name, frozen(value))
