"""The text panel of the heading tab: verdict, number to type, gates."""

import math
from collections.abc import Sequence

from groundstation.results.heading import Gate, HeadingResult, OnboardComparison
from groundstation.viewer.markdown import markdown_text, number, table
from groundstation.viewer.names import UNITS

STATES = {"passed": "passed", "failed": "**FAILED**", "not_measured": "*not measured*"}


def verdict_text(result: HeadingResult | None, reasons: Sequence[str] = ()) -> str:
    """Markdown of the panel; without a result the reasons why there is none."""
    if result is None:
        return "\n\n".join(["# Heading not assessed", *(markdown_text(reason) for reason in reasons)])
    parts = [
        f"# {result.verdict.upper()}",
        markdown_text(result.verdict_reason),
        f"## {to_type(result).capitalize()}",
        _figures(result),
        "## Gates",
        table(["state", "figure", "limit", "gate"], [_gate_row(gate) for gate in result.gates]),
        *_standstill(result),
        *_segments(result),
        *_onboard(result.onboard),
    ]
    return "\n\n".join(part for part in parts if part)


def to_type(result: HeadingResult) -> str:
    """The number to type with its sign and digits of the entry step; never one when there is nothing to type."""
    if result.correction_deg is None:
        return "nothing to type"
    step = f"{result.entry_step_deg:.6f}".rstrip("0")
    return f"type {number(result.correction_deg, len(step.partition('.')[2]), 'deg', sign=True)}"


def _figures(result: HeadingResult) -> str:
    low, high = result.confidence95_deg
    rows = [
        ["heading error (INS − true)", number(result.error_deg, 3, "deg", sign=True)],
        ["95 % interval, honest", f"{number(low, 3, sign=True)} … {number(high, 3, 'deg', sign=True)}"],
        ["standard error, honest", number(result.standard_error_deg, 3, "deg")],
        [
            "the paper's mean ± e",
            f"{number(result.paper_error_deg, 3, sign=True)} ± {number(result.precision_deg)} deg",
        ],
        ["samples, taxi time", f"{result.samples}, {number(result.taxi_seconds, 1, 's')}"],
        ["azimuth drift", _with_sigma(result.drift_deg_per_h, result.drift_sigma_deg_per_h, 2, "deg/h")],
        ["antenna ahead of main gear", _with_sigma(result.lever_arm_m, result.lever_arm_sigma_m, 1, "m")],
        ["parking heading, corrected", _with_sigma(result.parking_heading_deg, result.parking_sigma_deg, 2, "deg")],
        ["against the reference heading", number(result.reference_residual_arcmin, 1, "arcmin", sign=True)],
        ["pair used", f"{markdown_text(result.ins_topic)}, {markdown_text(result.gnss_topic)}"],
        ["heading", markdown_text(result.heading_source)],
    ]
    return table(["figure", "value"], [row for row in rows if row[1] != "–"])


def _with_sigma(value: float | None, sigma: float | None, digits: int, unit: str) -> str:
    if value is None or not math.isfinite(value):
        return "–"
    return f"{number(value, digits)} ± {number(sigma, digits)} {unit}"


def _gate_row(gate: Gate) -> list[str]:
    unit = UNITS.get(gate.unit, gate.unit)
    sign = {"at_most": "≤ ", "at_least": "≥ "}.get(gate.sense, "")
    limit = f"{gate.limit[0]:g} … {gate.limit[1]:g}" if isinstance(gate.limit, tuple) else f"{sign}{gate.limit:g}"
    title = markdown_text(gate.title) + ("" if gate.required else " *(informs)*")
    if gate.reason:
        title += f": {markdown_text(gate.reason)}"
    value = "–" if gate.value is None else f"{gate.value:.4g}"
    return [STATES[gate.state], value, markdown_text(f"{limit} {unit}"), title]


def _standstill(result: HeadingResult) -> list[str]:
    still = result.standstill
    if still is None:
        return []
    rows = [
        ["from, to", f"{number(still.start_s, 1)} … {number(still.end_s, 1, 's')}"],
        ["mean north, east", f"{number(still.mean_north_mps, 4)}, {number(still.mean_east_mps, 4, 'm/s')}"],
        ["sigma north, east", f"{number(still.sigma_north_mps, 4)}, {number(still.sigma_east_mps, 4, 'm/s')}"],
        ["length of the mean velocity", number(still.speed_of_mean_mps, 4, "m/s")],
        ["its 0.97 bound", number(still.speed_bound97_mps, 4, "m/s")],
    ]
    return ["## Standstill", table(["GNSS velocity", "value"], rows)]


def _segments(result: HeadingResult) -> list[str]:
    if not result.segments:
        return []
    rows = [
        [
            f"{number(segment.start_s, 1)} … {number(segment.end_s, 1, 's')}",
            str(segment.samples),
            number(segment.mean_track_deg, 1, "deg"),
            number(segment.mean_speed_mps, 1, "m/s"),
            f"{number(segment.error_deg, 3, sign=True)} ± {number(segment.sigma_deg, 3, 'deg')}",
        ]
        for segment in result.segments
    ]
    return ["## Straight taxi segments", table(["from, to", "samples", "track", "speed", "error ± sigma"], rows)]


def _onboard(onboard: OnboardComparison | None) -> list[str]:
    if onboard is None:
        return []
    rows = [
        ["heading error", number(onboard.heading_error_deg, 3, "deg", sign=True)],
        ["onboard − ours", number(onboard.difference_error_deg, 3, "deg", sign=True)],
        ["precision e", number(onboard.precision_deg, 3, "deg")],
        ["quality", number(onboard.quality_deg, 3, "deg")],
        ["cycles", number(onboard.cycles, 0)],
        ["correction entered", number(onboard.correction_entered_deg, 2, "deg", sign=True)],
        ["status", markdown_text(onboard.status) or "–"],
    ]
    return ["## The aircraft's own figures", table(["onboard", "value"], [row for row in rows if row[1] != "–"])]
