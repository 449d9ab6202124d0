"""Gates with figure and limit, the verdict that follows from them, and the number to type."""

from dataclasses import dataclass

import numpy as np

from groundstation.base.normal import NORMAL_95
from groundstation.estimators.heading.checks import Disagreement, VarianceRatio
from groundstation.estimators.heading.gating import NOT_TAXI, is_straight_and_fast
from groundstation.estimators.heading.normality import Normality, normality_limits
from groundstation.estimators.heading.samples import Samples
from groundstation.estimators.heading.settings import HeadingSettings
from groundstation.estimators.heading.wording import told
from groundstation.results.heading import Gate, HeadingStep, Sense, Standstill, Verdict

# Required gates whose failure more data may cure; the failure of any other required gate rejects.
CURED_BY_MORE_DATA = frozenset({"standstill_duration", "taxi_seconds", "precision", "half_width", "whole_half_width"})
STANDSTILL_GATE = "standstill_speed_of_mean"


@dataclass(frozen=True)
class Figures:
    """What the gates judge. None: could not be measured."""

    precision_deg: float
    quality_deg: float
    half_width_deg: float
    whole_half_width_deg: float
    steady_sigma_deg: float
    taxi_seconds: float
    normality: Normality | None
    variance: VarianceRatio | None
    drift_deg_per_h: float | None
    drift_sigma_deg_per_h: float | None
    mode_changes: int | None
    disagreement: Disagreement | None
    steps: tuple[HeadingStep, ...]


def _gate(
    name: str,
    title: str,
    value: float | None,
    *,
    low: float | None = None,
    high: float | None = None,
    unit: str = "",
    reason: str = "",
    required: bool = True,
) -> Gate:
    """A gate that passes where low <= value <= high; its limit is the one bound given, or both."""
    bounds = tuple(bound for bound in (low, high) if bound is not None)
    limit = bounds[0] if len(bounds) == 1 else (bounds[0], bounds[1])
    sense: Sense = "between" if len(bounds) == 2 else "at_most" if low is None else "at_least"
    if value is None or not np.isfinite(value):
        return Gate(name, title, None, limit, unit, "not_measured", required, reason or "not measurable", sense)
    passed = (low is None or value >= low) and (high is None or value <= high)
    return Gate(name, title, float(value), limit, unit, "passed" if passed else "failed", required, reason, sense)


def build_gates(
    samples: Samples, standstill: Standstill | None, figures: Figures, settings: HeadingSettings
) -> tuple[Gate, ...]:
    """Every gate of the method in the order of the paper: throughout, standstill, taxi, acceptance."""
    return (
        *_throughout_gates(samples, figures, settings),
        *_standstill_gates(standstill, settings),
        *_taxi_gates(samples, figures, settings),
        *_normality_gates(figures.normality, int(samples.is_used.sum()), settings),
        *_steadiness_gates(figures, settings),
    )


def _throughout_gates(samples: Samples, figures: Figures, settings: HeadingSettings) -> tuple[Gate, ...]:
    judged = is_straight_and_fast(samples, settings) & np.isin(
        samples.gate, ["used", "geometry", "integrity", "outlier"]
    )
    geometry, integrity = samples.geometry[judged], samples.integrity[judged]
    geometry, integrity = geometry[np.isfinite(geometry)], integrity[np.isfinite(integrity)]
    name = samples.geometry_name or "GDOP"
    changes = figures.mode_changes
    return (
        _gate(
            "geometry",
            f"share of straight taxi with {name} at most {settings.geometry_max:g}",
            float(np.mean(geometry <= settings.geometry_max)) if len(geometry) else None,
            low=settings.geometry_share_min,
            reason=f"largest {np.max(geometry):.2f}" if len(geometry) else "no GDOP, PDOP or HDOP in the log",
        ),
        _gate(
            "integrity",
            "share of straight taxi with integrity good",
            float(np.mean(integrity > 0.5)) if len(integrity) else None,
            low=settings.integrity_share_min,
            reason="" if len(integrity) else "integrity flag not in the log",
        ),
        _gate(
            "ground",
            "share of used samples with ground contact proven",
            float(np.mean(samples.on_ground[samples.is_used])) if samples.ground_method else None,
            low=1.0,
            reason=samples.ground_method or "nothing in the log proves ground contact",
        ),
        _gate(
            "ins_mode",
            "changes of INS mode from the end of standstill to the end of taxi",
            None if changes is None else float(changes),
            high=0.0,
            reason="INS mode not in the log" if changes is None else "",
            required=changes is not None,
        ),
    )


