"""Readings that the method uses: the magnetometer with the INS attitude at the same times."""

from dataclasses import fields

import numpy as np
from numpy.typing import NDArray

from groundstation.base.angles import FloatArray, wrap_180, wrap_360
from groundstation.base.dataclasses import dataclass
from groundstation.base.errors import NotAssessableError
from groundstation.base.records import Int64Array
from groundstation.base.signals import topics_of_kind
from groundstation.base.units import NS_PER_S
from groundstation.results.arrays.states import BodyStates
from groundstation.results.roles import Delays
from groundstation.systems.magnetic.attitude import levelled_heading_deg
from groundstation.systems.magnetic.settings import MagneticSettings
from groundstation.tables.headings import FARTHEST_POSITION_S
from groundstation.tables.resample import join, values_at
from groundstation.tables.sources import AIDED, Need, choose_source, is_mostly_aided
from groundstation.tables.table import Flight, Table

FIELD = ("field_forward_nt", "field_right_nt", "field_down_nt")
ATTITUDE = ("roll_deg", "pitch_deg", "true_heading_deg")
ALTITUDES = ("altitude_msl_m", "altitude_ellipsoid_m", "pressure_altitude_m")
MAGNETOMETER = Need("magnetometer", "three-axis magnetometer", FIELD)
UNIT = Need("ins", "INS with roll, pitch and true heading", ATTITUDE)
LEAST_READINGS = 10
ANALYSIS = "magnetic"
NO_DATE = ("no date, so no declination", "UTC in the log, or declination_deg stated")
PLACE_WANTED = "a position, or declination_deg stated"


@dataclass(frozen=True)
class Readings:
    """Magnetometer readings with known attitude, in order of time.

    Arrays have shape (n,), ``field_nt`` (n, 3). ``true_heading_deg`` is the INS heading (mounting and alignment taken
    off where that is known), ``altitude_m``, ``latitude_deg``, ``longitude_deg`` and ``current_a`` are NaN where
    unknown.
    """

    time_s: FloatArray
    field_nt: FloatArray
    roll_deg: FloatArray
    pitch_deg: FloatArray
    true_heading_deg: FloatArray
    altitude_m: FloatArray
    latitude_deg: FloatArray
    longitude_deg: FloatArray
    current_a: FloatArray

    def __len__(self) -> int:
        return len(self.time_s)

    def take(self, index: NDArray[np.bool_] | NDArray[np.intp] | slice) -> "Readings":
        """The readings that a mask or rows select."""
        return Readings(**{item.name: getattr(self, item.name)[index] for item in fields(self)})

    @property
    def magnetic_heading_deg(self) -> FloatArray:
        """Uncorrected magnetic heading: levelled with the attitude of the INS."""
        return levelled_heading_deg(self.field_nt, self.roll_deg, self.pitch_deg)

    @property
    def compass_error_deg(self) -> FloatArray:
        """Magnetic heading minus true heading, in [-180, 180): declination is in it."""
        return wrap_180(self.magnetic_heading_deg - self.true_heading_deg)


def choose_topics(flight: Flight, ins_topic: str = "", magnetometer_topic: str = "") -> tuple[str, str]:
    """Return the first INS with attitude and true heading, and the first magnetometer.

    Named topics come before; the magnetometer has three axes.

    Raises
    ------
    NotAssessableError
        When the log has none.
    """
    sensor = choose_source(flight, MAGNETOMETER, ANALYSIS, magnetometer_topic)
    return choose_source(flight, UNIT, ANALYSIS, ins_topic), sensor


def why_not_independent(flight: Flight, ins_topic: str, kinds: dict[str, str], settings: MagneticSettings) -> str:
    """Return why the heading of an INS may itself come from a magnetometer.

    Empty when nothing says so.
    """
    derived = flight.metadata.get(f"derived.{ins_topic}.true_heading_deg", "")
    if "magnetic" in derived:
        return f"the reader derived the true heading of {ins_topic} from {derived}: it is no independent reference"
    if settings.trusts_aided_heading:
        return ""
    if is_mostly_aided(flight[ins_topic]) or kinds.get(ins_topic) == AIDED:
        return (
            f"other sensors correct {ins_topic}, a magnetometer perhaps among them: its heading is no independent "
            "reference unless trusts_aided_heading states where it comes from"
        )
    return ""


