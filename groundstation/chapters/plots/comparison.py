"""Plots of a comparison: curves of two flights over each other."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, Generic, Protocol

import numpy as np

from groundstation.base.geodesy import north_east_m, on_earth, plan_north_east_m
from groundstation.base.normal import NORMAL_95
from groundstation.chapters.plots.common import M_PER_KM, has_values, label, positive
from groundstation.plots.axes import time_axis
from groundstation.plots.marks import AnyMark, Band, Curve, Dash, Emphasis, Floats, Lanes, Role, Told
from groundstation.plots.plot import Axis, Panel, Plot, Row, one_panel
from groundstation.plots.ranges import broken_at_gaps, broken_at_wrap, finite, padded
from groundstation.results.arrays.cooperative import SessionErrors
from groundstation.results.arrays.flight import Overview, PhaseSpans
from groundstation.results.arrays.typed import T
from groundstation.results.comparison import Comparison
from groundstation.results.files import SavedFlight
from groundstation.systems.heading.arrays import HeadingRunning, HeadingSamples
from groundstation.systems.inertial.arrays import InertialStates, InertialTrack
from groundstation.systems.inertial.forecast_answer import ForecastResult
from groundstation.systems.inertial.forecast_arrays import ForecastGrowth
from groundstation.systems.inertial.forecast_chapter import short

NEAR_M = 200_000.0  # flights that begin no further apart share one map
LANE_MM = 4.0


class HasRows(Protocol):
    """A flight with its arrays."""

    def rows_of(self, kind: type[T]) -> T | None:
        """Return the typed arrays of a figure, None when the flight has none."""


@dataclass(frozen=True)
class Side:
    """One of two flights: its letter, its forecast method, and its start.

    The letter is A or B, the start is in seconds after that of A.
    """

    letter: str
    flight: HasRows
    default_method: str = ""
    offset_s: float = 0.0

    @property
    def role(self) -> Role:
        """Role of its lines."""
        return "ins" if self.letter == "A" else "gnss"

    @property
    def emphasis(self) -> Emphasis:
        """Emphasis of its lines: A is bold, so that it is seen behind B where both agree."""
        return "bold" if self.letter == "A" else "usual"


def sides_of(comparison: Comparison, a: SavedFlight, b: SavedFlight) -> tuple[Side, Side]:
    """Both flights as plots take them."""
    methods = (_default_method(one.results.answer(ForecastResult)) for one in (a, b))
    return Side("A", a, next(methods)), Side("B", b, next(methods), comparison.alignment.offset_s)


def _default_method(forecast: ForecastResult | None) -> str:
    return "" if forecast is None else forecast.default_method


@dataclass(frozen=True)
class TimeLine:
    """Curve of a flight over its time, with half of its 95 % band.

    The half is None where there is no band.
    """

    time_s: Floats
    values: Floats | None
    half: Floats | None = None


class Overlay(Generic[T]):
    """Curve that both flights have: its figure, its columns, its axis and title."""

    def __init__(self, kind: type[T], key: str, read: Callable[[T], TimeLine], axis: str, title: str) -> None:
        self.name, self.axis, self.title = f"{kind.figure}-{key}", axis, title
        self._kind, self._read = kind, read

    def of(self, flight: HasRows) -> TimeLine | None:
        """Return the line of a flight, None where it has no number."""
        rows = flight.rows_of(self._kind)
        line = None if rows is None else self._read(rows)
        return line if line is not None and has_values(line.values) else None


def _altitude(data: Overview) -> TimeLine:
    return TimeLine(data.time_s, data.altitude_m)


def _pressure_altitude(data: Overview) -> TimeLine:
    return TimeLine(data.time_s, data.pressure_altitude_m)


def _speed(data: Overview) -> TimeLine:
    return TimeLine(data.time_s, data.ground_speed_mps)


def _heading(data: Overview) -> TimeLine:
    return TimeLine(*broken_at_wrap(data.time_s, data.heading_deg))


def _mean(data: HeadingRunning) -> TimeLine:
    return TimeLine(data.time_s, data.mean_deg, data.honest_half_width_deg)


def _speed_at_samples(data: HeadingSamples) -> TimeLine:
    return TimeLine(data.time_s, data.ground_speed_mps)


def _radial(data: InertialTrack) -> TimeLine:
    return TimeLine(data.time_s, data.ins_error_m)


def _north(data: InertialStates) -> TimeLine:
    return TimeLine(data.time_s, data.north.position_m, NORMAL_95 * data.north.position_sigma_m)


def _east(data: InertialStates) -> TimeLine:
    return TimeLine(data.time_s, data.east.position_m, NORMAL_95 * data.east.position_sigma_m)


def _north_velocity(data: InertialStates) -> TimeLine:
    return TimeLine(data.time_s, data.north.velocity_mps, NORMAL_95 * data.north.velocity_sigma_mps)


def _east_velocity(data: InertialStates) -> TimeLine:
    return TimeLine(data.time_s, data.east.velocity_mps, NORMAL_95 * data.east.velocity_sigma_mps)


def _computed(data: SessionErrors) -> TimeLine:
    return TimeLine(data.time_s, data.two_sigma_r_m)


def _error(data: SessionErrors) -> TimeLine:
    return TimeLine(data.time_s, data.rms_error_m)


OVERLAYS: tuple[Overlay[Any], ...] = (
    Overlay(Overview, "altitude_m", _altitude, "altitude, m", "Altitude"),
    Overlay(Overview, "pressure_altitude_m", _pressure_altitude, "pressure altitude, m", "Pressure altitude"),
    Overlay(Overview, "ground_speed_mps", _speed, "ground speed, m/s", "Ground speed"),
    Overlay(Overview, "heading_deg", _heading, "true heading, °", "INS heading"),
    Overlay(HeadingRunning, "mean_deg", _mean, "mean heading error, °", "Heading error, running mean"),
    Overlay(
        HeadingSamples,
        "ground_speed_mps",
        _speed_at_samples,
        "speed at the samples, m/s",
        "Ground speed at the samples",
    ),
    Overlay(InertialTrack, "ins_error_m", _radial, "radial error, m", "Radial error of the INS against GNSS"),
    Overlay(InertialStates, "north_position_m", _north, "north position error, m", "North position error"),
    Overlay(InertialStates, "east_position_m", _east, "east position error, m", "East position error"),
    Overlay(InertialStates, "north_velocity_mps", _north_velocity, "north velocity error, m/s", "North velocity error"),
    Overlay(InertialStates, "east_velocity_mps", _east_velocity, "east velocity error, m/s", "East velocity error"),
    Overlay(SessionErrors, "two_sigma_r_m", _computed, "2σ_r as computed, m", "2σ_r as computed, worst aircraft"),
    Overlay(
        SessionErrors, "rms_error_m", _error, "RMS error, m", "Horizontal error against the truth, RMS of all aircraft"
    ),
)


def tracks(sides: Sequence[Side]) -> Plot | None:
    """Return the tracks of both flights on one map.

    Each from its own origin where they are far from each other.
    """
    drawn = []
    for side in sides:
        data = side.flight.rows_of(Overview)
        if data is not None:
            latitude, longitude = on_earth(data.latitude_deg, data.longitude_deg)
            known = np.flatnonzero(np.isfinite(latitude))
            if known.size:
                first = float(latitude[known[0]]), float(longitude[known[0]])
                drawn.append((side, data.time_s, latitude, longitude, first))
    if not drawn:
        return None
    shared = drawn[0][-1]
    is_shared = bool(np.hypot(*north_east_m(*drawn[-1][-1], *shared)) <= NEAR_M)
    lines: list[AnyMark] = []
    times: list[AnyMark] = []
    for side, time_s, latitude, longitude, own in drawn:
        north, east = plan_north_east_m(latitude, longitude, *(shared if is_shared else own))
        x, y = east / M_PER_KM, north / M_PER_KM
        lines.append(Curve(x=x, y=y, role=side.role, name=side.letter, emphasis=side.emphasis))
        time_s = time_s + side.offset_s
        times.append(Told(x=x, y=y, value=time_s, title=f"{side.letter}, flight time", is_time=True, role=side.role))
    origin = "the first position of A" if is_shared else "the first position of each"
    return Plot(
        "comparison.tracks",
        "Tracks",
        f"Distances north and east of {origin}, equal scales.",
        "Map of the tracks of A and B.",
        one_panel(Panel((*lines, *times), Axis("east, km"), Axis("north, km"), is_map=True), 84.0),
    )


def overlay(sides: Sequence[Side], told: Overlay[Any]) -> Plot | None:
    """Return a line of both flights over the flight time of A, with its band."""
    drawn = [(side, line) for side in sides if (line := told.of(side.flight)) is not None]
    if not drawn:
        return None
    bands: list[AnyMark] = []
    lines: list[AnyMark] = []
    times, shown = [], []
    for side, line in drawn:
        unknown = np.full(len(line.time_s), np.nan)
        known = (unknown if one is None else one for one in (line.values, line.half))
        time, values, half = broken_at_gaps(line.time_s + side.offset_s, *known)
        if line.half is not None:
            low, high = values - half, values + half
            bands.append(Band(x=time, low=low, high=high, role=side.role, name="95 %"))
            shown += [low, high]
        lines.append(Curve(x=time, y=values, role=side.role, name=side.letter, emphasis=side.emphasis))
        times.append(time)
        shown.append(values)
    has_band = any(line.half is not None for _, line in drawn)
    # The bands of the first samples may leave the picture.
    least, most = np.percentile(finite(*shown), (0.5, 99.5) if has_band else (0.0, 100.0)).tolist()
    ends, every = padded(least, most), finite(*times)
    x = time_axis(float(every.min()), float(every.max()))
    title = told.title
    return Plot(
        f"comparison.{told.name}",
        title,
        f"{title} of both flights." if len(drawn) == len(sides) else f"{title}: only {drawn[0][0].letter} has it.",
        f"{title} of A and B over flight time.",
        one_panel(Panel((*bands, *lines), x, Axis(told.axis, low=ends[0], high=ends[1])), 42.0),
    )


def phases(sides: Sequence[Side]) -> Plot | None:
    """Phases of both flights in lanes under each other, over the flight time of A."""
    drawn = [(side, rows) for side in sides if (rows := side.flight.rows_of(PhaseSpans)) is not None and len(rows)]
    if not drawn:
        return None
    order = tuple(dict.fromkeys(phase for _, rows in drawn for phase in rows.phase.tolist()))
    every = finite(*(ends + side.offset_s for side, rows in drawn for ends in (rows.start_s, rows.end_s)))
    x = time_axis(float(every.min()), float(every.max()))
    panels = []
    for side, rows in drawn:
        ends = rows.start_s + side.offset_s, rows.end_s + side.offset_s
        lanes = Lanes(start=ends[0], end=ends[1], state=rows.phase, order=order, role=side.role)
        panels.append(Panel((lanes,), x, title=side.letter, legend=""))
    last = len(panels) - 1
    return Plot(
        "comparison.phases",
        "Flight phase",
        "Phases of both flights over the flight time of A.",
        "Lanes of the flight phases of A and B over flight time.",
        tuple(Row((panel,), LANE_MM * len(order), shares_x=place < last) for place, panel in enumerate(panels)),
    )


def growth(sides: Sequence[Side]) -> Plot | None:
    """Return the RMS of the forecast by horizon, the shipped method and the INS without one."""
    marks = []
    for side in sides:
        data = side.flight.rows_of(ForecastGrowth)
        for method in (side.default_method, "raw_ins"):
            rms_m = None if data is None else data.rms_m.get(method)
            if data is None or rms_m is None or not has_values(rms_m):
                continue
            name = f"{side.letter}: {label(short(method))}"
            is_raw = method == "raw_ins"
            dash: Dash = "dotted" if is_raw else ""
            heavy: Emphasis = "thin" if is_raw else side.emphasis
            x, y = data.horizon_min, positive(rms_m)
            marks.append(Curve(x=x, y=y, role=side.role, name=name, dash=dash, emphasis=heavy))
    if not marks:
        return None
    return Plot(
        "comparison.growth",
        "Forecast",
        "Root mean square of the radial error over all replayed starts; dotted: the INS without a forecast.",
        "RMS of the forecast error of A and B by horizon.",
        one_panel(Panel(marks, Axis("horizon, min", "log"), Axis("RMS radial error, m", "log")), 52.0),
    )


COMPARED: dict[str, Callable[[Sequence[Side]], Plot | None]] = {
    "tracks": tracks,
    "phases": phases,
    **{one.name: partial(overlay, told=one) for one in OVERLAYS},
    "growth": growth,
}
