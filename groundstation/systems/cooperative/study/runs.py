"""Runs of the cooperative study: each session simulated, filtered and judged.

A small outcome of each is kept.
"""

import os
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.dataclasses import dataclass
from groundstation.base.records import frozen
from groundstation.simulation.session import simulate_session
from groundstation.simulation.session_scenario import load_session
from groundstation.systems.cooperative.algorithms import run_algorithm
from groundstation.systems.cooperative.consistency import DIVERGED, normalised
from groundstation.systems.cooperative.events import Prepared, prepare
from groundstation.systems.cooperative.settings import CooperativeSettings
from groundstation.systems.cooperative.study.cases import settings_of
from groundstation.systems.cooperative.study.published_case import PublishedCase
from groundstation.systems.cooperative.study.source_formula import RULES, run_rule
from groundstation.systems.cooperative.tracks import AlgorithmRun

Progress = Callable[[str], None]
WORKERS = 2


@dataclass(frozen=True)
class CaseRun:
    """One run of one case.

    Parameters
    ----------
    error_m : ndarray, shape (2,)
        North and east of the judged aircraft at the time of the figure; estimate minus truth of the INS error.
    sigma_m : ndarray, shape (2,)
        Computed.
    nees : float
        Two degrees of freedom.
    other_error_m, other_sigma_m : ndarrays, shape (2,)
        Under the second algorithm.
    peer_error_m : ndarray, shape (2,)
        Of the second aircraft of the session.
    late_ratio, middle_ratio : float
        Horizontal error over computed sigma_r, root mean square over all aircraft, last tenth and middle tenth.
    radius : float
        Median spectral radius of the error map over the second half; NaN for centralised filters.
    bytes_per_frame : float
    """

    error_m: FloatArray
    sigma_m: FloatArray
    nees: float
    other_error_m: FloatArray
    other_sigma_m: FloatArray
    peer_error_m: FloatArray
    late_ratio: float
    middle_ratio: float
    radius: float
    bytes_per_frame: float

    def __post_init__(self) -> None:
        for name in ("error_m", "sigma_m", "other_error_m", "other_sigma_m", "peer_error_m"):
            object.__setattr__(self, name, frozen(getattr(self, name)))


def run_cases(
    cases: Sequence[PublishedCase], runs: int, seed: int, progress: Progress | None = None, workers: int = WORKERS
) -> dict[str, tuple[CaseRun, ...]]:
    """Run every case ``runs`` times.

    Cases of one session see the same flights, whatever the number of workers.
    """
    flown: dict[tuple[object, ...], tuple[CaseRun, ...]] = {}
    different = list({case.run: case for case in cases}.values())
    if workers <= 1 or len(different) * runs < 8:
        for case in different:
            flown[case.run] = tuple(fly(case, seed, run) for run in range(runs))
        return {case.name: flown[case.run] for case in cases}
    with ProcessPoolExecutor(min(workers, os.cpu_count() or 1), mp_context=get_context("spawn")) as pool:
        for case in different:
            own = zip(*((case, seed, run) for run in range(runs)), strict=True)
            flown[case.run] = tuple(pool.map(fly, *own, chunksize=max(1, runs // (4 * workers))))
            if progress:
                progress(f"{case.name}: {runs} runs")
    return {case.name: flown[case.run] for case in cases}


def fly(case: PublishedCase, seed: int, run: int) -> CaseRun:
    """Simulate and filter one run of a case."""
    scenario = load_session(case.session)
    settings = settings_of(scenario, case)
    simulated = simulate_session(scenario, seed, run)
    prepared = prepare(simulated.session, settings)
    done = _run(prepared, settings, case.algorithm)
    other = done
    if case.metric == "gain_over_ins":
        other = _run(prepared, settings, case.against)
    who = simulated.session.names.index(case.aircraft)
    errors = []
    for track, truth in zip(done.tracks, simulated.truth, strict=True):
        epochs = np.searchsorted(truth.time_s, track.time_s - 1e-6)
        errors.append(track.state[:, :2] - truth.states[epochs, :2])
    track, truth = done.tracks[who], simulated.truth[who]
    place = len(track.time_s) - 1 if case.at_s is None else int(np.argmin(np.abs(track.time_s - case.at_s)))
    covariance = track.horizontal_m2[place]
    at = int(np.searchsorted(truth.time_s, track.time_s[place] - 1e-6))
    other_track = other.tracks[who]
    frames = scenario.duration_s / scenario.link.frame_s
    half = len(done.map_radius) // 2
    return CaseRun(
        error_m=errors[who][place],
        sigma_m=np.sqrt(np.diag(covariance)),
        nees=float(normalised(errors[who][place][None], covariance[None])[0]),
        other_error_m=other_track.state[place, :2] - truth.states[at, :2],
        other_sigma_m=np.sqrt(np.diag(other_track.horizontal_m2[place])),
        peer_error_m=errors[min(1, len(errors) - 1)][place],
        late_ratio=_ratio(errors, done.tracks, 0.9, 1.0),
        middle_ratio=_ratio(errors, done.tracks, 0.45, 0.55),
        radius=float(np.median(done.map_radius[half:])) if len(done.map_radius) else float("nan"),
        bytes_per_frame=sum(size for _, size in done.messages.values()) / frames,
    )


def _run(prepared: Prepared, settings: CooperativeSettings, algorithm: str) -> AlgorithmRun:
    if algorithm in RULES:
        return run_rule(prepared, settings, algorithm)
    return run_algorithm(prepared, settings, algorithm)


def _ratio(errors: list[FloatArray], tracks: Sequence[object], first: float, last: float) -> float:
    squares = []
    for error, track in zip(errors, tracks, strict=True):
        sigma_r = 0.5 * track.two_sigma_r_m  # type: ignore[attr-defined]
        part = slice(int(first * len(error)), max(int(last * len(error)), 1))
        squares.append(np.mean((error[part] ** 2).sum(axis=1) / sigma_r[part] ** 2))
    return float(np.sqrt(np.mean(squares)))


def diverges(outcomes: Sequence[CaseRun]) -> bool:
    """Tell whether the late errors of all runs are beyond three computed sigma_r.

    Late: the last tenth of a run.
    """
    return not np.sqrt(np.mean([one.late_ratio**2 for one in outcomes])) <= DIVERGED  # an error that is no number too
