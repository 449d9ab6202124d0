"""Family of flights with figure-eights for Monte Carlo.

They are whole flights at 10 Hz as tables, with no log on disk. A flight is a scenario drawn from its seed, hence the
same whatever the other seeds are: stand, two straights of taxi, take-off, climb to 1500 m, a figure-eight, straights on
several headings, further figure-eights.
"""

from collections.abc import Iterable, Iterator
from dataclasses import replace
from itertools import chain

import numpy as np

from groundstation.base.dataclasses import dataclass
from groundstation.base.declination import NORTH_EAST_DOWN_SIGMA_NT
from groundstation.base.errors import SettingsError
from groundstation.base.toml_settings import check_ranges, number
from groundstation.simulation.flight import Simulated, simulate
from groundstation.simulation.legs import AirTurn, ClimbTo, Fly, GroundTurn, Leg, Parked, TakeOff, Taxi
from groundstation.simulation.readings import generator
from groundstation.simulation.scenario import (
    Airport,
    Anomaly,
    BaroSettings,
    DiscreteSettings,
    ElectricSettings,
    GnssSettings,
    InsSettings,
    Load,
    MagnetometerSettings,
    Scenario,
    TruthSettings,
    Vector,
    Wind,
)

RATE_HZ = 10.0
FIELD_ALTITUDE_M, FIGURE_ALTITUDE_M = 200.0, 1500.0
LOAD_PERIOD_S, LOAD_S, LATEST_LOAD_S = 100.0, 40.0, 10_000.0
LEAST_BANK_DEG = 2.0


@dataclass(frozen=True)
class MagneticFamilySettings:
    """Settings that the flights of a family have in common.

    A ``sigma`` is that of a normal draw, per axis or matrix element.

    Parameters
    ----------
    bank_deg, bank_sigma_deg : float
        Mean of every turn's bank, and what each turn's differs from it.
    turn_deg : float
        Length of each branch of a figure; the first is to the right.
    figures, straights : int
        Straights of ``straight_s`` are flown after the first figure, a turn of 360 deg / straights between them.
    hard_iron_sigma_nt, soft_iron_sigma, misalignment_sigma_deg, scale_sigma, bank_odd_sigma_nt, bank_even_sigma_nt
        As in :class:`MagnetometerSettings`.
    latency_s : float
        Largest of a uniform draw.
    coupling_sigma_nt_per_a, load_a : float
        Sigma of the field of the current; with a load there is a topic ``electric``: ``load_a`` is on 40 s of every 100
        s.
    heading_error_sigma_deg, drift_sigma_dph, attitude_error_sigma_deg, attitude_wander_deg : float
        Errors of the INS: azimuth error and its drift, constant and wandering errors of roll and pitch.
    attitude_wander_s : float
        Correlation time of the latter.
    field_error_sigmas : float
        Difference of the world's field from the model's, north, east and down: a normal draw of so many of the sigmas
        that the model states.
    anomaly_nt, anomaly_wavelength_m : float, tuple of two float
        Amplitude of an anomaly of the crust, ends of a uniform draw of its wavelength; direction and phase are drawn.
    latitude_deg, longitude_deg : tuple of two float
        Ends of uniform draws.
    world_field_nt : tuple of three float, optional
        North, east, down instead of the World Magnetic Model.
    """

    bank_deg: float = number(20.0, LEAST_BANK_DEG, 45.0)
    bank_sigma_deg: float = number(0.5, 0.0, 10.0)
    turn_deg: float = number(375.0, 30.0, 1080.0)
    figures: int = number(2, 1, 5)
    straights: int = number(4, 0, 24)
    straight_s: float = number(30.0, 1.0, 600.0)
    airspeed_mps: float = number(70.0, 40.0, 200.0)
    wind_sigma_mps: float = number(6.0, 0.0, 20.0)
    hard_iron_sigma_nt: float = number(800.0, 0.0, 1e5)
    soft_iron_sigma: float = number(0.01, 0.0, 1.0)
    misalignment_sigma_deg: float = number(0.5, 0.0, 45.0)
    scale_sigma: float = number(0.003, 0.0, 0.5)
    bank_odd_sigma_nt: float = number(0.0, 0.0, 1e5)
    bank_even_sigma_nt: float = number(0.0, 0.0, 1e5)
    noise_nt: float = number(30.0, 0.0, 1e4)
    correlated_nt: float = number(20.0, 0.0, 1e4)
    correlation_s: float = number(20.0, 0.0, 1e4)
    latency_s: float = number(0.1, 0.0, 2.0)
    coupling_sigma_nt_per_a: float = number(0.0, 0.0, 1e4)
    load_a: float = number(0.0, -1e4, 1e4)
    heading_error_sigma_deg: float = number(1.0, 0.0, 45.0)
    drift_sigma_dph: float = number(0.05, 0.0, 100.0)
    attitude_error_sigma_deg: float = number(0.1, 0.0, 5.0)
    attitude_wander_deg: float = number(0.05, 0.0, 5.0)
    attitude_wander_s: float = number(120.0, 0.0, 1e5)
    field_error_sigmas: float = number(0.0, 0.0, 100.0)
    anomaly_nt: float = number(0.0, 0.0, 1e5)
    anomaly_wavelength_m: tuple[float, float] = (8_000.0, 40_000.0)
    latitude_deg: tuple[float, float] = (30.0, 62.0)
    longitude_deg: tuple[float, float] = (-10.0, 150.0)
    start_utc: str = "2026-05-12T08:00:00Z"
    world_field_nt: Vector | None = None

    def __post_init__(self) -> None:
        check_ranges(self)
        limits = {"latitude_deg": (-85.0, 85.0), "longitude_deg": (-180.0, 180.0), "anomaly_wavelength_m": (100.0, 1e7)}
        for name, (least, largest) in limits.items():
            low, high = getattr(self, name)
            if not least <= low <= high <= largest:
                raise SettingsError(name, f"{low:g} to {high:g}", f"two ends in order within [{least:g}, {largest:g}]")


