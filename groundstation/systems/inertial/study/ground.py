"""Monte Carlo study of alignment and shutdown: coverage, and what is told."""

import time
from collections.abc import Sequence

import numpy as np

from groundstation.methods.intervals import share_interval
from groundstation.results.figures import FigureData
from groundstation.systems.inertial.study.ground_runs import CASES, GroundOutcome, Progress, ratios, run_ground
from groundstation.systems.study import RunStore, StudyResult, section, table

SHARES = dict.fromkeys(("inside95", "inside95_low", "inside95_high", "kind", "moved", "above", "over_limit"), 3)


def study_ground(
    runs: int = 100,
    seed: int = 5,
    progress: Progress | None = None,
    *,
    kept: RunStore[GroundOutcome] | None = None,
    minutes: float | None = None,
) -> StudyResult:
    """Fly and judge flights that begin standing and end parked.

    Parameters
    ----------
    runs : int
        Flights of each case.
    seed : int
        Cases have the seeds ``70 000 + 100 seed`` and following.
    progress : callable, optional
        Called with one line for each flight.
    kept : RunStore, optional
        Flights that it has are taken from there; those that are made are put there.
    minutes : float, optional
        Ends the study early: the tables are those of the flights made.
    """
    end_s = time.monotonic() + 60.0 * minutes if minutes is not None else float("inf")
    outcomes = run_ground(runs, seed, progress, kept=kept, is_over=lambda: time.monotonic() > end_s)
    coverage, told = coverage_of(outcomes), told_of(outcomes)
    head = section(
        "Study: alignment and shutdown",
        f"{len(outcomes)} of {runs * len(CASES)} flights of 80 min that begin standing and end parked. The last three "
        "cases break assumptions: wind rocks the aircraft while it stands, a tug moves it while it aligns, sensors "
        "warm up.",
    )
    sections = (
        section(
            "Coverage of the intervals",
            "inside95: share of true values inside the 95 % interval. mean, spread: of the error over half of the "
            "interval; 0 and 0.51 are honest for a value with a sign, less for a length: its interval holds both axes.",
            table(coverage),
        ),
        section(
            "What is told",
            "kind: told as a gyrocompass, as it was; moved: told to have moved while it aligned; above: drift while "
            "standing told to be above the class; over_limit: the largest drift over the limit.",
            table(told),
        ),
    )
    return StudyResult("ground", tuple(one for one in (coverage, told) if len(one)), (head, *sections))


def coverage_of(outcomes: Sequence[GroundOutcome]) -> FigureData:
    """Return the share of truths inside the interval, by case and quantity."""
    rows: list[dict[str, object]] = []
    for case in CASES:
        cells = [cell for one in outcomes if one.case == case for cell in one.cells]
        for quantity in dict.fromkeys(cell.quantity for cell in cells):
            of_it = [cell for cell in cells if cell.quantity == quantity]
            inside = sum(abs(cell.error) <= cell.half95 for cell in of_it)
            low, high = share_interval(inside, len(of_it))
            ratio = ratios(of_it)
            rows.append(
                {
                    "case": case,
                    "quantity": quantity,
                    "values": len(of_it),
                    "inside95": inside / len(of_it),
                    "inside95_low": low,
                    "inside95_high": high,
                    "mean": float(np.mean(ratio)) if len(ratio) else float("nan"),
                    "spread": float(np.std(ratio)) if len(ratio) else float("nan"),
                    "half95_median": float(np.median([cell.half95 for cell in of_it])),
                    "error_rms": float(np.sqrt(np.mean([cell.error**2 for cell in of_it]))),
                }
            )
    return _table("ground_coverage", rows, {"mean": 2, "spread": 2, "half95_median": 4, "error_rms": 4})


def told_of(outcomes: Sequence[GroundOutcome]) -> FigureData:
    """Return what was told of the flights of each case."""
    rows: list[dict[str, object]] = []
    for case in CASES:
        several = [one for one in outcomes if one.case == case]
        if not several:
            continue
        over = np.array([one.drift_over_limit for one in several])
        known = over[np.isfinite(over)]
        rows.append(
            {
                "case": case,
                "flights": len(several),
                "no_answer": sum(bool(one.why_not) for one in several),
                "kind": float(np.mean([one.kind == "gyrocompass" for one in several])),
                "moved": float(np.mean([one.is_moved is True for one in several])),
                "above": float(np.mean([one.is_above is True for one in several])),
                "over_limit": float(np.max(known)) if len(known) else float("nan"),
            }
        )
    return _table("ground_told", rows, {})


def _table(name: str, rows: Sequence[dict[str, object]], digits: dict[str, int]) -> FigureData:
    names = list(rows[0]) if rows else []
    return FigureData(name, {key: np.array([row[key] for row in rows]) for key in names}, SHARES | digits)
