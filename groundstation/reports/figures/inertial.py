"""Figures of the INS errors: each state with its band, innovations, observability, and the track before and after."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from groundstation.base.normal import NORMAL_95
from groundstation.plots.ranges import finite, padded, thin
from groundstation.reports import drawing as d
from groundstation.reports import layout
from groundstation.reports.drawing import Drawing
from groundstation.results.arrays.inertial import (
    InertialDifferences,
    InertialObservability,
    InertialOwnInnovations,
    InertialStates,
    InertialTrack,
    StateSeries,
)
from groundstation.results.arrays.typed import Floats
from groundstation.results.flight import FlightResults

BAND_QUANTILES = (10.0, 90.0)  # the band of the first minutes and of long outages may leave the axis
UNITS = {"position": "m", "velocity": "m/s", "tilt": "arcsec", "drift": "°/h"}
STATES = {
    "position": "position",
    "velocity": "velocity",
    "tilt": "tilt",
    "drift": "constant drift",
    "drift_rate": "drift rate",
    "random_drift": "random drift",
}
OUTAGE = "#fbe9c6"
MOST, MOST_DOTS = 500, 800  # points of a line and dots: more cannot be told apart on paper


def state(results: FlightResults, name: str) -> Drawing | None:
    """Position or velocity error of both channels: measured, estimated, smoothed, with the 95 % band."""
    data = results.rows_of(InertialStates)
    if data is None or not _are_known(data, name):
        return None
    low, high = span(data.time_s)

    def paint(figure: Any) -> None:
        upper, lower = layout.place(figure, 18, 58, 174, 98), layout.place(figure, 18, 12, 174, 52)
        for axes, channel, states in ((upper, "north", data.north), (lower, "east", data.east)):
            _outages(axes, data)
            _paint_state(axes, data.time_s, states.state(name))
            axes.set_ylabel(f"{channel} {name} error, {UNITS[name]}")
            layout.time_axis(axes, low, high, title=axes is lower)
        layout.legend_above(upper)

    caption = (
        "Grey: INS − GNSS; green: estimate, shaded ± 1.96 σ; black: smoothed with data on both sides (RTS). Yellow "
        "background: nothing to compare, the filter forecasts."
    )
    alt = f"North and east {name} error over flight time with the estimate and its band."
    svg = d.draw(f"inertial-{name}", 106, paint)
    return Drawing(f"{name.capitalize()} error of the INS", caption, alt, svg, ("inertial_states",))


def tilt_and_drift(results: FlightResults) -> Drawing | None:
    """Platform tilt and constant gyro drift of both channels with their bands."""
    data = results.rows_of(InertialStates)
    names = ("tilt", "drift")
    if data is None or not all(_are_known(data, name) for name in names):
        return None
    low, high = span(data.time_s)

    def paint(figure: Any) -> None:
        for row, name in enumerate(names):
            bottom = 12.0 + 46.0 * (1 - row)
            for column, (channel, states) in enumerate((("north", data.north), ("east", data.east))):
                axes = layout.place(figure, 18 + 90 * column, bottom, 84 + 90 * column, bottom + 38)
                _outages(axes, data)
                _paint_state(axes, data.time_s, states.state(name))
                axes.set_ylabel(f"{channel} {STATES[name]}, {UNITS[name]}")
                layout.time_axis(axes, low, high, title=row == 1, most=5)
                if row == 0 and column == 1:
                    layout.legend_above(axes)

    caption = (
        "States that GNSS does not measure, as the filter infers them. If a band does not shrink, the flight does not "
        "show the state."
    )
    alt = "Platform tilt and gyro drift of both channels over flight time with 95 % bands."
    svg = d.draw("inertial-tilt", 104, paint)
    return Drawing("Platform tilt and gyro drift", caption, alt, svg, ("inertial_states",))


def _are_known(data: InertialStates, name: str) -> bool:
    """Tell whether a state is known in both channels."""
    return has_values(data.north.state(name).value, data.east.state(name).value)


def _paint_state(axes: Any, time: Floats, state: StateSeries) -> None:
    estimate, measured, smoothed = state.value, state.measured, state.smoothed
    half = NORMAL_95 * state.sigma
    keep = thin(len(time), MOST)
    if np.isfinite(half).any():
        low, high = (estimate - half)[keep], (estimate + half)[keep]
        axes.fill_between(time[keep], low, high, color=d.USED, alpha=0.2, linewidth=0, label="95 % band")
    if np.isfinite(measured).any():
        d.dots(axes, time, measured, d.UNUSED, 1.6, MOST_DOTS, zorder=1.5, label="INS − GNSS")
    if np.isfinite(smoothed).any():
        d.line(axes, time, smoothed, d.INK, 0.8, MOST, zorder=3, label="smoothed (RTS)")
    d.line(axes, time, estimate, d.USED, 1.1, MOST, zorder=2.5, label="estimate")
    shown = finite(estimate, measured)
    if shown.size:
        edges = [finite(estimate - half), finite(estimate + half)]
        ends = [float(end) for edge in edges if edge.size for end in np.percentile(edge, BAND_QUANTILES)]
        axes.set_ylim(*padded(min(float(shown.min()), *ends), max(float(shown.max()), *ends), 0.08))


def has_values(*columns: Floats | None) -> bool:
    """Tell whether each of the columns is there and has a finite value."""
    return all(column is not None and bool(np.isfinite(column).any()) for column in columns)


def span(time_s: Floats) -> tuple[float, float]:
    """First and last flight time of a figure."""
    times = finite(time_s)
    return (float(times.min()), float(times.max())) if times.size else (0.0, 1.0)


def _outages(axes: Any, data: InertialStates) -> None:
    """Ground the times at which the filter forecast."""
    gone, time = data.is_forecast, data.time_s
    edges = np.flatnonzero(np.diff(np.concatenate([[0], gone.astype(np.int8), [0]])))
    for start, end in zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True):
        axes.axvspan(time[start], time[min(end, len(time) - 1)], color=OUTAGE, linewidth=0, zorder=0)


def radial(results: FlightResults) -> Drawing | None:
    """Radial error of the track as flown by the INS and as corrected, on a logarithmic axis."""
    data = results.rows_of(InertialTrack)
    if data is None or data.ins_error_m is None or data.corrected_error_m is None:
        return None
    errors = data.ins_error_m, data.corrected_error_m
    if not has_values(*errors):
        return None
    low, high = span(data.time_s)
    states = results.rows_of(InertialStates)

    def paint(figure: Any) -> None:
        axes = layout.place(figure, 18, 12, 174, 58)
        axes.set_yscale("log")
        if states is not None:
            _outages(axes, states)
        for values, text, colour in (
            (errors[0], "INS", d.INS),
            (errors[1], "corrected: INS − estimated or forecast error", d.USED),
        ):
            d.line(axes, data.time_s, np.where(values > 0.0, values, np.nan), colour, 1.0, label=text)
        plain_log(axes.yaxis, (1.0,))
        axes.set_ylabel("radial error against GNSS, m")
        layout.time_axis(axes, low, high)
        layout.legend_above(axes)

    caption = (
        "Distance from GNSS. With GNSS, the corrected track follows it as far as the filter trusts it; on yellow "
        "background there was nothing to compare."
    )
    alt = "Radial position error of the INS and of the corrected track over flight time, logarithmic axis."
    svg = d.draw("inertial-radial", 66, paint)
    return Drawing("Track error before and after correction", caption, alt, svg, ("inertial_track",))


def plain_log(axis: Any, marks: tuple[float, ...] = (1.0, 2.0, 5.0)) -> None:
    """Write the ticks of a logarithmic axis as plain numbers."""
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter, NullLocator

    axis.set_major_locator(LogLocator(10.0, subs=marks, numticks=20))
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axis.set_minor_locator(NullLocator())
    axis.set_minor_formatter(NullFormatter())


def innovations(results: FlightResults) -> Drawing | None:
    """Innovations over their sigma, with the limits that 95 % should keep."""
    data = results.rows_of(InertialStates)
    if data is None or not has_values(data.north.normalised_innovation, data.east.normalised_innovation):
        return None
    low, high = span(data.time_s)

    def paint(figure: Any) -> None:
        for channel, values, bottom in (
            ("north", data.north.normalised_innovation, 46.0),
            ("east", data.east.normalised_innovation, 12.0),
        ):
            axes = layout.place(figure, 18, bottom, 174, bottom + 28)
            d.dots(axes, data.time_s, values, d.INS, 1.6, MOST_DOTS, zorder=2)
            for limit, text in ((NORMAL_95, "± 1.96 σ"), (-NORMAL_95, "")):
                layout.limit_line(axes, limit, text)
            axes.set_ylim(*_symmetric(values))
            axes.set_ylabel(f"{channel} innovation, σ")
            if channel == "north":
                layout.legend_above(axes)
            layout.time_axis(axes, low, high, title=channel == "east")

    caption = (
        "Innovation (measured − predicted position) over its own σ. If the noise model is right, 95 % lie between the "
        "dashed lines without slow waves; waves mean slow GNSS errors or an INS that the model does not describe. "
        "With the noise raised nearly all lie inside, which proves nothing."
    )
    alt = "Normalised innovations of both channels over flight time with limits at 1.96."
    svg = d.draw("inertial-innovations", 80, paint)
    return Drawing("Innovations", caption, alt, svg, ("inertial_states",))


def _symmetric(values: NDArray[np.float64]) -> tuple[float, float]:
    largest = float(np.abs(finite(values)).max(initial=1.3 * NORMAL_95))
    return -1.1 * min(largest, 8.0), 1.1 * min(largest, 8.0)


def observability(results: FlightResults) -> Drawing | None:
    """How well each state is seen as the flight goes on."""
    data = results.rows_of(InertialObservability)
    if data is None or not any(has_values(values) for values in data.north.states().values()):
        return None
    low, high = span(data.time_s)

    def paint(figure: Any) -> None:
        for place, (channel, part) in enumerate((("north", data.north), ("east", data.east))):
            axes = layout.place(figure, 18 + 66 * place, 12, 76 + 66 * place, 50)
            for (name, values), colour in zip(part.states().items(), d.SERIES, strict=False):
                d.line(axes, data.time_s, values, colour, 1.1, MOST, label=STATES[name])
            axes.set_ylim(-0.03, 1.03)
            axes.set_title(channel)
            axes.set_ylabel("observability" if place == 0 else "")
            layout.time_axis(axes, low, high, most=4)
            if place == 1:
                axes.legend(loc="center left", bbox_to_anchor=(1.03, 0.5))

    caption = "1 − σ/σ without GNSS, for each state: 0: the flight does not show it; 1: it is known."
    alt = "Observability of the six states of both channels over flight time."
    svg = d.draw("inertial-observability", 58, paint)
    return Drawing("Observability", caption, alt, svg, ("inertial_observability",))


def differences(results: FlightResults, quantity: str) -> Drawing | None:
    """INS minus GNSS of an INS that GNSS corrects, north and east."""
    data = results.rows_of(InertialDifferences)
    if data is None:
        return None
    shown = [one.position_m if quantity == "position" else one.velocity_mps for one in (data.north, data.east)]
    if not has_values(*shown):
        return None
    low, high = span(data.time_s)

    def paint(figure: Any) -> None:
        for bottom, channel, values in ((46.0, "north", shown[0]), (12.0, "east", shown[1])):
            axes = layout.place(figure, 18, bottom, 174, bottom + 28)
            _zero(axes)
            d.dots(axes, data.time_s, values, d.INS, 1.6, MOST_DOTS, zorder=2)
            axes.set_ylabel(f"{channel}, {UNITS[quantity]}")
            layout.time_axis(axes, low, high, title=channel == "east")

    caption = "Every epoch with both INS and GNSS. A slow wave here is not a Schuler oscillation."
    alt = f"INS minus GNSS, {quantity} north and east, over flight time."
    svg = d.draw(f"inertial-differences-{quantity}", 80, paint)
    return Drawing(f"INS − GNSS, {quantity}", caption, alt, svg, ("inertial_differences",))


def own_innovations(results: FlightResults) -> Drawing | None:
    """Innovations that the INS's own filter logged, with its band where it logged one."""
    data = results.rows_of(InertialOwnInnovations)
    if data is None:
        return None
    low, high = span(data.time_s)
    time = data.time_s
    has_band = has_values(data.north.position_sigma_m)

    def paint(figure: Any) -> None:
        for row, quantity in enumerate(("position", "velocity")):
            for column, (channel, own) in enumerate((("north", data.north), ("east", data.east))):
                bottom = 12.0 + 40.0 * (1 - row)
                axes = layout.place(figure, 18 + 90 * column, bottom, 84 + 90 * column, bottom + 32)
                values, sigma = own.of(quantity)
                half = NORMAL_95 * sigma
                if np.isfinite(half).any():
                    axes.fill_between(time, -half, half, color=d.USED, alpha=0.2, linewidth=0)
                _zero(axes)
                d.dots(axes, time, values, d.INS, 1.6, MOST_DOTS, zorder=2)
                axes.set_ylim(*_most_of(values))
                axes.set_ylabel(f"{channel} {quantity}, {UNITS[quantity]}")
                layout.time_axis(axes, low, high, title=row == 1, most=5)

    band = " Shaded: ± 1.96 of the filter's own σ; 95 % should lie inside." if has_band else ""
    caption = f"GNSS − what the INS's own filter predicted.{band} Rare large ones are off the axis."
    alt = "Innovations of the INS's own filter in position and velocity, north and east, over flight time."
    svg = d.draw("inertial-own-innovations", 92, paint)
    return Drawing("Innovations of the INS's own filter", caption, alt, svg, ("inertial_own_innovations",))


def _zero(axes: Any) -> None:
    axes.axhline(0.0, color=d.FAINT, linewidth=0.6, zorder=1)


def _most_of(values: NDArray[np.float64]) -> tuple[float, float]:
    """Limits that hold all but one in a hundred."""
    known = np.abs(finite(values))
    largest = 1.3 * float(np.quantile(known, 0.99)) if known.size else 1.0
    return -max(largest, 1e-3), max(largest, 1e-3)
