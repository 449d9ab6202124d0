"""Session of several vehicles: their own dead reckoning, and ranges between them.

Vehicles, satellites and ground points come and go: one is there while its table has rows. Times are float seconds
since the start of the session. Positions are in one frame for all: ECEF, or a local north-east-down frame.
"""

from dataclasses import field, fields
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from groundstation.base.angles import FloatArray
from groundstation.base.dataclasses import dataclass
from groundstation.base.records import frozen

Frame = Literal["ecef", "local"]
NO_SLOT = -1


def _freeze(table: Any) -> None:
    """Make every array of a dataclass read-only.

    Text stays text, everything else becomes float64.
    """
    for item in fields(table):
        value = getattr(table, item.name)
        if isinstance(value, np.ndarray):
            object.__setattr__(table, item.name, frozen(value))


@dataclass(frozen=True)
class DeadReckoning:
    """Readings of one aircraft's INS and barometric altimeter, at its own epochs.

    Parameters
    ----------
    name : str
    time_s : ndarray, shape (n,)
        Increasing.
    position_m : ndarray, shape (n, 3)
        In the frame of the session.
    velocity_mps : ndarray, shape (n, 3)
        North, east, down.
    axes : ndarray, shape (n, 3, 3)
        Columns: north, east and down in the frame of the session; the unit matrix in a local one.
    latitude_deg : ndarray, shape (n,)
        NaN in a local frame.
    heading_deg : ndarray, shape (n,)
        Heading of the nose, NaN where unknown; only a lever arm needs it.
    """

    name: str
    time_s: FloatArray
    position_m: FloatArray
    velocity_mps: FloatArray
    axes: FloatArray
    latitude_deg: FloatArray
    heading_deg: FloatArray

    def __post_init__(self) -> None:
        _freeze(self)

    def __len__(self) -> int:
        return len(self.time_s)


@dataclass(frozen=True)
class Odometry:
    """Readings of the wheels of one ground vehicle: speed and rate of turn.

    Each is held until the next epoch.

    Parameters
    ----------
    name : str
    time_s, speed_mps, turn_rate_dps : ndarrays, shape (n,)
        Turn to the right positive (about down).
    position_m : tuple of float
        Where it stood at the first epoch, frame of the session (north, east).
    heading_deg : float
        Its heading then.
    gap_s : ndarray, shape (n,)
        Length of the gap without readings that an epoch lies in, over which the last one is held; 0 where there is
        none. Empty: none anywhere.
    """

    name: str
    time_s: FloatArray
    speed_mps: FloatArray
    turn_rate_dps: FloatArray
    position_m: tuple[float, float]
    heading_deg: float
    gap_s: FloatArray = field(default_factory=lambda: np.zeros(0))

    def __post_init__(self) -> None:
        _freeze(self)

    def __len__(self) -> int:
        return len(self.time_s)


@dataclass(frozen=True)
class GroundPoint:
    """A navigation reference point that stands still.

    Parameters
    ----------
    name : str
    position_m : tuple of float
        As everybody believes it, frame of the session.
    position_sigma_m : float
        Sigma of that belief along each horizontal axis; 0 for a surveyed point. The navigation controller sets origin
        and axes of the local frame: its error is common to all who range to it.
    place_deg : tuple of float, optional
        Latitude and longitude, where the session knows where on the globe it is.
    """

    name: str
    position_m: tuple[float, float, float]
    position_sigma_m: float = 0.0
    place_deg: tuple[float, float] | None = None