def simulate_magnetic_family(settings: MagneticFamilySettings, seeds: Iterable[int]) -> Iterator[Simulated]:
    """Simulate one flight for each seed, one at a time.

    Yields
    ------
    Simulated
        ``flight`` has the tables ``ins``, ``gnss``, ``magnetometer``, ``discrete``, ``baro``, ``truth`` and, with a
        load, ``electric``; :func:`groundstation.simulation.deviation.scenario_deviation` tells the deviation.

    Examples
    --------
    >>> [one] = simulate_magnetic_family(MagneticFamilySettings(figures=1, straights=0), [3])
    >>> one.flight["magnetometer"].has("field_forward_nt"), one.scenario.seed
    (True, 3)
    """
    for seed in seeds:
        yield simulate(draw_magnetic_scenario(settings, seed))


def draw_magnetic_scenario(settings: MagneticFamilySettings, seed: int) -> Scenario:
    """Draw the scenario of one flight of a family."""
    rng = generator(seed, "magnetic family")
    latitude, longitude = rng.uniform(*settings.latitude_deg), rng.uniform(*settings.longitude_deg)
    parking, wind = rng.uniform(0.0, 360.0), settings.wind_sigma_mps * rng.standard_normal(2)
    ins, magnetometer = _ins(settings, rng), _magnetometer(settings, rng)
    magnetometer = _in_the_world(magnetometer, settings, generator(seed, "magnetic world"))
    return Scenario(
        name="magnetic-family",
        airport=Airport(float(latitude), float(longitude), FIELD_ALTITUDE_M),
        legs=_legs(settings, rng),
        aircraft="SIM-3",
        flight=str(seed),
        start_utc=settings.start_utc,
        seed=seed,
        internal_rate_hz=RATE_HZ,
        parking_heading_deg=float(parking),
        wind=Wind(float(np.clip(wind[0], -20.0, 20.0)), float(np.clip(wind[1], -20.0, 20.0))),
        ins=ins,
        gnss=GnssSettings(rate_hz=5.0, velocity_correlated_mps=0.015, velocity_correlation_s=3.0),
        discrete=DiscreteSettings(rate_hz=5.0),
        magnetometer=magnetometer,
        electric=_electric(settings),
        baro=BaroSettings(),
        truth=TruthSettings(rate_hz=RATE_HZ),
    )


