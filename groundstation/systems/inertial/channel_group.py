"""Channels with a common covariance, filtered together.

The sigma is widened through outages at whose end GNSS is beyond the gate.
"""

import numpy as np
from numpy.typing import NDArray

from groundstation.base.dataclasses import dataclass
from groundstation.base.records import BoolArray, Int64Array
from groundstation.methods.kalman import filter as kalman
from groundstation.methods.kalman.arrays import NO_STEP, REJECTED, USED, Drive, MeasurementRows
from groundstation.methods.kalman.transition import Transition
from groundstation.systems.inertial.model import POSITION, SIZE, VELOCITY, FloatArray
from groundstation.systems.inertial.seams import Fixes, Seam, fixes_since, returns_of
from groundstation.systems.inertial.steps import Steps

MOST_SEAMS = 50  # each costs a run; a class that fits its INS so badly is told by the count
RESET_POSITION_M, RESET_VELOCITY_MPS = 2e4, 20.0  # what a reset of the INS may change; tilt and drift are kept
KINDS = np.array([POSITION, VELOCITY])


@dataclass(frozen=True)
class GroupRun:
    """Run of the channels of a group, with its steps and the seams that widened some of them.

    ``mark`` (n, 2): rejected -1, absent 0, used 1; rejected too what was odd at a seam and not shown to the filter.
    """

    run: kalman.FilterRun
    mark: NDArray[np.int8]
    steps: Steps
    seams: tuple[Seam, ...]

    def forecast(self, drive: Drive, at: int, end: int) -> tuple[FloatArray, FloatArray]:
        """Forecast states and covariances at the epochs behind ``at`` up to ``end``.

        Nothing is measured from there on.
        """
        x, P, states, covariances = self.run.x[at], self.run.P[at], [], []
        for epoch in range(at + 1, end + 1):
            step = self.steps.index[epoch]
            phi, moved = self.steps.transitions[step], drive.push[epoch] + drive.mix[epoch] @ x[drive.state]
            x, P = phi @ x, phi @ P @ phi.T + self.steps.noises[step]
            x[drive.state] += moved
            states.append(x)
            covariances.append(P)
        return np.array(states), np.array(covariances)


@dataclass(frozen=True)
class ChannelGroup:
    """Inputs of the filter for c channels that are measured at the same epochs.

    Parameters
    ----------
    time_s : ndarray, shape (n,)
    measured : ndarray, shape (n, 2, c)
        Position and velocity, INS minus GNSS; NaN where absent.
    is_reset : ndarray of bool, shape (n,)
    drive : Drive
        Of the position.
    weighted, believed : ndarrays, shape (2,)
        Variances of position and velocity: as they are weighted, and as a single one errs.
    patience : ndarray of int, shape (2,)
        Rejections in a row of each kind after which GNSS is taken to be right.
    gate : float
        Squared sigmas.
    start : kalman.Start
    """

    time_s: FloatArray
    measured: FloatArray
    is_reset: BoolArray
    drive: Drive
    weighted: FloatArray
    believed: FloatArray
    patience: Int64Array
    gate: float
    start: kalman.Start

    def run_over_seams(self, steps: Steps) -> GroupRun:
        """Run the filter, and widen outages after which GNSS is beyond the gate yet consistent.

        Each seam is judged by what was known at
        it; the run is made again before the next one is looked for.
        """
        part = self._part(steps, ())
        for back in returns_of(self.time_s, np.asarray(np.isfinite(self.measured).any(axis=(1, 2)))):
            seam = self._seam_at(part, int(back)) if len(part.seams) < MOST_SEAMS else None
            if seam is not None:
                seams = (*part.seams, seam)
                part = self._part(steps.widened(seams), seams)
        return part

    def _part(self, steps: Steps, seams: tuple[Seam, ...]) -> GroupRun:
        odd = np.zeros(len(self.time_s), dtype=bool)
        for seam in seams:
            odd[seam.first : seam.back] = True
        run = self._run(steps, np.where(odd[:, None, None], np.nan, self.measured))
        is_rejected = odd[:, None] & np.isfinite(self.measured).all(axis=2)
        return GroupRun(run, np.where(is_rejected, np.int8(REJECTED), run.mark.reshape(-1, 2)), steps, seams)

    def _run(self, steps: Steps, z: FloatArray) -> kalman.FilterRun:
        """Run over the steps: two rows, position and velocity, at every epoch."""
        n, _, channels = z.shape
        both, opened = np.arange(2), np.zeros((1, SIZE))
        opened[0, KINDS] = np.square([RESET_POSITION_M, RESET_VELOCITY_MPS])
        lines = MeasurementRows(np.arange(3), KINDS, np.ones(2), self.weighted, self.believed, both)
        step = steps.index.copy()
        step[:1] = NO_STEP  # the start belongs to the first epoch
        return kalman.run_filter(
            Transition.dense(steps.transitions, steps.noises),
            step,
            kalman.Measurements(np.repeat(np.arange(n), 2), z.reshape(2 * n, channels), np.tile(both, n), lines),
            self.start,
            gate=kalman.InnovationGate(float(np.sqrt(self.gate)), self.patience, is_by_innovation=True),
            jump=np.where(self.is_reset, 0, NO_STEP),
            jumps=opened,
            drive=self.drive,
        )

    def _seam_at(self, part: GroupRun, back: int) -> Seam | None:
        """Return the seam at a return of GNSS, or None.

        None where the gate let it pass, fixes disagree, or no factor explains them.
        """
        fixes = fixes_since(self.time_s, self.measured[:, 0], self.measured[:, 1], back)
        used = np.flatnonzero((part.mark[:back] == USED).any(axis=1))
        if not len(fixes) or not (part.mark[back : fixes[-1] + 1] == REJECTED).any():
            return None
        last = int(used[-1]) if len(used) else 0  # the start of a run that goes on from another one
        if self.is_reset[last + 1 : fixes[-1] + 1].any():
            return None
        states, covariances = part.forecast(self.drive, back - 1, int(fixes[-1]))
        channels, rows = np.eye(self.measured.shape[2]), fixes - back
        predicted = np.array([np.kron(P[np.ix_(KINDS, KINDS)], channels) for P in covariances[rows]])
        found = Fixes(self.time_s[fixes], self.measured[fixes], states[rows][:, KINDS], predicted, self.believed)
        seam = found.seam(self.gate)
        if seam is None:
            return None
        return Seam(last, back, int(fixes[seam[0]]), seam[1], np.array(part.run.P[last]))
