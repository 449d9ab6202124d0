"""INS errors: filter and smoother against the same model in filterpy, the hindcast map, the forecast study.

One flight of 16 000 epochs, two channels of six states, position and velocity measured at 1 Hz. filterpy predicts and
updates channel by channel and smooths with its own rts_smoother. Both sides take turns, warm, and figures are processor
seconds, best of several rounds; results are compared before any ratio is printed.
"""

import argparse
import os
import time
from collections.abc import Callable, Sequence

for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(_name, "1")  # one core: threads cost six-by-six products more than they give

import numpy as np  # noqa: E402
from filterpy.kalman import KalmanFilter  # noqa: E402
from numpy.typing import NDArray  # noqa: E402

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
RATIO_GOAL, MAP_GOAL_S, STUDY_GOAL_S = 100.0, 1.0, 120.0
STUDY_RUNS = 200
ROUNDS, OURS_A_ROUND = 4, 5
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


def seconds_of(do: Callable[[], object], times: int = 1) -> float:
    """Processor seconds of one of ``times`` calls."""
    begin = time.process_time()
    for _ in range(times):
        do()
    return (time.process_time() - begin) / times


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
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--runs", type=int, default=20, help="flights a case of the study (0: leave it out)")
    runs = parser.parse_args().runs
    run = matched_run(1, 0, duration_s=EPOCHS - 1).run
    apart = largest_difference(run)  # warms both sides up as well
    full_map(run)
    rounds = [
        (seconds_of(lambda: by_filterpy(run)), seconds_of(lambda: by_us(run), OURS_A_ROUND)) for _ in range(ROUNDS)
    ]
    theirs, ours = (min(part) for part in zip(*rounds, strict=True))
    print(f"filter and smoother, {EPOCHS} epochs, two channels: filterpy {theirs:.2f} s, ours {1e3 * ours:.1f} ms")
    print(f"  {theirs / ours:.0f} times as fast; largest difference {apart:.1e} sigma")
    errors = full_map(run)
    mapped = min(seconds_of(lambda: full_map(run)) for _ in range(ROUNDS))
    print(f"full hindcast map, {errors} errors of {len(FORECAST_METHODS)} methods: {mapped:.2f} s on one core")
    alone = [method for method in FORECAST_METHODS if method != "noise_bank"]  # that one runs filters of its own
    by_alone = min(seconds_of(lambda: full_map(run, alone)) for _ in range(ROUNDS))
    print(f"  of {len(alone)} methods, without the bank of noise sets: {by_alone:.2f} s")
    met = theirs / ours >= RATIO_GOAL and mapped <= MAP_GOAL_S and apart <= AGREE_SIGMAS
    if runs:
        begin, processor = time.perf_counter(), time.process_time()
        study_forecast(runs=runs)
        clock, cores = time.perf_counter() - begin, time.process_time() - processor
        whole = clock * STUDY_RUNS / runs
        print(f"study, {runs} flights a case: {clock:.0f} s ({cores:.0f} s of processor), {STUDY_RUNS}: {whole:.0f} s")
        met &= whole <= STUDY_GOAL_S
    goals = f"{RATIO_GOAL:g} times, map {MAP_GOAL_S:g} s, study {STUDY_GOAL_S:g} s, same within {AGREE_SIGMAS:g} sigma"
    print(f"goals ({goals}): {'met' if met else 'NOT met on this machine now'}")


if __name__ == "__main__":
    main()
