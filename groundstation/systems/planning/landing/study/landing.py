"""Study of landing by ranges and by NDBs: every published figure with ours beside it."""

import os
from collections.abc import Callable, Mapping
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from multiprocessing import get_context

from groundstation.systems.planning.landing.answer import RangeLanding
from groundstation.systems.planning.landing.outcome import range_landing
from groundstation.systems.planning.landing.scenario import RangeApproach
from groundstation.systems.planning.landing.study.bearings import BEACONS_M, bearing_spans, bearing_table
from groundstation.systems.planning.landing.study.cases import FIRST_SEED, FLOWN, PUBLISHED, approach, variations
from groundstation.systems.planning.landing.study.tables import (
    category_table,
    order_table,
    sigma_table,
    trial_table,
    variation_table,
)
from groundstation.systems.study import StudyResult, section, table

DRAWS_A_RUN = 100  # of bearings, which cost next to nothing
Progress = Callable[[str], None]
WORKERS = 2


def study_landing(runs: int = 100, seed: int = 0, progress: Progress | None = None) -> StudyResult:
    """Answer every published approach and compare.

    Parameters
    ----------
    runs : int
        Simulated approaches of each that is flown.
    seed : int
        The seed of the runs is ``FIRST_SEED + seed``.
    progress : callable, optional
        Called with one line for each approach.
    """
    names = dict.fromkeys((*PUBLISHED, *FLOWN))
    changed = variations()
    correlated = [name for name, one in changed.items() if one.noise.correlated_m > 0.0]
    trials = dict.fromkeys((*FLOWN, *correlated), runs)
    answers = run_approaches({name: approach(name) for name in names} | changed, trials, FIRST_SEED + seed, progress)
    published = {name: answers[name] for name in names}
    tables = (
        sigma_table(published),
        category_table(published),
        order_table(published),
        variation_table({name: answers[name] for name in changed}),
        trial_table(answers),
        bearing_table(DRAWS_A_RUN * runs, FIRST_SEED + seed),
        bearing_spans(),
    )
    titles = (
        "Published sigmas",
        "Published categories",
        "Variants, the worst height at touchdown first",
        "What the figures rest on: the moving fourth point under other noise, baro and control",
        "Simulated approaches: normalised squared error of the place (3 is honest)",
        "Two locators and a beacon beside the threshold: 95 % of the errors",
        "Where bearings meet a category, metres before the threshold",
    )
    head = section(
        "Study: landing",
        f"{runs} simulated approaches of each that is flown, seed {FIRST_SEED + seed}. Scenarios are the shipped plans "
        "of landings. Sigmas are one sigma; categories are held against 95 %: 1.96 sigma of one axis, the radius of "
        "95 % in the plane. Accuracy only: integrity, continuity and availability are not shown. Locators stand "
        f"{-BEACONS_M[0, 0]:.0f} and {-BEACONS_M[1, 0]:.0f} m before the threshold, the beacon beside it "
        f"{BEACONS_M[2, 1]:.0f} m from the axis.",
    )
    told = (section(title, table(one)) for title, one in zip(titles, tables, strict=True))
    return StudyResult("landing", tables, (head, *told))


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
