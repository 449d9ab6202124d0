"""Flights with several INS units: one true motion, errors of each unit, one receiver."""

from collections.abc import Callable
from dataclasses import fields, replace
from zlib import crc32

import numpy as np

from groundstation.base.angles import FloatArray, wrap_360
from groundstation.base.dataclasses import dataclass
from groundstation.base.geodesy import displaced_deg
from groundstation.base.records import frozen
from groundstation.simulation.inertial_family import draw_gnss_errors
from groundstation.simulation.ins_class import InsClass, draw_instrument
from groundstation.simulation.ins_draw import draw_heading_wander, draw_sensor_errors
from groundstation.simulation.ins_errors import SensorErrors, propagate
from groundstation.simulation.ins_units.settings import UnitDrift, UnitsSettings, UnitTilt, UnitTwin
from groundstation.simulation.ins_units.unit_faults import UnitErrors, UnitRecord, with_error_faults, with_output_faults
from groundstation.simulation.processes import gauss_markov
from groundstation.simulation.readings import in_steps, quantised_heading
from groundstation.simulation.routes import Route, draw_route

GUST_S = 20.0
GUSTS_FROM_MPS, GUSTS_FULL_MPS = 60.0, 80.0  # below, the aircraft is on its wheels
HIGHEST_LATITUDE_DEG = 80.0
DRAWS_OF_ROUTE = 200


@dataclass(frozen=True)
class GnssRecord:
    """Fixes of the receiver where there is one; arrays of shape (m,) and (m, 2)."""

    time_s: FloatArray
    latitude_deg: FloatArray
    longitude_deg: FloatArray
    altitude_m: FloatArray
    velocity_mps: FloatArray

    def __post_init__(self) -> None:
        for item in fields(self):
            object.__setattr__(self, item.name, frozen(getattr(self, item.name)))


@dataclass(frozen=True)
class UnitsFlight:
    """Flight with several units, and its truth.

    Parameters
    ----------
    settings : UnitsSettings
    time_s : ndarray, shape (n,)
        Of the truth; units have stamps of their own.
    truth : Route
        With gusts.
    units : tuple of UnitRecord
    gnss : GnssRecord or None
    """

    settings: UnitsSettings
    time_s: FloatArray
    truth: Route
    units: tuple[UnitRecord, ...]
    gnss: GnssRecord | None


class _Streams:
    """Random generators by name: what one draws never moves another."""

    def __init__(self, seed: int, run: int, suffix: str = "", shared: tuple[str, ...] = ()) -> None:
        self._seed, self._run, self._suffix, self._shared = seed, run, suffix, shared

    def __call__(self, name: str) -> np.random.Generator:
        full = name if name in self._shared else f"{name}{self._suffix}"
        return np.random.default_rng(np.random.SeedSequence(self._seed, spawn_key=(self._run, crc32(full.encode()))))

    def of_unit(self, label: str) -> "_Streams":
        """Return the streams of a unit; gravity is that of all."""
        return _Streams(self._seed, self._run, f" {label}", ("deflection",))


def simulate_units(settings: UnitsSettings, seed: int, run: int = 0) -> UnitsFlight:
    """Simulate a flight. The same settings, seed and run give the same flight.

    Route, receiver and every unit draw from streams of their own: a fault or another unit changes nothing else.

    Examples
    --------
    >>> flight = simulate_units(UnitsSettings(units=3, duration_s=600.0), seed=1)
    >>> [unit.topic for unit in flight.units], len(flight.gnss.time_s)
    (['ins', 'ins.1', 'ins.2'], 601)
    """
    time_s = np.arange(round(settings.duration_s / settings.step_s) + 1, dtype=np.float64) * settings.step_s
    streams = _Streams(seed, run)
    truth = _with_gusts(_route(settings, time_s, streams("route")), settings.gust_mps, streams("gust"))
    records = []
    for number in range(1, settings.units + 1):
        errors = _errors_of(settings, truth, number, streams)
        clean = _record(settings, truth, errors, number, streams)
        records.append(with_output_faults(clean, [one for one in settings.faults if one.unit == number]))
    return UnitsFlight(settings, time_s, truth, _with_twins(settings, records), _gnss(settings, truth, streams("gnss")))


def _route(settings: UnitsSettings, time_s: FloatArray, rng: np.random.Generator) -> Route:
    """Draw a route that stays away from the poles."""
    for _ in range(DRAWS_OF_ROUTE):
        route = draw_route(settings.route, time_s, rng)
        if np.abs(route.motion.latitude_deg).max() < HIGHEST_LATITUDE_DEG:
            break
    return route


