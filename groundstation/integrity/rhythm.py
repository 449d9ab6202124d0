"""Rhythm of a topic: its usual step in time, whether that is a period, and its gaps."""

from dataclasses import dataclass
from fnmatch import fnmatchcase

import numpy as np

from groundstation.base.gaps import Gaps
from groundstation.base.records import Int64Array
from groundstation.base.signals import is_canonical
from groundstation.base.units import NS_PER_S
from groundstation.integrity.clock_steps import quantile
from groundstation.integrity.limits import GapLimits, RhythmLimits, Thresholds

MOST_STEPS = 10_000  # steps from which a typical step is taken
WHOLE = 0.2  # periods that a step may be off a whole number of them
MOST_SKIPPED = 10.0  # periods: a longer step that is no gap explains nothing


@dataclass(frozen=True)
class Rhythm:
    """Steps between the times of a topic.

    Parameters
    ----------
    steps_ns : ndarray of int64
        All steps, none below zero.
    ahead : int
        Number of steps ahead in time.
    period_ns : float
        Usual step; of a topic whose usual step is no period, the mean one.
    has_rate : bool
        The usual step is a period: there is a nominal rate and a coverage.
    has_gaps : bool
        A long step is a gap.
    """

    steps_ns: Int64Array
    ahead: int
    period_ns: float
    has_rate: bool
    has_gaps: bool
    limits: GapLimits

    @property
    def coverage(self) -> float:
        """Share of the samples expected at the usual step that are there, at most 1."""
        expected = int(self.steps_ns.sum()) / self.period_ns + 1.0
        return min(1.0, (self.ahead + 1) / expected)

    @property
    def jitter_s(self) -> float:
        """Root mean square of the steps less the period, without gaps."""
        inside = self.steps_ns[self.steps_ns <= _longest_ns(self.period_ns, self.limits)]
        return float(np.sqrt(np.mean(np.square(inside - self.period_ns)))) / NS_PER_S if len(inside) else 0.0

    def gaps(self, topic: str, time_ns: Int64Array) -> Gaps:
        """Return the steps that are too long, for the times that the steps are of."""
        if not self.has_gaps:
            return Gaps(topic, np.zeros(0, dtype=np.int64), np.zeros(0))
        before = np.flatnonzero(self.steps_ns > _longest_ns(self.period_ns, self.limits))
        return Gaps(topic, time_ns[before], self.steps_ns[before] / NS_PER_S)


def rhythm_of(topic: str, time_ns: Int64Array, thresholds: Thresholds) -> Rhythm:
    """The rhythm of a topic, from its corrected times in order, shape (n,).

    A topic that is written when something happens has none: by its name, by too few or too uneven steps, or by bursts:
    all at one moment (definitions, units, lists) or with pauses between. A topic whose usual step leaves a good part of
    the time without an explanation (records that come in pairs, a wavering timer) has gaps, if it is canonical, by its
    mean step, but no nominal rate.
    """
    limits, steps = thresholds.rhythm, np.diff(time_ns)
    ahead = steps[steps > 0]
    if not len(ahead):
        return Rhythm(steps, 0, 0.0, False, False, thresholds.gaps)
    some = ahead[:: len(ahead) // MOST_STEPS | 1]  # odd: two steps in turn are both met
    usual_ns = quantile(some, 0.5)
    found = Rhythm(steps, len(ahead), usual_ns, True, True, thresholds.gaps)
    if _is_sporadic(topic, found, quantile(some, 0.8), limits):
        return Rhythm(steps, len(ahead), usual_ns, False, False, thresholds.gaps)
    if _is_unexplained(found, limits):
        mean_ns = int(steps.sum()) / len(ahead)
        return Rhythm(steps, len(ahead), mean_ns, False, is_canonical(topic), thresholds.gaps)
    return found


def _longest_ns(period_ns: float, limits: GapLimits) -> float:
    return max(limits.periods * period_ns, limits.min_s * NS_PER_S)


def _is_sporadic(topic: str, rhythm: Rhythm, long_ns: float, limits: RhythmLimits) -> bool:
    """Tell whether a topic is written only when something happens."""
    if any(fnmatchcase(topic, pattern) for pattern in limits.sporadic_topics):
        return True
    if is_canonical(topic):
        return False
    if rhythm.ahead < limits.fewest_steps or long_ns > limits.uneven * rhythm.period_ns:
        return True
    is_gap = rhythm.steps_ns > _longest_ns(rhythm.period_ns, rhythm.limits)
    gaps = int(np.count_nonzero(is_gap))
    if int(rhythm.steps_ns[~is_gap].sum()) < limits.burst_s * NS_PER_S * (gaps + 1):
        return True  # lists and definitions, written at one moment: the step in a burst is no period
    is_thin = rhythm.coverage < limits.burst_coverage
    return is_thin and gaps > 0 and (rhythm.ahead + 1) / (gaps + 1) < limits.burst_rows


def _is_unexplained(rhythm: Rhythm, limits: RhythmLimits) -> bool:
    """Tell whether more is missing than gaps explain: then the usual step is not the period."""
    coverage = rhythm.coverage
    if 1.0 - coverage <= limits.unexplained:
        return False
    ratio = rhythm.steps_ns / rhythm.period_ns
    is_gap = rhythm.steps_ns > _longest_ns(rhythm.period_ns, rhythm.limits)
    skips = (ratio > 1.5) & (ratio < MOST_SKIPPED) & (np.abs(ratio - np.rint(ratio)) < WHOLE)  # missing one by one
    missing = float(ratio.sum()) - rhythm.ahead
    explained = float((ratio[is_gap | skips] - 1.0).sum())
    return missing - explained > limits.unexplained * (rhythm.ahead + missing)
