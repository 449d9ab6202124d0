"""Flights of one INS that begin standing and end parked: alignment, stand, flight, stand.

The alignment is in the log by the mode, by velocities of exactly zero, or not at all. Errors begin where navigation
does. What breaks the assumptions of an estimator: an aircraft that rocks in the wind, one moved by a tug while it
aligns, sensors that warm up.
"""

from dataclasses import field, fields, replace
from typing import Literal
from zlib import crc32

import numpy as np
from numpy.typing import NDArray

from groundstation.base.angles import FloatArray, wrap_360
from groundstation.base.dataclasses import dataclass
from groundstation.base.errors import SettingsError
from groundstation.base.geodesy import displaced_deg
from groundstation.base.records import Column, frozen
from groundstation.base.toml_settings import check_ranges, number
from groundstation.base.units import NS_PER_S
from groundstation.simulation.inertial_family import GnssErrorModel, draw_gnss_errors
from groundstation.simulation.ins_class import InsClass, load_ins_class
from groundstation.simulation.ins_draw import DPH, MICRO_G, Streams, draw_heading_wander, draw_sensor_errors
from groundstation.simulation.ins_errors import SensorErrors, propagate
from groundstation.simulation.ins_units.settings import UnitOutput
from groundstation.simulation.processes import gauss_markov
from groundstation.simulation.readings import in_steps, quantised_heading
from groundstation.simulation.routes import Route, RouteKind, RoutePlan, draw_plan, fly_plan, smooth_ramp
from groundstation.tables.table import Flight, Table

AlignmentLog = Literal["mode", "still", "none"]
START_NS = 1_777_874_400 * NS_PER_S
BRAKING_S, DESCENT_S = 240.0, 1200.0  # before the end of the flight
ROCKING_S = 1.5  # correlation of the velocity of a rocking aircraft
TUG_MPS = 1.0
DISTURBED = 3.0  # an alignment of a moving aircraft leaves so many times the tilt and azimuth of the class
RECEIVER = GnssErrorModel(
    position_white_m=2.0,
    position_correlated_m=1.5,
    velocity_white_mps=0.03,
    velocity_correlated_mps=0.01,
)


@dataclass(frozen=True)
class ParkedSettings:
    """Everything that determines such a flight, but for its seed.

    Parameters
    ----------
    align_s, stand_s, flight_s, park_s : float
        Lengths of alignment, stand after it, flight, and stand at its end.
    alignment : {"mode", "still", "none"}
        How it is in the log: by the mode; by rows without a mode and velocities of zero; not at all.
    place_m : float
        Sigma of the position that was entered, each axis.
    rocking_mps : float
        Sigma of the velocity of the standing aircraft.
    tug_m : float
        Way it is towed in the middle of the alignment.
    warm_up_dph, warm_up_ug, warm_up_s : float
        Drift and bias at the start of navigation that go off exponentially.
    """

    ins: str | InsClass = "navigation"
    route: RouteKind = "manoeuvring"
    align_s: float = number(600.0, 0.0, 7200.0)
    stand_s: float = number(240.0, 0.0, 7200.0)
    flight_s: float = number(4800.0, 1500.0, 50_000.0)
    park_s: float = number(180.0, 0.0, 7200.0)
    alignment: AlignmentLog = "mode"
    gnss: GnssErrorModel = RECEIVER
    output: UnitOutput = field(default_factory=UnitOutput)
    place_m: float = number(3.0, 0.0, 1e5)
    rocking_mps: float = number(0.0, 0.0, 5.0)
    tug_m: float = number(0.0, 0.0, 500.0)
    warm_up_dph: float = number(0.0, 0.0, 100.0)
    warm_up_ug: float = number(0.0, 0.0, 1e4)
    warm_up_s: float = number(900.0, 1.0, 1e5)

    def __post_init__(self) -> None:
        check_ranges(self)
        if self.tug_m and self.tug_m / TUG_MPS > self.align_s:
            raise SettingsError("tug_m", f"{self.tug_m:g} m", f"at most {self.align_s * TUG_MPS:g} m")

    @property
    def ins_class(self) -> InsClass:
        """The class itself."""
        return load_ins_class(self.ins) if isinstance(self.ins, str) else self.ins


@dataclass(frozen=True)
class ParkedFlight:
    """Log of such a flight, and its truth.

    Parameters
    ----------
    log : Flight
        Topics ``ins`` and ``gnss``.
    start_s : float
        Start of navigation, flight seconds.
    time_s : ndarray, shape (n,)
        Flight seconds from the start of navigation on.
    position_error_m, velocity_error_mps, tilt_rad : ndarray, shape (n, 2)
        INS - truth, north and east.
    azimuth_error_rad : ndarray, shape (n,)
        Of the platform.
    """

    log: Flight
    start_s: float
    time_s: FloatArray
    position_error_m: FloatArray
    velocity_error_mps: FloatArray
    tilt_rad: FloatArray
    azimuth_error_rad: FloatArray

    def __post_init__(self) -> None:
        for item in fields(self):
            value = getattr(self, item.name)
            if isinstance(value, np.ndarray):
                object.__setattr__(self, item.name, frozen(value))


