"""Simulated sessions of several aircraft: inputs of the estimators, and the truth."""

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.dataclasses import dataclass
from groundstation.base.ecef import ecef_from_n, geodetic_deg_m
from groundstation.base.records import frozen
from groundstation.simulation.session_errors import VehicleErrors, draw_errors
from groundstation.simulation.session_links import SimulatedAircraft, draw_ranges, draw_satellite_ranges
from groundstation.simulation.session_motion import AircraftMotion, fly, grid_s, place_m
from groundstation.simulation.session_scenario import SessionAircraft, SessionPoint, SessionScenario
from groundstation.tables.session import DeadReckoning, GroundPoint, Session

FIXED_POINTS = 4  # each gains five digits: the axes turn by 5e-5 rad in 300 m


@dataclass(frozen=True)
class VehicleTruth:
    """Truth of one aircraft at the epochs of its dead reckoning.

    Parameters
    ----------
    name : str
    time_s : ndarray, shape (n,)
    position_m : ndarray, shape (n, 3)
        Frame of the session.
    states : ndarray, shape (n, 7) or (n, 13) or (n, 15)
        Errors in the order of the design: local x, y, vx, vy, height, clock offset, clock frequency; global position
        north, east, velocity north, east, tilt and drift about north, east, down (rad, rad/s), height, clock offset
        and frequency, then those of the satellite receiver where it has a clock of its own.
    """

    name: str
    time_s: FloatArray
    position_m: FloatArray
    states: FloatArray

    def __post_init__(self) -> None:
        for name in ("time_s", "position_m", "states"):
            object.__setattr__(self, name, frozen(getattr(self, name)))


@dataclass(frozen=True)
class SimulatedSession:
    """Session and its truth, vehicles in the same order.

    ``point_errors_m`` is believed minus true position.
    """

    session: Session
    truth: tuple[VehicleTruth, ...]
    point_errors_m: dict[str, tuple[float, float, float]]


def simulate_session(scenario: SessionScenario, seed: int, run: int = 0, *, scale: float = 1.0) -> SimulatedSession:
    """Fly a scenario once.

    Parameters
    ----------
    scenario : SessionScenario
    seed, run : int
        Run k of a seed is the same whatever the number of runs; every aircraft, the points and the link have a
        generator of their own.
    scale : float
        Every error times this: 0 gives a session without errors.

    It ignores the motion of an aircraft while a signal of the link travels (2 cm at 30 km).
    """
    time_s = grid_s(scenario)
    seeds = np.random.SeedSequence((seed, run)).spawn(len(scenario.aircraft) + 3)
    generators = [np.random.default_rng(item) for item in seeds]
    flown, vehicles, truths = [], [], []
    for aircraft, rng in zip(scenario.aircraft, generators, strict=False):
        motion = fly(scenario, aircraft)
        errors = _scaled(draw_errors(scenario, motion, aircraft.height_m, rng), scale)
        flown.append(SimulatedAircraft(aircraft, motion, errors))
        epochs = _epochs(scenario, aircraft, time_s)
        vehicles.append(_dead_reckoning(scenario, aircraft, motion, errors, epochs))
        truths.append(_truth(scenario, aircraft, motion, errors, epochs))
    wrong = {
        point.name: scale * point.position_sigma_m * generators[-3].standard_normal(2) for point in scenario.points
    }
    points = tuple(_point(scenario, point, wrong[point.name]) for point in scenario.points)
    session = Session(
        frame=scenario.frame,
        vehicles=tuple(vehicles),
        points=points,
        ranges=draw_ranges(scenario, flown, generators[-2], scale),
        satellites=draw_satellite_ranges(scenario, flown, generators[-1], scale),
        ranks={one.name: one.rank for one in scenario.aircraft} | {one.name: one.rank for one in scenario.points},
    )
    errors_m = {name: (float(error[0]), float(error[1]), 0.0) for name, error in wrong.items()}
    return SimulatedSession(session, tuple(truths), errors_m)


def _scaled(errors: VehicleErrors, scale: float) -> VehicleErrors:
    return errors if scale == 1.0 else VehicleErrors(*(scale * value for value in vars(errors).values()))


def _epochs(scenario: SessionScenario, aircraft: SessionAircraft, time_s: FloatArray) -> slice:
    """Places of the dead reckoning's epochs on the grid."""
    every = max(1, round(scenario.epoch_s / scenario.link.slot_s))
    first = int(np.ceil(aircraft.appears_s / scenario.epoch_s - 1e-9)) * every
    last = int(np.searchsorted(time_s, aircraft.leaves_s + 1e-9))
    return slice(first, last, every)


def _dead_reckoning(
    scenario: SessionScenario, aircraft: SessionAircraft, motion: AircraftMotion, errors: VehicleErrors, epochs: slice
) -> DeadReckoning:
    position, axes, latitude = motion.position_m[epochs], motion.axes[epochs], motion.latitude_deg[epochs]
    error = np.concatenate([errors.position_m, -errors.height_m[:, None]], axis=1)[epochs]
    read = position + np.einsum("nij,nj->ni", axes, error)
    if scenario.frame == "ecef":
        for _ in range(FIXED_POINTS):  # the error is counted along the axes at the place that is read
            latitude, longitude, _ = geodetic_deg_m(read)
            axes = ecef_from_n(latitude, longitude)
            read = position + np.einsum("nij,nj->ni", axes, error)
    velocity = motion.velocity_mps[epochs].copy()
    velocity[:, :2] += errors.velocity_mps[epochs]
    heading = motion.track_deg[epochs] % 360.0
    return DeadReckoning(aircraft.name, motion.time_s[epochs], read, velocity, axes, latitude, heading)


def _truth(
    scenario: SessionScenario, aircraft: SessionAircraft, motion: AircraftMotion, errors: VehicleErrors, epochs: slice
) -> VehicleTruth:
    one = [errors.height_m[:, None], errors.clock_m[:, None], errors.clock_mps[:, None]]
    parts = [errors.position_m, errors.velocity_mps]
    if scenario.frame == "ecef":
        parts += [errors.tilt_rad, errors.drift_radps]
    parts += one
    if scenario.errors.has_separate_clocks:
        parts += [errors.receiver_clock_m[:, None], errors.receiver_clock_mps[:, None]]
    states = np.concatenate(parts, axis=1)[epochs]
    return VehicleTruth(aircraft.name, motion.time_s[epochs], motion.position_m[epochs], states)


def _point(scenario: SessionScenario, point: SessionPoint, wrong_m: FloatArray) -> GroundPoint:
    place = place_m(scenario, point)
    if scenario.frame == "ecef":
        latitude, longitude, _ = geodetic_deg_m(place)
        place = place + ecef_from_n(latitude, longitude)[:, :2] @ wrong_m
    else:
        place = place + np.array([wrong_m[0], wrong_m[1], 0.0])
    return GroundPoint(point.name, (float(place[0]), float(place[1]), float(place[2])), point.position_sigma_m)
