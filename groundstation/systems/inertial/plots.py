"""Plots of the INS errors: states with bands, innovations, observability, track.

The track before and after correction.
"""

from collections.abc import Mapping

import numpy as np

from groundstation.base.quantiles import NORMAL_95
from groundstation.chapters.plots.common import has_values, positive, span
from groundstation.plots.axes import ZERO, time_axis
from groundstation.plots.marks import AnyMark, Band, Curve, Dots, Floats, Limit, Spans, series
from groundstation.plots.plot import Axis, Describe, Panel, Plot, Row, one_panel
from groundstation.plots.ranges import finite, padded, symmetric
from groundstation.results.flight import FlightResults
from groundstation.systems.inertial.alignment_plots import ground_marks
from groundstation.systems.inertial.answer import InertialResult
from groundstation.systems.inertial.arrays import (
    InertialDifferences,
    InertialObservability,
    InertialOwnInnovations,
    InertialStates,
    InertialTrack,
    ObservabilityOfChannel,
    OwnInnovationsOfChannel,
    StateSeries,
    StatesOfChannel,
)

INFERRED = ("tilt", "drift", "drift_rate", "random_drift")  # what GNSS does not measure
BAND_QUANTILES = (10.0, 90.0)  # the band of the first minutes and of long outages may leave the axis
MOST_SIGMAS = 8.0  # of an innovation that is on the axis
UNITS = {
    "position": "m",
    "velocity": "m/s",
    "tilt": "arcsec",
    "drift": "°/h",
    "drift_rate": "°/h per h",
    "random_drift": "°/h",
}
STATES = {
    "position": "position",
    "velocity": "velocity",
    "tilt": "tilt",
    "drift": "constant drift",
    "drift_rate": "drift rate",
    "random_drift": "random drift",
}


def state(results: FlightResults, name: str) -> Plot | None:
    """Return a state of both channels: measured, estimated, smoothed, with the 95 % band."""
    data = results.rows_of(InertialStates)
    if data is None or not _are_known(data, name):
        return None
    told = STATES[name] if name in INFERRED else f"{name} error"
    rows = tuple(
        Row((_state(data, states, name, f"{channel} {told}", legend=above),), 40.0, shares_x=above)
        for channel, states, above in (("north", data.north, True), ("east", data.east, False))
    )
    return Plot(
        f"inertial.state.{name}",
        f"{told.capitalize()} of the INS",
        "Grey: INS − GNSS; green: estimate, shaded ± 1.96 σ; black: smoothed with data on both sides (RTS). Yellow "
        "background: nothing to compare, the filter forecasts.",
        f"North and east {told} over flight time with the estimate and its band.",
        rows,
        ("inertial_states",),
    )


def tilt_and_drift(results: FlightResults) -> Plot | None:
    """Return the platform tilt and constant gyro drift of both channels with their bands."""
    data = results.rows_of(InertialStates)
    names = ("tilt", "drift")
    if data is None or not all(_are_known(data, name) for name in names):
        return None
    rows = []
    for name in names:
        panels = tuple(
            _state(data, states, name, f"{channel} {STATES[name]}", legend=name == "tilt" and channel == "east")
            for channel, states in (("north", data.north), ("east", data.east))
        )
        rows.append(Row(panels, 38.0, shares_x=name == "tilt"))
    return Plot(
        "inertial.tilt_and_drift",
        "Platform tilt and gyro drift",
        "States that GNSS does not measure, as the filter infers them. If a band does not shrink, the flight does not "
        "show the state.",
        "Platform tilt and gyro drift of both channels over flight time with 95 % bands.",
        tuple(rows),
        ("inertial_states",),
    )


def _are_known(data: InertialStates, name: str) -> bool:
    """Tell whether a state is known in both channels."""
    return has_values(data.north.state(name).value, data.east.state(name).value)


def _state(data: InertialStates, channel: StatesOfChannel, name: str, title: str, *, legend: bool) -> Panel:
    one, time = channel.state(name), data.time_s
    half = NORMAL_95 * one.sigma
    marks: list[AnyMark] = [outages(data)]
    if np.isfinite(half).any():
        marks.append(Band(x=time, low=one.value - half, high=one.value + half, role="answer", name="95 % band"))
    if np.isfinite(one.measured).any():
        marks.append(Dots(x=time, y=one.measured, role="unused", name="INS − GNSS"))
    marks.append(Curve(x=time, y=one.value, role="answer", name="estimate"))
    if np.isfinite(one.smoothed).any():
        marks.append(Curve(x=time, y=one.smoothed, role="ink", name="smoothed (RTS)", emphasis="thin"))
    low, high = _range(one)
    y = Axis(f"{title}, {UNITS[name]}", low=low, high=high)
    return Panel(marks, time_axis(*span(time)), y, legend="above" if legend else "")


