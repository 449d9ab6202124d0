"""Learned answer of a flight: both numbers, their intervals in parts, and the verdict."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from groundstation.base.angles import wrap_180
from groundstation.base.dataclasses import dataclass
from groundstation.base.quantiles import NORMAL_95
from groundstation.base.units import ARCMIN_PER_DEG
from groundstation.methods.intervals import mixture_quantile
from groundstation.results.installations import Lesson
from groundstation.results.roles import IntervalPart
from groundstation.systems.heading.gates_answer import WHOLE
from groundstation.systems.heading.installation.answer import InstallationResult
from groundstation.systems.heading.installation.model import Belief, Mixture, doubts, installed, predict
from groundstation.systems.heading.installation.settings import InstallationSettings
from groundstation.systems.heading.reason_answer import ALL_PASSED, ENTER, good_to
from groundstation.systems.heading.verdict import is_mostly_steady, round_to_step

FloatArray = NDArray[np.float64]
AIRFRAME, PLATFORM = 0, 1


@dataclass(frozen=True)
class LearnedNumber:
    """One heading error with its interval, deg.

    ``half_width_deg`` reaches from the number to the farther end.
    """

    error_deg: float
    sigma_deg: float
    ends_deg: tuple[float, float]
    half_width_deg: float
    parts: tuple[IntervalPart, ...]


def learned_number(mixture: Mixture, lesson: Lesson, which: int) -> LearnedNumber:
    """Return the airframe's or the platform's error from its mixture.

    Angles are kept together about their middle.
    """
    weight, sigma, share = mixture.weight, mixture.sigma[:, which], mixture.taxi_share[:, which]
    middle = float(mixture.mean[np.argmax(weight), which])
    mean = middle + np.asarray(wrap_180(mixture.mean[:, which] - middle))
    error = float(weight @ mean)
    variance = float(weight @ (sigma**2 + (mean - error) ** 2))
    low, high = (mixture_quantile(tail, mean, sigma, weight) for tail in (0.025, 0.975))
    wrapped = float(wrap_180(error))
    taxi = float(weight @ (share**2)) * lesson.taxi_sigma_deg**2
    wind = float(weight @ (share * mixture.factor) ** 2) * lesson.crosswind_sigma_mps**2
    factor = float(weight @ mixture.factor)
    wind += float(weight @ (share * (mixture.factor - factor)) ** 2) * lesson.crosswind_mps**2
    sigmas = {"taxi": taxi, "wind": wind, "installation": max(variance - taxi - wind, 0.0)}
    parts = tuple(
        IntervalPart(name, float(np.sqrt(value)), NORMAL_95 * float(np.sqrt(value))) for name, value in sigmas.items()
    )
    shift = wrapped - error
    return LearnedNumber(
        wrapped, float(np.sqrt(variance)), (low + shift, high + shift), max(high - error, error - low), parts
    )


def learned_answer(
    lesson: Lesson, belief: Belief, taught_by: tuple[str, ...], settings: InstallationSettings
) -> InstallationResult:
    """Return the answer of a flight with what earlier ones taught.

    It is that of its taxi alone where nothing was taught.
    """
    assert lesson.number_deg is not None and lesson.error_deg is not None
    mixture = predict(belief, lesson, settings)
    airframe, platform = (learned_number(mixture, lesson, which) for which in (AIRFRAME, PLATFORM))
    verdict = verdict_of(lesson, airframe.half_width_deg)
    correction = round_to_step(-airframe.error_deg, lesson.entry_step_deg)
    odd, changed = doubts(belief)
    residual, residual_sigma = _residual(lesson, platform)
    return InstallationResult(
        ins_serial=lesson.ins_serial,
        aircraft=lesson.aircraft,
        flights=belief.flights,
        why_not="",
        verdict=verdict,
        verdict_reason=_reason(lesson, verdict, airframe, correction),
        correction_deg=correction if verdict == "accept" else None,
        error_deg=airframe.error_deg,
        standard_error_deg=airframe.sigma_deg,
        confidence95_deg=airframe.ends_deg,
        half_width_deg=airframe.half_width_deg,
        alone_error_deg=lesson.error_deg,
        alone_half_width_deg=lesson.half_width_deg,
        interval_parts=airframe.parts,
        platform_error_deg=platform.error_deg,
        platform_standard_error_deg=platform.sigma_deg,
        platform_confidence95_deg=platform.ends_deg,
        platform_parts=platform.parts,
        installed=installed(belief),
        odd=named(taught_by, odd.tolist(), settings),
        changed=named(taught_by, changed.tolist(), settings),
        residual_deg=residual,
        residual_sigma_deg=residual_sigma,
    )


def _residual(lesson: Lesson, platform: LearnedNumber) -> tuple[float | None, float | None]:
    """Return the platform's number less the azimuth of the same flight, and its sigma."""
    if lesson.azimuth_deg is None or lesson.azimuth_sigma_deg is None:
        return None, None
    residual = float(wrap_180(platform.error_deg - lesson.azimuth_deg))
    return residual, float(np.hypot(platform.sigma_deg, lesson.azimuth_sigma_deg))


