"""Simulated flights along laws of control.

Is the accuracy that a plan computes met, and is it honest? Each flight draws the errors that the plan believes in,
ranges are those of the true places, and the filter takes the directions at its own estimate, as one in the air must:
what the linear covariance of a plan leaves out.
"""

import numpy as np

from groundstation.base.angles import FloatArray
from groundstation.base.dataclasses import dataclass
from groundstation.systems.planning.session.accuracy import CLOCK, EAST, NORTH, AccuracyModel
from groundstation.systems.planning.session.laws import PlannedSession
from groundstation.systems.planning.session.motion import Paths

PASSES = 3  # linearisations of each epoch: one is not enough 300 m off at ranges of 1 km


@dataclass(frozen=True)
class EndErrors:
    """Errors of many flights at the end: rms north and east (m), and NEES of both.

    ``runs`` is the number of flights.
    """

    rms_north_m: float
    rms_east_m: float
    nees: float
    runs: int


def fly(session: PlannedSession, paths: Paths, runs: int, rng: np.random.Generator) -> EndErrors:
    """Fly one law many times; only the judged aircraft is estimated, all others are exact.

    The filter is an iterated extended one (Bell and Cathey, 1993): at each epoch the ranges are taken anew about the
    estimate they led to.
    """
    model = session.model
    errors, nees = np.zeros((runs, 2)), np.zeros(runs)
    for run in range(runs):
        truth, estimate, P = _one(model, paths.position_m, rng)
        off = (estimate - truth)[[NORTH, EAST]]
        errors[run] = off
        nees[run] = off @ np.linalg.solve(P[np.ix_([NORTH, EAST], [NORTH, EAST])], off)
    rms = np.sqrt(np.mean(errors**2, axis=0))
    return EndErrors(float(rms[0]), float(rms[1]), float(nees.mean()), runs)


def _one(
    model: AccuracyModel, position_m: FloatArray, rng: np.random.Generator
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the error states at the end: true, estimated, and their covariance.

    Position = true position + error.
    """
    sources = position_m[:, [one for one in range(model.sources) if one != model.user]]
    R = model.variance_m2 * np.eye(sources.shape[1])
    F, noise = model.dynamics, np.linalg.cholesky(model.noise + 1e-12 * np.eye(model.size))
    P = model.start.copy()
    x, estimate = np.sqrt(np.diag(P)) * rng.standard_normal(model.size), np.zeros(model.size)
    for epoch in range(1, len(position_m)):
        x = F @ x + noise @ rng.standard_normal(model.size)
        estimate, P = F @ estimate, F @ P @ F.T + model.noise
        true = position_m[epoch, model.user]
        ranges = np.linalg.norm(true - sources[epoch], axis=1) + x[CLOCK]
        measured = ranges + np.sqrt(model.variance_m2) * rng.standard_normal(len(ranges))
        reckoned = true + np.array([x[NORTH], x[EAST], x[4]])
        predicted, about = estimate, estimate
        for _ in range(PASSES):
            place = reckoned - np.array([about[NORTH], about[EAST], about[4]])
            lines = place - sources[epoch]
            distance = np.linalg.norm(lines, axis=1)
            H = np.zeros((len(lines), model.size))
            H[:, [NORTH, EAST, 4]] = -lines / distance[:, None]
            H[:, CLOCK] = 1.0
            gain = P @ H.T @ np.linalg.inv(H @ P @ H.T + R)
            about = predicted + gain @ (measured - distance - about[CLOCK] - H @ (predicted - about))
        estimate = about
        P = (np.eye(model.size) - gain @ H) @ P
        P = 0.5 * (P + P.T)
    return x, estimate, P
