"""Monte Carlo study of navigation between aircraft.

Every published figure with ours beside it, and how honest ours is.
"""

from collections.abc import Sequence

from groundstation.systems.cooperative.study.cases import CASES, FIRST_SEED
from groundstation.systems.cooperative.study.page import page, study_table
from groundstation.systems.cooperative.study.pairwise_family import FAMILY, Net, pairwise_section, pairwise_table
from groundstation.systems.cooperative.study.published_case import PublishedCase
from groundstation.systems.cooperative.study.runs import WORKERS, Progress, run_cases
from groundstation.systems.study import StudyResult


def study_cooperative(
    runs: int = 100,
    seed: int = 0,
    progress: Progress | None = None,
    *,
    cases: Sequence[PublishedCase] = CASES,
    nets: Sequence[Net] = FAMILY,
    workers: int = WORKERS,
) -> StudyResult:
    """Fly every published case and compare.

    Parameters
    ----------
    runs : int
        Sessions of each case; 100 give NEES to 10 %.
    seed : int
        The runs' seed is ``FIRST_SEED + seed``.
    progress : callable, optional
        Called with one line for each case.
    cases : sequence of PublishedCase
    nets : sequence of Net
        Sessions of the family for the pairwise filter.
    workers : int
        Processes; the answer does not depend on them.
    """
    outcomes = run_cases(cases, runs, FIRST_SEED + seed, progress, workers)
    table = study_table(cases, outcomes)
    sections = page(cases, table, runs, FIRST_SEED + seed)
    if not nets:
        return StudyResult("cooperative", (table,), sections)
    dense = pairwise_table(nets, runs, FIRST_SEED + seed, workers)
    return StudyResult("cooperative", (table, dense), (*sections, pairwise_section(dense, runs)))
