"""The answer: gates, verdict and references around a solution, as the frozen result."""

from dataclasses import asdict, replace

import numpy as np

from groundstation.base.angles import wrap_180
from groundstation.base.dataclasses import dataclass
from groundstation.base.quantiles import NORMAL_95
from groundstation.methods.taxi_error.posterior import ErrorPosterior
from groundstation.results.figures import FigureData
from groundstation.results.roles import IntervalPart
from groundstation.systems.heading import figures as drawn
from groundstation.systems.heading.answer import HeadingResult, Standstill, seconds_of_segments
from groundstation.systems.heading.checks import disagreement, held_seconds, variance_ratio
from groundstation.systems.heading.normality import normality
from groundstation.systems.heading.references import (
    drift_prior,
    mode_changes,
    onboard_comparison,
    parking_heading,
    runway_checks,
)
from groundstation.systems.heading.settings import HeadingSettings
from groundstation.systems.heading.solution import Solution
from groundstation.systems.heading.standstill import StandstillData
from groundstation.systems.heading.steady import SteadyPrior
from groundstation.systems.heading.unproven_ground import count_left_out
from groundstation.systems.heading.verdict import JudgedValues, build_gates, decide, explain, round_to_step
from groundstation.systems.known import AircraftData, SiteData
from groundstation.tables.sources import said_of
from groundstation.tables.table import Flight


@dataclass(frozen=True)
class _Error:
    """Heading error of the airframe, wrapped, with its intervals.

    Parameters
    ----------
    error_deg, sigma_deg
        The sigma includes ``common_sigma_deg``.
    whole_interval_deg : (low, high)
        With the steady terms.
    taxi_interval_deg : (low, high)
        Without them: what this taxi shows.
    steady_sigma_deg
        Sigma of the steady terms: wind, and sideslip that is the same in every direction.
    common_sigma_deg
        Sigma of what all samples share: declination, and sideslip that is the same in every direction.
    platform_sigma_deg, platform_interval_deg
        Those of the platform's error: mounting taken off, its sigma included.
    parts
        Parts of the whole interval.
    """

    error_deg: float
    sigma_deg: float
    whole_interval_deg: tuple[float, float]
    taxi_interval_deg: tuple[float, float]
    steady_sigma_deg: float
    common_sigma_deg: float
    platform_sigma_deg: float
    platform_interval_deg: tuple[float, float]
    parts: tuple[IntervalPart, ...]

    @property
    def whole_half_width_deg(self) -> float:
        return 0.5 * (self.whole_interval_deg[1] - self.whole_interval_deg[0])


def build_answer(
    flight: Flight,
    topics: tuple[str, str],
    solution: Solution,
    standstill: StandstillData,
    settings: HeadingSettings,
    aircraft: AircraftData,
    site: SiteData,
    steady: SteadyPrior,
    whole: HeadingResult | None = None,
) -> HeadingResult:
    """Judge a solution and set it beside its references.

    ``topics`` are those of INS and GNSS; ``whole`` is the answer with the straight epochs of unproven ground.
    """
    error = _error_of(solution, steady)
    assessed = _assessed(standstill, solution.posterior)
    unproven = count_left_out(solution.samples, settings, whole)
    values = _judged_values(flight, topics[0], solution, assessed, settings, error)
    values = replace(values, unproven_ground=unproven, whole=whole, interval_deg=error.whole_interval_deg)
    gates = build_gates(solution.samples, assessed, values, settings)
    verdict, deciding = decide(gates, assessed, settings)
    step_deg, running = aircraft.entry_step_deg, solution.running
    plain = HeadingResult(
        ins_topic=topics[0],
        gnss_topic=topics[1],
        heading_source=solution.samples.heading_source,
        verdict=verdict,
        verdict_reason=explain(verdict, deciding, error.error_deg, step_deg, error.whole_half_width_deg),
        error_deg=error.error_deg,
        standard_error_deg=error.sigma_deg,
        confidence95_deg=error.whole_interval_deg,
        paper_error_deg=float(wrap_180(running.mean_deg[-1])),
        precision_deg=float(running.precision_deg[-1]),
        quality_deg=float(running.quality_deg[-1]),
        estimate_sd_deg=float(running.sigma_deg[-1]),
        samples=len(solution.used),
        taxi_seconds=values.taxi_seconds,
        drift_deg_per_h=solution.drift_deg_per_h,
        drift_sigma_deg_per_h=solution.drift_sigma_deg_per_h,
        correction_deg=round_to_step(-error.error_deg, step_deg) if verdict == "accept" else None,
        entry_step_deg=step_deg,
        gates=gates,
        standstill=assessed,
        segments=solution.segments,
        directions=solution.directions,
        uncorrected_error_deg=solution.uncorrected_deg,
        reference_time_s=solution.reference_time_s,
        segment_spread_deg=solution.posterior.parameter("segment_deg"),
        wander_spread_deg=solution.posterior.parameter("wander_deg"),
        wander_s=solution.posterior.parameter("wander_s"),
        steps=solution.steps,
        unproven_ground=unproven,
        settings=_settings_of(settings, aircraft),
        figures=_figures_of(solution, standstill, settings, error.common_sigma_deg),
    )
    result = _with_arm(_with_steady_terms(plain, error, solution, steady), solution)
    return _with_references(result, flight, solution, standstill, settings, aircraft, site)


