"""Gates, verdicts and settings of an answer, in the same form in every chapter."""

import json
from collections.abc import Mapping, Sequence

from groundstation.base.words import capitalised
from groundstation.chapters.parts import Cell, Facts, Grid, Head, Mark
from groundstation.chapters.wording import clean, number_with_unit, significant, typeset, unit_sign
from groundstation.results.gates import Gate

SENSE_SIGNS = {"at_most": "≤ ", "at_least": "≥ "}
STATES = {
    "passed": Mark("good", "passed"),
    "failed": Mark("bad", "failed"),
    "not_measured": Mark("unknown", "not measured"),
}
HEADS = (Head("State"), Head("Gate"), Head("Figure", True), Head("Limit", True), Head("Reason"))
INFORMS = "informs"
CAPTION = "Accept requires every gate except those that only inform."
VERDICTS: Mapping[str, Mark] = {
    "accept": Mark("good", "Accept"),
    "advisory": Mark("warn", "Advisory"),
    "reject": Mark("bad", "Reject"),
    "extend": Mark("warn", "Extend"),
    "undecided": Mark("unknown", "Undecided"),
}
NOT_ASSESSABLE = Mark("unknown", "Not assessable")


def gate_grid(gates: Sequence[Gate]) -> Grid | None:
    """Return the gates of an answer, each with figure, limit and reason; None without any."""
    return Grid("Gates", HEADS, [_row(gate) for gate in gates], CAPTION) if gates else None


def _row(gate: Gate) -> tuple[Cell, ...]:
    value = number_with_unit(significant(gate.value, 3), unit_sign(gate.unit))
    title = gate.title or gate.name
    title = capitalised(title)
    reason = "" if gate.state == "passed" else typeset(gate.reason)
    note = "; ".join(filter(None, ("" if gate.required else INFORMS, reason)))
    return state_of(gate), title, value, limit_text(gate), note


def failed_to_inform(gates: Sequence[Gate]) -> str:
    """Return a sentence that names the failed gates that only inform; empty without one.

    Examples
    --------
    >>> failed_to_inform([Gate("kurtosis", "excess kurtosis", 2.4, (-1.2, 2.0), "", "failed", required=False)])
    'Failed, but does not decide: excess kurtosis 2.4 (wanted −1.2 … 2).'
    """
    failed = [gate for gate in gates if gate.state == "failed" and not gate.required]
    told = [
        f"{typeset(gate.title or gate.name)} {number_with_unit(significant(gate.value, 3), unit_sign(gate.unit))} "
        f"(wanted {limit_text(gate)})"
        for gate in failed
    ]
    return f"Failed, but {'does' if len(told) == 1 else 'do'} not decide: {'; '.join(told)}." if told else ""


def state_of(gate: Gate) -> Mark:
    """Return the state of a gate; a failed one that only informs is a warning.

    Examples
    --------
    >>> failed = Gate("kurtosis", "Excess kurtosis", 2.4, (-1.2, 2.0), "", "failed", required=False)
    >>> state_of(failed)
    Mark(tone='warn', text='failed')
    """
    state = STATES[gate.state]
    return Mark("warn", state.text) if state.tone == "bad" and not gate.required else state


def limit_text(gate: Gate) -> str:
    """Return a gate's limit with its sense.

    Examples
    --------
    >>> limit_text(Gate("e", "Precision e", None, 0.05, "deg", "not_measured"))
    '≤ 0.05°'
    >>> limit_text(Gate("taxi", "Straight taxi", 148.3, 20.0, "s", "passed", sense="at_least"))
    '≥ 20\u202fs'
    >>> limit_text(Gate("kurtosis", "Excess kurtosis", 0.1, (-1.2, 2.0), "", "passed", sense="between"))
    '−1.2 … 2'
    """
    unit = unit_sign(gate.unit)
    if isinstance(gate.limit, tuple):
        return number_with_unit(f"{significant(gate.limit[0], 4)} … {significant(gate.limit[1], 4)}", unit)
    return SENSE_SIGNS.get(gate.sense, "") + number_with_unit(significant(gate.limit, 4), unit)


def setting_facts(settings: Mapping[str, float | str | bool], table: str = "") -> Facts | None:
    """Return the settings behind an answer, spelled as in a settings file; None without any.

    Examples
    --------
    >>> facts = setting_facts({"kurtosis.low": -1.2, "kurtosis.high": 2.0, "turn_rate_kind": "slope"}, "heading")
    >>> facts.title, facts.pairs
    ('Settings: [heading]', [('kurtosis', '[-1.2, 2]', ''), ('turn_rate_kind', '"slope"', '')])
    """
    pairs = [(clean(name), value, "") for name, value in sorted(_in_toml(settings).items())]
    title = f"Settings: [{table}]" if table else "Settings"
    return Facts(title, pairs, compact=True, settings_of=table) if pairs else None


def _in_toml(settings: Mapping[str, float | str | bool]) -> dict[str, str]:
    """Return keys and values as typed; a range, kept as its two ends, is an array again."""
    told = {name: _value(value) for name, value in settings.items()}
    for low in [name for name in told if name.endswith(".low") and f"{name[:-4]}.high" in told]:
        told[low[:-4]] = f"[{told.pop(low)}, {told.pop(f'{low[:-4]}.high')}]"
    return told


def _value(value: float | str | bool) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    return json.dumps(clean(value), ensure_ascii=False) if isinstance(value, str) else f"{value:.10g}"