def _ins(settings: MagneticFamilySettings, rng: np.random.Generator) -> InsSettings:
    heading, drift, roll, pitch = rng.standard_normal(4)
    return InsSettings(
        rate_hz=RATE_HZ,
        azimuth_error_deg=float(settings.heading_error_sigma_deg * heading),
        azimuth_drift_dph=float(settings.drift_sigma_dph * drift),
        roll_error_deg=float(settings.attitude_error_sigma_deg * roll),
        pitch_error_deg=float(settings.attitude_error_sigma_deg * pitch),
        attitude_wander_deg=settings.attitude_wander_deg,
        attitude_wander_s=settings.attitude_wander_s,
    )


def _magnetometer(settings: MagneticFamilySettings, rng: np.random.Generator) -> MagnetometerSettings:
    def draw(sigma: float, mean: float = 0.0) -> Vector:
        first, second, third = (mean + sigma * rng.standard_normal(3)).tolist()
        return first, second, third

    soft = np.eye(3) + settings.soft_iron_sigma * rng.standard_normal((3, 3))
    return MagnetometerSettings(
        rate_hz=RATE_HZ,
        hard_iron_nt=draw(settings.hard_iron_sigma_nt),
        soft_iron=(tuple(soft[0].tolist()), tuple(soft[1].tolist()), tuple(soft[2].tolist())),
        misalignment_deg=draw(settings.misalignment_sigma_deg),
        scale=draw(settings.scale_sigma, 1.0),
        current_nt_per_a=draw(settings.coupling_sigma_nt_per_a),
        bank_odd_nt=draw(settings.bank_odd_sigma_nt),
        bank_even_nt=draw(settings.bank_even_sigma_nt),
        noise_nt=settings.noise_nt,
        correlated_nt=settings.correlated_nt,
        correlation_s=settings.correlation_s,
        latency_s=float(rng.uniform(0.0, settings.latency_s)),
        world_field_nt=settings.world_field_nt,
    )


def _in_the_world(
    magnetometer: MagnetometerSettings, settings: MagneticFamilySettings, rng: np.random.Generator
) -> MagnetometerSettings:
    """Return the same magnetometer in a world that is not the model's."""
    north, east, down = (rng.standard_normal(3) * settings.field_error_sigmas * NORTH_EAST_DOWN_SIGMA_NT).tolist()
    wavelength_m, (direction, phase) = rng.uniform(*settings.anomaly_wavelength_m), rng.uniform(0.0, 360.0, 2)
    anomaly = Anomaly(settings.anomaly_nt, float(wavelength_m), float(direction), float(phase))
    return replace(
        magnetometer, field_error_nt=(north, east, down), anomaly=anomaly if settings.anomaly_nt > 0.0 else None
    )


def _electric(settings: MagneticFamilySettings) -> ElectricSettings | None:
    if settings.load_a == 0.0:
        return None
    starts = np.arange(0.0, LATEST_LOAD_S, LOAD_PERIOD_S)
    return ElectricSettings(loads=tuple(Load(float(start), float(start + LOAD_S), settings.load_a) for start in starts))


def _legs(settings: MagneticFamilySettings, rng: np.random.Generator) -> tuple[Leg, ...]:
    speed = settings.airspeed_mps

    def turn(angle_deg: float) -> AirTurn:
        bank = settings.bank_deg + settings.bank_sigma_deg * rng.standard_normal()
        return AirTurn(angle_deg, float(np.clip(bank, LEAST_BANK_DEG, 60.0)))

    def straight() -> Fly:
        return Fly(settings.straight_s, speed)

    def figure() -> tuple[Leg, ...]:
        return turn(settings.turn_deg), turn(-settings.turn_deg), straight()

    first = figure()
    held_out: list[Leg] = []
    for _ in range(settings.straights):
        held_out += (turn(360.0 / settings.straights), straight())
    return (
        Parked(30.0),
        Taxi(400.0, 10.0),
        GroundTurn(90.0),
        Taxi(400.0, 10.0),
        Parked(5.0),
        TakeOff(min(55.0, speed)),
        ClimbTo(FIGURE_ALTITUDE_M, speed),
        straight(),
        *first,
        *held_out,
        *chain.from_iterable(figure() for _ in range(1, settings.figures)),
    )
