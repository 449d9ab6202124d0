"""The Kalman core against filterpy: 6, 14, 130 and 260 states, block by block and with random ties.

At every epoch a prediction, then scalar measurements of pairs of states one after the other, as ranges between
aircraft are. filterpy predicts with full matrices and updates with one scalar at a time too, so both sides do the same
estimate. Results are compared before any ratio is recorded.
"""

import argparse
import os
from dataclasses import dataclass
from functools import partial

for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(_name, "1")  # one core on both sides

import numpy as np  # noqa: E402
from filterpy.kalman import KalmanFilter  # noqa: E402
from numpy.typing import NDArray  # noqa: E402

from benchmarks.record import ROUNDS, Book, by_turns  # noqa: E402
from groundstation.methods.kalman.filter import (  # noqa: E402
    FilterRun,
    KeptArrays,
    Measurements,
    Start,
    run_filter,
)
from groundstation.methods.kalman.transition import Transition  # noqa: E402

Array = NDArray[np.float64]
SEED = 1960
AGREE_SIGMAS = 1e-6
# states of one block, blocks, epochs, measurements at each
CASES = ((6, 1, 4000, 2), (14, 1, 2000, 4), (13, 10, 40, 20), (13, 20, 10, 40))


@dataclass(frozen=True)
class System:
    """Blocks of a stable system (b, b), driven by noise; each measurement sees one state of one or two blocks."""

    F: Array
    Q: Array
    count: int
    epoch: NDArray[np.int64]
    columns: NDArray[np.int64]
    coefficients: Array
    value: Array

    @property
    def size(self) -> int:
        """Number of states."""
        return len(self.F) * self.count


def system(block: int, count: int, epochs: int, each: int) -> System:
    """A chain of integrators that decay, blocks of it, and random pairs seen."""
    rng = np.random.default_rng(SEED)
    F = 0.98 * np.eye(block) + 0.05 * np.eye(block, k=1)
    m = epochs * each
    columns = rng.integers(0, block * count, (m, 2))
    columns[:, 1] = (columns[:, 0] + 1 + rng.integers(0, block * count - 1, m)) % (block * count)
    coefficients = np.tile([1.0, -1.0], (m, 1))
    return System(
        F, 0.1 * np.eye(block), count, np.repeat(np.arange(epochs), each), columns, coefficients, rng.normal(size=m)
    )


def by_us(given: System) -> FilterRun:
    """States and variances by the core."""
    transition = Transition.blocks(given.F[None], given.Q[None], given.count)
    seen = Measurements.of(given.epoch, given.value, given.columns, given.coefficients, 1.0)
    step = np.zeros(given.epoch[-1] + 1, dtype=np.int64)
    kept = KeptArrays(covariances=False, gains=False, variances=True)
    return run_filter(transition, step, seen, Start(np.zeros(given.size), np.eye(given.size)), kept=kept)


def by_filterpy(given: System) -> tuple[Array, Array]:
    """The same by filterpy: last states and covariance."""
    kalman = KalmanFilter(dim_x=given.size, dim_z=1)
    kalman.x, kalman.P = np.zeros(given.size), np.eye(given.size)
    kalman.F, kalman.Q = np.kron(np.eye(given.count), given.F), np.kron(np.eye(given.count), given.Q)
    H, last = np.zeros((1, given.size)), -1
    for epoch, z, columns, coefficients in zip(
        given.epoch, given.value, given.columns, given.coefficients, strict=True
    ):
        if epoch != last:
            kalman.predict()
            last = epoch
        H[:] = 0.0
        H[0, columns] = coefficients
        kalman.update(np.array([z]), R=1.0, H=H)
    return kalman.x, kalman.P


def main() -> None:
    """Measure and record."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.parse_args()
    with Book("kalman") as book:
        for block, count, epochs, each in CASES:
            given = system(block, count, epochs, each)
            ours, (x, P) = by_us(given), by_filterpy(given)
            sigma = np.sqrt(np.diag(P))
            apart = float(np.max(np.abs(ours.x[-1, :, 0] - x) / sigma))
            apart = max(apart, float(np.max(np.abs(np.sqrt(ours.record.variance[-1]) / sigma - 1.0))))
            if apart > AGREE_SIGMAS:
                raise SystemExit(f"{given.size} states: {apart:.1e} sigma apart, more than {AGREE_SIGMAS:g}")
            times = by_turns({"ours": partial(by_us, given), "peer": partial(by_filterpy, given)}, ROUNDS)
            what = f"Kalman core, {given.size} states, {epochs} epochs of {each} measurements"
            note = f"{apart:.0e} sigma apart"
            book.against(what, times["ours"], times["peer"], "filterpy", is_times=True, note=note)


if __name__ == "__main__":
    main()
