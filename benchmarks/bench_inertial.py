"""INS errors: filter and smoother against the same model in filterpy, the hindcast map, the forecast study.

One flight of 16 000 epochs, two channels of six states, position and velocity measured at 1 Hz. filterpy predicts and
updates channel by channel and smooths with its own rts_smoother. Results are compared before any ratio is recorded.
"""

import argparse
import os
import time
from collections.abc import Sequence
from functools import partial

for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(_name, "1")  # one core: threads cost six-by-six products more than they give

import numpy as np  # noqa: E402
from filterpy.kalman import KalmanFilter  # noqa: E402
from numpy.typing import NDArray  # noqa: E402

from benchmarks.record import ROUNDS, Book, Goal, by_turns  # noqa: E402
from groundstation.results.forecast_methods import FORECAST_METHODS  # noqa: E402
from groundstation.systems.inertial.filter import (  # noqa: E402
    ChannelsRun,
    SmoothedErrors,
    measurement_variances,
    run_filter,
    smooth,
)
from groundstation.systems.inertial.hindcast import hindcast  # noqa: E402
from groundstation.systems.inertial.leads import leads_of, start_epochs  # noqa: E402
from groundstation.systems.inertial.settings import InertialSettings  # noqa: E402
from groundstation.systems.inertial.study.consistency import matched_run  # noqa: E402
from groundstation.systems.inertial.study.forecast import study_forecast  # noqa: E402

EPOCHS = 16_000
RATIO_GOAL, MAP_GOAL, STUDY_GOAL = Goal(100.0, "at least"), Goal(1.0), Goal(300.0)
STUDY_RUNS = 200
OURS_A_ROUND = 5
GRID_S = 60.0
AGREE_SIGMAS = 1e-6  # filterpy inverts unscaled covariances, metres beside 1e-13 rad/s^2

Array = NDArray[np.float64]
Peer = tuple[Array, Array, Array]


def by_filterpy(run: ChannelsRun) -> Peer:
    """Filtered and smoothed states, shapes (n, 6, 2), and sigmas of the smoothed, by filterpy."""
    phi, Q = run.steps.transitions[run.steps.index[1]], run.steps.noises[run.steps.index[1]]
    n, parts = len(run.epochs), []
    for channel in range(2):
        kalman = KalmanFilter(dim_x=6, dim_z=2)
        kalman.x, kalman.P = np.zeros(6), np.diag(run.noise.initial_variances())
        kalman.F, kalman.Q, kalman.H = phi, Q, np.eye(2, 6)
        kalman.R = np.diag(measurement_variances(run.epochs, run.noise)[0])
        z = np.stack([run.epochs.position_m[:, channel], run.epochs.velocity_mps[:, channel]], axis=1)
        x, P = np.empty((n, 6)), np.empty((n, 6, 6))
        for k in range(n):
            if k:
                kalman.predict()
            kalman.update(z[k])
            x[k], P[k] = kalman.x, kalman.P
        xs, Ps, _, _ = kalman.rts_smoother(x, P, np.tile(phi, (n, 1, 1)), np.tile(Q, (n, 1, 1)))
        parts.append((x, xs, np.sqrt(np.einsum("nii->ni", Ps))))
    filtered, smoothed, sigma = (np.stack(part, axis=2) for part in zip(*parts, strict=True))
    return filtered, smoothed, sigma


def by_us(run: ChannelsRun) -> tuple[ChannelsRun, SmoothedErrors]:
    """The same by ours."""
    again = run_filter(run.epochs, run.model, run.noise)
    return again, smooth(again)


def full_map(run: ChannelsRun, methods: Sequence[str] = tuple(FORECAST_METHODS)) -> int:
    """Errors from every minute's start to every minute's lead until the end of the flight, by some methods."""
    span_s = float(run.epochs.time_s[-1])
    at = start_epochs(run.epochs, GRID_S, GRID_S)
    replay = hindcast(run, at, leads_of(GRID_S, span_s), methods, InertialSettings())
    return sum(int(np.isfinite(replay.radial_m(method)).sum()) for method in methods)


def largest_difference(run: ChannelsRun) -> float:
    """Largest difference between the two, in sigmas: filtered and smoothed."""
    ours, smoothed = by_us(run)
    filtered, theirs, _ = by_filterpy(run)
    sigma = np.stack([ours.sigma(0), ours.sigma(1)], axis=2)
    return max(
        float(np.max(np.abs(ours.x - filtered) / sigma)),
        float(np.max(np.abs(smoothed.x - theirs) / np.sqrt(smoothed.variance))),
    )


def main() -> None:
    """Measure and record."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--runs", type=int, default=0, help="flights a case of the study (0: leave it out)")
    runs = parser.parse_args().runs
    run = matched_run(1, 0, duration_s=EPOCHS - 1).run
    with Book("inertial") as book:
        apart = largest_difference(run)
        assert apart <= AGREE_SIGMAS, f"{apart:.1e} sigma apart"
        alone = [method for method in FORECAST_METHODS if method != "noise_bank"]  # that one runs filters of its own
        works = {
            "ours": partial(by_us, run),
            "peer": partial(by_filterpy, run),
            "map": partial(full_map, run),
            "alone": partial(full_map, run, alone),
        }
        times = by_turns(works, ROUNDS, {"ours": OURS_A_ROUND})
        what = f"filter and smoother of INS errors, {EPOCHS} epochs, two channels of six states"
        given = {"goal": RATIO_GOAL, "is_times": True, "note": f"{apart:.0e} sigma apart"}
        book.against(what, times["ours"], times["peer"], "filterpy", **given)
        for name, methods in (("map", len(FORECAST_METHODS)), ("alone", len(alone))):
            book.figure(f"full hindcast map, {methods} methods", times[name].processor_s, "s", goal=MAP_GOAL)
        if runs:
            begin, before = time.perf_counter(), os.times()
            study_forecast(runs=runs)
            whole_s, after = (time.perf_counter() - begin) * STUDY_RUNS / runs, os.times()
            note, what = f"from {runs} flights a case", f"study forecast, {STUDY_RUNS} flights"
            book.figure(what, whole_s, "s by the clock", goal=STUDY_GOAL, note=note)
            # what other programs do on the machine is not in it
            processor_s = sum(after[:4]) - sum(before[:4])
            book.figure(f"{what}, all processes", processor_s * STUDY_RUNS / runs, "s", note=note)


if __name__ == "__main__":
    main()
