"""Signals that two logs have of one motion: a pair of topics, one of each log."""

from collections.abc import Mapping

import numpy as np

from groundstation.base.angles import FloatArray, unwrap
from groundstation.base.dataclasses import dataclass
from groundstation.base.records import BoolArray
from groundstation.base.signals import topics_of_kind
from groundstation.base.units import NS_PER_S
from groundstation.tables.motion import horizontal_speed_mps
from groundstation.tables.table import Flight, Table

KINDS = ("ins", "gnss", "odometry", "baro")
ALTITUDES = ("altitude_ellipsoid_m", "altitude_msl_m", "pressure_altitude_m")
HEADINGS = ("true_heading_deg", "magnetic_heading_deg")
WEIGHT: Mapping[str, int] = {"north": 3, "east": 3, "speed": 3, "heading": 2, "turn": 2, "down": 1, "altitude": 1}
UNITS: Mapping[str, str] = {
    "north": "m/s",
    "east": "m/s",
    "speed": "m/s",
    "heading": "deg",
    "turn": "deg/s",
    "down": "m/s",
    "altitude": "m",
}
LEAST_ROWS = 10
LEAST_WEIGHT = 1  # altitudes alone


@dataclass(frozen=True)
class TopicSignals:
    """Signals of one topic: seconds since the start of its flight (n,), and values (n, c).

    The times increase. ``attitude_deg``: roll, pitch and heading (n, 3) where it has a heading, for the arm between two
    sensors.
    """

    topic: str
    time_s: FloatArray
    values: FloatArray
    attitude_deg: FloatArray | None = None

    def take(self, index: BoolArray) -> "TopicSignals":
        """Some of the rows."""
        attitude = None if self.attitude_deg is None else self.attitude_deg[index]
        return TopicSignals(self.topic, self.time_s[index], self.values[index], attitude)

    @property
    def interval_s(self) -> float:
        """Usual time between samples."""
        return float(np.median(np.diff(self.time_s)))


@dataclass(frozen=True)
class SignalPair:
    """The same signals (``names``, c of them) of two logs."""

    names: tuple[str, ...]
    first: TopicSignals
    other: TopicSignals


def pair_of(
    first: Flight, other: Flight, longest_s: float, *, is_late: tuple[bool, bool] = (False, False)
) -> SignalPair | None:
    """Return the pair of topics that shows most of the motion; None where there is none.

    The pair comes with the signals that both have. Velocities say more than speed, an INS more than GNSS (it is stamped
    when it is measured), fast topics more than slow ones. A topic slower than one sample in ``longest_s`` says nothing.
    ``is_late``: GNSS messages of a log came to its recorder late; they are used where nothing else shows the motion.
    """
    sides = [[_channels(flight, topic) for topic in _topics(flight)] for flight in (first, other)]
    best, rank = None, (False, -2, 0, 0, 0.0)
    for a in sides[0]:
        for b in sides[1]:
            names = _common(a, b)
            if not names:
                continue
            pair = SignalPair(names, a.side(names), b.side(names))
            if min(len(pair.first.time_s), len(pair.other.time_s)) < LEAST_ROWS:
                continue
            slower = max(pair.first.interval_s, pair.other.interval_s)
            if not 0.0 < slower <= longest_s:
                continue
            inertial = sum(topic.startswith("ins") for topic in (a.topic, b.topic))
            late = sum(side.topic.startswith("gnss") and stamps for side, stamps in zip((a, b), is_late, strict=True))
            weight = sum(WEIGHT[name] for name in names)
            of_pair = (weight > LEAST_WEIGHT, -late, weight, inertial, -slower)
            if of_pair > rank:
                best, rank = pair, of_pair
    return best


def side_of(flight: Flight, topic: str, names: tuple[str, ...]) -> TopicSignals | None:
    """Some signals of a topic; None where it lacks one or has hardly any sample."""
    found = _channels(flight, topic)
    if any(name not in found.values for name in names):
        return None
    side = found.side(names)
    return side if len(side.time_s) >= LEAST_ROWS else None


def _topics(flight: Flight) -> list[str]:
    return [topic for kind in KINDS for topic in topics_of_kind(kind, flight.topics()) if len(flight[topic])]


