"""Speed of the session smoother, beside gtsam on the same graph.

    python -m benchmarks.bench_cooperative_smoother [--session local-three-two-points] [--gtsam PYTHON]

The whole smoother is timed first. Then the linear problem of its last pass is solved twice: by the smoother's chain and
by gtsam (multifrontal Cholesky, COLAMD), one variable a vehicle and knot, one factor a reading. Both print seconds of
processor time on one thread for a solution and for a solution with the covariances of all states, and how far they are
apart. gtsam is no dependency: ``--gtsam`` names the Python of an environment of its own (``python -m venv E; E/bin/pip
install gtsam``). Building its graph is not timed.

    python -m benchmarks.bench_cooperative_smoother --runs 100 --seed 4711 [--session ...] [--silent 125 375] [--filter]

flies a session many times and prints RMS error and NEES of the smoother over aircraft and time (after the first minute
too), and the NEES of the first aircraft at start, middle and end with 99 % limits of so many runs; ``--silent``: no
point is heard between these seconds; ``--filter``: the centralised filter on the same sessions.
"""

import argparse
import os
import subprocess
import tempfile
import time
from pathlib import Path

for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "TBB_NUM_THREADS"):
    os.environ.setdefault(_name, "1")

import numpy as np  # noqa: E402

ROUNDS = 3


def best_of(call: object, rounds: int = ROUNDS) -> float:
    """Return the least processor time of several calls."""
    times = []
    for _ in range(rounds):
        start = time.process_time()
        call()  # type: ignore[operator]
        times.append(time.process_time() - start)
    return min(times)