def _standstill_gates(standstill: Standstill | None, settings: HeadingSettings) -> tuple[Gate, ...]:
    missing = "no standstill before taxi in the log" if standstill is None else ""
    seconds = None if standstill is None else standstill.end_s - standstill.start_s
    seen, unseen = standstill, missing
    if standstill is not None and standstill.velocity_is_held:
        seen, unseen = None, "the receiver holds its velocity when standing: its error cannot be seen"
    return (
        _gate(
            "standstill_duration",
            "standstill assessed",
            seconds,
            low=settings.standstill_min_s,
            unit="s",
            reason=missing,
        ),
        _gate(
            STANDSTILL_GATE,
            "length of the mean GNSS velocity at standstill",
            None if seen is None else seen.speed_of_mean_mps,
            high=settings.speed_of_mean_max_mps,
            unit="m/s",
            reason=unseen or f"over {seconds:.0f} s",
        ),
        _gate(
            "standstill_bound97",
            "0.97 bound of the mean speed at standstill",
            None if seen is None else seen.speed_bound97_mps,
            high=settings.speed_of_mean_max_mps,
            unit="m/s",
            reason=unseen,
            required=False,
        ),
    )


def _taxi_gates(samples: Samples, figures: Figures, settings: HeadingSettings) -> tuple[Gate, ...]:
    outliers, used = int(np.sum(samples.gate == "outlier")), int(samples.is_used.sum())
    later = int(samples.is_after_lift_off[samples.is_used].sum())
    run = is_straight_and_fast(samples, settings) & np.isin(samples.gate, NOT_TAXI)
    return (
        _gate(
            "not_taxi",
            "share of straight epochs in take-off run and landing roll",
            float(run.sum()) / max(int(run.sum()) + used, 1),
            high=1.0,
            reason=f"{run.sum()} epochs" if run.any() else "",
            required=False,
        ),
        _gate(
            "before_take_off",
            "share of used samples before take-off",
            (used - later) / max(used, 1),
            low=1.0,
            reason=f"{later} of {used} are from after the flight: too little straight taxi before it" if later else "",
        ),
        _gate("taxi_seconds", "straight taxi", figures.taxi_seconds, low=settings.taxi_min_s, unit="s"),
        _gate(
            "outliers",
            "share of outliers among straight samples",
            outliers / max(outliers + used, 1),
            high=settings.outlier_share_max,
            reason=f"{outliers} of {outliers + used}",
        ),
        _gate(
            "gnss_rate",
            "GNSS rate (10 Hz in Markelov 2015)",
            1.0 / samples.interval_s if samples.interval_s > 0 else None,
            low=9.0,
            unit="Hz",
            required=False,
        ),
        _gate(
            "precision",
            "precision e of Markelov 2015",
            figures.precision_deg,
            high=settings.precision_max_deg,
            unit="deg",
        ),
        _gate("quality", "spread of the running mean", figures.quality_deg, high=settings.quality_max_deg, unit="deg"),
        _gate(
            "half_width",
            "half width of the 95 % interval by this taxi alone",
            figures.half_width_deg,
            high=settings.half_width_max_deg,
            unit="deg",
        ),
        _gate(
            "whole_half_width",
            "half width of the 95 % interval, steady sideslip and mounting in it",
            figures.whole_half_width_deg,
            high=settings.whole_half_width_max_deg,
            unit="deg",
            reason=f"{NORMAL_95 * figures.steady_sigma_deg:.2f} deg of it steady: taxi the other way too, log the "
            "wind, or state the sigmas in the aircraft file",
            required=settings.whole_decides,
        ),
    )


