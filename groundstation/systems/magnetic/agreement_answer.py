"""Error of the magnetic heading in the air beside that on ground runs."""

import math

from groundstation.results.agreement import Agreement, OneFinding
from groundstation.results.answer import Answers, answer_of
from groundstation.results.roles import LETTERS
from groundstation.systems.magnetic.answer import MagneticResult
from groundstation.systems.magnetic.flux_answer import FluxDeviation
from groundstation.systems.magnetic.ground_answer import GroundDeviation, GroundRun


def deviation_agreement(answers: Answers) -> Agreement | None:
    """Compare the error of the magnetic heading in the air and on ground runs.

    The error in the air is that by the recommended method, at the headings of the runs. The declination is in both and
    is counted once, in the air.
    """
    air, ground = _in_the_air(answers), answer_of(answers, GroundDeviation)
    runs = [run for run in ground.used if run.error_deg is not None and run.sigma_deg] if ground else []
    if air is None or ground is None or not runs:
        return None
    own = [_own_variance(run, ground.declination.sigma_deg, ground.place_sigma_deg) for run in runs]
    weights = [1.0 / one / sum(1.0 / other for other in own) for one in own]
    columns = [_columns(run.magnetic_heading_deg) for run in runs]
    mean = [sum(part * column[place] for part, column in zip(weights, columns, strict=True)) for place in range(5)]
    values, sigmas = air
    on_runs = sum(part * (run.error_deg or 0.0) for part, run in zip(weights, runs, strict=True))
    sigma = math.sqrt(sum(part**2 * one for part, one in zip(weights, own, strict=True)))
    there = sum(column * value for column, value in zip(mean, values, strict=True))
    spread = math.sqrt(sum((column * value) ** 2 for column, value in zip(mean, sigmas, strict=True)))
    return Agreement(
        "error of the magnetic heading on the headings of the ground runs",
        "deg",
        OneFinding("in the air", there, spread),
        OneFinding("on the ground", on_runs, sigma),
    )


def _in_the_air(answers: Answers) -> tuple[list[float], list[float]] | None:
    """Return A to E in the air and their sigmas; a coefficient that is not shown is 0."""
    found, compass = answer_of(answers, MagneticResult), answer_of(answers, FluxDeviation)
    if found is not None:
        method = found.method(found.recommended_method)
        if set(LETTERS) - set(method.coefficients_deg):
            return None
        return (
            [method.coefficients_deg[letter] for letter in LETTERS],
            [method.coefficients_sigma_deg[letter] for letter in LETTERS],
        )
    if compass is None:
        return None
    rows = [compass.coefficient(letter) for letter in LETTERS]
    return [row.value_deg or 0.0 for row in rows], [row.sigma_deg for row in rows]


def _own_variance(run: GroundRun, declination_sigma_deg: float, place_sigma_deg: float) -> float:
    """Return the variance of a run's own error: noise, slip and place."""
    sigma = run.sigma_deg or 0.0
    return max(sigma**2 - declination_sigma_deg**2, (run.noise_sigma_deg or 0.0) ** 2, 1e-6) + place_sigma_deg**2


def _columns(heading_deg: float) -> tuple[float, ...]:
    """Return the columns 1, sin c, cos c, sin 2c, cos 2c."""
    rad = math.radians(heading_deg)
    return (1.0, math.sin(rad), math.cos(rad), math.sin(2.0 * rad), math.cos(2.0 * rad))
