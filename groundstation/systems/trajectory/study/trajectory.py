"""Monte Carlo study of the trajectory estimator: errors against sigmas.

The families are written down in ``family``. The model knows the noise of the simulation, nothing is fitted and no gate
scales a sigma: it is the estimator's equations that are judged.
"""

from collections.abc import Callable, Sequence
from functools import partial

import numpy as np

from groundstation.chapters.parts import Section
from groundstation.results.figures import FigureData
from groundstation.systems.study import StudyResult, mapped, section, table, table_of
from groundstation.systems.trajectory.study.family import FAMILIES, StudyFamily
from groundstation.systems.trajectory.study.judged import QUANTITIES, Run, run_of

Progress = Callable[[str], None]
INSIDE_95 = 1.959963984540054**2
DIGITS = {
    "runs": 0,
    "refused_share": 3,
    "ambiguous_share": 3,
    "heading_rms_deg": 2,
    "heading_coverage": 3,
    "latency_rms_s": 4,
    "latency_rms_over_sigma": 2,
    **{f"{kind}_{name}_nees": 2 for kind in ("smoothed", "filtered") for name in QUANTITIES},
    "coverage": 3,
}


def study_trajectory(
    runs: int = 200, seed: int = 0, progress: Progress | None = None, *, families: tuple[StudyFamily, ...] = FAMILIES
) -> StudyResult:
    """Fly every family and compare errors with the estimator's sigmas.

    Parameters
    ----------
    runs : int
        Logs of each family.
    seed : int
        Run k of every family has the seed (seed, k).
    progress : callable, optional
        Called with one line for each family.
    families : tuple of StudyFamily
    """
    rows = []
    for family in families:
        with mapped(runs) as each:
            found = list(each(partial(run_of, family), [(seed, number) for number in range(runs)]))
        rows.append(row_of(family.name, found))
        if progress:
            progress(f"{family.name}: {sum(one is not None for one in found)} of {runs} estimated")
    data = table_of("trajectory_consistency", rows, DIGITS)
    return StudyResult("trajectory", (data,), _page(data, families, runs, seed))


def row_of(name: str, found: Sequence[Run | None]) -> dict[str, object]:
    """Return the row of a family.

    NEES are per degree of freedom, 1 where the sigmas are right.
    """
    done = [one for one in found if one is not None]
    row: dict[str, object] = {
        "family": name,
        "runs": float(len(found)),
        "refused_share": 1.0 - len(done) / max(len(found), 1),
        "ambiguous_share": _mean([np.array([one.is_ambiguous]) for one in done]),
    }
    for kind in ("smoothed", "filtered"):
        for place, quantity in enumerate(QUANTITIES):
            row[f"{kind}_{quantity}_nees"] = _mean([getattr(one, kind)[:, place] for one in done])
    row["coverage"] = _mean([one.smoothed < INSIDE_95 for one in done])
    row["heading_rms_deg"] = float(np.sqrt(_mean([one.heading_error_deg**2 for one in done])))
    row["heading_coverage"] = _mean([one.smoothed[:, 2, 2] < INSIDE_95 for one in done])
    row["latency_rms_s"] = float(np.sqrt(_mean([np.array([one.latency_error_s**2]) for one in done])))
    row["latency_rms_over_sigma"] = float(np.sqrt(_mean([np.array([one.latency_ratio**2]) for one in done])))
    return row


def _mean(parts: list[np.ndarray]) -> float:
    """Return the mean of all values, NaN where there is none."""
    every = np.concatenate([part.ravel() for part in parts]) if parts else np.zeros(0)
    return float(np.mean(every)) if len(every) else float("nan")


def _page(data: FigureData, families: tuple[StudyFamily, ...], runs: int, seed: int) -> tuple[Section, ...]:
    head = section(
        "Study: the sigmas of the best trajectory",
        f"{runs} simulated logs of each family (seed {seed}), estimated with the noise of the simulation known: "
        "nothing is fitted and no sigma is scaled. NEES: mean squared error over variance, 1 where sigmas are right. "
        "The filter counts once its heading sigma is below 5 deg. Coverage: share of the smoothed errors within "
        "their 95 % interval.",
        table(data),
        *(f"{family.name}: {family.what}" for family in families),
    )
    return (head,)