def _normality_gates(normal: Normality | None, count: int, settings: HeadingSettings) -> tuple[Gate, ...]:
    few = "too few samples, or no spread"

    def p_value(value: float) -> str:
        return f"p = {value:.2g} for independent samples, not gated"

    skewness, (low, high), distance = normality_limits(settings, max(count, 1))
    return (
        _gate(
            "skewness",
            "skewness of the differences, absolute",
            None if normal is None else abs(normal.skewness),
            high=skewness,
            reason=few if normal is None else p_value(normal.skewness_p),
        ),
        _gate(
            "kurtosis",
            "excess kurtosis of the differences",
            None if normal is None else normal.excess_kurtosis,
            low=low,
            high=high,
            reason=few if normal is None else p_value(normal.kurtosis_p),
        ),
        _gate(
            "normal_distance",
            "distance to the fitted normal distribution",
            None if normal is None else normal.distance,
            high=distance,
            reason=few if normal is None else p_value(normal.distance_p),
        ),
    )


def _steadiness_gates(figures: Figures, settings: HeadingSettings) -> tuple[Gate, ...]:
    variance, parts = figures.variance, figures.disagreement
    drift, sigma = figures.drift_deg_per_h, figures.drift_sigma_deg_per_h
    low, high = settings.variance_ratio_range
    return (
        _gate(
            "variance_ratio",
            "variance of the differences over that of track and sway",
            None if variance is None else variance.ratio,
            low=low,
            high=high,
            reason="no standstill variance, or too few samples"
            if variance is None
            else f"95 % interval {variance.low:.2f} to {variance.high:.2f}",
        ),
        _gate(
            "drift",
            "azimuth drift over its standard deviation",
            abs(drift) / sigma if drift is not None and sigma else None,
            high=settings.drift_sigmas_max,
            reason="taxi too short" if drift is None else f"{drift:+.1f} +- {sigma:.1f} deg/h",
        ),
        _gate(
            "segments",
            "disagreement of segments and minutes, chi-square per degree of freedom",
            None if parts is None else parts.chi2,
            high=1.0 if parts is None else parts.limit,
            reason="one part" if parts is None else parts.told,
            required=parts is not None,
        ),
        _gate(
            "steps",
            "steps of the INS heading",
            float(len(figures.steps)),
            high=0.0,
            reason=", ".join(f"{step.size_deg:+.2f} deg at {step.time_s:.1f} s" for step in figures.steps),
        ),
    )


def _is_curable(gate: Gate, standstill: Standstill | None, settings: HeadingSettings) -> bool:
    if gate.name in CURED_BY_MORE_DATA:
        return True
    # A receiver that passes 97 % of 30-s intervals passes about 70 % of 10-s ones: a short interval says "extend".
    is_short = standstill is not None and standstill.end_s - standstill.start_s < settings.standstill_max_s - 1.0
    return gate.name == STANDSTILL_GATE and is_short


def decide(
    gates: tuple[Gate, ...], standstill: Standstill | None, settings: HeadingSettings
) -> tuple[Verdict, tuple[Gate, ...]]:
    """The verdict and every gate that stands against a correction.

    reject: a required gate failed that more data cannot cure; extend: only such failed as more data may cure;
    undecided: nothing failed, but a required gate could not be measured; accept: every required gate passed.
    """
    failed = tuple(gate for gate in gates if gate.required and gate.state == "failed")
    if any(not _is_curable(gate, standstill, settings) for gate in failed):
        return "reject", failed
    if failed:
        return "extend", failed
    missing = tuple(gate for gate in gates if gate.required and gate.state == "not_measured")
    return ("undecided", missing) if missing else ("accept", ())


def round_to_step(value: float, step: float) -> float:
    """Value rounded to a multiple of ``step`` (half away from zero), without a negative zero.

    Examples
    --------
    >>> round_to_step(-0.8449, 0.1), round_to_step(0.25, 0.1), round_to_step(-0.01, 0.1), round_to_step(1.23, 0.0)
    (-0.8, 0.3, 0.0, 1.23)
    """
    if step <= 0.0:
        return value
    steps = np.sign(value) * np.floor(abs(value) / step + 0.5 + 1e-9)
    return float(round(steps * step, 9)) + 0.0


def explain(verdict: Verdict, gates: tuple[Gate, ...], error_deg: float, step_deg: float) -> str:
    """One line for people: every gate the verdict rests on, the plainest first; a number not to be entered says so."""
    if verdict == "accept":
        return f"every required gate passed: enter {round_to_step(-error_deg, step_deg):+g} deg"
    return f"{told(gates)}. Not to be entered: {round_to_step(-error_deg, step_deg):+g} deg"
