"""An INS that GNSS corrects: INS - GNSS, and the innovations of its own filter with its band."""

from dataclasses import dataclass

import numpy as np
import rerun.blueprint as rrb

from groundstation.base.normal import NORMAL_95
from groundstation.results.arrays.inertial import InertialDifferences, InertialOwnInnovations
from groundstation.results.flight import FlightResults
from groundstation.viewer import colours
from groundstation.viewer.recorder import Line, Recorder
from groundstation.viewer.series import FloatArray, gap_after
from groundstation.viewer.views import plot

THIN, BOLD = 1.0, 1.5


@dataclass(frozen=True)
class AidedPage:
    """A page: part of its paths, the quantity that its plots show, and flight seconds."""

    part: str
    shown: str
    time_s: FloatArray


def aided_pages(recorder: Recorder, results: FlightResults) -> list[rrb.Container]:
    """Pages of plots, north on the left and east on the right; none for an INS that GNSS does not correct."""
    pages: list[rrb.Container] = []
    differences = results.rows_of(InertialDifferences)
    if differences is not None:
        page = AidedPage("differences", "INS − GNSS", differences.time_s)
        columns = [
            rrb.Vertical(
                contents=[
                    _plot(recorder, page, f"{channel} position", "m", one.position_m),
                    _plot(recorder, page, f"{channel} velocity", "m/s", one.velocity_mps),
                ]
            )
            for channel, one in (("north", differences.north), ("east", differences.east))
        ]
        pages.append(rrb.Horizontal(contents=columns, name="INS − GNSS"))
    own = results.rows_of(InertialOwnInnovations)
    if own is not None:
        page = AidedPage("own_innovations", "innovation, GNSS − predicted", own.time_s)
        columns = [
            rrb.Vertical(
                contents=[
                    _plot(recorder, page, f"{channel} position", "m", one.position_m, one.position_sigma_m),
                    _plot(recorder, page, f"{channel} velocity", "m/s", one.velocity_mps, one.velocity_sigma_mps),
                ]
            )
            for channel, one in (("north", own.north), ("east", own.east))
        ]
        pages.append(rrb.Horizontal(contents=columns, name="Its own filter"))
    return pages


def _plot(
    recorder: Recorder, page: AidedPage, quantity: str, unit: str, values: FloatArray, sigma: FloatArray | None = None
) -> rrb.View:
    """One quantity of a channel over the band of the filter, where that states one."""
    path, time_ns = f"inertial/{page.part}/{quantity.replace(' ', '_')}", recorder.time_ns(page.time_s)
    series: list[FloatArray] = []
    lines: list[Line] = []
    if sigma is not None and np.isfinite(sigma).any():
        half = NORMAL_95 * sigma
        series += [half, -half]
        lines += [Line(f"± 1.96 σ of the filter, {unit}", colours.HONEST, THIN)] * 2
    series.append(values)
    lines.append(Line(f"{page.shown}, {unit}", colours.INS, BOLD))
    recorder.lines(path, time_ns, np.column_stack(series), lines, gap_after(time_ns))
    title = f"{quantity.capitalize()}: {page.shown}, {unit}"
    return plot(title, path, legend=len(lines) > 1)
