"""Figures of the flight at a glance: track map, altitude, speed, phases and the state of GNSS."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from groundstation.base.ellipse import ELLIPSE_95, outlines
from groundstation.base.geodesy import on_earth, plan_north_east_m
from groundstation.chapters.wording import number
from groundstation.plots.ranges import broken_at_wrap, finite
from groundstation.reports import drawing as d
from groundstation.reports import layout
from groundstation.reports.drawing import Drawing
from groundstation.reports.frames import TIME
from groundstation.results.arrays.flight import GnssLanes, Overview, PhaseSpans, StateLanes
from groundstation.results.arrays.typed import Floats
from groundstation.results.corrected_position import CorrectedPosition, corrected_position
from groundstation.results.flight import FlightResults
from groundstation.results.heading import HeadingResult, TaxiSegment

SMALLEST_TAXI_M = 10.0  # less is no taxi worth enlarging: a receiver at rest, or a start by hand
SMALLEST_MAP_M = 2.0  # side of the map of an aircraft that did not move
MOST_MODES = 12
STATE_COLOURS = {"armed": "#b3261e", "on the ground": "#3a86c8"}
GNSS_COLOURS = {"good": d.USED, "integrity lost": "#b3261e", "no GNSS": "#b3261e"}


def track_map(results: FlightResults) -> Drawing | None:
    """The track in local coordinates, with the taxi enlarged and the used stretches marked."""
    data = results.rows_of(Overview)
    if data is None:
        return None
    latitude, longitude = on_earth(data.latitude_deg, data.longitude_deg)
    known = np.flatnonzero(np.isfinite(latitude) & np.isfinite(longitude))
    if not known.size:
        return None
    origin = float(latitude[known[0]]), float(longitude[known[0]])
    north, east = plan_north_east_m(latitude, longitude, *origin)
    answer = results.answer(HeadingResult)
    segments = () if answer is None else answer.segments
    time = data.time_s
    used = _used_rows(time, segments)
    taxi = _taxi_rows(time, segments, results.rows_of(PhaseSpans))
    on_ground = _extent(north[taxi], east[taxi])
    zoom = on_ground > SMALLEST_TAXI_M and _extent(north, east) > 2.0 * on_ground

    corrected = corrected_position(results)
    larger = 1 if corrected is None else corrected.larger(_extent(north, east))

    def paint(figure: Any) -> None:
        right, top = (86.0, 84.0) if zoom else (174.0, 90.0)
        axes = layout.place(figure, 16, 12, right, top)
        if corrected is not None:
            _ellipses(axes, corrected, origin, larger, _scale(north, east)[0])
        _map(axes, time, north, east, used, "Whole flight" if zoom else "")
        if zoom:
            _map(layout.place(figure, 104, 12, 174, 84), time[taxi], north[taxi], east[taxi], used[taxi], "Taxi")

    start = f"{number(origin[0], 5, '°')}, {number(origin[1], 5, '°')}"
    caption = f"Ring: start ({start})."
    if used.any():
        caption += " Green: straight taxi used for the heading error."
    if corrected is not None:
        size = f", drawn {number(larger, 0)} times their size" if larger > 1 else ""
        caption += f" Ellipses: 95 % of the corrected position{size}."
    alt = "Map of the track in metres north and east of the start."
    return Drawing("Track", caption, alt, d.draw("map", 92, paint), ("overview",))


def _used_rows(time: Any, segments: Sequence[TaxiSegment]) -> Any:
    used = np.zeros(len(time), dtype=bool)
    for segment in segments:
        used |= (time >= segment.start_s) & (time <= segment.end_s)
    return used


def _taxi_rows(time: Any, segments: Sequence[TaxiSegment], phases: PhaseSpans | None) -> Any:
    if phases is not None:
        airborne = np.flatnonzero(np.isin(phases.phase, ("take-off run", "airborne")))
        if airborne.size:
            return time < float(phases.start_s[airborne[0]])
    ends = [segment.end_s for segment in segments]
    return time <= max(ends) if ends else np.zeros(len(time), dtype=bool)


def _extent(north: Any, east: Any) -> float:
    spans = [np.nanmax(values) - np.nanmin(values) for values in (north, east) if np.isfinite(values).any()]
    return float(max(spans, default=0.0))


def _scale(north: Any, east: Any) -> tuple[float, str]:
    """Factor and unit of a map."""
    return (1e-3, "km") if _extent(north, east) > 3000.0 else (1.0, "m")


def _ellipses(axes: Any, corrected: CorrectedPosition, origin: tuple[float, float], larger: int, scale: float) -> None:
    """95 % ellipses of the corrected position along the track."""
    rows = corrected.along()
    north, east = plan_north_east_m(corrected.latitude_deg[rows], corrected.longitude_deg[rows], *origin)
    sigmas = corrected.sigma_north_m[rows], corrected.sigma_east_m[rows]
    for middle, outline in zip(
        np.column_stack([north, east]), outlines(*sigmas, np.zeros(len(rows)), ELLIPSE_95), strict=True
    ):
        drawn = scale * (middle + larger * outline)
        d.line(axes, drawn[:, 1], drawn[:, 0], d.INS, 0.8)


def _map(axes: Any, time: Any, north: Any, east: Any, used: Any, title: str) -> None:
    scale, unit = _scale(north, east)
    north, east = north * scale, east * scale
    axes.set_aspect("equal", adjustable="datalim")
    d.line(axes, east, north, d.GNSS, 0.9)
    d.line(axes, np.where(used, east, np.nan), np.where(used, north, np.nan), d.USED, 2.4, solid_capstyle="round")
    d.tell(axes, east, north, time, TIME)
    first = int(np.flatnonzero(np.isfinite(north) & np.isfinite(east))[0])
    axes.plot(
        [east[first]], [north[first]], "o", color=d.INK, markersize=5, markerfacecolor="white", markeredgewidth=1.2
    )
    if _extent(north, east) / scale < SMALLEST_MAP_M:  # scatter of a receiver at rest
        half = 0.5 * SMALLEST_MAP_M
        axes.update_datalim([(east[first] - half, north[first] - half), (east[first] + half, north[first] + half)])
        axes.autoscale_view()
    axes.set_xlabel(f"east, {unit}")
    axes.set_ylabel(f"north, {unit}")
    axes.set_title(title)


def profile(results: FlightResults) -> Drawing | None:
    """Altitude and ground speed over time, shaded by phase, above the state of GNSS."""
    data = results.rows_of(Overview)
    if data is None:
        return None
    phases, gnss = results.rows_of(PhaseSpans), results.rows_of(GnssLanes)
    time = data.time_s
    altitude, altitude_name = _first_known(
        (data.altitude_m, "altitude"),
        (data.pressure_altitude_m, "pressure altitude"),
        (data.height_above_airfield_m, "height above airfield"),
    )
    speed, speed_name = _first_known((data.ground_speed_mps, "ground speed"), (data.true_airspeed_mps, "true airspeed"))
    times = finite(time)
    low, high = (float(times.min()), float(times.max())) if times.size else (0.0, 1.0)
    states = [] if gnss is None else sorted(set(gnss.state.tolist()), key=lambda name: (name != "good", name))[:8]
    lane_mm = 4.6 * len(states) + (3.0 if states else 0.0)

    panels = [
        panel
        for panel in (
            (altitude, f"{altitude_name}, m", d.INS),
            (speed, f"{speed_name}, m/s", d.GNSS),
        )
        if np.isfinite(panel[0]).any()
    ]
    if not panels:
        return None

    def paint(figure: Any) -> None:
        base = 12.0 + lane_mm
        places = [layout.place(figure, 30, base + 35 * row, 174, base + 35 * row + 31) for row in range(len(panels))]
        for axes, (values, text, colour) in zip(reversed(places), panels, strict=True):
            if phases is not None:
                d.spans(axes, phases.start_s, phases.end_s, phases.phase, d.PHASE_COLOURS)
            d.line(axes, time, values, colour, 1.0)
            axes.set_ylabel(text)
            layout.time_axis(axes, low, high, title=axes is places[0] and not states)
        layout.legend_above(places[-1])
        if states and gnss is not None:
            strip = layout.place(figure, 30, 12, 174, 9 + lane_mm)
            d.lanes(strip, gnss.start_s, gnss.end_s, gnss.state, states, GNSS_COLOURS)
            layout.time_axis(strip, low, high)

    names = tuple(one.name for one in (data, phases, gnss) if one is not None)
    caption = "Ground: phase of flight." + (" Lanes: usability of GNSS." if states else "")
    alt = "Altitude and speed over flight time with phases shaded."
    return Drawing(
        "Altitude, speed and phases", caption, alt, d.draw("profile", 16 + lane_mm + 35 * len(panels), paint), names
    )


def _first_known(*listed: tuple[Floats | None, str]) -> tuple[Floats, str]:
    """The first of some columns that has a value, else the first, and its name."""
    there = [(values, name) for values, name in listed if values is not None]
    return next(((values, name) for values, name in there if np.isfinite(values).any()), there[0])


def attitude(results: FlightResults) -> Drawing | None:
    """Roll, pitch and heading over time, as far as they are known; None where none is."""
    data = results.rows_of(Overview)
    if data is None:
        return None
    heading = _first_known((data.heading_deg, "heading"), (data.magnetic_heading_deg, "magnetic heading"))
    listed = (
        (((data.roll_deg, "roll"), (data.pitch_deg, "pitch")), "attitude, °"),
        (
            (heading, (data.track_deg, "track")),
            "direction, °",
        ),
    )
    panels = [
        (curves, unit)
        for curves, unit in listed
        if any(values is not None and np.isfinite(values).any() for values, _ in curves)
    ]
    times = finite(data.time_s)
    if not panels or not times.size:
        return None
    height = 14.0 + 36.0 * len(panels)

    def paint(figure: Any) -> None:
        for place, (curves, unit) in enumerate(reversed(panels)):
            axes = layout.place(figure, 30, 12 + 36 * place, 174, 42 + 36 * place)
            for (values, name), colour in zip(curves, (d.INS, d.GNSS), strict=True):
                if values is not None and np.isfinite(values).any():
                    shown = values if name in ("roll", "pitch") else broken_at_wrap(values)
                    d.line(axes, data.time_s, shown, colour, 0.9, label=name)
            axes.set_ylabel(unit)
            layout.time_axis(axes, float(times.min()), float(times.max()), title=place == 0)
            layout.legend_above(axes)

    alt = "Roll, pitch and heading over flight time."
    return Drawing("Attitude", "", alt, d.draw("attitude", height, paint), ("overview",))


def states(results: FlightResults) -> Drawing | None:
    """Flight modes, arming and ground contact as the log tells them, a row for each state; None when it tells none."""
    data = results.rows_of(StateLanes)
    if data is None:
        return None
    lane, state = data.lane, data.state
    start, end = data.start_s, data.end_s
    named = np.where(lane == "mode", np.char.add("mode ", state), state)
    shown = ~np.isin(state, ("disarmed", "in the air", ""))  # what is not drawn is the opposite
    modes = list(dict.fromkeys(named[shown & (lane == "mode")].tolist()))
    rows = [*dict.fromkeys(named[shown & (lane != "mode")].tolist()), *modes[:MOST_MODES]]
    course = results.rows_of(Overview)
    times = finite(start if course is None else course.time_s, start, end)
    if not rows or not times.size:
        return None
    height = 14.0 + 4.6 * len(rows)
    colours = dict.fromkeys(rows, d.INS) | STATE_COLOURS

    def paint(figure: Any) -> None:
        axes = layout.place(figure, 44, 12, 174, height - 2)
        d.lanes(axes, start[shown], end[shown], named[shown], rows, colours)
        layout.time_axis(axes, min(float(times.min()), 0.0), float(times.max()))

    flags = [name for name in dict.fromkeys(lane.tolist()) if name not in ("mode", "arming")]
    caption = "Flight mode and arming as logged"
    caption += f"; ground contact by its {', '.join(flags)}." if flags else "."
    caption += f" {len(modes) - MOST_MODES} more modes in the table." if len(modes) > MOST_MODES else ""
    alt = "Strips of flight mode, arming and ground contact over flight time."
    return Drawing("Modes and states", caption, alt, d.draw("states", height, paint), ("state_lanes",))
