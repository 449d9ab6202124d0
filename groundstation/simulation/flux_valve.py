"""Flights with a flux valve: legs and turns, a compass that gives heading alone, the wind.

The valve hangs, so that it leans with the aircraft in a turn; its reading is displayed with a lag, or corrects a gyro.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from groundstation.base.angles import FloatArray, unwrap, wrap_180, wrap_360
from groundstation.base.dataclasses import dataclass
from groundstation.base.declination import declination_along
from groundstation.base.geodesy import SEMI_MAJOR_M
from groundstation.base.records import Column
from groundstation.base.timescales import iso_to_utc_ns
from groundstation.base.toml_settings import check_ranges, number
from groundstation.base.units import NS_PER_S
from groundstation.simulation.readings import generator, quantised, quantised_heading
from groundstation.simulation.trajectory import rotation_n_from_b
from groundstation.tables.table import Flight, Table

GRAVITY_MPS2 = 9.81
PARKED_S, ROLL_IN_DPS, LEAST_BEND_DEG = 60.0, 6.0, 1.0
LATITUDE_DEG, LONGITUDE_DEG, ALTITUDE_M = 55.0, 37.0, 1500.0
STEPS = 20  # of the iteration from magnetic heading to reading
INS_STEP_DEG, VELOCITY_STEP_MPS, PLACE_STEP_DEG = 0.001, 0.01, 1e-7


@dataclass(frozen=True)
class FluxFlightSettings:
    """Settings of a flight with a flux valve, 1 Hz; a ``sigma`` is that of a normal draw.

    Parameters
    ----------
    headings_deg : tuple of float
        True headings of the legs less that of the first, which is drawn.
    is_shuffled : bool
        The order of the legs is drawn.
    full_turns : int
        Full circles after the legs, right and left by turns.
    lean : float
        Share of the bank by which the sensing element leans.
    lag_s, slaved_s : float
        Time constant of the display, and of the slaving of a gyro; with the latter the former is not read.
    with_ins : bool
        A true heading of an INS is in the log.
    load_deg : float
        Change of B on every second leg.
    declination_off_deg : float
        Error of the declination besides ``declination_sigma_deg``, the sign drawn.
    """

    headings_deg: tuple[float, ...] = (0.0, 45.0, 90.0, 135.0, 180.0, 225.0, 270.0, 315.0)
    is_shuffled: bool = True
    leg_s: float = number(120.0, 10.0, 10_000.0)
    full_turns: int = number(0, 0, 20)
    bank_deg: float = number(18.0, 2.0, 45.0)
    airspeed_mps: float = number(60.0, 20.0, 300.0)
    coefficients_sigma_deg: tuple[float, ...] = (1.0, 3.0, 3.0, 1.0, 1.0)
    lean: float = number(1.0, 0.0, 1.0)
    lag_s: float = number(1.0, 0.0, 60.0)
    slaved_s: float = number(0.0, 0.0, 3600.0)
    noise_deg: float = number(0.3, 0.0, 30.0)
    noise_s: float = number(3.0, 0.1, 600.0)
    step_deg: float = number(0.5, 1e-4, 10.0)
    with_ins: bool = True
    ins_sigma_deg: float = number(1.0, 0.0, 45.0)
    ins_drift_sigma_dph: float = number(0.1, 0.0, 100.0)
    roll_sigma_deg: float = number(0.2, 0.0, 10.0)
    wind_sigma_mps: float = number(8.0, 0.0, 50.0)
    wind_wander_mps: float = number(0.0, 0.0, 30.0)
    wind_wander_s: float = number(1800.0, 1.0, 1e6)
    gust_mps: float = number(0.5, 0.0, 30.0)
    gust_s: float = number(60.0, 1.0, 1e5)
    sideslip_sigma_deg: float = number(0.3, 0.0, 20.0)
    leg_slip_sigma_deg: float = number(0.2, 0.0, 20.0)
    airspeed_scale_sigma: float = number(0.02, 0.0, 0.5)
    airspeed_noise_mps: float = number(0.3, 0.0, 10.0)
    velocity_noise_mps: float = number(0.05, 0.0, 10.0)
    declination_sigma_deg: float = number(0.4, 0.0, 20.0)
    declination_off_deg: float = number(0.0, 0.0, 20.0)
    load_deg: float = number(0.0, 0.0, 30.0)
    start_utc: str = "2026-05-12T08:00:00Z"

    def __post_init__(self) -> None:
        check_ranges(self)


@dataclass(frozen=True)
class FluxFlight:
    """A flight with a flux valve and its truth: A to E, shape (5,), and the true heading."""

    flight: Flight
    coefficients_deg: FloatArray
    true_heading_deg: FloatArray


def valve_heading_deg(
    magnetic_deg: FloatArray, lean_deg: FloatArray, horizontal_nt: float, down_nt: float
) -> FloatArray:
    """Return the heading that a valve senses in its own plane, which leans to the right.

    Examples
    --------
    >>> valve_heading_deg(np.array([0.0]), np.array([0.0]), 17e3, 50e3).tolist()
    [0.0]
    """
    level = np.zeros_like(lean_deg)
    body_from_n = np.swapaxes(rotation_n_from_b(lean_deg, level, magnetic_deg), 1, 2)
    sensed = body_from_n @ np.array([horizontal_nt, 0.0, down_nt])
    return wrap_360(np.rad2deg(np.arctan2(-sensed[:, 1], sensed[:, 0])))


def simulate_flux_flight(settings: FluxFlightSettings, seed: int) -> FluxFlight:
    """Simulate one flight: topics ``ins``, ``gnss``, ``air``, ``discrete``."""
    rng = generator(seed, "flux flight")
    coefficients = rng.normal(0.0, settings.coefficients_sigma_deg)
    heading, bank, leg = _motion(settings, rng)
    count = len(heading)
    airborne = leg >= 0
    place = np.full(1, LATITUDE_DEG), np.full(1, LONGITUDE_DEG), np.full(1, ALTITUDE_M)
    start_ns = iso_to_utc_ns(settings.start_utc)[0]
    model = declination_along(*place, start_ns)
    off = settings.declination_sigma_deg * rng.standard_normal()
    off += settings.declination_off_deg * float(rng.choice([-1.0, 1.0]))
    magnetic = heading - float(model.values_deg[0]) - off
    shown = _shown(
        settings, rng, magnetic, bank, leg, coefficients, float(model.horizontal_nt[0]), float(model.down_nt[0])
    )
    slip = settings.sideslip_sigma_deg * rng.standard_normal()
    each = settings.leg_slip_sigma_deg * rng.standard_normal(int(leg.max()) + 2)
    path_rad = np.deg2rad(heading + slip + each[leg])
    airspeed = np.where(airborne, settings.airspeed_mps, 0.0)
    wind = [
        settings.wind_sigma_mps * rng.standard_normal()
        + settings.wind_wander_mps * _wandering(rng, count, settings.wind_wander_s)
        + settings.gust_mps * _wandering(rng, count, settings.gust_s)
        for _ in range(2)
    ]
    ground = [
        np.where(airborne, airspeed * part + blown, 0.0)
        for part, blown in zip((np.cos(path_rad), np.sin(path_rad)), wind, strict=True)
    ]
    noisy = [
        part + settings.velocity_noise_mps * (rng.standard_normal(count) + _wandering(rng, count, 4.0))
        for part in ground
    ]
    scale = 1.0 + settings.airspeed_scale_sigma * rng.standard_normal()
    logged = np.maximum(airspeed / scale + settings.airspeed_noise_mps * rng.standard_normal(count), 0.0)
    error, drift = settings.ins_sigma_deg * rng.standard_normal(), settings.ins_drift_sigma_dph * rng.standard_normal()
    by_ins = heading + error + drift * np.arange(count) / 3600.0
    latitude = LATITUDE_DEG + np.rad2deg(np.cumsum(ground[0]) / SEMI_MAJOR_M)
    longitude = LONGITUDE_DEG + np.rad2deg(np.cumsum(ground[1]) / SEMI_MAJOR_M) / np.cos(np.deg2rad(LATITUDE_DEG))
    ins = {
        "magnetic_heading_deg": quantised_heading(shown, settings.step_deg),
        "roll_deg": quantised(bank + settings.roll_sigma_deg * rng.standard_normal(), 0.01),
    }
    if settings.with_ins:
        ins["true_heading_deg"] = quantised_heading(by_ins, INS_STEP_DEG)
    gnss = {
        "latitude_deg": quantised(latitude, PLACE_STEP_DEG),
        "longitude_deg": quantised(longitude, PLACE_STEP_DEG),
        "altitude_ellipsoid_m": np.where(airborne, ALTITUDE_M, 150.0),
        "velocity_north_mps": quantised(noisy[0], VELOCITY_STEP_MPS),
        "velocity_east_mps": quantised(noisy[1], VELOCITY_STEP_MPS),
    }
    tables = {
        "ins": _table("ins", start_ns, ins),
        "gnss": _table("gnss", start_ns, gnss),
        "air": _table("air", start_ns, {"true_airspeed_mps": quantised(logged, VELOCITY_STEP_MPS)}),
        "discrete": _table("discrete", start_ns, {"weight_on_wheels": ~airborne}),
    }
    metadata = {"aircraft": "SIM-F", "flight": str(seed), "start_utc": settings.start_utc}
    return FluxFlight(Flight(tables, metadata, start_ns, True, "flux.csv"), coefficients, wrap_360(heading))


def _motion(settings: FluxFlightSettings, rng: np.random.Generator) -> tuple[FloatArray, FloatArray, np.ndarray]:
    """Return continuous true heading, bank and number of the leg, one a second.

    The number is -1 on the ground.

    A turn belongs to the leg after it.
    """
    first = rng.uniform(0.0, 360.0)
    offsets = np.array(settings.headings_deg)
    if settings.is_shuffled:
        offsets = offsets[rng.permutation(len(offsets))]
    headings, banks = [np.full(int(PARKED_S), first + offsets[0])], [np.zeros(int(PARKED_S))]
    legs = [np.full(int(PARKED_S), -1)]
    bends = [0.0, *wrap_180(np.diff(offsets)).tolist()]
    bends += [360.0 if place % 2 == 0 else -360.0 for place in range(settings.full_turns)]
    for place, bend in enumerate(bends):
        turned, bank = _turn(bend, settings)
        straight = int(settings.leg_s)
        start = headings[-1][-1]
        headings += [start + turned, np.full(straight, start + (turned[-1] if len(turned) else 0.0))]
        banks += [bank, np.zeros(straight)]
        legs.append(np.full(len(turned) + straight, place))
    return np.concatenate(headings), np.concatenate(banks), np.concatenate(legs)


def _turn(bend_deg: float, settings: FluxFlightSettings) -> tuple[FloatArray, FloatArray]:
    """Return heading turned and bank of a coordinated turn, one a second."""
    if abs(bend_deg) < LEAST_BEND_DEG:
        return np.zeros(0), np.zeros(0)
    full = np.rad2deg(GRAVITY_MPS2 * np.tan(np.deg2rad(settings.bank_deg)) / settings.airspeed_mps)
    ramp = settings.bank_deg / ROLL_IN_DPS
    seconds = max(abs(bend_deg) / full + ramp, 2.0 * ramp + 1.0)
    time = np.arange(1.0, np.ceil(seconds) + 1.0)
    shape = np.clip(np.minimum(time / ramp, (time[-1] - time) / ramp), 0.0, 1.0)
    rate = np.rad2deg(GRAVITY_MPS2 * np.tan(np.deg2rad(settings.bank_deg * shape)) / settings.airspeed_mps)
    factor = abs(bend_deg) / float(np.sum(rate))
    bank = np.rad2deg(np.arctan(np.deg2rad(rate * factor) * settings.airspeed_mps / GRAVITY_MPS2))
    return np.sign(bend_deg) * np.cumsum(rate) * factor, np.sign(bend_deg) * bank


def _shown(
    settings: FluxFlightSettings,
    rng: np.random.Generator,
    magnetic_deg: FloatArray,
    bank_deg: FloatArray,
    leg: np.ndarray,
    coefficients_deg: FloatArray,
    horizontal_nt: float,
    down_nt: float,
) -> FloatArray:
    """Return the heading displayed.

    The valve senses it, with its deviation, and the display follows."""
    sensed = valve_heading_deg(magnetic_deg, settings.lean * bank_deg, horizontal_nt, down_nt)
    sensed = magnetic_deg + wrap_180(sensed - magnetic_deg)
    a, b, c, d, e = coefficients_deg
    loaded = b + settings.load_deg * (leg % 2 == 1)
    reading = sensed.copy()
    for _ in range(STEPS):
        rad = np.deg2rad(reading)
        reading = sensed + a + loaded * np.sin(rad) + c * np.cos(rad) + d * np.sin(2 * rad) + e * np.cos(2 * rad)
    noise = settings.noise_deg * _wandering(rng, len(reading), settings.noise_s)
    if settings.slaved_s > 0.0:
        keep = np.exp(-1.0 / settings.slaved_s)
        away = wrap_180(reading - magnetic_deg)
        followed = lfilter([1.0 - keep], [1.0, -keep], away, zi=[keep * away[0]])[0]
        return np.asarray(magnetic_deg + followed + noise)
    keep = np.exp(-1.0 / settings.lag_s) if settings.lag_s > 0.0 else 0.0
    going_on = unwrap(wrap_360(reading))
    return np.asarray(lfilter([1.0 - keep], [1.0, -keep], going_on, zi=[keep * going_on[0]])[0] + noise)


def _wandering(rng: np.random.Generator, count: int, time_s: float) -> FloatArray:
    """First-order Gauss-Markov noise of unit variance, one a second."""
    keep = np.exp(-1.0 / time_s)
    white = rng.standard_normal(count) * np.sqrt(1.0 - keep**2)
    white[0] = rng.standard_normal()
    return np.asarray(lfilter([1.0], [1.0, -keep], white))


def _table(topic: str, start_ns: int, columns: Mapping[str, NDArray[Any]]) -> Table:
    count = len(next(iter(columns.values())))
    device_ns = np.arange(count, dtype=np.int64) * NS_PER_S
    made = {name: Column(values) for name, values in columns.items()}
    return Table(topic, start_ns + device_ns, made, np.arange(count), Column(device_ns))
