"""Error states of the approach and their dynamics.

There are seven of the local frame, then those of the moving point and of the ranges.

State: INS position along, right (m), INS velocity along, right (m/s), barometric height (m), clock offset (m), clock
rate (m/s); then the moving point's along, right, up (m); then one slow range error for each point (m), where modelled.
Error = reading - truth.
"""

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.dataclasses import dataclass
from groundstation.base.records import frozen
from groundstation.methods.link_dynamics import discretise, local_dynamics
from groundstation.systems.planning.landing.scenario import RangeApproach

OWN, PLACE, CLOCK = slice(0, 7), (0, 1, 4), 5  # the place's along, right and up errors are the states PLACE


@dataclass(frozen=True)
class ErrorModel:
    """Linear error model at the step of the measurements.

    Parameters
    ----------
    F, Q : ndarrays, shape (n, n)
        Transition and covariance of the noise of one step.
    P0 : ndarray, shape (n, n)
        Covariance at the start.
    moving : int
        First state of the moving point, -1: none.
    slow : int
        First state of the slow range errors, -1: none.
    """

    F: FloatArray
    Q: FloatArray
    P0: FloatArray
    moving: int
    slow: int

    def __post_init__(self) -> None:
        for name in ("F", "Q", "P0"):
            object.__setattr__(self, name, frozen(getattr(self, name)))

    @property
    def size(self) -> int:
        """Number of states."""
        return len(self.F)


def error_model(scenario: RangeApproach, *, has_slow_errors: bool) -> ErrorModel:
    """Error model of a scenario.

    Parameters
    ----------
    scenario : RangeApproach
    has_slow_errors : bool
        Whether the correlated part of the ranges' errors is among the states.
    """
    own, moving, noise = scenario.own, scenario.moving, scenario.noise
    dynamics = [local_dynamics(own.velocity_s, own.baro_s, own.clock_s)]
    start = [own.position_m, own.position_m, own.velocity_mps, own.velocity_mps, own.baro_m, own.clock_m, own.clock_mps]
    driven = [0.0, 0.0, *[2.0 * own.velocity_mps**2 / own.velocity_s] * 2, 2.0 * own.baro_m**2 / own.baro_s, 0.0]
    driven.append(2.0 * own.clock_mps**2 / own.clock_s)
    first_moving = first_slow = -1
    if moving is not None:
        first_moving = len(start)
        sigmas = [moving.position_sigma_m, moving.position_sigma_m, moving.height_sigma_m]
        dynamics.append(np.eye(3) * (-1.0 / moving.error_s))
        start += sigmas
        driven += [2.0 * sigma**2 / moving.error_s for sigma in sigmas]
    if has_slow_errors and noise.correlated_m > 0.0:
        first_slow, count = len(start), len(scenario.points) + (moving is not None)
        dynamics.append(np.eye(count) * (-1.0 / noise.correlation_s))
        start += [noise.correlated_m] * count
        driven += [2.0 * noise.correlated_m**2 / noise.correlation_s] * count
    whole, at = np.zeros((len(start), len(start))), 0
    for block in dynamics:
        whole[at : at + len(block), at : at + len(block)] = block
        at += len(block)
    F, Q = discretise(whole, np.array(driven), noise.interval_s)
    return ErrorModel(F, Q, np.diag(np.square(start)), first_moving, first_slow)
