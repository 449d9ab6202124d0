"""Gates and verdict of the deviation of a flux valve."""

from collections.abc import Mapping

from groundstation.results.gates import Bound, Gate, judged_gate
from groundstation.results.rules import Rejudged
from groundstation.systems.magnetic.flux_answer import BankError, FluxDeviation
from groundstation.systems.magnetic.flux_settings import MagneticFluxSettings
from groundstation.systems.magnetic.verdict import judged_under, told


def flux_gates(values: Mapping[str, float | None], bank: BankError, settings: MagneticFluxSettings) -> tuple[Gate, ...]:
    """Build every gate with its figure; one that cannot be measured informs.

    Turns must be there: without them a gyro that the valve slaves over minutes would bias A to E unseen.
    """
    bounds = _bounds(settings)
    titles = {
        "gap": ("widest part of the circle without a leg or a turn", "deg", ""),
        "curve": ("sigma of the curve without A, rms over the circle", "deg", ""),
        "level": ("sigma of A: declination and reference in it", "deg", ""),
        "left": (
            "rms error left on legs that the fit did not have",
            "deg",
            "fewer than six directions",
        ),
        "dip": ("dip of the earth's field, up or down", "deg", "no model of the field"),
    }
    shown = float(bank.turns) if bank.lag95_s is not None else None
    turns = judged_gate(
        bounds["turns"],
        "turns",
        "turns that show whether a slow gyro is displayed",
        shown,
        reason=bank.reason if shown is None else "",
        required=settings.may_be_slaved,
    )
    return told(turns), *(
        told(
            judged_gate(
                bounds[name], name, title, values[name], unit=unit, reason=reason, required=values[name] is not None
            )
        )
        for name, (title, unit, reason) in titles.items()
    )


def flux_rejudge(answer: FluxDeviation, settings: MagneticFluxSettings) -> tuple[Rejudged, ...]:
    """Apply other limits to the gates and the verdict of an answer."""
    return (judged_under(_bounds(settings), answer.analysis, answer.verdict, answer.gates),)


def _bounds(settings: MagneticFluxSettings) -> dict[str, Bound]:
    return {
        "turns": (1.0, None),
        "gap": (None, settings.gap_max_deg),
        "curve": (None, settings.curve_sigma_max_deg),
        "level": (None, settings.a_sigma_max_deg),
        "left": (None, settings.left_rms_max_deg),
        "dip": (None, settings.dip_max_deg),
    }
