"""What a run leaves behind: every vehicle's states at the times of output, and counts."""

from collections import Counter
from dataclasses import dataclass, field

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.records import frozen
from groundstation.estimators.cooperative.events import Event
from groundstation.estimators.cooperative.vehicles import Vehicle

USED, GATED = 1, -1


@dataclass(frozen=True)
class Track:
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
        Place of the height in the state; -1 where there is none.
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
        """Of the errors north and east, shape (n,); 0 where one is exact."""
        product = np.sqrt(self.covariance[:, 0, 0] * self.covariance[:, 1, 1])
        both = self.covariance[:, 0, 1]
        return np.asarray(np.divide(both, product, out=np.zeros(len(both)), where=product > 0.0))

    @property
    def sigma_up_m(self) -> FloatArray:
        """Of the height, shape (n,); NaN for a vehicle whose height is no state."""
        if self.height < 0:
            return np.full(len(self.time_s), np.nan)
        return np.sqrt(self.covariance[:, self.height, self.height])


@dataclass(frozen=True)
class Judged:
    """One range as the filter judged it: innovation, its sigma, and whether it was used (1) or gated (-1)."""

    time_s: float
    kind: str
    receiver: int
    source: int
    innovation: float
    sigma: float
    mark: int


@dataclass(frozen=True)
class AlgorithmRun:
    """One algorithm over one session.

    Parameters
    ----------
    algorithm, update : str
    tracks : tuple of Track
        In the order of the vehicles.
    judged : tuple of Judged
        Ranges alone.
    counts : dict
        ``used``, ``gated``, ``lost``, ``unused``, ``clock_leaps``, ``reopened``.
    messages : dict of vehicle to (messages, bytes)
    map_time_s, map_radius : ndarrays, shape (w,)
        Spectral radius of the joint error map over each window; empty for a centralised filter.
    """

    algorithm: str
    update: str
    tracks: tuple[Track, ...]
    judged: tuple[Judged, ...]
    counts: dict[str, int]
    messages: dict[str, tuple[int, int]]
    map_time_s: FloatArray
    map_radius: FloatArray


@dataclass
class Recorder:
    """Collects what becomes an :class:`AlgorithmRun`."""

    vehicles: tuple[Vehicle, ...]
    counts: Counter[str] = field(default_factory=Counter)
    judged: list[Judged] = field(default_factory=list)
    messages: dict[str, tuple[int, int]] = field(default_factory=dict)
    map_time_s: list[float] = field(default_factory=list)
    map_radius: list[float] = field(default_factory=list)
    _rows: list[list[tuple[float, FloatArray, FloatArray, FloatArray]]] = field(default_factory=list)

    def __post_init__(self) -> None:
        self._rows = [[] for _ in self.vehicles]

    def keep(self, who: int, time_s: float, x: FloatArray, P: FloatArray) -> None:
        """Keep a vehicle's state at a time of output."""
        position, _ = self.vehicles[who].place(x, time_s)
        self._rows[who].append((time_s, position, x.copy(), P.copy()))

    def judge(self, event: Event, innovation: float, variance: float, mark: int) -> None:
        """Count a measurement and keep how it was judged."""
        self.counts["used" if mark == USED else "gated"] += 1
        sigma = float(np.sqrt(variance))
        self.judged.append(Judged(event.time_s, event.kind, event.receiver, event.source, innovation, sigma, mark))

    def opened(self, vehicle: Vehicle) -> None:
        """Count that nothing fitted a vehicle's estimate any more and its states in doubt were opened."""
        self.counts["clock_leaps" if vehicle.clock >= 0 else "reopened"] += 1

    def sent(self, who: int, size: int) -> None:
        """Count a message of a vehicle."""
        name = self.vehicles[who].name
        messages, total = self.messages.get(name, (0, 0))
        self.messages[name] = (messages + 1, total + size)

    def finish(self, algorithm: str, update: str) -> AlgorithmRun:
        """Everything as one frozen answer."""
        tracks = []
        for vehicle, rows in zip(self.vehicles, self._rows, strict=True):
            n, m = len(rows), vehicle.size
            tracks.append(
                Track(
                    vehicle.name,
                    np.array([row[0] for row in rows]),
                    np.array([row[1] for row in rows]).reshape(n, 3),
                    np.array([row[2] for row in rows]).reshape(n, m),
                    np.array([row[3] for row in rows]).reshape(n, m, m),
                    vehicle.height,
                )
            )
        return AlgorithmRun(
            algorithm,
            update,
            tuple(tracks),
            tuple(self.judged),
            dict(self.counts),
            dict(self.messages),
            np.array(self.map_time_s),
            np.array(self.map_radius),
        )
