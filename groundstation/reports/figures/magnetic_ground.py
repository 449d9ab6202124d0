"""Figure of the ground runs: the error of the installed heading sensor by magnetic heading."""

from typing import Any

import numpy as np

from groundstation.base.normal import NORMAL_95
from groundstation.reports import drawing as d
from groundstation.reports import layout
from groundstation.reports.drawing import Drawing
from groundstation.results.arrays.magnetic import GroundRunCurve, GroundRunEpochs
from groundstation.results.flight import FlightResults
from groundstation.results.magnetic_ground import GroundDeviation

LEAST_SPAN_DEG = 2.0  # of the error axis


def ground_runs(results: FlightResults) -> Drawing | None:
    """Error by magnetic heading: every run with its bar, its epochs behind it, the curve where there is one."""
    answer = results.answer(GroundDeviation)
    used = [run for run in answer.used if run.error_deg is not None] if answer else []
    if not used:
        return None
    heading = np.array([run.magnetic_heading_deg for run in used])
    error = np.array([run.error_deg for run in used], dtype=np.float64)
    half = NORMAL_95 * np.array([run.sigma_deg for run in used], dtype=np.float64)  # NaN where it is not known
    curve = results.rows_of(GroundRunCurve)
    epochs = results.rows_of(GroundRunEpochs)
    low, high = float(np.nanmin(error - half)), float(np.nanmax(error + half))
    middle, reach = 0.5 * (low + high), max(0.6 * (high - low), 0.5 * LEAST_SPAN_DEG)

    def paint(figure: Any) -> None:
        axes = layout.place(figure, 16, 12, 174, 66)
        if epochs is not None:
            mine = epochs.is_used
            x, y = epochs.magnetic_heading_deg[mine], epochs.heading_error_deg[mine]
            d.dots(axes, x, y, d.UNUSED, 2.4, 2500, label="epochs")
        if curve is not None and np.isfinite(curve.heading_error_deg).any():
            x, y = curve.magnetic_heading_deg, curve.heading_error_deg
            band = NORMAL_95 * curve.heading_error_sigma_deg
            axes.fill_between(x, y - band, y + band, color=d.USED, alpha=0.15, linewidth=0)
            d.line(axes, x, y, d.USED, 1.2, label="A to E")
        bars: dict[str, Any] = {"color": d.INS, "markersize": 3.5, "elinewidth": 1.1, "capsize": 2.5, "zorder": 4}
        axes.errorbar(heading, error, half, fmt="o", label="runs", **bars)
        axes.axhline(0.0, color=d.FAINT, linewidth=0.6)
        axes.set_ylim(middle - reach, middle + reach)
        axes.set_xlim(0.0, 360.0)
        axes.set_xticks(range(0, 361, 30))
        axes.set_xlabel("magnetic heading as read, °")
        axes.set_ylabel("error of the heading, °")
        layout.legend_above(axes, 3)

    caption = (
        f"Magnetic heading + declination − track, n = {len(used)} runs with ± 1.96 σ (noise, slip and declination, the "
        "last common to all). Line and shade: the curve with its 95 % band, drawn only where it is accurate enough. "
        "Epochs beyond the axis are cut."
    )
    alt = "Error of the installed heading sensor against magnetic heading, one bar for each straight ground run."
    names = ("magnetic_ground_epochs", "magnetic_ground_curve")
    return Drawing("Ground runs: error by heading", caption, alt, d.draw("magnetic-ground", 74, paint), names)
