"""Monte Carlo study of the magnetic deviation.

Error of every method, the published claim and its limit, honesty.
"""

from collections.abc import Sequence

from groundstation.systems.magnetic.study import tables
from groundstation.systems.magnetic.study.cases import CLAIM, SWEEPS, WIDE, Sweep, setups
from groundstation.systems.magnetic.study.coverage import SECOND, coverage_table, first_cells
from groundstation.systems.magnetic.study.page import page
from groundstation.systems.magnetic.study.runs import Progress, jobs_of, run_jobs
from groundstation.systems.magnetic.study.taxis import taxi_table
from groundstation.systems.study import StudyResult


def study_magnetic(
    runs: int = 200, seed: int = 71, progress: Progress | None = None, *, sweeps: Sequence[Sweep] = SWEEPS
) -> StudyResult:
    """Fly figures through every sweep and compare the methods with the truth.

    RMS, shares, refusals with intervals.

    Parameters
    ----------
    runs : int
        Whole flights of the first family, as many of the second, run k of its cell k modulo 12, and of the third,
        modulo 11; half as many fly each point of the sweeps, with the same iron, noise and INS at every point, and a
        quarter fly each incomplete figure.
    seed : int
        Flights have the seeds ``7 000 000 + 100 000 seed + run``.
    progress : callable, optional
        Called with one line for each run.
    sweeps : sequence of Sweep
        That of the bank has to be among them.
    """
    flown = setups(sweeps)
    outcomes = run_jobs(jobs_of(runs, seed, flown), progress)
    swept = [run for run in outcomes if run.swept]
    samples = tables.samples_of(swept, flown, seed)
    judged = tables.judged_sample(outcomes, seed)
    kept = tables.accepted(judged, seed)
    wide = [
        (SECOND, cell, [run.wide[cell] for run in outcomes if cell in run.wide])
        for cell in WIDE
        if any(cell in run.wide for run in outcomes)
    ]
    found = (
        taxi_table([run.taxi for run in outcomes if run.taxi is not None]),
        coverage_table([*first_cells(judged, sweeps, samples), *wide]),
        tables.honesty_table(kept),
        tables.residual_table(kept),
        tables.claim_table(swept, samples),
        tables.power_table(swept, samples),
        *(tables.sweep_table(sweep, samples) for sweep in sweeps),
        tables.ratio_table(sweeps, samples),
        tables.verdict_table(judged, (*sweeps, CLAIM), samples),
        tables.incomplete_table(outcomes),
    )
    return StudyResult("magnetic", found, page({table.name: table for table in found}, runs, seed, sweeps))
