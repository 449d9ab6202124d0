"""Gates and settings of answers that a chapter still reads from summary.json; the others use chapters/gates.py."""

from collections.abc import Mapping
from typing import Any

from groundstation.chapters.gates import CAPTION, HEADS, SENSE_SIGNS
from groundstation.chapters.gates import STATES as GATE_MARKS
from groundstation.chapters.gates import setting_facts as typed_setting_facts
from groundstation.chapters.parts import Cell, Facts, Grid, Mark
from groundstation.chapters.wording import number_with_unit, significant, typeset, unit_sign
from groundstation.reports.sections.saved import mapping, objects


def limit_text(gate: Mapping[str, Any]) -> str:
    """A gate's limit with its sense.

    Examples
    --------
    >>> limit_text({"limit": 0.05, "unit": "deg", "sense": "at_most"})
    '≤ 0.05°'
    >>> limit_text({"limit": 20.0, "unit": "s", "sense": "at_least"})
    '≥ 20\u202fs'
    >>> limit_text({"limit": [-1.2, 2.0], "unit": "", "sense": "between"})
    '−1.2 … 2'
    """
    limit, unit = gate.get("limit"), unit_sign(str(gate.get("unit", "")))
    if isinstance(limit, list | tuple) and len(limit) == 2:
        return number_with_unit(f"{significant(limit[0], 4)} … {significant(limit[1], 4)}", unit)
    text = number_with_unit(significant(limit, 4), unit)
    return SENSE_SIGNS.get(str(gate.get("sense")), "") + text


def gate_grid(answer: Mapping[str, Any]) -> Grid | None:
    """The gates of an answer, each with figure, limit and reason; None where there are none."""
    rows: list[tuple[Cell, ...]] = []
    for gate in objects(answer, "gates"):
        unit = unit_sign(str(gate.get("unit", "")))
        role = "decides" if gate.get("required") else "informs"
        state = GATE_MARKS.get(str(gate.get("state")), Mark("unknown", str(gate.get("state"))))
        if state.tone == "bad" and not gate.get("required"):
            state = Mark("warn", state.text)  # it does not stand against an accepted answer
        value = number_with_unit(significant(gate.get("value"), 3), unit)
        title = str(gate.get("title") or gate.get("name") or "")
        title, reason = title[:1].upper() + title[1:], typeset(str(gate.get("reason") or ""))
        rows.append((state, title, value, limit_text(gate), role, reason))
    return Grid("Gates", HEADS, rows, CAPTION) if rows else None


def setting_facts(answer: Mapping[str, Any]) -> Facts | None:
    """The settings an answer was found with."""
    return typed_setting_facts(mapping(answer, "settings"))
