"""Short problems for tests of the estimator's core: starts at the truth, epochs by hand, corrections between states."""

from functools import cache

import numpy as np
from numpy.typing import NDArray

from groundstation.base.geodesy import curvature_radii_m
from groundstation.simulation.imu.families import Family
from groundstation.simulation.imu.flight import ImuFlight, simulate_imu
from groundstation.simulation.imu.motion import true_states
from groundstation.simulation.imu.settings import ImuSettings
from groundstation.systems.trajectory.forward import BLOCK, run_forward
from groundstation.systems.trajectory.inputs import ImuIncrements
from groundstation.systems.trajectory.layout import Plan, Samples, fill_gaps
from groundstation.systems.trajectory.model import Model, gate
from groundstation.systems.trajectory.passes import (
    NOTHING_HELD,
    OWN_ESTIMATE,
    PATTERN,
    Start,
    linear_room,
    make_room,
    moved,
    nothing_kept,
)
from groundstation.systems.trajectory.start import quaternion_of
from groundstation.systems.trajectory.states import BARO, LEV, MNT, NAVIGATION, SLOW, STATES, Linear, Schedule, Seen

FloatArray = NDArray[np.float64]
NOISE = Model().noise(np.ones(3))
# what a correction of each state may be: m, m/s, rad, ...
SIZES = np.concatenate(
    [
        np.full(3, 10.0),
        np.full(3, 1.0),
        np.full(3, 0.1),
        np.full(3, np.radians(1.0)),
        np.full(3, 0.5),
        np.full(15, 0.005),
        np.full(3, 1.0),
        [0.3, 0.1],
        np.full(6, 3.0),
        np.full(2, 0.1),
        [5.0],
        [0.02],
    ]
)


@cache
def perfect(family: Family, rate_hz: float = 100.0, duration_s: float = 200.0, seed: int = 3) -> ImuFlight:
    """Log of a unit without errors."""
    return simulate_imu(family, seed, settings=ImuSettings(duration_s=duration_s, rate_hz=rate_hz, error_factor=0.0))


def samples_of(flight: ImuFlight) -> Samples:
    """Increments of a log at their true times."""
    return fill_gaps(
        ImuIncrements(flight.true_time_s, flight.interval_s, flight.delta_angle_rad, flight.delta_velocity_mps)
    )


def start_at(flight: ImuFlight, time_s: float, value: FloatArray | None = None) -> Start:
    """Start at the truth, without covariance."""
    truth = true_states(flight.motion, np.array([time_s]))
    nav = np.empty(10)
    nav[:2] = np.radians(truth.latitude_deg[0]), np.radians(truth.longitude_deg[0])
    nav[2] = truth.height_m[0]
    nav[3:6] = truth.velocity_mps[0]
    nav[6:] = quaternion_of(truth.n_from_b[0])
    constants = np.zeros(STATES) if value is None else value
    return Start(nav, constants, np.zeros((STATES, STATES)), np.zeros(STATES))


def nothing_seen() -> Seen:
    """No measurements."""
    wide = np.zeros((0, 3))
    return Seen(np.zeros(0, dtype=np.int64), np.zeros(0), wide, wide, wide, wide)


def plan_of(samples: Samples, edges: list[int], seen: Seen | None = None, first_seen: list[int] | None = None) -> Plan:
    """Epochs that end before samples ``edges``; the first is the start."""
    found = nothing_seen() if seen is None else seen
    starts = np.zeros(len(edges) + 1) if first_seen is None else first_seen
    ends = np.concatenate([[samples.begin_s], samples.time_s])
    return Plan(
        Schedule(
            np.array([edges[0], *edges], dtype=np.int64),
            np.asarray(starts, dtype=np.int64),
            np.arange(len(samples.time_s)),
        ),
        found,
        np.arange(len(found.kind)),
        ends[edges],
    )


def carried(samples: Samples, plan: Plan, start: Start) -> Linear:
    """Carry a start over the epochs of a plan, without any measurement used."""
    linear = linear_room(plan)
    run_forward(
        samples.imu,
        plan.schedule,
        plan.seen,
        NOISE,
        gate(),
        PATTERN,
        NOTHING_HELD,
        OWN_ESTIMATE,
        True,
        False,
        0,
        len(plan.epoch_s),
        start.now(),
        make_room(),
        linear,
        nothing_kept(),
    )
    return linear


def nudged(start: Start, state: int, by: float) -> Start:
    """Start with one state corrected."""
    correction = np.zeros(STATES)
    correction[state] = by
    return moved(start, correction)


def rotation_of(quaternion: FloatArray) -> FloatArray:
    """Rotation matrices of quaternions wxyz, shapes (..., 4) and (..., 3, 3)."""
    w, x, y, z = np.moveaxis(quaternion, -1, 0)
    rows = [
        [w * w + x * x - y * y - z * z, 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), w * w - x * x + y * y - z * z, 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z],
    ]
    return np.moveaxis(np.array(rows), (0, 1), (-2, -1))


def correction_between(estimate: FloatArray, better: FloatArray) -> FloatArray:
    """Correction (9,) that leads from one navigation state (10,) to another near by."""
    north, east = (float(one) for one in curvature_radii_m(np.degrees(estimate[0])))
    turn = rotation_of(better[6:]) @ rotation_of(estimate[6:]).T
    vector = 0.5 * np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]])
    return np.concatenate(
        [
            [
                (better[0] - estimate[0]) * (north + estimate[2]),
                (better[1] - estimate[1]) * (east + estimate[2]) * np.cos(estimate[0]),
                estimate[2] - better[2],
            ],
            better[3:6] - estimate[3:6],
            vector,
        ]
    )


def transition(linear: Linear, epoch: int) -> FloatArray:
    """Transition of an epoch as a square matrix."""
    F = np.eye(STATES)
    F[:NAVIGATION, :LEV] = linear.F[epoch, :BLOCK].reshape(NAVIGATION, LEV)
    for place, state in enumerate((*range(SLOW, MNT), BARO)):
        F[state, state] = linear.F[epoch, BLOCK + place]
    return F
