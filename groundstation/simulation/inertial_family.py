"""Families of flights with INS errors and GNSS for Monte Carlo.

They are many flights at 1 Hz, as vectorised arrays without a log. Run k of a family is the same flight whatever the
number of runs; each kind of randomness has its own stream, so that a switch changes what it names and nothing else.
"""

from collections.abc import Iterator
from dataclasses import field, fields
from typing import Literal
from zlib import crc32

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.dataclasses import dataclass
from groundstation.base.records import frozen
from groundstation.base.toml_settings import check_ranges, number
from groundstation.base.units import MPS2_PER_G
from groundstation.simulation.channel_truth import POSITION, RADIUS_M, TILT, VELOCITY, channel_truth
from groundstation.simulation.ins_class import InsClass, draw_instrument, load_ins_class
from groundstation.simulation.ins_draw import Streams, draw_heading_wander, draw_sensor_errors
from groundstation.simulation.ins_errors import InsErrors, propagate
from groundstation.simulation.processes import gauss_markov
from groundstation.simulation.routes import Route, RouteKind, draw_route


@dataclass(frozen=True)
class GnssErrorModel:
    """GNSS errors per horizontal axis: white + first-order Gauss-Markov.

    Position and velocity are independent.
    """

    position_white_m: float = number(10.0, 0.0, 1e4)
    position_correlated_m: float = number(0.0, 0.0, 1e4)
    position_correlation_s: float = number(300.0, 0.1, 1e5)
    velocity_white_mps: float = number(0.03, 0.0, 100.0)
    velocity_correlated_mps: float = number(0.0, 0.0, 100.0)
    velocity_correlation_s: float = number(60.0, 0.1, 1e5)

    def __post_init__(self) -> None:
        check_ranges(self)


ORDINARY_RECEIVER = GnssErrorModel(
    position_white_m=2.0,
    position_correlated_m=3.0,
    position_correlation_s=300.0,
    velocity_white_mps=0.03,
    velocity_correlated_mps=0.02,
    velocity_correlation_s=60.0,
)  # docs/evidence/forecast.md


@dataclass(frozen=True)
class FamilySettings:
    """A family of flights.

    Parameters
    ----------
    ins : str or InsClass
        Name of a shipped class, or a class.
    route : {"straight", "norilsk_moscow", "manoeuvring", "out_and_back", "dogleg", "racetrack", "late_survey"}
    duration_s, step_s : float
    gnss : GnssErrorModel
    truth : {"full", "channel"}
        ``full``: the physics of :mod:`groundstation.simulation.ins_errors`. ``channel``: the design's six-state model
        is exactly true, with ``channel_gravity_mps2`` and ``channel_radius_m``; azimuth error is zero.
    earth_rate, deflection : bool
        Switches of the full truth.
    body_fixed : bool, optional
        True where sensor errors turn with the body; None: as the class says.
    each_its_own : bool
        Every flight has an instrument of its own, better or worse than the class (:func:`ins_class.draw_instrument`).
    """

    ins: str | InsClass = "navigation"
    route: RouteKind = "straight"
    duration_s: float = number(16_000.0, 10.0, 200_000.0)
    step_s: float = number(1.0, 0.01, 10.0)
    gnss: GnssErrorModel = field(default_factory=GnssErrorModel)
    truth: Literal["full", "channel"] = "full"
    earth_rate: bool = True
    body_fixed: bool | None = None
    deflection: bool = True
    each_its_own: bool = False
    channel_gravity_mps2: float = number(MPS2_PER_G, 9.0, 10.0)
    channel_radius_m: float = number(RADIUS_M, 6.3e6, 6.5e6)

    def __post_init__(self) -> None:
        check_ranges(self)

    @property
    def ins_class(self) -> InsClass:
        """The class itself."""
        return load_ins_class(self.ins) if isinstance(self.ins, str) else self.ins


@dataclass(frozen=True)
class ErrorBatch:
    """Flights of a family: f flights, n epochs, channels (last axis) 0 north, 1 east.

    Errors are INS or GNSS - truth.

    Parameters
    ----------
    time_s : ndarray, shape (n,)
    latitude_deg, longitude_deg, altitude_m, velocity_north_mps, velocity_east_mps, heading_deg : ndarray, shape (f, n)
        Truth.
    position_error_m, velocity_error_mps, tilt_rad, drift_radps : ndarray, shape (f, n, 2)
        Errors of the INS: position in metres on the local tangent, d_lat (M + h) and d_lon (N + h) cos(lat); tilt
        positive where it makes the velocity error fall; drift is all of tilt' - velocity / R but white noise.
    azimuth_error_rad : ndarray, shape (f, n)
        Heading error of the platform, INS - truth (-phi_D).
    heading_error_rad : ndarray, shape (f, n)
        Error of the heading output: the azimuth error and the wander of the class.
    gnss_position_error_m, gnss_velocity_error_mps : ndarray, shape (f, n, 2)
    """

    time_s: FloatArray
    latitude_deg: FloatArray
    longitude_deg: FloatArray
    altitude_m: FloatArray
    velocity_north_mps: FloatArray
    velocity_east_mps: FloatArray
    heading_deg: FloatArray
    position_error_m: FloatArray
    velocity_error_mps: FloatArray
    tilt_rad: FloatArray
    drift_radps: FloatArray
    azimuth_error_rad: FloatArray
    heading_error_rad: FloatArray
    gnss_position_error_m: FloatArray
    gnss_velocity_error_mps: FloatArray

    def __post_init__(self) -> None:
        for item in fields(self):
            object.__setattr__(self, item.name, frozen(getattr(self, item.name)))

    def __len__(self) -> int:
        return len(self.latitude_deg)


