"""Small sessions of several aircraft for the tests of navigation between aircraft."""

from dataclasses import fields, replace

import numpy as np

from groundstation.simulation.session import SimulatedSession, VehicleTruth
from groundstation.simulation.session_scenario import (
    SessionAircraft,
    SessionErrorSigmas,
    SessionPoint,
    SessionScenario,
    SessionTurn,
)
from groundstation.systems.cooperative.settings import CooperativeSettings, InsBelief

TRIANGLE = (
    SessionAircraft("A", 0.0, 0.0, rank=1),
    SessionAircraft("B", 0.0, 30_000.0, rank=1, turns=(SessionTurn(30.0, 3.0, 30.0),)),
    SessionAircraft("C", -25_981.0, 15_000.0, rank=2),
)
POINTS = (SessionPoint("N1", 50_000.0, -30_000.0), SessionPoint("N2", 100_000.0, 60_000.0))
GLOBAL_ERRORS = SessionErrorSigmas(position_m=106.0, velocity_mps=0.15, baro_m=10.0)
LOCAL = SessionScenario("local", "local", TRIANGLE, duration_s=60.0, points=POINTS)
GLOBAL = SessionScenario(
    "global",
    "ecef",
    tuple(replace(one, satellites=("GPS-13", "GLO-733", "GPS-17", "GLO-735")) for one in TRIANGLE),
    duration_s=60.0,
    errors=GLOBAL_ERRORS,
)


def believed(scenario: SessionScenario, **changes: object) -> CooperativeSettings:
    """Settings whose belief is what the scenario draws from."""
    errors = scenario.errors
    belief = InsBelief(**{item.name: getattr(errors, item.name) for item in fields(InsBelief)})
    return CooperativeSettings(ins=belief, **changes)  # type: ignore[arg-type]


def truth_of(simulated: SimulatedSession) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    return {one.name: (one.time_s, one.position_m) for one in simulated.truth}


def full_nees(state: np.ndarray, covariance: np.ndarray, truth: VehicleTruth, epoch: int = -1) -> float:
    """Squared error of all states of one vehicle over its covariance."""
    error = state[epoch] - truth.states[epoch]
    sigma = np.sqrt(np.diag(covariance[epoch]))
    normal = error / sigma
    return float(normal @ np.linalg.solve(covariance[epoch] / np.outer(sigma, sigma), normal))
