"""Gates with figure and limit, the verdict that follows from them, and the number to type."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from groundstation.base.quantiles import NORMAL_95
from groundstation.base.units import ARCMIN_PER_DEG
from groundstation.methods.taxi.gating import NOT_TAXI, is_straight_and_fast
from groundstation.methods.taxi.samples import VELOCITY_SIGMA, TaxiSamples
from groundstation.results.gates import Bound, Gate, judged_gate
from groundstation.results.rules import Rejudged
from groundstation.systems.heading.answer import HeadingResult, HeadingStep, Standstill, Verdict
from groundstation.systems.heading.checks import Disagreement, VarianceRatio
from groundstation.systems.heading.normality import Normality, normality_limits
from groundstation.systems.heading.reason_answer import ALL_PASSED, BETWEEN, ENTER, IF_ENOUGH, NOT_ENTERED, good_to
from groundstation.systems.heading.settings import HeadingSettings
from groundstation.systems.heading.wording import told

# Required gates whose failure more data may cure; the failure of any other required gate rejects.
CURED_BY_MORE_DATA = frozenset({"standstill_duration", "taxi_seconds", "precision", "half_width", "whole_half_width"})
WHOLE, TAXI_ALONE = "whole_half_width", "half_width"
PAPER_RATE_HZ, LEAST_RATE_HZ = 10.0, 0.2
HELD_MAX_S = 1.0  # a receiver is late by less
CURES = "taxi the other way, state the wind, or let the tool learn the installation"
STANDSTILL_GATE = "standstill_speed_of_mean"
Bounds = Mapping[str, Bound]


@dataclass(frozen=True)
class Figures:
    """Figures that the gates judge. None: could not be measured."""

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
    held_s: float | None = None


def gate_bounds(settings: HeadingSettings, samples: int, rate_hz: float = PAPER_RATE_HZ) -> dict[str, Bound]:
    """Return the lowest and highest value with which each gate passes.

    It holds for those whose limits are settings. The limit of e is for the paper's 10 Hz: fewer epochs of the same taxi
    give a larger e and no larger error.
    """
    slower = float(np.sqrt(max(PAPER_RATE_HZ / max(rate_hz, LEAST_RATE_HZ), 1.0)))
    skewness, kurtosis, distance = normality_limits(settings, max(samples, 1))
    return {
        "geometry": (settings.geometry_share_min, None),
        "integrity": (settings.integrity_share_min, None),
        "standstill_duration": (settings.standstill_min_s, None),
        STANDSTILL_GATE: (None, settings.speed_of_mean_max_mps),
        "standstill_bound97": (None, settings.speed_of_mean_max_mps),
        "taxi_seconds": (settings.taxi_min_s, None),
        "outliers": (None, settings.outlier_share_max),
        "precision": (None, settings.precision_max_deg * slower),
        "quality": (None, settings.quality_max_deg),
        "half_width": (None, settings.half_width_max_deg),
        "whole_half_width": (None, settings.whole_half_width_max_deg),
        "skewness": (None, skewness),
        "kurtosis": kurtosis,
        "normal_distance": (None, distance),
        "variance_ratio": settings.variance_ratio_range,
        "drift": (None, settings.drift_sigmas_max),
    }


def rejudge(answer: HeadingResult, settings: HeadingSettings) -> tuple[Rejudged, ...]:
    """Apply other limits to the gates and the verdict of an answer.

    The values are those that it was judged by.
    """
    rate_hz = next((gate.value for gate in answer.gates if gate.name == "gnss_rate"), None) or PAPER_RATE_HZ
    bounds = gate_bounds(settings, answer.samples, rate_hz)
    after = tuple(gate.under(bounds[gate.name]) if gate.name in bounds else gate for gate in answer.gates)
    required = _required_by(settings)
    after = tuple(replace(gate, required=required.get(gate.name, gate.required)) for gate in after)
    verdict, _ = decide(after, answer.standstill, settings)
    return (Rejudged("heading", answer.verdict, verdict, answer.gates, after),)


def _required_by(settings: HeadingSettings) -> dict[str, bool]:
    """Tell for the gates that a setting decides whether they are required."""
    return {
        "precision": settings.precision_decides,
        TAXI_ALONE: settings.half_width_decides,
        WHOLE: settings.whole_decides,
    }


def build_gates(
    samples: TaxiSamples, standstill: Standstill | None, figures: Figures, settings: HeadingSettings
) -> tuple[Gate, ...]:
    """Build every gate of the method in the order of the paper.

    Throughout, standstill, taxi, acceptance.
    """
    rate_hz = 1.0 / samples.interval_s if samples.interval_s > 0.0 else PAPER_RATE_HZ
    bounds = gate_bounds(settings, int(samples.is_used.sum()), rate_hz)
    return (
        *_throughout_gates(samples, figures, settings, bounds),
        *_standstill_gates(standstill, bounds),
        *_taxi_gates(samples, figures, settings, bounds),
        *_normality_gates(figures.normality, bounds),
        *_steadiness_gates(figures, bounds),
    )


def _throughout_gates(
    samples: TaxiSamples, figures: Figures, settings: HeadingSettings, bounds: Bounds
) -> tuple[Gate, ...]:
    judged = is_straight_and_fast(samples, settings) & np.isin(
        samples.gate, ["used", "geometry", "integrity", "outlier"]
    )
    geometry, integrity = samples.geometry[judged], samples.integrity[judged]
    geometry, integrity = geometry[np.isfinite(geometry)], integrity[np.isfinite(integrity)]
    is_sigma = samples.geometry_name == VELOCITY_SIGMA
    most = settings.velocity_sigma_max_mps if is_sigma else settings.geometry_max
    geometry = geometry * (most / settings.geometry_max)
    limit = f"at most {most:g} m/s" if is_sigma else f"at most {most:g}"
    name = f"{VELOCITY_SIGMA} of the receiver" if is_sigma else samples.geometry_name or "GDOP"
    changes = figures.mode_changes
    return (
        judged_gate(
            bounds["geometry"],
            "geometry",
            f"share of straight taxi with {name} {limit}",
            float(np.mean(geometry <= most)) if len(geometry) else None,
            reason=f"largest {np.max(geometry):.3g}" if len(geometry) else "no GDOP, PDOP or HDOP in the log",
        ),
        judged_gate(
            bounds["integrity"],
            "integrity",
            "share of straight taxi with integrity good",
            float(np.mean(integrity > 0.5)) if len(integrity) else None,
            reason="" if len(integrity) else "no integrity flag, fix type or RAIM in the log",
            required=bool(len(integrity)),
        ),
        judged_gate(
            (1.0, None),
            "ground",
            "share of used samples with ground contact proven",
            float(np.mean(samples.on_ground[samples.is_used])) if samples.ground_method else None,
            reason=samples.ground_method or "nothing in the log proves ground contact",
        ),
        judged_gate(
            (None, 0.0),
            "ins_mode",
            "changes of INS mode from the end of standstill to the end of taxi",
            None if changes is None else float(changes),
            reason="INS mode not in the log" if changes is None else "",
            required=changes is not None,
        ),
    )


def _standstill_gates(standstill: Standstill | None, bounds: Bounds) -> tuple[Gate, ...]:
    missing = "no standstill before taxi in the log" if standstill is None else ""
    seconds = None if standstill is None else standstill.end_s - standstill.start_s
    seen, unseen = standstill, missing
    if standstill is not None and standstill.velocity_is_held:
        seen, unseen = None, "the receiver holds its velocity when standing: its error cannot be seen"
    return (
        judged_gate(
            bounds["standstill_duration"],
            "standstill_duration",
            "standstill assessed",
            seconds,
            unit="s",
            reason=missing,
        ),
        judged_gate(
            bounds[STANDSTILL_GATE],
            STANDSTILL_GATE,
            "length of the mean GNSS velocity at standstill",
            None if seen is None else seen.speed_of_mean_mps,
            unit="m/s",
            reason=unseen or f"over {seconds:.0f} s",
        ),
        judged_gate(
            bounds["standstill_bound97"],
            "standstill_bound97",
            "0.97 bound of the mean speed at standstill",
            None if seen is None else seen.speed_bound97_mps,
            unit="m/s",
            reason=unseen,
            required=False,
        ),
    )


def _taxi_gates(samples: TaxiSamples, figures: Figures, settings: HeadingSettings, bounds: Bounds) -> tuple[Gate, ...]:
    outliers, used = int(np.sum(samples.gate == "outlier")), int(samples.is_used.sum())
    later = int(samples.is_after_lift_off[samples.is_used].sum())
    run = is_straight_and_fast(samples, settings) & np.isin(samples.gate, NOT_TAXI)
    required = _required_by(settings)
    return (
        judged_gate(
            (None, 1.0),
            "not_taxi",
            "share of straight epochs in take-off run and landing roll",
            float(run.sum()) / max(int(run.sum()) + used, 1),
            reason=f"{run.sum()} epochs" if run.any() else "",
            required=False,
        ),
        judged_gate(
            (1.0, None),
            "before_take_off",
            "share of used samples before take-off",
            (used - later) / max(used, 1),
            reason=f"{later} of {used} are from after the flight: too little straight taxi before it" if later else "",
        ),
        judged_gate(bounds["taxi_seconds"], "taxi_seconds", "straight taxi", figures.taxi_seconds, unit="s"),
        judged_gate(
            bounds["outliers"],
            "outliers",
            "share of outliers among straight samples",
            outliers / max(outliers + used, 1),
            reason=f"{outliers} of {outliers + used}",
        ),
        judged_gate(
            (None, HELD_MAX_S),
            "held_velocity",
            "turns of the INS that the GNSS velocity does not show",
            figures.held_s,
            unit="s",
            reason="no turn in motion" if figures.held_s is None else "",
            required=figures.held_s is not None,
        ),
        judged_gate(
            (9.0, None),
            "gnss_rate",
            "GNSS rate (10 Hz in Markelov 2015)",
            1.0 / samples.interval_s if samples.interval_s > 0 else None,
            unit="Hz",
            required=False,
        ),
        judged_gate(
            bounds["precision"],
            "precision",
            "precision e of Markelov 2015",
            figures.precision_deg,
            unit="deg",
            required=required["precision"],
        ),
        judged_gate(bounds["quality"], "quality", "spread of the running mean", figures.quality_deg, unit="deg"),
        judged_gate(
            bounds["half_width"],
            "half_width",
            "half width of the 95 % interval from this taxi alone",
            figures.half_width_deg,
            unit="deg",
            required=required[TAXI_ALONE],
        ),
        judged_gate(
            bounds["whole_half_width"],
            "whole_half_width",
            "half width of the 95 % interval: this taxi, wind and installation together",
            figures.whole_half_width_deg,
            unit="deg",
            reason=f"{NORMAL_95 * figures.steady_sigma_deg:.2f} deg of it wind and installation",
            required=required[WHOLE],
        ),
    )


def _normality_gates(normal: Normality | None, bounds: Bounds) -> tuple[Gate, ...]:
    few = "too few samples, or no spread"

    def p_value(value: float) -> str:
        return f"p = {value:.2g} for independent samples, not gated"

    return (
        judged_gate(
            bounds["skewness"],
            "skewness",
            "skewness of the differences, absolute",
            None if normal is None else abs(normal.skewness),
            reason=few if normal is None else p_value(normal.skewness_p),
        ),
        judged_gate(
            bounds["kurtosis"],
            "kurtosis",
            "excess kurtosis of the differences",
            None if normal is None else normal.excess_kurtosis,
            reason=few if normal is None else p_value(normal.kurtosis_p),
        ),
        judged_gate(
            bounds["normal_distance"],
            "normal_distance",
            "distance to the fitted normal distribution",
            None if normal is None else normal.distance,
            reason=few if normal is None else p_value(normal.distance_p),
        ),
    )


def _steadiness_gates(figures: Figures, bounds: Bounds) -> tuple[Gate, ...]:
    variance, parts = figures.variance, figures.disagreement
    drift, sigma = figures.drift_deg_per_h, figures.drift_sigma_deg_per_h
    return (
        judged_gate(
            bounds["variance_ratio"],
            "variance_ratio",
            "variance of the differences over that of track and sway",
            None if variance is None else variance.ratio,
            reason="no standstill variance, or too few samples"
            if variance is None
            else f"95 % interval {variance.low:.2f} to {variance.high:.2f}",
        ),
        judged_gate(
            bounds["drift"],
            "drift",
            "azimuth drift over its standard deviation",
            abs(drift) / sigma if drift is not None and sigma else None,
            reason="taxi too short" if drift is None else f"{drift:+.1f} +- {sigma:.1f} deg/h",
        ),
        judged_gate(
            (None, 1.0 if parts is None else parts.limit),
            "segments",
            "disagreement of segments and minutes, chi-square per degree of freedom",
            None if parts is None else parts.chi2,
            reason="one part" if parts is None else parts.told,
            required=parts is not None,
        ),
        judged_gate(
            (None, 0.0),
            "steps",
            "steps of the INS heading",
            float(len(figures.steps)),
            reason=", ".join(f"{step.size_deg:+.2f} deg at {step.time_s:.1f} s" for step in figures.steps),
        ),
    )


def _is_curable(gate: Gate, standstill: Standstill | None, settings: HeadingSettings) -> bool:
    if gate.name in CURED_BY_MORE_DATA:
        return True
    # A receiver that passes 97 % of 30-s intervals passes about 70 % of 10-s ones: a short interval says "extend".
    is_short = standstill is not None and standstill.end_s - standstill.start_s < settings.standstill_max_s - 1.0
    return gate.name == STANDSTILL_GATE and is_short


def is_mostly_steady(whole_deg: float, alone_deg: float) -> bool:
    """Tell whether wind and installation make more of the interval than this taxi.

    Examples
    --------
    >>> is_mostly_steady(0.3, 0.2), is_mostly_steady(0.3, 0.25)
    (True, False)
    """
    return whole_deg**2 >= 2.0 * alone_deg**2


def _lacks_steady_parts(gates: tuple[Gate, ...]) -> bool:
    """Tell whether more taxi would not mend the whole interval.

    True also where its parts are not known.
    """
    whole, alone = (next((gate.value for gate in gates if gate.name == name), None) for name in (WHOLE, TAXI_ALONE))
    return whole is None or alone is None or is_mostly_steady(whole, alone)


def decide(
    gates: tuple[Gate, ...], standstill: Standstill | None, settings: HeadingSettings
) -> tuple[Verdict, tuple[Gate, ...]]:
    """The verdict and every gate that stands against a correction.

    reject: a required gate failed that more data cannot cure; extend: only such failed as more of the same may cure;
    undecided: nothing failed but for steady terms, but a required gate could not be measured; advisory: only the whole
    interval is too wide, and wind and installation are the larger part of it, which no length of the same taxi cures;
    accept: every required gate passed.
    """
    failed = tuple(gate for gate in gates if gate.required and gate.state == "failed")
    if any(not _is_curable(gate, standstill, settings) for gate in failed):
        return "reject", failed
    if failed and ({gate.name for gate in failed} != {WHOLE} or not _lacks_steady_parts(gates)):
        return "extend", failed
    missing = tuple(gate for gate in gates if gate.required and gate.state == "not_measured")
    if missing:
        return "undecided", (*failed, *missing)
    return ("advisory", failed) if failed else ("accept", ())


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


def explain(
    verdict: Verdict, gates: tuple[Gate, ...], error_deg: float, step_deg: float, half_width_deg: float = float("nan")
) -> str:
    """Tell in one line the gates the verdict rests on, the plainest first.

    A number not to be entered says so.
    """
    number = f"{round_to_step(-error_deg, step_deg):+g} deg"
    if verdict == "accept":
        return f"{ALL_PASSED}{ENTER}{number}"
    if verdict == "advisory":
        return f"{good_to(half_width_deg * ARCMIN_PER_DEG)}{BETWEEN}{CURES}{IF_ENOUGH}{number}"
    return f"{told(gates)}{NOT_ENTERED}{number}"