@dataclass(frozen=True)
class _Channels:
    """Every signal that a topic has."""

    topic: str
    time_s: FloatArray
    values: Mapping[str, FloatArray]
    attitude_deg: FloatArray | None

    def side(self, names: tuple[str, ...]) -> TopicSignals:
        """Return the rows that have all of the named signals."""
        values = np.column_stack([self.values[name] for name in names])
        known = np.isfinite(values).all(axis=1)
        if self.attitude_deg is None:
            return TopicSignals(self.topic, self.time_s[known], values[known])
        known &= np.isfinite(self.attitude_deg).all(axis=1)
        return TopicSignals(self.topic, self.time_s[known], values[known], self.attitude_deg[known])


def _common(a: _Channels, b: _Channels) -> tuple[str, ...]:
    both = {name for name in WEIGHT if name in a.values and name in b.values}
    if "north" in both:
        both.discard("speed")
    if "heading" in both:
        both.discard("turn")
    if "down" in both:
        both.discard("altitude")
    return tuple(name for name in WEIGHT if name in both)


def _channels(flight: Flight, topic: str) -> _Channels:
    table = flight[topic].unique_times().trusted()
    time_s = flight.seconds(table.time_ns)
    found = {
        "north": table.values("velocity_north_mps"),
        "east": table.values("velocity_east_mps"),
        "speed": _speed(table),
        "heading": _first(table, HEADINGS),
        "down": table.values("velocity_down_mps"),
        "altitude": _first(table, ALTITUDES),
    }
    if np.isfinite(found["heading"]).any():
        found["heading"] = unwrap(found["heading"])
    found["turn"] = _turn(table, time_s, found["heading"])
    most = max(int(np.count_nonzero(np.isfinite(values))) for values in found.values())
    known = {name: values for name, values in found.items() if _tells(values, most // 2)}
    if ("north" in known) != ("east" in known):
        known = {name: values for name, values in known.items() if name not in ("north", "east")}
    attitude_deg = None
    if "heading" in known:
        tilt = [np.nan_to_num(table.values(name)) for name in ("roll_deg", "pitch_deg")]
        attitude_deg = np.column_stack([*tilt, known["heading"]])
    return _Channels(topic, time_s, known, attitude_deg)


def _tells(values: FloatArray, more_than: int) -> bool:
    """Tell whether there are enough values, and not all are the same."""
    finite = values[np.isfinite(values)]
    return len(finite) > more_than and float(np.ptp(finite)) > 0.0


def _speed(table: Table) -> FloatArray:
    speed = horizontal_speed_mps(table)
    return np.where(np.isfinite(speed), speed, np.abs(table.values("speed_mps")))


def _first(table: Table, names: tuple[str, ...]) -> FloatArray:
    return next((table.values(name) for name in names if table.has(name)), np.full(len(table), np.nan))


def _turn(table: Table, time_s: FloatArray, heading_deg: FloatArray) -> FloatArray:
    """Rate of turn: logged, else by the heading."""
    for name in ("rate_z_dps", "turn_rate_dps"):
        if table.has(name):
            return table.values(name)
    if len(time_s) < LEAST_ROWS or not np.isfinite(heading_deg).any():
        return np.full(len(table), np.nan)
    return np.asarray(np.gradient(heading_deg, time_s))


def averaged(side: TopicSignals, step_s: float) -> TopicSignals:
    """Means over ``step_s``, at their mean times; a slower side as it is."""
    cell = np.floor((side.time_s - side.time_s[0]) / max(step_s, 1.0 / NS_PER_S) + 1e-6).astype(np.int64)
    starts = np.flatnonzero(np.diff(cell, prepend=-1))
    if len(starts) == len(side.time_s):
        return side
    count = np.diff(np.append(starts, len(side.time_s)))
    attitude = side.attitude_deg
    return TopicSignals(
        side.topic,
        np.add.reduceat(side.time_s, starts) / count,
        np.add.reduceat(side.values, starts, axis=0) / count[:, None],
        None if attitude is None else np.add.reduceat(attitude, starts, axis=0) / count[:, None],
    )


def running_mean(side: TopicSignals, nodes: int) -> TopicSignals:
    """Means over an odd number of samples, two in that length; those at the ends are left out."""
    if len(side.time_s) <= nodes:
        return side
    half = nodes // 2
    step = max(nodes // 2, 1)
    rows = slice(half, len(side.time_s) - half, step)

    def means(values: FloatArray) -> FloatArray:
        sums = np.cumsum(np.concatenate([np.zeros((1, *values.shape[1:])), values]), axis=0)
        return np.asarray((sums[nodes:] - sums[:-nodes])[::step] / nodes)

    attitude = None if side.attitude_deg is None else means(side.attitude_deg)
    return TopicSignals(side.topic, side.time_s[rows], means(side.values), attitude)