def verdict_of(lesson: Lesson, half_width_deg: float) -> str:
    """Return the verdict on a learned number.

    It rests on the gates of this taxi, and on the whole half width with what was learned.

    Examples
    --------
    >>> lesson = Lesson("", "", "", "", verdict="advisory", failed=("whole_half_width",), limit_deg=1 / 3)
    >>> verdict_of(lesson, 0.3), verdict_of(lesson, 0.4)
    ('accept', 'advisory')
    """
    if lesson.verdict in ("reject", "undecided"):
        return lesson.verdict
    if set(lesson.failed) - {WHOLE}:
        return "extend"
    if lesson.limit_deg is None or half_width_deg <= lesson.limit_deg:
        return "accept"
    return "advisory" if is_mostly_steady(half_width_deg, NORMAL_95 * lesson.taxi_sigma_deg) else "extend"


def _reason(lesson: Lesson, verdict: str, number: LearnedNumber, correction_deg: float) -> str:
    if verdict == "accept":
        return f"{ALL_PASSED}{ENTER}{correction_deg:+g} deg"
    if verdict in ("reject", "undecided"):
        return f"as by this taxi alone: {', '.join(lesson.failed)}"
    if verdict == "extend":
        return f"more of the same taxi is needed: {', '.join(lesson.failed)}"
    return f"{good_to(number.half_width_deg * ARCMIN_PER_DEG)} only"


def named(flights: Sequence[str], probability: Sequence[float], settings: InstallationSettings) -> tuple[str, ...]:
    """Flights whose probability is high enough to name them."""
    return tuple(name for name, one in zip(flights, probability, strict=True) if one > settings.named_probability)


def alone_answer(lesson: Lesson, why_not: str) -> InstallationResult:
    """The answer of the taxi alone, and why nothing was learned."""
    assert lesson.error_deg is not None
    return InstallationResult(
        ins_serial=lesson.ins_serial,
        aircraft=lesson.aircraft,
        flights=0,
        why_not=why_not,
        verdict=lesson.verdict,
        verdict_reason="as by this taxi alone",
        correction_deg=round_to_step(-lesson.error_deg, lesson.entry_step_deg) if lesson.verdict == "accept" else None,
        error_deg=lesson.error_deg,
        standard_error_deg=lesson.half_width_deg / NORMAL_95,
        confidence95_deg=(lesson.error_deg - lesson.half_width_deg, lesson.error_deg + lesson.half_width_deg),
        half_width_deg=lesson.half_width_deg,
        alone_error_deg=lesson.error_deg,
        alone_half_width_deg=lesson.half_width_deg,
        platform_error_deg=lesson.platform_error_deg,
    )