def _error_of(solution: Solution, steady: SteadyPrior) -> _Error:
    posterior, declination_deg = solution.posterior, solution.samples.heading_sigma_deg
    common_deg = float(np.hypot(declination_deg, steady.same_sigma_deg))
    wrapped = float(wrap_180(posterior.error_deg))
    shift = wrapped - posterior.error_deg  # differences near +-180 deg were kept together
    low, high = posterior.interval_deg(extra_sigma_deg=common_deg)
    least, most = posterior.interval_deg(extra_sigma_deg=declination_deg, is_measured=True)
    platform_sigma_deg = float(np.hypot(common_deg, steady.mounting_sigma_deg))
    ends_deg = posterior.interval_deg(extra_sigma_deg=platform_sigma_deg)
    off = float(wrap_180(wrapped - steady.mounting_deg)) - posterior.error_deg
    measured_sigma_deg = float(np.sqrt(max(posterior.standard_error_deg**2 - posterior.apart_sigma_deg**2, 0.0)))
    sigmas_deg = {
        "taxi": (float(np.hypot(measured_sigma_deg, declination_deg)), 0.5 * (most - least)),
        "wind": (posterior.apart_sigma_deg, NORMAL_95 * posterior.apart_sigma_deg),
        "installation": (steady.same_sigma_deg, NORMAL_95 * steady.same_sigma_deg),
    }
    return _Error(
        error_deg=wrapped,
        sigma_deg=float(np.hypot(posterior.standard_error_deg, common_deg)),
        whole_interval_deg=(low + shift, high + shift),
        taxi_interval_deg=(least + shift, most + shift),
        steady_sigma_deg=float(np.hypot(posterior.apart_sigma_deg, steady.same_sigma_deg)),
        common_sigma_deg=common_deg,
        platform_sigma_deg=float(np.hypot(posterior.standard_error_deg, platform_sigma_deg)),
        platform_interval_deg=(ends_deg[0] + off, ends_deg[1] + off),
        parts=tuple(IntervalPart(name, sigma, half_width) for name, (sigma, half_width) in sigmas_deg.items()),
    )


def _assessed(standstill: StandstillData, posterior: ErrorPosterior) -> Standstill | None:
    if standstill.answer is None or not standstill.is_informative:
        return standstill.answer
    return replace(
        standstill.answer,
        white_sigma_mps=posterior.parameter("white_mps"),
        correlated_sigma_mps=posterior.parameter("correlated_mps"),
        correlation_time_s=posterior.parameter("correlation_s"),
    )


def _judged_values(
    flight: Flight,
    ins_topic: str,
    solution: Solution,
    assessed: Standstill | None,
    settings: HeadingSettings,
    error: _Error,
) -> JudgedValues:
    used, running = solution.used, solution.running
    begin_s = assessed.end_s if assessed else float(used.time_s[0])  # alignment may end while the aircraft stands
    return JudgedValues(
        precision_deg=float(running.precision_deg[-1]),
        quality_deg=float(running.quality_deg[-1]),
        half_width_deg=0.5 * (error.taxi_interval_deg[1] - error.taxi_interval_deg[0]),
        whole_half_width_deg=error.whole_half_width_deg,
        steady_sigma_deg=error.steady_sigma_deg,
        taxi_seconds=seconds_of_segments(
            ((part.start_s, part.end_s) for part in solution.segments), solution.samples.interval_s
        ),
        normality=normality(solution.without_wind_deg),
        variance=variance_ratio(used, solution.without_wind_deg, assessed, settings.sway_line_s),
        drift_deg_per_h=solution.drift_deg_per_h,
        drift_sigma_deg_per_h=solution.drift_sigma_deg_per_h,
        mode_changes=mode_changes(flight, ins_topic, begin_s, float(used.time_s[-1])),
        disagreement=disagreement(solution.parts, settings.disagreement_probability, solution.wind_of_parts_deg),
        steps=solution.steps,
        held_s=held_seconds(solution.samples),
    )


