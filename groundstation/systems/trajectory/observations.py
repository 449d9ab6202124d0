"""Observations of a pass in one list: GNSS, standstill, no slip, aids."""

from dataclasses import fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from groundstation.base.dataclasses import dataclass
from groundstation.base.records import BoolArray, Int64Array, frozen
from groundstation.systems.trajectory.fix_motion import motion_of
from groundstation.systems.trajectory.inputs import AidReadings, GnssFixes
from groundstation.systems.trajectory.states import POSITION, VELOCITY

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class Observations:
    """Measurements of up to three scalars each.

    Parameters
    ----------
    time_s : ndarray, shape (m,)
        Time by its stamp.
    kind : ndarray of int, shape (m,)
        See ``states``.
    value, variance : ndarrays, shape (m, 3)
        NaN: absent.
    is_gnss : ndarray of bool, shape (m,)
        True where the latency of GNSS shifts it.
    change : ndarray, shape (m, 3)
        Rate of the value, by which an error of its time makes an error of it: m/s, m/s2; 0 where there is none.
    """

    time_s: FloatArray
    kind: Int64Array
    value: FloatArray
    variance: FloatArray
    is_gnss: BoolArray
    change: FloatArray

    def __post_init__(self) -> None:
        for item in fields(self):
            object.__setattr__(self, item.name, frozen(getattr(self, item.name)))

    def __len__(self) -> int:
        return len(self.time_s)

    def take(self, index: Any) -> "Observations":
        """The measurements that ``index`` selects."""
        return Observations(*(getattr(self, item.name)[index] for item in fields(self)))


def joined(parts: list[Observations]) -> Observations:
    """Return several lists as one."""
    return Observations(
        *(np.concatenate([getattr(part, item.name) for part in parts]) for item in fields(Observations))
    )


def of_gnss(gnss: GnssFixes) -> Observations:
    """Return positions and velocities with the variances that the receiver states."""
    position = np.stack([np.radians(gnss.latitude_deg), np.radians(gnss.longitude_deg), gnss.height_m], axis=1)
    velocity = np.nan_to_num(motion_of(gnss))
    kinds = np.repeat([POSITION, VELOCITY], len(gnss))
    everywhere = np.ones(2 * len(gnss), dtype=bool)
    found = Observations(
        np.tile(gnss.time_s, 2),
        kinds.astype(np.int64),
        np.concatenate([position, gnss.velocity_mps]),
        np.concatenate([gnss.position_sigma_m**2, gnss.velocity_sigma_mps**2]),
        everywhere,
        np.concatenate([velocity, _slope(gnss.time_s, velocity)]),
    )
    return found.take(np.isfinite(found.value).any(axis=1))


def of_readings(readings: AidReadings, kind: int) -> Observations:
    """Return the readings of an aid of one number; the variance is in units of the model's."""
    count = len(readings)
    value, variance, change = (np.full((count, 3), np.nan) for _ in range(3))
    value[:, 0], variance[:, 0], change[:, 0] = readings.value, 1.0, readings.change
    kinds = np.full(count, kind, dtype=np.int64)
    return Observations(readings.time_s, kinds, value, variance, np.zeros(count, dtype=bool), change)


def _slope(time_s: FloatArray, values: FloatArray) -> FloatArray:
    """Return the rate of change of columns over time, 0 where there is one time only."""
    times, first, place = np.unique(time_s, return_index=True, return_inverse=True)
    if len(times) < 2:
        return np.zeros_like(values)
    return np.asarray(np.gradient(values[first], times, axis=0)[place])
