"""Consistency of the filter on channels of which its model is exactly true.

NEES of all six states and NIS against chi-square.
"""

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.dataclasses import dataclass
from groundstation.base.quantiles import chi_square_quantile
from groundstation.base.records import Int64Array
from groundstation.base.units import MPS2_PER_G
from groundstation.methods.ins_noise import GnssNoise
from groundstation.results.figures import FigureData
from groundstation.simulation.channel_truth import POSITION, RADIUS_M, VELOCITY, channel_truth
from groundstation.simulation.ins_class import load_ins_class
from groundstation.systems.inertial.filter import ChannelsRun, DifferenceEpochs, run_filter
from groundstation.systems.inertial.model import SIZE, ChannelModel
from groundstation.systems.inertial.study.cases import matched_noise
from groundstation.systems.study import mapped

RUNS = 100
DURATION_S = 16_000
TIMES_S = (60, 600, 1800, 3600, 5400, 10_800, 16_000)
POSITION_M, VELOCITY_MPS = 10.0, 0.03
TAIL = 0.005


@dataclass(frozen=True)
class MatchedRun:
    """A filter run and the states that were true, shape (n, 6, c)."""

    run: ChannelsRun
    truth: FloatArray

    def nees(self, epoch: int) -> float:
        """Return NEES of all states over both channels at an epoch; 12 on average.

        NEES: squared error normalised by the filter's covariance.
        """
        error = self.run.x[epoch] - self.truth[epoch]
        total = 0.0
        for channel in range(error.shape[1]):
            P = self.run.covariance(channel)[epoch]
            scale = np.sqrt(np.diag(P))  # from metres to 1e-14 rad/s^2: correlations are solved, not covariances
            normal = error[:, channel] / scale
            total += float(normal @ np.linalg.solve(P / np.outer(scale, scale), normal))
        return total


def matched_run(seed: int, number: int, *, duration_s: int = DURATION_S, uses_velocity: bool = True) -> MatchedRun:
    """Draw run ``number`` of a seed and filter it with the true model.

    I-21-like channels, white GNSS at 1 Hz.
    """
    rng, ins = np.random.default_rng((seed, number)), load_ins_class("i-21")
    states = np.moveaxis(channel_truth(ins, duration_s + 1, 1.0, rng).states, 0, 2)
    noise = matched_noise(ins, GnssNoise(POSITION_M, 0.0, 0.0, VELOCITY_MPS, 0.0, 0.0, is_inflated=False))
    white = rng.standard_normal((2, *states[:, POSITION].shape))
    velocity = states[:, VELOCITY] + VELOCITY_MPS * white[1]
    epochs = DifferenceEpochs.plain(
        np.arange(duration_s + 1, dtype=np.float64),
        states[:, POSITION] + POSITION_M * white[0],
        velocity if uses_velocity else np.full_like(velocity, np.nan),
    )
    return MatchedRun(run_filter(epochs, ChannelModel(MPS2_PER_G, RADIUS_M, noise.beta_per_s), noise), states)


def _judged(job: tuple[int, int, bool]) -> tuple[list[float], FloatArray, Int64Array]:
    """Return the NEES of a run at some times, and sums and counts of its NIS, shape (2,)."""
    seed, number, uses_velocity = job
    matched = matched_run(seed, number, uses_velocity=uses_velocity)
    ratio = np.square(matched.run.innovation) / matched.run.innovation_variance
    known = np.isfinite(ratio)
    nees = [matched.nees(epoch) for epoch in TIMES_S]
    return nees, np.where(known, ratio, 0.0).sum(axis=(0, 2)), known.sum(axis=(0, 2))


def consistency_table(seed: int, runs: int = RUNS, *, uses_velocity: bool = True) -> FigureData:
    """Tabulate mean NEES per state at some times, and mean NIS, over ``runs`` flights.

    NIS is that of position and velocity over all epochs. 1 is honest; limits are those of 99 % of chi-square with
    ``freedom`` degrees of freedom: flights and channels are independent, and so are innovations of one another.
    """
    nees, nis, count = np.zeros(len(TIMES_S)), np.zeros(2), np.zeros(2, dtype=np.int64)
    with mapped(runs) as each:
        for of_run in each(_judged, [(seed, number, uses_velocity) for number in range(runs)]):
            nees += of_run[0]
            nis += of_run[1]
            count += of_run[2]
    freedom = np.array([2 * SIZE * runs] * len(TIMES_S) + [number for number in count.tolist() if number])
    total = np.concatenate([nees, nis[count > 0]])
    names = [f"NEES at {seconds} s" for seconds in TIMES_S] + ["NIS position", "NIS velocity"][: int((count > 0).sum())]
    low, high = (chi_square_quantile(part, freedom) / freedom for part in (TAIL, 1.0 - TAIL))
    mean = total / freedom
    columns = {
        "measure": np.array(names),
        "freedom": freedom,
        "mean": mean,
        "low": low,
        "high": high,
        "inside": (mean >= low) & (mean <= high),
    }
    return FigureData("forecast_consistency", columns, {"mean": 4, "low": 4, "high": 4})
