"""Channels of configuration, thrust, wind, attitude and height about an approach."""

from typing import TYPE_CHECKING

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.dataclasses import dataclass
from groundstation.systems.landing.criteria_answer import REVERSED
from groundstation.systems.landing.path import FlightPath
from groundstation.tables.resample import join, values_at
from groundstation.tables.sources import sources_of_kind

if TYPE_CHECKING:
    from groundstation.tables.table import Flight

LONGEST_HOLD_S = 10.0  # a switch or a flap is logged as seldom as every 4 s
LARGEST_GAP_S = 10.0  # between samples of the wind
SLOW_MPS = 10.0  # no aeroplane flies so slowly
FEWEST_ON_GROUND = 10
GEAR = ("gear_down", "gear_nose_down", "gear_left_down", "gear_right_down")
THRUST = ("n1_share", "power_share", "throttle_share")


@dataclass(frozen=True, eq=False)
class Series:
    """Samples of one quantity at their own times, by what they are logged; none: not logged."""

    time_s: FloatArray
    values: FloatArray
    logged_by: str = ""

    def at(self, time_s: float, longest_s: float = 3.0) -> float | None:
        """The value at a time, between samples no farther apart than ``longest_s``."""
        after = int(np.searchsorted(self.time_s, time_s))
        if after == 0 or after == len(self.time_s):
            near = min(after, len(self.time_s) - 1)
            is_near = len(self.time_s) > 0 and abs(self.time_s[near] - time_s) <= 0.5 * longest_s
            return float(self.values[near]) if is_near else None
        if self.time_s[after] - self.time_s[after - 1] > longest_s:
            return None
        return float(np.interp(time_s, self.time_s, self.values))

    def between(self, first_s: float, last_s: float) -> "Series":
        """The samples of a stretch of time."""
        rows = (self.time_s >= first_s) & (self.time_s <= last_s)
        return Series(self.time_s[rows], self.values[rows], self.logged_by)

    def __len__(self) -> int:
        return len(self.time_s)


@dataclass(frozen=True, eq=False, kw_only=True)
class Logged:
    """Channels of a flight beside its path; arrays of the times of the path, shape (n,).

    ``flap_deg`` and ``gear_share`` (1: every leg down) hold the last sample; NaN where not known. ``thrust_share`` is
    the lowest of the engines. ``tells`` names what a whole flight shows of a channel that is no use: "never moved".
    """

    flap_deg: FloatArray
    gear_share: FloatArray
    thrust_share: FloatArray
    wind_north_mps: FloatArray
    wind_east_mps: FloatArray
    wind_is_derived: bool
    indicated_mps: FloatArray
    pitch: Series
    roll: Series
    radio: Series
    sources: dict[str, str]
    tells: dict[str, str]


def logged_of(flight: "Flight", path: FlightPath) -> Logged:
    """Gather the channels; what a log lacks is all NaN, or a series without samples."""
    sources: dict[str, str] = {}
    tells: dict[str, str] = {}
    flap = _held(flight, path, "configuration", ("flap_deg",), sources, "flap")
    gear = _held(flight, path, "configuration", GEAR, sources, "gear")
    for name, values in (("flap", flap), ("gear", gear)):
        known = values[np.isfinite(values)]
        if known.size and np.ptp(known) == 0.0:
            tells[name] = "never moved in this log"
    gear_share = np.min(gear, axis=1)
    if _is_reversed(gear, _on_ground(flight, path)):
        gear_share = np.min(1.0 - gear, axis=1)
        tells["gear"] = REVERSED
    north, east, is_derived = _wind(flight, path, sources)
    indicated = next(iter(_topics(flight, "air", "indicated_airspeed_mps")), "")
    if indicated:
        sources["indicated"] = f"{indicated}.indicated_airspeed_mps"
    return Logged(
        flap_deg=flap[:, 0],
        gear_share=gear_share,
        thrust_share=_thrust(flight, path, sources),
        wind_north_mps=north,
        wind_east_mps=east,
        wind_is_derived=is_derived,
        indicated_mps=_at(flight, path, indicated, "indicated_airspeed_mps"),
        pitch=series_of(flight, "ins", "pitch_deg"),
        roll=series_of(flight, "ins", "roll_deg"),
        radio=series_of(flight, "radio_altimeter", "height_m"),
        sources=sources,
        tells=tells,
    )


def series_of(flight: "Flight", kind: str, name: str) -> Series:
    """Samples of a field of the first topic that has it; of radio altimeters those of all."""
    topics = _topics(flight, kind, name)
    if not topics:
        return Series(np.zeros(0), np.zeros(0))
    used = topics if kind == "radio_altimeter" else topics[:1]
    times = np.concatenate([flight.time_s(topic) for topic in used])
    values = np.concatenate([flight[topic].values(name) for topic in used])
    rows = np.flatnonzero(np.isfinite(values))
    rows = rows[np.argsort(times[rows], kind="stable")]
    return Series(times[rows], values[rows], " and ".join(f"{topic}.{name}" for topic in used))


