"""Results of a run: every vehicle's states at the times of output, and counts."""

from collections.abc import Mapping
from dataclasses import field

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.dataclasses import dataclass
from groundstation.base.records import Int64Array, frozen


@dataclass(frozen=True)
class VehicleTrack:
    """One vehicle under one algorithm.

    Parameters
    ----------
    name : str
    time_s : ndarray, shape (n,)
    position_m : ndarray, shape (n, 3)
        Estimated, frame of the session.
    state : ndarray, shape (n, m)
    covariance : ndarray, shape (n, m, m)
    height : int
        Index of the height in the state; -1 where there is none.
    """

    name: str
    time_s: FloatArray
    position_m: FloatArray
    state: FloatArray
    covariance: FloatArray
    height: int = -1

    def __post_init__(self) -> None:
        for name in ("time_s", "position_m", "state", "covariance"):
            object.__setattr__(self, name, frozen(getattr(self, name)))

    @property
    def horizontal_m2(self) -> FloatArray:
        """Covariance north, east, shape (n, 2, 2)."""
        return self.covariance[:, :2, :2]

    @property
    def two_sigma_r_m(self) -> FloatArray:
        """Twice sqrt(sx^2 + sy^2), shape (n,)."""
        return 2.0 * np.sqrt(self.covariance[:, 0, 0] + self.covariance[:, 1, 1])

    @property
    def correlation(self) -> FloatArray:
        """Correlation of the errors north and east, shape (n,); 0 where one is exact."""
        product = np.sqrt(self.covariance[:, 0, 0] * self.covariance[:, 1, 1])
        both = self.covariance[:, 0, 1]
        return np.asarray(np.divide(both, product, out=np.zeros(len(both)), where=product > 0.0))

    @property
    def sigma_up_m(self) -> FloatArray:
        """Sigma of the height, shape (n,); NaN for a vehicle whose height is no state."""
        if self.height < 0:
            return np.full(len(self.time_s), np.nan)
        return np.sqrt(self.covariance[:, self.height, self.height])


@dataclass(frozen=True)
class JudgedMeasurements:
    """Measurements as the filter judged them: innovation, sigma, used (1) or gated (-1).

    Parameters
    ----------
    event : ndarray of int, shape (r,)
        Which of the prepared events.
    innovation, sigma : ndarrays, shape (r,)
        Metres; radians of a bearing.
    mark : ndarray of int, shape (r,)
    """

    event: Int64Array
    innovation: FloatArray
    sigma: FloatArray
    mark: Int64Array

    def __post_init__(self) -> None:
        for name in ("event", "innovation", "sigma", "mark"):
            object.__setattr__(self, name, frozen(getattr(self, name)))

    def __len__(self) -> int:
        return len(self.event)


@dataclass(frozen=True)
class AlgorithmRun:
    """One algorithm over one session.

    Parameters
    ----------
    algorithm, update : str
    tracks : tuple of VehicleTrack
        In the order of the vehicles.
    judged : JudgedMeasurements
    counts : dict
        ``used``, ``gated``, ``lost``, ``unused``, ``clock_leaps``, ``reopened``, ``unsettled``.
    messages : dict of vehicle to (messages, bytes)
    map_time_s, map_radius : ndarrays, shape (w,)
        Spectral radius of the joint error map over each window; empty for a centralised filter.
    relative : dict of (vehicle, vehicle) to (time_s (n,), covariance (n, 2, 2))
        Covariance of the place of one vehicle to another, north and east, where the algorithm makes it.
    """

    algorithm: str
    update: str
    tracks: tuple[VehicleTrack, ...]
    judged: JudgedMeasurements
    counts: dict[str, int]
    messages: dict[str, tuple[int, int]]
    map_time_s: FloatArray
    map_radius: FloatArray
    relative: Mapping[tuple[int, int], tuple[FloatArray, FloatArray]] = field(default_factory=dict)
