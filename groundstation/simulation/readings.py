"""Readings of a sensor: columns rounded to its resolution at recorded times.

They are not yet put together into a log.
"""

from collections.abc import Mapping
from dataclasses import field
from types import MappingProxyType
from zlib import crc32

import numpy as np

from groundstation.base.angles import FloatArray, wrap_360
from groundstation.base.dataclasses import dataclass
from groundstation.base.records import Column, Int64Array, frozen
from groundstation.base.units import NS_PER_S
from groundstation.simulation.trajectory import Trajectory

ROUNDING_NUDGE = 1e-6  # in steps of the resolution


@dataclass(frozen=True)
class TopicReadings:
    """One topic's samples in order of recording.

    Parameters
    ----------
    topic : str
    time_ns : ndarray of int64, shape (n,)
        Recorded time since log zero.
    columns : mapping of name to Column
    resolution : mapping of name to float
        Step to which a numeric field was rounded, in the field's unit.
    """

    topic: str
    time_ns: Int64Array
    columns: Mapping[str, Column]
    resolution: Mapping[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        object.__setattr__(self, "time_ns", frozen(self.time_ns))
        object.__setattr__(self, "columns", MappingProxyType(dict(self.columns)))
        object.__setattr__(self, "resolution", MappingProxyType(dict(self.resolution)))

    def only(self, names: tuple[str, ...]) -> "TopicReadings":
        """Keep the named fields, in canonical order; all where none is named."""
        if not names:
            return self
        columns = {name: column for name, column in self.columns.items() if name in names}
        return TopicReadings(self.topic, self.time_ns, columns, self.resolution)


def generator(seed: int, stream: str) -> np.random.Generator:
    """Return a random generator of its own for each named stream.

    So one sensor's settings never move another's noise.

    Examples
    --------
    >>> first, second = generator(1, "ins"), generator(1, "gnss")
    >>> bool(first.standard_normal() == second.standard_normal())
    False
    """
    return np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(crc32(stream.encode()),)))


def every(trajectory: Trajectory, rate_hz: float) -> Int64Array:
    """Positions of the samples of a rate on the trajectory's grid, from the first row on."""
    stride = round(NS_PER_S / rate_hz / trajectory.step_ns)
    return np.arange(0, len(trajectory), stride, dtype=np.int64)


def quantised(values: FloatArray, resolution: float) -> FloatArray:
    """Round to a multiple of the resolution.

    The nudge moves the edge between two steps off the round values that noiseless motion likes to hit, where the last
    bit of a sine, which differs between machines, would decide.

    Examples
    --------
    >>> quantised(np.array([1.2345, -0.0001]), 0.001).tolist()
    [1.235, 0.0]
    """
    steps = np.floor(np.asarray(values) / resolution + 0.5 + ROUNDING_NUDGE)
    if resolution < 1.0 and abs(round(1.0 / resolution) * resolution - 1.0) < 1e-12:
        return np.asarray(steps / round(1.0 / resolution))  # correctly rounded: prints and parses as the decimal
    return np.asarray(steps * resolution)


def in_steps(values: FloatArray, resolution: float) -> FloatArray:
    """Round to a multiple of the resolution; one of zero rounds nothing."""
    return quantised(values, resolution) if resolution else np.asarray(values)


def quantised_heading(heading_deg: FloatArray, resolution_deg: float) -> FloatArray:
    """Round headings and keep them in [0, 360): 359.9996 becomes 0, not 360.

    Examples
    --------
    >>> quantised_heading(np.array([359.9996, -0.001]), 0.001).tolist()
    [0.0, 359.999]
    """
    rounded = quantised(wrap_360(heading_deg), resolution_deg)
    return np.where(rounded >= 360.0, 0.0, rounded)