def _topics(flight: "Flight", kind: str, *names: str) -> tuple[str, ...]:
    return tuple(topic for topic in sources_of_kind(flight, kind) if flight[topic].has(*names))


def _at(flight: "Flight", path: FlightPath, topic: str, name: str) -> FloatArray:
    if not topic:
        return np.full(len(path.time_ns), np.nan)
    return values_at(flight[topic], name, path.time_ns, largest_gap_s=LARGEST_GAP_S)


def _held(
    flight: "Flight", path: FlightPath, kind: str, names: tuple[str, ...], sources: dict[str, str], what: str
) -> FloatArray:
    """Fields of one kind, each held from sample to sample, shape (n, those logged or 1)."""
    found = [(topic, name) for topic in sources_of_kind(flight, kind) for name in names if flight[topic].has(name)]
    if not found:
        return np.full((len(path.time_ns), 1), np.nan)
    sources[what] = ", ".join(f"{topic}.{name}" for topic, name in found)
    columns = []
    for topic, name in found:
        table = flight[topic]
        known = table.take(table.valid(name))
        before = np.searchsorted(known.time_ns, path.time_ns, side="right") - 1
        values = known.values(name)[np.maximum(before, 0)]
        is_fresh = (before >= 0) & (path.time_ns - known.time_ns[np.maximum(before, 0)] <= LONGEST_HOLD_S * 1e9)
        columns.append(np.where(is_fresh, values, np.nan))
    return np.stack(columns, axis=1)


def _on_ground(flight: "Flight", path: FlightPath) -> "np.ndarray":
    """Return the rows that stand or roll, by weight on wheels, else by their speed."""
    known: dict[str, str] = {}
    wheels = _held(flight, path, "discrete", ("weight_on_wheels",), known, "wheels")
    return np.asarray(wheels[:, 0] > 0.5 if known else path.ground_speed_mps < SLOW_MPS)


def _is_reversed(gear: FloatArray, on_ground: "np.ndarray") -> bool:
    """Tell whether every leg reads down in flight alone, and never on the wheels."""
    standing, flying = gear[on_ground & np.isfinite(gear).all(axis=1)], gear[~on_ground & np.isfinite(gear).all(axis=1)]
    if len(standing) < FEWEST_ON_GROUND or not len(flying):
        return False
    return bool((np.mean(standing, axis=0) < 0.05).all() and (np.max(flying, axis=0) == 1.0).all())


def _thrust(flight: "Flight", path: FlightPath, sources: dict[str, str]) -> FloatArray:
    """Return the lowest thrust of the engines, by the best of the measures that they log."""
    for name in THRUST:
        topics = _topics(flight, "engine", name)
        if topics:
            sources["thrust"] = ", ".join(f"{topic}.{name}" for topic in topics)
            return np.asarray(np.min([_at(flight, path, topic, name) for topic in topics], axis=0))
    return np.full(len(path.time_ns), np.nan)


def _wind(flight: "Flight", path: FlightPath, sources: dict[str, str]) -> tuple[FloatArray, FloatArray, bool]:
    """Return the wind as logged, else motion over the ground less that through the air."""
    names = ("wind_north_mps", "wind_east_mps")
    for topic in _topics(flight, "air", *names):
        sources["wind"] = f"{topic}.wind"
        north, east = (_at(flight, path, topic, name) for name in names)
        return north, east, False
    air = next(iter(_topics(flight, "air", "true_airspeed_mps")), "")
    heading = next(iter(_topics(flight, "ins", "true_heading_deg")), "")
    velocities = ("velocity_north_mps", "velocity_east_mps")
    moving = next(iter((*_topics(flight, "gnss", *velocities), *_topics(flight, "ins", *velocities))), "")
    if not (air and heading and moving):
        nothing = np.full(len(path.time_ns), np.nan)
        return nothing, nothing, False
    sources["wind"] = f"{moving} velocity less {air}.true_airspeed_mps along {heading}.true_heading_deg"
    nose_deg = join(flight[heading], path.time_ns, ["true_heading_deg"], largest_gap_s=LARGEST_GAP_S)
    nose_rad = np.deg2rad(nose_deg.values("true_heading_deg"))
    speed = _at(flight, path, air, "true_airspeed_mps")
    north, east = (_at(flight, path, moving, name) for name in velocities)
    return north - speed * np.cos(nose_rad), east - speed * np.sin(nose_rad), True
