"""Plots of a comparison: curves of two flights over each other."""

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any, Generic, NamedTuple

import numpy as np

from groundstation.base.angles import wrap_180
from groundstation.base.dataclasses import dataclass
from groundstation.base.geodesy import north_east_m, on_earth, plan_north_east_m
from groundstation.chapters.plots.common import M_PER_KM, has_values
from groundstation.plots.axes import time_axis
from groundstation.plots.marks import AnyMark, Band, Curve, Emphasis, Floats, Lanes, Limit, Role, Told
from groundstation.plots.plot import Axis, Panel, Plot, Row, one_panel
from groundstation.plots.ranges import broken_at_gaps, broken_at_wrap, finite, padded
from groundstation.results.arrays.flight import Overview, PhaseSpans
from groundstation.results.arrays.typed import T
from groundstation.results.comparison import Comparison
from groundstation.results.files import SavedFlight

NEAR_M = 200_000.0  # flights that begin no further apart share one map
LANE_MM = 4.0
GAP_STEPS = 10.0  # usual intervals over which no difference is told


@dataclass(frozen=True)
class PlottedSide:
    """One of two flights: its letter, A or B, and its start in seconds after that of A."""

    letter: str
    flight: SavedFlight
    offset_s: float = 0.0

    @property
    def role(self) -> Role:
        """Role of its lines."""
        return "ins" if self.letter == "A" else "gnss"

    @property
    def emphasis(self) -> Emphasis:
        """Emphasis of its lines: A is bold, so that it is seen behind B where both agree."""
        return "bold" if self.letter == "A" else "usual"


def sides_of(comparison: Comparison, a: SavedFlight, b: SavedFlight) -> tuple[PlottedSide, PlottedSide]:
    """Both flights as plots take them."""
    return PlottedSide("A", a), PlottedSide("B", b, comparison.alignment.offset_s)


Tell = Callable[[Sequence[PlottedSide]], Plot | None]  # describes a figure of both flights, None where neither has it


class Compared(NamedTuple):
    """Figures of a system in a comparison, by name in the order of the page.

    ``rows`` are those of its tab in the recording, ``name`` and ``title``: names of figures, side by side.
    """

    name: str
    title: str
    figures: Mapping[str, Tell]
    rows: tuple[tuple[str, ...], ...]


@dataclass(frozen=True)
class TimeLine:
    """Curve of a flight over its time, with half of its 95 % band.

    The half is None where there is no band.
    """

    time_s: Floats
    values: Floats | None
    half: Floats | None = None


class Overlay(Generic[T]):
    """Curve that both flights have: its figure, its columns, its axis and title.

    ``rows`` gives the columns of a flight where they are made of others.
    """

    def __init__(
        self,
        kind: type[T],
        key: str,
        read: Callable[[T], TimeLine],
        axis: str,
        title: str,
        rows: Callable[[SavedFlight], T | None] | None = None,
    ) -> None:
        self.name, self.axis, self.title = f"{kind.figure}-{key}", axis, title
        self._kind, self._read, self._rows = kind, read, rows

    def of(self, flight: SavedFlight) -> TimeLine | None:
        """Return the line of a flight, None where it has no number."""
        rows = flight.rows_of(self._kind) if self._rows is None else self._rows(flight)
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


def tracks(sides: Sequence[PlottedSide]) -> Plot | None:
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


def overlay(sides: Sequence[PlottedSide], told: Overlay[Any]) -> Plot | None:
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


def difference(sides: Sequence[PlottedSide], told: Overlay[Any]) -> Plot | None:
    """Return B less A of a line, with its band.

    None unless both have it at the same time.
    """
    drawn = [(side, line) for side in sides if (line := told.of(side.flight)) is not None]
    if len(drawn) < 2:
        return None
    (a, one), (b, other) = drawn
    if one.values is None:
        return None
    time, theirs = one.time_s + a.offset_s, other.time_s + b.offset_s
    is_angle = told.name.endswith("heading_deg")
    change = _held(theirs, other.values, time, is_angle=is_angle) - one.values
    change = wrap_180(change) if is_angle else change
    if not has_values(change):
        return None
    marks: list[AnyMark] = [Limit(value=0.0, role="faint", dash="dotted", emphasis="faint")]
    half = None
    if one.half is not None and other.half is not None:
        half = np.hypot(one.half, _held(theirs, other.half, time))
    x, change, half = broken_at_gaps(time, change, np.full(len(time), np.nan) if half is None else half)
    if np.isfinite(half).any():
        marks.append(Band(x=x, low=change - half, high=change + half, role="answer", name="95 %, as if independent"))
    marks.append(Curve(x=x, y=change, role="answer", name="B − A"))
    known = np.isfinite(change)
    ends = padded(*np.percentile(change[known], (0.5, 99.5)).tolist())
    return Plot(
        f"comparison.{told.name}-difference",
        f"{told.title}, B − A",
        f"{told.title}: B less A at the same time of A.",
        f"{told.title}, B less A, over flight time.",
        one_panel(
            Panel(
                tuple(marks),
                time_axis(float(x[known].min()), float(x[known].max())),
                Axis(f"B − A, {told.axis.rpartition(', ')[2]}", low=ends[0], high=ends[1]),
            ),
            30.0,
        ),
    )


def _held(time: Floats, values: Floats | None, at: Floats, *, is_angle: bool = False) -> Floats:
    """Interpolate values at times, NaN outside them and in their gaps."""
    known = np.flatnonzero(np.isfinite(values)) if values is not None else np.zeros(0, np.intp)
    if values is None or len(known) < 2:
        return np.full(len(at), np.nan)
    time, values = time[known], values[known]
    values = np.unwrap(values, period=360.0) if is_angle else values
    found = np.interp(at, time, values, left=np.nan, right=np.nan)
    steps = np.diff(time)
    after = np.clip(np.searchsorted(time, at), 1, len(time) - 1)
    found[steps[after - 1] > GAP_STEPS * max(float(np.median(steps)), 1e-3)] = np.nan
    return np.asarray(found)


def phases(sides: Sequence[PlottedSide]) -> Plot | None:
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


def overlaid(*overlays: Overlay[Any]) -> dict[str, Tell]:
    """Return the figures of some curves, by name, each with that of the difference behind it."""
    found: dict[str, Tell] = {}
    for one in overlays:
        found[one.name] = partial(overlay, told=one)
        found[f"{one.name}-difference"] = partial(difference, told=one)
    return found


COMPARED: dict[str, Tell] = {  # of all flights
    "tracks": tracks,
    "phases": phases,
    **overlaid(
        Overlay(Overview, "altitude_m", _altitude, "altitude, m", "Altitude"),
        Overlay(Overview, "pressure_altitude_m", _pressure_altitude, "pressure altitude, m", "Pressure altitude"),
        Overlay(Overview, "ground_speed_mps", _speed, "ground speed, m/s", "Ground speed"),
        Overlay(Overview, "heading_deg", _heading, "true heading, °", "INS heading"),
    ),
}
