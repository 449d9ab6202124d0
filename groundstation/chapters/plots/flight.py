"""Plots of the flight at a glance: track map, altitude, speed, phases and state of GNSS."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from groundstation.base.ellipse import ELLIPSE_95, outlines, told_ellipses
from groundstation.base.geodesy import is_near_pole, on_earth, plan_north_east_m
from groundstation.chapters.plots.coast import coast
from groundstation.chapters.plots.common import lane_roles, span
from groundstation.chapters.wording import number
from groundstation.plots.axes import time_axis
from groundstation.plots.extents import x_extent, y_extent
from groundstation.plots.marks import AnyMark, Curve, Floats, Lanes, Outlines, Points, Role, Spans, Told
from groundstation.plots.plot import Axis, Panel, Plot, Row, one_panel
from groundstation.plots.ranges import broken_at_wrap, finite, padded
from groundstation.plots.scales import MARGIN
from groundstation.results.arrays.flight import GnssLanes, Overview, PhaseSpans, StateLanes
from groundstation.results.arrays.typed import Flags
from groundstation.results.corrected_position import CorrectedPosition, corrected_position
from groundstation.results.flight import ALTITUDE_DATUM, FlightResults
from groundstation.results.roles import OnTaxi

SMALLEST_TAXI_M = 10.0  # less is no taxi worth enlarging: a receiver at rest, or a start by hand
SMALLEST_MAP_M = 2.0  # side of the map of an aircraft that did not move
LARGEST_IN_METRES = 3000.0
LARGEST_OF_ONE_SCALE_M = 200_000.0  # beyond it the scale 60 deg north is 3 % off at the other end
ASPECTS, HALF_ASPECTS = (1.95, 2.15), (0.88, 1.05)  # of the frame of a map alone, of one of two: least and greatest
MOST_MODES, MOST_GNSS_STATES = 12, 8
LANE_MM = 4.6
STATE_ROLES: dict[str, Role] = {"armed": "bad", "on the ground": "series 6"}
GNSS_ROLES: dict[str, Role] = {
    "good": "answer",
    "integrity lost": "bad",
    "no fix": "bad",
    "no GNSS": "bad",
    "not logged": "faint",
}


def track_map(results: FlightResults) -> Plot | None:
    """Return the track in local coordinates, the taxi enlarged, the used stretches marked."""
    data = results.rows_of(Overview)
    if data is None:
        return None
    latitude, longitude = on_earth(data.latitude_deg, data.longitude_deg)
    known = np.flatnonzero(np.isfinite(latitude) & np.isfinite(longitude))
    if not known.size:
        return None
    origin = float(latitude[known[0]]), float(longitude[known[0]])
    north, east = plan_north_east_m(latitude, longitude, *origin)
    answer = results.answer_meeting(OnTaxi)
    stretches = () if answer is None else answer.taxi_used_s
    time = data.time_s
    used = _used_rows(time, stretches)
    taxi = _taxi_rows(time, stretches, results.rows_of(PhaseSpans))
    on_ground = _extent(north[taxi], east[taxi])
    zoom = on_ground > SMALLEST_TAXI_M and _extent(north, east) > 2.0 * on_ground
    corrected = corrected_position(results)
    ellipses: tuple[Outlines, ...] = ()
    of_ellipses = ""
    if corrected is not None:
        ellipses, of_ellipses = _ellipses(corrected, origin, _extent(north, east), _scale(north, east)[0])
    whole = _map(time, north, east, used, "Whole flight" if zoom else "", ellipses)
    is_polar = is_near_pole(latitude)
    whole, of_shore = _shore(whole, HALF_ASPECTS if zoom else ASPECTS, origin, is_polar=is_polar)
    panels = [whole]
    if zoom:
        panels.append(_map(time[taxi], north[taxi], east[taxi], used[taxi], "Taxi"))
    caption = f"Ring: start ({number(origin[0], 5, '°')}, {number(origin[1], 5, '°')})."
    if answer is not None and used.any():
        caption += f" Green: straight taxi used for {answer.taxi_serves}."
    caption += of_ellipses + of_shore
    if is_polar or _extent(north, east) > LARGEST_OF_ONE_SCALE_M:
        caption += " Scale and north are those at the start."
    alt = "Map of the track in metres north and east of the start."
    rows = (Row(tuple(panels), 72.0 if zoom else 78.0),)
    return Plot("overview.track", "Track", caption, alt, rows, ("overview",))


def _used_rows(time: Floats, stretches: Sequence[tuple[float, float]]) -> Flags:
    used = np.zeros(len(time), dtype=bool)
    for start_s, end_s in stretches:
        used |= (time >= start_s) & (time <= end_s)
    return used


def _taxi_rows(time: Floats, stretches: Sequence[tuple[float, float]], phases: PhaseSpans | None) -> Flags:
    if phases is not None:
        airborne = np.flatnonzero(np.isin(phases.phase, ("take-off run", "airborne")))
        if airborne.size:
            return np.asarray(time < float(phases.start_s[airborne[0]]))
    ends = [end_s for _, end_s in stretches]
    return np.asarray(time <= max(ends)) if ends else np.zeros(len(time), dtype=bool)


def _extent(north: Floats, east: Floats) -> float:
    spans = [np.nanmax(values) - np.nanmin(values) for values in (north, east) if np.isfinite(values).any()]
    return float(max(spans, default=0.0))


def _scale(north: Floats, east: Floats) -> tuple[float, str]:
    """Return the factor and unit of a map."""
    return (1e-3, "km") if _extent(north, east) > LARGEST_IN_METRES else (1.0, "m")


def _ellipses(
    corrected: CorrectedPosition, origin: tuple[float, float], side_m: float, scale: float
) -> tuple[tuple[Outlines, ...], str]:
    """Return 95 % ellipses of the corrected position along the track, and their caption."""
    rows, larger = corrected.drawn_on(side_m)
    north, east = plan_north_east_m(corrected.latitude_deg[rows], corrected.longitude_deg[rows], *origin)
    sigmas = corrected.sigma_north_m[rows], corrected.sigma_east_m[rows]
    middles = np.column_stack([north, east])[:, None, :]
    drawn = scale * (middles + larger * outlines(*sigmas, np.zeros(len(rows)), ELLIPSE_95))
    rings = tuple(one[:, ::-1] for one in drawn)
    words = told_ellipses("Ellipses: 95 % of the corrected position", larger, len(corrected.along()) - len(rows))
    return (Outlines(rings=rings, magnified=larger, role="ins", emphasis="thin", makes_room=False),), f" {words}"


def _map(time: Floats, north: Floats, east: Floats, used: Flags, title: str, behind: tuple[AnyMark, ...] = ()) -> Panel:
    scale, unit = _scale(north, east)
    north, east = north * scale, east * scale
    first = int(np.flatnonzero(np.isfinite(north) & np.isfinite(east))[0])
    marks = (
        *behind,
        Curve(x=east, y=north, role="gnss"),
        Curve(x=np.where(used, east, np.nan), y=np.where(used, north, np.nan), role="answer", emphasis="bold"),
        Told(x=east, y=north, value=time, title="flight time", is_time=True),
        Points(x=east[[first]], y=north[[first]], symbol="ring", role="ink"),
    )
    x, y = Axis(f"east, {unit}"), Axis(f"north, {unit}")
    if _extent(north, east) / scale < SMALLEST_MAP_M:  # scatter of a receiver at rest
        x, y = (
            Axis(axis.title, low=low, high=high)
            for axis, (low, high) in ((x, _at_least(east, first)), (y, _at_least(north, first)))
        )
    return Panel(marks, x, y, title=title, legend="", is_map=True, unit_m=1.0 / scale)


def _shore(
    panel: Panel, aspects: tuple[float, float], origin_deg: tuple[float, float], *, is_polar: bool
) -> tuple[Panel, str]:
    """Return a map with the coast beneath it, its axes as they were, and its caption.

    The map is as it was, its caption empty, without a coast in its frame.
    """
    found = [extent(panel.marks).tolist() for extent in (x_extent, y_extent)]
    ends = [padded(low, high, MARGIN) for low, high in found]
    across, up = (0.5 * panel.unit_m * (high - low) for low, high in ends)
    middle = tuple(0.5 * panel.unit_m * (low + high) for low, high in ends)
    half = max(across, aspects[0] * up), max(up, across / aspects[1])
    shore = coast((middle[0], middle[1]), half, origin_deg, is_polar=is_polar)
    if shore is None:
        return panel, ""
    x, y = (replace(axis, low=low, high=high) for axis, (low, high) in zip((panel.x, panel.y), ends, strict=True))
    marks = (shore.outlines(panel.unit_m), *panel.marks)
    return replace(panel, marks=marks, x=x, y=y), f" {shore.caption}"


def _at_least(values: Floats, first: int) -> tuple[float, float]:
    """Return ends of the axis of a map of an aircraft at rest."""
    half, known = 0.5 * SMALLEST_MAP_M, finite(values)
    return min(float(known.min()), values[first] - half), max(float(known.max()), values[first] + half)


def altitude_name_of(results: FlightResults) -> str:
    """Return the name of the altitude of the overview, with its datum where the run found one."""
    datum = results.metadata.get(ALTITUDE_DATUM, "")
    return {"MSL": "altitude MSL", "ellipsoid": "ellipsoid height"}.get(datum, "altitude")


def profile(results: FlightResults) -> Plot | None:
    """Return altitude and ground speed over time, shaded by phase, above the state of GNSS."""
    data = results.rows_of(Overview)
    if data is None:
        return None
    phases, gnss = results.rows_of(PhaseSpans), results.rows_of(GnssLanes)
    altitude, altitude_name = _first_known(
        (data.altitude_m, altitude_name_of(results)),
        (data.pressure_altitude_m, "pressure altitude"),
        (data.height_above_airfield_m, "height above airfield"),
    )
    speed, speed_name = _first_known((data.ground_speed_mps, "ground speed"), (data.true_airspeed_mps, "true airspeed"))
    listed: tuple[tuple[Floats, str, Role], ...] = (
        (altitude, f"{altitude_name}, m", "ins"),
        (speed, f"{speed_name}, m/s", "gnss"),
    )
    known = [one for one in listed if np.isfinite(one[0]).any()]
    if not known:
        return None
    states = [] if gnss is None else sorted(set(gnss.state.tolist()), key=lambda name: (name != "good", name))
    order, time = tuple(states[:MOST_GNSS_STATES]), time_axis(*span(data.time_s))
    rows: list[Row] = []
    for values, title, role in known:
        marks: list[AnyMark] = [] if phases is None else [_phases(phases)]
        marks.append(Curve(x=data.time_s, y=values, role=role))
        is_last = len(rows) == len(known) - 1
        panel = Panel(marks, time, Axis(title), legend="" if rows else "above")
        rows.append(Row((panel,), 31.0, shares_x=bool(order) or not is_last))
    if order and gnss is not None:
        lanes = Lanes(
            start=gnss.start_s,
            end=gnss.end_s,
            state=gnss.state,
            order=order,
            role="faint",
            roles=lane_roles(order, GNSS_ROLES),
        )
        rows.append(Row((Panel((lanes,), time, legend=""),), LANE_MM * len(order)))
    return Plot(
        "overview.profile",
        "Altitude, speed and phases",
        _phase_caption(phases) + (" Lanes: usability of GNSS." if order else ""),
        "Altitude and speed over flight time with phases shaded.",
        tuple(rows),
        tuple(one.name for one in (data, phases, gnss) if one is not None),
    )


def _phase_caption(phases: PhaseSpans | None) -> str:
    if phases is None:
        return "Nothing tells the phases."
    return "Ground: phase, likely where it is not proven." if phases.likely_share() else "Ground: phase of flight."


def _phases(phases: PhaseSpans) -> Spans:
    return Spans(start=phases.start_s, end=phases.end_s, kind=phases.phase, role="faint", name="phase")


def _first_known(*listed: tuple[Floats | None, str]) -> tuple[Floats, str]:
    """Return the first of some columns that has a value, else the first, and its name."""
    there = [(values, name) for values, name in listed if values is not None]
    return next(((values, name) for values, name in there if np.isfinite(values).any()), there[0])


def attitude(results: FlightResults) -> Plot | None:
    """Return roll, pitch and heading over time, as far as they are known; None where none is."""
    data = results.rows_of(Overview)
    if data is None:
        return None
    heading = _first_known((data.heading_deg, "heading"), (data.magnetic_heading_deg, "magnetic heading"))
    listed = (
        (((data.roll_deg, "roll"), (data.pitch_deg, "pitch")), "attitude, °"),
        ((heading, (data.track_deg, "track")), "direction, °"),
    )
    panels = []
    for curves, unit in listed:
        marks = []
        for (values, name), role in zip(curves, _TWO, strict=True):
            if values is not None and np.isfinite(values).any():
                is_heading = unit != "attitude, °"
                x, y = broken_at_wrap(data.time_s, values) if is_heading else (data.time_s, values)
                marks.append(Curve(x=x, y=y, role=role, name=name))
        if marks:
            panels.append(Panel(marks, time_axis(*span(data.time_s)), Axis(unit)))
    if not panels or not finite(data.time_s).size:
        return None
    rows = tuple(Row((panel,), 30.0, shares_x=panel is not panels[-1]) for panel in panels)
    return Plot("overview.attitude", "Attitude", "", "Roll, pitch and heading over flight time.", rows, ("overview",))


_TWO: tuple[Role, Role] = ("ins", "gnss")


def states(results: FlightResults) -> Plot | None:
    """Return flight modes, arming and ground contact as logged, a row for each state.

    None when the log has none of them.
    """
    data = results.rows_of(StateLanes)
    if data is None:
        return None
    lane, state = data.lane, data.state
    named = np.where(lane == "mode", np.char.add("mode ", state), state)
    shown = ~np.isin(state, ("disarmed", "in the air", ""))  # what is not drawn is the opposite
    modes = list(dict.fromkeys(named[shown & (lane == "mode")].tolist()))
    order = (*dict.fromkeys(named[shown & (lane != "mode")].tolist()), *modes[:MOST_MODES])
    course = results.rows_of(Overview)
    times = finite(data.start_s if course is None else course.time_s, data.start_s, data.end_s)
    if not order or not times.size:
        return None
    lanes = Lanes(
        start=data.start_s[shown],
        end=data.end_s[shown],
        state=named[shown],
        order=order,
        role="ins",
        roles={name: role for name, role in STATE_ROLES.items() if name in order},
    )
    time = time_axis(min(float(times.min()), 0.0), float(times.max()))
    flags = [name for name in dict.fromkeys(lane.tolist()) if name not in ("mode", "arming")]
    caption = "Flight mode and arming as logged"
    caption += f"; ground contact by its {', '.join(flags)}." if flags else "."
    caption += f" {len(modes) - MOST_MODES} more modes in the table." if len(modes) > MOST_MODES else ""
    return Plot(
        "overview.states",
        "Modes and states",
        caption,
        "Strips of flight mode, arming and ground contact over flight time.",
        one_panel(Panel((lanes,), time, legend=""), LANE_MM * len(order)),
        ("state_lanes",),
    )