def _with_steady_terms(result: HeadingResult, error: _Error, solution: Solution, steady: SteadyPrior) -> HeadingResult:
    """Add the parts of the interval, the platform's number and the wind that was used."""
    return replace(
        result,
        confidence95_measured_deg=error.taxi_interval_deg,
        steady_sigma_deg=error.steady_sigma_deg,
        steady_origin="aircraft file" if steady.is_stated else "shipped figures",
        interval_parts=error.parts,
        platform_error_deg=float(wrap_180(error.error_deg - steady.mounting_deg)),
        platform_standard_error_deg=error.platform_sigma_deg,
        platform_confidence95_deg=error.platform_interval_deg,
        wind=steady.wind,
        aircraft_class=steady.aircraft_class,
        sideslip_deg=solution.sideslip_deg,
        mean_direction=solution.mean_direction,
    )


def _with_arm(result: HeadingResult, solution: Solution) -> HeadingResult:
    knowledge = solution.knowledge
    rest_m, sigma_m = solution.posterior.coefficient(1)  # what the straight samples add to the applied arm
    result = replace(
        result,
        lever_arm_m=knowledge.applied_arm_m + rest_m,
        lever_arm_sigma_m=sigma_m,
        lever_arm_origin=knowledge.origin,
    )
    if not knowledge.is_offset_observable:
        return result
    return replace(result, time_offset_s=knowledge.offset_s, time_offset_sigma_s=knowledge.offset_sigma_s)


def _with_references(
    result: HeadingResult,
    flight: Flight,
    solution: Solution,
    standstill: StandstillData,
    settings: HeadingSettings,
    aircraft: AircraftData,
    site: SiteData,
) -> HeadingResult:
    error, sigma = result.error_deg, result.standard_error_deg
    parking = parking_heading(
        solution.samples,
        standstill.in_interval,
        flight,
        site,
        (error - _stepped_deg(solution, standstill), sigma, solution.reference_time_s),
        (solution.drift_deg_per_h, solution.drift_sigma_deg_per_h),
        drift_prior(aircraft.ins_class, said_of(flight, result.ins_topic, "ins_class")),
    )
    return replace(
        result,
        parking_ins_heading_deg=parking.ins_heading_deg,
        parking_heading_deg=parking.heading_deg,
        parking_sigma_deg=parking.sigma_deg,
        reference_parking_heading_deg=parking.reference_deg,
        reference_residual_arcmin=parking.residual_arcmin,
        runway=runway_checks(solution.samples, site, error, sigma, settings),
        onboard=onboard_comparison(flight, float(solution.used.time_s[-1]), error),
    )


def _stepped_deg(solution: Solution, standstill: StandstillData) -> float:
    """Return what the steps after the standstill added to the error."""
    if not standstill.in_interval.any():
        return 0.0
    parked_s = float(solution.samples.time_s[standstill.in_interval][-1])
    return sum(step.size_deg for step in solution.steps if step.time_s > parked_s)


def _settings_of(settings: HeadingSettings, aircraft: AircraftData) -> dict[str, float | str | bool]:
    out: dict[str, float | str | bool] = {}
    for name, value in (
        asdict(settings) | {f"aircraft.{key}": value for key, value in asdict(aircraft).items()}
    ).items():
        if isinstance(value, tuple) and len(value) == 2:
            out[f"{name}.low"], out[f"{name}.high"] = value
        elif isinstance(value, tuple):
            out[name] = ", ".join(f"{one:g}" for one in value)
        elif value is not None:
            out[name] = value
    return out


def _figures_of(
    solution: Solution, standstill: StandstillData, settings: HeadingSettings, common_sigma_deg: float
) -> tuple[FigureData, ...]:
    used, differences, posterior = solution.used, solution.differences, solution.posterior
    half_width_deg = posterior.growth_half_width_deg(extra_sigma_deg=common_sigma_deg)
    spectrum = drawn.spectrum_figure(
        differences.time_s,
        differences.difference_deg - posterior.error_deg,
        differences.speed_mps,
        posterior.typical(),
    )
    return (
        drawn.samples_figure(solution.samples, posterior.error_deg, solution.weight),
        drawn.lanes_figure(solution.samples),
        drawn.running_figure(used.time_s, solution.running, solution.growth_samples, half_width_deg),
        *drawn.distribution_figures(used.time_s, differences.difference_deg, settings.growth_steps),
        *drawn.standstill_figures(solution.samples, standstill),
        *(() if spectrum is None else (spectrum,)),
    )
