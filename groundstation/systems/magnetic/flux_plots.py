"""Plots of a compass that gives heading alone: legs by heading, and turns."""

from collections.abc import Mapping

import numpy as np

from groundstation.base.quantiles import NORMAL_95
from groundstation.plots.axes import ZERO
from groundstation.plots.marks import AnyMark, Band, Bars, Curve, Dots, Role
from groundstation.plots.plot import Axis, Describe, Panel, Plot, one_panel
from groundstation.results.flight import FlightResults
from groundstation.systems.magnetic.arrays import FluxCurve, FluxEpochRows
from groundstation.systems.magnetic.flux_answer import FluxDeviation
from groundstation.systems.magnetic.plots import heading_axis

LEAST_SPAN_DEG, TURN_DEG = 2.0, 8.0  # span of the axis of errors, lean of a turn
SIDES: tuple[tuple[str, Role, float], ...] = (("right turns", "gnss", 1.0), ("left turns", "ins", -1.0))


def legs(results: FlightResults) -> Plot | None:
    """Return the error by heading: a bar for every leg, its epochs, and the fitted curve."""
    answer, epochs, curve = results.answer(FluxDeviation), results.rows_of(FluxEpochRows), results.rows_of(FluxCurve)
    used = [leg for leg in answer.used if leg.error_deg is not None] if answer else []
    if answer is None or epochs is None or curve is None:
        return None
    mine = epochs.leg > 0
    x, y, band = (
        curve.uncorrected_magnetic_heading_deg,
        curve.heading_error_deg,
        NORMAL_95 * curve.heading_error_sigma_deg,
    )
    marks: list[AnyMark] = [
        ZERO,
        Dots(x=epochs.magnetic_heading_deg[mine], y=epochs.heading_error_deg[mine], role="unused", name="epochs"),
        Band(x=x, low=y - band, high=y + band, role="answer"),
        Curve(x=x, y=y, role="answer", name="A to E"),
    ]
    errors = np.array([leg.error_deg for leg in used], dtype=np.float64)
    half = NORMAL_95 * np.array([leg.sigma_deg for leg in used], dtype=np.float64)
    if used:
        heading = np.array([leg.magnetic_heading_deg for leg in used])
        marks.append(Bars(x=heading, y=errors, half=half, role="ins", name="legs"))
    low = float(np.min(np.concatenate([errors - half, y - band])))
    high = float(np.max(np.concatenate([errors + half, y + band])))
    middle, reach = 0.5 * (low + high), max(0.6 * (high - low), 0.5 * LEAST_SPAN_DEG)
    axis = Axis("error of the heading, °", low=middle - reach, high=middle + reach)
    return Plot(
        "magnetic.flux_legs",
        "Compass in flight: error by heading",
        f"Reading + declination − true heading, n = {len(used)} straight legs with ± 1.96 σ (what all share in it). "
        "Line and shade: A to E with their 95 % band. Epochs beyond the axis are cut.",
        "Error of the compass against magnetic heading, one bar for each straight leg.",
        one_panel(Panel(marks, heading_axis(), axis), 56.0),
        ("magnetic_flux_epochs", "magnetic_flux_curve"),
    )


def turns(results: FlightResults) -> Plot | None:
    """Return the error in turns by heading, to either side, beside what lean and lag make."""
    answer, epochs = results.answer(FluxDeviation), results.rows_of(FluxEpochRows)
    if answer is None or epochs is None or not (np.abs(epochs.lean_deg) >= TURN_DEG).any():
        return None
    marks: list[AnyMark] = [ZERO]
    for name, role, side in SIDES:
        mine = side * epochs.lean_deg >= TURN_DEG
        x = epochs.magnetic_heading_deg[mine]
        marks.append(Dots(x=x, y=epochs.heading_error_deg[mine], role=role, name=name))
        if answer.bank_error.state == "found":
            fitted = epochs.bank_error_deg[mine]
            told = "by lean and lag" if side > 0.0 else ""
            marks.append(Dots(x=x, y=fitted, role="ink", name=told, emphasis="faint"))
    return Plot(
        "magnetic.flux_turns",
        "Compass in turns",
        f"Error at more than {TURN_DEG:g}° of bank. A sensor that hangs leans with the aircraft and senses the "
        "vertical field: north of the magnetic equator it lags through north and leads through south. Black: that part "
        "as fitted.",
        "Error of the compass in right and left turns against magnetic heading.",
        one_panel(Panel(marks, heading_axis(), Axis("error of the heading, °")), 52.0),
        ("magnetic_flux_epochs",),
    )


PLOTS: Mapping[str, Describe] = {"magnetic.flux_legs": legs, "magnetic.flux_turns": turns}
