"""Runs of the magnetic study: every seed flies all setups, on several processes.

A small outcome of each is kept.
"""

from collections.abc import Callable, Sequence
from dataclasses import field

from groundstation.base.dataclasses import dataclass
from groundstation.simulation.magnetic_family import MagneticFamilySettings, draw_magnetic_scenario
from groundstation.systems.magnetic.study.bias import Biases, formula_biases
from groundstation.systems.magnetic.study.cases import (
    BANK_DEG,
    EXACT,
    INCOMPLETE,
    JUDGED,
    REFERENCE,
    WIDE,
    Setup,
    seed_of,
)
from groundstation.systems.magnetic.study.flights import Hangar, judged_outcome, wide_outcome
from groundstation.systems.magnetic.study.judge import JudgedAnswer
from groundstation.systems.magnetic.study.taxis import TaxiOutcome, taxi_cells, taxi_outcome
from groundstation.systems.study import mapped

Progress = Callable[[str], None]

SWEPT_SHARE = 0.5  # of the seeds fly the sweeps: each seed is the same at every point, so that curves are smooth
INCOMPLETE_SHARE = 0.25  # of the seeds fly incomplete figures, too: each of them is refused for a reason, not by chance


@dataclass(frozen=True)
class SeedJob:
    """Flights of one seed.

    ``wide`` is the cell of the second family, ``taxi`` that of the third.
    """

    run: int
    seed: int
    setups: tuple[Setup, ...]
    judged: MagneticFamilySettings | None
    is_incomplete: bool
    wide: str = ""
    taxi: str = ""


@dataclass(frozen=True)
class SeedOutcome:
    """All flights of one seed.

    Parameters
    ----------
    run : int
    swept : tuple of JudgedAnswer
        In the order of the setups; empty where this seed does not fly them.
    judged : JudgedAnswer or None
        The whole flight of the judged family.
    incomplete : mapping of kind of figure to JudgedAnswer
    biases : Biases
        Of this seed's iron, by formula.
    wide : mapping of cell to JudgedAnswer
        The flight of the second family.
    taxi : TaxiOutcome or None
        The flight of the third family.
    """

    run: int
    swept: tuple[JudgedAnswer, ...]
    judged: JudgedAnswer | None
    incomplete: dict[str, JudgedAnswer]
    biases: Biases
    wide: dict[str, JudgedAnswer] = field(default_factory=dict)
    taxi: TaxiOutcome | None = None


def jobs_of(runs: int, seed: int, swept_setups: tuple[Setup, ...]) -> list[SeedJob]:
    """Return one job for each run; the seed alone decides how each setup is flown."""
    cells, taxis = tuple(WIDE), tuple(taxi_cells())
    swept, incomplete = (max(2, round(share * runs)) for share in (SWEPT_SHARE, INCOMPLETE_SHARE))
    return [
        SeedJob(
            run,
            seed_of(seed, run),
            swept_setups if run < swept else (),
            JUDGED,
            run < incomplete,
            cells[run % len(cells)],
            taxis[run % len(taxis)],
        )
        for run in range(runs)
    ]


def run_jobs(jobs: Sequence[SeedJob], progress: Progress | None = None) -> tuple[SeedOutcome, ...]:
    """Fly all jobs, on as many processes as there are cores.

    The outcomes are in the order of the jobs.
    """
    found = []
    with mapped(len(jobs)) as each:
        for outcome in each(fly_job, jobs):
            found.append(outcome)
            if progress:
                progress(f"run {outcome.run}: {_told(outcome)}")
    return tuple(found)


def fly_job(job: SeedJob) -> SeedOutcome:
    """Fly everything of one seed."""
    hangar = Hangar(job.seed)
    iron = draw_magnetic_scenario(EXACT, job.seed).magnetometer
    assert iron is not None
    figures = {kind: make(BANK_DEG) for kind, make in INCOMPLETE.items()} if job.is_incomplete else {}
    return SeedOutcome(
        job.run,
        tuple(hangar.outcome(setup) for setup in job.setups),
        judged_outcome(job.judged, job.seed) if job.judged else None,
        {kind: hangar.outcome(REFERENCE, figure) for kind, figure in figures.items()},
        formula_biases(iron),
        {job.wide: wide_outcome(WIDE[job.wide], job.seed)} if job.wide else {},
        taxi_outcome(job.taxi, job.seed) if job.taxi else None,
    )


def _told(outcome: SeedOutcome) -> str:
    flights = [
        *outcome.swept,
        *outcome.incomplete.values(),
        *outcome.wide.values(),
        *([outcome.judged] if outcome.judged else []),
    ]
    accepted = sum(flight.verdict == "accept" for flight in flights)
    return f"{accepted} of {len(flights)} flights accepted"
