"""Channels of a flight that matter to its approaches, on the times of one position source."""

from typing import TYPE_CHECKING

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.dataclasses import dataclass
from groundstation.base.errors import NotAssessableError
from groundstation.base.geodesy import north_east_m
from groundstation.base.records import Int64Array
from groundstation.base.units import NS_PER_S
from groundstation.systems.landing.settings import LandingSettings
from groundstation.tables.motion import runs
from groundstation.tables.resample import values_at
from groundstation.tables.sources import sources_of_kind

if TYPE_CHECKING:
    from groundstation.tables.table import Flight

HIGHEST_RATE_HZ = 4.0
LARGEST_GAP_S = 5.0
SHORTEST_LEAVE_S = 2.5  # what leaves the guidance for less has not left it
POSITION = ("latitude_deg", "longitude_deg")
SMOOTHED_S = 6.0  # over which speeds and sink rates of stepped signals are taken
# Height -> whether it counts from the airfield.
HEIGHTS = (
    ("baro", "height_above_airfield_m", True),
    ("gnss", "altitude_msl_m", False),
    ("gnss", "altitude_ellipsoid_m", False),
    ("ins", "altitude_msl_m", False),
    ("ins", "altitude_ellipsoid_m", False),
    ("baro", "pressure_altitude_m", False),
    ("radio_altimeter", "height_m", True),
)


@dataclass(frozen=True, eq=False, kw_only=True)
class FlightPath:
    """A flight's motion with what guided it, arrays of shape (n,), NaN where not known.

    ``altitude_m`` counts from the airfield where ``is_above_airfield``, else from some level that a touchdown or an
    elevation ties to it.
    """

    position_topic: str
    guidance_topic: str
    altitude_source: str
    is_above_airfield: bool
    time_ns: Int64Array
    time_s: FloatArray
    latitude_deg: FloatArray
    longitude_deg: FloatArray
    altitude_m: FloatArray
    ground_speed_mps: FloatArray
    sink_rate_mps: FloatArray
    bank_deg: FloatArray
    airspeed_mps: FloatArray
    lateral_dots: FloatArray
    vertical_dots: FloatArray

    def position_m(self, latitude_deg: float, longitude_deg: float) -> FloatArray:
        """Displacements north and east of a place, shape (n, 2)."""
        return np.stack(north_east_m(self.latitude_deg, self.longitude_deg, latitude_deg, longitude_deg), axis=-1)


def path_of(flight: "Flight", settings: LandingSettings) -> FlightPath:
    """Gather the channels.

    Raises
    ------
    NotAssessableError
        When the log has no positions.
    """
    topic = next(iter(position_topics(flight)), "")
    if not topic:
        raise NotAssessableError("landing", f"no position of the aircraft in the log{_guidance_told(flight, settings)}")
    table = flight[topic].unique_times()
    known = np.flatnonzero(table.valid(*POSITION))
    steps_s = np.diff(table.time_ns[known]) / NS_PER_S
    every = max(int(1.0 / (HIGHEST_RATE_HZ * max(float(np.median(steps_s)), 1e-3))), 1) if steps_s.size else 1
    table = table.take(known[::every])
    time_ns, time_s = table.time_ns, flight.seconds(table.time_ns)
    altitude_source, altitude_m, is_above = _altitude(flight, time_ns)
    guidance = next((one for one in _topics(flight, "guidance", "lateral_deviation_dots")), "")

    def field(kind: str, name: str) -> FloatArray:
        found = next(iter(_topics(flight, kind, name)), "")
        return _at(flight, found, name, time_ns)

    bank_deg, airspeed_mps = field("ins", "roll_deg"), field("air", "indicated_airspeed_mps")
    if not np.isfinite(airspeed_mps).any():
        airspeed_mps = field("air", "true_airspeed_mps")
    return FlightPath(
        position_topic=topic,
        guidance_topic=guidance,
        altitude_source=altitude_source,
        is_above_airfield=is_above,
        time_ns=time_ns,
        time_s=time_s,
        latitude_deg=table.values("latitude_deg"),
        longitude_deg=table.values("longitude_deg"),
        altitude_m=altitude_m,
        ground_speed_mps=_ground_speed(flight, topic, time_ns),
        sink_rate_mps=-slope(time_s, altitude_m),
        bank_deg=bank_deg,
        airspeed_mps=airspeed_mps,
        lateral_dots=_at(flight, guidance, "lateral_deviation_dots", time_ns),
        vertical_dots=_at(flight, guidance, "vertical_deviation_dots", time_ns),
    )


def position_topics(flight: "Flight") -> tuple[str, ...]:
    """Topics with positions, satellite receivers first."""
    return (*_topics(flight, "gnss", *POSITION), *_topics(flight, "ins", *POSITION))


