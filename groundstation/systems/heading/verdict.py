"""Gates with figure and limit, the verdict that follows from them, and the number to type."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from groundstation.base.dataclasses import dataclass
from groundstation.base.quantiles import NORMAL_95
from groundstation.base.units import ARCMIN_PER_DEG
from groundstation.base.words import counted
from groundstation.methods.taxi.gating import NOT_TAXI, is_straight_and_fast
from groundstation.methods.taxi.samples import VELOCITY_SIGMA, TaxiSamples
from groundstation.results.gates import Bound, Gate, judged_gate
from groundstation.results.rules import Rejudged
from groundstation.systems.heading.answer import HeadingResult, HeadingStep, Standstill, UnprovenGround, Verdict
from groundstation.systems.heading.checks import Disagreement, VarianceRatio
from groundstation.systems.heading.gates_answer import (
    CURED_BY_MORE_DATA,
    GATES,
    STANDSTILL_SPEED,
    TAXI_ALONE,
    UNPROVEN,
    UNPROVEN_OPEN,
    WHOLE,
    GateKind,
)
from groundstation.systems.heading.normality import Normality, normality_limits
from groundstation.systems.heading.reason_answer import ALL_PASSED, BETWEEN, ENTER, IF_ENOUGH, NOT_ENTERED, good_to
from groundstation.systems.heading.settings import HeadingSettings
from groundstation.systems.heading.unproven_ground import objections, reason_of
from groundstation.systems.heading.wording import told

PAPER_RATE_HZ, LEAST_RATE_HZ = 10.0, 0.2
OF_NORMALITY = ("skewness", "kurtosis", "normal_distance")
CURES = "taxi the other way, state the wind, or let the tool learn the installation"


@dataclass(frozen=True)
class JudgedValues:
    """Values that the gates judge, beside those of the samples. None: could not be measured.

    ``half_width_deg`` is that of the interval from this taxi alone, ``whole_half_width_deg`` that with the steady
    terms, whose sigma is ``steady_sigma_deg``; ``interval_deg`` is that whole interval. ``whole`` is the answer with
    the epochs of ``unproven_ground``, where it was asked for.
    """

    taxi_seconds: float
    precision_deg: float | None = None
    quality_deg: float | None = None
    half_width_deg: float | None = None
    whole_half_width_deg: float | None = None
    steady_sigma_deg: float | None = None
    normality: Normality | None = None
    variance: VarianceRatio | None = None
    drift_deg_per_h: float | None = None
    drift_sigma_deg_per_h: float | None = None
    mode_changes: int | None = None
    disagreement: Disagreement | None = None
    steps: tuple[HeadingStep, ...] = ()
    held_s: float | None = None
    unproven_ground: UnprovenGround | None = None
    whole: HeadingResult | None = None
    interval_deg: tuple[float, float] = (float("nan"), float("nan"))


def gate_bounds(settings: HeadingSettings, samples: int, rate_hz: float = PAPER_RATE_HZ) -> dict[str, Bound]:
    """Return the lowest and highest value with which each gate passes.

    It holds for those whose limits are settings. The limit of e is for the paper's 10 Hz: fewer epochs of the same taxi
    give a larger e and no larger error.
    """
    slower = float(np.sqrt(max(PAPER_RATE_HZ / max(rate_hz, LEAST_RATE_HZ), 1.0)))
    skewness, kurtosis, distance = normality_limits(settings, max(samples, 1))
    by_the_flight: dict[str, Bound] = {
        "precision": (None, settings.precision_max_deg * slower),
        "skewness": (None, skewness),
        "kurtosis": kurtosis,
        "normal_distance": (None, distance),
    }
    return {kind.name: _as_set(kind, settings) for kind in GATES.values() if kind.setting} | by_the_flight


def _as_set(kind: GateKind, settings: HeadingSettings) -> Bound:
    """Return the bound of a gate as its setting states it."""
    stated = getattr(settings, kind.setting)
    if isinstance(stated, tuple):
        return stated
    return (stated, None) if kind.sense == "at_least" else (None, stated)


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
    return {kind.name: bool(getattr(settings, kind.decided_by)) for kind in GATES.values() if kind.decided_by}


@dataclass(frozen=True)
class _Judge:
    """Judge of values by the bounds of one flight."""

    bounds: Mapping[str, Bound]
    is_required: Mapping[str, bool]

    def __call__(
        self, name: str, value: float | None, reason: str = "", limit: Bound | None = None, geometry: str = ""
    ) -> Gate:
        kind = GATES[name]
        usual = kind.required == "always" or (kind.required == "if_measured" and value is not None)
        return judged_gate(
            limit or kind.limit or self.bounds[name],
            name,
            kind.title.format(geometry=geometry),
            value,
            unit=kind.unit,
            reason=reason,
            required=self.is_required.get(name, usual),
        )


def build_gates(
    samples: TaxiSamples, standstill: Standstill | None, values: JudgedValues, settings: HeadingSettings
) -> tuple[Gate, ...]:
    """Build every gate of the method in the order of the paper.

    Throughout, standstill, taxi, acceptance.
    """
    rate_hz = 1.0 / samples.interval_s if samples.interval_s > 0.0 else PAPER_RATE_HZ
    bounds = gate_bounds(settings, int(samples.is_used.sum()), rate_hz)
    judge = _Judge(bounds, _required_by(settings))
    throughout = _throughout_gates(samples, values, settings, judge)
    later = (
        *_standstill_gates(standstill, judge),
        *_taxi_gates(samples, settings, judge),
        *_accuracy_gates(samples, values, judge),
        *_normality_gates(values.normality, judge),
        *_steadiness_gates(values, judge),
    )
    verdict, _ = decide((*throughout, *later), standstill, settings)
    unproven = _unproven_gates((*throughout, *later), values, judge, is_heard=verdict != "undecided")
    return (*throughout, *unproven, *later)


def _unproven_gates(
    others: tuple[Gate, ...], values: JudgedValues, judge: _Judge, *, is_heard: bool
) -> tuple[Gate, ...]:
    """Judge what the straight epochs of unproven ground say against the others.

    It is not heard where the others leave the answer undecided: nothing is claimed then. Where it only asks for more
    data, as the others would, that is no contradiction: the second gate fails.
    """
    if values.unproven_ground is None:
        return tuple(judge(name, 0.0, "no straight epoch is left out for it") for name in (UNPROVEN, UNPROVEN_OPEN))
    left = values.unproven_ground
    found = objections(others, values.interval_deg, values.whole) if is_heard else None
    reason = reason_of(left, found)
    if found is None:
        return judge(UNPROVEN, None, reason), judge(UNPROVEN_OPEN, None, reason)
    counts = (0.0, float(found.count)) if found.is_curable else (float(found.count), 0.0)
    return judge(UNPROVEN, counts[0], reason), judge(UNPROVEN_OPEN, counts[1], reason)


def _throughout_gates(
    samples: TaxiSamples, values: JudgedValues, settings: HeadingSettings, judge: _Judge
) -> tuple[Gate, ...]:
    judged = is_straight_and_fast(samples, settings) & np.isin(
        samples.gate, ["used", "geometry", "integrity", "outlier"]
    )
    geometry, integrity = samples.geometry[judged], samples.integrity[judged]
    geometry, integrity = geometry[np.isfinite(geometry)], integrity[np.isfinite(integrity)]
    is_sigma = samples.geometry_name == VELOCITY_SIGMA
    most = settings.velocity_sigma_max_mps if is_sigma else settings.geometry_max
    geometry = geometry * (most / settings.geometry_max)  # samples hold a velocity sigma as a factor: back to m/s
    limit = f"at most {most:g} m/s" if is_sigma else f"at most {most:g}"
    name = f"{VELOCITY_SIGMA} of the receiver" if is_sigma else samples.geometry_name or "GDOP"
    changes = values.mode_changes
    return (
        judge(
            "geometry",
            float(np.mean(geometry <= most)) if len(geometry) else None,
            f"largest {np.max(geometry):.3g}" if len(geometry) else "no GDOP, PDOP or HDOP in the log",
            geometry=f"{name} {limit}",
        ),
        judge(
            "integrity",
            float(np.mean(integrity > 0.5)) if len(integrity) else None,
            "" if len(integrity) else "no integrity flag, fix type or RAIM in the log",
        ),
        judge(
            "ground",
            float(np.mean(samples.on_ground[samples.is_used])) if samples.ground_method else None,
            samples.ground_method or "nothing in the log proves ground contact",
        ),
        judge(
            "ins_mode",
            None if changes is None else float(changes),
            "INS mode not in the log" if changes is None else "",
        ),
    )


def _standstill_gates(standstill: Standstill | None, judge: _Judge) -> tuple[Gate, ...]:
    missing = "no standstill before taxi in the log" if standstill is None else ""
    seconds = None if standstill is None else standstill.end_s - standstill.start_s
    seen, unseen = standstill, missing
    if standstill is not None and standstill.velocity_is_held:
        seen, unseen = None, "the receiver holds its velocity when standing: its error cannot be seen"
    return (
        judge("standstill_duration", seconds, missing),
        judge(STANDSTILL_SPEED, None if seen is None else seen.speed_of_mean_mps, unseen or f"over {seconds:.0f} s"),
        judge("standstill_bound97", None if seen is None else seen.speed_bound97_mps, unseen),
    )


def _taxi_gates(samples: TaxiSamples, settings: HeadingSettings, judge: _Judge) -> tuple[Gate, ...]:
    """Judge the epochs by where they lie and how many were left out."""
    used = int(samples.is_used.sum())
    later = int(samples.is_after_lift_off[samples.is_used].sum())
    run = is_straight_and_fast(samples, settings) & np.isin(samples.gate, NOT_TAXI)
    return (
        judge(
            "not_taxi",
            float(run.sum()) / max(int(run.sum()) + used, 1),
            counted(run.sum(), "epoch") if run.any() else "",
        ),
        judge(
            "before_take_off",
            (used - later) / max(used, 1),
            f"{later} of {used} are from after the flight: too little straight taxi before it" if later else "",
        ),
    )


def _accuracy_gates(samples: TaxiSamples, values: JudgedValues, judge: _Judge) -> tuple[Gate, ...]:
    """Judge how much taxi there is, and how well it shows the error."""
    outliers, used = int(np.sum(samples.gate == "outlier")), int(samples.is_used.sum())
    steady_deg = values.steady_sigma_deg
    of_steady_terms = "" if steady_deg is None else f"{NORMAL_95 * steady_deg:.2f} deg of it wind and installation"
    return (
        judge("taxi_seconds", values.taxi_seconds),
        judge("outliers", outliers / max(outliers + used, 1), f"{outliers} of {outliers + used}"),
        judge("held_velocity", values.held_s, "no turn in motion" if values.held_s is None else ""),
        judge("gnss_rate", 1.0 / samples.interval_s if samples.interval_s > 0 else None),
        judge("precision", values.precision_deg),
        judge("quality", values.quality_deg),
        judge(TAXI_ALONE, values.half_width_deg),
        judge(WHOLE, values.whole_half_width_deg, of_steady_terms),
    )


def _normality_gates(normal: Normality | None, judge: _Judge) -> tuple[Gate, ...]:
    if normal is None:
        return tuple(judge(name, None, "too few samples, or no spread") for name in OF_NORMALITY)
    measures = abs(normal.skewness), normal.excess_kurtosis, normal.distance
    chances = normal.skewness_p, normal.kurtosis_p, normal.distance_p
    return tuple(
        judge(name, value, f"p = {chance:.2g} for independent samples, not gated")
        for name, value, chance in zip(OF_NORMALITY, measures, chances, strict=True)
    )


def _steadiness_gates(values: JudgedValues, judge: _Judge) -> tuple[Gate, ...]:
    variance, parts = values.variance, values.disagreement
    drift, sigma = values.drift_deg_per_h, values.drift_sigma_deg_per_h
    return (
        judge(
            "variance_ratio",
            None if variance is None else variance.ratio,
            "no standstill variance, or too few samples"
            if variance is None
            else f"95 % interval {variance.low:.2f} to {variance.high:.2f}",
        ),
        judge(
            "drift",
            abs(drift) / sigma if drift is not None and sigma else None,
            "taxi too short" if drift is None else f"{drift:+.1f} +- {sigma:.1f} deg/h",
        ),
        judge(
            "segments",
            None if parts is None else parts.chi2,
            "one part" if parts is None else parts.told,
            None if parts is None else (None, parts.limit),
        ),
        judge(
            "steps",
            float(len(values.steps)),
            ", ".join(f"{step.size_deg:+.2f} deg at {step.time_s:.1f} s" for step in values.steps),
        ),
    )


def _is_curable(gate: Gate, standstill: Standstill | None, settings: HeadingSettings) -> bool:
    if gate.name in CURED_BY_MORE_DATA:
        return True
    # A receiver that passes 97 % of 30-s intervals passes about 70 % of 10-s ones: a short interval says "extend".
    is_short = standstill is not None and standstill.end_s - standstill.start_s < settings.standstill_max_s - 1.0
    return gate.name == STANDSTILL_SPEED and is_short


def is_mostly_steady(whole_half_width_deg: float, alone_half_width_deg: float) -> bool:
    """Tell whether wind and installation make more of the interval than this taxi.

    Examples
    --------
    >>> is_mostly_steady(0.3, 0.2), is_mostly_steady(0.3, 0.25)
    (True, False)
    """
    return whole_half_width_deg**2 >= 2.0 * alone_half_width_deg**2


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
