"""Two analyses of one log that answer the same question: agreement within intervals."""

import math
from dataclasses import dataclass

from groundstation.base.normal import NORMAL_95
from groundstation.results.answer import Answers, answer_of
from groundstation.systems.heading.answer import HeadingResult
from groundstation.systems.inertial.answer import InertialResult
from groundstation.systems.latency.answer import Latencies
from groundstation.systems.magnetic.answer import LETTERS, MagneticResult
from groundstation.systems.magnetic.ground_answer import GroundDeviation, GroundRun

DRIFT_SIGMA_DEG_PER_H = 0.1  # drift of the azimuth of an INS between two looks at it
AGREE_SIGMAS, CONTRADICT_SIGMAS = 2.0, 3.0
NARROWED = 0.95  # a sigma that the turns of a taxi leave of the one known before: above it they show nothing
S_PER_H = 3600.0


@dataclass(frozen=True)
class OneFinding:
    """Value that one analysis found, with its sigma and its origin."""

    origin: str
    value: float
    sigma: float

    @property
    def interval95(self) -> tuple[float, float]:
        return self.value - NORMAL_95 * self.sigma, self.value + NORMAL_95 * self.sigma


@dataclass(frozen=True)
class Agreement:
    """Two findings on one question.

    ``between_sigma`` is what may have changed between them.
    """

    question: str
    unit: str
    first: OneFinding
    second: OneFinding
    between_sigma: float = 0.0

    @property
    def difference(self) -> float:
        """First minus second."""
        return self.first.value - self.second.value

    @property
    def sigmas(self) -> float:
        """Difference of the two in sigmas.

        Examples
        --------
        >>> taxi, turns = OneFinding("by taxi", 1.0, 0.3), OneFinding("by turns", 0.5, 0.4)
        >>> Agreement("heading error", "deg", taxi, turns).sigmas
        1.0
        """
        return abs(self.difference) / math.hypot(self.first.sigma, self.second.sigma, self.between_sigma)

    @property
    def agrees(self) -> bool:
        return self.sigmas <= AGREE_SIGMAS


def heading_agreement(answers: Answers) -> Agreement | None:
    """Compare the platform's azimuth error by taxi (system 1) and by turns (system 2).

    Both are of the same INS; the turns are in flight.
    """
    taxi, inertial = answer_of(answers, HeadingResult), answer_of(answers, InertialResult)
    turns = inertial.azimuth if inertial is not None else None
    if taxi is None or inertial is None or turns is None or taxi.ins_topic != inertial.ins_topic:
        return None
    if turns.error_deg is None or turns.sigma_deg is None or not all(map(math.isfinite, taxi.azimuth)):
        return None
    hours = 0.0 if turns.time_s is None else abs(turns.time_s - (taxi.reference_time_s or 0.0)) / S_PER_H
    return Agreement(
        "azimuth error of the INS",
        "deg",
        OneFinding("by taxi", *taxi.azimuth),
        OneFinding("by turns in flight", turns.error_deg, turns.sigma_deg),
        DRIFT_SIGMA_DEG_PER_H * hours,
    )


def latency_agreement(answers: Answers) -> Agreement | None:
    """Compare the GNSS latency behind the INS by motion and by the turns of the taxi.

    The first is the latency analysis, the second system 1. Where the former was taken out before the turns were looked
    at, it was their prior: it is taken off again.
    """
    taxi, latencies = answer_of(answers, HeadingResult), answer_of(answers, Latencies)
    found = latencies.observed(taxi.ins_topic, taxi.gnss_topic) if latencies and taxi else None
    if taxi is None or found is None or found.latency_s is None or found.confidence95_s is None:
        return None
    low, high = found.confidence95_s
    motion = OneFinding("by motion", found.latency_s, 0.5 * (high - low) / NORMAL_95)
    if taxi.time_offset_s is None or not taxi.time_offset_sigma_s or not motion.sigma > 0.0:
        return None
    offset, sigma = taxi.time_offset_s, taxi.time_offset_sigma_s
    if taxi.latency_origin == "motion":
        if sigma >= NARROWED * motion.sigma:
            return None
        information = sigma**-2 - motion.sigma**-2
        offset, sigma = offset * sigma**-2 / information, information**-0.5
    turns = OneFinding("by the turns of the taxi", (taxi.latency_used_s or 0.0) + offset, sigma)
    return Agreement(f"latency of {taxi.gnss_topic} behind {taxi.ins_topic}", "s", motion, turns)


def deviation_agreement(answers: Answers) -> Agreement | None:
    """Compare the error of the magnetic heading in the air and on ground runs.

    The error in the air is that by the recommended method, at the headings of the runs. The declination is in both and
    is counted once, in the air.
    """
    air, ground = answer_of(answers, MagneticResult), answer_of(answers, GroundDeviation)
    runs = [run for run in ground.used if run.error_deg is not None and run.sigma_deg] if ground else []
    if air is None or ground is None or not runs:
        return None
    method = air.method(air.recommended_method)
    if set(LETTERS) - set(method.coefficients_deg):
        return None
    own = [_own_variance(run, ground.declination.sigma_deg, ground.place_sigma_deg) for run in runs]
    weights = [1.0 / one / sum(1.0 / other for other in own) for one in own]
    columns = [_columns(run.magnetic_heading_deg) for run in runs]
    mean = [sum(part * column[place] for part, column in zip(weights, columns, strict=True)) for place in range(5)]
    values = [method.coefficients_deg[letter] for letter in LETTERS]
    sigmas = [method.coefficients_sigma_deg[letter] for letter in LETTERS]
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


def _own_variance(run: GroundRun, declination_sigma_deg: float, place_sigma_deg: float) -> float:
    """Return the variance of a run's own error: noise, slip and place."""
    sigma = run.sigma_deg or 0.0
    return max(sigma**2 - declination_sigma_deg**2, (run.noise_sigma_deg or 0.0) ** 2, 1e-6) + place_sigma_deg**2


def _columns(heading_deg: float) -> tuple[float, ...]:
    """Return the columns 1, sin c, cos c, sin 2c, cos 2c."""
    rad = math.radians(heading_deg)
    return (1.0, math.sin(rad), math.cos(rad), math.sin(2.0 * rad), math.cos(2.0 * rad))