def simulate_parked(settings: ParkedSettings, seed: int, run: int = 0) -> ParkedFlight:
    """Simulate a flight. The same settings, seed and run give the same one.

    Examples
    --------
    >>> flight = simulate_parked(ParkedSettings(align_s=60.0, flight_s=1500.0), seed=1)
    >>> flight.start_s, sorted(flight.log.topics())
    (60.0, ['gnss', 'ins'])
    """

    def streams(name: str) -> np.random.Generator:
        return np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(run, crc32(name.encode()))))

    route = _route(settings, streams("route"))
    motion, ins = route.motion, replace(settings.ins_class, initial_position_m=settings.place_m)
    if settings.rocking_mps or settings.tug_m:
        tilt_rad, azimuth_deg = DISTURBED * ins.initial_tilt_rad, DISTURBED * ins.initial_azimuth_deg
        ins = replace(ins, initial_tilt_rad=tilt_rad, initial_azimuth_deg=azimuth_deg)
    sensors = _warming(draw_sensor_errors(ins, motion, streams), settings, motion.time_s, streams("warm-up"))
    errors = propagate(motion, sensors, body_fixed=ins.is_strapdown)
    wander = draw_heading_wander(streams("heading"), motion.time_s, motion.heading_deg[0], ins.heading)
    start_s = settings.align_s if settings.alignment != "none" else 0.0
    log = _log(
        settings,
        route,
        errors.position_m[0],
        errors.velocity_mps[0],
        errors.azimuth_rad[0] + np.deg2rad(wander),
        streams,
    )
    return ParkedFlight(
        log,
        start_s,
        start_s + motion.time_s,
        errors.position_m[0],
        errors.velocity_mps[0],
        errors.tilt_rad[0],
        errors.azimuth_rad[0],
    )


def _route(settings: ParkedSettings, rng: np.random.Generator) -> Route:
    """Return the motion from the start of navigation on."""
    flown = np.arange(round(settings.flight_s) + 1, dtype=np.float64)
    plan, end = draw_plan(settings.route, flown, rng), float(flown[-1])
    speed = plan.speed_mps * (1.0 - smooth_ramp(flown, end - BRAKING_S, 0.9 * BRAKING_S))
    field_m = float(plan.altitude_m[0])
    descent = 1.0 - smooth_ramp(flown, end - DESCENT_S, 0.75 * DESCENT_S)
    altitude = field_m + (plan.altitude_m - field_m) * descent
    before, after = round(settings.stand_s), round(settings.park_s)
    rolls = (speed > 1.0).astype(np.float64)

    def around(values: FloatArray, edge: float) -> FloatArray:
        return np.concatenate([np.full(before, edge), values, np.full(after, edge)])

    time_s = np.arange(before + len(flown) + after, dtype=np.float64)
    parked = RoutePlan(
        plan.latitude_deg,
        plan.longitude_deg,
        plan.heading_deg,
        around(speed, 0.0),
        around(altitude, field_m),
        around(plan.turn_radps * rolls, 0.0),
        around(plan.steers * rolls, 0.0),
        plan.destination_deg,
        plan.steering_radps,
    )
    return fly_plan(parked, time_s)


def _warming(
    sensors: SensorErrors, settings: ParkedSettings, time_s: FloatArray, rng: np.random.Generator
) -> SensorErrors:
    """Add a drift and a bias that go off; the bias at the start is levelled out."""
    if not settings.warm_up_dph and not settings.warm_up_ug:
        return sensors
    sign = rng.choice([-1.0, 1.0], 4)
    going = np.exp(-time_s / settings.warm_up_s)
    gyro, accelerometer = sensors.gyro_radps.copy(), sensors.accelerometer_mps2.copy()
    for axis in range(2):
        gyro[0, :, axis] += sign[axis] * DPH * settings.warm_up_dph * going
        accelerometer[0, :, axis] += sign[2 + axis] * MICRO_G * settings.warm_up_ug * (going - 1.0)
    return replace(sensors, gyro_radps=gyro, accelerometer_mps2=accelerometer)


@dataclass(frozen=True)
class _Path:
    """True motion of the whole log: the alignment in front."""

    time_s: FloatArray
    place_deg: FloatArray
    altitude_m: FloatArray
    velocity_mps: FloatArray
    down_mps: FloatArray
    heading_deg: FloatArray
    roll_deg: FloatArray


