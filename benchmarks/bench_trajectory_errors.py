"""Errors of the trajectory's filter beside pyins and INSLIB, on the simulated logs of the part ``trajectory``.

Errors are those of whole logs, once a second in their second half. "squares" is the mean of squared errors over the
variance that the filter states, 1 where its sigmas hold. Attitude is that of the accelerometer's axes, made square.
pyins takes some milliseconds a sample: all sides are compared with it on one log of ``--pyins-s`` seconds.
"""

import argparse
from collections.abc import Sequence

import numpy as np
from scipy.linalg import rq

from benchmarks.bench_trajectory import CASES, DURATION_S, SIDES, Array, Found, Given, given, judged_at, words_of
from benchmarks.record import Book
from groundstation.base.angles import wrap_180
from groundstation.base.attitude import rotation_n_from_b
from groundstation.base.geodesy import curvature_radii_m
from groundstation.base.words import counted
from groundstation.simulation.imu.families import Family

Case = tuple[Family, str, float, float]
PYINS_S = 40.0


def _square_axes(matrix: Array) -> Array:
    """Turn to the accelerometer's axes, made square, from those of the case: what no filter can tell apart."""
    upper, turn = rq(np.eye(3) + matrix)
    return np.asarray(np.sign(np.diag(upper))[:, None] * turn)


def _angles_deg(n_from_b: Array) -> Array:
    """Roll, pitch and heading of rotations, shape (k, 3)."""
    roll = np.arctan2(n_from_b[:, 2, 1], n_from_b[:, 2, 2])
    heading = np.arctan2(n_from_b[:, 1, 0], n_from_b[:, 0, 0])
    return np.degrees(np.stack([roll, -np.arcsin(n_from_b[:, 2, 0]), heading], axis=1))


def errors_of(of: Given, found: Found) -> Array:
    """Errors at the judged samples, shape (k, 9): m north, east, down; m/s; deg."""
    flight, at = of.flight, judged_at(of)
    meridian, normal = curvature_radii_m(flight.latitude_deg[at])
    parallel = (normal + flight.height_m[at]) * np.cos(np.radians(flight.latitude_deg[at]))
    body = np.stack([flight.roll_deg[at], flight.pitch_deg[at], flight.heading_deg[at]], axis=1)
    truth = _angles_deg(rotation_n_from_b(body) @ _square_axes(flight.accelerometer_matrix).T)
    place = [
        np.radians(found.place[:, 0] - flight.latitude_deg[at]) * (meridian + flight.height_m[at]),
        np.radians(found.place[:, 1] - flight.longitude_deg[at]) * parallel,
        flight.height_m[at] - found.place[:, 2],
    ]
    return np.concatenate(
        [np.stack(place, axis=1), found.velocity - flight.velocity_mps[at], wrap_180(found.attitude - truth)], axis=1
    )


PARTS = (("position", 0, 3, "m"), ("velocity", 3, 6, "m/s"), ("tilt", 6, 8, "deg"), ("heading", 8, 9, "deg"))


def errors(book: Book, what: str, case: Case, sides: Sequence[str], seeds: int, duration_s: float) -> None:
    """Record RMS errors of each side, and the mean of squared errors over the filter's own variance."""
    logs = [given(*case, seed, duration_s) for seed in range(1, seeds + 1)]
    for who in sides:
        parts = [(errors_of(of, found), found.sigma) for of, found in ((of, SIDES[who](of).judged()) for of in logs)]
        error, sigma = (np.concatenate(part) for part in zip(*parts, strict=True))
        rms, squares = np.sqrt(np.mean(error**2, axis=0)), np.mean((error / sigma) ** 2, axis=0)
        for name, at, end, unit in PARTS:
            note = f"squares {np.mean(squares[at:end]):.2f}; {counted(seeds, 'log')} of {duration_s:g} s"
            if who == "INSLIB" and name == "tilt":
                note = f"{counted(seeds, 'log')} of {duration_s:g} s"  # its angles are others
            rms_of = float(np.sqrt(np.sum(rms[at:end] ** 2)))
            book.figure(f"RMS error of {name}, {who}, {what}", rms_of, unit, note=note)


def main() -> None:
    """Measure and record."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=10, help="logs of each case on which errors are judged")
    parser.add_argument("--pyins-s", type=float, default=PYINS_S, help="length of the log that pyins is judged on")
    options = parser.parse_args()
    with Book("trajectory_errors") as book:
        for case in CASES:
            what = words_of(case)
            errors(book, what, case, [who for who in SIDES if who != "pyins"], options.seeds, DURATION_S)
            errors(book, f"{what}, {options.pyins_s:g} s", case, list(SIDES), 1, options.pyins_s)


if __name__ == "__main__":
    main()
