"""Coarse epochs: means over some seconds, for filtering the same flight many times."""

from dataclasses import replace

import numpy as np

from groundstation.base.dataclasses import dataclass
from groundstation.base.records import frozen
from groundstation.methods.ins_noise import InsNoise
from groundstation.methods.kalman.arrays import USED
from groundstation.systems.inertial.differences import mean_in
from groundstation.systems.inertial.filter import ChannelsRun, DifferenceEpochs
from groundstation.systems.inertial.model import FloatArray

COARSE_S = 10.0  # a Schuler period has 500 of them


@dataclass(frozen=True)
class Coarse:
    """A flight over coarse epochs.

    Parameters
    ----------
    flown : ChannelsRun
        The flight's own filter over its own epochs; what it rejected is in no mean.
    epochs : DifferenceEpochs
        Each at the mean time of the samples that measured; a reset of the INS begins one.
    begin_s, end_s : ndarrays, shape (n,)
        Times of the first and the last sample in each.
    samples : float
        How many measurements are usually in one.
    """

    flown: ChannelsRun
    epochs: DifferenceEpochs
    begin_s: FloatArray
    end_s: FloatArray
    samples: float

    def __post_init__(self) -> None:
        for name in ("begin_s", "end_s"):
            object.__setattr__(self, name, frozen(getattr(self, name)))

    @classmethod
    def of(cls, run: ChannelsRun) -> "Coarse":
        """Means over :data:`COARSE_S` of what a run used."""
        epochs = run.epochs
        begins = np.diff(np.floor((epochs.time_s - epochs.time_s[0]) / COARSE_S), prepend=-1.0) > 0.0
        interval = np.cumsum(begins | epochs.is_reset) - 1
        bins = int(interval[-1]) + 1
        both = [np.where(run.used[:, kind] == USED, run.measured(kind), np.nan) for kind in range(2)]
        measures = [np.isfinite(part).any(axis=1) for part in both]
        times = np.stack([*(np.where(known, epochs.time_s, np.nan) for known in measures), epochs.time_s], axis=1)
        at_position, at_velocity, of_all = mean_in(interval, times, bins).T
        position, velocity, drag = (mean_in(interval, part, bins) for part in (*both, epochs.drag_per_s.reshape(-1, 4)))
        time_s = np.where(
            np.isfinite(at_position), at_position, np.where(np.isfinite(at_velocity), at_velocity, of_all)
        )
        is_reset = np.bincount(interval, weights=epochs.is_reset, minlength=bins) > 0.0
        count = np.bincount(interval[measures[0] | measures[1]], minlength=bins)
        samples = float(np.median(count[count > 0])) if count.any() else 1.0
        first, last = (np.searchsorted(interval, np.arange(bins), side=side) for side in ("left", "right"))
        means = DifferenceEpochs(time_s, position, velocity, drag.reshape(-1, 2, 2), is_reset)
        return cls(run, means, epochs.time_s[first], epochs.time_s[last - 1], samples)

    def noise(self, noise: InsNoise) -> InsNoise:
        """A class's noise for these epochs: the white part of GNSS falls in a mean."""
        return replace(noise, gnss=noise.gnss.averaged(self.samples))

    def blinded(self, epoch: int, begin_s: float, end_s: float, behind_s: float) -> DifferenceEpochs:
        """Return epochs from one of the flight to a time behind a gap without measurements.

        The first epoch is included.
        """
        use = (self.begin_s > begin_s) & (self.epochs.time_s < behind_s)
        is_blind = np.append(True, self.begin_s[use] < end_s)[:, None]
        own, flown = self.epochs, self.flown.epochs
        columns = [
            np.concatenate([getattr(flown, name)[epoch : epoch + 1], getattr(own, name)[use]])
            for name in ("time_s", "position_m", "velocity_mps", "drag_per_s", "is_reset")
        ]
        columns[1:3] = [np.where(is_blind, np.nan, part) for part in columns[1:3]]
        columns[4][0] = False
        return DifferenceEpochs(*columns)
