"""Coverage of the magnetic deviation cell by cell.

Accepted flights of both families against the truth.
"""

from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from groundstation.base.quantiles import NORMAL_95
from groundstation.results.figures import FigureData
from groundstation.results.roles import LETTERS
from groundstation.systems.magnetic.study.cases import Setup, Sweep
from groundstation.systems.magnetic.study.judge import METHODS, JudgedAnswer, JudgedMethod
from groundstation.systems.magnetic.study.tables import IRON, TABLE, OutcomeSample

FIRST, SECOND = "first", "wide"
D = LETTERS.index("D")
Cell = tuple[str, str, Sequence[JudgedAnswer]]


def first_cells(
    judged: OutcomeSample, sweeps: Sequence[Sweep], samples: Mapping[Setup, OutcomeSample]
) -> Iterable[Cell]:
    """Return the whole flights of the first family, and the points of its sweeps."""
    yield FIRST, "whole flights", judged.outcomes
    for sweep in sweeps:
        for value, setup in sweep.points:
            yield FIRST, f"{sweep.column} {value:.3g}", samples[setup].outcomes


def coverage_table(cells: Iterable[Cell]) -> FigureData:
    """Tabulate how often errors of accepted flights stay within 1.96 stated sigma, by cell.

    ``*_a_to_e``: coefficients A to E; ``*_level``: headings of level flight; ``recommended_*``: by the method that the
    flight recommends, with the RMS of its error over all headings and flights and that of the worst flight.
    ``iron_d_ratio``: RMS of the error of D of the iron over its sigma.
    """
    rows = [(family, cell, len(outcomes), *_row(outcomes)) for family, cell, outcomes in cells]
    names = (
        *("family", "cell", "flights", "accepted", "table_a_to_e", "iron_a_to_e", "iron_d_ratio"),
        *("table_level", "iron_level", "recommended_level", "recommended_rms_deg", "recommended_worst_deg"),
    )
    columns = {name: np.array([row[place] for row in rows]) for place, name in enumerate(names)}
    return FigureData("magnetic_cells", columns, dict.fromkeys(names[4:], 2))


def _row(outcomes: Sequence[JudgedAnswer]) -> tuple[float, ...]:
    kept = [outcome for outcome in outcomes if outcome.verdict == "accept"]
    table, iron = ([one.judged[method] for one in kept if method in one.judged] for method in (TABLE, IRON))
    recommended = [one.judged[one.recommended] for one in kept if one.recommended in one.judged]
    rms = np.array([one.rms_deg[METHODS.index(one.recommended)] for one in kept if one.recommended in METHODS])
    return (
        len(kept),
        *(_share(np.array([_inside(one) for one in judged])) for judged in (table, iron)),
        float(np.sqrt(_share(np.array([one.coefficient_ratio[D] ** 2 for one in iron])))),
        *(_share(np.array([one.curve_inside95 for one in judged])) for judged in (table, iron, recommended)),
        float(np.sqrt(_share(rms**2))),
        float(np.max(rms, initial=0.0)),
    )


def _inside(judged: JudgedMethod) -> float:
    return float(np.mean(np.abs(judged.coefficient_ratio) <= NORMAL_95))


def _share(values: np.ndarray) -> float:
    return float(np.mean(values)) if values.size else float("nan")
