"""Count of the samples of an inertial unit at the end of its range, batch by batch."""

import math
from dataclasses import field

import numpy as np
from numpy.typing import NDArray

from groundstation.base.dataclasses import dataclass
from groundstation.base.records import Column, RecordBatch
from groundstation.base.signals import kind_of
from groundstation.base.units import DEG_PER_RAD

FloatArray = NDArray[np.float64]

IMU = "imu"
FEWEST_ALIKE = 3  # samples one after the other at the largest value of a log: the sensor could not follow
SAME = 1e-6  # relative difference of samples that are one value, rounded in single precision
LEAST_RATE_DPS, LEAST_ACCEL_MPS2 = 100.0, 18.0  # no unit ends below: there, values repeat by their resolution
_CLIPPING = ("gyro_clipping", "accel_clipping")


def is_inertial(topic: str) -> bool:
    """Tell whether a topic is of an inertial unit."""
    return kind_of(topic) == IMU


@dataclass
class _End:
    """Samples at the largest value met so far, where several stand in a row."""

    least: float
    value: float = 0.0
    count: int = 0
    run: int = 0  # samples at that value right before the next batch

    def reaches(self, most: float) -> bool:
        """Tell whether values up to ``most`` have to be looked at; where not, no run goes on."""
        if most < self.least or most < self.value * (1.0 - SAME):
            self.run = 0
            return False
        return True

    def add(self, values: FloatArray, most: float, *, is_low: bool = False) -> None:
        """Count the samples at the largest value, ``most`` of these.

        ``is_low``: the lower end is meant, and ``most`` is that of the values with the other sign.
        """
        if most > self.value * (1.0 + SAME):
            self.value, self.count, self.run = most, 0, 0
        least = self.value * (1.0 - SAME)
        rows = np.flatnonzero(values <= -least if is_low else values >= least)  # few, mostly
        borders = np.flatnonzero(np.diff(rows) > 1)
        starts, ends = rows[np.concatenate(([0], borders + 1))], rows[np.concatenate((borders, [-1]))] + 1
        for start, end in zip(starts.tolist(), ends.tolist(), strict=True):
            before = self.run if start == 0 else 0
            length = before + end - start
            if length >= FEWEST_ALIKE:
                self.count += length - (before if before >= FEWEST_ALIKE else 0)
        goes_through = starts[0] == 0 and ends[0] == len(values)
        self.run = (self.run if goes_through else 0) + (len(values) - int(starts[-1]) if ends[-1] == len(values) else 0)


@dataclass
class InertialTally:
    """Counts of one inertial unit, growing batch by batch.

    Attributes
    ----------
    increments_s : float
        Sum of the intervals of its increments.
    """

    increments_s: float = 0.0
    _ends: dict[str, tuple[_End, _End]] = field(default_factory=dict)
    _clipped: dict[str, int] = field(default_factory=dict)

    def add(self, batch: RecordBatch) -> None:
        """Count a batch."""
        interval = batch.columns.get("interval_s")
        if interval is not None:
            known_s = interval.values[interval.mask].astype(np.float64)
            self.increments_s += float(known_s[np.isfinite(known_s)].sum())
        for name, column in batch.columns.items():
            if name in _CLIPPING:
                with np.errstate(invalid="ignore"):
                    self._clipped[name] = self._clipped.get(name, 0) + int(((column.values > 0) & column.mask).sum())
                continue
            values = _rate_of(name, column, batch)
            if values is not None and not math.isfinite(values.max(initial=0.0) - values.min(initial=0.0)):
                values = values[np.isfinite(values)]
            if values is not None and len(values):
                least = LEAST_RATE_DPS if name.startswith(("rate", "delta_angle")) else LEAST_ACCEL_MPS2
                high, low = self._ends.setdefault(name, (_End(least), _End(least)))
                most, lowest = float(values.max()), float(values.min())
                if high.reaches(most):
                    high.add(values, most)
                if low.reaches(-lowest):
                    low.add(values, -lowest, is_low=True)

    def at_end(self, name: str) -> int:
        """Return how many samples of a field met the end of the range."""
        high, low = self._ends.get(name, (_End(0.0), _End(0.0)))
        return self._clipped.get(name, 0) + high.count + low.count


def _rate_of(name: str, column: Column, batch: RecordBatch) -> FloatArray | None:
    """Return rates in degrees per second, or specific force; None of another field.

    Those of increments are means over their interval; they need not be finite.
    """
    if name.startswith(("rate_", "accel_")):
        values = column.values if column.present is None else column.values[column.present]
        values = values.astype(np.float64, copy=False)
    elif name.startswith("delta_"):
        interval = batch.columns.get("velocity_interval_s") if name.startswith("delta_velocity") else None
        interval = interval or batch.columns.get("interval_s")
        if interval is None:
            return None
        known = column.mask & interval.mask
        with np.errstate(divide="ignore", invalid="ignore"):
            values = column.values[known].astype(np.float64) / interval.values[known]
        values = values * DEG_PER_RAD if name.startswith("delta_angle") else values
    else:
        return None
    return values
