"""Plots of the magnetic deviation: by heading, held out, flown figure, branches, modulus."""

from collections.abc import Mapping

import numpy as np

from groundstation.base.geodesy import on_earth, plan_north_east_m
from groundstation.base.quantiles import NORMAL_95
from groundstation.chapters.plots.common import M_PER_KM
from groundstation.chapters.wording import number
from groundstation.plots.axes import ZERO, broken_time_axis, time_axis
from groundstation.plots.marks import AnyMark, Band, Bars, Curve, Dots, Limit, Role, Told
from groundstation.plots.plot import Axis, Describe, Panel, Plot, Row, one_panel
from groundstation.plots.ranges import broken_at_gaps, padded, windows
from groundstation.results.arrays.flight import Overview
from groundstation.results.flight import FlightResults
from groundstation.systems.magnetic.answer import METHOD_TITLES, MagneticResult, MethodName, Turn
from groundstation.systems.magnetic.arrays import (
    GroundRunCurve,
    GroundRunEpochs,
    MagneticCurves,
    MagneticModulus,
    MagneticSamples,
    MagneticTable,
)
from groundstation.systems.magnetic.ground_answer import GroundDeviation

METHOD_ROLES: dict[MethodName, Role] = {
    "compass_table": "ins",
    "poisson_attitude": "answer",
    "constant_modulus": "series 4",
}
BRANCHES: tuple[tuple[str, Role], ...] = (("right turn", "gnss"), ("left turn", "ins"))
MARGIN_S = 20.0  # flight shown before and after the figure
LEAST_SPAN_DEG = 2.0  # of the axis of errors of ground runs
NT_PER_UT = 1e3


def heading_axis(step_deg: float = 30.0) -> Axis:
    """Return an axis of the magnetic heading as read, a number at every so many degrees."""
    ticks = tuple(np.arange(0.0, 361.0, step_deg).tolist())
    return Axis("magnetic heading as read, °", "angle", 0.0, 360.0, ticks=ticks)


def deviation(results: FlightResults) -> Plot | None:
    """Return the deviation against heading by each method, with bands."""
    curves, table = results.rows_of(MagneticCurves), results.rows_of(MagneticTable)
    if curves is None:
        return None
    heading = curves.uncorrected_magnetic_heading_deg
    bands: list[AnyMark] = []
    lines: list[AnyMark] = []
    for name, role in METHOD_ROLES.items():
        value, sigma = curves.deviation_deg.get(name), curves.sigma_deg.get(name)
        if value is None or sigma is None or not np.isfinite(value).any():
            continue
        half = NORMAL_95 * sigma
        bands.append(Band(x=heading, low=value - half, high=value + half, role=role))
        lines.append(Curve(x=heading, y=value, role=role, name=METHOD_TITLES[name]))
    if table is not None:
        bins, values = table.uncorrected_magnetic_heading_deg, table.deviation_deg
        bands.append(Dots(x=bins, y=values, role="unused", name="table, bins of 1°", emphasis="bold"))
    panel = Panel((ZERO, *bands, *lines), heading_axis(), Axis("deviation, to be added, °"))
    return Plot(
        "magnetic.deviation",
        "Deviation by heading",
        "To be added to the reading, east positive; lines by A to E of each method in level flight, shaded ± 1.96 σ. "
        "The modulus, where it is drawn, does not show A. Grey: the table bin by bin, with the bias of its bank.",
        "Deviation against magnetic heading, one curve for each method.",
        one_panel(panel, 62.0),
        ("magnetic_curves",),
    )


