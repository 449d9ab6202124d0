"""Offset and drift between the clocks of two logs of a flight, with 95 % intervals."""

from typing import Literal

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.dataclasses import dataclass
from groundstation.base.quantiles import NORMAL_95
from groundstation.base.records import Int64Array
from groundstation.base.units import NS_PER_S
from groundstation.systems.several_logs.gnss_time import GnssTime
from groundstation.tables.table import Flight

Method = Literal["gnss_time", "motion", "gnss_time_and_motion", "file_time"]


@dataclass(frozen=True)
class TimedLog:
    """A log by its tables, and GNSS time where it tells it."""

    flight: Flight
    gnss_time: GnssTime | None = None

    @property
    def name(self) -> str:
        """Name of its file."""
        return self.flight.source_name

    @property
    def end_ns(self) -> int:
        """Time of its last sample."""
        return self.flight.start_ns + round(self.flight.duration_s * NS_PER_S)


@dataclass(frozen=True)
class RelationStretch:
    """Lag and drift between the clocks of two logs over one stretch.

    First time = other time + ``lag_s`` - ``drift`` (other time - ``middle_s``), seconds of both flights. Sigmas are
    such that 1.96 of them hold the truth in 95 of 100 cases; infinite where nothing tells. ``drift`` is positive where
    the other clock is fast.
    """

    begin_s: float
    middle_s: float
    lag_s: float
    lag_sigma_s: float
    drift: float
    drift_sigma: float
    method: Method

    def lag_at(self, other_s: FloatArray | float) -> FloatArray:
        """Return what is added to seconds of the other log to give those of the first."""
        return np.asarray(self.lag_s - self.drift * (np.asarray(other_s) - self.middle_s))

    def sigma_at(self, other_s: FloatArray | float) -> FloatArray:
        """Return one sigma of :meth:`lag_at`, seconds."""
        return np.asarray(np.hypot(self.lag_sigma_s, self.drift_sigma * (np.asarray(other_s) - self.middle_s)))


@dataclass(frozen=True)
class LogRelation:
    """Relation of the clock of the other log to that of the first.

    Parameters
    ----------
    first_start_ns, other_start_ns : int
        Starts of the two flights, each on its own clock.
    stretches : tuple of RelationStretch
        In order of time; more than one where a clock was set.
    signals : tuple of str
        What of the motion was compared, of ``first_topic`` and ``other_topic``; empty where nothing could be.
    correlation : float or None
        Of the two motions.
    gnss_less_motion_s, gnss_less_motion_sigma_s : float or None
        What GNSS time says of the lag less what the motion says, where both tell.
    reason : str
        What the relation rests on, and why not on more.
    remarks : tuple of str
        What a user must know of it: contradictions, steps.
    """

    first_start_ns: int
    other_start_ns: int
    stretches: tuple[RelationStretch, ...]
    first_topic: str = ""
    other_topic: str = ""
    signals: tuple[str, ...] = ()
    correlation: float | None = None
    gnss_less_motion_s: float | None = None
    gnss_less_motion_sigma_s: float | None = None
    reason: str = ""
    remarks: tuple[str, ...] = ()

    @property
    def method(self) -> Method:
        """Method of the first stretch; every stretch has its own."""
        return self.stretches[0].method

    def seconds(self, other_ns: Int64Array) -> FloatArray:
        """Seconds of the other flight."""
        return np.asarray((np.asarray(other_ns, dtype=np.int64) - self.other_start_ns) / NS_PER_S)

    def stretch_of(self, other_s: FloatArray) -> Int64Array:
        """Number of the stretch that seconds of the other flight lie in, shape as given."""
        begins = np.array([one.begin_s for one in self.stretches])
        return np.asarray(np.maximum(np.searchsorted(begins, other_s, side="right") - 1, 0), dtype=np.int64)

    def first_time_ns(self, other_ns: Int64Array) -> Int64Array:
        """Times of the other log on the clock of the first, shape as given."""
        other_s = self.seconds(other_ns)
        number = self.stretch_of(other_s)
        lag_s = self._of_stretch(number, [one.lag_at(other_s) for one in self.stretches])
        base_ns = self.first_start_ns - self.other_start_ns
        return np.asarray(other_ns + base_ns + np.rint(lag_s * NS_PER_S).astype(np.int64), dtype=np.int64)

    def half_width95_s(self, other_ns: Int64Array) -> FloatArray:
        """Return half of the 95 % interval of :meth:`first_time_ns`, seconds.

        Infinite where nothing tells it.
        """
        other_s = self.seconds(other_ns)
        number = self.stretch_of(other_s)
        return NORMAL_95 * self._of_stretch(number, [one.sigma_at(other_s) for one in self.stretches])

    @staticmethod
    def _of_stretch(number: Int64Array, values: list[FloatArray]) -> FloatArray:
        """Pick for each time the value by the stretch that it is in; any number of stretches."""
        return np.asarray(np.take_along_axis(np.stack(values), np.asarray(number)[None], axis=0)[0])
