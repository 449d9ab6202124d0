"""Solution of the trajectory estimator: states over time with their sigmas."""

from dataclasses import fields

import numpy as np
from numpy.typing import NDArray

from groundstation.base.dataclasses import dataclass
from groundstation.base.records import Int64Array, frozen

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class TrackOfStates:
    """States of the body over time, and the sigmas of their errors.

    Parameters
    ----------
    time_s : ndarray, shape (k,)
        Flight time.
    segment : ndarray of int, shape (k,)
        Number of the segment: a gap of the inertial unit longer than a second begins a new one.
    latitude_deg, longitude_deg, height_m : ndarrays, shape (k,)
        Of the inertial unit; height in the datum of the GNSS fixes.
    velocity_mps : ndarray, shape (k, 3)
        North, east, down.
    roll_deg, pitch_deg, heading_deg : ndarrays, shape (k,)
        Of the body (of the case where the mounting is not known); heading true.
    position_sigma_m, velocity_sigma_mps : ndarrays, shape (k, 3)
        North, east, down.
    attitude_sigma_deg : ndarray, shape (k, 3)
        Roll, pitch, heading.
    """

    time_s: FloatArray
    segment: Int64Array
    latitude_deg: FloatArray
    longitude_deg: FloatArray
    height_m: FloatArray
    velocity_mps: FloatArray
    roll_deg: FloatArray
    pitch_deg: FloatArray
    heading_deg: FloatArray
    position_sigma_m: FloatArray
    velocity_sigma_mps: FloatArray
    attitude_sigma_deg: FloatArray

    def __post_init__(self) -> None:
        for item in fields(self):
            object.__setattr__(self, item.name, frozen(getattr(self, item.name)))

    def __len__(self) -> int:
        return len(self.time_s)