def gather(
    flight: Flight,
    topics: tuple[str, str],
    latencies: Delays | None,
    settings: MagneticSettings,
    states: BodyStates | None = None,
) -> tuple[Readings, float]:
    """Return readings at the times of the magnetometer, and its latency.

    The times are put back by the latency where that is observed. Attitude and heading are those of ``states`` where
    they are given, else those of the INS.

    Raises
    ------
    NotAssessableError
        When hardly any reading has an attitude beside it.
    """
    unit, sensor = flight[topics[0]], flight[topics[1]]
    sensor = _thinned(sensor.take(sensor.valid(*FIELD)).unique_times(), settings.rate_max_hz)
    unit = unit.trusted()
    latency_s = latency_of(topics, latencies)
    at_ns = sensor.time_ns - round(latency_s * NS_PER_S)
    attitude = _attitude(flight, unit, at_ns, settings, states)
    latitude, longitude = position_at(flight, unit, at_ns)
    readings = Readings(
        flight.seconds(at_ns),
        np.stack([sensor.values(name) for name in FIELD], axis=-1),
        attitude[0],
        attitude[1],
        wrap_360(attitude[2]),
        altitude_at(flight, unit, at_ns),
        latitude,
        longitude,
        current_at(flight, at_ns),
    )
    known = np.isfinite(attitude).all(axis=0) & (np.abs(readings.field_nt).sum(axis=1) > 0.0)
    if np.count_nonzero(known) < LEAST_READINGS:
        whose = topics[0] if states is None else "the best trajectory"
        raise NotAssessableError(ANALYSIS, f"too few readings of {topics[1]} while the attitude of {whose} is known")
    return readings.take(known), latency_s


def _attitude(
    flight: Flight, unit: Table, at_ns: Int64Array, settings: MagneticSettings, states: BodyStates | None
) -> FloatArray:
    """Return roll, pitch and true heading, shape (3, n), NaN where unknown."""
    if states is not None:
        at = states.at(flight.seconds(at_ns))
        return np.stack([at.roll_deg, at.pitch_deg, at.true_heading_deg])
    joined = join(unit, at_ns, ATTITUDE, largest_gap_s=settings.gap_max_s)
    return np.where(joined.valid(*ATTITUDE), np.stack([joined.values(name) for name in ATTITUDE]), np.nan)


def latency_of(topics: tuple[str, str], latencies: Delays | None) -> float:
    """Latency of a magnetometer against an INS where it is observed, else 0, seconds."""
    row = latencies.observed(*topics) if latencies is not None else None
    return row.latency_s if row is not None and row.latency_s is not None else 0.0


def _thinned(table: Table, rate_max_hz: float) -> Table:
    """Every k-th row, so that the rate is at most that."""
    steps_ns = np.diff(table.time_ns)
    if not steps_ns.size:
        return table
    step = int(NS_PER_S / rate_max_hz / float(np.median(steps_ns)) + 0.5)
    return table.take(slice(0, None, step)) if step > 1 else table


def altitude_at(flight: Flight, unit: Table, at_ns: Int64Array) -> FloatArray:
    """The first altitude there is: of the INS, a satellite receiver, a barometer."""
    others = [flight[topic] for kind in ("gnss", "baro") for topic in topics_of_kind(kind, flight.topics())]
    for table in (unit, *others):
        for name in ALTITUDES:
            if table.has(name):
                return values_at(table, name, at_ns, largest_gap_s=FARTHEST_POSITION_S)
    return np.full(len(at_ns), np.nan)


def position_at(flight: Flight, unit: Table, at_ns: Int64Array) -> tuple[FloatArray, FloatArray]:
    """Latitude and longitude of the INS, else of a satellite receiver; NaN where unknown."""
    names = ("latitude_deg", "longitude_deg")
    for table in (unit, *(flight[topic] for topic in topics_of_kind("gnss", flight.topics()))):
        if table.has(*names):
            joined = join(table, at_ns, names, largest_gap_s=FARTHEST_POSITION_S)
            return joined.values(names[0]), joined.values(names[1])
    return np.full(len(at_ns), np.nan), np.full(len(at_ns), np.nan)


def current_at(flight: Flight, at_ns: Int64Array) -> FloatArray:
    """The first current logged; NaN where unknown."""
    for topic in topics_of_kind("electric", flight.topics()):
        if flight[topic].has("current_a"):
            return values_at(flight[topic], "current_a", at_ns, largest_gap_s=2.0)
    return np.full(len(at_ns), np.nan)
