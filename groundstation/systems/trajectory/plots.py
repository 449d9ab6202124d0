"""Plots of the best trajectory: map, attitude, sigmas, outages, separation, residuals."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from groundstation.base.angles import interpolate_heading, wrap_360
from groundstation.base.ellipse import ELLIPSE_95, fits, magnified, outlines, told_ellipses
from groundstation.base.geodesy import on_earth, plan_north_east_m
from groundstation.base.quantiles import NORMAL_95
from groundstation.chapters.plots.common import has_values, span
from groundstation.plots.axes import ZERO, time_axis
from groundstation.plots.marks import AnyMark, Band, Curve, Dots, Floats, Outlines, Points, Role, Told
from groundstation.plots.plot import Axis, Describe, Panel, Plot, Row, one_panel
from groundstation.plots.ranges import broken_at_gaps, broken_at_wrap, symmetric, thin
from groundstation.results.arrays.typed import Counts, Flags
from groundstation.results.flight import FlightResults
from groundstation.systems.trajectory.arrays import (
    TrajectoryBiases,
    TrajectoryOnboard,
    TrajectoryOutages,
    TrajectoryResiduals,
    TrajectorySeparation,
    TrajectoryTrack,
)
from groundstation.systems.trajectory.onboard_plots import PANEL_MM, onboard_attitude, onboard_motion, usual

LARGEST_IN_METRES = 3000.0
ELLIPSES = 24  # along the map
AXES: tuple[tuple[str, Role], ...] = (("north", "series 1"), ("east", "series 2"), ("down", "series 3"))
BODY: tuple[tuple[str, Role], ...] = (("x", "series 1"), ("y", "series 2"), ("z", "series 3"))


class _Line(NamedTuple):
    """Line of a panel: name, values, role; sigma where it has a band about it."""

    name: str
    values: Floats
    role: Role
    sigma: Floats | None = None


def track_map(results: FlightResults) -> Plot | None:
    """Return the smoothed track with ellipses of 95 %, and the track of the on-board filter."""
    data, onboard = results.rows_of(TrajectoryTrack), results.rows_of(TrajectoryOnboard)
    if data is None or not len(data):
        return None
    latitude, longitude = on_earth(data.latitude_deg, data.longitude_deg)
    known = np.flatnonzero(np.isfinite(latitude) & np.isfinite(longitude))
    if not len(known):
        return None
    origin = float(latitude[known[0]]), float(longitude[known[0]])
    north, east = plan_north_east_m(latitude, longitude, *origin)
    extent = max(float(np.nanmax(one) - np.nanmin(one)) for one in (north, east))
    scale, unit = (1e-3, "km") if extent > LARGEST_IN_METRES else (1.0, "m")
    rings, larger, wider = _rings(data, north, east, extent)
    marks: list[AnyMark] = [
        Outlines(
            rings=tuple(scale * ring[:, ::-1] for ring in rings),
            magnified=larger,
            role="answer",
            emphasis="thin",
            name="95 %",
            makes_room=False,
        )
    ]
    if onboard is not None and has_values(onboard.latitude_deg):
        theirs = plan_north_east_m(*on_earth(onboard.latitude_deg, onboard.longitude_deg), *origin)
        marks.append(Curve(x=scale * theirs[1], y=scale * theirs[0], role="ins", name="on-board filter"))
    _time, shown_north, shown_east = _broken(data.time_s, data.segment, north, east)
    marks += [
        Curve(x=scale * shown_east, y=scale * shown_north, role="answer", name="smoothed"),
        Told(x=scale * east, y=scale * north, value=data.time_s, title="flight time", is_time=True),
        Points(x=scale * east[known[:1]], y=scale * north[known[:1]], symbol="ring", role="ink"),
    ]
    panel = Panel(marks, Axis(f"east, {unit}"), Axis(f"north, {unit}"), is_map=True, unit_m=1.0 / scale)
    return Plot(
        "trajectory.map",
        "Track",
        f"Smoothed track of the inertial unit. Ring: its start. {told_ellipses('Ellipses: 95 %', larger, wider)}",
        "Map of the smoothed track in metres north and east of its start, with ellipses of 95 %.",
        one_panel(panel, 78.0),
        ("trajectory_track", "trajectory_onboard"),
    )


def _rings(data: TrajectoryTrack, north: Floats, east: Floats, extent: float) -> tuple[tuple[Floats, ...], int, int]:
    """Return ellipses along the way, and how many times their size they are.

    Behind these: how many are wider than the map, and not drawn.
    """
    rows = thin(len(data), ELLIPSES)
    sigmas = data.position_north_sigma_m[rows], data.position_east_sigma_m[rows]
    seen = np.isfinite(north[rows]) & np.isfinite(sigmas[0]) & np.isfinite(sigmas[1])
    rows = rows[seen]
    half = ELLIPSE_95 * np.maximum(data.position_north_sigma_m[rows], data.position_east_sigma_m[rows])
    wider = ~fits(extent, half)
    rows, half = rows[~wider], half[~wider]
    if not len(rows):
        return (), 1, int(wider.sum())
    sigmas = data.position_north_sigma_m[rows], data.position_east_sigma_m[rows]
    larger = magnified(extent, half)
    middles = np.column_stack([north[rows], east[rows]])[:, None, :]
    drawn = middles + larger * outlines(*sigmas, np.zeros(len(rows)), ELLIPSE_95)
    return tuple(drawn), larger, int(wider.sum())


def attitude(results: FlightResults) -> Plot | None:
    """Return smoothed attitude over time beside that of the on-board filter.

    The heading of a second hypothesis is drawn, too.
    """
    data = results.rows_of(TrajectoryTrack)
    if data is None or not len(data):
        return None
    theirs = onboard_attitude_deg(results)
    ends = time_axis(*span(data.time_s))
    rows: list[Row] = []
    smoothed = (("roll, °", data.roll_deg), ("pitch, °", data.pitch_deg), ("heading, °", data.heading_deg))
    for place, (axis, values) in enumerate(smoothed):
        is_heading = axis.startswith("heading")
        marks: list[AnyMark] = [] if is_heading else [ZERO]
        if theirs is not None and has_values(theirs[1][:, place]):
            x, y = broken_at_wrap(*broken_at_gaps(theirs[0], theirs[1][:, place]))
            marks.append(Curve(x=x, y=y, role="ins", name="on-board filter"))
        if is_heading and data.other_heading_deg is not None:
            x, y = broken_at_wrap(*_broken(data.time_s, data.segment, data.other_heading_deg))
            marks.append(Curve(x=x, y=y, role="unused", name="second hypothesis"))
        x, y = broken_at_wrap(*_broken(data.time_s, data.segment, values))
        marks.append(Curve(x=x, y=y, role="answer", name="smoothed"))
        height = Axis(axis, low=0.0, high=360.0) if is_heading else Axis(axis)
        panel = Panel(marks, ends, height, legend="above" if is_heading or not rows else "")
        rows.append(Row((panel,), PANEL_MM, shares_x=not is_heading))
    return Plot(
        "trajectory.attitude",
        "Attitude",
        "Smoothed attitude of the body; the on-board filter's with its constant turn taken off.",
        "Roll, pitch and heading over flight time.",
        tuple(rows),
        ("trajectory_track", "trajectory_onboard"),
    )


def onboard_attitude_deg(results: FlightResults) -> tuple[Floats, Floats] | None:
    """Return times and attitude of the on-board filter, its constant turn taken off."""
    data, onboard = results.rows_of(TrajectoryTrack), results.rows_of(TrajectoryOnboard)
    if data is None or onboard is None or not len(onboard):
        return None
    roll, pitch = (np.interp(onboard.time_s, data.time_s, one) for one in (data.roll_deg, data.pitch_deg))
    heading = interpolate_heading(onboard.time_s, data.time_s, data.heading_deg)
    errors = np.column_stack([onboard.roll_deg, onboard.pitch_deg, onboard.heading_deg])
    told = np.column_stack([roll, pitch, heading]) + errors
    told[:, 2] = wrap_360(told[:, 2])
    return onboard.time_s, told


def sigmas(results: FlightResults) -> Plot | None:
    """Return the smoothed sigmas over time."""
    data = results.rows_of(TrajectoryTrack)
    if data is None or not len(data):
        return None
    plane = np.hypot(data.position_north_sigma_m, data.position_east_sigma_m)
    moving = np.hypot(data.velocity_north_sigma_mps, data.velocity_east_sigma_mps)
    tilt = np.maximum(data.roll_sigma_deg, data.pitch_sigma_deg)
    groups = (
        (
            "position σ, m",
            (_Line("horizontal", plane, "series 1"), _Line("vertical", data.position_down_sigma_m, "series 2")),
        ),
        (
            "velocity σ, m/s",
            (_Line("horizontal", moving, "series 1"), _Line("vertical", data.velocity_down_sigma_mps, "series 2")),
        ),
        ("tilt σ, °", (_Line("", tilt, "answer"),)),
        ("heading σ, °", (_Line("", data.heading_sigma_deg, "answer"),)),
    )
    return _over_time(
        "trajectory.sigmas",
        "Sigmas",
        "Of the smoothed solution, raised where the log's own checks ask for it.",
        "Sigmas of position, velocity, tilt and heading over flight time.",
        (data.time_s, data.segment),
        groups,
        "trajectory_track",
        from_zero=True,
    )


def outages(results: FlightResults) -> Plot | None:
    """Return the errors of replayed outages by their length."""
    data = results.rows_of(TrajectoryOutages)
    if data is None or not len(data):
        return None
    groups: tuple[tuple[str, Floats, Role, float], ...] = (
        ("forward filter, at the end", data.forward_end_error_m, "ins", 1.06),
        ("smoothed, largest inside", data.smoothed_error_m, "answer", 1.0),
        ("95 % of the smoothed solution there", _radius_95(data.smoothed_sigma_m), "unused", 0.94),
    )
    place = _side_by_side(data.length_s)
    marks: list[AnyMark] = [
        Dots(x=aside * place, y=np.where(values > 0.0, values, np.nan), role=role, name=name, emphasis="bold")
        for name, values, role, aside in groups
        if has_values(values)
    ]
    lengths = sorted(set(data.length_s.tolist()))
    x = Axis("length of the outage, s", "log", low=0.7 * lengths[0], high=1.4 * lengths[-1], ticks=tuple(lengths))
    return Plot(
        "trajectory.outages",
        "Errors inside replayed outages",
        f"{len(data)} outages: GNSS was withheld, and the horizontal error is that against the solution with it.",
        "Horizontal errors of replayed outages by their length.",
        one_panel(Panel(marks, x, Axis("horizontal error, m", "log")), 58.0),
        ("trajectory_outages",),
    )


def _side_by_side(length_s: Floats) -> Floats:
    """Return the lengths, equal ones a little apart.

    Dots above each other are told from one.
    """
    place = np.array(length_s)
    for one in np.unique(length_s):
        of = np.flatnonzero(length_s == one)
        place[of] = one * (1.0 + 0.045 * (np.arange(len(of)) / len(of) - 0.5))
    return place


def _radius_95(sigma: Floats) -> Floats:
    """Return the radius of 95 % of a sigma that is the root of the sum of both variances."""
    return np.asarray(ELLIPSE_95 * 0.5**0.5 * sigma)


def separation(results: FlightResults) -> Plot | None:
    """Return forward filter minus smoothed solution."""
    data = results.rows_of(TrajectorySeparation)
    if data is None or not len(data):
        return None
    groups = (
        (
            "position, m",
            tuple(
                _Line(name, values, role)
                for (name, role), values in zip(
                    AXES, (data.position_north_m, data.position_east_m, data.position_down_m), strict=True
                )
            ),
        ),
        (
            "velocity, m/s",
            tuple(
                _Line(name, values, role)
                for (name, role), values in zip(
                    AXES, (data.velocity_north_mps, data.velocity_east_mps, data.velocity_down_mps), strict=True
                )
            ),
        ),
        ("tilt, °", (_Line("roll", data.roll_deg, "series 1"), _Line("pitch", data.pitch_deg, "series 2"))),
        ("heading, °", (_Line("", data.heading_deg, "answer"),)),
    )
    return _over_time(
        "trajectory.separation",
        "Forward filter minus smoothed solution",
        "What the data behind a moment change in it: large at the start and in outages, small where both agree.",
        "Forward filter minus smoothed solution over flight time.",
        (data.time_s, None),
        groups,
        "trajectory_separation",
    )


def residuals(results: FlightResults) -> Plot | None:
    """Return GNSS minus smoothed solution, fixes apart that were held out or rejected."""
    data = results.rows_of(TrajectoryResiduals)
    if data is None or not len(data):
        return None
    every = (
        ("north, m", data.position_north_m),
        ("east, m", data.position_east_m),
        ("down, m", data.position_down_m),
        ("north, m/s", data.velocity_north_mps),
        ("east, m/s", data.velocity_east_mps),
        ("down, m/s", data.velocity_down_mps),
    )
    known = [one for one in every if has_values(one[1])]
    if not known:
        return None
    ends = time_axis(*span(data.time_s))
    kinds: tuple[tuple[str, Flags, Role], ...] = (
        ("used", data.is_used & ~data.is_held_out, "gnss"),
        ("rejected", ~data.is_used & ~data.is_held_out, "bad"),
    )
    rows: list[Row] = []
    for axis, values in known:
        marks: list[AnyMark] = [ZERO]
        for name, chosen, role in kinds:
            if (chosen & np.isfinite(values)).any():
                marks.append(Dots(x=data.time_s, y=np.where(chosen, values, np.nan), role=role, name=name))
        held = np.flatnonzero(data.is_held_out & np.isfinite(values))
        if len(held):
            x, y = data.time_s[held], values[held]
            marks.append(Points(x=x, y=y, symbol="ring", role="answer", name="held out", is_hollow=True))
        low, high = symmetric(usual(values), 1e-3)
        panel = Panel(marks, ends, Axis(axis, low=low, high=high), legend="" if rows else "above")
        rows.append(Row((panel,), 20.0, shares_x=axis != known[-1][0]))
    return Plot(
        "trajectory.residuals",
        "GNSS minus smoothed solution",
        "At the antenna. Hollow: held out, ten seconds of every hundred, against a solution without them.",
        "Residuals of GNSS position and velocity over flight time.",
        tuple(rows),
        ("trajectory_residuals",),
    )


def biases(results: FlightResults) -> Plot | None:
    """Return the biases of gyros and accelerometers with their 95 %."""
    data = results.rows_of(TrajectoryBiases)
    if data is None or not len(data):
        return None
    gyros = (data.gyro_x_dps, data.gyro_y_dps, data.gyro_z_dps)
    gyro_sigmas = (data.gyro_x_sigma_dps, data.gyro_y_sigma_dps, data.gyro_z_sigma_dps)
    accels = (data.accel_x_mg, data.accel_y_mg, data.accel_z_mg)
    accel_sigmas = (data.accel_x_sigma_mg, data.accel_y_sigma_mg, data.accel_z_sigma_mg)
    groups = tuple(
        (
            title,
            tuple(
                _Line(name, one, role, sigma) for (name, role), one, sigma in zip(BODY, values, spreads, strict=True)
            ),
        )
        for title, values, spreads in (
            ("gyro bias, °/s", gyros, gyro_sigmas),
            ("accelerometer bias, mg", accels, accel_sigmas),
        )
    )
    return _over_time(
        "trajectory.biases",
        "Biases of the inertial unit",
        "In the axes of the body: x forward, y right, z down. Bands: 95 %.",
        "Biases of gyros and accelerometers over flight time.",
        (data.time_s, None),
        groups,
        "trajectory_biases",
        height_mm=40.0,
    )


def _over_time(
    name: str,
    title: str,
    caption: str,
    alt: str,
    at: tuple[Floats, Counts | None],
    groups: Sequence[tuple[str, Sequence[_Line]]],
    numbers: str,
    *,
    from_zero: bool = False,
    height_mm: float = PANEL_MM,
) -> Plot | None:
    """Return a panel of lines each group over flight time; None where none has a value."""
    shown = [(axis, [line for line in lines if has_values(line.values)]) for axis, lines in groups]
    shown = [(axis, lines) for axis, lines in shown if lines]
    if not shown:
        return None
    time_s, segment = at
    ends = time_axis(*span(time_s))
    rows = []
    for axis, lines in shown:
        marks: list[AnyMark] = [] if from_zero else [ZERO]
        bands: list[AnyMark] = []
        for line in lines:
            half = np.zeros(len(time_s)) if line.sigma is None else NORMAL_95 * line.sigma
            x, y, wide = _broken(time_s, segment, line.values, half)
            if line.sigma is not None:
                bands.append(Band(x=x, low=y - wide, high=y + wide, role=line.role))
            marks.append(Curve(x=x, y=y, role=line.role, name=line.name if len(lines) > 1 else ""))
        held = usual(np.concatenate([line.values for line in lines]))
        low, high = (0.0, 1.15 * float(held.max(initial=1e-6))) if from_zero else symmetric(held, 1e-6)
        panel = Panel([*bands, *marks], ends, Axis(axis, low=low, high=high), legend="above" if len(lines) > 1 else "")
        rows.append(Row((panel,), height_mm, shares_x=axis != shown[-1][0]))
    return Plot(name, title, caption, alt, tuple(rows), (numbers,))


def _broken(time_s: Floats, segment: Counts | None, *values: Floats) -> tuple[Floats, ...]:
    """Break lines where a segment ends; without segments, at gaps."""
    if segment is None:
        return broken_at_gaps(time_s, *values)
    after = np.flatnonzero(np.diff(segment) != 0) + 1
    return np.insert(time_s, after, time_s[after]), *(np.insert(one, after, np.nan) for one in values)


PLOTS: Mapping[str, Describe] = {
    "trajectory.map": track_map,
    "trajectory.onboard_attitude": onboard_attitude,
    "trajectory.onboard_motion": onboard_motion,
    "trajectory.outages": outages,
    "trajectory.attitude": attitude,
    "trajectory.sigmas": sigmas,
    "trajectory.separation": separation,
    "trajectory.residuals": residuals,
    "trajectory.biases": biases,
}
