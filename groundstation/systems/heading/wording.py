"""Gates in the words of a crew: what was found and what is needed.

What people can see for themselves comes first.
"""

from groundstation.results.gates import Gate
from groundstation.systems.heading.reason_answer import BETWEEN

# By the name of a gate, in the order they are told. {value}: what was found; {limit}: what is needed.
FAILED = {
    "taxi_seconds": "{value} of straight taxi, {limit} needed",
    "before_take_off": "only {value} of the straight taxi used lies before take-off",
    "standstill_duration": "stood still for {value}, {limit} needed",
    "standstill_speed_of_mean": "GNSS shows {value} at standstill, at most {limit}",
    "geometry": "satellite geometry good for {value} of the taxi, {limit} needed",
    "integrity": "GNSS integrity good for {value} of the taxi, {limit} needed",
    "ground": "ground contact proven for {value} of the samples, {limit} needed",
    "ins_mode": "{value} changes of the INS mode during the taxi",
    "outliers": "{value} of the samples are outliers, at most {limit}",
    "held_velocity": "GNSS velocity held for {value} while the INS turned, at most {limit}",
    "steps": "{value} steps of the INS heading during the taxi ({reason})",
    "segments": "parts of the taxi disagree: chi-square {value} per part, at most {limit} ({reason})",
    "half_width": "heading error known to +- {value} only, +- {limit} needed",
    "whole_half_width": "heading error with wind and installation known to +- {value} only, "
    "+- {limit} needed ({reason})",
    "precision": "precision e {value}, at most {limit}",
    "quality": "running mean not settled: spread {value}, at most {limit}",
    "drift": "heading error drifts: {value} sigma, at most {limit}",
    "variance_ratio": "scatter {value} times what track and sway explain, {limit} expected",
    "normal_distance": "errors not normal: distance {value}, at most {limit}",
    "skewness": "errors lean to one side: skewness {value}, at most {limit}",
    "kurtosis": "errors with heavy tails or none: excess kurtosis {value}, {limit} expected",
}
NOT_MEASURED = {
    "geometry": "satellite geometry",
    "integrity": "GNSS integrity",
    "ground": "ground contact",
    "standstill_duration": "standstill",
    "standstill_speed_of_mean": "GNSS velocity at standstill",
    "drift": "drift of the heading error",
    "variance_ratio": "scatter against what track and sway explain",
}
SHARES = ("before_take_off", "geometry", "integrity", "ground", "outliers")


def told(gates: tuple[Gate, ...]) -> str:
    """Gates that failed or were not measured, the plainest first.

    Examples
    --------
    >>> told((Gate("skewness", "", 0.86, 0.5, "", "failed"), Gate("taxi_seconds", "", 12.0, 20.0, "s", "failed")))
    '12 s of straight taxi, 20 s needed; errors lean to one side: skewness 0.86, at most 0.5'
    >>> told((Gate("integrity", "", None, 0.9, "", "not_measured", reason="integrity flag not in the log"),))
    'GNSS integrity not measured (integrity flag not in the log)'
    """
    order = list(FAILED)
    ranked = sorted(gates, key=lambda gate: order.index(gate.name) if gate.name in order else len(order))
    return BETWEEN.join(_told(gate) for gate in ranked)


def _told(gate: Gate) -> str:
    if gate.value is None:
        return f"{NOT_MEASURED.get(gate.name, gate.title)} not measured ({gate.reason})"
    limits = gate.limit if isinstance(gate.limit, tuple) else (gate.limit,)
    limit = " to ".join(_figure(gate, value) for value in limits)
    form = FAILED.get(gate.name, f"{gate.title} {{value}} against {{limit}}")
    return form.format(value=_figure(gate, gate.value), limit=limit, reason=gate.reason)


def _figure(gate: Gate, value: float) -> str:
    if gate.name in SHARES:
        return f"{100.0 * value:.3g} %"
    return f"{value:.3g}{f' {gate.unit}' if gate.unit else ''}"
