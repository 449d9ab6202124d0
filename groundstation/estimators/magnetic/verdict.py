"""Gates and verdict of the magnetic deviation."""

from groundstation.estimators.magnetic.settings import MagneticSettings
from groundstation.results.heading import Gate, GateState, Sense
from groundstation.results.magnetic import (
    Alignment,
    BankBias,
    Coverage,
    MagneticVerdict,
    MethodName,
    Residual,
    Swing,
    Turn,
)


def build_gates(
    turns: list[Turn],
    swings: list[Swing],
    coverage: Coverage,
    alignment: Alignment,
    residual: Residual | None,
    bias: BankBias | None,
    method: MethodName,
    dip_sigmas: float | None,
    settings: MagneticSettings,
) -> tuple[Gate, ...]:
    """Every gate with its figure. ``turns`` are those used, ``bias`` is that of the bank flown.

    ``dip_sigmas``: by how many sigma the vertical field of the readings differs from the model's.
    """
    altitude = min((turn.altitude_m for turn in turns if turn.altitude_m is not None), default=None)
    unequal = max(abs(abs(swing.right_bank_deg) - abs(swing.left_bank_deg)) for swing in swings)
    repeat = max((swing.difference_rms_deg for swing in swings if swing.difference_rms_deg is not None), default=None)
    unsteady = max(turn.bank_sd_deg for turn in turns)
    after = residual.after if residual else None
    return (
        _gate("coverage", "circle covered by both branches", coverage.share, settings.coverage_min, sense="at_least"),
        _gate("bank_difference", "difference of opposite banks", unequal, settings.bank_difference_max_deg, "deg"),
        _gate("bank_steadiness", "standard deviation of bank in a turn", unsteady, settings.bank_sd_max_deg, "deg"),
        _gate(
            "alignment",
            "sigma of the INS heading at the figure",
            alignment.sigma_deg,
            settings.alignment_sigma_max_deg,
            "deg",
        ),
        _gate(
            "held_out",
            "rms error after correction where no fit has seen",
            after,
            settings.held_out_rms_max_deg,
            "deg",
            reason="no level flight beside the figure",
        ),
        _gate(
            "bank_bias",
            "rms of the forecast bank bias of the average of branches",
            bias.rms_deg if bias else None,
            settings.bank_bias_max_deg,
            "deg",
            is_required=method == "compass_table",
            reason="no iron fitted to forecast it from",
        ),
        _gate(
            "dip",
            "dip of the field in the readings off the model's, in sigmas",
            dip_sigmas,
            settings.dip_sigmas_max,
            is_required=dip_sigmas is not None,
            reason="no model of the field, or no iron fitted",
        ),
        _gate(
            "altitude",
            "lowest mean altitude of a turn",
            altitude,
            settings.altitude_min_m,
            "m",
            "at_least",
            is_required=False,
            reason="no altitude in the log",
        ),
        _gate(
            "repeatability",
            "rms difference of repeated figures",
            repeat,
            settings.repeat_rms_max_deg,
            "deg",
            is_required=len(swings) > 1,
            reason="one figure alone",
        ),
    )


def decide(gates: tuple[Gate, ...]) -> tuple[MagneticVerdict, str]:
    """Reject on a required gate failed, undecided on one not measured, else accept; and the reason."""
    outcomes: tuple[tuple[GateState, MagneticVerdict], ...] = (("failed", "reject"), ("not_measured", "undecided"))
    for state, verdict in outcomes:
        telling = [gate for gate in gates if gate.required and gate.state == state]
        if telling:
            return verdict, "; ".join(f"{gate.title}: {gate.reason}" for gate in telling)
    return "accept", "every required gate passed"


def _gate(
    name: str,
    title: str,
    value: float | None,
    limit: float,
    unit: str = "",
    sense: Sense = "at_most",
    *,
    is_required: bool = True,
    reason: str = "",
) -> Gate:
    if value is None:
        return Gate(name, title, None, limit, unit, "not_measured", is_required, reason or "not measured", sense)
    is_good = value >= limit if sense == "at_least" else value <= limit
    wanted = "at least" if sense == "at_least" else "at most"
    reason = "" if is_good else f"{value:.3g} {unit}, {wanted} {limit:g}".replace(" ,", ",")
    return Gate(name, title, value, limit, unit, "passed" if is_good else "failed", is_required, reason, sense)
