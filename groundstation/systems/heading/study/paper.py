"""Published and stated figures of the method, measured on plain simulated processes.

The simulation is vectorised.
"""

import numpy as np
from numpy.typing import NDArray

from groundstation.base.quantiles import NORMAL_95
from groundstation.base.units import DEG_PER_RAD
from groundstation.results.figures import FigureData
from groundstation.simulation.processes import damped_oscillation, gauss_markov
from groundstation.systems.heading.recursion import run_recursion

FloatArray = NDArray[np.float64]
STEP_S = 0.1
SPEED_MPS, WHITE_MPS = 8.0, 0.05
SWAY_DEG, SWAY_HZ = 0.5, 0.4


def coverage_of_e(differences_deg: FloatArray) -> float:
    """Return the share of runs, shape (runs, n), true error 0, whose mean +- e holds 0."""
    count = differences_deg.shape[1]
    e = NORMAL_95 * np.std(differences_deg, axis=1) / np.sqrt(count - 1)
    return float(np.mean(np.abs(np.mean(differences_deg, axis=1)) <= e))


def precision_table(rng: np.random.Generator, runs: int) -> FigureData:
    """Tabulate the coverage of the paper's e on 60-s runs.

    Sway of given damping, GNSS error correlated over given times.
    """
    count = round(60.0 / STEP_S)
    labels, stated, measured = [], [], []
    for damping, figure in ((0.02, 0.99), (0.1, 0.87), (0.2, 0.73), (0.5, 0.52)):
        sway = damped_oscillation(rng, (runs, count), STEP_S, SWAY_DEG, SWAY_HZ, damping)
        labels.append(f"sway {SWAY_HZ:g} Hz, damping {damping:g}")
        stated.append(figure)
        measured.append(coverage_of_e(sway))
    for tau, figure in ((1.0, 0.42), (3.0, 0.26), (10.0, 0.13)):
        velocity = gauss_markov(rng, (runs, count), STEP_S, 0.05, tau)
        labels.append(f"GNSS 0.05 m/s correlated over {tau:g} s, at {SPEED_MPS:g} m/s")
        stated.append(figure)
        measured.append(coverage_of_e(DEG_PER_RAD * velocity / SPEED_MPS))
        labels.append(f"the same with white noise of {WHITE_MPS:g} m/s")
        stated.append(np.nan)
        measured.append(
            coverage_of_e(DEG_PER_RAD / SPEED_MPS * (velocity + WHITE_MPS * rng.standard_normal(velocity.shape)))
        )
    columns = {"errors": np.array(labels), "stated": np.array(stated), "measured": np.array(measured)}
    return FigureData("heading_paper_e", columns, {"stated": 2, "measured": 3})


def quality_table(rng: np.random.Generator, runs: int) -> FigureData:
    """Tabulate quality (spread of the running mean) on 120-s runs.

    The runs are ordinary ones, and ones with a drift of 2 deg/min.
    """
    count = round(120.0 / STEP_S)
    time_min = np.arange(count) * STEP_S / 60.0
    noise = damped_oscillation(rng, (runs, count), STEP_S, SWAY_DEG, SWAY_HZ, 0.1)
    noise = noise + DEG_PER_RAD / SPEED_MPS * 0.05 * rng.standard_normal((runs, count))
    noise = noise + DEG_PER_RAD / SPEED_MPS * gauss_markov(rng, (runs, count), STEP_S, 0.03, 3.0)
    rows = []
    for label, drift in (("ordinary", 0.0), ("drift of 2 deg/min", 2.0)):
        quality = [float(run_recursion(row + drift * time_min).quality_deg[-1]) for row in noise]
        rows.append((label, *np.quantile(quality, [0.05, 0.5, 0.95])))
    columns = {
        "run": np.array([row[0] for row in rows]),
        "p05_deg": np.array([row[1] for row in rows]),
        "median_deg": np.array([row[2] for row in rows]),
        "p95_deg": np.array([row[3] for row in rows]),
    }
    return FigureData("heading_quality", columns, {"p05_deg": 3, "median_deg": 3, "p95_deg": 3})


RECEIVERS: tuple[tuple[str, float, float, float], ...] = (
    ("white 0.065 m/s", 0.065, 0.0, 0.0),
    ("white 0.05 m/s", 0.05, 0.0, 0.0),
    ("white 0.05 and 0.02 m/s over 1 s", 0.05, 0.02, 1.0),
    ("white 0.05 and 0.03 m/s over 3 s", 0.05, 0.03, 3.0),
    ("white 0.05 and 0.03 m/s over 10 s", 0.05, 0.03, 10.0),
)


def standstill_tables(rng: np.random.Generator, runs: int, limit_mps: float = 0.01) -> tuple[FigureData, FigureData]:
    """Tabulate the length of the mean velocity at standstill over 10 s and 30 s.

    Share within the limit, and its density.
    """
    names, windows, shares, p97 = [], [], [], []
    density: dict[str, list[FloatArray]] = {"receiver": [], "window_s": [], "speed_mps": [], "density_per_mps": []}
    edges = np.linspace(0.0, 0.05, 51)
    for name, white, sigma, tau in RECEIVERS:
        velocity = white * rng.standard_normal((2, runs, 300)) + gauss_markov(rng, (2, runs, 300), STEP_S, sigma, tau)
        for seconds in (10, 30):
            mean = velocity[:, :, : seconds * 10].mean(axis=2)
            length = np.hypot(mean[0], mean[1])
            names.append(name)
            windows.append(seconds)
            shares.append(float(np.mean(length <= limit_mps)))
            p97.append(float(np.quantile(length, 0.97)))
            density["receiver"].append(np.full(50, name))
            density["window_s"].append(np.full(50, float(seconds)))
            density["speed_mps"].append(0.5 * (edges[1:] + edges[:-1]))
            density["density_per_mps"].append(np.histogram(length, edges)[0] / (runs * (edges[1] - edges[0])))
    passing = FigureData(
        "standstill_pass",
        {
            "receiver": np.array(names),
            "window_s": np.array(windows),
            "share_within_limit": np.array(shares),
            "p97_mps": np.array(p97),
        },
        {"share_within_limit": 3, "p97_mps": 4},
    )
    curves = {key: np.concatenate(parts) for key, parts in density.items()}
    return passing, FigureData("standstill_density", curves, {"speed_mps": 4, "density_per_mps": 2})


def arm_table() -> FigureData:
    """Tabulate the largest effect of an uncorrected antenna arm inside the gates.

    The gates are 1 deg/s at 6 m/s; the effect of a gentle curve is given too. A turn of given rate for 10 s in a 40-s
    run at 6 m/s shifts the mean by arm x rate / speed x 10 / 40.
    """
    arms = np.array([2.0, 5.0, 10.0])
    return FigureData(
        "heading_arm",
        {"arm_m": arms, "largest_deg": arms * 1.0 / 6.0, "curve_bias_arcmin": arms * 0.8 / 6.0 * 0.25 * 60.0},
        {"largest_deg": 2, "curve_bias_arcmin": 1},
    )
