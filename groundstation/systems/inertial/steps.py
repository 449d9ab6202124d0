"""Transitions and process noise between epochs, and what is added where outages failed."""

from collections.abc import Sequence

import numpy as np

from groundstation.base.dataclasses import dataclass
from groundstation.base.records import Int64Array
from groundstation.methods.ins_noise import InsNoise
from groundstation.methods.kalman.transition import distinct_steps
from groundstation.systems.inertial.model import ChannelModel, FloatArray
from groundstation.systems.inertial.seams import Seam

TIME_RESOLUTION_S = 1e-4  # intervals that agree to this share one transition
MOST_TRANSITIONS = 4096  # distinct intervals kept exactly; jittered clocks are rounded more coarsely beyond


@dataclass(frozen=True)
class Steps:
    """Transitions between epochs: ``index`` (n,) into ``transitions``, ``noises`` (m, 6, 6)."""

    index: Int64Array
    transitions: FloatArray
    noises: FloatArray

    @classmethod
    def between(cls, time_s: FloatArray, model: ChannelModel, noise: InsNoise) -> "Steps":
        """Transition and noise of every interval; intervals equal to 0.1 ms share one."""
        interval = np.diff(time_s, prepend=time_s[:1])
        seconds, index = distinct_steps(interval, TIME_RESOLUTION_S, MOST_TRANSITIONS)
        density = noise.densities()
        return cls(
            index,
            np.stack([model.transition_over(float(part)) for part in seconds]),
            np.stack([model.process_noise_over(float(part), density) for part in seconds]),
        )

    def widened(self, seams: Sequence[Seam]) -> "Steps":
        """Return steps whose covariance in each outage grows to the seam's factor squared.

        It is that factor times the model's covariance. The covariance at the last fix and the noise since are both
        multiplied, so that the correlation between the two sides of the outage, which the smoother goes back over, is
        the model's own.
        """
        index, transitions, noises = np.array(self.index), [self.transitions], [self.noises]
        count = len(self.transitions)
        for seam in seams:
            square = seam.factor**2
            inside = np.arange(seam.last + 1, seam.back + 1)
            distinct, which = np.unique(self.index[inside], return_inverse=True)
            first = self.index[inside[0]]
            phi = self.transitions[first]
            before = (square - 1.0) * phi @ seam.covariance @ phi.T + square * self.noises[first]
            transitions += [self.transitions[distinct], phi[None]]
            noises += [square * self.noises[distinct], 0.5 * (before + before.T)[None]]
            index[inside] = count + which
            index[inside[0]] = count + len(distinct)
            count += len(distinct) + 1
        return Steps(index, np.concatenate(transitions), np.concatenate(noises))