def ours(session: str, seed: int) -> tuple[float, dict[str, np.ndarray], float, float]:
    """Return the time of the whole smoother, its last linear problem, and the times of its chain."""
    from groundstation.simulation.session import simulate_session
    from groundstation.simulation.session_scenario import load_session
    from groundstation.systems.cooperative.events import prepare
    from groundstation.systems.cooperative.smoother import smoothed
    from groundstation.systems.cooperative.smoother.chain import Chain, Problem, block
    from groundstation.systems.cooperative.study.cases import CASES, settings_of

    scenario = load_session(session)
    settings = settings_of(scenario, CASES[0])
    prepared = prepare(simulate_session(scenario, seed).session, settings)
    problems: list[Problem] = []

    class Kept(Chain):
        def __init__(self, problem: Problem) -> None:
            problems.append(problem)
            super().__init__(problem)

    whole_s = best_of(lambda: smoothed.smooth(prepared, settings))
    before, smoothed.Chain = smoothed.Chain, Kept  # type: ignore[misc]
    smoothed.smooth(prepared, settings)
    smoothed.Chain = before  # type: ignore[misc]
    problem = problems[-1]
    (span,) = problem.spans
    size, n = span.stop, problem.phi[0].shape[2]
    found: dict[str, np.ndarray] = {}

    def covariances() -> None:
        found["step"] = Chain(problem).solve()[0]
        blocks = np.empty((problem.knots, size // n, n, n))
        for knot, P, _, behind in Chain(problem).covariances():
            for vehicle in range(size // n):
                blocks[knot, vehicle] = block(P, behind, slice(vehicle * n, vehicle * n + n))
        found["blocks"] = blocks

    solve_s = best_of(lambda: Chain(problem).solve())
    both_s = best_of(covariances)
    fields = ("defect", "start", "variance", "first", "columns", "values", "residual", "weight")
    arrays = {name: getattr(problem, name) for name in fields}
    arrays |= {"phi": problem.phi[0], "noise": problem.noise[0], **found}
    print(f"{session}: {size // n} vehicles, {problem.knots} knots, {len(problem.residual)} rows")
    return whole_s, arrays, solve_s, both_s


def theirs(path: Path) -> None:
    """Solve the linear problem of a file by gtsam; print two times and the largest differences."""
    import gtsam  # type: ignore[import-not-found]

    a = np.load(path)
    t, v, n = a["noise"].shape[0] + 1, a["noise"].shape[1], a["noise"].shape[2]
    graph = gtsam.GaussianFactorGraph()

    def key(knot: int, vehicle: int) -> int:
        return knot * v + vehicle

    for vehicle in range(v):
        own = slice(vehicle * n, vehicle * n + n)
        whiten = np.diag(1.0 / np.sqrt(a["variance"][own]))
        graph.add(gtsam.JacobianFactor(key(0, vehicle), whiten, whiten @ a["start"][own], _unit(gtsam, n)))
        for knot in range(t - 1):
            root = np.linalg.inv(np.linalg.cholesky(a["noise"][knot, vehicle]))
            one, two = key(knot, vehicle), key(knot + 1, vehicle)
            b = root @ a["defect"][knot, own]
            graph.add(gtsam.JacobianFactor(one, -root @ a["phi"][knot, vehicle], two, root, b, _unit(gtsam, n)))
    knots = np.repeat(np.arange(t), np.diff(a["first"]))
    for row, knot in enumerate(knots.tolist()):
        columns, values = a["columns"][row], a["values"][row] * np.sqrt(a["weight"][row])
        b = np.array([a["residual"][row] * np.sqrt(a["weight"][row])])
        parts = []
        for vehicle in np.unique(columns[columns < v * n] // n).tolist():
            line = np.zeros((1, n))
            mine = (columns // n == vehicle) & (columns < v * n)
            line[0, columns[mine] - vehicle * n] = values[mine]
            parts += [key(knot, vehicle), line]
        graph.add(gtsam.JacobianFactor(*parts, b, _unit(gtsam, 1)))
    solve_s = best_of(graph.optimize)
    answer = graph.optimize()
    step = np.array([np.concatenate([answer.at(key(knot, one)) for one in range(v)]) for knot in range(t)])
    blocks = np.empty((t, v, n, n))

    def both() -> None:
        marginals = gtsam.Marginals(graph, graph.optimize())
        for knot in range(t):
            for one in range(v):
                blocks[knot, one] = marginals.marginalCovariance(key(knot, one))

    both_s = best_of(both)
    sigma = np.sqrt(np.einsum("kvii->kvi", a["blocks"])).reshape(t, -1)
    apart = np.abs(step - a["step"]) / sigma
    other = np.abs(np.sqrt(np.einsum("kvii->kvi", blocks)).reshape(t, -1) / sigma - 1.0)
    print(solve_s, both_s, apart.max(), other.max())


def _unit(gtsam: object, n: int) -> object:
    return gtsam.noiseModel.Unit.Create(n)  # type: ignore[attr-defined]


def honesty(session: str, runs: int, seed: int, silent: tuple[float, float], algorithm: str) -> None:
    """Fly a session many times, and print errors and NEES of an algorithm."""
    from dataclasses import replace

    from groundstation.methods.intervals import nees_limits
    from groundstation.simulation.session import simulate_session
    from groundstation.simulation.session_scenario import load_session
    from groundstation.systems.cooperative.algorithms import run_algorithm
    from groundstation.systems.cooperative.consistency import normalised
    from groundstation.systems.cooperative.events import prepare
    from groundstation.systems.cooperative.study.cases import CASES, settings_of

    scenario = load_session(session)
    settings = settings_of(scenario, CASES[0])
    squares, nees, cpu_s = [], [], 0.0
    for run in range(runs):
        simulated = simulate_session(scenario, seed, run)
        table = simulated.session.ranges
        points = [point.name for point in simulated.session.points]
        lost = np.isin(table.source, points) & (table.time_s > silent[0]) & (table.time_s < silent[1])
        prepared = prepare(replace(simulated.session, ranges=table.take(~lost)), settings)
        start = time.process_time()
        tracks = run_algorithm(prepared, settings, algorithm).tracks
        cpu_s += time.process_time() - start
        error = [
            track.state[:, :2] - truth.states[np.searchsorted(truth.time_s, track.time_s - 1e-6), :2]
            for track, truth in zip(tracks, simulated.truth, strict=True)
        ]
        squares.append([(one**2).sum(axis=1) for one in error])
        nees.append([normalised(one, track.horizontal_m2) for one, track in zip(error, tracks, strict=True)])
    square, ratio, late = np.array(squares), np.array(nees), tracks[0].time_s > 60.0
    low, high = nees_limits(2, runs, 0.99)
    first = ratio[:, 0].mean(axis=0)
    print(
        f"{session}, {algorithm}, {runs} runs, seed {seed}: RMS {np.sqrt(square.mean()):.2f} m, after the first minute "
        f"{np.sqrt(square[:, :, late].mean()):.2f} m, NEES {ratio.mean():.2f}; of one aircraft {first[0]:.2f} at the "
        f"start, {first[len(first) // 2]:.2f} in the middle, {first[-1]:.2f} at the end [{low:.2f}, {high:.2f}]; "
        f"{cpu_s / runs:.2f} s of processor time a run",
        flush=True,
    )


def main() -> None:
    """Run both."""
    parser = argparse.ArgumentParser(description="Speed of the session smoother.")
    parser.add_argument("--session", default="local-three-two-points")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--runs", type=int, default=0)
    parser.add_argument("--silent", type=float, nargs=2, default=(0.0, 0.0))
    parser.add_argument("--filter", action="store_true")
    parser.add_argument("--gtsam", help="Python of an environment that has gtsam")
    parser.add_argument("--solve", type=Path, help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.solve:
        theirs(arguments.solve)
        return
    if arguments.runs:
        for algorithm in ("smoothed", *(("centralised",) if arguments.filter else ())):
            honesty(arguments.session, arguments.runs, arguments.seed, tuple(arguments.silent), algorithm)
        return
    from benchmarks.record import Book  # not above: gtsam's Python has not what it imports

    with Book("cooperative_smoother") as book:
        whole_s, arrays, solve_s, both_s = ours(arguments.session, arguments.seed)
        book.figure(f"smoother of {arguments.session}, all passes", whole_s, "s")
        book.figure("its chain: solution", solve_s, "s")
        book.figure("its chain: solution with covariances", both_s, "s")
        if not arguments.gtsam:
            book.not_measured("beside gtsam", "gtsam has an environment of its own: --gtsam PYTHON", "gtsam")
            return
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "problem.npz"
            np.savez(path, **arrays)
            solved = [arguments.gtsam, __file__, "--solve", str(path)]
            told = subprocess.run(solved, check=True, capture_output=True, text=True).stdout
        solve, both, states, sigmas = (float(word) for word in told.split())
        apart = f"apart: states {states:.1e} sigma, sigmas {sigmas:.1e} of them"
        book.figure("gtsam: solution", solve, "s", note=apart)
        book.figure("gtsam: solution with covariances", both, "s", note=apart)


if __name__ == "__main__":
    main()