def held_out(results: FlightResults) -> Plot | None:
    """Return the error of the magnetic heading on samples that no fit used.

    Before and after the recommended correction.
    """
    answer, data = results.answer(MagneticResult), results.rows_of(MagneticSamples)
    if answer is None or data is None or not (mine := data.part == "held out").any():
        return None
    method = answer.recommended_method
    time, heading = data.time_s[mine], data.uncorrected_magnetic_heading_deg[mine]
    before, after = data.error_before_deg[mine], data.error_after_deg(method)[mine]
    over_time, by_heading = (
        (
            ZERO,
            Dots(x=x, y=before, role="unused", name="before" if is_named else ""),
            Dots(x=x, y=after, role=METHOD_ROLES[method], name="after" if is_named else ""),
        )
        for x, is_named in ((time, True), (heading, False))
    )
    ends = time_axis(*padded(float(time.min()), float(time.max())))
    left = Panel(over_time, ends, Axis("error of magnetic heading, °"), share=1.12)
    right = Panel(by_heading, heading_axis(60.0), Axis(), legend="")
    return Plot(
        "magnetic.held_out",
        "Error on data that no fit used",
        f"Level flight that no fit used, n = {number(len(time), 0)} drawn, against flight time and heading; after: by "
        f"the {METHOD_TITLES[method]}. Judged by the same INS and declination: their errors common to the whole flight "
        "do not show.",
        "Residual heading error before and after correction on the held-out part.",
        (Row((left, right), 50.0),),
        ("magnetic_samples",),
    )


def track(results: FlightResults) -> Plot | None:
    """Return the figures as flown, with the branches in their own roles."""
    answer, data = results.answer(MagneticResult), results.rows_of(Overview)
    turns = [turn for turn in answer.turns if turn.state == "used"] if answer else []
    if data is None or not turns:
        return None
    first, last = min(turn.start_s for turn in turns), max(turn.end_s for turn in turns)
    near = (data.time_s >= first - MARGIN_S) & (data.time_s <= last + MARGIN_S)
    latitude, longitude = on_earth(data.latitude_deg[near], data.longitude_deg[near])
    known = np.flatnonzero(np.isfinite(latitude) & np.isfinite(longitude))
    if not known.size:
        return None
    north, east = plan_north_east_m(latitude, longitude, float(latitude[known[0]]), float(longitude[known[0]]))
    time, x, y = data.time_s[near], east / M_PER_KM, north / M_PER_KM
    marks: list[AnyMark] = [
        Curve(x=x, y=y, role="unused"),
        Told(x=x, y=y, value=time, title="flight time", is_time=True),
    ]
    named: set[str] = set()
    for turn in turns:
        mine = (time >= turn.start_s) & (time <= turn.end_s)
        name, role = _branch(turn)
        told = "" if name in named else name
        ways = np.where(mine, x, np.nan), np.where(mine, y, np.nan)
        marks.append(Curve(x=ways[0], y=ways[1], role=role, name=told, emphasis="bold"))
        named.add(name)
    panel = Panel(marks, Axis("east, km"), Axis("north, km"), is_map=True)
    return Plot(
        "magnetic.track",
        "Figures as flown",
        "Ground track in wind from before the first used turn until after the last one, equal scales.",
        "Map of the figures flown, right and left turns in two colours.",
        one_panel(panel, 72.0),
        ("overview",),
    )


def _branch(turn: Turn) -> tuple[str, Role]:
    right, left = BRANCHES
    return right if turn.bank_deg > 0.0 else left


def branches(results: FlightResults) -> Plot | None:
    """Return the compass error on either branch and their average, declination in it."""
    samples, table = results.rows_of(MagneticSamples), results.rows_of(MagneticTable)
    if samples is None or table is None:
        return None
    heading, error = samples.uncorrected_magnetic_heading_deg, samples.compass_error_deg
    bins, average, filled = table.uncorrected_magnetic_heading_deg, table.compass_error_deg, table.is_interpolated
    marks: list[AnyMark] = [
        Dots(x=heading[samples.part == name], y=error[samples.part == name], role=role, name=name)
        for name, role in BRANCHES
    ]
    marks.append(Curve(x=bins, y=average, role="ink", name="average of both"))
    marks.append(Dots(x=bins[filled], y=average[filled], role="limit", name="interpolated", emphasis="bold"))
    return Plot(
        "magnetic.branches",
        "Both branches",
        "Magnetic minus INS true heading, declination in it, as in the patent. Errors that are odd in bank cancel in "
        f"the average; one branch is never used alone. Bins interpolated: {number(int(filled.sum()), 0)} of 360.",
        "Compass error against magnetic heading on right and left turns with their average.",
        one_panel(Panel(marks, heading_axis(), Axis("magnetic − true heading, °")), 58.0),
        ("magnetic_samples", "magnetic_table"),
    )


