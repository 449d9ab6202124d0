"""Gates and verdict of the magnetic deviation."""

from collections.abc import Mapping
from dataclasses import replace

from groundstation.base.dataclasses import dataclass
from groundstation.results.gates import Bound, Gate, GateState, judged_gate
from groundstation.results.rules import Rejudged
from groundstation.systems.magnetic.alignment import against_heading
from groundstation.systems.magnetic.answer import (
    Alignment,
    BankBias,
    Coverage,
    MagneticResult,
    MagneticVerdict,
    MethodName,
    Residual,
    Swing,
    Turn,
)
from groundstation.systems.magnetic.settings import MagneticSettings


@dataclass(frozen=True, kw_only=True)
class JudgedValues:
    """Parts of an answer that its gates judge.

    ``turns`` are those used, ``bank_bias`` is that of the bank flown. ``dip_sigmas``: by how many sigma the vertical
    field of the readings differs from the model's.
    """

    turns: list[Turn]
    swings: list[Swing]
    coverage: Coverage
    alignment: Alignment
    residual: Residual | None
    bank_bias: BankBias | None
    method: MethodName
    dip_sigmas: float | None


def build_gates(judged: JudgedValues, settings: MagneticSettings) -> tuple[Gate, ...]:
    """Build every gate with its figure."""
    bounds = gate_bounds(settings)
    return (*_gates_of_the_figure(judged, bounds), *_gates_of_the_result(judged, bounds), *_informing(judged, bounds))


def _gates_of_the_figure(judged: JudgedValues, bounds: dict[str, Bound]) -> tuple[Gate, ...]:
    """Build the gates on how the figure was flown, and on the heading it rests on."""
    unequal = max(abs(abs(swing.right_bank_deg) - abs(swing.left_bank_deg)) for swing in judged.swings)
    unsteady = max(turn.bank_sd_deg for turn in judged.turns)
    contradicted = against_heading(judged.alignment)
    return (
        _gate(bounds, "coverage", "circle covered by both branches", judged.coverage.share),
        _gate(bounds, "bank_difference", "difference of opposite banks", unequal, "deg"),
        _gate(bounds, "bank_steadiness", "standard deviation of bank in a turn", unsteady, "deg"),
        _gate(bounds, "alignment", "sigma of the INS heading at the figure", judged.alignment.sigma_deg, "deg"),
        _gate(
            bounds,
            "heading",
            "alignment, hence A, against the heading analysis of this log, in sigmas",
            contradicted,
            is_required=contradicted is not None,
            reason="no heading analysis of this INS",
        ),
    )


def _gates_of_the_result(judged: JudgedValues, bounds: dict[str, Bound]) -> tuple[Gate, ...]:
    """Build the gates on what the correction leaves, and on the field it rests on."""
    return (
        _gate(
            bounds,
            "held_out",
            "rms error after correction in flight that no fit used",
            judged.residual.after if judged.residual else None,
            "deg",
            reason="no level flight beside the figure",
        ),
        _gate(
            bounds,
            "bank_bias",
            "rms of the forecast bank bias of the average of branches",
            judged.bank_bias.rms_deg if judged.bank_bias else None,
            "deg",
            is_required=judged.method == "compass_table",
            reason="no iron fitted to forecast it from",
        ),
        _gate(
            bounds,
            "dip",
            "dip of the field, readings against model, in sigmas",
            judged.dip_sigmas,
            is_required=judged.dip_sigmas is not None,
            reason="no model of the field, or no iron fitted",
        ),
    )


def _informing(judged: JudgedValues, bounds: dict[str, Bound]) -> tuple[Gate, ...]:
    """Build the gates on height, which informs, and on repetition, where figures are repeated."""
    altitudes = [turn.altitude_m for turn in judged.turns if turn.altitude_m is not None]
    repeats = [swing.difference_rms_deg for swing in judged.swings if swing.difference_rms_deg is not None]
    return (
        _gate(
            bounds,
            "altitude",
            "lowest mean altitude of a turn",
            min(altitudes, default=None),
            "m",
            is_required=False,
            reason="no altitude in the log",
        ),
        _gate(
            bounds,
            "repeatability",
            "rms difference of repeated figures",
            max(repeats, default=None),
            "deg",
            is_required=len(judged.swings) > 1,
            reason="one figure alone",
        ),
    )


def gate_bounds(settings: MagneticSettings) -> dict[str, Bound]:
    """Lowest and highest value with which each gate passes."""
    return {
        "coverage": (settings.coverage_min, None),
        "bank_difference": (None, settings.bank_difference_max_deg),
        "bank_steadiness": (None, settings.bank_sd_max_deg),
        "alignment": (None, settings.alignment_sigma_max_deg),
        "heading": (None, settings.heading_sigmas_max),
        "held_out": (None, settings.held_out_rms_max_deg),
        "bank_bias": (None, settings.bank_bias_max_deg),
        "dip": (None, settings.dip_sigmas_max),
        "altitude": (settings.altitude_min_m, None),
        "repeatability": (None, settings.repeat_rms_max_deg),
    }


def rejudge(answer: MagneticResult, settings: MagneticSettings) -> tuple[Rejudged, ...]:
    """Apply other limits to the gates and the verdict of an answer.

    The values are those that it was judged by.
    """
    return (judged_under(gate_bounds(settings), answer.analysis, answer.verdict, answer.gates),)


def judged_under(
    bounds: Mapping[str, Bound], analysis: str, verdict: MagneticVerdict, gates: tuple[Gate, ...]
) -> Rejudged:
    """Apply bounds to gates, and decide the verdict anew."""
    after = tuple(told(gate.under(bounds[gate.name])) if gate.name in bounds else gate for gate in gates)
    return Rejudged(analysis, verdict, decide(after)[0], gates, after)


def decide(gates: tuple[Gate, ...]) -> tuple[MagneticVerdict, str]:
    """Decide the verdict and its reason from the gates.

    Reject on a required gate failed, undecided on one not measured, else accept.
    """
    outcomes: tuple[tuple[GateState, MagneticVerdict], ...] = (("failed", "reject"), ("not_measured", "undecided"))
    for state, verdict in outcomes:
        telling = [gate for gate in gates if gate.required and gate.state == state]
        if telling:
            return verdict, "; ".join(f"{gate.title}: {gate.reason}" for gate in telling)
    return "accept", "every required gate passed"


def _gate(
    bounds: dict[str, Bound],
    name: str,
    title: str,
    value: float | None,
    unit: str = "",
    *,
    is_required: bool = True,
    reason: str = "not measured",
) -> Gate:
    return told(judged_gate(bounds[name], name, title, value, unit=unit, required=is_required, reason=reason))


def told(gate: Gate) -> Gate:
    """Return the gate with its reason: figure and limit where it failed, none where it passed."""
    if gate.value is None:
        return gate
    wanted = "at least" if gate.sense == "at_least" else "at most"
    told = f"{gate.value:.3g} {gate.unit}, {wanted} {gate.limit:g}".replace(" ,", ",")
    return replace(gate, reason=told if gate.state == "failed" else "")