def _with_gusts(route: Route, gust_mps: float, rng: np.random.Generator) -> Route:
    """Add gusts to velocity and, integrated, to position: in the air only."""
    if not gust_mps:
        return route
    motion = route.motion
    step_s = float(motion.time_s[1] - motion.time_s[0])
    speed = np.hypot(motion.velocity_north_mps[0], motion.velocity_east_mps[0])
    airborne = np.clip((speed - GUSTS_FROM_MPS) / (GUSTS_FULL_MPS - GUSTS_FROM_MPS), 0.0, 1.0)
    gust = airborne * gauss_markov(rng, (2, len(speed)), step_s, gust_mps, GUST_S)
    moved = np.zeros_like(gust)
    moved[:, 1:] = np.cumsum(0.5 * step_s * (gust[:, 1:] + gust[:, :-1]), axis=1)
    latitude, longitude = displaced_deg(motion.latitude_deg[0], route.longitude_deg, motion.altitude_m[0], moved.T)
    gusty = replace(
        motion,
        latitude_deg=latitude,
        velocity_north_mps=motion.velocity_north_mps[0] + gust[0],
        velocity_east_mps=motion.velocity_east_mps[0] + gust[1],
    )
    return Route(gusty, longitude)


def _errors_of(settings: UnitsSettings, truth: Route, number: int, streams: _Streams) -> UnitErrors:
    """Return the errors of a unit along the flight, with the faults that change them."""
    faults = [one for one in settings.faults if one.unit == number]
    kind = settings.class_of(number)

    def draw(label: str) -> UnitErrors:
        own = streams.of_unit(label)
        ins = _instrument(settings, kind, own)
        sensors = _sensors(settings, ins, kind, truth, own, streams)
        if label == str(number):
            for fault in faults:
                if isinstance(fault, UnitDrift):
                    sensors = _drifting(sensors, fault, kind, truth.motion.time_s)
                elif isinstance(fault, UnitTilt):
                    sensors = _tilted(sensors, fault.times, fault.direction_deg, kind)
        found = propagate(truth.motion, sensors, body_fixed=ins.is_strapdown)
        wander = draw_heading_wander(own("heading"), truth.motion.time_s, truth.motion.heading_deg[0], kind.heading)
        return UnitErrors(
            found.position_m[0],
            found.velocity_mps[0],
            found.tilt_rad[0],
            found.azimuth_rad[0] + np.deg2rad(wander),
        )

    outages = [(one.from_s, one.to_s) for one in settings.outages] if settings.has_gnss else []
    return with_error_faults(draw(str(number)), faults, truth.motion, kind, outages, draw, streams.of_unit(str(number)))


def _instrument(settings: UnitsSettings, kind: InsClass, own: Callable[[str], np.random.Generator]) -> InsClass:
    """Return the instrument of one unit: its class, or one of its own."""
    ins, common = kind, settings.common
    if settings.each_its_own:
        ins = draw_instrument(ins, own("instrument"))
    if common.heavy_tail_freedom:
        freedom = common.heavy_tail_freedom
        gyros, accelerometers = np.sqrt(freedom / own("tails").chisquare(freedom, 2))
        ins = replace(
            ins,
            gyro_constant_dph=float(gyros * ins.gyro_constant_dph),
            accelerometer_constant_ug=float(accelerometers * ins.accelerometer_constant_ug),
        )
    if common.deflection_arcsec is not None:
        ins = replace(ins, deflection_arcsec=common.deflection_arcsec, deflection_correlation_km=common.deflection_km)
    return ins


def _sensors(
    settings: UnitsSettings, ins: InsClass, kind: InsClass, truth: Route, own: _Streams, streams: _Streams
) -> SensorErrors:
    """Draw the sensors and the alignment of one unit, and what all units share of it."""
    sensors = draw_sensor_errors(ins, truth.motion, own, body_fixed=ins.is_strapdown)
    shared = streams("alignment")
    position, direction_deg = shared.standard_normal((1, 2)), float(shared.uniform(0.0, 360.0))
    common = settings.common
    sensors = replace(
        sensors,
        position_m=settings.ins_class.initial_position_m * position,
        azimuth_rad=sensors.azimuth_rad + np.deg2rad(common.azimuth_deg),
    )
    return _tilted(sensors, common.tilt_times, direction_deg, kind) if common.tilt_times else sensors