def modulus(results: FlightResults) -> Plot | None:
    """Return the modulus of the field on the figures before and after it is freed of the iron."""
    answer, data = results.answer(MagneticResult), results.rows_of(MagneticModulus)
    if answer is None or data is None:
        return None
    listed: list[tuple[np.ndarray, Role, str]] = [(data.before_nt, "unused", "as read")]
    listed += [(after, METHOD_ROLES[name], METHOD_TITLES[name]) for name, after in data.freed().items()]
    marks: list[AnyMark] = []
    for values, role, name in listed:
        if np.isfinite(values).any():
            time, broken = broken_at_gaps(data.time_s, values / NT_PER_UT)
            marks.append(Curve(x=time, y=broken, role=role, name=name))
    horizontal, down = answer.declination.horizontal_nt, answer.declination.down_nt
    if horizontal is not None and down is not None:
        marks.append(Limit(value=float(np.hypot(horizontal, down)) / NT_PER_UT, name="field of the model"))
    panel = Panel(marks, broken_time_axis(windows(data.time_s)), Axis("modulus of the field, µT"))
    return Plot(
        "magnetic.modulus",
        "Modulus of the field",
        "Readings of the figures alone. If the modulus still waves after the fit, the model does not describe all "
        "iron.",
        "Modulus of the magnetic field over flight time before and after the fit.",
        one_panel(panel, 50.0),
        ("magnetic_modulus",),
    )


def ground_runs(results: FlightResults) -> Plot | None:
    """Return the error by magnetic heading: a bar for every run, epochs, fitted curve.

    Epochs lie behind the bars; no curve where none was fitted.
    """
    answer = results.answer(GroundDeviation)
    used = [run for run in answer.used if run.error_deg is not None] if answer else []
    if not used:
        return None
    heading = np.array([run.magnetic_heading_deg for run in used])
    error = np.array([run.error_deg for run in used], dtype=np.float64)
    half = NORMAL_95 * np.array([run.sigma_deg for run in used], dtype=np.float64)  # NaN where it is not known
    curve, epochs = results.rows_of(GroundRunCurve), results.rows_of(GroundRunEpochs)
    marks: list[AnyMark] = [ZERO]
    if epochs is not None:
        x, y = epochs.magnetic_heading_deg[epochs.is_used], epochs.heading_error_deg[epochs.is_used]
        marks.append(Dots(x=x, y=y, role="unused", name="epochs"))
    if curve is not None and np.isfinite(curve.heading_error_deg).any():
        x, y, band = curve.magnetic_heading_deg, curve.heading_error_deg, NORMAL_95 * curve.heading_error_sigma_deg
        marks.append(Band(x=x, low=y - band, high=y + band, role="answer"))
        marks.append(Curve(x=x, y=y, role="answer", name="A to E"))
    marks.append(Bars(x=heading, y=error, half=half, role="ins", name="runs"))
    low, high = float(np.nanmin(error - half)), float(np.nanmax(error + half))
    middle, reach = 0.5 * (low + high), max(0.6 * (high - low), 0.5 * LEAST_SPAN_DEG)
    errors = Axis("error of the heading, °", low=middle - reach, high=middle + reach)
    return Plot(
        "magnetic.ground_runs",
        "Ground runs: error by heading",
        f"Magnetic heading + declination − track, n = {len(used)} runs with ± 1.96 σ (noise, slip and declination, the "
        "last common to all). Line and shade: the curve with its 95 % band, drawn only where it is accurate enough. "
        "Epochs beyond the axis are cut.",
        "Error of the installed heading sensor against magnetic heading, one bar for each straight ground run.",
        one_panel(Panel(marks, heading_axis(), errors), 54.0),
        ("magnetic_ground_epochs", "magnetic_ground_curve"),
    )


PLOTS: Mapping[str, Describe] = {
    "magnetic.deviation": deviation,
    "magnetic.held_out": held_out,
    "magnetic.track": track,
    "magnetic.branches": branches,
    "magnetic.modulus": modulus,
    "magnetic.ground_runs": ground_runs,
}
