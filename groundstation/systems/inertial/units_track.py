"""Tracks of several INS and of the reference, as the comparison of units takes them."""

from dataclasses import fields

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.dataclasses import dataclass
from groundstation.base.records import frozen
from groundstation.tables.sources import UNKNOWN


class _Frozen:
    def __post_init__(self) -> None:
        for item in fields(self):  # type: ignore[arg-type]
            value = getattr(self, item.name)
            if isinstance(value, np.ndarray):
                object.__setattr__(self, item.name, frozen(value))


@dataclass(frozen=True)
class UnitTrack(_Frozen):
    """Output of one INS over time; NaN where a value is missing.

    Parameters
    ----------
    topic : str
    time_s : ndarray, shape (n,)
        Flight seconds, increasing.
    latitude_deg, longitude_deg : ndarray, shape (n,)
    velocity_mps : ndarray, shape (n, 2)
        North and east.
    heading_deg, altitude_m : ndarray, shape (n,), optional
    kind, kind_reason : str
        Whether GNSS corrects it, and who says so (:mod:`groundstation.tables.sources`).
    serials : tuple of (float, str)
        Flight seconds from which each serial holds.
    start_s : float or None
        Start of navigation, flight seconds; None where nothing proves it.
    ins_class : str
        Class that is stated of this unit; empty where it is that of the flight.
    """

    topic: str
    time_s: FloatArray
    latitude_deg: FloatArray
    longitude_deg: FloatArray
    velocity_mps: FloatArray
    heading_deg: FloatArray | None = None
    altitude_m: FloatArray | None = None
    kind: str = UNKNOWN
    kind_reason: str = ""
    serials: tuple[tuple[float, str], ...] = ()
    start_s: float | None = None
    ins_class: str = ""


@dataclass(frozen=True)
class ReferenceTrack(_Frozen):
    """Reference that the units are held against: GNSS, or the best trajectory.

    Parameters
    ----------
    topic, title : str
        Its topic, and words for it: "gnss", "the best trajectory".
    time_s : ndarray, shape (n,)
    latitude_deg, longitude_deg : ndarray, shape (n,)
    velocity_mps : ndarray, shape (n, 2)
    position_sigma_m, velocity_sigma_mps : float
        Error of one axis that lasts over the correlation time.
    position_correlation_s, velocity_correlation_s : float
    heading_deg : ndarray, shape (n,), optional
    """

    topic: str
    title: str
    time_s: FloatArray
    latitude_deg: FloatArray
    longitude_deg: FloatArray
    velocity_mps: FloatArray
    position_sigma_m: float = 3.6
    velocity_sigma_mps: float = 0.05
    position_correlation_s: float = 300.0
    velocity_correlation_s: float = 60.0
    heading_deg: FloatArray | None = None