@dataclass(frozen=True)
class Ranges:
    """One-way pseudo-ranges over the link, with bearings where the sensor has them.

    One row is one measurement.

    Parameters
    ----------
    time_s : ndarray, shape (n,)
        Times of transmission, on the session's clock; not decreasing.
    receiver, source : ndarrays of text, shape (n,)
        The source is a vehicle or a ground point.
    pseudorange_m, sigma_m : ndarrays, shape (n,)
        Pseudo-range NaN for a bearing alone.
    slot : ndarray of int, shape (n,)
        Number of the time slot, rising through the session; ``NO_SLOT`` where the link has none.
    bearing_deg, bearing_sigma_deg : ndarrays, shape (n,), optional
        From the nose of the receiver, to the right positive.
    is_two_way : bool
        Two-way ranges: no clock stands in them.
    arm_m : ndarray, shape (n, 3), optional
        Known lever arms, frame of the session: that of the receiver's antenna less that of the source's.
    """

    time_s: FloatArray
    receiver: NDArray[np.str_]
    source: NDArray[np.str_]
    pseudorange_m: FloatArray
    sigma_m: FloatArray
    slot: NDArray[np.int64]
    bearing_deg: FloatArray | None = None
    bearing_sigma_deg: FloatArray | None = None
    is_two_way: bool = False
    arm_m: FloatArray | None = None

    def __post_init__(self) -> None:
        _freeze(self)

    def __len__(self) -> int:
        return len(self.time_s)

    @classmethod
    def none(cls) -> "Ranges":
        """No measurement at all."""
        empty, names = np.zeros(0), np.zeros(0, dtype=np.str_)
        return cls(empty, names, names, empty, empty, np.zeros(0, dtype=np.int64))

    def take(self, rows: Any) -> "Ranges":
        """The rows that a mask or positions select."""
        return Ranges(
            self.time_s[rows],
            self.receiver[rows],
            self.source[rows],
            self.pseudorange_m[rows],
            self.sigma_m[rows],
            self.slot[rows],
            None if self.bearing_deg is None else self.bearing_deg[rows],
            None if self.bearing_sigma_deg is None else self.bearing_sigma_deg[rows],
            self.is_two_way,
            None if self.arm_m is None else self.arm_m[rows],
        )


@dataclass(frozen=True)
class SatelliteRanges:
    """Pseudo-ranges to satellites.

    Parameters
    ----------
    time_s, pseudorange_m, sigma_m : ndarrays, shape (n,)
        Time of reception.
    receiver, satellite : ndarrays of text, shape (n,)
    position_m : ndarray, shape (n, 3)
        Positions of the satellite at emission, ECEF of the instant of emission.
    """

    time_s: FloatArray
    receiver: NDArray[np.str_]
    satellite: NDArray[np.str_]
    pseudorange_m: FloatArray
    sigma_m: FloatArray
    position_m: FloatArray

    def __post_init__(self) -> None:
        _freeze(self)

    def __len__(self) -> int:
        return len(self.time_s)

    @classmethod
    def none(cls) -> "SatelliteRanges":
        """No measurement at all."""
        empty, names = np.zeros(0), np.zeros(0, dtype=np.str_)
        return cls(empty, names, names, empty, empty, np.zeros((0, 3)))


@dataclass(frozen=True)
class Heights:
    """Heights above the session's reference from a separate instrument.

    It is another one than that which damps the vertical channel.
    """

    time_s: FloatArray
    aircraft: NDArray[np.str_]
    height_m: FloatArray
    sigma_m: FloatArray

    def __post_init__(self) -> None:
        _freeze(self)

    def __len__(self) -> int:
        return len(self.time_s)

    @classmethod
    def none(cls) -> "Heights":
        """No measurement at all."""
        empty = np.zeros(0)
        return cls(empty, np.zeros(0, dtype=np.str_), empty, empty)


@dataclass(frozen=True)
class Session:
    """Everything that the cooperative estimators take.

    Parameters
    ----------
    frame : {'ecef', 'local'}
    vehicles : tuple of DeadReckoning or Odometry
    points : tuple of GroundPoint
    ranges, satellites, heights
        Measurements.
    ranks : dict of name to int
        Rank of accuracy of vehicles and points, 0 the highest; who has none is of the lowest rank.
    """

    frame: Frame
    vehicles: tuple[DeadReckoning | Odometry, ...]
    points: tuple[GroundPoint, ...] = ()
    ranges: Ranges = field(default_factory=Ranges.none)
    satellites: SatelliteRanges = field(default_factory=SatelliteRanges.none)
    heights: Heights = field(default_factory=Heights.none)
    ranks: dict[str, int] = field(default_factory=dict)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the vehicles."""
        return tuple(vehicle.name for vehicle in self.vehicles)