def _topics(flight: "Flight", kind: str, *names: str) -> tuple[str, ...]:
    return tuple(topic for topic in sources_of_kind(flight, kind) if flight[topic].has(*names))


def _at(flight: "Flight", topic: str, name: str, time_ns: Int64Array) -> FloatArray:
    if not topic:
        return np.full(len(time_ns), np.nan)
    return values_at(flight[topic], name, time_ns, largest_gap_s=LARGEST_GAP_S)


def _altitude(flight: "Flight", time_ns: Int64Array) -> tuple[str, FloatArray, bool]:
    for kind, name, is_above in HEIGHTS:
        for topic in _topics(flight, kind, name):
            return f"{topic}.{name}", _at(flight, topic, name, time_ns), is_above
    return "", np.full(len(time_ns), np.nan), False


def _ground_speed(flight: "Flight", topic: str, time_ns: Int64Array) -> FloatArray:
    names = ("velocity_north_mps", "velocity_east_mps")
    if flight[topic].has("ground_speed_mps"):
        return _at(flight, topic, "ground_speed_mps", time_ns)
    if flight[topic].has(*names):
        return np.hypot(*(_at(flight, topic, name, time_ns) for name in names))
    latitude = values_at(flight[topic], "latitude_deg", time_ns, largest_gap_s=LARGEST_GAP_S)
    longitude = values_at(flight[topic], "longitude_deg", time_ns, largest_gap_s=LARGEST_GAP_S)
    origin = int(np.argmax(np.isfinite(latitude)))
    time_s = flight.seconds(time_ns)
    north, east = north_east_m(latitude, longitude, float(latitude[origin]), float(longitude[origin]))
    return np.hypot(slope(time_s, north), slope(time_s, east))


def slope(time_s: FloatArray, values: FloatArray, over_s: float = SMOOTHED_S) -> FloatArray:
    """Return the rate of change of a stepped signal, NaN where not known.

    The rate is the difference over ``over_s`` about each time.
    """
    known = np.isfinite(values)
    if known.sum() < 2:
        return np.full(len(time_s), np.nan)
    at, what = time_s[known], values[known]
    after, before = np.minimum(time_s + 0.5 * over_s, at[-1]), np.maximum(time_s - 0.5 * over_s, at[0])
    length = after - before
    rate = (np.interp(after, at, what) - np.interp(before, at, what)) / np.where(length > 0.0, length, np.nan)
    return np.where(known, rate, np.nan)


def step_of(values_deg: FloatArray) -> float:
    """The step a coordinate is written in, 0 where it is below some 2 m.

    Examples
    --------
    >>> step_of(np.round(np.linspace(60.0, 60.1, 500) / 0.0013733) * 0.0013733).__round__(7)
    0.0013733
    """
    steps = np.abs(np.diff(values_deg[np.isfinite(values_deg)]))
    steps = steps[steps > 1e-9]
    smallest = float(np.quantile(steps, 0.02)) if steps.size else 0.0
    still = steps.size < 0.9 * (len(values_deg) - 1)  # written in steps, a coordinate often stays as it is
    return smallest if smallest > 2e-5 and (still or smallest > 5e-4) else 0.0


def on_guidance(
    time_s: FloatArray, lateral_dots: FloatArray, vertical_dots: FloatArray, settings: LandingSettings
) -> tuple[tuple[int, int], ...]:
    """Return the stretches [first, last) of samples established on the guidance.

    Where no glide path is logged, the course alone counts.
    """
    is_on = np.abs(lateral_dots) < settings.established_lateral_dots
    if np.isfinite(vertical_dots).any():
        is_on &= np.abs(vertical_dots) < settings.established_vertical_dots
    found: list[tuple[int, int]] = []
    for first, last in runs(np.asarray(is_on)):
        if found and time_s[first] - time_s[found[-1][1] - 1] <= SHORTEST_LEAVE_S:
            first = found.pop()[0]
        found.append((first, last))
    return tuple(one for one in found if time_s[one[1] - 1] - time_s[one[0]] >= settings.established_min_s)


def _guidance_told(flight: "Flight", settings: LandingSettings) -> str:
    """Tell what the guidance of a log without positions shows."""
    topic = next(iter(_topics(flight, "guidance", "lateral_deviation_dots")), "")
    if not topic:
        return ""
    table = flight[topic].unique_times()
    _source, altitude_m, is_above = _altitude(flight, table.time_ns)
    lateral, vertical = (table.values(f"{axis}_deviation_dots") for axis in ("lateral", "vertical"))
    if is_above:
        lateral = np.where(altitude_m > settings.final_height_min_m, lateral, np.nan)
    if on_guidance(flight.seconds(table.time_ns), lateral, vertical, settings):
        return ""
    return f"; {topic} is never established in flight for {settings.established_min_s:.0f} s"
