"""Monte Carlo study of errors by cause: coverage of every interval, cell by cell."""

from collections.abc import Sequence

import numpy as np

from groundstation.methods.intervals import share_interval
from groundstation.results.figures import FigureData
from groundstation.systems.inertial.study.causes_runs import CASES, CauseOutcome, Progress, quantities, run_causes
from groundstation.systems.study import StudyResult, section, table

ALL, WITHIN = "all but broken", tuple(case.name for case in CASES if not case.broken)


def study_causes(
    runs: int = 25, seed: int = 91, progress: Progress | None = None, *, minutes: float | None = None
) -> StudyResult:
    """Fly and judge the families of docs/evidence/forecast.md and three of broken assumptions.

    Parameters
    ----------
    runs : int
        Flights of each cell.
    seed : int
        Flights are drawn from ``70 000 + 10 seed``.
    progress : callable, optional
        Called with one line for each flight.
    minutes : float, optional
        Ends the study early: the tables are those of the flights made.
    """
    outcomes = run_causes(runs, seed, progress, minutes=minutes)
    found = coverage_table(outcomes)
    worst = widths_table(outcomes)
    return StudyResult(
        "causes",
        (found, worst),
        (
            section(
                "Study: errors by cause",
                f"{len(outcomes)} flights, {max((one.run for one in outcomes), default=-1) + 1} a cell. Share of true "
                "values inside their 95 % interval.",
            ),
            section("Coverage", "Flights of one cell are independent, legs of one flight are not.", table(found)),
            section("Widths", "Half of the interval, median over all cells that break nothing.", table(worst)),
        ),
    )


def coverage_table(outcomes: Sequence[CauseOutcome]) -> FigureData:
    """Return the share of truths inside the interval, a row a quantity, a column a cell.

    ``low`` and ``high`` are the 95 % limits of the share over all cells that break nothing.
    """
    rows: list[dict[str, object]] = []
    for quantity in quantities(outcomes):
        inside = [
            cell.is_inside for one in outcomes if one.case in WITHIN for cell in one.cells if cell.quantity == quantity
        ]
        low, high = share_interval(sum(inside), len(inside)) if inside else (float("nan"), float("nan"))
        row: dict[str, object] = {"quantity": quantity, "values": len(inside)}
        row |= {ALL: float(np.mean(inside)) if inside else float("nan"), "low": low, "high": high}
        rows.append(row | {case.name: _share(outcomes, case.name, quantity) for case in CASES})
    return _table("causes_coverage", rows)


def _share(outcomes: Sequence[CauseOutcome], case: str, quantity: str) -> float:
    inside = [cell.is_inside for one in outcomes if one.case == case for cell in one.cells if cell.quantity == quantity]
    return float(np.mean(inside)) if inside else float("nan")


def widths_table(outcomes: Sequence[CauseOutcome]) -> FigureData:
    """Return the median width of each interval, and the error in half widths: mean and spread."""
    rows: list[dict[str, object]] = []
    for quantity in quantities(outcomes):
        cells = [cell for one in outcomes if one.case in WITHIN for cell in one.cells if cell.quantity == quantity]
        half = np.array([0.5 * (cell.high - cell.low) for cell in cells])
        ratio = np.array([cell.error for cell in cells])[half > 0.0] / half[half > 0.0]
        rows.append(
            {
                "quantity": quantity,
                "half95_median": float(np.median(half)) if len(half) else float("nan"),
                "mean": float(np.mean(ratio)) if len(ratio) else float("nan"),
                "spread": float(np.std(ratio)) if len(ratio) else float("nan"),
            }
        )
    return _table("causes_widths", rows, {"half95_median": 4})


def _table(name: str, rows: Sequence[dict[str, object]], digits: dict[str, int] | None = None) -> FigureData:
    names = list(rows[0]) if rows else []
    numbers = {key: 3 for key in names if key not in ("quantity", "values")}
    return FigureData(name, {key: np.array([row[key] for row in rows]) for key in names}, numbers | (digits or {}))
