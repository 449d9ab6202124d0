"""The text panel of the Magnetic tab: verdict, coefficients, card, methods, gates, what must be told beside them."""

from collections.abc import Sequence

from groundstation.results.magnetic import ADVISORY, LETTERS, METHOD_TITLES, MagneticResult
from groundstation.results.magnetic_ground import GroundDeviation
from groundstation.viewer.markdown import markdown_text, number, table


def magnetic_text(
    result: MagneticResult | None, reasons: Sequence[str] = (), ground: GroundDeviation | None = None
) -> str:
    """Markdown of the panel; without a result the reasons why there is none. Behind it what the ground runs tell."""
    if result is None:
        why = ["# Magnetic deviation not assessed", *(markdown_text(reason) for reason in reasons)]
        return "\n\n".join([*why, *_ground_runs(ground)])
    residual, reason = result.residual_rms_deg, result.verdict_reason
    left = (
        f"{number(residual.before, 2)} deg RMS before, {number(residual.after, 2)} after, where no fit has seen."
        if residual
        else "Nothing was left to judge by."
    )
    parts = [
        f"# Magnetic deviation: {result.verdict}",
        f"{markdown_text(reason[:1].upper() + reason[1:])}. {left} **{ADVISORY}**",
        f"Correct by the {METHOD_TITLES[result.recommended_method]}: {markdown_text(result.recommendation)}.",
        "## Coefficients of the error, deg",
        _coefficients(result),
        "## Steer card, deg",
        _card(result),
        "## Methods, deg where no fit has seen",
        _methods(result),
        "## Gates",
        _gates(result),
        *(markdown_text(remark) for remark in result.remarks),
        *_ground_runs(ground),
    ]
    return "\n\n".join(parts)


def _ground_runs(ground: GroundDeviation | None) -> list[str]:
    """Error of the installed heading sensor on each straight ground run, and the remarks."""
    if ground is None:
        return []
    rows = [
        [
            number(run.start_s, 0),
            run.phase,
            number(run.magnetic_heading_deg, 1),
            f"{number(run.error_deg, 2, sign=True)} ± {number(run.sigma_deg, 2)}",
        ]
        for run in ground.used
    ]
    told = (markdown_text(remark) for remark in ground.remarks)
    return ["## Heading sensor on ground runs, deg", table(["from, s", "", "reading", "error"], rows), *told]


def _coefficients(result: MagneticResult) -> str:
    fitted = [row for row in result.methods if row.coefficients_deg]
    rows = [
        [
            letter,
            *(
                f"{number(row.coefficients_deg.get(letter), 3, sign=True)} ± "
                f"{number(row.coefficients_sigma_deg.get(letter), 3)}"
                for row in fitted
            ),
        ]
        for letter in LETTERS
    ]
    return table(["", *(METHOD_TITLES[row.name] for row in fitted)], rows)


def _card(result: MagneticResult) -> str:
    rows = [
        [
            number(row.magnetic_heading_deg, 0),
            number(row.steer_deg, 1),
            number(row.deviation_deg, 1, sign=True),
            number(row.sigma_deg, 1) + (" interpolated" if row.is_interpolated else ""),
        ]
        for row in result.card
    ]
    return table(["for magnetic", "steer", "add", "σ"], rows)


def _methods(result: MagneticResult) -> str:
    rows = [
        [
            METHOD_TITLES[row.name],
            row.state,
            number(row.held_out_after_deg, 2),
            number(row.condition_number, 0),
            markdown_text(row.reason),
        ]
        for row in result.methods
    ]
    return table(["method", "state", "after", "condition", "why, or what it lacks"], rows)


def _gates(result: MagneticResult) -> str:
    rows = [
        [markdown_text(gate.title), number(gate.value, 3), gate.state.replace("_", " "), markdown_text(gate.reason)]
        for gate in result.gates
    ]
    return table(["gate", "figure", "state", "reason"], rows)