def simulate_family(family: FamilySettings, runs: int, seed: int, *, first_run: int = 0) -> ErrorBatch:
    """Simulate runs ``first_run`` to ``first_run + runs - 1`` of a family.

    Parameters
    ----------
    family : FamilySettings
    runs : int
    seed : int
        Seed of the family; run k draws from streams of (seed, k).
    first_run : int

    Returns
    -------
    ErrorBatch
        About 150 bytes an epoch and flight: 0.5 GB for 200 flights of 16 000 s.

    Examples
    --------
    >>> batch = simulate_family(FamilySettings(ins="i-21", duration_s=60.0), runs=2, seed=1)
    >>> batch.position_error_m.shape
    (2, 61, 2)
    """
    time_s = np.arange(round(family.duration_s / family.step_s) + 1, dtype=np.float64) * family.step_s
    n = len(time_s)
    arrays = {
        item.name: np.empty((runs, n) if item.name in _SCALARS else (runs, n, 2))
        for item in fields(ErrorBatch)
        if item.name != "time_s"
    }
    for row in range(runs):
        for name, values in _one_run(family, time_s, seed, first_run + row).items():
            arrays[name][row] = values
    return ErrorBatch(time_s=time_s, **arrays)


def iterate_family(family: FamilySettings, runs: int, seed: int, chunk: int = 20) -> Iterator[ErrorBatch]:
    """Yield the flights of :func:`simulate_family`, ``chunk`` at a time, for bounded memory."""
    for first in range(0, runs, chunk):
        yield simulate_family(family, min(chunk, runs - first), seed, first_run=first)


_SCALARS = (
    *("latitude_deg", "longitude_deg", "altitude_m", "velocity_north_mps", "velocity_east_mps", "heading_deg"),
    *("azimuth_error_rad", "heading_error_rad"),
)


def _one_run(family: FamilySettings, time_s: FloatArray, seed: int, run: int) -> dict[str, FloatArray]:
    def streams(name: str) -> np.random.Generator:
        return np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(run, crc32(name.encode()))))

    route = draw_route(family.route, time_s, streams("route"))
    motion, ins = route.motion, family.ins_class
    if family.each_its_own:
        ins = draw_instrument(ins, streams("instrument"))
    errors = _channel_errors(family, ins, time_s, streams) if family.truth == "channel" else None
    wander = np.zeros(len(time_s))
    if errors is None:
        errors = _full_errors(family, ins, route, streams)
        wander = draw_heading_wander(streams("heading"), time_s, motion.heading_deg[0], ins.heading)
    position, velocity = draw_gnss_errors(family.gnss, len(time_s), family.step_s, streams("gnss"))
    return {
        "latitude_deg": motion.latitude_deg[0],
        "longitude_deg": route.longitude_deg,
        "altitude_m": motion.altitude_m[0],
        "velocity_north_mps": motion.velocity_north_mps[0],
        "velocity_east_mps": motion.velocity_east_mps[0],
        "heading_deg": motion.heading_deg[0],
        "position_error_m": errors.position_m[0],
        "velocity_error_mps": errors.velocity_mps[0],
        "tilt_rad": errors.tilt_rad[0],
        "drift_radps": errors.drift_radps[0],
        "azimuth_error_rad": errors.azimuth_rad[0],
        "heading_error_rad": errors.azimuth_rad[0] + np.deg2rad(wander),
        "gnss_position_error_m": position,
        "gnss_velocity_error_mps": velocity,
    }


def _full_errors(family: FamilySettings, ins: InsClass, route: Route, streams: Streams) -> InsErrors:
    body_fixed = ins.is_strapdown if family.body_fixed is None else family.body_fixed
    sensors = draw_sensor_errors(
        ins,
        route.motion,
        streams,
        earth_rate=family.earth_rate,
        body_fixed=body_fixed,
        deflection=family.deflection,
    )
    return propagate(route.motion, sensors, earth_rate=family.earth_rate, body_fixed=body_fixed)


def _channel_errors(family: FamilySettings, ins: InsClass, time_s: FloatArray, streams: Streams) -> InsErrors:
    drawn = channel_truth(
        ins,
        len(time_s),
        family.step_s,
        streams("channel"),
        gravity_mps2=family.channel_gravity_mps2,
        radius_m=family.channel_radius_m,
    )
    states = np.moveaxis(drawn.states, 0, 1)[None]
    return InsErrors(
        position_m=states[..., POSITION],
        velocity_mps=states[..., VELOCITY],
        tilt_rad=states[..., TILT],
        drift_radps=np.moveaxis(drawn.drift_radps, 0, 1)[None],
        azimuth_rad=np.zeros((1, len(time_s))),
    )


def draw_gnss_errors(
    noise: GnssErrorModel, n: int, step_s: float, rng: np.random.Generator
) -> tuple[FloatArray, FloatArray]:
    """Return position and velocity errors, north and east, shapes (n, 2)."""
    white = rng.standard_normal((4, n))
    position = noise.position_white_m * white[:2]
    velocity = noise.velocity_white_mps * white[2:]
    if noise.position_correlated_m > 0.0:
        position += gauss_markov(rng, (2, n), step_s, noise.position_correlated_m, noise.position_correlation_s)
    if noise.velocity_correlated_mps > 0.0:
        velocity += gauss_markov(rng, (2, n), step_s, noise.velocity_correlated_mps, noise.velocity_correlation_s)
    return position.T, velocity.T
