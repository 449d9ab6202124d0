"""Runs of the landing study: each approach answered once, in separate processes."""

import os
from collections.abc import Callable, Mapping
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from multiprocessing import get_context

from groundstation.systems.planning.landing.answer import RangeLanding
from groundstation.systems.planning.landing.outcome import range_landing
from groundstation.systems.planning.landing.scenario import RangeApproach

Progress = Callable[[str], None]
WORKERS = 2


def run_approaches(
    approaches: Mapping[str, RangeApproach], trials: Mapping[str, int], seed: int, progress: Progress | None = None
) -> dict[str, RangeLanding]:
    """Return the answer of every approach, by name.

    ``trials`` is the number of simulated approaches by name, 0 for a name that it lacks.
    """
    wanted = {name: replace(one, trials=trials.get(name, 0), seed=seed) for name, one in approaches.items()}
    found: dict[str, RangeLanding] = {}
    if not any(one.trials for one in wanted.values()):
        return {name: _answer(one) for name, one in wanted.items()}
    with ProcessPoolExecutor(min(WORKERS, os.cpu_count() or 1), mp_context=get_context("spawn")) as pool:
        for name, answer in zip(wanted, pool.map(_answer, wanted.values()), strict=True):
            found[name] = answer
            if progress:
                progress(f"{name}: {wanted[name].trials} approaches")
    return found


def _answer(scenario: RangeApproach) -> RangeLanding:
    """Return the answer without its arrays.

    No table of the study needs them, and no process can hand them over.
    """
    return replace(range_landing(scenario), figures=())