def _path(settings: ParkedSettings, route: Route, rng: np.random.Generator) -> _Path:
    motion = route.motion
    ahead = round(settings.align_s) if settings.alignment != "none" else 0
    count = ahead + len(motion.time_s)

    def whole(values: FloatArray, first: float) -> FloatArray:
        return np.concatenate([np.full(ahead, first), values])

    latitude, longitude = motion.latitude_deg[0], route.longitude_deg
    velocity = np.column_stack([whole(one[0], 0.0) for one in (motion.velocity_north_mps, motion.velocity_east_mps)])
    heading = whole(motion.heading_deg[0], float(motion.heading_deg[0, 0]))
    moved = np.zeros((count, 2))
    if settings.tug_m and ahead:
        course = np.deg2rad(heading[0])
        length = round(settings.tug_m / TUG_MPS)
        first = (ahead - length) // 2
        along = np.clip(np.arange(count) - first, 0, length) * TUG_MPS - settings.tug_m
        along[ahead:] = 0.0  # the route begins where the tug left it
        moved = along[:, None] * np.array([np.cos(course), np.sin(course)])
        velocity[first : first + length] += TUG_MPS * np.array([np.cos(course), np.sin(course)])
    if settings.rocking_mps:
        stands = np.hypot(*velocity.T) < 0.1
        velocity += stands[:, None] * gauss_markov(rng, (2, count), 1.0, settings.rocking_mps, ROCKING_S).T
    altitude = whole(motion.altitude_m[0], float(motion.altitude_m[0, 0]))
    place = displaced_deg(whole(latitude, float(latitude[0])), whole(longitude, float(longitude[0])), altitude, moved)
    return _Path(
        np.arange(count, dtype=np.float64),
        np.column_stack(place),
        altitude,
        velocity,
        whole(motion.velocity_down_mps[0], 0.0),
        heading,
        whole(motion.roll_deg[0], 0.0),
    )


def _log(
    settings: ParkedSettings,
    route: Route,
    position_m: FloatArray,
    velocity_mps: FloatArray,
    heading_rad: FloatArray,
    streams: Streams,
) -> Flight:
    path, output = _path(settings, route, streams("rocking")), settings.output
    ahead, rng = len(path.time_s) - len(position_m), streams("output")
    noise = rng.standard_normal((len(path.time_s), 3))
    wrong = np.concatenate([np.repeat(position_m[:1], ahead, axis=0), position_m])
    place = np.column_stack(displaced_deg(path.place_deg[:, 0], path.place_deg[:, 1], path.altitude_m, wrong))
    velocity = path.velocity_mps + np.concatenate([np.zeros((ahead, 2)), velocity_mps])
    velocity = in_steps(velocity + output.velocity_noise_mps * noise[:, :2], output.velocity_step_mps)
    velocity[:ahead] = 0.0
    place[:ahead] = place[ahead] if ahead else place[:ahead]
    turned = np.rad2deg(np.concatenate([np.zeros(ahead), heading_rad]))
    heading = wrap_360(path.heading_deg + turned + output.heading_noise_deg * noise[:, 2])
    ins: dict[str, NDArray[np.generic]] = {
        "latitude_deg": in_steps(place[:, 0], output.position_step_deg),
        "longitude_deg": in_steps(place[:, 1], output.position_step_deg),
        "altitude_ellipsoid_m": path.altitude_m,
        "velocity_north_mps": velocity[:, 0],
        "velocity_east_mps": velocity[:, 1],
        "velocity_down_mps": path.down_mps,
        "roll_deg": path.roll_deg,
        "true_heading_deg": quantised_heading(heading, output.heading_step_deg) if output.heading_step_deg else heading,
    }
    if settings.alignment == "mode":
        ins["mode"] = np.where(np.arange(len(path.time_s)) < ahead, "align", "nav")
    tables = {
        "ins": _table("ins", path.time_s, ins),
        "gnss": _table("gnss", path.time_s, _gnss(settings, path, streams)),
    }
    metadata = {"aircraft": "SIM", "flight": "parked", "datum": "WGS-84"}
    if isinstance(settings.ins, str):
        metadata["ins_class"] = settings.ins
    return Flight(tables, metadata, START_NS, has_utc=True, source_name="parked.csv")


def _gnss(settings: ParkedSettings, path: _Path, streams: Streams) -> dict[str, NDArray[np.generic]]:
    position, velocity = draw_gnss_errors(settings.gnss, len(path.time_s), 1.0, streams("gnss"))
    latitude, longitude = displaced_deg(path.place_deg[:, 0], path.place_deg[:, 1], path.altitude_m, position)
    velocity = path.velocity_mps + velocity
    return {
        "latitude_deg": latitude,
        "longitude_deg": longitude,
        "altitude_ellipsoid_m": path.altitude_m,
        "velocity_north_mps": velocity[:, 0],
        "velocity_east_mps": velocity[:, 1],
    }


def _table(topic: str, time_s: FloatArray, columns: dict[str, NDArray[np.generic]]) -> Table:
    since_ns = np.rint(time_s * NS_PER_S).astype(np.int64)
    return Table(
        topic,
        since_ns + START_NS,
        {name: Column(np.array(values)) for name, values in columns.items()},
        np.arange(len(time_s)),
        Column(since_ns),
    )