def class_tilt_rad(ins: InsClass) -> float:
    """Return one sigma of the tilt that an alignment of the class leaves, per axis.

    Examples
    --------
    >>> from groundstation.simulation.ins_class import load_ins_class
    >>> round(1e6 * class_tilt_rad(load_ins_class("navigation")), 1)
    51.0
    """
    levelled = 1e-6 * ins.accelerometer_constant_ug if ins.is_levelled else 0.0
    return float(np.hypot(ins.initial_tilt_rad, levelled))


def _tilted(sensors: SensorErrors, times: float, direction_deg: float, ins: InsClass) -> SensorErrors:
    tilt = times * class_tilt_rad(ins) * _direction(direction_deg)
    return replace(sensors, tilt_rad=sensors.tilt_rad + tilt)


def _drifting(sensors: SensorErrors, fault: UnitDrift, ins: InsClass, time_s: FloatArray) -> SensorErrors:
    gyro = sensors.gyro_radps.copy()
    drift = np.deg2rad(fault.times * ins.gyro_constant_dph / 3600.0) * _direction(fault.direction_deg)
    gyro[0, time_s >= fault.at_s, :2] += drift
    return replace(sensors, gyro_radps=gyro)


def _direction(direction_deg: float) -> FloatArray:
    direction = np.deg2rad(direction_deg)
    return np.array([np.cos(direction), np.sin(direction)])


def _record(settings: UnitsSettings, truth: Route, errors: UnitErrors, number: int, streams: _Streams) -> UnitRecord:
    """Return what a unit writes: truth and errors, noise, rounding."""
    motion, output = truth.motion, settings.output
    rng = streams.of_unit(str(number))("output")
    noise = rng.standard_normal((len(motion.time_s), 3))
    latitude, longitude = displaced_deg(
        motion.latitude_deg[0], truth.longitude_deg, motion.altitude_m[0], errors.position_m
    )
    velocity = np.stack([motion.velocity_north_mps[0], motion.velocity_east_mps[0]], axis=1) + errors.velocity_mps
    velocity += output.velocity_noise_mps * noise[:, :2]
    heading = motion.heading_deg[0] + np.rad2deg(errors.azimuth_rad) + output.heading_noise_deg * noise[:, 2]
    heading_deg = wrap_360(heading)
    if output.heading_step_deg:
        heading_deg = quantised_heading(heading, output.heading_step_deg)
    return UnitRecord(
        topic="ins" if number == 1 else f"ins.{number - 1}",
        serials=((0.0, f"SIM-{100 + number}"),),
        stamp_s=motion.time_s,
        latitude_deg=in_steps(latitude, output.position_step_deg),
        longitude_deg=in_steps(longitude, output.position_step_deg),
        altitude_m=motion.altitude_m[0],
        velocity_mps=in_steps(velocity, output.velocity_step_mps),
        velocity_down_mps=in_steps(motion.velocity_down_mps[0], output.velocity_step_mps),
        heading_deg=heading_deg,
        roll_deg=in_steps(motion.roll_deg[0], output.heading_step_deg),
        errors=errors,
    )


def _with_twins(settings: UnitsSettings, records: list[UnitRecord]) -> tuple[UnitRecord, ...]:
    """Put the records of twins in place: all of another unit but the topic."""
    found = list(records)
    for fault in settings.faults:
        if isinstance(fault, UnitTwin):
            found[fault.unit - 1] = replace(records[fault.of - 1], topic=records[fault.unit - 1].topic)
    return tuple(found)


def _gnss(settings: UnitsSettings, truth: Route, rng: np.random.Generator) -> GnssRecord | None:
    if not settings.has_gnss:
        return None
    motion = truth.motion
    n = len(motion.time_s)
    position, velocity = draw_gnss_errors(settings.gnss, n, settings.step_s, rng)
    kept = np.ones(n, dtype=bool)
    for outage in settings.outages:
        kept &= (motion.time_s < outage.from_s) | (motion.time_s >= outage.to_s)
    latitude, longitude = displaced_deg(motion.latitude_deg[0], truth.longitude_deg, motion.altitude_m[0], position)
    ground = np.stack([motion.velocity_north_mps[0], motion.velocity_east_mps[0]], axis=1)
    return GnssRecord(
        motion.time_s[kept],
        latitude[kept],
        longitude[kept],
        motion.altitude_m[0][kept],
        (ground + velocity)[kept],
    )