def _range(one: StateSeries) -> tuple[float | None, float | None]:
    """Return ends of the axis on which every estimate is seen and the band most of the time."""
    half = NORMAL_95 * one.sigma
    shown = finite(one.value, one.measured)
    if not shown.size:
        return None, None
    edges = [finite(one.value - half), finite(one.value + half)]
    ends = [float(end) for edge in edges if edge.size for end in np.percentile(edge, BAND_QUANTILES)]
    return padded(min(float(shown.min()), *ends), max(float(shown.max()), *ends), 0.08)


def outages(data: InertialStates) -> Spans:
    """Return the spans of time in which the filter forecast."""
    gone, time = data.is_forecast, data.time_s
    edges = np.flatnonzero(np.diff(np.concatenate([[0], gone.astype(np.int8), [0]])))
    start, end = time[edges[::2]], time[np.minimum(edges[1::2], len(time) - 1)]
    return Spans(start=start, end=end, kind=np.full(len(start), ""), role="warn", emphasis="faint")


def radial(results: FlightResults) -> Plot | None:
    """Return the radial error of the track by the INS and as corrected, on a log axis."""
    data = results.rows_of(InertialTrack)
    if data is None or data.ins_error_m is None or data.corrected_error_m is None:
        return None
    if not has_values(data.ins_error_m, data.corrected_error_m):
        return None
    states = results.rows_of(InertialStates)
    corrected = "corrected: INS − estimated or forecast error"
    marks: list[AnyMark] = [] if states is None else [outages(states)]
    marks += ground_marks(results, named=True)
    marks.append(Curve(x=data.time_s, y=positive(data.ins_error_m), role="ins", name="INS"))
    marks.append(Curve(x=data.time_s, y=positive(data.corrected_error_m), role="answer", name=corrected))
    panel = Panel(marks, time_axis(*span(data.time_s)), Axis("radial error against GNSS, m", "log"))
    return Plot(
        "inertial.radial",
        "Track error before and after correction",
        "Distance from GNSS. With GNSS, the corrected track follows it as far as the filter trusts it; on yellow "
        "background there was nothing to compare.",
        "Radial position error of the INS and of the corrected track over flight time, logarithmic axis.",
        one_panel(panel, 46.0),
        ("inertial_track",),
    )


def innovations(results: FlightResults) -> Plot | None:
    """Return innovations over their sigma, with the limits that 95 % should keep."""
    data = results.rows_of(InertialStates)
    if data is None or not has_values(data.north.normalised_innovation, data.east.normalised_innovation):
        return None
    rows = []
    for channel, states in (("north", data.north), ("east", data.east)):
        values = states.normalised_innovation
        marks: list[AnyMark] = [
            Dots(x=data.time_s, y=values, role="ins"),
            Limit(value=NORMAL_95, name="± 1.96 σ"),
            Limit(value=-NORMAL_95),
        ]
        low, high = symmetric(values, 1.3 * NORMAL_95, MOST_SIGMAS)
        y = Axis(f"{channel} innovation, σ", low=low, high=high)
        above = channel == "north"
        panel = Panel(marks, time_axis(*span(data.time_s)), y, legend="above" if above else "")
        rows.append(Row((panel,), 28.0, shares_x=above))
    return Plot(
        "inertial.innovations",
        "Innovations",
        "Innovation (measured − predicted position) over its own σ. If the noise model is right, 95 % lie between the "
        "dashed lines without slow waves; waves mean slow GNSS errors or an INS that the model does not describe. "
        "With the noise raised nearly all lie inside, which proves nothing.",
        "Normalised innovations of both channels over flight time with limits at 1.96.",
        tuple(rows),
        ("inertial_states",),
    )


def observability(results: FlightResults) -> Plot | None:
    """Return how well each state is observed as the flight goes on."""
    data = results.rows_of(InertialObservability)
    if data is None or not any(has_values(values) for values in data.north.states().values()):
        return None
    panels = _observed(data, data.north, "north"), _observed(data, data.east, "east")
    return Plot(
        "inertial.observability",
        "Observability",
        "1 − σ/σ without GNSS, for each state: 0: the flight does not show it; 1: it is known.",
        "Observability of the six states of both channels over flight time.",
        (Row(panels, 38.0),),
        ("inertial_observability",),
    )


