"""Gates in the words of a crew: what was found and what is needed.

What people can see for themselves comes first.
"""

from groundstation.base.words import counted
from groundstation.results.gates import Gate
from groundstation.systems.heading.answer import UnprovenGround
from groundstation.systems.heading.gates_answer import GATES
from groundstation.systems.heading.reason_answer import BETWEEN


def told(gates: tuple[Gate, ...]) -> str:
    """Gates that failed or were not measured, the plainest first.

    Examples
    --------
    >>> told((Gate("skewness", "", 0.86, 0.5, "", "failed"), Gate("taxi_seconds", "", 12.0, 20.0, "s", "failed")))
    '12 s of straight taxi, 20 s needed; errors lean to one side: skewness 0.86, at most 0.5'
    >>> told((Gate("integrity", "", None, 0.9, "", "not_measured", reason="integrity flag not in the log"),))
    'GNSS integrity not measured (integrity flag not in the log)'
    """
    order = list(GATES)
    ranked = sorted(gates, key=lambda gate: order.index(gate.name) if gate.name in GATES else len(order))
    return BETWEEN.join(_told(gate) for gate in ranked)


def left_out_told(left: UnprovenGround) -> str:
    """Straight epochs left out, of how many.

    Examples
    --------
    >>> left_out_told(UnprovenGround(440, 621))
    '440 of 621 straight epochs left out as ground is not proven'
    """
    return f"{left.epochs} of {counted(left.straight, 'straight epoch')} left out as ground is not proven"


def _told(gate: Gate) -> str:
    kind = GATES.get(gate.name)
    if gate.value is None:
        return f"{(kind and kind.not_measured) or gate.title} not measured ({gate.reason})"
    limits = gate.limit if isinstance(gate.limit, tuple) else (gate.limit,)
    limit = " to ".join(_figure(gate, value) for value in limits)
    form = (kind and kind.failed) or f"{gate.title} {{value}} against {{limit}}"
    return form.format(value=_figure(gate, gate.value), limit=limit, reason=gate.reason)


def _figure(gate: Gate, value: float) -> str:
    if gate.name in GATES and GATES[gate.name].is_share:
        return f"{100.0 * value:.3g} %"
    return f"{value:.3g}{f' {gate.unit}' if gate.unit else ''}"
