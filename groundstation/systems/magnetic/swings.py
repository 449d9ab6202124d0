"""Figures of one flight beside each other, and the card for the technician."""

import numpy as np

from groundstation.base.angles import FloatArray, wrap_180, wrap_360
from groundstation.base.records import BoolArray
from groundstation.methods import harmonics
from groundstation.results.roles import LETTERS
from groundstation.systems.magnetic.answer import CardRow, Swing
from groundstation.systems.magnetic.apply import corrected_by_table
from groundstation.systems.magnetic.compass_table import CENTRES_DEG, bin_of, build_table
from groundstation.systems.magnetic.manoeuvre import OppositeTurns
from groundstation.systems.magnetic.readings import Readings


def compare_swings(readings: Readings, declination_deg: float, figures: list[OppositeTurns]) -> list[Swing]:
    """Every figure's own A to E, and how far its curve is from the mean of the other figures."""
    heading, error = readings.magnetic_heading_deg, readings.compass_error_deg
    tables = [build_table(heading, error, figure.rows(True), figure.rows(False)) for figure in figures]
    rows = []
    for place, (figure, table) in enumerate(zip(figures, tables, strict=True)):
        values = table.coefficients_deg.copy()
        others = [other for index, other in enumerate(tables) if index != place]
        difference, sigma = None, None
        if others:
            steps = np.array([values - other.coefficients_deg for other in others])
            steps[:, 0] = wrap_180(steps[:, 0])
            covariance = table.covariance + np.sum([other.covariance for other in others], axis=0) / len(others) ** 2
            difference = float(np.sqrt(harmonics.OVER_CIRCLE @ np.mean(steps, axis=0) ** 2))
            sigma = float(np.sqrt(harmonics.OVER_CIRCLE @ np.diag(covariance)))
        values[0] = wrap_180(values[0] + declination_deg)
        rows.append(
            Swing(
                place + 1,
                figure.start_s,
                figure.end_s,
                figure.bank_deg(True),
                figure.bank_deg(False),
                figure.covered_share,
                dict(zip(LETTERS, map(float, values), strict=True)),
                dict(zip(LETTERS, map(float, np.sqrt(np.diag(table.covariance))), strict=True)),
                difference,
                sigma,
            )
        )
    return rows


def steer_card(
    deviation_deg: FloatArray, sigma_deg: dict[str, float], is_measured: BoolArray, step_deg: int
) -> tuple[CardRow, ...]:
    """Return readings to steer for magnetic headings every ``step_deg``.

    reading + deviation = heading.

    Examples
    --------
    >>> card = steer_card(np.full(360, -2.0), dict.fromkeys("ABCDE", 0.1), np.ones(360, dtype=bool), 90)
    >>> [(row.magnetic_heading_deg, row.steer_deg) for row in card]
    [(0.0, 2.0), (90.0, 92.0), (180.0, 182.0), (270.0, 272.0)]
    """
    wanted = np.arange(0.0, 360.0, float(step_deg))
    leads = corrected_by_table(CENTRES_DEG, deviation_deg)
    order = np.argsort(leads)
    added = np.interp(wanted, leads[order], np.asarray(deviation_deg)[order], period=360.0)
    steer = wrap_360(wanted - added)
    variance = harmonics.design(steer) ** 2 @ np.array([sigma_deg[letter] ** 2 for letter in LETTERS])
    return tuple(
        CardRow(float(heading), float(reading), float(deviation), float(np.sqrt(spread)), not bool(measured))
        for heading, reading, deviation, spread, measured in zip(
            wanted, steer, added, variance, is_measured[bin_of(steer)], strict=True
        )
    )