def _observed(data: InertialObservability, part: ObservabilityOfChannel, channel: str) -> Panel:
    marks = [
        Curve(x=data.time_s, y=values, role=series(place), name=STATES[name])
        for place, (name, values) in enumerate(part.states().items())
    ]
    y = Axis("observability" if channel == "north" else "", low=-0.03, high=1.03)
    return Panel(marks, time_axis(*span(data.time_s)), y, title=channel, legend="beside" if channel == "east" else "")


def differences(results: FlightResults, quantity: str) -> Plot | None:
    """Return INS minus GNSS of an INS that GNSS corrects, north and east."""
    data = results.rows_of(InertialDifferences)
    if data is None:
        return None
    north, east = (one.position_m if quantity == "position" else one.velocity_mps for one in (data.north, data.east))
    if not has_values(north, east):
        return None
    rows, left = [], _departures(results)
    for channel, values in (("north", north), ("east", east)):
        marks = (*left, ZERO, Dots(x=data.time_s, y=values, role="ins"))
        panel = Panel(marks, time_axis(*span(data.time_s)), Axis(f"{channel}, {UNITS[quantity]}"), legend="")
        rows.append(Row((panel,), 28.0, shares_x=channel == "north"))
    return Plot(
        f"inertial.differences.{quantity}",
        f"INS − GNSS, {quantity}",
        "Every epoch with both INS and GNSS. A slow wave here is not a Schuler oscillation."
        + (" Shaded: departures from GNSS." if left else ""),
        f"INS minus GNSS, {quantity} north and east, over flight time.",
        tuple(rows),
        ("inertial_differences",),
    )


def _departures(results: FlightResults) -> tuple[AnyMark, ...]:
    """Return the spans in which the INS left GNSS, shaded."""
    answer = results.answer(InertialResult)
    found = () if answer is None else answer.departures
    if not found:
        return ()
    start, end = np.array([one.start_s for one in found]), np.array([one.end_s for one in found])
    return (Spans(start=start, end=end, kind=np.full(len(found), ""), role="warn", name="apart"),)


def own_innovations(results: FlightResults) -> Plot | None:
    """Return innovations that the INS's own filter logged, with its band where it logged one."""
    data = results.rows_of(InertialOwnInnovations)
    if data is None:
        return None
    rows = tuple(
        Row(
            (_own(data.time_s, data.north, "north", quantity), _own(data.time_s, data.east, "east", quantity)),
            32.0,
            shares_x=quantity == "position",
        )
        for quantity in ("position", "velocity")
    )
    has_band = has_values(data.north.position_sigma_m)
    band = " Shaded: ± 1.96 of the filter's own σ; 95 % should lie inside." if has_band else ""
    return Plot(
        "inertial.own_innovations",
        "Innovations of the INS's own filter",
        f"GNSS − what the INS's own filter predicted.{band} Rare large ones are off the axis.",
        "Innovations of the INS's own filter in position and velocity, north and east, over flight time.",
        rows,
        ("inertial_own_innovations",),
    )


def _own(time: Floats, own: OwnInnovationsOfChannel, channel: str, quantity: str) -> Panel:
    values, sigma = own.of(quantity)
    half = NORMAL_95 * sigma
    marks: list[AnyMark] = []
    if np.isfinite(half).any():
        marks.append(Band(x=time, low=-half, high=half, role="answer"))
    marks += [ZERO, Dots(x=time, y=values, role="ins")]
    low, high = _most_of(values)
    y = Axis(f"{channel} {quantity}, {UNITS[quantity]}", low=low, high=high)
    return Panel(marks, time_axis(*span(time)), y, legend="")


def _most_of(values: Floats) -> tuple[float, float]:
    """Return ends of an axis that hold all but one in a hundred."""
    known = np.abs(finite(values))
    largest = 1.3 * float(np.quantile(known, 0.99)) if known.size else 1.0
    return -max(largest, 1e-3), max(largest, 1e-3)


PLOTS: Mapping[str, Describe] = {
    "inertial.state": state,
    "inertial.tilt_and_drift": tilt_and_drift,
    "inertial.radial": radial,
    "inertial.innovations": innovations,
    "inertial.observability": observability,
    "inertial.differences": differences,
    "inertial.own_innovations": own_innovations,
}
